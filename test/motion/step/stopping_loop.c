/* A loop of the caller's that stops once, at any of its calls, ends the step with its name. So do breakpoints without
 * end, and jumps to angles without digits. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct stopping {
    long calls, at; /* it stops at this call */
    bool rejects;   /* it rejects the state at this call instead */
} stopping;

/* A rod of 1 m between the ends. */
static int rod(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equation) {
    stopping *s = user;
    (void)t;
    equation->residual = 0.5 * (kt_vec3_dot(motion->position, motion->position) - 1.0);
    return ++s->calls == s->at ? (s->rejects ? 1 : -7) : 0;
}

static kt_model *two_pendulums(stopping *s, bool closed) {
    kt_body body[2];
    kt_loop loop = kt_loop_default();
    kt_description d = kt_description_default();
    kt_model *model = NULL;
    kt_error e = {0};
    for (int i = 0; i < 2; i++) {
        body[i] = kt_body_default();
        body[i].name = i ? "b" : "a";
        body[i].joint.type = KT_JOINT_REVOLUTE;
        body[i].joint.at = kt_vec3_make(i, 0.0, 0.0);
        body[i].joint.position[0] = 0.4;
        body[i].mass = 1.0;
        body[i].com = kt_vec3_make(0.0, -0.4, 0.0);
        body[i].inertia = kt_sym3_make(0.05, 0.01, 0.05, 0.0, 0.0, 0.0);
        loop.between[i].body = body[i].name;
        loop.between[i].at = kt_vec3_make(0.0, -0.5, 0.0);
    }
    loop.name = "rod";
    loop.type = KT_LOOP_CUSTOM;
    loop.equations = rod;
    loop.user = s;
    loop.equation_count = 1;
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    d.bodies = body;
    d.body_count = 2;
    d.loops = &loop;
    d.loop_count = closed ? 1 : 0;
    kt_need_fine("model", kt_model_compile(&d, NULL, &model, &e), &e);
    return model;
}

static kt_simulation *start(const kt_model *model, const char *integrator, const kt_simulation_options *options) {
    kt_run run = kt_run_default();
    kt_simulation *s = NULL;
    kt_error e = {0};
    run.integrator = integrator;
    run.step = options != NULL ? 0.0 : 2e-3; /* with breakpoints, adaptive steps */
    kt_need_fine("simulation", kt_simulation_create(model, &run, options, &s, &e), &e);
    return s;
}

/* Every 37th call of a run, for one method of each family. */
static void check_stops(const char *integrator) {
    stopping s = {.at = -1};
    kt_model *model = two_pendulums(&s, true);
    kt_simulation *whole = start(model, integrator, NULL);
    kt_error e = {0};
    s.calls = 0;
    kt_need_fine("advance", kt_simulation_advance(whole, 0.02, &e), &e);
    const long total = s.calls;
    long ignored = 0, unnamed = 0, tried = 0;
    kt_simulation_free(whole);
    for (long at = 1; at <= total; at += 37, tried++) {
        kt_simulation *simulation = start(model, integrator, NULL);
        s.calls = 0;
        s.at = at;
        const kt_status status = kt_simulation_advance(simulation, 0.02, &e);
        ignored += status != KT_ERROR_CALLBACK;
        unnamed += status == KT_ERROR_CALLBACK && strstr(e.where, "rod") == NULL && strstr(e.message, "rod") == NULL;
        s.at = -1;
        kt_simulation_free(simulation);
    }
    kt_note("%s: %ld of %ld calls", integrator, tried, total);
    kt_check_equal_int("ignored", ignored, 0);
    kt_check_equal_int("without the name of the loop", unnamed, 0);
    kt_check_above("calls", (double)tried, 10.0);
    kt_model_free(model);
}

/* No number is huge if a callback rejects one state on the way to closed loops. The step goes on, or fails with the
 * cause. */
KT_TEST(loop_that_rejects_a_state_once_is_the_cause) {
    stopping s = {.at = -1, .rejects = true};
    kt_model *model = two_pendulums(&s, true);
    long failed = 0, other = 0;
    for (long at = 1; at <= 200; at++) {
        kt_simulation *simulation = start(model, "rk4", NULL);
        kt_error e = {0};
        s.calls = 0;
        s.at = at;
        const kt_status status = kt_simulation_advance(simulation, 0.02, &e);
        failed += status == KT_ERROR_CONSTRAINT && strstr(e.message, "callback") != NULL;
        other += status != KT_OK && (status != KT_ERROR_CONSTRAINT || strstr(e.message, "callback") == NULL);
        s.at = -1;
        kt_simulation_free(simulation);
    }
    kt_check_equal_int("another cause", other, 0);
    kt_check_above("failures", (double)failed, 10.0);
    kt_model_free(model);
}

KT_TEST(loop_that_stops_once_ends_explicit_steps) { check_stops("rk4"); }
KT_TEST(loop_that_stops_once_ends_adaptive_steps) { check_stops("dop853"); }
KT_TEST(loop_that_stops_once_ends_multistep_steps) { check_stops("ab2"); }
KT_TEST(loop_that_stops_once_ends_implicit_steps) { check_stops("radau5"); }
KT_TEST(loop_that_stops_once_ends_newton_steps) { check_stops("bdf2"); }

static double next_corner(void *user, double t) { return t + *(const double *)user; }

/* Breakpoints 1e-12 s apart need 1e12 steps for a second. The run ends within a few windows of 10,000 steps. */
KT_TEST(breakpoints_without_end_are_no_progress) {
    static const double apart = 1e-12;
    stopping none = {.at = -1};
    kt_model *model = two_pendulums(&none, false);
    kt_simulation_options options = kt_simulation_options_default();
    double user = apart;
    options.breakpoint = next_corner;
    options.user = &user;
    kt_simulation *s = start(model, "dopri5", &options);
    kt_error e = {0};
    kt_check_equal_int("status", kt_simulation_advance(s, 1.0, &e), KT_ERROR_STEP);
    kt_check_contains("message", e.message, "makes no progress");
    kt_check_below("steps", (double)kt_simulation_counts_of(s).steps, 2e5);
    kt_simulation_free(s);
    kt_model_free(model);
}

/* An angle of 1e300 rad has no digit left for the position of a body. */
KT_TEST(angles_without_digits_are_rejected) {
    stopping none = {.at = -1};
    kt_model *model = two_pendulums(&none, false);
    kt_simulation *s = start(model, "rk4", NULL);
    const double far[2] = {0.4, 1e300}, fine[2] = {0.4, 1e9};
    kt_error e = {0};
    kt_check_equal_int("1e300 rad", kt_simulation_jump(s, far, NULL, &e), KT_ERROR_ARGUMENT);
    kt_check_contains("where", e.where, "'b'");
    kt_check_near("unchanged", kt_simulation_positions(s)[1], 0.4, 0.0);
    (void)kt_fine("1e9 rad", kt_simulation_jump(s, fine, NULL, &e), &e);
    kt_check_equal_int("a start there", kt_simulation_set_state(s, 0.0, far, NULL, &e), KT_ERROR_ARGUMENT);
    kt_check_contains("where", e.where, "'b'");
    kt_check_near("still unchanged", kt_simulation_positions(s)[1], 1e9, 0.0);
    (void)kt_fine("a start at 1e9 rad", kt_simulation_set_state(s, 0.0, fine, NULL, &e), &e);
    kt_simulation_free(s);
    kt_model_free(model);
}
