/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

/* The series leave 1e-12. For |u| up to 1000, the power 2^u loses as much as u does, |u| ln 2 eps. */
KT_TEST(own_power_is_that_of_the_library) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("relative error");
    for (int i = 0; i < 20000; i++) {
        const double x = exp2(kt_random_uniform(&random, -300.0, 300.0)), p = kt_random_uniform(&random, -1.0, 1.0);
        const double exact = pow(x, p);
        kt_worst_near(&worst, kt_control_power(x, p) / exact, 1.0, 1.5e-12, "%.17g ^ %.17g", x, p);
    }
    for (int i = -40; i <= 40; i++)
        kt_worst_near(&worst, kt_control_power(exp2(i), 1.0) / exp2(i), 1.0, 1.5e-12, "2 ^ %d", i);
}

KT_TEST(own_power_saturates) {
    kt_check_near("tiny", kt_control_power(DBL_MIN, 2.0), 0.0, 0.0);
    kt_check_true("huge", isinf(kt_control_power(DBL_MAX, 2.0)));
    kt_check_near("smallest subnormal", kt_control_power(4.9406564584124654e-324, 0.5), 2.2227587494850775e-162,
                  4e-174);
}

/* Hairer's formula in his own constants, limited to 1/0.2 and 1/10. For DOPRI5 it is
 *     fac = err^0.17 / (err_last^0.04 0.9) */
KT_TEST(factors_are_those_of_dopri5) {
    kt_integrator *it = integrator_make(kt_method_find("dopri5"), 1, kt_integrator_options_default());
    KT_WORST worst = kt_worst_make("factor");
    for (int i = 0; i <= 4; i++)
        for (int j = 0; j <= 16; j++) {
            const double last = pow(10.0, -i), error = pow(3.0, -j);
            it->memory.control_error = last;
            const double fac = pow(error, 0.17) / pow(last, 0.04) / 0.9;
            const double expected = 1.0 / fmax(1.0 / 10.0, fmin(1.0 / 0.2, fac));
            kt_worst_near(&worst, kt_control_accepted(it, error), expected, 4e-12 * expected, "%g after %g", error,
                          last);
        }
    for (int j = 0; j <= 16; j++) {
        const double error = 1.0001 * pow(3.0, j);
        const double expected = 1.0 / fmin(1.0 / 0.2, pow(error, 0.17) / 0.9);
        kt_worst_near(&worst, kt_control_rejected(it, error), expected, 4e-12 * expected, "rejected at %g", error);
    }
    kt_check_near("no error", kt_control_accepted(it, 0.0), 10.0, 0.0);
    kt_check_near("infinite error", kt_control_rejected(it, HUGE_VAL), 0.2, 0.0);
}

/* Over twelve decades of time scales the first step passes at once, and is not timid: the second is at most ten times
 * as long. */
static int decay(double t, const double *y, double *dydt, void *user) {
    const double rate = *(const double *)user;
    dydt[0] = -rate * (y[0] - cos(rate * t));
    return 0;
}

KT_TEST(first_steps_fit_the_scale_of_the_problem) {
    static const char *const names[] = {"heun", "bs32", "dopri5", "tsit5", "dop853"};
    for (int i = 0; i < 5; i++) {
        KT_WORST tries = kt_worst_make(names[i]), growth = kt_worst_make("second over first"),
                 scale = kt_worst_make("rate * step, over that of rate 1");
        double unit = 0.0;
        for (int power = 0; power <= 12; power++) {
            double rate = pow(10.0, power % 2 == 0 ? power / 2 : -(power + 1) / 2);
            kt_integrator *it = integrator_start(kt_method_find(names[i]), 1, tolerance(1e-6, 1e-6), decay, &rate, 0.0,
                                                 (double[]){2.0});
            integrator_step(it, HUGE_VAL);
            const double first = kt_integrator_memory_of(it)->last_step;
            unit = power == 0 ? first : unit;
            kt_worst_near(&tries, (double)kt_integrator_counts_of(it).rejected, 0.0, 0.0, "rate %g", rate);
            kt_worst_below(&growth, kt_integrator_memory_of(it)->next_step / first, 10.0, "rate %g", rate);
            kt_worst_near(&scale, rate * first / unit, 1.0, 2e-12, "rate %g", rate); /* two powers */
        }
    }
}

KT_TEST(given_steps_are_kept_to) {
    kt_integrator_options options = tolerance(1e-3, 1e-3);
    options.initial_step = 1e-3;
    options.max_step = 0.01;
    kt_integrator *it = integrator_begin(kt_method_find("dopri5"), &problem_kepler, options);
    double longest = 0.0;
    integrator_step(it, 1.0);
    kt_check_near("first", kt_integrator_memory_of(it)->last_step, 1e-3, 0.0);
    while (kt_integrator_time(it) < 1.0 && integrator_step(it, 1.0))
        longest = fmax(longest, kt_integrator_memory_of(it)->last_step);
    kt_check_near("longest", longest, 0.01, 1e-16); /* a difference of two rounded times below 1 */
}

/* y' = -rate y, and the time of the last call: 0, or the end of the first trial step of kt_control_initial. */
typedef struct asking {
    double rate, last;
} asking;

static int decay_and_note(double t, const double *y, double *dydt, void *user) {
    asking *a = user;
    a->last = t;
    dydt[0] = -a->rate * y[0];
    return 0;
}

/* It would be 0.01 |y| / |f| = 0.01 s, and goes half of the way to the limit at most. */
KT_TEST(first_try_is_a_hundredth_of_the_time_scale_or_half_the_limit) {
    static const double over[] = {0.3, 1.0, 3.0}; /* 0.01 s, of half the limit */
    for (int k = 0; k < 3; k++) {
        asking a = {1.0, -1.0};
        kt_try result;
        kt_integrator *it = integrator_start(kt_method_find("dopri5"), 1, tolerance(1e-6, 1e-6), decay_and_note, &a,
                                             0.0, (double[]){2.0});
        kt_check_true("slope", kt_evaluate(it, 0.0, it->y, 0, &result) == KT_TRY_PASSED);
        const double limit = 2.0 * 0.01 / over[k], h = kt_control_initial(it, 1.0, limit, &result);
        kt_check_near("where it looks, s", a.last, over[k] <= 1.0 ? 0.01 : 0.01 / 3.0, 1e-17);
        /* The step satisfies err ~ (|f| / scale) h^5 = 0.01. The rate of change is 1 / s. */
        kt_check_near("what it proposes, s", h, pow(0.01 * 3e-6 / 2.0, 0.2), 4.0 * DBL_EPSILON);
    }
}
