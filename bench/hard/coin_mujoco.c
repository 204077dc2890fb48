/* The spinning coin in MuJoCo: a free body with a cylinder of 2 um, on a plane. Its contact is as stiff as that of the other motions
 * without restitution: of 2 to 20 steps, damping ratios of 1 and 0.3, and the integrators Euler, implicit and RK4 these have the least error. */
#include "coin.h"
#include "events.h"
#include "mujoco.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static mjModel *load(kt_events_watch *watch) {
    const double step = watch->problem->step, m = KT_COIN_MASS, r = KT_COIN_RADIUS;
    char reason[KT_MUJOCO_REASON], *text = NULL;
    size_t size = 0;
    FILE *xml = open_memstream(&text, &size);
    if (!xml)
        return NULL;
    (void)fprintf(
        xml,
        "<mujoco><option gravity='0 0 -9.81' timestep='%.17g' solver='Newton' iterations='100' tolerance='1e-14'"
        " cone='elliptic' impratio='10' noslip_iterations='20' noslip_tolerance='1e-14'/>"
        "<default><geom solref='%.17g 1' solimp='0.9999 0.9999 0.001' friction='%.17g 0 0'/></default>"
        "<worldbody><geom type='plane' size='100 100 1'/><body pos='0 0 %.17g' euler='%.17g 0 0'><freejoint/>"
        "<inertial pos='0 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/>"
        "<geom type='cylinder' size='%.17g 1e-6'/></body></worldbody></mujoco>",
        step, 2.0 * step, KT_COIN_FRICTION, r * sin(KT_COIN_ALPHA), KT_COIN_ALPHA * 45.0 / atan(1.0), m,
        0.25 * m * r * r, 0.25 * m * r * r, 0.5 * m * r * r, r);
    if (fclose(xml) != 0) {
        free(text);
        return NULL;
    }
    mjModel *model = kt_mujoco_read(text, size, reason);
    if (!model)
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", reason);
    return model;
}

static void damp(mjData *d) {
    const double *R = d->xmat + 9;
    const double axle[3] = {R[2], R[5], R[8]};
    double w[3];
    mju_rotVecMat(w, d->qvel + 3, R);
    kt_coin_damper(axle, w, d->xfrc_applied + 6 + 3);
}

static void say_nothing(const char *words) { (void)words; }

bool kt_events_coin_mujoco(kt_events_watch *watch) {
    mju_user_warning = say_nothing; /* it would write a file */
    mjModel *m = load(watch);
    if (!m)
        return false;
    mjData *d = mj_makeData(m);
    const double h = m->opt.timestep, Omega = kt_coin_rate();
    const long every = lround(1e-3 / h), steps = lround(watch->problem->duration / h);
    d->qvel[4] = Omega * sin(KT_COIN_ALPHA); /* in its own axes: across the axle, up the disc */
    const double begin = kt_events_clock();
    for (long k = 0; k <= steps; k++) {
        if (k % every == 0)
            kt_events_see(watch, 0, (double)k * h, d->qpos[2]);
        mj_kinematics(m, d);
        damp(d);
        mj_step(m, d);
    }
    watch->seconds = kt_events_clock() - begin;
    mj_deleteData(d);
    mj_deleteModel(m);
    return true;
}
