/* Warnings of `run` about energies that a scene cannot have. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* README's four-bar has 34.8 J. A block on a spring has 10 rad/s and 50 J. */
static const char four_bar[] = "kinetree: 1\n"
                               "gravity: [0, -9.81, 0]\n"
                               "bodies:\n"
                               "  - name: crank\n"
                               "    joint: {type: revolute, axis: z, position: 60 deg}\n"
                               "    mass: 1\n"
                               "    shape: {type: rod, to: [1, 0, 0]}\n"
                               "  - name: coupler\n"
                               "    parent: crank\n"
                               "    joint: {type: revolute, axis: z, at: [1, 0, 0], position: -50 deg}\n"
                               "    mass: 2\n"
                               "    shape: {type: rod, to: [2, 0, 0]}\n"
                               "    markers: {tip: [2, 0, 0]}\n"
                               "  - name: rocker\n"
                               "    joint: {type: revolute, axis: z, at: [2.5, 0, 0], position: 80 deg}\n"
                               "    mass: 1\n"
                               "    shape: {type: rod, to: [1.5, 0, 0]}\n"
                               "    markers: {tip: [1.5, 0, 0]}\n"
                               "loops:\n"
                               "  - {name: close, type: revolute, between: [coupler.tip, rocker.tip]}\n"
                               "initial: {hold: [crank]}\n"
                               "simulate: {duration: 5, integrator: dop853, tolerance: 1e-9}\n";

static const char oscillator[] = "kinetree: 1\n"
                                 "bodies: [{name: mass, mass: 1, joint: {type: prismatic, axis: x, velocity: 10}}]\n"
                                 "effects: [{type: joint_spring, joint: mass, stiffness: 100, damping: 0}]\n"
                                 "simulate: {duration: 20, integrator: rk4, step: 0.01}\n";

/* The warning of this code in a summary; NULL: none. */
static const json_t *find_warning(const json_t *root, const char *code) {
    const json_t *list = kt_json_find(root, "warnings");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *one = json_array_get(list, i);
        if (strcmp(json_string_value(kt_json_find(one, "code")), code) == 0)
            return one;
    }
    return NULL;
}

KT_TEST(run_warns_of_energy_that_is_lost_or_gained) {
    kt_write_file("four-bar.yaml", four_bar);
    kt_ran ran = kt_shell("$K run four-bar.yaml --integrator rk4 --step 0.1 --out /dev/null --summary -");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("words", ran.err, "kinetree: warning: the total energy is off by ");
    kt_check_contains("remedy", ran.err, "Take much smaller steps, or an adaptive method");
    json_t *root = kt_json(ran.out);
    const json_t *warning = find_warning(root, "energy");
    kt_need(kt_check_true("it stands in the summary", warning != NULL));
    kt_check_above("over the scale", kt_json_at(warning, "value"), 0.1);
    kt_check_below("and when", kt_json_at(warning, "time"), 1.0);
    json_decref(root);
    ran = kt_shell("$K run four-bar.yaml --out /dev/null");
    kt_check_true("as it should be run", strstr(ran.err, "warning") == NULL);
}

/* A step of rk4 multiplies the amplitude by |R(iy)|, with
 *     |R|^2 = 1 - y^6 / 72 + y^8 / 576. */
KT_TEST(warning_tells_the_step_that_is_enough) {
    kt_write_file("oscillator.yaml", oscillator);
    const double y = 0.3, end = pow(1.0 - pow(y, 6.0) / 72.0 + pow(y, 8.0) / 576.0, 20.0 / (0.1 * y));
    kt_ran ran = kt_shell("$K run oscillator.yaml --step 0.03 --out /dev/null --quiet --summary -");
    kt_check_text("nothing is printed", ran.err, "");
    json_t *root = kt_json(ran.out);
    const json_t *warning = find_warning(root, "energy");
    double step = 0.0;
    kt_check_near("error over the energy", kt_json_at(root, "energy.error"), 1.0 - end, 1e-4);
    kt_need(kt_check_true("it stands in the summary", warning != NULL));
    kt_check_near("energy lost", kt_json_at(warning, "value"), 1.0 - end, 1e-4);
    const char *remedy = json_string_value(kt_json_find(warning, "remedy"));
    const char *below = strstr(remedy, "Take steps below ");
    if (kt_check_true("the step is told", below != NULL))
        step = strtod(below + strlen("Take steps below "), NULL);
    json_decref(root);
    ran = kt_shell("$K run oscillator.yaml --step %.17g --out /dev/null", step);
    kt_check_true("and is enough", strstr(ran.err, "total energy is off") == NULL);
}

/* There are 2.5 samples a period, within rk4's region of stability (2.83 rad). The factor |R|^2 is 0.18 a step. */
KT_TEST(undamped_oscillation_that_dies_by_the_method_is_told) {
    kt_write_file("oscillator.yaml", oscillator);
    kt_ran ran = kt_shell("$K run oscillator.yaml --step 0.25132741228718347 --out /dev/null");
    kt_check_contains("all of it is lost", ran.err,
                      "the total energy is off by 50 J, 1 times the energy of the motion");
}

/* The gain of a step is |R(3i)|^2 = 2.27, which gives 1000 after nine. The scene cannot gain energy, with or without
 * dampers. */
KT_TEST(blow_up_ends_the_run_with_exit_code_4) {
    static const char *const dampings[] = {"0", "0.001"};
    kt_write_file("oscillator.yaml", oscillator);
    for (int i = 0; i < 2; i++) {
        kt_ran ran = kt_shell("sed 's/damping: 0/damping: %s/' oscillator.yaml >d.yaml; $K run d.yaml --step 0.3 "
                              "--out b.csv --summary -",
                              dampings[i]);
        kt_check_equal_int("exit code", ran.code, 4);
        kt_check_contains("words", ran.err,
                          "in a scene that cannot gain any: the integration has blown up. Take smaller");
        json_t *root = kt_json(ran.out);
        const json_t *warning = find_warning(root, "blow_up");
        kt_check_true("in the summary", warning != NULL);
        kt_check_true("once", find_warning(root, "energy") == NULL);
        kt_check_above("soon", kt_json_at(root, "time"), 8 * 0.3);
        kt_check_below("and not at the end", kt_json_at(root, "time"), 15 * 0.3);
        json_decref(root);
    }
}

/* Losing by dampers and gaining by motors is no error, at the same settings; records of positions alone are watched. */
KT_TEST(scenes_that_may_change_their_energy_are_not_warned_of) {
    kt_write_file("oscillator.yaml", oscillator);
    kt_ran ran = kt_shell("sed 's/damping: 0/damping: 2/' oscillator.yaml | $K run - --out /dev/null");
    kt_check_true("damped", strstr(ran.err, "warning") == NULL);
    ran = kt_shell("sed 's/^effects.*/effects: [{type: motor, joint: mass, force: 100}]/' oscillator.yaml | $K run - "
                   "--out /dev/null");
    kt_check_true("driven", strstr(ran.err, "warning") == NULL);
    ran = kt_shell("$K run oscillator.yaml --step 0.1 --record position --out b.csv && head -1 b.csv");
    kt_check_contains("watched all the same", ran.err, "the total energy is off by");
    kt_check_text("and not written", ran.out, "time,position.mass\n");
    ran = kt_shell("$K run oscillator.yaml --step 0.1 --record balance --out /dev/null");
    kt_check_contains("a balance", ran.err, "the total energy is off by");
    ran = kt_shell("sed 's/damping: 0/damping: 2/' oscillator.yaml | $K run - --step 0.1 --record balance --out "
                   "/dev/null");
    kt_check_contains("a balance with dampers", ran.err, "the balance of energies");
}

/* The scenes of the table in validation.md that take least time, to the digit of the table. */
KT_TEST(resolution_of_the_watch_is_what_the_page_says) {
    static const struct {
        const char *scene;
        double resolution;
    } cases[] = {{"andrews", 6e-5}, {"slider-crank-spring", 3e-3}, {"shot", 6e-3}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        kt_ran ran = kt_shell("$K run " KT_SCENES "/%s.yaml --out /dev/null --summary -", cases[i].scene);
        json_t *root = kt_json(ran.out);
        const double found = kt_json_at(root, "energy_watch.uncertainty") / kt_json_at(root, "energy_watch.scale");
        kt_check_near(cases[i].scene, found / cases[i].resolution, 1.0, 0.15);
        json_decref(root);
    }
}

/* The four-bar with a damper, and with a motor: its energy changes, and the watch works all the same. If a loop drives
 * it, the run reports that there is no watch. */
KT_TEST(damped_and_driven_motions_are_watched_or_said_not_to_be) {
    static const struct {
        const char *effects, *name;
    } cases[] = {{"effects: [{type: joint_damper, joint: crank, damping: 0.1}]\n", "damped"},
                 {"effects: [{type: motor, joint: crank, torque: {sine: {amplitude: 5, frequency: 1}}}]\n", "driven"}};
    char text[2000];
    for (size_t i = 0; i < 2; i++) {
        kt_note("%s", cases[i].name);
        snprintf(text, sizeof text, "%s%s", four_bar, cases[i].effects);
        kt_write_file("watched.yaml", text);
        kt_ran ran = kt_shell("$K run watched.yaml --out /dev/null --summary -");
        json_t *root = kt_json(ran.out);
        kt_check_true("none is warned of falsely", find_warning(root, "energy") == NULL);
        kt_check_text("by", json_string_value(kt_json_find(root, "energy_watch.by")), "powers at the ends of steps");
        kt_check_above("resolution", 1e-2 * kt_json_at(root, "energy_watch.scale"),
                       kt_json_at(root, "energy_watch.uncertainty"));
        json_decref(root);
        ran = kt_shell("$K run watched.yaml --integrator tsit5 --step 0.05 --out /dev/null --summary -");
        kt_check_contains("words", ran.err,
                          i == 0 ? "while the scene can only dissipate it" : "the uncertainty of the work done");
        root = kt_json(ran.out);
        kt_check_true("a wrong one is", find_warning(root, "energy") != NULL);
        json_decref(root);
    }
    snprintf(text, sizeof text, "%s", four_bar);
    char *loops = strstr(text, "loops:\n");
    kt_need(kt_check_true("loops", loops != NULL));
    snprintf(loops, sizeof text - (size_t)(loops - text), "%s%s",
             "loops:\n  - {name: drive, type: motion, joint: crank, position: {polynomial: [1.0471975511965976, 2]}}\n",
             strstr(four_bar, "loops:\n") + 7);
    kt_write_file("led.yaml", text);
    kt_expect(0, "energy not watched: that would cost more than 2 % here; record 'balance' to watch it",
              "$K run led.yaml --out /dev/null");
    kt_expect(0, "J supplied: the balance closes to", "$K run led.yaml --out /dev/null --record balance");
}

/* The slope of each function jumps within two seconds, or nowhere in them. Jumps at the start and at the end do not
 * count. */
KT_TEST(kinks_of_driven_joints_are_told) {
    static const char drive[] = "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic}, mass: 1}]\n"
                                "loops: [{name: drive, %s}]\nsimulate: {duration: 2}\n";
    static const char told[] = "the speed of loop 'drive' jumps at a row of its table, or at a branch of its";
    static const struct {
        const char *loop;
        bool jumps;
    } cases[] = {
        {"type: motion, joint: a, position: {table: [[0, 0], [1.5, 2]]}", true},
        {"type: motion, joint: a, position: {table: [[0.5, 0], [3, 2]]}", true},
        {"type: motion, joint: a, position: {table: [[0, 0], [2, 2]]}", false},
        {"type: motion, joint: a, position: {table: [[0.5, 1], [1.5, 1]]}", false},
        {"type: motion, joint: a, position: {sum: [{table: [[0, 0], [1, 2]]}, {sine: {amplitude: 1, frequency: 1}}]}",
         true},
        {"type: motion, joint: a, position: 'max(0, t - 1)'", true},
        {"type: motion, joint: a, position: 'abs(sin(3*t))'", true},
        {"type: motion, joint: a, position: 'min (t, 1.99)'", true},
        {"type: motion, joint: a, position: 'clamp(t, -1, 0.5)'", true},
        {"type: motion, joint: a, position: {table: [[0, 0], [1, 1], [1.5, 1.5]], interpolation: linear}", true},
        {"type: motion, joint: a, position: {table: [[0, 0], [1, 1], [3, 3]], interpolation: linear}", false},
        {"type: motion, joint: a, position: {table: [[3, 0], [4, 1], [5, 0]], interpolation: linear}", false},
        {"type: motion, joint: a, position: 'max(0, t - 1)^2'", false},
        {"type: motion, joint: a, position: 'abs(t) + min(t, 5)'", false},
        {"type: rates, coefficients: {a: 1}, rate: 'max(0, t - 1)'", false},
        {"type: rates, coefficients: {a: 1}, rate: {table: [[0, 0], [1, 2], [2, 0]]}", false},
        {"type: rates, coefficients: {a: 1}, rate: 'step(t - 1)'", true},
    };
    char text[500];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        snprintf(text, sizeof text, drive, cases[i].loop);
        kt_write_file("d.yaml", text);
        const kt_ran ran = kt_shell("$K check d.yaml");
        kt_note("%s", cases[i].loop);
        kt_check_equal_int("status", ran.code, 0);
        kt_check_equal_int("told", strstr(ran.err, told) != NULL || strstr(ran.out, told) != NULL, cases[i].jumps);
    }
}

/* A drive whose speed jumps has an impulse. Steps end there, and the balance has its work. */
KT_TEST(balance_closes_where_the_speed_of_a_drive_jumps) {
    static const char scene[] =
        "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
        "  - {name: a, joint: {type: revolute, axis: z}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
        "  - {name: b, parent: a, joint: {type: revolute, axis: z, at: [1, 0, 0]}, mass: 1, shape: {type: rod, to: [1, "
        "0, "
        "0]}}\n"
        "loops:\n  - {name: drive, type: motion, joint: a, position: \"abs(t-0.5)\"}\n"
        "simulate: {duration: 1}\noutput: {record: [position, velocity, balance]}\n";
    kt_write_file("jump.yaml", scene);
    kt_ran ran = kt_shell("$K run jump.yaml --out /dev/null");
    kt_check_contains("adaptive", ran.err, "the balance closes to");
    kt_check_true("no warning", strstr(ran.err, "balance of energies") == NULL);
    ran = kt_shell("$K run jump.yaml --out /dev/null --integrator rk4 --step 0.003");
    kt_check_contains("fixed", ran.err, "the balance closes to");
    kt_check_true("no warning", strstr(ran.err, "balance of energies") == NULL);
}
