/* Loops that cannot be closed after some time. The error names these loops and reports their gaps a little later, for
 * every way in which the step may fail. It does not name other loops.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "scenes.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.141592653589793;

/* The gap of a loop in the message of an error, m or rad; NaN if the message reports no gap. */
static double gap_of(const kt_error *error, const char *loop) {
    char name[32];
    snprintf(name, sizeof name, "'%s' by ", loop);
    const char *at = strstr(error->message, name);
    char *end = NULL;
    const double gap = at ? strtod(at + strlen(name), &end) : (double)NAN;
    return end && strncmp(end, " deg", 4) == 0 ? gap * pi / 180.0 : gap;
}

typedef struct setting {
    const char *integrator;
    double step; /* 0: adaptive */
    kt_formulation formulation;
} setting;

/* The gaps ahead have more digits than the message prints. */
static const setting settings[] = {{"rk4", 1.234e-3, KT_FORMULATION_TREE},
                                   {"dopri5", 0.0, KT_FORMULATION_TREE},
                                   {"dop853", 0.0, KT_FORMULATION_TREE},
                                   {"dopri5", 0.0, KT_FORMULATION_ABSOLUTE}};
enum { SETTINGS = sizeof settings / sizeof settings[0] };

static const double interval = 0.01234;

static int ignore(const kt_record *record, void *user) {
    (void)record;
    (void)user;
    return 0;
}

/* Runs to where it fails; returns that time, NaN where nothing ran. The search for loops reaches ahead by *ahead. */
static double run_into(const kt_description *description, const setting *with, double *ahead, kt_status *status,
                       kt_error *error) {
    kt_run run = kt_run_default();
    run.integrator = with->integrator;
    run.step = with->step;
    run.interval = interval;
    *ahead = with->step > 0.0 ? with->step : interval;
    kt_model *model = kt_test_model(description, NULL);
    kt_absolute *absolute = kt_formulate(description, NULL, model, with->formulation);
    kt_either e = {NULL, NULL};
    *status = absolute != NULL ? kt_absolute_motion_create(absolute, &run, NULL, &e.motion, error)
                               : kt_simulation_create(model, &run, NULL, &e.simulation, error);
    if (e.motion != NULL)
        e.simulation = kt_absolute_motion_simulation(e.motion);
    if (*status == KT_OK)
        *status = kt_either_run(e, ignore, NULL, error);
    const double t = e.simulation != NULL ? kt_simulation_time(e.simulation) : 0.0;
    kt_note("%s, step %g: %s: %s", with->integrator, with->step, error->where, error->message);
    if (e.motion == NULL)
        kt_simulation_free(e.simulation);
    kt_absolute_motion_free(e.motion);
    return t;
}

static void check_words(const kt_error *error, double t, double ahead) {
    char where[40], begin[120];
    snprintf(where, sizeof where, "t = %.9g s", t);
    snprintf(begin, sizeof begin,
             "from here on the loops cannot be closed; at t = %.9g s these stay open: ", t + ahead);
    kt_check_text("where", error->where, where);
    kt_check_contains("message", error->message, begin);
    kt_check_contains(
        "how to mend it", error->message,
        ". Change the driving functions so that the loops can be closed, or end the run before this time");
}

/* Two bars of 1 m are straight at 3 s. At the time t the distance of their ends is 1.4 m + 0.2 m/s t. Near 3 s the
 * rates grow as (3 s - t)^-1/2. A fixed step throws the bars far off, and an adaptive step shrinks to nothing. The
 * bound is five times the largest measured difference from 3 s. The words have three digits of the gap. */
KT_TEST(length_beyond_the_reach_of_bars_is_named_with_its_gap_a_little_later) {
    static const double length[2] = {1.4, 0.2};
    kt_body bodies[2];
    kt_loop loop = kt_loop_default();
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_of(i ? "lower" : "upper", i ? "upper" : NULL, KT_JOINT_REVOLUTE, 1.0);
        bodies[i].joint.at = kt_vec3_make(0.0, i ? -1.0 : 0.0, 0.0);
        bodies[i].joint.position[0] = i ? 2.0 * acos(0.7) : 0.0;
        bodies[i].shape.type = KT_SHAPE_ROD;
        bodies[i].shape.to = kt_vec3_make(0.0, -1.0, 0.0);
        bodies[i].com_of_shape = bodies[i].inertia_of_shape = true;
    }
    loop.name = "pull";
    loop.type = KT_LOOP_DISTANCE;
    loop.between[1].body = "lower";
    loop.between[1].at = kt_vec3_make(0.0, -1.0, 0.0);
    loop.function = kt_function_polynomial(length, 2);
    kt_description description = kt_description_of(bodies, 2, &loop, 1, NULL, 0);
    for (int i = 0; i < SETTINGS; i++) {
        kt_error error = {KT_OK, "", ""};
        kt_status status = KT_OK;
        double ahead;
        const double t = run_into(&description, &settings[i], &ahead, &status, &error);
        const double gap = 0.2 * (t + ahead - 3.0);
        kt_check_equal_int("status", status, KT_ERROR_CONSTRAINT);
        kt_check_near("time", t, 3.0, settings[i].step > 0.0 ? 2.0 * settings[i].step : 2e-12);
        check_words(&error, t, ahead);
        const double found = gap_of(&error, "pull");
        if (settings[i].formulation == KT_FORMULATION_TREE)
            kt_check_near("gap", found, gap, 0.006 * gap);
        else /* the joints, which are loops as well, share the gap */
            kt_check_near("gap of three loops", found, gap / 3.0, 0.002 * gap);
    }
}

/* A joint on which two motions are laid, which are seen to part at `part`: their gap is shared out evenly. */
static void check_motions(kt_function one, kt_function other, double part, double (*apart)(double t), double slack) {
    kt_lone lone;
    kt_loop loops[2];
    kt_lone_make(&lone, KT_JOINT_REVOLUTE, 1.0);
    for (int i = 0; i < 2; i++) {
        loops[i] = kt_loop_of(i ? "other" : "one", KT_LOOP_MOTION);
        loops[i].joint = lone.body.name;
        loops[i].function = i ? other : one;
    }
    lone.description.loops = loops;
    lone.description.loop_count = 2;
    for (int i = 0; i < SETTINGS; i++) {
        kt_error error = {KT_OK, "", ""};
        kt_status status = KT_OK;
        double ahead;
        const double t = run_into(&lone.description, &settings[i], &ahead, &status, &error);
        const double gap = 0.5 * fabs(apart(t + ahead)), step = settings[i].step;
        kt_check_equal_int("status", status, KT_ERROR_CONSTRAINT);
        kt_check_near("time", t, step > 0.0 ? step * floor(part / step) : part, slack);
        check_words(&error, t, ahead);
        kt_check_near("one", gap_of(&error, "one"), gap, 0.006 * gap);
        kt_check_near("other", gap_of(&error, "other"), gap, 0.006 * gap);
    }
}

static double apart_by_a_ramp(double t) {
    const double s = (t - 0.5) / 0.5;
    return s * s * (3.0 - 2.0 * s);
}

static double apart_by_a_sine(double t) { return 0.5 * sin(2.0 * pi * t) - pi * t; }

KT_TEST(motions_that_come_to_contradict_each_other_are_both_named) {
    const double straight[2] = {0.0, pi};
    /* their rates part by 24 (t - 0.5), which passes for rounding up to 1e-12 of 6 / 0.5, the terms of a ramp's rate */
    check_motions(kt_function_constant(0.0), kt_function_ramp(0.0, 1.0, 0.5, 1.0), 0.5 + 0.5e-12, apart_by_a_ramp,
                  64.0 * DBL_EPSILON);
    /* their rates part by pi (1 - cos 2 pi t), which passes for closed up to 1e-12 of pi, where 2 pi t = sqrt(2e-12) */
    const double seen = sqrt(2e-12) / (2.0 * pi);
    check_motions(kt_function_sine(0.5, 1.0, 0.0, 0.0), kt_function_polynomial(straight, 2), seen, apart_by_a_sine,
                  1e-3 * seen);
}

/* From the start on: rates 0 and 2, which share out evenly, too. */
KT_TEST(rates_that_contradict_each_other_at_the_start_name_both_loops) {
    kt_lone lone;
    kt_loop loops[2];
    const double straight[2] = {0.0, 2.0};
    kt_error error = {KT_OK, "", ""};
    kt_status status = KT_OK;
    double ahead;
    kt_lone_make(&lone, KT_JOINT_REVOLUTE, 1.0);
    for (int i = 0; i < 2; i++) {
        loops[i] = kt_loop_of(i ? "other" : "one", KT_LOOP_MOTION);
        loops[i].joint = lone.body.name;
        loops[i].function = i ? kt_function_polynomial(straight, 2) : kt_function_constant(0.0);
    }
    lone.description.loops = loops;
    lone.description.loop_count = 2;
    (void)run_into(&lone.description, &settings[1], &ahead, &status, &error);
    kt_check_equal_int("status", status, KT_ERROR_CONSTRAINT);
    kt_check_near("one", gap_of(&error, "one"), 1.0, 1e-12);
    kt_check_near("other", gap_of(&error, "other"), 1.0, 1e-12);
}

/* ---- others ------------------------------------------------------------------------------------------------------ */

/* Runs off at 0.5 s. */
static int drive_to_a_pole(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user;
    (void)q;
    (void)v;
    (void)balance;
    *force = pow(fabs(0.5 - t), -1.5);
    return 0;
}

/* A wheel driven by a motion, which can always follow, and next to it a block with a force that has a pole. */
KT_TEST(driven_loop_that_can_be_closed_is_not_blamed_for_a_pole) {
    kt_body bodies[2];
    kt_loop loop = kt_loop_default();
    kt_effect effect = kt_effect_default();
    const double turning[2] = {0.0, 50.0};
    kt_error error = {KT_OK, "", ""};
    kt_status status = KT_OK;
    double ahead;
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_of(i ? "block" : "wheel", NULL, i ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE, 1.0);
        bodies[i].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    }
    loop.name = "drive";
    loop.type = KT_LOOP_MOTION;
    loop.joint = "wheel";
    loop.function = kt_function_polynomial(turning, 2);
    effect.type = KT_EFFECT_CUSTOM;
    effect.joint = "block";
    effect.joint_force = drive_to_a_pole;
    kt_description description = kt_description_of(bodies, 2, &loop, 1, &effect, 1);
    const double t = run_into(&description, &settings[1], &ahead, &status, &error);
    kt_check_near("time", t, 0.5, 4e-12); /* five times the measured error */
    kt_check_equal_int("status", status, KT_ERROR_STEP);
    kt_check_contains("message", error.message, "Look for a jump or a pole of a force here");
}
