/* Works estimated from powers at the ends of steps: what a watch over the energy of driven and damped motions costs next
 * to nothing by.
 *
 * The net power P = dissipated - supplied is computed once a step, in an evaluation that the step needs anyway: the first
 * one, or the last one where a method ends with the slope of the next step (fsal); methods that know that slope without
 * an evaluation (radau5) are given one more. Over
 * the last step, of length h, the net work is the integral of the cubic through the last four powers,
 *
 *     P(t + s) = P_0 + D_1 s + D_2 s (s + h) + D_3 s (s + h)(s + h_1)
 *     N        = h P_0 - h^2 D_1 / 2 - h^3 D_2 / 6 - h^3 (2 h_1 - h) D_3 / 12
 *
 * with divided differences D_k, h_1 and h_2 being the times since the last point but one and but two. Its last term is the error of the parabola, which is far larger than
 * that of the cubic where powers are smooth at all, and as large where they are not (impacts, friction that turns round).
 * Four times the sum of their magnitudes is handed over as the uncertainty of the work, and a watch is to believe nothing
 * below it: of the bundled scenes it is 1e-15 to 0.05 of the energy of the motion, and true errors are within half of it. Steps that follow the motion follow P: forces
 * that do work are in the accelerations, whose errors are controlled. Not so those that only hold a drive that turns
 * evenly, in steps of whole turns: where a joint of a driven model turns by more than a radian in a step, all its work is
 * uncertain. Where forces jump, at corners and new inputs, the cubic begins anew.
 */
#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <math.h>

/* The net work from the last point but one to the last, less that up to s <= 0 after it. */
static double work_until(const kt_power_points *p, double s) {
    const double h = p->t[0] - p->t[1], h1 = p->t[0] - p->t[2], *d = p->d;
    const double s2 = s * s / 2.0, s3 = s * s * s / 3.0, s4 = s * s * s * s / 4.0;
    return p->sum[1].net + d[0] * s + d[1] * s2 + d[2] * (s3 + h * s2) + d[3] * (s4 + (h + h1) * s3 + h * h1 * s2);
}

/* Adds the powers at the present time by an evaluation of its own, with the forces of the time `at`. */
static void evaluate_work_watch(kt_simulation *simulation, double at) {
    kt_power power;
    kt_error ignored; /* the next step tells it */
    if (kt_simulation_power(simulation, at, simulation->integrator->y, &power, &ignored) == 0)
        kt_simulation_note_power(simulation, power);
}

void kt_simulation_end_powers(kt_simulation *simulation) {
    const double *slope = kt_integrator_known_derivative(simulation->integrator), *evaluated = simulation->end_slope;
    const double t = kt_integrator_time(simulation->integrator);
    const bool jumps = simulation->corners.any && t == simulation->corners.end;
    simulation->end_slope = NULL;
    if (slope != NULL && slope == evaluated)
        kt_simulation_note_power(simulation, simulation->end_power);
    else if (slope != NULL || jumps) /* else the first evaluation of the next step is at this state */
        evaluate_work_watch(simulation, jumps ? simulation->corners.before : t);
}

void kt_simulation_complete_powers(kt_simulation *simulation) {
    const kt_power_points *p = &simulation->memory.powers;
    const double t = kt_integrator_time(simulation->integrator);
    if (p->count > 0 && t > p->t[0])
        evaluate_work_watch(simulation, t);
}

kt_work_estimate kt_simulation_work_estimate(const kt_simulation *simulation, double t) {
    const kt_power_points *p = &simulation->memory.powers;
    const kt_work_estimate unknown = {(double)NAN, (double)NAN, (double)NAN}, last = p->sum[1];
    if (p->count <= 1)
        return t == (p->count == 0 ? 0.0 : p->t[0]) ? last : unknown;
    if (!(p->t[1] <= t && t <= p->t[0]))
        return unknown;
    return (kt_work_estimate){work_until(p, t - p->t[0]), last.error, last.turned};
}
