/* Taylor coefficients of a formula over an interval of time: bounds of its value and of its first derivatives. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_JET_H
#define KT_EXPRESSION_JET_H

#include "base/inner.h"
#include "expression/expression.h"

/* All numbers from lo to hi, which may be infinite. */
typedef struct kt_between {
    double lo, hi;
} kt_between;

/* Equals fmin and fmax for numbers, without a call of the C library. If one of them is NaN, the result is the
 * second. */
static inline double smaller(double x, double y) { return x < y ? x : y; }
static inline double larger(double x, double y) { return x > y ? x : y; }

enum { KT_JET_ORDER = 4 };

/* Whether a value may be NaN: nowhere in an interval, at some times, or everywhere. Examples are sqrt(-1), and inf/inf
 * after numbers became too large. */
typedef enum kt_definedness { KT_DEFINED, KT_DEFINED_IN_PART, KT_DEFINED_NOWHERE } kt_definedness;

/* c[k] holds the k-th derivative over k!, at every time of an interval at which that derivative exists. */
typedef struct kt_jet {
    kt_between c[KT_JET_ORDER + 1];
    double size; /* rounding errors of the value are a small part of it in a short interval, and less in a long one */
    kt_definedness defined;
    bool has_ratio;                     /* the ratios are set */
    kt_between ratio[KT_JET_ORDER + 1]; /* c[k] over c[0], which may be infinite: as in 1 / (1 + exp(800)) */
} kt_jet;

/* The decision on the branch of an operation that is not smooth, as a formula whose sign changes with the branch. If
 * the decision is not defined, it is NaN, and the branch of a false comparison follows. */
typedef void kt_jet_meet(void *user, const kt_jet *decision);

/* Bounds of a formula of time alone over [from, to]. Calls `meet` (unless NULL) for every operation that is not smooth,
 * in the order of the text. These operations are abs, sign, min, max, step, clamp and comparisons. Next to such an
 * operation the bounds include all branches that are taken in the interval. Cost: O(length). */
KT_INNER kt_jet kt_expression_bound(const kt_expression *expression, double from, double to, kt_jet_meet *meet,
                                    void *user);

#endif
