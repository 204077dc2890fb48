/* Taylor coefficients of a formula over an interval of time: bounds of its value and of its first derivatives. */
#ifndef KT_EXPRESSION_JET_H
#define KT_EXPRESSION_JET_H

#include "expression/expression.h"

/* A set of numbers, [lo, hi]; both NaN where the formula is not defined. */
typedef struct kt_interval {
    double lo, hi;
} kt_interval;

enum { KT_JET_ORDER = 4 };

/* c[k] holds the k-th derivative over k!, at every time of an interval. */
typedef struct kt_jet {
    kt_interval c[KT_JET_ORDER + 1];
    double size; /* the largest value that was met on the way: rounding errors are a small part of it */
} kt_jet;

/* What decides on the branch of an operation that is not smooth, as a formula whose sign changes with the branch. */
typedef void kt_switch(void *user, const kt_jet *decision);

/* Bounds of a formula of time alone over [from, to]. `meet` is called for every operation that is not smooth (abs, sign,
 * min, max, step, clamp, comparisons), in the order of the text; NULL: for none. Next to such an operation the bounds are
 * those of all branches that are taken in the interval. O(length). */
kt_jet kt_expression_bound(const kt_expression *expression, double from, double to, kt_switch *meet, void *user);

#endif
