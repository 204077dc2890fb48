/* The columns of a run's records, and the own columns of a scene (kt_scene_column). An own column is a formula over all
 * columns that records of its model may have, recorded or not. Only the columns that formulas read are computed.
 */
#include "records/columns.h"

#include "base/memory.h"
#include "kinetree/descriptor.h"
#include "kinetree/expression.h"
#include "kinetree/loop.h"
#include "records/quantities.h"
#include "text/list.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void free_own(kt_own_columns *own);
static void evaluate_own(kt_own_columns *own, const kt_record *record, double *values);
static int own_count(const kt_own_columns *own);

/* ---- the list ---------------------------------------------------------------------------------------------------- */

/* Adds `count` columns of one source, with the components from 0 on. at: index of the first column's value. Returns
 * false if memory is insufficient. */
static bool add_source_columns(kt_columns *columns, kt_column_source source, int index, int count, int at) {
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
        fine = source == KT_COLUMN_POSITION ? add_source_columns(columns, source, body, at.nq, at.q)
                                            : add_source_columns(columns, source, body, at.nv, at.v);
    }
    return fine;
}

/* Returns whether a loop has a wrench. A coupling of joints has joint forces only and therefore no wrench. */
static bool has_wrench(const kt_model *model, int loop) {
    return !kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(model, loop)), KT_KEY_TERMS);
}

/* Returns whether a loop is between joints, not between points of bodies. Such a loop has one equation, whose
 * multiplier is its generalised force. */
static bool is_relation(const kt_model *model, int loop) {
    return !has_wrench(model, loop) ||
           kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(model, loop)), KT_KEY_JOINT);
}

static bool add_multipliers(kt_columns *columns, int loop) {
    const kt_loop_rows rows = kt_loop_rows_of(columns->model, loop);
    return add_source_columns(columns, KT_COLUMN_MULTIPLIER, loop, rows.count, rows.first);
}

static bool add_reactions(kt_columns *columns) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++)
        fine = add_source_columns(columns, KT_COLUMN_REACTION, body, 6, 0);
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++) {
        fine = !has_wrench(columns->model, loop) || add_source_columns(columns, KT_COLUMN_LOOP_REACTION, loop, 6, 0);
        fine = fine && (!is_relation(columns->model, loop) || add_multipliers(columns, loop));
    }
    return fine;
}

/* Adds the columns of bearings, and allocates the memory for a Jacobian. */
static bool add_bearings(kt_columns *columns) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++)
        fine = add_source_columns(columns, KT_COLUMN_BEARING, body, 6, 0);
    columns->jacobian = fine ? malloc((6 * (size_t)kt_model_nv(columns->model) + 1) * sizeof *columns->jacobian) : NULL;
    return columns->jacobian != NULL;
}

/* Adds the multipliers that add_reactions leaves out. */
static bool add_all_multipliers(kt_columns *columns, bool has_reactions) {
    bool fine = true;
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++)
        fine = (has_reactions && is_relation(columns->model, loop)) || add_multipliers(columns, loop);
    return fine;
}

static bool add_marker(kt_columns *columns, const kt_marker_pair *pair, kt_column_source source) {
    const int body = pair->body != NULL ? kt_body_find(columns->model, pair->body) : 0;
    if (!add_source_columns(columns, source, body, 3, 0))
        return false;
    for (size_t i = columns->count - 3; i < columns->count; i++)
        columns->columns[i].marker = kt_marker_find(columns->model, body, pair->marker);
    return true;
}

/* Adds the columns of markers, marker by marker. */
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
        fine = add_source_columns(columns, KT_COLUMN_ORIENTATION, body, 4, 0);
    return fine;
}

/* Adds x, y, z in world axes, then in body axes, for every body. */
static bool add_rotations(kt_columns *columns, kt_column_source source) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++)
        fine = add_source_columns(columns, source, body, 6, 0);
    return fine;
}

/* Adds the closures of loops. Relations of joints have no ends, and therefore no columns. */
static bool add_closures(kt_columns *columns) {
    bool fine = true;
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++)
        if (!is_relation(columns->model, loop))
            fine = add_source_columns(columns, KT_COLUMN_CLOSURE, loop, kt_column_has_arc(columns->model, loop) ? 7 : 6,
                                      0);
    return fine;
}

/* Adds the columns of effects, and allocates the memory for their quantities. */
static bool add_effect_columns(kt_columns *columns) {
    bool fine = true;
    int at = 0;
    for (int effect = 0; effect < kt_effect_count(columns->model) && fine; effect++) {
        const int count = kt_effect_quantity_count(columns->model, effect);
        fine = add_source_columns(columns, KT_COLUMN_EFFECT, effect, count, at);
        at += count;
    }
    columns->quantities = fine ? malloc(((size_t)at + 1) * sizeof *columns->quantities) : NULL;
    return columns->quantities != NULL;
}

static bool add_states(kt_columns *columns) {
    bool fine = true;
    for (int state = 0; state < kt_own_state_count(columns->model) && fine; state++)
        fine = add_source_columns(columns, KT_COLUMN_STATE, state, 1, state);
    return fine;
}

/* Returns the set in which every switched loop and effect is on. Friction sticks in this set: the switch of its loop is
 * on, and the switch of its effect is off. */
static uint64_t full_set(const kt_model *model) {
    uint64_t set = 0;
    for (int k = 0; k < kt_switch_count(model); k++)
        set |= kt_switch_bits(model, k);
    for (int i = 0; i < kt_effect_count(model); i++)
        if (kt_effect_switch(model, i) >= 0 && kt_effect_stick(model, i) >= 0)
            set &= ~kt_switch_bits(model, kt_effect_switch(model, i));
    return set;
}

/* Lists all columns, but allocates no memory for singular values. */
static bool list_all_columns(kt_columns *columns, const kt_scene *scene, const kt_model *model, const kt_run *run,
                             unsigned record) {
    /* All switched loops and effects are on, so that each has its columns. Their values are 0 while they are off. */
    const kt_model *all = kt_model_switched(model, full_set(model));
    *columns = (kt_columns){.model = all, .description = &scene->description, .record = record};
    bool fine = add_source_columns(columns, KT_COLUMN_TIME, 0, 1, 0);
    if (fine && (record & KT_RECORD_POSITION) != 0)
        fine = add_coordinates(columns, KT_COLUMN_POSITION);
    if (fine && (record & KT_RECORD_VELOCITY) != 0)
        fine = add_coordinates(columns, KT_COLUMN_VELOCITY);
    if (fine && (record & KT_RECORD_ACCELERATION) != 0)
        fine = add_coordinates(columns, KT_COLUMN_ACCELERATION);
    if (fine && (record & KT_RECORD_GRAVITY) != 0)
        fine = add_coordinates(columns, KT_COLUMN_GRAVITY);
    if (fine && (record & KT_RECORD_STATE) != 0)
        fine = add_states(columns);
    fine = fine && add_markers(columns, run, record);
    if (fine && (record & KT_RECORD_ORIENTATION) != 0)
        fine = add_orientations(columns);
    if (fine && (record & KT_RECORD_ANGULAR_VELOCITY) != 0)
        fine = add_rotations(columns, KT_COLUMN_ANGULAR_VELOCITY);
    if (fine && (record & KT_RECORD_ANGULAR_ACCELERATION) != 0)
        fine = add_rotations(columns, KT_COLUMN_ANGULAR_ACCELERATION);
    if (fine && (record & KT_RECORD_MOMENTUM) != 0)
        fine = add_source_columns(columns, KT_COLUMN_MOMENTUM, 0, 6, 0);
    if (fine && (record & KT_RECORD_ENERGY) != 0)
        fine = add_source_columns(columns, KT_COLUMN_ENERGY, 0, 3, 0);
    if (fine && (record & KT_RECORD_BALANCE) != 0)
        fine = add_source_columns(columns, KT_COLUMN_WORK, 0, 3, 0);
    if (fine && (record & KT_RECORD_CONSTRAINT) != 0)
        fine = add_source_columns(columns, KT_COLUMN_RESIDUAL, 0, 2, 0);
    if (fine && (record & KT_RECORD_SINGULAR_VALUE) != 0)
        fine = add_source_columns(columns, KT_COLUMN_SINGULAR_VALUE, 0, 1, 0);
    if (fine && (record & KT_RECORD_REACTION) != 0)
        fine = add_reactions(columns);
    if (fine && (record & KT_RECORD_BEARING) != 0)
        fine = add_bearings(columns);
    if (fine && (record & KT_RECORD_MULTIPLIER) != 0)
        fine = add_all_multipliers(columns, (record & KT_RECORD_REACTION) != 0);
    if (fine && (record & KT_RECORD_CLOSURE) != 0)
        fine = add_closures(columns);
    if (fine && (record & KT_RECORD_EFFECT) != 0)
        fine = add_effect_columns(columns);
    columns->values = fine ? malloc(columns->count * sizeof *columns->values) : NULL;
    return columns->values != NULL;
}

/* Allocates the memory for the recorded quantities that have memory of their own. */
static bool take_column_memory(kt_columns *columns, unsigned record) {
    const bool is_singular = (record & KT_RECORD_SINGULAR_VALUE) != 0, is_gravity = (record & KT_RECORD_GRAVITY) != 0;
    if (is_singular && columns->singular == NULL)
        columns->singular = kt_singular_create(columns->model);
    if (is_gravity && columns->gravity == NULL)
        columns->gravity = kt_gravity_create(columns->model);
    return (!is_singular || columns->singular != NULL) && (!is_gravity || columns->gravity != NULL);
}

bool kt_columns_list(kt_columns *columns, const kt_scene *scene, const kt_model *model, const kt_run *run,
                     unsigned record) {
    return list_all_columns(columns, scene, model, run, record) && take_column_memory(columns, record);
}

void kt_columns_free(kt_columns *columns) {
    free_own(columns->own);
    free(columns->columns);
    free(columns->values);
    free(columns->quantities);
    free(columns->jacobian);
    kt_singular_free(columns->singular);
    kt_gravity_free(columns->gravity);
    *columns = (kt_columns){.count = 0};
}

const double *kt_columns_evaluate(kt_columns *columns, const kt_record *record) {
    kt_columns_fill(columns, record);
    if (columns->own != NULL) /* the last ones */
        evaluate_own(columns->own, record, columns->values + columns->count - (size_t)own_count(columns->own));
    return columns->values;
}

enum { NAME_SIZE = 600 };

struct kt_own_columns {
    kt_columns all; /* of all kinds, and of all markers */
    bool *is_used;  /* [all.count]: by a formula */
    const kt_scene *scene;
    void **memory; /* of each formula */
    const kt_expression **formula;
};

/* ---- own columns: all that formulas may read --------------------------------------------------------------------- */

static kt_marker_pair *list_all_markers(const kt_model *model, int *count) {
    *count = 0;
    for (int body = 0; body < kt_model_body_count(model); body++)
        *count += kt_marker_count(model, body);
    kt_marker_pair *pairs = malloc(((size_t)*count + 1) * sizeof *pairs);
    for (int body = 0, k = 0; pairs != NULL && body < kt_model_body_count(model); body++)
        for (int i = 0; i < kt_marker_count(model, body); i++)
            pairs[k++] = (kt_marker_pair){kt_body_name(model, body), kt_marker_name(model, body, i)};
    return pairs;
}

bool kt_columns_list_all(kt_columns *all, const kt_scene *scene, const kt_model *model) {
#define RECORD_OR(id, bit, name) | bit
    static const unsigned every = 0U KT_RECORD_LIST(RECORD_OR);
#undef RECORD_OR
    kt_run run = kt_run_default();
    kt_marker_pair *markers = list_all_markers(model, &run.marker_count);
    run.markers = markers;
    const bool fine = markers != NULL && list_all_columns(all, scene, model, &run, every);
    free(markers);
    return fine;
}

/* ---- own columns: names ------------------------------------------------------------------------------------------ */

static bool find_record_symbol(void *user, const char *name, kt_symbol *symbol) {
    const kt_columns *all = user;
    const int state = kt_own_state_find(all->model, name);
    char text[NAME_SIZE];
    for (size_t i = 0; i < all->count; i++) {
        (void)kt_column_name(all, i, text, sizeof text);
        const bool is_time = i == 0 && strcmp(name, "t") == 0;
        const bool is_state = state >= 0 && all->columns[i].source == KT_COLUMN_STATE && all->columns[i].index == state;
        if (is_time || is_state || strcmp(text, name) == 0) {
            *symbol = (kt_symbol){.index = (int)i};
            return true;
        }
    }
    return false;
}

static const char *list_record_symbol(void *user, int k) {
    static char text[NAME_SIZE]; /* of a command, which has one thread; read before the next call */
    const kt_columns *all = user;
    if ((size_t)k >= all->count)
        return NULL;
    (void)kt_column_name(all, (size_t)k, text, sizeof text);
    return text;
}

/* ---- what is needed ---------------------------------------------------------------------------------------------- */

/* Returns the bits that a simulation must compute for a column. */
static unsigned record_for(kt_column_source source) {
    switch (source) {
    case KT_COLUMN_TIME:
    case KT_COLUMN_POSITION:
    case KT_COLUMN_VELOCITY:
    case KT_COLUMN_STATE:
    case KT_COLUMN_OWN:
        return 0;
    case KT_COLUMN_ACCELERATION:
        return KT_RECORD_ACCELERATION;
    case KT_COLUMN_MARKER:
    case KT_COLUMN_MARKER_VELOCITY:
        return KT_RECORD_MARKER_VELOCITY;
    case KT_COLUMN_MARKER_ACCELERATION:
        return KT_RECORD_MARKER_ACCELERATION;
    case KT_COLUMN_ORIENTATION:
        return KT_RECORD_ORIENTATION;
    case KT_COLUMN_ANGULAR_VELOCITY:
        return KT_RECORD_ANGULAR_VELOCITY;
    case KT_COLUMN_ANGULAR_ACCELERATION:
        return KT_RECORD_ANGULAR_ACCELERATION;
    case KT_COLUMN_SINGULAR_VALUE:
        return KT_RECORD_SINGULAR_VALUE;
    case KT_COLUMN_GRAVITY:
        return KT_RECORD_GRAVITY;
    case KT_COLUMN_MOMENTUM:
        return KT_RECORD_MOMENTUM;
    case KT_COLUMN_ENERGY:
        return KT_RECORD_ENERGY;
    case KT_COLUMN_WORK:
        return KT_RECORD_BALANCE;
    case KT_COLUMN_RESIDUAL:
        return KT_RECORD_CONSTRAINT;
    case KT_COLUMN_REACTION:
    case KT_COLUMN_LOOP_REACTION:
    case KT_COLUMN_BEARING:
        return KT_RECORD_REACTION;
    case KT_COLUMN_MULTIPLIER:
        return KT_RECORD_MULTIPLIER;
    case KT_COLUMN_CLOSURE:
        return KT_RECORD_CLOSURE;
    case KT_COLUMN_EFFECT:
        return KT_RECORD_EFFECT;
    }
    return 0;
}

/* Marks the columns that a formula reads as used, and returns the bits that they need. A group of columns is computed
 * at its component 0, which is marked, too. */
static unsigned use_symbols(kt_own_columns *own, const kt_expression *formula) {
    unsigned record = 0;
    const size_t count = kt_expression_symbols(formula, 0, NULL);
    int *symbols = malloc((count + 1) * sizeof *symbols);
    if (symbols == NULL)
        return 0;
    (void)kt_expression_symbols(formula, count, symbols);
    for (size_t k = 0; k < count; k++) {
        const kt_column *column = &own->all.columns[symbols[k]];
        own->is_used[symbols[k]] = own->is_used[symbols[k] - column->component] = true;
        record |= record_for(column->source);
    }
    free(symbols);
    return record;
}

static kt_status read_own_formula(kt_own_columns *own, int k, unsigned *record, kt_error *error) {
    const kt_scene_column *column = &own->scene->columns[k];
    const kt_symbols symbols = {.find = find_record_symbol, .list = list_record_symbol, .user = &own->all};
    const size_t size = kt_expression_size(column->formula);
    kt_error from = {0};
    own->memory[k] = malloc(size);
    if (own->memory[k] == NULL)
        return kt_reject_memory(error);
    const kt_status status =
        kt_expression_parse(column->formula, &symbols, own->memory[k], size, &own->formula[k], NULL, &from);
    if (status != KT_OK) {
        char where[KT_WHERE_SIZE];
        (void)snprintf(where, sizeof where, "output.columns.%.100s", column->name);
        return kt_error_set(error, KT_ERROR_SCENE, where, "%s", from.message);
    }
    *record |= use_symbols(own, own->formula[k]);
    return take_column_memory(&own->all, *record) ? KT_OK : kt_reject_memory(error);
}

/* ---- own columns: the list --------------------------------------------------------------------------------------- */

static void free_own(kt_own_columns *own) {
    for (int k = 0; own != NULL && own->memory != NULL && k < own->scene->column_count; k++)
        free(own->memory[k]);
    if (own != NULL) {
        kt_columns_free(&own->all);
        free(own->memory);
        free((void *)own->formula);
        free(own->is_used);
    }
    free(own);
}

static kt_status create_own(const kt_scene *scene, const kt_model *model, kt_own_columns **own, unsigned *record,
                            kt_error *error) {
    kt_own_columns *made = calloc(1, sizeof *made);
    *own = NULL;
    *record = 0;
    if (made == NULL)
        return kt_reject_memory(error);
    made->scene = scene;
    made->memory = calloc((size_t)scene->column_count + 1, sizeof *made->memory);
    made->formula = calloc((size_t)scene->column_count + 1, sizeof *made->formula);
    const bool fine = made->memory != NULL && made->formula != NULL && kt_columns_list_all(&made->all, scene, model);
    made->is_used = fine ? calloc(made->all.count + 1, sizeof *made->is_used) : NULL;
    kt_status status = made->is_used != NULL ? KT_OK : kt_reject_memory(error);
    for (int k = 0; k < scene->column_count && status == KT_OK; k++)
        status = read_own_formula(made, k, record, error);
    if (status == KT_OK)
        *own = made;
    else
        free_own(made);
    return status;
}

static void evaluate_own(kt_own_columns *own, const kt_record *record, double *values) {
    own->all.is_used = own->is_used;
    const double *all = kt_columns_evaluate(&own->all, record);
    for (int k = 0; k < own->scene->column_count; k++)
        values[k] = kt_expression_evaluate(own->formula[k], all);
}

static int own_count(const kt_own_columns *own) { return own != NULL ? own->scene->column_count : 0; }

kt_status kt_columns_add_own(kt_columns *columns, const kt_scene *scene, unsigned *record, kt_error *error) {
    *record = 0;
    if (scene->column_count == 0)
        return KT_OK;
    const kt_status status = create_own(scene, columns->model, &columns->own, record, error);
    columns->formulas = scene->columns;
    if (status != KT_OK)
        return status;
    bool fine = true;
    for (int k = 0; k < scene->column_count && fine; k++)
        fine = add_source_columns(columns, KT_COLUMN_OWN, k, 1, k);
    double *values = fine ? realloc(columns->values, columns->count * sizeof *values) : NULL;
    if (values == NULL)
        return kt_reject_memory(error);
    columns->values = values;
    return KT_OK;
}

kt_status kt_columns_own_record(const kt_scene *scene, const kt_model *model, unsigned *record, kt_error *error) {
    kt_own_columns *own = NULL;
    const kt_status status = create_own(scene, model, &own, record, error);
    free_own(own);
    return status;
}
