/* Stability polynomials against steps that are really taken, and their limits against closed forms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/stabilised.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- a mode, really stepped -------------------------------------------------------------------------------------- */

/* y' = lambda y, y complex. */
static int turn_and_decay(double t, const double *y, double *dydt, void *user) {
    const kt_complex *lambda = user;
    (void)t;
    dydt[0] = lambda->re * y[0] - lambda->im * y[1];
    dydt[1] = lambda->im * y[0] + lambda->re * y[1];
    return 0;
}

/* y after `steps` steps of size 1 from 1; *stages that a stabilised method took. */
static kt_complex stepped(const kt_method *m, kt_complex lambda, int steps, int *stages) {
    kt_integrator *it = integrator_start(m, 2, fixed_step(1.0), turn_and_decay, &lambda, 0.0, (double[]){1.0, 0.0});
    for (int i = 0; i < steps; i++)
        integrator_step(it, HUGE_VAL);
    *stages =
        kt_method_stages_vary(m) ? kt_chebyshev_stages(kt_stabilised_radius(it), kt_chebyshev_damping(m)) : m->stages;
    const kt_complex y = {kt_integrator_state(it)[0], kt_integrator_state(it)[1]};
    return y;
}

static kt_stability stability_of(const kt_method *m, int stages) {
    kt_error error;
    kt_stability s = {0};
    kt_fine(m->name, kt_stability_make(m, stages, &s, &error), &error);
    return s;
}

static double sum_of_terms(const double *c, int degree, double size) {
    double sum = 0.0;
    for (int k = degree; k >= 0; k--)
        sum = fabs(c[k]) + size * sum;
    return sum;
}

/* Rounding for an implicit method: that of P and of Q, over |Q|, which is small near a pole. Measured: 20 eps of it,
 * since Newton's iteration ends at 4 eps of y. */
static double rounding_of_rational(const kt_method *m, kt_complex z) {
    const kt_stability s = stability_of(m, 2);
    kt_stability q = s;
    q.degree = 0;
    q.coefficient[0] = 1.0;
    const double size = hypot(z.re, z.im), gain = kt_stability_gain(&s, z);
    return 64.0 * DBL_EPSILON * kt_stability_gain(&q, z) *
           (sum_of_terms(s.coefficient, s.degree, size) + gain * sum_of_terms(s.denominator, s.poles, size));
}

/* A Jacobian by central differences has an error of eps^(2/3). This moves R by R'. Near the pole, which all eight
 * stages share, it moves the stages by more. */
static double rounding_of_rosenbrock(const kt_method *m, kt_complex z) {
    const kt_stability s = stability_of(m, 2);
    const double pole = hypot(1.0 - m->gamma[0] * z.re, m->gamma[0] * z.im);
    return 64.0 * pow(DBL_EPSILON, 2.0 / 3.0) * (1.0 + hypot(z.re, z.im)) * (1.0 + kt_stability_gain(&s, z)) *
           (1.0 + 1.0 / pole) * (1.0 + 1.0 / pole);
}

/* The rounding error of a step. In general it is a few eps of the sum S of all terms,
 *     S = 1 + sum_k |z|^k |b|' |A|^(k-1) 1
 * The recurrence of the stabilised methods adds the rounding of each stage, of values of the size of 1 + |z|. So this
 * size is multiplied by the number of stages. With T_k for k steps of z / k, the sum of rkc4 is
 *     T = T_1 / 12 - 4 T_2 / 3 + 9 T_3 / 4 */
static double rounding_of(const kt_method *m, int stages, kt_complex z) {
    const double size = hypot(z.re, z.im);
    if (kt_method_stages_vary(m) && kt_chebyshev_copies(m) == 1)
        return DBL_EPSILON * stages * (1.0 + size);
    if (kt_method_stages_vary(m))
        return DBL_EPSILON * stages * ((1.0 + size) / 12.0 + 4.0 / 3.0 * (2.0 + size) + 9.0 / 4.0 * (3.0 + size));
    if (m->gamma != NULL)
        return rounding_of_rosenbrock(m, z);
    if (kt_method_is_implicit(m))
        return rounding_of_rational(m, z);
    double power[KT_METHOD_STAGES_MAX], sum = 1.0, z_k = 1.0;
    for (int i = 0; i < m->stages; i++)
        power[i] = 1.0;
    for (int k = 1; k <= m->stages; k++) {
        z_k *= size;
        for (int i = 0; i < m->stages; i++)
            sum += z_k * fabs(m->b[i]) * power[i];
        for (int i = m->stages - 1; i >= 0; i--) {
            double next = 0.0;
            for (int j = 0; j < i; j++)
                next += fabs(m->a[i * (i - 1) / 2 + j]) * power[j];
            power[i] = next;
        }
    }
    return 4.0 * DBL_EPSILON * sum; /* numbers are complex: two products in each part */
}

KT_TEST(the_polynomial_is_what_a_step_multiplies_a_mode_with) {
    kt_random random = kt_random_of_test();
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (m->steps > 0) /* see multistep.c */
            continue;
        KT_WORST worst = kt_worst_make(m->name);
        for (int k = 0; k < 200; k++) {
            const double size = kt_random_uniform(&random, 0.0, kt_method_stages_vary(m) ? 50.0 : 6.0);
            const double angle = kt_method_stages_vary(m) ? 3.14159265358979324
                                                          : kt_random_uniform(&random, 0.0, 2.0 * 3.14159265358979324);
            const kt_complex z = {size * cos(angle), size * sin(angle)};
            int stages = 2;
            const kt_complex y = stepped(m, z, 1, &stages);
            const kt_stability s = stability_of(m, stages);
            const kt_complex r = kt_stability_value(&s, z);
            kt_worst_below(&worst, hypot(y.re - r.re, y.im - r.im), rounding_of(m, stages, z), "z = %g + %gi", z.re,
                           z.im);
        }
    }
}

KT_TEST(a_callers_table_has_its_polynomial) {
    static const double a[] = {1.0}, b[] = {1.0, 0.0}, c[] = {0.0, 1.0}; /* Euler with an idle stage */
    const kt_method own = {.name = "own", .stages = 2, .order = 1, .a = a, .b = b, .c = c};
    const kt_stability s = stability_of(&own, 0);
    kt_check_equal_int("degree", s.degree, 1);
    kt_check_near("real limit", kt_stability_real_limit(&s), 2.0, 1e-15);
    kt_stability untouched = s;
    kt_check_equal_int("stages", kt_stability_make(kt_method_find("rkc2"), 1, &untouched, NULL), KT_ERROR_ARGUMENT);
    kt_check_equal_int("stages", kt_stability_make(kt_method_find("rkc2"), 251, &untouched, NULL), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no method", kt_stability_make(NULL, 2, &untouched, NULL), KT_ERROR_ARGUMENT);
    kt_check_equal_int("untouched", untouched.degree, 1);
}

/* ---- limits on the axes ------------------------------------------------------------------------------------------ */

/* The one real root of x^3 + b x^2 + c x + d (Cardano, positive discriminant). */
static double cubic_root(double b, double c, double d) {
    const double p = c - b * b / 3.0, q = 2.0 * b * b * b / 27.0 - b * c / 3.0 + d;
    const double root = sqrt(q * q / 4.0 + p * p * p / 27.0);
    return cbrt(-q / 2.0 + root) + cbrt(-q / 2.0 - root) - b / 3.0;
}

static void check_limits(const char *name, double real, double imaginary) {
    const kt_stability s = stability_of(kt_method_find(name), 2);
    kt_note("%s: %.9f and %.9f", name, real, imaginary);
    kt_check_near("real", kt_stability_real_limit(&s), real, 16.0 * DBL_EPSILON * real);
    kt_check_near("imaginary", kt_stability_imaginary_limit(&s), imaginary, 16.0 * DBL_EPSILON * imaginary);
}

/* With R(z) the series of e^z to order p = 1 .. 4:
 *   real: R(-x) = -1 at p = 1, 2, 3: x = 2, x = 2, x^3 - 3 x^2 + 6 x - 12 = 0; R(-x) = 1 at p = 4: x^3 - 4 x^2 + 12 x -
 *   24 = 0
 *   imaginary: |R|^2 = 1 + y^2; 1 + y^4/4; 1 - y^4/12 + y^6/36; 1 - y^6/72 + y^8/576 */
KT_TEST(limits_of_the_classical_methods_are_those_of_their_closed_forms) {
    check_limits("euler", 2.0, 0.0);
    check_limits("midpoint", 2.0, 0.0);
    check_limits("heun", 2.0, 0.0);
    check_limits("ralston", 2.0, 0.0);
    const double third = cubic_root(-3.0, 6.0, -12.0), fourth = cubic_root(-4.0, 12.0, -24.0);
    kt_check_near("Kutta 3, published", third, 2.5127, 5e-5);
    kt_check_near("Runge-Kutta 4, published", fourth, 2.785293563, 5e-10);
    check_limits("kutta3", third, sqrt(3.0));
    check_limits("bs32", third, sqrt(3.0));
    check_limits("rk4", fourth, sqrt(8.0));
    check_limits("rk38", fourth, sqrt(8.0));
}

/* The polynomial of dopri5 (HW IV.2, (2.13)) is
 *     R = 1 + z + ... + z^5/120 + z^6/600
 * Bisection of R yields its real limit. On the imaginary axis,
 *     |R|^2 - 1 = y^6 (-1/1800 + 1/28800 y^2 ... )
 * Each coefficient is the sum of c_i c_j over i + j = 2k with alternating signs. By hand,
 *     e_3 = -2/600 + 2/120 - 1/36 + ... */
KT_TEST(limits_of_dopri5_are_those_of_its_published_polynomial) {
    double low = 3.0, high = 3.5;
    while (high - low > 1e-15 * high && 0.5 * (low + high) > low && 0.5 * (low + high) < high) {
        const double x = 0.5 * (low + high);
        const double r =
            1.0 - x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 5.0)))));
        *(r > 1.0 ? &high : &low) = x;
    }
    kt_check_near("published", low, 3.3066, 5e-5);
    const kt_stability s = stability_of(kt_method_find("dopri5"), 2);
    kt_check_near("real", kt_stability_real_limit(&s), low, 1e-14);
    kt_check_near("z^6", s.coefficient[6], 1.0 / 600.0, DBL_EPSILON / 600.0);
    /* The coefficients of |R|^2 - 1 follow from the real and the imaginary part:
     *     Re = 1 - y^2/2 + y^4/24 - y^6/600, Im = y - y^3/6 + y^5/120
     *     y^6: -1/300 - 1/24 + 1/60 + 1/36,   y^8: 1/576 + 1/600 - 1/360,   y^10: -1/7200 + 1/14400,   y^12: 1/360000
     */
    const double e3 = -1.0 / 300.0 - 1.0 / 24.0 + 1.0 / 60.0 + 1.0 / 36.0, e4 = 1.0 / 576.0 + 1.0 / 600.0 - 1.0 / 360.0,
                 e5 = -1.0 / 7200.0 + 1.0 / 14400.0, e6 = 1.0 / 360000.0;
    const double y = kt_stability_imaginary_limit(&s), x = y * y;
    kt_check_above("stable near 0", -e3, 1e-4);
    kt_check_near("e_3 + e_4 y^2 + ...", e3 + x * (e4 + x * (e5 + x * e6)), 0.0, 64.0 * DBL_EPSILON * fabs(e3));
}

/* For every method, a mode at the limit keeps its size in a step really taken. A mode just beyond does not. */
KT_TEST(modes_at_the_limits_neither_grow_nor_decay) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (!goes_by_its_table(m))
            continue;
        const kt_stability s = stability_of(m, 2);
        const double x = kt_stability_real_limit(&s), y = kt_stability_imaginary_limit(&s);
        int stages;
        kt_note("%s: %.6f, %.6f", m->name, x, y);
        const kt_complex real = stepped(m, (kt_complex){-x, 0.0}, 1, &stages);
        kt_check_near("|R| at the real limit", fabs(real.re), 1.0, 4.0 * DBL_EPSILON * exp(x));
        const kt_complex outside = stepped(m, (kt_complex){-1.001 * x, 0.0}, 1, &stages);
        kt_check_above("outside", fabs(outside.re), 1.0005);
        if (y == 0.0)
            continue;
        const kt_complex turned = stepped(m, (kt_complex){0.0, y}, 1, &stages);
        kt_check_near("|R| at the imaginary limit", hypot(turned.re, turned.im), 1.0, 4.0 * DBL_EPSILON * exp(y));
        const kt_complex grown = stepped(m, (kt_complex){0.0, 1.1 * y}, 20, &stages);
        const kt_complex beyond = kt_stability_value(&s, (kt_complex){0.0, 1.1 * y});
        const double growth = 20.0 * log(hypot(beyond.re, beyond.im));
        kt_check_true("beyond, it grows", growth > 0.0);
        kt_check_near("20 steps beyond, log", log(hypot(grown.re, grown.im)), growth,
                      80.0 * DBL_EPSILON * exp(1.1 * y));
        const kt_complex kept = stepped(m, (kt_complex){0.0, 0.9 * y}, 20, &stages);
        const kt_complex within = kt_stability_value(&s, (kt_complex){0.0, 0.9 * y});
        const double decay = 20.0 * log(hypot(within.re, within.im));
        kt_check_true("within, it decays", decay < 0.0);
        kt_check_near("20 steps within, log", log(hypot(kept.re, kept.im)), decay,
                      80.0 * DBL_EPSILON * exp(0.9 * y) / hypot(within.re, within.im));
    }
}

KT_TEST(a_grid_holds_the_gain_at_its_points) {
    const kt_stability s = stability_of(kt_method_find("rk4"), 2);
    const kt_complex low = {-4.0, -1.0}, high = {2.0, 3.5};
    double gain[7 * 10];
    kt_stability_grid(&s, low, high, 7, 10, gain);
    KT_WORST worst = kt_worst_make("gain");
    for (int i = 0; i < 10; i++)
        for (int j = 0; j < 7; j++)
            kt_worst_near(&worst, gain[7 * i + j], kt_stability_gain(&s, (kt_complex){-4.0 + j, -1.0 + 0.5 * i}), 0.0,
                          "row %d, column %d", i, j);
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* An undamped mode of Heun's method:
 *     |R|^2 = 1 + (h w)^4 / 4 */
KT_TEST(growth_of_an_undamped_mode_is_that_of_heuns_closed_form) {
    const kt_stability s = stability_of(kt_method_find("heun"), 2);
    const kt_complex lambda = {0.0, 20.0};
    KT_WORST worst = kt_worst_make("growth");
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double h = 1e-4; h < 0.05; h *= 1.7) {
        const double exact = pow(1.0 + pow(20.0 * h, 4) / 4.0, 0.5 * 10.0 / h);
        kt_worst_near(&worst, kt_stability_growth(&s, lambda, h, 10.0), exact, 1e-9 * exact, "h = %g", h);
    }
    ptrdiff_t index = -1;
    const double h = kt_stability_step(kt_method_find("heun"), &lambda, 1, 10.0, 2.0, &index);
    kt_check_near("growth at the limit", pow(1.0 + pow(20.0 * h, 4) / 4.0, 5.0 / h), 2.0, 1e-11);
    kt_check_equal_int("index", index, 0);
}

/* Largest |y| in a run of `duration` over that at its start, of a mode on its own. */
static double run_growth(const kt_method *m, kt_complex lambda, double h, double duration) {
    const int steps = (int)ceil(duration / h);
    int stages;
    const kt_complex z = {h * lambda.re, h * lambda.im}, y = stepped(m, z, steps, &stages);
    return hypot(y.re, y.im);
}

/* The step at which runs begin to grow, by bisection of runs. Whole steps: the run is longer by up to one of them. */
KT_TEST(the_largest_step_is_where_runs_begin_to_grow) {
    static const kt_complex modes[] = {{-1000.0, 0.0}, {-5.0, 30.0}, {-0.02, 60.0}, {0.0, 40.0}, {-400.0, 300.0}};
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        kt_worst worst = kt_worst_make(m->name);
        for (int k = 0; k < 5 && goes_by_its_table(m); k++) {
            const double duration = 10.0;
            ptrdiff_t index;
            const double predicted = kt_stability_step(m, &modes[k], 1, duration, KT_STABILITY_GROWTH, &index);
            double low = 0.2 * predicted, high = 5.0 * predicted;
            for (int l = 0; l < 20; l++) {
                const double middle = sqrt(low * high);
                const bool grows = !(run_growth(m, modes[k], middle, duration) <= KT_STABILITY_GROWTH);
                *(grows ? &high : &low) = middle;
            }
            kt_worst_near(&worst, predicted / low, 1.0, 0.005, "%g + %gi: %g s", modes[k].re, modes[k].im, predicted);
        }
        if (goes_by_its_table(m))
            kt_check_worst(&worst);
    }
}

KT_TEST(the_worst_of_many_modes_bounds_the_step) {
    const kt_method *m = kt_method_find("rk4");
    const kt_complex modes[] = {{-1.0, 3.0}, {-100.0, 0.0}, {0.0, 0.0}, {-1.0, -3.0}, {-20.0, 500.0}, {0.0, 1e-9}};
    ptrdiff_t index, alone;
    const double h = kt_stability_step(m, modes, 6, 10.0, 2.0, &index);
    kt_check_equal_int("index", index, 4);
    kt_check_near("its own", h, kt_stability_step(m, modes + 4, 1, 10.0, 2.0, &alone), 1e-12 * h);
}

KT_TEST(modes_that_rest_or_grow_in_truth_bound_no_step) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_complex rest = {0.0, 0.0}, fall = {5.0, 0.0}, rounding[] = {{1e-9, 1e-8}, {-1e-8, 0.0}, {0.0, -1e-8}};
        ptrdiff_t index = 7;
        kt_check_true(kt_method_at(i)->name,
                      kt_stability_step(kt_method_at(i), &rest, 1, 10.0, 2.0, &index) == HUGE_VAL);
        kt_check_equal_int("index", index, -1);
        if (kt_method_stages_vary(kt_method_at(i)))
            continue; /* it takes the size of an eigenvalue for a decay */
        kt_check_true("falls", kt_stability_step(kt_method_at(i), &fall, 1, 10.0, 2.0, &index) == HUGE_VAL);
        const double step = kt_stability_step(kt_method_at(i), rounding, 3, 10.0, 2.0, &index);
        kt_check_above("rounding", step > 1e10 ? 1e10 : step, 1e8);
    }
}

/* ---- verdicts ---------------------------------------------------------------------------------------------------- */

/* Published: Hairer and Wanner IV.3, V.1; of two-step by its choice of rho. */
KT_TEST(verdicts_are_those_published) {
    static const struct {
        const char *name;
        bool a, l;
        double at_infinity;
    } expected[] = {{"implicit-euler", true, true, 0.0}, {"crank-nicolson", true, false, 1.0},
                    {"bdf2", true, true, 0.0},           {"two-step", true, false, 0.6},
                    {"rodas5p", true, true, 0.0},        {"radau5", true, true, 0.0}};
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; i++) {
        const kt_stability s = stability_of(kt_method_find(expected[i].name), 2);
        const kt_stability_verdict verdict = kt_stability_assess(&s);
        kt_check_true(expected[i].name, verdict.a_stable == expected[i].a && verdict.l_stable == expected[i].l);
        kt_check_near("at infinity", verdict.at_infinity, expected[i].at_infinity, 1e-7);
    }
    for (int i = 0; i < kt_method_count(); i++)
        if (!kt_method_is_implicit(kt_method_at(i))) {
            const kt_stability s = stability_of(kt_method_at(i), 10);
            const kt_stability_verdict verdict = kt_stability_assess(&s);
            kt_check_true(kt_method_at(i)->name, !verdict.a_stable && !verdict.l_stable && isinf(verdict.at_infinity));
        }
}

/* Three-step BDF grows near the axis (Dahlquist's second barrier: no method of order 3 is A-stable), and damps
 * infinitely stiff modes. The function
 *     R = (1 + z / 2) / (1 + z / 2 - z^2)
 * has a pole on the left, and |R| < 1 on the axis. */
KT_TEST(methods_that_are_not_a_stable_are_told_from_those_that_are) {
    kt_stability three = stability_of(kt_method_find("bdf2"), 2), pole = stability_of(kt_method_find("radau5"), 2);
    const double bdf[4][2] = {{11.0 / 6.0, -1.0}, {-3.0, 0.0}, {1.5, 0.0}, {-1.0 / 3.0, 0.0}};
    three.steps = 3;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 2; j++)
            three.characteristic[i][j] = bdf[i][j];
    kt_check_true("BDF3", !kt_stability_assess(&three).a_stable && !kt_stability_assess(&three).l_stable);
    kt_check_near("BDF3 at infinity", kt_stability_assess(&three).at_infinity, 0.0, 0.0);
    const double p[] = {1.0, 0.5}, q[] = {1.0, 0.5, -1.0};
    pole.degree = 1;
    pole.poles = 2;
    memcpy(pole.coefficient, p, sizeof p);
    memcpy(pole.denominator, q, sizeof q);
    for (int k = -40; k <= 40; k++)
        if (!(kt_stability_gain(&pole, (kt_complex){0.0, exp(0.2 * k)}) <= 1.0))
            kt_check_true("on the axis", false);
    kt_check_true("a pole on the left", !kt_stability_assess(&pole).a_stable);
}

/* ---- implicit methods -------------------------------------------------------------------------------------------- */

/* A-stable: |R| <= 1 on the left half plane, which by the maximum principle is the imaginary axis; L-stable: R goes to
 * 0. Both to any size of z. */
static void check_a_stable(const char *name, double at_infinity) {
    const kt_stability s = stability_of(kt_method_find(name), 2);
    KT_WORST axis = kt_worst_make("imaginary axis"), left = kt_worst_make("left half plane");
    kt_random random = kt_random_of_test();
    for (int k = 0; k < 2000; k++) {
        const double size = exp(kt_random_uniform(&random, -10.0, 60.0));
        const double angle = kt_random_uniform(&random, 1.5707963267948966, 4.71238898038469);
        const kt_complex z = {size * cos(angle), size * sin(angle)};
        kt_worst_below(&axis, kt_stability_gain(&s, (kt_complex){0.0, size}), 1.0 + 8.0 * DBL_EPSILON, "y = %g", size);
        kt_worst_below(&left, kt_stability_gain(&s, z), 1.0 + 8.0 * DBL_EPSILON, "|z| = %g", size);
    }
    kt_note("%s", name);
    kt_check_near("R(-1e12)", kt_stability_value(&s, (kt_complex){-1e12, 0.0}).re, at_infinity, 1e-11);
    kt_check_true("no limit", kt_stability_real_limit(&s) == HUGE_VAL && kt_stability_imaginary_limit(&s) == HUGE_VAL);
    const kt_complex modes[] = {{-1e9, 0.0}, {0.0, 1e6}, {-1.0, 1e5}};
    ptrdiff_t index = 7;
    kt_check_true("no step", kt_stability_step(kt_method_find(name), modes, 3, 10.0, 2.0, &index) == HUGE_VAL);
    kt_check_equal_int("index", index, -1);
}

KT_TEST(implicit_methods_are_stable_on_the_left_and_all_but_one_damp_what_is_infinitely_stiff) {
    check_a_stable("implicit-euler", 0.0);
    check_a_stable("crank-nicolson", -1.0);
    check_a_stable("radau5", 0.0);
}

/* The functions are 1 / (1 - z) and (1 + z/2) / (1 - z/2), derived by hand. For radau5, R = e^z + O(z^6). */
KT_TEST(rational_functions_are_those_of_the_textbook) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("R");
    const kt_stability euler = stability_of(kt_method_find("implicit-euler"), 2);
    const kt_stability trapezoid = stability_of(kt_method_find("crank-nicolson"), 2);
    const kt_stability radau = stability_of(kt_method_find("radau5"), 2);
    for (int k = 0; k < 100; k++) {
        const double x = kt_random_uniform(&random, -20.0, 0.5), fine = 0.02 * x;
        const kt_complex z = {x, 0.0};
        kt_worst_near(&worst, kt_stability_value(&euler, z).re, 1.0 / (1.0 - x), 1e-14, "Euler, %g", x);
        kt_worst_near(&worst, kt_stability_value(&trapezoid, z).re, (1.0 + 0.5 * x) / (1.0 - 0.5 * x), 1e-14,
                      "trapezoid, %g", x);
        kt_worst_near(&worst, kt_stability_value(&radau, (kt_complex){fine, 0.0}).re, exp(fine),
                      pow(fabs(fine), 6.0) / 7200.0 * 1.5 + 1e-15, "Radau, %g", fine);
    }
}

/* ---- the stabilised family --------------------------------------------------------------------------------------- */

/* Order 2 means R = 1 + z + z^2/2 + O(z^3). The bound of |R| is a + b, near 1 - epsilon/3 = 0.949, up to the reach. The
 * reach is that of the literature. Two stages are all used up by order 2. */
KT_TEST(chebyshev_polynomials_are_damped_up_to_their_reach) {
    static const int stages[] = {2, 3, 4, 5, 7, 10, 20, 50, 100, 250};
    KT_WORST damped = kt_worst_make("|R|"), length = kt_worst_make("reach / 0.653 (s^2 - 1)"),
             second = kt_worst_make("R - 1 - z - z^2/2");
    for (int i = 0; i < 10; i++) {
        const int s = stages[i];
        const kt_chebyshev family = kt_chebyshev_make(s, 2.0 / 13.0);
        const kt_stability r = stability_of(kt_method_find("rkc2"), s);
        const double reach = kt_chebyshev_reach(&family);
        kt_worst_near(&length, reach / (0.653 * ((double)s * s - 1.0)), 1.0, s == 2 ? 0.06 : 0.02, "%d stages", s);
        kt_check_above("real limit", kt_stability_real_limit(&r), reach);
        kt_check_below("which is not far beyond", kt_stability_real_limit(&r), 1.04 * reach + 0.8);
        for (int k = 0; k <= 2000 && s > 2; k++) {
            const double z = -2.0 - (reach - 2.0) * k / 2000.0;
            kt_worst_below(&damped, kt_stability_gain(&r, (kt_complex){z, 0.0}), family.a + family.b + 1e-14 * s,
                           "%d stages, z = %g", s, z);
        }
        if (s > 2)
            kt_check_near("a + b", family.a + family.b, 1.0 - 2.0 / 39.0, 0.02);
        const double z = -1e-3;
        const kt_complex value = kt_stability_value(&r, (kt_complex){z, 0.0});
        kt_worst_below(&second, fabs(value.re - 1.0 - z - z * z / 2.0), 1.7e-10 + 4.0 * s * s * DBL_EPSILON,
                       "%d stages", s);
    }
}

/* For the extrapolated polynomials, R - e^z is no more than a few times the remainder z^5 / 120 of the series. They are
 * damped below 0.74 once e^z is, up to the reach of their members. */
KT_TEST(extrapolated_polynomials_are_of_order_4_and_damped_up_to_their_reach) {
    KT_WORST damped = kt_worst_make("|R|"), fourth = kt_worst_make("R - e^z over z^5 / 120");
    for (int s = 2; s <= KT_STABILISED_STAGES_MAX; s += s < 30 ? 1 : 20) {
        const kt_stability r = stability_of(kt_method_find("rkc4"), s);
        const kt_chebyshev family = kt_chebyshev_make(s, 6.0 / 5.0);
        const double reach = kt_chebyshev_reach(&family), z = -0.05;
        kt_check_above("real limit", kt_stability_real_limit(&r), reach);
        for (int k = 0; k <= 2000; k++) {
            const double x = -1.0 - (reach - 1.0) * pow(k / 2000.0, 2);
            kt_worst_below(&damped, kt_stability_gain(&r, (kt_complex){x, 0.0}), 0.74, "%d stages, z = %g", s, x);
        }
        const kt_complex value = kt_stability_value(&r, (kt_complex){z, 0.0});
        kt_worst_below(&fourth, fabs(value.re - exp(z)) / (pow(0.05, 5) / 120.0), 1.0, "%d stages", s);
    }
}

KT_TEST(stages_are_as_few_as_the_reach_allows) {
    int wrong = 0;
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double z = 0.0; z < 40000.0; z = 1.07 * z + 0.1) {
        const int s = kt_chebyshev_stages(z, 2.0 / 13.0);
        const kt_chebyshev enough = kt_chebyshev_make(s, 2.0 / 13.0),
                           fewer = kt_chebyshev_make(s > 2 ? s - 1 : 2, 2.0 / 13.0);
        wrong += kt_chebyshev_reach(&enough) < z || (s > 2 && kt_chebyshev_reach(&fewer) >= z);
    }
    kt_check_equal_int("wrong", wrong, 0);
    kt_check_equal_int("too far", kt_chebyshev_stages(41500.0, 2.0 / 13.0), KT_STABILISED_STAGES_MAX + 1);
    kt_check_equal_int("infinite", kt_chebyshev_stages(HUGE_VAL, 2.0 / 13.0), KT_STABILISED_STAGES_MAX + 1);
    kt_check_equal_int("NaN", kt_chebyshev_stages((double)NAN, 2.0 / 13.0), KT_STABILISED_STAGES_MAX + 1);
}

/* 250 stages reach 40800 / 1.2 decays. */
KT_TEST(a_stabilised_step_ends_where_its_stages_do) {
    const kt_complex modes[] = {{-2.0, 0.0}, {-5000.0, 0.0}, {-30.0, 0.0}};
    ptrdiff_t index = -1;
    const double h = kt_stability_step(kt_method_find("rkc2"), modes, 3, 10.0, 2.0, &index);
    kt_check_near("h radius", h * 5000.0, 0.653 * 62499.0 / 1.2, 0.01 * 34000.0);
    kt_check_equal_int("index", index, 1);
}

/* Just inside of the imaginary limit, a step keeps a mode within rounding of its size. Just outside, it does not. If
 * the limit is 0, any mode grows. */
KT_TEST(stabilised_methods_have_a_limit_on_the_imaginary_axis_too) {
    static const char *const names[] = {"rkc2", "rkc4"};
    for (int i = 0; i < 2; i++)
        for (int stages = 2; stages <= 12; stages++) {
            const kt_stability s = stability_of(kt_method_find(names[i]), stages);
            const double y = kt_stability_imaginary_limit(&s);
            const double within = kt_stability_gain(&s, (kt_complex){0.0, 0.999 * y});
            const double beyond = kt_stability_gain(&s, (kt_complex){0.0, y > 0.0 ? 1.01 * y : 0.02});
            kt_note("%s, %d stages: %.6f", names[i], stages, y);
            kt_check_near("|R| within", fmax(within, 1.0), 1.0, 64.0 * DBL_EPSILON);
            kt_check_above("|R| - 1 beyond", beyond - 1.0, i == 0 ? 2e-9 : 0.05);
            kt_check_true("rkc4 alone has one", (y > 0.0) == (i == 1));
        }
}

KT_TEST(the_worst_mode_of_a_step_is_the_one_that_grows_most) {
    const kt_method *rk4 = kt_method_find("rk4"), *rkc2 = kt_method_find("rkc2");
    const kt_stability s = stability_of(rk4, 2);
    const kt_complex modes[] = {{-1.0, 3.0}, {-20.0, 500.0}, {-300.0, 0.0}, {0.0, 0.0}}, vast = {-1e200, 1e200};
    ptrdiff_t index = -1;
    const double worst = kt_stability_worst(rk4, modes, 4, 0.01, 1.0, &index);
    kt_check_near("growth", worst, kt_stability_growth(&s, modes[1], 0.01, 1.0), 0.0);
    kt_check_equal_int("index", index, 1);
    kt_check_near("not asked which", kt_stability_worst(rk4, modes, 4, 0.01, 1.0, NULL), worst, 0.0);
    kt_check_near("none grows", kt_stability_worst(rk4, modes, 4, 1e-4, 1.0, &index), 1.0, 0.0);
    kt_check_equal_int("index", index, -1);
    kt_check_true("beyond all numbers", kt_stability_growth(&s, vast, 1.0, 1.0) == HUGE_VAL);
    kt_check_true("beyond all stages", kt_stability_worst(rkc2, modes, 4, 1e3, 1.0, &index) == HUGE_VAL);
    kt_check_equal_int("index", index, 1);
    const double h = kt_stability_step(rk4, modes, 4, 1.0, 2.0, &index);
    kt_check_near("step, not asked which", kt_stability_step(rk4, modes, 4, 1.0, 2.0, NULL), h, 0.0);
    kt_method wrong = *rk4;
    wrong.stages = 0;
    kt_check_near("no method", kt_stability_step(&wrong, modes, 4, 1.0, 2.0, &index), 0.0, 0.0);
    kt_check_equal_int("stages of a tableau", kt_stability_stages(rk4, 1e6), 4);
}

/* Near rest, roundings leave modes of 1e-119 Hz, for example. Their periods take more steps than R(z) has digits. The
 * largest error is that of euler, pi / 0.8 |z| e^(1.5 pi), with |z| = 1e-7 at the most. */
KT_TEST(oscillations_slower_than_rounding_have_no_error) {
    static const char *const methods[] = {"euler", "heun", "rk4", "radau5"};
    KT_WORST worst = kt_worst_make("error of a period");
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++)
        for (double rate = 1e-4; rate > 1e-300; rate *= 0.1) {
            const kt_stability s = stability_of(kt_method_find(methods[i]), 0);
            const double error = kt_stability_period_error(&s, (kt_complex){0.6 * rate, 0.8 * rate}, 1e-3);
            kt_worst_below(&worst, error, 4.5e-5, "%s, %g /s", methods[i], rate);
        }
}
