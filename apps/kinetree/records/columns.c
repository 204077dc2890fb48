/* The columns of a run's records. */
#include "records/columns.h"

#include "kinetree/descriptor.h"
#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the list ---------------------------------------------------------------------------------------------------- */

/* at: of the first of them. */
static bool add(kt_columns *columns, kt_column_source source, int index, int count, int at) {
    if (columns->room - columns->count < (size_t)count) {
        const size_t room = 2 * columns->room + (size_t)count + 32;
        kt_column *more = realloc(columns->columns, room * sizeof *more);
        if (more == NULL)
            return false;
        columns->columns = more;
        columns->room = room;
    }
    for (int k = 0; k < count; k++)
        columns->columns[columns->count++] =
            (kt_column){.source = source, .index = index, .component = k, .at = at + k};
    return true;
}

static bool add_coordinates(kt_columns *columns, kt_column_source source) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++) {
        const kt_coordinates at = kt_body_coordinates(columns->model, body);
        fine = source == KT_COLUMN_POSITION ? add(columns, source, body, at.nq, at.q)
                                            : add(columns, source, body, at.nv, at.v);
    }
    return fine;
}

/* A coupling of joints has joint forces only and therefore no wrench. */
static bool has_wrench(const kt_model *model, int loop) {
    return !kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(model, loop)), KT_KEY_TERMS);
}

/* A loop between joints, not between points of bodies, has one equation, whose multiplier is its generalised force. */
static bool is_relation(const kt_model *model, int loop) {
    return !has_wrench(model, loop) ||
           kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(model, loop)), KT_KEY_JOINT);
}

static bool add_multipliers(kt_columns *columns, int loop) {
    const kt_loop_rows rows = kt_loop_rows_of(columns->model, loop);
    return add(columns, KT_COLUMN_MULTIPLIER, loop, rows.count, rows.first);
}

static bool add_reactions(kt_columns *columns) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++)
        fine = add(columns, KT_COLUMN_REACTION, body, 6, 0);
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++) {
        fine = !has_wrench(columns->model, loop) || add(columns, KT_COLUMN_LOOP_REACTION, loop, 6, 0);
        fine = fine && (!is_relation(columns->model, loop) || add_multipliers(columns, loop));
    }
    return fine;
}

/* The multipliers that add_reactions leaves out. */
static bool add_all_multipliers(kt_columns *columns, bool has_reactions) {
    bool fine = true;
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++)
        fine = (has_reactions && is_relation(columns->model, loop)) || add_multipliers(columns, loop);
    return fine;
}

static bool add_marker(kt_columns *columns, const kt_marker_pair *pair, kt_column_source source) {
    const int body = pair->body != NULL ? kt_body_find(columns->model, pair->body) : 0;
    if (!add(columns, source, body, 3, 0))
        return false;
    for (size_t i = columns->count - 3; i < columns->count; i++)
        columns->columns[i].marker = kt_marker_find(columns->model, body, pair->marker);
    return true;
}

/* What is recorded of markers, marker by marker. */
static bool add_markers(kt_columns *columns, const kt_run *run, unsigned record) {
    bool fine = true;
    for (int i = 0; i < run->marker_count && fine; i++) {
        fine = add_marker(columns, &run->markers[i], KT_COLUMN_MARKER);
        if (fine && (record & KT_RECORD_MARKER_VELOCITY) != 0)
            fine = add_marker(columns, &run->markers[i], KT_COLUMN_MARKER_VELOCITY);
        if (fine && (record & KT_RECORD_MARKER_ACCELERATION) != 0)
            fine = add_marker(columns, &run->markers[i], KT_COLUMN_MARKER_ACCELERATION);
    }
    return fine;
}

static bool add_orientations(kt_columns *columns) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++)
        fine = add(columns, KT_COLUMN_ORIENTATION, body, 4, 0);
    return fine;
}

static bool is_curve(const kt_model *model, int loop) {
    return kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(model, loop)), KT_KEY_TRACK) != NULL;
}

/* Relations of joints have no ends, and no columns. */
static bool add_closures(kt_columns *columns) {
    bool fine = true;
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++)
        if (!is_relation(columns->model, loop))
            fine = add(columns, KT_COLUMN_CLOSURE, loop, is_curve(columns->model, loop) ? 7 : 6, 0);
    return fine;
}

/* And the room for what they quantity. */
static bool add_effects(kt_columns *columns) {
    bool fine = true;
    int at = 0;
    for (int effect = 0; effect < kt_effect_count(columns->model) && fine; effect++) {
        const int count = kt_effect_quantity_count(columns->model, effect);
        fine = add(columns, KT_COLUMN_EFFECT, effect, count, at);
        at += count;
    }
    columns->quantities = fine ? malloc(((size_t)at + 1) * sizeof *columns->quantities) : NULL;
    return columns->quantities != NULL;
}

static bool add_states(kt_columns *columns) {
    bool fine = true;
    for (int state = 0; state < kt_own_state_count(columns->model) && fine; state++)
        fine = add(columns, KT_COLUMN_STATE, state, 1, state);
    return fine;
}

bool kt_columns_list(kt_columns *columns, const kt_model *model, const kt_run *run, unsigned record) {
    /* With all that is switched on, so that everything has its columns; what is off is 0 in them. */
    const kt_model *all = kt_model_switched(model, ((uint64_t)1 << kt_switch_count(model)) - 1);
    *columns = (kt_columns){.model = all, .record = record};
    bool fine = add(columns, KT_COLUMN_TIME, 0, 1, 0);
    if (fine && (record & KT_RECORD_POSITION) != 0)
        fine = add_coordinates(columns, KT_COLUMN_POSITION);
    if (fine && (record & KT_RECORD_VELOCITY) != 0)
        fine = add_coordinates(columns, KT_COLUMN_VELOCITY);
    if (fine && (record & KT_RECORD_ACCELERATION) != 0)
        fine = add_coordinates(columns, KT_COLUMN_ACCELERATION);
    if (fine && (record & KT_RECORD_STATE) != 0)
        fine = add_states(columns);
    fine = fine && add_markers(columns, run, record);
    if (fine && (record & KT_RECORD_ORIENTATION) != 0)
        fine = add_orientations(columns);
    if (fine && (record & KT_RECORD_MOMENTUM) != 0)
        fine = add(columns, KT_COLUMN_MOMENTUM, 0, 6, 0);
    if (fine && (record & KT_RECORD_ENERGY) != 0)
        fine = add(columns, KT_COLUMN_ENERGY, 0, 3, 0);
    if (fine && (record & KT_RECORD_BALANCE) != 0)
        fine = add(columns, KT_COLUMN_WORK, 0, 3, 0);
    if (fine && (record & KT_RECORD_CONSTRAINT) != 0)
        fine = add(columns, KT_COLUMN_RESIDUAL, 0, 2, 0);
    if (fine && (record & KT_RECORD_REACTION) != 0)
        fine = add_reactions(columns);
    if (fine && (record & KT_RECORD_MULTIPLIER) != 0)
        fine = add_all_multipliers(columns, (record & KT_RECORD_REACTION) != 0);
    if (fine && (record & KT_RECORD_CLOSURE) != 0)
        fine = add_closures(columns);
    if (fine && (record & KT_RECORD_EFFECT) != 0)
        fine = add_effects(columns);
    columns->values = fine ? malloc(columns->count * sizeof *columns->values) : NULL;
    return columns->values != NULL;
}

kt_status kt_columns_add_own(kt_columns *columns, const kt_scene *scene, unsigned *record, kt_error *error) {
    *record = 0;
    if (scene->column_count == 0)
        return KT_OK;
    const kt_status status = kt_own_columns_create(scene, columns->model, &columns->own, record, error);
    if (status != KT_OK)
        return status;
    bool fine = true;
    for (int k = 0; k < scene->column_count && fine; k++)
        fine = add(columns, KT_COLUMN_OWN, k, 1, k);
    double *values = fine ? realloc(columns->values, columns->count * sizeof *values) : NULL;
    if (values == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
    columns->values = values;
    return KT_OK;
}

void kt_columns_free(kt_columns *columns) {
    kt_own_columns_free(columns->own);
    free(columns->columns);
    free(columns->values);
    free(columns->quantities);
    *columns = (kt_columns){.count = 0};
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* "KIND.NAME", or "KIND.NAME[k]" if there is more than one of them. */
static int name_numbered(char *text, size_t size, const char *kind, const char *name, const char *of, int k,
                         int count) {
    return count == 1 ? snprintf(text, size, "%s.%s%s", kind, name, of)
                      : snprintf(text, size, "%s.%s%s[%d]", kind, name, of, k);
}

/* "effect.tyre.force"; "effect[2].force" of one without a name. */
static int name_quantity(const kt_columns *columns, const kt_column *c, char *text, size_t size) {
    const char *name = kt_effect_name(columns->model, c->index);
    const char *quantity = kt_quantity_name(kt_effect_quantity_at(columns->model, c->index, c->component),
                                            kt_effect_is_sliding(columns->model, c->index));
    return name[0] != '\0' ? snprintf(text, size, "effect.%s.%s", name, quantity)
                           : snprintf(text, size, "effect[%d].%s", c->index, quantity);
}

int kt_column_name(const kt_columns *columns, size_t column, char *text, size_t size) {
    static const char *const kinds[] = {"position", "velocity", "acceleration"};
    static const char *const energies[] = {"kinetic", "potential", "total"};
    static const char *const works[] = {"dissipated", "supplied", "balance"};
    static const char *const orders[] = {"", "v", "a"};
    static const char *const momenta[] = {"px", "py", "pz", "lx", "ly", "lz"};
    static const char *const wrench[] = {"fx", "fy", "fz", "mx", "my", "mz"};
    static const char *const closure[] = {"x", "y", "z", "rx", "ry", "rz", "arc"};
    const kt_column *c = &columns->columns[column];
    const kt_model *model = columns->model;
    switch (c->source) {
    case KT_COLUMN_TIME:
        return snprintf(text, size, "time");
    case KT_COLUMN_POSITION:
    case KT_COLUMN_VELOCITY:
    case KT_COLUMN_ACCELERATION: {
        const kt_coordinates at = kt_body_coordinates(model, c->index);
        return name_numbered(text, size, kinds[c->source - KT_COLUMN_POSITION], kt_joint_name(model, c->index), "",
                             c->component, c->source == KT_COLUMN_POSITION ? at.nq : at.nv);
    }
    case KT_COLUMN_MARKER:
    case KT_COLUMN_MARKER_VELOCITY:
    case KT_COLUMN_MARKER_ACCELERATION:
        return snprintf(text, size, "marker.%s.%s.%s%c", kt_body_name(model, c->index),
                        kt_marker_name(model, c->index, c->marker), orders[c->source - KT_COLUMN_MARKER],
                        "xyz"[c->component]);
    case KT_COLUMN_ORIENTATION:
        return snprintf(text, size, "orientation.%s.%c", kt_body_name(model, c->index), "wxyz"[c->component]);
    case KT_COLUMN_MOMENTUM:
        return snprintf(text, size, "momentum.%s", momenta[c->component]);
    case KT_COLUMN_ENERGY:
        return snprintf(text, size, "energy.%s", energies[c->component]);
    case KT_COLUMN_WORK:
        return snprintf(text, size, "energy.%s", works[c->component]);
    case KT_COLUMN_RESIDUAL:
        return snprintf(text, size, "constraint.%s", kinds[c->component]);
    case KT_COLUMN_REACTION:
        return snprintf(text, size, "reaction.%s.%s", kt_joint_name(model, c->index), wrench[c->component]);
    case KT_COLUMN_LOOP_REACTION:
        return snprintf(text, size, "reaction.%s.%s", kt_loop_name(model, c->index), wrench[c->component]);
    case KT_COLUMN_MULTIPLIER:
        return name_numbered(text, size, "reaction", kt_loop_name(model, c->index), ".multiplier", c->component,
                             kt_loop_rows_of(model, c->index).count);
    case KT_COLUMN_CLOSURE:
        return snprintf(text, size, "closure.%s.%s", kt_loop_name(model, c->index), closure[c->component]);
    case KT_COLUMN_OWN:
        return snprintf(text, size, "%s", kt_own_column_name(columns->own, c->index));
    case KT_COLUMN_STATE:
        return snprintf(text, size, "state.%s", kt_own_state_name(model, c->index));
    case KT_COLUMN_EFFECT:
        return name_quantity(columns, c, text, size);
    }
    return 0;
}

static const char *unit_of_quantity(const kt_columns *columns, const kt_column *c) {
    return kt_quantity_unit(kt_effect_quantity_at(columns->model, c->index, c->component),
                            kt_effect_is_sliding(columns->model, c->index));
}

int kt_column_header(const kt_columns *columns, size_t column, char *text, size_t size) {
    const kt_column *c = &columns->columns[column];
    const int length = kt_column_name(columns, column, text, size);
    if (c->source != KT_COLUMN_EFFECT)
        return length;
    const char *unit = unit_of_quantity(columns, c);
    const size_t used = (size_t)length < size ? (size_t)length : size;
    return length + snprintf(text != NULL ? text + used : NULL, size - used, " [%s]", unit);
}

static kt_quantity coordinate_quantity(const kt_columns *columns, const kt_column *c) {
    static const kt_quantity angles[] = {
        {"Angles", "rad"}, {"Angular velocities", "rad/s"}, {"Angular accelerations", "rad/s\u00b2"}};
    static const kt_quantity lengths[] = {{"Lengths", "m"}, {"Velocities", "m/s"}, {"Accelerations", "m/s\u00b2"}};
    const int order = (int)c->source - KT_COLUMN_POSITION;
    switch (kt_joint_coordinate_kind(kt_body_coordinates(columns->model, c->index).type, c->component)) {
    case KT_COORDINATE_LENGTH:
    case KT_COORDINATE_TRANSLATION:
        return lengths[order];
    case KT_COORDINATE_ROTATION:
        return order == 0 ? (kt_quantity){"Quaternions", ""} : angles[order];
    case KT_COORDINATE_ANGLE:
    case KT_COORDINATE_TURNS:
    case KT_COORDINATE_NONE:
        break;
    }
    return angles[order];
}

static kt_quantity quantity_of_effect(const kt_columns *columns, const kt_column *c) {
    static const struct {
        const char *unit;
        kt_quantity quantity;
    } of[] = {{"N", {"Forces of effects", "N"}},
              {"N m", {"Torques of effects", "N m"}},
              {"W", {"Powers of effects", "W"}},
              {"m", {"Lengths of effects", "m"}},
              {"m/s", {"Rates of effects", "m/s"}},
              {"rad", {"Angles of effects", "rad"}},
              {"rad/s", {"Angular rates of effects", "rad/s"}}};
    const char *unit = unit_of_quantity(columns, c);
    for (size_t i = 0; i < sizeof of / sizeof *of; i++)
        if (strcmp(of[i].unit, unit) == 0)
            return of[i].quantity;
    return (kt_quantity){"Effects", ""};
}

kt_quantity kt_column_quantity(const kt_columns *columns, size_t column) {
    const kt_column *c = &columns->columns[column];
    switch (c->source) {
    case KT_COLUMN_TIME:
        return (kt_quantity){"Time", "s"};
    case KT_COLUMN_POSITION:
    case KT_COLUMN_VELOCITY:
    case KT_COLUMN_ACCELERATION:
        return coordinate_quantity(columns, c);
    case KT_COLUMN_MARKER:
        return (kt_quantity){"Markers", "m"};
    case KT_COLUMN_MARKER_VELOCITY:
        return (kt_quantity){"Velocities of markers", "m/s"};
    case KT_COLUMN_MARKER_ACCELERATION:
        return (kt_quantity){"Accelerations of markers", "m/s\u00b2"};
    case KT_COLUMN_ORIENTATION:
        return (kt_quantity){"Orientations", ""};
    case KT_COLUMN_MOMENTUM:
        return c->component < 3 ? (kt_quantity){"Momentum", "kg m/s"}
                                : (kt_quantity){"Angular momentum", "kg m\u00b2/s"};
    case KT_COLUMN_ENERGY:
    case KT_COLUMN_WORK:
        return (kt_quantity){"Energies", "J"};
    case KT_COLUMN_RESIDUAL:
        return c->component == 0 ? (kt_quantity){"Loops open by", "m, rad"}
                                 : (kt_quantity){"Loops open by, per second", "m/s, rad/s"};
    case KT_COLUMN_REACTION:
    case KT_COLUMN_LOOP_REACTION:
        return c->component < 3 ? (kt_quantity){"Reactions: forces", "N"} : (kt_quantity){"Reactions: moments", "N m"};
    case KT_COLUMN_CLOSURE:
        return c->component < 3 || c->component == 6 ? (kt_quantity){"Relative positions in loops", "m"}
                                                     : (kt_quantity){"Relative rotations in loops", "rad"};
    case KT_COLUMN_OWN:
        return (kt_quantity){"Own columns", ""};
    case KT_COLUMN_STATE:
        return (kt_quantity){"Own states", ""};
    case KT_COLUMN_EFFECT:
        return quantity_of_effect(columns, c);
    case KT_COLUMN_MULTIPLIER:
        break;
    }
    return (kt_quantity){"Multipliers", "N, N m"};
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static double coordinate(const double *x, int index) { return x != NULL ? x[index] : (double)NAN; }

static double component_of(const kt_wrench *wrenches, int index, int k) {
    if (wrenches == NULL)
        return (double)NAN;
    const kt_wrench *w = &wrenches[index];
    const double x[] = {w->force.x, w->force.y, w->force.z, w->moment.x, w->moment.y, w->moment.z};
    return x[k];
}

/* What a group of columns that follow each other has in common, computed at the first of them. */
typedef struct kt_column_group {
    double value[7];
} kt_column_group;

static kt_column_group vector_group(kt_vec3 u) { return (kt_column_group){{u.x, u.y, u.z}}; }

static kt_column_group closure_group(const kt_model *model, const kt_data *data, int loop) {
    kt_loop_motion m = {.rotation = kt_mat3_identity()};
    (void)kt_loop_motion_evaluate(model, data, loop, &m); /* loops of columns have ends */
    const kt_vec3 turn = kt_euler_vector_from_matrix(m.rotation);
    const double arc = is_curve(model, loop) ? kt_loop_arc_length(model, data, loop) : 0.0;
    return (kt_column_group){{m.position.x, m.position.y, m.position.z, turn.x, turn.y, turn.z, arc}};
}

static kt_column_group group_of(const kt_column *c, const kt_record *record) {
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
        const kt_quat p = kt_quat_from_matrix(kt_body_pose(model, record->data, c->index).rotation);
        return (kt_column_group){{p.w, p.x, p.y, p.z}};
    }
    case KT_COLUMN_MOMENTUM: {
        const kt_wrench p = kt_momentum(model, record->data);
        return (kt_column_group){{p.force.x, p.force.y, p.force.z, p.moment.x, p.moment.y, p.moment.z}};
    }
    case KT_COLUMN_CLOSURE:
        return closure_group(model, record->data, c->index);
    default:
        return (kt_column_group){{0.0}};
    }
}

/* Equations have other numbers where other loops are switched on. */
static double multiplier_of(const kt_column *c, const kt_record *record) {
    const kt_loop_rows rows = kt_loop_rows_of(record->model, c->index);
    return c->component < rows.count ? coordinate(record->multipliers, rows.first + c->component) : 0.0;
}

static double value_of(const kt_column *c, const kt_record *record, const kt_column_group *group,
                       const double *quantities) {
    switch (c->source) {
    case KT_COLUMN_TIME:
        return record->time;
    case KT_COLUMN_POSITION:
        return coordinate(record->q, c->at);
    case KT_COLUMN_VELOCITY:
        return coordinate(record->v, c->at);
    case KT_COLUMN_ACCELERATION:
        return coordinate(record->a, c->at);
    case KT_COLUMN_MARKER:
    case KT_COLUMN_MARKER_VELOCITY:
    case KT_COLUMN_MARKER_ACCELERATION:
    case KT_COLUMN_ORIENTATION:
    case KT_COLUMN_MOMENTUM:
    case KT_COLUMN_CLOSURE:
        return group->value[c->component];
    case KT_COLUMN_ENERGY:
        return c->component == 0   ? record->kinetic
               : c->component == 1 ? record->potential
                                   : record->kinetic + record->potential;
    case KT_COLUMN_WORK:
        return c->component == 0   ? record->work.dissipated
               : c->component == 1 ? record->work.supplied
                                   : kt_balance_of(record);
    case KT_COLUMN_RESIDUAL:
        return c->component == 0 ? record->constraint.position : record->constraint.velocity;
    case KT_COLUMN_REACTION:
        return component_of(record->reactions, c->index, c->component);
    case KT_COLUMN_LOOP_REACTION:
        return component_of(record->loop_reactions, c->index, c->component);
    case KT_COLUMN_MULTIPLIER:
        return multiplier_of(c, record);
    case KT_COLUMN_OWN:
        return (double)NAN; /* computed together */
    case KT_COLUMN_STATE:
        return coordinate(record->x, c->at);
    case KT_COLUMN_EFFECT:
        return quantities[c->at];
    }
    return (double)NAN;
}

/* NaN if the state is not finite, as the last one of a failed run may be. */
static void evaluate_quantities(kt_columns *columns, const kt_record *record) {
    const kt_model *model = record->model;
    if (kt_effect_quantities_evaluate(model, record->data, record->time, record->q, record->v, columns->quantities,
                                      NULL) == KT_OK)
        return;
    for (size_t i = 0; i < columns->count; i++)
        if (columns->columns[i].source == KT_COLUMN_EFFECT)
            columns->quantities[columns->columns[i].at] = (double)NAN;
}

static bool uses_effects(const kt_columns *columns) {
    for (size_t i = 0; columns->is_used != NULL && i < columns->count; i++)
        if (columns->is_used[i] && columns->columns[i].source == KT_COLUMN_EFFECT)
            return true;
    return columns->is_used == NULL;
}

const double *kt_columns_evaluate(kt_columns *columns, const kt_record *record) {
    kt_column_group group = {{0.0}};
    if (columns->quantities != NULL && uses_effects(columns))
        evaluate_quantities(columns, record);
    for (size_t i = 0; i < columns->count; i++) {
        const kt_column *c = &columns->columns[i];
        if (columns->is_used != NULL && !columns->is_used[i])
            continue;
        if (c->component == 0)
            group = group_of(c, record);
        columns->values[i] = value_of(c, record, &group, columns->quantities);
    }
    if (columns->own != NULL) /* the last ones */
        kt_own_columns_evaluate(columns->own, record,
                                columns->values + columns->count - (size_t)kt_own_column_count(columns->own));
    return columns->values;
}
