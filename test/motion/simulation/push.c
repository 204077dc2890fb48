/* Torques and wrenches of the embedding program: held over a step, no longer and no less. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <float.h>
#include <math.h>

enum { STEPS = 50 };
static const double step = 0.02, mass = 2.0;

/* A force that jumps at every step, up and down. */
static double force_of(int k) { return k % 3 == 0 ? 5.0 : -3.0 - k; }

/* Constant force over a step: q += v h + F h^2 / 2m, v += F h / m. Every method of order 2 has this exactly. Errors on
 * each side are one rounding of the running value a step, and up to eight of the increment in sums over stages. The
 * errors of the velocity continue in the position. */
static void follow_slider(kt_run run, bool by_advance) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    KT_WORST position = kt_worst_make("position"), velocity = kt_worst_make("velocity");
    double q = 0.0, v = 0.0, slack_q = 0.0, slack_v = 0.0;
    for (int k = 0; k < STEPS; k++) {
        double force = force_of(k);
        (void)kt_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
        if (by_advance)
            kt_test_advance(simulation, (k + 1) * step);
        else
            (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
        double dv = force / mass * step, dq = (v + 0.5 * dv) * step;
        slack_q += DBL_EPSILON * (fabs(q + dq) + 8.0 * (fabs(v) + fabs(dv)) * step) + step * slack_v;
        slack_v += DBL_EPSILON * (fabs(v + dv) + 8.0 * fabs(dv));
        q += dq;
        v += dv;
        kt_worst_near(&velocity, kt_simulation_velocities(simulation)[0], v, slack_v, "k = %d", k);
        kt_worst_near(&position, kt_simulation_positions(simulation)[0], q, slack_q, "k = %d", k);
    }
}

KT_TEST(torque_is_held_over_a_fixed_step) {
    follow_slider(kt_run_fixed("rk4", step, 1.0), false);
    follow_slider(kt_run_fixed("midpoint", step, 1.0), false);
}

/* The last stage of a step is the first slope of the next: with the new force it must be evaluated again. */
KT_TEST(torque_is_held_where_the_last_stage_is_used_again) {
    follow_slider(kt_run_fixed("dopri5", step, 1.0), false);
    follow_slider(kt_run_fixed("tsit5", step, 1.0), false);
}

KT_TEST(torque_is_held_between_calls_of_advance) {
    kt_run run = kt_run_default();
    follow_slider(run, true);
    run.integrator = "dop853";
    follow_slider(run, true);
    follow_slider(kt_run_fixed("rk4", 0.013, 1.0), true); /* each advance is one step and a shorter one */
}

/* A run of 3000 periods of 1 ms makes 3000 steps, for any division of the period by the step. They end at 3 s to the
 * bit, also from a start that is no multiple of the period. With t += 1e-3 there are half as many again. */
KT_TEST(periods_are_whole_steps) {
    static const struct {
        const char *integrator;
        double step, start;
        uint64_t steps;
    } cases[] = {
        {"rk4", 1e-3, 0.0, 3000}, {"rk4", 2.5e-4, 0.0, 12000}, {"heun", 1e-3, 0.7123, 3000}, {"dopri5", 0.0, 0.0, 0}};
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        kt_run run = cases[i].step > 0.0 ? kt_run_fixed(cases[i].integrator, cases[i].step, 5.0) : kt_run_default();
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_error error;
        bool fine = true;
        for (int way = 0; way < 2 && fine; way++) {
            const double still[1] = {0.0}, start = cases[i].start;
            double t = start;
            fine = kt_fine("start", kt_simulation_set_state(simulation, start, still, still, &error), &error);
            for (int k = 0; k < 3000 && fine; k++)
                fine = (way == 0 ? kt_simulation_tick(simulation, 1e-3, &error)
                                 : kt_simulation_advance(simulation, t += 1e-3, &error)) == KT_OK;
            const uint64_t steps = kt_simulation_counts_of(simulation).steps;
            if (way == 0) {
                if (cases[i].steps > 0)
                    kt_check_equal_int("steps", (int)steps, (int)cases[i].steps);
                kt_check_near("end, s", kt_simulation_time(simulation), start + 3000 * 1e-3, 0.0);
            } else if (cases[i].step == 1e-3 && start == 0.0)
                kt_check_above("steps with a sum of times", (double)steps, 4000.0);
        }
        kt_check_true("all went well", fine);
    }
}

/* After an odd time a period has its exact length. An invalid period is rejected. */
KT_TEST(periods_begin_anywhere) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 1e-3, 5.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    kt_test_advance(simulation, 0.0123);
    (void)kt_fine("period", kt_simulation_tick(simulation, 0.002, &error), &error);
    kt_check_near("0.0123 s + 2 ms", kt_simulation_time(simulation), 0.0123 + 0.002, 0.0);
    kt_check_equal_int("0", kt_simulation_tick(simulation, 0.0, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("back", kt_simulation_tick(simulation, -1e-3, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("NaN", kt_simulation_tick(simulation, (double)NAN, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("without end", kt_simulation_tick(simulation, HUGE_VAL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("shorter than rounding", kt_simulation_tick(simulation, 1e-19, &error), KT_ERROR_ARGUMENT);
    kt_check_near("the time stays", kt_simulation_time(simulation), 0.0123 + 0.002, 0.0);
}

KT_TEST(torque_stays_until_it_is_set_again) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.5, 10.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    double force = 3.0;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &force, &error), &error);
    kt_test_advance(simulation, 2.0);
    (void)kt_fine("no torque", kt_simulation_set_torque(simulation, NULL, &error), &error);
    kt_test_advance(simulation, 4.0);
    kt_check_near("velocity", kt_simulation_velocities(simulation)[0], 3.0, 4.0 * DBL_EPSILON);
    kt_check_near("position", kt_simulation_positions(simulation)[0], 9.0, 32.0 * DBL_EPSILON);
}

/* A free body without gravity: a force gives m a, a moment about z gives Izz alpha while it spins about z alone. */
KT_TEST(wrench_pushes_and_turns_a_free_body) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.1, 1.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    kt_wrench wrenches[2] = {{{9.0, 9.0, 9.0}, {9.0, 9.0, 9.0}}, {{0.0, 0.0, 1.5}, {1.0, -2.0, 4.0}}};
    double a[6];
    (void)kt_fine("wrenches", kt_simulation_set_wrenches(simulation, wrenches, &error), &error);
    (void)kt_fine("acceleration", kt_simulation_acceleration(simulation, a, &error), &error);
    kt_check_near("linear acceleration", a[0], 0.5, 4.0 * DBL_EPSILON);
    kt_check_near("angular acceleration", a[5], 0.5, 4.0 * DBL_EPSILON);
    kt_test_advance(simulation, 1.0);
    const double *v = kt_simulation_velocities(simulation), *q = kt_simulation_positions(simulation);
    kt_check_near("vx", v[0], 0.5, 16.0 * DBL_EPSILON);
    kt_check_near("vy", v[1], -1.0, 16.0 * DBL_EPSILON);
    kt_check_near("vz", v[2], 2.0, 32.0 * DBL_EPSILON);
    kt_check_near("spin", v[5], 0.5, 16.0 * DBL_EPSILON);
    kt_check_near("x", q[0], 0.25, 16.0 * DBL_EPSILON);
}

/* One second of each. */
KT_TEST(wrench_gives_way_to_the_next_one) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.25, 3.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    const double forces[3] = {1.0, -4.0, 8.0};
    double velocity = 0.0;
    for (int k = 0; k < 3; k++) {
        const kt_wrench wrenches[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0}, {forces[k], 0.0, 0.0}}};
        (void)kt_fine("wrenches", kt_simulation_set_wrenches(simulation, wrenches, &error), &error);
        kt_test_advance(simulation, k + 1.0);
        velocity += forces[k] / mass;
        kt_check_near("velocity", kt_simulation_velocities(simulation)[0], velocity, 16.0 * DBL_EPSILON);
    }
}

/* A recorder may set the torque: it holds from the next step on, and not in the step whose records are being read. */
typedef struct kt_controller {
    kt_simulation *simulation;
    double force;
    kt_worst acceleration;
    double expected;
} kt_controller;

static int control(const kt_record *record, void *user) {
    kt_controller *c = user;
    kt_error error;
    double step_of_record = ceil(record->t / 0.5 - 1e-9); /* records at a step's end belong to it */
    double expected = step_of_record <= 1.0 ? 0.0 : c->expected;
    kt_worst_near(&c->acceleration, record->a[0], expected, 2.0 * DBL_EPSILON * 4.0, "t = %g", record->t);
    if (record->t == 0.25)
        (void)kt_fine("torque", kt_simulation_set_torque(c->simulation, &c->force, &error), &error);
    return 0;
}

KT_TEST(recorder_sets_the_torque_of_the_next_step) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.5, 2.0);
    run.interval = 0.125;
    run.record = KT_RECORD_ACCELERATION;
    kt_controller c = {kt_test_simulation(model, &run, NULL), 8.0, kt_worst_make("acceleration"), 4.0};
    kt_test_run(c.simulation, control, &c);
    kt_check_worst(&c.acceleration);
    kt_check_near("velocity at the end", kt_simulation_velocities(c.simulation)[0], 1.5 * 4.0, 16.0 * DBL_EPSILON);
}

KT_TEST(push_that_is_not_finite_is_rejected_and_the_old_one_stays) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, mass);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    kt_error error;
    double torque[6] = {2.0, 0.0, 0.0, 0.0, 0.0, 0.0}, a[6];
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, torque, &error), &error);
    torque[4] = (double)NAN;
    kt_check_equal_int("torque", kt_simulation_set_torque(simulation, torque, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("where", error.where, "joint 'block'");
    kt_wrench wrenches[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, HUGE_VAL, 0.0}, {0.0, 0.0, 0.0}}};
    kt_check_equal_int("wrench", kt_simulation_set_wrenches(simulation, wrenches, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("where", error.where, "body 'block'");
    (void)kt_fine("acceleration", kt_simulation_acceleration(simulation, a, &error), &error);
    kt_check_near("the old force acts", a[0], 1.0, 2.0 * DBL_EPSILON);
}
