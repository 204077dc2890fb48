/* A coin that spins on its rim, ever lower and ever faster (Euler's disk), until it is nearly flat.
 *
 * The reference is an integration of the equations of a thin disc that rolls without slip. The axes are e1 along its
 * horizontal diameter, e2 up the disc, e3 along its axle. The angular velocity w has the components
 *     w1 = alpha',  w2 = Omega sin(alpha),  w3
 * The axes turn with (w1, w2, w2 cot(alpha)). The rim is at rest at the point of contact, so v = w x r e2. Let
 *     A = m r^2 / 4 = C / 2
 * The balance of momentum, with the force at the rim, and the balance of angular momentum about the centre yield
 *     (A + m r^2) w1' = w2 (A w2 cot(alpha) - (C + m r^2) w3) - m g r cos(alpha)
 *     A w2'           = w1 (C w3 - A w2 cot(alpha)) - c w2 / sin(alpha)^2
 *     (C + m r^2) w3' = m r^2 w1 w2
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "coin.h"

#include "events.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double g = 9.81, r = KT_COIN_RADIUS, m = KT_COIN_MASS;

double kt_coin_rate(void) { return sqrt(4.0 * g / (r * sin(KT_COIN_ALPHA))); }

void kt_coin_damper(const double axle[3], const double w[3], double torque[3]) {
    const double n[3] = {-axle[2] * axle[0], -axle[2] * axle[1], 1.0 - axle[2] * axle[2]};
    const double nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], Omega = (w[0] * n[0] + w[1] * n[1] + w[2] * n[2]) / nn;
    for (int i = 0; i < 3; i++)
        torque[i] = -KT_COIN_DAMPING * Omega * n[i] / nn;
}

/* ---- its own equations ------------------------------------------------------------------------------------------- */

enum { STATES = 4 }; /* alpha, w */

static void rates(const double y[], double dy[]) {
    const double A = 0.25 * m * r * r, C = 2.0 * A, mrr = m * r * r, s = sin(y[0]), c = cos(y[0]);
    const double turn = y[2] * c / s;
    dy[0] = y[1];
    dy[1] = (y[2] * (A * turn - (C + mrr) * y[3]) - m * g * r * c) / (A + mrr);
    dy[2] = (y[1] * (C * y[3] - A * turn) - KT_COIN_DAMPING * y[2] / (s * s)) / A;
    dy[3] = mrr * y[1] * y[2] / (C + mrr);
}

/* The height of its centre after t, by RK4 in steps of 1/16 ms. The integration continues from the time of the last
 * call, unless that time was later. */
static double sinking(const kt_events_problem *p, int body, double t) {
    static double y[STATES];
    static long done = -1;
    const double h = 1e-3 / 16.0;
    (void)p;
    (void)body;
    if (done < 0 || (double)done * h > t + 0.5 * h) {
        const double start[STATES] = {KT_COIN_ALPHA, 0.0, kt_coin_rate() * sin(KT_COIN_ALPHA), 0.0};
        memcpy(y, start, sizeof y);
        done = 0;
    }
    for (; (double)done * h < t - 0.5 * h; done++)
        kt_events_step(rates, STATES, y, h);
    return r * sin(y[0]);
}

/* ---- this engine ------------------------------------------------------------------------------------------------- */

static int see(const kt_record *record, void *user) {
    kt_events_see(user, 0, record->t, record->q[KT_COIN_HEIGHT]);
    return 0;
}

static bool run(kt_events_watch *watch) {
    char text[2000];
    (void)snprintf(text, sizeof text, KT_COIN(KT_COIN_TOUCHES), KT_COIN_ALPHA, KT_COIN_DAMPING, 1e-10, "t - 2");
    return kt_events_run_text(watch, text, see, watch);
}

const kt_events_problem kt_events_coin = {
    .name = "coin that spins until it is flat",
    .measured = "height, m",
    .bound = 2e-12,
    .duration = 0.58, /* it is flat at 0.5887 */
    .step = 1e-4,
    .engine = {run, kt_events_coin_mujoco, kt_events_coin_ode},
    .exact = sinking,
};
