/* Parameters that events set, or that a program varies (assignment.h): which numbers of a model follow from them, and
 * their new values. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/assignment.h"
#include "scene/foothold.h"

#include "base/sum.h"
#include "base/text.h"
#include "expression/expression.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"
#include "model/model.h"

#include <stdint.h>
#include <string.h>

bool kt_is_velocity_name(const char *name) { return kt_text_begins(name, "velocity."); }

bool kt_events_set(const kt_scene *scene, bool velocities) {
    bool any = false;
    for (int i = 0; i < scene->event_count; i++)
        for (int k = 0; k < scene->events[i].set_count; k++)
            any = any || kt_is_velocity_name(scene->events[i].sets[k].name) == velocities;
    return any;
}

bool kt_scene_needs_settable(const kt_scene *scene) {
    return scene != NULL && (kt_events_set(scene, false) || kt_footholds_count(scene) > 0);
}

/* ---- checksums --------------------------------------------------------------------------------------------------- */

static uint64_t sum_of_formula(uint64_t sum, const kt_expression *expression) {
    for (size_t i = 0; i < expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        const int32_t code[] = {term->code, term->code == KT_OPERATOR_SYMBOL ? term->symbol : 0};
        sum = kt_sum_add(kt_sum_add(sum, code, sizeof code), &term->number, sizeof term->number);
    }
    return sum;
}

/* The place of a number: a parameter of the scene, or a number of its description. */
static uint64_t sum_of_place(uint64_t sum, const kt_assigned_number *number) {
    const bool is_target = number->parameter < 0;
    const kt_parameter *of = &number->target.parameter;
    const int place[] = {is_target, (int)of->kind, is_target ? of->item : number->parameter, number->target.component};
    sum = kt_sum_add(sum, place, sizeof place);
    return is_target && of->key != NULL ? kt_sum_add_text(sum, of->key->name) : sum;
}

/* A checksum of the numbers that follow from the parameters that events set: their formulas and places. */
static uint64_t sum_of_numbers(uint64_t sum, const kt_scene *scene) {
    const kt_assigned_number *number;
    for (int k = 0; k < scene->parameter_count; k++) /* formulas refer to them with their index */
        sum = kt_sum_add_text(sum, scene->parameters[k].name);
    for (size_t k = 0; (number = kt_assignments_next(scene, &k)) != NULL;)
        if (number->expression != NULL)
            sum = sum_of_place(sum_of_formula(sum, number->expression), number);
    return sum;
}

uint64_t kt_scene_event_sum(const kt_scene *scene, const kt_scene_event *event) {
    if (!scene || !event)
        return 0;
    const int numbers[] = {(int)event->direction, event->record, event->stop, event->limit, event->switch_count};
    uint64_t sum = kt_sum_add_text(kt_sum_add_text(KT_SUM_START, event->name), event->when);
    sum = kt_sum_add(sum, numbers, sizeof numbers);
    for (int i = 0; i < event->switch_count; i++) {
        const int on = event->switches[i].on + 2 * event->switches[i].here;
        sum = kt_sum_add(kt_sum_add_text(sum, event->switches[i].name), &on, sizeof on);
    }
    for (int i = 0; i < event->set_count; i++)
        sum = kt_sum_add_text(kt_sum_add_text(sum, event->sets[i].name), event->sets[i].value);
    for (int i = 0; i < event->call_count; i++)
        sum = kt_sum_add_text(sum, event->call[i]);
    return event->set_count > 0 ? sum_of_numbers(sum, scene) : sum;
}

/* ---- binding ----------------------------------------------------------------------------------------------------- */

/* A number that follows. */
typedef struct bound_number {
    const kt_expression *expression; /* of parameters; NULL: the number `varied` of the scene */
    size_t varied;
    int parameter;         /* it is this one, */
    int change, component; /* or that number of this parameter of the model */
} bound_number;

struct kt_assignments {
    const kt_scene *scene; /* its variables are set; NULL: auxiliary states are */
    kt_model *model;
    double *parameters; /* values */
    int *state;         /* of each, its auxiliary state in the model; -1: none */
    bool *is_set;       /* of each */
    int parameter_count;
    bound_number *bound;
    int bound_count;
    kt_parameter_change *changes, *news; /* of all that follow, and of those that differ from the model's */
    double *inertia; /* six for each change of a mass whose body has the inertia of its shape: the inertia of a kg */
    int change_count;
    double *x; /* auxiliary states */
    int x_count;
};

/* The parameter of the model that a parameter of the description is. */
static bool find_model_parameter(const kt_scene *scene, const kt_model *model, kt_parameter *parameter) {
    const kt_description *d = &scene->description;
    const int item = parameter->item;
    parameter->item = -1;
    switch (parameter->kind) {
    case KT_PARAMETER_GRAVITY:
        parameter->item = 0;
        break;
    case KT_PARAMETER_LOOP_CURVE:
        parameter->item = kt_loop_find(model, d->loops[item].name);
        break;
    case KT_PARAMETER_EFFECT:
    case KT_PARAMETER_EFFECT_CURVE:
    case KT_PARAMETER_EFFECT_VALUE:
        for (size_t i = 0; i < model->n.effect + model->n.effect_off; i++)
            if (model->effect[i].source == item)
                parameter->item = (int)i;
        break;
    default:
        parameter->item = kt_body_find(model, d->bodies[item].name);
        if (parameter->kind == KT_PARAMETER_ARMATURE && parameter->item > 0)
            parameter->count = kt_body_coordinates(model, parameter->item).nv;
    }
    return parameter->item >= 0;
}

static bool parameters_are_same(const kt_parameter *a, const kt_parameter *b) {
    return a->kind == b->kind && a->item == b->item && a->key == b->key;
}

/* The index of the change of this parameter, a new one if need be. */
static kt_status find_parameter_change(kt_assignments *to, const kt_model *model, const kt_parameter *parameter,
                                       int *index, kt_error *error) {
    for (*index = 0; *index < to->change_count; (*index)++)
        if (parameters_are_same(&to->changes[*index].parameter, parameter))
            return KT_OK;
    kt_parameter_change *change = &to->changes[to->change_count++];
    change->parameter = *parameter;
    return kt_parameter_get(model, parameter, change->values, error);
}

/* For a mass with the inertia of a shape, keeps this inertia for each kg. */
static kt_status add_inertia(kt_assignments *to, const kt_model *model, int mass, kt_error *error) {
    const kt_parameter parameter = {.kind = KT_PARAMETER_INERTIA, .item = to->changes[mass].parameter.item, .count = 6};
    double *a_kg = to->inertia + 6 * (size_t)to->change_count;
    int index;
    const kt_status status = find_parameter_change(to, model, &parameter, &index, error);
    for (int k = 0; status == KT_OK && k < 6; k++)
        a_kg[k] = to->changes[index].values[k] / to->changes[mass].values[0];
    return status;
}

/* Binds a number that follows from an assigned parameter. A mass also changes the inertia that was computed from the
 * shape of the body. */
static kt_status add_assigned_number(kt_assignments *to, const kt_scene *scene, const kt_model *model,
                                     const kt_assigned_number *number, size_t varied, kt_error *error) {
    const kt_parameter *of = &number->target.parameter;
    kt_parameter parameter = *of;
    if (!find_model_parameter(scene, model, &parameter))
        return kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create",
                            "a number that follows from a parameter which an event sets is not in the model");
    bound_number *f = &to->bound[to->bound_count++];
    *f = (bound_number){
        .expression = number->expression, .varied = varied, .parameter = -1, .component = number->target.component};
    const int before = to->change_count;
    kt_status status = find_parameter_change(to, model, &parameter, &f->change, error);
    if (status == KT_OK && to->change_count > before && of->kind == KT_PARAMETER_MASS &&
        scene->description.bodies[of->item].inertia_of_shape)
        status = add_inertia(to, model, f->change, error);
    return status;
}

static bool take_assignment_memory(kt_pool *pool, kt_assignments *to, size_t numbers) {
    const size_t parameters = (size_t)to->parameter_count + 1, changes = 2 * numbers + 1;
    to->parameters = kt_pool_take(pool, parameters, sizeof *to->parameters);
    to->state = kt_pool_take(pool, parameters, sizeof *to->state);
    to->is_set = kt_pool_take(pool, parameters, sizeof *to->is_set);
    to->bound = kt_pool_take(pool, numbers + 1, sizeof *to->bound);
    to->changes = kt_pool_take(pool, changes, sizeof *to->changes);
    to->news = kt_pool_take(pool, changes, sizeof *to->news);
    to->inertia = kt_pool_take(pool, 6 * changes, sizeof *to->inertia);
    to->x = kt_pool_take(pool, (size_t)to->x_count + 1, sizeof *to->x);
    return to->parameters != NULL && to->state != NULL && to->is_set != NULL && to->bound != NULL &&
           to->changes != NULL && to->news != NULL && to->inertia != NULL && to->x != NULL;
}

static void bind_parameters(kt_assignments *to, const kt_scene *scene, const kt_model *model) {
    for (int k = 0; k < to->parameter_count; k++) {
        const kt_assigned_parameter parameter = kt_assignments_parameter(scene, k);
        to->parameters[k] = parameter.value;
        to->is_set[k] = parameter.is_set;
        to->state[k] =
            parameter.state < 0 ? -1 : kt_auxiliary_state_find(model, scene->description.states[parameter.state].name);
    }
}

/* Room for so many numbers; NULL: out of memory. */
static kt_assignments *start_assignments(kt_pool *pool, const kt_model *model, int parameters, int states,
                                         size_t numbers, kt_error *error) {
    kt_assignments *to = kt_pool_take(pool, 1, sizeof *to);
    if (to != NULL) {
        to->parameter_count = parameters;
        to->x_count = states;
        to->model = (kt_model *)(uintptr_t)model; /* that of the simulation, which may be set */
    }
    if (to != NULL && take_assignment_memory(pool, to, numbers))
        return to;
    (void)kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    return NULL;
}

kt_status kt_assignments_create(kt_pool *pool, const kt_scene *scene, const kt_model *model,
                                kt_assignments **assignments, kt_error *error) {
    const kt_assigned_number *next;
    size_t count = 0;
    *assignments = NULL;
    if (!kt_events_set(scene, false))
        return KT_OK;
    for (size_t k = 0; kt_assignments_next(scene, &k) != NULL;)
        count++;
    kt_assignments *to =
        start_assignments(pool, model, kt_assignments_parameters(scene), kt_auxiliary_state_count(model), count, error);
    if (to == NULL)
        return KT_ERROR_MEMORY;
    bind_parameters(to, scene, model);
    kt_status status = KT_OK;
    for (size_t k = 0; status == KT_OK && (next = kt_assignments_next(scene, &k)) != NULL;) {
        kt_assigned_number number = *next;
        number.expression = kt_expression_keep(pool, number.expression); /* the scene may be released before */
        if (number.expression == NULL)
            return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
        if (number.parameter >= 0 && !to->is_set[number.parameter])
            to->bound[to->bound_count++] =
                (bound_number){.expression = number.expression, .parameter = number.parameter};
        else if (number.parameter < 0)
            status = add_assigned_number(to, scene, model, &number, 0, error);
    }
    if (status == KT_OK && to->change_count > 0 && !model->placed && !model->settable)
        status = kt_error_set(error, KT_ERROR_ARGUMENT, "kt_scene_watch_create",
                              "events of the scene set parameters of its model, which is immutable: compile it with "
                              "kt_model_options.settable (kt_scene_needs_settable), or make a copy (kt_model_copy)");
    *assignments = to;
    return status;
}

kt_status kt_assignments_create_varied(kt_pool *pool, const kt_scene *scene, const kt_model *model,
                                       kt_assignments **assignments, kt_error *error) {
    const kt_assigned_number *next;
    size_t count = 0;
    for (size_t k = 0; kt_varied_next(scene, &k) != NULL;)
        count++;
    *assignments = start_assignments(pool, model, 0, 0, count, error);
    if (*assignments == NULL)
        return KT_ERROR_MEMORY;
    (*assignments)->scene = scene;
    kt_status status = KT_OK;
    for (size_t k = 0; status == KT_OK && (next = kt_varied_next(scene, &k)) != NULL;) {
        kt_assigned_number number = *next;
        number.expression = NULL;
        status = add_assigned_number(*assignments, scene, model, &number, k - 1, error);
    }
    return status;
}

/* ---- new values -------------------------------------------------------------------------------------------------- */

double *kt_assignments_states(kt_assignments *assignments, const kt_simulation *simulation) {
    memcpy(assignments->x, kt_simulation_auxiliary_states(simulation),
           (size_t)assignments->x_count * sizeof *assignments->x);
    return assignments->x;
}

/* Evaluates all that follows from the states, and lists the values that differ from the model. */
static kt_status evaluate_assignment(kt_assignments *r, int *count, kt_error *error) {
    for (int k = 0; k < r->parameter_count; k++)
        if (r->is_set[k] && r->state[k] >= 0)
            r->parameters[k] = r->x[r->state[k]];
    for (int i = 0; i < r->bound_count; i++) {
        const bound_number *f = &r->bound[i];
        const double value = f->expression != NULL ? kt_expression_evaluate(f->expression, r->parameters)
                                                   : kt_varied_value(r->scene, f->varied);
        if (f->parameter < 0) {
            r->changes[f->change].values[f->component] = value;
        } else {
            r->parameters[f->parameter] = value;
            r->x[r->state[f->parameter]] = value;
        }
    }
    *count = 0;
    for (int i = 0; i < r->change_count; i++) {
        double now[KT_PARAMETER_MAX], mass = 0.0;
        kt_parameter_change *change = &r->changes[i];
        const double *a_kg = r->inertia + 6 * (size_t)i;
        for (int k = 0; change->parameter.kind == KT_PARAMETER_INERTIA && k < 3; k++)
            mass = a_kg[k] != 0.0 ? r->changes[i - 1].values[0] : mass;
        for (int k = 0; mass != 0.0 && k < 6; k++)
            change->values[k] = mass * a_kg[k];
        const kt_status status = kt_parameter_get(r->model, &change->parameter, now, error);
        if (status != KT_OK)
            return status;
        if (memcmp(now, change->values, (size_t)change->parameter.count * sizeof *now) != 0)
            r->news[(*count)++] = *change;
    }
    return KT_OK;
}

kt_status kt_assignments_apply(kt_assignments *assignments, kt_simulation *simulation, kt_error *error) {
    int count = 0;
    kt_status status = evaluate_assignment(assignments, &count, error);
    if (status == KT_OK)
        status = kt_simulation_change(simulation, assignments->model, assignments->news, count,
                                      assignments->scene == NULL ? assignments->x : NULL, error);
    return status;
}

kt_status kt_assignments_sync(kt_assignments *assignments, const kt_simulation *simulation, kt_error *error) {
    int count = 0;
    (void)kt_assignments_states(assignments, simulation);
    kt_status status = evaluate_assignment(assignments, &count, error);
    for (int i = 0; status == KT_OK && i < count; i++)
        status =
            kt_parameter_set(assignments->model, &assignments->news[i].parameter, assignments->news[i].values, error);
    return status;
}
