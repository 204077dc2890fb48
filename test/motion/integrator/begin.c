/* The first step where the usual guess, from sizes of y and f, has nothing to go by. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

/* y' = value + slope t, but it cannot be computed for 0 < t unless t <= until, and jumps to `after` there. */
typedef struct motion {
    double value, slope, after, until;
    int calls;
} motion;

static int move(double t, const double *y, double *dydt, void *user) {
    motion *m = user;
    (void)y;
    m->calls++;
    dydt[0] = t > 0.0 && m->after != 0.0 ? m->after : m->value + m->slope * t;
    return t > m->until ? 3 : 0;
}

static const double atol = 1e-8;

/* The step that is proposed from y = 0 at t = 0, forwards. */
static double proposal(motion *m, double limit, kt_integrator **integrator, kt_try *result) {
    kt_integrator *it =
        integrator_start(kt_method_find("dopri5"), 1, tolerance(0.0, atol), move, m, 0.0, (double[]){0.0});
    kt_check_equal_int("f", (int)kt_evaluate(it, 0.0, kt_integrator_state(it), 0, result), KT_TRY_PASSED);
    m->calls = 0;
    const double h = kt_control_initial(it, 1.0, limit, result);
    *integrator = it;
    return h;
}

/* The step satisfies err ~ |f'| h^2 / atol = 1/100. The result of kt_power is good to 1e-12, the difference of f to eps
 * / (h0 = 1e-6). */
KT_TEST(where_nothing_moves_yet_the_change_of_the_slope_decides) {
    KT_WORST worst = kt_worst_make("first step");
    for (int i = 0; i <= 6; i++) {
        kt_integrator *it;
        kt_try r;
        motion m = {.slope = pow(10.0, i), .until = HUGE_VAL};
        const double expected = sqrt(0.01 * atol / m.slope);
        kt_worst_near(&worst, proposal(&m, HUGE_VAL, &it, &r), expected, 2e-12 * expected, "f' = %g", m.slope);
    }
}

/* A micro of the unit of time, or half the way where that is less. */
KT_TEST(where_nothing_tells_a_scale_the_first_step_is_a_guess) {
    kt_integrator *it;
    kt_try r;
    motion rest = {.until = HUGE_VAL}, even = {.value = 1.0, .until = HUGE_VAL};
    kt_check_near("at rest", proposal(&rest, HUGE_VAL, &it, &r), 1e-6, 0.0);
    kt_check_near("even motion from 0", proposal(&even, HUGE_VAL, &it, &r), 1e-6, 0.0);
    kt_check_near("at rest, with little way to go", proposal(&rest, 1e-7, &it, &r), 0.5e-7, 0.0);
    motion huge = {.value = DBL_MAX, .until = HUGE_VAL}; /* its weighted norm overflows */
    kt_check_near("slope without a norm", proposal(&huge, HUGE_VAL, &it, &r), 1e-6, 0.0);
    motion jump = {.value = 1.0, .after = DBL_MAX, .until = HUGE_VAL};
    kt_check_near("change without a norm", proposal(&jump, HUGE_VAL, &it, &r), 1e-6, 0.0);
}

/* Each try is at a hundredth of the way of the one before; eight are made. */
KT_TEST(a_first_look_ahead_comes_nearer_until_the_slope_can_be_had) {
    kt_integrator *it;
    kt_try r;
    motion wall = {.slope = 1.0, .until = 0.0}, fence = {.slope = 1.0, .until = 0.5e-9};
    kt_check_near("never", proposal(&wall, HUGE_VAL, &it, &r), 1e-22, 1e-36);
    kt_check_equal_int("tries", wall.calls, 8);
    kt_check_equal_int("result", (int)r.result, KT_TRY_RECOVERABLE);
    const double h = proposal(&fence, HUGE_VAL, &it, &r);
    kt_check_equal_int("tries", fence.calls, 3); /* 1e-6, 1e-8, 1e-10 */
    kt_check_near("a hundred times as far as it was seen", h, 1e-8, 1e-22);
}

KT_TEST(a_first_step_keeps_to_the_longest_that_is_allowed) {
    kt_integrator_options options = tolerance(1e-3, 1e-3);
    options.max_step = 1e-7;
    kt_integrator *it = integrator_begin(kt_method_find("dopri5"), &problem_kepler, options);
    integrator_step(it, 1.0);
    kt_check_above("step", kt_integrator_memory_of(it)->last_step, 0.4e-7); /* half of it is probed */
    kt_check_below("step", kt_integrator_memory_of(it)->last_step, 1e-7);
}

/* dop853 weighs one estimate by the other: 0 / 0 where both are. */
KT_TEST(an_error_of_nothing_lets_the_step_grow_as_far_as_it_may) {
    static const char *const names[] = {"heun", "rkc2", "bs32", "rkc4", "dopri5", "tsit5", "dop853"};
    for (int i = 0; i < 7; i++) {
        motion rest = {.until = HUGE_VAL};
        const kt_integrator_options options = tolerance(1e-6, 1e-6);
        kt_integrator *it = integrator_start(kt_method_find(names[i]), 1, options, move, &rest, 0.0, (double[]){2.0});
        integrator_step(it, HUGE_VAL);
        const kt_integrator_memory *memory = kt_integrator_memory_of(it);
        kt_check_near(names[i], memory->last_error, 0.0, 0.0);
        kt_check_near("next over last step", memory->next_step / memory->last_step, options.factor_max, 0.0);
        kt_check_near("state", kt_integrator_state(it)[0], 2.0, 0.0);
    }
}

/* One tolerance for all, or the same for each: the same bits. */
KT_TEST(tolerances_one_by_one_are_those_of_their_equations) {
    static const char *const names[] = {"heun", "rkc2", "bs32", "rkc4", "dopri5", "tsit5", "dop853"};
    static const double each[4] = {1e-5, 1e-5, 1e-5, 1e-5}, finer[4] = {1e-5, 1e-8, 1e-5, 1e-5};
    for (int i = 0; i < 7; i++) {
        kt_integrator_options options = tolerance(1e-5, 1e-5);
        const kt_method *m = kt_method_find(names[i]);
        kt_integrator *all = integrator_begin(m, &problem_kepler, options);
        options.absolute_tolerances = each;
        kt_integrator *one_by_one = integrator_begin(m, &problem_kepler, options);
        options.absolute_tolerances = finer;
        options.relative_tolerance = 0.0;
        kt_integrator *fine = integrator_begin(m, &problem_kepler, options);
        integrate_to(all, 1.0);
        integrate_to(one_by_one, 1.0);
        integrate_to(fine, 1.0);
        kt_check_equal_bits(names[i], kt_integrator_state(one_by_one), kt_integrator_state(all), 4);
        kt_check_above("steps where one is finer, over those", (double)kt_integrator_counts_of(fine).steps,
                       1.2 * (double)kt_integrator_counts_of(all).steps);
    }
}
