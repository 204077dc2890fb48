/* Formulas whose variables are bound to a model (bound.h).
 *
 * A comparison a < b is watched as the difference b - a, which rises through zero when it begins to hold.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/bound.h"

#include "expression/expression.h"
#include "expression/margin.h"
#include "expression/part.h"
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "model/formula_names.h"
#include "scene/scene_event.h"

#include <stdlib.h>
#include <string.h>

/* ---- variables --------------------------------------------------------------------------------------------------- */

kt_status kt_variable_bind(const kt_description *description, const kt_model *model, const kt_variable *variable,
                           kt_bound *to, kt_error *error) {
    *to = (kt_bound){.type = variable->type, .component = variable->component};
    if (variable->type == KT_VARIABLE_TIME)
        return KT_OK;
    if (variable->type == KT_VARIABLE_STATE) {
        to->at = kt_auxiliary_state_find(model, description->states[variable->component].name);
        return to->at >= 0 ? KT_OK
                           : kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create", "the model has no state '%s'",
                                          description->states[variable->component].name);
    }
    const kt_body *body = &description->bodies[variable->body];
    to->body = kt_body_find(model, body->name);
    if (to->body <= 0)
        return kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create", "the model has no body '%s'", body->name);
    const kt_coordinates at = kt_body_coordinates(model, to->body);
    to->at = (variable->type == KT_VARIABLE_POSITION ? at.q : at.v) + variable->component;
    if (variable->type == KT_VARIABLE_MARKER || variable->type == KT_VARIABLE_MARKER_VELOCITY)
        to->point =
            kt_marker_at(model, to->body, kt_marker_find(model, to->body, body->markers[variable->marker].name));
    return KT_OK;
}

/* Symbols of a formula: the k-th that it names. */
typedef struct names {
    const kt_description *description;
    const kt_model *model;
    kt_bound *variables; /* NULL: they are not kept */
    int count, room;
    kt_status status; /* the reason if one of them is not in the model */
    kt_error *error;
} names;

/* Without `variables`, only tests whether a name is known. Otherwise each occurrence of a name gets a variable of its
 * own, except time. */
static bool find_variable(void *user, const char *name, kt_symbol *symbol) {
    names *n = user;
    kt_variable variable = {.type = KT_VARIABLE_STATE};
    const bool responds = !kt_variable_find(n->description, name, &variable);
    if (responds && !kt_response_is_named(n->description, name))
        return false;
    *symbol = (kt_symbol){.index = n->count};
    if (n->variables == NULL)
        return true;
    for (int k = 0; k < n->count; k++) /* time is one symbol, though named often: parts of time alone refer to it */
        if (variable.type == KT_VARIABLE_TIME && n->variables[k].type == KT_VARIABLE_TIME) {
            symbol->index = k;
            return true;
        }
    if (n->count == n->room)
        return false;
    kt_bound *to = &n->variables[n->count++];
    const kt_status status = responds ? kt_response_bind(n->description, n->model, name, &to->response, n->error)
                                      : kt_variable_bind(n->description, n->model, &variable, to, n->error);
    to->responds = responds;
    if (responds)
        to->type = KT_VARIABLE_STATE; /* none of time */
    n->status = n->status == KT_OK ? status : n->status;
    return true;
}

bool kt_formula_is_comparison(const kt_description *description, const char *text) {
    names any = {.description = description};
    const kt_symbols symbols = {
        .find = find_variable, .user = &any, .tables = description->tables, .table_count = description->table_count};
    const size_t size = kt_expression_size(text);
    const kt_expression *expression = NULL;
    kt_expression *memory = malloc(2 * size);
    const bool compares = memory != NULL &&
                          kt_expression_parse(text, &symbols, memory, size, &expression, NULL, NULL) == KT_OK &&
                          kt_expression_margin(expression, (kt_expression *)(void *)((char *)memory + size));
    free(memory);
    return compares;
}

/* ---- parts that depend on time alone ----------------------------------------------------------------------------- */

typedef struct parts {
    kt_pool *pool;
    kt_bound_formula *formula;
    bool failed;
} parts;

static void count_bound_part(void *user, const kt_expression_term *term, size_t count) {
    (void)term, (void)count;
    ((kt_bound_formula *)user)->part_count++;
}

static void keep_part(void *user, const kt_expression_term *term, size_t count) {
    parts *to = user;
    kt_expression *part = kt_pool_take(to->pool, kt_expression_part_size(count), 1);
    to->failed = to->failed || part == NULL;
    if (part != NULL)
        kt_expression_part_copy(term, count, part);
    to->formula->parts[to->formula->part_count++] = part;
}

/* Keeps the parts of a formula that depend on time alone: between their breakpoints they are monotone. */
static kt_status keep_parts(kt_pool *pool, kt_bound_formula *f, kt_error *error) {
    int32_t time = -1;
    for (int k = 0; k < f->count; k++)
        if (f->variables[k].type == KT_VARIABLE_TIME)
            time = k;
    kt_expression_parts(f->expression, time, count_bound_part, f);
    parts to = {.pool = pool, .formula = f};
    f->parts = kt_pool_take(pool, (size_t)f->part_count + 1, sizeof *f->parts);
    f->part_count = 0;
    if (f->parts != NULL)
        kt_expression_parts(f->expression, time, keep_part, &to);
    return f->parts == NULL || to.failed
               ? kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory")
               : KT_OK;
}

/* ---- formulas of events ------------------------------------------------------------------------------------------ */

/* Finds what the variables of a formula need at each evaluation, and takes its memory: kinematics (`moves`), quantities
 * of the accelerations (`responds`), gravity forces. Returns false if there is not enough memory. */
static bool take_needs_of_formula(const kt_binding *in, kt_bound_formula *to) {
    bool has_memory = true;
    for (int k = 0; k < to->count; k++) {
        const kt_bound *variable = &to->variables[k];
        if (variable->type == KT_VARIABLE_GRAVITY && !variable->responds && to->gravity == NULL) {
            to->gravity = kt_pool_take(in->pool, (size_t)kt_model_nv(in->model), sizeof *to->gravity);
            has_memory = has_memory && to->gravity != NULL;
        }
        to->moves = to->moves || variable->type == KT_VARIABLE_MARKER || variable->type == KT_VARIABLE_MARKER_VELOCITY;
        to->responds |= variable->responds ? kt_response_bit(&variable->response) : 0U;
    }
    to->moves = to->moves || to->responds != 0 || to->gravity != NULL;
    to->responses = in->responses;
    return has_memory &&
           (to->responds == 0 || in->responses->a != NULL || kt_responses_take(in->pool, in->model, in->responses));
}

/* Reads the formula of an event, and binds its variables to quantities of the model. A formula that is watched is
 * replaced by its margin if it has one, and its parts that depend on time alone are stored. */
kt_status kt_formula_bind(const kt_binding *in, const kt_scene *scene, const char *text, bool is_watched,
                          kt_bound_formula *to, kt_error *error) {
    kt_pool *pool = in->pool;
    const size_t size = kt_expression_size(text), room = strlen(text);
    names n = {.description = &scene->description,
               .model = in->model,
               .variables = kt_pool_take(pool, room + 1, sizeof(kt_bound)),
               .room = (int)room,
               .error = error};
    const kt_symbols symbols = {.find = find_variable,
                                .user = &n,
                                .tables = scene->description.tables,
                                .table_count = scene->description.table_count,
                                .compiled = kt_model_tables(in->model)};
    const kt_expression *expression = NULL;
    to->expression = kt_pool_take(pool, size, 1);
    kt_expression *margin = is_watched ? kt_pool_take(pool, size, 1) : NULL;
    if (n.variables == NULL || to->expression == NULL || (is_watched && margin == NULL))
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    kt_status status = kt_expression_parse(text, &symbols, to->expression, size, &expression, NULL, error);
    if (status != KT_OK || n.status != KT_OK)
        return status != KT_OK ? status : n.status;
    if (is_watched && kt_expression_margin(expression, margin))
        to->expression = margin;
    to->count = n.count;
    to->variables = n.variables;
    to->values = kt_pool_take(pool, (size_t)n.count + 1, sizeof *to->values);
    if (!take_needs_of_formula(in, to) || to->values == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    return is_watched ? keep_parts(pool, to, error) : KT_OK;
}

/* Requires kinematics of the instant for markers. */
static double bound_value_of(const kt_instant *at, const double *gravity, const kt_bound *variable) {
    kt_vec3 point = {0.0, 0.0, 0.0};
    switch (variable->type) {
    case KT_VARIABLE_TIME:
        return at->t;
    case KT_VARIABLE_POSITION:
        return at->q[variable->at];
    case KT_VARIABLE_VELOCITY:
        return at->v[variable->at];
    case KT_VARIABLE_STATE:
        return at->x[variable->at];
    case KT_VARIABLE_GRAVITY:
        return gravity[variable->at];
    case KT_VARIABLE_MARKER:
        point = kt_point_position(at->model, at->data, variable->body, variable->point);
        break;
    case KT_VARIABLE_MARKER_VELOCITY:
        point = kt_point_velocity(at->model, at->data, variable->body, variable->point);
        break;
    }
    return variable->component == 0 ? point.x : variable->component == 1 ? point.y : point.z;
}

int kt_bound_evaluate(kt_bound_formula *f, const kt_instant *at, double *value, kt_error *error) {
    if (f->responds != 0 && kt_responses_evaluate(f->responses, f->responds, at, error) != KT_OK)
        return 1;
    if (f->responds == 0 && f->moves && kt_kinematics_update(at->model, at->data, at->q, at->v, NULL, error) != KT_OK)
        return 1;
    if (f->gravity != NULL &&
        (kt_masses_update(at->model, at->data, at->t, error) != KT_OK ||
         kt_dynamics_inverse(at->model, at->data, at->q, NULL, NULL, NULL, f->gravity, error) != KT_OK))
        return 1;
    for (int k = 0; k < f->count; k++)
        f->values[k] = f->variables[k].responds ? kt_response_value(f->responses, &f->variables[k].response)
                                                : bound_value_of(at, f->gravity, &f->variables[k]);
    *value = kt_expression_evaluate(f->expression, f->values);
    return 0;
}
