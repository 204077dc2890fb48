/* Torques that are set at every tick, as samples of a smooth signal. Methods with a history are compared with the
 * motion under the signal itself. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "scenes.h"

#include "kinetree/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DURATION 2.0
#define PACE 3.0 /* rad/s */

static double signal_of(double t, int joint) { return (joint ? 1.0 : 3.0) * sin(PACE * t + 0.4 * joint); }

/* Two bars of 1 m and 1 kg, hanging, with dampers; with motors that follow the signal, if `motors`. */
static kt_model *make_arm(bool motors) {
    kt_body bodies[2];
    kt_effect effects[4];
    kt_description d = kt_description_default();
    static const char *const names[] = {"upper", "lower"};
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_of(names[i], i ? names[0] : NULL, KT_JOINT_REVOLUTE, 1.0);
        bodies[i].joint.at = kt_vec3_make(0.0, i ? -1.0 : 0.0, 0.0);
        bodies[i].com = kt_vec3_make(0.0, -0.5, 0.0);
        bodies[i].inertia = kt_sym3_make(1.0 / 12.0, 0.01, 1.0 / 12.0, 0.0, 0.0, 0.0);
        effects[i] = effects[2 + i] = kt_effect_default();
        effects[i].type = KT_EFFECT_JOINT_DAMPER;
        effects[i].joint = effects[2 + i].joint = names[i];
        effects[i].damping = 4.0;
        effects[2 + i].type = KT_EFFECT_MOTOR;
        effects[2 + i].torque = kt_function_sine(i ? 1.0 : 3.0, PACE / (2.0 * acos(-1.0)), 0.4 * i, 0.0);
    }
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&d, bodies, 2, NULL, 0, effects, motors ? 4 : 2);
    return kt_scene_compile(&d);
}

static kt_simulation *open_simulation(const kt_model *model, const char *method, double step, bool smooth) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    if (step == 0.0)
        run.relative = run.absolute = 1e-13;
    options.smooth_inputs = smooth;
    return kt_test_simulation(model, &run, &options);
}

/* One tick from the present time: the torques are samples at its start. */
static bool tick(kt_simulation *simulation, int k, double h) {
    kt_error e = {0};
    const double tau[2] = {signal_of(k * h, 0), signal_of(k * h, 1)};
    return kt_simulation_set_torque(simulation, tau, &e) == KT_OK && kt_simulation_tick(simulation, h, &e) == KT_OK;
}

/* The error of the last positions against `expected`, and the evaluations a tick. */
static double run(const kt_model *model, const char *method, double h, bool smooth, bool changes,
                  const double expected[2], double *evaluations) {
    const int ticks = (int)lround(DURATION / h);
    kt_simulation *simulation = open_simulation(model, method, h, smooth);
    bool fine = true;
    for (int k = 0; k < ticks && fine; k++)
        fine = tick(simulation, changes ? k : 0, h);
    kt_check_true("runs", fine);
    const double *q = kt_simulation_positions(simulation);
    const double error = fine ? hypot(q[0] - expected[0], q[1] - expected[1]) : (double)NAN;
    *evaluations = (double)kt_simulation_counts_of(simulation).evaluations / ticks;
    return error;
}

/* The motion under the signal itself. */
static void find_reference(double expected[2]) {
    kt_model *model = make_arm(true);
    kt_simulation *simulation = open_simulation(model, "dop853", 0.0, false);
    kt_test_advance(simulation, DURATION);
    memcpy(expected, kt_simulation_positions(simulation), 2 * sizeof *expected);
}

/* Samples that are held for a tick lag behind the signal by half a tick: an error of order 1 that all methods have.
 * With their past, these methods have the same lag at fewer evaluations. The method ab2 has only one past slope, and
 * starts by a method with as many evaluations. BDF2 would have twice the error, and starts anew. The figures are those
 * of include/pages/step-cost.md, to the digits that it gives. */
KT_TEST(methods_with_a_past_keep_it_under_smooth_inputs) {
    static const struct {
        const char *method;
        double many, few, ratio; /* evaluations of a tick without a past and with it, its error over that without */
    } methods[] = {
        {"ab2", 2.0, 2.0, 1.03}, {"ab4", 4.0, 2.0, 0.75}, {"bdf2", 5.8, 5.8, 1.0}, {"two-step", 5.8, 3.9, 0.78}};
    double expected[2];
    kt_model *model = make_arm(false);
    find_reference(expected);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        double anew[2], kept[2], many, few;
        for (int k = 0; k < 2; k++) {
            const double h = k ? 0.005 : 0.01;
            anew[k] = run(model, methods[m].method, h, false, true, expected, &many);
            kept[k] = run(model, methods[m].method, h, true, true, expected, &few);
        }
        kt_note("%s: %.1f evaluations a tick instead of %.1f", methods[m].method, few, many);
        kt_check_near("evaluations of starting anew", many, methods[m].many, 0.05);
        kt_check_near("evaluations with the past", few, methods[m].few, 0.05);
        kt_check_near("error over that of starting anew", kept[1] / anew[1], methods[m].ratio, 0.005);
        kt_check_above("order", log2(kept[0] / kept[1]), 0.9);
        kt_check_above("order of starting anew", log2(anew[0] / anew[1]), 0.9);
    }
}

/* Their history is the rate of decay of the right-hand side, which inputs hardly change. It is kept for all inputs.
 * Torques that change therefore take no more evaluations than constant ones. The counts are 2.8 and 10.8. They would
 * otherwise be 6.0 and 14.0. */
KT_TEST(stabilised_methods_keep_their_spectral_radius) {
    static const char *const methods[] = {"rkc2", "rkc4"};
    double expected[2];
    kt_model *model = make_arm(false);
    find_reference(expected);
    for (int m = 0; m < 2; m++) {
        double changing, constant;
        const double error[2] = {run(model, methods[m], 0.01, false, true, expected, &changing),
                                 run(model, methods[m], 0.005, false, true, expected, &changing)};
        (void)run(model, methods[m], 0.005, false, false, expected, &constant);
        kt_note("%s: %.1f evaluations a tick, %.1f under constant torques", methods[m], changing, constant);
        kt_check_above("order", log2(error[0] / error[1]), 0.9);
        kt_check_below("evaluations over those under constant torques", changing / constant, 1.1);
    }
}

KT_TEST(checkpoints_between_samples_are_exact) {
    static const char *const methods[] = {"ab2", "ab4", "bdf2", "two-step", "rkc2", "radau5"};
    kt_model *model = make_arm(false);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *one = open_simulation(model, methods[m], 0.01, true);
        kt_simulation *other = open_simulation(model, methods[m], 0.01, true);
        void *block = malloc(kt_simulation_state_size(one));
        kt_error e = {0};
        bool fine = true;
        for (int k = 0; k < 23 && fine; k++)
            fine = tick(one, k, 0.01);
        kt_simulation_save(one, block);
        fine = fine && kt_simulation_restore(other, block, &e) == KT_OK;
        for (int k = 23; k < 40 && fine; k++)
            fine = tick(one, k, 0.01) && tick(other, k, 0.01);
        kt_check_true(methods[m], fine);
        kt_check_equal_bits("positions", kt_simulation_positions(other), kt_simulation_positions(one), 2);
        kt_check_equal_bits("velocities", kt_simulation_velocities(other), kt_simulation_velocities(one), 2);
        kt_simulation *third = open_simulation(model, methods[m], 0.01, false);
        kt_check_equal_int("another option", kt_simulation_restore(third, block, &e), KT_ERROR_ARGUMENT);
        kt_check_contains("its name", e.message, "smooth_inputs");
        free(block);
    }
}
