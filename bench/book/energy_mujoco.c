/* SPDX-License-Identifier: Apache-2.0 */
#include "energy.h"

#include <mujoco/mujoco.h>
#include <stdio.h>

static void run(const mjModel *m, const char *name, int evaluations, double duration) {
    mjData *d = mj_makeData(m);
    energy_watch watch = {.begun = false};
    long count = 0;
    mj_resetDataKeyframe(m, d, 0);
    for (long k = 0; (double)k * m->opt.timestep < duration - 0.5 * m->opt.timestep; k++, count += evaluations) {
        mj_forward(m, d); /* energies of this state */
        energy_watch_add(&watch, d->energy[1], d->energy[0]);
        mj_step(m, d);
    }
    mj_forward(m, d);
    energy_watch_add(&watch, d->energy[1], d->energy[0]);
    printf("MuJoCo %s,%s,%ld,%.6g\n", mj_versionString(), name, count, watch.change / watch.kinetic);
    mj_deleteData(d);
}

bool energy_mujoco(const char *mjcf, double duration, double step) {
    static const struct {
        int integrator, evaluations;
        const char *name;
    } list[] = {{mjINT_EULER, 1, "Euler"}, {mjINT_IMPLICIT, 1, "implicit"}, {mjINT_RK4, 4, "RK4"}};
    char reason[500] = "";
    mjModel *m = mj_loadXML(mjcf, NULL, reason, sizeof reason);
    if (m == NULL) {
        fprintf(stderr, "MuJoCo rejects %s: %s\n", mjcf, reason);
        return false;
    }
    m->opt.timestep = step;
    m->opt.enableflags |= mjENBL_ENERGY;
    for (int k = 0; k < 3; k++) {
        m->opt.integrator = list[k].integrator;
        run(m, list[k].name, list[k].evaluations, duration);
    }
    mj_deleteModel(m);
    return true;
}
