/* kinetree stability, and the warning of `kinetree run`. */
#include "shell.h"

#include <math.h>
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
    kt_check_contains("a step and what bounds it", ran.out, "  rk4         0.0003431  decay of 8117 /s, t = 0 s\n");
    ran = kt_shell("$K stability " GOVERNOR " --step 5e-4");
    kt_check_contains("too long", ran.out, "  rk4         0.0003431  unstable: blows up          decay of 8117 /s");
    kt_check_contains("not too long", ran.out, "  dop853      0.0007877  stable                      decay of 8117 /s");
}

/* rk4's limit is 2.785 / 8117 s; heun's on a swing of w lets |R|^N = (1 + (h w)^4 / 4)^(T / 2h) become 2. */
KT_TEST(stability_writes_json) {
    kt_ran ran = kt_shell("$K stability " GOVERNOR " --json --step 3e-4 --samples 3");
    json_t *root = kt_json(ran.out);
    kt_check_near("states", (double)json_array_size(kt_json_find(root, "states")), 3.0, 0.0);
    kt_check_near("fastest", kt_json_at(root, "states[0].modes[0].real"), -8117.2033, 1e-4);
    kt_check_near("it moves", kt_json_at(root, "states[0].modes[0].moves.slider"), 1.0, 1e-12);
    kt_check_text("method", json_string_value(kt_json_find(root, "methods[7].integrator")), "rk4");
    kt_check_near("step", kt_json_at(root, "methods[7].step"), 2.785293563 / 8117.2033, 1e-7);
    kt_check_near("growth", kt_json_at(root, "methods[7].growth"), 1.0, 1e-3);
    kt_check_near("bounded by", kt_json_at(root, "methods[7].bounded_by.real"), -8117.2033, 1e-4);
    json_decref(root);
    kt_write_file("swing.yaml", "kinetree: 1\n"
                                "bodies: [{name: mass, mass: 2, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                                "effects: [{type: joint_spring, joint: mass, stiffness: 800}]\n"
                                "simulate: {duration: 5, integrator: heun, step: 0.01}\n");
    ran = kt_shell("$K stability swing.yaml --json");
    root = kt_json(ran.out);
    const double h = kt_json_at(root, "methods[2].step");
    kt_check_text("method", json_string_value(kt_json_find(root, "methods[2].integrator")), "heun");
    kt_check_near("growth over the run", pow(1.0 + pow(20.0 * h, 4.0) / 4.0, 2.5 / h), 2.0, 1e-12);
    json_decref(root);
}

KT_TEST(stability_says_what_it_cannot_do) {
    kt_expect(1, "there is no method 'rk5'; did you mean 'rk4'?", "$K stability " PENDULUM " --integrator rk5");
    kt_expect(1, "SCENE is missing", "$K stability");
    kt_expect(2, "nowhere.yaml", "$K stability nowhere.yaml");
    kt_write_file("still.yaml", "kinetree: 1\nbodies: [{name: a, mass: 1}]\n");
    kt_ran ran = kt_shell("$K stability still.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("nothing moves", ran.out, "nothing moves: any step is stable\n");
#ifdef KT_HAS_CAIRO
    kt_expect(1, "a picture's name ends in .svg or .png", "$K stability " PENDULUM " --plot a.pdf");
    kt_expect(1, "nothing to draw", "$K stability still.yaml --plot a.svg");
#endif
}

#ifdef KT_HAS_CAIRO
KT_TEST(stability_draws_the_region) {
    kt_ran ran = kt_shell("$K stability " GOVERNOR " --integrator rk4 --step 1e-3 --samples 1 --plot a.svg && "
                          "$K stability " GOVERNOR " --integrator rkc2 --step 1e-2 --plot a.png && file a.png 2>&1");
    kt_check_equal_int("exit code", ran.code, 0);
    const char *svg = kt_read_file("a.svg");
    kt_check_contains("it is one", svg, "<svg");
    kt_check_above("a boundary of many pieces", (double)strlen(svg), 2e4);
    static const char white[] = "style=\"fill:rgb(100%,100%,100%)"; /* the page is painted first */
    kt_check_true("a white page", strstr(svg, white) != NULL);
    ran = kt_shell("$K stability " GOVERNOR " --integrator rk4 --step 1e-3 --samples 1 --dark --plot b.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    svg = kt_read_file("b.svg");
    kt_check_above("as many pieces on a dark page", (double)strlen(svg), 2e4);
    kt_check_true("which is not white", strstr(svg, white) == NULL);
}
#endif

/* ---- the warning ------------------------------------------------------------------------------------------------- */

static int count(const char *text, const char *part) {
    int found = 0;
    for (const char *at = strstr(text, part); at != NULL; at = strstr(at + 1, part))
        found++;
    return found;
}

KT_TEST(run_warns_once_of_a_step_outside_the_region) {
    kt_ran ran = kt_shell("$K run " GOVERNOR " --integrator rk4 --step 1e-3 --out /dev/null");
    kt_check_equal_int("it blows up, too", ran.code, 4);
    kt_check_equal_int("once", count(ran.err, "warning"), 1);
    kt_check_contains(
        "words", ran.err,
        "kinetree: warning: steps of 0.001 s are too long for rk4 to be stable: a decay of 8117 /s "
        "(slider, right, left) blows up, which in truth it does not. Take steps below 0.000343 s, or rkc2;");
    ran = kt_shell("$K run " GOVERNOR " --integrator rk4 --step 1e-3 --out /dev/null --quiet");
    kt_check_equal_int("not when quiet", count(ran.err, "warning"), 0);
    ran = kt_shell("$K run " GOVERNOR " --integrator rk4 --step 1e-3 --out /dev/null --quiet --summary - 2>/dev/null");
    json_t *root = kt_json(ran.out);
    kt_check_text("but it stands in the summary", json_string_value(kt_json_find(root, "warnings[0].code")),
                  "unstable_step");
    kt_check_near("with the step", kt_json_at(root, "warnings[0].value"), 2.785293563 / 8117.2033, 1e-7);
    kt_check_text("its unit", json_string_value(kt_json_find(root, "warnings[0].unit")), "s");
    kt_check_contains("the remedy", json_string_value(kt_json_find(root, "warnings[0].remedy")), "Take steps below");
    json_decref(root);
    kt_write_file("swing.yaml", "kinetree: 1\n"
                                "bodies: [{name: mass, mass: 2, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                                "effects: [{type: joint_spring, joint: mass, stiffness: 800}]\n"
                                "simulate: {duration: 5, integrator: heun, step: 0.05}\n");
    ran = kt_shell("$K run swing.yaml --out /dev/null"); /* (1 + 1/4)^(100/2) */
    kt_check_equal_int("a slow growth", count(ran.err, "warning"), 1);
    kt_check_contains(
        "words", ran.err,
        "an undamped swing of 3.183 Hz (mass) grows about 7e+04 times over the run, which in truth it does "
        "not. Take steps below 0.0191 s;");
}

/* A pendulum let go from the level has no stiffness there: what is wrong shows at the end. */
KT_TEST(run_looks_at_the_end_where_the_start_says_nothing) {
    kt_ran ran = kt_shell("$K run " PENDULUM " --integrator euler --step 0.1 --out /dev/null");
    kt_check_equal_int("once", count(ran.err, "too long for euler to be stable"), 1);
}

KT_TEST(run_does_not_warn_of_what_is_only_inaccurate) {
    static const char *const settings[] = {"rk4 --step 0.2", "heun --step 0.05", "kutta3 --step 0.1",
                                           "dopri5 --step 0.3", "euler --step 0.001"};
    for (int i = 0; i < 5; i++) {
        kt_ran ran = kt_shell("$K run " PENDULUM " --out /dev/null --integrator %s", settings[i]);
        kt_check_equal_int(settings[i], count(ran.err, "to be stable"), 0);
    }
    kt_ran ran = kt_shell("$K run " GOVERNOR " --out /dev/null --duration 1 --integrator rk4 --step 3.4e-4");
    kt_check_equal_int("just within", count(ran.err, "to be stable"), 0);
    ran = kt_shell("for s in " KT_SCENES "/*.yaml; do $K run $s --out /dev/null --duration 0.3; done");
    kt_check_equal_int("bundled scenes as they are", count(ran.err, "warning"), 0);
    kt_check_above("which ran", count(ran.err, "simulated"), 30.0);
}
