/* The spinning coin in MuJoCo: a free body with a cylinder of 2 um, on a plane. Its contact is as stiff as that of the
 * other motions without restitution. The search covered 2 to 20 steps, and damping ratios of 1 and 0.3. It covered the
 * integrators Euler, implicit and RK4. The chosen values have the least error. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "coin.h"
#include "mujoco.h"

#include <math.h>

static void write_coin(FILE *xml, const kt_events_problem *p) {
    const double m = KT_COIN_MASS, r = KT_COIN_RADIUS;
    (void)fprintf(
        xml,
        "<mujoco><option gravity='0 0 -9.81' timestep='%.17g' solver='Newton' iterations='100' tolerance='1e-14'"
        " cone='elliptic' impratio='10' noslip_iterations='20' noslip_tolerance='1e-14'/>"
        "<default><geom solref='%.17g 1' solimp='0.9999 0.9999 0.001' friction='%.17g 0 0'/></default>"
        "<worldbody><geom type='plane' size='100 100 1'/><body pos='0 0 %.17g' euler='%.17g 0 0'><freejoint/>"
        "<inertial pos='0 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/>"
        "<geom type='cylinder' size='%.17g 1e-6'/></body></worldbody></mujoco>",
        p->step, 2.0 * p->step, KT_COIN_FRICTION, r * sin(KT_COIN_ALPHA), KT_COIN_ALPHA * 45.0 / atan(1.0), m,
        0.25 * m * r * r, 0.25 * m * r * r, 0.5 * m * r * r, r);
}

static void begin(const kt_events_problem *p, const mjModel *m, mjData *d) {
    (void)p;
    (void)m;
    d->qvel[4] = kt_coin_rate() * sin(KT_COIN_ALPHA); /* in its own axes: across the axle, up the disc */
}

static void see(kt_events_watch *watch, const mjModel *m, mjData *d, double t) {
    (void)m;
    kt_events_see(watch, 0, t, d->qpos[2]);
}

static void damp(const kt_events_problem *p, mjModel *m, mjData *d, double t) {
    const double *R = d->xmat + 9;
    (void)p;
    (void)t;
    mj_kinematics(m, d);
    const double axle[3] = {R[2], R[5], R[8]};
    double w[3];
    mju_rotVecMat(w, d->qvel + 3, R);
    kt_coin_damper(axle, w, d->xfrc_applied + 6 + 3);
}

bool kt_events_coin_mujoco(kt_events_watch *watch) {
    static const kt_mujoco_motion coin = {.write = write_coin, .begin = begin, .see = see, .act = damp};
    return kt_mujoco_run(watch, &coin);
}
