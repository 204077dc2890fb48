/* The columns of a run's records, and the own columns of a scene (kt_scene_column). An own column is a formula over all
 * columns that records of its model may have, recorded or not. Only the columns that formulas read are computed.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/columns.h"

#include "base/grow.h"
#include "base/memory.h"
#include "kinetree/descriptor.h"
#include "kinetree/expression.h"
#include "kinetree/loop.h"
#include "model/formula_names.h"
#include "records/gravity.h"

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
    kt_column *more = kt_heap_grow(columns->columns, columns->count, (size_t)count, &columns->room, sizeof *more);
    if (more == NULL && count > 0)
        return false;
    columns->columns = more;
    for (int k = 0; k < count; k++)
        columns->columns[columns->count++] =
            (kt_column){.source = source, .index = index, .component = k, .at = at + k};
    return true;
}

/* A quantity of records, and its columns. */
typedef struct recorded recorded;
struct recorded {
    kt_column_source source;
    unsigned record; /* the KT_RECORD_ bit that selects its columns; 0: they are always there */
    unsigned needs;  /* the bits that a simulation must compute for a formula of these columns */
    int count;       /* columns of each body, or in all; 0: it varies */
    bool (*add)(kt_columns *columns, const recorded *quantity); /* NULL: the columns of another quantity include them */
};

static bool add_coordinates(kt_columns *columns, const recorded *quantity) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++) {
        const kt_coordinates at = kt_body_coordinates(columns->model, body);
        const bool is_position = quantity->source == KT_COLUMN_POSITION;
        fine =
            add_source_columns(columns, quantity->source, body, is_position ? at.nq : at.nv, is_position ? at.q : at.v);
    }
    return fine;
}

/* Adds the columns of joints that close loops. */
static bool add_loop_coordinates(kt_columns *columns, const recorded *quantity) {
    bool fine = true;
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++) {
        const kt_coordinates at = kt_loop_coordinates(columns->model, loop);
        fine = add_source_columns(columns, quantity->source, loop,
                                  quantity->source == KT_COLUMN_LOOP_POSITION ? at.nq : at.nv, 0);
    }
    return fine;
}

static bool add_once(kt_columns *columns, const recorded *quantity) {
    return add_source_columns(columns, quantity->source, 0, quantity->count, 0);
}

static bool add_for_bodies(kt_columns *columns, const recorded *quantity) {
    bool fine = true;
    for (int body = 1; body < kt_model_body_count(columns->model) && fine; body++)
        fine = add_source_columns(columns, quantity->source, body, quantity->count, 0);
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

static bool add_reactions(kt_columns *columns, const recorded *quantity) {
    bool fine = add_for_bodies(columns, quantity);
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++) {
        fine = !has_wrench(columns->model, loop) ||
               add_source_columns(columns, KT_COLUMN_LOOP_REACTION, loop, quantity->count, 0);
        fine = fine && (!is_relation(columns->model, loop) || add_multipliers(columns, loop));
    }
    return fine;
}

/* Adds the columns of bearings, and allocates the memory for a Jacobian. */
static bool add_bearings(kt_columns *columns, const recorded *quantity) {
    const bool fine = add_for_bodies(columns, quantity);
    columns->jacobian = fine ? malloc((6 * (size_t)kt_model_nv(columns->model) + 1) * sizeof *columns->jacobian) : NULL;
    return columns->jacobian != NULL;
}

/* Adds the multipliers that add_reactions leaves out. */
static bool add_all_multipliers(kt_columns *columns, const recorded *quantity) {
    const bool has_reactions = (columns->record & KT_RECORD_REACTION) != 0;
    bool fine = true;
    (void)quantity;
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
static bool add_markers(kt_columns *columns, const kt_run *run) {
    bool fine = true;
    for (int i = 0; i < run->marker_count && fine; i++) {
        fine = add_marker(columns, &run->markers[i], KT_COLUMN_MARKER);
        if (fine && (columns->record & KT_RECORD_MARKER_VELOCITY) != 0)
            fine = add_marker(columns, &run->markers[i], KT_COLUMN_MARKER_VELOCITY);
        if (fine && (columns->record & KT_RECORD_MARKER_ACCELERATION) != 0)
            fine = add_marker(columns, &run->markers[i], KT_COLUMN_MARKER_ACCELERATION);
    }
    return fine;
}

/* Adds the closures of loops. Relations of joints have no ends, and therefore no columns. */
static bool add_closures(kt_columns *columns, const recorded *quantity) {
    bool fine = true;
    for (int loop = 0; loop < kt_loop_count(columns->model) && fine; loop++)
        if (!is_relation(columns->model, loop))
            fine =
                add_source_columns(columns, quantity->source, loop, kt_column_has_arc(columns->model, loop) ? 7 : 6, 0);
    return fine;
}

/* Adds the columns of effects, and allocates the memory for their quantities. */
static bool add_effect_columns(kt_columns *columns, const recorded *quantity) {
    bool fine = true;
    int at = 0;
    for (int effect = 0; effect < kt_effect_count(columns->model) && fine; effect++) {
        const int count = kt_effect_quantity_count(columns->model, effect);
        fine = add_source_columns(columns, quantity->source, effect, count, at);
        at += count;
    }
    columns->quantities = fine ? malloc(((size_t)at + 1) * sizeof *columns->quantities) : NULL;
    return columns->quantities != NULL;
}

static bool add_states(kt_columns *columns, const recorded *quantity) {
    bool fine = true;
    for (int state = 0; state < kt_auxiliary_state_count(columns->model) && fine; state++)
        fine = add_source_columns(columns, quantity->source, state, 1, state);
    return fine;
}

/* All quantities, in the order of their columns in files. */
static const recorded quantities[] = {
    {KT_COLUMN_TIME, 0, 0, 1, add_once},
    {KT_COLUMN_POSITION, KT_RECORD_POSITION, 0, 0, add_coordinates},
    {KT_COLUMN_LOOP_POSITION, KT_RECORD_POSITION, KT_RECORD_CLOSURE, 0, add_loop_coordinates},
    {KT_COLUMN_VELOCITY, KT_RECORD_VELOCITY, 0, 0, add_coordinates},
    {KT_COLUMN_LOOP_VELOCITY, KT_RECORD_VELOCITY, KT_RECORD_CLOSURE, 0, add_loop_coordinates},
    {KT_COLUMN_ACCELERATION, KT_RECORD_ACCELERATION, KT_RECORD_ACCELERATION, 0, add_coordinates},
    {KT_COLUMN_GRAVITY, KT_RECORD_GRAVITY, KT_RECORD_GRAVITY, 0, add_coordinates},
    {KT_COLUMN_STATE, KT_RECORD_STATE, 0, 0, add_states},
    {KT_COLUMN_MARKER, 0, KT_RECORD_MARKER_VELOCITY, 0, NULL}, /* add_markers: one marker after another */
    {KT_COLUMN_MARKER_VELOCITY, 0, KT_RECORD_MARKER_VELOCITY, 0, NULL},
    {KT_COLUMN_MARKER_ACCELERATION, 0, KT_RECORD_MARKER_ACCELERATION, 0, NULL},
    {KT_COLUMN_ORIENTATION, KT_RECORD_ORIENTATION, KT_RECORD_ORIENTATION, 4, add_for_bodies},
    {KT_COLUMN_ANGULAR_VELOCITY, KT_RECORD_ANGULAR_VELOCITY, KT_RECORD_ANGULAR_VELOCITY, 6, add_for_bodies},
    {KT_COLUMN_ANGULAR_ACCELERATION, KT_RECORD_ANGULAR_ACCELERATION, KT_RECORD_ANGULAR_ACCELERATION, 6, add_for_bodies},
    {KT_COLUMN_MOMENTUM, KT_RECORD_MOMENTUM, KT_RECORD_MOMENTUM, 6, add_once},
    {KT_COLUMN_ENERGY, KT_RECORD_ENERGY, KT_RECORD_ENERGY, 3, add_once},
    {KT_COLUMN_WORK, KT_RECORD_BALANCE, KT_RECORD_BALANCE, 3, add_once},
    {KT_COLUMN_RESIDUAL, KT_RECORD_CONSTRAINT, KT_RECORD_CONSTRAINT, 2, add_once},
    {KT_COLUMN_SINGULAR_VALUE, KT_RECORD_SINGULAR_VALUE, KT_RECORD_SINGULAR_VALUE, 1, add_once},
    {KT_COLUMN_REACTION, KT_RECORD_REACTION, KT_RECORD_REACTION, 6, add_reactions},
    {KT_COLUMN_LOOP_REACTION, 0, KT_RECORD_REACTION, 0, NULL},
    {KT_COLUMN_BEARING, KT_RECORD_BEARING, KT_RECORD_REACTION, 6, add_bearings},
    {KT_COLUMN_MULTIPLIER, KT_RECORD_MULTIPLIER, KT_RECORD_MULTIPLIER, 0, add_all_multipliers},
    {KT_COLUMN_CLOSURE, KT_RECORD_CLOSURE, KT_RECORD_CLOSURE, 0, add_closures},
    {KT_COLUMN_EFFECT, KT_RECORD_EFFECT, KT_RECORD_EFFECT, 0, add_effect_columns},
};

/* Returns the set in which every switched loop and effect is on. Friction sticks in this set: the switch of its loop is
 * on, and the switch of its effect is off. */
static uint64_t full_set(const kt_model *model) {
    uint64_t set = 0;
    for (int k = 0; k < kt_switch_count(model); k++)
        set |= kt_switch_bits(model, k);
    for (int i = 0; i < kt_effect_count(model); i++)
        if (kt_effect_switch(model, i) >= 0 && kt_effect_stick_loop(model, i) >= 0)
            set &= ~kt_switch_bits(model, kt_effect_switch(model, i));
    return set;
}

/* Lists all columns, but allocates no memory for singular values. */
static bool list_all_columns(kt_columns *columns, const kt_scene *scene, const kt_model *model, const kt_run *run,
                             unsigned record) {
    /* All switched loops and effects are on, so that each has its columns. Their values are 0 while they are off. */
    const kt_model *all = kt_model_switched(model, full_set(model));
    *columns = (kt_columns){.model = all, .description = &scene->description, .record = record};
    bool fine = true;
    for (size_t i = 0; i < sizeof quantities / sizeof *quantities && fine; i++) {
        const recorded *quantity = &quantities[i];
        const size_t before = columns->count;
        if (quantity->source == KT_COLUMN_MARKER)
            fine = add_markers(columns, run);
        else if (quantity->add != NULL && (quantity->record == 0 || (record & quantity->record) != 0))
            fine = quantity->add(columns, quantity);
        const bool is_in_reactions =
            quantity->record == KT_RECORD_MULTIPLIER && (record & KT_RECORD_REACTION) != 0 && kt_loop_count(all) > 0;
        const bool is_of_loops = quantity->add == add_loop_coordinates;
        columns->empty |= columns->count == before && !is_in_reactions && !is_of_loops ? record & quantity->record : 0;
    }
    columns->empty |= run->marker_count == 0 ? record & (KT_RECORD_MARKER_VELOCITY | KT_RECORD_MARKER_ACCELERATION) : 0;
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
    const double *tables; /* of formulas, compiled, in the model */
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
    char text[NAME_SIZE];
    size_t found = strcmp(name, "t") == 0 ? 0 : kt_columns_find(all, name, 0);
    if (found == all->count && kt_auxiliary_state_find(all->model, name) >= 0) {
        (void)snprintf(text, sizeof text, "state.%s", name);
        found = kt_columns_find(all, text, 0);
    }
    *symbol = (kt_symbol){.index = (int)found};
    return found < all->count;
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
    for (size_t i = 0; i < sizeof quantities / sizeof *quantities; i++)
        if (quantities[i].source == source)
            return quantities[i].needs;
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
    const kt_symbols symbols = {.find = find_record_symbol,
                                .list = list_record_symbol,
                                .user = &own->all,
                                .tables = own->scene->description.tables,
                                .table_count = own->scene->description.table_count,
                                .compiled = own->tables};
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
    made->tables = kt_model_tables(model);
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
