/* Own columns of a scene (kt_scene_column): formulas over all columns that records of its model may have, recorded or not.
 * Only the columns that formulas read are computed.
 */
#include "records/columns.h"

#include "kinetree/dynamics.h"
#include "kinetree/expression.h"
#include "text/list.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_SIZE = 600 };

struct kt_own_columns {
    kt_columns all; /* of all kinds, and of all markers */
    bool *is_used;  /* [all.count]: by a formula */
    const kt_scene *scene;
    void **memory; /* of each formula */
    const kt_expression **formula;
};

static kt_status no_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
}

/* ---- all columns ------------------------------------------------------------------------------------------------- */

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

static bool list_all(kt_columns *all, const kt_model *model) {
#define RECORD_OR(id, bit, name) | bit
    static const unsigned every = 0U KT_RECORD_LIST(RECORD_OR);
#undef RECORD_OR
    kt_run run = kt_run_default();
    kt_marker_pair *markers = list_all_markers(model, &run.marker_count);
    run.markers = markers;
    const bool fine = markers != NULL && kt_columns_list(all, model, &run, every);
    free(markers);
    return fine;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

static bool find_name(void *user, const char *name, kt_symbol *symbol) {
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

static const char *list_name(void *user, int k) {
    static char text[NAME_SIZE]; /* of a command, which has one thread; read before the next call */
    const kt_columns *all = user;
    if ((size_t)k >= all->count)
        return NULL;
    (void)kt_column_name(all, (size_t)k, text, sizeof text);
    return text;
}

/* ---- what is needed ---------------------------------------------------------------------------------------------- */

/* The bits that a simulation computes for a column. */
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

/* Columns that are computed together begin with component 0. */
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

static kt_status read_formula(kt_own_columns *own, int k, unsigned *record, kt_error *error) {
    const kt_scene_column *column = &own->scene->columns[k];
    const kt_symbols symbols = {.find = find_name, .list = list_name, .user = &own->all};
    const size_t size = kt_expression_size(column->formula);
    kt_error from = {0};
    own->memory[k] = malloc(size);
    if (own->memory[k] == NULL)
        return no_memory(error);
    const kt_status status =
        kt_expression_parse(column->formula, &symbols, own->memory[k], size, &own->formula[k], NULL, &from);
    if (status != KT_OK) {
        char where[KT_WHERE_SIZE];
        (void)snprintf(where, sizeof where, "output.columns.%.100s", column->name);
        return kt_error_set(error, KT_ERROR_SCENE, where, "%s", from.message);
    }
    *record |= use_symbols(own, own->formula[k]);
    return KT_OK;
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

void kt_own_columns_free(kt_own_columns *own) {
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

kt_status kt_own_columns_create(const kt_scene *scene, const kt_model *model, kt_own_columns **own, unsigned *record,
                                kt_error *error) {
    kt_own_columns *made = calloc(1, sizeof *made);
    *own = NULL;
    *record = 0;
    if (made == NULL)
        return no_memory(error);
    made->scene = scene;
    made->memory = calloc((size_t)scene->column_count + 1, sizeof *made->memory);
    made->formula = calloc((size_t)scene->column_count + 1, sizeof *made->formula);
    const bool fine = made->memory != NULL && made->formula != NULL && list_all(&made->all, model);
    made->is_used = fine ? calloc(made->all.count + 1, sizeof *made->is_used) : NULL;
    kt_status status = made->is_used != NULL ? KT_OK : no_memory(error);
    for (int k = 0; k < scene->column_count && status == KT_OK; k++)
        status = read_formula(made, k, record, error);
    if (status == KT_OK)
        *own = made;
    else
        kt_own_columns_free(made);
    return status;
}

void kt_own_columns_evaluate(kt_own_columns *own, const kt_record *record, double *values) {
    own->all.is_used = own->is_used;
    const double *all = kt_columns_evaluate(&own->all, record);
    for (int k = 0; k < own->scene->column_count; k++)
        values[k] = kt_expression_evaluate(own->formula[k], all);
}

const char *kt_own_column_name(const kt_own_columns *own, int column) { return own->scene->columns[column].name; }
int kt_own_column_count(const kt_own_columns *own) { return own != NULL ? own->scene->column_count : 0; }
