/* Modes along a motion, and the steps that they allow, against closed forms and against runs that really blow up. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sanitized.h"
#include "train.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static kt_spectrum *spectrum_of(const kt_model *model, const kt_run *run, int samples) {
    kt_error error = {0};
    kt_spectrum *spectrum = kt_test_spectrum(model, samples);
    (void)kt_fine("along the run", kt_spectrum_along(spectrum, run, &error), &error);
    return spectrum;
}

static kt_run run_of(double duration) {
    kt_run run = kt_run_default();
    run.duration = duration;
    return run;
}

/* ---- what is found ----------------------------------------------------------------------------------------------- */

KT_TEST(modes_of_a_train_are_those_of_its_closed_form_at_every_state) {
    train t;
    const kt_run run = run_of(2.0);
    train_open(&t, 5, 2.0, 300.0, 0.7);
    kt_spectrum *spectrum = spectrum_of(t.model, &run, 4);
    kt_check_equal_int("states", kt_spectrum_samples(spectrum), 4);
    kt_check_equal_int("modes", kt_spectrum_count(spectrum), 20);
    KT_WORST lambda = kt_worst_make("lambda"), moves = kt_worst_make("moves"), times = kt_worst_make("time");
    for (int i = 0; i < kt_spectrum_count(spectrum); i++) {
        const kt_spectrum_mode at = kt_spectrum_at(spectrum, i);
        const int j = 5 - i % 5, third = i / 5; /* the fastest first */
        const kt_complex exact = train_eigenvalue(&t, j);
        double shape[TRAIN_MAX], most = 0.0;
        kt_worst_near(&times, at.t, 2.0 * third / 3.0, 1e-15, "mode %d", i);
        kt_worst_below(&lambda, hypot(at.mode.real - exact.re, at.mode.imaginary - exact.im), 1e-11, "mode %d", i);
        train_shape(&t, j, shape);
        for (int k = 0; k < 5; k++)
            most = fmax(most, fabs(shape[k]));
        for (int k = 0; k < 5; k++)
            kt_worst_near(&moves, at.moves[k], fabs(shape[k]) / most, 1e-13, "mode %d, joint %d", i, k);
    }
    kt_check_equal_int("fastest", kt_spectrum_fastest(spectrum), 0);
}

/* A pendulum let go at 1 rad: lambda^2 = -g / l cos q changes as it swings. Heun's steps of 0.4 s would give another
 * motion. The analysed motion is accurate to 1e-6, and 1e-6 was measured for lambda. */
KT_TEST(motion_is_looked_at_without_the_step_that_is_in_doubt) {
    kt_body bob = kt_body_of("bob", NULL, KT_JOINT_REVOLUTE, 1.0);
    bob.joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bob.joint.position[0] = 1.0;
    bob.com = kt_vec3_make(0.0, 0.0, -1.0);
    kt_description description = kt_description_of(&bob, 1, NULL, 0, NULL, 0);
    description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    kt_model *model = kt_test_model(&description, NULL);
    const kt_run fine = run_of(2.0);
    kt_run coarse = fine;
    coarse.integrator = "heun"; /* the error estimate of heun is not used */
    coarse.step = 0.4;
    kt_spectrum *one = spectrum_of(model, &fine, 6), *two = spectrum_of(model, &coarse, 6);
    KT_WORST lambda = kt_worst_make("lambda");
    kt_check_equal_int("modes", kt_spectrum_count(two), kt_spectrum_count(one));
    for (int i = 0; i < kt_spectrum_count(one) && i < kt_spectrum_count(two); i++) {
        const kt_mode a = kt_spectrum_at(one, i).mode, b = kt_spectrum_at(two, i).mode;
        kt_worst_near(&lambda, hypot(b.real - a.real, b.imaginary - a.imaginary), 0.0, 5e-6, "mode %d", i);
    }
}

KT_TEST(a_full_spectrum_takes_no_more_and_stays_as_it_was) {
    train t;
    kt_error error = {0};
    const double q[2] = {0.0, 0.0}, bad[2] = {0.0, (double)NAN};
    train_open(&t, 2, 1.0, 1.0, 0.0);
    kt_spectrum *spectrum = NULL;
    const size_t size = kt_spectrum_size(t.model, 2);
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_check_equal_int("none", kt_spectrum_init(t.model, 0, memory, size, &spectrum, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("small", kt_spectrum_init(t.model, 2, memory, size - 1, &spectrum, &error), KT_ERROR_MEMORY);
    kt_check_equal_int("placed", kt_spectrum_init(t.model, 2, memory, size, &spectrum, &error), KT_OK);
    kt_check_equal_int("nothing is fastest", kt_spectrum_fastest(spectrum), -1);
    kt_check_equal_int("one", kt_spectrum_add(spectrum, 0.0, q, q, NULL, &error), KT_OK);
    kt_check_true("not a number", kt_spectrum_add(spectrum, 0.0, bad, q, NULL, &error) != KT_OK);
    kt_check_equal_int("still one", kt_spectrum_samples(spectrum), 1);
    kt_check_equal_int("two", kt_spectrum_add(spectrum, 1.0, q, q, NULL, &error), KT_OK);
    kt_check_equal_int("three", kt_spectrum_add(spectrum, 2.0, q, q, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("modes", kt_spectrum_count(spectrum), 4);
    kt_spectrum_free(spectrum); /* which owns nothing here */
    free(memory);
}

/* A mass on a damper alone: 0 and -c/m. The slow one bounds nothing, and the shape of the fast one moves. */
KT_TEST(limits_name_the_mode_that_bounds_and_the_growth_of_the_worst) {
    train t;
    const kt_run run = run_of(10.0);
    train_open(&t, 1, 1.0, 0.0, 1000.0);
    kt_spectrum *spectrum = spectrum_of(t.model, &run, 1);
    const kt_method *rk4 = kt_method_find("rk4");
    kt_step_limit limit = kt_spectrum_limit(spectrum, rk4, 10.0, 0.0);
    kt_check_near("step", limit.step, 2.785293563e-3, 1e-6); /* a run's growth moves it by less */
    kt_check_near("nothing asked", limit.growth, 1.0, 0.0);
    kt_check_near("bounded by", kt_spectrum_at(spectrum, limit.mode).mode.real, -1000.0, 1e-6);
    limit = kt_spectrum_limit(spectrum, rk4, 10.0, 2e-3);
    kt_check_near("within", limit.growth, 1.0, 0.0);
    limit = kt_spectrum_limit(spectrum, rk4, 10.0, 5e-3); /* R(-5) = 13.708: overflows over 2000 steps */
    kt_check_true("beyond", limit.growth > 1e6);
    limit = kt_spectrum_limit(spectrum, rk4, 0.05, 5e-3);
    kt_check_near("ten steps", limit.growth, pow(1.0 - 5.0 + 12.5 - 125.0 / 6.0 + 625.0 / 24.0, 10.0),
                  1e-13 * limit.growth);
}

/* Random numbers with errors of 1e-9 at most in the place of a train's state matrix. */
enum { STATES = 6 };
typedef struct matrix {
    double state[STATES * STATES], error[STATES * STATES];
} matrix;

static bool eigenvalues(kt_modes *modes, kt_linear_system system, const matrix *m, kt_mode *mode) {
    kt_error error = {0};
    system.state = m->state;
    system.state_error = m->error;
    system.force_error = NULL; /* none of these are errors of forces */
    system.error = 1e-3;       /* the bound of estimates where eigenvalues meet is far */
    const bool fine = kt_modes_evaluate(modes, &system, &error) == KT_OK;
    for (int i = 0; fine && i < kt_modes_count(modes); i++)
        mode[i] = kt_modes_at(modes, i);
    return fine;
}

/* sum over the numbers of error |d lambda / d number|, by differences of step h, of all modes. */
static bool first_order(kt_modes *modes, const kt_linear_system *system, const matrix *m, double h, int count,
                        double *sum) {
    kt_mode side[2][STATES];
    for (int k = 0; k < count; k++)
        sum[k] = 0.0;
    for (int i = 0; i < STATES * STATES; i++) {
        for (int up = 0; up < 2; up++) {
            matrix moved = *m;
            moved.state[i] += up ? h : -h;
            if (!eigenvalues(modes, *system, &moved, side[up]) || kt_modes_count(modes) != count)
                return false;
        }
        for (int k = 0; k < count; k++)
            sum[k] += m->error[i] *
                      hypot(side[1][k].real - side[0][k].real, side[1][k].imaginary - side[0][k].imaginary) / (2.0 * h);
    }
    return true;
}

/* True errors of numbers are within four estimated ones (honest.c), and so are those of eigenvalues. The differences
 * are good to h^2 times a factor that grows where eigenvalues are close. Their error is a third of their distance to
 * those with twice the step. The decomposition adds a rounding of some eps to errors of 1e-9. */
KT_TEST(estimated_errors_of_modes_are_what_errors_of_numbers_do_to_first_order) {
    train t;
    kt_error error = {0};
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("estimate over first order"), pairs = kt_worst_make("of them of a pair");
    train_open(&t, STATES / 2, 1.0, 1.0, 0.1);
    kt_modes *modes = kt_test_modes(t.model);
    const double rest[STATES / 2] = {0.0};
    kt_linearization *linearization = kt_test_linearization(t.model, NULL);
    kt_check_equal_int("linear", kt_linearization_evaluate(linearization, 0.0, rest, rest, NULL, &error), KT_OK);
    const kt_linear_system *system = kt_linearization_system(linearization);
    for (int round = 0; round < 20; round++) {
        matrix m;
        kt_mode mode[STATES];
        double sum[STATES], coarse[STATES];
        for (int i = 0; i < STATES * STATES; i++) {
            m.state[i] = kt_random_normal(&random);
            m.error[i] = kt_random_uniform(&random, 0.0, 1e-9);
        }
        kt_need(kt_check_true("modes", eigenvalues(modes, *system, &m, mode)));
        const int count = kt_modes_count(modes);
        if (first_order(modes, system, &m, 1e-5, count, sum) && first_order(modes, system, &m, 2e-5, count, coarse))
            for (int k = 0; k < count; k++)
                kt_worst_near(mode[k].imaginary > 0.0 ? &pairs : &worst, mode[k].error / (4.0 * sum[k]), 1.0,
                              fabs(coarse[k] / sum[k] - 1.0) + 4.0 * DBL_EPSILON / 1e-9, "round %d, mode %d", round, k);
    }
}

/* ---- where runs blow up ------------------------------------------------------------------------------------------ */

/* The step at which a run's amplitude first doubles, by bisection of runs, over the step that is predicted. */
static double real_over_predicted(const train *t, const kt_method *m, double predicted, double duration, int j) {
    double low = 0.5 * predicted, high = 2.0 * predicted;
    if (train_growth(t, m, low, duration, j) > KT_STABILITY_GROWTH)
        return 0.5;
    for (int k = 0; k < 9; k++) {
        const double middle = sqrt(low * high);
        *(train_growth(t, m, middle, duration, j) > KT_STABILITY_GROWTH ? &high : &low) = middle;
    }
    return sqrt(low * high) / predicted;
}

static void check_train(int count, double stiffness, double damping, double duration, double bound) {
    train t;
    const kt_run run = run_of(duration);
    train_open(&t, count, 1.0, stiffness, damping);
    kt_spectrum *spectrum = spectrum_of(t.model, &run, 2);
    KT_WORST worst = kt_worst_make("step of blow-up over the predicted one");
    kt_note("%d masses, stiffness %g, damping %g", count, stiffness, damping);
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const kt_step_limit limit = kt_spectrum_limit(spectrum, m, duration, 0.0);
        if (!kt_method_stages_vary(m) && !kt_method_is_implicit(m))
            kt_worst_near(&worst, real_over_predicted(&t, m, limit.step, duration, count), 1.0, bound, "%s at %g s",
                          m->name, limit.step);
    }
}

/* A decay, a damped swing and an undamped one. One error that remains is the step of the bisection, 0.3%. In undamped
 * swings, the other modes also add to the energy. */
KT_TEST(linear_scenes_blow_up_within_a_tenth_of_the_predicted_step) {
    check_train(1, 100.0, 400.0, 10.0, 0.03);
    check_train(1, 1000.0, 4.0, 10.0, 0.03);
    check_train(1, 1000.0, 0.0, 10.0, 0.03);
    check_train(5, 2000.0, 200.0, 4.0, 0.1);
    check_train(5, 2000.0, 1.0, 4.0, 0.1);
    check_train(5, 2000.0, 0.0, 4.0, 0.1);
}

/* Within the limit a run decays, for every number of stages. */
KT_TEST(stabilised_steps_within_the_limit_decay) {
    train t;
    const kt_run run = run_of(2.0);
    train_open(&t, 5, 1.0, 100.0, 40000.0);
    kt_spectrum *spectrum = spectrum_of(t.model, &run, 1);
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        const kt_step_limit limit = kt_spectrum_limit(spectrum, m, 2.0, 0.0);
        const double reach = (m->order == 2 ? 0.653 : 0.5797) * 62499.0 / 1.2 / -train_eigenvalue(&t, 5).re;
        if (!kt_method_stages_vary(m))
            continue;
        KT_WORST growth = kt_worst_make(m->name);
        kt_check_near("limit", limit.step / reach, 1.0, 0.01);
        /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
        for (double h = 0.9 * limit.step; h > (KT_ADDRESS_SANITIZER ? 1e-3 : 1e-4); h *= 0.7)
            kt_worst_below(&growth, train_growth(&t, m, h, 4.0, 5), 1.0, "h = %g", h);
    }
}
