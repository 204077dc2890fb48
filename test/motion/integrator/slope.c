/* The slope at the present state: evaluated once, and by nobody again. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include <math.h>
#include <string.h>

enum { STEPS = 7 };

/* Steps of `method`. On request the slope is evaluated after each, and values within the step before it. */
typedef struct looks {
    bool slope, within;
} looks;

typedef struct traced {
    double y[PROBLEM_MAX], within[STEPS][PROBLEM_MAX];
    uint64_t evaluations;
    long wrong; /* slopes that are not f(t, y) to the bit */
} traced;

static traced trace(const kt_method *method, const kt_integrator_options *options, looks look) {
    const problem *p = &problem_chirp;
    traced out = {.wrong = 0};
    kt_error error;
    kt_integrator *it = integrator_begin(method, p, *options);
    for (int k = 0; k < STEPS; k++) {
        double expected[PROBLEM_MAX];
        const double *slope = NULL;
        if (look.slope && kt_fine("slope", kt_integrator_derivative(it, &slope, &error), &error)) {
            (void)p->rhs(kt_integrator_time(it), kt_integrator_state(it), expected, NULL);
            out.wrong += !same_bits(slope, expected, p->n);
        }
        if (!integrator_step(it, HUGE_VAL))
            break;
        const double mid = 0.5 * (kt_integrator_previous_time(it) + kt_integrator_time(it));
        if (look.slope && k % 2 == 1) /* before the values, too */
            out.wrong += !kt_fine("slope", kt_integrator_derivative(it, &slope, &error), &error);
        if (look.within)
            (void)integrator_value(it, mid, out.within[k]);
    }
    memcpy(out.y, kt_integrator_state(it), p->n * sizeof(double));
    out.evaluations = kt_integrator_counts_of(it).evaluations;
    return out;
}

/* A fixed step and an adaptive one. The counts are compared before the last slope is evaluated. */
KT_TEST(slope_is_evaluated_once_and_moves_no_bit) {
    long compared = 0, different = 0, wrong = 0, more = 0;
    for (int m = 0; m < kt_method_count(); m++) {
        const kt_method *method = kt_method_at(m);
        for (int adaptive = 0; adaptive < 2; adaptive++) {
            const kt_integrator_options options = adaptive ? tolerance(1e-5, 1e-5) : fixed_step(0.05);
            if (adaptive && method->embedded_order == 0)
                continue;
            for (int within = 0; within < 2; within++) {
                const traced with = trace(method, &options, (looks){true, within == 1});
                const traced without = trace(method, &options, (looks){false, within == 1});
                const int64_t added = (int64_t)with.evaluations - (int64_t)without.evaluations;
                if (added != 0)
                    kt_note("%s: %lld evaluations more", method->name, (long long)added);
                more += added != 0;
                different += !same_bits(with.y, without.y, PROBLEM_MAX);
                different += !same_bits(with.within[0], without.within[0], (size_t)STEPS * PROBLEM_MAX);
                wrong += with.wrong;
                compared++;
            }
        }
    }
    kt_check_above("runs compared", (double)compared, 30.0);
    kt_check_equal_int("runs with evaluations more", more, 0);
    kt_check_equal_int("runs that differ", different, 0);
    kt_check_equal_int("slopes that are not those of the state", wrong, 0);
}

static int reject(double t, const double *y, double *dydt, void *user) {
    (void)t, (void)y;
    dydt[0] = 1.0;
    return *(int *)user;
}

KT_TEST(slope_that_cannot_be_had_leaves_the_integrator_as_it_was) {
    const double start = 0.0, *slope = NULL;
    int answer = -3;
    kt_error error;
    const kt_integrator_callbacks callbacks = {reject, NULL, &answer};
    kt_integrator *it = integrator_make(kt_method_find("rk4"), 1, fixed_step(0.1));
    kt_check_equal_int("not started", kt_integrator_derivative(it, &slope, &error), KT_ERROR_ARGUMENT);
    (void)kt_fine("start", kt_integrator_start(it, 0.0, &start, &callbacks, &error), &error);
    kt_check_equal_int("rejected", kt_integrator_derivative(it, &slope, &error), KT_ERROR_CALLBACK);
    kt_check_contains("code", error.message, "-3");
    kt_check_true("untouched", slope == NULL);
    answer = 0;
    kt_check_true("goes on", integrator_step(it, 0.1));
    kt_check_near("state", kt_integrator_state(it)[0], 0.1, 2e-17); /* an ulp is 1.4e-17 */
}
