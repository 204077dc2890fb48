/* The motion theta'' = c sin(theta), theta counted from upright: a pendulum, and linkages whose bars turn as one. */
#ifndef KT_TEST_REFERENCE_UPRIGHT_H
#define KT_TEST_REFERENCE_UPRIGHT_H

typedef struct kt_upright {
    long double c, t, theta, rate;
} kt_upright;

/* To time t, forwards or back, by a Taylor series of order 30 with steps of 0.02 s: at 7 rad/s its rest is
 * (7 * 0.02)^30 = 2e-26. */
void kt_upright_move(kt_upright *m, long double t);

/* c of N four-bar windows in a row (IFToMM A02): (3/2) g (3 N + 1) / (4 N + 1), g = 9.81 m/s^2 (energy: N + 1 cranks of
 * inertia 1/3, N couplers in translation). */
double kt_upright_windows(int windows);

#endif
