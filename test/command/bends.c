/* Runs next to singular positions of loops: velocities that do not fit the loops, and paths that bend. Lifts, linkages
 * and four-bars fold. A bar that is a little too long or too short leads them past the folded position. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A crank of 1 m turns a rocker. It starts at 60 deg and 6 rad/s. With euler, the error of the velocities is of the
 * order of the square of the step. At 0.1 s, it is 0.12 of the fastest velocity. At 0.08 s, it is below 0.1. */
KT_TEST(run_tells_velocities_that_do_not_fit_the_loops) {
    static const char scene[] =
        "kinetree: 1\n"
        "bodies:\n"
        "  - {name: crank, joint: {type: revolute, axis: z, position: 60 deg, velocity: 6}, mass: 1,\n"
        "     shape: {type: rod, to: [1, 0, 0]}}\n"
        "  - {name: coupler, parent: crank, joint: {type: revolute, axis: z, at: [1, 0, 0], position: -50 deg},\n"
        "     mass: 1, shape: {type: rod, to: [3, 0, 0]}}\n"
        "  - {name: rocker, joint: {type: revolute, axis: z, at: [3, 0, 0], position: 80 deg}, mass: 1,\n"
        "     shape: {type: rod, to: [2, 0, 0]}}\n"
        "loops: [{name: close, type: revolute, axis: z, between: [{body: coupler, at: [3, 0, 0]},\n"
        "         {body: rocker, at: [2, 0, 0]}]}]\n"
        "initial: {hold: [crank]}\n"
        "simulate: {duration: 1, integrator: euler, step: 0.1}\n";
    kt_write_file("bars.yaml", scene);
    kt_ran ran = kt_shell("$K run bars.yaml --out /dev/null --summary -");
    json_t *root = kt_json(ran.out);
    const json_t *list = kt_json_find(root, "warnings");
    const json_t *found = NULL;
    for (size_t i = 0; i < json_array_size(list) && found == NULL; i++)
        if (strcmp(json_string_value(json_object_get(json_array_get(list, i), "code")), "large_projection") == 0)
            found = json_array_get(list, i);
    kt_note("%s", ran.err);
    kt_check_contains("words", ran.err,
                      "velocities after steps of 0.1 s do not fit the loops. The projection has changed that of joint");
    kt_check_equal_int("no drive, no dead point of it", kt_count_of(ran.err, "dead point"), 0);
    kt_check_true("in the summary", found != NULL);
    kt_check_above("how much", json_number_value(json_object_get(found, "value")), 0.1);
    json_decref(root);
    ran = kt_shell("$K run bars.yaml --out /dev/null --step 0.08");
    kt_check_equal_int("shorter steps", kt_count_of(ran.err, "do not fit the loops"), 0);
    ran = kt_shell("$K run bars.yaml --out /dev/null --integrator rk4");
    kt_check_equal_int("a better method", kt_count_of(ran.err, "do not fit the loops"), 0);
    kt_check_equal_int("projected", kt_count_of(ran.err, "drifted open"), 0);
    ran = kt_shell("$K run bars.yaml --out /dev/null --integrator rk4 --step 0.02 --unprojected");
    kt_check_contains("drift", ran.err, "without projection the loops have drifted open by up to ");
    ran = kt_shell("$K run bars.yaml --out /dev/null --integrator dop853 --step 0.002 --unprojected");
    kt_check_equal_int("accurate steps drift less", kt_count_of(ran.err, "drifted open"), 0);
}

/* A scissor lift of two stages that sinks through its folded position, a bar longer or shorter than the others. If it
 * is shorter, both bars of the lower stage come to hang down, and the upper stage swings through between them. Two
 * loops fold at once there. `floor` is the loop that holds b1's foot at the height of a1's. `unit` is one second in
 * units of time. */
static void make_lift_in(double unit, const char *file, double length, const char *floor) {
    char scene[1600];
    snprintf(
        scene, sizeof scene,
        "kinetree: 1\n"
        "gravity: [0, %.17g, 0]\n"
        "bodies:\n"
        "  - {name: a1, joint: {type: revolute, position: 45 deg}, mass: 0.5, shape: {type: rod, to: [%.17g, 0, 0]}}\n"
        "  - {name: b1, parent: a1, joint: {type: revolute, at: [0.5, 0, 0], position: 90 deg}, mass: 0.5,\n"
        "     shape: {type: rod, from: [-0.5, 0, 0], to: [0.5, 0, 0]}}\n"
        "  - {name: a2, parent: b1, joint: {type: revolute, at: [0.5, 0, 0], position: -90 deg}, mass: 0.5,\n"
        "     shape: {type: rod, to: [1, 0, 0]}}\n"
        "  - {name: b2, parent: a2, joint: {type: revolute, at: [0.5, 0, 0], position: 90 deg}, mass: 0.5,\n"
        "     shape: {type: rod, from: [-0.5, 0, 0], to: [0.5, 0, 0]}}\n"
        "loops:\n"
        "  - {name: floor, %s}\n"
        "  - {name: pin2, type: revolute, between: [{body: a1, at: [%.17g, 0, 0]}, {body: b2, at: [-0.5, 0, 0]}]}\n"
        "initial: {hold: [a1]}\n"
        "simulate: {duration: %.17g}\n",
        -9.81 / (unit * unit), length, floor, length, unit);
    kt_write_file(file, scene);
}

static void make_lift(const char *file, double length, const char *floor) { make_lift_in(1.0, file, length, floor); }

static const char on_the_floor[] = "type: inplane, between: [world, {body: b1, at: [-0.5, 0, 0]}], axis: y";
/* The same condition without its second branch, b1 along a1: b1 makes the angle 180 deg - 2 a1 with a1. */
static const char geared[] = "type: coupling, coefficients: {a1: 2, b1: 1}, offset: 180 deg";

/* The length differs by 2e-12 m, of which rounding of positions leaves little. No step is short enough, and 2 % of the
 * energy is lost. */
KT_TEST(run_tells_a_path_that_bends_more_sharply_than_steps_follow) {
    static const char words[] = "the path bends more sharply than the steps resolve. At t = 0.9";
    make_lift("short.yaml", 1.0 - 2e-12, on_the_floor);
    kt_ran ran = kt_shell("$K run short.yaml --out /dev/null --summary -");
    kt_note("%s", ran.err);
    kt_check_contains("words", ran.err, words);
    kt_check_contains("in the summary", ran.out, "\"large_projection\"");
    make_lift("long.yaml", 1.0 + 1e-6, on_the_floor);
    ran = kt_shell("$K run long.yaml --out /dev/null");
    kt_check_equal_int("a path that steps follow", kt_count_of(ran.err, "bends more sharply"), 0);
}

/* The angle of a2 in the last row. */
static double last_angle_of(const char *records) {
    const char *row = records + strlen(records);
    for (int lines = 0; row > records && lines < 2; row -= lines < 2)
        lines += row[-1] == '\n';
    for (int column = 0; row != NULL && column < 3; column++)
        row = strchr(row + 1, ',');
    return row != NULL ? strtod(row + 1, NULL) : (double)NAN;
}

static double last_angle(const char *scene) {
    return last_angle_of(kt_shell("$K run %s --record position --interval 1 --out - --quiet", scene).out);
}

/* At t = 0.793 s two branches cross. On one of them b1 is the mirror image of a1, and on the other it lies along a1. On
 * the second, the upper stage rests, and a2 is 0.08 off within 0.2 s. */
KT_TEST(two_loops_that_fold_at_once_stay_on_their_branch) {
    KT_WORST worst = kt_worst_make("a2 at 1 s");
    for (int k = 4; k <= 10; k++) {
        make_lift("lift.yaml", 1.0 - pow(10.0, -k), on_the_floor);
        make_lift("geared.yaml", 1.0 - pow(10.0, -k), geared);
        kt_worst_below(&worst, fabs(last_angle("lift.yaml") - last_angle("geared.yaml")), 1e-4, "1e-%g", (double)k);
    }
}

/* The angle of a2 in the last record of fixed steps. */
static double last_angle_in(double unit) {
    make_lift_in(unit, "unit.yaml", 1.0 - 1e-6, on_the_floor);
    const kt_ran ran = kt_shell("$K run unit.yaml --record position --interval %.17g --integrator rk4 --step %.17g "
                                "--out - --quiet",
                                unit, unit * 0x1p-14);
    return last_angle_of(ran.out);
}

/* The power of loops that fold at once is removed with an acceleration along the velocities, in any unit of time.
 * Powers of two leave all bits. */
KT_TEST(two_loops_that_fold_at_once_have_the_same_bits_in_any_unit_of_time) {
    const double angle = last_angle_in(1.0);
    kt_check_near("2^10", last_angle_in(0x1p10), angle, 0.0);
    kt_check_near("2^-10", last_angle_in(0x1p-10), angle, 0.0);
}

/* Sarrus' linkage without a spring, one of its bars too long by d: the platform falls through the position in which
 * both legs lie flat. */
static void make_sarrus(const char *file, double d) {
    char scene[1600];
    snprintf(scene, sizeof scene,
             "kinetree: 1\n"
             "gravity: [0, 0, -9.81]\n"
             "bodies:\n"
             "  - {name: lower1, joint: {type: revolute, axis: y, at: [1, 0, 0], position: 0.6}, mass: 1,\n"
             "     shape: {type: rod, to: [0, 0, 1], radius: 0.03}}\n"
             "  - {name: upper1, parent: lower1, joint: {type: revolute, axis: y, at: [0, 0, %.17g], position: -1.2},\n"
             "     mass: 1, shape: {type: rod, to: [0, 0, 1], radius: 0.03}}\n"
             "  - {name: platform, parent: upper1, joint: {type: revolute, axis: y, at: [0, 0, 1], position: 0.6},\n"
             "     mass: 5, shape: {type: box, size: [1, 1, 0.1], at: [-0.5, 0.5, 0]}}\n"
             "  - {name: lower2, joint: {type: revolute, axis: x, at: [0, 1, 0], position: -0.6}, mass: 1,\n"
             "     shape: {type: rod, to: [0, 0, 1], radius: 0.03}}\n"
             "  - {name: upper2, parent: lower2, joint: {type: revolute, axis: x, at: [0, 0, 1], position: 1.2},\n"
             "     mass: 1, shape: {type: rod, to: [0, 0, 1], radius: 0.03}}\n"
             "loops:\n"
             "  - {name: close, type: revolute, axis: x,\n"
             "     between: [{body: upper2, at: [0, 0, 1]}, {body: platform, at: [-1, 1, 0]}]}\n"
             "simulate: {duration: 0.6}\n",
             1.0 + d);
    kt_write_file(file, scene);
}

/* From t = 0.564 s on, the state is next to a bend of the path. Interpolated accelerations are off by 1e-3 to one side,
 * and direct ones by 1e-8. Interpolated ones lose 2.6e-6 J. The tolerance alone costs 3e-8 J. */
KT_TEST(stages_take_the_direct_acceleration_where_rounding_leaves_it_exact) {
    make_sarrus("sarrus.yaml", 2.1544346900318845e-4);
    const kt_ran ran =
        kt_shell("$K run sarrus.yaml --out /dev/null --record energy,balance --tolerance 1e-10 --quiet --summary -");
    json_t *root = kt_json(ran.out);
    kt_check_below("steps next to the position", 100.0, kt_json_at(root, "singular.near"));
    kt_check_below("energy lost, J", kt_json_at(root, "balance.drift"), 3e-7);
    json_decref(root);
}

/* A four-bar whose crank has the length and the rate given, of ground 2 or 2.5 m; angles of the three bars. */
static void make_four_bar(const char *file, double ground, double crank, double rocker, double rate,
                          const double angle[3]) {
    char scene[1200];
    snprintf(
        scene, sizeof scene,
        "kinetree: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "bodies:\n"
        "  - {name: crank, joint: {type: revolute, position: %.17g, velocity: %.17g}, mass: 1,\n"
        "     shape: {type: rod, to: [%.17g, 0, 0]}}\n"
        "  - {name: coupler, parent: crank, joint: {type: revolute, at: [%.17g, 0, 0], position: %.17g}, mass: 2,\n"
        "     shape: {type: rod, to: [2, 0, 0]}}\n"
        "  - {name: rocker, joint: {type: revolute, at: [%.17g, 0, 0], position: %.17g}, mass: 1,\n"
        "     shape: {type: rod, to: [%.17g, 0, 0]}}\n"
        "loops: [{name: close, type: revolute, between: [{body: coupler, at: [2, 0, 0]}, {body: rocker, at: [%.17g, 0, "
        "0]}]}]\n"
        "initial: {hold: [crank]}\n",
        angle[0], rate, crank, crank, angle[1], ground, angle[2], rocker, rocker);
    kt_write_file(file, scene);
}

static const double falling[3] = {2.0943951023931953, -1.9745985297754385, 2.3134194848241023};

/* The acceleration overflows at 6.85 s; the bend was leapt over at 0.55 s. */
KT_TEST(fixed_steps_that_fail_name_the_singular_position_before) {
    make_four_bar("bends.yaml", 2.5, 1.0 - 1e-6, 1.5, 0.0, falling);
    kt_ran ran = kt_shell("$K run bends.yaml --integrator dopri5 --step 0.01 --duration 10 --out /dev/null --quiet");
    kt_check_equal_int("exit code", ran.code, 4);
    kt_check_contains("the position", ran.err, "since t = 0.54");
    kt_check_contains("what", ran.err,
                      "the motion has come next to singular positions of the loops, where its path "
                      "bends within");
    kt_check_contains("remedy", ran.err, "one below a tenth of that may help, or an adaptive method");
}

/* Rounding bends the path: steps shrank until they made no progress. The causes were Jacobians of before the bend, and
 * the uncertainty of accelerations. */
KT_TEST(steps_pass_what_rounding_bends) {
    static const double crossed[3] = {1.2, -2.234830412233192, -2.2348304122331903};
    make_four_bar("bends.yaml", 2.5, 1.0 - 6e-13, 1.5, 0.0, falling);
    kt_ran ran = kt_shell("$K run bends.yaml --integrator rodas5p --duration 0.6 --out /dev/null");
    kt_check_equal_int("rodas5p", ran.code, 0);
    kt_check_equal_int("its energy", kt_count_of(ran.err, "the total energy is off"), 0);
    make_four_bar("crossed.yaml", 2.0, 0.99999999999999, 1.0, 9.0, crossed);
    ran = kt_shell("$K run crossed.yaml --duration 2 --interval 0.05 --record energy --out /dev/null");
    kt_check_equal_int("dopri5", ran.code, 0);
    kt_check_equal_int("its energy", kt_count_of(ran.err, "the total energy is off"), 0);
}
