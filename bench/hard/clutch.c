/* The clutch of apps/scenes/clutch.yaml: a motor drives a load through dry friction with Stribeck's curve. The clutch
 * slips, sticks, slips when the motor drives harder, and sticks again.
 *
 * While the clutch slips, the rate of the slip r depends on the slip alone:
 *     r' = P / I1 - f(r) (1 / I1 + 1 / I2)
 * So the time from one slip to another is the integral of dr / r'. The sum I1 w1 + I2 w2 grows by the integral of the
 * torque P. The clutch sticks while the torque that the plates transmit to the load, P I2 / (I1 + I2), is within f(0).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "clutch.h"

#include "events.h"

#include <math.h>
#include <stdio.h>

const kt_clutch kt_clutch_data = {
    .mass = {20.0, 30.0}, .inertia = {0.4, 0.9375}, .speed = 30.0, .coulomb = 8.0, .breakaway = 10.0, .stribeck = 5.0};

enum { CLUTCH_RECORDS = 6000 }; /* one a millisecond */

double kt_clutch_push(double t) { return t < 3.0 ? 3.0 : t < 3.5 ? 25.0 : -2.0; }

double kt_clutch_friction(double slip) {
    const double ratio = slip / kt_clutch_data.stribeck;
    return kt_clutch_data.coulomb + (kt_clutch_data.breakaway - kt_clutch_data.coulomb) * exp(-ratio * ratio);
}

/* Of a slip r >= 0. */
static double slip_rate(double push, double slip) {
    const double *inertia = kt_clutch_data.inertia;
    return push / inertia[0] - kt_clutch_friction(slip) * (1.0 / inertia[0] + 1.0 / inertia[1]);
}

/* The integral of dr / r' from one slip to another, by the Gauss-Legendre rule of order ten: for slips of a
 * millisecond. */
static double slip_time(double push, double from, double to) {
    static const double node[5] = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831,
                                   0.9061798459386640};
    static const double weight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                     0.2369268850561891};
    const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
    double sum = 0.0;
    for (int i = 0; i < 5; i++)
        sum += weight[i] / slip_rate(push, middle + half * node[i]);
    return half * sum;
}

/* The slip after h, by Newton's method; 0 where it has ended by then, and as long as it sticks. */
static double slip_after(double push, double slip, double h) {
    const double *inertia = kt_clutch_data.inertia;
    const bool holds = fabs(push) * inertia[1] <= kt_clutch_data.breakaway * (inertia[0] + inertia[1]);
    if (holds && (slip == 0.0 || slip_time(push, slip, 0.0) <= h))
        return 0.0;
    double next = slip + h * slip_rate(push, slip);
    for (int i = 0; i < 4; i++)
        next += (h - slip_time(push, slip, next)) * slip_rate(push, next);
    return next;
}

/* The slip at each millisecond, and the speeds from it: I1 w1 + I2 w2 = I1 w0 + the integral of P. */
static double turning(const kt_events_problem *p, int which, double t) {
    static double speed[CLUTCH_RECORDS + 1][2];
    static bool is_known;
    (void)p;
    if (!is_known) {
        const double *inertia = kt_clutch_data.inertia, h = 1e-3;
        double slip = kt_clutch_data.speed, momentum = inertia[0] * slip;
        for (int k = 0; k <= CLUTCH_RECORDS; k++) {
            const double push = kt_clutch_push(k / 1000.0);
            speed[k][1] = (momentum - inertia[0] * slip) / (inertia[0] + inertia[1]);
            speed[k][0] = speed[k][1] + slip;
            slip = slip_after(push, slip, h);
            momentum += push * h;
        }
        is_known = true;
    }
    return speed[lround(1e3 * t)][which];
}

/* ---- this engine ------------------------------------------------------------------------------------------------- */

/* The load turns on the motor. */
static int see(const kt_record *record, void *user) {
    kt_events_see(user, 0, record->t, record->v[0]);
    kt_events_see(user, 1, record->t, record->v[0] + record->v[1]);
    return 0;
}

static bool run(kt_events_watch *watch) {
    kt_scene scene;
    kt_error error = {0};
    if (kt_scene_read(KT_SCENES "/clutch.yaml", &scene, NULL, NULL, &error) != KT_OK) {
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", error.message);
        return false;
    }
    const bool good = kt_events_run(watch, &scene, see, watch);
    kt_scene_free(&scene);
    return good;
}

const kt_events_problem kt_events_clutch = {
    .name = "clutch with Stribeck's curve",
    .measured = "speeds, rad/s",
    .bound = 2e-8, /* the method's: it goes with the tolerance, 2e-10 at 1e-12 */
    .duration = 6.0,
    .step = 1e-3,
    .engine = {run, kt_events_clutch_mujoco, kt_events_clutch_ode},
    .exact = turning,
};
