/* The watch on the fastest mode, and the steps per period of oscillations, against closed forms and runs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "train.h"

#include <float.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

static kt_mode_watch *watch_of(const kt_model *model) {
    kt_error error = {0};
    kt_mode_watch *watch = NULL;
    (void)kt_check_equal_int("watch", kt_mode_watch_create(model, &watch, &error), KT_OK);
    return watch;
}

/* ---- rates ------------------------------------------------------------------------------------------------------- */

/* Undamped, damped, overdamped; a linear scene has one rate at all states. Measured: 0.93 to 1.0000 of it. */
KT_TEST(rate_is_that_of_the_fastest_mode) {
    static const double damping[] = {0.0, 0.5, 200.0};
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("rate over that of the closed form");
    for (int count = 1; count <= TRAIN_MAX; count++)
        for (int d = 0; d < 3; d++) {
            train t;
            train_open(&t, count, 2.0, 1e4, damping[d]);
            kt_mode_watch *watch = watch_of(t.model);
            double q[TRAIN_MAX], v[TRAIN_MAX];
            for (int i = 0; i < 20; i++) {
                for (int k = 0; k < count; k++) {
                    q[k] = kt_random_uniform(&random, -0.1, 0.1);
                    v[k] = kt_random_uniform(&random, -1.0, 1.0);
                }
                kt_mode_watch_add(watch, 0.1 * i, q, v);
            }
            const kt_complex exact = train_eigenvalue(&t, count);
            const double ratio = kt_mode_watch_fastest(watch).rate / hypot(exact.re, exact.im);
            kt_worst_near(&worst, ratio, 1.0, 0.15, "%d masses, damping %g", count, damping[d]);
            kt_mode_watch_free(watch);
        }
}

/* A block that slides freely until it meets a stop: sqrt(k / m), from the first look on in which it touches. */
KT_TEST(stiffness_that_was_not_there_shows_at_the_first_look) {
    kt_body bodies[2];
    kt_effect effects[2] = {kt_effect_default(), kt_effect_default()};
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_of(i ? "block" : "swing", NULL, KT_JOINT_PRISMATIC, 4.0);
        effects[i].joint = bodies[i].name;
    }
    effects[0].type = KT_EFFECT_JOINT_SPRING; /* of 5 rad/s, which it follows until then */
    effects[0].stiffness = 100.0;
    effects[1].type = KT_EFFECT_JOINT_LIMIT;
    effects[1].upper = 1.0;
    effects[1].stiffness = 4e8;
    kt_description description = kt_description_of(bodies, 2, NULL, 0, effects, 2);
    kt_model *model = kt_test_model(&description, NULL);
    kt_mode_watch *watch = watch_of(model);
    const double v[2] = {0.0, 1.0};
    for (int i = 0; i < 30; i++) {
        const double q[2] = {0.1, 1.0 + 1e-5 * (i - 19.5)};
        kt_mode_watch_add(watch, 0.1 * i, q, v);
        if (i == 19)
            kt_check_near("before", kt_mode_watch_fastest(watch).rate, 5.0, 1e-8); /* measured: 1e-9 */
        if (i == 20)
            kt_check_near("at the first look", kt_mode_watch_fastest(watch).rate, 1e4, 0.05); /* measured: 0.007 */
    }
    const kt_fast_state fastest = kt_mode_watch_fastest(watch);
    kt_check_near("rate", fastest.rate, 1e4, 0.05);
    kt_check_above("it touches there", fastest.q[1], 1.0);
    kt_check_above("and when", fastest.t, 1.95);
    kt_mode_watch_free(watch);
}

/* Three evaluations a state, once it has settled. */
KT_TEST(watch_costs_three_evaluations_a_state) {
    train t;
    train_open(&t, 5, 1.0, 100.0, 0.1);
    kt_mode_watch *watch = watch_of(t.model);
    double q[TRAIN_MAX] = {0.01}, v[TRAIN_MAX] = {0.0};
    uint64_t before = 0;
    for (int i = 0; i < 40; i++) {
        kt_mode_watch_add(watch, i, q, v);
        const double taken = (double)(kt_mode_watch_evaluations(watch) - before);
        before = kt_mode_watch_evaluations(watch);
        kt_check_below("of a state", taken, i < 20 ? 17.0 : 3.0);
    }
    kt_mode_watch_free(watch);
}

KT_TEST(states_without_an_acceleration_are_passed_over) {
    train t;
    train_open(&t, 2, 1.0, 100.0, 0.0);
    kt_mode_watch *watch = watch_of(t.model);
    const double good[2] = {0.01, 0.0}, bad[2] = {(double)NAN, 0.0};
    kt_mode_watch_add(watch, 0.0, bad, good);
    kt_check_near("nothing found", kt_mode_watch_fastest(watch).rate, 0.0, 0.0);
    kt_mode_watch_add(watch, 1.0, good, good);
    const double rate = kt_mode_watch_fastest(watch).rate;
    kt_check_above("found", rate, 1.0);
    kt_mode_watch_add(watch, 2.0, good, bad);
    kt_check_near("kept", kt_mode_watch_fastest(watch).rate, rate, 0.0);
    kt_check_near("state", kt_mode_watch_fastest(watch).q[0], 0.01, 0.0);
    kt_mode_watch_free(watch);
}

KT_TEST(watch_rejects_memory_that_is_too_small) {
    train t;
    kt_error error = {0};
    train_open(&t, 2, 1.0, 100.0, 0.0);
    _Alignas(KT_ALIGNMENT) char memory[64];
    kt_mode_watch *watch = NULL;
    kt_check_equal_int("status", kt_mode_watch_init(t.model, memory, sizeof memory, &watch, &error), KT_ERROR_MEMORY);
    kt_check_true("untouched", watch == NULL);
    kt_check_above("what it takes", (double)kt_mode_watch_size(t.model), 64.0);
    kt_mode_watch_free(NULL);
}

/* ---- excitation -------------------------------------------------------------------------------------------------- */

/* A state in one shape is in one mode. The amplitude of its velocities is independent of the phase: |v| at the middle,
 * omega |q| at the turn. */
KT_TEST(excitation_is_the_amplitude_of_velocities) {
    train t;
    kt_error error = {0};
    train_open(&t, 4, 1.0, 400.0, 0.0);
    kt_spectrum *spectrum = kt_test_spectrum(t.model, 1);
    for (int j = 1; j <= 4; j++)
        for (int turn = 0; turn < 2; turn++) {
            double shape[TRAIN_MAX], q[TRAIN_MAX] = {0.0}, v[TRAIN_MAX] = {0.0}, most = 0.0;
            const double omega = train_eigenvalue(&t, j).im;
            train_shape(&t, j, shape);
            for (int k = 0; k < 4; k++) {
                q[k] = turn ? shape[k] / omega : 0.0;
                v[k] = turn ? 0.0 : shape[k];
                most = fmax(most, fabs(shape[k]));
            }
            spectrum = NULL;
            spectrum = kt_test_spectrum(t.model, 1);
            kt_linearization *linearization = kt_test_linearization(t.model, NULL);
            kt_check_equal_int("add", kt_spectrum_add(spectrum, 0.0, q, v, NULL, &error), KT_OK);
            kt_check_equal_int("units", kt_linearization_evaluate(linearization, 0.0, q, v, NULL, &error), KT_OK);
            const double unit = kt_linearization_system(linearization)->unit[0];
            for (int i = 0; i < kt_spectrum_count(spectrum); i++)
                kt_check_near(4 - i == j ? "its own" : "another",
                              kt_spectrum_at(spectrum, i).mode.excitation * unit / most, 4 - i == j ? 1.0 : 0.0,
                              64.0 * DBL_EPSILON); /* measured: 8 */
        }
}

/* ---- steps a period ---------------------------------------------------------------------------------------------- */

/* The true error of a run of one period, in q and v / omega over the amplitude. */
static double error_of_run(const train *t, const kt_method *method, double omega, int samples) {
    kt_error error = {0};
    kt_run run = kt_run_default();
    const double period = 2.0 * pi / omega, q = 0.01, v = 0.0;
    double result = HUGE_VAL;
    run.duration = period;
    run.integrator = method->name;
    run.step = period / samples;
    kt_simulation *simulation = kt_test_simulation(t->model, &run, NULL);
    kt_need(kt_check_equal_int("start", kt_simulation_set_state(simulation, 0.0, &q, &v, &error), KT_OK));
    kt_need(kt_check_equal_int("run", kt_simulation_advance(simulation, period, &error), KT_OK));
    result = hypot(kt_simulation_positions(simulation)[0] - q, kt_simulation_velocities(simulation)[0] / omega) / q;
    return result;
}

KT_TEST(error_of_a_period_is_that_of_a_run) {
    train t;
    train_open(&t, 1, 1.0, 100.0, 0.0);
    KT_WORST worst = kt_worst_make("error of a period against a run");
    const kt_complex lambda = train_eigenvalue(&t, 1);
    for (int i = 0; i < kt_method_count(); i++)
        for (int samples = 4; samples <= 64; samples *= 2) {
            const kt_method *method = kt_method_at(i);
            kt_stability stability;
            if (kt_method_stages_vary(method) || method->steps > 0 || /* begins by another method */
                !kt_check_equal_int("made", kt_stability_make(method, 0, &stability, NULL), KT_OK))
                continue;
            const double predicted = kt_stability_period_error(&stability, lambda, 2.0 * pi / lambda.im / samples);
            const double found = error_of_run(&t, method, lambda.im, samples);
            kt_worst_near(&worst, found, predicted, 1e-11 * fmax(1.0, predicted), "%s, %d", method->name, samples);
        }
}

static kt_sampling sampling_of(const train *t, const char *method, const double *q, const double *v, double step) {
    kt_error error = {0};
    kt_sampling sampling = {-2, 0.0, 0.0, 0.0};
    kt_spectrum *spectrum = kt_test_spectrum(t->model, 1);
    kt_need(kt_check_equal_int("add", kt_spectrum_add(spectrum, 0.0, q, v, NULL, &error), KT_OK));
    sampling = kt_spectrum_sampling(spectrum, kt_method_find(method), step);
    return sampling;
}

KT_TEST(few_steps_a_period_are_told_with_the_step_that_is_enough) {
    static const char *const methods[] = {"euler", "heun", "rk4", "dopri5", "tsit5", "rkc2"};
    train t;
    train_open(&t, 1, 1.0, 100.0, 0.0);
    const double q = 0.0, v = 1.0, period = 0.2 * pi;
    for (int i = 0; i < 6; i++) {
        const kt_sampling few = sampling_of(&t, methods[i], &q, &v, period / 2.5);
        kt_check_equal_int(methods[i], few.mode, 0);
        kt_check_near("steps a period", few.samples, 2.5, 1e-14);
        kt_check_above("error", few.error, 10.0 * KT_SAMPLING_ERROR);
        kt_check_equal_int("not enough", sampling_of(&t, methods[i], &q, &v, 1.01 * few.step).mode, 0);
        kt_check_equal_int("enough", sampling_of(&t, methods[i], &q, &v, 0.99 * few.step).mode, -1);
    }
    /* `2 pi y^4 / 120` of rk4's phase, up to y^6 */
    kt_check_near("of rk4", period / sampling_of(&t, "rk4", &q, &v, 0.3).step,
                  2.0 * pi / pow(0.01 * 120.0 / (2.0 * pi), 0.25), 0.5);
}

/* A fast flywheel next to a block on a spring: 500 rad/s of the one, which needs no samples, do not outweigh the
 * other. */
KT_TEST(a_steady_spin_hides_no_oscillation) {
    kt_body bodies[2];
    train t = {.count = 2};
    bodies[0] = kt_body_of("flywheel", NULL, KT_JOINT_REVOLUTE, 0.0);
    bodies[0].inertia.xx = bodies[0].inertia.yy = bodies[0].inertia.zz = 1.0;
    bodies[1] = kt_body_of("block", NULL, KT_JOINT_PRISMATIC, 0.0);
    bodies[0].mass = bodies[1].mass = 1.0;
    kt_effect spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, "block");
    spring.stiffness = 100.0;
    kt_description description = kt_description_of(bodies, 2, NULL, 0, &spring, 1);
    const double q[2] = {0.0, 0.0}, v[2] = {500.0, 0.01}, period = 2.0 * pi / 10.0;
    t.model = kt_test_model(&description, NULL);
    kt_check_near("steps a period", sampling_of(&t, "rk4", q, v, period / 4.0).samples, 4.0, 1e-14);
    kt_check_equal_int("of enough", sampling_of(&t, "rk4", q, v, period / 20.0).mode, -1);
}

/* The slow shape alone: the fast one needs no samples. A twentieth of it is enough to count. */
KT_TEST(only_what_is_excited_counts) {
    train t;
    train_open(&t, 2, 1.0, 100.0, 0.0);
    double slow[TRAIN_MAX], fast[TRAIN_MAX], v[2];
    const double q[2] = {0.0, 0.0}, step = 2.0 * pi / train_eigenvalue(&t, 2).im / 6.0;
    static const double part[] = {0.0, 0.01, 0.1, 1.0};
    train_shape(&t, 1, slow);
    train_shape(&t, 2, fast);
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 2; k++)
            v[k] = slow[k] + part[i] * fast[k];
        kt_check_equal_int("told", sampling_of(&t, "rk4", q, v, step).mode, i < 2 ? -1 : 0);
    }
}
