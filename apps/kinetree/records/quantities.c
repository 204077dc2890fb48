/* The force of a hard contact, a hard stop or sticking friction is the reaction of a loop. The library computes the
 * quantities of effects without reactions, and these effects are 0 there. This file adds the reactions of the loops:
 *
 *     hard stop           force = sum of the multipliers of NAME.lower and NAME.upper
 *     sticking friction   force = multiplier of NAME.stick
 *     hard contact        kt_record_contact
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/gravity.h"

#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/model.h"
#include "kinetree/simulation.h"

#include <math.h>

/* Returns the number of loops of an effect. These loops follow the loops of the description, in the order of the
 * effects. */
static int effect_loops_of(const kt_effect *effect) {
    const bool is_hard = !isinf(effect->restitution);
    switch (effect->type) {
    case KT_EFFECT_CONTACT:
        return is_hard ? 1 + (int)(effect->friction > 0.0) : 0;
    case KT_EFFECT_JOINT_LIMIT:
        return is_hard ? (int)isfinite(effect->lower) + (int)isfinite(effect->upper) : 0;
    case KT_EFFECT_JOINT_FRICTION:
        return (int)effect->stick;
    default:
        return 0;
    }
}

bool kt_quantities_need_reactions(const kt_description *description) {
    for (int i = 0; i < description->effect_count; i++)
        if (effect_loops_of(&description->effects[i]) > 0)
            return true;
    return false;
}

static bool loop_is_closed(const kt_record *record, int loop) { return kt_loop_rows_of(record->model, loop).count > 0; }

/* ---- in a joint -------------------------------------------------------------------------------------------------- */

static double joint_force_of(const kt_record *record, int first, int count) {
    double force = 0.0;
    for (int loop = first; loop < first + count; loop++)
        if (loop_is_closed(record, loop))
            force += record->multipliers[kt_loop_rows_of(record->model, loop).first];
    return force;
}

static double quantity_of(const kt_record *record, int index, kt_effect_quantity quantity, const double *values) {
    for (int k = 0; k < kt_effect_quantity_count(record->model, index); k++)
        if (kt_effect_quantity_at(record->model, index, k) == quantity)
            return values[k];
    return (double)NAN;
}

/* Sets the force in a joint and its power if a loop bears it. */
static void set_joint_force(const kt_record *record, int index, int first, int count, double *values) {
    bool closed = false;
    for (int loop = first; loop < first + count; loop++)
        closed = closed || loop_is_closed(record, loop);
    const double force = closed ? joint_force_of(record, first, count) : 0.0;
    for (int k = 0; closed && k < kt_effect_quantity_count(record->model, index); k++)
        if (kt_effect_quantity_at(record->model, index, k) == KT_QUANTITY_JOINT_FORCE)
            values[k] = force;
        else if (kt_effect_quantity_at(record->model, index, k) == KT_QUANTITY_POWER)
            values[k] = force * quantity_of(record, index, KT_QUANTITY_COORDINATE_RATE, values);
}

/* ---- of a contact ------------------------------------------------------------------------------------------------ */

typedef struct contact_force {
    kt_vec3 force; /* on the sphere */
    double normal, friction, power;
} contact_force;

/* A constraint at rest has no power, and friction of slow slip that of slip alone. */
static contact_force contact_force_of(const kt_record *record, int index) {
    contact_force f = {.force = {0.0, 0.0, 0.0}};
    kt_contact_load load;
    if (kt_record_contact(record, index, &load, NULL) != KT_OK || !load.touches)
        return f;
    f.force = load.force;
    f.normal = kt_vec3_dot(load.force, load.normal);
    const kt_vec3 across = kt_vec3_sub(load.force, kt_vec3_scale(f.normal, load.normal));
    f.friction = kt_vec3_norm(across);
    f.power = load.sticks ? 0.0 : kt_vec3_dot(across, load.slip);
    return f;
}

static void set_contact_quantities(const kt_record *record, int index, double *values) {
    const contact_force f = contact_force_of(record, index);
    for (int k = 0; k < kt_effect_quantity_count(record->model, index); k++)
        switch (kt_effect_quantity_at(record->model, index, k)) {
        case KT_QUANTITY_NORMAL:
            values[k] = f.normal;
            break;
        case KT_QUANTITY_FRICTION:
            values[k] = f.friction;
            break;
        case KT_QUANTITY_FORCE_X:
            values[k] = f.force.x;
            break;
        case KT_QUANTITY_FORCE_Y:
            values[k] = f.force.y;
            break;
        case KT_QUANTITY_FORCE_Z:
            values[k] = f.force.z;
            break;
        case KT_QUANTITY_POWER:
            values[k] = f.power;
            break;
        default:
            break;
        }
}

/* ---- of all ------------------------------------------------------------------------------------------------------ */

static void clear_quantities(const kt_model *model, double *values) {
    for (int i = 0; i < kt_effect_count(model); i++)
        for (int k = 0; k < kt_effect_quantity_count(model, i); k++)
            *values++ = (double)NAN;
}

void kt_quantities_evaluate(const kt_description *description, const kt_record *record, double *values) {
    if (kt_effect_quantities_evaluate(record->model, record->data, record->t, record->q, record->v, values, NULL) !=
        KT_OK) {
        clear_quantities(record->model, values);
        return;
    }
    int loop = description->loop_count;
    for (int i = 0; i < description->effect_count; i++) {
        const kt_effect *effect = &description->effects[i];
        const int count = effect_loops_of(effect);
        if (count > 0 && effect->type == KT_EFFECT_CONTACT)
            set_contact_quantities(record, i, values);
        else if (count > 0)
            set_joint_force(record, i, loop, count, values);
        loop += count;
        values += kt_effect_quantity_count(record->model, i);
    }
}
