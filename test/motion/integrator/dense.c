/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

/* ---- order ------------------------------------------------------------------------------------------------------- */

enum { PLACES = 7 };

/* Largest error at seven places within one step from the exact state. */
static double error_within_a_step(const kt_method *m, const problem *p, double t0, double h) {
    double y[PROBLEM_MAX], worst = 0.0;
    p->solution(t0, y);
    kt_integrator *it = integrator_start(m, p->n, fixed_step(h), p->rhs, NULL, t0, y);
    integrator_step(it, HUGE_VAL);
    for (int i = 1; i <= PLACES; i++) {
        const double t = t0 + h * i / (PLACES + 1);
        integrator_value(it, t, y);
        worst = fmax(worst, error_at(p, t, y));
    }
    return worst;
}

/* One step is off by h^(q + 1) inside, if the dense output is of order q. Measured: the slope is within 0.09. */
KT_TEST(dense_output_has_its_order_within_a_step) {
    static const double steps[] = {0.0, 1e-3, 4e-3, 8e-3, 0.02, 0.0, 0.0, 0.2}; /* twice the longest */
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const int q = kt_method_dense_order(m);
        double h[4], error[4];
        for (int l = 0; l < 4; l++) {
            h[l] = steps[q] / (2 + l);
            error[l] = error_within_a_step(m, &problem_chirp, 0.7, h[l]);
        }
        kt_note("%s: errors %.2g ... %.2g", m->name, error[0], error[3]);
        kt_check_near("slope", slope_of(h, error, 4), q + 1, 0.1);
    }
}

/* The times of the records are independent of the steps. The records are off by as much as the steps are: of the
 * method's own order p, since q + 1 >= p. */
static double worst_record(const kt_method *m, const problem *p, int steps) {
    kt_integrator *it = integrator_begin(m, p, fixed_step((p->end - p->start) / steps));
    double y[PROBLEM_MAX], worst = 0.0;
    int records = 0;
    while (kt_integrator_time(it) != p->end && integrator_step(it, p->end))
        for (; p->start + 0.00137 * records <= kt_integrator_time(it); records++) {
            const double t = p->start + 0.00137 * records;
            integrator_value(it, t, y);
            worst = fmax(worst, error_at(p, t, y));
        }
    kt_check_equal_int("steps", (long long)kt_integrator_counts_of(it).steps, steps);
    return worst;
}

KT_TEST(records_have_the_order_of_the_method) {
    static const int first[9] = {0, 8192, 1024, 256, 128, 192, 0, 0, 16};
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        double h[3], error[3];
        for (int l = 0; l < 3; l++) {
            const int steps = first[m->order] * (l + 2) / 2;
            h[l] = (problem_chirp.end - problem_chirp.start) / steps;
            error[l] = worst_record(m, &problem_chirp, steps);
        }
        kt_note("%s: errors %.2g ... %.2g", m->name, error[0], error[2]);
        kt_check_near("slope", slope_of(h, error, 3), m->order, 0.1);
    }
}

/* ---- ends and continuity ----------------------------------------------------------------------------------------- */

static kt_integrator *begin_adaptive(const char *name, double tol) {
    return integrator_begin(kt_method_find(name), &problem_kepler, tolerance(tol, tol));
}

KT_TEST(values_at_the_ends_are_the_states_to_the_bit) {
    for (int i = 0; i < kt_method_count(); i++) {
        kt_integrator *it = integrator_begin(kt_method_at(i), &problem_kepler, fixed_step(0.05));
        double y0[4], y1[4], y[4];
        integrator_value(it, 0.0, y);
        kt_check_equal_bits("start", y, kt_integrator_state(it), 4);
        integrator_step(it, HUGE_VAL);
        memcpy(y0, kt_integrator_state(it), sizeof y0);
        integrator_step(it, HUGE_VAL);
        memcpy(y1, kt_integrator_state(it), sizeof y1);
        integrator_value(it, kt_integrator_previous_time(it), y);
        kt_check_equal_bits("begin", y, y0, 4);
        integrator_value(it, kt_integrator_time(it), y);
        kt_check_equal_bits("end", y, y1, 4);
        const kt_method *m = kt_method_at(i);
        if (goes_by_its_table(m))
            kt_check_equal_int("evaluations", (long long)kt_integrator_counts_of(it).evaluations,
                               2 * (m->stages - m->fsal) + m->fsal);
    }
}

/* Near the ends the value is y0 + theta h f and y1 - (1 - theta) h f to the next order. In the middle the two sums
 * meet. */
/* The dense output of rkc4 is made of the states of its stages, and needs no slope. */
static bool is_made_of_states(const kt_method *m) { return strcmp(m->name, "rkc4") == 0; }

KT_TEST(dense_output_is_continuous_with_its_slope) {
    for (int i = 0; i < kt_method_count(); i++) {
        kt_integrator *it = integrator_begin(kt_method_at(i), &problem_kepler, fixed_step(0.25));
        integrator_step(it, HUGE_VAL);
        integrator_step(it, HUGE_VAL);
        double y[4], z[4], f0[4], f1[4];
        const double *y0 = it->previous_y, *y1 = it->y, d = 1e-6;
        problem_kepler.rhs(0.25, y0, f0, NULL);
        problem_kepler.rhs(0.5, y1, f1, NULL);
        KT_WORST ends = kt_worst_make(kt_method_at(i)->name), middle = kt_worst_make("in the middle");
        integrator_value(it, 0.25 + d, y);
        integrator_value(it, 0.5 - d, z);
        /* d^2 y'' / 2 with y'' up to 7 here. After a step of implicit Euler, which falls inwards, y'' is up to 16. */
        double bound = (strcmp(kt_method_at(i)->name, "implicit-euler") == 0 ? 8.0 : 3.5) * d * d;
        if (kt_method_at(i)->gamma != NULL) /* its slopes are of order 4 in h, and not evaluated; measured: 2.1e-4 */
            bound += 0.1 * pow(0.25, 4) * d;
        if (is_made_of_states(kt_method_at(i))) /* of order 3, measured: 2.7e-9 */
            bound += 0.5 * pow(0.25, 3) * d;
        for (int l = 0; l < 4; l++) {
            kt_worst_near(&ends, y[l], y0[l] + d * f0[l], bound, "begin %d", l);
            kt_worst_near(&ends, z[l], y1[l] - d * f1[l], bound, "end %d", l);
        }
        integrator_value(it, 0.375, y);
        integrator_value(it, nextafter(0.375, 1.0), z);
        for (int l = 0; l < 4; l++) /* rounding of about ten terms of size 1 */
            kt_worst_near(&middle, z[l], y[l], 8.0 * DBL_EPSILON, "component %d", l);
    }
}

/* ---- what it costs ----------------------------------------------------------------------------------------------- */

KT_TEST(interpolation_changes_no_bit_of_the_motion) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_integrator_options options = kt_method_at(i)->e != NULL ? tolerance(1e-6, 1e-6) : fixed_step(0.02);
        kt_integrator *silent = integrator_begin(kt_method_at(i), &problem_kepler, options);
        kt_integrator *asked = integrator_begin(kt_method_at(i), &problem_kepler, options);
        for (int k = 0; k < 40; k++) {
            double y[4];
            integrator_step(silent, 60.0);
            integrator_step(asked, 60.0);
            const double t0 = kt_integrator_previous_time(asked), h = kt_integrator_time(asked) - t0;
            for (int l = 0; l < k % 4; l++)
                integrator_value(asked, t0 + 0.3 * l * h, y);
        }
        kt_check_equal_bits(kt_method_at(i)->name, kt_integrator_state(asked), kt_integrator_state(silent), 4);
        kt_check_near("time", kt_integrator_time(asked), kt_integrator_time(silent), 0.0);
    }
}

/* Ten values in each of ten steps: f at the ends, which all but the last step need anyway, and dop853's three stages.
 */
KT_TEST(interpolation_evaluates_no_more_than_it_needs) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (!goes_by_its_table(m)) /* see stabilised.c and radau.c */
            continue;
        kt_integrator *it = integrator_begin(m, &problem_kepler, fixed_step(0.02));
        for (int k = 0; k < 10; k++) {
            double y[4];
            integrator_step(it, HUGE_VAL);
            for (int l = 0; l < 10; l++) {
                const double t = kt_integrator_previous_time(it) + 0.0019 * (l + 0.5);
                integrator_value(it, t, y);
            }
        }
        const int expected = 10 * (m->stages - (m->fsal ? 1 : 0) + m->dense_stages) + 1;
        kt_check_equal_int(m->name, (long long)kt_integrator_counts_of(it).evaluations, expected);
    }
}

/* All slopes forgotten: a cubic needs those at the ends, the others the stages too. */
KT_TEST(what_was_forgotten_is_evaluated_once) {
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        kt_integrator *it = integrator_begin(m, &problem_kepler, fixed_step(0.02));
        integrator_step(it, HUGE_VAL);
        kt_integrator_poison(it, 0xFF);
        double y[4];
        const long long before = (long long)kt_integrator_counts_of(it).evaluations;
        for (int l = 1; l < 4; l++)
            integrator_value(it, 0.005 * l, y);
        const int expected = kt_method_is_implicit(m) || is_made_of_states(m) ? 0
                             : m->dense_terms == 0                            ? 2
                                                                              : m->stages + !m->fsal + m->dense_stages;
        kt_check_equal_int(m->name, (long long)kt_integrator_counts_of(it).evaluations - before, expected);
    }
}

KT_TEST(times_outside_of_the_last_step_are_rejected) {
    kt_error error;
    kt_integrator *it = begin_adaptive("dopri5", 1e-6);
    double y[4] = {1.0, 2.0, 3.0, 4.0};
    const double kept[4] = {1.0, 2.0, 3.0, 4.0};
    kt_check_equal_int("before any step", kt_integrator_interpolate(it, 0.1, y, &error), KT_ERROR_ARGUMENT);
    integrate_to(it, 1.0);
    const double t0 = kt_integrator_previous_time(it);
    const double outside[] = {nextafter(t0, 0.0), nextafter(1.0, 2.0), (double)NAN, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 5; i++) {
        kt_check_equal_int("outside", kt_integrator_interpolate(it, outside[i], y, &error), KT_ERROR_ARGUMENT);
        kt_check_contains("words", error.message, "is outside of the last step, from ");
    }
    kt_check_equal_bits("output untouched", y, kept, 4);
}

KT_TEST(values_are_had_in_steps_that_go_backwards) {
    const char *const names[] = {"rk4", "dopri5", "dop853"};
    static const double bounds[] = {1e-8, 5e-11, 1e-15}; /* measured: 1.6e-9, 1.0e-11, 1.4e-16 */
    for (int i = 0; i < 3; i++) {
        double y[4];
        problem_kepler.solution(1.0, y);
        kt_integrator *it =
            integrator_start(kt_method_find(names[i]), 4, fixed_step(0.02), problem_kepler.rhs, NULL, 1.0, y);
        integrator_step(it, 0.0);
        integrator_value(it, 0.987, y);
        kt_check_below(names[i], error_at(&problem_kepler, 0.987, y), bounds[i]);
    }
}

/* A right-hand side that fails while a value is interpolated. */
static int failing(double t, const double *y, double *dydt, void *user) {
    const int *code = user;
    return *code != 0 ? *code : problem_kepler.rhs(t, y, dydt, NULL);
}

KT_TEST(a_failed_value_leaves_the_output_and_the_motion) {
    kt_error error;
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (m->fsal || kt_method_is_implicit(m) || is_made_of_states(m))
            continue; /* has all it needs */
        int code = 0;
        double start[4], y[4] = {1.0, 2.0, 3.0, 4.0};
        const double kept[4] = {1.0, 2.0, 3.0, 4.0};
        problem_kepler.solution(0.0, start);
        const kt_integrator_options options = fixed_step(0.1);
        const kt_integrator_callbacks callbacks = {failing, NULL, &code};
        kt_integrator *it = integrator_make(m, 4, options), *other = integrator_begin(m, &problem_kepler, options);
        kt_fine("start", kt_integrator_start(it, 0.0, start, &callbacks, &error), &error);
        integrator_step(it, HUGE_VAL);
        code = 2;
        kt_check_equal_int(m->name, kt_integrator_interpolate(it, 0.05, y, &error), KT_ERROR_CALLBACK);
        code = -2;
        kt_check_equal_int(m->name, kt_integrator_interpolate(it, 0.05, y, &error), KT_ERROR_CALLBACK);
        kt_check_equal_bits("output untouched", y, kept, 4);
        code = 0;
        integrator_step(it, HUGE_VAL);
        integrate_to(other, 0.2);
        kt_check_equal_bits("state", kt_integrator_state(it), kt_integrator_state(other), 4);
    }
}

/* A right-hand side that stops after so many evaluations. */
static int stopping(double t, const double *y, double *dydt, void *user) {
    int *left = user;
    return (*left)-- <= 0 ? -2 : problem_kepler.rhs(t, y, dydt, NULL);
}

/* The method dop853 has stages that only its values need. After a restore, all stages of a step are evaluated again. */
KT_TEST(a_stop_at_any_stage_of_a_value_leaves_the_output_and_the_motion) {
    static const char *const names[] = {"dopri5", "tsit5", "dop853"};
    for (int i = 0; i < 3; i++) {
        kt_error error;
        const kt_method *m = kt_method_find(names[i]);
        int left = INT_MAX, stops = 0, wrong = 0;
        double start[4], saved[4], previous[4], y[4] = {1.0, 2.0, 3.0, 4.0}, value[4];
        const double kept[4] = {1.0, 2.0, 3.0, 4.0};
        problem_kepler.solution(0.0, start);
        const kt_integrator_options options = fixed_step(0.1);
        const kt_integrator_callbacks callbacks = {stopping, NULL, &left};
        kt_integrator *it = integrator_make(m, 4, options), *other = integrator_make(m, 4, options);
        kt_fine("start", kt_integrator_start(it, 0.0, start, &callbacks, &error), &error);
        integrator_step(it, HUGE_VAL);
        integrator_value(it, 0.05, value);
        kt_integrator_memory memory;
        double history[2];
        kt_integrator_save(it, &memory, saved, previous, history);
        for (;; stops++) {
            kt_fine("restore", kt_integrator_restore(other, &memory, saved, previous, history, &callbacks, &error),
                    &error);
            left = stops;
            const kt_status status = kt_integrator_interpolate(other, 0.05, y, &error);
            if (status == KT_OK || stops > 2 * m->stages)
                break;
            wrong += status != KT_ERROR_CALLBACK || !same_bits(y, kept, 4);
        }
        kt_check_equal_int(m->name, stops, m->stages + m->dense_stages + (m->fsal ? 0 : 1));
        kt_check_equal_int("stops that were not heeded, or left something", wrong, 0);
        kt_check_equal_bits("value in the end", y, value, 4);
    }
}
