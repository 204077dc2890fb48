/* Taylor coefficients of functions over an interval of time, by interval arithmetic (Moore, Kearfott and Cloud 2009,
 * Introduction to Interval Analysis, chapter 9). With x_k the k-th derivative of x over k!,
 *
 *     z = x y      z_k = sum_i x_i y_(k-i)
 *     z = x / y    z_k = (x_k - sum_(i<k) z_i y_(k-i)) / y_0
 *     z = sqrt x   z_k = (x_k - sum_(0<i<k) z_i z_(k-i)) / (2 z_0)
 *     z = exp x    k z_k = sum_(i>0) i x_i z_(k-i)
 *     z = log x    z_k = (x_k - (1/k) sum_(0<i<k) i z_i x_(k-i)) / x_0
 *     s = sin x, c = cos x    k s_k = sum_(i>0) i x_i c_(k-i),  k c_k = -sum_(i>0) i x_i s_(k-i)
 *
 * Integrals of these functions (atan, asin, ...) have z_k = (z')_(k-1) / k.
 *
 * Ratios. A value may exceed the largest number, as exp(800) in 1 / (1 + exp(100 (8 - t))). These sums then have no
 * bounds, but the ratios z_k / z_0 have. The ratios follow from the same sums over x_0, y_0 and z_0. For x + y with two
 * numbers of one sign, the ratios of the sum are means of the ratios of x and y. If the signs differ, the same means
 * have bounds as long as |x| > 2 |y|. The weights of these means are then 1 / (1 + y / x) and 1 less that.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_TAYLOR_H
#define KT_EXPRESSION_TAYLOR_H

#include "expression/interval.h"

static kt_jet jet_constant(kt_between value) {
    return (kt_jet){.c = {value, interval_zero, interval_zero, interval_zero, interval_zero}};
}
static kt_jet jet_number(double value) { return jet_constant((kt_between){value, value}); }

static bool jet_is_constant(const kt_jet *x) {
    for (int k = 1; k <= KT_JET_ORDER; k++)
        if (!interval_is_point(x->c[k], 0.0))
            return false;
    return true;
}

/* x_k / x_0. */
static kt_between jet_ratio(const kt_jet *x, int k) {
    static const kt_between one = {1.0, 1.0};
    return k == 0 ? one : x->has_ratio ? x->ratio[k] : interval_divide(x->c[k], x->c[0]);
}

/* Stores the ratios z_k / z_0, and derives bounds of coefficients that have no bounds or wide bounds. Infinity times 0
 * bounds nothing. */
static void jet_settle(kt_jet *z, const kt_between ratio[KT_JET_ORDER + 1]) {
    for (int k = 0; k <= KT_JET_ORDER; k++) {
        z->ratio[k] = ratio[k];
        const bool bounds = k > 0 && !(interval_is_point(z->c[0], 0.0) && interval_holds_infinity(ratio[k]));
        z->c[k] = !bounds ? z->c[k] : interval_common(z->c[k], interval_multiply(z->c[0], ratio[k]));
    }
    z->has_ratio = true;
}

static bool jet_overflows(const kt_jet *x) {
    for (int k = 0; k <= KT_JET_ORDER; k++)
        if (interval_holds_infinity(x->c[k]))
            return true;
    return false;
}

/* The weights of x and y in the ratios of x + y. Returns whether both weights have bounds. */
static bool jet_sum_weights(const kt_jet *of_x, const kt_jet *of_y, kt_between weight[2]) {
    const kt_between x = of_x->c[0], y = of_y->c[0];
    kt_between swapped[2];
    if (interval_have_one_sign(x, y)) {
        weight[0] = interval_share(x, y);
        weight[1] = interval_share(y, x);
        return true;
    }
    if (jet_overflows(of_x) && interval_least(x) > 2.0 * interval_most(y)) {
        interval_dominate(x, y, weight);
        return true;
    }
    if (jet_overflows(of_y) && interval_least(y) > 2.0 * interval_most(x)) {
        interval_dominate(y, x, swapped);
        weight[0] = swapped[1];
        weight[1] = swapped[0];
        return true;
    }
    return false;
}

static kt_jet jet_sum(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    kt_between weight[2], ratio[KT_JET_ORDER + 1];
    for (int k = 0; k <= KT_JET_ORDER; k++)
        z.c[k] = interval_add(x->c[k], y->c[k]);
    if (jet_sum_weights(x, y, weight)) {
        for (int k = 0; k <= KT_JET_ORDER; k++)
            ratio[k] = interval_add(interval_multiply(weight[0], jet_ratio(x, k)),
                                    interval_multiply(weight[1], jet_ratio(y, k)));
        jet_settle(&z, ratio);
    }
    return z;
}

static kt_jet jet_scale(double factor, const kt_jet *x) {
    kt_jet z = *x;
    for (int k = 0; k <= KT_JET_ORDER; k++)
        z.c[k] = interval_scale(factor, x->c[k]);
    return z;
}

/* Negates exactly, so that -2 remains a whole number. */
static kt_jet jet_minus(const kt_jet *x) {
    kt_jet z = *x;
    for (int k = 0; k <= KT_JET_ORDER; k++)
        z.c[k] = interval_negate(x->c[k]);
    return z;
}

static kt_jet jet_difference(const kt_jet *x, const kt_jet *y) {
    const kt_jet minus = jet_minus(y);
    return jet_sum(x, &minus);
}

static kt_jet jet_product(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    for (int k = 0; k <= KT_JET_ORDER; k++) {
        z.c[k] = interval_zero;
        for (int i = 0; i <= k; i++)
            z.c[k] = interval_add(z.c[k], interval_multiply(x->c[i], y->c[k - i]));
    }
    kt_between ratio[KT_JET_ORDER + 1];
    for (int k = 0; k <= KT_JET_ORDER; k++) {
        ratio[k] = interval_zero;
        for (int i = 0; i <= k; i++)
            ratio[k] = interval_add(ratio[k], interval_multiply(jet_ratio(x, i), jet_ratio(y, k - i)));
    }
    jet_settle(&z, ratio);
    return z;
}

static kt_jet jet_quotient(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    for (int k = 0; k <= KT_JET_ORDER; k++) {
        kt_between sum = x->c[k];
        for (int i = 0; i < k; i++)
            sum = interval_subtract(sum, interval_multiply(z.c[i], y->c[k - i]));
        z.c[k] = interval_divide(sum, y->c[0]);
    }
    kt_between ratio[KT_JET_ORDER + 1];
    for (int k = 0; k <= KT_JET_ORDER; k++) {
        ratio[k] = jet_ratio(x, k);
        for (int i = 0; i < k; i++)
            ratio[k] = interval_subtract(ratio[k], interval_multiply(ratio[i], jet_ratio(y, k - i)));
    }
    jet_settle(&z, ratio);
    return z;
}

/* The ratios, of use only if a coefficient of x has no bounds, follow from z z = x: r_k = (x_k / x_0 - sum_(0<i<k) r_i
 * r_(k-i)) / 2. */
static kt_jet jet_sqrt(const kt_jet *x) {
    kt_jet z = {.size = 0.0};
    z.c[0] = interval_sqrt(x->c[0]);
    for (int k = 1; k <= KT_JET_ORDER; k++) {
        kt_between sum = x->c[k];
        for (int i = 1; i < k; i++)
            sum = interval_subtract(sum, interval_multiply(z.c[i], z.c[k - i]));
        z.c[k] = interval_divide(sum, interval_scale(2.0, z.c[0]));
    }
    if (!jet_overflows(x))
        return z;
    kt_between ratio[KT_JET_ORDER + 1] = {{1.0, 1.0}};
    for (int k = 1; k <= KT_JET_ORDER; k++) {
        ratio[k] = jet_ratio(x, k);
        for (int i = 1; i < k; i++)
            ratio[k] = interval_subtract(ratio[k], interval_multiply(ratio[i], ratio[k - i]));
        ratio[k] = interval_scale(0.5, ratio[k]);
    }
    jet_settle(&z, ratio);
    return z;
}

/* The coefficients follow from the ratios alone (jet_settle), since exp x = z_0 may be infinite and its ratios are
 * not. */
static kt_jet jet_exp(const kt_jet *x) {
    kt_jet z = {.size = 0.0};
    z.c[0] = interval_raise(exp, x->c[0]);
    z.c[0].lo = larger(0.0, z.c[0].lo);
    z.c[0].hi = larger(DBL_TRUE_MIN, z.c[0].hi); /* above zero, for every factor */
    for (int k = 1; k <= KT_JET_ORDER; k++)
        z.c[k] = interval_unbounded;
    kt_between ratio[KT_JET_ORDER + 1] = {{1.0, 1.0}};
    for (int k = 1; k <= KT_JET_ORDER; k++) {
        ratio[k] = interval_zero;
        for (int i = 1; i <= k; i++)
            ratio[k] = interval_add(ratio[k], interval_scale((double)i / k, interval_multiply(x->c[i], ratio[k - i])));
    }
    jet_settle(&z, ratio);
    return z;
}

static kt_jet jet_log(const kt_jet *x) {
    kt_jet z = {.size = 0.0};
    z.c[0] = interval_log(x->c[0]);
    for (int k = 1; k <= KT_JET_ORDER; k++) {
        z.c[k] = jet_ratio(x, k);
        for (int i = 1; i < k; i++)
            z.c[k] = interval_subtract(z.c[k],
                                       interval_scale((double)i / k, interval_multiply(z.c[i], jet_ratio(x, k - i))));
    }
    return z;
}

static void jet_sincos(const kt_jet *x, kt_jet *s, kt_jet *c) {
    *s = *c = (kt_jet){.size = 0.0};
    s->c[0] = interval_sin(x->c[0]);
    c->c[0] = interval_cos(x->c[0]);
    for (int k = 1; k <= KT_JET_ORDER; k++) {
        s->c[k] = c->c[k] = interval_zero;
        for (int i = 1; i <= k; i++) {
            s->c[k] = interval_add(s->c[k], interval_scale((double)i / k, interval_multiply(x->c[i], c->c[k - i])));
            c->c[k] =
                interval_subtract(c->c[k], interval_scale((double)i / k, interval_multiply(x->c[i], s->c[k - i])));
        }
    }
}

/* The integral of z' = x' / y with the value z_0 at the expansion point. */
static kt_jet jet_integral(kt_between value, const kt_jet *x, const kt_jet *y) {
    kt_jet rate = jet_number(0.0), z = {.c = {value}};
    for (int k = 0; k < KT_JET_ORDER; k++)
        rate.c[k] = interval_scale(k + 1.0, x->c[k + 1]);
    rate = jet_quotient(&rate, y); /* the last coefficient of `rate` is not used */
    for (int k = 1; k <= KT_JET_ORDER; k++)
        z.c[k] = interval_scale(1.0 / k, rate.c[k - 1]);
    return z;
}

static kt_jet jet_one_plus_square(const kt_jet *x, double sign) {
    kt_jet square = jet_product(x, x);
    const kt_jet one = jet_number(1.0);
    square.c[0].lo = larger(0.0, square.c[0].lo);
    square = jet_scale(sign, &square);
    return jet_sum(&one, &square);
}

static kt_jet jet_atan(const kt_jet *x) {
    const kt_jet y = jet_one_plus_square(x, 1.0);
    return jet_integral(interval_raise(atan, x->c[0]), x, &y);
}

static kt_jet jet_asin(const kt_jet *x) {
    const kt_jet square = jet_one_plus_square(x, -1.0), y = jet_sqrt(&square);
    return jet_integral(interval_raise(asin, interval_within(x->c[0], -1.0, 1.0)), x, &y);
}

static kt_jet jet_acos(const kt_jet *x) {
    static const double half_pi = 1.57079632679489661923;
    const kt_jet angle = jet_asin(x), right = jet_number(half_pi);
    return jet_difference(&right, &angle);
}

static kt_jet jet_tan(const kt_jet *x) {
    kt_jet s, c;
    jet_sincos(x, &s, &c);
    return jet_quotient(&s, &c);
}

/* (e^x + sign e^-x) / 2 */
static kt_jet jet_hyperbolic(const kt_jet *x, double sign) {
    const kt_jet minus = jet_minus(x), e = jet_exp(x);
    kt_jet other = jet_exp(&minus);
    other = jet_scale(sign, &other);
    other = jet_sum(&e, &other);
    other = jet_scale(0.5, &other);
    if (sign > 0.0)
        other.c[0] =
            interval_common(interval_widened(cosh(interval_least(x->c[0])), cosh(interval_most(x->c[0]))), other.c[0]);
    return other;
}

/* 1 - 2 / (e^2x + 1) */
static kt_jet jet_tanh(const kt_jet *x) {
    const kt_jet twice = jet_scale(2.0, x), one = jet_number(1.0), two = jet_number(2.0);
    kt_jet z = jet_exp(&twice);
    z = jet_sum(&z, &one);
    z = jet_quotient(&two, &z);
    z = jet_difference(&one, &z);
    z.c[0] = interval_within(z.c[0], -1.0, 1.0);
    return z;
}

/* x^n, by squares. */
static kt_jet jet_whole_power(const kt_jet *x, int n) {
    kt_jet z = jet_number(1.0), square = *x;
    for (int rest = n, bits = 0; rest > 0; rest /= 2) {
        if (rest % 2 != 0)
            z = bits++ > 0 ? jet_product(&z, &square) : square;
        square = rest > 1 ? jet_product(&square, &square) : square;
    }
    if (n > 0 && n % 2 == 0)
        z.c[0].lo = larger(0.0, z.c[0].lo);
    return z;
}

static bool jet_is_whole(const kt_jet *y) {
    static const double most = 1048576.0;
    const double n = y->c[0].lo;
    return jet_is_constant(y) && interval_is_point(y->c[0], n) && n == rint(n) && fabs(n) <= most &&
           y->defined == KT_DEFINED;
}

/* e^(y log x), which is defined for x > 0 alone; whole exponents have their own way. */
static kt_jet jet_power(const kt_jet *x, const kt_jet *y) {
    const double n = y->c[0].lo;
    const kt_jet one = jet_number(1.0);
    if (jet_is_whole(y)) {
        const kt_jet z = jet_whole_power(x, (int)fabs(n));
        return n < 0.0 ? jet_quotient(&one, &z) : z;
    }
    if (!(x->c[0].lo > 0.0)) {
        const bool root = jet_is_constant(y) && interval_is_point(y->c[0], n) && n > 0.0 && x->c[0].lo == 0.0;
        return (kt_jet){.c = {root ? interval_widened(0.0, pow(x->c[0].hi, n)) : interval_unbounded, interval_unbounded,
                              interval_unbounded, interval_unbounded, interval_unbounded}};
    }
    kt_jet z = jet_log(x);
    z = jet_product(&z, y);
    return jet_exp(&z);
}

#endif
