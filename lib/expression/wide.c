/* Formulas with numbers m 2^e of any exponent e, for cases in which the usual ones overflow or underflow. For example,
 * log(1 + exp(8000)) is 8000, and exp(900) / exp(899) is e. Such an evaluation costs some ten times the usual one. It
 * replaces the usual one only if a result is not finite.
 *
 * Each value has its Taylor coefficients x_k, the k-th derivative over k! along the curve. With z' as the derivative by
 * the curve's parameter,
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
 */
#include "expression/wide.h"

#include <math.h>
#include <stdio.h>

enum { ORDER = 3 };

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* m 2^e, 0.5 <= |m| < 1; or m is 0, infinite or NaN. e is a whole number. */
typedef struct wide {
    double m, e;
} wide;

static wide normal(double m, double e) {
    int shift = 0;
    const double part = isfinite(m) ? frexp(m, &shift) : m;
    return (wide){part, part == 0.0 || !isfinite(part) ? 0.0 : e + shift};
}

static wide widen(double x) { return normal(x, 0.0); }

/* Zero or infinite if it is beyond the numbers. */
static double double_of(wide x) {
    static const double beyond = 3000.0;
    return ldexp(x.m, (int)fmax(-beyond, fmin(x.e, beyond)));
}

static wide times(wide x, wide y) { return normal(x.m * y.m, x.e + y.e); }
static wide over(wide x, wide y) { return normal(x.m / y.m, x.e - y.e); }
static wide minus(wide x) { return (wide){-x.m, x.e}; }

static wide plus(wide x, wide y) {
    static const double beyond = 200.0;
    if (x.m == 0.0 || y.m == 0.0)
        return x.m == 0.0 ? y : x;
    if (x.e < y.e)
        return plus(y, x);
    return normal(x.m + ldexp(y.m, (int)fmax(y.e - x.e, -beyond)), x.e);
}

/* e^x as e^(x - k ln 2) 2^k, with k ln 2 the nearest to x. If the rounding of x alone makes the result uncertain,
 * NaN. */
static wide wide_exp(wide x) {
    static const double inverse = 1.44269504088896338700, high = 6.93147180559945286227e-01,
                        low = 2.31904681384629955842e-17, most = 1e12;
    const double t = double_of(x), k = nearbyint(t * inverse);
    if (!(fabs(t) < most))
        return widen(t < 0.0 ? 0.0 : (double)NAN);
    return normal(exp(fma(-k, low, fma(-k, high, t))), k);
}

static wide wide_log(wide x) {
    static const double ln2 = 6.93147180559945286227e-01, usual = 1000.0;
    return widen(fabs(x.e) < usual ? log(double_of(x)) : log(x.m) + x.e * ln2);
}

/* x^p = e^(p log m) 2^(e p). */
static wide wide_power(wide x, double p) {
    const double usual = pow(double_of(x), p), exponent = x.e * p, k = nearbyint(exponent);
    if ((isfinite(usual) && usual != 0.0) || x.m == 0.0)
        return widen(usual);
    const wide part = fabs(p) < 500.0 ? widen(pow(x.m, p)) : wide_exp(widen(p * log(x.m)));
    return times(part, normal(exp2(exponent - k), k));
}

/* ---- series ------------------------------------------------------------------------------------------------------ */

/* Taylor coefficients, up to the order of the evaluation. */
typedef struct series {
    wide c[ORDER + 1];
} series;

static const wide nothing = {0.0, 0.0};

static series constant(wide value) { return (series){{value, nothing, nothing, nothing}}; }

static bool is_constant(const series *x) { return x->c[1].m == 0.0 && x->c[2].m == 0.0 && x->c[3].m == 0.0; }

static series sum_of(const series *x, const series *y, double sign) {
    series z;
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = plus(x->c[k], sign < 0.0 ? minus(y->c[k]) : y->c[k]);
    return z;
}

static series scaled(const series *x, double factor) {
    series z;
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = times(widen(factor), x->c[k]);
    return z;
}

static series product_of(const series *x, const series *y) {
    series z;
    for (int k = 0; k <= ORDER; k++) {
        z.c[k] = nothing;
        for (int i = 0; i <= k; i++)
            z.c[k] = plus(z.c[k], times(x->c[i], y->c[k - i]));
    }
    return z;
}

static series quotient_of(const series *x, const series *y) {
    series z = constant(nothing);
    for (int k = 0; k <= ORDER; k++) {
        wide rest = x->c[k];
        for (int i = 0; i < k; i++)
            rest = plus(rest, minus(times(z.c[i], y->c[k - i])));
        z.c[k] = over(rest, y->c[0]);
    }
    return z;
}

/* sum_(i>0) i x_i y_(k-i) / k */
static wide mean_of(const series *x, const series *y, int k) {
    wide sum = nothing;
    for (int i = 1; i <= k; i++)
        if (x->c[i].m != 0.0)
            sum = plus(sum, times(widen((double)i / k), times(x->c[i], y->c[k - i])));
    return sum;
}

static series exp_of(const series *x) {
    series z = constant(wide_exp(x->c[0]));
    for (int k = 1; k <= ORDER; k++)
        z.c[k] = mean_of(x, &z, k);
    return z;
}

static series log_of(const series *x) {
    series z = constant(wide_log(x->c[0]));
    for (int k = 1; k <= ORDER; k++) {
        wide rest = x->c[k];
        for (int i = 1; i < k; i++)
            rest = plus(rest, minus(times(widen((double)i / k), times(z.c[i], x->c[k - i]))));
        z.c[k] = over(rest, x->c[0]);
    }
    return z;
}

/* x^p of a number p. Small whole ones have derivatives at zero. */
static series power_of(const series *x, double p) {
    static const double many = 64.0;
    series z = constant(widen(1.0));
    if (p >= 0.0 && p <= many && p == floor(p)) {
        for (int i = 0; i < (int)p; i++)
            z = product_of(&z, x);
        return z;
    }
    z.c[0] = wide_power(x->c[0], p);
    for (int k = 1; k <= ORDER; k++) {
        wide sum = nothing;
        for (int i = 1; i <= k; i++)
            sum = plus(sum, times(widen((i * p - (k - i)) / k), times(x->c[i], z.c[k - i])));
        z.c[k] = over(sum, x->c[0]);
    }
    return z;
}

/* The coefficients of sine and cosine (sign -1) or of the hyperbolic functions (sign 1), whose values are in s and
 * c. */
static void pair_of(const series *x, double sign, series *s, series *c) {
    for (int k = 1; k <= ORDER; k++) {
        s->c[k] = mean_of(x, c, k);
        c->c[k] = times(widen(sign), mean_of(x, s, k));
    }
}

static void circular_of(const series *x, series *s, series *c) {
    const double t = double_of(x->c[0]);
    *s = constant(widen(sin(t)));
    *c = constant(widen(cos(t)));
    pair_of(x, -1.0, s, c);
}

static void hyperbolic_of(const series *x, series *s, series *c) {
    static const double usual = 700.0;
    const double t = double_of(x->c[0]);
    const wide half = times(widen(0.5), wide_exp(widen(fabs(t))));
    *s = constant(fabs(t) < usual ? widen(sinh(t)) : t < 0.0 ? minus(half) : half);
    *c = constant(fabs(t) < usual ? widen(cosh(t)) : half);
    pair_of(x, 1.0, s, c);
}

/* x' as a series. Its last coefficient is missing, and not used. */
static series rate_of(const series *x) {
    series z = constant(nothing);
    for (int k = 0; k < ORDER; k++)
        z.c[k] = times(widen(k + 1.0), x->c[k + 1]);
    return z;
}

/* The series with the value z_0 and the derivative `rate`. */
static series integral_of(double value, const series *rate) {
    series z = constant(widen(value));
    for (int k = 1; k <= ORDER; k++)
        z.c[k] = times(widen(1.0 / k), rate->c[k - 1]);
    return z;
}

/* The integral of x' / y. */
static series integral_over(double value, const series *x, const series *y) {
    series rate = rate_of(x);
    rate = quotient_of(&rate, y);
    return integral_of(value, &rate);
}

static series one_plus_square(const series *x, double sign) {
    const series one = constant(widen(1.0)), square = product_of(x, x);
    return sum_of(&one, &square, sign);
}

/* ---- operations -------------------------------------------------------------------------------------------------- */

static series tanh_of(const series *x) {
    static const double saturated = 1e6;
    const double t = double_of(x->c[0]);
    series s, c;
    if (fabs(t) > saturated)
        return constant(widen(tanh(t)));
    hyperbolic_of(x, &s, &c);
    c = product_of(&c, &c);
    return integral_over(tanh(t), x, &c);
}

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
        return scaled(x, (x->c[0].m > 0.0) - (x->c[0].m < 0.0));
    default:
        return constant(widen(kt_operator_value(code, x->c[0].m, 0.0))); /* only their signs count */
    }
}

/* x^y of two functions, x > 0. */
static series raised(const series *x, const series *y) {
    series z = log_of(x);
    if (is_constant(y))
        return power_of(x, double_of(y->c[0]));
    z = product_of(y, &z);
    return exp_of(&z);
}

/* The angle of (y, x). */
static series angle_of(const series *x, const series *y) {
    const series dx = rate_of(x), dy = rate_of(y), a = product_of(&dx, y), b = product_of(x, &dy);
    const series xx = product_of(x, x), yy = product_of(y, y), square = sum_of(&xx, &yy, 1.0);
    const double shift = -fmax(x->c[0].e, y->c[0].e); /* their ratio decides */
    series rate = sum_of(&a, &b, -1.0);
    rate = quotient_of(&rate, &square);
    return integral_of(
        atan2(double_of((wide){x->c[0].m, x->c[0].e + shift}), double_of((wide){y->c[0].m, y->c[0].e + shift})), &rate);
}

static series of_two(kt_operator code, const series *x, const series *y) {
    const series difference = sum_of(x, y, -1.0);
    const double side = difference.c[0].m;
    switch (code) {
    case KT_OPERATOR_ADD:
        return sum_of(x, y, 1.0);
    case KT_OPERATOR_SUBTRACT:
        return difference;
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
        return side <= 0.0 || isnan(x->c[0].m) ? *x : *y;
    case KT_OPERATOR_MAX:
        return side >= 0.0 || isnan(x->c[0].m) ? *x : *y;
    default:
        return constant(widen(kt_operator_value(code, side, 0.0))); /* comparisons */
    }
}

/* A function of constants is constant, even if its derivatives are infinite. */
static series operate(kt_operator code, const series *x, const series *y) {
    const series z = kt_operator_is_binary(code) ? of_two(code, x, y) : of_one(code, x);
    return is_constant(x) && (x == y || is_constant(y)) ? constant(z.c[0]) : z;
}

/* The series of a number or a symbol, whose derivatives are given by `rates` and `second` (NULL: zero). */
static series leaf_of(const kt_expression_term *term, const double *values, const double *rates, const double *second) {
    if (term->code == KT_OPERATOR_NUMBER)
        return constant(widen(term->number));
    series x = constant(widen(values[term->symbol]));
    x.c[1] = widen(rates ? rates[term->symbol] : 0.0);
    x.c[2] = widen(second ? 0.5 * second[term->symbol] : 0.0);
    return x;
}

static bool is_leaf(const kt_expression_term *term) {
    return term->code == KT_OPERATOR_NUMBER || term->code == KT_OPERATOR_SYMBOL;
}

void kt_expression_wide(const kt_expression *expression, const double *values, const double *rates,
                        const double *second, int order, double *out) {
    static const double factorial[ORDER + 1] = {1.0, 1.0, 2.0, 6.0};
    series stack[KT_EXPRESSION_DEPTH_MAX] = {{{nothing}}};
    int top = -1;
    for (size_t i = 0; i < expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        const kt_operator code = (kt_operator)term->code;
        if (is_leaf(term)) {
            stack[++top] = leaf_of(term, values, rates, second);
            continue;
        }
        const int two = kt_operator_is_binary(code);
        top -= two;
        stack[top] = operate(code, &stack[top], &stack[top + two]);
    }
    for (int k = 0; k <= order; k++)
        out[k] = factorial[k] * double_of(stack[0].c[k]);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

#define NAME(id, name, least, most) [KT_OPERATOR_##id] = #name,
static const char *const function_name[] = {KT_EXPRESSION_FUNCTION_LIST(NAME)};
#undef NAME

/* "exp(8000)", "1/0" */
static void write_operation(kt_operator code, double first, double second, char *text, size_t size) {
    const double x = first + 0.0, y = second + 0.0; /* -0 is written as 0 */
    static const char sign[] = {[KT_OPERATOR_ADD] = '+',
                                [KT_OPERATOR_SUBTRACT] = '-',
                                [KT_OPERATOR_MULTIPLY] = '*',
                                [KT_OPERATOR_DIVIDE] = '/',
                                [KT_OPERATOR_POWER] = '^'};
    if (code < sizeof sign && sign[code] != 0)
        (void)snprintf(text, size, x < 0.0 ? "(%.4g)%c%.4g" : "%.4g%c%.4g", x, sign[code], y);
    else if (kt_operator_is_binary(code))
        (void)snprintf(text, size, "%s(%.4g, %.4g)", function_name[code], x, y);
    else
        (void)snprintf(text, size, "%s(%.4g)", function_name[code], x);
}

/* An undefined operation takes precedence over the first number that is too large, which may have no effect. */
bool kt_expression_fault(const kt_expression *expression, const double *values, char *text, size_t size) {
    series stack[KT_EXPRESSION_DEPTH_MAX] = {{{nothing}}};
    bool found = false;
    int top = -1;
    for (size_t i = 0; i < expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        const kt_operator code = (kt_operator)term->code;
        if (is_leaf(term)) {
            stack[++top] = leaf_of(term, values, NULL, NULL);
            continue;
        }
        const int two = kt_operator_is_binary(code);
        top -= two;
        const double x = double_of(stack[top].c[0]), y = double_of(stack[top + two].c[0]);
        stack[top] = operate(code, &stack[top], &stack[top + two]);
        const bool defined = isfinite(stack[top].c[0].m);
        if (defined && (found || isfinite(double_of(stack[top].c[0]))))
            continue;
        char operation[64];
        write_operation(code, x, y, operation, sizeof operation);
        (void)snprintf(text, size, "%s %s", operation, defined ? "exceeds the largest number" : "is not defined");
        found = true;
        if (!defined)
            return true;
    }
    return found;
}
