/* The clutch in MuJoCo, which has no Stribeck curve. The dry friction of a joint is a number of the model. Before each
 * step this number is set to the value of the curve at the slip.
 *
 * The search covered Euler's and the Runge-Kutta method, and time constants of 2 to 20 steps. Impedances were from 0.9
 * to 0.9999. Euler's method with 2 steps has the least error, and the impedance does not matter there. The error is in
 * proportion to the step.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "clutch.h"
#include "mujoco.h"

static void write_clutch(FILE *xml, const kt_events_problem *p) {
    const kt_clutch *c = &kt_clutch_data;
    (void)fprintf(
        xml,
        "<mujoco><option timestep='%.17g' integrator='Euler' solver='Newton' iterations='100' tolerance='1e-14'/>"
        "<worldbody><body><joint type='hinge' axis='1 0 0'/>"
        "<inertial pos='0 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/>"
        "<body><joint type='hinge' axis='1 0 0' solreffriction='%.17g 1' solimpfriction='0.9999 0.9999 0.001'/>"
        "<inertial pos='0 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/></body></body></worldbody></mujoco>",
        p->step, c->mass[0], c->inertia[0], c->inertia[0], c->inertia[0], 2.0 * p->step, c->mass[1], c->inertia[1],
        c->inertia[1], c->inertia[1]);
}

/* The load's joint is on the motor. */
static void begin(const kt_events_problem *p, const mjModel *m, mjData *d) {
    (void)p;
    (void)m;
    d->qvel[0] = kt_clutch_data.speed;
    d->qvel[1] = -kt_clutch_data.speed;
}

static void see(kt_events_watch *watch, const mjModel *m, mjData *d, double t) {
    (void)m;
    kt_events_see(watch, 0, t, d->qvel[0]);
    kt_events_see(watch, 1, t, d->qvel[0] + d->qvel[1]);
}

static void transmit(const kt_events_problem *p, mjModel *m, mjData *d, double t) {
    (void)p;
    m->dof_frictionloss[1] = kt_clutch_friction(d->qvel[1]);
    d->qfrc_applied[0] = kt_clutch_push(t);
}

bool kt_events_clutch_mujoco(kt_events_watch *watch) {
    static const kt_mujoco_motion clutch = {.write = write_clutch, .begin = begin, .see = see, .act = transmit};
    return kt_mujoco_run(watch, &clutch);
}
