/* Elementary operations on numbers and points that several folders need. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_ELEMENTARY_H
#define KT_ALGEBRA_ELEMENTARY_H

#include "kinetree/algebra.h"

#include <math.h>
#include <stddef.h>

/* -1, 0 or 1; 0 for a NaN. */
static inline int kt_sign_of(double x) { return (x > 0.0) - (x < 0.0); }

static inline double kt_norm(const double *x, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

/* Extends the box from *low to *high by a point. */
static inline void kt_box_widen(kt_vec3 *low, kt_vec3 *high, kt_vec3 x) {
    *low = kt_vec3_make(fmin(low->x, x.x), fmin(low->y, x.y), fmin(low->z, x.z));
    *high = kt_vec3_make(fmax(high->x, x.x), fmax(high->y, x.y), fmax(high->z, x.z));
}

/* Finds the box around some points, at least one. */
static inline void kt_box_of(const kt_vec3 *points, int count, kt_vec3 *low, kt_vec3 *high) {
    *low = *high = points[0];
    for (int i = 1; i < count; i++)
        kt_box_widen(low, high, points[i]);
}

#endif
