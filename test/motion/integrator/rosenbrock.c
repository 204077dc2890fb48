/* Features of Rosenbrock methods alone: their conditions and transformed table, an exact Jacobian, the slope in time,
 * stiff equations, quadratures. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/rosenbrock.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { S = KT_ROSENBROCK_STAGES };

static const kt_method *rodas(void) { return kt_method_find("rodas5p"); }

/* ---- the table --------------------------------------------------------------------------------------------------- */

/* U = Gamma k: a Gamma = alpha, (1 / gamma - C) Gamma = 1, m Gamma = b, and the row sums of Gamma. */
KT_TEST(the_transformed_table_is_that_of_the_method) {
    const kt_method *m = rodas();
    const kt_rosenbrock *r = m->transformed;
    KT_WORST worst = kt_worst_make("defect over terms");
    for (int i = 0; i < S; i++) {
        double sum = 0.0;
        for (int j = 0; j < S; j++) {
            double alpha = 0.0, unit = 0.0, size = 1.0;
            for (int k = 0; k < S; k++) {
                const double gamma = m->gamma[k * S + j],
                             inverse = (i == k ? 1.0 / m->gamma[0] : 0.0) - r->coupling[i][k];
                alpha += r->a[i][k] * gamma;
                unit += inverse * gamma;
                size += fabs(inverse * gamma) + fabs(r->a[i][k] * gamma);
            }
            sum += m->gamma[i * S + j];
            kt_worst_near(&worst, alpha / size, m->a[i * S + j] / size, 4.0 * DBL_EPSILON, "a, %d %d", i, j);
            kt_worst_near(&worst, unit / size, (i == j ? 1.0 : 0.0) / size, 4.0 * DBL_EPSILON, "C, %d %d", i, j);
        }
        kt_worst_near(&worst, r->gamma_sum[i], sum, 16.0 * DBL_EPSILON, "gamma, %d", i);
        double b = 0.0, size = 1.0;
        for (int k = 0; k < S; k++) {
            b += r->m[k] * m->gamma[k * S + i];
            size += fabs(r->m[k] * m->gamma[k * S + i]);
        }
        kt_worst_near(&worst, b / size, m->b[i] / size, 4.0 * DBL_EPSILON, "m, %d", i);
        kt_worst_near(&worst, i == S - 1 ? 1.0 : 0.0, r->m[i] - (i < S - 1 ? r->a[S - 1][i] : 0.0), 0.0,
                      "stiffly accurate, %d", i);
    }
}

KT_TEST(any_change_of_gamma_is_rejected) {
    kt_error error;
    double gamma[S * S];
    kt_method m = *rodas();
    m.gamma = gamma;
    KT_WORST worst = kt_worst_make("rejected");
    for (int i = 0; i < S * S; i++) {
        memcpy(gamma, rodas()->gamma, sizeof gamma);
        gamma[i] += 1e-12;
        kt_worst_near(&worst, kt_method_check(&m, &error), KT_ERROR_ARGUMENT, 0.0, "gamma[%d]", i);
    }
    gamma[3] = (double)NAN;
    kt_check_equal_int("not finite", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "a coefficient is not finite");
}

/* ---- stiff equations --------------------------------------------------------------------------------------------- */

/* Steinebach's condition of order 4 for this equation: the order falls by one only, and over lambda not at all. */
KT_TEST(the_order_falls_by_one_where_the_equation_is_stiff) {
    check_forced_order(rodas(), -1.0, 4, 3, 5.0, 0.2);
    check_forced_order(rodas(), -1e3, 24, 3, 4.0, 0.6);
}

KT_TEST(a_stiff_oscillator_is_integrated_in_few_steps) {
    static const double tolerances[] = {1e-4, 1e-6};
    for (int i = 0; i < 2; i++) {
        const kt_integrator_counts counts = check_stiff_oscillator(rodas(), tolerances[i], 4.0 * tolerances[i]);
        kt_check_equal_int("Jacobians", (long long)counts.jacobians, (long long)counts.steps);
        kt_check_equal_int("factors", (long long)counts.factorizations, (long long)(counts.steps + counts.rejected));
    }
}

KT_TEST(the_stability_function_is_that_of_an_l_stable_method) {
    kt_stability s = {0};
    kt_error error;
    kt_fine("made", kt_stability_make(rodas(), 0, &s, &error), &error);
    kt_check_equal_int("degree", s.degree, 7);
    kt_check_equal_int("poles", s.poles, 8);
    KT_WORST axis = kt_worst_make("imaginary axis");
    for (int k = -400; k <= 1200; k++)
        kt_worst_below(&axis, kt_stability_gain(&s, (kt_complex){0.0, exp(0.02 * k)}), 1.0 + 1e-12, "%d", k);
    kt_check_near("at infinity", kt_stability_gain(&s, (kt_complex){-1e14, 0.0}), 0.0, 1e-11);
    /* For linear equations the order is 6, one more than for others. */
    double h[3], defect[3];
    for (int l = 0; l < 3; l++) {
        h[l] = 0.2 / (1 << l);
        const kt_complex r = kt_stability_value(&s, (kt_complex){0.0, h[l]});
        defect[l] = hypot(r.re - cos(h[l]), r.im - sin(h[l]));
    }
    kt_check_near("linear order + 1", slope_of(h, defect, 3), 7.0, 0.1);
}

/* ---- who solves -------------------------------------------------------------------------------------------------- */

/* y' = lambda(t) y with lambda = -cos t / 2, or the same at t = 0 alone, solved by the caller. */
typedef struct solver {
    double jacobian, sigma;
    bool is_autonomous;
    int jacobians, fail_from, factor_code;
} solver;

static double rate_of(const solver *s, double t) { return -0.5 * (s->is_autonomous ? 1.0 : cos(t)); }

static int own_rhs(double t, const double *y, double *dydt, void *user) {
    dydt[0] = rate_of(user, t) * y[0];
    return 0;
}

static int own_jacobian(double t, const double *y, const double *dydt, void *user) {
    solver *s = user;
    (void)y;
    (void)dydt;
    if (++s->jacobians > s->fail_from)
        return 1;
    s->jacobian = rate_of(s, t);
    return 0;
}

static int own_factor(kt_complex sigma, void *user) {
    solver *s = user;
    s->sigma = sigma.re;
    return s->factor_code;
}

static int own_solve(double *re, double *im, void *user) {
    const solver *s = user;
    (void)im;
    re[0] /= s->sigma - s->jacobian;
    return 0;
}

static bool own_autonomous(void *user) { return ((const solver *)user)->is_autonomous; }

static const kt_newton own = {own_jacobian, own_factor, own_solve, own_autonomous, NULL};

static kt_integrator *solver_begin(solver *s, double step) {
    kt_integrator_options options = fixed_step(step);
    options.newton = &own;
    kt_integrator *it = integrator_start(rodas(), 1, options, own_rhs, s, 0.0, (double[]){1.0});
    return it;
}

/* Prothero and Robinson's equation solved by the caller. The caller supplies its slope in time, or returns `known`
 * instead. */
typedef struct driven {
    double lambda, sigma, offset;
    int known;
} driven;

static int driven_rhs(double t, const double *y, double *dydt, void *user) {
    return forced(t, y, dydt, &((driven *)user)->lambda);
}

static int driven_jacobian(double t, const double *y, const double *dydt, void *user) {
    (void)t, (void)y, (void)dydt, (void)user;
    return 0;
}

static int driven_factor(kt_complex sigma, void *user) {
    ((driven *)user)->sigma = sigma.re;
    return 0;
}

static int driven_solve(double *re, double *im, void *user) {
    const driven *s = user;
    (void)im;
    re[0] /= s->sigma - s->lambda;
    return 0;
}

static int driven_slope(double t, const double *y, const double *dydt, double *slope, void *user) {
    const driven *s = user;
    (void)y, (void)dydt;
    kt_check_near("is zero before", slope[0], 0.0, 0.0);
    slope[0] = s->known == 0 ? -s->lambda * cos(t) - sin(t) + s->offset : 1e9;
    return s->known;
}

static const kt_newton driven_newton = {driven_jacobian, driven_factor, driven_solve, NULL, driven_slope};

static double driven_error(driven *s, int steps, kt_integrator_counts *counts, kt_status *status) {
    kt_error error;
    kt_integrator_options options = fixed_step(1.5 / steps);
    options.newton = &driven_newton;
    kt_integrator *it = integrator_start(rodas(), 1, options, driven_rhs, s, 0.25, (double[]){sin(0.25)});
    double worst = 0.0;
    *status = KT_OK;
    while (*status == KT_OK && kt_integrator_time(it) < 1.75) {
        *status = kt_integrator_step(it, 1.75, &error);
        worst = fmax(worst, fabs(kt_integrator_state(it)[0] - sin(kt_integrator_time(it))));
    }
    if (*status != KT_OK)
        kt_check_contains("words", error.message, "the slope in time stopped (code -3)");
    *counts = kt_integrator_counts_of(it);
    return worst;
}

/* A derivative of the caller is used, at the cost of one evaluation. Otherwise a difference is used, at the cost of
 * two. A slope of another equation shows. If lambda is large, the three are the same: the last stages leave the slope
 * out. */
KT_TEST(a_slope_in_time_that_is_known_is_taken) {
    static const struct {
        double offset;
        int known, evaluations;
    } cases[] = {{0.0, 0, 9}, {0.0, 1, 10}, {0.5, 0, 9}, {0.0, -3, 0}};
    double error[4];
    for (int k = 0; k < 4; k++) {
        driven s = {.lambda = -1.0, .offset = cases[k].offset, .known = cases[k].known};
        kt_integrator_counts counts;
        kt_status status;
        error[k] = driven_error(&s, 12, &counts, &status);
        kt_check_equal_int("status", status, k < 3 ? KT_OK : KT_ERROR_CALLBACK);
        if (k < 3)
            kt_check_equal_int("evaluations", (long long)counts.evaluations, cases[k].evaluations * 12);
    }
    kt_note("errors %.2g known, %.2g by the difference, %.2g of a wrong one", error[0], error[1], error[2]);
    kt_check_near("difference", error[1] / error[0], 1.0, 0.01);
    kt_check_above("wrong", error[2] / error[0], 100.0);
}

/* The difference has two times within the step. If these round to its start, the slope changes no digit of the step. */
KT_TEST(a_step_of_a_few_roundings_needs_no_slope_in_time) {
    static const double roundings[] = {1.0, 8.0, 64.0, 500.0, 600.0, 2000.0};
    for (size_t k = 0; k < sizeof roundings / sizeof *roundings; k++) {
        driven s = {.lambda = -1.0, .known = 1};
        kt_integrator_options options = fixed_step(0.1);
        options.newton = &driven_newton;
        const double end = 0.25 + roundings[k] * 0.25 * DBL_EPSILON;
        kt_integrator *it = integrator_start(rodas(), 1, options, driven_rhs, &s, 0.25, (double[]){sin(0.25)});
        integrator_step(it, end);
        kt_check_near("time", kt_integrator_time(it), end, 0.0);
        kt_check_near("y", kt_integrator_state(it)[0], sin(end), DBL_EPSILON);
    }
}

/* y' = lambda (y - sin s) + cos s with s = t - 2^30, whose solution is sin s. */
static int late_rhs(double t, const double *y, double *dydt, void *user) {
    const double s = t - ldexp(1.0, 30), lambda = *(const double *)user;
    dydt[0] = lambda * (y[0] - sin(s)) + cos(s);
    return 0;
}

/* Times are multiples of 2^-22 s, and a step has 256 of them. The bound is the change of the solution in half of such a
 * time. Without the slope in time, the error is 5e-7. */
KT_TEST(steps_of_many_roundings_have_a_slope_in_time) {
    const double start = ldexp(1.0, 30), h = ldexp(1.0, -14);
    kt_integrator_options options = fixed_step(h);
    double lambda = -1e4;
    kt_integrator *it = integrator_start(rodas(), 1, options, late_rhs, &lambda, start, (double[]){0.0});
    integrate_to(it, start + 1024.0 * h);
    kt_check_near("y", kt_integrator_state(it)[0], sin(1024.0 * h), ldexp(1.0, -23));
}

/* A step takes eight evaluations, and two more for the slope in time. With the slope the order is 5. For a linear
 * equation that does not depend on time, the order is 6. */
KT_TEST(the_slope_in_time_is_asked_for_where_there_is_one) {
    for (int k = 0; k < 2; k++) {
        double h[3], error[3];
        for (int l = 0; l < 3; l++) {
            solver s = {.is_autonomous = k == 0, .fail_from = 1000};
            h[l] = 0.5 / (1 << l);
            kt_integrator *it = solver_begin(&s, h[l]);
            integrate_to(it, 2.0);
            const kt_integrator_counts counts = kt_integrator_counts_of(it);
            kt_check_equal_int("evaluations", (long long)counts.evaluations,
                               (long long)counts.steps * (k == 0 ? 8 : 10));
            error[l] = fabs(kt_integrator_state(it)[0] - exp(k == 0 ? -1.0 : -0.5 * sin(2.0)));
        }
        kt_note("errors %.2g ... %.2g", error[0], error[2]);
        kt_check_near(k == 0 ? "order, autonomous" : "order", slope_of(h, error, 3), k == 0 ? 6.0 : 5.0, 0.3);
    }
}

/* The Jacobian fails from the second on: the first one serves, or none, each such step is counted, and the order is
 * lost. */
KT_TEST(an_old_jacobian_serves_and_is_counted) {
    double h[3], error[3];
    for (int l = 0; l < 3; l++) {
        solver s = {.fail_from = 1};
        h[l] = 0.05 / (1 << l);
        kt_integrator *it = solver_begin(&s, h[l]);
        integrate_to(it, 2.0);
        const kt_integrator_counts counts = kt_integrator_counts_of(it);
        kt_check_equal_int("counted", (long long)counts.capped, (long long)counts.steps - 1);
        error[l] = fabs(kt_integrator_state(it)[0] - exp(-0.5 * sin(2.0)));
    }
    kt_note("errors %.2g ... %.2g", error[0], error[2]);
    kt_check_below("order", slope_of(h, error, 3), 4.0);
    kt_check_below("error", error[2], 2e-9);
}

/* With the Jacobian of the stiff part the other part takes 7e5 evaluations, and ends 0.04 off. */
KT_TEST(an_old_jacobian_that_misleads_is_left_out) { check_lost_jacobian(rodas(), 5e3, 1e-5); }

KT_TEST(a_singular_matrix_is_told) {
    kt_error error;
    solver s = {.fail_from = 1000, .factor_code = 1};
    kt_integrator *it = solver_begin(&s, 0.1);
    kt_check_equal_int("status", kt_integrator_step(it, HUGE_VAL, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message,
                      "the matrix of a linearly implicit step is singular; take a smaller step");
    kt_check_near("state", kt_integrator_state(it)[0], 1.0, 0.0);
}

/* ---- quadratures ------------------------------------------------------------------------------------------------- */

/* y' = -sin t y, z' = y^2: y = exp(cos t - 1), and z once more with a part in the Jacobian. */
static int with_quadrature(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = -sin(t) * y[0];
    dydt[1] = y[0] * y[0];
    return 0;
}

KT_TEST(quadratures_have_order_4_and_change_nothing) {
    double h[3], defect[3], inner[3], z[2];
    const double start[2] = {1.0, 0.0};
    for (int l = 0; l < 3; l++) {
        h[l] = 0.25 / (1 << l);
        kt_integrator_options options = fixed_step(h[l]);
        kt_integrator *all = integrator_start(rodas(), 2, fixed_step(1.0 / 512.0), with_quadrature, NULL, 0.0, start);
        kt_integrator *plain = integrator_start(rodas(), 2, options, with_quadrature, NULL, 0.0, start);
        options.quadratures = 1;
        kt_integrator *it = integrator_start(rodas(), 2, options, with_quadrature, NULL, 0.0, start);
        integrate_to(it, 2.0);
        integrate_to(plain, 2.0);
        integrate_to(all, 2.0 - 0.4 * h[l]);
        integrator_value(it, 2.0 - 0.4 * h[l], z);
        inner[l] = fabs(z[1] - kt_integrator_state(all)[1]);
        integrate_to(all, 2.0);
        defect[l] = fabs(kt_integrator_state(it)[1] - kt_integrator_state(all)[1]);
        /* Both find the Jacobian by differences. Only the column of y matters to y. */
        kt_check_near("the other", kt_integrator_state(it)[0], kt_integrator_state(plain)[0], 0.0);
    }
    kt_note("errors %.2g ... %.2g, within a step %.2g ... %.2g", defect[0], defect[2], inner[0], inner[2]);
    kt_check_above("order", slope_of(h, defect, 3), 3.8);
    kt_check_above("order within a step", slope_of(h, inner, 3), 3.8);
}
