/* A trebuchet whose sling lets go at a height: the ball's place while it is slung and flies, and where it lands.
 *
 * The reference integrates the trebuchet's own equations (test/files/scene/trebuchet.c) by RK4 in steps of 1/64 ms up
 * to the release. The release is at the end of the last step after which the ball is at the height. From there on the
 * reference is a parabola.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "trebuchet.h"

#include <math.h>
#include <string.h>

/* ---- its own equations ------------------------------------------------------------------------------------------- */

enum {
    STATES = KT_TREBUCHET_STATES,
    STEPS = 64,
    SLUNG = 1000,
    RANGE = 2
}; /* a millisecond; milliseconds; the observed quantities */

/* The ball at each millisecond before the release, and at that. */
typedef struct throw {
    double slung[SLUNG][4], release, ball[4];
    int count;
}
throw;

/* The step after which the ball is at the height at which it is let go, by bisection. */
static double last_step(const double y[STATES], double h, double ball[4]) {
    double low = 0.0, high = h, end[STATES];
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        memcpy(end, y, sizeof end);
        kt_events_step(kt_trebuchet_rate, STATES, end, middle);
        kt_trebuchet_ball(end, ball);
        *(ball[1] < kt_trebuchet_data.release ? &low : &high) = middle;
    }
    return high;
}

static void integrate(throw *thrown) {
    const double h = 1e-3 / STEPS;
    double y[STATES], next[STATES];
    kt_trebuchet_start(y);
    kt_trebuchet_ball(y, thrown->ball);
    for (int k = 0; k < SLUNG * STEPS; k++) {
        if (k % STEPS == 0)
            memcpy(thrown->slung[thrown->count++], thrown->ball, sizeof thrown->ball);
        memcpy(next, y, sizeof next);
        kt_events_step(kt_trebuchet_rate, STATES, next, h);
        kt_trebuchet_ball(next, thrown->ball);
        if (thrown->ball[1] >= kt_trebuchet_data.release) {
            thrown->release = k * h + last_step(y, h, thrown->ball);
            return;
        }
        memcpy(y, next, sizeof y);
    }
}

/* The ball's place along x (0) and its height (1) at t, and where it lands. */
static double thrown_to(const kt_events_problem *p, int which, double t) {
    static throw thrown;
    (void)p;
    if (thrown.count == 0)
        integrate(&thrown);
    if (which == RANGE)
        return kt_trebuchet_range(thrown.ball);
    if (t < thrown.release)
        return thrown.slung[lround(1e3 * t)][which];
    const double since = t - thrown.release, fall = which == 1 ? 0.5 * kt_trebuchet_data.gravity * since : 0.0;
    return thrown.ball[which] + since * (thrown.ball[which + 2] - fall);
}

void kt_trebuchet_see(kt_events_watch *watch, double t, const double ball[4]) {
    for (int i = 0; i < 2; i++)
        kt_events_see(watch, i, t, ball[i]);
    if (t > watch->problem->duration - 0.5e-3)
        kt_events_see(watch, RANGE, t, kt_trebuchet_range(ball));
}

/* ---- this engine ------------------------------------------------------------------------------------------------- */

/* Records of events are not at milliseconds. */
static int see(const kt_record *record, void *user) {
    if (record->event == NULL)
        kt_trebuchet_see(user, record->t, (double[4]){record->q[2], record->q[3], record->v[2], record->v[3]});
    return 0;
}

static bool run(kt_events_watch *watch) { return kt_events_run_text(watch, kt_trebuchet_scene, see, watch); }

const kt_events_problem kt_events_trebuchet = {
    .name = "trebuchet that lets go",
    .measured = "place and range, m",
    .bound = 5e-10,
    .duration = 1.0,
    .step = 1e-4,
    .tolerance = 1e-12,
    .engine = {run, kt_events_trebuchet_mujoco, kt_events_trebuchet_ode},
    .exact = thrown_to,
};
