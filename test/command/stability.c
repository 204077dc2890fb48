/* kinetree stability, and the warning of `kinetree run`. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GOVERNOR KT_SCENES "/flyball-governor.yaml"
#define PENDULUM KT_SCENES "/pendulum.yaml"

KT_TEST(stability_tells_the_fastest_modes_and_the_steps) {
    kt_ran ran = kt_shell("$K stability " GOVERNOR);
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_text("no words", ran.err, "");
    kt_check_contains("when", ran.out, "fastest modes, at t = 0 s\n");
    kt_check_contains("the fastest and who moves in it", ran.out,
                      "-8117.2              -          1  slider, right, left\n");
    kt_check_contains("verdict", ran.out, "  bdf2                   any  L-stable\n");
    kt_check_contains("verdict", ran.out, "  two-step               any  A-stable, 0.6 at infinity\n");
    kt_check_contains("verdict", ran.out, "  crank-nicolson         any  A-stable, 1 at infinity\n");
    kt_check_contains("multistep", ran.out, "  ab4              0.0001583  decay of 8117 /s, t = 0 s\n");
    kt_check_contains("a step and what bounds it", ran.out,
                      "  rk4              0.0003431  decay of 8117 /s, t = 0 s\n");
    kt_check_contains("that of auto is a fixed one", ran.out,
                      "s, t = 0 s; adaptive ones are not bounded: radau5 takes them\n");
    ran = kt_shell("$K stability " GOVERNOR " --step 5e-4");
    kt_check_contains("too long", ran.out,
                      "  rk4              0.0003431  unstable: diverges          decay of 8117 /s");
    kt_check_contains("not too long", ran.out,
                      "  dop853           0.0007877  stable                      decay of 8117 /s");
}

/* A member of a method's entry among the largest steps. */
static const json_t *limit_of(const json_t *root, const char *method, const char *member) {
    const json_t *methods = kt_json_find(root, "methods");
    for (size_t i = 0; i < json_array_size(methods); i++) {
        json_t *entry = json_array_get(methods, i);
        if (strcmp(json_string_value(json_object_get(entry, "integrator")), method) == 0)
            return kt_json_find(entry, member);
    }
    return NULL;
}

/* rk4's limit is 2.785 / 8117 s; heun's on a swing of w lets |R|^N = (1 + (h w)^4 / 4)^(T / 2h) become 2. */
KT_TEST(stability_writes_json) {
    kt_ran ran = kt_shell("$K stability " GOVERNOR " --json --step 3e-4 --samples 3");
    json_t *root = kt_json(ran.out);
    kt_check_near("states", (double)json_array_size(kt_json_find(root, "states")), 3.0, 0.0);
    kt_check_near("fastest", kt_json_at(root, "states[0].modes[0].real"), -8117.2033, 1e-4);
    kt_check_near("it moves", kt_json_at(root, "states[0].modes[0].moves.slider"), 1.0, 1e-12);
    kt_check_near("step", json_number_value(limit_of(root, "rk4", "step")), 2.785293563 / 8117.2033, 1e-7);
    kt_check_near("growth", json_number_value(limit_of(root, "rk4", "growth")), 1.0, 1e-3);
    kt_check_near("bounded by", json_number_value(limit_of(root, "rk4", "bounded_by.real")), -8117.2033, 1e-4);
    kt_check_true("L-stable", json_is_true(limit_of(root, "radau5", "l_stable")));
    kt_check_true("A-stable", json_is_true(limit_of(root, "two-step", "a_stable")));
    kt_check_true("but not L-stable", json_is_false(limit_of(root, "two-step", "l_stable")));
    kt_check_near("at infinity", json_number_value(limit_of(root, "two-step", "at_infinity")), 0.6, 1e-7);
    kt_check_true("no verdict of explicit ones", limit_of(root, "rk4", "a_stable") == NULL);
    json_decref(root);
    kt_write_file("swing.yaml", "kinetree: 1\n"
                                "bodies: [{name: mass, mass: 2, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                                "effects: [{type: joint_spring, joint: mass, stiffness: 800}]\n"
                                "simulate: {duration: 5, integrator: heun, step: 0.01}\n");
    ran = kt_shell("$K stability swing.yaml --json");
    root = kt_json(ran.out);
    const double h = json_number_value(limit_of(root, "heun", "step"));
    kt_check_near("growth over the run", pow(1.0 + pow(20.0 * h, 4.0) / 4.0, 2.5 / h), 2.0, 1e-12);
    json_decref(root);
}

/* A swing of 1 m hits its stop at 0.95 m. The nine states are one period apart, and sin of whole periods is 0.
 * Therefore, the stop acts only between them. */
KT_TEST(stops_that_act_in_no_state_are_told) {
    static const char swing[] = "kinetree: 1\n"
                                "bodies: [{name: mass, mass: 1, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                                "effects:\n"
                                "  - {type: joint_spring, joint: mass, stiffness: 1}\n"
                                "  - {name: stop, type: joint_limit, joint: mass, upper: %s, stiffness: 1e-3}\n"
                                "simulate: {duration: 50.26548245743669}\n";
    char text[400];
    snprintf(text, sizeof text, swing, "0.95");
    kt_write_file("stop.yaml", text);
    kt_expect(0, "stability: joint_limit 'stop' of 'mass' acts in none of the 9 linearised states",
              "$K stability stop.yaml");
    kt_ran ran = kt_shell("$K stability stop.yaml --json");
    json_t *root = kt_json(ran.out);
    kt_check_text("in JSON", json_string_value(kt_json_find(root, "inactive[0]")), "joint_limit 'stop' of 'mass'");
    json_decref(root);
    snprintf(text, sizeof text, swing, "-0.5");
    kt_write_file("stop.yaml", text);
    kt_check_text("one that acts", kt_shell("$K stability stop.yaml").err, "");
}

KT_TEST(stability_says_what_it_cannot_do) {
    kt_expect(1, "there is no method 'rk5'; did you mean 'rk4'?", "$K stability " PENDULUM " --integrator rk5");
    kt_expect(1, "SCENE is missing", "$K stability");
    kt_expect(2, "nowhere.yaml", "$K stability nowhere.yaml");
    kt_expect(4, "small motions are computed with dense matrices, for up to 2000: describe it with fewer bodies",
              "$K make chain --links 2001 | $K stability -");
    kt_write_file("still.yaml", "kinetree: 1\nbodies: [{name: a, mass: 1}]\n");
    kt_ran ran = kt_shell("$K stability still.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("nothing moves", ran.out,
                      "there are no degrees of freedom: loops alone determine the motion, and any step is stable\n");
    kt_write_file("lag.yaml", "kinetree: 1\nbodies: [{name: a, mass: 1}]\nstates: {x: {rate: \"-1000*x\"}}\n");
    kt_check_contains("but an auxiliary state", kt_shell("$K stability lag.yaml").out, "decay of 1000 /s");
#ifdef KT_WITH_CAIRO
    kt_expect(1, "a picture's name ends in .svg, .png or .pdf", "$K stability " PENDULUM " --plot a.jpg");
    kt_expect(1, "nothing to draw", "$K stability still.yaml --plot a.svg");
#endif
}

#ifdef KT_WITH_CAIRO
/* The x of the label below a tick of the horizontal axis, in points; NaN where there is none. */
static double label_x(const char *svg, const char *label) {
    char end[64];
    snprintf(end, sizeof end, "text-anchor=\"middle\">%s</text>", label);
    const char *at = strstr(svg, end), *x = NULL;
    for (const char *next = svg; at != NULL && (next = strstr(next, "<text x=\"")) != NULL && next < at; next++)
        x = next;
    return x != NULL ? strtod(x + strlen("<text x=\""), NULL) : (double)NAN;
}

/* The path with the most lines: how many, and the least and the largest x of their points. */
typedef struct boundary {
    int lines;
    double left, right;
} boundary;

static boundary find_boundary(const char *svg) {
    boundary most = {0, (double)NAN, (double)NAN};
    for (const char *path = svg; (path = strstr(path, " d=\"M ")) != NULL;) {
        boundary one = {0, HUGE_VAL, -HUGE_VAL};
        path += strlen(" d=\"");
        for (; *path != '"' && *path != '\0'; path++)
            if (*path == 'M' || *path == 'L') {
                one.left = fmin(one.left, strtod(path + 1, NULL));
                if (*path == 'L')
                    one.right = fmax(one.right, strtod(path + 1, NULL));
                one.lines += *path == 'L';
            }
        most = one.lines > most.lines ? one : most;
    }
    return most;
}

/* The region of rk4 ends at -2.785293563 on the real axis. A unit is 34 points, which are written to a hundredth: a
 * tenth of one is the bound. The boundary was 394 lines when this was written; half of them would still draw it. */
static void check_region(const char *svg) {
    const boundary drawn = find_boundary(svg);
    const double zero = label_x(svg, "0"), unit = (zero - label_x(svg, "\u22122")) / 2.0;
    kt_check_above("pieces of the boundary", drawn.lines, 197.0);
    kt_check_near("where it ends on the left", (drawn.left - zero) / unit, -2.785293563, 0.1 / unit);
}

KT_TEST(stability_draws_the_region) {
    kt_ran ran = kt_shell("$K stability " GOVERNOR " --integrator rk4 --step 1e-3 --samples 1 --plot a.svg && "
                          "$K stability " GOVERNOR " --integrator rkc2 --step 1e-2 --plot a.png");
    kt_check_equal_int("exit code", ran.code, 0);
    const char *svg = kt_read_file("a.svg");
    kt_check_contains("it is one", svg, "<svg");
    check_region(svg);
    kt_check_near("a white page", kt_page_lightness(svg), 1.0, 0.0);
    kt_check_contains("the other is one, too", kt_read_file("a.png"), "PNG");
    ran = kt_shell("$K stability " GOVERNOR " --integrator rk4 --step 1e-3 --samples 1 --dark --plot b.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    svg = kt_read_file("b.svg");
    check_region(svg);
    kt_check_below("which is dark", kt_page_lightness(svg), 0.25);
}

/* The root locus of two-step with rho = 0.6 goes from 0 around the unstable region. It ends in xi = -1 at z = 16. */
KT_TEST(stability_draws_what_an_implicit_region_surrounds) {
    const kt_ran ran = kt_shell("$K stability " GOVERNOR " --integrator two-step --step 2e-3 --samples 1 --plot c.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    const char *svg = kt_read_file("c.svg");
    const boundary drawn = find_boundary(svg);
    const double zero = label_x(svg, "0"), unit = (label_x(svg, "10") - zero) / 10.0;
    kt_check_contains("verdict", svg, "two-step with steps of 0.002 s; A-stable, 0.6 at infinity: stable outside");
    kt_check_contains("what is drawn", svg, "boundary |ξ| = 1");
    kt_check_above("pieces of the boundary", drawn.lines, 100.0);
    kt_check_near("where it begins", drawn.left, zero, 0.5);
    kt_check_near("where it ends", (drawn.right - zero) / unit, 16.0, 0.5 / unit);
}
#endif

/* ---- the warning ------------------------------------------------------------------------------------------------- */

/* The fastest decay of the governor is 8117 /s. At any tolerance, steps of dopri5 stay below 3.3066 / 8117.2 s. */
KT_TEST(run_tells_that_stability_bounds_adaptive_explicit_steps_and_what_is_cheaper) {
    static const char *const methods[] = {"dopri5", "dop853"};
    for (int i = 0; i < 2; i++) {
        kt_ran ran =
            kt_shell("$K run " GOVERNOR " --integrator %s --tolerance 1e-6 --duration 3 --out /dev/null --summary - "
                     "2>err.txt",
                     methods[i]);
        json_t *root = kt_json(ran.out);
        kt_check_text("code", json_string_value(kt_json_find(root, "warnings[0].code")), "bounded_by_stability");
        kt_check_near("the rate", kt_json_at(root, "warnings[0].value"), 8117.2033, 0.02);
        json_decref(root);
        const char *words = kt_read_file("err.txt");
        kt_check_equal_int("once", kt_count_of(words, "bounded by its stability, not by the tolerance, in"), 1);
        kt_check_contains("remedy", words, "Take auto, or radau5");
    }
    kt_ran ran = kt_shell("$K run " GOVERNOR " --integrator auto --tolerance 1e-6 --duration 3 --out /dev/null");
    kt_check_equal_int("not of auto", kt_count_of(ran.err, "warning"), 0);
    kt_check_contains("but that it has switched", ran.err, ", 1 switch between explicit and implicit ones, ");
    ran = kt_shell("$K run " KT_SCENES "/double-pendulum.yaml --integrator dopri5 --tolerance 1e-6 --out /dev/null");
    kt_check_equal_int("nor where accuracy decides", kt_count_of(ran.err, "bounded by"), 0);
    ran = kt_shell("$K run " KT_SCENES "/servo-arm.yaml --integrator dopri5 --tolerance 1e-9 --out /dev/null");
    kt_check_equal_int("nor with springs that have to be followed", kt_count_of(ran.err, "bounded by"), 0);
}

/* A slider on a spring, pulled along by a pendulum: its mode is (stiffness / 0.09 kg)^(1/2), and rings. */
static void write_ringing(double stiffness, double damping, double tolerance) {
    char text[640];
    snprintf(text, sizeof text,
             "kinetree: 1\n"
             "gravity: [0, -9.81, 0]\n"
             "bodies:\n"
             "  - {name: arm, joint: {type: revolute, axis: z, position: 40 deg}, mass: 1,\n"
             "     shape: {type: rod, to: [0, -1, 0]}}\n"
             "  - {name: slider, parent: arm, joint: {type: prismatic, axis: x, at: [0, -1, 0]}, mass: 0.1}\n"
             "effects: [{type: joint_spring, joint: slider, stiffness: %g, damping: %g}]\n"
             "simulate: {duration: 8, tolerance: %g}\n",
             stiffness, damping, tolerance);
    kt_write_file("ring.yaml", text);
}

/* The default method finds a mode that rings with 0.01 to 0.5 of the critical damping. dopri5 takes 90,000 steps. The
 * tolerance may keep the steps to two thirds of the limit. No step of the motion then shows the mode. In this case, the
 * run reports it, and the remedy helps. */
KT_TEST(run_finds_a_mode_that_rings_or_tells_that_it_has_missed_it) {
    static const double dampings[] = {60.0, 300.0, 3000.0};
    for (int i = 0; i < 3; i++) {
        write_ringing(1e8, dampings[i], 1e-5);
        const kt_ran ran = kt_shell("$K run ring.yaml --out /dev/null --summary -");
        json_t *root = kt_json(ran.out);
        kt_check_equal_int("warnings", (long long)json_array_size(kt_json_find(root, "warnings")), 0);
        kt_check_above("switches", kt_json_at(root, "cost.switches"), 0.5);
        kt_check_below("steps", kt_json_at(root, "cost.steps"), 400.0);
        json_decref(root);
    }
    write_ringing(1e5, 57.0, 1e-8);
    kt_ran ran = kt_shell("$K run ring.yaml --out /dev/null --summary -");
    json_t *root = kt_json(ran.out);
    kt_check_text("code", json_string_value(kt_json_find(root, "warnings[0].code")), "bounded_by_stability");
    kt_check_contains(
        "words", ran.err,
        "the steps of auto, which has not detected the stiffness and uses dopri5, are bounded by its stability");
    kt_check_contains("remedy", ran.err, "Take radau5, whose steps no decaying mode bounds");
    const double missed = kt_json_at(root, "cost.evaluations");
    json_decref(root);
    root = kt_json(kt_shell("$K run ring.yaml --integrator radau5 --out /dev/null --summary - 2>/dev/null").out);
    kt_check_below("evaluations of radau5, over those", kt_json_at(root, "cost.evaluations") / missed, 0.2);
    json_decref(root);
}

/* Through a singular position of the loops. */
KT_TEST(run_tells_what_an_implicit_method_has_taken_unsettled) {
    static const char *const methods[] = {"bdf2", "rodas5p", "rk4"};
    static const char *const words[] = {"Newton's iteration came no nearer to the solution than 1e-7 of the state",
                                        "the order of rodas5p is lower", NULL};
    for (int i = 0; i < 3; i++) {
        kt_ran ran = kt_shell("$K run " KT_SCENES "/n-four-bar-2.yaml --integrator %s --step 5e-3 --duration 3 "
                              "--out /dev/null --summary - 2>err.txt",
                              methods[i]);
        json_t *root = kt_json(ran.out);
        const double capped = kt_json_at(root, "cost.capped");
        if (words[i] != NULL) {
            kt_check_text("code", json_string_value(kt_json_find(root, "warnings[0].code")), "capped");
            kt_check_near("as many", kt_json_at(root, "warnings[0].value"), capped, 0.0);
            kt_check_above("some", capped, 0.5);
            kt_check_equal_int("once", kt_count_of(kt_read_file("err.txt"), words[i]), 1);
        } else {
            kt_check_near("none", capped, 0.0, 0.0);
        }
        json_decref(root);
    }
}

KT_TEST(run_warns_once_of_a_step_outside_the_region) {
    kt_ran ran = kt_shell("$K run " GOVERNOR " --integrator rk4 --step 1e-3 --out /dev/null");
    kt_check_equal_int("it blows up, too", ran.code, 4);
    kt_check_equal_int("once", kt_count_of(ran.err, "to be stable"), 1);
    kt_check_contains(
        "words", ran.err,
        "kinetree: warning: steps of 0.001 s are too long for rk4 to be stable: the method amplifies a decay of ");
    ran = kt_shell("$K run " GOVERNOR " --integrator rk4 --step 1e-3 --out /dev/null --quiet");
    kt_check_equal_int("not when quiet", kt_count_of(ran.err, "warning"), 0);
    ran = kt_shell("$K run " GOVERNOR " --integrator rk4 --step 1e-3 --out /dev/null --quiet --summary - 2>/dev/null");
    json_t *root = kt_json(ran.out);
    kt_check_text("but it stands in the summary", json_string_value(kt_json_find(root, "warnings[0].code")),
                  "unstable_step");
    /* The least along the motion: the start's, or of one a little faster. The mode may double over the run
     * (analysis.h). The slope is |R'| = 1.507, and there are 29,143 steps. The step may exceed the limit by
     *     ln 2 / (1.507 * 2.785 * 29143) = 5.7e-6. */
    kt_check_below("with the step", kt_json_at(root, "warnings[0].value"), (1.0 + 5.7e-6) * 2.785293563 / 8117.2033);
    kt_check_above("with the step", kt_json_at(root, "warnings[0].value"), 0.99 * 2.785293563 / 8117.2033);
    kt_check_text("its unit", json_string_value(kt_json_find(root, "warnings[0].unit")), "s");
    kt_check_contains("the remedy", json_string_value(kt_json_find(root, "warnings[0].remedy")), "Take steps below");
    json_decref(root);
    kt_write_file("swing.yaml", "kinetree: 1\n"
                                "bodies: [{name: mass, mass: 2, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                                "effects: [{type: joint_spring, joint: mass, stiffness: 800}]\n"
                                "simulate: {duration: 5, integrator: heun, step: 0.05}\n");
    ran = kt_shell("$K run swing.yaml --out /dev/null"); /* (1 + 1/4)^(100/2) */
    kt_check_equal_int("a slow growth", kt_count_of(ran.err, "to be stable"), 1);
    kt_check_contains("words", ran.err,
                      "the method amplifies an undamped oscillation of 3.183 Hz (mass), as it is at t = ");
    kt_check_contains("by how much", ran.err, " s, 7e+04-fold over the run. Take steps below 0.0191 s;");
}

/* A pendulum let go from the level has no stiffness there: the fault appears at the end. */
KT_TEST(run_looks_at_the_end_where_the_start_says_nothing) {
    kt_ran ran = kt_shell("$K run " PENDULUM " --integrator euler --step 0.1 --out /dev/null");
    kt_check_equal_int("once", kt_count_of(ran.err, "too long for euler to be stable"), 1);
}

KT_TEST(run_does_not_warn_of_what_is_only_inaccurate) {
    static const char *const settings[] = {"rk4 --step 0.2", "heun --step 0.05", "kutta3 --step 0.1",
                                           "dopri5 --step 0.3", "euler --step 0.001"};
    for (int i = 0; i < 5; i++) {
        kt_ran ran = kt_shell("$K run " PENDULUM " --out /dev/null --integrator %s", settings[i]);
        kt_check_equal_int(settings[i], kt_count_of(ran.err, "to be stable"), 0);
    }
    kt_ran ran = kt_shell("$K run " GOVERNOR " --out /dev/null --duration 1 --integrator rk4 --step 3.4e-4");
    kt_check_equal_int("just within", kt_count_of(ran.err, "to be stable"), 0);
    ran = kt_shell("for s in " KT_SCENES "/*.yaml; do $K run $s --out /dev/null --duration 0.3; done");
    kt_check_equal_int("bundled scenes as they are", kt_count_of(ran.err, "warning"), 0);
    kt_check_above("which ran", kt_count_of(ran.err, "simulated"), 30.0);
}

/* ---- along the motion ----------------------------------------------------------------------------------------------
 */

/* A trunk on four legs with springs in their joints is let go above the ground. In the air, its fastest mode is one of
 * 801 /s. With a foot on the ground, friction below its slip speed damps it at 4e4 /s. At the impact, this rate is
 * higher. */
static void write_quadruped(void) {
    static const char *const legs[4][2] = {
        {"lf", "0.25, 0.15"}, {"rf", "0.25, -0.15"}, {"lh", "-0.25, 0.15"}, {"rh", "-0.25, -0.15"}};
    static char text[8192];
    size_t used = (size_t)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: trunk, mass: 10, shape: {type: box, size: [0.6, 0.3, 0.1]},\n"
        "     joint: {type: free, position: {position: [0, 0, 0.5]}, velocity: {linear: [0.3, 0, 0]}}}\n");
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(
            text + used, sizeof text - used,
            "  - {name: %s_thigh, parent: trunk, mass: 0.5, shape: {type: rod, to: [0, 0, -0.25], radius: 0.02},\n"
            "     joint: {type: revolute, axis: y, at: [%s, 0], position: 0.6}}\n"
            "  - {name: %s_shin, parent: %s_thigh, mass: 0.2, shape: {type: rod, to: [0, 0, -0.25], radius: 0.01},\n"
            "     joint: {type: revolute, axis: y, at: [0, 0, -0.25], position: -1.2}, markers: {foot: [0, 0, "
            "-0.25]}}\n",
            legs[i][0], legs[i][1], legs[i][0], legs[i][0]);
    used += (size_t)snprintf(text + used, sizeof text - used, "effects:\n");
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(
            text + used, sizeof text - used,
            "  - {type: joint_spring, joint: %s_thigh, stiffness: 60, rest: 0.6, damping: 2}\n"
            "  - {type: joint_spring, joint: %s_shin, stiffness: 60, rest: -1.2, damping: 2}\n"
            "  - {type: contact, point: %s_shin.foot, radius: 0.02, plane: world, axis: z, stiffness: 2e4,\n"
            "     dissipation: 0.5, friction: 0.8, slip: 0.01}\n",
            legs[i][0], legs[i][0], legs[i][0]);
    (void)snprintf(text + used, sizeof text - used, "simulate: {duration: 1, integrator: rk4, step: 1e-3}\n");
    kt_write_file("quadruped.yaml", text);
}

/* The step that the warning of instability names, 0 where there is none; and where the trunk has come to. */
static double advised_step(const char *options, double *x) {
    kt_ran ran = kt_shell("$K run quadruped.yaml --quiet --out /dev/null --summary - %s 2>/dev/null", options);
    json_t *root = kt_json(ran.out);
    const bool warns = kt_json_find(root, "warnings[0].code") != NULL &&
                       strcmp(json_string_value(kt_json_find(root, "warnings[0].code")), "unstable_step") == 0;
    const double step = warns ? kt_json_at(root, "warnings[0].value") : 0.0;
    *x = kt_json_at(root, "position.trunk[0]");
    json_decref(root);
    return step;
}

/* The start gives no advice, and at 5 ms the run fails at the impact. The advice is that of the motion itself. The feet
 * are on the ground for most of the time, with steps of some 7.4e-5 s (kinetree stability --samples). */
KT_TEST(run_watches_the_fastest_mode_along_the_motion) {
    char options[64];
    double exact, x;
    write_quadruped();
    kt_check_near("adaptive", advised_step("--integrator dop853 --tolerance 1e-9", &exact), 0.0, 0.0);
    const double fine = advised_step("", &x);
    kt_check_above("the run is off", fabs(x - exact), 5e-3);
    kt_check_below("and told", fine, 7.4e-5);
    kt_check_above("not by far", fine, 7.4e-5 / 5.0);
    const double coarse = advised_step("--step 5e-3", &x);
    kt_check_near("the same of coarse steps", coarse / fine, 1.0, 0.25);
    snprintf(options, sizeof options, "--step %.17g", 0.5 * fmin(fine, coarse));
    kt_check_near("half of it is not warned of", advised_step(options, &x), 0.0, 0.0);
    kt_check_near("and near", x, exact, 1e-8);
}

/* 2.5 samples a period lie within the region of stability of rk4 (2.83 rad a step). */
KT_TEST(run_tells_few_samples_a_period) {
    kt_write_file("swing.yaml", "kinetree: 1\n"
                                "bodies: [{name: mass, mass: 2, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                                "effects: [{type: joint_spring, joint: mass, stiffness: 800}]\n"
                                "simulate: {duration: 5, integrator: rk4, step: 0.1256637}\n");
    kt_ran ran = kt_shell("$K run swing.yaml --out /dev/null");
    kt_check_contains("words", ran.err,
                      "rk4 at 0.125664 s takes 2.5 steps a period of an undamped oscillation of 3.183 Hz (mass)");
    kt_check_contains("remedy", ran.err, "Take steps below 0.033 s, 9.5 a period");
    kt_check_equal_int("it is stable", kt_count_of(ran.err, "to be stable"), 0);
    ran = kt_shell("$K run swing.yaml --step 0.03 --out /dev/null");
    kt_check_equal_int("enough", kt_count_of(ran.err, "steps a period"), 0);
}

/* At the end the ball lies on its stop, and no mode of it has a rate. Its modes without the stop have no meaning. */
KT_TEST(no_doubt_where_nothing_moves) {
    kt_write_file("rests.yaml", "kinetree: 1\n"
                                "gravity: [0, 0, -9.81]\n"
                                "bodies: [{name: ball, mass: 1, joint: {type: prismatic, axis: z, position: 0.5}}]\n"
                                "effects: [{type: joint_limit, joint: ball, lower: 0, restitution: 0.5}]\n"
                                "simulate: {duration: 3, integrator: rk4, step: 1e-3}\n");
    const kt_ran ran = kt_shell("$K run rests.yaml --out /dev/null");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_equal_int("warnings", kt_count_of(ran.err, "warning"), 0);
}
