/* Loops that events close where bodies are (foothold.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/foothold.h"

#include "base/pool.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"
#include "model/follow.h"
#include "scene/expand.h"
#include "scene/named.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"

#include <stdio.h>
#include <string.h>

enum { NUMBERS = 6, NAME_MOST = 60 };

static const char *const suffixes[NUMBERS] = {"x", "y", "z", "rx", "ry", "rz"};

typedef struct state_name {
    char text[NAME_MOST + 4];
} state_name;

static state_name name_place_state(const char *loop, int k) {
    state_name name;
    (void)snprintf(name.text, sizeof name.text, "%.*s_%s", NAME_MOST, loop, suffixes[k]);
    return name;
}

/* ---- while a scene is read --------------------------------------------------------------------------------------- */

/* The types whose equations hold if both ends coincide. */
static const kt_loop_type closed_types[] = {KT_LOOP_WELD,      KT_LOOP_SPHERICAL,   KT_LOOP_REVOLUTE,
                                            KT_LOOP_PRISMATIC, KT_LOOP_CYLINDRICAL, KT_LOOP_PLANAR};

/* The actions that have been visited. */
typedef struct action_list {
    kt_reader *r;
    const char **names; /* of the loops whose states are there */
    int count;
} action_list;

static void count_action(const kt_node *action, void *user) {
    ((action_list *)user)->count += kt_node_find(action, "engage_here") != NULL;
}

/* The loop of an action; NULL if there is none, or if its name is wrong, which the reader of the event reports. */
static const kt_node *loop_of_action(const kt_node *action) {
    const kt_node *loop = kt_node_find(action, "engage_here");
    return loop != NULL && loop->kind == KT_NODE_TEXT && kt_name_is_valid(loop->of.text) && loop->count <= NAME_MOST
               ? loop
               : NULL;
}

/* The items of the file that have this name; NULL: none. */
static const char *users_of_name(const kt_reader *r, const char *name) {
    static const char *const keys[] = {"parameters", "expressions", "states"};
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++)
        if (kt_section_has(r, keys[k], name))
            return keys[k];
    return NULL;
}

/* Reports the name of a state that the file uses for another item. */
static bool check_place_name(kt_reader *r, const kt_node *loop, const char *name) {
    static const kt_scope events = {.key = "events"}, scope = {.outer = &events, .key = "engage_here"};
    const char *users = users_of_name(r, name);
    return users == NULL || kt_fault_at(r, KT_ERROR_SCENE, &scope, (kt_node *)(uintptr_t)loop, /* the reader's own */
                                        "this action of %s makes the state '%s', which is one of `%s` already; rename "
                                        "that one, or the loop",
                                        kt_name_quote(loop->of.text).text, name, users);
}

/* Adds the six states of a loop as text of a scene, as if the file had them. A loop with several actions has one set.
 */
static void expand_action(const kt_node *action, void *user) {
    action_list *list = user;
    const kt_node *loop = loop_of_action(action);
    char text[NUMBERS * (NAME_MOST + 20)], *to = text;
    if (loop == NULL)
        return;
    for (int i = 0; i < list->count; i++)
        if (strcmp(list->names[i], loop->of.text) == 0)
            return;
    list->names[list->count++] = loop->of.text;
    *to++ = '{';
    for (int k = 0; k < NUMBERS; k++) {
        const state_name name = name_place_state(loop->of.text, k);
        if (check_place_name(list->r, loop, name.text))
            to += snprintf(to, sizeof text - (size_t)(to - text), "%s%s: {rate: \"0\"}", to[-1] == '{' ? "" : ", ",
                           name.text);
    }
    (void)snprintf(to, sizeof text - (size_t)(to - text), "}");
    const char *kept = kt_pool_text(&list->r->scratch, text, strlen(text));
    kt_node *states = kept != NULL ? kt_nodes_parse(list->r, kept, strlen(kept)) : NULL;
    if (states == NULL) {
        (void)kt_reader_out_of_memory(list->r);
        return;
    }
    kt_nodes_settle(states, loop, NULL, 0);
    kt_nodes_append(list->r, "states", states, loop);
}

void kt_footholds_expand(kt_reader *r) {
    action_list list = {.r = r};
    kt_actions_visit(r, count_action, &list);
    if (list.count == 0)
        return;
    list.names = kt_reader_take(r, &r->scratch, (size_t)list.count, sizeof *list.names);
    list.count = 0;
    if (list.names != NULL)
        kt_actions_visit(r, expand_action, &list);
}

/* A name in search of the action that makes a state of this name. */
typedef struct place_search {
    const char *name, *loop;
} place_search;

static void compare_action(const kt_node *action, void *user) {
    place_search *search = user;
    const kt_node *loop = loop_of_action(action);
    if (loop == NULL || loop->faulty || strncmp(search->name, loop->of.text, loop->count) != 0)
        return;
    for (int k = 0; k < NUMBERS; k++)
        if (strcmp(search->name, name_place_state(loop->of.text, k).text) == 0)
            search->loop = loop->of.text;
}

const char *kt_foothold_named(const kt_reader *r, const char *state) {
    place_search search = {.name = state};
    kt_actions_visit(r, compare_action, &search);
    return search.loop;
}

static bool is_world(const kt_end *end) { return end->body == NULL || strcmp(end->body, "world") == 0; }

/* The end of a loop that moves: the end on the world, or else the second one. Returns -1 if this end is a marker, which
 * has a place of its own. */
static int moved_end(const kt_loop *loop) {
    const int end = is_world(&loop->between[0]) ? 0 : 1;
    return loop->between[end].marker == NULL ? end : -1;
}

/* Whether a body is fixed to the world by fixed joints alone. */
static bool is_fixed_to_world(const kt_description *d, const char *name) {
    for (int depth = 0; name != NULL && strcmp(name, "world") != 0 && depth <= d->body_count; depth++) {
        int i = 0;
        while (i < d->body_count && strcmp(d->bodies[i].name, name) != 0)
            i++;
        if (i == d->body_count || d->bodies[i].joint.type != KT_JOINT_FIXED)
            return false;
        name = d->bodies[i].parent;
    }
    return true;
}

static bool closes_where_ends_coincide(kt_loop_type type) {
    bool any = false;
    for (size_t i = 0; i < sizeof closed_types / sizeof *closed_types; i++)
        any = any || closed_types[i] == type;
    return any;
}

bool kt_foothold_check(kt_reader *r, const kt_scope *scope, kt_node *node, const char *name) {
    const int i = kt_find_loop(r->scene->description, name);
    const kt_loop *loop = i >= 0 ? &r->scene->description->loops[i] : NULL;
    if (loop == NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "%s is an effect, which has no place; name a loop, or write {engage: %.60s}",
                           kt_name_quote(name).text, name);
    if (!closes_where_ends_coincide(loop->type))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "the loop %s may be open where its ends coincide; name a weld, spherical, revolute, "
                           "prismatic, cylindrical or planar one, or write {engage: %.60s}",
                           kt_name_quote(name).text, name);
    if (moved_end(loop) < 0)
        return kt_fault_at(
            r, KT_ERROR_SCENE, scope, node,
            "the end of the loop %s that would be moved is a marker, whose place is fixed; write the body without a "
            "marker, as BODY or {body: BODY, at: [x, y, z]}. The end on the world moves, or else the second one",
            kt_name_quote(name).text);
    for (int k = 0; k < 2; k++)
        if (!is_world(&loop->between[k]) && is_fixed_to_world(r->scene->description, loop->between[k].body))
            return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                               "the end %s of the loop %s is fixed to the world; write its point as {body: world, at: "
                               "[x, y, z]}",
                               kt_name_quote(loop->between[k].body).text, kt_name_quote(name).text);
    if (node->count > NAME_MOST)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "%s has more than %d characters, which names of its states have no room for; take a shorter "
                           "name",
                           kt_name_quote(name).text, NAME_MOST);
    return true;
}

/* ---- of a scene -------------------------------------------------------------------------------------------------- */

/* The next action from the *k-th switch of the *i-th event on; NULL: there is none. */
static const char *next_foothold(const kt_scene *scene, int *i, int *k) {
    for (; *i < scene->event_count; (*i)++, *k = 0)
        while (*k < scene->events[*i].switch_count)
            if (scene->events[*i].switches[(*k)++].here)
                return scene->events[*i].switches[*k - 1].name;
    return NULL;
}

int kt_footholds_count(const kt_scene *scene) {
    int count = 0;
    for (int i = 0, k = 0; next_foothold(scene, &i, &k) != NULL;)
        count++;
    return count;
}

bool kt_scene_is_place_state(const kt_scene *scene, const char *name) {
    const char *loop;
    if (scene == NULL || name == NULL)
        return false;
    for (int i = 0, k = 0; (loop = next_foothold(scene, &i, &k)) != NULL;)
        for (int j = 0; j < NUMBERS; j++)
            if (strcmp(name_place_state(loop, j).text, name) == 0)
                return true;
    return false;
}

static kt_auxiliary_state *find_place_state(kt_scene *scene, const char *loop, int k) {
    kt_auxiliary_state *states =
        (kt_auxiliary_state *)(uintptr_t)scene->description.states; /* the scene's own, like its loops */
    const state_name name = name_place_state(loop, k);
    for (int i = 0; i < scene->description.state_count; i++)
        if (states[i].name != NULL && strcmp(states[i].name, name.text) == 0)
            return &states[i];
    return NULL;
}

/* The loop of an action, its end, and the rotation of the end's frame to the loop's axis. Returns NULL if they have
 * faults. */
static kt_loop *moved_loop(kt_scene *scene, const char *name, int *end, kt_mat3 *to_axis) {
    const int i = kt_find_loop(&scene->description, name);
    kt_loop *loop = i >= 0 ? (kt_loop *)(uintptr_t)&scene->description.loops[i] : NULL;
    *end = loop != NULL ? moved_end(loop) : -1;
    if (*end < 0)
        return NULL;
    *to_axis = kt_triad_from_axis(kt_vec3_normalize(loop->axis), 2);
    return loop;
}

void kt_footholds_measure(kt_scene *scene) {
    const char *name;
    for (int i = 0, k = 0; (name = next_foothold(scene, &i, &k)) != NULL;) {
        int end;
        kt_mat3 turn, to_axis;
        kt_error ignored; /* the check reports it */
        const kt_loop *loop = moved_loop(scene, name, &end, &to_axis);
        if (loop == NULL || kt_rotation_evaluate(&loop->between[end].rotation, &turn, &ignored) != KT_OK)
            continue;
        const kt_vec3 at = loop->between[end].at, v = kt_euler_vector_from_mat3(kt_mat3_multiply(turn, to_axis));
        const double numbers[NUMBERS] = {at.x, at.y, at.z, v.x, v.y, v.z};
        for (int j = 0; j < NUMBERS; j++) {
            kt_auxiliary_state *state = find_place_state(scene, name, j);
            if (state != NULL)
                state->initial = numbers[j];
        }
    }
}

void kt_footholds_follow(kt_scene *scene) {
    const char *name;
    for (int i = 0, k = 0; (name = next_foothold(scene, &i, &k)) != NULL;) {
        int end;
        kt_mat3 to_axis;
        double x[NUMBERS];
        kt_loop *loop = moved_loop(scene, name, &end, &to_axis);
        bool complete = loop != NULL;
        for (int j = 0; j < NUMBERS; j++) {
            const kt_auxiliary_state *state = find_place_state(scene, name, j);
            complete = complete && state != NULL;
            x[j] = state != NULL ? state->initial : 0.0;
        }
        if (!complete)
            continue;
        const kt_mat3 turn = kt_mat3_from_euler_vector(kt_vec3_make(x[3], x[4], x[5]));
        loop->between[end].at = kt_vec3_make(x[0], x[1], x[2]);
        loop->between[end].rotation = kt_rotation_matrix(kt_mat3_multiply(turn, kt_mat3_transpose(to_axis)));
    }
}

/* ---- in a simulation --------------------------------------------------------------------------------------------- */

typedef struct bound_foothold {
    kt_parameter place;
    uint64_t bit;       /* its loop is on */
    int state[NUMBERS]; /* indices of the states */
} bound_foothold;

struct kt_footholds {
    kt_model *model;
    bound_foothold *bound;
    int count, x_count;
    kt_parameter_change *changes; /* as many */
    double *x;                    /* auxiliary states */
};

/* Finds the place of a loop, its switch, and its six states in the model. */
static kt_status bind_foothold(const kt_model *model, const char *name, bound_foothold *to, kt_error *error) {
    char text[KT_WHERE_SIZE];
    (void)snprintf(text, sizeof text, "loop %s.place", name);
    const kt_status status = kt_parameter_find(model, text, &to->place, error);
    if (status != KT_OK)
        return status;
    to->bit = kt_switch_bits(model, kt_loop_switch(model, to->place.item));
    for (int k = 0; k < NUMBERS; k++) {
        to->state[k] = kt_auxiliary_state_find(model, name_place_state(name, k).text);
        if (to->state[k] < 0)
            return kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create", "the model has no state '%s'",
                                name_place_state(name, k).text);
    }
    return KT_OK;
}

kt_status kt_footholds_create(kt_pool *pool, const kt_scene *scene, const kt_model *model, kt_footholds **footholds,
                              kt_error *error) {
    const size_t count = (size_t)kt_footholds_count(scene);
    const char *name;
    kt_status status = KT_OK;
    *footholds = NULL;
    if (count == 0)
        return KT_OK;
    kt_footholds *to = kt_pool_take(pool, 1, sizeof *to);
    if (to != NULL) {
        to->model = (kt_model *)(uintptr_t)model; /* that of the simulation, which may be set */
        to->x_count = kt_auxiliary_state_count(model);
        to->bound = kt_pool_take(pool, count, sizeof *to->bound);
        to->changes = kt_pool_take(pool, count, sizeof *to->changes);
        to->x = kt_pool_take(pool, (size_t)to->x_count + 1, sizeof *to->x);
    }
    if (to == NULL || to->bound == NULL || to->changes == NULL || to->x == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
    for (int i = 0, k = 0; status == KT_OK && (name = next_foothold(scene, &i, &k)) != NULL;) {
        bound_foothold *next = &to->bound[to->count];
        bool known = false;
        status = bind_foothold(model, name, next, error);
        for (int j = 0; j < to->count; j++)
            known = known || to->bound[j].bit == next->bit;
        to->count += !known;
    }
    *footholds = to;
    return status;
}

kt_status kt_footholds_set(kt_footholds *footholds, kt_simulation *simulation, kt_data *data, uint64_t bits,
                           kt_error *error) {
    const kt_model *model = kt_simulation_model(simulation);
    const uint64_t open = bits & ~kt_switch_set(model);
    int count = 0;
    if (open == 0)
        return KT_OK;
    memcpy(footholds->x, kt_simulation_auxiliary_states(simulation), (size_t)footholds->x_count * sizeof *footholds->x);
    kt_data_follow(model, data);
    kt_status status = kt_kinematics_update(model, data, kt_simulation_positions(simulation), NULL, NULL, error);
    for (int i = 0; status == KT_OK && i < footholds->count; i++) {
        const bound_foothold *foothold = &footholds->bound[i];
        kt_parameter_change *change = &footholds->changes[count];
        if ((foothold->bit & open) == 0)
            continue;
        change->parameter = foothold->place;
        status = kt_loop_place_here(model, data, foothold->place.item, change->values, error);
        for (int k = 0; status == KT_OK && k < NUMBERS; k++)
            footholds->x[foothold->state[k]] = change->values[k];
        count++;
    }
    return status == KT_OK
               ? kt_simulation_change(simulation, footholds->model, footholds->changes, count, footholds->x, error)
               : status;
}

kt_status kt_footholds_sync(kt_footholds *footholds, const kt_simulation *simulation, kt_error *error) {
    const double *x = kt_simulation_auxiliary_states(simulation);
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK && i < footholds->count; i++) {
        const bound_foothold *foothold = &footholds->bound[i];
        double place[NUMBERS];
        for (int k = 0; k < NUMBERS; k++)
            place[k] = x[foothold->state[k]];
        status = kt_parameter_set(footholds->model, &foothold->place, place, error);
    }
    return status;
}
