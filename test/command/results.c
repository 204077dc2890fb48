/* The exact texts and numbers that `run` and `evaluate` write. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* A block falls on a vertical slide with energy 0 throughout:
 *     y = -g t^2 / 2. */
static const char falling[] = "kinetree: 1\n"
                              "name: falling block\n"
                              "gravity: [0, -10, 0]\n"
                              "bodies:\n"
                              "  - name: block\n"
                              "    joint: {type: prismatic, axis: y}\n"
                              "    mass: 2\n"
                              "    markers: {corner: [1, 2, 3]}\n"
                              "simulate: {duration: 1, integrator: rk4, step: 0.125}\n"
                              "output: {interval: 0.25}\n";

/* A spherical joint under a revolute one: coordinates of both sorts. */
static const char ball[] = "kinetree: 1\n"
                           "gravity: [0, 0, -9.81]\n"
                           "bodies:\n"
                           "  - name: arm\n"
                           "    joint: {type: revolute, velocity: 1}\n"
                           "    mass: 1\n"
                           "    shape: {type: rod, to: [1, 0, 0]}\n"
                           "    markers: {tip: [1, 0, 0]}\n"
                           "  - name: ball\n"
                           "    parent: arm\n"
                           "    joint: {type: spherical, at: [1, 0, 0]}\n"
                           "    mass: 1\n"
                           "    com: [0, 0, -1]\n"
                           "    inertia: [1, 2, 3]\n"
                           "simulate: {duration: 1}\n";

/* Bodies that are fixed to the world, directly or through others, weigh nothing. The block's energy stays
 *     m g y = 20 N y. */
KT_TEST(bodies_fixed_to_the_world_have_no_energy) {
    static const char rest[] = "bodies:\n"
                               "  - {name: tower, joint: {type: fixed, at: [0, 100, 0]}, mass: 1e6}\n"
                               "  - {name: bell, parent: tower, joint: {type: fixed, at: [0, 7, 0]}, mass: 10}\n";
    char text[1024];
    snprintf(text, sizeof text, "%.*s%s%s", (int)(strstr(falling, "bodies:\n") - falling), falling, rest,
             strstr(falling, "bodies:\n") + strlen("bodies:\n"));
    kt_write_file("t.yaml", text);
    json_t *root = kt_json(kt_shell("$K run t.yaml --quiet --out /dev/null --summary -").out);
    const double y = kt_json_at(root, "position.block");
    kt_check_near("y", y, -5.0, 1e-14);
    kt_check_near("potential energy", kt_json_at(root, "energy.potential"), 20.0 * y, 1e-13);
    kt_check_near("total energy", kt_json_at(root, "energy.total"), 0.0, 1e-13);
    json_decref(root);
    root = kt_json(kt_shell("$K run t.yaml --formulation absolute --quiet --out /dev/null --summary -").out);
    kt_check_near("free bodies", kt_json_at(root, "energy.potential"), 20.0 * y, 1e-12);
    json_decref(root);
}

static void check_method(const char *arguments, const char *words, const char *method, const char *chosen) {
    const kt_ran ran = kt_shell("$K run b.yaml %s --out /dev/null --summary -", arguments);
    json_t *root = kt_json(ran.out);
    const json_t *why = kt_json_find(root, "method.chosen");
    kt_check_text(arguments, json_string_value(kt_json_find(root, "method.integrator")), method);
    kt_check_text(arguments, json_is_null(why) ? "null" : json_string_value(why), chosen);
    kt_check_contains(arguments, ran.err, words);
    json_decref(root);
}

/* If a run names no method, report and summary give the method and the reason; so does info. */
KT_TEST(a_run_tells_its_default_method) {
    kt_write_file("b.yaml", ball);
    check_method("", ", auto at tolerance 1e-09 (auto is the default)\n", "auto", "the default");
    check_method("--step 0.01", ", dopri5 with steps of 0.01 s (dopri5 is the default with a fixed step)\n", "dopri5",
                 "the default with a fixed step");
    check_method("--integrator auto", ", auto at tolerance 1e-09\n", "auto", "null");
    check_method("--formulation absolute", ", auto at tolerance 1e-09 (auto is the default)\n", "auto", "the default");
    check_method("--tolerance 1e-3", ", auto at tolerance 0.001 (auto is the default)\n", "auto", "the default");
    kt_expect(1, "--rho is for --integrator two-step, and this is the default one", "$K run b.yaml --rho 0.5");
    kt_check_contains("info", kt_shell("$K info b.yaml").out,
                      "simulate   1 s, auto at tolerance 1e-09, tree formulation\n           (auto is the default)\n");
    kt_check_contains("its plan", kt_shell("$K info --plan b.yaml").out, "  linear equations while it is stiff  ");
    const kt_ran large = kt_shell("$K make chain --links 101 | $K info -");
    kt_check_contains("a large one", large.out,
                      "(dopri5 is the default above 100 velocity coordinates, for the size of matrices; if the motion "
                      "is stiff, name auto or radau5)");
    const kt_ran free =
        kt_shell("$K make chain --links 17 | $K run - --formulation absolute --duration 0.01 --out /dev/null");
    kt_check_contains("what counts are the coordinates that are integrated", free.err,
                      "dopri5 at tolerance 1e-09 (dopri5 is the default above 100 velocity coordinates");
}

KT_TEST(header_names_every_column) {
    kt_write_file("b.yaml", ball);
    kt_ran ran = kt_shell("$K run b.yaml --quiet --out - --interval 1 --markers arm.tip "
                          "--record reaction,constraint,energy,acceleration,velocity,position");
    kt_check_equal_int("exit code", ran.code, 0);
    char header[2048];
    snprintf(header, sizeof header, "%.*s", (int)strcspn(ran.out, "\n"), ran.out);
    kt_check_text(
        "header", header,
        "time,position.arm,position.ball[0],position.ball[1],position.ball[2],position.ball[3],velocity.arm,"
        "velocity.ball[0],velocity.ball[1],velocity.ball[2],acceleration.arm,acceleration.ball[0],"
        "acceleration.ball[1],acceleration.ball[2],marker.arm.tip.x,marker.arm.tip.y,marker.arm.tip.z,"
        "energy.kinetic,energy.potential,energy.total,constraint.position,constraint.velocity,"
        "reaction.arm.fx,reaction.arm.fy,reaction.arm.fz,reaction.arm.mx,reaction.arm.my,reaction.arm.mz,"
        "reaction.ball.fx,reaction.ball.fy,reaction.ball.fz,reaction.ball.mx,reaction.ball.my,reaction.ball.mz");
    kt_check_equal_int("lines", kt_count_lines(ran.out), 3);
    ran = kt_shell("$K run b.yaml --quiet --out - --interval 1");
    kt_check_true("position, velocity, energy where nothing is said",
                  strncmp(ran.out,
                          "time,position.arm,position.ball[0],position.ball[1],position.ball[2],position.ball[3],"
                          "velocity.arm,velocity.ball[0],velocity.ball[1],velocity.ball[2],"
                          "energy.kinetic,energy.potential,energy.total\n",
                          strcspn(ran.out, "\n") + 1) == 0);
}

KT_TEST(records_are_those_of_the_motion) {
    kt_write_file("f.yaml", falling);
    kt_ran ran = kt_shell("$K run f.yaml --quiet --out - --markers block.corner --record "
                          "position,velocity,acceleration,energy,reaction");
    int position = kt_csv_column(ran.out, "position.block"), velocity = kt_csv_column(ran.out, "velocity.block");
    int y = kt_csv_column(ran.out, "marker.block.corner.y"), kinetic = kt_csv_column(ran.out, "energy.kinetic");
    kt_check_equal_int("lines", kt_count_lines(ran.out), 6);
    for (int k = 0; k <= 4; k++) {
        double t = 0.25 * k;
        kt_check_near("time", kt_csv_number(ran.out, k + 1, 0), t, 0.0);
        kt_check_near("position", kt_csv_number(ran.out, k + 1, position), -5.0 * t * t, 16.0 * DBL_EPSILON);
        kt_check_near("velocity", kt_csv_number(ran.out, k + 1, velocity), -10.0 * t, 16.0 * DBL_EPSILON);
        kt_check_near("marker", kt_csv_number(ran.out, k + 1, y), 2.0 - 5.0 * t * t, 16.0 * DBL_EPSILON);
        kt_check_near("kinetic energy", kt_csv_number(ran.out, k + 1, kinetic), 100.0 * t * t, 400.0 * DBL_EPSILON);
    }
    kt_check_near("acceleration", kt_csv_number(ran.out, 3, kt_csv_column(ran.out, "acceleration.block")), -10.0, 0.0);
    kt_check_near("free fall has no reaction", kt_csv_number(ran.out, 3, kt_csv_column(ran.out, "reaction.block.fy")),
                  0.0, 0.0);
}

/* Reading the last record gives the bits of the summary, which jansson reads and writes by itself. */
KT_TEST(numbers_read_back_to_the_same_bits) {
    kt_write_file("b.yaml", ball);
    kt_ran ran = kt_shell("$K run b.yaml --quiet --summary b.json && cat b.csv && cat b.json >&2");
    kt_check_equal_int("exit code", ran.code, 0);
    json_t *root = kt_json(ran.err);
    int last = kt_count_lines(ran.out) - 1;
    static const char *const pairs[][2] = {
        {"position.arm", "position.arm"},         {"position.ball[1]", "position.ball[1]"},
        {"position.ball[3]", "position.ball[3]"}, {"velocity.arm", "velocity.arm"},
        {"velocity.ball[2]", "velocity.ball[2]"}, {"energy.kinetic", "energy.kinetic"},
        {"energy.total", "energy.total"},         {"time", "time"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        double csv = kt_csv_number(ran.out, last, kt_csv_column(ran.out, pairs[i][0]));
        double json = kt_json_at(root, pairs[i][1]);
        kt_check_equal_bits(pairs[i][0], &csv, &json, 1);
    }
    json_decref(root);
}

KT_TEST(summary_tells_the_end_and_the_cost) {
    kt_write_file("f.yaml", falling);
    kt_ran ran = kt_shell("$K run f.yaml --quiet --out /dev/null --summary -");
    kt_check_equal_int("exit code", ran.code, 0);
    json_t *root = kt_json(ran.out);
    static const struct {
        const char *path;
        double value, bound;
    } numbers[] = {
        {"time", 1.0, 0.0},
        {"freedom.tree", 1.0, 0.0},
        {"freedom.equations", 0.0, 0.0},
        {"freedom.rank", 0.0, 0.0},
        {"freedom.minimal", 1.0, 0.0},
        {"position.block", -5.0, 16.0 * DBL_EPSILON},
        {"velocity.block", -10.0, 16.0 * DBL_EPSILON},
        {"acceleration.block", -10.0, 0.0},
        {"marker/block.corner[0]", 1.0, 0.0},
        {"marker/block.corner[1]", -3.0, 16.0 * DBL_EPSILON},
        {"marker/block.corner[2]", 3.0, 0.0},
        {"energy.kinetic", 100.0, 400.0 * DBL_EPSILON},
        {"energy.potential", -100.0, 400.0 * DBL_EPSILON},
        {"energy.total", 0.0, 400.0 * DBL_EPSILON},
        {"energy.drift", 0.0, 400.0 * DBL_EPSILON},
        {"energy.error", 0.0, 4.0 * DBL_EPSILON}, /* of 100 J */
        {"constraint.position", 0.0, 0.0},
        {"constraint.velocity", 0.0, 0.0},
        {"method.step", 0.125, 0.0},
        {"cost.steps", 8.0, 0.0},
        {"cost.rejected", 0.0, 0.0},
        {"cost.factorizations", 0.0, 0.0},
    };
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        kt_check_near(numbers[i].path, kt_json_at(root, numbers[i].path), numbers[i].value, numbers[i].bound);
    kt_check_text("scene", json_string_value(kt_json_find(root, "scene")), "falling block");
    kt_check_text("integrator", json_string_value(kt_json_find(root, "method.integrator")), "rk4");
    kt_check_text("formulation", json_string_value(kt_json_find(root, "method.formulation")), "tree");
    kt_check_text("reduction", json_string_value(kt_json_find(root, "method.reduction")), "qr");
    kt_check_text("plan", json_string_value(kt_json_find(root, "method.plan")), "planar");
    kt_check_above("evaluations", kt_json_at(root, "cost.evaluations"), 32.0);
    kt_check_true("CPU time", kt_json_at(root, "cost.cpu_seconds") > 0.0);
    kt_check_equal_int("keys at the top", (long long)json_object_size(root), 18);
    json_decref(root);
}

/* Each key of `simulate` and `output`, seen in the summary or in the records. */
KT_TEST(command_line_overrides_the_scene) {
    kt_write_file("f.yaml", falling);
    kt_ran ran =
        kt_shell("$K run f.yaml --quiet --out /dev/null --summary - --duration 2 --integrator=tsit5 --tolerance "
                 "1e-6,1e-8 --reduction svd --metric mass");
    json_t *root = kt_json(ran.out);
    kt_check_near("duration", kt_json_at(root, "time"), 2.0, 0.0);
    kt_check_text("integrator", json_string_value(kt_json_find(root, "method.integrator")), "tsit5");
    kt_check_true("no fixed step", json_is_null(kt_json_find(root, "method.step")));
    kt_check_near("relative", kt_json_at(root, "method.tolerance.relative"), 1e-6, 0.0);
    kt_check_near("absolute", kt_json_at(root, "method.tolerance.absolute"), 1e-8, 0.0);
    kt_check_text("reduction", json_string_value(kt_json_find(root, "method.reduction")), "svd");
    json_decref(root);
    ran = kt_shell("$K run f.yaml --quiet --out /dev/null --summary - --plan spatial");
    root = kt_json(ran.out);
    kt_check_text("plan", json_string_value(kt_json_find(root, "method.plan")), "spatial");
    json_decref(root);
    ran = kt_shell("$K run f.yaml --plan=flat");
    kt_check_equal_int("no such plan", ran.code, 1);
    kt_check_contains("told", ran.err, "--plan takes one of auto|spatial, not 'flat'");
    ran = kt_shell("$K run f.yaml --quiet --out /dev/null --summary - --step 0.0625");
    root = kt_json(ran.out);
    kt_check_near("steps", kt_json_at(root, "cost.steps"), 16.0, 0.0);
    json_decref(root);
    ran = kt_shell("$K run f.yaml --quiet --out - --interval 0.5 --record position --markers block.corner");
    kt_check_equal_int("interval", kt_count_lines(ran.out), 4);
    kt_check_true("record and markers", strncmp(ran.out,
                                                "time,position.block,marker.block.corner.x,marker.block.corner.y,"
                                                "marker.block.corner.z\n",
                                                strcspn(ran.out, "\n") + 1) == 0);
}

KT_TEST(scene_may_come_from_standard_input) {
    kt_write_file("f.yaml", falling);
    kt_ran ran = kt_shell("$K run f.yaml --quiet && $K run - --quiet <f.yaml && cmp f.csv scene.csv && cat f.yaml | $K "
                          "run - --quiet --out - | cmp - f.csv");
    kt_check_equal_int("the same records", ran.code, 0);
    kt_check_text("nothing on standard output", ran.out, "");
    kt_check_text("nothing on standard error", ran.err, "");
}

KT_TEST(report_tells_what_was_done_and_where_it_is) {
    kt_write_file("f.yaml", falling);
    kt_ran ran = kt_shell("$K run f.yaml --summary f.json");
    kt_check_text("standard output", ran.out, "");
    kt_check_contains("name", ran.err, "falling block: 1 s simulated\n");
    kt_check_contains("size and method", ran.err, "1 body, 1 degree of freedom, rk4 with steps of 0.125 s\n");
    kt_check_contains("cost", ran.err, "8 steps, ");
    kt_check_contains("drift", ran.err, "drift at most ");
    kt_check_contains("records", ran.err, "5 records: f.csv\n");
    kt_check_contains("summary", ran.err, "summary: f.json\n");
    kt_check_true("no bar where there is no terminal", strchr(ran.err, '\r') == NULL);
}

/* A change of the energy is an error only if nothing gives or takes any energy. */
KT_TEST(energy_that_is_given_or_taken_is_no_drift) {
    static const struct {
        const char *word, *more;
    } scenes[] = {
        {"drift",
         "effects: [{type: spring, between: [world, a], stiffness: 3}, {type: attraction, between: [world, a], "
         "strength: 1}, {type: joint_limit, joint: a, upper: 2, stiffness: 4}, {type: bushing, between: [world, "
         "a], stiffness: [1, 1, 1, 1, 1, 1]}]"},
        {"change", "effects: [{type: spring, between: [world, a], stiffness: 3, damping: 1}]"},
        {"change", "effects: [{type: bushing, between: [world, a], damping: [0, 0, 0, 0, 0, 1]}]"},
        {"change", "effects: [{type: motor, joint: a, force: 1}]"},
        {"change", "effects: [{type: drag, on: a, linear: 1}]"},
        {"drift", "loops: [{name: l, type: motion, joint: a, position: 1}]"},
        {"change", "loops: [{name: l, type: motion, joint: a, position: {polynomial: [1, 1]}}]"},
    };
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        char text[1024], words[64];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, position: 1}, mass: 1}]\n"
                 "simulate: {duration: 0.1}\n%s\n",
                 scenes[i].more);
        kt_write_file("e.yaml", text);
        snprintf(words, sizeof words, "%s at most ", scenes[i].word);
        kt_check_contains(scenes[i].more, kt_shell("$K run e.yaml --out /dev/null").err, words);
    }
}

/* ---- evaluate ---------------------------------------------------------------------------------------------------- */

/* Two slender rods of m = 3 kg, l = 2 m in line along x: with relative angles
 *   M = [m l^2 (1/3 + 1/12 + 9/4)  m l^2 (1/12 + 3/4); .  m l^2 / 3],   h = m g l (1/2 + 3/2, 1/2). */
static const char rods[] = "kinetree: 1\n"
                           "gravity: [0, -10, 0]\n"
                           "bodies:\n"
                           "  - {name: a, joint: {type: revolute}, mass: 3, shape: {type: rod, to: [2, 0, 0]}}\n"
                           "  - {name: b, parent: a, joint: {type: revolute, at: [2, 0, 0]}, mass: 3,\n"
                           "     shape: {type: rod, to: [2, 0, 0]}}\n";

KT_TEST(evaluate_prints_the_equations_of_motion) {
    kt_write_file("r.yaml", rods);
    kt_ran ran = kt_shell("$K evaluate r.yaml --acceleration=1,-2");
    kt_check_equal_int("exit code", ran.code, 0);
    json_t *root = kt_json(ran.out);
    const double m11 = 12.0 * (1.0 / 3.0 + 1.0 / 12.0 + 9.0 / 4.0), m12 = 12.0 * (1.0 / 12.0 + 3.0 / 4.0), m22 = 4.0;
    const double h1 = 120.0, h2 = 30.0, det = m11 * m22 - m12 * m12, eps = DBL_EPSILON;
    kt_check_text("coordinates", json_string_value(kt_json_find(root, "coordinates[1]")), "b");
    kt_check_near("M 11", kt_json_at(root, "mass_matrix[0][0]"), m11, 4.0 * eps * m11);
    kt_check_near("M 12", kt_json_at(root, "mass_matrix[0][1]"), m12, 4.0 * eps * m11);
    kt_check_near("M 21", kt_json_at(root, "mass_matrix[1][0]"), m12, 4.0 * eps * m11);
    kt_check_near("M 22", kt_json_at(root, "mass_matrix[1][1]"), m22, 4.0 * eps * m22);
    kt_check_near("h 1", kt_json_at(root, "bias[0]"), h1, 4.0 * eps * h1);
    kt_check_near("h 2", kt_json_at(root, "bias[1]"), h2, 4.0 * eps * h2);
    /* a = -M^-1 h; the condition of M is below 40. */
    kt_check_near("a 1", kt_json_at(root, "acceleration[0]"), -(m22 * h1 - m12 * h2) / det, 160.0 * eps);
    kt_check_near("a 2", kt_json_at(root, "acceleration[1]"), -(m11 * h2 - m12 * h1) / det, 160.0 * eps);
    kt_check_near("tau 1", kt_json_at(root, "inverse_dynamics[0]"), m11 - 2.0 * m12 + h1, 8.0 * eps * h1);
    kt_check_near("tau 2", kt_json_at(root, "inverse_dynamics[1]"), m12 - 2.0 * m22 + h2, 8.0 * eps * h2);
    kt_check_near("energy", kt_json_at(root, "energy.total"), 0.0, 0.0);
    kt_check_near("x of b", kt_json_at(root, "pose.b.position[0]"), 2.0, 0.0);
    kt_check_near("orientation", kt_json_at(root, "pose.b.quaternion[0]"), 1.0, 0.0);
    kt_check_near("rotation", kt_json_at(root, "pose.b.rotation[2][2]"), 1.0, 0.0);
    kt_check_near("equations", kt_json_at(root, "constraint.equations"), 0.0, 0.0);
    json_decref(root);
    ran = kt_shell("$K evaluate r.yaml");
    root = kt_json(ran.out);
    kt_check_true("inverse dynamics only where asked", kt_json_find(root, "inverse_dynamics") == NULL);
    json_decref(root);
}

KT_TEST(evaluate_names_coordinates_of_joints_with_several) {
    kt_write_file("b.yaml", ball);
    kt_ran ran = kt_shell("$K evaluate b.yaml");
    json_t *root = kt_json(ran.out);
    kt_check_equal_int("coordinates", (long long)json_array_size(kt_json_find(root, "coordinates")), 4);
    kt_check_text("first", json_string_value(kt_json_find(root, "coordinates[0]")), "arm");
    kt_check_text("last", json_string_value(kt_json_find(root, "coordinates[3]")), "ball[2]");
    json_decref(root);
}

/* ---- the balance ------------------------------------------------------------------------------------------------- */

/* A block of 2 kg on a level slide moves under 6 N, with a damper of 1 N s/m:
 *     v = 6 (1 - e^(-t / 2)). */
static const char dragged[] = "kinetree: 1\n"
                              "bodies:\n"
                              "  - {name: block, joint: {type: prismatic, axis: x}, mass: 2}\n"
                              "effects:\n"
                              "  - {type: motor, joint: block, force: 6}\n"
                              "  - {type: joint_damper, joint: block, damping: 1}\n"
                              "simulate: {duration: 2, integrator: dop853, tolerance: 1e-12}\n"
                              "output: {interval: 0.5, record: [position, velocity, balance]}\n";

KT_TEST(balance_is_recorded_and_summed_up) {
    kt_write_file("d.yaml", dragged);
    kt_ran ran = kt_shell("$K run d.yaml --quiet --out d.csv --summary - && cat d.csv >&2");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_true("header",
                  strncmp(ran.err,
                          "time,position.block,velocity.block,energy.dissipated,energy.supplied,energy.balance\n",
                          strcspn(ran.err, "\n") + 1) == 0);
    json_t *root = kt_json(ran.out);
    const double end = exp(-1.0), x = 12.0 - 12.0 * (1.0 - end); /* at t = 2 */
    const double kinetic = 36.0 * (1.0 - end) * (1.0 - end);
    kt_check_near("supplied", kt_json_at(root, "balance.supplied"), 6.0 * x, 2e-11);
    kt_check_near("dissipated", kt_json_at(root, "balance.dissipated"), 6.0 * x - kinetic, 2e-11);
    kt_check_below("drift", kt_json_at(root, "balance.drift"), 2e-11);
    const int supplied = kt_csv_column(ran.err, "energy.supplied"), v = kt_csv_column(ran.err, "velocity.block");
    const int balance = kt_csv_column(ran.err, "energy.balance"), position = kt_csv_column(ran.err, "position.block");
    /* Steps that are long for the works have them from the dense output: to the tolerance of a step, 1e-12 (1 + W). */
    for (int line = 1; line <= 5; line++) {
        kt_check_near("6 N along the way", kt_csv_number(ran.err, line, supplied),
                      6.0 * kt_csv_number(ran.err, line, position), 2e-11);
        kt_check_near("balance", kt_csv_number(ran.err, line, balance), 0.0, 2e-11);
        kt_check_near("velocity", kt_csv_number(ran.err, line, v), 6.0 * (1.0 - exp(-0.25 * (line - 1))), 2e-12);
    }
    json_decref(root);
    ran = kt_shell("$K run d.yaml --quiet --out /dev/null --summary - --record energy");
    root = kt_json(ran.out);
    kt_check_true("no balance where none is asked for", kt_json_find(root, "balance") == NULL);
    json_decref(root);
    ran = kt_shell("$K run d.yaml --out /dev/null");
    kt_check_contains("report", ran.err, "the balance closes to");
}

/* The spectral radius at infinity is an option of two-step alone, and the summary has it. */
KT_TEST(rho_is_told_and_rejected_where_it_is_not_read) {
    kt_ran ran = kt_shell("$K run " KT_SCENES "/pendulum.yaml --integrator two-step --rho 0.25 --step 0.01 "
                          "--duration 0.1 --out /dev/null --quiet --summary -");
    kt_check_equal_int("exit code", ran.code, 0);
    json_t *root = kt_json(ran.out);
    kt_check_near("rho", kt_json_at(root, "method.rho"), 0.25, 0.0);
    json_decref(root);
    ran = kt_shell("$K run " KT_SCENES "/pendulum.yaml --integrator rk4 --rho 0.25 --step 0.01");
    kt_check_equal_int("of another", ran.code, 1);
    kt_check_contains("words", ran.err, "--rho is for --integrator two-step, and this is rk4");
    ran = kt_shell("$K run " KT_SCENES "/pendulum.yaml --integrator two-step --rho 1.25 --step 0.01");
    kt_check_equal_int("out of range", ran.code, 1);
    kt_check_contains("words", ran.err, "rho: 1.25: the spectral radius at infinity must be 0 to 1");
}

/* A body of inertia 3 about z spins with 2 rad/s. It moves with 1 m/s along x, and its tip is 0.5 m from the centre of
 * mass. All results have a closed form; the integration's tolerance is 1e-12. */
static const char spinning[] = "kinetree: 1\n"
                               "bodies:\n"
                               "  - name: top\n"
                               "    joint: {type: free, velocity: {linear: [1, 0, 0], angular: [0, 0, 2]}}\n"
                               "    mass: 2\n"
                               "    inertia: [1, 2, 3]\n"
                               "    markers: {tip: [0.5, 0, 0]}\n"
                               "simulate: {duration: 1, tolerance: 1e-12}\n"
                               "output: {interval: 1e-3, markers: [top.tip],\n"
                               "         record: [momentum, orientation, marker velocity, marker acceleration]}\n";

static void check_column(const char *csv, const char *name, double expected) {
    const int column = kt_csv_column(csv, name);
    kt_check_near(name, column < 0 ? (double)NAN : kt_csv_number(csv, 501, column), expected, 1e-10);
}

KT_TEST(motion_of_markers_momentum_and_orientation_are_recorded) {
    kt_write_file("s.yaml", spinning);
    const kt_ran ran = kt_shell("$K run s.yaml --quiet --out -");
    const double t = 0.5, c = cos(2.0 * t), s = sin(2.0 * t);
    check_column(ran.out, "time", t);
    check_column(ran.out, "marker.top.tip.x", t + 0.5 * c);
    check_column(ran.out, "marker.top.tip.vx", 1.0 - s);
    check_column(ran.out, "marker.top.tip.vy", c);
    check_column(ran.out, "marker.top.tip.ax", -2.0 * c);
    check_column(ran.out, "marker.top.tip.ay", -2.0 * s);
    check_column(ran.out, "orientation.top.w", cos(t));
    check_column(ran.out, "orientation.top.z", sin(t));
    check_column(ran.out, "momentum.px", 2.0);
    check_column(ran.out, "momentum.py", 0.0);
    check_column(ran.out, "momentum.lz", 6.0);
}

/* The mean of cos^2 over [0, 1] is 1/2 + sin(4)/8. The error of the trapezoidal rule is h^2 / 12 times the change of
 * its slope, 2 sin(4). This is 2e-7. The least 1 - sin(2 t) is that of the record nearest to pi/4. Its time is off by
 * 0.4 ms, which gives 4e-7. */
KT_TEST(summary_has_extremes_and_means_of_all_columns) {
    kt_write_file("s.yaml", spinning);
    json_t *root = kt_json(kt_shell("$K run s.yaml --quiet --out /dev/null --summary -").out);
    kt_check_near("rms", kt_json_at(root, "columns/marker.top.tip.vy/rms"), sqrt(0.5 + sin(4.0) / 8.0), 2e-7);
    kt_check_near("least", kt_json_at(root, "columns/marker.top.tip.vx/min"), 0.0, 4e-7);
    kt_check_near("its time", kt_json_at(root, "columns/marker.top.tip.vx/min_time"), 0.785, 1e-12);
    kt_check_near("greatest", kt_json_at(root, "columns/marker.top.tip.vx/max"), 1.0, 1e-12);
    kt_check_near("its time", kt_json_at(root, "columns/marker.top.tip.vx/max_time"), 0.0, 0.0);
    kt_check_near("end", kt_json_at(root, "columns/marker.top.tip.vy/end"), cos(2.0), 2e-12);
    kt_check_near("constant", kt_json_at(root, "columns/momentum.lz/rms"), 6.0, 2e-12);
    json_decref(root);
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* A mass of 2 kg moves on a spring of 8 N/m with x = cos 2 t. It is 3 m from the spring's end when the spring is slack.
 * A motor of sin(2 pi t) N m at an inertia of 0.5 kg m^2 gives the velocity
 *     (1 - cos(2 pi t)) / pi. */
static const char driven[] = "kinetree: 1\n"
                             "bodies:\n"
                             "  - {name: block, joint: {type: prismatic, axis: x, position: 1}, mass: 2}\n"
                             "  - {name: rotor, joint: {type: revolute}, mass: 1, inertia: [0.5, 0.5, 0.5]}\n"
                             "effects:\n"
                             "  - {name: strut, type: spring, between: [{body: world, at: [-3, 0, 0]}, block],\n"
                             "     stiffness: 8, length: 3}\n"
                             "  - {type: motor, joint: rotor, torque: {sine: {amplitude: 1, frequency: 1}}}\n"
                             "simulate: {duration: 1, integrator: dop853, tolerance: 1e-12}\n"
                             "output: {interval: 0.0625, record: [effect]}\n";

KT_TEST(effects_are_recorded_with_units_in_the_header) {
    const double pi = 3.14159265358979323846;
    kt_write_file("driven.yaml", driven);
    const char *csv = kt_shell("$K run driven.yaml --quiet --out -").out;
    kt_check_contains("header", csv,
                      "time,effect.strut.force [N],effect.strut.power [W],effect.strut.length [m],effect.strut.rate "
                      "[m/s],effect[1].torque [N m],effect[1].power [W],effect[1].position [rad],effect[1].rate "
                      "[rad/s]\n");
    KT_WORST worst = kt_worst_make("columns");
    for (int line = 1; line < kt_count_lines(csv); line++) {
        const double t = kt_csv_number(csv, line, 0), x = cos(2.0 * t), v = -2.0 * sin(2.0 * t);
        const double torque = sin(2.0 * pi * t), speed = (1.0 - cos(2.0 * pi * t)) / pi;
        const double expected[] = {8.0 * x, -8.0 * x * v, 3.0 + x, v, torque, torque * speed};
        for (int k = 0; k < 6; k++)
            kt_worst_near(&worst, kt_csv_number(csv, line, k + 1), expected[k], 2e-10, "t = %g, column %d", t, k + 1);
    }
}

/* A bead that is pushed along a circle of 0.5 m at 0.3 m/s: d in the circle's frame, and the way along it. */
KT_TEST(closures_are_recorded_as_relative_coordinates) {
    kt_write_file(
        "wire.yaml",
        "kinetree: 1\n"
        "bodies:\n"
        "  - {name: bead, joint: {type: free, position: {position: [0, 0.5, 0]}}, mass: 1, inertia: [1, 1, 1]}\n"
        "loops:\n"
        "  - {name: wire, type: curve, between: [world, bead], axis: x, curve: {circle: {radius: 0.5}},\n"
        "     distance: {polynomial: [0, 0.3]}}\n"
        "simulate: {duration: 1, integrator: dop853, tolerance: 1e-12}\n"
        "output: {interval: 0.0625, record: [closure]}\n");
    const char *csv = kt_shell("$K run wire.yaml --quiet --out -").out;
    kt_check_contains(
        "header", csv,
        "time,closure.wire.x,closure.wire.y,closure.wire.z,closure.wire.rx,closure.wire.ry,closure.wire.rz,"
        "closure.wire.arc\n");
    KT_WORST worst = kt_worst_make("columns");
    for (int line = 1; line < kt_count_lines(csv); line++) {
        const double arc = 0.3 * kt_csv_number(csv, line, 0), angle = arc / 0.5;
        const double expected[] = {0.5 * cos(angle), 0.5 * sin(angle), 0.0, 0.0, 0.0, 0.0, arc};
        for (int k = 0; k < 7; k++)
            kt_worst_near(&worst, kt_csv_number(csv, line, k + 1), expected[k], 2e-15, "line %d, column %d", line,
                          k + 1);
    }
}

KT_TEST(summary_has_the_extremes_of_effects) {
    kt_write_file("driven.yaml", driven);
    json_t *root = kt_json(kt_shell("$K run driven.yaml --quiet --out /dev/null --summary -").out);
    kt_check_near("least length", kt_json_at(root, "columns/effect.strut.length/min"), 3.0 + cos(2.0), 1e-13);
    kt_check_near("its time", kt_json_at(root, "columns/effect.strut.length/min_time"), 1.0, 1e-12);
    kt_check_near("largest force", kt_json_at(root, "columns/effect.strut.force/max"), 8.0, 1e-9);
    kt_check_near("force at the end", kt_json_at(root, "columns/effect.strut.force/end"), 8.0 * cos(2.0), 5e-13);
    kt_check_text("unit", json_string_value(kt_json_find(root, "columns/effect.strut.power/unit")), "W");
    json_decref(root);
    kt_check_contains("help", kt_shell("$K help spring").out, "along the line of the ends");
    root = kt_json(kt_shell("$K run driven.yaml --record position --quiet --out /dev/null --summary -").out);
    kt_check_true("nothing of effects where it is not asked",
                  kt_json_find(root, "columns/effect.strut.force/max") == NULL);
    json_decref(root);
}
