/* Numbers that follow from variables, or from parameters that events set. Such numbers are listed while a scene is
 * read, and get new values later (kt_scene_vary; assignment.c).
 *
 * Numbers are listed in the order in which they are read. Parameters come before all else, and each after those that it
 * uses. A walk along the list therefore finds everything evaluated that an expression needs.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/vary.h"

#include "base/require.h"
#include "expression/expression.h"
#include "scene/assignment.h"
#include "scene/foothold.h"
#include "scene/scene_expression.h" /* kt_named_number */
#include "scene/scene_parameter.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* A number of the scene. */
typedef struct kt_bound_number {
    const kt_expression *expression; /* of parameters; NULL: the value of a variable */
    int variable;
    bool positive;    /* others are rejected */
    bool is_assigned; /* it follows from a parameter that an event sets */
    bool is_offset;   /* it lies in the struct kt_scene, which its owner may move */
    bool is_target;   /* it is a number that can change while a scene runs, assigned.target */
    double *at;
    size_t offset;
    kt_node *node;               /* while the scene is read */
    kt_assigned_number assigned; /* once the scene has been read */
} kt_bound_number;

/* A value that has been read and depends on a variable, until a reader has recorded its final place. */
typedef struct kt_pending_binding {
    kt_node *node;
    const kt_expression *expression; /* a copy, as long as the scene; NULL: the value of a variable, or no number */
    bool is_assigned;                /* it depends on a parameter that an event sets */
} kt_pending_binding;

struct kt_scene_variables {
    kt_bound_number *bound;
    size_t count, room;
    int variable_count, first_setting;
    double *values;     /* of the variables, now */
    double *parameters; /* values of all parameters, now */
    int parameter_count;
    int *
        assigned_state; /* of each parameter: the index of its state in the description if it follows events; else -1 */
    bool *is_set;       /* of each: an event sets it */
    int assigned_count; /* how many follow events; the states are the first ones */
    kt_pending_binding *pending; /* while the scene is read */
    size_t pending_count, pending_room;
    kt_node *copied;           /* while the scene is read: a number of which another item has a copy; NULL: none */
    bool is_fixed;             /* a value was made that cannot be changed */
    char where[KT_WHERE_SIZE]; /* the place of the first such value */
};

/* ---- while a scene is read --------------------------------------------------------------------------------------- */

void kt_varying_start(kt_reader *r, const kt_scene_options *options) {
    const int count = options != NULL ? options->variable_count : 0;
    if (count == 0 && !kt_assignments_exist(r))
        return;
    kt_scene_variables *v = kt_reader_take(r, &r->keep, 1, sizeof *v);
    double *values = kt_reader_take(r, &r->keep, (size_t)count + 1, sizeof *values);
    if (v == NULL || values == NULL)
        return;
    if (count > 0)
        memcpy(values, options->values, (size_t)count * sizeof *values);
    v->values = values;
    v->variable_count = count;
    v->first_setting = options != NULL ? options->setting_count : 0;
    r->scene->varying = v;
}

/* The variable that a node is the value of; -1: of none. */
static int node_variable_of(const kt_scene_variables *v, const kt_node *node) {
    if (node->line < KT_SETTING_LINE)
        return -1;
    const int k = (int)(node->line - KT_SETTING_LINE) - v->first_setting;
    return k < v->variable_count ? k : -1;
}

bool kt_is_varied(const kt_reader *r, const kt_node *node) {
    return r->scene->varying != NULL && node_variable_of(r->scene->varying, node) >= 0;
}

/* Whether an expression depends on a variable; *is_assigned: on a parameter that an event sets. */
static bool depends(const kt_reader *r, const kt_expression *expression, bool *is_assigned) {
    bool varies = false;
    *is_assigned = false;
    for (size_t i = 0; i < expression->count; i++)
        if (expression->term[i].code == KT_OPERATOR_SYMBOL) {
            varies = varies || r->scene->parameters[expression->term[i].symbol].varies;
            *is_assigned = *is_assigned || r->scene->parameters[expression->term[i].symbol].is_assigned;
        }
    return varies;
}

static void add_pending_binding(kt_reader *r, kt_node *node, const kt_expression *expression, bool is_assigned) {
    kt_scene_variables *v = r->scene->varying;
    kt_pending_binding *pending =
        kt_reader_grow(r, &r->scratch, v->pending, v->pending_count, 1, &v->pending_room, sizeof *pending);
    if (pending == NULL)
        return;
    pending[v->pending_count++] = (kt_pending_binding){node, expression, is_assigned};
    v->pending = pending;
    node->follows = true;
}

void kt_varying_note_fixed(kt_reader *r, kt_node *node, bool is_assigned) {
    if (r->scene->varying != NULL)
        add_pending_binding(r, node, NULL, is_assigned);
}

void kt_varying_note(kt_reader *r, kt_node *node, const kt_expression *expression) {
    bool is_assigned = false;
    if (r->scene->varying == NULL || !(expression != NULL ? depends(r, expression, &is_assigned) || is_assigned
                                                          : node_variable_of(r->scene->varying, node) >= 0))
        return;
    const kt_expression *kept = expression != NULL ? kt_expression_keep(&r->keep, expression) : NULL;
    if (kept == NULL && expression != NULL)
        (void)kt_reader_out_of_memory(r);
    else
        add_pending_binding(r, node, kept, is_assigned);
}

const kt_expression *kt_expression_keep(kt_pool *pool, const kt_expression *expression) {
    const size_t size = sizeof *expression + expression->count * sizeof expression->term[0];
    kt_expression *kept = kt_pool_take(pool, 1, size);
    if (kept != NULL)
        memcpy(kept, expression, size);
    return kept;
}

static kt_bound_number *add_bound_number(kt_reader *r) {
    kt_scene_variables *v = r->scene->varying;
    kt_bound_number *bound = kt_reader_grow(r, &r->keep, v->bound, v->count, 1, &v->room, sizeof *bound);
    if (bound == NULL)
        return NULL;
    v->bound = bound;
    return &bound[v->count++];
}

/* Removes the last note of a node from the list, and returns it. */
static kt_pending_binding take_pending(kt_scene_variables *v, const kt_node *node) {
    size_t k = v->pending_count - 1;
    while (v->pending[k].node != node)
        k--;
    const kt_pending_binding found = v->pending[k];
    memmove(&v->pending[k], &v->pending[k + 1], (v->pending_count - k - 1) * sizeof found);
    v->pending_count--;
    return found;
}

bool kt_number_follows(kt_reader *r, kt_node *node, bool positive, double *at) {
    if (r->scene->varying == NULL || !node->follows || r->out_of_memory)
        return false;
    kt_bound_number *number = add_bound_number(r);
    if (number == NULL)
        return false;
    const kt_pending_binding pending = take_pending(r->scene->varying, node);
    *number = (kt_bound_number){.expression = pending.expression,
                                .variable = pending.expression == NULL ? node_variable_of(r->scene->varying, node) : -1,
                                .positive = positive,
                                .is_assigned = pending.is_assigned,
                                .node = node};
    number->at = at;
    node->follows = false;
    return true;
}

void kt_number_follows_too(kt_reader *r, double *at) {
    kt_bound_number *number = add_bound_number(r);
    if (number == NULL)
        return;
    *number = number[-1];
    number->at = at;
}

void kt_numbers_follow(kt_reader *r, const kt_node *list, double *at) {
    int k = 0;
    for (kt_node *item = list->of.first; r->scene->varying != NULL && item != NULL; item = item->next)
        (void)kt_number_follows(r, item, false, &at[k++]);
}

/* ---- once it has been read --------------------------------------------------------------------------------------- */

static double *bound_place_of(const kt_bound_number *number, kt_scene *scene) {
    return number->is_offset ? (double *)(void *)((char *)scene + number->offset) : number->at;
}

/* Whether a number lies in `size` bytes from an address on, which may be released by now. */
static bool lies_within(const kt_bound_number *number, const void *from, size_t size) {
    const uintptr_t at = (uintptr_t)number->at, begin = (uintptr_t)from;
    return !number->is_offset && at >= begin && at < begin + size;
}

static void move_numbers(kt_scene_variables *v, const void *from, size_t size, void *to) {
    for (size_t i = 0; v != NULL && i < v->count; i++)
        if (lies_within(&v->bound[i], from, size))
            v->bound[i].at = (double *)(void *)((char *)to + ((uintptr_t)v->bound[i].at - (uintptr_t)from));
}

void kt_numbers_move(const kt_scene *scene, const void *from, size_t size, void *to) {
    move_numbers(scene->variables, from, size, to);
}

void kt_varying_move(kt_reader *r, const void *from, size_t size, void *to) {
    move_numbers(r->scene->varying, from, size, to);
}

void kt_varying_copied(kt_reader *r, const void *from, size_t size) {
    kt_scene_variables *v = r->scene->varying;
    for (size_t i = 0; v != NULL && i < v->count; i++)
        if (lies_within(&v->bound[i], from, size) && v->copied == NULL)
            v->copied = v->bound[i].node;
}

static double bound_number_value(const kt_scene_variables *v, const kt_bound_number *number, const double *values) {
    return number->expression != NULL ? kt_expression_evaluate(number->expression, v->parameters)
                                      : values[number->variable];
}

/* Whether a number is at its final place in the scene, and still has the value that was read. */
static bool is_in_place(const kt_reader *r, kt_bound_number *number, kt_scene *scene) {
    const uintptr_t at = (uintptr_t)number->at, begin = (uintptr_t)scene;
    number->is_offset = at >= begin && at < begin + sizeof *scene;
    number->offset = number->is_offset ? (size_t)(at - begin) : 0;
    if (!number->is_offset && !kt_pool_has(&r->keep, number->at))
        return false;
    return *bound_place_of(number, scene) == bound_number_value(r->scene->varying, number, r->scene->varying->values);
}

/* Reports a value that an event cannot change although it depends on a parameter that the event sets. */
static void reject_assignment(kt_reader *r, kt_node *node) {
    (void)kt_fault_at(r, KT_ERROR_SCENE, NULL, node,
                      "an event sets a parameter of %s, which cannot change during a run. These numbers can: masses, "
                      "centres, inertias and armatures of bodies, gravity, numbers and constant functions of effects "
                      "and loops, and formulas of forces, rates, events and columns. Use another parameter here",
                      node->kind == KT_NODE_TEXT ? kt_name_quote(node->of.text).text : "this");
}

/* Records which number of the description each bound number is. */
static void check_assignments(kt_reader *r, const kt_scene *scene) {
    kt_scene_variables *v = r->scene->varying;
    for (size_t i = 0; i < v->pending_count; i++)
        if (v->pending[i].is_assigned)
            reject_assignment(r, v->pending[i].node);
    for (size_t i = 0; i < v->count; i++) {
        kt_bound_number *number = &v->bound[i];
        const double *at = number->at;
        const bool is_parameter = r->scene->parameter_count > 0 && at >= r->scene->parameter_values &&
                                  at < r->scene->parameter_values + r->scene->parameter_count;
        number->assigned = (kt_assigned_number){
            .expression = number->expression, .parameter = is_parameter ? (int)(at - r->scene->parameter_values) : -1};
        number->is_target = !is_parameter && kt_assignment_target_of(&scene->description, at, &number->assigned.target);
        if (number->is_assigned && !is_parameter && !number->is_target)
            reject_assignment(r, number->node);
        number->node = NULL;
    }
}

void kt_varying_finish(kt_reader *r, const char *path, kt_scene *scene) {
    kt_scene_variables *v = r->scene->varying;
    if (v == NULL)
        return;
    check_assignments(r, scene);
    const kt_node *fixed = v->pending_count > 0 ? v->pending[0].node : v->copied;
    bool follows = fixed == NULL;
    v->parameters = r->scene->parameter_values;
    for (size_t i = 0; i < v->count; i++) /* all: also those of a scene that has to be read anew may be set by events */
        follows = is_in_place(r, &v->bound[i], scene) && follows;
    v->is_fixed = !follows;
    if (fixed != NULL)
        kt_reader_where(r, path, fixed->line, fixed->column, v->where);
    else
        (void)snprintf(v->where, KT_WHERE_SIZE, "%s", path);
    v->pending = NULL;
    v->copied = NULL;
    scene->variables = v;
}

/* ---- parameters that events set ---------------------------------------------------------------------------------- */

void kt_assignments_add_states(kt_reader *r, kt_description *description) {
    kt_scene_variables *v = r->scene->varying;
    if (v == NULL || r->scene->parameter_count == 0)
        return;
    const size_t count = (size_t)r->scene->parameter_count;
    kt_auxiliary_state *states = kt_reader_take(r, &r->keep, count, sizeof *states);
    v->assigned_state = kt_reader_take(r, &r->keep, count, sizeof *v->assigned_state);
    v->is_set = kt_reader_take(r, &r->keep, count, sizeof *v->is_set);
    r->scene->state_nodes = kt_reader_take(r, &r->scratch, count, sizeof(kt_node *));
    if (states == NULL || v->assigned_state == NULL || v->is_set == NULL || r->scene->state_nodes == NULL)
        return;
    v->parameter_count = r->scene->parameter_count;
    for (int k = 0; k < r->scene->parameter_count; k++) {
        const kt_named_number *parameter = &r->scene->parameters[k];
        v->assigned_state[k] = parameter->is_assigned ? v->assigned_count : -1;
        v->is_set[k] = parameter->is_set;
        if (!parameter->is_assigned)
            continue;
        r->scene->state_nodes[v->assigned_count] = parameter->node;
        states[v->assigned_count++] =
            (kt_auxiliary_state){.name = kt_pool_text(&r->keep, parameter->name, strlen(parameter->name)),
                                 .initial = parameter->is_known ? parameter->value : 0.0,
                                 .rate = "0"};
    }
    description->states = v->assigned_count > 0 ? states : NULL;
    description->state_count = v->assigned_count;
}

int kt_assignments_parameters(const kt_scene *scene) {
    return scene->variables != NULL && scene->variables->assigned_count > 0 ? scene->variables->parameter_count : 0;
}

kt_assigned_parameter kt_assignments_parameter(const kt_scene *scene, int k) {
    const kt_scene_variables *v = scene->variables;
    return (kt_assigned_parameter){.value = v->parameters[k], .state = v->assigned_state[k], .is_set = v->is_set[k]};
}

/* The next number from the *k-th on that is assigned, or a target. */
static const kt_assigned_number *next_bound(const kt_scene_variables *v, bool is_target, size_t *k) {
    while (v != NULL && *k < v->count && !(is_target ? v->bound[*k].is_target : v->bound[*k].is_assigned))
        (*k)++;
    return v != NULL && *k < v->count ? &v->bound[(*k)++].assigned : NULL;
}

const kt_assigned_number *kt_assignments_next(const kt_scene *scene, size_t *k) {
    return next_bound(scene->variables, false, k);
}

/* ---- numbers of a running simulation ----------------------------------------------------------------------------- */

bool kt_scene_is_tunable(const kt_scene *scene) {
    const kt_scene_variables *v = scene != NULL ? scene->variables : NULL;
    bool any = false, all = v != NULL && v->variable_count > 0 && !v->is_fixed;
    for (size_t i = 0; all && i < v->count; i++) {
        const kt_bound_number *number = &v->bound[i];
        all = !number->is_assigned && (number->is_target || number->assigned.parameter >= 0);
        any = any || number->is_target;
    }
    return any && all;
}

bool kt_scene_parameter_follows(const kt_scene *scene, int k) {
    const kt_scene_variables *v = scene != NULL ? scene->variables : NULL;
    for (size_t i = 0; v != NULL && i < v->count; i++)
        if (v->bound[i].expression != NULL && v->bound[i].assigned.parameter == k && k >= 0)
            return v->variable_count > 0;
    return false;
}

const kt_assigned_number *kt_varied_next(const kt_scene *scene, size_t *k) {
    return next_bound(scene->variables, true, k);
}

double kt_varied_value(const kt_scene *scene, size_t k) {
    return *bound_place_of(&scene->variables->bound[k], (kt_scene *)(uintptr_t)scene);
}

const double *kt_varied_values(const kt_scene *scene, size_t *count) {
    *count = scene->variables != NULL ? (size_t)scene->variables->variable_count : 0;
    return *count > 0 ? scene->variables->values : NULL;
}

/* ---- new values -------------------------------------------------------------------------------------------------- */

/* Puts the numbers into the scene. Returns NULL, or the first invalid number: the scene is then partly new. */
static const kt_bound_number *put_bound_numbers(kt_scene *scene, const double *values) {
    const kt_scene_variables *v = scene->variables;
    for (size_t i = 0; i < v->count; i++) {
        const kt_bound_number *number = &v->bound[i];
        const double value = bound_number_value(v, number, values);
        if (!isfinite(value) || (number->positive && !(value > 0.0)))
            return number;
        *bound_place_of(number, scene) = value;
    }
    for (int k = 0; k < scene->parameter_count; k++)
        scene->parameters[k].value = v->parameters[k];
    kt_auxiliary_state *states = (kt_auxiliary_state *)(uintptr_t)scene->description.states; /* the scene's own */
    for (int k = 0; k < v->parameter_count && v->assigned_count > 0; k++)
        if (v->assigned_state[k] >= 0)
            states[v->assigned_state[k]].initial = v->parameters[k];
    kt_footholds_measure(scene);
    return NULL;
}

kt_status kt_scene_vary(kt_scene *scene, const double *values, kt_error *error) {
    if (KT_IS_MISSING(error, scene, values))
        return KT_ERROR_ARGUMENT;
    kt_scene_variables *v = scene->variables;
    if (v == NULL || v->variable_count == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_scene_vary",
                            "the scene was read without variables; name them in kt_scene_options");
    if (v->is_fixed)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, v->where,
                            "a variable changes more than numbers here; read the scene again for other values");
    for (int k = 0; k < v->variable_count; k++)
        if (!isfinite(values[k]))
            return kt_error_set(error, KT_ERROR_SCENE, "kt_scene_vary", "variable %d is not finite", k);
    if (put_bound_numbers(scene, values) != NULL) {
        (void)put_bound_numbers(scene, v->values);
        return kt_error_set(error, KT_ERROR_SCENE, "kt_scene_vary",
                            "a number that follows from these values is not finite, or not above 0 as it must be; read "
                            "the scene with these values to find the number");
    }
    memcpy(v->values, values, (size_t)v->variable_count * sizeof *values);
    return KT_OK;
}
