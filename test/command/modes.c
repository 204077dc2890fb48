/* modes and equilibrium. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A cart with a motor and a point-mass pendulum, which starts on its side. */
static const char cart[] = "kinetree: 1\n"
                           "name: cart\n"
                           "gravity: [0, -9.81, 0]\n"
                           "bodies:\n"
                           "  - {name: cart, joint: {type: prismatic, axis: x, position: 0.5}, mass: 2}\n"
                           "  - name: bob\n"
                           "    parent: cart\n"
                           "    joint: {type: revolute, axis: z, position: 90 deg}\n"
                           "    mass: 0.3\n"
                           "    com: [0, -0.6, 0]\n"
                           "    markers: {tip: [0, -0.6, 0]}\n"
                           "effects:\n"
                           "  - {type: motor, joint: cart, torque: 0}\n";

KT_TEST(modes_prints_frequencies_and_what_moves) {
    kt_write_file("cart.yaml", cart);
    kt_ran ran = kt_shell("$K modes cart.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_text("no words", ran.err, "");
    kt_check_contains("about", ran.out, "cart: linearised about its equilibrium, 4 states\n");
    /* sqrt((1 + 0.3 / 2) 9.81 / 0.6) / (2 pi) = 0.690125 */
    kt_check_contains("mode", ran.out, "   1      0.690125             0     0.0000  bob, cart 0.1");
    kt_check_contains("neutral", ran.out, "2 eigenvalues are zero: neither stiffness nor damping acts on cart\n");
    ran = kt_shell("$K make pendulum --links 5 | $K modes - --count 2");
    kt_check_contains("the rest is counted", ran.out, "\n3 more, faster\n");
}

/* A cantilever of 60 segments: 1.8751^2 / (2 pi L^2) sqrt(EI / mu) = 2.08879 Hz, less 0.958 / 60^2. */
KT_TEST(modes_of_a_fine_beam_begin_with_its_lowest_frequency) {
    kt_write_file("beam.yaml", "kinetree: 1\n"
                               "gravity: [0, 0, 0]\n"
                               "beams: [{name: beam, segments: 60, length: 2, mass_per_length: 3.925, EI: 875}]\n");
    kt_ran ran = kt_shell("$K modes beam.yaml --count 2");
    kt_check_contains("mode", ran.out, "   1       2.08853             0     0.0000  beam-2, ");
    kt_check_contains("all", ran.out, "\n58 more, faster\n");
    ran = kt_shell("$K equilibrium beam.yaml --json");
    kt_check_contains("no eigenvalue is lost", ran.out, "\"stability\": \"stable, undamped\"");
}

/* A stop that just touches: the stiffness is 100 or 1e6 N/m. */
KT_TEST(modes_lists_what_cannot_be_distinguished_from_zero) {
    kt_write_file("touch.yaml", "kinetree: 1\n"
                                "gravity: [0, 0, 0]\n"
                                "bodies:\n"
                                "  - {name: a, joint: {type: prismatic, axis: x}, mass: 1}\n"
                                "  - {name: b, joint: {type: prismatic, axis: x}, mass: 1}\n"
                                "effects:\n"
                                "  - {type: joint_spring, joint: a, stiffness: 100}\n"
                                "  - {type: joint_limit, joint: a, lower: 0, stiffness: 1e6}\n"
                                "  - {type: joint_spring, joint: b, stiffness: 1e6}\n");
    kt_ran ran = kt_shell("$K modes touch.yaml");
    kt_check_contains("warning", ran.err, "a stop that just touches");
    kt_check_contains("row", ran.out, "\n   ?       112.551             0     0.0000  a\n   1       159.155  ");
    kt_check_contains("below", ran.out, "\n2 eigenvalues (? in the table) cannot be distinguished from zero (");
}

/* 200 floating links: each coordinate is neutral, and six are named. */
KT_TEST(modes_names_few_and_counts_the_rest) {

    kt_ran ran = kt_shell("(echo 'kinetree: 1'; echo 'bodies:'; for i in $(seq 40); do echo \"  - {name: b$i, mass: 1, "
                          "joint: {type: prismatic}}\"; done) >float.yaml; $K modes float.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("few names", ran.out,
                      "80 eigenvalues are zero: neither stiffness nor damping acts on b1, b2, b3, b4, b5, b6 and 34 "
                      "more\n");
}

KT_TEST(modes_tells_which_state_it_is_about) {
    kt_write_file("cart.yaml", cart);
    kt_ran ran = kt_shell("$K modes cart.yaml --at initial");
    kt_check_contains("initial", ran.out, "about its initial position, 4 states\n");
    kt_check_contains("warning", ran.err, "is not an equilibrium");
    ran = kt_shell("sed 's/90 deg/170 deg/' cart.yaml | $K modes - --nearest");
    kt_check_contains("upright", ran.out, "-       4.33618  "); /* sqrt(1.15 9.81 / 0.6) */
    ran = kt_shell("sed 's/position: 90 deg/velocity: 3/' cart.yaml | $K modes -");
    kt_check_contains("motion", ran.out, "about its motion, 4 states\n");
    kt_check_contains("warning", ran.err, "the initial state is part of a motion that changes");
    ran = kt_shell("sed 's/position: 90 deg/velocity: 3/' cart.yaml | $K modes - --at equilibrium");
    kt_check_contains("equilibrium", ran.out, "   1      0.690125  ");
    ran = kt_shell("sed 's/position: 0.5/velocity: 0.5/; s/position: 90 deg/position: 0/' cart.yaml | $K modes -");
    kt_check_contains("steady motion", ran.out, "about its steady motion, 4 states\n");
    kt_check_text("which is fine", ran.err, "");
    kt_expect(1, "--nearest linearises about an equilibrium", "$K modes cart.yaml --nearest --at initial");
}

/* An upright wheel rolls straight ahead. It is stable if v^2 > g R / 3. The coordinates of its free joint turn with it
 * about a horizontal axis. A yaw, a lean and a spin do not. Their frequency is that of a thin disc, with the square 12
 * (v / R)^2 / 5 - 4 g / (5 R). */
KT_TEST(modes_calls_a_motion_steady_only_if_its_matrix_is_constant) {
    static const char wheel[] = "mass: 2, com: [0, 0, 0], inertia: [0.045, 0.09, 0.045]}]\n"
                                "loops: [{name: road, type: rolling, wheel: wheel, axis: y, radius: 0.3, on: world}]\n";
    static const char *const joints[] = {
        "bodies: [{name: wheel, joint: {type: free, position: {position: [0, 0, 0.3]}, velocity: {linear: [1.2, 0, 0], "
        "angular: [0, 4, 0]}}, ",
        "bodies: [{name: yaw, joint: {type: planar, axis: z, velocity: [1.2, 0, 0]}}, {name: lean, parent: yaw, joint: "
        "{type: revolute, axis: x}}, {name: drop, parent: lean, joint: {type: prismatic, axis: z, at: [0, 0, 0.3]}}, "
        "{name: wheel, parent: drop, joint: {type: revolute, axis: y, velocity: 4}, "};
    char scene[1200];
    (void)snprintf(scene, sizeof scene, "kinetree: 1\ngravity: [0, 0, -9.81]\n%s%s", joints[0], wheel);
    kt_write_file("wheel.yaml", scene);
    kt_ran ran = kt_shell("$K modes wheel.yaml");
    kt_check_contains("free", ran.out, "wheel: linearised about its motion, 8 states\n");
    kt_check_contains("note", ran.err, "its state matrix changes along it");
    kt_check_contains("remedy", ran.err, "--period S");
    ran = kt_shell("$K view wheel.yaml --modes; $K view wheel.yaml --modes");
    kt_check_contains("view", ran.err, "its state matrix changes along it");
    kt_check_contains("its page", ran.err, "\nview: wheel.html\n");
    kt_check_contains("the older page", ran.err, "  replaces an older wheel.html of 20");
    (void)snprintf(scene, sizeof scene, "kinetree: 1\ngravity: [0, 0, -9.81]\n%s%s", joints[1], wheel);
    kt_write_file("wheel.yaml", scene);
    ran = kt_shell("$K modes wheel.yaml");
    kt_check_contains("tree", ran.out, "wheel: linearised about its steady motion, 8 states\n");
    kt_check_contains("frequency", ran.out, "   1      0.556815             0     0.0000  ");
    kt_check_text("without a note", ran.err, "");
    static const char shaft[] =
        "kinetree: 1\ngravity: [0, 0, 0]\n"
        "bodies: [{name: r, joint: {type: free, velocity: {angular: [20, 0, 0]}}, mass: 1, inertia: [0.02, 0.01, "
        "0.012]}]\n"
        "effects: [{type: bushing, between: [world, r], stiffness: [100, 200, 300, 0, %s]}]\n";
    (void)snprintf(scene, sizeof scene, shaft, "0, 0");
    kt_write_file("shaft.yaml", scene);
    ran = kt_shell("$K modes shaft.yaml");
    kt_check_contains("free rotations", ran.out, "about its steady motion");
    (void)snprintf(scene, sizeof scene, shaft, "2, 6");
    kt_write_file("shaft.yaml", scene);
    ran = kt_shell("$K modes shaft.yaml");
    kt_check_contains("supports that do not turn", ran.out, "about its motion");
}

/* With m / M = 0.15: x'' = u / 2 + ..., theta'' = -(u / 2) / 0.6 about hanging. */
KT_TEST(modes_gives_matrices_with_names_as_json) {
    kt_write_file("cart.yaml", cart);
    kt_ran ran = kt_shell("$K modes cart.yaml --json");
    json_t *root = kt_json(ran.out);
    static const char *const states[] = {"position.cart", "position.bob", "velocity.cart", "velocity.bob"};
    const json_t *names = kt_json_find(root, "states"), *outputs = kt_json_find(root, "outputs");
    for (size_t i = 0; i < 4; i++)
        kt_check_text("state", json_string_value(json_array_get(names, i)), states[i]);
    kt_check_text("input", json_string_value(json_array_get(kt_json_find(root, "inputs"), 0)), "motor.cart");
    kt_check_equal_int("outputs", (long long)json_array_size(outputs), 6);
    kt_check_text("output", json_string_value(json_array_get(outputs, 3)), "marker.bob.tip.vx");
    kt_check_text("about", json_string_value(kt_json_find(root, "about")), "equilibrium");
    kt_check_near("A", kt_json_at(root, "state_matrix[3][1]"), -1.15 * 9.81 / 0.6, 1e-13);
    kt_check_near("B", kt_json_at(root, "input_matrix[3][0]"), -1.0 / (2.0 * 0.6), 1e-15);
    kt_check_near("C", kt_json_at(root, "output_matrix[0][1]"), 0.6, 1e-15);
    kt_check_near("C", kt_json_at(root, "output_matrix[3][3]"), 0.6, 1e-15);
    const json_t *modes = kt_json_find(root, "modes");
    kt_check_equal_int("modes", (long long)json_array_size(modes), 3);
    kt_check_near("omega", kt_json_at(root, "modes[2].imaginary"), sqrt(1.15 * 9.81 / 0.6), 1e-14);
    kt_check_near("cart against bob", kt_json_at(root, "modes[2].position.cart[0][0]"), -0.6 * 0.15 / 1.15, 1e-14);
    json_decref(root);
}

KT_TEST(scene_without_a_name_goes_by_its_file) {
    kt_write_file("cart.yaml", cart);
    kt_expect(0, NULL, "grep -v '^name' cart.yaml >nameless.yaml");
    kt_ran ran = kt_shell("$K modes nameless.yaml");
    kt_check_contains("table", ran.out, "nameless: linearised about its equilibrium, 4 states\n");
    static const char *const commands[] = {"modes", "equilibrium"};
    for (int i = 0; i < 2; i++) {
        ran = kt_shell("$K %s nameless.yaml --json 2>/dev/null", commands[i]);
        json_t *root = kt_json(ran.out);
        kt_check_text(commands[i], json_string_value(kt_json_find(root, "scene")), "nameless");
        json_decref(root);
    }
#ifdef KT_WITH_CAIRO
    kt_expect(0, NULL, "$K modes nameless.yaml --plot s.svg >/dev/null && $K modes cart.yaml --plot t.svg >/dev/null");
    kt_expect(0, NULL, "test $(wc -c <s.svg) -ge $(wc -c <t.svg)"); /* with a title, which is longer */
#endif
}

#ifdef KT_WITH_CAIRO
KT_TEST(modes_draws_shapes) {
    kt_write_file("cart.yaml", cart);
    kt_ran ran = kt_shell("$K modes cart.yaml --plot s.svg >/dev/null && grep -c '<rect\\|<path\\|<text' s.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_above("parts of the picture", (int)strtol(ran.out, NULL, 10), 10.0);
    ran = kt_shell("$K modes cart.yaml --plot s.png --dark >/dev/null && head -c 4 s.png | tail -c 3");
    kt_check_text("picture", ran.out, "PNG");
    kt_expect(1, "a picture's name ends in .svg, .png or .pdf", "$K modes cart.yaml --plot s.jpg");
    kt_expect(4, "cannot be written", "$K modes cart.yaml --plot /nowhere/s.svg");
}

/* An arm that droops by 0.1 rad at rest. Two of its modes lift the middle of its first link above the pivot. Each panel
 * has a grey triangle from the pivot to the ground: all of them point to one side. */
KT_TEST(mounts_of_all_modes_are_on_one_side) {
    kt_write_file("arm.yaml",
                  "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                  "  - {name: a, joint: {type: revolute, axis: y}, mass: 3, shape: {type: rod, to: [0.5, 0, 0]}}\n"
                  "  - {name: b, parent: a, joint: {type: revolute, axis: y, at: [0.5, 0, 0]}, mass: 2,\n"
                  "     shape: {type: rod, to: [0.4, 0, 0]}}\n"
                  "effects:\n"
                  "  - {type: joint_spring, joint: a, stiffness: 200, damping: 20}\n"
                  "  - {type: joint_spring, joint: b, stiffness: 200, rest: -0.8, damping: 20}\n");
    kt_expect(0, NULL, "$K modes arm.yaml --plot arm.svg >/dev/null");
    static const char *const heads[] = {"fill:#e0e0e0;stroke-linejoin:round;stroke:#6b6b6b;\" d=\"M ",
                                        "fill=\"#e0e0e0\" stroke-linejoin=\"round\" stroke=\"#6b6b6b\" d=\"M "};
    const char *svg = kt_read_file("arm.svg"), *head = heads[strstr(svg, heads[0]) == NULL]; /* cairo 1.16; 1.18 */
    int above = 0, below = 0;
    for (const char *at = strstr(svg, head); at != NULL; at = strstr(at + 1, head)) {
        double y[2] = {0.0, 0.0};
        kt_check_equal_int("numbers", sscanf(at + strlen(head), "%*f %lf L %*f %lf", &y[0], &y[1]), 2);
        above += y[1] < y[0];
        below += y[1] > y[0];
    }
    kt_check_equal_int("above", above, 3);
    kt_check_equal_int("below", below, 0);
}
#endif

/* Quantities that count from the initial positions must not count from the equilibrium: a spring without a length, the
 * angle of a screw. */
KT_TEST(equilibrium_writes_a_scene_that_rests) {
    kt_write_file("hung.yaml",
                  "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                  "  - name: nut\n"
                  "    joint: {type: cylindrical, axis: z, position: [0.3, 0]}\n"
                  "    mass: 2\n    com: [0.1, 0.05, 0]\n    inertia: [0.1, 0.1, 0.1]\n"
                  "    markers: {eye: [0.2, 0, 0.1]}\n"
                  "  - name: block\n    joint: {type: prismatic, axis: z, position: -1}\n    mass: 1\n"
                  "loops:\n"
                  "  - {name: thread, type: screw, pitch: 0.1, axis: -z,\n"
                  "     between: [{body: nut, at: [0, 0, 0], rotation: {rpy: [0, 0, 1]}}, world]}\n"
                  "effects:\n"
                  "  - {type: spring, between: [{body: world, at: [0.4, 0, 0.2]}, nut.eye], stiffness: 30}\n"
                  "  - {type: spring, between: [nut, block], stiffness: 20, damping: 1}\n");
    kt_ran ran = kt_shell("$K equilibrium hung.yaml --scene rest.yaml >/dev/null 2>&1 && $K evaluate rest.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    json_t *root = kt_json(ran.out);
    for (int i = 0; i < 3; i++) {
        char path[32];
        snprintf(path, sizeof path, "acceleration[%d]", i);
        kt_check_near(path, kt_json_at(root, path), 0.0, 2e-14); /* measured: 2e-15 */
    }
    json_decref(root);
    ran = kt_shell("$K equilibrium hung.yaml >a 2>/dev/null; $K equilibrium rest.yaml >b 2>/dev/null; cmp a b");
    kt_check_equal_int("found again", ran.code, 0);
}

KT_TEST(equilibrium_prints_and_writes_what_a_scene_can_hold) {
    kt_write_file("cart.yaml", cart);
    kt_ran ran = kt_shell("$K equilibrium cart.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("cart stays", ran.out, "cart: {position: 0.5}\n");
    kt_check_contains("words", ran.err, "a neutral equilibrium: 2 eigenvalues are zero");
    ran =
        kt_shell("$K equilibrium cart.yaml --scene rest.yaml >a 2>&1 && $K equilibrium rest.yaml >b 2>&1 && cmp a b && "
                 "$K evaluate rest.yaml");
    kt_check_equal_int("rests", ran.code, 0);
    json_t *root = kt_json(ran.out);
    kt_check_near("acceleration", kt_json_at(root, "acceleration[1]"), 0.0, 2e-14);
    kt_check_near("energy", kt_json_at(root, "energy.total"), -0.3 * 9.81 * 0.6, 1e-15);
    json_decref(root);
    ran = kt_shell("sed 's/90 deg/170 deg/' cart.yaml | $K equilibrium - --nearest --json");
    root = kt_json(ran.out);
    kt_check_text("unstable", json_string_value(kt_json_find(root, "stability")), "unstable");
    kt_check_near("growth", kt_json_at(root, "growth"), sqrt(1.15 * 9.81 / 0.6), 1e-13);
    kt_check_near("upright", kt_json_at(root, "position.bob"), acos(-1.0), 1e-15);
    json_decref(root);
}

KT_TEST(equilibrium_says_why_there_is_none) {
    kt_write_file("cart.yaml", cart);
    kt_expect(4, "joint 'cart': there is no equilibrium: this joint accelerates without bound",
              "sed 's/torque: 0/torque: 1/' cart.yaml | $K equilibrium -");
    kt_write_file("stone.yaml",
                  "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n  - {name: stone, joint: {type: free}, mass: 1, "
                  "inertia: [1, 1, 1]}\n");
    kt_expect(4, "joint 'stone': there is no equilibrium: this joint accelerates without bound, by 9.81 m/s^2",
              "$K equilibrium stone.yaml");
    kt_ran ran = kt_shell("sed 's/torque: 0/torque: 1/' cart.yaml | $K modes -");
    kt_check_equal_int("modes go on", ran.code, 0);
    kt_check_contains("about the initial state", ran.err, "these are the modes about the initial state instead");
    kt_expect(3, "loop 'drive': it drives the mechanism",
              "(cat cart.yaml; echo 'loops: [{name: drive, type: motion, joint: cart, position: {sine: {amplitude: 1, "
              "frequency: 1, offset: 0.5}}}]') | $K equilibrium -");
    kt_expect(4, "up to 2000", "$K make chain --links 2001 | $K modes -");
    const kt_ran announced =
        kt_shell("$K make chain --links 301 >large.yaml; $K modes large.yaml 2>said & until test -s said "
                 "|| ! kill -0 $!; do :; done; kill -KILL $!; wait $!; cat said");
    kt_check_contains("announced", announced.out, "small motions of 301 degrees of freedom take about 1 s");
}

KT_TEST(scene_without_freedoms_is_said_to_have_no_modes) {
    kt_write_file("n.yaml", "kinetree: 1\nbodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
                            "loops: [{name: stop, type: weld, between: [a, world]}]\nsimulate: {duration: 1}\n");
    kt_check_contains("modes", kt_shell("$K modes n.yaml").out, "There are no degrees of freedom, and so no modes.\n");
    kt_expect(4, "n.svg is not written: there is no mode to be drawn", "$K modes n.yaml --plot n.svg");
    kt_expect(4, "n.html is not written: there is no mode to be shown", "$K view n.yaml --modes --out n.html");
    kt_expect(1, "accuracy: the scene has no degrees of freedom: its loops alone determine the motion",
              "$K accuracy n.yaml --integrators rk4,dopri5 --budget 0.1 --out /dev/null --plot /dev/null");
    kt_check_contains("stability", kt_shell("$K stability n.yaml").out,
                      "there are no degrees of freedom: loops alone determine the motion, and any step is stable\n");
}

/* Baumgarte's gains 7 and 9 add -7 +- 5.657i to the pendulum's +- 3.132i. Force projection adds zeros. */
KT_TEST(modes_of_a_formulation_show_what_it_adds) {
    const kt_ran ran =
        kt_shell("$K modes " KT_SCENES "/point-pendulum.yaml --formulation baumgarte --alpha 7 --beta 9");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("the pendulum's", ran.out, "0      +- 3.13209  the mechanism's\n");
    kt_check_contains("Baumgarte's", ran.out, "-7      +- 5.65685  added by the formulation\n");
    kt_check_contains("projection", kt_shell("$K modes " KT_SCENES "/point-pendulum.yaml --formulation projection").out,
                      "0               0  added by the formulation\n");
    kt_check_contains("gains alone", kt_shell("$K modes " KT_SCENES "/pendulum.yaml --alpha 7").err,
                      "--formulation baumgarte goes with them");
}

KT_TEST(modes_over_a_period_are_multipliers) {
    const kt_ran ran = kt_shell("$K modes " KT_SCENES "/ground-resonance.yaml --period 0.36959913571644626 --json");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("growth", ran.out, "\"growth\": 1.2029");
    kt_check_equal_int("said", (long long)strlen(ran.err), 0);
    kt_check_contains("another period", kt_shell("$K modes " KT_SCENES "/ground-resonance.yaml --period 0.3").err,
                      "the period is another one");
    kt_check_contains("with --at", kt_shell("$K modes " KT_SCENES "/pendulum.yaml --period 1 --at initial").err,
                      "--period starts at the initial state and prints a table; leave --at, --nearest,");
}

/* The names of planar joints follow the joint's own directions: the first two axes of the triad about the normal. */
KT_TEST(modes_names_planar_coordinates_by_their_directions) {
    static const struct {
        const char *axis, *first, *second;
    } cases[] = {
        {"z", "b x", "b y"},
        {"x", "b y", "b z"},
        {"y", "b z", "b x"},
        {"[0, 0, -1]", "b x", "b -y"},
        {"[-2, 0, 0]", "b y", "b -z"},
        {"[0, -1, 0]", "b z", "b -x"},
        {"[0, 1, 6e-17]", "b z", "b x"},
        {"[0.6, 0, 0.8]", "b [0.8, 0, -0.6]", "b y"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[600], expected[160];
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\n"
                       "gravity: [0, 0, 0]\n"
                       "bodies: [{name: b, joint: {type: planar, axis: %s}, mass: 1, shape: {type: box, size: [1, 1, "
                       "1]}}]\n"
                       "effects: [{type: joint_spring, joint: \"b[0]\", stiffness: 100}]\n",
                       cases[i].axis);
        kt_write_file("planar.yaml", text);
        const kt_ran ran = kt_shell("$K modes planar.yaml");
        (void)snprintf(expected, sizeof expected, "     0.0000  %s\n", cases[i].first);
        kt_check_contains(cases[i].axis, ran.out, expected);
        (void)snprintf(expected, sizeof expected, "acts on %s, b angle\n", cases[i].second);
        kt_check_contains("neutral", ran.out, expected);
    }
    kt_write_file("tip.yaml", "kinetree: 1\n"
                              "gravity: [0, 0, 0]\n"
                              "bodies: [{name: b, joint: {type: planar, axis: y}, mass: 1, inertia: [1, 1, 1]}]\n"
                              "effects: [{type: expression, joint: \"b[1]\", force: \"100*position.b[1]\"}]\n");
    kt_ran ran = kt_shell("$K equilibrium tip.yaml");
    kt_check_contains("equilibrium", ran.err, ", most in b x\n");
    ran = kt_shell("sed 's/100[*].*\"}/1e12\"}/' tip.yaml | $K run - --duration 1 --quiet --out tip.csv");
    kt_check_contains("a speed", ran.err, "the speed of joint 'b[1]' is ");
}

/* The six states of its place have the rate 0. Without gravity, the block drifts along x. */
KT_TEST(a_foothold_changes_no_verdict) {
    static const char scene[] =
        "kinetree: 1\n"
        "gravity: [0, 0, %s]\n"
        "bodies: [{name: a, joint: {type: %s}, mass: 1, com: [0, 0, -0.5], inertia: [0.1, 0.1, 0.1], "
        "markers: {tip: [0, 0, -1]}}]\n"
        "effects: [{type: joint_damper, joint: a, damping: %s}]\n"
        "loops: [{name: grab, type: spherical, between: [a.tip, {body: world, at: [0, 0, -1]}], switched: off}]\n"
        "events: [{name: low, when: t - 1, then: {engage_here: grab}}]\n";
    char text[800];
    (void)snprintf(text, sizeof text, scene, "-9.81", "revolute, axis: y, position: 0.5", "0.3");
    kt_write_file("grab.yaml", text);
    kt_ran ran = kt_shell("$K equilibrium grab.yaml");
    kt_check_contains("verdict", ran.err, "a stable equilibrium\n");
    kt_check_true("Newton's method finds it", strstr(ran.err, "Newton") == NULL);
    kt_check_contains("position", ran.out, "a: {position: ");
    kt_check_true("no states are printed", strstr(ran.out, "grab_x") == NULL);
    (void)snprintf(text, sizeof text, scene, "0", "prismatic, axis: x", "0");
    kt_write_file("grab.yaml", text);
    ran = kt_shell("$K modes grab.yaml");
    kt_check_contains("modes", ran.out, "2 eigenvalues are zero: neither stiffness nor damping acts on a\n");
}

/* A box on three elastic contacts slides and turns freely. Its equilibrium is that without the foothold. */
KT_TEST(equilibrium_holds_places_of_footholds) {
    static const char scene[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies: [{name: box, joint: {type: free, position: {position: [0.3, -0.2, 0.11]}}, mass: 3, shape: {type: "
        "box, "
        "size: [0.4, 0.3, 0.2]}, markers: {a: [0.2, 0.1, -0.1], b: [-0.2, 0.1, -0.1], c: [0, -0.1, -0.1]}}]\n"
        "effects:\n"
        "  - {type: contact, point: box.a, plane: world, stiffness: 1e4, dissipation: 0.1}\n"
        "  - {type: contact, point: box.b, plane: world, stiffness: 1e4, dissipation: 0.1}\n"
        "  - {type: contact, point: box.c, plane: world, stiffness: 1e4, dissipation: 0.1}\n"
        "%s";
    char text[1200];
    (void)snprintf(text, sizeof text, scene, "");
    kt_write_file("box.yaml", text);
    kt_expect(0, "a neutral equilibrium: 6 eigenvalues are zero", "$K equilibrium box.yaml > plain.txt");
    (void)snprintf(text, sizeof text, scene,
                   "loops: [{name: grab, type: spherical, between: [box.a, world], switched: off}]\n"
                   "events: [{name: low, when: t - 1, then: {engage_here: grab}}]\n");
    kt_write_file("box-grab.yaml", text);
    kt_expect(0, "a neutral equilibrium: 6 eigenvalues are zero", "$K equilibrium box-grab.yaml > held.txt");
    kt_expect(0, NULL, "grep -q quaternion plain.txt && diff plain.txt held.txt");
}

/* Fixed steps are compared with the modes, which places of footholds do not change. The period is 2 s. */
KT_TEST(fixed_steps_are_watched_besides_a_foothold) {
    static const char scene[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies: [{name: a, joint: {type: revolute, axis: y, position: 0.1}, mass: 1, com: [0, 0, -1], markers: {tip: "
        "[0, 0, -1]}}]\n"
        "loops: [{name: grab, type: spherical, between: [a.tip, world], switched: off}]\n"
        "events: [{name: low, when: t - 100, then: {engage_here: grab}}]\n"
        "simulate: {duration: 9, integrator: rk4, step: 0.01}\n";
    kt_write_file("steps.yaml", scene);
    kt_ran ran = kt_shell("$K run steps.yaml --out /dev/null");
    kt_check_true("no warning", strstr(ran.err, "warning") == NULL);
    ran = kt_shell("$K run steps.yaml --out /dev/null --step 0.3");
    kt_check_contains("warning", ran.err, "steps a period");
}

/* Its friction moves nothing at rest, so that the eigenvalue of the parameter is apart from those of the arm. */
KT_TEST(modes_calls_a_parameter_that_events_set_a_parameter) {
    kt_write_file("set.yaml",
                  "kinetree: 1\ngravity: [0, -9.81, 0]\nparameters: {A: 2}\nstates: {heat: {rate: 0*t}}\n"
                  "bodies: [{name: arm, joint: {type: revolute}, mass: 1, com: [0, -1, 0], inertia: [0, 0, 0]}]\n"
                  "effects: [{type: expression, joint: arm, force: \"-(A + heat)*velocity.arm\"}]\n"
                  "events: [{name: hit, when: position.arm - 1, then: {set: {A: 0.5*A}}}]\n");
    const kt_ran ran = kt_shell("$K modes set.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("words", ran.out, "neither stiffness nor damping acts on parameter A, state heat\n");
}
