/* The woodpecker toy in MuJoCo: a sleeve that slides and turns, and a bird on it with a spring. The edges and the beak
 * are spheres, and each meets the pole in a plane. The edges' contacts take four steps, and those of the beak oscillate
 * at 0.3 / step. The search covered two and four steps, and oscillations of 0.05 to 0.6. Impedances along friction were
 * one, 10 and 100 times those along the normal. The methods were Euler and RK4. With oscillations at 0.3 the errors
 * scatter, up to 5e-3 s and down to 5e-4 s. Softer contacts have errors of 2e-2 s. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "events.h"
#include "mujoco.h"
#include "woodpecker.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { BEAK_PLANE = 1 }; /* the index of its geom */

/* A plane at x and its contacts' class; the bits keep it to these. */
static void write_plane(FILE *xml, const char *class, double x, int bits) {
    (void)fprintf(
        xml,
        "<geom class='%s' type='plane' size='100 100 1' pos='%.17g 0 0' zaxis='1 0 0' contype='%d' conaffinity='%d'/>",
        class, x, bits, bits);
}

/* A sphere that touches where (x, y) of its body is. */
static void write_sphere(FILE *xml, const char *class, double x, double y, int bits) {
    (void)fprintf(xml,
                  "<geom class='%s' type='sphere' size='%.17g' pos='%.17g %.17g 0' contype='%d' conaffinity='%d'/>",
                  class, KT_WOODPECKER_RHO, x + KT_WOODPECKER_RHO, y, bits, bits);
}

static void write_inertia(FILE *xml, double x, double mass, double inertia) {
    (void)fprintf(xml, "<inertial pos='%.17g 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/>", x, mass, inertia,
                  inertia, inertia);
}

static void write_scene(FILE *xml, double step) {
    const kt_woodpecker *t = &kt_woodpecker_data;
    const double N = KT_WOODPECKER_N, w = 0.3 / step, beak = t->lM + t->lG - t->lS;
    (void)fprintf(
        xml,
        "<mujoco><option gravity='0 %.17g 0' timestep='%.17g' solver='Newton' iterations='100' tolerance='1e-14'"
        " cone='elliptic' noslip_iterations='20' noslip_tolerance='1e-14'/>"
        "<default><geom solimp='0.9999 0.9999 0.001' friction='%.17g 0 0'/>"
        "<default class='edge'><geom solref='%.17g 1'/></default>"
        "<default class='beak'><geom solref='%.17g %.17g'/></default></default><worldbody>",
        -t->g, step, t->friction, 4.0 * step, -w * w, -2.0 * kt_mujoco_damping(t->restitution) * w);
    write_plane(xml, "edge", N * t->rM - (t->rM - t->r0), 1);
    write_plane(xml, "beak", N * beak - (beak - t->r0), 2);
    (void)fputs("<body><joint type='slide' axis='0 1 0'/><joint type='hinge' axis='0 0 1'/>", xml);
    write_inertia(xml, 0.0, t->mM, N * N * t->JM);
    write_sphere(xml, "edge", N * t->rM, -N * t->hM, 1);
    write_sphere(xml, "edge", N * t->rM, N * t->hM, 1);
    (void)fprintf(xml, "<body pos='%.17g 0 0'><joint type='hinge' axis='0 0 1' stiffness='%.17g'/>", N * t->lM,
                  N * N * t->c);
    write_inertia(xml, N * t->lG, t->mS, N * N * t->JS);
    write_sphere(xml, "beak", N * (t->lG - t->lS), N * t->hS, 2);
    (void)fputs("</body></body></worldbody></mujoco>", xml);
}

static mjModel *load(kt_events_watch *watch) {
    char reason[KT_MUJOCO_REASON], *text = NULL;
    size_t size = 0;
    FILE *xml = open_memstream(&text, &size);
    if (!xml)
        return NULL;
    write_scene(xml, watch->problem->step);
    if (fclose(xml) != 0) {
        free(text);
        return NULL;
    }
    mjModel *model = kt_mujoco_read(text, size, reason);
    if (!model)
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", reason);
    return model;
}

static void say_nothing(const char *words) { (void)words; }

/* The bird's hinge turns against the sleeve. */
static void begin_motion(mjData *d) {
    const kt_woodpecker *t = &kt_woodpecker_data;
    const double N = KT_WOODPECKER_N, phiM = (t->r0 - t->rM) / t->hM;
    d->qpos[1] = phiM / N;
    d->qpos[2] = (t->phiS - phiM) / N;
    d->qvel[0] = t->fall;
    d->qvel[2] = t->turn / N;
}

bool kt_events_woodpecker_mujoco(kt_events_watch *watch) {
    const double h = watch->problem->step;
    const long steps = lround(watch->problem->duration / h);
    kt_pecks pecks = {.count = 0};
    mju_user_warning = say_nothing; /* it would write a file */
    mjModel *m = load(watch);
    if (!m)
        return false;
    mjData *d = mj_makeData(m);
    begin_motion(d);
    const double begin = kt_events_clock();
    for (long k = 0; k <= steps; k++) {
        mj_step(m, d);
        for (int i = 0; i < d->ncon; i++)
            if (d->contact[i].geom1 == BEAK_PLANE && d->contact[i].dist < 0.0)
                kt_pecks_see(&pecks, (double)k * h);
    }
    watch->seconds = kt_events_clock() - begin;
    kt_events_see(watch, 0, watch->problem->duration, kt_pecks_period(&pecks));
    mj_deleteData(d);
    mj_deleteModel(m);
    return true;
}
