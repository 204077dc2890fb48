/* Taylor coefficients of a formula over an interval of time: bounds of its value and of its first derivatives. */
#ifndef KT_EXPRESSION_JET_H
#define KT_EXPRESSION_JET_H

#include "base/inner.h"
#include "expression/expression.h"

/* All numbers from lo to hi, which may be infinite. */
typedef struct kt_interval {
    double lo, hi;
} kt_interval;

enum { KT_JET_ORDER = 4 };

/* Whether a value may be NaN, as of sqrt(-1), or of inf/inf after numbers became too large: nowhere in an interval, at some
 * times, or at all. */
typedef enum kt_definedness { KT_DEFINED, KT_DEFINED_IN_PART, KT_DEFINED_NOWHERE } kt_definedness;

/* c[k] holds the k-th derivative over k!, at every time of an interval at which there is one. */
typedef struct kt_jet {
    kt_interval c[KT_JET_ORDER + 1];
    double
        size; /* rounding errors of the value are a small part of it, where the interval is short; less where it is long */
    kt_definedness defined;
    bool has_ratio;                      /* whether */
    kt_interval ratio[KT_JET_ORDER + 1]; /* holds c[k] over c[0], which need not be numbers: of 1 / (1 + exp(800)) */
} kt_jet;

/* What decides on the branch of an operation that is not smooth, as a formula whose sign changes with the branch; where it
 * is not defined, the branch is that of NaN, which compares as false. */
typedef void kt_switch(void *user, const kt_jet *decision);

/* Bounds of a formula of time alone over [from, to]. `meet` is called for every operation that is not smooth (abs, sign,
 * min, max, step, clamp, comparisons), in the order of the text; NULL: for none. Next to such an operation the bounds are
 * those of all branches that are taken in the interval. O(length). */
KT_INNER kt_jet kt_expression_bound(const kt_expression *expression, double from, double to, kt_switch *meet,
                                    void *user);

#endif
