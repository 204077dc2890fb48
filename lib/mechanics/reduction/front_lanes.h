/* The vectors of a front, four lanes at a time. Each length is the number of parameters, ten or so. Sums one after the
 * other would wait for each addition, and loops of any length would be mostly remainders. Therefore lengths are rounded
 * up to whole lanes. The entries behind the end of a vector are finite; behind the end of a reflector they are zero.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_FRONT_LANES_H
#define KT_REDUCTION_FRONT_LANES_H

#include "algebra/lane.h"
#include "model/front_plan.h"

#include <math.h>

/* a . b over n numbers, rounded up */
KT_INLINE double kt_front_dot(const double *a, const double *b, int n) {
    kt_v4 sum = kt_v4_load(a) * kt_v4_load(b);
    for (int i = KT_FRONT_LANES; i < n; i += KT_FRONT_LANES)
        sum += kt_v4_load(a + i) * kt_v4_load(b + i);
    return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/* y += a x */
KT_INLINE void kt_front_add(double a, const double *x, int n, double *y) {
    for (int i = 0; i < n; i += KT_FRONT_LANES)
        kt_v4_store(y + i, kt_v4_load(y + i) + kt_v4_splat(a) * kt_v4_load(x + i));
}

/* A reflector 1 - t u u', all entries of which are stored. */
KT_INLINE void kt_front_reflect(const double *u, double t, int n, double *x) {
    kt_front_add(-t * kt_front_dot(u, x, n), u, n, x);
}

/* Writes the reflector of an equation, as qr.h stores it: zeros, a one at `head`, and its tail up to n. */
KT_INLINE void kt_front_expand_reflector(const double *row, int head, int n, double *u) {
    const int all = kt_front_padded(n);
    for (int i = 0; i < head; i++)
        u[i] = 0.0;
    u[head] = 1.0;
    for (int i = head + 1; i < n; i++)
        u[i] = row[i];
    for (int i = n; i < all; i++)
        u[i] = 0.0;
}

/* Turns x, with n entries and zeros behind, into the reflector that maps x onto its entry `head`, whose
 * new value is *to. Returns t, or 0 if x is zero or its squares underflow. */
KT_INLINE double kt_front_make_reflector(double *x, int head, int n, double *to) {
    const double squares = kt_front_dot(x, x, n);
    if (!(squares > 0.0))
        return 0.0;
    const double length = sqrt(squares), r = x[head] > 0.0 ? -length : length, by = x[head] - r;
    for (int i = 0; i < n; i += KT_FRONT_LANES)
        kt_v4_store(x + i, kt_v4_load(x + i) / kt_v4_splat(by));
    x[head] = 1.0;
    *to = r;
    return -by / r;
}

#endif
