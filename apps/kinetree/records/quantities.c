/* The force of a hard contact, a hard stop or sticking friction is the reaction of a loop. The library computes the
 * quantities of effects without reactions, and these effects are 0 there. This file adds the reactions of the loops:
 *
 *     hard stop           force = sum of the multipliers of NAME.lower and NAME.upper
 *     sticking friction   force = multiplier of NAME.stick
 *     hard contact        F = N n + T      N n: reaction of NAME      T: reaction of NAME.stick, or -mu N s / |s|
 *
 * with the slip velocity s at the lowest point of the sphere. The power of a contact that slips is -mu N |s|. A
 * constraint at rest has no power. With time stepping, T is the reaction of NAME.stick also during slip, and the power
 * is T . s.
 */
#include "records/gravity.h"

#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <math.h>
#include <stdio.h>

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

/* Returns the force of a loop on the sphere. The sphere is the second end of a plane's loop, and the first end of a
 * rolling loop. */
static kt_vec3 force_on_sphere(const kt_record *record, int loop) {
    const double sign = kt_loop_type_of(record->model, loop) == KT_LOOP_ROLLING ? -1.0 : 1.0;
    return kt_vec3_scale(sign, record->loop_reactions[loop].force);
}

/* Returns the present coefficient of friction. Events can set the parameters of effects that have a name. */
static double coefficient_of(const kt_record *record, const kt_effect *effect) {
    char name[512];
    kt_parameter parameter;
    double values[KT_PARAMETER_MAX];
    (void)snprintf(name, sizeof name, "effect %s.friction", effect->name != NULL ? effect->name : "");
    const bool is_found = effect->name != NULL && kt_parameter_find(record->model, name, &parameter, NULL) == KT_OK &&
                          kt_parameter_get(record->model, &parameter, values, NULL) == KT_OK;
    return is_found ? values[0] : effect->friction;
}

static kt_vec3 body_velocity_at(const kt_record *record, int body, kt_vec3 point) {
    const kt_pose pose = kt_body_pose(record->model, record->data, body);
    const kt_vec3 at = kt_mat3_apply_transposed(pose.rotation, kt_vec3_sub(point, pose.position));
    return kt_point_velocity(record->model, record->data, body, at);
}

/* Returns the velocity of the sphere's slip. */
static kt_vec3 velocity_of_slip(const kt_record *record, int index, kt_vec3 normal, const double *values) {
    const kt_vec3 point = {quantity_of(record, index, KT_QUANTITY_POINT_X, values),
                           quantity_of(record, index, KT_QUANTITY_POINT_Y, values),
                           quantity_of(record, index, KT_QUANTITY_POINT_Z, values)};
    const kt_vec3 speed = kt_vec3_sub(body_velocity_at(record, kt_effect_body(record->model, index, 0), point),
                                      body_velocity_at(record, kt_effect_body(record->model, index, 1), point));
    return kt_vec3_sub(speed, kt_vec3_scale(kt_vec3_dot(normal, speed), normal));
}

/* Returns the unit vector of a slip. It is NaN if slip is so slow that friction opposes the slip of a later instant
 * (lib/mechanics/evaluate/slip_prediction.c). */
static kt_vec3 direction_of_slip(const kt_record *record, kt_vec3 slip) {
    const double norm = kt_vec3_norm(slip);
    return kt_vec3_scale(norm < record->slow_slip ? (double)NAN : 1.0 / norm, slip);
}

static contact_force contact_force_of(const kt_record *record, const kt_effect *effect, int index, int loop,
                                      const double *values) {
    contact_force f = {.force = {0.0, 0.0, 0.0}};
    if (!loop_is_closed(record, loop))
        return f;
    f.force = force_on_sphere(record, loop);
    f.normal = kt_vec3_norm(f.force);
    if (!(effect->friction > 0.0) || f.normal == 0.0)
        return f;
    const kt_vec3 slip = velocity_of_slip(record, index, kt_vec3_scale(1.0 / f.normal, f.force), values);
    if (loop_is_closed(record, loop + 1)) {
        const kt_vec3 held = force_on_sphere(record, loop + 1);
        f.friction = kt_vec3_norm(held);
        f.force = kt_vec3_add(f.force, held);
        f.power = kt_vec3_norm(slip) < record->slow_slip ? 0.0 : kt_vec3_dot(held, slip);
        return f;
    }
    f.friction = coefficient_of(record, effect) * f.normal;
    f.power = 0.0 - f.friction * quantity_of(record, index, KT_QUANTITY_SLIP, values);
    f.force = kt_vec3_sub(f.force, kt_vec3_scale(f.friction, direction_of_slip(record, slip)));
    return f;
}

static void set_contact_quantities(const kt_record *record, const kt_effect *effect, int index, int loop,
                                   double *values) {
    const contact_force f = contact_force_of(record, effect, index, loop, values);
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
    if (kt_effect_quantities_evaluate(record->model, record->data, record->time, record->q, record->v, values, NULL) !=
        KT_OK) {
        clear_quantities(record->model, values);
        return;
    }
    int loop = description->loop_count;
    for (int i = 0; i < description->effect_count; i++) {
        const kt_effect *effect = &description->effects[i];
        const int count = effect_loops_of(effect);
        if (count > 0 && effect->type == KT_EFFECT_CONTACT)
            set_contact_quantities(record, effect, i, loop, values);
        else if (count > 0)
            set_joint_force(record, i, loop, count, values);
        loop += count;
        values += kt_effect_quantity_count(record->model, i);
    }
}
