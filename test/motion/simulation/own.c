/* Right-hand sides and projections of the caller's in a simulation. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <float.h>
#include <math.h>

/* A slider that its caller ties to the origin by a spring of its own: a = -w^2 q + tau / m, q = q0 cos w t. */
typedef struct tied {
    double w, extra; /* extra: positions move faster by this much */
    int calls, fail_after, code;
    bool speaks;
    int projections;
    double pull; /* the projection moves q by this */
    double last_torque;
} tied;

static int accelerate(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    tied *s = user;
    s->calls++;
    if (s->fail_after > 0 && s->calls > s->fail_after) {
        if (s->speaks)
            (void)kt_error_set(error, KT_ERROR_NOT_FINITE, "the spring", "it broke at %g", at->q[0]);
        return s->code;
    }
    s->last_torque = at->tau ? at->tau[0] : 0.0;
    rate[0] += s->extra;
    a[0] = -s->w * s->w * at->q[0] + s->last_torque / kt_body_mass(at->model, 1);
    return 0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int pull(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user) {
    tied *s = user;
    (void)error;
    s->projections++;
    q[0] += s->pull;
    *changed = s->pull != 0.0;
    return at->q == q && at->v == v ? 0 : -1;
}

static kt_model *make_slider(void) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    lone.body.joint.position[0] = 0.7;
    return kt_scene_compile(&lone.description);
}

static kt_simulation *simulate(const kt_model *model, kt_run run, tied *s) {
    kt_simulation_options options = kt_simulation_options_default();
    options.acceleration = accelerate;
    options.projection = pull;
    options.user = s;
    return kt_test_simulation(model, &run, &options);
}

KT_TEST(motion_and_records_follow_the_callers_equations) {
    tied s = {.w = 3.0};
    kt_model *model = make_slider();
    kt_error e = {0};
    kt_run run = kt_run_within("dop853", 1e-12, 2.0);
    run.interval = 0.1;
    run.record = KT_RECORD_ACCELERATION;
    kt_simulation *simulation = simulate(model, run, &s);
    kt_kept *kept = kt_kept_empty(model);
    KT_WORST q = kt_worst_make("q"), a = kt_worst_make("a");
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("records", kept->count, 21);
    for (int k = 0; k < kept->count; k++) {
        kt_worst_near(&q, kept->state[k][0], 0.7 * cos(3.0 * kept->time[k]), 1e-10, "t = %g", kept->time[k]);
        kt_worst_near(&a, kept->state[k][2], -9.0 * kept->state[k][0], 16.0 * DBL_EPSILON, "t = %g", kept->time[k]);
    }
    const double torque = 5.0;
    double now = 0.0;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &torque, &e), &e);
    (void)kt_fine("acceleration", kt_simulation_acceleration(simulation, &now, &e), &e);
    kt_check_near("acceleration now, with a torque", now, -9.0 * kt_simulation_positions(simulation)[0] + 2.5,
                  16.0 * DBL_EPSILON);
}

/* q' = v + extra, v' = 0. */
KT_TEST(positions_follow_the_rate_that_the_caller_gives) {
    tied s = {.w = 0.0, .extra = 0.25};
    kt_model *model = make_slider();
    kt_simulation *simulation = simulate(model, kt_run_fixed("rk4", 0.1, 2.0), &s);
    kt_test_advance(simulation, 2.0);
    kt_check_near("q", kt_simulation_positions(simulation)[0], 0.7 + 0.5, 64.0 * DBL_EPSILON);
    kt_check_near("v", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
    kt_check_equal_int("projections", s.projections, 20);
}

KT_TEST(the_callers_projection_moves_the_state_after_each_step) {
    tied s = {.w = 0.0, .pull = 0.01};
    kt_model *model = make_slider();
    kt_simulation *simulation = simulate(model, kt_run_fixed("rk4", 0.1, 1.0), &s);
    kt_test_advance(simulation, 1.0);
    kt_check_near("q", kt_simulation_positions(simulation)[0], 0.7 + 0.1, 32.0 * DBL_EPSILON);
}

/* The state stays the same to the bit. The message is the caller's, or names the part that caused the fault. */
static void fail(int code, bool speaks, const char *words) {
    tied s = {.w = 1.0, .fail_after = 6, .code = code, .speaks = speaks};
    kt_model *model = make_slider();
    kt_error e = {0};
    kt_simulation *simulation = simulate(model, kt_run_fixed("rk4", 0.1, 2.0), &s);
    (void)kt_fine("first step", kt_simulation_step(simulation, 1.0, &e), &e);
    const double before = kt_simulation_positions(simulation)[0];
    kt_check_true("second step fails", kt_simulation_step(simulation, 1.0, &e) != KT_OK);
    kt_check_contains("message", e.message, words);
    kt_check_contains("where", e.where, "t = 0.1");
    kt_check_equal_bits("q", kt_simulation_positions(simulation), &before, 1);
}

KT_TEST(failures_of_the_callers_equations_are_told_in_its_words) {
    fail(1, true, "it broke at 0.");
    fail(-1, true, "it broke at 0.");
    fail(1, false, "the caller's right-hand side returned 1");
    fail(-3, false, "the caller's right-hand side returned -3");
}

/* An adaptive method avoids failures that only large steps cause. */
/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int reject_large_steps(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    (void)rate;
    (void)error;
    a[0] = -at->q[0];
    return at->t - *(double *)user > 0.05 ? 1 : 0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int note_time(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user) {
    (void)q, (void)v, (void)error;
    *changed = false;
    *(double *)user = at->t;
    return 0;
}

KT_TEST(recoverable_failures_shorten_adaptive_steps) {
    double last = 0.0;
    kt_model *model = make_slider();
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.relative = run.absolute = 1e-4;
    options.acceleration = reject_large_steps;
    options.projection = note_time;
    options.user = &last;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_test_advance(simulation, 1.0);
    kt_check_above("rejected", (double)kt_simulation_counts_of(simulation).rejected, 1.0);
    kt_check_above("steps", (double)kt_simulation_counts_of(simulation).steps, 20.0);
    kt_check_near("q", kt_simulation_positions(simulation)[0], 0.7 * cos(1.0), 1e-10);
}
