/* Breakpoints and features of formulas of time, compared with dense samples of the formula and with exact times. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "steep.h"

#include "expression/formula_breakpoint.h"
#include "expression/part.h"
#include "model/function_formula.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

enum { MEMORY = 8192 };

static const kt_expression *formula(const char *text, double memory[MEMORY]) {
    const kt_expression *expression = NULL;
    kt_error error = {0};
    if (kt_formula_of_time(text, memory, MEMORY * sizeof *memory, &expression, NULL, &error) != KT_OK)
        kt_check_text(text, error.message, "");
    return expression;
}

/* The next breakpoint of a search that may take all operations of a run. */
static double next_breakpoint(const kt_expression *f, double t, double until, int *order) {
    int64_t left = KT_BREAKPOINT_OPERATIONS;
    return kt_expression_next_breakpoint(f, t, until, &left, order);
}

/* ---- bounds ------------------------------------------------------------------------------------------------------ */

/* Every function and operator, over intervals in which it is defined. */
KT_TEST(bounds_hold_values_and_derivatives) {
    static const struct {
        const char *text;
        double from, to;
    } rows[] = {
        {"3 - 2*t + t^3 - t/4", -2.0, 2.0},
        {"1/(1.5 + t)", -1.0, 3.0},
        {"sin(7*t)*cos(t)", -9.0, 9.0},
        {"tan(t/4)", -3.0, 3.0},
        {"asin(t/4) + acos(t/5)", -3.0, 3.0},
        {"atan(3*t)", -3.0, 3.0},
        {"atan2(t, 2)", -3.0, 3.0},
        {"atan2(1 + t^2, t)", -3.0, 3.0},
        {"atan2(-1 - t^2, t)", -3.0, 3.0},
        {"atan2(t, -4)", 0.5, 3.0},
        {"sinh(t) - cosh(2*t)", -2.0, 2.0},
        {"tanh(5*t)", -4.0, 4.0},
        {"exp(-t^2)", -4.0, 4.0},
        {"log(3 + t)", -2.0, 4.0},
        {"sqrt(5 + t)", -4.0, 4.0},
        {"(4 + t)^2.5", -3.0, 3.0},
        {"2^t", -3.0, 3.0},
        {"(5 + t)^-3", -3.0, 3.0},
        {"-t^299", -0.9, 0.9},
        {"hypot(t, 0.5)", -2.0, 2.0},
        {"abs(t - 1)", -3.0, 3.0},
        {"max(t, 1 - t, 0.2)", -3.0, 3.0},
        {"min(t, t^2)", -3.0, 3.0},
        {"clamp(t, -1, 1)^2", -3.0, 3.0},
        {"sign(t)*t + step(t - 1)", -3., 3.},
        {"(t < 1) + 2*(t >= 0.5)*t", -3.0, 3.0},
        {"(t > 1) - (t <= 0.5) + (t == 2)*(t != 3)", -3.0, 3.0},
    };
    kt_random random = kt_random_named("bounds of formulas");
    double memory[MEMORY];
    int outside = 0, wide = 0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const kt_expression *f = formula(rows[i].text, memory);
        for (int k = 0; f != NULL && k < 2000; k++) {
            const double a = kt_random_uniform(&random, rows[i].from, rows[i].to);
            const double b = fmin(rows[i].to, a + pow(10.0, kt_random_uniform(&random, -6.0, 0.5)));
            const double t = kt_random_uniform(&random, a, b), rate = 1.0;
            const kt_jet jet = kt_expression_bound(f, a, b, NULL, NULL);
            double y[3];
            kt_expression_taylor(f, &t, &rate, NULL, y);
            for (int n = 0; n < 3; n++) {
                const double c = n == 2 ? 0.5 * y[2] : y[n], room = 1e-12 * (1.0 + fabs(c));
                outside += !(jet.c[n].lo - room <= c && c <= jet.c[n].hi + room);
                wide += !(jet.c[n].hi - jet.c[n].lo < 1e9);
            }
        }
    }
    kt_check_equal_int("outside", outside, 0);
    kt_check_below("without a finite bound, of 156,000", wide, 100);
}

/* A formula that may be NaN is marked. The result of a part that may be NaN is marked, too: `NaN < 1` is 0, and `NaN !=
 * 1` is 1. */
KT_TEST(bounds_hold_where_there_is_no_value) {
    static const struct {
        const char *text;
        double from, to;
        kt_definedness defined; /* from `from` to `to` */
    } rows[] = {
        {"sqrt(t)", -2.0, 2.0, KT_DEFINED_IN_PART},
        {"sqrt(t)*2 - 1", -2.0, -1.0, KT_DEFINED_NOWHERE},
        {"log(t - 1)", 1.5, 2.0, KT_DEFINED},
        {"asin(t) + acos(2*t)", 0.0, 1.0, KT_DEFINED_IN_PART},
        {"acos(t)", 1.5, 2.0, KT_DEFINED_NOWHERE},
        {"t^t", -2.0, 2.0, KT_DEFINED_IN_PART},
        {"t^3 + t^-2", -2.0, 2.0, KT_DEFINED},
        {"sqrt(t)^0 + 1^log(t)", -2.0, -1.0, KT_DEFINED_IN_PART},
        {"t/t", -1.0, 1.0, KT_DEFINED_IN_PART},
        {"1/t", -1.0, 1.0, KT_DEFINED},
        {"exp(1000*t)/exp(999*t)", -1.0, 2.0, KT_DEFINED_IN_PART},
        {"exp(1000*t) - exp(999*t)", -1.0, 2.0, KT_DEFINED_IN_PART},
        {"exp(1000*t)*exp(-1000*t)", 0.0, 2.0, KT_DEFINED_IN_PART},
        {"sin(exp(1000*t))", 0.0, 2.0, KT_DEFINED_IN_PART},
        {"hypot(sqrt(t), exp(1000))", -2.0, -1.0, KT_DEFINED_IN_PART},
        {"max(sqrt(t), 3) + min(2, log(t)) + abs(sqrt(t))", -2.0, 2.0, KT_DEFINED_IN_PART},
        {"(sqrt(t) < 3) + 2*(sqrt(t) <= 3)", -2.0, 2.0, KT_DEFINED},
        {"(sqrt(t) > -1) + 2*(sqrt(t) >= -1)", -2.0, 2.0, KT_DEFINED},
        {"(sqrt(t) == -1) + 2*(sqrt(t) != -1)", -2.0, 2.0, KT_DEFINED},
        {"step(1 + sqrt(t)) + 2*sign(1 + sqrt(t))", -2.0, 2.0, KT_DEFINED},
        {"(sqrt(t) < 3) + 2*(sqrt(t) != 3) + 4*step(sqrt(t)) + 8*sign(sqrt(t))", -2.0, -1.0, KT_DEFINED},
        {"(1 > (2 > t/t))*t", -1.0, 1.0, KT_DEFINED},
        {"2^t^3/8^8^t^t/1^t^t^0/1^t^0 < 1", 9.0, 11.0, KT_DEFINED},
    };
    kt_random random = kt_random_named("formulas without a value");
    double memory[MEMORY];
    int outside = 0, unlike = 0, wrong = 0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const kt_expression *f = formula(rows[i].text, memory);
        wrong += f == NULL || kt_expression_bound(f, rows[i].from, rows[i].to, NULL, NULL).defined != rows[i].defined;
        for (int k = 0; f != NULL && k < 2000; k++) {
            const double a = kt_random_uniform(&random, rows[i].from, rows[i].to);
            const double b = k % 4 == 0 ? a : kt_random_uniform(&random, a, rows[i].to);
            const double t = k % 8 == 0 ? a : kt_random_uniform(&random, a, b), y = kt_expression_evaluate(f, &t);
            const kt_jet jet = kt_expression_bound(f, a, b, NULL, NULL);
            unlike += jet.defined == (isnan(y) ? KT_DEFINED : KT_DEFINED_NOWHERE);
            outside += !isnan(y) && !(jet.c[0].lo <= y && y <= jet.c[0].hi);
        }
    }
    kt_check_equal_int("whole intervals that are judged otherwise", wrong, 0);
    kt_check_equal_int("defined or not", unlike, 0);
    kt_check_equal_int("outside", outside, 0);
}

/* ---- breakpoints ------------------------------------------------------------------------------------------------- */

KT_TEST(breakpoints_are_where_branches_change) {
    static const struct {
        const char *text;
        int count, order;
        double time[4];
    } rows[] = {
        {"abs(t - 1)", 1, 1, {1.0}},
        {"max(0, sin(3*t))",
         4,
         1,
         {0.0, 3.14159265358979323846 / 3.0, 2.0 * 3.14159265358979323846 / 3.0, 3.14159265358979323846}},
        {"step(t - 2)*(t < 2.001)", 2, 0, {2.0, 2.001}},
        {"clamp(t, 1, 4)", 2, 1, {1.0, 4.0}},
        {"sign(t - 1e6)", 1, 0, {1e6}},
        {"min(t, 1e-6)", 1, 1, {1e-6}},
        {"abs(t^2 + 1)", 0, 0, {0.0}},
        {"abs(2 + sin(t))", 0, 0, {0.0}},
        {"sqrt(t - 1) < 3", 2, 0, {1.0, 10.0}},
        {"5*(log(2 - t) != 9)*(t < 3)", 2, 0, {2.0, 3.0}},
    };
    double memory[MEMORY];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const kt_expression *f = formula(rows[i].text, memory);
        double t = -0.1;
        int found = 0, steps = 0;
        kt_check_true(rows[i].text, f != NULL);
        while (f != NULL && found < rows[i].count && steps++ < 200) {
            int order;
            t = next_breakpoint(f, t, HUGE_VAL, &order);
            if (order > 3)
                continue;
            kt_check_equal_int("order", order, rows[i].order);
            kt_check_near("time, s", t, rows[i].time[found], 1e-15 * (1.0 + fabs(t)));
            found++;
        }
        kt_check_equal_int("found", found, rows[i].count);
        for (steps = 0; f != NULL && rows[i].count < 4 && t < 1e11 && steps < 100; steps++) {
            int order;
            t = next_breakpoint(f, t, HUGE_VAL, &order);
            kt_check_true("no more", order > 3);
        }
    }
}

/* The first searched interval ends at `1/1024` s, the next at `3/1024` s. This branch changes after the last
 * interval. */
KT_TEST(breakpoints_are_found_at_ends_of_intervals) {
    double memory[MEMORY];
    int order = 4;
    for (int k = 1; k < 4096; k = 2 * k + 1) {
        char text[40];
        (void)snprintf(text, sizeof text, "t <= %.10f", k / 1024.0);
        const kt_expression *f = formula(text, memory);
        kt_check_near(text, f != NULL ? next_breakpoint(f, 0.0, HUGE_VAL, &order) : -1.0, k / 1024.0,
                      4.0 * DBL_EPSILON * k / 1024.0);
        kt_check_equal_int("order", order, 0);
    }
}

/* Between two of the times the formula and its first two derivatives are monotone: sampled. */
KT_TEST(formulas_are_monotone_between_features) {
    static const char *const texts[] = {"exp(-((t - 5)/0.01)^2)", "sin(40*t)*exp(-t)", "t^3 - 6*t^2 + t",
                                        "tanh((t - 3)/0.02)",     "1/(1 + (t - 2)^2)", "sin(t^2)",
                                        "sqrt(1.1 + cos(t))",     "log(1.01 + sin(t))"};
    double memory[MEMORY];
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        const kt_expression *f = formula(texts[i], memory);
        double t = 0.0;
        int turns = 0, pieces = 0;
        while (f != NULL && t < 8.0 && pieces < 2000) {
            enum { SAMPLES = 60 };
            int order, signs[2] = {0, 0};
            const double from = t;
            t = fmin(next_breakpoint(f, t, HUGE_VAL, &order), 8.0);
            pieces++;
            for (int k = 1; k < SAMPLES; k++) {
                const double at = from + (t - from) * (0.001 + 0.998 * k / SAMPLES), rate = 1.0;
                double y[3];
                kt_expression_taylor(f, &at, &rate, NULL, y);
                for (int n = 0; n < 2; n++) {
                    const int sign = y[n + 1] > 0.0 ? 1 : y[n + 1] < 0.0 ? -1 : signs[n];
                    turns += signs[n] != 0 && sign != signs[n] && fabs(y[n + 1]) > 1e-150;
                    signs[n] = sign;
                }
            }
        }
        kt_check_equal_int(texts[i], turns, 0);
        kt_check_above("pieces", pieces, 2);
        kt_check_below("pieces", pieces, 1000);
    }
}

/* A pulse, u = (t - c)/w: its formula, and the u >= 0 at which f', f'' or f''' change their sign. The negative u are
 * their mirror images. */
typedef struct pulse {
    const char *before, *behind; /* HEIGHT before u behind */
    double u[3];
    int count;
} pulse;

/* Pulses of all widths far from the time 0, whose third derivative is hidden by the rounding of t in short
 * intervals. */
KT_TEST(features_of_random_pulses_are_found) {
    static const pulse pulses[] = {
        {"*exp(-", "^2)", {0.0, 0.70710678118654752, 1.2247448713915890}, 3},
        {"/(1 + ", "^2)^8", {0.0, 0.24253562503633297, 0.42008402520840293}, 3}, /* 1, 3 over 17 */
        {"/(1 + ", "^2)^2", {0.0, 0.44721359549995794, 0.77459666924148338}, 3},
        {"*tanh(", ")", {0.0, 0.6584789484624083, 0.0}, 2},
        {"/(1 + exp(-", "))", {0.0, 1.3169578969248166, 0.0}, 2},
    };
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("a feature, in widths");
    double memory[MEMORY];
    for (int round = 0; round < 200; round++) {
        const pulse *p = &pulses[round % (int)(sizeof pulses / sizeof *pulses)];
        const double height = exp(kt_random_uniform(&random, -9.0, 9.0)), c = kt_random_uniform(&random, 1.0, 100.0);
        const double w = exp(kt_random_uniform(&random, -10.0, 0.0));
        char text[256];
        double found[64] = {0.0};
        int order, count = 0;
        (void)snprintf(text, sizeof text, "%.17g%s((t - %.17g)/%.17g)%s", height, p->before, c, w, p->behind);
        const kt_expression *f = formula(text, memory);
        for (double t = c - 50.0 * w; f != NULL && t < c + 50.0 * w && count < 64; count++)
            found[count] = t = next_breakpoint(f, t, HUGE_VAL, &order);
        for (int k = 0; k < 2 * p->count; k++) {
            const double u = k % 2 ? -p->u[k / 2] : p->u[k / 2];
            double nearest = HUGE_VAL;
            for (int i = 0; i < count; i++)
                nearest = fmin(nearest, fabs((found[i] - c) / w - u));
            kt_worst_near(&worst, nearest, 0.0, 1e-6 + 64.0 * DBL_EPSILON * c / w, "%s, u = %g", text, u);
        }
    }
}

/* The first functions are constant but for rounding, though their arguments are beyond the largest number. The others
 * are mostly undefined, and each search of them is cut. */
KT_TEST(searches_have_an_end) {
    static const struct {
        const char *text;
        bool cut;
    } rows[] = {
        {"tanh(exp(1000*(t - 7)))", false},    {"atan(exp(1000*(t - 7)))", false},
        {"tanh(50*sinh(300*(t - 5)))", false}, {"tanh(exp(400*(t - 5)) - exp(-400*(t - 5)))", false},
        {"log(cosh(1000*(t - 8)))", true},     {"cosh(500*(t - 5))/(1 + cosh(600*(t - 5)))", true},
    };
    double memory[MEMORY];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const kt_expression *f = formula(rows[i].text, memory);
        int order, count = 0, cut = 0;
        for (double t = rows[i].cut ? 6.0 : 0.0; f != NULL && t < 10.0 && count < 100; count++) {
            t = next_breakpoint(f, t, 10.0, &order);
            cut += t < 10.0 && order == KT_BREAKPOINT_CUT;
        }
        kt_check_below(rows[i].text, count, rows[i].cut ? 20.0 : 8.0);
        kt_check_true("cut", rows[i].cut == (cut > 0));
    }
}

/* The operations of all searches of a run are limited, and so are the searches that are cut: 16 for each factor e of
 * the time after the first 16/1024 s, and 16 before. Every change has at most 60 bisections more. */
KT_TEST(searches_of_random_formulas_share_a_limit) {
    enum { FORMULAS = 60, LIMIT = KT_BREAKPOINT_OPERATIONS / 50, MOST_CUT = 16 + 16 * 7 };
    kt_random random = kt_random_of_test();
    KT_WORST taken = kt_worst_make("operations over the limit"), most = kt_worst_make("cut");
    int formulas_cut = 0;
    double memory[MEMORY];
    for (int i = 0; i < FORMULAS; i++) {
        static const char *const known[] = {"sin(t)^2 + cos(t)^2", "sin(1/(t - 5))",
                                            "tanh(20*sin(200*t)) + exp(-(5*sin(190*t))^2)"};
        char text[1024];
        kt_write_steep_formula(&random, text, sizeof text);
        const kt_expression *f = formula(i < 3 ? known[i] : text, memory);
        int64_t left = LIMIT;
        int order, cut = 0;
        for (double t = 0.0; f != NULL && t < 10.0 && left > -LIMIT;) {
            t = kt_expression_next_breakpoint(f, t, 10.0, &left, &order);
            cut += t < 10.0 && order == KT_BREAKPOINT_CUT;
        }
        formulas_cut += cut > 0;
        const double more = f != NULL ? 60.0 * (double)f->count : 0.0;
        kt_worst_below(&taken, (double)(LIMIT - left), LIMIT + more, "%s", i < 3 ? known[i] : text);
        kt_worst_below(&most, cut, MOST_CUT, "%s", i < 3 ? known[i] : text);
    }
    kt_check_above("formulas that are cut", formulas_cut, 15.0);
    kt_check_below("formulas that are cut", formulas_cut, FORMULAS);
}

/* If exp overflows or underflows, and if the root of 0 stays 0, the search finds the first feature. It does not find
 * the end of the searched interval. The zero of f''' of `1 / (1 + e^-u)` is `u = -log(2 + sqrt(3))`. For tanh u it is
 * half of this. For `log(1 + e^u)` it is 0, and for `exp(-u^2)` it is `-sqrt(3/2)`. */
KT_TEST(features_are_found_behind_numbers_that_are_too_large) {
    static const struct {
        const char *text;
        double first;
    } rows[] = {
        {"1000/(1 + exp(-(t - 8)/0.002))", 8.0 - 0.002 * 1.3169578969248166},
        {"1/(1 + 2^(-1000*(t - 3)))", 3.0 - 1.3169578969248166 / 693.14718055994530942},
        {"tanh(1000*(t - 6))", 6.0 - 0.6584789484624083e-3},
        {"log(1 + exp(100*(t - 8)))", 8.0},
        {"1e150*exp(-((t - 6)/0.1)^2 - 350)", 6.0 - 0.12247448713915891},
        {"sqrt(max(0, t - 5))", 5.0},
        {"max(0, t - 5)^1.5", 5.0},
    };
    double memory[MEMORY];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const kt_expression *f = formula(rows[i].text, memory);
        int order;
        kt_check_near(rows[i].text, f != NULL ? next_breakpoint(f, 1e-3, HUGE_VAL, &order) : -1.0, rows[i].first,
                      1e-6 * rows[i].first);
    }
    const kt_expression *f = formula("tanh(1000*t)", memory);
    int order;
    kt_check_equal_int("none behind", f != NULL && next_breakpoint(f, 0.5, HUGE_VAL, &order) > 1e9, true);
}

/* ---- parts ------------------------------------------------------------------------------------------------------- */

enum { PARTS = 4 };

typedef struct parts {
    int count;
    double at_two[PARTS]; /* their values at 2 */
} parts;

static void keep_part(void *user, const kt_expression_term *term, size_t count) {
    static double memory[MEMORY];
    static const double two = 2.0;
    parts *p = user;
    if (p->count == PARTS || kt_expression_part_size(count) > sizeof memory)
        return;
    kt_expression_part_copy(term, count, memory);
    p->at_two[p->count++] = kt_expression_evaluate((const kt_expression *)(const void *)memory, &two);
}

static bool find_letter(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    *symbol = (kt_symbol){.index = name[0] - 'q'}; /* q, .., t, .., v */
    return name[1] == '\0';
}

static const char *list_letter(void *user, int k) {
    (void)user;
    (void)k;
    return NULL;
}

KT_TEST(parts_in_time_are_the_largest_that_read_nothing_else) {
    static const struct {
        const char *text;
        parts parts;
    } rows[] = {
        {"-3*q + 5*step(t - 1) + v*(t^2 + 1)", {2, {5.0, 5.0}}},
        {"max(v, sin(t)) - min(0, t - 9)", {2, {0.9092974268256817, -7.0}}},
        {"t*v + q + 2*3", {0, {0.0}}},
        {"2*t + 1", {1, {5.0}}},
        {"clamp(q, -t, 3*t)", {2, {-2.0, 6.0}}},
        {"abs(q - v)*7", {0, {0.0}}},
        {"v*(3*(t + 1)) - q^(t*t)", {2, {9.0, 4.0}}},
    };
    const kt_symbols symbols = {.find = find_letter, .list = list_letter};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        static double memory[MEMORY];
        const kt_expression *expression = NULL;
        parts found = {0, {0.0}};
        kt_error error;
        kt_note("%s", rows[i].text);
        kt_check_equal_int(
            "parsed", kt_expression_parse(rows[i].text, &symbols, memory, sizeof memory, &expression, NULL, &error),
            KT_OK);
        if (expression == NULL)
            return;
        kt_expression_parts(expression, 't' - 'q', keep_part, &found);
        kt_check_equal_int("parts", found.count, rows[i].parts.count);
        for (int k = 0; k < found.count; k++)
            kt_check_near("value", found.at_two[k], rows[i].parts.at_two[k], 1e-15);
    }
}
