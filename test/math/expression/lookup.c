/* Lookup tables in formulas: closed forms of each interpolation, of its derivatives, and of inputs outside the rows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/lookup.h"
#include "check.h"
#include "expression/formula_breakpoint.h"
#include "expression/margin.h"
#include "expression/part.h"
#include "expression/third.h"
#include "expression/wide.h"

#include <float.h>
#include <math.h>
#include <stdalign.h>
#include <string.h>

enum { ROWS = 65 };

static bool find(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    *symbol = (kt_symbol){.index = name[0] == 'y'};
    return strcmp(name, "x") == 0 || strcmp(name, "y") == 0;
}

static double compiled[20000];
static alignas(double) char memory[1 << 17];

/* The formula, with tables that are compiled one behind the other. */
static const kt_expression *read_formula(const char *text, const kt_lookup *tables, int count) {
    const kt_symbols symbols = {.find = find, .tables = tables, .table_count = count, .compiled = compiled};
    const kt_expression *formula = NULL;
    kt_error error = {0};
    size_t used = 0;
    for (int k = 0; k < count; k++) {
        char fault[200] = "";
        kt_check_true(fault, kt_lookup_check(&tables[k], fault, sizeof fault));
        kt_lookup_compile(&tables[k], compiled + used);
        used += kt_lookup_numbers(&tables[k]);
    }
    if (kt_expression_parse(text, &symbols, memory, sizeof memory, &formula, NULL, &error) != KT_OK)
        kt_note("'%s': %s: %s", text, error.where, error.message);
    kt_need(kt_check_true(text, formula != NULL));
    return formula;
}

static double value_at(const kt_expression *formula, double x, double y) {
    return kt_expression_evaluate(formula, (const double[]){x, y});
}

/* ---- one input --------------------------------------------------------------------------------------------------- */

/* Three rows 0, 1, 0. Lines: 2 x. Natural spline: m_1 = -3, so that y = 1.5 s - 0.5 s^3. Monotone: the slopes are 2 at
 * the first row, by the parabola, and 0 at the second, so that y = 2 s - s^2. */
KT_TEST(one_input_has_the_closed_forms_of_three_rows) {
    static const double rows[] = {0.0, 0.0, 1.0, 1.0, 2.0, 0.0}, s = 0.375,
                        expected[] = {s, 1.5 * s - 0.5 * s * s * s, 2.0 * s - s * s};
    static const double slope[] = {1.0, 1.5 - 1.5 * s * s, 2.0 - 2.0 * s}, bend[] = {0.0, -3.0 * s, -2.0};
    static const double third[] = {0.0, -3.0, 0.0};
    for (int k = 0; k < 3; k++) {
        const kt_lookup table = {
            .name = "f", .inputs = 1, .rows = rows, .row_count = 3, .interpolation = (kt_interpolation)k};
        const kt_expression *formula = read_formula("f(x)", &table, 1);
        double out[3];
        kt_expression_taylor(formula, &s, (const double[]){1.0}, NULL, out);
        kt_check_near("value", value_at(formula, s, 0.0), expected[k], 2.0 * DBL_EPSILON);
        kt_check_near("first derivative", out[1], slope[k], 4.0 * DBL_EPSILON);
        kt_check_near("second derivative", out[2], bend[k], 8.0 * DBL_EPSILON);
        kt_check_near("third derivative", kt_expression_third(formula, &s, (const double[]){1.0}), third[k],
                      16.0 * DBL_EPSILON);
        kt_check_near("value at the last row", value_at(formula, 2.0, 0.0), 0.0, 4.0 * DBL_EPSILON);
    }
}

/* A spline through a sine of one period is off by up to h^4/384 max|y''''| at its rows' middles, and its first two
 * derivatives are continuous where the table repeats itself. */
KT_TEST(a_cubic_table_that_repeats_itself_is_smooth_at_its_ends) {
    static const double turn = 6.283185307179586;
    double rows[2 * ROWS], below[3], above[3], worst = 0.0;
    for (int k = 0; k < ROWS; k++) {
        rows[2 * k] = turn * k / (ROWS - 1);
        rows[2 * k + 1] = k == ROWS - 1 ? rows[1] : 2.0 + sin(rows[2 * k] + 0.3);
    }
    const kt_lookup table = {.name = "f",
                             .inputs = 1,
                             .rows = rows,
                             .row_count = ROWS,
                             .interpolation = KT_INTERPOLATION_CUBIC,
                             .outside = KT_OUTSIDE_REPEAT};
    const kt_expression *formula = read_formula("f(x)", &table, 1);
    const double before = turn * (1.0 - DBL_EPSILON), behind = turn * (1.0 + DBL_EPSILON);
    kt_expression_taylor(formula, &before, (const double[]){1.0}, NULL, below);
    kt_expression_taylor(formula, &behind, (const double[]){1.0}, NULL, above);
    for (int k = 0; k < 3; k++)
        kt_check_near(k == 0 ? "value" : k == 1 ? "slope" : "curvature", above[k], below[k], 4e-13);
    for (int k = -2000; k <= 2000; k++)
        worst = fmax(worst, fabs(value_at(formula, 0.0137 * k, 0.0) - 2.0 - sin(0.0137 * k + 0.3)));
    kt_check_below("difference from the sine", worst, pow(turn / (ROWS - 1), 4.0) / 384.0 * 1.02);
    kt_check_above("difference from the sine", worst, pow(turn / (ROWS - 1), 4.0) / 384.0 * 0.9);
}

/* The slope of a monotone table at its seam is the mean of the last interval and the first one. */
KT_TEST(a_monotone_table_that_repeats_itself_has_one_slope_at_its_ends) {
    static const double rows[] = {0.0, 0.0, 1.0, 2.0, 3.0, -1.0, 4.0, 0.0};
    const kt_lookup table = {.name = "f",
                             .inputs = 1,
                             .rows = rows,
                             .row_count = 4,
                             .interpolation = KT_INTERPOLATION_MONOTONE,
                             .outside = KT_OUTSIDE_REPEAT};
    const kt_expression *formula = read_formula("f(x)", &table, 1);
    const double e0 = 1.0, e1 = 2.0, w1 = 3.0, w2 = 3.0, expected = (w1 + w2) / (w1 / e0 + w2 / e1);
    for (int k = -2; k <= 2; k++) {
        double out[3];
        const double at = 4.0 * k;
        kt_expression_taylor(formula, &at, (const double[]){1.0}, NULL, out);
        kt_check_near("slope at the seam", out[1], expected, 4.0 * DBL_EPSILON);
        kt_check_near("value at the seam", out[0], 0.0, 0.0);
    }
}

KT_TEST(outside_its_rows_a_table_does_as_stated) {
    static const double rows[] = {1.0, 2.0, 3.0, 6.0};
    static const double x[] = {0.0, 4.0}, hold[] = {2.0, 6.0}, extend[] = {0.0, 8.0};
    for (int k = 0; k < 2; k++) {
        kt_lookup table = {.name = "f", .inputs = 1, .rows = rows, .row_count = 2};
        const kt_expression *formula = read_formula("1 + f(x)", &table, 1);
        char fault[200] = "";
        kt_check_true("rejected: not a number", isnan(value_at(formula, x[k], 0.0)));
        kt_check_true("rejected: a reason", kt_expression_fault(formula, &x[k], fault, sizeof fault));
        kt_check_contains("the reason", fault,
                          k == 0 ? "the input 0 of a table is before its first row, at 1"
                                 : "the input 4 of a table is behind its last row, at 3");
        table.outside = KT_OUTSIDE_HOLD;
        kt_check_near("held", value_at(read_formula("f(x)", &table, 1), x[k], 0.0), hold[k], 0.0);
        table.outside = KT_OUTSIDE_EXTEND;
        kt_check_near("extended", value_at(read_formula("f(x)", &table, 1), x[k], 0.0), extend[k], 4.0 * DBL_EPSILON);
    }
}

/* ---- two inputs -------------------------------------------------------------------------------------------------- */

static double plane(double x, double y) { return 3.0 - 2.0 * x + 0.5 * y + 0.25 * x * y; }

static void fill_grid(double rows[36]) {
    static const double xs[] = {-1.0, 0.5, 4.0}, ys[] = {0.0, 1.0, 3.0, 8.0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            double *row = rows + 3 * (4 * i + j);
            row[0] = xs[i];
            row[1] = ys[j];
            row[2] = plane(xs[i], ys[j]);
        }
}

/* A bilinear function is its own interpolation, also outside the grid. */
KT_TEST(two_inputs_reproduce_a_bilinear_function) {
    double rows[36];
    fill_grid(rows);
    const kt_lookup table = {.name = "f", .inputs = 2, .rows = rows, .row_count = 12, .outside = KT_OUTSIDE_EXTEND};
    const kt_expression *formula = read_formula("f(x, y)", &table, 1);
    KT_WORST value = kt_worst_make("value"), slope = kt_worst_make("slope"), bend = kt_worst_make("second"),
             third = kt_worst_make("third");
    for (int k = 0; k < 100; k++) {
        const double at[] = {-3.0 + 0.09 * k, 10.0 - 0.13 * k}, rate[] = {0.7, -0.4}, second[] = {0.3, 0.2};
        double out[3];
        kt_expression_taylor(formula, at, rate, second, out);
        const double fx = -2.0 + 0.25 * at[1], fy = 0.5 + 0.25 * at[0];
        kt_worst_near(&value, out[0], plane(at[0], at[1]), 64.0 * DBL_EPSILON, "%d", k);
        kt_worst_near(&slope, out[1], fx * rate[0] + fy * rate[1], 32.0 * DBL_EPSILON, "%d", k);
        kt_worst_near(&bend, out[2], fx * second[0] + fy * second[1] + 0.5 * rate[0] * rate[1], 32.0 * DBL_EPSILON,
                      "%d", k);
        kt_worst_near(&third, kt_expression_third(formula, at, rate), 0.0, 1e-14, "%d", k);
    }
}

KT_TEST(two_inputs_are_held_at_the_edge_of_the_grid) {
    double rows[36];
    fill_grid(rows);
    const kt_lookup table = {.name = "f", .inputs = 2, .rows = rows, .row_count = 12, .outside = KT_OUTSIDE_HOLD};
    const kt_expression *formula = read_formula("f(x, y)", &table, 1);
    KT_WORST value = kt_worst_make("value"), slope = kt_worst_make("slope");
    for (int k = 0; k < 100; k++) {
        const double at[] = {-3.0 + 0.09 * k, 10.0 - 0.13 * k}, rate[] = {1.0, 1.0};
        const double x = fmin(fmax(at[0], -1.0), 4.0), y = fmin(fmax(at[1], 0.0), 8.0);
        double out[3];
        kt_expression_taylor(formula, at, rate, NULL, out);
        kt_worst_near(&value, out[0], plane(x, y), 64.0 * DBL_EPSILON, "%d", k);
        kt_worst_near(&slope, out[1], (x == at[0] ? -2.0 + 0.25 * y : 0.0) + (y == at[1] ? 0.5 + 0.25 * x : 0.0),
                      32.0 * DBL_EPSILON, "%d", k);
    }
}

/* ---- formulas that contain tables -------------------------------------------------------------------------------- */

/* Two tables: the second one lies behind the first one. Parts and margins of formulas are copies elsewhere. */
KT_TEST(copies_of_formulas_keep_their_tables) {
    static const double f[] = {0.0, 1.0, 2.0, 5.0}, g[] = {0.0, -1.0, 4.0, 7.0, 5.0, 0.0};
    const kt_lookup tables[] = {{.name = "f", .inputs = 1, .rows = f, .row_count = 2},
                                {.name = "g", .inputs = 1, .rows = g, .row_count = 3}};
    static alignas(double) char copy[4096];
    const kt_expression *formula = read_formula("g(x) + f(x) > 3 and not g(x) < 0", tables, 2);
    kt_expression *margin = (kt_expression *)(void *)copy;
    kt_need(kt_check_true("margin", kt_expression_margin(formula, margin)));
    kt_check_near("margin", value_at(margin, 1.0, 0.0), fmin(1.0 + 3.0 - 3.0, 1.0), 4.0 * DBL_EPSILON);
    kt_expression_part_copy(margin->term, margin->count, copy + 2048);
    kt_check_near("copy of the margin", value_at((const kt_expression *)(void *)(copy + 2048), 1.0, 0.0), 1.0,
                  4.0 * DBL_EPSILON);
}

/* With numbers of any exponent, as doubles would overflow. */
KT_TEST(tables_in_formulas_that_overflow_have_their_values) {
    static const double rows[] = {0.0, 1.0, 2.0, 5.0};
    const kt_lookup table = {.name = "f", .inputs = 1, .rows = rows, .row_count = 2};
    kt_check_near("value", value_at(read_formula("log(exp(800)*f(x)) - 800", &table, 1), 1.0, 0.0), log(3.0), 1e-12);
}

/* Steps end at the rows that a formula of time meets. */
KT_TEST(rows_are_breakpoints_of_formulas_of_time) {
    static const double rows[] = {0.0, 0.0, 1.0, 2.0, 2.5, 1.0, 4.0, 1.5};
    static const double expected[] = {0.5, 1.25, 2.0};
    static const char *const texts[] = {"f(2*x)", "3 + f(2*x)^2"};
    for (int n = 0; n < 2; n++) {
        const kt_lookup table = {.name = "f", .inputs = 1, .rows = rows, .row_count = 4, .outside = KT_OUTSIDE_HOLD};
        const kt_expression *formula = read_formula(texts[n], &table, 1);
        double t = 0.25;
        int order = 0, met = 0;
        for (int k = 0; k < 20 && t < 3.0; k++) {
            int64_t left = KT_BREAKPOINT_OPERATIONS;
            t = kt_expression_next_breakpoint(formula, t, 3.0, &left, &order);
            if (order == 1 && met < 3) {
                kt_check_near("a row", t, expected[met], 4.0 * DBL_EPSILON);
                met++;
            }
        }
        kt_check_equal_int("rows met", met, 3);
    }
}

/* The bounds over an interval hold all values. */
KT_TEST(bounds_hold_the_values_of_tables) {
    static const double rows[] = {0.0, 0.0, 1.0, 2.0, 2.5, 1.0, 4.0, 1.5};
    for (int k = 0; k < 3; k++) {
        const kt_lookup table = {.name = "f",
                                 .inputs = 1,
                                 .rows = rows,
                                 .row_count = 4,
                                 .interpolation = (kt_interpolation)k,
                                 .outside = KT_OUTSIDE_HOLD};
        const kt_expression *formula = read_formula("f(x) - f(x/2)", &table, 1);
        int misses = 0;
        for (int i = 0; i < 60; i++) {
            const double from = -1.0 + 0.1 * i, to = from + 0.02 * (i % 13) + 0.01;
            const kt_jet jet = kt_expression_bound(formula, from, to, NULL, NULL);
            for (int j = 0; j <= 20; j++) {
                const double t = from + (to - from) * j / 20.0, z = value_at(formula, t, 0.0);
                misses += !(z >= jet.c[0].lo && z <= jet.c[0].hi);
            }
        }
        kt_check_equal_int("values outside the bounds", misses, 0);
    }
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(wrong_calls_of_tables_are_reported) {
    static const double rows[] = {0.0, 0.0, 1.0, 2.0}, grid[] = {0, 0, 1, 0, 1, 2, 1, 0, 3, 1, 1, 4};
    const kt_lookup tables[] = {{.name = "lift", .inputs = 1, .rows = rows, .row_count = 2},
                                {.name = "map", .inputs = 2, .rows = grid, .row_count = 4}};
    static const char *const wrong[][2] = {{"lift + 1", "lift is a table; write its input in parentheses: lift(x)"},
                                           {"lift(x, y)", "the table lift has 1 input; remove this one"},
                                           {"map(x)", "the table map has 2 inputs; one is missing"},
                                           {"left(x)", "did you mean 'lift'?"},
                                           {"map(x, y", "a ')' is missing"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const kt_symbols symbols = {.find = find, .tables = tables, .table_count = 2};
        const kt_expression *formula = NULL;
        kt_error error = {0};
        kt_check_true("rejected", kt_expression_parse(wrong[k][0], &symbols, memory, sizeof memory, &formula, NULL,
                                                      &error) == KT_ERROR_SCENE);
        kt_check_contains(wrong[k][0], error.message, wrong[k][1]);
    }
}

KT_TEST(wrong_tables_are_reported) {
    static const double falls[] = {0.0, 1.0, 0.0, 2.0}, grid[] = {0, 0, 1, 0, 1, 2, 1, 0, 3, 1, 2, 4},
                        inf[] = {0.0, 1.0, 1.0, (double)INFINITY};
    static const struct {
        kt_lookup table;
        const char *fault;
    } wrong[] = {{{.inputs = 3, .rows = grid, .row_count = 2}, "one input or two"},
                 {{.inputs = 1, .rows = falls, .row_count = 1}, "two rows or more"},
                 {{.inputs = 1, .rows = falls, .row_count = 2}, "inputs must increase"},
                 {{.inputs = 1, .rows = inf, .row_count = 2}, "numbers are finite"},
                 {{.inputs = 2, .rows = grid, .row_count = 3}, "no grid"},
                 {{.inputs = 2, .rows = grid, .row_count = 4}, "each x needs the same y"},
                 {{.inputs = 1, .rows = falls, .row_count = 2, .outside = KT_OUTSIDE_REPEAT}, "the same value"},
                 {{.inputs = 2, .rows = grid, .row_count = 4, .interpolation = KT_INTERPOLATION_CUBIC}, "is linear"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        char fault[200] = "";
        kt_check_true("rejected", !kt_lookup_check(&wrong[k].table, fault, sizeof fault));
        kt_check_contains("the reason", fault, wrong[k].fault);
    }
}
