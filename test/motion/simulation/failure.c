/* Messages of a simulation that cannot go on, and its state afterwards. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A step that must fail with this code, keep the state, and report the time and the place. */
static void fail_step(kt_simulation *simulation, kt_status expected, const char *time, const char *joint) {
    kt_error error = {KT_OK, "", ""};
    double state[2] = {kt_simulation_positions(simulation)[0], kt_simulation_velocities(simulation)[0]};
    double t = kt_simulation_time(simulation);
    kt_check_equal_int("status", kt_simulation_step(simulation, HUGE_VAL, &error), expected);
    kt_check_equal_int("code", error.code, expected);
    kt_check_contains("time", error.where, time);
    kt_check_contains("joint", error.where, joint);
    kt_note("%s: %s", error.where, error.message);
    double now[2] = {kt_simulation_positions(simulation)[0], kt_simulation_velocities(simulation)[0]};
    kt_check_equal_bits("state", now, state, 2);
    kt_check_equal_bits("clock", &(double){kt_simulation_time(simulation)}, &t, 1);
}

/* 1e300 N on 1e-20 kg overflow. */
static void overflow(kt_run run) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1e-20);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    double force = 1e-19;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
    kt_test_advance(simulation, 0.25);
    force = 1e300;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
    fail_step(simulation, KT_ERROR_NOT_FINITE, "t = 0.25 s", "joint 'block'");
    kt_check_equal_int("status without words", kt_simulation_step(simulation, HUGE_VAL, NULL), KT_ERROR_NOT_FINITE);
    force = -1e-19;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
    kt_test_advance(simulation, 0.5);
    kt_check_near("velocity", kt_simulation_velocities(simulation)[0], 0.0, 32.0 * DBL_EPSILON);
}

KT_TEST(not_finite_names_time_and_joint_and_leaves_the_state) {
    overflow(kt_run_fixed("rk4", 0.125, 10.0));
    overflow(kt_run_fixed("dopri5", 0.125, 10.0));
    overflow(kt_run_default());
}

/* Spun so fast about two axes that the third rate overflows in the first stage after the start, for any step. In the
 * end the step is lost in the rounding of the time, and the message has both facts. */
KT_TEST(adaptive_step_that_never_succeeds_tells_the_cause) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation_options options = kt_simulation_options_default();
    options.initial_step = 0.01;
    kt_simulation *simulation = kt_test_simulation(model, NULL, &options);
    kt_error error;
    double q[7] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}, v[6] = {0.0, 0.0, 0.0, 3e153, 3e153, 0.0};
    (void)kt_fine("state", kt_simulation_set_state(simulation, 1.0, q, v, &error), &error);
    kt_check_equal_int("status", kt_simulation_run(simulation, kt_keep, kt_kept_empty(model), &error),
                       KT_ERROR_NOT_FINITE);
    kt_note("%s: %s", error.where, error.message);
    kt_check_contains("time", error.where, "t = 1 s");
    kt_check_contains("joint", error.where, "'block'");
    kt_check_contains("message", error.message, "smaller steps did not help");
}

/* Two sliders. Friction that changes sign within 1e-12 m/s holds the second by 100 N. The accepted steps have a length
 * of 1e-10 s. */
KT_TEST(motion_that_does_not_get_on_ends_and_names_the_joint) {
    kt_body bodies[2];
    kt_effect brake = kt_effect_default();
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_of(i == 0 ? "runner" : "stopper", NULL, KT_JOINT_PRISMATIC, 1.0);
        bodies[i].joint.velocity[0] = 0.1;
    }
    brake.name = "brake";
    brake.type = KT_EFFECT_JOINT_FRICTION;
    brake.joint = "stopper";
    brake.coulomb = 100.0;
    brake.smoothing = 1e-12;
    kt_description description = kt_description_of(bodies, 2, NULL, 0, &brake, 1);
    description.gravity = kt_vec3_make(1.0, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int("status", kt_simulation_run(simulation, kt_keep, kt_kept_empty(model), &error), KT_ERROR_STEP);
    kt_note("%s: %s", error.where, error.message);
    kt_check_contains("time and joint", error.where, "t = 0.00101");
    kt_check_contains("joint", error.where, " s, joint 'stopper'");
    kt_check_contains("message", error.message, "the motion makes no progress");
    const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
    kt_check_below("tries", (double)(counts.steps + counts.rejected), 20000.0);
}

/* A point mass 1 m above a universal joint (about x, then y). Tilted by a right angle, it lies on the x axis. A
 * rotation about that axis does not move it. */
KT_TEST(singular_names_time_and_joint) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_UNIVERSAL, 1.0);
    lone.body.name = "pointer";
    lone.body.inertia = (kt_sym3){0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    lone.body.joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    lone.body.joint.axis2 = kt_vec3_make(0.0, 1.0, 0.0);
    lone.body.com = kt_vec3_make(0.0, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    kt_error error;
    double q[2] = {0.0, 0.5 * 3.14159265358979323846}, v[2] = {1.0, 0.0};
    (void)kt_fine("state", kt_simulation_set_state(simulation, 0.5, q, v, &error), &error);
    fail_step(simulation, KT_ERROR_SINGULAR, "t = 0.5 s", "joint 'pointer'");
}

/* The steps that there are give their records; then the run ends in words. */
KT_TEST(run_that_fails_has_handed_over_all_records_up_to_then) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error;
    run.interval = 0.01;
    options.max_steps = 20;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_kept *kept = kt_kept_empty(model);
    kt_check_equal_int("status", kt_simulation_run(simulation, kt_keep, kept, &error), KT_ERROR_STEP);
    kt_note("%s: %s", error.where, error.message);
    kt_check_contains("message", error.message, "max_steps");
    double t = kt_simulation_time(simulation);
    kt_check_above("time reached", t, 0.1);
    kt_check_equal_int("records", kept->count, (long long)floor(t / 0.01) + 1);
    kt_simulation_counts counts = kt_simulation_counts_of(simulation);
    kt_check_equal_int("steps and rejected", (long long)counts.steps + (long long)counts.rejected, 20);
}

/* ---- what is asked for wrongly ----------------------------------------------------------------------------------- */

static void reject(const kt_model *model, const kt_run *run, kt_status expected, const char *where,
                   const char *message) {
    kt_error error = {KT_OK, "", ""};
    kt_simulation *simulation = NULL;
    kt_check_equal_int("status", kt_simulation_create(model, run, NULL, &simulation, &error), expected);
    kt_check_text("where", error.where, where);
    kt_check_contains("message", error.message, message);
    kt_check_true("no simulation", simulation == NULL);
    kt_check_equal_int("size", (long long)kt_simulation_size(model, run, NULL), 0);
}

KT_TEST(run_that_makes_no_sense_is_rejected_in_words) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    run.integrator = "dopri6";
    reject(model, &run, KT_ERROR_ARGUMENT, "integrator", "dopri6");
    run.integrator = "rk4";
    reject(model, &run, KT_ERROR_ARGUMENT, "integrator", "give it a step");
    run = kt_run_default();
    run.duration = (double)NAN;
    reject(model, &run, KT_ERROR_ARGUMENT, "duration", "nan");
    run.duration = -1.0;
    reject(model, &run, KT_ERROR_ARGUMENT, "duration", "-1");
    run = kt_run_default();
    run.step = -1e-3;
    reject(model, &run, KT_ERROR_ARGUMENT, "step", "-0.001");
    run = kt_run_default();
    run.interval = HUGE_VAL;
    reject(model, &run, KT_ERROR_ARGUMENT, "interval", "inf");
    run.interval = 1e-17;
    reject(model, &run, KT_ERROR_ARGUMENT, "interval", "more records");
    kt_marker_pair marker[2] = {{kt_body_name(model, 1), NULL}, {"bloc", "tip"}};
    run = kt_run_default();
    run.markers = marker;
    run.marker_count = 1;
    reject(model, &run, KT_ERROR_ARGUMENT, "markers[0]", "no name of a marker");
    marker[0].marker = "tipp";
    reject(model, &run, KT_ERROR_ARGUMENT, "markers[0]", "has no marker 'tipp'");
    run.markers = &marker[1];
    reject(model, &run, KT_ERROR_ARGUMENT, "markers[0]", "no body 'bloc'");
    const kt_marker tip = {.name = "tip"};
    lone.body.markers = &tip;
    lone.body.marker_count = 1;
    marker[0] = marker[1] = (kt_marker_pair){lone.body.name, "tip"};
    run.markers = marker;
    run.marker_count = 2;
    reject(kt_scene_compile(&lone.description), &run, KT_ERROR_ARGUMENT, "markers[1]", "is there already");
}

KT_TEST(clock_does_not_run_backwards) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    kt_error error;
    kt_test_advance(simulation, 1.0);
    kt_test_advance(simulation, 1.0);
    kt_check_equal_int("advance", kt_simulation_advance(simulation, 0.5, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("NaN", kt_simulation_advance(simulation, (double)NAN, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("for ever", kt_simulation_advance(simulation, HUGE_VAL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("step", kt_simulation_step(simulation, 1.0, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("NaN", kt_simulation_step(simulation, (double)NAN, &error), KT_ERROR_ARGUMENT);
}

KT_TEST(state_that_is_not_finite_is_rejected_and_the_old_one_stays) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    kt_error error;
    double q[7] = {1.0, 2.0, 3.0, 0.0, 0.0, 0.0, -2.0}, v[6] = {0.5, 0.0, 0.0, 0.0, 0.0, 0.0};
    static const double unit[4] = {0.0, 0.0, 0.0, -1.0};
    (void)kt_fine("state", kt_simulation_set_state(simulation, 2.0, q, v, &error), &error);
    kt_check_equal_bits("quaternion scaled", kt_simulation_positions(simulation) + 3, unit, 4);
    v[3] = HUGE_VAL;
    kt_check_equal_int("velocity", kt_simulation_set_state(simulation, 0.0, q, v, &error), KT_ERROR_NOT_FINITE);
    kt_check_text("where", error.where, "joint 'block'");
    v[3] = 0.0;
    q[5] = q[6] = 0.0;
    kt_check_equal_int("quaternion", kt_simulation_set_state(simulation, 0.0, q, v, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_bits("quaternion", kt_simulation_positions(simulation) + 3, unit, 4);
    kt_check_near("time", kt_simulation_time(simulation), 2.0, 0.0);
}

/* A force of a program, which fails at one of its calls. */
typedef struct failing {
    long calls, at;
} failing;

static int fail_once(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    failing *f = user;
    (void)t;
    (void)balance;
    *force = -3.0 * sin(q) - 0.1 * v;
    return ++f->calls == f->at ? -1 : 0;
}

/* Runs ticks of two steps and a half, with another torque in each, and repeats a tick that fails. Returns whether one
 * has failed. */
static bool run_ticks(const kt_model *model, const char *method, double state[2]) {
    const kt_run run = kt_run_fixed(method, 2e-3, 1.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    bool failed = false;
    for (int k = 1; k <= 20; k++) {
        const double tau = 0.1 * (k % 3);
        (void)kt_fine("torque", kt_simulation_set_torque(simulation, &tau, &error), &error);
        if (kt_simulation_advance(simulation, 5e-3 * k, &error) != KT_OK) {
            failed = true;
            (void)kt_fine("again", kt_simulation_advance(simulation, 5e-3 * k, &error), &error);
        }
    }
    state[0] = kt_simulation_positions(simulation)[0];
    state[1] = kt_simulation_velocities(simulation)[0];
    return failed;
}

KT_TEST(methods_repeat_a_step_that_failed_with_the_same_bits) {
    static const char *const methods[] = {"radau5", "bdf2", "two-step", "implicit-euler", "midpoint", "rk4", "dopri5",
                                          "ab2",    "ab4",  "rkc4"};
    failing f = {.at = -1};
    kt_body body = kt_body_default();
    kt_effect effect = kt_effect_default();
    kt_description d = kt_description_default();
    body.name = "a";
    body.joint.type = KT_JOINT_REVOLUTE;
    body.joint.position[0] = 0.4;
    body.mass = 1.0;
    body.com = kt_vec3_make(0.0, -0.4, 0.0);
    effect.type = KT_EFFECT_CUSTOM;
    effect.joint = "a";
    effect.joint_force = fail_once;
    effect.user = &f;
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    d.bodies = &body;
    d.body_count = 1;
    d.effects = &effect;
    d.effect_count = 1;
    kt_model *model = kt_scene_compile(&d);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        double whole[2], state[2];
        long different = 0, failures = 0;
        f = (failing){.at = -1};
        (void)run_ticks(model, methods[m], whole);
        const long total = f.calls;
        for (long at = 3; at <= total; at += total / 100 + 1) {
            f = (failing){.at = at};
            const bool failed = run_ticks(model, methods[m], state);
            failures += failed;
            different += failed && memcmp(state, whole, sizeof whole) != 0;
        }
        kt_note("%s: %ld runs with a failure", methods[m], failures);
        kt_check_true("steps fail", failures > 10);
        kt_check_equal_int(methods[m], (int)different, 0);
    }
}
