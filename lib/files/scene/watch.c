/* Events of a scene in a simulation: their formulas, with the variables that they read bound to the simulation's model
 * (bound.c), and their actions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pool.h"
#include "base/require.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "model/follow.h"
#include "scene/assignment.h"
#include "scene/bound.h"
#include "scene/foothold.h"
#include "simulation/response.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The data of an event's functions. */
typedef struct watched {
    const char *name;
    kt_bound_formula formula;
    const kt_scene_call **calls;
    int call_count;
    uint64_t on, off;          /* the switches that it engages and releases */
    uint64_t here;             /* those of loops that it closes where their bodies are */
    uint64_t acting, released; /* likewise of hard stops, contacts, slack ropes and joint friction that sticks */
    kt_bound_formula *values;  /* of the auxiliary states and velocities that it sets */
    int *states;               /* these: the indices of states; those of velocities lie behind them */
    double *velocities;        /* what they become */
    int state_count, set_count;
    const kt_scene_watch *watch;
    kt_simulation *simulation;
} watched;

struct kt_scene_watch {
    kt_pool pool;
    watched *watched;
    int count; /* events, `until` among them */
    const kt_model *model;
    kt_data *data;               /* of the model; NULL: neither events nor values that are set need markers */
    kt_assignments *assignments; /* NULL: events set no parameters and no states */
    kt_impulses *impulses;       /* NULL: events set no velocities */
    kt_footholds *footholds;     /* NULL: events close no loops where their bodies are */
    kt_responses responses;      /* `a` is NULL: no formula has any */
    kt_binding binding;
};

/* The first breakpoint after t of the parts that depend on time alone (kt_event.breakpoint). */
static double next_watch_breakpoint(void *user, double t) {
    const watched *w = user;
    return kt_simulation_next_feature(w->simulation, (const kt_expression *const *)w->formula.parts,
                                      w->formula.part_count, t);
}

static int evaluate_watched(const kt_instant *at, double *value, kt_error *error, void *user) {
    watched *w = user;
    if (at->t < kt_simulation_time(w->simulation) &&
        kt_responses_are_stepped(&w->watch->responses, w->formula.responds))
        return KT_EVENT_HOLDS;
    return kt_bound_evaluate(&w->formula, at, value, error);
}

/* ---- actions ----------------------------------------------------------------------------------------------------- */

/* The simulation's present state, with data of the watch. */
static kt_instant watched_instant_of(const kt_scene_watch *watch, const kt_simulation *simulation) {
    const kt_model *model = kt_simulation_model(simulation);
    if (watch->data != NULL)
        kt_data_follow(model, watch->data);
    return (kt_instant){.model = model,
                        .data = watch->data,
                        .t = kt_simulation_time(simulation),
                        .q = kt_simulation_positions(simulation),
                        .v = kt_simulation_velocities(simulation),
                        .x = kt_simulation_auxiliary_states(simulation)};
}

/* Sets auxiliary states and velocities, all from the state before, and the numbers that follow from them. */
static kt_status set_values(const watched *w, kt_simulation *simulation, kt_error *error) {
    const kt_scene_watch *watch = w->watch;
    const kt_instant at = watched_instant_of(watch, simulation);
    double *x = w->state_count > 0 ? kt_assignments_states(watch->assignments, simulation) : NULL;
    for (int i = 0; i < w->set_count; i++) {
        double *to = i < w->state_count ? &x[w->states[i]] : &w->velocities[i - w->state_count];
        if (kt_bound_evaluate(&w->values[i], &at, to, error) != 0)
            return KT_ERROR_CALLBACK;
    }
    const int count = w->set_count - w->state_count;
    kt_status status = w->state_count > 0 ? kt_assignments_apply(watch->assignments, simulation, error) : KT_OK;
    if (status == KT_OK && count > 0)
        status = kt_impulses_apply(watch->impulses, simulation, watch->data, w->states + w->state_count, w->velocities,
                                   count, error);
    return status;
}

static int act_on_event(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const watched *w = user;
    int stops = 0;
    if (w->set_count > 0 && set_values(w, simulation, error) != KT_OK)
        return -1;
    const uint64_t released = (kt_simulation_released(simulation) & ~w->acting) | w->released;
    if ((w->acting | w->released) != 0 && kt_simulation_set_released(simulation, released, error) != KT_OK)
        return -1;
    const uint64_t set = (kt_switch_set(kt_simulation_model(simulation)) & ~w->off) | w->on;
    if (w->here != 0 && kt_footholds_set(w->watch->footholds, simulation, w->watch->data, w->here, error) != KT_OK)
        return -1;
    if ((w->on | w->off) != 0 && kt_simulation_set_switches(simulation, set, NULL, error) != KT_OK)
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
    const int stick = found ? -1 : kt_effect_stick_loop(model, kt_effect_find(model, name));
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
        const uint64_t bits = kt_switch_bits(model, k);
        put_bit(bits, event->switches[i].on, &to->on, &to->off);
        to->here = event->switches[i].here ? to->here | bits : to->here & ~bits;
    }
    return KT_OK;
}

/* The index of an auxiliary state, or of a velocity, that an event sets. */
static kt_status find_set(const kt_scene_watch *watch, const kt_scene *scene, const kt_scene_event *event,
                          const char *name, int *index, kt_error *error) {
    kt_variable variable;
    kt_bound to;
    if (!kt_is_velocity_name(name)) {
        *index = kt_auxiliary_state_find(watch->model, name);
        return *index >= 0 ? KT_OK
                           : kt_error_set(error, KT_ERROR_MODEL, event->name, "the model has no state '%s'", name);
    }
    if (!kt_variable_find(&scene->description, name, &variable))
        return kt_error_set(error, KT_ERROR_SCENE, event->name, "the scene has no velocity '%s'", name);
    const kt_status status = kt_variable_bind(&scene->description, watch->model, &variable, &to, error);
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
            kt_bound_formula *value = &to->values[to->set_count];
            status = find_set(watch, scene, event, set->name, &to->states[to->set_count], error);
            if (status == KT_OK)
                status = kt_formula_bind(&watch->binding, scene, set->value, false, value, error);
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
    if (!kt_events_set(scene, true))
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
    kt_status status = kt_formula_bind(&watch->binding, in->scene, event->when, true, &to->formula, error);
    to->simulation = in->simulation;
    to->watch = watch;
    if (status == KT_OK)
        status = find_calls(&watch->pool, event, in->calls, in->call_count, to, error);
    if (status == KT_OK)
        status = find_switches(model, event, to, error);
    if (status == KT_OK && (to->here != 0 || to->formula.moves) && watch->data == NULL)
        status = kt_data_create(model, &watch->data, error);
    if (status == KT_OK)
        status = find_sets(watch, in->scene, event, to, error);
    const char *name = kt_pool_text(&watch->pool, event->name, strlen(event->name));
    to->name = name;
    if (status == KT_OK && name == NULL)
        status = kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    if (status != KT_OK)
        return status;
    const bool acts = event->switch_count > 0 || event->set_count > 0;
    const kt_event added = {.name = name,
                            .function = evaluate_watched,
                            .action = to->call_count > 0 || acts ? act_on_event : NULL,
                            .breakpoint = to->formula.part_count > 0 ? next_watch_breakpoint : NULL,
                            .user = to,
                            .direction = event->direction,
                            .record = event->record || acts,
                            .stop = event->stop,
                            .repeatable = to->call_count == 0 && event->set_count == 0 && to->here == 0,
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
        made->count = count;
        made->responses.simulation = simulation;
        made->binding = (kt_binding){.pool = &made->pool, .model = model, .responses = &made->responses};
        status = kt_assignments_create(&made->pool, scene, model, &made->assignments, error);
    }
    if (status == KT_OK)
        status = kt_footholds_create(&made->pool, scene, model, &made->footholds, error);
    if (status == KT_OK)
        status = make_impulses(made, scene, error);
    const target in = {made, scene, model, simulation, calls, call_count};
    for (int i = 0; status == KT_OK && i < count; i++) {
        const kt_scene_event *event = i < scene->event_count ? &scene->events[i] : &scene->until;
        status = add_event(&in, event, &made->watched[i], error);
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

double kt_scene_event_value(kt_scene_watch *watch, const kt_simulation *simulation, int event) {
    double value = 0.0;
    if (!watch || !simulation || !KT_IS_INDEX(event, watch->count))
        return (double)NAN;
    const kt_instant at = watched_instant_of(watch, simulation);
    return evaluate_watched(&at, &value, NULL, &watch->watched[event]) == 0 ? value : (double)NAN;
}

kt_status kt_scene_watch_sync(kt_scene_watch *watch, const kt_simulation *simulation, kt_error *error) {
    if (KT_IS_MISSING(error, watch, simulation))
        return KT_ERROR_ARGUMENT;
    kt_status status = watch->footholds != NULL ? kt_footholds_sync(watch->footholds, simulation, error) : KT_OK;
    if (status == KT_OK && watch->assignments != NULL)
        status = kt_assignments_sync(watch->assignments, simulation, error);
    kt_simulation_renew_model(simulation);
    return status;
}

void kt_scene_watch_free(kt_scene_watch *watch) {
    if (watch == NULL)
        return;
    kt_data_free(watch->data);
    kt_pool_free(watch->pool.chunks);
    free(watch);
}
