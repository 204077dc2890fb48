/* Doubts about a scene: numbers that are possible, but that its author hardly means. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <stdio.h>
#include <string.h>

/* An event that holds from the start seems to lie beyond the motion. */
KT_TEST(events_that_hold_from_the_start_are_told) {
    static const struct {
        const char *when;
        bool holds;
    } cases[] = {{"\"position.block < 2\"", true},
                 {"\"marker.block.top.y < 3\"", true},
                 {"\"reaction.block.mx > -1\"", true},
                 {"\"position.block - 2\", direction: falling", true},
                 {"\"position.block - 2\", direction: rising", false},
                 {"\"position.block - 2\"", false},
                 {"\"position.block > 2\"", false}};
    static const char words[] = "event 'low' has not happened: its condition is true from the start, and an event is "
                                "the change to true: ";
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[400];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n"
                 "  - {name: block, joint: {type: prismatic, axis: y, position: 1, velocity: 1}, mass: 1,\n"
                 "     inertia: [1, 1, 1], markers: {top: [0, 0.5, 0]}}\n"
                 "events: [{name: low, when: %s, then: record}]\n"
                 "simulate: {duration: 0.5}\n",
                 cases[i].when);
        kt_write_file("e.yaml", text);
        const kt_ran ran = kt_shell("$K run e.yaml --out /dev/null --summary -");
        json_t *root = kt_json(ran.out);
        const char *code = json_string_value(kt_json_find(root, "warnings[0].code"));
        kt_check_text(cases[i].when, code != NULL ? code : "none", cases[i].holds ? "event_holds" : "none");
        kt_check_true(cases[i].when, (strstr(ran.err, words) != NULL) == cases[i].holds);
        json_decref(root);
    }
}

/* Four-bars, and a five-bar with an end out of reach. Both drives of a four-bar hold its one degree of freedom; each
 * drive of the five-bar has its own. */
KT_TEST(drives_of_one_degree_of_freedom_are_told_if_positions_cannot_close) {
    static const char four[] =
        "kinetree: 1\nbodies:\n"
        "  - {name: crank, joint: {type: revolute, position: 60 deg}, mass: 1, inertia: [1, 1, 1]}\n"
        "  - {name: coupler, parent: crank, joint: {type: revolute, at: [0.3, 0, 0]}, mass: 1,\n"
        "     inertia: [1, 1, 1], markers: {tip: [0.8, 0, 0]}}\n"
        "  - {name: rocker, joint: {type: revolute, at: [0.7, 0, 0], position: 90 deg}, mass: 1,\n"
        "     inertia: [1, 1, 1], markers: {tip: [0.7, 0, 0]}}\n"
        "loops:\n"
        "  - {name: close, type: revolute, between: [coupler.tip, rocker.tip]}\n"
        "  - {name: motor, type: motion, joint: crank, position: 60 deg}\n"
        "  - {name: brake, type: motion, joint: rocker, position: %s deg}\n";
    static const char words[] =
        "drives 'motor' and 'brake' determine the same degree of freedom; leave one of them out";
    char text[1200];
    for (int k = 0; k < 2; k++) {
        snprintf(text, sizeof text, four, k ? "90" : "110");
        kt_write_file("four.yaml", text);
        kt_expect(3, words, "$K check four.yaml");
    }
    kt_write_file("five.yaml",
                  "kinetree: 1\nbodies:\n"
                  "  - {name: a, joint: {type: revolute, position: 120 deg}, mass: 1, inertia: [1, 1, 1]}\n"
                  "  - {name: b, parent: a, joint: {type: revolute, at: [0.3, 0, 0]}, mass: 1, inertia: [1, 1, 1],\n"
                  "     markers: {tip: [0.5, 0, 0]}}\n"
                  "  - {name: c, joint: {type: revolute, at: [0.8, 0, 0], position: 60 deg}, mass: 1,\n"
                  "     inertia: [1, 1, 1]}\n"
                  "  - {name: d, parent: c, joint: {type: revolute, at: [0.3, 0, 0]}, mass: 1, inertia: [1, 1, 1],\n"
                  "     markers: {tip: [0.5, 0, 0]}}\n"
                  "loops:\n"
                  "  - {name: close, type: revolute, between: [b.tip, d.tip]}\n"
                  "  - {name: left, type: motion, joint: a, position: 180 deg}\n"
                  "  - {name: right, type: motion, joint: c, position: 0 deg}\n");
    const kt_ran ran = kt_shell("$K check five.yaml");
    kt_check_equal_int("it is out of reach", ran.code, 3);
    kt_check_true("its drives are told apart", strstr(ran.err, "determine the same degree") == NULL);
}

/* A rod in a loop turns about its own axis if both of its ends are balls. */
KT_TEST(slender_rods_in_loops_are_told_with_their_remedy) {
    static const char rod[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: crank, joint: {type: revolute, axis: z, velocity: 1}, mass: 1,\n"
        "     shape: {type: rod, to: [0.3, 0, 0]},\n"
        "     markers: {pin: [0.3, 0, 0]}}\n"
        "  - {name: rocker, joint: {type: revolute, axis: x, at: [1, 0, 0], position: 90 deg}, mass: 1,\n"
        "     inertia: [1, 1, 1], markers: {pin: [0, 0.5, 0]}}\n"
        "  - {name: link, %s, mass: 1, shape: {type: rod, from: [0, 0, 0], to: [%s, 0, 0]%s}}\n"
        "loops:\n%s"
        "  - {name: two, type: spherical, between: [{body: link, at: [%s, 0, 0]}, rocker.pin]}\n"
        "simulate: {duration: 0}\n";
    char text[1400];
    const char *const length = "0.860232526704263";
    for (int k = 0; k < 4; k++) {
        snprintf(text, sizeof text, rod,
                 k % 2 ? "joint: {type: free, position: {position: [0.3, 0, 0]}}"
                       : "parent: crank, joint: {type: spherical, at: [0.3, 0, 0]}",
                 length, k > 1 ? ", radius: 0.01" : "",
                 k % 2 ? "  - {name: one, type: spherical, between: [link, crank.pin]}\n" : "", length);
        kt_write_file("rod.yaml", text);
        const kt_ran ran = kt_shell("$K run rod.yaml --out /dev/null");
        kt_check_true(ran.err, (strstr(ran.err, "Give its shape a `radius`") != NULL) == (k < 2));
    }
}

/* Masses in grams, lengths in millimetres, an inertia of another body; and a solid of steel. */
KT_TEST(masses_and_inertias_beyond_the_shape_are_doubted_once) {
    static const char body[] = "kinetree: 1\nbodies:\n"
                               "  - {name: a, joint: {type: revolute}, mass: %s%s, shape: {type: box, size: [%s]}}\n"
                               "  - {name: b, joint: {type: revolute}, mass: %s%s, shape: {type: box, size: [%s]}}\n"
                               "simulate: {duration: 0}\n";
    static const struct {
        const char *mass, *inertia, *size, *words;
    } cases[] = {
        {"7.8", "", "0.1, 0.1, 0.1", NULL},
        {"7800", "", "0.1, 0.1, 0.1",
         "body 'a' has a mass of 7.8e+03 kg in 0.001 m^3: 7.8e+06 kg/m^3, beyond 0.1 to "
         "3e4 kg/m^3, and likewise 1 more. Compare the mass"},
        {"7.8", "", "100, 100, 100", "body 'a' has a mass of 7.8 kg in 1e+06 m^3: 7.8e-06 kg/m^3"},
        {"7.8", ", com: [0, 0, 0], inertia: [0.01, 0.01, 0.013]", "0.1, 0.1, 0.1", NULL},
        {"7.8", ", com: [0, 0, 0], inertia: [0.1, 0.1, 0.13]", "0.1, 0.1, 0.1",
         "the inertia of body 'a' has a radius of gyration of 0.145 m, and its shape ends 0.0866 m from the centre of "
         "mass, and likewise 1 more"},
        {"7.8", ", com: [0.5, 0, 0], inertia: [0.1, 0.1, 0.13]", "0.1, 0.1, 0.1", NULL}};
    char text[600];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *m = cases[i].mass, *j = cases[i].inertia, *s = cases[i].size;
        snprintf(text, sizeof text, body, m, j, s, m, j, s);
        kt_write_file("p.yaml", text);
        const kt_ran ran = kt_shell("$K check p.yaml");
        const char *first = strstr(ran.err, "body '");
        if (cases[i].words != NULL)
            kt_check_contains("words", ran.err, cases[i].words);
        else
            kt_check_true("no doubt", strstr(ran.err, "body 'a'") == NULL);
        kt_check_true("once", first == NULL || strstr(first + 1, "body '") == NULL);
        const kt_ran run = kt_shell("$K run p.yaml --out /dev/null");
        const char *words = strstr(run.err, "warning: body 'a' has a mass");
        kt_check_true("a run warns of ten times these bounds", (words != NULL) == (i == 1 || i == 2));
    }
}

/* 57.3 is no whole number, and far more turns than a joint has. A file may have it from an earlier run. */
KT_TEST(angles_above_50_rad_on_the_command_line_are_doubted) {
    kt_write_file("turns.yaml", "kinetree: 1\nparameters: {at: 0}\nbodies:\n"
                                "  - {name: a, joint: {type: revolute, position: =at}, mass: 1, inertia: [1, 1, 1]}\n"
                                "simulate: {duration: 0}\n");
    static const char doubt[] = "body 'a': joint.position: 57.3 is in radians, 9.12 turns. Write '57.3 deg'";
    kt_expect(0, doubt, "$K run turns.yaml --out /dev/null --set at=57.3");
    kt_expect(0, doubt, "$K run turns.yaml --out /dev/null --set bodies.a.joint.position=57.3");
    kt_expect(0, doubt, "$K sweep turns.yaml --out turns.csv --vary at=0,57.3");
    kt_expect(0, NULL, "$K run turns.yaml --out /dev/null --set at='57.3 rad' --quiet");
    kt_expect(0, NULL, "$K run turns.yaml --out /dev/null --set at=47.3 --quiet");
    const kt_ran ran = kt_shell("$K run turns.yaml --out /dev/null --set at=47.3");
    kt_check_true("47.3 rad may be meant", strstr(ran.err, "radians") == NULL);
}
