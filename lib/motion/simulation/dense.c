/* The state within the last step, from the method's dense output.
 *
 * The dense output uses the acceleration at the end of the step. At a dead point of drives, that acceleration grows
 * without bound or consists of rounding errors, although the state itself is closed. In this case, the polynomial can
 * deviate from the motion by any distance. Between the ends of a step, the velocities and the distance of both ends
 * limit the motion,
 *
 *     |q - q0| <= LEEWAY (|q1 - q0| + h |v0| + h |v1|)
 *     |v - v0| <= LEEWAY (|v1 - v0| + |v0| + |v1| + |q1 - q0| / h)
 *
 * If a dense output violates this limit or cannot be computed, an interpolation of the two states replaces it. In this
 * interpolation, q is a cubic with the slopes v at both ends (linear with quaternions); v and the work done are linear.
 * Afterwards, loops are closed and quaternions are scaled to unit norm. Only drives have dead points: a model without
 * drives is not checked.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/elementary.h"
#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <math.h>

static const double leeway = 10.0, rounding = 1e-9;

static double state_distance(const double *x, const double *y, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(sum);
}

/* Whether the motion between the ends of the last step can reach the state y; false for NaN. */
static bool motion_can_reach(const kt_simulation *simulation, const double *y) {
    const kt_integrator *it = simulation->integrator;
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    const double *y0 = it->previous_y, *y1 = it->y, h = fabs(it->memory.last_step);
    const double path = state_distance(y1, y0, nq), turn = state_distance(y1 + nq, y0 + nq, nv);
    const double speed = kt_norm(y0 + nq, nv) + kt_norm(y1 + nq, nv);
    return state_distance(y, y0, nq) <= leeway * (path + h * speed) + rounding * (1.0 + kt_norm(y0, nq)) &&
           state_distance(y + nq, y0 + nq, nv) <= leeway * (turn + speed + path / h) + rounding;
}

/* Interpolates between both ends of the last step: positions by the cubic with the velocities as slopes, all other
 * numbers by a straight line. Positions with quaternions are interpolated by a straight line, too. */
static void join_auxiliary_states(const kt_simulation *simulation, double t, double *y) {
    const kt_integrator *it = simulation->integrator;
    const size_t nq = simulation->size.nq, cubic = simulation->size.quaternion == 0 ? nq : 0;
    const double *y0 = it->previous_y, *y1 = it->y, h = it->memory.last_step;
    const double s = (t - it->memory.previous_t) / (it->memory.t - it->memory.previous_t), rest = 1.0 - s;
    for (size_t i = 0; i < simulation->size.n; i++) {
        const double d = y1[i] - y0[i];
        y[i] = i < cubic ? y0[i] + s * s * (3.0 - 2.0 * s) * d + h * s * rest * (rest * y0[nq + i] - s * y1[nq + i])
                         : y0[i] + s * d;
    }
}

kt_status kt_simulation_between(kt_simulation *simulation, double t, kt_error *error) {
    bool changed;
    const bool may_have_dead_point =
        simulation->model->driven && simulation->closes_loops && simulation->options.projection == NULL;
    kt_status status = kt_integrator_interpolate(simulation->integrator, t, simulation->y, error);
    if (may_have_dead_point && simulation->integrator->memory.has_previous &&
        (status != KT_OK || !motion_can_reach(simulation, simulation->y))) {
        join_auxiliary_states(simulation, t, simulation->y);
        simulation->memory.joined++;
        simulation->cause.code = KT_OK;
        status = KT_OK;
    }
    if (status != KT_OK)
        return status;
    return kt_simulation_project(simulation, kt_simulation_closing_time(simulation, t), simulation->y, &changed, error);
}
