/* Names of the columns of a run's records, in files and in charts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/columns.h"

#include "kinetree/descriptor.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <stdio.h>
#include <string.h>

/* Writes "KIND.NAME", or "KIND.NAME[k]" if there are several. */
static int name_numbered(char *text, size_t size, const char *kind, const char *name, const char *of, int k,
                         int count) {
    return count == 1 ? snprintf(text, size, "%s.%s%s", kind, name, of)
                      : snprintf(text, size, "%s.%s%s[%d]", kind, name, of, k);
}

/* Writes the name of a quantity: "effect.tyre.force", or "effect[2].force" if the effect has no name. */
static int name_quantity(const kt_columns *columns, const kt_column *c, char *text, size_t size) {
    const char *name = kt_effect_name(columns->model, c->index);
    const char *quantity = kt_quantity_name(kt_effect_quantity_at(columns->model, c->index, c->component),
                                            kt_effect_is_sliding(columns->model, c->index));
    return name[0] != '\0' ? snprintf(text, size, "effect.%s.%s", name, quantity)
                           : snprintf(text, size, "effect[%d].%s", c->index, quantity);
}

static int name_coordinate_column(const kt_columns *columns, const kt_column *c, const char *kind, char *text,
                                  size_t size) {
    const kt_coordinates at = kt_body_coordinates(columns->model, c->index);
    return name_numbered(text, size, kind, kt_joint_name(columns->model, c->index), "", c->component,
                         c->source == KT_COLUMN_POSITION ? at.nq : at.nv);
}

static int name_loop_coordinate(const kt_columns *columns, const kt_column *c, char *text, size_t size) {
    const kt_coordinates at = kt_loop_coordinates(columns->model, c->index);
    const bool is_position = c->source == KT_COLUMN_LOOP_POSITION;
    return name_numbered(text, size, is_position ? "position" : "velocity", kt_loop_name(columns->model, c->index), "",
                         c->component, is_position ? at.nq : at.nv);
}

/* A column of a joint's or a loop's reaction. */
static int name_reaction(const kt_columns *columns, const kt_column *c, char *text, size_t size) {
    static const char *const wrench[] = {"fx", "fy", "fz", "mx", "my", "mz"};
    const bool is_loop = c->source == KT_COLUMN_LOOP_REACTION;
    return snprintf(text, size, "%s.%s.%s", c->source == KT_COLUMN_BEARING ? "bearing" : "reaction",
                    is_loop ? kt_loop_name(columns->model, c->index) : kt_joint_name(columns->model, c->index),
                    wrench[c->component]);
}

static int name_marker_column(const kt_columns *columns, const kt_column *c, char *text, size_t size) {
    static const char *const orders[] = {"", "v", "a"};
    return snprintf(text, size, "marker.%s.%s.%s%c", kt_body_name(columns->model, c->index),
                    kt_marker_name(columns->model, c->index, c->marker), orders[c->source - KT_COLUMN_MARKER],
                    "xyz"[c->component]);
}

int kt_column_name(const kt_columns *columns, size_t column, char *text, size_t size) {
    static const char *const kinds[] = {"position", "velocity", "acceleration", "gravity"};
    static const char *const energies[] = {"kinetic", "potential", "total"};
    static const char *const works[] = {"dissipated", "supplied", "balance"};
    static const char *const momenta[] = {"px", "py", "pz", "lx", "ly", "lz"};
    static const char *const axes[] = {"x", "y", "z", "body_x", "body_y", "body_z"};
    static const char *const closure[] = {"x", "y", "z", "rx", "ry", "rz", "arc"};
    const kt_column *c = &columns->columns[column];
    const kt_model *model = columns->model;
    switch (c->source) {
    case KT_COLUMN_TIME:
        return snprintf(text, size, "time");
    case KT_COLUMN_POSITION:
    case KT_COLUMN_VELOCITY:
    case KT_COLUMN_ACCELERATION:
    case KT_COLUMN_GRAVITY:
        return name_coordinate_column(columns, c, kinds[c->source - KT_COLUMN_POSITION], text, size);
    case KT_COLUMN_MARKER:
    case KT_COLUMN_MARKER_VELOCITY:
    case KT_COLUMN_MARKER_ACCELERATION:
        return name_marker_column(columns, c, text, size);
    case KT_COLUMN_ORIENTATION:
        return snprintf(text, size, "orientation.%s.%c", kt_body_name(model, c->index), "wxyz"[c->component]);
    case KT_COLUMN_ANGULAR_VELOCITY:
    case KT_COLUMN_ANGULAR_ACCELERATION:
        return snprintf(text, size, "angular_%s.%s.%s", kinds[1 + (int)c->source - KT_COLUMN_ANGULAR_VELOCITY],
                        kt_body_name(model, c->index), axes[c->component]);
    case KT_COLUMN_SINGULAR_VALUE:
        return snprintf(text, size, "constraint.singular_value");
    case KT_COLUMN_MOMENTUM:
        return snprintf(text, size, "momentum.%s", momenta[c->component]);
    case KT_COLUMN_ENERGY:
    case KT_COLUMN_WORK:
        return snprintf(text, size, "energy.%s", (c->source == KT_COLUMN_ENERGY ? energies : works)[c->component]);
    case KT_COLUMN_RESIDUAL:
        return snprintf(text, size, "constraint.%s", kinds[c->component]);
    case KT_COLUMN_REACTION:
    case KT_COLUMN_BEARING:
    case KT_COLUMN_LOOP_REACTION:
        return name_reaction(columns, c, text, size);
    case KT_COLUMN_MULTIPLIER:
        return name_numbered(text, size, "reaction", kt_loop_name(model, c->index), ".multiplier", c->component,
                             kt_loop_rows_of(model, c->index).count);
    case KT_COLUMN_LOOP_POSITION:
    case KT_COLUMN_LOOP_VELOCITY:
        return name_loop_coordinate(columns, c, text, size);
    case KT_COLUMN_CLOSURE:
        return snprintf(text, size, "closure.%s.%s", kt_loop_name(model, c->index), closure[c->component]);
    case KT_COLUMN_OWN:
        return snprintf(text, size, "%s", columns->formulas[c->index].name);
    case KT_COLUMN_STATE:
        return snprintf(text, size, "state.%s", kt_auxiliary_state_name(model, c->index));
    case KT_COLUMN_EFFECT:
        return name_quantity(columns, c, text, size);
    }
    return 0;
}

size_t kt_columns_find(const kt_columns *columns, const char *name, size_t guess) {
    char text[600];
    for (size_t i = 0; i < columns->count; i++) {
        const size_t k = (guess + i) % columns->count;
        (void)kt_column_name(columns, k, text, sizeof text);
        if (strcmp(text, name) == 0)
            return k;
    }
    return columns->count;
}

static const char *unit_of_quantity(const kt_columns *columns, const kt_column *c) {
    return kt_quantity_unit(kt_effect_quantity_at(columns->model, c->index, c->component),
                            kt_effect_is_sliding(columns->model, c->index));
}

int kt_column_header(const kt_columns *columns, size_t column, char *text, size_t size) {
    const kt_column *c = &columns->columns[column];
    const int length = kt_column_name(columns, column, text, size);
    const char *unit = c->source == KT_COLUMN_EFFECT ? unit_of_quantity(columns, c)
                       : c->source == KT_COLUMN_OWN  ? columns->formulas[c->index].unit
                                                     : NULL;
    if (unit == NULL)
        return length;
    const size_t used = (size_t)length < size ? (size_t)length : size;
    return length + snprintf(text != NULL ? text + used : NULL, size - used, " [%s]", unit);
}

/* ---- quantities -------------------------------------------------------------------------------------------------- */

static kt_measure coordinate_quantity(kt_joint_type type, int component, int order) {
    static const kt_measure angles[] = {{"Angles", "rad"},
                                        {"Angular velocities", "rad/s"},
                                        {"Angular accelerations", "rad/s\u00b2"},
                                        {"Gravity in joints: torques", "N m"}};
    static const kt_measure lengths[] = {
        {"Lengths", "m"}, {"Velocities", "m/s"}, {"Accelerations", "m/s\u00b2"}, {"Gravity in joints: forces", "N"}};
    switch (kt_joint_coordinate_kind(type, component)) {
    case KT_COORDINATE_LENGTH:
    case KT_COORDINATE_TRANSLATION:
        return lengths[order];
    case KT_COORDINATE_ROTATION:
        return order == 0 ? (kt_measure){"Quaternions", ""} : angles[order];
    case KT_COORDINATE_ANGLE:
    case KT_COORDINATE_TURNS:
    case KT_COORDINATE_NONE:
        break;
    }
    return angles[order];
}

static kt_measure quantity_of_effect(const kt_columns *columns, const kt_column *c) {
    static const struct {
        const char *unit;
        kt_measure quantity;
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
    return (kt_measure){"Effects", ""};
}

/* Whether all terms of a relation of joints are lengths, or all are angles (is_length false). */
static bool are_terms(const kt_columns *columns, const kt_loop *loop, bool is_length) {
    bool all = loop->term_count > 0;
    for (int i = 0; i < loop->term_count && all; i++) {
        kt_error ignored;
        int body = 0;
        all = kt_joint_find(columns->model, loop->terms[i].joint, &body, &ignored) == KT_OK;
        const kt_coordinate_kind kind = kt_joint_coordinate_kind(kt_body_coordinates(columns->model, body).type, 0);
        all = all && (kind == KT_COORDINATE_LENGTH) == is_length;
    }
    return all;
}

/* Whether a loop that holds the friction of an effect is in a joint that slides. */
static bool is_sliding_stick(const kt_columns *columns, int loop) {
    char name[160];
    (void)snprintf(name, sizeof name, "%s", kt_loop_name(columns->model, loop));
    char *dot = strrchr(name, '.');
    if (dot != NULL)
        *dot = '\0';
    const int effect = kt_effect_find(columns->model, name);
    return effect >= 0 && kt_effect_is_sliding(columns->model, effect);
}

/* A multiplier is a force in an equation of lengths, and a torque in one of angles. In an equation of both, the unit
 * depends on the coefficients. */
static kt_measure quantity_of_multiplier(const kt_columns *columns, const kt_column *c) {
    static const kt_measure force = {"Multipliers: forces", "N"}, torque = {"Multipliers: torques", "N m"},
                            other = {"Multipliers: forces and torques", ""};
    const kt_loop_measure measure = kt_loop_measure_of(columns->model, c->index, c->component);
    const bool is_own = c->index >= columns->description->loop_count; /* of the engine, for friction */
    const kt_loop *loop = is_own ? NULL : &columns->description->loops[c->index];
    if (measure == KT_MEASURE_LENGTH || measure == KT_MEASURE_ANGLE)
        return measure == KT_MEASURE_LENGTH ? force : torque;
    if (is_own && kt_loop_is_stick(columns->model, c->index))
        return is_sliding_stick(columns, c->index) ? force : torque;
    if (loop != NULL && (loop->type == KT_LOOP_ROLLING || are_terms(columns, loop, true)))
        return force;
    return loop != NULL && are_terms(columns, loop, false) ? torque : other;
}

/* Returns the quantity of an own column. A column with a unit is a quantity of its own. */
static kt_measure own_quantity(const kt_scene_column *column) {
    return column->unit != NULL ? (kt_measure){column->name, column->unit} : (kt_measure){"Own columns", ""};
}

/* The quantities of other sources: that of the first `split` components, and that of the others. */
static const struct {
    int split;
    kt_measure first, second;
} measures[] = {
    [KT_COLUMN_TIME] = {1, {"Time", "s"}, {"", ""}},
    [KT_COLUMN_MARKER] = {3, {"Markers", "m"}, {"", ""}},
    [KT_COLUMN_MARKER_VELOCITY] = {3, {"Velocities of markers", "m/s"}, {"", ""}},
    [KT_COLUMN_MARKER_ACCELERATION] = {3, {"Accelerations of markers", "m/s\u00b2"}, {"", ""}},
    [KT_COLUMN_ORIENTATION] = {4, {"Orientations", ""}, {"", ""}},
    [KT_COLUMN_ANGULAR_VELOCITY] = {6, {"Angular velocities of bodies", "rad/s"}, {"", ""}},
    [KT_COLUMN_ANGULAR_ACCELERATION] = {6, {"Angular accelerations of bodies", "rad/s\u00b2"}, {"", ""}},
    [KT_COLUMN_MOMENTUM] = {3, {"Momentum", "kg m/s"}, {"Angular momentum", "kg m\u00b2/s"}},
    [KT_COLUMN_ENERGY] = {3, {"Energies", "J"}, {"", ""}},
    [KT_COLUMN_WORK] = {3, {"Energies", "J"}, {"", ""}},
    [KT_COLUMN_RESIDUAL] = {1, {"Loops open by", "m, rad"}, {"Loops open by, per second", "m/s, rad/s"}},
    [KT_COLUMN_SINGULAR_VALUE] = {1, {"Smallest singular value of the loops", ""}, {"", ""}},
    [KT_COLUMN_REACTION] = {3, {"Reactions: forces", "N"}, {"Reactions: moments", "N m"}},
    [KT_COLUMN_LOOP_REACTION] = {3, {"Reactions: forces", "N"}, {"Reactions: moments", "N m"}},
    [KT_COLUMN_BEARING] = {3, {"Bearings: forces", "N"}, {"Bearings: moments", "N m"}},
    [KT_COLUMN_CLOSURE] = {3, {"Relative positions in loops", "m"}, {"Relative rotations in loops", "rad"}},
    [KT_COLUMN_STATE] = {1, {"Auxiliary states", ""}, {"", ""}},
};

kt_measure kt_column_quantity(const kt_columns *columns, size_t column) {
    const kt_column *c = &columns->columns[column];
    switch (c->source) {
    case KT_COLUMN_POSITION:
    case KT_COLUMN_VELOCITY:
    case KT_COLUMN_ACCELERATION:
    case KT_COLUMN_GRAVITY:
        return coordinate_quantity(kt_body_coordinates(columns->model, c->index).type, c->component,
                                   (int)c->source - KT_COLUMN_POSITION);
    case KT_COLUMN_LOOP_POSITION:
    case KT_COLUMN_LOOP_VELOCITY:
        return coordinate_quantity(kt_loop_coordinates(columns->model, c->index).type, c->component,
                                   (int)c->source - KT_COLUMN_LOOP_POSITION);
    case KT_COLUMN_OWN:
        return own_quantity(&columns->formulas[c->index]);
    case KT_COLUMN_EFFECT:
        return quantity_of_effect(columns, c);
    case KT_COLUMN_MULTIPLIER:
        return quantity_of_multiplier(columns, c);
    default:
        break;
    }
    const bool is_arc = c->source == KT_COLUMN_CLOSURE && c->component == 6; /* a length behind the angles */
    return c->component < measures[c->source].split || is_arc ? measures[c->source].first : measures[c->source].second;
}
