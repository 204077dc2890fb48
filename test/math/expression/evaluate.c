/* Values and derivatives of formulas, against the same formulas written in C, in long double, and their differences. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/margin.h"
#include "expression/third.h"
#include "expression/wide.h"
#include "kinetree/expression.h"

#include <float.h>
#include <math.h>
#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

typedef long double real;

static real step_of(real x) { return x >= 0.0L; }
static real sign_of(real x) { return (x > 0.0L) - (x < 0.0L); }
static const real pi = 3.14159265358979323846264338327950288L;

/* A formula of x and y, once for the library and once for the compiler. */
#define FORMULAS(F)                                                                                                    \
    F("1.5", 1.5L)                                                                                                     \
    F("x", x)                                                                                                          \
    F("-x^2", -(x * x))                                                                                                \
    F("2^x^2/10", powl(2.0L, x *x) / 10.0L)                                                                            \
    F("2^-x", powl(2.0L, -x))                                                                                          \
    F("x - y - 1", x - y - 1.0L)                                                                                       \
    F("x/y/2", x / y / 2.0L)                                                                                           \
    F("x - (y - 1)", x - (y - 1.0L))                                                                                   \
    F("x/(y/2)", x / (y / 2.0L))                                                                                       \
    F("2*x + 3*y*x", 2.0L * x + 3.0L * y * x)                                                                          \
    F("- - x + +y", x + y)                                                                                             \
    F("sin(2*pi*x)*cos(y)", sinl(2.0L * pi * x) * cosl(y))                                                             \
    F("tan(x) + asin(x/2) + acos(y/3) + atan(x*y)", tanl(x) + asinl(x / 2.0L) + acosl(y / 3.0L) + atanl(x * y))        \
    F("sinh(x) - cosh(y) + tanh(x*y)", sinhl(x) - coshl(y) + tanhl(x * y))                                             \
    F("exp(-x)*log(y) + sqrt(x + y)", expl(-x) * logl(y) + sqrtl(x + y))                                               \
    F("atan2(y, x) + hypot(x, y)", atan2l(y, x) + hypotl(x, y))                                                        \
    F("x^y", powl(x, y))                                                                                               \
    F("x^3 + y^-2 + x^0.5 + y^0 + x^1", x *x *x + 1.0L / (y * y) + sqrtl(x) + 1.0L + x)                                \
    F("abs(x - y) + sign(x - y) + step(y - x)", fabsl(x - y) + sign_of(x - y) + step_of(y - x))                        \
    F("step(x - x) + 2*sign(y - y)", 1.0L)                                                                             \
    F("min(x, y, 0.9) * max(x, y)", fminl(fminl(x, y), 0.9L) * fmaxl(x, y))                                            \
    F("clamp(3*x, 0.5, y)", fminl(fmaxl(3.0L * x, 0.5L), y))                                                           \
    F("(x < y) + 2*(x <= y) + 4*(x > y)", (x < y) + 2 * (x <= y) + 4 * (x > y) + 0.0L)                                 \
    F("(x >= y) + 2*(x == x) + 4*(x != x)", (x >= y) + 2.0L)                                                           \
    F("x < y and y < 1 or x > 1.2", (x < y && y < 1.0L) || x > 1.2L)                                                   \
    F("2*(x < y and not (y > 1 or x > 0.5)) + (not x < y)", 2 * (x < y && !(y > 1.0L || x > 0.5L)) + !(x < y) + 0.0L)  \
    F("not not x < 1 and 1 < 2", x < 1.0L)                                                                             \
    F("30 deg + 1 rad*x", pi / 6.0L + x)                                                                               \
    F("1e-3*x + .5e1*y + 2.E+0", 0.001L * x + 5.0L * y + 2.0L)                                                         \
    F("  ( ( x ) )  ", x)

#define WRITTEN(text, value) text,
static const char *const texts[] = {FORMULAS(WRITTEN)};
enum { COUNT = sizeof texts / sizeof *texts };

#define CASE(text, value)                                                                                              \
    if (k-- == 0)                                                                                                      \
        return value;
static real compiled(int k, real x, real y) {
    FORMULAS(CASE)
    return (real)NAN;
}

static bool find(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    *symbol = (kt_symbol){.index = name[0] == 'y'};
    return strcmp(name, "x") == 0 || strcmp(name, "y") == 0;
}
static const kt_symbols symbols = {.find = find};

static alignas(double) char memory[1 << 17];

static const kt_expression *read_formula(const char *text) {
    const kt_expression *formula = NULL;
    kt_error error = {0};
    if (kt_expression_parse(text, &symbols, memory, sizeof memory, &formula, NULL, &error) != KT_OK)
        kt_note("'%s': %s: %s", text, error.where, error.message);
    return formula;
}

static const double points[][2] = {{0.31, 0.72}, {0.72, 0.31}, {1.1, 1.3}, {1.3, 1.1}};
enum { POINTS = sizeof points / sizeof *points };

/* The functions of the C library err by a few units in the last place; a formula has at most eight operations. */
KT_TEST(values_are_those_of_the_compiled_formulas) {
    KT_WORST worst = kt_worst_make("value");
    for (int k = 0; k < COUNT; k++) {
        const kt_expression *formula = read_formula(texts[k]);
        for (int i = 0; formula != NULL && i < POINTS; i++) {
            const real expected = compiled(k, (real)points[i][0], (real)points[i][1]);
            kt_worst_near(&worst, kt_expression_evaluate(formula, points[i]), (double)expected,
                          8.0 * DBL_EPSILON * fmax(1.0, (double)fabsl(expected)), "'%s' at %d", texts[k], i);
        }
        kt_check_true(texts[k], formula != NULL);
    }
}

/* Events change the sign of the margin where the condition changes. */
KT_TEST(margins_are_positive_where_conditions_hold) {
    static const char *const conditions[] = {
        "x < y",         "x >= y and y < 1",          "x < 0.5 or y > 1.2",         "not x < y",
        "not not x > 1", "not (x < 0.5 and y > 0.5)", "not (x > 1 or not y <= 0.8)"};
    static alignas(double) char room[1 << 12];
    kt_expression *margin = (kt_expression *)(void *)room;
    for (size_t k = 0; k < sizeof conditions / sizeof *conditions; k++) {
        const kt_expression *formula = read_formula(conditions[k]);
        int wrong = 0;
        kt_need(kt_check_true("margin", formula != NULL && kt_expression_margin(formula, margin)));
        for (int i = 0; i < POINTS; i++)
            wrong += (kt_expression_evaluate(margin, points[i]) > 0.0) !=
                     (kt_expression_evaluate(formula, points[i]) == 1.0);
        kt_check_equal_int(conditions[k], wrong, 0);
    }
    kt_check_true("a number", !kt_expression_margin(read_formula("x + y"), margin));
}

/* x = a + u s + p s^2 / 2, y likewise. */
static real along(int k, const double *a, real s) {
    return compiled(k, (real)a[0] + 0.7L * s - 0.15L * s * s, (real)a[1] - 0.4L * s + 0.45L * s * s);
}

/* Differences of the eighth order in long double. With a step of 2e-3, rounding leaves an error of some `1e-18 /
 * 2e-3^2` = 3e-13 in the second derivative. The truncation error is less if there is no jump within. */
static void differences(int k, const double *a, real out[3]) {
    static const real first[] = {4.0L / 5.0L, -1.0L / 5.0L, 4.0L / 105.0L, -1.0L / 280.0L};
    static const real second[] = {8.0L / 5.0L, -1.0L / 5.0L, 8.0L / 315.0L, -1.0L / 560.0L};
    const real h = 2e-3L;
    out[0] = along(k, a, 0.0L);
    out[1] = 0.0L;
    out[2] = -205.0L / 72.0L * out[0] / (h * h);
    for (int i = 0; i < 4; i++) {
        const real plus = along(k, a, (real)(i + 1) * h), minus = along(k, a, -(real)(i + 1) * h);
        out[1] += first[i] * (plus - minus) / h;
        out[2] += second[i] * (plus + minus) / (h * h);
    }
}

KT_TEST(derivatives_along_a_curve_are_those_of_differences) {
    static const double rates[] = {0.7, -0.4}, second[] = {-0.3, 0.9};
    KT_WORST value = kt_worst_make("value"), one = kt_worst_make("first"), two = kt_worst_make("second");
    for (int k = 0; k < COUNT; k++) {
        const kt_expression *formula = read_formula(texts[k]);
        for (int i = 0; formula != NULL && i < POINTS; i++) {
            double out[3];
            real expected[3];
            differences(k, points[i], expected);
            kt_expression_taylor(formula, points[i], rates, second, out);
            const double scale = fmax(1.0, (double)fabsl(expected[2]));
            kt_worst_near(&value, out[0], kt_expression_evaluate(formula, points[i]), 0.0, "'%s' at %d", texts[k], i);
            kt_worst_near(&one, out[1], (double)expected[1], 2e-13 * scale, "'%s' at %d", texts[k], i);
            kt_worst_near(&two, out[2], (double)expected[2], 4e-12 * scale, "'%s' at %d", texts[k], i);
        }
    }
}

/* Along a line, against differences of the eighth order of the second derivative. */
KT_TEST(third_derivatives_are_differences_of_the_second) {
    static const double first[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0}, rates[] = {0.7, -0.4};
    const double h = 2e-3;
    KT_WORST worst = kt_worst_make("third");
    for (int k = 0; k < COUNT; k++) {
        const kt_expression *formula = read_formula(texts[k]);
        for (int i = 0; formula != NULL && i < POINTS; i++) {
            double expected = 0.0, scale = 1.0;
            for (int n = -4; n <= 4; n++) {
                const double at[] = {points[i][0] + n * h * rates[0], points[i][1] + n * h * rates[1]};
                double out[3];
                kt_expression_taylor(formula, at, rates, NULL, out);
                expected += n == 0 ? 0.0 : (n > 0 ? 1.0 : -1.0) * first[abs(n) - 1] * out[2] / h;
                scale = fmax(scale, fmax(fabs(out[0]), fabs(out[2])));
            }
            scale = fmax(scale, fabs(expected));
            kt_worst_near(&worst, kt_expression_third(formula, points[i], rates), expected, 4e-12 * scale, "'%s' at %d",
                          texts[k], i);
        }
    }
}

/* Constants pass no derivative on, however steep the function is there. */
KT_TEST(steep_functions_of_constants_have_no_derivative) {
    static const char *const steep[] = {"sqrt(0) + x", "0^0.5 + x",    "x*x^0 + 0^x*0",
                                        "acos(1) + x", "log(0)*0 + x", "hypot(0, 0) + x"};
    for (size_t k = 0; k < sizeof steep / sizeof *steep; k++) {
        const double at[] = {2.0, 0.0}, rates[] = {1.0, 0.0};
        double out[3] = {0.0, 0.0, 0.0};
        const kt_expression *formula = read_formula(steep[k]);
        if (formula != NULL)
            kt_expression_taylor(formula, at, rates, NULL, out);
        kt_check_near(steep[k], out[1], 1.0, DBL_EPSILON);
        kt_check_near(steep[k], out[2], 0.0, DBL_EPSILON);
    }
}

/* ---- beyond the largest number ----------------------------------------------------------------------------------- */

/* Formulas of bounded values in which numbers overflow for large |y|; in long double they do not. */
#define STEEP_FORMULAS(F)                                                                                              \
    F("1/cosh(y)", 1.0L / coshl(y))                                                                                    \
    F("1/(1 + exp(-y))", 1.0L / (1.0L + expl(-y)))                                                                     \
    F("x + 1/(1 + exp(y))", x + 1.0L / (1.0L + expl(y)))                                                               \
    F("x/sinh(y)", x / sinhl(y))                                                                                       \
    F("sin(x)/(1 - exp(y))", sinl(x) / (1.0L - expl(y)))                                                               \
    F("1/sqrt(1 + exp(y)) + x^2", 1.0L / sqrtl(1.0L + expl(y)) + x * x)                                                \
    F("x/cosh(y)^2", x / (coshl(y) * coshl(y)))                                                                        \
    F("max(x, 0) - 1/(2 + cosh(y))^0.3", x - 1.0L / powl(2.0L + coshl(y), 0.3L))                                       \
    F("exp(-exp(abs(y)))", 0.0L * y)                                                                                   \
    F("tanh(cosh(y)*x)", 1.0L + 0.0L * y)                                                                              \
    F("2/pi*atan(cosh(y)) + x", x + 1.0L)                                                                              \
    F("x/hypot(1, exp(y)) + x", x / hypotl(1.0L, expl(y)) + x)                                                         \
    F("x/(exp(y) + exp(-2*y) + 3)", x / (expl(y) + expl(-2.0L * y) + 3.0L))

static const char *const steep_texts[] = {STEEP_FORMULAS(WRITTEN)};
enum { STEEP_COUNT = sizeof steep_texts / sizeof *steep_texts };

static real steep_compiled(int k, real x, real y) {
    STEEP_FORMULAS(CASE)
    return (real)NAN;
}

/* Formulas of finite values whose derivatives overflow within, for y from 690 to 709. */
#define NEAR_FORMULAS(F)                                                                                               \
    F("log(1 + exp(y))", logl(1.0L + expl(y)))                                                                         \
    F("log(cosh(y)) + x", logl(coshl(y)) + x)                                                                          \
    F("exp(y - x)/exp(y)", expl(y - x) / expl(y))                                                                      \
    F("x*exp(y)/(1 + exp(y))", x *expl(y) / (1.0L + expl(y)))                                                          \
    F("sinh(y)/cosh(y)*x", sinhl(y) / coshl(y) * x)

static const char *const near_texts[] = {NEAR_FORMULAS(WRITTEN)};
enum { NEAR_COUNT = sizeof near_texts / sizeof *near_texts };

static real near_compiled(int k, real x, real y) {
    NEAR_FORMULAS(CASE)
    return (real)NAN;
}

typedef real compiled_formula(int k, real x, real y);

/* Differences of the fourth order in long double along x' = u, y' = w, in which y changes by 2e-2 a step. */
static void steep_differences(compiled_formula *f, int k, const double *at, const double *rates, double out[2]) {
    const real h = 2e-2L / (real)fabs(rates[1]);
    real g[5];
    for (int n = 0; n < 5; n++)
        g[n] = f(k, (real)at[0] + (n - 2) * h * (real)rates[0], (real)at[1] + (n - 2) * h * (real)rates[1]);
    out[0] = (double)((8.0L * (g[3] - g[1]) - (g[4] - g[0])) / (12.0L * h));
    out[1] = (double)((16.0L * (g[3] + g[1]) - (g[4] + g[0]) - 30.0L * g[2]) / (12.0L * h * h));
}

static void compare_steep(const char *text, compiled_formula *f, int k, kt_random *random, const double range[2],
                          double noise, kt_worst *one, kt_worst *two) {
    enum { TRIED = 100 };
    const kt_expression *formula = read_formula(text);
    kt_check_true(text, formula != NULL);
    for (int i = 0; formula != NULL && i < TRIED; i++) {
        const double sign = range[0] > 700.0 && kt_random_int(random, 0, 1) ? -1.0 : 1.0;
        const double at[] = {kt_random_uniform(random, 0.3, 1.3), sign * kt_random_uniform(random, range[0], range[1])};
        const double rates[] = {0.7, kt_random_uniform(random, 100.0, 1000.0)};
        const double w = fabs(rates[1]);
        double expected[2], out[3];
        steep_differences(f, k, at, rates, expected);
        kt_expression_taylor(formula, at, rates, NULL, out);
        kt_worst_near(one, out[1], expected[0], noise * w, "'%s' at %.17g", text, at[1]);
        kt_worst_near(two, out[2], expected[1], noise * w * w, "'%s' at %.17g", text, at[1]);
    }
}

/* Long double holds exp(11000). For y' = w the differences err by some 1e-14 of w and of w^2. */
KT_TEST(derivatives_are_numbers_where_numbers_within_overflow) {
    static const double far[] = {720.0, 9000.0}, close[] = {690.0, 709.0};
    kt_random random = kt_random_of_test();
    KT_WORST one = kt_worst_make("first"), two = kt_worst_make("second");
    for (int k = 0; k < STEEP_COUNT; k++)
        compare_steep(steep_texts[k], steep_compiled, k, &random, far, 1e-13, &one, &two);
    for (int k = 0; k < NEAR_COUNT; k++)
        compare_steep(near_texts[k], near_compiled, k, &random, close, 1e-13, &one, &two);
}

/* Formulas of finite values in which numbers overflow or underflow, for y from 700 to 9000. */
#define WIDE_FORMULAS(F)                                                                                               \
    F("log(1 + exp(y))", logl(1.0L + expl(y)))                                                                         \
    F("log(exp(-y)) + x", logl(expl(-y)) + x)                                                                          \
    F("exp(y - x)/exp(y)", expl(y - x) / expl(y))                                                                      \
    F("(exp(y) - exp(-y))/(exp(y) + exp(-y))*x", (expl(y) - expl(-y)) / (expl(y) + expl(-y)) * x)                      \
    F("x*exp(-y)/(exp(-y) + exp(-y - x))", x *expl(-y) / (expl(-y) + expl(-y - x)))                                    \
    F("sqrt(cosh(y))*exp(-0.5*y)", sqrtl(coshl(y)) * expl(-0.5L * y))                                                  \
    F("log(hypot(exp(y), exp(y - x)))", logl(hypotl(expl(y), expl(y - x))))                                            \
    F("(2^(2*y)/4^y)*sin(x)", sinl(x))                                                                                 \
    F("log(max(exp(y), 2*exp(y - 1)) - exp(y - 3))", y + logl(1.0L - expl(-3.0L)))                                     \
    F("log(abs(1 - exp(y)))*step(exp(y) - exp(0.5*y))", logl(expl(y) - 1.0L))

static const char *const wide_texts[] = {WIDE_FORMULAS(WRITTEN)};
enum { WIDE_COUNT = sizeof wide_texts / sizeof *wide_texts };

static real wide_compiled(int k, real x, real y) {
    WIDE_FORMULAS(CASE)
    return (real)NAN;
}

/* The third derivative by differences of the second along x' = u, y' = w. */
static double third_difference(const kt_expression *formula, const double *at, const double *rates) {
    const double h = 1e-2 / fabs(rates[1]);
    double g[5];
    for (int n = 0; n < 5; n++) {
        const double here[2] = {at[0] + (n - 2) * h * rates[0], at[1] + (n - 2) * h * rates[1]};
        double out[3];
        kt_expression_taylor(formula, here, rates, NULL, out);
        g[n] = out[2];
    }
    return (8.0 * (g[3] - g[1]) - (g[4] - g[0])) / (12.0 * h);
}

/* An exponential of y has a relative error of y units of rounding: 5e-16 in long double. Differences with steps of 2e-2
 * have errors of some 5e-12. */
KT_TEST(values_are_numbers_where_numbers_within_overflow) {
    static const double range[] = {700.0, 9000.0};
    kt_random random = kt_random_of_test();
    KT_WORST value = kt_worst_make("value"), one = kt_worst_make("first"), two = kt_worst_make("second"),
             three = kt_worst_make("third");
    for (int k = 0; k < WIDE_COUNT; k++) {
        compare_steep(wide_texts[k], wide_compiled, k, &random, range, 1e-11, &one, &two);
        const kt_expression *formula = read_formula(wide_texts[k]);
        for (int i = 0; formula != NULL && i < 100; i++) {
            const double x = kt_random_uniform(&random, 0.3, 1.3), y = kt_random_uniform(&random, range[0], range[1]);
            const double at[] = {x, y}, rates[] = {0.7, kt_random_uniform(&random, 1.0, 10.0)};
            const double expected = (double)wide_compiled(k, (real)x, (real)y), w = fabs(rates[1]);
            kt_worst_near(&value, kt_expression_evaluate(formula, at), expected, 4.0 * DBL_EPSILON * y, "'%s' at %.17g",
                          wide_texts[k], y);
            kt_worst_near(&three, kt_expression_third(formula, at, rates), third_difference(formula, at, rates),
                          1e-9 * w * w * w + 1e-7, "'%s' at %.17g", wide_texts[k], y);
        }
    }
}

/* The message names the first operation without a result, with its arguments. If there is none, it names the operation
 * whose result exceeds the largest number. */
KT_TEST(operation_that_makes_a_value_infinite_is_named) {
    static const struct {
        const char *text, *fault;
    } rows[] = {
        {"2*exp(1000*(x + 7)) - y", "exp(8000) exceeds the largest number"},
        {"log(1 + exp(8000*x)) + y/(x - x)", "8000/0 is not defined"},
        {"y*sqrt(x - 3)", "sqrt(-2) is not defined"},
        {"(x - 3)^0.5", "(-2)^0.5 is not defined"},
        {"max(y, 1)*1e307", "8000*1e+307 exceeds the largest number"},
        {"x + y", ""},
    };
    static const double at[] = {1.0, 8000.0};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char fault[100] = "";
        const kt_expression *formula = read_formula(rows[k].text);
        const bool found = formula != NULL && kt_expression_fault(formula, at, fault, sizeof fault);
        kt_check_text(rows[k].text, fault, rows[k].fault);
        kt_check_true("found", found == (rows[k].fault[0] != '\0'));
    }
}

/* The result of such a power is infinite or zero, as is that of pow. */
KT_TEST(powers_with_exponents_beyond_all_numbers_are_not_mended) {
    static const char *const powers[] = {"2^(1e21*x)",     "0.5^(1e21*x)",   "0.5^(-1e21*x)",
                                         "2^(-1e21*x)",    "y^(1e13*x)",     "2^9^(22*x)",
                                         "1/(2^(1e21*x))", "3*2^(1e21*x)/y", "2 - 2^(1e18*x)"};
    static const double expected[] = {HUGE_VAL, 0.0, HUGE_VAL, 0.0, HUGE_VAL, HUGE_VAL, 0.0, HUGE_VAL, -HUGE_VAL};
    static const double at[] = {1.0, 8000.0};
    for (size_t k = 0; k < sizeof powers / sizeof *powers; k++) {
        const kt_expression *formula = read_formula(powers[k]);
        const double value = formula != NULL ? kt_expression_evaluate(formula, at) : (double)NAN;
        kt_note("%s is %g, expected %g", powers[k], value, expected[k]);
        kt_check_true(powers[k], value == expected[k]);
    }
}

/* An infinite derivative remains infinite, and the value keeps its bits. */
KT_TEST(infinite_derivatives_are_not_mended) {
    static const char *const endless[] = {"sqrt(x)", "x^0.5 + 1/cosh(y)", "asin(1 + x) + y"};
    static const double at[] = {0.0, 8000.0}, rates[] = {1.0, 1000.0};
    for (size_t k = 0; k < sizeof endless / sizeof *endless; k++) {
        double out[3] = {0.0, 0.0, 0.0};
        const kt_expression *formula = read_formula(endless[k]);
        if (formula != NULL)
            kt_expression_taylor(formula, at, rates, NULL, out);
        kt_check_true(endless[k], !isfinite(out[1]));
        kt_check_near(endless[k], out[0], formula != NULL ? kt_expression_evaluate(formula, at) : 1.0, 0.0);
    }
}

/* ---- random formulas --------------------------------------------------------------------------------------------- */

typedef struct written {
    char text[4000];
    size_t length;
} written;

static void write(written *w, const char *part) {
    const size_t length = strlen(part);
    if (w->length + length < sizeof w->text) {
        memcpy(w->text + w->length, part, length + 1);
        w->length += length;
    }
}

/* Strength of the operator that a formula has at its top. */
enum { SUM = 1, PRODUCT, SIGN, POWER, PRIMARY };

static double invent(kt_random *random, int depth, int strength, const double *at, written *w);

/* One operator of two values, with parentheses where its place requires them, or now and then. */
static double invent_pair(kt_random *random, int depth, int strength, const double *at, written *w) {
    static const char signs[] = "+-*/^";
    const int which = kt_random_int(random, 0, 4);
    const int own = which < 2 ? SUM : which < 4 ? PRODUCT : POWER;
    const bool encloses = own < strength || kt_random_int(random, 0, 4) == 0;
    const char text[] = {kt_random_int(random, 0, 1) ? ' ' : signs[which], signs[which], '\0'};
    if (encloses)
        write(w, "(");
    const double a = invent(random, depth - 1, own == POWER ? PRIMARY : own, at, w);
    write(w, text[0] == ' ' ? text : text + 1);
    const double b = own == POWER ? (write(w, "2"), 2.0) : invent(random, depth - 1, own + 1, at, w);
    if (encloses)
        write(w, ")");
    return which == 0 ? a + b : which == 1 ? a - b : which == 2 ? a * b : which == 3 ? a / b : pow(a, b);
}

static double invent(kt_random *random, int depth, int strength, const double *at, written *w) {
    char text[40];
    const int which = depth > 0 ? kt_random_int(random, 0, 9) : 9;
    if (which < 6)
        return invent_pair(random, depth, strength, at, w);
    if (which == 6) {
        write(w, strength > SIGN ? "(-" : "-");
        const double value = -invent(random, depth - 1, SIGN, at, w);
        write(w, strength > SIGN ? ")" : "");
        return value;
    }
    if (which < 9) {
        write(w, which == 7 ? "sin(" : "tanh(");
        const double value = invent(random, depth - 1, SUM, at, w);
        write(w, ")");
        return which == 7 ? sin(value) : tanh(value);
    }
    const int leaf = kt_random_int(random, 0, 2);
    const double number = kt_random_uniform(random, 0.1, 3.0);
    (void)snprintf(text, sizeof text, "%.17g", number);
    write(w, leaf == 0 ? "x" : leaf == 1 ? "y" : text);
    return leaf < 2 ? at[leaf] : number;
}

/* The same operations in the same order have the same bits. */
KT_TEST(random_formulas_have_the_bits_of_their_operations) {
    enum { FORMULAS_TRIED = 5000 };
    kt_random random = kt_random_of_test();
    long different = 0, unread = 0, operators = 0;
    for (int k = 0; k < FORMULAS_TRIED; k++) {
        const double at[] = {kt_random_uniform(&random, -2.0, 2.0), kt_random_uniform(&random, -2.0, 2.0)};
        written w = {.length = 0};
        const double expected = invent(&random, 6, SUM, at, &w);
        const kt_expression *formula = w.length < sizeof w.text - 40 ? read_formula(w.text) : NULL;
        const double observed = formula != NULL ? kt_expression_evaluate(formula, at) : 0.0;
        unread += formula == NULL;
        operators += (long)w.length;
        const bool same = memcmp(&observed, &expected, sizeof observed) == 0 || (isnan(observed) && isnan(expected));
        if (formula != NULL && !same && different++ == 0)
            kt_note("%.17g, not %.17g: %s", observed, expected, w.text);
    }
    kt_check_equal_int("formulas that are not read", unread, 0);
    kt_check_equal_int("formulas with other bits", different, 0);
    kt_check_above("characters a formula", (double)operators / FORMULAS_TRIED, 50.0);
}
