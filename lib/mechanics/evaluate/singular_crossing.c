/* The accelerations of a mechanism with loops.
 *
 * At a singular position of the loops one equation depends on the others. The size s of the smallest direction of A,
 * relative to its usual size, is zero at this position. A motion through such a position is smooth, and so is its
 * acceleration, but the acceleration cannot be computed at this position. A motion that passes at a small distance
 * bends away instead. The bend has a size of about sqrt(d) if the lengths are off by d. Near such positions
 * (KT_NEAR_SINGULAR), two ways lead to an acceleration.
 *
 * Directly. The nearly dependent equation restricts the motion quadratically. With coordinates x, y along the two
 * branches that meet, the equation is x y = d, and the curvature is d / s^3. A position that violates this equation by
 * c lies on x y = d + c, and has the acceleration of a motion along this curve. The error is about c v^2 / s^3.
 * Rounding in A and b'' themselves adds 1e-16 v^2 / s only. The part of c that is due to rounding is measured. For this
 * the state, q and v, is closed by Newton's method, and then moved by as much as residuals can be off (ROUNDING). The
 * change of the acceleration is the error. A stage of a step violates the loops by more than rounding. This part is the
 * error of the step, which the method estimates itself, because the acceleration is smooth next to the loops, too. This
 * estimate is no reason to interpolate. Errors of the neighbouring states have one sign throughout a step, and no
 * difference of stages shows them. (An example is Sarrus' linkage, flat, with d = 2.15e-4. Within 1 ms it gained
 * energy. The gain was 3.4e-6 of 113 J, and a tolerance of 1e-10 did not reduce it.)
 *
 * Interpolated along the motion. Let (q, v)(s) be any smooth family of states on the manifold, with the given state at
 * s = 0. Then a(s) is smooth, and a(0) is required. The states are q (+) s v and v, both projected, for s = -3 h to 3 h
 * in steps of h, without 0:
 *
 *     a(0) = (15 (a_1 + a_-1) - 6 (a_2 + a_-2) + (a_3 + a_-3)) / 20 + h^6 a6 / 20      a6: the sixth derivative
 *
 * The distance h moves the fastest coordinate by 0.02 of its unit. Then the error is 3e-12 a6. Rounding errors at the
 * nearest of these states are about 3e-11 v^2. The error is estimated with the interpolation of the inner four states:
 *
 *     a(0) = (4 (a_1 + a_-1) - (a_2 + a_-2)) / 6 + h^4 a4 / 6
 *
 * While both differ, h is halved, because a mechanism may change its shape within less than its units. If loops are
 * driven, time varies with s. Otherwise only groups near a singular position move. Forces are those of
 * the given state throughout. If nothing moves, the acceleration computed without interpolation is used.
 *
 * If more than one degree of freedom is left at the position, the branches form a cone. A motion of curvature k at the
 * distance s from the apex misses the apex by e = k s^2. On the cone x^2 + e^2 = z^2 its acceleration has a part
 *
 *     e^2 v^2 / s^3 = k^2 s v^2
 *
 * The neighbouring states, farther away on both sides, do not have this part. However, accelerations follow different
 * curves on the two sides of the apex. Let o_k = (a_k - a_-k) / 2 be the odd parts. For a smooth family their
 * extrapolation to 0 vanishes:
 *
 *     (5 o_1 - 4 o_2 + o_3) / 2 = h^5 a5 / 2                                   a5: the fifth derivative
 *
 * For other families, the value is half the jump between the sides. Half the jump is a lower bound of the
 * interpolation's error. If it is not small compared with s v^2, the error is at least s v^2. (In the mechanism's units
 * k = 1.)
 *
 * The difference of the two interpolations does not show a bend between the inner states, because all states lie on the
 * branches outside the bend. The closed state shows the bend. If its acceleration differs from the interpolated one by
 * more than both errors explain, the path bends, and the direct acceleration is right. (The difference is proportional
 * to d, and the error to c. Both grow as v^2 / s^3, so their ratio is d / c at every s.) Otherwise d does not exceed
 * the rounding errors, and the acceleration with the smaller error is taken. If s is below the root of ROUNDING, the
 * steps that close a state, c / s, are longer than s. Then the closed state may be any. A motion that misses the
 * position by more than rounding does not come so near.
 *
 * If two loops fold at the same time, one of them swings through. The coordinates of the other move by only d times as
 * much, and may meet a singular position of their own. At a distance x from that position s is only d x, and a residual
 * c bends the path as x y = c / d does. The direct error is about
 *
 *     (c / d) v^2 / x^3 = c v^2 / (s x^2)
 *
 * The interpolated states have this error, too. This error decreases with the distance of the states, until the error
 * of the interpolation itself prevails. Among several distances, the distance with the smallest total error is used. A
 * velocity w along the other branch cannot be determined near the position. With it, the forces of the loops, which do
 * no work along the motion, would do work. So this power is removed from such accelerations (remove_power). Without the
 * removal, a scissor lift with d = 1e-9 lost 26 of 33 J. With it, the energy is kept to 4e-7 J.
 *
 * The effect of an error e of an acceleration is reported (kt_data_crossings) as the drift while the motion is near the
 * position, e T^2 / 2. T is the time h, or the time in which s would vanish, s / speed. For the direct acceleration the
 * drift is c / s. If two loops fold at the same time, a motion may stay for longer. Then the drift within a step is
 * e / 2 times the square of the step.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/rejected_loops.h"
#include "base/where.h"
#include "evaluate/evaluate.h"

#include "dynamics/dynamics.h"
#include "model/scratch.h"

#include <string.h>

/* How far the first dt moves the fastest coordinate, relative to its unit. */
#define NEIGHBOUR_DISTANCE (2.0 * KT_NEAR_SINGULAR)
/* The least size of a direction at the neighbouring states, relative to its usual size. */
#define CLEAR (0.1 * KT_NEAR_SINGULAR)
/* Limits for two loops that fold at the same time. FARTHER is the least ratio of s at the neighbouring states to s at
 * the given state. UNCLEAR_MOST is the largest error of their accelerations, relative to v^2. */
#define FARTHER 4.0
#define UNCLEAR_MOST 1e-2
/* The largest difference of the interpolations of six and of four states, relative to the largest acceleration. If a
 * varies within R units,
 *
 *     difference = 4 (0.02 / R)^4,   error = 36 (0.02 / R)^6
 *
 * HALVINGS_MOST is the largest number of times that h is halved. Each halving reduces the error to 1/64, and enlarges
 * the rounding error eightfold. */
#define APART_MOST 2e-6
enum { HALVINGS_MOST = 3 };
/* ROUNDING is the largest residual due to rounding, relative to its scale. ERRORS_MOST is the largest difference of two
 * right accelerations, relative to their estimated errors. */
#define ROUNDING (2.0 * KT_CLOSED)
#define ERRORS_MOST 4.0
/* The path counts as bent, without further states, under two conditions. The direct acceleration differs from the mean
 * of the inner two accelerations by more than half of its size, and the error of the direct acceleration is at most
 * this part of the difference. */
#define BENT 1e-3
/* The least jump between the two sides, relative to s v^2, of a motion that misses an apex. Jumps of 2e-3 to 3e-2 were
 * observed at cones. Elsewhere, jumps were below 1e-4. */
#define JUMP_LEAST 1e-3
/* The error of a direct acceleration, relative to the largest acceleration, up to which no interpolation is
 * computed. */
#define ACCURATE 1e-11
/* Newton's steps that close a state, each of which squares the gap. */
enum { CLOSINGS_MOST = 4 };

static bool is_singular(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->near[g] && data->rank[g] < model->group[g].rank[KT_ROWS_ALL])
            return true;
    return false;
}

/* A motion near a singular position. Errors and differences of accelerations are the largest of the groups'
 * coordinates, each over its unit. */
typedef struct crossing {
    const kt_model *model;
    kt_data *data;
    kt_dynamic_state at;
    bool driven;             /* loops change with time */
    const double *direction; /* v of the coordinates that move, zero for the others */
    double *closed;          /* the acceleration at the state closed to rounding, computed directly */
    double rounding;         /* error of the direct acceleration due to rounding */
    double interpolated, dt; /* error of the interpolated one, and the distance of its states, s */
    bool bent;               /* the path bends between the states */
    double apart;            /* the difference of the interpolations, in which that error is seen */
    double s;                /* the size of the smallest direction at the given state, over its usual size */
    bool cone;               /* more than one degree of freedom is left at the position */
    bool folded;             /* two loops fold at the same time: s is small at the neighbouring states, too */
    double least, slope;     /* s at the nearest of the states, and that of those adopted over their dt */
    double between, jump;    /* half the jump between the two sides: as last interpolated, and of the adopted one */
} crossing;

/* The largest |a_i - b_i| (b: NULL for zero) of the groups' coordinates, over their units. */
static double largest_difference(const kt_model *model, const double *a, const double *b) {
    double most = 0.0;
    for (size_t i = 0; i < model->n.group_v; i++) {
        const int32_t k = model->group_v[i];
        most = fmax(most, fabs(b ? a[k] - b[k] : a[k]) / model->unit[i]);
    }
    return most;
}

/* ---- directly ---------------------------------------------------------------------------------------------------- */

/* Moves q to residuals of `off` times the rounding errors, in one of Newton's steps, from equations filled at q. The
 * amounts differ from row to row, so that no direction can be orthogonal to the amounts of all rows. */
static bool move_to(const crossing *c, double off, double *q) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const kt_reduction_kernels *kernels = model->group_kernels;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        for (int r = 0; r < w.k; r++)
            w.right[r] = w.closes[r] * (off * ROUNDING * w.scale[r] * (1.0 + (5 * r % 8) / 8.0) - w.residual[r]);
    }
    if (!kernels->prepare(model, data, KT_ROWS_ALL, false) ||
        !kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, data->delta))
        return false;
    memcpy(data->moved_q, q, model->n.q * sizeof *q);
    kt_position_add(model, data->moved_q, data->delta, q);
    return true;
}

/* The neighbouring state in data, under the same forces. */
static kt_dynamic_state neighbour_of(const crossing *c, double t) {
    return (kt_dynamic_state){t, c->data->neighbour_q, c->data->neighbour_v, c->at.tau, c->at.external};
}

/* Closes the velocities of the neighbouring state, from equations filled at this state, and computes its
 * acceleration. */
static bool accelerate_closed(const crossing *c, double *a) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const kt_reduction_kernels *kernels = model->group_kernels;
    if (!kernels->prepare(model, data, KT_ROWS_ALL, false) ||
        !kernels->least_step(model, data, KT_METRIC_MASS, model->zero, data->delta))
        return false;
    for (size_t i = 0; i < model->n.v; i++)
        data->neighbour_v[i] += data->delta[i];
    const kt_dynamic_state neighbour = neighbour_of(c, c->at.t);
    return kernels->forward(model, data, &neighbour, false, a) == 0 && !is_singular(model, data);
}

/* Computes the accelerations at the closed state and next to this state; returns false if any of these cannot be
 * computed. */
static bool accelerate_next(const crossing *c, double *next) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const kt_reduction_kernels *kernels = model->group_kernels;
    kt_violation violation;
    double before = (double)INFINITY;
    memcpy(data->neighbour_q, c->at.q, model->n.q * sizeof *c->at.q);
    memcpy(data->neighbour_v, c->at.v, model->n.v * sizeof *c->at.v);
    for (int k = 0; k <= CLOSINGS_MOST; k++) {
        if (!kernels->residuals(model, data, c->at.t, data->neighbour_q, c->at.v, NULL, &violation))
            return false;
        if (violation.gap <= KT_CLOSED || violation.gap > 0.5 * before || k == CLOSINGS_MOST)
            break;
        before = violation.gap;
        if (!move_to(c, 0.0, data->neighbour_q))
            return false;
    }
    return accelerate_closed(c, c->closed) &&
           kernels->residuals(model, data, c->at.t, data->neighbour_q, NULL, NULL, &violation) &&
           move_to(c, 1.0, data->neighbour_q) &&
           kernels->residuals(model, data, c->at.t, data->neighbour_q, data->neighbour_v, NULL, &violation) &&
           accelerate_closed(c, next);
}

/* The error of the acceleration that was computed directly, or infinity. */
static double measure_direct(const crossing *c) {
    double *next = kt_scratch_part(c->model, c->data, 0);
    return accelerate_next(c, next) ? largest_difference(c->model, next, c->closed) : (double)INFINITY;
}

/* ---- interpolated ------------------------------------------------------------------------------------------------ */

/* Whether no group is so near to a singular position that rounding errors dominate the acceleration. If two loops fold
 * at the same time, states at the distance x are accepted if the given state is nearer to the position than these
 * states. */
static bool instant_is_clear(crossing *c, double dt) {
    const double s = kt_smallest_direction(c->model, c->data, KT_ROWS_ALL);
    const double x = dt * largest_difference(c->model, c->direction, NULL);
    c->least = fmin(c->least, s);
    return s >= CLEAR || (s > 0.0 && s >= FARTHER * c->s && ROUNDING <= UNCLEAR_MOST * s * x * x);
}

/* Computes the acceleration at the neighbouring state dt away along the motion, into `out`. Returns false if the
 * acceleration cannot be computed at that state. */
static bool accelerate_neighbour(crossing *c, double dt, double *out) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const kt_dynamic_state neighbour = neighbour_of(c, c->at.t + (c->driven ? dt : 0.0));
    const kt_projection_limits limits = {.steps = 6, .gap = 0.0, .tolerance = KT_CLOSED_ASSEMBLED};
    bool changed = false;
    kt_violation violation;
    for (size_t i = 0; i < model->n.v; i++)
        data->neighbour_v[i] = dt * c->direction[i];
    kt_position_add(model, c->at.q, data->neighbour_v, data->neighbour_q);
    memcpy(data->neighbour_v, c->at.v, model->n.v * sizeof *c->at.v);
    return kt_project_in_place(model, data, neighbour.t, data->neighbour_q, data->neighbour_v, &limits, &changed,
                               &violation) == KT_CLOSURE_DONE &&
           model->group_kernels->forward(model, data, &neighbour, false, out) == 0 && instant_is_clear(c, dt);
}

/* Whether the path bends between the inner two of the states; a holds 3/4 of the sum of their accelerations. If so, the
 * other states need not be computed. */
static bool bends_within(const crossing *c, const double *a, double *mean) {
    for (size_t i = 0; i < c->model->n.v; i++)
        mean[i] = a[i] / 1.5;
    const double apart = largest_difference(c->model, c->closed, mean);
    return c->rounding < BENT * apart && apart > 0.5 * largest_difference(c->model, c->closed, NULL);
}

/* Interpolates the acceleration from six neighbouring states. Returns the difference from the interpolation of the
 * inner four, relative to the largest acceleration. Returns infinity if a state cannot be computed, or if the path
 * bends between the states. */
static double interpolate_crossing(crossing *c, double dt, double *a) {
    static const double node[6] = {-1.0, 1.0, -2.0, 2.0, -3.0, 3.0};
    static const double weight[6] = {0.75, 0.75, -0.3, -0.3, 0.05, 0.05};
    static const double inner[6] = {2.0 / 3.0, 2.0 / 3.0, -1.0 / 6.0, -1.0 / 6.0, 0.0, 0.0};
    static const double odd[6] = {-1.25, 1.25, 1.0, -1.0, -0.25, 0.25};
    const size_t nv = c->model->n.v;
    double *one = kt_scratch_part(c->model, c->data, 0), *jump = kt_scratch_part(c->model, c->data, 1);
    double *four = kt_scratch_part(c->model, c->data, 3);
    c->least = 1.0;
    memset(a, 0, nv * sizeof *a);
    memset(four, 0, nv * sizeof *four);
    memset(jump, 0, nv * sizeof *jump);
    for (int k = 0; k < 6; k++) {
        if (!accelerate_neighbour(c, node[k] * dt, one))
            return (double)INFINITY;
        for (size_t i = 0; i < nv; i++) {
            a[i] += weight[k] * one[i];
            four[i] += inner[k] * one[i];
            jump[i] += odd[k] * one[i];
        }
        c->bent = k == 1 && bends_within(c, a, one);
        if (c->bent)
            return (double)INFINITY;
    }
    c->between = largest_difference(c->model, jump, NULL);
    const double apart = largest_difference(c->model, a, four);
    return apart > 0.0 ? apart / largest_difference(c->model, a, NULL) : 0.0;
}

/* Writes the velocities of the coordinates that move to `direction`. Returns the largest of these speeds relative to
 * its unit. *pull becomes the largest acceleration, relative to its unit, too. */
static double choose_direction(crossing *c, const double *a, double *direction, double *pull) {
    const kt_model *model = c->model;
    double speed = 0.0;
    *pull = 0.0;
    memset(direction, 0, model->n.v * sizeof *direction);
    if (c->driven)
        memcpy(direction, c->at.v, model->n.v * sizeof *direction);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (!c->driven && !c->data->near[g])
            continue;
        c->cone |= c->data->near[g] && group->v_count > group->rank[KT_ROWS_ALL] + 1;
        for (int32_t i = group->v; i < group->v + group->v_count; i++) {
            const int32_t k = model->group_v[i];
            direction[k] = c->at.v[k];
            speed = fmax(speed, fabs(c->at.v[k]) / model->unit[i]);
            *pull = fmax(*pull, fabs(a[k]) / model->unit[i]);
        }
    }
    return speed;
}

/* Returns the error of an interpolation, 36 x^6, from `apart`, which is 4 x^4. If two loops fold at the same time,
 * rounding errors are added. */
static double interpolation_error_of(const crossing *c, double dt, double apart, const double *try) {
    const double own = fmin(apart, 4.5 * apart * sqrt(apart)) * largest_difference(c->model, try, NULL);
    return c->least < CLEAR ? own + ROUNDING / (c->least * dt * dt) : own;
}

/* Stores the interpolated acceleration `try` as the best one so far, with its distance dt and its error. */
static void adopt(crossing *c, double dt, double apart, const double *try, double *a) {
    memcpy(a, try, c->model->n.v * sizeof *a);
    c->dt = dt;
    c->apart = apart * largest_difference(c->model, try, NULL);
    c->jump = c->cone ? c->between : 0.0;
    c->interpolated = interpolation_error_of(c, dt, apart, try);
    c->slope = c->least / dt;
}

/* Whether the closed state's acceleration differs from the interpolated one by more than the errors explain: then the
 * path bends between the states. */
static bool contradicts(const crossing *c, const double *a) {
    return largest_difference(c->model, a, c->closed) > ERRORS_MOST * (c->rounding + c->interpolated);
}

/* Halves dt while the interpolations of six and of four states approach each other and differ by more than APART_MOST.
 * `apart` is their difference at first. */
static void halve_distance(crossing *c, double dt, double apart, double *try, double *a) {
    for (int k = 0; k < HALVINGS_MOST && apart > APART_MOST && !contradicts(c, a); k++) {
        const double before = apart;
        dt *= 0.5;
        apart = interpolate_crossing(c, dt, try);
        if (!(apart < before))
            return;
        adopt(c, dt, apart, try, a);
    }
}

/* Replaces a, which was computed without the lost direction, by the interpolated acceleration. Returns false if the
 * interpolated one cannot be computed, or if the path bends. */
static bool interpolate_across(crossing *c, double *a) {
    static const double wider[] = {1.0, 1.5, 0.6,  2.5,
                                   4.0, 8.0, 14.0, 20.0}; /* the last three if two loops fold at the same time */
    enum { USUAL = 5 };
    double *try = kt_scratch_part(c->model, c->data, 2), *direction = c->data->moved_v, pull;
    c->direction = direction;
    const double speed = choose_direction(c, a, direction, &pull);
    if (!(speed > KT_SPEED_LEAST))
        return false;
    /* if time varies: at most so far that the velocity remains nearly v */
    const double most = c->driven && pull > 0.0 ? 0.1 * speed / pull : HUGE_VAL;
    for (size_t k = 0; k < (c->folded ? sizeof wider / sizeof *wider : USUAL) && !c->bent; k++) {
        const double dt = wider[k] * fmin(NEIGHBOUR_DISTANCE / speed, most);
        const double apart = dt > most ? (double)INFINITY : interpolate_crossing(c, dt, try);
        c->folded |= dt <= most && c->least < CLEAR;
        if (apart == (double)INFINITY)
            continue;
        if (c->dt > 0.0 && interpolation_error_of(c, dt, apart, try) >= c->interpolated)
            break;
        adopt(c, dt, apart, try, a);
        if (!c->folded) {
            halve_distance(c, dt, apart, try, a);
            return true;
        }
    }
    if (c->dt > 0.0) {
        c->bent = false; /* if the path bends between farther states, these are not taken */
        if (c->rounding == (double)INFINITY && c->s > 0.0)
            c->rounding = ROUNDING * c->slope * c->slope / (c->s * c->s * c->s);
        return true;
    }
    c->data->iterations.capped += !c->bent;
    return false;
}

/* ---- the choice -------------------------------------------------------------------------------------------------- */

/* The error of the interpolation if its sides differ. */
static double error_of_sides(const crossing *c) {
    const double speed = largest_difference(c->model, c->at.v, NULL), miss = c->s * speed * speed;
    return c->jump > JUMP_LEAST * miss ? fmax(c->jump, miss) : c->jump;
}

/* Whether the direct acceleration is better. An interpolation is more exact than its estimate if both orders agree to
 * APART_MOST, and if the two sides agree. */
static bool is_direct_better(crossing *c, const double *a) {
    const bool smooth = c->jump <= c->interpolated;
    const bool settled = smooth && c->apart <= APART_MOST * largest_difference(c->model, a, NULL);
    c->bent = contradicts(c, a);
    return c->bent || (!settled && c->rounding < (smooth ? c->interpolated : error_of_sides(c)));
}

/* Adds an evaluation next to a singular position, whose acceleration is interpolated or direct, to the record of
 * kt_data_crossings. If errors cannot be measured, the position itself is uncertain within
 * ROUNDING of x y. */
static void count_crossing(const crossing *c, bool interpolated) {
    const double nearest = sqrt(ROUNDING), speed = largest_difference(c->model, c->at.v, NULL), s = c->s;
    const double error = interpolated ? c->interpolated : c->rounding, time = interpolated ? c->dt : s / speed;
    const bool measured = isfinite(error) && time > 0.0;
    const bool either = interpolated && isfinite(c->rounding); /* the direct one may be right, too */
    const double apart = either ? largest_difference(c->model, c->data->scratch, c->closed) : 0.0;
    kt_crossings *seen = &c->data->crossings;
    kt_passage *passage = &c->data->passage;
    const double drift = measured ? 0.5 * error * time * time : nearest, left = fmax(s, nearest) / speed;
    passage->time = passage->time > 0.0 ? fmin(passage->time, left) : left;
    passage->acceleration = fmax(passage->acceleration, measured ? error : 0.0);
    passage->error = fmax(passage->error, fmax(drift, 0.5 * apart * left * left));
    passage->jump = fmax(passage->jump, apart);
    if (c->bent && !interpolated)
        seen->bend = seen->bend > 0.0 ? fmin(seen->bend, s / speed) : s / speed;
    seen->since = seen->near > 0 ? fmin(seen->since, c->at.t) : c->at.t;
    seen->smallest = seen->near++ ? fmin(seen->smallest, s) : s;
    seen->interpolated += interpolated;
    seen->error = fmax(seen->error, drift);
}

/* Corrects an acceleration along the motion of the groups, so that the forces that hold the loops closed do no work. If
 * the loops do not change with time, the condition is
 *
 *     v . (M a + h - tau - J' external) = 0
 */
static void remove_power(const crossing *c, double *a) {
    const kt_model *model = c->model;
    const double *v = c->at.v, rate = largest_difference(model, v, NULL);
    double *needed = kt_scratch_part(model, c->data, 1), *at = kt_scratch_part(model, c->data, 2), power[2];
    double *given = kt_scratch_part(model, c->data, 3);
    memcpy(given, a, model->n.v * sizeof *a);
    memcpy(at, a, model->n.v * sizeof *a);
    for (int k = 0; k < 2; k++) { /* with a; with a + rate v, which adds rate v . M v */
        if (kt_inverse_trusted(model, c->data, c->at.q, v, at, c->at.external, needed, NULL) != KT_OK)
            return;
        power[k] = 0.0;
        for (size_t i = 0; i < model->n.group_v; i++) {
            const int32_t j = model->group_v[i];
            power[k] += v[j] * (needed[j] - c->at.tau[j]);
            at[j] = given[j] + rate * v[j];
        }
    }
    const double by = power[1] > power[0] ? power[0] / (power[1] - power[0]) : 0.0;
    memcpy(a, given, model->n.v * sizeof *a);
    for (size_t i = 0; i < model->n.group_v; i++)
        a[model->group_v[i]] -= by * rate * v[model->group_v[i]];
}

/* Computes the acceleration near a singular position again, if a better one than the direct one in data->scratch is
 * available. Returns the result of `forward`.
 *
 * lost: the direct acceleration could not be computed. */
static size_t choose_acceleration(crossing *c, bool lost) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const kt_reduction_kernels *kernels = model->group_kernels;
    double *a = data->scratch;
    size_t failed = 0;
    c->s = lost ? 0.0 : kt_smallest_direction(model, data, KT_ROWS_ALL);
    c->closed = kt_scratch_part(model, data, 4);
    c->rounding = c->s > sqrt(ROUNDING) ? measure_direct(c) : (double)INFINITY;
    if (!(c->rounding <= ACCURATE * largest_difference(model, a, NULL))) {
        if (c->rounding == (double)INFINITY)
            memcpy(c->closed, a, model->n.v * sizeof *a);
        failed = kernels->forward(model, data, &c->at, true, a);
        data->interpolated = !failed && interpolate_across(c, a) && (lost || !is_direct_better(c, a));
    }
    count_crossing(c, data->interpolated);
    if (!failed && !data->interpolated)
        failed = kernels->forward(model, data, &c->at, false, a);
    if (!failed && c->folded && !c->driven && (data->interpolated || (c->s > 0.0 && c->s <= sqrt(ROUNDING))))
        remove_power(c, a);
    return failed;
}

size_t kt_crossing_accelerate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, size_t failed) {
    const bool is_lost = is_singular(model, data);
    crossing c = {.model = model, .data = data, .at = *at, .driven = model->driven};
    return failed && !is_lost ? failed : choose_acceleration(&c, is_lost);
}
