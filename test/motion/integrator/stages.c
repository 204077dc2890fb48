/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* The error is largest somewhere on the way, not always at the end, where it may pass through zero. */
static double worst_error(const kt_method *method, const problem *p, int steps) {
    kt_integrator *it = integrator_begin(method, p, fixed_step((p->end - p->start) / steps));
    const double worst = error_until_end(it, p);
    kt_check_equal_int("steps", (long long)kt_integrator_counts_of(it).steps, steps);
    return worst;
}

/* The four numbers of steps are the first one and its multiples by 3/2, two and three. They are chosen such that the
 * leading term of the error dominates and rounding is negligible. Up to order 4, the measured slope is within 0.02 of
 * the order. Above, it is within 0.3, because the leading coefficients are so small that the next terms show. A method
 * of four steps begins with half as many steps again. */
static void check_slope(const kt_method *method, const problem *p, const int first_by_order[9]) {
    enum { COUNT = 4 };
    static const int halves[COUNT] = {2, 3, 4, 6};
    double h[COUNT], error[COUNT];
    for (int i = 0; i < COUNT; i++) {
        const int steps = first_by_order[method->order] * halves[i] / 2 * (method->steps > 2 ? 3 : 2) / 2;
        h[i] = (p->end - p->start) / steps;
        error[i] = worst_error(method, p, steps);
    }
    kt_note("%s, %s: errors %.2g ... %.2g", method->name, p->name, error[0], error[COUNT - 1]);
    kt_check_near("order", slope_of(h, error, COUNT), method->order, method->order < 5 ? 0.05 : 0.35);
}

KT_TEST(every_method_has_its_order_on_a_problem_that_is_not_autonomous) {
    static const int first[9] = {0, 8192, 1024, 256, 128, 96, 0, 0, 10};
    for (int i = 0; i < kt_method_count(); i++)
        check_slope(kt_method_at(i), &problem_chirp, first);
}

KT_TEST(every_method_has_its_order_on_an_orbit) {
    static const int first[9] = {0, 32768, 4096, 1024, 1024, 256, 0, 0, 48};
    for (int i = 0; i < kt_method_count(); i++)
        check_slope(kt_method_at(i), &problem_kepler, first);
}

/* With one equation, only the shorter of the two vector loops runs. */
KT_TEST(low_orders_are_measured_on_one_equation_too) {
    static const int first[9] = {0, 8192, 1024, 512, 512};
    for (int i = 0; i < kt_method_count(); i++)
        if (kt_method_at(i)->order < 5)
            check_slope(kt_method_at(i), &problem_tangent, first);
}

/* ---- what is asked of the right-hand side ------------------------------------------------------------------------ */

typedef struct record {
    double t[64];
    int count;
} record;

static int record_times(double t, const double *y, double *dydt, void *user) {
    record *r = user;
    if (r->count < 64)
        r->t[r->count++] = t;
    dydt[0] = cos(t) * y[0];
    return 0;
}

KT_TEST(stages_are_evaluated_at_their_own_times) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (!goes_by_its_table(m)) /* see stabilised.c and radau.c */
            continue;
        record r = {.count = 0};
        kt_integrator *it = integrator_start(m, 1, fixed_step(0.125), record_times, &r, 2.0, (double[]){1.0});
        integrator_step(it, HUGE_VAL);
        kt_check_equal_int(m->name, r.count, m->stages);
        KT_WORST worst = kt_worst_make("time");
        for (int s = 0; s < m->stages; s++)
            kt_worst_near(&worst, r.t[s], 2.0 + 0.125 * m->c[s], 0.0, "stage %d", s + 1);

        r.count = 0;
        integrator_step(it, HUGE_VAL);
        kt_check_equal_int("second step", r.count, m->stages - (m->fsal ? 1 : 0));
    }
}

/* c = 1 means the end of the step itself, also if t + h is rounded otherwise. Only then is a reused last stage equal to
 * the evaluation of a restarted integrator. */
KT_TEST(the_last_stages_are_at_the_very_end) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (!goes_by_its_table(m)) /* see stabilised.c and radau.c */
            continue;
        if (m->c[m->stages - 1] != 1.0)
            continue;
        record r = {.count = 0};
        kt_integrator *it = integrator_start(m, 1, fixed_step(0.1), record_times, &r, 0.7, (double[]){1.0});
        KT_WORST worst = kt_worst_make(m->name);
        for (int k = 0; k < 50; k++) {
            r.count = 0;
            integrator_step(it, HUGE_VAL);
            kt_worst_near(&worst, r.t[r.count - 1], kt_integrator_time(it), 0.0, "step %d", k);
        }
    }
}

/* A negative zero and a large number are finite. */
KT_TEST(the_first_value_that_is_not_finite_is_found) {
    static const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL};
    double values[41];
    KT_WORST found = kt_worst_make("first");
    for (size_t n = 1; n <= 41; n++) {
        for (size_t i = 0; i < n; i++)
            values[i] = i % 3 == 0 ? -0.0 : i % 3 == 1 ? DBL_MAX : -DBL_MAX;
        kt_worst_near(&found, (double)kt_first_not_finite(values, n), (double)n, 0.0, "none of %zu", n);
        for (size_t i = 0; i < n; i++) {
            const double kept = values[i];
            values[i] = bad[i % 3];
            kt_worst_near(&found, (double)kt_first_not_finite(values, n), (double)i, 0.0, "%zu of %zu", i, n);
            values[i] = kept;
        }
    }
}

/* ---- sums -------------------------------------------------------------------------------------------------------- */

/* n uncoupled pendulums: omega' = -sin(phi) cos(t), phi' = omega. */
static int pendulums(double t, const double *y, double *dydt, void *user) {
    const size_t n = *(const size_t *)user;
    for (size_t i = 0; i < n; i++) {
        dydt[i] = y[n + i];
        dydt[n + i] = -sin(y[i]) * cos(t);
    }
    return 0;
}

static void swing(const kt_method *m, size_t n, double *y) {
    kt_integrator *it = integrator_start(m, 2 * n, fixed_step(0.0625), pendulums, &n, 0.0, y);
    integrate_to(it, 2.0);
    memcpy(y, kt_integrator_state(it), 2 * n * sizeof *y);
}

/* The bits do not depend on the loop that computes a component. */
KT_TEST(a_component_has_the_same_bits_whatever_stands_beside_it) {
    enum { MOST = 13 };
    for (int i = 0; i < kt_method_count(); i++) {
        bool same = true;
        if (kt_method_is_implicit(kt_method_at(i))) /* how often it iterates depends on all components */
            continue;
        for (size_t n = 1; n <= MOST; n++) {
            double all[2 * MOST];
            for (size_t j = 0; j < n; j++) {
                all[j] = 0.3 + 0.1 * (double)j;
                all[n + j] = 0.5 - 0.05 * (double)j;
            }
            swing(kt_method_at(i), n, all);
            for (size_t j = 0; j < n; j++) {
                double one[2] = {0.3 + 0.1 * (double)j, 0.5 - 0.05 * (double)j};
                swing(kt_method_at(i), 1, one);
                same = same && one[0] == all[j] && one[1] == all[n + j];
            }
        }
        kt_check_true(kt_method_at(i)->name, same);
    }
}

/* Against long double: three roundings a term, and one each for h and the sum. */
KT_TEST(combinations_are_exact_to_rounding) {
    kt_random random = kt_random_of_test();
    enum { MOST = 37, TERMS = 9 };
    double k[TERMS][MOST], y[MOST], out[MOST];
    double *slopes[TERMS];
    kt_stage_term terms[TERMS];
    KT_WORST worst = kt_worst_make("sum");
    for (size_t n = 1; n <= MOST; n++) {
        for (size_t j = 0; j < TERMS; j++) {
            slopes[j] = k[j];
            terms[j].slot = TERMS - 1 - j;
            terms[j].weight = kt_random_normal(&random);
            for (size_t i = 0; i < n; i++)
                k[j][i] = kt_random_normal(&random);
        }
        for (size_t i = 0; i < n; i++)
            y[i] = kt_random_normal(&random);
        kt_combine(out, y, 0.3, terms, TERMS, slopes, n);
        for (size_t i = 0; i < n; i++) {
            long double sum = 0.0L, size = 0.0L;
            for (size_t j = 0; j < TERMS; j++) {
                const long double term = 0.3L * (long double)terms[j].weight * (long double)k[terms[j].slot][i];
                sum += term;
                size += fabsl(term);
            }
            const double bound = DBL_EPSILON / 2.0 * (TERMS * (double)size + 2.0 * fabs(y[i]));
            kt_worst_near(&worst, out[i], (double)((long double)y[i] + sum), bound, "%zu of %zu", i, n);
        }
    }
}

/* ---- the error estimate ------------------------------------------------------------------------------------------ */

/* Three chirps side by side, so that both loops of the norm have their share: 8 equations and 4. */
enum { CHIRPS = 3, CHIRP = 4, EQUATIONS = CHIRPS * CHIRP };

static int chirps(double t, const double *y, double *dydt, void *user) {
    for (size_t i = 0; i < CHIRPS; i++)
        (void)problem_chirp.rhs(t, y + i * CHIRP, dydt + i * CHIRP, user);
    return 0;
}

static void try_step(kt_integrator *it, const kt_interval *interval, kt_try *result) {
    kt_check_equal_int("try", it->family->try_step(it, interval, result), KT_TRY_PASSED);
    (void)kt_try_check(it, interval, result);
}

/* The norm of the first try, again from the slopes, in long double and in the textbook's order. */
static void check_error_norm(const char *name, const double *absolute_tolerances) {
    const kt_method *m = kt_method_find(name);
    kt_integrator_options options = tolerance(1e-5, 1e-7);
    options.initial_step = 0.0625;
    options.absolute_tolerances = absolute_tolerances;
    double y0[EQUATIONS];
    for (size_t i = 0; i < CHIRPS; i++)
        problem_chirp.solution(0.25, y0 + i * CHIRP);
    kt_integrator *it = integrator_start(m, EQUATIONS, options, chirps, NULL, 0.25, y0);
    kt_try result;
    const kt_interval interval = {0.25, 0.0625, 0.3125, it->y};
    kt_check_equal_int("slope", kt_evaluate(it, 0.25, it->y, 0, &result), KT_TRY_PASSED);
    try_step(it, &interval, &result);

    long double high = 0.0L, low = 0.0L, size = 0.0L;
    for (size_t i = 0; i < EQUATIONS; i++) {
        long double e = 0.0L, e_low = 0.0L, terms = 0.0L;
        for (int j = 0; j < m->stages; j++) {
            const long double k = (long double)it->k[j][i];
            e += (long double)m->e[j] * k;
            terms += fabsl((long double)m->e[j] * k);
            e_low += m->e_low != NULL ? (long double)m->e_low[j] * k : 0.0L;
        }
        const long double scale = (long double)(absolute_tolerances != NULL ? absolute_tolerances[i] : 1e-7) +
                                  1e-5L * fmaxl(fabsl((long double)y0[i]), fabsl((long double)it->trial[i]));
        high += e * e / (scale * scale);
        low += e_low * e_low / (scale * scale);
        size += terms * terms / (scale * scale);
    }
    const long double n = EQUATIONS;
    const long double expected =
        m->e_low == NULL ? 0.0625L * sqrtl(high / n) : 0.0625L * high / sqrtl(n * (high + 0.01L * low));
    /* s roundings of terms that cancel; with two estimates the norm goes with the square of the first. */
    const double cancelled = (double)sqrtl(size / high);
    kt_check_near(name, result.error, (double)expected, m->stages * DBL_EPSILON * cancelled * (double)expected);
}

KT_TEST(the_error_norm_is_that_of_the_textbook) {
    static const double each[EQUATIONS] = {1e-4, 1e-5, 1e-6, 1e-7, 1e-6, 1e-7, 1e-4, 1e-5, 1e-7, 1e-4, 1e-5, 1e-6};
    static const char *const names[] = {"heun", "bs32", "dopri5", "tsit5", "dop853"};
    for (int i = 0; i < 5; i++) {
        check_error_norm(names[i], NULL);
        check_error_norm(names[i], each);
    }
}

/* The estimate scales as err ~ h^k, and the control divides by k:
 *     k = 2, 3, 5, 5, 8 */
KT_TEST(error_estimates_scale_with_their_order) {
    static const char *const names[] = {"heun", "bs32", "dopri5", "tsit5", "dop853"};
    static const double steps[] = {1e-3, 4e-3, 2e-2, 2e-2, 0.06};
    for (int i = 0; i < 5; i++) {
        double h[3], error[3];
        kt_integrator *it = integrator_begin(kt_method_find(names[i]), &problem_chirp, tolerance(0.0, 1e-6));
        for (int l = 0; l < 3; l++) {
            kt_try result;
            h[l] = steps[i] / (1 << l);
            const kt_interval interval = {0.25, h[l], 0.25 + h[l], it->y};
            kt_check_equal_int("slope", kt_evaluate(it, 0.25, it->y, 0, &result), KT_TRY_PASSED);
            try_step(it, &interval, &result);
            error[l] = result.error;
        }
        kt_check_near(names[i], slope_of(h, error, 3), it->error_order, 0.15);
    }
}
