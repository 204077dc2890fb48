/* The values of columns in a record. Some columns in a row are components of one vector, which is computed once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/columns.h"

#include "records/gravity.h"

#include "kinetree/descriptor.h"
#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <math.h>

static double coordinate(const double *x, int index) { return x != NULL ? x[index] : (double)NAN; }

/* The common values of a group of successive columns, computed at the first column. */
typedef struct kt_column_group {
    double value[KT_JOINT_NQ_MAX];
} kt_column_group;

static kt_column_group vector_group(kt_vec3 u) { return (kt_column_group){{u.x, u.y, u.z}}; }

/* Returns a vector of a body in world axes, then in body axes. */
static kt_column_group rotation_group(const kt_model *model, const kt_data *data, int body, kt_vec3 u) {
    const kt_vec3 w = kt_mat3_apply_transposed(kt_body_pose(model, data, body).rotation, u);
    return (kt_column_group){{u.x, u.y, u.z, w.x, w.y, w.z}};
}

static kt_column_group wrench_group(kt_wrench p) {
    return (kt_column_group){{p.force.x, p.force.y, p.force.z, p.moment.x, p.moment.y, p.moment.z}};
}

/* Returns one of the wrenches of a record; NaN if the record has none. */
static kt_column_group recorded_wrench(const kt_wrench *wrenches, int index) {
    const kt_vec3 unknown = kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    return wrench_group(wrenches != NULL ? wrenches[index] : (kt_wrench){unknown, unknown});
}

static kt_column_group bearing_group(const kt_columns *columns, const kt_column *c, const kt_record *record) {
    if (record->reactions == NULL)
        return recorded_wrench(NULL, 0);
    return wrench_group(
        kt_bearing_of(record->model, record->data, c->index, record->reactions[c->index], columns->jacobian));
}

bool kt_column_has_arc(const kt_model *model, int loop) {
    return kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(model, loop)), KT_KEY_TRACK) != NULL;
}

static kt_column_group closure_group(const kt_model *model, const kt_data *data, int loop) {
    kt_loop_motion m = {.rotation = kt_mat3_identity()};
    (void)kt_loop_motion_evaluate(model, data, loop, &m); /* loops of columns have ends */
    const kt_vec3 turn = kt_euler_vector_from_mat3(m.rotation);
    const double arc = kt_column_has_arc(model, loop) ? kt_loop_arc_length(model, data, loop) : 0.0;
    return (kt_column_group){{m.position.x, m.position.y, m.position.z, turn.x, turn.y, turn.z, arc}};
}

/* Returns the coordinates of a joint that closes a loop. */
static kt_column_group loop_coordinate_group(const kt_column *c, const kt_record *record) {
    kt_column_group position = {{0.0}}, velocity = {{0.0}};
    if (!kt_loop_coordinates_evaluate(record->model, record->data, c->index, record->q, position.value, velocity.value))
        position.value[0] = velocity.value[0] = (double)NAN;
    return c->source == KT_COLUMN_LOOP_POSITION ? position : velocity;
}

/* Returns whether source_group_of computes the values of a source. */
static bool is_grouped(kt_column_source source) {
    return (source >= KT_COLUMN_MARKER && source <= KT_COLUMN_BEARING) ||
           (source >= KT_COLUMN_LOOP_POSITION && source <= KT_COLUMN_CLOSURE);
}

static kt_column_group source_group_of(const kt_columns *columns, const kt_column *c, const kt_record *record) {
    const kt_model *model = record->model;
    const bool is_marker = c->source >= KT_COLUMN_MARKER && c->source <= KT_COLUMN_MARKER_ACCELERATION;
    const kt_vec3 at = is_marker ? kt_marker_at(model, c->index, c->marker) : kt_vec3_make(0.0, 0.0, 0.0);
    switch (c->source) {
    case KT_COLUMN_MARKER:
        return vector_group(kt_point_position(model, record->data, c->index, at));
    case KT_COLUMN_MARKER_VELOCITY:
        return vector_group(kt_point_velocity(model, record->data, c->index, at));
    case KT_COLUMN_MARKER_ACCELERATION:
        return vector_group(kt_point_acceleration(model, record->data, c->index, at));
    case KT_COLUMN_ORIENTATION: {
        const kt_quat p = kt_quat_from_mat3(kt_body_pose(model, record->data, c->index).rotation);
        return (kt_column_group){{p.w, p.x, p.y, p.z}};
    }
    case KT_COLUMN_ANGULAR_VELOCITY:
        return rotation_group(model, record->data, c->index, kt_body_twist(model, record->data, c->index).angular);
    case KT_COLUMN_ANGULAR_ACCELERATION:
        return rotation_group(model, record->data, c->index,
                              kt_body_acceleration(model, record->data, c->index).angular);
    case KT_COLUMN_MOMENTUM:
        return wrench_group(kt_momentum(model, record->data));
    case KT_COLUMN_ENERGY:
        return (kt_column_group){{record->kinetic, record->potential, record->kinetic + record->potential}};
    case KT_COLUMN_WORK:
        return (kt_column_group){{record->work.dissipated, record->work.supplied, kt_balance_of(record)}};
    case KT_COLUMN_RESIDUAL:
        return (kt_column_group){{record->constraint.position, record->constraint.velocity}};
    case KT_COLUMN_REACTION:
        return recorded_wrench(record->reactions, c->index);
    case KT_COLUMN_LOOP_REACTION:
        return recorded_wrench(record->loop_reactions, c->index);
    case KT_COLUMN_BEARING:
        return bearing_group(columns, c, record);
    case KT_COLUMN_SINGULAR_VALUE:
        return (kt_column_group){{kt_singular_evaluate(columns->singular, model, record->t, record->q, record->v)}};
    case KT_COLUMN_LOOP_POSITION:
    case KT_COLUMN_LOOP_VELOCITY:
        return loop_coordinate_group(c, record);
    case KT_COLUMN_CLOSURE:
        return closure_group(model, record->data, c->index);
    default:
        return (kt_column_group){{0.0}};
    }
}

/* Returns the multiplier of a column; 0 while the loop is off. The index of an equation depends on the loops that are
 * on. */
static double column_multiplier_of(const kt_column *c, const kt_record *record) {
    const kt_loop_rows rows = kt_loop_rows_of(record->model, c->index);
    return c->component < rows.count ? coordinate(record->multipliers, rows.first + c->component) : 0.0;
}

/* The arrays of a record's columns that are computed together. */
typedef struct kt_column_arrays {
    const double *quantities, *gravity;
} kt_column_arrays;

static double column_value_of(const kt_column *c, const kt_record *record, const kt_column_group *group,
                              const kt_column_arrays *arrays) {
    if (is_grouped(c->source))
        return group->value[c->component];
    switch (c->source) {
    case KT_COLUMN_TIME:
        return record->t;
    case KT_COLUMN_POSITION:
        return coordinate(record->q, c->at);
    case KT_COLUMN_VELOCITY:
        return coordinate(record->v, c->at);
    case KT_COLUMN_ACCELERATION:
        return coordinate(record->a, c->at);
    case KT_COLUMN_GRAVITY:
        return coordinate(arrays->gravity, c->at);
    case KT_COLUMN_MULTIPLIER:
        return column_multiplier_of(c, record);
    case KT_COLUMN_STATE:
        return coordinate(record->x, c->at);
    case KT_COLUMN_EFFECT:
        return arrays->quantities[c->at];
    default: /* own columns are computed together */
        return (double)NAN;
    }
}

static bool uses(const kt_columns *columns, kt_column_source source) {
    for (size_t i = 0; columns->is_used != NULL && i < columns->count; i++)
        if (columns->is_used[i] && columns->columns[i].source == source)
            return true;
    return columns->is_used == NULL;
}

void kt_columns_fill(kt_columns *columns, const kt_record *record) {
    kt_column_group group = {{0.0}};
    kt_column_arrays arrays = {.quantities = columns->quantities};
    if (columns->quantities != NULL && uses(columns, KT_COLUMN_EFFECT))
        kt_quantities_evaluate(columns->description, record, columns->quantities);
    if (columns->gravity != NULL && uses(columns, KT_COLUMN_GRAVITY))
        arrays.gravity = kt_gravity_evaluate(columns->gravity, record->model, record->t, record->q);
    for (size_t i = 0; i < columns->count; i++) {
        const kt_column *c = &columns->columns[i];
        if (columns->is_used != NULL && !columns->is_used[i])
            continue;
        if (c->component == 0 && is_grouped(c->source))
            group = source_group_of(columns, c, record);
        columns->values[i] = column_value_of(c, record, &group, &arrays);
    }
}
