/* Recorded quantities of effects: forces, powers, and the motion of their ends or joints.
 *
 * With the wrenches F_k, M_k on the ends k, their points p_k with velocities v_k, and their angular velocities w_k
 *
 *     power    P = sum (F_k . v_k + M_k . w_k)            for a joint force f: P = f v
 *     length   |d|, d = p_2 - p_1, n = d / |d|            rate: n . (v_2 - v_1); |v_2 - v_1| if d = 0
 *     tension  F_1 . n, which pulls the first end towards the second; |F_1| if d = 0
 *
 * For a contact with normal n and lowest point l of the sphere, F_1 is the force on the sphere:
 *
 *     normal   F_1 . n                                   friction: |F_1 - (F_1 . n) n|
 *     slip     |s|, s = the velocity of the sphere in l less that of the plane's body at l, in the plane
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "evaluate/evaluate.h"
#include "evaluate/path_force.h"
#include "evaluate/relative_force.h"
#include "model/relative.h"

#include <math.h>
#include <string.h>

/* ---- words ------------------------------------------------------------------------------------------------------- */

const char *kt_quantity_name(kt_effect_quantity quantity, bool sliding) {
#define NAME(id, name, sliding_name, unit, sliding_unit, help) {name, sliding_name},
    static const char *const names[][2] = {KT_QUANTITY_LIST(NAME)};
#undef NAME
    return (unsigned)quantity < KT_QUANTITY_COUNT ? names[quantity][sliding] : "";
}

const char *kt_quantity_unit(kt_effect_quantity quantity, bool sliding) {
#define UNIT(id, name, sliding_name, unit, sliding_unit, help) {unit, sliding_unit},
    static const char *const units[][2] = {KT_QUANTITY_LIST(UNIT)};
#undef UNIT
    return (unsigned)quantity < KT_QUANTITY_COUNT ? units[quantity][sliding] : "";
}

const char *kt_quantity_help(kt_effect_quantity quantity) {
#define HELP(id, name, sliding_name, unit, sliding_unit, help) help,
    static const char *const helps[] = {KT_QUANTITY_LIST(HELP)};
#undef HELP
    return (unsigned)quantity < KT_QUANTITY_COUNT ? helps[quantity] : "";
}

/* ---- the effects of a model -------------------------------------------------------------------------------------- */

int kt_effect_count(const kt_model *model) { return model ? (int)(model->n.effect + model->n.effect_off) : 0; }

const char *kt_effect_name(const kt_model *model, int effect) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    return record && record->name ? model->text + record->name : "";
}

int kt_effect_find(const kt_model *model, const char *name) {
    for (size_t i = 0; model && name && name[0] != '\0' && i < model->n.effect + model->n.effect_off; i++)
        if (model->effect[i].name && strcmp(model->text + model->effect[i].name, name) == 0)
            return model->effect[i].source;
    return -1;
}

kt_effect_type kt_effect_type_of(const kt_model *model, int effect) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    return record ? (kt_effect_type)record->type : KT_EFFECT_TYPE_COUNT;
}

int kt_effect_body(const kt_model *model, int effect, int end) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    return record && end >= 0 && end < (record->ends > 1 ? record->ends : 1) ? record->body[end] : -1;
}

int kt_effect_loop(const kt_model *model, int effect, int *component) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    if (!record || !record->relative.type)
        return -1;
    if (component)
        *component = record->relative.component;
    return record->relative.loop;
}

/* Whether an effect acts in one coordinate, of a joint or of a loop, and not at its ends. */
static bool is_in_coordinate(const kt_effect_record *effect) { return effect->ends == 0 || (effect->relative.type); }

double kt_effect_coordinate(const kt_model *model, const kt_data *data, const double *q, int effect) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    if (KT_IS_OTHER_DATA(NULL, model, data) || !record || !q || !is_in_coordinate(record))
        return (double)NAN;
    if (record->ends == 0)
        return q[model->link[record->link[0]].q];
    kt_effect_end end[2];
    kt_effect_ends_find(data, record, end);
    return kt_relative_motion_of(model, record, q, end).position;
}

static bool has_path(const kt_effect_record *effect) { return effect->path_count > 0; }

/* Returns the quantities of a record. The quantities of formulas and of a caller's own effect depend on the points of
 * action. */
static const kt_effect_quantity *quantities_of(const kt_effect_record *effect, int *count) {
    static const kt_effect_quantity in_joint[] = {KT_QUANTITY_JOINT_FORCE, KT_QUANTITY_POWER, KT_QUANTITY_COORDINATE,
                                                  KT_QUANTITY_COORDINATE_RATE};
    static const kt_effect_quantity at_ends[] = {KT_QUANTITIES_FORCE, KT_QUANTITIES_MOMENT, KT_QUANTITY_POWER,
                                                 KT_QUANTITY_LENGTH, KT_QUANTITY_LENGTH_RATE};
    static const kt_effect_quantity along_line_of_ends[] = {KT_QUANTITY_TENSION, KT_QUANTITY_POWER, KT_QUANTITY_LENGTH,
                                                            KT_QUANTITY_LENGTH_RATE};
    const kt_descriptor *descriptor = kt_effect_descriptor((kt_effect_type)effect->type);
    const bool is_formula = effect->type == KT_EFFECT_EXPRESSION;
    if (descriptor != NULL && !is_formula) {
        *count = descriptor->quantity_count;
        return descriptor->quantities;
    }
    const bool in_coordinate = is_in_coordinate(effect);
    if (is_formula && !in_coordinate && effect->ends == 2) {
        *count = (int)(sizeof along_line_of_ends / sizeof *along_line_of_ends);
        return along_line_of_ends;
    }
    *count = in_coordinate ? (int)(sizeof in_joint / sizeof *in_joint) : 7 + 2 * (effect->ends == 2);
    return in_coordinate ? in_joint : at_ends;
}

int kt_effect_quantity_count(const kt_model *model, int effect) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    int count = 0;
    if (record)
        (void)quantities_of(record, &count);
    return count;
}

kt_effect_quantity kt_effect_quantity_at(const kt_model *model, int effect, int k) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    int count = 0;
    const kt_effect_quantity *quantities = record ? quantities_of(record, &count) : NULL;
    return k >= 0 && k < count ? quantities[k] : KT_QUANTITY_COUNT;
}

bool kt_effect_is_sliding(const kt_model *model, int effect) {
    const kt_effect_record *record = model ? kt_effect_record_find(model, effect) : NULL;
    if (record && record->relative.type)
        return kt_relative_is_length((kt_relative)record->relative.type);
    return record && (!is_in_coordinate(record) || model->link[record->link[0]].motion == KT_MOTION_PRISMATIC);
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* An effect in a state. */
typedef struct reading {
    const kt_effect_record *effect;
    double q, v; /* of its coordinate, or its path's length and rate */
    kt_effect_end end[2];
    kt_effect_load load;
} reading;

static double effect_power_of(const reading *r) {
    double power = r->load.joint_force * r->v;
    for (int k = 0; k < r->effect->ends && !is_in_coordinate(r->effect) && !has_path(r->effect); k++)
        power += kt_vec3_dot(r->load.wrench[k].force, r->end[k].velocity) +
                 kt_vec3_dot(r->load.wrench[k].moment, r->end[k].omega);
    return power;
}

/* The component of a vector of the first or second end along the line of the ends; its length if the ends coincide. */
static double along_line(const reading *r, kt_vec3 vector) {
    const kt_vec3 d = kt_vec3_sub(r->end[1].point, r->end[0].point);
    const double length = kt_vec3_norm(d);
    return length > 0.0 ? kt_vec3_dot(d, vector) / length : kt_vec3_norm(vector);
}

/* How deep a contact is, or how far a stop is exceeded: 0 while the gap is open, in m or rad. */
static double penetration_of(const reading *r) {
#if KT_IS_OF_VALUES
    const kt_effect_kind *kind = kt_effect_kind_of(r->effect->type);
    const bool in_coordinate = is_in_coordinate(r->effect);
    if (in_coordinate && kind->joint_gap != NULL)
        return fmax(-kind->joint_gap(r->effect, r->q, r->v).distance, 0.0);
    if (!in_coordinate && kind->gap != NULL)
        return fmax(-kind->gap(r->effect, r->end).distance, 0.0);
#else
    (void)r;
#endif
    return (double)NAN;
}

/* The normal of a contact: the normal of the plane, or the line of centres of two spheres. */
static kt_vec3 contact_normal_of(const reading *r) {
    const kt_vec3 apart = kt_vec3_sub(r->end[0].point, r->end[1].point);
    const double norm = kt_vec3_norm(apart);
    return r->effect->radius2 > 0.0 && norm > 0.0 ? kt_vec3_scale(1.0 / norm, apart) : r->end[1].axes.z;
}

/* Returns the vector less its component along the normal of a contact. */
static kt_vec3 tangential(const reading *r, kt_vec3 vector) {
    const kt_vec3 n = contact_normal_of(r);
    return kt_vec3_sub(vector, kt_vec3_scale(kt_vec3_dot(n, vector), n));
}

static kt_vec3 lowest_point(const reading *r) {
    return kt_vec3_add(r->end[0].point, kt_contact_lowest(r->effect, r->end[0].axes, contact_normal_of(r)));
}

static kt_vec3 end_velocity_at(const kt_effect_end *end, kt_vec3 point) {
    return kt_vec3_add(end->velocity, kt_vec3_cross(end->omega, kt_vec3_sub(point, end->point)));
}

static kt_vec3 slip_velocity_at(const reading *r, kt_vec3 point) {
    return tangential(r, kt_vec3_sub(end_velocity_at(&r->end[0], point), end_velocity_at(&r->end[1], point)));
}

kt_contact_kinematics kt_contact_kinematics_find(const kt_data *data, const kt_effect_record *effect) {
    reading r = {.effect = effect};
    kt_effect_ends_find(data, effect, r.end);
    const kt_vec3 point = lowest_point(&r);
    return (kt_contact_kinematics){
        .point = point, .normal = contact_normal_of(&r), .slip = slip_velocity_at(&r, point)};
}

/* The value of a quantity in its SI unit. Components of vectors are in world axes. */
static double quantity_value_of(const reading *r, kt_effect_quantity quantity) {
    const bool touches = r->effect->type == KT_EFFECT_CONTACT;
    const kt_wrench *wrench = &r->load.wrench[r->effect->ends == 2 && !touches ? 1 : 0];
    const kt_vec3 l = lowest_point(r);
    switch (quantity) {
    case KT_QUANTITY_JOINT_FORCE:
        return r->load.joint_force;
    case KT_QUANTITY_TENSION:
        return has_path(r->effect) ? -r->load.joint_force : along_line(r, r->load.wrench[0].force);
    case KT_QUANTITY_NORMAL:
        return kt_vec3_dot(r->load.wrench[0].force, contact_normal_of(r));
    case KT_QUANTITY_FRICTION:
        return kt_vec3_norm(tangential(r, r->load.wrench[0].force));
    case KT_QUANTITY_FORCE_X:
    case KT_QUANTITY_FORCE_Y:
    case KT_QUANTITY_FORCE_Z:
        return kt_vec3_part(wrench->force, (int)quantity - KT_QUANTITY_FORCE_X);
    case KT_QUANTITY_MOMENT_X:
    case KT_QUANTITY_MOMENT_Y:
    case KT_QUANTITY_MOMENT_Z:
        return kt_vec3_part(wrench->moment, (int)quantity - KT_QUANTITY_MOMENT_X);
    case KT_QUANTITY_POWER:
        return effect_power_of(r);
    case KT_QUANTITY_COORDINATE:
        return r->q;
    case KT_QUANTITY_COORDINATE_RATE:
        return r->v;
    case KT_QUANTITY_LENGTH:
        return has_path(r->effect) ? r->q : kt_vec3_norm(kt_vec3_sub(r->end[1].point, r->end[0].point));
    case KT_QUANTITY_LENGTH_RATE:
        return has_path(r->effect) ? r->v : along_line(r, kt_vec3_sub(r->end[1].velocity, r->end[0].velocity));
    case KT_QUANTITY_EXCESS:
        return penetration_of(r);
    case KT_QUANTITY_SLIP:
        return kt_vec3_norm(slip_velocity_at(r, l));
    case KT_QUANTITY_POINT_X:
    case KT_QUANTITY_POINT_Y:
    case KT_QUANTITY_POINT_Z:
        return kt_vec3_part(l, (int)quantity - KT_QUANTITY_POINT_X);
    case KT_QUANTITY_COUNT:
        break;
    }
    return (double)NAN;
}

/* Writes the quantities of one effect; returns their number. */
static int evaluate_one(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                        const kt_effect_record *effect, double *values) {
    const kt_link *link = &model->link[effect->link[0]];
    reading r = {.effect = effect};
    if (effect->ends == 0) {
        r.q = q[link->q];
        r.v = v[link->v];
    }
    int count;
    const kt_effect_quantity *quantities = quantities_of(effect, &count);
    const bool fine = kt_effect_load_find(model, data, t, q, v, effect, r.end, &r.load) == 0;
    if (effect->relative.type) {
        const kt_relative_motion motion = kt_relative_motion_of(model, effect, q, r.end);
        r.q = motion.position;
        r.v = motion.rate;
    }
    if (has_path(effect)) {
        kt_path_value path;
        kt_path_value_find(model, data, data->kinematics, effect, &path);
        r.q = path.length;
        r.v = path.rate;
    }
    const bool is_borne = kt_effect_closed_loop(model, effect) >= 0;
    for (int k = 0; k < count; k++) {
        const bool is_force = quantities[k] <= KT_QUANTITY_POWER;
        values[k] = fine && !(is_borne && is_force) ? quantity_value_of(&r, quantities[k]) : (double)NAN;
    }
    return count;
}

kt_status kt_effect_quantities_evaluate(const kt_model *model, const kt_data *data, double t, const double *q,
                                        const double *v, double *values, kt_error *error) {
    const int count = kt_effect_count(model);
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, values || !count))
        return KT_ERROR_ARGUMENT;
    const bool has_ends = model->n.force_link > 0 || model->n.effect_off > 0;
    const kt_status status = kt_effect_state_check(model, data, q, v, has_ends, error);
    for (int i = 0; i < count && status == KT_OK; i++)
        values += evaluate_one(model, data, t, q, v ? v : model->zero, kt_effect_record_find(model, i), values);
    return status;
}
