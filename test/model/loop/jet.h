/* Numbers with their first and second derivatives by time, in long double: derivatives without differences. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_LOOP_JET_H
#define KT_TEST_LOOP_JET_H

#include <math.h>

typedef struct jet {
    long double x, d, dd;
} jet;

static inline jet jet_make(long double x, long double d, long double dd) {
    const jet a = {x, d, dd};
    return a;
}

static inline jet jet_constant(long double x) { return jet_make(x, 0.0L, 0.0L); }
static inline jet jet_add(jet a, jet b) { return jet_make(a.x + b.x, a.d + b.d, a.dd + b.dd); }
static inline jet jet_sub(jet a, jet b) { return jet_make(a.x - b.x, a.d - b.d, a.dd - b.dd); }
static inline jet jet_scale(long double s, jet a) { return jet_make(s * a.x, s * a.d, s * a.dd); }

static inline jet jet_mul(jet a, jet b) {
    return jet_make(a.x * b.x, a.d * b.x + a.x * b.d, a.dd * b.x + 2.0L * a.d * b.d + a.x * b.dd);
}

/* f(a) where f, f', f'' at a.x are f0, f1, f2 */
static inline jet jet_chain(jet a, long double f0, long double f1, long double f2) {
    return jet_make(f0, f1 * a.d, f2 * a.d * a.d + f1 * a.dd);
}

static inline jet jet_invert(jet a) {
    const long double i = 1.0L / a.x;
    return jet_chain(a, i, -i * i, 2.0L * i * i * i);
}

static inline jet jet_div(jet a, jet b) { return jet_mul(a, jet_invert(b)); }

static inline jet jet_sqrt(jet a) {
    const long double s = sqrtl(a.x);
    return jet_chain(a, s, 0.5L / s, -0.25L / (s * a.x));
}

static inline jet jet_sin(jet a) { return jet_chain(a, sinl(a.x), cosl(a.x), -sinl(a.x)); }
static inline jet jet_cos(jet a) { return jet_chain(a, cosl(a.x), -sinl(a.x), -cosl(a.x)); }

/* angle of the point (x, y) */
static inline jet jet_atan2(jet y, jet x) {
    const long double square = x.x * x.x + y.x * y.x;
    const long double area = x.x * y.d - y.x * x.d, grown = x.x * y.dd - y.x * x.dd; /* square * angle', its rate */
    const long double half = x.x * x.d + y.x * y.d;
    return jet_make(atan2l(y.x, x.x), area / square, grown / square - 2.0L * area * half / (square * square));
}

/* Rate of a jet, as a jet; its second derivative is unknown and NaN. */
static inline jet jet_rate(jet a) { return jet_make(a.d, a.dd, (long double)NAN); }

static inline jet jet_dot(const jet a[3], const jet b[3]) {
    return jet_add(jet_add(jet_mul(a[0], b[0]), jet_mul(a[1], b[1])), jet_mul(a[2], b[2]));
}

#endif
