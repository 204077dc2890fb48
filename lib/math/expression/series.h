/* Taylor coefficients of formulas up to the third order, for one type of numbers. This file is a template: it is
 * included once by a file that defines `number` and its operations. Third derivatives (third.c) have doubles. Formulas
 * whose values exceed the largest double (wide.c) have numbers with any exponent.
 *
 * Each value has its coefficients x_k, the k-th derivative over k! along the curve. With z' as the derivative by the
 * curve's parameter,
 *
 *     z = x y      z_k = sum_i x_i y_(k-i)
 *     z = x / y    z_k = (x_k - sum_(i<k) z_i y_(k-i)) / y_0
 *     z = x^p      z_k = sum_(i>0) (i p - (k - i)) x_i z_(k-i) / (k x_0)
 *     z = exp x    k z_k = sum_(i>0) i x_i z_(k-i)
 *     z = log x    z_k = (x_k - (1/k) sum_(0<i<k) i z_i x_(k-i)) / x_0
 *     s = sin x, c = cos x      k s_k = sum_(i>0) i x_i c_(k-i),  k c_k = -sum_(i>0) i x_i s_(k-i)
 *     s = sinh x, c = cosh x    likewise, with + in place of -
 *
 * (Moore, Kearfott and Cloud 2009, Introduction to Interval Analysis, chapter 9). Integrals of these functions (atan,
 * asin, tanh, atan2) have z_k = (z')_(k-1) / k.
 *
 * The operations: number_of(double), double_of, sign_of (a double with the number's sign, NaN of NaN), plus, minus,
 * times, over, number_exp, number_log, number_power (by a double) and number_atan2 (a double). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_SERIES_H
#define KT_EXPRESSION_SERIES_H

#include "expression/lookup.h"

#include <math.h>

enum { ORDER = 3 };

/* Taylor coefficients, up to the order of the evaluation. */
typedef struct series {
    number c[ORDER + 1];
} series;

static const double share[ORDER + 1][ORDER + 1] = {
    {0.0}, {0.0, 1.0}, {0.0, 0.5, 1.0}, {0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0}}; /* i / k */

static series constant(number value) { return (series){{value, nothing, nothing, nothing}}; }

static bool is_constant(const series *x) {
    return sign_of(x->c[1]) == 0.0 && sign_of(x->c[2]) == 0.0 && sign_of(x->c[3]) == 0.0;
}

static series sum_of(const series *x, const series *y, double sign) {
    series z;
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = plus(x->c[k], sign < 0.0 ? minus(y->c[k]) : y->c[k]);
    return z;
}

static series scaled(const series *x, double factor) {
    series z;
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = times(number_of(factor), x->c[k]);
    return z;
}

static series product_of(const series *x, const series *y) {
    series z;
    for (int k = 0; k <= ORDER; k++) {
        z.c[k] = times(x->c[0], y->c[k]);
        for (int i = 1; i <= k; i++)
            z.c[k] = plus(z.c[k], times(x->c[i], y->c[k - i]));
    }
    return z;
}

static series quotient_of(const series *x, const series *y) {
    series z = constant(nothing);
    for (int k = 0; k <= ORDER; k++) {
        number rest = x->c[k];
        for (int i = 0; i < k; i++)
            rest = plus(rest, minus(times(z.c[i], y->c[k - i])));
        z.c[k] = over(rest, y->c[0]);
    }
    return z;
}

/* sum_(i>0) i x_i y_(k-i) / k */
static number mean_of(const series *x, const series *y, int k) {
    number sum = nothing;
    for (int i = 1; i <= k; i++)
        if (sign_of(x->c[i]) != 0.0)
            sum = plus(sum, times(number_of(share[k][i]), times(x->c[i], y->c[k - i])));
    return sum;
}

static series exp_of(const series *x) {
    series z = constant(number_exp(x->c[0]));
    for (int k = 1; k <= ORDER; k++)
        z.c[k] = mean_of(x, &z, k);
    return z;
}

static series log_of(const series *x) {
    series z = constant(number_log(x->c[0]));
    for (int k = 1; k <= ORDER; k++) {
        number rest = x->c[k];
        for (int i = 1; i < k; i++)
            rest = plus(rest, minus(times(number_of(share[k][i]), times(z.c[i], x->c[k - i]))));
        z.c[k] = over(rest, x->c[0]);
    }
    return z;
}

/* x^p for a number p. If p is a small integer, the derivatives at x = 0 exist. */
static series power_of(const series *x, double p) {
    static const double many = 64.0;
    series z = constant(number_of(1.0));
    if (p >= 0.0 && p <= many && p == floor(p)) {
        for (int i = 0; i < (int)p; i++)
            z = product_of(&z, x);
        return z;
    }
    z.c[0] = number_power(x->c[0], p);
    for (int k = 1; k <= ORDER; k++) {
        number sum = nothing;
        for (int i = 1; i <= k; i++)
            sum = plus(sum, times(number_of((i * p - (k - i)) / k), times(x->c[i], z.c[k - i])));
        z.c[k] = over(sum, x->c[0]);
    }
    return z;
}

/* The coefficients of sine and cosine (sign -1) or of the hyperbolic functions (sign 1), whose values are in s and
 * c. */
static void pair_of(const series *x, double sign, series *s, series *c) {
    for (int k = 1; k <= ORDER; k++) {
        s->c[k] = mean_of(x, c, k);
        c->c[k] = times(number_of(sign), mean_of(x, s, k));
    }
}

static void circular_of(const series *x, series *s, series *c) {
    const double t = double_of(x->c[0]);
    *s = constant(number_of(sin(t)));
    *c = constant(number_of(cos(t)));
    pair_of(x, -1.0, s, c);
}

/* Beyond `usual`, exp(-|t|) / 2 is below the rounding of exp(|t|) / 2, which may exceed the largest double. */
static void hyperbolic_of(const series *x, series *s, series *c) {
    static const double usual = 700.0;
    const double t = double_of(x->c[0]);
    const number half = times(number_of(0.5), number_exp(number_of(fabs(t))));
    *s = constant(fabs(t) < usual ? number_of(sinh(t)) : t < 0.0 ? minus(half) : half);
    *c = constant(fabs(t) < usual ? number_of(cosh(t)) : half);
    pair_of(x, 1.0, s, c);
}

/* x' as a series. The last coefficient is missing, and not used. */
static series rate_of(const series *x) {
    series z = constant(nothing);
    for (int k = 0; k < ORDER; k++)
        z.c[k] = times(number_of(k + 1.0), x->c[k + 1]);
    return z;
}

/* The series with the value z_0 and the derivative `rate`. */
static series integral_of(double value, const series *rate) {
    series z = constant(number_of(value));
    for (int k = 1; k <= ORDER; k++)
        z.c[k] = times(number_of(1.0 / k), rate->c[k - 1]);
    return z;
}

/* The integral of x' / y. */
static series integral_over(double value, const series *x, const series *y) {
    series rate = rate_of(x);
    rate = quotient_of(&rate, y);
    return integral_of(value, &rate);
}

/* 1 + sign x^2 */
static series one_plus_square(const series *x, double sign) {
    const series one = constant(number_of(1.0)), square = product_of(x, x);
    return sum_of(&one, &square, sign);
}

/* ---- operations -------------------------------------------------------------------------------------------------- */

/* The integral of x' / cosh^2 x. Beyond `saturated`, the derivatives are below the least double. */
static series tanh_of(const series *x) {
    static const double saturated = 1e6;
    const double t = double_of(x->c[0]);
    series s, c;
    if (fabs(t) > saturated)
        return constant(number_of(tanh(t)));
    hyperbolic_of(x, &s, &c);
    c = product_of(&c, &c);
    return integral_over(tanh(t), x, &c);
}

/* The integral of x' / sqrt(1 - x^2) for asin, of its opposite for acos. */
static series asin_of(kt_operator code, const series *x) {
    const series square = one_plus_square(x, -1.0), y = power_of(&square, 0.5);
    const double t = double_of(x->c[0]);
    if (code == KT_OPERATOR_ASIN)
        return integral_over(asin(t), x, &y);
    const series opposite = scaled(&y, -1.0);
    return integral_over(acos(t), x, &opposite);
}

static series of_one(kt_operator code, const series *x) {
    const double t = double_of(x->c[0]);
    series s, c;
    switch (code) {
    case KT_OPERATOR_NEGATE:
        return scaled(x, -1.0);
    case KT_OPERATOR_SIN:
    case KT_OPERATOR_COS:
    case KT_OPERATOR_TAN:
        circular_of(x, &s, &c);
        return code == KT_OPERATOR_SIN ? s : code == KT_OPERATOR_COS ? c : quotient_of(&s, &c);
    case KT_OPERATOR_SINH:
    case KT_OPERATOR_COSH:
        hyperbolic_of(x, &s, &c);
        return code == KT_OPERATOR_SINH ? s : c;
    case KT_OPERATOR_TANH:
        return tanh_of(x);
    case KT_OPERATOR_ASIN:
    case KT_OPERATOR_ACOS:
        return asin_of(code, x);
    case KT_OPERATOR_ATAN:
        s = one_plus_square(x, 1.0);
        return integral_over(atan(t), x, &s);
    case KT_OPERATOR_EXP:
        return exp_of(x);
    case KT_OPERATOR_LOG:
        return log_of(x);
    case KT_OPERATOR_SQRT:
        return power_of(x, 0.5);
    case KT_OPERATOR_ABS:
        return scaled(x, (sign_of(x->c[0]) > 0.0) - (sign_of(x->c[0]) < 0.0));
    default:
        return constant(number_of(kt_operator_value(code, sign_of(x->c[0]), 0.0))); /* only their signs count */
    }
}

/* x^y of two functions, x > 0. */
static series raised(const series *x, const series *y) {
    if (is_constant(y))
        return power_of(x, double_of(y->c[0]));
    const series logarithm = log_of(x), exponent = product_of(y, &logarithm);
    return exp_of(&exponent);
}

/* The angle of (y, x). */
static series angle_of(const series *x, const series *y) {
    const series dx = rate_of(x), dy = rate_of(y), a = product_of(&dx, y), b = product_of(x, &dy);
    const series xx = product_of(x, x), yy = product_of(y, y), square = sum_of(&xx, &yy, 1.0);
    series rate = sum_of(&a, &b, -1.0);
    rate = quotient_of(&rate, &square);
    return integral_of(number_atan2(x->c[0], y->c[0]), &rate);
}

/* The sign of x - y. */
static double side_of(const series *x, const series *y) { return sign_of(plus(x->c[0], minus(y->c[0]))); }

static series of_two(kt_operator code, const series *x, const series *y) {
    switch (code) {
    case KT_OPERATOR_ADD:
        return sum_of(x, y, 1.0);
    case KT_OPERATOR_SUBTRACT:
        return sum_of(x, y, -1.0);
    case KT_OPERATOR_MULTIPLY:
        return product_of(x, y);
    case KT_OPERATOR_DIVIDE:
        return quotient_of(x, y);
    case KT_OPERATOR_POWER:
        return raised(x, y);
    case KT_OPERATOR_ATAN2:
        return angle_of(x, y);
    case KT_OPERATOR_HYPOT: {
        const series xx = product_of(x, x), yy = product_of(y, y), square = sum_of(&xx, &yy, 1.0);
        return power_of(&square, 0.5);
    }
    case KT_OPERATOR_MIN:
        return side_of(x, y) <= 0.0 || isnan(sign_of(x->c[0])) ? *x : *y;
    case KT_OPERATOR_MAX:
        return side_of(x, y) >= 0.0 || isnan(sign_of(x->c[0])) ? *x : *y;
    default:
        return constant(number_of(kt_operator_value(code, side_of(x, y), 0.0))); /* comparisons */
    }
}

/* z x + c */
static series times_plus(const series *z, const series *x, double c) {
    series sum = product_of(z, x);
    sum.c[0] = plus(sum.c[0], number_of(c));
    return sum;
}

/* The polynomial of a table (lookup.h). */
static series of_lookup(const kt_expression_term *term, const series *x, const series *y) {
    const double at[2] = {double_of(x->c[0]), double_of(y->c[0])};
    const kt_lookup_piece p = kt_lookup_piece_at(kt_lookup_of(term), at[0], at[1]);
    series s = *x, r = *y, z = constant(number_of(p.c[3]));
    s.c[0] = plus(s.c[0], number_of(-p.at[0]));
    r.c[0] = plus(r.c[0], number_of(-p.at[1]));
    z = times_plus(&z, &s, p.c[2]);
    if (p.inputs == 1) {
        z = times_plus(&z, &s, p.c[1]);
        return times_plus(&z, &s, p.c[0]);
    }
    const series slope = constant(number_of(p.c[1])), first = times_plus(&slope, &s, p.c[0]);
    z = product_of(&z, &r);
    return sum_of(&z, &first, 1.0);
}

/* A function of constants is constant, even if its derivatives are infinite. */
static series operate(const kt_expression_term *term, const series *x, const series *y) {
    const kt_operator code = (kt_operator)term->code;
    const series z = kt_operator_is_lookup(code)   ? of_lookup(term, x, y)
                     : kt_operator_is_binary(code) ? of_two(code, x, y)
                                                   : of_one(code, x);
    return is_constant(x) && (x == y || is_constant(y)) ? constant(z.c[0]) : z;
}

/* The series of a number or a symbol, whose derivatives are given by `rates` and `second` (NULL: zero). */
static series leaf_of(const kt_expression_term *term, const double *values, const double *rates, const double *second) {
    if (term->code == KT_OPERATOR_NUMBER)
        return constant(number_of(term->number));
    series x = constant(number_of(values[term->symbol]));
    x.c[1] = number_of(rates ? rates[term->symbol] : 0.0);
    x.c[2] = number_of(second ? 0.5 * second[term->symbol] : 0.0);
    return x;
}

/* The series of a formula along the curve of its symbols. */
static series series_of(const kt_expression *expression, const double *values, const double *rates,
                        const double *second) {
    series stack[KT_EXPRESSION_DEPTH_MAX] = {{{nothing}}};
    for (kt_postfix w = kt_postfix_begin(expression); kt_postfix_next(&w);)
        stack[w.at] =
            w.is_leaf ? leaf_of(w.term, values, rates, second) : operate(w.term, &stack[w.at], &stack[w.other]);
    return stack[0];
}

#endif
