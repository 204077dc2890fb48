/* Functions of time against closed forms and difference quotients. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/function.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "check.h"

enum { ROOM = 400 };

/* A function and the place of its numbers; `first` is moved so that nothing relies on a zero. */
typedef struct ready {
    kt_curve curve;
    double numbers[ROOM];
} ready;

static ready make_ready(kt_function function) {
    enum { FIRST = 7 };
    ready r;
    for (int i = 0; i < ROOM; i++)
        r.numbers[i] = (double)NAN;
    const size_t count = kt_curve_number_count(&function);
    r.curve = kt_curve_compile(&function, r.numbers, FIRST);
    kt_check_true("numbers before its place are not touched", isnan(r.numbers[FIRST - 1]));
    kt_check_true("nor those after", isnan(r.numbers[FIRST + count]));
    return r;
}

static double value_at(const ready *r, double t, int derivative) {
    double out[3] = {(double)NAN, (double)NAN, (double)NAN};
    kt_curve_evaluate(&r->curve, r->numbers, t, out);
    return out[derivative];
}

/* Both derivatives against the five-point formula of the order before,
 *   f'(t) = (f(t-2h) - 8 f(t-h) + 8 f(t+h) - f(t+2h)) / (12 h) - h^4 f''''' / 30.
 * scale bounds |f^(k)| / rate^k for all k. With h = 1e-3 / rate, the formula is off by `scale rate 1e-12 / 30`.
 * Rounding of f adds `1.5 eps |f| / h = 1.5e3 eps rate scale`, if each value is wrong by an ulp of scale at most. */
static void check_derivatives(const char *what, const ready *r, const double *times, int count, double scale,
                              double rate) {
    const double h = 1e-3 / rate;
    KT_WORST worst = kt_worst_make(what);
    for (int i = 0; i < count; i++)
        for (int k = 1; k <= 2; k++) {
            const double t = times[i];
            const double quotient = (value_at(r, t - 2.0 * h, k - 1) - 8.0 * value_at(r, t - h, k - 1) +
                                     8.0 * value_at(r, t + h, k - 1) - value_at(r, t + 2.0 * h, k - 1)) /
                                    (12.0 * h);
            const double unit = scale * pow(rate, k);
            kt_worst_near(&worst, value_at(r, t, k), quotient, unit * (1e-12 / 30.0 + 1.5e3 * DBL_EPSILON),
                          "t = %g, derivative %d", t, k);
        }
}

KT_TEST(constant_and_missing_functions_do_not_move) {
    const kt_function missing = {.type = KT_FUNCTION_NONE, .value = 5.0};
    const ready c = make_ready(kt_function_constant(-2.5)), n = make_ready(missing);
    double out[3];
    kt_curve_evaluate(&c.curve, c.numbers, 1e9, out);
    kt_check_equal_bits("constant", out, (const double[]){-2.5, 0.0, 0.0}, 3);
    kt_curve_evaluate(&n.curve, n.numbers, 0.0, out);
    kt_check_equal_bits("missing", out, (const double[]){0.0, 0.0, 0.0}, 3);
}

KT_TEST(sine_is_in_hertz_and_radians) {
    /* `3 + 2 sin(2 pi t / 4 + pi/6)`: the sine is `1/2` at t = 0, and again a third of a period later, at `4/3 s`. */
    const ready r = make_ready(kt_function_sine(2.0, 0.25, 0.52359877559829887, 3.0));
    const double w = 1.5707963267948966;
    kt_check_near("value at 0", value_at(&r, 0.0, 0), 4.0, 4.0 * DBL_EPSILON);
    kt_check_near("value at 4/3", value_at(&r, 4.0 / 3.0, 0), 4.0, 8.0 * DBL_EPSILON);
    kt_check_near("slope at 0", value_at(&r, 0.0, 1), sqrt(3.0) * w, 4.0 * DBL_EPSILON);
    kt_check_near("second derivative at 0", value_at(&r, 0.0, 2), -w * w, 4.0 * DBL_EPSILON);
    const double times[] = {-3.0, -0.7, 0.0, 0.3, 1.1, 2.9};
    check_derivatives("derivatives", &r, times, 6, 5.0, w);
}

KT_TEST(ramp_has_a_continuous_slope) {
    const ready r = make_ready(kt_function_ramp(1.0, 5.0, 2.0, 4.0));
    double out[3];
    static const double before[] = {1.0, 0.0, 0.0}, after[] = {5.0, 0.0, 0.0};
    static const double earlier[] = {-10.0, 1.99, 2.0}, later[] = {4.0, 4.01, 1e6};
    for (int i = 0; i < 3; i++) {
        kt_curve_evaluate(&r.curve, r.numbers, earlier[i], out);
        kt_check_equal_bits("before", out, before, 3);
        kt_curve_evaluate(&r.curve, r.numbers, later[i], out);
        kt_check_equal_bits("after", out, after, 3);
    }
    kt_check_near("middle", value_at(&r, 3.0, 0), 3.0, 2.0 * DBL_EPSILON);
    kt_check_near("slope in the middle, 1.5 (to - from) / length", value_at(&r, 3.0, 1), 3.0, 4.0 * DBL_EPSILON);
    kt_check_near("curvature in the middle", value_at(&r, 3.0, 2), 0.0, 0.0);
    /* s = 1/4: s^2 (3 - 2 s) = 5/32 */
    kt_check_near("first quarter", value_at(&r, 2.5, 0), 1.0 + 4.0 * 5.0 / 32.0, 4.0 * DBL_EPSILON);
    /* Next to the ends the slope is `6 s (to - from) / length = 6 e`, and the curvature `6 (to - from) / length^2 =
     * 6`. */
    const double e = 1e-7;
    kt_check_near("slope at the start", value_at(&r, 2.0 + e, 1), 6.0 * e, 1e-13 + 16.0 * DBL_EPSILON);
    kt_check_near("slope at the end", value_at(&r, 4.0 - e, 1), 6.0 * e, 1e-13 + 16.0 * DBL_EPSILON);
    kt_check_near("curvature at the start", value_at(&r, 2.0 + e, 2), 6.0, 1e-6);
    kt_check_near("curvature at the end", value_at(&r, 4.0 - e, 2), -6.0, 1e-6);
    const double times[] = {2.1, 2.5, 3.0, 3.3, 3.9};
    check_derivatives("derivatives", &r, times, 5, 5.0, 1.5);
}

/* Against sums of powers in long double. Horner's rule: 2 n eps sum |c_k t^k|, and its derivatives likewise. */
KT_TEST(polynomial_and_its_derivatives_are_sums_of_powers) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("value and derivatives");
    for (int count = 1; count <= 9; count++) {
        double c[9];
        for (int k = 0; k < count; k++)
            c[k] = kt_random_normal(&random);
        const ready r = make_ready(kt_function_polynomial(c, count));
        for (int i = 0; i < 20; i++) {
            const double t = kt_random_uniform(&random, -2.0, 2.0);
            for (int d = 0; d <= 2; d++) {
                long double sum = 0.0L, size = 0.0L;
                for (int k = d; k < count; k++) {
                    const long double factor = d == 0 ? 1 : d == 1 ? k : k * (k - 1);
                    const long double term = factor * (long double)c[k] * powl((long double)t, k - d);
                    sum += term;
                    size += fabsl(term);
                }
                kt_worst_near(&worst, value_at(&r, t, d), (double)sum, 2.0 * count * DBL_EPSILON * (double)size,
                              "%d coefficients, t = %g, derivative %d", count, t, d);
            }
        }
    }
}

static int fill_rows(kt_random *random, double *rows, int count, double *t, double *y) {
    double time = -3.0;
    for (int k = 0; k < count; k++) {
        rows[2 * k] = t[k] = time;
        rows[2 * k + 1] = y[k] = kt_random_normal(random);
        time += kt_random_uniform(random, 0.2, 1.5);
    }
    return 2 * count;
}

KT_TEST(linear_table_joins_its_rows) {
    static const double rows[] = {-1.0, 2.0, 1.0, 3.0, 1.5, -1.0};
    const ready r = make_ready(kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR));
    static const struct {
        double t, out[3];
    } expected[] = {
        {-5.0, {2.0, 0.0, 0.0}},  {-1.0, {2.0, 0.5, 0.0}},  {0.0, {2.5, 0.5, 0.0}},   {1.0, {3.0, -8.0, 0.0}},
        {1.25, {1.0, -8.0, 0.0}}, {1.5, {-1.0, -8.0, 0.0}}, {99.0, {-1.0, 0.0, 0.0}},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        double out[3];
        kt_curve_evaluate(&r.curve, r.numbers, expected[i].t, out);
        kt_check_equal_bits("value, slope, second derivative", out, expected[i].out, 3);
    }
}

/* From either side of a row: `|f(t+e) - f(t-e)| <= 2 e |f'|`, with e = 1e-9. For these rows |f^(k)| <= 60 with k up to
 * 3. */
KT_TEST(cubic_table_is_twice_continuously_differentiable) {
    static const double rows[] = {-1.0, 0.5, -0.3, 1.2, 0.4, -0.7, 1.5, 0.1, 2.1, 0.9, 2.6, -1.1, 4.0, 0.3};
    enum { ROWS = sizeof rows / sizeof *rows / 2 };
    const ready r = make_ready(kt_function_table(rows, 2 * ROWS, KT_INTERPOLATION_CUBIC));
    const double e = 1e-9;
    KT_WORST jump = kt_worst_make("jump at a row"), miss = kt_worst_make("value at a row");
    for (int k = 1; k < ROWS - 1; k++) {
        kt_worst_near(&miss, value_at(&r, rows[2 * k], 0), rows[2 * k + 1], 2.0 * DBL_EPSILON * fabs(rows[2 * k + 1]),
                      "row %d", k);
        for (int d = 0; d < 3; d++)
            kt_worst_near(&jump, value_at(&r, rows[2 * k] + e, d), value_at(&r, rows[2 * k] - e, d), 2.0 * e * 60.0,
                          "row %d, derivative %d", k, d);
    }
    kt_check_near("curvature at the first row", value_at(&r, rows[0] + e, 2), 0.0, 60.0 * e);
    kt_check_near("curvature at the last row", value_at(&r, rows[2 * ROWS - 2] - e, 2), 0.0, 60.0 * e);
    kt_check_near("value before", value_at(&r, -99.0, 0), rows[1], 0.0);
    kt_check_near("value after", value_at(&r, 99.0, 0), rows[2 * ROWS - 1], 0.0);
    kt_check_near("slope before", value_at(&r, -99.0, 1), 0.0, 0.0);
    kt_check_near("slope after", value_at(&r, 99.0, 1), 0.0, 0.0);
}

/* The slope of Fritsch and Butland in Brodlie's form, by the weight a = (1 + h_k / (h_{k-1} + h_k)) / 3:
 *   p = e0 e1 / (a e1 + (1 - a) e0),
 * and Hermite's cubic by its basis, where the library has powers of s. */
static double brodlie(double h0, double h1, double e0, double e1) {
    const double a = (1.0 + h1 / (h0 + h1)) / 3.0;
    return e0 * e1 > 0.0 ? e0 * e1 / (a * e1 + (1.0 - a) * e0) : 0.0;
}

static double parabola_end(double h0, double h1, double e0, double e1) {
    const double p = e0 + (e0 - e1) * h0 / (h0 + h1);
    return p * e0 <= 0.0 ? 0.0 : e0 * e1 <= 0.0 && fabs(p) > 3.0 * fabs(e0) ? 3.0 * e0 : p;
}

static double hermite(const double *t, const double *y, const double *p, int k, double x, int d) {
    const double h = t[k + 1] - t[k], s = (x - t[k]) / h;
    const double basis[3][4] = {
        {(1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s), s * (1.0 - s) * (1.0 - s), s * s * (3.0 - 2.0 * s),
         s * s * (s - 1.0)},
        {6.0 * s * (s - 1.0), (1.0 - s) * (1.0 - 3.0 * s), 6.0 * s * (1.0 - s), s * (3.0 * s - 2.0)},
        {12.0 * s - 6.0, 6.0 * s - 4.0, 6.0 - 12.0 * s, 6.0 * s - 2.0}};
    const double *b = basis[d];
    return (b[0] * y[k] + b[1] * h * p[k] + b[2] * y[k + 1] + b[3] * h * p[k + 1]) / pow(h, d);
}

KT_TEST(monotone_table_is_the_cubic_of_fritsch_and_butland) {
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("against Hermite's basis"), beyond = kt_worst_make("beyond its two rows");
    for (int count = 3; count <= 40; count++) {
        double rows[80], t[40], y[40], p[40];
        const ready r =
            make_ready(kt_function_table(rows, fill_rows(&random, rows, count, t, y), KT_INTERPOLATION_MONOTONE));
#define H(k) (t[(k) + 1] - t[k])
#define E(k) ((y[(k) + 1] - y[k]) / H(k))
        p[0] = parabola_end(H(0), H(1), E(0), E(1));
        p[count - 1] = parabola_end(H(count - 2), H(count - 3), E(count - 2), E(count - 3));
        for (int k = 1; k < count - 1; k++)
            p[k] = brodlie(H(k - 1), H(k), E(k - 1), E(k));
#undef E
#undef H
        for (int i = 0; i < 50; i++) {
            const double x = kt_random_uniform(&random, t[0], t[count - 1]);
            int k = 0;
            while (k < count - 2 && x >= t[k + 1])
                k++;
            for (int d = 0; d < 3; d++) /* as for the spline: rounding of y / least step^d, some ten times */
                kt_worst_near(&worst, value_at(&r, x, d), hermite(t, y, p, k, x, d),
                              8.0 * DBL_EPSILON * 3.0 / pow(0.2, d), "%d rows, t = %g, derivative %d", count, x, d);
            const double low = fmin(y[k], y[k + 1]), high = fmax(y[k], y[k + 1]), value = value_at(&r, x, 0);
            kt_worst_below(&beyond, fmax(0.0, fmax(low - value, value - high)), 8.0 * DBL_EPSILON, "%d rows, t = %g",
                           count, x);
        }
    }
    kt_check_worst(&worst);
    kt_check_worst(&beyond);
}

/* A slew of 90 degrees between two rests: the spline swings beyond both. */
KT_TEST(monotone_table_does_not_overshoot_where_the_spline_does) {
    static const double rows[] = {0.0, 0.0, 1.0, 0.0, 2.0, 90.0, 3.0, 90.0};
    const ready spline = make_ready(kt_function_table(rows, 8, KT_INTERPOLATION_CUBIC));
    const ready monotone = make_ready(kt_function_table(rows, 8, KT_INTERPOLATION_MONOTONE));
    double least[2] = {90.0, 90.0}, most[2] = {0.0, 0.0}, back = 0.0;
    for (int i = 0; i <= 3000; i++) {
        const double value[2] = {value_at(&spline, 1e-3 * i, 0), value_at(&monotone, 1e-3 * i, 0)};
        for (int k = 0; k < 2; k++) {
            least[k] = fmin(least[k], value[k]);
            most[k] = fmax(most[k], value[k]);
        }
        back = fmin(back, value_at(&monotone, 1e-3 * i, 1));
    }
    kt_note("the spline goes from %g to %g", least[0], most[0]);
    /* 60 / sqrt(27) beyond both, from m_1 = -m_2 = 180 */
    kt_check_near("the spline overshoots", most[0], 90.0 + 60.0 / sqrt(27.0), 1e-3);
    kt_check_near("monotone: least", least[1], 0.0, 0.0);
    kt_check_near("monotone: most", most[1], 90.0, 90.0 * DBL_EPSILON);
    kt_check_near("monotone: never back", back, 0.0, 90.0 * DBL_EPSILON);
    kt_check_near("slope at a row", value_at(&monotone, 2.0, 1), 0.0, 8.0 * 90.0 * DBL_EPSILON);
}

KT_TEST(monotone_table_of_two_rows_is_a_line) {
    static const double rows[] = {1.0, 2.0, 3.0, 8.0};
    const ready r = make_ready(kt_function_table(rows, 4, KT_INTERPOLATION_MONOTONE));
    kt_check_near("value", value_at(&r, 1.5, 0), 3.5, 4.0 * DBL_EPSILON);
    kt_check_near("slope", value_at(&r, 1.5, 1), 3.0, 4.0 * DBL_EPSILON);
    kt_check_near("curvature", value_at(&r, 1.5, 2), 0.0, 16.0 * DBL_EPSILON);
}

KT_TEST(cubic_table_of_two_rows_is_a_line) {
    static const double rows[] = {1.0, 2.0, 3.0, 8.0};
    const ready r = make_ready(kt_function_table(rows, 4, KT_INTERPOLATION_CUBIC));
    double out[3];
    kt_curve_evaluate(&r.curve, r.numbers, 1.5, out);
    kt_check_equal_bits("value, slope, second derivative", out, (const double[]){3.5, 3.0, 0.0}, 3);
}

KT_TEST(time_that_is_no_number_gives_no_number) {
    static const double rows[] = {1.0, 2.0, 3.0, 8.0, 4.0, 1.0};
    const kt_function functions[] = {
        kt_function_sine(1.0, 1.0, 0.0, 0.0), kt_function_ramp(0.0, 1.0, 0.0, 1.0), kt_function_polynomial(rows, 6),
        kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR), kt_function_table(rows, 6, KT_INTERPOLATION_CUBIC)};
    for (size_t i = 0; i < sizeof functions / sizeof *functions; i++) {
        const ready r = make_ready(functions[i]);
        kt_check_true("value is NaN", isnan(value_at(&r, (double)NAN, 0)));
    }
}

KT_TEST(functions_made_of_others_have_exact_derivatives) {
    const kt_function parts[] = {kt_function_sine(2.0, 0.2, 0.5, 1.0), kt_function_expression("exp(-t/4)*cos(t)"),
                                 kt_function_bump(0.5, -4.0, 4.0)};
    const kt_function inner[] = {kt_function_sum(parts, 3),
                                 kt_function_polynomial((const double[]){1.0, -0.2, 0.1}, 3)};
    const struct {
        const char *what;
        kt_function function;
        double scale;
    } rows[] = {{"bump", parts[2], 4.0},
                {"expression", parts[1], 4.0},
                {"sum", inner[0], 8.0},
                {"product", kt_function_product(parts, 3), 16.0},
                {"product of a sum", kt_function_product(inner, 2), 32.0}};
    double times[40];
    for (int i = 0; i < 40; i++)
        times[i] = -3.9 + 7.8 * i / 39.0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const ready r = make_ready(rows[i].function);
        check_derivatives(rows[i].what, &r, times, 40, rows[i].scale, 3.0);
    }
    const ready bump = make_ready(parts[2]), product = make_ready(kt_function_product(parts, 3));
    kt_check_near("crest", value_at(&bump, 0.0, 0), 0.5, DBL_EPSILON);
    kt_check_equal_bits("outside", (const double[]){value_at(&bump, -4.1, 0), value_at(&bump, 4.0, 1)},
                        (const double[]){0.0, 0.0}, 2);
    const double t = 1.25, u = 1.0 - t * t / 16.0;
    kt_check_near("product", value_at(&product, t, 0),
                  (1.0 + 2.0 * sin(0.4 * acos(-1.0) * t + 0.5)) * exp(-t / 4.0) * cos(t) * 0.5 * u * u * u,
                  8.0 * DBL_EPSILON);
}

KT_TEST(products_of_sines_bound_steps_by_the_sum_of_their_frequencies) {
    const kt_function parts[] = {kt_function_sine(2.0, 3.0, 0.5, 1.0), kt_function_sine(1.0, 1.0, 0.0, 0.0)};
    const ready sum = make_ready(kt_function_sum(parts, 2)), product = make_ready(kt_function_product(parts, 2));
    kt_check_near("sum, s", kt_curve_longest_step(&sum.curve, sum.numbers), 1.0 / 12.0, DBL_EPSILON);
    kt_check_near("product, s", kt_curve_longest_step(&product.curve, product.numbers), 1.0 / 16.0, DBL_EPSILON);
}

/* In a block of the very size, so that the sanitizers see one number too many, written or read. */
KT_TEST(functions_stay_in_their_place) {
    static const double numbers[] = {1.0, 2.0, 3.0, 8.0, 4.0, 1.0, 5.0, 0.5};
    const kt_function functions[] = {kt_function_constant(1.0), kt_function_polynomial(numbers, 8),
                                     kt_function_table(numbers, 8, KT_INTERPOLATION_LINEAR),
                                     kt_function_table(numbers, 8, KT_INTERPOLATION_CUBIC),
                                     kt_function_expression("1+t")};
    static const size_t counts[] = {0, 8, 20, 20, 10};
    for (size_t i = 0; i < sizeof functions / sizeof *functions; i++) {
        const size_t count = kt_curve_number_count(&functions[i]);
        kt_check_equal_int("numbers", (long long)count, (long long)counts[i]);
        double *block = malloc((count + 1) * sizeof *block), out[3];
        const kt_curve curve = kt_curve_compile(&functions[i], block, 1);
        for (int k = 0; k < 24; k++)
            kt_curve_evaluate(&curve, block, 0.25 * k, out);
        kt_check_true("value is finite", isfinite(out[0]));
        free(block);
    }
}
