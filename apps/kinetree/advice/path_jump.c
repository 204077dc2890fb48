/* The watch of paths around surfaces.
 *
 * With the length L and its rate L' at both ends of a step h, the rates explain the change of a length without a jump
 * up to an error of third order:
 *     e = L1 - L0 - h (L0' + L1') / 2
 * If |e| exceeds a part of the radius, the positions between the two states are interpolated with Hermite's cubic.
 * Steps in which the length changes by much are divided into parts. A part is halved, and the half with the larger |e|
 * is kept. Without a jump, |e| soon falls below the bound. A jump remains in an interval of any length. Two opposite
 * jumps within one part are missed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/growth.h"

#include "kinetree/control.h"
#include "kinetree/dynamics.h"
#include "kinetree/effect.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HALVINGS = 40, PARTS_MOST = 64 };

/* The smallest |e| of a jump, over the radius. */
static const double least_jump = 1e-3;

/* A point that is within a surface by less, over the radius, is on it. */
static const double touching = 1e-12;

/* A state within a step: the part of the step, from 0 to 1, and the length and the rate of a path. */
typedef struct kt_path_instant {
    double part, length, rate;
} kt_path_instant;

/* A step: its duration, and the velocities at its end. */
typedef struct kt_path_step {
    double duration;
    const double *v;
} kt_path_step;

/* ---- lengths ----------------------------------------------------------------------------------------------------- */

/* Computes the quantities of all effects in a state. Returns false if that fails. */
static bool measure_paths(kt_path_watch *watch, double time, const double *q, const double *v) {
    return kt_kinematics_update(watch->model, watch->data, q, v, NULL, NULL) == KT_OK &&
           kt_effect_quantities_evaluate(watch->model, watch->data, time, q, v, watch->quantities, NULL) == KT_OK;
}

/* Moves the data to a part of the step. Returns false if that fails. */
static bool move_into_step(kt_path_watch *watch, const kt_path_step *step, double part) {
    const double s = part, h = step->duration, begin = s * (1.0 - s) * (1.0 - s) * h, end = -s * s * (1.0 - s) * h;
    const double begin_rate = (1.0 - s) * (1.0 - 3.0 * s), end_rate = s * (3.0 * s - 2.0);
    for (int i = 0; i < kt_model_nv(watch->model); i++) {
        watch->change[i] = s * s * (3.0 - 2.0 * s) * watch->forward[i] + begin * watch->v[i] + end * step->v[i];
        watch->v_at[i] = 6.0 * s * (1.0 - s) * watch->forward[i] / h + begin_rate * watch->v[i] + end_rate * step->v[i];
    }
    kt_position_add(watch->model, watch->q, watch->change, watch->q_at);
    return measure_paths(watch, watch->time + s * h, watch->q_at, watch->v_at);
}

/* Returns the part of the change of a length between two instants that the rates do not explain. */
static double unexplained(const kt_path_instant *a, const kt_path_instant *b, double h) {
    return fabs(b->length - a->length - 0.5 * h * (b->part - a->part) * (a->rate + b->rate));
}

/* Computes the length and the rate of a path at a part of the step. Returns false if that fails. */
static bool measure_at(kt_path_watch *watch, const kt_path_state *path, const kt_path_step *step, double part,
                       kt_path_instant *at) {
    if (!move_into_step(watch, step, part))
        return false;
    *at = (kt_path_instant){part, watch->quantities[path->quantity[0]], watch->quantities[path->quantity[1]]};
    return true;
}

/* Locates a jump between two instants. Returns false if there is none. */
static bool locate_jump(kt_path_watch *watch, const kt_path_state *path, const kt_path_step *step, kt_path_instant *low,
                        kt_path_instant *high) {
    kt_path_instant middle;
    for (int k = 0; k < HALVINGS; k++) {
        if (!measure_at(watch, path, step, 0.5 * (low->part + high->part), &middle))
            return false;
        const double before = unexplained(low, &middle, step->duration);
        const double after = unexplained(&middle, high, step->duration);
        if (!(fmax(before, after) > least_jump * path->radius))
            return false;
        *(before > after ? high : low) = middle;
    }
    return true;
}

/* Searches a step for its first jump. Returns false if there is none. In a part, the length changes by at most a
 * quarter of the radius, as far as the states at both ends show. */
static bool search_jump(kt_path_watch *watch, const kt_path_state *path, const kt_path_step *step, kt_path_instant *low,
                        kt_path_instant *high) {
    const kt_path_instant end = *high;
    const double change = fmax(step->duration * fmax(fabs(low->rate), fabs(end.rate)), fabs(end.length - low->length));
    const int parts = (int)ceil(fmin(4.0 * change / path->radius + 1.0, PARTS_MOST));
    kt_path_instant begin = *low, next = end;
    for (int k = 1; k <= parts; k++, begin = next) {
        next = end;
        if (k < parts && !measure_at(watch, path, step, (double)k / parts, &next))
            return false;
        *low = begin;
        *high = next;
        if (unexplained(low, high, step->duration) > least_jump * path->radius &&
            locate_jump(watch, path, step, low, high))
            return true;
    }
    return false;
}

/* ---- the cause --------------------------------------------------------------------------------------------------- */

/* Returns the frame of an end of a path in the state of the data. */
static kt_pose pose_of_path_end(const kt_path_watch *watch, const kt_end *end) {
    const int body = end->body != NULL ? kt_body_find(watch->model, end->body) : 0;
    const int marker = end->marker != NULL ? kt_marker_find(watch->model, body, end->marker) : -1;
    kt_pose pose = kt_body_pose(watch->model, watch->data, body);
    kt_mat3 turned;
    if (marker >= 0)
        pose = kt_marker_pose(watch->model, watch->data, body, marker);
    else
        pose.position = kt_pose_apply(pose, end->at);
    if (kt_rotation_evaluate(&end->rotation, &turned, NULL) == KT_OK)
        pose.rotation = kt_mat3_multiply(pose.rotation, turned);
    return pose;
}

/* Returns how far a point is within a surface in the state of the data, m; negative: it is outside. */
static double depth_in_surface(const kt_path_watch *watch, const kt_path_point *surface, const kt_path_point *point) {
    const kt_pose on = pose_of_path_end(watch, &surface->end), at = pose_of_path_end(watch, &point->end);
    kt_vec3 place = kt_mat3_apply_transposed(on.rotation, kt_vec3_sub(at.position, on.position));
    const double square = kt_vec3_dot(surface->axis, surface->axis);
    if (square > 0.0)
        place = kt_vec3_sub(place, kt_vec3_scale(kt_vec3_dot(place, surface->axis) / square, surface->axis));
    return surface->radius - kt_vec3_norm(place);
}

/* Writes which points of the path are within surfaces in the state of the data: two bits for each surface. */
static void find_points_within(const kt_path_watch *watch, const kt_effect *effect, unsigned char *within) {
    for (int k = 1; k + 1 < effect->path_count; k++) {
        const kt_path_point *surface = &effect->path[k];
        within[k] = 0;
        for (int side = 0; side < 2 && surface->radius > 0.0; side++)
            if (depth_in_surface(watch, surface, &effect->path[k - 1 + 2 * side]) > 0.0)
                within[k] |= (unsigned char)(1U << side);
    }
}

static const char *path_body(const kt_effect *effect, int k) {
    return effect->path[k].end.body != NULL ? effect->path[k].end.body : "world";
}

/* Writes the cause of a jump between two parts of a step: a point that enters or leaves a surface, or else another way
 * around a surface. */
static void write_cause(kt_path_watch *watch, const kt_effect *effect, const kt_path_step *step, double low,
                        double high, char *text, size_t size) {
    unsigned char *within = calloc(2 * (size_t)effect->path_count, 1), *after;
    int surfaces = 0, last = 0;
    snprintf(text, size, "the path changes its way around a surface");
    if (within == NULL)
        return;
    after = within + effect->path_count;
    if (move_into_step(watch, step, low))
        find_points_within(watch, effect, within);
    if (move_into_step(watch, step, high))
        find_points_within(watch, effect, after);
    for (int k = 1; k + 1 < effect->path_count; k++) {
        const int changed = within[k] ^ after[k], point = changed & 1 ? k - 1 : k + 1;
        surfaces += effect->path[k].radius > 0.0;
        last = effect->path[k].radius > 0.0 ? k : last;
        if (changed != 0)
            snprintf(text, size, "entry %d of the path, on '%s', %s the surface of entry %d, on '%s'", point + 1,
                     path_body(effect, point), after[k] & changed ? "enters" : "leaves", k + 1, path_body(effect, k));
        if (changed != 0)
            surfaces = effect->path_count;
    }
    if (surfaces == 1)
        snprintf(text, size, "the path changes its way around the surface of entry %d, on '%s'", last + 1,
                 path_body(effect, last));
    free(within);
}

/* Returns whether a warning of this effect is in the list, which has those of the part before --resume. */
static bool jump_is_listed(const kt_path_watch *watch, const char *effect) {
    char begin[200];
    snprintf(begin, sizeof begin, "the path of effect '%.150s' jumps", effect);
    for (size_t i = 0; i < json_array_size(watch->warnings->list); i++) {
        const char *what = json_string_value(json_object_get(json_array_get(watch->warnings->list, i), "what"));
        if (what != NULL && strncmp(what, begin, strlen(begin)) == 0)
            return true;
    }
    return false;
}

static void warn_of_jump(kt_path_watch *watch, const kt_path_state *path, const kt_path_step *step,
                         const kt_path_instant *low, const kt_path_instant *high) {
    const char *name = kt_effect_name(watch->model, path->effect);
    const kt_warning warning = kt_warning_at(
        "path_jump", watch->time + high->part * step->duration, high->length - low->length, "m",
        "End the run before this time, with `until` or an event, or keep the points away from the surfaces");
    char cause[400];
    if (jump_is_listed(watch, name))
        return;
    write_cause(watch, &watch->scene->description.effects[path->effect], step, low->part, high->part, cause,
                sizeof cause);
    kt_warn(watch->warnings, &warning,
            "the path of effect '%s' jumps from %.6g to %.6g m at t = %.9g s, and the force with it: %s", name,
            low->length, high->length, warning.time, cause);
}

/* Warns of the point that is deepest within a surface at the start: there the path is straight, through the surface. */
static bool examine_start(kt_path_watch *watch, const kt_path_state *path) {
    const kt_effect *effect = &watch->scene->description.effects[path->effect];
    int on = 0, point = 0;
    double most = 0.0;
    for (int k = 1; k + 1 < effect->path_count; k++)
        for (int side = -1; side <= 1 && effect->path[k].radius > 0.0 && !effect->path[k].inside; side += 2) {
            const double depth = depth_in_surface(watch, &effect->path[k], &effect->path[k + side]);
            if (effect->path[k + side].radius > 0.0 || !(depth > fmax(most, touching * effect->path[k].radius)))
                continue;
            most = depth;
            on = k;
            point = k + side;
        }
    const kt_warning warning =
        kt_warning_at("path_inside", watch->time, most, "m", "Move the point out of the surface");
    if (on > 0)
        kt_warn(
            watch->warnings, &warning,
            "entry %d of the path of effect '%s', on '%s', begins %.3g m within the surface of entry %d, on '%s': the "
            "path leads straight through this surface",
            point + 1, kt_effect_name(watch->model, path->effect), path_body(effect, point), most, on + 1,
            path_body(effect, on));
    return on > 0;
}

/* ---- the watch --------------------------------------------------------------------------------------------------- */

/* Returns the radius of the smallest surface of a path; 0: it has none. */
static double smallest_radius(const kt_effect *effect) {
    double radius = 0.0;
    for (int k = 1; effect->path != NULL && k + 1 < effect->path_count; k++)
        if (effect->path[k].radius > 0.0 && (radius == 0.0 || effect->path[k].radius < radius))
            radius = effect->path[k].radius;
    return radius;
}

/* Lists the paths around surfaces. Returns the number of quantities of all effects. */
static int list_paths(kt_path_watch *watch) {
    int quantities = 0;
    for (int i = 0; i < watch->scene->description.effect_count; i++) {
        kt_path_state path = {.effect = i, .radius = smallest_radius(&watch->scene->description.effects[i])};
        for (int k = 0; k < kt_effect_quantity_count(watch->model, i); k++, quantities++) {
            const kt_effect_quantity quantity = kt_effect_quantity_at(watch->model, i, k);
            path.quantity[0] = quantity == KT_QUANTITY_LENGTH ? quantities : path.quantity[0];
            path.quantity[1] = quantity == KT_QUANTITY_LENGTH_RATE ? quantities : path.quantity[1];
        }
        if (path.radius > 0.0)
            watch->paths[watch->count++] = path;
    }
    return quantities;
}

void kt_path_watch_begin(kt_path_watch *watch, const kt_scene *scene, const kt_model *model, kt_warnings *warnings) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    *watch = (kt_path_watch){.scene = scene, .model = model, .warnings = warnings, .time = (double)NAN};
    watch->paths = calloc((size_t)scene->description.effect_count + 1, sizeof *watch->paths);
    const size_t quantities = watch->paths != NULL ? (size_t)list_paths(watch) : 0;
    if (watch->count == 0)
        return;
    watch->numbers = calloc(2 * nq + 4 * nv + quantities + 1, sizeof(double));
    if (watch->numbers == NULL || kt_data_create(model, &watch->data, NULL) != KT_OK) {
        watch->count = 0;
        return;
    }
    watch->q = watch->numbers;
    watch->q_at = watch->q + nq;
    watch->v = watch->q_at + nq;
    watch->v_at = watch->v + nv;
    watch->change = watch->v_at + nv;
    watch->forward = watch->change + nv;
    watch->quantities = watch->forward + nv;
}

void kt_path_watch_free(kt_path_watch *watch) {
    kt_data_free(watch->data);
    free(watch->numbers);
    free(watch->paths);
    *watch = (kt_path_watch){.count = 0};
}

/* Examines the step up to an instant of one path. Returns whether there was a warning. Several jumps within rounding of
 * each other are reported as one, with the lengths at the ends of the step. */
static bool examine_path(kt_path_watch *watch, kt_path_state *path, const kt_path_step *step,
                         const kt_path_instant *now) {
    const kt_path_instant last = {.length = path->length, .rate = path->rate};
    const double least = least_jump * path->radius;
    kt_path_instant low = last, high = *now;
    path->length = now->length;
    path->rate = now->rate;
    if (path->reported || !(step->duration > 0.0) || !(unexplained(&low, &high, step->duration) > least) ||
        !search_jump(watch, path, step, &low, &high))
        return false;
    if (step->duration * fmax(fabs(last.rate), fabs(now->rate)) < least) {
        low = last;
        high = *now;
    }
    path->reported = true;
    warn_of_jump(watch, path, step, &low, &high);
    return true;
}

bool kt_path_watch_add(kt_path_watch *watch, double time, const double *q, const double *v) {
    const kt_path_step step = {time - watch->time, v};
    const bool begins = isnan(watch->time);
    bool warned = false;
    if (watch->count == 0)
        return false;
    kt_position_subtract(watch->model, q, watch->q, watch->forward);
    for (int i = 0; i < watch->count && measure_paths(watch, time, q, v); i++) {
        kt_path_state *path = &watch->paths[i];
        const double length = watch->quantities[path->quantity[0]], rate = watch->quantities[path->quantity[1]];
        const kt_path_instant now = {1.0, length, rate};
        watch->time = begins ? time : watch->time;
        warned = (begins && examine_start(watch, path)) || warned;
        warned = examine_path(watch, path, &step, &now) || warned;
    }
    memcpy(watch->q, q, (size_t)kt_model_nq(watch->model) * sizeof *q);
    memcpy(watch->v, v, (size_t)kt_model_nv(watch->model) * sizeof *v);
    watch->time = time;
    return warned;
}
