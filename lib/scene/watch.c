/* Events of a scene in a simulation: their formulas, with the variables that they read bound to the simulation's model.
 *
 * A comparison a < b is watched as the difference b - a, which rises through zero when it begins to hold.
 */
#include "base/require.h"
#include "document/pool.h"
#include "expression/expression.h"
#include "expression/part.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "scene/event.h"
#include "scene/impulse.h"
#include "scene/reset.h"
#include "scene/response.h"
#include "simulation/feature.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* A variable of a formula in a model. */
typedef struct bound {
    kt_variable_type type;
    int body, at, component; /* at: in q, v or gravity forces, or of auxiliary states */
    kt_vec3 point;           /* of a marker, in the body's frame */
    bool responds;           /* the variable is `response` instead */
    kt_response response;
} bound;

typedef struct formula {
    kt_expression *expression; /* of a comparison: its difference */
    double sign;               /* of the value that is watched */
    bound *variables;
    double *values;
    int count;
    bool moves;        /* a marker or another quantity that needs data is among them */
    double *gravity;   /* gravity forces of all joints; NULL: none is among them */
    unsigned responds; /* bits of accelerations and reactions among them (kt_response_bit) */
    kt_responses *responses;
    kt_expression **parts; /* those that depend on time alone */
    int part_count;
} formula;

/* The data of an event's functions. */
typedef struct watched {
    formula formula;
    const kt_scene_call **calls;
    int call_count;
    uint64_t on, off;          /* the switches that it engages and releases */
    uint64_t acting, released; /* likewise of hard stops, contacts, slack ropes and joint friction that sticks */
    formula *values;           /* of the auxiliary states and velocities that it sets */
    int *states;               /* these: the indices of states; those of velocities lie behind them */
    double *velocities;        /* what they become */
    int state_count, set_count;
    const kt_scene_watch *watch;
    kt_simulation *simulation;
} watched;

struct kt_scene_watch {
    kt_pool pool;
    watched *watched;
    watched *until; /* a comparison; NULL: there is none, or `until` is none */
    const kt_model *model;
    kt_data *data;          /* of the model; NULL: neither values that are set nor `until` need markers */
    kt_resets *resets;      /* NULL: events set no parameters and no states */
    kt_impulses *impulses;  /* NULL: events set no velocities */
    kt_responses responses; /* `a` is NULL: no formula has any */
};

/* Symbols of a formula: the k-th that it names. */
typedef struct names {
    const kt_description *description;
    const kt_model *model;
    bound *variables; /* NULL: they are not kept */
    int count, room;
    kt_status status; /* the reason if one of them is not in the model */
    kt_error *error;
} names;

static kt_status bind(const kt_description *description, const kt_model *model, const kt_variable *variable, bound *to,
                      kt_error *error);

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
    bound *to = &n->variables[n->count++];
    const kt_status status = responds ? kt_response_bind(n->description, n->model, name, &to->response, n->error)
                                      : bind(n->description, n->model, &variable, to, n->error);
    to->responds = responds;
    if (responds)
        to->type = KT_VARIABLE_STATE; /* none of time */
    n->status = n->status == KT_OK ? status : n->status;
    return true;
}

/* Whether the last operator compares, and the sign with which the difference of its sides rises as it becomes true. */
static bool is_comparison(const kt_expression *expression, double *sign) {
    const int32_t code = expression->count > 0 ? expression->term[expression->count - 1].code : 0;
    *sign = code == KT_OPERATOR_LESS || code == KT_OPERATOR_LESS_EQUAL ? -1.0 : 1.0;
    return code == KT_OPERATOR_LESS || code == KT_OPERATOR_LESS_EQUAL || code == KT_OPERATOR_GREATER ||
           code == KT_OPERATOR_GREATER_EQUAL;
}

bool kt_formula_is_comparison(const kt_description *description, const char *text) {
    names any = {.description = description};
    const kt_symbols symbols = {.find = find_variable, .user = &any};
    const size_t size = kt_expression_size(text);
    const kt_expression *expression = NULL;
    double sign;
    void *memory = malloc(size);
    const bool compares = memory != NULL &&
                          kt_expression_parse(text, &symbols, memory, size, &expression, NULL, NULL) == KT_OK &&
                          is_comparison(expression, &sign);
    free(memory);
    return compares;
}

static kt_status bind(const kt_description *description, const kt_model *model, const kt_variable *variable, bound *to,
                      kt_error *error) {
    *to = (bound){.type = variable->type, .component = variable->component};
    if (variable->type == KT_VARIABLE_TIME)
        return KT_OK;
    if (variable->type == KT_VARIABLE_STATE) {
        to->at = kt_own_state_find(model, description->states[variable->component].name);
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

/* ---- parts that depend on time alone ----------------------------------------------------------------------------- */

typedef struct parts {
    kt_pool *pool;
    formula *formula;
    bool failed;
} parts;

static void count_part(void *user, const kt_expression_term *term, size_t count) {
    (void)term, (void)count;
    ((formula *)user)->part_count++;
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
static kt_status keep_parts(kt_pool *pool, formula *f, kt_error *error) {
    int32_t time = -1;
    for (int k = 0; k < f->count; k++)
        if (f->variables[k].type == KT_VARIABLE_TIME)
            time = k;
    kt_expression_parts(f->expression, time, count_part, f);
    parts to = {.pool = pool, .formula = f};
    f->parts = kt_pool_take(pool, (size_t)f->part_count + 1, sizeof *f->parts);
    f->part_count = 0;
    if (f->parts != NULL)
        kt_expression_parts(f->expression, time, keep_part, &to);
    return f->parts == NULL || to.failed
               ? kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory")
               : KT_OK;
}

/* The first breakpoint after t of the parts that depend on time alone (kt_event.corner). */
static double next_corner(void *user, double t) {
    const watched *w = user;
    return kt_simulation_next_feature(w->simulation, (const kt_expression *const *)w->formula.parts,
                                      w->formula.part_count, t);
}

/* ---- formulas of events ------------------------------------------------------------------------------------------ */

/* Reads the formula of an event, and binds its variables to the model. For a comparison that is watched, it takes the
 * difference of both sides. */
static kt_status make_formula(kt_scene_watch *watch, const kt_scene *scene, const char *text, bool is_watched,
                              formula *to, kt_error *error) {
    kt_pool *pool = &watch->pool;
    const size_t size = kt_expression_size(text), room = strlen(text);
    names n = {.description = &scene->description,
               .model = watch->model,
               .variables = kt_pool_take(pool, room + 1, sizeof(bound)),
               .room = (int)room,
               .error = error};
    const kt_symbols symbols = {.find = find_variable, .user = &n};
    const kt_expression *expression = NULL;
    to->expression = kt_pool_take(pool, size, 1);
    if (n.variables == NULL || to->expression == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    kt_status status = kt_expression_parse(text, &symbols, to->expression, size, &expression, NULL, error);
    if (status != KT_OK || n.status != KT_OK)
        return status != KT_OK ? status : n.status;
    to->sign = 1.0;
    if (is_watched && is_comparison(expression, &to->sign))
        to->expression->term[to->expression->count - 1].code = KT_OPERATOR_SUBTRACT;
    to->count = n.count;
    to->variables = n.variables;
    to->values = kt_pool_take(pool, (size_t)n.count + 1, sizeof *to->values);
    bool has_memory = to->values != NULL;
    for (int k = 0; k < n.count; k++) {
        const bound *variable = &to->variables[k];
        if (variable->type == KT_VARIABLE_GRAVITY && !variable->responds && to->gravity == NULL) {
            to->gravity = kt_pool_take(pool, (size_t)kt_model_nv(watch->model), sizeof *to->gravity);
            has_memory = has_memory && to->gravity != NULL;
        }
        to->moves = to->moves || variable->type == KT_VARIABLE_MARKER || variable->type == KT_VARIABLE_MARKER_VELOCITY;
        to->responds |= variable->responds ? kt_response_bit(&variable->response) : 0U;
    }
    to->moves = to->moves || to->responds != 0 || to->gravity != NULL;
    to->responses = &watch->responses;
    has_memory = has_memory && (to->responds == 0 || watch->responses.a != NULL ||
                                kt_responses_take(pool, watch->model, &watch->responses));
    if (!has_memory)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    return is_watched ? keep_parts(pool, to, error) : KT_OK;
}

static double value_of(const kt_instant *at, const double *gravity, const bound *variable) {
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

static int evaluate_formula(formula *f, const kt_instant *at, double *value, kt_error *error) {
    if (f->responds != 0 && kt_responses_evaluate(f->responses, f->responds, at, error) != KT_OK)
        return 1;
    if (f->responds == 0 && f->moves && kt_kinematics_update(at->model, at->data, at->q, at->v, NULL, error) != KT_OK)
        return 1;
    if (f->gravity != NULL &&
        (kt_masses_update(at->model, at->data, at->t, error) != KT_OK ||
         kt_dynamics_inverse(at->model, at->data, at->q, NULL, NULL, NULL, f->gravity, error) != KT_OK))
        return 1;
    for (int k = 0; k < f->count; k++)
        f->values[k] = f->variables[k].responds ? kt_response_value(f->responses, &f->variables[k].response, at)
                                                : value_of(at, f->gravity, &f->variables[k]);
    *value = f->sign * kt_expression_evaluate(f->expression, f->values);
    return 0;
}

static int evaluate_watched(const kt_instant *at, double *value, kt_error *error, void *user) {
    return evaluate_formula(&((watched *)user)->formula, at, value, error);
}

/* ---- actions ----------------------------------------------------------------------------------------------------- */

/* The simulation's present state, with data of the watch. */
static kt_instant instant_of(const kt_scene_watch *watch, const kt_simulation *simulation) {
    return (kt_instant){.model = kt_simulation_model(simulation),
                        .data = watch->data,
                        .t = kt_simulation_time(simulation),
                        .q = kt_simulation_positions(simulation),
                        .v = kt_simulation_velocities(simulation),
                        .x = kt_simulation_own_states(simulation)};
}

/* Sets auxiliary states and velocities, all from the state before, and the numbers that follow from them. */
static kt_status set_values(const watched *w, kt_simulation *simulation, kt_error *error) {
    const kt_scene_watch *watch = w->watch;
    const kt_instant at = instant_of(watch, simulation);
    double *x = w->state_count > 0 ? kt_resets_states(watch->resets, simulation) : NULL;
    for (int i = 0; i < w->set_count; i++) {
        double *to = i < w->state_count ? &x[w->states[i]] : &w->velocities[i - w->state_count];
        if (evaluate_formula(&w->values[i], &at, to, error) != 0)
            return KT_ERROR_CALLBACK;
    }
    const int count = w->set_count - w->state_count;
    kt_status status = w->state_count > 0 ? kt_resets_apply(watch->resets, simulation, error) : KT_OK;
    if (status == KT_OK && count > 0)
        status = kt_impulses_apply(watch->impulses, simulation, watch->data, w->states + w->state_count, w->velocities,
                                   count, error);
    return status;
}

static int act(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const watched *w = user;
    int stops = 0;
    if (w->set_count > 0 && set_values(w, simulation, error) != KT_OK)
        return -1;
    const uint64_t released = (kt_simulation_released(simulation) & ~w->acting) | w->released;
    if ((w->acting | w->released) != 0 && kt_simulation_release(simulation, released, error) != KT_OK)
        return -1;
    const uint64_t set = (kt_switch_set(kt_simulation_model(simulation)) & ~w->off) | w->on;
    if ((w->on | w->off) != 0 && kt_simulation_switch(simulation, set, NULL, error) != KT_OK)
        return -1;
    for (int i = 0; i < w->call_count; i++) {
        const int code = w->calls[i]->action(simulation, what, error, w->calls[i]->user);
        if (code < 0)
            return code;
        stops = stops > code ? stops : code;
    }
    return stops;
}

static kt_status find_calls(kt_pool *pool, const kt_scene_event *event, const kt_scene_call *calls, int call_count,
                            watched *to, kt_error *error) {
    if (event->call_count == 0 || call_count < 0)
        return KT_OK;
    to->calls = kt_pool_take(pool, (size_t)event->call_count, sizeof *to->calls);
    if (to->calls == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    for (int i = 0; i < event->call_count; i++) {
        const kt_scene_call *found = NULL;
        for (int k = 0; k < call_count && found == NULL; k++)
            found = strcmp(calls[k].name, event->call[i]) == 0 ? &calls[k] : NULL;
        if (found == NULL)
            return kt_error_set(error, KT_ERROR_SCENE, event->name,
                                "the program has no action '%s'; give it one by kt_scene_call", event->call[i]);
        to->calls[to->call_count++] = found;
    }
    return KT_OK;
}

static void put_bit(uint64_t bit, bool on, uint64_t *yes, uint64_t *no) {
    *yes = on ? *yes | bit : *yes & ~bit;
    *no = on ? *no & ~bit : *no | bit;
}

/* The loops of this name that bound a side: a loop, or those of an effect, or its friction that sticks. Returns false
 * if there are none. */
static bool find_contacts(const kt_model *model, const char *name, bool on, watched *to) {
    static const char *const suffixes[] = {"", ".lower", ".upper"};
    char text[KT_WHERE_SIZE];
    bool found = false;
    for (int i = 0; i < KT_COUNT_OF(suffixes); i++) {
        (void)snprintf(text, sizeof text, "%s%s", name, suffixes[i]);
        const int loop = kt_loop_find(model, text);
        if (loop < 0 || kt_loop_side(model, loop) == KT_SIDE_NONE)
            continue;
        put_bit(kt_switch_bits(model, kt_loop_switch(model, loop)), on, &to->acting, &to->released);
        found = true;
    }
    const int stick = found ? -1 : kt_effect_stick(model, kt_effect_find(model, name));
    if (stick >= 0)
        put_bit(kt_switch_bits(model, kt_loop_switch(model, stick)), on, &to->acting, &to->released);
    return found || stick >= 0;
}

/* If a name occurs twice, the last entry decides. */
static kt_status find_switches(const kt_model *model, const kt_scene_event *event, watched *to, kt_error *error) {
    for (int i = 0; i < event->switch_count; i++) {
        const char *name = event->switches[i].name;
        if (find_contacts(model, name, event->switches[i].on, to))
            continue;
        const int loop = kt_loop_switch(model, kt_loop_find(model, name));
        const int k = loop >= 0 ? loop : kt_effect_switch(model, kt_effect_find(model, name));
        if (k < 0)
            return kt_error_set(error, KT_ERROR_SCENE, event->name,
                                "the model has no loop or effect '%s' that is switched (kt_switching)", name);
        put_bit(kt_switch_bits(model, k), event->switches[i].on, &to->on, &to->off);
    }
    return KT_OK;
}

/* The index of an auxiliary state, or of a velocity, that an event sets. */
static kt_status find_set(const kt_scene_watch *watch, const kt_scene *scene, const kt_scene_event *event,
                          const char *name, int *index, kt_error *error) {
    kt_variable variable;
    bound to;
    if (!kt_is_velocity_name(name)) {
        *index = kt_own_state_find(watch->model, name);
        return *index >= 0 ? KT_OK
                           : kt_error_set(error, KT_ERROR_MODEL, event->name, "the model has no state '%s'", name);
    }
    if (!kt_variable_find(&scene->description, name, &variable))
        return kt_error_set(error, KT_ERROR_SCENE, event->name, "the scene has no velocity '%s'", name);
    const kt_status status = bind(&scene->description, watch->model, &variable, &to, error);
    *index = to.at;
    if (status == KT_OK && kt_massless_moves(watch->model, to.at))
        return kt_error_set(
            error, KT_ERROR_UNSUPPORTED, event->name,
            "'%s' follows from a balance of forces, since its joint moves no mass; set another velocity", name);
    return status;
}

/* States come first, then velocities. */
static kt_status find_sets(kt_scene_watch *watch, const kt_scene *scene, const kt_scene_event *event, watched *to,
                           kt_error *error) {
    const size_t count = (size_t)event->set_count;
    bool needs_data = false;
    to->watch = watch;
    if (count == 0)
        return KT_OK;
    to->values = kt_pool_take(&watch->pool, count, sizeof *to->values);
    to->states = kt_pool_take(&watch->pool, count, sizeof *to->states);
    to->velocities = kt_pool_take(&watch->pool, count, sizeof *to->velocities);
    if (to->values == NULL || to->states == NULL || to->velocities == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    kt_status status = KT_OK;
    for (int of_velocities = 0; of_velocities < 2; of_velocities++) {
        for (size_t i = 0; status == KT_OK && i < count; i++) {
            const kt_scene_set *set = &event->sets[i];
            if (kt_is_velocity_name(set->name) != (of_velocities != 0))
                continue;
            formula *value = &to->values[to->set_count];
            status = find_set(watch, scene, event, set->name, &to->states[to->set_count], error);
            if (status == KT_OK)
                status = make_formula(watch, scene, set->value, false, value, error);
            needs_data = needs_data || value->moves || of_velocities != 0;
            to->set_count++;
        }
        to->state_count = of_velocities == 0 ? to->set_count : to->state_count;
    }
    if (status == KT_OK && needs_data && watch->data == NULL)
        status = kt_data_create(watch->model, &watch->data, error);
    return status;
}

/* Room for the velocities that one event sets. */
static kt_status make_impulses(kt_scene_watch *watch, const kt_scene *scene, kt_error *error) {
    int count = 0;
    for (int i = 0; i < scene->event_count; i++)
        count = scene->events[i].set_count > count ? scene->events[i].set_count : count;
    if (!kt_impulses_are_set(scene))
        return KT_OK;
    watch->impulses = kt_impulses_create(&watch->pool, watch->model, count);
    return watch->impulses != NULL
               ? KT_OK
               : kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
}

kt_scene_missed kt_scene_watch_missed(const kt_scene_watch *watch) {
    return watch != NULL && watch->impulses != NULL ? kt_impulses_missed(watch->impulses) : (kt_scene_missed){0};
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

int kt_scene_event_room(const kt_scene *scene) { return scene ? scene->event_count + (scene->until.when != NULL) : 0; }

/* The target of the events of a scene. */
typedef struct target {
    kt_scene_watch *watch;
    const kt_scene *scene;
    const kt_model *model;
    kt_simulation *simulation;
    const kt_scene_call *calls;
    int call_count;
} target;

static kt_status add_event(const target *in, const kt_scene_event *event, watched *to, kt_error *error) {
    kt_scene_watch *watch = in->watch;
    const kt_model *model = in->model;
    kt_status status = make_formula(watch, in->scene, event->when, true, &to->formula, error);
    to->simulation = in->simulation;
    if (status == KT_OK)
        status = find_calls(&watch->pool, event, in->calls, in->call_count, to, error);
    if (status == KT_OK)
        status = find_switches(model, event, to, error);
    if (status == KT_OK)
        status = find_sets(watch, in->scene, event, to, error);
    const char *name = kt_pool_text(&watch->pool, event->name, strlen(event->name));
    if (status == KT_OK && name == NULL)
        status = kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    if (status != KT_OK)
        return status;
    const bool acts = event->switch_count > 0 || event->set_count > 0;
    const kt_event added = {.name = name,
                            .function = evaluate_watched,
                            .action = to->call_count > 0 || acts ? act : NULL,
                            .corner = to->formula.part_count > 0 ? next_corner : NULL,
                            .user = to,
                            .direction = event->direction,
                            .record = event->record || acts,
                            .stop = event->stop,
                            .repeatable = to->call_count == 0 && event->set_count == 0,
                            .limit = (uint64_t)event->limit,
                            .sum = kt_scene_event_sum(in->scene, event)};
    status = kt_simulation_event_add(in->simulation, &added, error);
    if (status == KT_ERROR_ARGUMENT && error != NULL) /* its name, which the scene gives */
        error->code = KT_ERROR_SCENE;
    return status == KT_ERROR_ARGUMENT ? KT_ERROR_SCENE : status;
}

kt_status kt_scene_watch_create(const kt_scene *scene, const kt_model *model, kt_simulation *simulation,
                                const kt_scene_call *calls, int call_count, kt_scene_watch **watch, kt_error *error) {
    if (KT_IS_MISSING(error, scene, model, simulation, watch, calls || call_count <= 0))
        return KT_ERROR_ARGUMENT;
    const int count = kt_scene_event_room(scene);
    kt_scene_watch *made = calloc(1, sizeof *made);
    kt_status status = KT_OK;
    if (made != NULL)
        made->watched = kt_pool_take(&made->pool, (size_t)count + 1, sizeof *made->watched);
    if (made == NULL || made->watched == NULL)
        status = kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    if (status == KT_OK) {
        made->model = model;
        status = kt_resets_create(&made->pool, scene, model, &made->resets, error);
    }
    if (status == KT_OK)
        status = make_impulses(made, scene, error);
    const target in = {made, scene, model, simulation, calls, call_count};
    for (int i = 0; status == KT_OK && i < count; i++) {
        const kt_scene_event *event = i < scene->event_count ? &scene->events[i] : &scene->until;
        status = add_event(&in, event, &made->watched[i], error);
    }
    if (status == KT_OK && scene->until.when != NULL && scene->until.direction == KT_DIRECTION_RISING) {
        made->until = &made->watched[count - 1];
        if (made->until->formula.moves && made->data == NULL)
            status = kt_data_create(model, &made->data, error);
    }
    if (status == KT_OK)
        status = kt_scene_watch_sync(made, simulation, error);
    if (status != KT_OK) {
        kt_scene_watch_free(made);
        return status;
    }
    *watch = made;
    return KT_OK;
}

bool kt_scene_until_holds(kt_scene_watch *watch, const kt_simulation *simulation) {
    double value = 0.0;
    if (!watch || !simulation || !watch->until)
        return false;
    const kt_instant at = instant_of(watch, simulation);
    return evaluate_watched(&at, &value, NULL, watch->until) == 0 && value > 0.0;
}

kt_status kt_scene_watch_sync(kt_scene_watch *watch, const kt_simulation *simulation, kt_error *error) {
    if (KT_IS_MISSING(error, watch, simulation))
        return KT_ERROR_ARGUMENT;
    return watch->resets != NULL ? kt_resets_sync(watch->resets, simulation, error) : KT_OK;
}

void kt_scene_watch_free(kt_scene_watch *watch) {
    if (watch == NULL)
        return;
    kt_data_free(watch->data);
    kt_pool_free(watch->pool.chunks);
    free(watch);
}
