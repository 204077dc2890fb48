/* rkc2 and rkc4: stabilised methods on problems that decay fast. The tests of all methods are run on them too. This
 * file tests the features that only they have. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/stabilised.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- problems ---------------------------------------------------------------------------------------------------- */

/* Decays to a motion that is given, at rates of 1 to `rate`, coupled and not autonomous:
 *     y_i' = -r_i (y_i - g_i(t)) + g_i'(t) + (y_0 - g_0)(y_1 - g_1),  g_i = cos(t + i),  y(0) = g(0) */
enum { DECAYS = 4 };

static int decays(double t, const double *y, double *dydt, void *user) {
    const double rate = *(const double *)user;
    const double product = (y[0] - cos(t)) * (y[1] - cos(t + 1.0));
    for (int i = 0; i < DECAYS; i++) {
        const double r = pow(rate, (double)i / (DECAYS - 1));
        dydt[i] = -r * (y[i] - cos(t + i)) - sin(t + i) + product;
    }
    return 0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): it goes into the callbacks */
static kt_integrator *decays_begin(const char *method, double *rate, kt_integrator_options options) {
    double y[DECAYS];
    for (int i = 0; i < DECAYS; i++)
        y[i] = cos(i);
    kt_integrator *it = integrator_start(kt_method_find(method), DECAYS, options, decays, rate, 0.0, y);
    return it;
}

static double decays_error(const kt_integrator *it) {
    double worst = 0.0;
    for (int i = 0; i < DECAYS; i++)
        worst = fmax(worst, fabs(kt_integrator_state(it)[i] - cos(kt_integrator_time(it) + i)));
    return worst;
}

/* Largest error on the way to t = 3. */
static double decays_worst(kt_integrator *it) {
    double worst = 0.0;
    while (kt_integrator_time(it) < 3.0 && integrator_step(it, 3.0))
        worst = fmax(worst, decays_error(it));
    return worst;
}

/* ---- accuracy ---------------------------------------------------------------------------------------------------- */

/* problem_chirp, nonlinear and not autonomous, next to a decay at rest that requires many stages. */
static int chirp_and_decay_rhs(double t, const double *y, double *dydt, void *user) {
    (void)problem_chirp.rhs(t, y, dydt, user);
    dydt[4] = -3e4 * y[4];
    return 0;
}

static void chirp_and_rest(double t, double *y) {
    problem_chirp.solution(t, y);
    y[4] = 0.0;
}

static const problem chirp_and_decay = {"chirp and decay", 5, 0.25, 1.5, chirp_and_decay_rhs, chirp_and_rest};

/* The order over halved steps, of `first` on to end at problem_chirp's end; stages from about 15 to 40. */
static double measured_order(const char *method, int first) {
    double h[4], error[4];
    for (int i = 0; i < 4; i++) {
        const int steps = first << i;
        h[i] = (problem_chirp.end - problem_chirp.start) / steps;
        kt_integrator *it = integrator_begin(kt_method_find(method), &chirp_and_decay, fixed_step(h[i]));
        error[i] = error_until_end(it, &chirp_and_decay);
        kt_note("%s, h = %g: error %.3g, %d stages", method, h[i], error[i],
                kt_chebyshev_stages(h[i] * kt_stabilised_radius(it), kt_chebyshev_damping(kt_method_find(method))));
    }
    return slope_of(h, error, 4);
}

KT_TEST(orders_hold_with_many_stages_on_a_problem_that_is_not_autonomous) {
    kt_check_near("order of rkc2", measured_order("rkc2", 128), 2.0, 0.1);
    kt_check_near("order of rkc4", measured_order("rkc4", 64), 4.0, 0.2);
}

/* If a fast decaying component follows a motion, errors at large steps are smaller than predicted by h^p. They also
 * fall more slowly (order reduction). The method rkc2 keeps its order 2. The method rkc4 has order 2.3. This is
 * measured for h rate from 400 to 50, from a hundredth of the error of rkc2 on. */
KT_TEST(errors_on_a_stiff_problem_fall_as_measured) {
    static const struct {
        const char *method;
        double slope, room, first;
    } cases[] = {{"rkc2", 2.0, 0.1, 3e-3}, {"rkc4", 2.3, 0.4, 5e-6}};
    for (int m = 0; m < 2; m++) {
        double rate = 2000.0, h[4], error[4];
        for (int i = 0; i < 4; i++) {
            h[i] = 0.2 / (double)(1 << i);
            kt_integrator *it = decays_begin(cases[m].method, &rate, fixed_step(h[i]));
            error[i] = decays_worst(it);
        }
        kt_note("%s: errors %.3g %.3g %.3g %.3g", cases[m].method, error[0], error[1], error[2], error[3]);
        kt_check_below("error at the largest step", error[0], cases[m].first);
        kt_check_near("slope", slope_of(h, error, 4), cases[m].slope, cases[m].room);
    }
}

/* If an estimate of order 3 is held at the tolerance, h grows as the cube root of the tolerance. The error of a
 * second-order method then grows as the power 2/3 of the tolerance. Measured: 0.65. */
KT_TEST(errors_follow_the_tolerance) {
    double rate = 2000.0, at[5], error[5];
    for (int i = 0; i < 5; i++) {
        at[i] = pow(10.0, -3 - i);
        kt_integrator *it = decays_begin("rkc2", &rate, tolerance(at[i], at[i]));
        error[i] = decays_worst(it);
        const kt_integrator_counts counts = kt_integrator_counts_of(it);
        kt_note("tolerance %g: error %.3g, %llu steps, %llu rejected, %llu evaluations", at[i], error[i],
                (unsigned long long)counts.steps, (unsigned long long)counts.rejected,
                (unsigned long long)counts.evaluations);
        kt_check_below("error over tolerance^(2/3)", error[i] / pow(at[i], 2.0 / 3.0), 0.2);
    }
    kt_check_near("slope", slope_of(at, error, 5), 2.0 / 3.0, 0.05);
}

/* rkc4: an estimate of order 4 of a method of order 4, so that errors are in proportion to the tolerance. The error
 * determines the step. The estimate of each step is near the tolerance, and the number of steps grows as
 * tolerance^(-1/4). */
KT_TEST(errors_of_rkc4_are_in_proportion_to_the_tolerance) {
    double at[5], error[5], steps[5];
    for (int i = 0; i < 5; i++) {
        at[i] = pow(10.0, -4 - i);
        kt_integrator *it = integrator_begin(kt_method_find("rkc4"), &chirp_and_decay, tolerance(at[i], at[i]));
        error[i] = error_until_end(it, &chirp_and_decay);
        steps[i] = (double)kt_integrator_counts_of(it).steps;
        kt_note("tolerance %g: error %.3g, %g steps", at[i], error[i], steps[i]);
    }
    kt_check_near("slope of the error", slope_of(at, error, 5), 1.0, 0.15);
    kt_check_near("slope of the steps", slope_of(at, steps, 5), -0.25, 0.05);
}

/* RK4 would need 2.8 / rate. */
KT_TEST(it_needs_far_fewer_evaluations_where_decays_are_fast) {
    double rate = 1e5;
    kt_integrator *it = decays_begin("rkc2", &rate, tolerance(1e-5, 1e-5));
    const double worst = decays_worst(it), rk4 = 4.0 * 3.0 * rate / 2.8;
    kt_check_below("error", worst, 1e-4);
    kt_check_below("evaluations over those of RK4 at its limit", (double)kt_integrator_counts_of(it).evaluations / rk4,
                   0.05);
}

/* ---- stages ------------------------------------------------------------------------------------------------------ */

typedef struct times {
    double t[64], rate;
    int count;
} times;

static int record_times(double t, const double *y, double *dydt, void *user) {
    times *r = user;
    if (r->count < 64)
        r->t[r->count++] = t;
    dydt[0] = -r->rate * y[0];
    return 0;
}

/* Stages of a fixed step. The slope at the start is the first stage. Stage j is at the following time at w0, and none
 * is at the end:
 *     c_j = T_s'/T_s'' T_j''/T_j' */
KT_TEST(stages_are_as_many_as_needed_and_at_their_own_times) {
    static const double rates[] = {1.0, 20.0, 150.0, 1000.0};
    for (int i = 0; i < 4; i++) {
        times r = {.rate = rates[i]};
        kt_integrator *it =
            integrator_start(kt_method_find("rkc2"), 1, fixed_step(0.125), record_times, &r, 2.0, (double[]){1.0});
        integrator_step(it, HUGE_VAL);
        r.count = 0;
        integrator_step(it, HUGE_VAL);
        const int s = kt_chebyshev_stages(1.2 * 0.125 * rates[i], 2.0 / 13.0);
        const kt_chebyshev family = kt_chebyshev_make(s, 2.0 / 13.0);
        kt_check_equal_int("stages", r.count, s);
        KT_WORST worst = kt_worst_make("time");
        kt_chebyshev_values v = kt_chebyshev_first(family.w0);
        kt_worst_near(&worst, r.t[0], 2.125, 0.0, "stage 0");
        for (int j = 1; j < s && j < 64; j++) {
            const double c2 = family.w1 / family.w0, c = j > 1 ? family.w1 * v.ddt / v.dt : c2 / (4.0 * family.w0);
            kt_worst_near(&worst, r.t[j], 2.125 + 0.125 * c, 4.0 * s * DBL_EPSILON, "stage %d", j);
            kt_chebyshev_next(&v, family.w0);
        }
    }
}

/* ---- the spectral radius ----------------------------------------------------------------------------------------- */

typedef struct spectrum {
    double decay, omega;
} spectrum;

/* A decay, and an oscillator in position and velocity: its matrix is not normal, and the more so the faster it is. */
static int decay_and_swing(double t, const double *y, double *dydt, void *user) {
    const spectrum *s = user;
    (void)t;
    dydt[0] = -s->decay * y[0];
    dydt[1] = y[2];
    dydt[2] = -s->omega * s->omega * y[1];
    dydt[3] = -y[3];
    return 0;
}

static double radius_of(spectrum s, uint64_t *evaluations) {
    kt_integrator *it = integrator_start(kt_method_find("rkc2"), 4, fixed_step(1e-9), decay_and_swing, &s, 0.0,
                                         (double[]){0.0, 0.3, 0.0, 1.0});
    integrator_step(it, HUGE_VAL);
    *evaluations = kt_integrator_counts_of(it).evaluations - 2; /* of a step with two stages */
    const double radius = kt_stabilised_radius(it);
    return radius / KT_RADIUS_MARGIN;
}

/* Within its margin. The decay is not excited (y_0 = 0), and is found all the same. */
KT_TEST(differences_find_the_fastest_decay_or_oscillation) {
    static const spectrum spectra[] = {{1e4, 1.0}, {1e2, 7.0}, {8e3, 50.0}, {2.0, 300.0}, {0.0, 25.0}, {50.0, 45.0}};
    for (int i = 0; i < 6; i++) {
        uint64_t evaluations;
        const double exact = fmax(spectra[i].decay, spectra[i].omega), radius = radius_of(spectra[i], &evaluations);
        kt_note("%g and %gi: %g after %llu evaluations", spectra[i].decay, spectra[i].omega, radius,
                (unsigned long long)evaluations);
        kt_check_above("radius", radius / exact, 1.0 / KT_RADIUS_MARGIN);
        kt_check_below("radius", radius / exact, KT_RADIUS_MARGIN);
        kt_check_below("evaluations", (double)evaluations, 24.0);
    }
}

/* y' = -k(t) y with k growing from 10 to 1000 /s: the stages follow. */
static int stiffening(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = -(10.0 + 990.0 * t) * (y[0] - 1.0);
    return 0;
}

KT_TEST(stages_follow_a_problem_that_becomes_stiff) {
    for (int fixed = 0; fixed <= 1; fixed++) {
        kt_integrator *it =
            integrator_start(kt_method_find("rkc2"), 1, fixed ? fixed_step(0.01) : tolerance(1e-4, 1e-4), stiffening,
                             NULL, 0.0, (double[]){2.0});
        integrate_to(it, 1.0);
        kt_check_near("at rest", kt_integrator_state(it)[0], 1.0, fixed ? 1e-9 : 1e-4);
        kt_check_near("radius", kt_stabilised_radius(it), 1.2 * 1000.0,
                      fixed ? 60.0 : 400.0); /* 5 and 25 steps old at most */
    }
}

/* ---- what it cannot ---------------------------------------------------------------------------------------------- */

KT_TEST(a_fixed_step_beyond_all_stages_is_rejected_in_words) {
    kt_error error;
    double rate = 1e6, before[DECAYS];
    kt_integrator *it = decays_begin("rkc2", &rate, fixed_step(0.1));
    memcpy(before, kt_integrator_state(it), sizeof before);
    kt_check_equal_int("status", kt_integrator_step(it, HUGE_VAL, &error), KT_ERROR_STEP);
    kt_check_contains("rate", error.message, "decays at 1.2e+06 /s");
    kt_check_contains("what to do", error.message, "take steps below 0.034 s");
    kt_check_equal_bits("state", kt_integrator_state(it), before, DECAYS);
    kt_check_equal_int("steps", (long long)kt_integrator_counts_of(it).steps, 0);
}

KT_TEST(an_adaptive_step_is_kept_within_its_stages) {
    double rate = 1e7;
    kt_integrator *it = decays_begin("rkc2", &rate, tolerance(1e-2, 1e-2));
    double longest = 0.0; /* over the length that the radius then allowed */
    for (int i = 0; i < 60; i++) {
        integrator_step(it, 3.0);
        longest = fmax(longest, (kt_integrator_time(it) - kt_integrator_previous_time(it)) / kt_stabilised_reach(it));
    }
    kt_check_below("longest step over the reach", longest, 1.0 + 1e-12);
    kt_check_above("which they use", longest, 0.9);
    kt_check_below("error", decays_error(it), 1e-7);
}

KT_TEST(a_callers_table_cannot_be_stabilised) {
    kt_error error;
    const kt_method own = *kt_method_find("rkc2");
    const kt_integrator_options options = fixed_step(0.1);
    char memory[4096];
    kt_integrator *it = NULL;
    kt_check_equal_int("status", kt_integrator_init(memory, sizeof memory, &own, 1, &options, &it, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "'rkc2': a stabilised method must be a built-in one");
}

/* The least step exceeds the step that the stages allow: there is no way between. */
KT_TEST(a_least_step_beyond_all_stages_is_rejected_in_words) {
    kt_error error;
    double rate = 1e7;
    kt_integrator_options options = tolerance(1e-2, 1e-2);
    options.min_step = 0.1;
    kt_integrator *it = decays_begin("rkc2", &rate, options);
    kt_check_equal_int("status", kt_integrator_step(it, 3.0, &error), KT_ERROR_STEP);
    kt_check_contains("words", error.message,
                      "needs more than the 250 stages that there are: take steps below 0.0034 s");
    kt_check_near("time", kt_integrator_time(it), 0.0, 0.0);
}

/* From y = 0, the size of y gives no hint for the length of differences:
 *     y' = -1000 (y - sin t) */
static int lag(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = -1000.0 * (y[0] - sin(t));
    return 0;
}

static int constant(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)y;
    (void)user;
    dydt[0] = 3.0;
    return 0;
}

KT_TEST(the_radius_is_found_at_zero_and_where_there_is_none) {
    kt_error error;
    const kt_integrator_callbacks callbacks[2] = {{lag, NULL, NULL}, {constant, NULL, NULL}};
    for (int i = 0; i < 2; i++) {
        kt_integrator *it = integrator_make(kt_method_find("rkc2"), 1, tolerance(1e-4, 1e-4));
        kt_fine("start", kt_integrator_start(it, 0.0, (double[]){0.0}, &callbacks[i], &error), &error);
        integrator_step(it, 1.0);
        kt_check_near("radius", kt_stabilised_radius(it), i ? 0.0 : 1.2 * 1000.0, i ? 0.0 : 1e-4);
        integrate_to(it, 1.0);
        kt_check_near("state", kt_integrator_state(it)[0], i ? 3.0 : (1e6 * sin(1.0) - 1e3 * cos(1.0)) / (1e6 + 1.0),
                      i ? 1e-15 : 4e-6);
        kt_check_true("reach", i ? kt_stabilised_reach(it) == HUGE_VAL : isfinite(kt_stabilised_reach(it)));
    }
}

/* The jump at 0.5 is not foreseen: tries fail, and before the next one the radius is estimated again. */
typedef struct jumping {
    int calls, stop_at;
} jumping;

static int jump(double t, const double *y, double *dydt, void *user) {
    jumping *j = user;
    dydt[0] = -(t > 0.5 ? 400.0 : 1.0) * y[0];
    return ++j->calls == j->stop_at ? -5 : 0;
}

static kt_integrator *before_the_jump(jumping *j) {
    kt_integrator *it =
        integrator_start(kt_method_find("rkc2"), 1, tolerance(1e-5, 1e-5), jump, j, 0.0, (double[]){1.0});
    integrate_to(it, 0.499);
    j->calls = 0;
    return it;
}

/* The states 1e-20 and 0 are one place, and the radius there is the same:
 *     y' = -rate (y - 1)
 * Differences over a part of 1e-20 would be all rounding. */
static int fall(double t, const double *y, double *dydt, void *user) {
    (void)t;
    const double rate = *(const double *)user;
    dydt[0] = -rate * (y[0] - 1.0);
    dydt[1] = -0.5 * rate * (y[1] - 1.0);
    return 0;
}

KT_TEST(the_radius_beside_zero_is_that_at_zero) {
    static const double starts[] = {0.0, 1e-20, 1e-9};
    double rate = 100.0;
    for (int i = 0; i < 3; i++) {
        kt_try result;
        kt_integrator *it = integrator_start(kt_method_find("rkc2"), 2, tolerance(1e-6, 1e-6), fall, &rate, 0.0,
                                             (double[]){starts[i], starts[i]});
        kt_check_true("slope", kt_evaluate(it, 0.0, it->y, 0, &result) == KT_TRY_PASSED);
        kt_check_true("radius", kt_need_radius(it, false, &result) == KT_TRY_PASSED);
        /* differences over 1.5e-8 of 1e-6 have a rounding error of 2 eps 100, hence 3 /s */
        kt_check_near("radius, 1/s", kt_stabilised_radius(it) / KT_RADIUS_MARGIN, 100.0, i ? 3.0 : 1e-5);
    }
}

KT_TEST(a_stop_is_heeded_wherever_a_rejected_step_asks) {
    kt_error error;
    jumping free_run = {0, 0};
    kt_integrator *undisturbed = before_the_jump(&free_run);
    integrator_step(undisturbed, 2.0);
    kt_check_above("rejected", (double)kt_integrator_counts_of(undisturbed).rejected, 1.0);
    const int calls = free_run.calls;
    int heeded = 0, kept = 0;
    for (int stop_at = 1; stop_at <= calls; stop_at++) {
        jumping j = {0, 0};
        kt_integrator *it = before_the_jump(&j);
        const double y = kt_integrator_state(it)[0];
        j.stop_at = stop_at;
        heeded += kt_integrator_step(it, 2.0, &error) == KT_ERROR_CALLBACK;
        kept += kt_integrator_time(it) == 0.499 && kt_integrator_state(it)[0] == y;
    }
    kt_check_equal_int("heeded", heeded, calls);
    kt_check_equal_int("state as it was", kept, calls);
}
