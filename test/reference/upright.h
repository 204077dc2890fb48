/* The motion theta'' = c sin(theta), theta counted from upright: a pendulum, and linkages whose bars turn as one. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_REFERENCE_UPRIGHT_H
#define KT_TEST_REFERENCE_UPRIGHT_H

typedef struct kt_upright {
    long double c, t, theta, rate;
} kt_upright;

/* Moves to time t, forwards or back, with a Taylor series of order 30 and steps of 0.02 s. At 7 rad/s, its rest is
 *     (7 * 0.02)^30 = 2e-26. */
void kt_upright_move(kt_upright *m, long double t);

/* c of N four-bar windows in a row (IFToMM A02), with g = 9.81 m/s^2:
 *     (3/2) g (3 N + 1) / (4 N + 1).
 * The energy gives c: N + 1 cranks have the inertia 1/3, and N couplers are in translation. */
double kt_upright_windows(int windows);

#endif
