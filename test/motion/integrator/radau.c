/* Features of implicit methods alone: Newton's iteration, its Jacobian, its solver, and stiff equations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/newton.h"

#include <math.h>

static const kt_method *radau(void) { return kt_method_find("radau5"); }

/* ---- stiff equations --------------------------------------------------------------------------------------------- */

/* If h lambda is large, the error is that of the stages. It is h^s / lambda for a stiffly accurate method with s = 3 of
 * them (Hairer and Wanner IV.15). If h lambda is small, the error is h^5. */
KT_TEST(the_order_falls_to_that_of_the_stages_where_the_equation_is_stiff) {
    check_forced_order(radau(), -1.0, 4, 4, 5.0, 0.15);
    check_forced_order(radau(), -1e6, 8, 4, 3.0, 0.15);
}

/* Measured: errors of 0.05 to 0.4 tolerances in 242, 488 and 1067 steps. */
KT_TEST(a_stiff_oscillator_is_integrated_in_few_steps) {
    static const double tolerances[] = {1e-4, 1e-6, 1e-8};
    for (int i = 0; i < 3; i++) {
        const kt_integrator_counts counts = check_stiff_oscillator(radau(), tolerances[i], tolerances[i]);
        kt_check_below("Jacobians, over steps", (double)counts.jacobians / (double)counts.steps, 1.0);
    }
}

/* ---- what a tolerance is ----------------------------------------------------------------------------------------- */

/* Eight reactions of a plant's cells to light (HIRES), stiff, with the solution at t = 321.8122. Source: F. Mazzia, C.
 * Magherini, Test Set for IVP Solvers, release 2.4, 2008. */
static int light_response(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007;
    dydt[1] = 1.71 * y[0] - 8.75 * y[1];
    dydt[2] = -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4];
    dydt[3] = 8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3];
    dydt[4] = -1.745 * y[4] + 0.43 * y[5] + 0.43 * y[6];
    dydt[5] = -280.0 * y[5] * y[7] + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6];
    dydt[6] = 280.0 * y[5] * y[7] - 1.81 * y[6];
    dydt[7] = -dydt[6];
    return 0;
}

static const double light_response_end[] = {0.7371312573325668e-3, 0.1442485726316185e-3, 0.5888729740967575e-4,
                                            0.1175651343283149e-2, 0.2386356198831331e-2, 0.6238968252742796e-2,
                                            0.2849998395185769e-2, 0.2850001604814231e-2};

/* A stiff problem, whose error of the stages has a part. Measured: 0.7 to 5.1 tolerances. */
KT_TEST(errors_of_a_published_stiff_problem_stay_at_a_few_tolerances) {
    const kt_integrator_callbacks callbacks = {light_response, NULL, NULL};
    for (int k = 4; k <= 11; k++) {
        const double tol = pow(10.0, -k), start[8] = {1.0, [7] = 0.0057}, *exact = light_response_end;
        double worst = 0.0;
        kt_error error;
        kt_integrator *it = integrator_make(radau(), 8, tolerance(tol, 1e-4 * tol));
        kt_fine("start", kt_integrator_start(it, 0.0, start, &callbacks, &error), &error);
        integrate_to(it, 321.8122);
        for (int i = 0; i < 8; i++)
            worst = fmax(worst, fabs(kt_integrator_state(it)[i] - exact[i]) / (1e-4 + exact[i]));
        kt_note("tolerance %g: %d evaluations", tol, (int)kt_integrator_counts_of(it).evaluations);
        kt_check_below("error, over the tolerance", worst / tol, 8.0);
    }
}

/* ---- who solves -------------------------------------------------------------------------------------------------- */

/* The caller's solution of the same equations, two of them, and the calls at which it is made to fail. */
typedef struct solver {
    double jacobian[2][2];
    kt_complex sigma[2];
    int jacobians, fail_from, fail_to; /* Jacobians that return `code` */
    int code, factor_code, solve_code;
} solver;

static int own_rhs(double t, const double *y, double *dydt, void *user) {
    (void)user;
    return van_der_pol(t, y, dydt, NULL);
}

static int own_jacobian(double t, const double *y, const double *dydt, void *user) {
    solver *s = user;
    (void)t;
    (void)dydt;
    s->jacobians++;
    if (s->jacobians >= s->fail_from && s->jacobians <= s->fail_to)
        return s->code;
    s->jacobian[0][0] = 0.0;
    s->jacobian[0][1] = 1.0;
    s->jacobian[1][0] = 1e6 * (-2.0 * y[0] * y[1] - 1.0);
    s->jacobian[1][1] = 1e6 * (1.0 - y[0] * y[0]);
    return 0;
}

static int own_factor(kt_complex sigma, void *user) {
    solver *s = user;
    s->sigma[sigma.im != 0.0] = sigma;
    return s->factor_code;
}

static kt_complex product(kt_complex a, kt_complex b) {
    return (kt_complex){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

/* Cramer's rule. */
static int own_solve(double *re, double *im, void *user) {
    const solver *s = user;
    const kt_complex sigma = s->sigma[im != NULL];
    const kt_complex a = {sigma.re - s->jacobian[0][0], sigma.im}, d = {sigma.re - s->jacobian[1][1], sigma.im};
    const kt_complex b = {-s->jacobian[0][1], 0.0}, c = {-s->jacobian[1][0], 0.0};
    const kt_complex x = {re[0], im != NULL ? im[0] : 0.0}, y = {re[1], im != NULL ? im[1] : 0.0};
    const kt_complex ad = product(a, d), bc = product(b, c), dx = product(d, x), by = product(b, y);
    const kt_complex ay = product(a, y), cx = product(c, x), det = {ad.re - bc.re, ad.im - bc.im};
    const double square = det.re * det.re + det.im * det.im;
    const kt_complex inverse = {det.re / square, -det.im / square};
    const kt_complex first = product(inverse, (kt_complex){dx.re - by.re, dx.im - by.im});
    const kt_complex second = product(inverse, (kt_complex){ay.re - cx.re, ay.im - cx.im});
    re[0] = first.re;
    re[1] = second.re;
    if (im != NULL) {
        im[0] = first.im;
        im[1] = second.im;
    }
    return s->solve_code;
}

static const kt_newton own = {own_jacobian, own_factor, own_solve, NULL, NULL};

static kt_integrator *solver_begin(solver *s, double tol) {
    kt_integrator_options options = tolerance(tol, tol);
    options.newton = &own;
    kt_integrator *it = integrator_start(radau(), 2, options, own_rhs, s, 0.0, (double[]){2.0, 0.0});
    return it;
}

KT_TEST(a_caller_may_solve) {
    solver s = {.code = 0};
    kt_integrator *it = solver_begin(&s, 1e-6);
    integrate_to(it, 2.0);
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_check_near("y1", kt_integrator_state(it)[0], 1.706167732170483, 1e-5);
    kt_check_equal_int("Jacobians", (long long)counts.jacobians, s.jacobians);
    kt_check_below("evaluations of a step", (double)counts.evaluations / (double)counts.steps, 16.0);
    kt_integrator_options options = tolerance(1e-6, 1e-6);
    const size_t with = kt_integrator_size_with(radau(), 100, &options);
    options.newton = &own;
    const size_t without = kt_integrator_size_with(radau(), 100, &options);
    kt_check_above("bytes of the matrices that it keeps", (double)(with - without), 4.0 * 100.0 * 100.0 * 8.0);
}

/* From the first or from a later one on: J = 0, or the old one, serves, in shorter steps. */
KT_TEST(a_jacobian_that_cannot_be_computed_for_a_while_is_done_without) {
    static const int from[] = {1, 20};
    for (int i = 0; i < 2; i++) {
        solver s = {.fail_from = from[i], .fail_to = from[i] + 20, .code = 1};
        kt_integrator *it = solver_begin(&s, 1e-6);
        integrate_to(it, 2.0);
        kt_note("from %d on: %d steps, %d rejected", from[i], (int)kt_integrator_counts_of(it).steps,
                (int)kt_integrator_counts_of(it).rejected);
        kt_check_near("y1", kt_integrator_state(it)[0], 1.706167732170483, 1e-5);
    }
}

/* With the Jacobian of the stiff part, iterations of the other part converge only in steps of 1e-5 s. */
KT_TEST(a_jacobian_by_which_iterations_diverge_is_left_out_where_none_can_be_computed) {
    check_lost_jacobian(radau(), 300.0, 1e-6);
}

/* The slope of y1 depends on its ratio to y0:
 *     y1' = 6 - 5 y1 / y0,  y0' = 1
 * From 0 the motion is y1 = y0, and slopes depend only on the direction in which 0 is left. Next to 0 there is no
 * Jacobian. */
static int leaving_rhs(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = 1.0;
    dydt[1] = y[0] > 0.0 ? 6.0 - 5.0 * y[1] / y[0] : 6.0;
    return 0;
}

static int leaving_jacobian(double t, const double *y, const double *dydt, void *user) {
    solver *s = user;
    (void)t;
    (void)dydt;
    s->jacobian[1][0] = 5.0 * y[1] / (y[0] * y[0]);
    s->jacobian[1][1] = -5.0 / y[0];
    return y[0] > 1e-3 ? 0 : 1;
}

/* Iterations without a Jacobian diverge at any step, and need not converge where their corrections are below the
 * tolerance. */
KT_TEST(a_point_whose_slopes_depend_on_the_direction_in_which_it_is_left_is_left) {
    static const kt_newton leaving = {leaving_jacobian, own_factor, own_solve, NULL, NULL};
    for (int k = 6; k <= 12; k += 3) {
        solver s = {.code = 0};
        kt_integrator_options options = tolerance(pow(10.0, -k), pow(10.0, -k));
        options.newton = &leaving;
        kt_integrator *it = integrator_start(radau(), 2, options, leaving_rhs, &s, 0.0, (double[]){0.0, 0.0});
        integrate_to(it, 1e-8);
        const kt_integrator_counts counts = kt_integrator_counts_of(it);
        kt_note("tolerance 1e-%d: %d steps, %d rejected", k, (int)counts.steps, (int)counts.rejected);
        kt_check_near("y1", kt_integrator_state(it)[1], 1e-8, 0.1 * options.absolute_tolerance);
    }
}

KT_TEST(a_stop_of_any_part_of_the_solution_stops_the_step_and_changes_nothing) {
    for (int part = 0; part < 3; part++) {
        kt_error error;
        solver s = {.fail_to = 0}, undisturbed = s;
        kt_integrator *it = solver_begin(&s, 1e-6), *other = solver_begin(&undisturbed, 1e-6);
        for (int k = 0; k < 10; k++) {
            integrator_step(it, 2.0);
            integrator_step(other, 2.0);
        }
        it->history[offsetof(kt_newton_memory, requested) / sizeof(double)] = 1.0;
        other->history[offsetof(kt_newton_memory, requested) / sizeof(double)] = 1.0;
        if (part == 0)
            s.fail_from = s.jacobians + 1, s.fail_to = s.jacobians + 1, s.code = -4;
        *(part == 1 ? &s.factor_code : &s.solve_code) = part == 0 ? 0 : -4;
        const double t = kt_integrator_time(it);
        kt_check_equal_int("stopped", kt_integrator_step(it, 2.0, &error), KT_ERROR_CALLBACK);
        kt_check_contains("words", error.message, "stopped (code -4)");
        kt_check_near("time", kt_integrator_time(it), t, 0.0);
        s.factor_code = s.solve_code = 0;
        for (int k = 0; k < 5; k++) {
            integrator_step(it, 2.0);
            integrator_step(other, 2.0);
        }
        kt_check_equal_bits("state", kt_integrator_state(it), kt_integrator_state(other), 2);
    }
}

KT_TEST(half_a_solver_is_rejected) {
    kt_error error;
    const kt_newton half = {own_jacobian, NULL, own_solve, NULL, NULL};
    kt_integrator_options options = tolerance(1e-6, 1e-6);
    options.newton = &half;
    kt_integrator *it = NULL;
    char memory[64];
    kt_check_equal_int("status", kt_integrator_init(memory, sizeof memory, radau(), 2, &options, &it, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "newton needs all of jacobian, factor and solve");
}

/* ---- the iteration ----------------------------------------------------------------------------------------------- */

/* A slope that is infinite at 0, where Newton's iteration does not settle:
 *     y' = -sign(y) |y|^(1/3) 1e6 */
static int kinked(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = -1e6 * cbrt(y[0]);
    return 0;
}

KT_TEST(a_fixed_step_whose_iteration_does_not_converge_fails_with_words) {
    kt_error error;
    kt_integrator *it = integrator_start(radau(), 1, fixed_step(1.0), kinked, NULL, 0.0, (double[]){1.0});
    kt_check_equal_int("status", kt_integrator_step(it, HUGE_VAL, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message, "Newton's iteration did not converge: after ");
    kt_check_contains("words", error.message, "take a smaller step");
    kt_check_near("state", kt_integrator_state(it)[0], 1.0, 0.0);
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_check_below("evaluations", (double)counts.evaluations, 2.0 + 3.0 * KT_NEWTON_ITERATIONS_FIXED);
}

/* The Jacobian of the stiff part makes corrections a hundred thousand times too small. Judged by the rate of the step
 * before, the first correction would do. */
KT_TEST(a_stiff_force_that_has_gone_is_noticed_by_the_iteration) {
    double lambda = -1e5;
    kt_integrator *it = integrator_start(radau(), 1, tolerance(1e-6, 1e-6), forced, &lambda, 0.0, (double[]){0.0});
    integrate_to(it, 1.0);
    lambda = -1.0;
    const uint64_t jacobians = kt_integrator_counts_of(it).jacobians;
    double worst = 0.0;
    while (kt_integrator_time(it) < 3.0 && integrator_step(it, 3.0))
        worst = fmax(worst, fabs(kt_integrator_state(it)[0] - sin(kt_integrator_time(it))));
    kt_check_above("Jacobians since", (double)(kt_integrator_counts_of(it).jacobians - jacobians), 1.0);
    kt_check_below("error", worst, 1e-5);
}

/* A mass of 1 kg on stiff ground, lifted by a force that grows:
 *     z'' = 18 t - 10 - 5 z' + N
 * Below 0 the ground acts as a contact:
 *     N = 1e9 (-z)^1.2 max(0, 1 - 150 z')
 * The mass bounces a few times, comes to rest, and is let go. */
static int lifted(double t, const double *y, double *dydt, void *user) {
    const double depth = -y[0];
    (void)user;
    dydt[0] = y[1];
    dydt[1] = 18.0 * t - 10.0 - 5.0 * y[1];
    if (depth > 0.0)
        dydt[1] += 1e9 * pow(depth, 1.2) * fmax(0.0, 1.0 - 150.0 * y[1]);
    return 0;
}

/* A mass on a spring that is a million times stiffer on one side, with a damper that is, too, under 5 cos 3t. */
static int bilinear(double t, const double *y, double *dydt, void *user) {
    const double stiffness = y[0] < 0.0 ? 1e8 : 100.0, damping = y[0] < 0.0 ? 1e4 : 1.0;
    (void)user;
    dydt[0] = y[1];
    dydt[1] = -5.0 * cos(3.0 * t) - stiffness * y[0] - damping * y[1];
    return 0;
}

/* The lifted mass, and one on a stiff and turning spring that is bent as it moves: its corrections are larger. */
static int accompanied(double t, const double *y, double *dydt, void *user) {
    const double off = y[2] + y[2] * y[2] * y[2] - sin(4.0 * t);
    dydt[2] = y[3];
    dydt[3] = -1e5 * (1.0 + 0.5 * y[2]) * off - 2e3 * y[3];
    return lifted(t, y, dydt, user);
}

typedef struct release {
    const char *name;
    int (*f)(double t, const double *y, double *dydt, void *user);
    size_t n;
    double start[4], end;
    double bounds[2]; /* of the speed at the end, in tolerances, with radau5 and rodas5p */
} release;

static double speed_after(const release *r, const char *name, double tol) {
    kt_integrator *it = integrator_start(kt_method_find(name), r->n, tolerance(tol, tol), r->f, NULL, 0.0, r->start);
    integrate_to(it, r->end);
    const double speed = kt_integrator_state(it)[1];
    return speed;
}

/* The matrix hides the rest of the force. The test runs 81 tolerances. At 3 to 22 of them, masses stayed in place or
 * were flung away. Their errors were up to 18,000 tolerances. With rodas5p, the same happened at 25 to 30 tolerances.
 * Errors were up to 37,000 tolerances. */
KT_TEST(a_stiff_force_that_lets_go_within_a_step_is_noticed) {
    enum { COUNT = 81 };
    static const char *const names[] = {"radau5", "rodas5p"};
    static const release releases[] = {{"lifted", lifted, 2, {-2e-5, 0.0}, 1.0, {10.0, 20.0}},
                                       {"lifted from rest", lifted, 2, {-2.1544e-7, 0.0}, 1.0, {10.0, 20.0}},
                                       {"bilinear", bilinear, 2, {0.1, 0.0}, 1.6, {10.0, 30.0}},
                                       {"accompanied", accompanied, 4, {-2.1544e-7, 0.0, 0.0, 4.0}, 1.0, {50.0, 20.0}}};
    for (size_t k = 0; k < 2 * sizeof releases / sizeof *releases; k++) {
        const release *r = &releases[k / 2];
        const double expected = speed_after(r, "dop853", 1e-12);
        KT_WORST off = kt_worst_make("speed off, over the tolerance");
        kt_note("%s, %s: %.9g m/s", r->name, names[k % 2], expected);
        for (int i = 0; i < COUNT; i++) {
            const double tol = pow(10.0, -5.0 - 0.05 * i), speed = speed_after(r, names[k % 2], tol);
            kt_worst_below(&off, fabs(speed - expected) / tol, r->bounds[k % 2], "tolerance %g", tol);
        }
    }
}

/* The stiff direction n turns, and y stays with g:
 *     y' = g' - lambda n n' (y - g),  n = (cos 3t, sin 3t),  g = (cos t, sin 2t)
 * The length of a step in which Newton's iteration converges depends on the angle by which n turns in it. It does not
 * depend on the error. */
static int turning(double t, const double *y, double *dydt, void *user) {
    const double n[2] = {cos(3.0 * t), sin(3.0 * t)}, off[2] = {y[0] - cos(t), y[1] - sin(2.0 * t)};
    const double pull = -1e5 * (n[0] * off[0] + n[1] * off[1]);
    (void)user;
    dydt[0] = -sin(t) + pull * n[0];
    dydt[1] = 2.0 * cos(2.0 * t) + pull * n[1];
    return 0;
}

/* Before the control knew the rate, three of five tries were in vain, and the evaluations 1.45 times as many. */
KT_TEST(steps_grow_no_further_than_the_iteration_bears) {
    static const double tolerances[] = {1e-3, 1e-5, 1e-7};
    for (int i = 0; i < 3; i++) {
        kt_integrator *it = integrator_start(radau(), 2, tolerance(tolerances[i], tolerances[i]), turning, NULL, 0.0,
                                             (double[]){1.0, 0.0});
        integrate_to(it, 10.0);
        const kt_integrator_counts counts = kt_integrator_counts_of(it);
        kt_note("tolerance %g: %d steps, %d rejected, %d evaluations", tolerances[i], (int)counts.steps,
                (int)counts.rejected, (int)counts.evaluations);
        kt_check_near("y2", kt_integrator_state(it)[1], sin(20.0), 10.0 * tolerances[i]);
        kt_check_below("rejected, over steps", (double)counts.rejected / (double)counts.steps, 0.3);
    }
}

/* The equations y' = t and y' = cos t start from 0. Nothing there indicates how large y will be. The slope of the first
 * does not indicate it either. */
static int from_rest(double t, const double *y, double *dydt, void *user) {
    (void)y;
    dydt[0] = *(const int *)user == 0 ? t : cos(t);
    return 0;
}

KT_TEST(fixed_steps_begin_at_a_state_of_zeros) {
    for (int i = 0; i < kt_method_count(); i++)
        for (int k = 0; k < 2 && kt_method_is_implicit(kt_method_at(i)); k++) {
            kt_integrator *it =
                integrator_start(kt_method_at(i), 1, fixed_step(0.0625), from_rest, &k, 0.0, (double[]){0.0});
            integrate_to(it, 1.0);
            const int order = kt_method_at(i)->order;
            const double bound = order == 1 ? 0.04 : k == 0 ? 1e-14 : order < 5 ? 0.01 : 1e-9;
            kt_check_near(kt_method_at(i)->name, kt_integrator_state(it)[0], k == 0 ? 0.5 : sin(1.0), bound);
        }
}

/* Linear equations with one Jacobian and one pair of factors for all steps. */
KT_TEST(fixed_steps_of_a_linear_equation_factor_once) {
    double lambda = -100.0;
    kt_integrator *it = integrator_start(radau(), 1, fixed_step(0.03125), forced, &lambda, 0.0, (double[]){0.5});
    integrate_to(it, 2.0);
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_check_equal_int("steps", (long long)counts.steps, 64);
    kt_check_equal_int("Jacobians", (long long)counts.jacobians, 1);
    kt_check_equal_int("factorizations, real and complex", (long long)counts.factorizations, 2);
}

/* Quadratures change no bit of the others, and end where the same equations with a part in the error do. */
static int with_quadrature(double t, const double *y, double *dydt, void *user) {
    (void)user;
    van_der_pol(t, y, dydt, NULL);
    dydt[2] = y[0] * y[0];
    return 0;
}

KT_TEST(quadratures_have_no_part_in_the_iteration) {
    const double start[3] = {2.0, 0.0, 0.0};
    kt_integrator_options options = tolerance(1e-7, 1e-7);
    kt_integrator *plain = integrator_start(radau(), 2, options, van_der_pol, NULL, 0.0, start);
    kt_integrator *all = integrator_start(radau(), 3, options, with_quadrature, NULL, 0.0, start);
    options.quadratures = 1;
    kt_integrator *it = integrator_start(radau(), 3, options, with_quadrature, NULL, 0.0, start);
    integrate_to(plain, 2.0);
    integrate_to(all, 2.0);
    integrate_to(it, 2.0);
    kt_check_equal_bits("the others", kt_integrator_state(it), kt_integrator_state(plain), 2);
    kt_check_near("quadrature", kt_integrator_state(it)[2], kt_integrator_state(all)[2], 1e-5);
}
