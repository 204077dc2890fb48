/* The angle of a pendulum. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_SWING_H
#define KT_TEST_SIMULATION_SWING_H

#include <math.h>

#include <gsl/gsl_sf_elljac.h>

/* Let go at u0, with frequency w of small swings: sin(u/2) = k cn(w t) / dn(w t), k = sin(u0/2), of modulus k. */
static inline double swing_angle(double start, double frequency, double t) {
    double k = sin(0.5 * start), sn, cn, dn;
    if (gsl_sf_elljac_e(frequency * t, k * k, &sn, &cn, &dn) != 0)
        return (double)NAN;
    return 2.0 * asin(k * cn / dn);
}

#endif
