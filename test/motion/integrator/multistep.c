/* Features of multistep methods alone: past states, their start, weights, characteristic polynomials. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/multistep.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const char *const names[] = {"bdf2", "two-step", "ab2", "ab4"};
enum { NAMES = 4, IMPLICIT = 2 };

static kt_method two_step_of(double rho) {
    kt_method m = *kt_method_find("two-step");
    m.rho = rho;
    return m;
}

/* ---- weights and order ------------------------------------------------------------------------------------------- */

KT_TEST(weights_at_rho_0_are_those_of_bdf2_and_at_rho_1_damp_nothing) {
    const kt_multistep bdf = kt_multistep_of(kt_method_find("bdf2"));
    const double expected[] = {4.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0, 0.0, 0.0};
    const double found[] = {bdf.past[1], bdf.past[2], bdf.slopes[0], bdf.slopes[1], bdf.slopes[2]};
    for (int i = 0; i < 5; i++)
        kt_check_near("BDF2 [MSD 5.6]", found[i], expected[i], 2.0 * DBL_EPSILON);
    const kt_method one = two_step_of(1.0);
    const kt_multistep w = kt_multistep_of(&one);
    kt_check_near("a_1", w.past[1], 0.0, 0.0);
    kt_check_near("b_1 over b_0", w.slopes[1] / w.slopes[0], 2.0, 0.0);
    kt_check_near("b_2 over b_0", w.slopes[2] / w.slopes[0], 1.0, 0.0);
}

/* [MSD 5.7 .. 5.14]: y = t^q, put into the formula. And not q = p + 1, so that the condition can fail. */
KT_TEST(polynomials_up_to_the_order_are_integrated_exactly) {
    for (int i = 0; i < NAMES; i++) {
        const kt_method *m = kt_method_find(names[i]);
        const kt_multistep w = kt_multistep_of(m);
        for (int q = 0; q <= m->order + 1; q++) {
            double sum = 0.0, predicted = pow(-1.0, q);
            for (int j = 0; j <= w.steps; j++) {
                const double slope = q == 0 ? 0.0 : q * pow(-j, q - 1);
                sum += w.past[j] * pow(-j, q) + w.slopes[j] * slope;
                predicted += j > 0 ? w.predictor[j] * (q == 0 ? 0.0 : q * pow(-j, q - 1)) : 0.0;
            }
            const double exact = q == 0 ? 1.0 : 0.0;
            if (q <= m->order)
                kt_check_near(m->name, sum, exact, 64.0 * DBL_EPSILON);
            else
                kt_check_above("beyond the order", fabs(sum - exact), 0.01);
            if (q <= m->order && m->predictor != NULL)
                kt_check_near("predictor", predicted, exact, 64.0 * DBL_EPSILON);
        }
    }
}

KT_TEST(wrong_weights_are_rejected_with_words) {
    kt_error error;
    double slopes[KT_METHOD_STEPS_MAX + 1], predictor[KT_METHOD_STEPS_MAX];
    for (int part = 0; part < 2; part++) {
        kt_method m = *kt_method_find("ab4");
        memcpy(slopes, m.slopes, sizeof slopes);
        memcpy(predictor, m.predictor, sizeof predictor);
        *(part == 0 ? &slopes[2] : &predictor[2]) += 1e-9;
        m.slopes = slopes;
        m.predictor = predictor;
        kt_check_equal_int("status", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
        kt_check_contains("words", error.message,
                          part == 0 ? "the multistep method does not integrate t^1"
                                    : "the predictor does not integrate t^1");
    }
    for (int i = 0; i < 3; i++) {
        static const double wrong[] = {-0.1, 1.1, (double)NAN};
        const kt_method m = two_step_of(wrong[i]);
        kt_check_equal_int("status", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
        kt_check_contains("words", error.message, "rho, the spectral radius at infinity, must be 0 to 1");
    }
    kt_method m = two_step_of(0.5);
    m.steps = 3;
    kt_check_equal_int("steps", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    m = *kt_method_find("ab2");
    m.predictor = NULL;
    kt_check_equal_int("no predictor", kt_method_check(&m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "a corrector needs its predictor");
}

/* ---- a caller's rho ---------------------------------------------------------------------------------------------- */

static double error_of(const kt_method *m, int steps) {
    kt_integrator *it =
        integrator_begin(m, &problem_chirp, fixed_step((problem_chirp.end - problem_chirp.start) / steps));
    return error_until_end(it, &problem_chirp);
}

KT_TEST(a_caller_chooses_rho_and_every_one_has_order_two) {
    for (int i = 0; i <= 4; i++) {
        const kt_method m = two_step_of(0.25 * i);
        double h[3], error[3];
        for (int l = 0; l < 3; l++) {
            h[l] = 1.0 / (512 << l);
            error[l] = error_of(&m, 512 << l);
        }
        kt_note("rho = %g: errors %.2g ... %.2g", m.rho, error[0], error[2]);
        kt_check_near("order", slope_of(h, error, 3), 2.0, 0.05);
    }
    const kt_method none = two_step_of(0.0);
    kt_check_near("rho = 0 is bdf2", error_of(&none, 64), error_of(kt_method_find("bdf2"), 64), 0.0);
}

/* ---- the start, and steps of another length ---------------------------------------------------------------------- */

/* Stops after every three steps and a half: the step before the stop and the one after it are short. */
static double error_with_stops(const kt_method *m, int steps, uint64_t *evaluations) {
    const problem *p = &problem_chirp;
    const double h = (p->end - p->start) / steps;
    kt_integrator *it = integrator_begin(m, p, fixed_step(h));
    double worst = 0.0;
    for (int k = 1; kt_integrator_time(it) < p->end; k++) {
        const double stop = fmin(p->start + 3.5 * k * h, p->end);
        while (kt_integrator_time(it) < stop && integrator_step(it, stop))
            worst = fmax(worst, error_at(p, kt_integrator_time(it), kt_integrator_state(it)));
    }
    *evaluations = kt_integrator_counts_of(it).evaluations;
    return worst;
}

KT_TEST(the_order_stays_where_steps_are_cut_short) {
    for (int i = 0; i < NAMES; i++) {
        const kt_method *m = kt_method_find(names[i]);
        const int first = m->order == 4 ? 126 : 1022;
        double h[3], error[3];
        uint64_t evaluations;
        for (int l = 0; l < 3; l++) {
            h[l] = 1.0 / (first * (l + 1));
            error[l] = error_with_stops(m, first * (l + 1), &evaluations);
        }
        kt_note("%s: errors %.2g ... %.2g", m->name, error[0], error[2]);
        kt_check_near("order", slope_of(h, error, 3), m->order, 0.1);
    }
}

/* They start by the table until there are past slopes. Then they take two evaluations a step. After a jump they start
 * once more. */
KT_TEST(adams_methods_start_by_their_table_and_after_a_jump_again) {
    for (int i = IMPLICIT; i < NAMES; i++) {
        const kt_method *m = kt_method_find(names[i]);
        kt_integrator *it = integrator_begin(m, &problem_kepler, fixed_step(0.01));
        kt_error error;
        double y[4];
        long long expected = 0;
        for (int k = 0; k < 12; k++) {
            if (k == 8) {
                memcpy(y, kt_integrator_state(it), sizeof y);
                kt_fine("jump", kt_integrator_jump(it, y, &error), &error);
            }
            integrator_step(it, HUGE_VAL);
            expected += k % 8 < m->steps - 1 ? m->stages : 2;
            kt_check_equal_int(m->name, (long long)kt_integrator_counts_of(it).evaluations, expected);
        }
    }
}

/* The first step of the implicit methods is that of the table's method. It has order 2 and is L-stable, so it damps
 * stiff components. */
KT_TEST(the_first_step_of_an_implicit_one_has_the_order_and_damps) {
    for (int i = 0; i < IMPLICIT; i++) {
        double h[3], error[3];
        for (int l = 0; l < 3; l++) {
            h[l] = 0.02 / (1 << l);
            kt_integrator *it = integrator_begin(kt_method_find(names[i]), &problem_chirp, fixed_step(h[l]));
            integrate_to(it, problem_chirp.start + h[l]);
            error[l] = error_at(&problem_chirp, kt_integrator_time(it), kt_integrator_state(it));
        }
        kt_check_near(names[i], slope_of(h, error, 3), 3.0, 0.1);
    }
}

/* ---- stiff equations --------------------------------------------------------------------------------------------- */

/* y' = lambda (y - sin t) + cos t, y = sin t (Prothero and Robinson). */
/* A multistep method has no stages of lower order: its error is that of its weights over lambda, some h^2 / |lambda|.
 * The method that starts it has such stages. The error of the first step is some h / |lambda|, and decays by the
 * spectral radius a step. From t = 1 on this error has gone. The one-step methods of one implicit stage are alike:
 * their weights' error over lambda. */
KT_TEST(the_order_does_not_fall_where_the_equation_is_stiff) {
    static const char *const of[] = {"bdf2", "two-step", "crank-nicolson", "implicit-euler"};
    static const int orders[] = {2, 2, 2, 1};
    for (int i = 0; i < 4; i++) {
        double h[4], error[4];
        for (int l = 0; l < 4; l++) {
            double lambda = -1e6;
            h[l] = 1.5 / (32 << l);
            kt_integrator *it = integrator_start(kt_method_find(of[i]), 1, fixed_step(h[l]), forced, &lambda, 0.25,
                                                 (double[]){sin(0.25)});
            error[l] = 0.0;
            while (kt_integrator_time(it) < 1.75 && integrator_step(it, 1.75))
                if (kt_integrator_time(it) > 1.0)
                    error[l] = fmax(error[l], fabs(kt_integrator_state(it)[0] - sin(kt_integrator_time(it))));
        }
        kt_note("%s: errors %.2g ... %.2g", of[i], error[0], error[3]);
        kt_check_above("order", slope_of(h, error, 4), orders[i] - 0.1);
        kt_check_below("error over h^p / |lambda|", error[3] / pow(h[3], orders[i]) * 1e6, 2.0);
    }
}

/* The two matrices, of the start and of later steps, once each. */
KT_TEST(fixed_steps_of_a_linear_equation_factor_twice) {
    for (int i = 0; i < IMPLICIT; i++) {
        double lambda = -100.0;
        kt_integrator *it =
            integrator_start(kt_method_find(names[i]), 1, fixed_step(0.03125), forced, &lambda, 0.0, (double[]){0.5});
        integrate_to(it, 2.0);
        kt_check_equal_int("factorizations", (long long)kt_integrator_counts_of(it).factorizations, 2);
        kt_check_equal_int("Jacobians", (long long)kt_integrator_counts_of(it).jacobians, 1);
    }
}

/* ---- linear stability -------------------------------------------------------------------------------------------- */

/* y' = lambda y, y complex. */
static int turn_and_decay(double t, const double *y, double *dydt, void *user) {
    const kt_complex *lambda = user;
    (void)t;
    dydt[0] = lambda->re * y[0] - lambda->im * y[1];
    dydt[1] = lambda->im * y[0] + lambda->re * y[1];
    return 0;
}

static kt_stability stability_of(const kt_method *m) {
    kt_error error;
    kt_stability s = {0};
    kt_fine(m->name, kt_stability_make(m, 0, &s, &error), &error);
    return s;
}

/* The states of `count` steps of size 1 from 1. */
static void states_of(const kt_method *m, kt_complex z, int count, double (*y)[2]) {
    kt_integrator *it = integrator_start(m, 2, fixed_step(1.0), turn_and_decay, &z, 0.0, (double[]){1.0, 0.0});
    for (int k = 0; k < count; k++) {
        memcpy(y[k], kt_integrator_state(it), sizeof y[k]);
        integrator_step(it, HUGE_VAL);
    }
}

/* sum_i c_i(z) y_(k-i) = 0 for steps really taken, to rounding of its terms. */
KT_TEST(the_characteristic_polynomial_is_the_recurrence_of_the_steps) {
    kt_random random = kt_random_of_test();
    for (int i = 0; i < NAMES; i++) {
        const kt_method *m = kt_method_find(names[i]);
        const kt_stability s = stability_of(m);
        KT_WORST worst = kt_worst_make(m->name);
        for (int l = 0; l < 100; l++) {
            const double size = kt_random_uniform(&random, 0.1, 3.0), angle = kt_random_uniform(&random, 1.6, 4.7);
            const kt_complex z = {size * cos(angle), size * sin(angle)};
            double y[12][2];
            states_of(m, z, 12, y);
            double re = 0.0, im = 0.0, terms = 0.0;
            for (int j = 0; j <= m->steps; j++) {
                const double *c = s.characteristic[j], *u = y[11 - j];
                const double a = c[0] + c[1] * z.re + c[2] * (z.re * z.re - z.im * z.im);
                const double b = c[1] * z.im + 2.0 * c[2] * z.re * z.im;
                re += a * u[0] - b * u[1];
                im += a * u[1] + b * u[0];
                terms += (fabs(c[0]) + fabs(c[1]) * size + fabs(c[2]) * size * size) * hypot(u[0], u[1]);
            }
            kt_worst_below(&worst, hypot(re, im) / terms, 64.0 * DBL_EPSILON, "z = %g + %gi", z.re, z.im);
        }
    }
}

/* The mean growth of 100 steps far beyond the region. */
KT_TEST(modes_grow_as_the_largest_root) {
    static const kt_complex z[] = {{-3.0, 0.0}, {-2.0, 2.0}, {0.3, 2.5}};
    for (int i = IMPLICIT; i < NAMES; i++)
        for (int l = 0; l < 3; l++) {
            const kt_method *m = kt_method_find(names[i]);
            const kt_stability s = stability_of(m);
            double y[200][2];
            states_of(m, z[l], 200, y);
            const double growth = log(hypot(y[199][0], y[199][1]) / hypot(y[99][0], y[99][1])) / 100.0;
            kt_check_near(m->name, growth, log(kt_stability_gain(&s, z[l])), 2e-14);
        }
}

/* The root of the motion is e^z up to the error of a step, C z^(p + 1). C is the error constant of the method (HNW
 * III.2). For the fourth-order Adams-Moulton method it is -19/720. */
KT_TEST(the_principal_root_is_the_motion_to_the_order) {
    for (int i = 0; i < NAMES; i++) {
        const kt_method *m = kt_method_find(names[i]);
        const kt_stability s = stability_of(m);
        double h[3], error[3];
        for (int l = 0; l < 3; l++) {
            h[l] = 0.05 / (1 << l);
            const kt_complex r = kt_stability_value(&s, (kt_complex){0.3 * h[l], h[l]});
            const double size = exp(0.3 * h[l]);
            error[l] = hypot(r.re - size * cos(h[l]), r.im - size * sin(h[l]));
        }
        kt_check_near(m->name, slope_of(h, error, 3), m->order + 1, 0.1);
    }
}

/* At z = -2, the polynomial p of ab2 has the root 1:
 *     p(xi) = xi^2 - (1 + z + 3 z^2 / 4) xi + z^2 / 4
 * The limit of ab4 is published as some -1.25 (J. D. Lambert, Numerical Methods for Ordinary Differential Systems,
 * 1991, section 4.3). Here runs on both sides determine it. On the imaginary axis, |xi| is found from the roots in 40
 * digits. For ab2,
 *     |xi| - 1 = -y^4 / 4
 * For ab4 it is 0.16 y^6, so this method is not stable there. */
KT_TEST(limits_of_the_adams_methods_are_where_runs_begin_to_grow) {
    static double y[400][2];
    const kt_stability two = stability_of(kt_method_find("ab2")), four = stability_of(kt_method_find("ab4"));
    const double limits[] = {kt_stability_real_limit(&two), kt_stability_imaginary_limit(&two),
                             kt_stability_real_limit(&four)};
    static const double grown[] = {1e12, 100.0, 2.0}; /* in 200 steps a little beyond the limit */
    kt_check_near("ab2, real", limits[0], 2.0, 2e-14);
    kt_check_near("ab4, real", limits[2], 1.25, 0.05);
    kt_check_near("ab4, imaginary", kt_stability_imaginary_limit(&four), 0.0, 0.0);
    kt_check_near("ab4, 0.1i", kt_stability_gain(&four, (kt_complex){0.0, 0.1}) - 1.0, 1.58693e-7, 1e-11);
    kt_check_near("ab2, 0.1i", kt_stability_gain(&two, (kt_complex){0.0, 0.1}) - 1.0, -2.47538e-5, 1e-10);
    for (int i = 0; i < 3; i++)
        for (int side = 0; side < 2; side++) {
            const double at = limits[i] * (side == 0 ? 0.99 : 1.01);
            const kt_complex z = {i == 1 ? 0.0 : -at, i == 1 ? at : 0.0};
            states_of(kt_method_find(i == 2 ? "ab4" : "ab2"), z, 400, y);
            const double growth = hypot(y[399][0], y[399][1]) / hypot(y[199][0], y[199][1]);
            kt_note("%s, %g + %gi", i == 2 ? "ab4" : "ab2", z.re, z.im);
            if (side == 0)
                kt_check_below("within", growth, 1.0);
            else
                kt_check_above("beyond", growth, grown[i]);
        }
}

/* A-stable for every rho, and with the spectral radius rho at infinity; L-stable for rho = 0 alone. */
KT_TEST(two_step_methods_are_a_stable_and_have_their_radius_at_infinity) {
    kt_random random = kt_random_of_test();
    for (int i = 0; i <= 4; i++) {
        const kt_method m = two_step_of(0.25 * i);
        const kt_stability s = stability_of(&m);
        const double bound = i < 4 ? 1.0 + 1e-13 : 1.0 + 1e-7; /* of rho = 1 a double root at infinity: sqrt(eps) */
        KT_WORST left = kt_worst_make("left half plane");
        for (int k = 0; k < 1000; k++) {
            const double size = exp(kt_random_uniform(&random, -5.0, 30.0));
            const double angle = kt_random_uniform(&random, 1.5707963267948966, 4.71238898038469);
            kt_worst_below(&left, kt_stability_gain(&s, (kt_complex){size * cos(angle), size * sin(angle)}), bound,
                           "z = %g at %g", size, angle);
            kt_worst_below(&left, kt_stability_gain(&s, (kt_complex){0.0, size}), bound, "y = %g", size);
        }
        /* A double root: the remaining 1 / z moves it by its square root. */
        kt_check_near("radius at infinity", kt_stability_gain(&s, (kt_complex){-1e14, 0.0}), m.rho,
                      i % 4 == 0 ? 1e-6 : 4e-13);
    }
}
