/* The trebuchet in MuJoCo. An equality fixes the length of a tendon from the beam's tip to the ball. It is switched off
 * in the model after the step in which the ball comes to the height of the release. RK4 is by far the best method
 * (Euler, implicit: 0.3 m). The search covered time constants from 2 to 30 steps. It covered damping ratios from 0.5 to
 * 2. A time constant of 2 steps leaves 6e-3 m. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco.h"
#include "trebuchet.h"

static void write_trebuchet(FILE *xml, const kt_events_problem *p) {
    const kt_trebuchet *s = &kt_trebuchet_data;
    double y[KT_TREBUCHET_STATES], ball[4];
    kt_trebuchet_start(y);
    kt_trebuchet_ball(y, ball);
    (void)fprintf(
        xml,
        "<mujoco><compiler angle='radian'/><option gravity='0 %.17g 0' timestep='%.17g' integrator='RK4' "
        "solver='Newton' iterations='100' tolerance='1e-14'/><worldbody>"
        "<body euler='0 0 %.17g'><joint type='hinge' axis='0 0 1'/>"
        "<inertial pos='0 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/><site name='tip' pos='%.17g 0 0'/>"
        "<body pos='%.17g 0 0' euler='0 0 %.17g'><joint type='hinge' axis='0 0 1'/>"
        "<inertial pos='%.17g 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/></body></body>",
        -s->gravity, p->step, y[0], s->beam, s->beam_inertia, s->beam_inertia, s->beam_inertia, s->long_arm,
        -s->short_arm, y[1] - y[0], s->hangs, s->box, s->box_inertia, s->box_inertia, s->box_inertia);
    (void)fprintf(
        xml,
        "<body pos='%.17g %.17g 0'><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/>"
        "<inertial pos='0 0 0' mass='%.17g' diaginertia='0.01 0.01 0.01'/><site name='ball'/></body></worldbody>"
        "<tendon><spatial name='sling'><site site='tip'/><site site='ball'/></spatial></tendon>"
        "<equality><tendon tendon1='sling' solref='%.17g 1' solimp='0.9999 0.9999 0.001'/></equality></mujoco>",
        ball[0], ball[1], s->ball, 10.0 * p->step);
}

/* Coordinates are counted from the start; the ball's are the last ones. */
static void find_ball(const mjModel *m, const mjData *d, double ball[4]) {
    const int b = m->nbody - 1;
    for (int i = 0; i < 2; i++) {
        ball[i] = m->body_pos[3 * b + i] + d->qpos[2 + i];
        ball[2 + i] = d->qvel[2 + i];
    }
}

static void see(kt_events_watch *watch, const mjModel *m, mjData *d, double t) {
    double ball[4];
    find_ball(m, d, ball);
    kt_trebuchet_see(watch, t, ball);
}

static void let_go(const kt_events_problem *p, mjModel *m, mjData *d, double t) {
    double ball[4];
    (void)p;
    (void)t;
    find_ball(m, d, ball);
    if (ball[1] >= kt_trebuchet_data.release)
        m->eq_active[0] = 0;
}

bool kt_events_trebuchet_mujoco(kt_events_watch *watch) {
    static const kt_mujoco_motion trebuchet = {.write = write_trebuchet, .see = see, .act = let_go};
    return kt_mujoco_run(watch, &trebuchet);
}
