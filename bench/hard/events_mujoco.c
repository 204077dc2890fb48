/* Impacts, stick and slip in MuJoCo: a body on two slides, with a box or a sphere on a plane. Its contacts are soft by design; those of
 * blocks are as stiff as is advised for the step, with the elliptic cone, ten times the impedance along friction, and the solver that
 * removes slip. MuJoCo has no restitution: the contact of a ball is a spring and a damper that do not pull, whose damping ratio gives
 * back e (T. Schwager, T. Poeschel, Granular Matter 9, 2007); with a time constant of twenty steps the error was the least of 2 to 80. */
#include "events.h"
#include "mujoco.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The damping ratio z of e = exp(-z / w (pi - atan2(2 z w, 1 - 2 z^2))), w = sqrt(1 - z^2), which falls with z. */
static double damping_of(double e) {
    const double pi = 3.14159265358979323846;
    double low = 1e-6, high = 0.999;
    for (int i = 0; i < 60; i++) {
        const double z = 0.5 * (low + high), w = sqrt(1.0 - z * z);
        *(exp(-z / w * (pi - atan2(2.0 * z * w, 1.0 - 2.0 * z * z))) > e ? &low : &high) = z;
    }
    return low;
}

static char *write_scene(const kt_events_watch *watch, size_t *size) {
    const kt_events_problem *p = watch->problem;
    const bool is_ball = watch->which == KT_EVENTS_BOUNCE;
    char *text = NULL;
    FILE *xml = open_memstream(&text, size);
    if (!xml)
        return NULL;
    (void)fprintf(
        xml,
        "<mujoco><option gravity='%.17g 0 %.17g' timestep='%.17g' integrator='%s' solver='Newton' iterations='100'"
        " tolerance='1e-14' cone='elliptic' impratio='10' noslip_iterations='20' noslip_tolerance='1e-14'/>"
        "<default><geom solref='%.17g %.17g' solimp='0.9999 0.9999 0.001' friction='%.17g 0 0'/></default>"
        "<worldbody><geom type='plane' size='100 100 1'/><body pos='0 0 %.17g'>"
        "<joint name='x' type='slide' axis='1 0 0'/><joint name='z' type='slide' axis='0 0 1'/>",
        p->gravity * sin(p->tilt), -p->gravity * cos(p->tilt), p->step, is_ball ? "RK4" : "Euler",
        (is_ball ? 20.0 : 2.0) * p->step, is_ball ? damping_of(p->restitution) : 1.0, p->friction,
        is_ball ? p->drop + p->radius : 0.05);
    if (is_ball)
        (void)fprintf(xml, "<geom type='sphere' size='%.17g' mass='%.17g'/>", p->radius, p->mass);
    else
        (void)fprintf(xml, "<geom type='box' size='0.1 0.1 0.05' mass='%.17g'/>", p->mass);
    (void)fputs("</body></worldbody></mujoco>", xml);
    if (fclose(xml) == 0)
        return text;
    free(text);
    return NULL;
}

static mjModel *load(kt_events_watch *watch) {
    char reason[KT_MUJOCO_REASON];
    size_t size = 0;
    char *text = write_scene(watch, &size);
    mjModel *model = kt_mujoco_read(text, size, reason);
    if (!model)
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", reason);
    return model;
}

static void say_nothing(const char *words) { (void)words; }

bool kt_events_mujoco(kt_events_watch *watch) {
    const kt_events_problem *p = watch->problem;
    const long every = lround(1e-3 / p->step), steps = lround(p->duration / p->step);
    mju_user_warning = say_nothing; /* it would write a file */
    mjModel *m = load(watch);
    if (!m)
        return false;
    mjData *d = mj_makeData(m);
    const double begin = kt_events_clock();
    for (long k = 0; k <= steps; k++) {
        const double t = (double)k * p->step;
        if (k % every == 0)
            kt_events_see(watch, t, watch->which == KT_EVENTS_BOUNCE ? p->drop + d->qpos[1] : d->qpos[0]);
        d->qfrc_applied[0] = -p->stiffness * (d->qpos[0] + p->belt * t);
        mj_step(m, d);
    }
    watch->seconds = kt_events_clock() - begin;
    mj_deleteData(d);
    mj_deleteModel(m);
    return true;
}
