/* Distances from contacts and stops, and bounds of their speeds.
 *
 * After each step, every contact and every stop is checked: may the step have leapt over it (gap.c)? For nearly all
 * contacts and stops the answer is no. Therefore distances and bounds of speeds are computed first, at far less cost
 * than gaps.
 *
 * - A stop, and a sphere about the centre of a free body, need a coordinate and its rate.
 *
 * - Points of one link above one plane of the ground (the corners of a box) need products with one vector. The bound of
 * their speed is the speed of the farthest point.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "evaluate/effect_ends.h"
#include "integrator/integrator.h"
#include "simulation/gap.h"

#include <math.h>

/* Rare cases are not inlined, because inlined code would make all other cases save registers. */
#define KT_BY_ITSELF static __attribute__((noinline))

/* Whether the path reaches the boundary, judged by the sum of both distances. If the effect acts at an end of the step,
 * the boundary lies at twice the depth at that end (gap.c). */
KT_INLINE bool is_within(const kt_simulation *simulation, double d0, double d1, double path) {
    const double least = d0 < d1 ? d0 : d1;
    if (least >= 0.0)
        return d0 + d1 < 2.0 * path;
    return d0 + d1 - 4.0 * least < 2.0 * path || simulation->lacks_end_stage;
}

bool kt_simulation_reaches_gap(const kt_simulation *simulation, size_t k, double h) {
    const size_t count = simulation->size.gap;
    const double *begin = simulation->gaps->clearance_begin + k, *end = simulation->gaps->clearance_end + k;
    const double speed = begin[count] > end[count] ? begin[count] : end[count];
    return is_within(simulation, begin[0], end[0], 2.0 * h * speed);
}

/* Not inlined, so that callers need not save registers. */
KT_BY_ITSELF bool is_near(const kt_simulation *simulation, double d0, double d1, double path) {
    return is_within(simulation, d0, d1, path);
}

/* Stores the distance and speed of effect k. Returns whether a step may have reached the boundary, judged by twice the
 * larger of the speeds at the ends of the step. */
KT_INLINE bool store_clearance(const kt_simulation *simulation, size_t k, double twice_h, double distance,
                               double speed) {
    const double *begin = &simulation->gaps->clearance_begin[k];
    double *end = &simulation->gaps->clearance_end[k];
    const size_t count = simulation->size.gap;
    const double path = twice_h * (speed > begin[count] ? speed : begin[count]), d0 = begin[0];
    end[0] = distance;
    end[count] = speed;
    return (!(distance >= path) || !(d0 >= path)) && is_near(simulation, d0, distance, path);
}

/* q and v at the end of the step. */
KT_INLINE const double *positions(const kt_simulation *simulation) { return simulation->integrator->y; }
KT_INLINE const double *velocities(const kt_simulation *simulation) {
    return simulation->integrator->y + simulation->size.nq;
}

typedef int64_t bits __attribute__((vector_size(16)));

/* min(a, b) of numbers that are finite. */
KT_INLINE kt_v2 least_of(kt_v2 a, kt_v2 b) {
    const bits first = a < b;
    return (kt_v2)((first & (bits)a) | (~first & (bits)b));
}

/* Measures one stop. */
KT_BY_ITSELF bool measure_stop(const kt_simulation *simulation, size_t k, double twice_h) {
    const kt_gap_source *source = &simulation->gaps->source[k];
    const double *q = positions(simulation) + source->q, *v = velocities(simulation) + source->v;
    return store_clearance(simulation, k, twice_h, kt_stop_distance(source->effect, *q), fabs(*v));
}

/* As kt_simulation_reaches_gap, for any of the effects from `first` to `end` - 1. */
KT_BY_ITSELF bool reaches_some(const kt_simulation *simulation, size_t first, size_t end, double h) {
    bool reached = false;
    for (size_t k = first; k < end && !reached; k++)
        reached = kt_simulation_reaches_gap(simulation, k, h);
    return reached;
}

/* Measures stops in pairs, as their coordinates follow each other. The sum of both speeds replaces the larger speed.
 * The signs of distance minus path are collected. If any sign is negative, a second pass checks which stops may have
 * been reached. */
static bool measure_stops(kt_simulation *simulation, size_t first, size_t end, double twice_h) {
    const size_t count = simulation->size.gap, n = end - first;
    const bool last = n % 2 != 0 && measure_stop(simulation, end - 1, twice_h);
    if (n == 1)
        return last;
    const kt_gap_source *source = &simulation->gaps->source[first];
    const double *q = positions(simulation) + source->q, *v = velocities(simulation) + source->v;
    const double *lower = simulation->gaps->stop_lower + first, *upper = simulation->gaps->stop_upper + first;
    const double *before = simulation->gaps->clearance_begin + first;
    double *now = simulation->gaps->clearance_end + first;
    const bits sign = {INT64_MIN, INT64_MIN};
    bits near = {0, 0};
    for (size_t k = 0; k + 1 < n; k += 2) {
        const kt_v2 x = kt_v2_load(q + k), speed = (kt_v2)((bits)kt_v2_load(v + k) & ~sign);
        const kt_v2 distance = least_of(kt_v2_load(upper + k) - x, x - kt_v2_load(lower + k));
        const kt_v2 path = kt_v2_splat(twice_h) * (speed + kt_v2_load(before + count + k));
        near |= (bits)(distance - path) | (bits)(kt_v2_load(before + k) - path);
        kt_v2_store(now + k, distance);
        kt_v2_store(now + count + k, speed);
    }
    return last || ((near[0] | near[1]) < 0 && reaches_some(simulation, first, end, 0.5 * twice_h));
}

/* Measures spheres on free bodies above planes of the ground: the distance is the height of the centre minus the
 * radius, the speed that of the centre along the normal. Returns whether the step may have reached a boundary. */
static bool measure_heights(kt_simulation *simulation, size_t first, size_t end, double twice_h) {
    const double *q = positions(simulation), *v = velocities(simulation);
    bool reached = false;
    for (size_t k = first; k < end; k++) {
        const kt_gap_source *source = &simulation->gaps->source[k];
        const kt_vec3 n = source->effect->frame[1].rotation.z;
        const double *u = v + source->v, distance = kt_gap_height(source, q) - source->effect->radius;
        if (store_clearance(simulation, k, twice_h, distance, fabs(n.x * u[0] + n.y * u[1] + n.z * u[2])))
            reached = true;
    }
    return reached;
}

/* Measures points of one link above a plane. With the link's axes A and along = A' n, a point p is along . p higher
 * than the link's origin. */
static bool measure_points(kt_simulation *simulation, size_t first, size_t end, double twice_h) {
    const kt_gap_source *source = &simulation->gaps->source[first];
    const kt_pose *plane = &source->effect->frame[1];
    const kt_force_frame *link = &simulation->data->force_link[source->effect->force_link[0]];
    const kt_v4 n = kt_v4_from(plane->rotation.z), *axes = link->link.axes, turn = link->link.omega;
    const double height = kt_v4_dot(n, link->base - kt_v4_from(plane->position) + link->local);
    const double x = kt_v4_dot(n, axes[0]), y = kt_v4_dot(n, axes[1]), z = kt_v4_dot(n, axes[2]);
    const double speed =
        sqrt(kt_v4_dot(link->velocity, link->velocity)) + sqrt(kt_v4_dot(turn, turn)) * source->farthest;
    bool reached = false;
    for (size_t k = first; k < end; k++) {
        const kt_effect_record *effect = simulation->gaps->source[k].effect;
        const kt_vec3 p = effect->frame[0].position;
        if (store_clearance(simulation, k, twice_h, height + (x * p.x + y * p.y + z * p.z) - effect->radius, speed))
            reached = true;
    }
    return reached;
}

/* Measures other contacts from both links. A point without an arm from its link's origin moves like that origin. */
static bool measure_ends(kt_simulation *simulation, size_t first, size_t end, double twice_h) {
    const kt_force_frame *links = simulation->data->force_link;
    bool reached = false;
    for (size_t k = first; k < end; k++) {
        const kt_gap_source *source = &simulation->gaps->source[k];
        const kt_effect_record *effect = source->effect;
        const kt_force_frame *a = &links[effect->force_link[0]], *b = &links[effect->force_link[1]];
        const kt_v4 n = kt_v4_apply_to(b->link.axes, effect->frame[1].rotation.z);
        kt_v4 from_link = (a->base - b->base) + (a->local - b->local), u = a->velocity - b->velocity;
        if (source->farthest > 0.0) {
            const kt_v4 arm = kt_v4_apply_to(a->link.axes, effect->frame[0].position);
            from_link += arm;
            u += kt_v4_cross(a->link.omega, arm);
        }
        u -= kt_v4_cross(b->link.omega, from_link);
        const double height = kt_v4_dot(n, from_link) - source->offset - effect->radius;
        if (store_clearance(simulation, k, twice_h, height, sqrt(kt_v4_dot(u, u))))
            reached = true;
    }
    return reached;
}

/* Measures the remaining effects by their gaps. */
static bool measure_others(kt_simulation *simulation, size_t first, size_t end, double twice_h) {
    bool reached = false;
    for (size_t k = first; k < end; k++) {
        kt_gap gap;
        kt_gaps_evaluate(simulation->model, simulation->data, &simulation->gaps->source[k], 1, positions(simulation),
                         velocities(simulation), true, &gap);
        if (store_clearance(simulation, k, twice_h, gap.distance, kt_vec3_norm(gap.velocity)))
            reached = true;
    }
    return reached;
}

bool kt_simulation_measure_clearances(kt_simulation *simulation, bool swept, double h) {
    static bool (*const measure[])(kt_simulation *, size_t, size_t, double) = {[KT_GAP_OF_COORDINATE] = measure_stops,
                                                                               [KT_GAP_OF_HEIGHT] = measure_heights,
                                                                               [KT_GAP_TO_GROUND] = measure_points,
                                                                               [KT_GAP_OF_ENDS] = measure_ends,
                                                                               [KT_GAP_OF_OTHERS] = measure_others};
    const kt_gap_source *row = simulation->gaps->source;
    if ((size_t)row->count == simulation->size.gap && (row->link != NULL || swept)) /* as in most models */
        return measure[row->form](simulation, 0, simulation->size.gap, 2.0 * h);
    bool reached = false;
    for (size_t k = 0, end; k < simulation->size.gap; k = end) {
        const kt_gap_source *source = &simulation->gaps->source[k];
        end = k + (size_t)source->count;
        if (source->link == NULL && !swept) {
            kt_force_frames_sweep(simulation->model, simulation->data, positions(simulation), velocities(simulation));
            swept = true;
        }
        if (measure[source->form](simulation, k, end, 2.0 * h))
            reached = true;
    }
    return reached;
}

void kt_simulation_begin_clearances(kt_simulation *simulation, bool swept) {
    for (size_t k = 0; k < simulation->size.gap; k++) {
        simulation->gaps->stop_lower[k] = simulation->gaps->source[k].effect->lower;
        simulation->gaps->stop_upper[k] = simulation->gaps->source[k].effect->upper;
    }
    (void)kt_simulation_measure_clearances(simulation, swept, 0.0);
}

void kt_simulation_pass_clearances(kt_simulation *simulation) {
    double *clearances = simulation->gaps->clearance_begin;
    simulation->gaps->clearance_begin = simulation->gaps->clearance_end;
    simulation->gaps->clearance_end = clearances;
}
