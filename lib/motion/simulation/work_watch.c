/* The work done, estimated from powers at the ends of steps. The estimate serves to watch the energy of driven and
 * damped motions at almost no cost.
 *
 * The net power P = dissipated - supplied is computed once a step, in an evaluation that the step needs anyway. That is
 * the first evaluation, or the last one if a method ends with the slope of the next step (fsal). Methods that have that
 * slope without an evaluation (radau5) get one more. Over the last step, of length h, the net work N is the integral of
 * the cubic through the last four powers,
 *
 *     P(t + s) = P_0 + D_1 s + D_2 s (s + h) + D_3 s (s + h)(s + h_1)
 *     N        = h P_0 - h^2 D_1 / 2 - h^3 D_2 / 6 - h^3 (2 h_1 - h) D_3 / 12
 *
 * with divided differences D_k. h_1 is the time from the last point but two to the last point. The last term of N is
 * the error of the parabola. For smooth powers, this term is far larger than the error of the cubic; otherwise
 * (impacts, reversing friction) both are equally large.
 *
 * Four times the sum of the magnitudes of these terms is reported as the uncertainty of the work. A watch must not rely
 * on a smaller difference. For the bundled scenes, the uncertainty is 1e-15 to 0.05 of the energy of the motion. True
 * errors are within half of it.
 *
 * Steps that follow the motion follow P: forces that do work are part of the accelerations, whose errors are
 * controlled. Forces that only hold a drive at constant speed are an exception, if a step takes whole turns. If a joint
 * of a driven model turns by more than a radian in a step, all work of the step is therefore uncertain. If forces jump,
 * at breakpoints and new inputs, the cubic begins anew.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <math.h>

/* The net work from the last point but one to the last, minus the work from s <= 0 (relative to the last point) to the
 * last point. */
static double work_until(const kt_power_points *p, double s) {
    const double h = p->t[0] - p->t[1], h1 = p->t[0] - p->t[2], *d = p->d;
    const double s2 = s * s / 2.0, s3 = s * s * s / 3.0, s4 = s * s * s * s / 4.0;
    return p->sum[1].net + d[0] * s + d[1] * s2 + d[2] * (s3 + h * s2) + d[3] * (s4 + (h + h1) * s3 + h * h1 * s2);
}

/* Adds the powers at the present time with an additional evaluation, with the forces of the time `at`. */
static void evaluate_work_watch(kt_simulation *simulation, double at) {
    kt_power power;
    kt_error ignored; /* the next step reports it */
    if (kt_simulation_power(simulation, at, simulation->integrator->y, &power, &ignored) == KT_OK)
        kt_simulation_add_power_point(simulation, power);
}

/* Notes the power at the end of a step. */
static void end_powers(kt_simulation *simulation) {
    const double *slope = kt_integrator_known_derivative(simulation->integrator),
                 *evaluated = simulation->works.end_slope;
    const double t = kt_integrator_time(simulation->integrator);
    const bool jumps = simulation->breakpoints.any && t == simulation->breakpoints.end;
    simulation->works.end_slope = NULL;
    if (slope != NULL && slope == evaluated)
        kt_simulation_add_power_point(simulation, simulation->works.end_power);
    else if (slope != NULL || jumps) /* else the first evaluation of the next step is at this state */
        evaluate_work_watch(simulation, jumps ? simulation->breakpoints.before : t);
}

static bool watches_works(const kt_simulation *simulation) { return simulation->works.watches; }

/* Adds the powers of the present time if these are missing: before a record, before new inputs, and before a jump. */
static void add_missing_powers(kt_simulation *simulation) {
    const kt_power_points *p = &simulation->memory.powers;
    const double t = kt_integrator_time(simulation->integrator);
    if (p->count > 0 && t > p->t[0])
        evaluate_work_watch(simulation, t);
}

/* Forces jump: the cubic begins anew. */
static void begin_cubic(kt_simulation *simulation) { simulation->memory.powers.count = 0; }

const kt_part kt_power_part = {
    .is_active = watches_works, .complete = add_missing_powers, .interrupt = begin_cubic, .finish = end_powers};

kt_work_estimate kt_simulation_work_estimate(const kt_simulation *simulation, double t) {
    const kt_power_points *p = &simulation->memory.powers;
    const kt_work_estimate unknown = {(double)NAN, (double)NAN, (double)NAN}, last = p->sum[1];
    if (p->count <= 1)
        return t == (p->count == 0 ? 0.0 : p->t[0]) ? last : unknown;
    if (!(p->t[1] <= t && t <= p->t[0]))
        return unknown;
    return (kt_work_estimate){work_until(p, t - p->t[0]), last.error, last.turned};
}
