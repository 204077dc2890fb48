/* Parts of a step that are compiled for one state, and for several states at once (algebra/real3.h).
 *
 * Powers: x = m 2^k with sqrt(1/2) <= m < sqrt(2), log2 x = k + 2 / ln 2 (z + z^3/3 + z^5/5 + ...),
 * z = (m - 1) / (m + 1), |z| < 0.172; terms to z^13 leave 7e-13. Then 2^u = 2^k e^w, |w| <= ln 2 / 2; terms to w^10
 * leave 3e-13. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_LANE_PARTS_H
#define KT_INTEGRATOR_LANE_PARTS_H

#include "algebra/real3.h"
#include "integrator/integrator.h"

#define KT_LN2 0.693147180559945309417
#define KT_SQRT_HALF 0.707106781186547524401

/* log2 (m 2^k) */
KT_OPERATOR kt_real1 kt_binary_logarithm(kt_real1 m, kt_real1 k) {
    const kt_real1 z = (m - 1.0) / (m + 1.0), q = z * z;
    kt_real1 log = kt_real1_splat(0.0);
    for (int i = 13; i >= 1; i -= 2)
        log = log * q + 1.0 / (double)i;
    return k + 2.0 / KT_LN2 * z * log;
}

/* 2^part, |part| <= 1/2 */
KT_OPERATOR kt_real1 kt_binary_power(kt_real1 part) {
    const kt_real1 w = part * KT_LN2;
    kt_real1 power = kt_real1_splat(1.0);
    for (int i = 10; i >= 1; i--)
        power = 1.0 + power * w / (double)i;
    return power;
}

/* The weights of the slopes in the dense output at theta. */
KT_OPERATOR void kt_dense_weights(const kt_method *m, size_t slots, size_t fresh, kt_real1 theta, kt_real1 *weight) {
    const kt_real1 rest = 1.0 - theta, bubble = theta * theta * rest * rest;
    for (size_t i = 0; i < slots; i++) {
        kt_real1 d = kt_real1_splat(0.0);
        for (int term = m->dense_terms - 1; term >= 0; term--) /* Horner: the factor in front of d_(term + 1) */
            d = m->dense_d[(size_t)term * slots + i] + (term % 2 == 0 ? theta : rest) * d;
        weight[i] = bubble * d;
        if (i == 0)
            weight[i] += theta * rest * rest;
        if (i == fresh)
            weight[i] -= theta * theta * rest;
    }
}

#endif
