/* Interval arithmetic with doubles (Moore, Kearfott and Cloud 2009, Introduction to Interval Analysis).
 *
 * Each operation widens its interval by two roundings, so that the interval contains the result of exact arithmetic.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_INTERVAL_H
#define KT_EXPRESSION_INTERVAL_H

#include "expression/jet.h"

#include <float.h>
#include <math.h>

static const kt_between interval_unbounded = {-HUGE_VAL, HUGE_VAL};
static const kt_between interval_zero = {0.0, 0.0};

/* Widens an interval by rounding. A value that is too large for a number may be a number in exact arithmetic. Therefore
 * no interval lies at infinity alone. */
static kt_between interval_widened(double lo, double hi) {
    if (isnan(lo) || isnan(hi))
        return interval_unbounded;
    if (lo == 0.0 && hi == 0.0)
        return interval_zero;
    const double least = smaller(lo, DBL_MAX), most = larger(hi, -DBL_MAX);
    const kt_between wide = {least - 2.0 * DBL_EPSILON * fabs(least) - DBL_TRUE_MIN,
                             most + 2.0 * DBL_EPSILON * fabs(most) + DBL_TRUE_MIN};
    return wide;
}

static bool interval_is_point(kt_between x, double value) { return x.lo == value && x.hi == value; }
static bool interval_holds(kt_between x, double value) { return x.lo <= value && value <= x.hi; }
static bool interval_holds_infinity(kt_between x) {
    return interval_holds(x, HUGE_VAL) || interval_holds(x, -HUGE_VAL);
}

static double interval_most(kt_between x) { return larger(fabs(x.lo), fabs(x.hi)); }
static double interval_least(kt_between x) { return interval_holds(x, 0.0) ? 0.0 : smaller(fabs(x.lo), fabs(x.hi)); }

static kt_between interval_add(kt_between x, kt_between y) { return interval_widened(x.lo + y.lo, x.hi + y.hi); }
static kt_between interval_negate(kt_between x) { return (kt_between){-x.hi, -x.lo}; }
static kt_between interval_subtract(kt_between x, kt_between y) { return interval_add(x, interval_negate(y)); }
static kt_between interval_hull(kt_between x, kt_between y) {
    return (kt_between){smaller(x.lo, y.lo), larger(x.hi, y.hi)};
}

static double interval_end_product(double x, double y) { return x == 0.0 || y == 0.0 ? 0.0 : x * y; }

static kt_between interval_multiply(kt_between x, kt_between y) {
    const double a = interval_end_product(x.lo, y.lo), b = interval_end_product(x.lo, y.hi),
                 c = interval_end_product(x.hi, y.lo), d = interval_end_product(x.hi, y.hi);
    return interval_widened(smaller(smaller(a, b), smaller(c, d)), larger(larger(a, b), larger(c, d)));
}

static kt_between interval_scale(double factor, kt_between x) {
    return interval_multiply((kt_between){factor, factor}, x);
}

static kt_between interval_divide(kt_between x, kt_between y) {
    if (interval_is_point(x, 0.0) && !interval_is_point(y, 0.0))
        return interval_zero;
    if (interval_holds(y, 0.0))
        return interval_unbounded;
    return interval_multiply(x, interval_widened(1.0 / y.hi, 1.0 / y.lo));
}

/* Bounds of a function that rises everywhere. */
static kt_between interval_raise(double (*f)(double), kt_between x) {
    const kt_between y = interval_widened(f(x.lo), f(x.hi));
    return interval_widened(y.lo, y.hi);
}

/* Bounds of sin over [lo, hi]. The crests of sin are at (4 n + 1) pi / 2. */
static kt_between interval_sin(kt_between x) {
    static const double pi = 3.14159265358979323846;
    const double slop = 4.0 * DBL_EPSILON * (1.0 + larger(fabs(x.lo), fabs(x.hi)));
    if (!(x.hi - x.lo < 2.0 * pi) || !(slop < 1.0))
        return (kt_between){-1.0, 1.0};
    const double a = sin(x.lo), b = sin(x.hi);
    const double crest = ceil((x.lo - slop - 0.5 * pi) / (2.0 * pi)) * 2.0 * pi + 0.5 * pi;
    const double trough = ceil((x.lo - slop + 0.5 * pi) / (2.0 * pi)) * 2.0 * pi - 0.5 * pi;
    const kt_between ends = interval_widened(smaller(a, b), larger(a, b));
    return (kt_between){trough <= x.hi + slop ? -1.0 : larger(-1.0, ends.lo - slop),
                        crest <= x.hi + slop ? 1.0 : smaller(1.0, ends.hi + slop)};
}

static kt_between interval_cos(kt_between x) {
    static const double half_pi = 1.57079632679489661923;
    return interval_sin(interval_add(x, (kt_between){half_pi, half_pi}));
}

/* Restricts x to the domain [lo, hi] of a function. Returns `interval_unbounded` if x lies outside it. */
static kt_between interval_within(kt_between x, double lo, double hi) {
    const kt_between cut = {larger(x.lo, lo), smaller(x.hi, hi)};
    return cut.lo <= cut.hi ? cut : interval_unbounded;
}

static kt_between interval_log(kt_between x) {
    return x.hi > 0.0 ? interval_raise(log, interval_within(x, 0.0, HUGE_VAL)) : interval_unbounded;
}
static kt_between interval_sqrt(kt_between x) {
    return x.hi >= 0.0 ? interval_raise(sqrt, interval_within(x, 0.0, HUGE_VAL)) : interval_unbounded;
}

/* The intersection of two intervals that contain the same number. */
static kt_between interval_common(kt_between x, kt_between y) {
    const kt_between both = {larger(x.lo, y.lo), smaller(x.hi, y.hi)};
    return both.lo <= both.hi ? both : x;
}

static bool interval_have_one_sign(kt_between x, kt_between y) {
    return (x.lo >= 0.0 && y.lo >= 0.0) || (x.hi <= 0.0 && y.hi <= 0.0);
}

/* Bounds of x / (x + y) for numbers of one sign. */
static kt_between interval_share(kt_between x, kt_between y) {
    static const kt_between whole = {0.0, 1.0};
    const double lo = interval_least(x) / (interval_least(x) + interval_most(y)),
                 hi = interval_most(x) / (interval_most(x) + interval_least(y));
    return isnan(lo) || isnan(hi) ? whole : interval_common(whole, interval_widened(lo, hi));
}

/* The weights of x and y in the ratios of x + y, if |x| > 2 |y| and the signs differ. */
static void interval_dominate(kt_between x, kt_between y, kt_between weight[2]) {
    const double m = interval_most(y) / interval_least(x);
    weight[0] = interval_widened(1.0, 1.0 / (1.0 - m));
    weight[1] = interval_widened(-m / (1.0 - m), 0.0);
}

#endif
