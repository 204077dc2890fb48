/* A scene that starts from another state of its mechanism.
 *
 * Quantities that a scene measures in its initial state have to keep their values. Lengths of springs are those in the
 * assembled state, and distances of loops are those at the given positions. The angle of screw closures counts from the
 * initial state. Their first end therefore moves along the axis by the distance of the ends along it in the new state.
 * Loops that events close where a body is have the places that auxiliary states hold (foothold.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/memory.h"
#include "base/pool.h"
#include "base/require.h"
#include "kinetree/closure.h"
#include "kinetree/descriptor.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "scene/foothold.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include <string.h>

/* The scene that is being changed: copies of its arrays, and a state of its model as scratch. */
typedef struct restart {
    const kt_model *model;
    kt_data *data;
    const kt_description *description;
    kt_body *bodies;
    kt_loop *loops;
    kt_effect *effects;
    double *q, *v; /* scratch */
} restart;

/* Position of an end in the world, for the positions of the last kt_kinematics_update. */
static kt_vec3 end_point(const restart *r, const kt_end *end) {
    const int body = end->body != NULL ? kt_body_find(r->model, end->body) : 0;
    const int marker = end->marker != NULL ? kt_marker_find(r->model, body, end->marker) : -1;
    return kt_point_position(r->model, r->data, body, marker >= 0 ? kt_marker_at(r->model, body, marker) : end->at);
}

static double end_distance_of(const restart *r, const kt_end ends[2]) {
    return kt_vec3_norm(kt_vec3_sub(end_point(r, &ends[1]), end_point(r, &ends[0])));
}

static bool measures_distance(const kt_loop *loop) {
    return loop->type == KT_LOOP_DISTANCE && loop->function.type == KT_FUNCTION_NONE;
}

static kt_status fix_distances(restart *r, kt_error *error) {
    kt_model_initial(r->model, r->q, r->v);
    const kt_status status = kt_kinematics_update(r->model, r->data, r->q, NULL, NULL, error);
    for (int i = 0; i < r->description->loop_count && status == KT_OK; i++)
        if (measures_distance(&r->loops[i]))
            r->loops[i].function = kt_function_constant(end_distance_of(r, r->loops[i].between));
    return status;
}

static bool measures_length(const kt_effect *effect) {
    return effect->initial_length && kt_descriptor_kind(kt_effect_descriptor(effect->type), KT_KEY_DISTANCE) != NULL;
}

/* Gives springs of initial length the length in the assembled state. A scene without such springs needs no assembly. */
static kt_status fix_lengths(restart *r, kt_error *error) {
    kt_status status = KT_OK;
    bool any = false;
    for (int i = 0; i < r->description->effect_count; i++)
        any = any || measures_length(&r->effects[i]);
    if (!any)
        return KT_OK;
    kt_model_initial(r->model, r->q, r->v);
    status = kt_state_assemble(r->model, r->data, 0.0, r->q, r->v, error);
    if (status == KT_OK)
        status = kt_kinematics_update(r->model, r->data, r->q, NULL, NULL, error);
    for (int i = 0; i < r->description->effect_count && status == KT_OK; i++)
        if (measures_length(&r->effects[i])) {
            r->effects[i].initial_length = false;
            r->effects[i].length = end_distance_of(r, r->effects[i].between);
        }
    return status;
}

/* Moves the first end of a screw closure. Requires kt_kinematics_update at the positions of the new start. */
static kt_status fix_thread(const restart *r, kt_loop *loop, kt_error *error) {
    kt_mat3 turn;
    kt_end *end = loop->between;
    const kt_status status = kt_rotation_evaluate(&end->rotation, &turn, error);
    if (status != KT_OK)
        return status;
    const int body = end->body != NULL ? kt_body_find(r->model, end->body) : 0;
    const int marker = end->marker != NULL ? kt_marker_find(r->model, body, end->marker) : -1;
    if (marker >= 0)
        turn = kt_mat3_multiply(kt_marker_rotation(r->model, body, marker), turn);
    const kt_vec3 axis = kt_mat3_apply(turn, kt_vec3_normalize(loop->axis)); /* in the body's frame */
    const kt_vec3 apart = kt_mat3_apply_transposed(kt_body_pose(r->model, r->data, body).rotation,
                                                   kt_vec3_sub(end_point(r, &end[1]), end_point(r, end)));
    if (marker >= 0)
        end->at = kt_marker_at(r->model, body, marker);
    end->rotation = marker >= 0 ? kt_rotation_matrix(turn) : end->rotation;
    end->marker = NULL;
    end->at = kt_vec3_add(end->at, kt_vec3_scale(kt_vec3_dot(axis, apart), axis));
    return KT_OK;
}

static kt_status fix_threads(const restart *r, const double *q, kt_error *error) {
    kt_status status = kt_kinematics_update(r->model, r->data, q, NULL, NULL, error);
    for (int i = 0; status == KT_OK && i < r->description->loop_count; i++)
        if (kt_descriptor_key(kt_loop_descriptor(r->loops[i].type), "pitch") != NULL)
            status = fix_thread(r, &r->loops[i], error);
    return status;
}

/* Puts the state into the joints. All of it is given now, so that the assembly keeps it. */
static void set_restart_state(const restart *r, const double *q, const double *v) {
    for (int body = 1; body < kt_model_body_count(r->model); body++) {
        const kt_coordinates at = kt_body_coordinates(r->model, body);
        kt_joint *joint = &r->bodies[kt_body_source(r->model, body)].joint;
        if (at.nq > 0) /* without coordinates q may be NULL */
            memcpy(joint->position, q + at.q, (size_t)at.nq * sizeof(double));
        memset(joint->velocity, 0, sizeof joint->velocity);
        if (v != NULL && at.nv > 0)
            memcpy(joint->velocity, v + at.v, (size_t)at.nv * sizeof(double));
        joint->guess = false;
        joint->given =
            KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION | (v != NULL ? KT_GIVEN_VELOCITY | KT_GIVEN_ANGULAR : 0U);
    }
}

static void *copy_of(kt_pool *pool, const void *array, int count, size_t size) {
    void *copy = kt_pool_take(pool, (size_t)count + 1, size);
    if (copy != NULL && count > 0)
        memcpy(copy, array, (size_t)count * size);
    return copy;
}

/* Lengths and angles that compilation measures in the initial state are fixed first, because the initial state becomes
 * (q, v). */
static kt_status change_to_state(restart *r, kt_pool *pool, const double *q, const double *v, kt_error *error) {
    const kt_description *d = r->description;
    r->bodies = copy_of(pool, d->bodies, d->body_count, sizeof *r->bodies);
    r->loops = copy_of(pool, d->loops, d->loop_count, sizeof *r->loops);
    r->effects = copy_of(pool, d->effects, d->effect_count, sizeof *r->effects);
    r->q = kt_pool_take(pool, (size_t)kt_model_nq(r->model) + 1, sizeof(double));
    r->v = kt_pool_take(pool, (size_t)kt_model_nv(r->model) + 1, sizeof(double));
    if (!r->bodies || !r->loops || !r->effects || !r->q || !r->v)
        return kt_reject_memory(error);
    kt_status status = fix_distances(r, error);
    if (status == KT_OK)
        status = fix_lengths(r, error);
    if (status == KT_OK)
        status = fix_threads(r, q, error);
    if (status == KT_OK)
        set_restart_state(r, q, v);
    return status;
}

kt_status kt_scene_start_from(kt_scene *scene, const kt_model *model, const double *q, const double *v,
                              kt_error *error) {
    if (KT_IS_MISSING(error, scene, model, q || kt_model_nq(model) == 0))
        return KT_ERROR_ARGUMENT;
    restart r = {.model = model, .description = &scene->description};
    kt_pool pool = {NULL, 0};
    kt_status status = kt_data_create(model, &r.data, error);
    if (status == KT_OK)
        status = change_to_state(&r, &pool, q, v, error);
    kt_data_free(r.data);
    if (status != KT_OK) {
        kt_pool_free(pool.chunks);
        return status;
    }
    const kt_description *d = &scene->description;
    kt_numbers_move(scene, d->bodies, (size_t)d->body_count * sizeof *d->bodies, r.bodies);
    kt_numbers_move(scene, d->loops, (size_t)d->loop_count * sizeof *d->loops, r.loops);
    kt_numbers_move(scene, d->effects, (size_t)d->effect_count * sizeof *d->effects, r.effects);
    scene->description.bodies = r.bodies;
    scene->description.loops = r.loops;
    scene->description.effects = r.effects;
    scene->from = NULL;
    scene->memory = kt_pool_join(pool.chunks, scene->memory);
    return KT_OK;
}

kt_status kt_scene_start_states(kt_scene *scene, const double *x, kt_error *error) {
    if (KT_IS_MISSING(error, scene, x || scene->description.state_count <= 0))
        return KT_ERROR_ARGUMENT;
    kt_description *d = &scene->description;
    kt_pool pool = {NULL, 0};
    kt_auxiliary_state *states = copy_of(&pool, d->states, d->state_count, sizeof *states);
    if (states == NULL)
        return kt_reject_memory(error);
    for (int i = 0; i < d->state_count; i++)
        states[i].initial = x[i];
    kt_numbers_move(scene, d->states, (size_t)d->state_count * sizeof *d->states, states);
    d->states = states;
    kt_footholds_follow(scene);
    scene->memory = kt_pool_join(pool.chunks, scene->memory);
    return KT_OK;
}
