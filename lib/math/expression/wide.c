/* Formulas with numbers m 2^e of any exponent e, for cases in which doubles overflow or underflow. For example,
 * log(1 + exp(8000)) is 8000, and exp(900) / exp(899) is e. An evaluation with such numbers costs some ten times as
 * much as with doubles, and is used only if a result with doubles is not finite.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/wide.h"

#include <math.h>
#include <stdio.h>

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* m 2^e, 0.5 <= |m| < 1; or m is 0, infinite or NaN. e is a whole number. */
typedef struct number {
    double m, e;
} number;

/* m 2^e with |m| in its range. */
static number normal(double m, double e) {
    int shift = 0;
    const double part = isfinite(m) ? frexp(m, &shift) : m;
    return (number){part, part == 0.0 || !isfinite(part) ? 0.0 : e + shift};
}

static number number_of(double x) { return normal(x, 0.0); }

/* Zero or infinite if the number is outside the range of double. */
static double double_of(number x) {
    static const double beyond = 3000.0;
    return ldexp(x.m, (int)fmax(-beyond, fmin(x.e, beyond)));
}

static number times(number x, number y) { return normal(x.m * y.m, x.e + y.e); }
static number over(number x, number y) { return normal(x.m / y.m, x.e - y.e); }
static number minus(number x) { return (number){-x.m, x.e}; }

/* A number smaller by the factor 2^-beyond is below the rounding of the larger one. The limit keeps the exponent of
 * ldexp within int. */
static number plus(number x, number y) {
    static const double beyond = 200.0;
    if (x.m == 0.0 || y.m == 0.0)
        return x.m == 0.0 ? y : x;
    if (x.e < y.e)
        return plus(y, x);
    return normal(x.m + ldexp(y.m, (int)fmax(y.e - x.e, -beyond)), x.e);
}

/* e^x as e^(x - k ln 2) 2^k, with k ln 2 the nearest to x. If the rounding of x alone makes the result uncertain,
 * NaN. */
static number number_exp(number x) {
    static const double inverse = 1.44269504088896338700, high = 6.93147180559945286227e-01,
                        low = 2.31904681384629955842e-17, most = 1e12;
    const double t = double_of(x), k = nearbyint(t * inverse);
    if (!(fabs(t) < most))
        return number_of(t < 0.0 ? 0.0 : (double)NAN);
    return normal(exp(fma(-k, low, fma(-k, high, t))), k);
}

static number number_log(number x) {
    static const double ln2 = 6.93147180559945286227e-01, usual = 1000.0;
    return number_of(fabs(x.e) < usual ? log(double_of(x)) : log(x.m) + x.e * ln2);
}

/* x^p = e^(p log m) 2^(e p). */
static number number_power(number x, double p) {
    static const double most = 1e12;
    const double usual = pow(double_of(x), p), exponent = x.e * p, k = nearbyint(exponent);
    if ((isfinite(usual) && usual != 0.0) || x.m == 0.0)
        return number_of(usual);
    if (!(fabs(p) < most)) /* m^p and 2^(e p) may both be beyond the exponents */
        return number_of(usual == 0.0 ? 0.0 : (double)NAN);
    const number part = fabs(p) < 500.0 ? number_of(pow(x.m, p)) : number_exp(number_of(p * log(x.m)));
    return times(part, normal(exp2(exponent - k), k));
}

static double sign_of(number x) { return x.m; }

/* The ratio of both decides. */
static double number_atan2(number x, number y) {
    const double shift = -fmax(x.e, y.e);
    return atan2(double_of((number){x.m, x.e + shift}), double_of((number){y.m, y.e + shift}));
}

static const number nothing = {0.0, 0.0};

#include "expression/series.h"

/* ---- values ------------------------------------------------------------------------------------------------------ */

void kt_expression_wide(const kt_expression *expression, const double *values, const double *rates,
                        const double *second, int order, double *out) {
    static const double factorial[ORDER + 1] = {1.0, 1.0, 2.0, 6.0};
    const series z = series_of(expression, values, rates, second);
    for (int k = 0; k <= order; k++)
        out[k] = factorial[k] * double_of(z.c[k]);
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

/* Writes the input of a table that is outside its rows. Returns false if there is none, as in a table that is not
 * compiled. */
static bool write_outside(const kt_expression_term *term, const double input[2], char *text, size_t size) {
    const kt_lookup_piece p = kt_lookup_piece_at(kt_lookup_of(term), input[0], input[1]);
    for (int k = 0; k < p.inputs; k++) {
        const bool before = p.low[k] == -HUGE_VAL && p.high[k]<HUGE_VAL, behind = p.low[k]> - HUGE_VAL;
        if (before || (behind && p.high[k] == HUGE_VAL)) {
            (void)snprintf(text, size, "the input %.6g of a table is %s its %s row, at %.6g (see `outside` of tables)",
                           input[k], before ? "before" : "behind", before ? "first" : "last",
                           before ? p.high[k] : p.low[k]);
            return true;
        }
    }
    return false;
}

/* An undefined operation takes precedence over the first number that is too large, which may have no effect. */
bool kt_expression_fault(const kt_expression *expression, const double *values, char *text, size_t size) {
    series stack[KT_EXPRESSION_DEPTH_MAX] = {{{nothing}}};
    bool found = false;
    for (kt_postfix w = kt_postfix_begin(expression); kt_postfix_next(&w);) {
        if (w.is_leaf) {
            stack[w.at] = leaf_of(w.term, values, NULL, NULL);
            continue;
        }
        const double x = double_of(stack[w.at].c[0]), y = double_of(stack[w.other].c[0]);
        stack[w.at] = operate(w.term, &stack[w.at], &stack[w.other]);
        const bool defined = isfinite(sign_of(stack[w.at].c[0]));
        if (defined && (found || isfinite(double_of(stack[w.at].c[0]))))
            continue;
        char operation[64];
        if (kt_operator_is_lookup(w.code) && write_outside(w.term, (const double[2]){x, y}, text, size))
            return true;
        write_operation(w.code, x, y, operation, sizeof operation);
        (void)snprintf(text, size, "%s %s", operation, defined ? "exceeds the largest number" : "is not defined");
        found = true;
        if (!defined)
            return true;
    }
    return found;
}
