/* Projection onto the constraint manifold [MSD 7.55 to 7.58]:
 *     u <- u (+) du,   A du = -phi           repeated
 *     v <- v + dv,     A dv = b' - A v
 * du is least in the model's metric. dv is always least in kinetic energy, so that it equals the effect of an impulse
 * of the loops. The error of an evaluation near a singular position is a force of the loops. Only the mass metric
 * removes this error completely. For the N-four-bar, with RK4 at 1e-3 s over 10 s, the error is 2e-10 m, and 5e-8 m
 * with the identity.
 *
 * Near a singular position, a direction of size s is about to vanish. Steps along this direction divide phi by s, and
 * amplify the rounding errors of phi. A remaining gap c along the direction makes the motion bend as if the lengths had
 * an error of c (singular_crossing.c). The direction is therefore closed after the others, if c is above rounding and s
 * above the root of rounding. For a smaller s the steps c / s would be longer than s, and the equation is linear only
 * within s. Then the direction is left out until the motion has moved on, unless the gap exceeds the tolerance. If no
 * step closes such a gap, because the linkage would have to go elsewhere, the tolerance is that of an assembly.
 *
 * An open gap does no harm while it stays constant: the motion is that of a linkage whose lengths are wrong by c.
 * Closing the gap in the bend does harm. The state moves by c / s on to the path of other lengths, for which the same
 * drive has supplied other work. Therefore c is made small before the bend, at an s of a few thousandths, where the
 * step c / s is of the size of rounding. The next steps do not enlarge c. A parallelogram of d = 1e-10 is driven
 * through s = 3e-5 with a gap of 4 eps, which cost 2e-5 J of 10 J.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/dead_point.h"
#include "assembly/levenberg_marquardt.h"
#include "assembly/open_loops.h"
#include "assembly/rejected_loops.h"
#include "assembly/rounding.h"
#include "base/where.h"

#include "dynamics/dynamics.h"
#include "joint/joint.h"

#include <assert.h>
#include <string.h>

/* Bounds for a direction that is nearly lost, of the size s relative to its usual size.
 *   LEFT_OPEN: the gap in the direction that is left to rounding.
 *   WAY_IN: the s above which the gap may be no larger than in other directions.
 *   LEFT_MOVING: the velocity in the direction that is left, relative to the largest velocity.
 *   RESOLVED: the s above which a larger gap must be closed; the root of the rounding level.
 *
 * A velocity w (relative to the largest) that remains along the direction violates the equation by s w. While the
 * motion is near the position, for the time s / v, the equations of the acceleration, w v^2 / s, transfer it to the
 * other directions. Speeds are then exact to w, and energies as well. LEFT_MOVING is the default tolerance. Rounding
 * alone may leave c / s of the equation (left_by_rounding), which is less if s > 1e-3. This was measured with six
 * linkages of test/hard/band.py (d = 1e-4 to 1e-9). With LEFT_MOVING from 1e-12 to 1e-6, the numbers of steps are
 * equal. Their energies change by at most 3e-7 J. */
#define LEFT_OPEN (4.0 * KT_CLOSED)
#define WAY_IN (0.3 * KT_NEAR_SINGULAR)
#define LEFT_MOVING 1e-9
#define RESOLVED 1.5e-8

/* The size of the smallest direction of the groups that are near a singular position, over its usual size. The size is
 * 0 if a direction vanishes; then `last` is the size of the previous direction. */
static double smallest(const kt_model *model, const kt_data *data, kt_rows rows) {
    double least = KT_NEAR_SINGULAR;
    for (size_t g = 0; g < model->n.group; g++) {
        const double last = data->last[g] / model->group[g].usual[rows];
        if (data->near[g])
            least = last < KT_NEAR_SINGULAR ? fmin(least, last) : 0.0;
        if (least == 0.0)
            break;
    }
    return least;
}

/* The violation of the velocity equation that rounding leaves in a direction of size s that is nearly lost, relative to
 * the speed. The position is exact to c / s, along a path whose radius of curvature is s (x y = d). The tangent of this
 * path is therefore exact to c / s^2, and the equation, of size s, to c / s. */
static double left_by_rounding(double s) { return LEFT_OPEN / fmax(s, RESOLVED); }

/* Whether the projection must also close the gap in a direction that is nearly lost, as last factored. */
static bool closes_nearly_lost(const kt_model *model, const kt_data *data, double gap) {
    const double s = smallest(model, data, KT_ROWS_CLOSED);
    return s > RESOLVED && gap > (s > WAY_IN ? KT_CLOSED : LEFT_OPEN);
}

/* Leaves the equations at q, with the violations of the velocities in `right`. */
static kt_closure close_positions(const kt_model *model, kt_data *data, double t, double *q, const double *v,
                                  const kt_projection_limits *limits, bool *changed, kt_violation *violation) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    double before = (double)INFINITY;
    bool regular = true, near = false;
    for (int i = 0;; i++) {
        data->closing.position = (uint32_t)i;
        if (!kernels->residuals(model, data, t, q, v, NULL, violation))
            return KT_CLOSURE_NOT_FINITE;
        /* Stop when rounding errors dominate: the gap is small, and a further step has not halved it. (A step that left
         * a direction out may have increased it.) */
        const bool slow = violation->gap > 0.5 * before;
        const bool closes = near && regular && closes_nearly_lost(model, data, violation->gap);
        if (violation->gap <= limits->gap || i == limits->steps ||
            (slow && !closes && kt_loops_are_closed(model, q, fmax(before, violation->gap), 4e3 * KT_CLOSED)))
            return KT_CLOSURE_DONE;
        if (slow && near)
            regular = false;
        before = violation->gap;
        if (!kernels->prepare(model, data, KT_ROWS_CLOSED, regular))
            return KT_CLOSURE_NOT_FINITE;
        kt_residuals_to_right_hand_side(model, data, limits->gap);
        if (!kernels->least_step(model, data, model->metric, model->zero, data->delta))
            return KT_CLOSURE_SINGULAR;
        near = kt_is_near_singular(model, data);
        kt_position_move(model, NULL, q, data->delta, q);
        *changed = true;
    }
}

/* Removing a velocity leaves a rounding error of its original size, not of the small remainder. The tolerance therefore
 * refers to the given speeds throughout. `regular`: directions that are about to be lost are left out (kernel.h). */
static kt_closure project_velocities(const kt_model *model, kt_data *data, bool regular, double *v, bool *changed,
                                     kt_violation *violation) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    if (!kernels->prepare(model, data, KT_ROWS_ALL, regular))
        return KT_CLOSURE_NOT_FINITE;
    const double given = violation->speed;
    double before = (double)INFINITY;
    for (int i = 0; violation->slip > 10.0 * KT_CLOSED * violation->speed && violation->slip < 0.5 * before; i++) {
        if (i == KT_VELOCITY_STEPS) {
            data->closing.capped = 1;
            break;
        }
        data->closing.velocity++;
        before = violation->slip;
        if (!kernels->least_step(model, data, KT_METRIC_MASS, model->zero, data->delta))
            return KT_CLOSURE_SINGULAR;
        for (size_t k = 0; k < model->n.v; k++) {
            const double old = v[k];
            v[k] += data->delta[k];
            *changed |= v[k] != old;
        }
        kt_velocity_violation(model, data, v, violation);
        violation->speed = fmax(violation->speed, given);
    }
    return KT_CLOSURE_DONE;
}

/* Requires filled equations and their violations in `right`. */
static kt_closure close_velocities(const kt_model *model, kt_data *data, double *v, bool *changed,
                                   kt_violation *violation) {
    if (violation->slip <= KT_CLOSED * violation->speed)
        return KT_CLOSURE_DONE;
    const kt_closure closure = project_velocities(model, data, true, v, changed, violation);
    if (closure != KT_CLOSURE_DONE || !kt_is_near_singular(model, data))
        return closure;
    /* A velocity that is left in the direction becomes a velocity along the path when the path bends. But next to a
     * singular position, within rounding, the equation does not determine the velocity, as at a dead point. The given
     * velocity is then better. */
    const double s = smallest(model, data, KT_ROWS_ALL);
    const double open = s > RESOLVED ? fmin(0.1 * KT_CLOSED_STEP, LEFT_MOVING * s) : left_by_rounding(s);
    /* If two loops fold at the same time, the terms of the equation are far below the velocities that it contains. Its
     * entries of A are exact only to the rounding of their possible size. */
    double speed = violation->speed;
    for (size_t i = 0; i < model->n.group_v && s <= RESOLVED; i++)
        speed = fmax(speed, fabs(v[model->group_v[i]]) / model->unit[i]);
    return violation->slip > open * speed ? project_velocities(model, data, false, v, changed, violation) : closure;
}

/* Whether a gap is left in a direction that is too small, compared with rounding, to determine a closed position; as
 * last factored. */
static bool is_undecided(const kt_model *model, const kt_data *data, double gap) {
    return gap <= KT_CLOSED_ASSEMBLED && kt_is_near_singular(model, data) &&
           smallest(model, data, KT_ROWS_CLOSED) < RESOLVED;
}

/* The disagreement of loops divided by the size of the smallest direction, down to a size of the root of the
 * disagreement. The bound is larger next to a singular position. */
static double left_by_disagreement(const kt_model *model, const kt_data *data) {
    const double root = sqrt(model->disagreement);
    return kt_is_near_singular(model, data) ? root : fmin(root, model->disagreement / KT_NEAR_SINGULAR);
}

/* Whether the gap is above the tolerance, above rounding, and above the remainder that no step removes: of loops that
 * disagree, or in a direction that is too small to determine a closed position. */
static bool leaves_gap(const kt_model *model, const kt_data *data, const double *q, double gap, double tolerance) {
    const double bound = fmax(tolerance, left_by_disagreement(model, data));
    return gap > bound && !kt_loops_are_closed(model, q, gap, bound) && !is_undecided(model, data, gap);
}

/* Closes the velocities at positions whose equations are filled. */
KT_INLINE kt_closure close_motion(const kt_model *model, kt_data *data, double t, const double *q, double *v,
                                  double tolerance, bool *changed, kt_violation *violation) {
    const kt_closure closure = close_velocities(model, data, v, changed, violation);
    if (closure != KT_CLOSURE_DONE)
        return closure;
    if (!isfinite(violation->velocity))
        return KT_CLOSURE_NOT_FINITE;
    if (violation->slip <= tolerance * violation->speed)
        return KT_CLOSURE_DONE;
    tolerance = fmax(tolerance, left_by_disagreement(model, data));
    /* A contradiction of the drives remains at its own size. A remainder above rounding has passed project_velocities,
     * which determines whether there is such a direction. If two loops fold at the same time, more is left. */
    if (kt_is_near_singular(model, data))
        tolerance = fmax(tolerance, fmax(KT_CLOSED_ASSEMBLED, left_by_rounding(smallest(model, data, KT_ROWS_ALL))));
    return violation->slip <= tolerance * violation->speed || kt_velocities_fit(model, data, t, q, v, tolerance)
               ? KT_CLOSURE_DONE
               : KT_CLOSURE_OPEN;
}

kt_closure kt_project_in_place(const kt_model *model, kt_data *data, double t, double *q, double *v,
                               const kt_projection_limits *limits, bool *changed, kt_violation *violation) {
    assert(kt_data_serve(model, data));
    assert(limits->steps >= 0 && limits->gap >= 0.0 && limits->tolerance >= limits->gap);
    data->closing = (kt_iterations){0, 0, 0, 0};
    const kt_closure closure = close_positions(model, data, t, q, v, limits, changed, violation);
    if (closure != KT_CLOSURE_DONE)
        return closure;
    if (violation->gap > limits->tolerance && leaves_gap(model, data, q, violation->gap, limits->tolerance))
        return KT_CLOSURE_OPEN;
    return close_motion(model, data, t, q, v, limits->tolerance, changed, violation);
}

/* Reports the gaps that remain when the loops are closed as far as possible. A search reaches farther than a
 * projection. If the search closes the loops, the gaps at q are reported. */
static kt_status reject_open(const kt_model *model, kt_data *data, double t, const double *q, kt_error *error) {
    kt_violation violation;
    const kt_status status = kt_loops_reach(model, data, t, q, KT_CLOSED_STEP,
                                            "the loops can no longer be closed; what stays open is", error);
    if (status != KT_OK)
        return status;
    (void)model->group_kernels->residuals(model, data, t, q, NULL, NULL, &violation);
    return kt_open_loops_error(
        model, data, t,
        model->disagreement > 0.0
            ? "these loops repeat others but for the rounding of data, and where they fold nothing closes all of them "
              "(give more digits, or leave one out); open are"
            : "the loops are too far open to be closed again in one step (smaller steps may help); these stay open",
        KT_OPEN_POSITIONS, error);
}

/* The error of a projection that ended with `closure`. If the positions are closed, an open loop is one whose
 * velocities do not fit. */
static kt_status reject_open_loops(const kt_model *model, kt_data *data, double t, kt_closure closure,
                                   const kt_input *input, bool positions_are_closed, kt_error *error) {
    if (closure == KT_CLOSURE_OPEN && !positions_are_closed)
        return reject_open(model, data, t, input->q, error);
    if (closure == KT_CLOSURE_DEAD)
        return kt_open_loops_error(model, data, t,
                                   "a dead point, where the loops cannot move as they are driven: no velocity follows",
                                   KT_OPEN_VELOCITIES, error);
    if (closure == KT_CLOSURE_OPEN) {
        kt_velocity_gaps_least_squares(model, data);
        return kt_open_loops_error(model, data, t,
                                   "the velocities cannot be brought to fit the loops, which contradict each other at",
                                   KT_OPEN_VELOCITIES, error);
    }
    if (closure == KT_CLOSURE_SINGULAR)
        return kt_inertia_reject_motion(model, kt_where_format("t = %.9g s", t).text, error);
    return kt_input_reject_not_finite(model, t, input, error);
}

/* Adds the iterations of the last projection to the totals. */
static void remember(kt_data *data) {
    kt_iterations *most = &data->iterations;
    const kt_iterations *last = &data->closing;
    most->position = last->position > most->position ? last->position : most->position;
    most->velocity = last->velocity > most->velocity ? last->velocity : most->velocity;
    most->capped += last->capped + (last->position == KT_POSITION_STEPS_MAX ? 1U : 0U);
}

/* Makes the result independent of earlier uses of the data. Only groups that this projection factors are tested for a
 * dead point, and only in these groups the disagreement of loops is distributed. */
static void forget_singular(const kt_model *model, kt_data *data) {
    if (model->driven || model->disagreement > 0.0)
        memset(data->near, 0, model->n.group * sizeof *data->near);
}

kt_status kt_loops_project(const kt_model *model, kt_data *data, double t, const kt_input *input, double *q, double *v,
                           bool *moved, kt_error *error) {
    kt_violation violation;
    forget_singular(model, data);
    const kt_projection_limits limits = {.steps = KT_POSITION_STEPS_MAX, .gap = KT_CLOSED, .tolerance = KT_CLOSED_STEP};
    kt_closure closure = kt_project_in_place(model, data, t, q, v, &limits, moved, &violation);
    data->dead = closure == KT_CLOSURE_DONE && model->driven && kt_is_near_singular(model, data) &&
                 kt_is_dead_point(model, data);
    if (data->dead)
        closure = KT_CLOSURE_DEAD;
    remember(data);
    if (closure == KT_CLOSURE_DONE)
        return KT_OK;
    const bool closed = kt_loops_are_closed(model, q, violation.gap, KT_CLOSED_STEP);
    const kt_status status = reject_open_loops(model, data, t, closure, input, closed, error);
    return kt_loops_explain(model, data, t, input->q, input->v, status, error);
}

kt_status kt_velocities_project(const kt_model *model, kt_data *data, double t, const kt_input *input, double *v,
                                kt_error *error) {
    assert(kt_data_serve(model, data) && v != input->v);
    kt_violation violation;
    bool changed = false;
    forget_singular(model, data);
    data->closing = (kt_iterations){0, 0, 0, 0};
    kt_closure closure = KT_CLOSURE_NOT_FINITE;
    if (model->group_kernels->residuals(model, data, t, input->q, v, NULL, &violation))
        closure = close_motion(model, data, t, input->q, v, KT_CLOSED_STEP, &changed, &violation);
    remember(data);
    if (closure == KT_CLOSURE_DONE)
        return KT_OK;
    const kt_status status = reject_open_loops(model, data, t, closure, input, true, error);
    return kt_loops_explain(model, data, t, input->q, input->v, status, error);
}
