/* The section `joints` of scenes: the bodies and loops that it becomes, the numbers that follow, and its faults. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "expect.h"

#include "kinetree/build.h"

#define BODIES                                                                                                         \
    "kinetree: 1\n"                                                                                                    \
    "parameters: {L: 0.3, m: 2}\n"                                                                                     \
    "bodies:\n"                                                                                                        \
    "  - {name: crank, mass: =m, inertia: [1, 1, 1], markers: {a: [0, 0, 0], b: [=L, 0, 0]}}\n"                        \
    "  - {name: rod, mass: 2, inertia: [1, 1, 1], markers: {b: [0.3, 0, 0], c: [1, 0.6, 0]}}\n"                        \
    "  - {name: C, mass: 2, inertia: [1, 1, 1], markers: {c: [1, 0.6, 0], d: [1, 0, 0]}}\n"
#define JOINTS                                                                                                         \
    "joints:\n"                                                                                                        \
    "  - {name: A, type: revolute, between: [world, crank.a], armature: =m/10}\n"                                      \
    "  - {name: B, type: revolute, between: [crank.b, rod.b]}\n"                                                       \
    "  - {name: C, type: revolute, between: [rod.c, C.c]}\n"                                                           \
    "  - {name: D, type: revolute, axis: -z, between: [{body: world, at: [1, 0, 0]}, C.d]}\n"

static const kt_body *body_of(const kt_scene *scene, const char *name) {
    for (int i = 0; i < scene->description.body_count; i++)
        if (strcmp(scene->description.bodies[i].name, name) == 0)
            return &scene->description.bodies[i];
    kt_note("no body '%s'", name);
    kt_need(kt_check_true("body", false));
    return NULL;
}

KT_TEST(joints_of_a_graph_become_bodies_and_loops_of_their_names) {
    const kt_scene *scene = kt_test_scene(BODIES JOINTS "loops: [{name: own, type: inplane, between: [rod, world]}]\n"
                                                        "initial: {hold: [B]}\n");
    const kt_description *d = &scene->description;
    kt_check_equal_int("bodies, and the massless ones of B and D", d->body_count, 5);
    kt_check_equal_int("loops: those of the file first", d->loop_count, 2);
    kt_check_text("the file's", d->loops[0].name, "own");
    kt_check_text("the joint that closes the loop", d->loops[1].name, "C");
    kt_check_true("it has coordinates", d->loops[1].coordinates && !d->loops[0].coordinates);
    kt_check_text("the joint of the crank", body_of(scene, "crank")->joint.name, "A");
    CHECK_NUMBERS("its armature", body_of(scene, "crank")->joint.armature, 0.2);
    kt_check_text("the rod is on the body of B", body_of(scene, "rod")->parent, "B");
    CHECK_VECTOR("at the inverse of its end", body_of(scene, "rod")->joint.at, -0.3, 0, 0);
    CHECK_VECTOR("B is at the end of the crank", body_of(scene, "B")->joint.at, 0.3, 0, 0);
    CHECK_VECTOR("the axis of D", body_of(scene, "D")->joint.axis, 0, 0, -1);
    kt_check_equal_int("choices", scene->joint_count, 4);
    kt_check_true("C is cut", scene->joints[2].body == NULL && scene->joints[2].length == 4);
    kt_check_text("D carries", scene->joints[3].body, "C");
}

/* The scene that is written has the tree and its loops, and reads the same. */
KT_TEST(a_graph_is_written_as_its_tree) {
    const char *text = kt_test_written(kt_test_scene(BODIES JOINTS));
    kt_check_true("no graph", strstr(text, "\njoints:") == NULL);
    kt_check_contains("coordinates", text, "coordinates: true");
    kt_check_text("again", kt_test_written(kt_test_scene(text)), text);
}

/* A joint that another section names is a coordinate, whatever its place in the graph. */
KT_TEST(joints_that_are_read_are_coordinates) {
    static const char *const readers[] = {"initial: {hold: [C]}\n",
                                          "loops: [{name: m, type: motion, joint: C, position: 0}]\n",
                                          "loops: [{name: g, type: coupling, coefficients: {C: 1, A: 2}}]\n",
                                          "effects: [{type: motor, joint: C, torque: 1}]\n",
                                          "states: {x: {rate: '-x + position.C'}}\n",
                                          "events: [{name: e, when: 'velocity.C-A'}]\n"};
    for (size_t i = 0; i < sizeof readers / sizeof *readers; i++) {
        char text[2000];
        kt_collected faults;
        kt_scene *scene = kt_test_scene_place();
        (void)snprintf(text, sizeof text, "%s%s%s", BODIES, JOINTS, readers[i]);
        (void)(kt_collect_parse(&faults, text, scene) == KT_OK);
        if (strstr(readers[i], "C-A") != NULL) { /* "velocity.C" less A: A is no name of a formula */
            kt_check_above("a fault of the formula alone", faults.count, 0);
            continue;
        }
        if (!kt_check_equal_int(readers[i], faults.count, 0))
            kt_note("%s", faults.text);
        kt_check_true(readers[i], scene->joint_count == 4 && scene->joints[2].body != NULL);
    }
}

/* ---- numbers that follow from variables -------------------------------------------------------------------------- */

static kt_status read_varied(const char *variable, double value, const char *setting, kt_scene *scene) {
    static const char text[] = BODIES JOINTS;
    const kt_scene_options options = {.settings = &setting,
                                      .setting_count = setting != NULL,
                                      .variables = &variable,
                                      .values = &value,
                                      .variable_count = variable != NULL};
    kt_error error = {0};
    const kt_status status = kt_scene_parse_with("scene", text, sizeof text - 1, &options, scene, NULL, NULL, &error);
    if (status != KT_OK)
        kt_note("%s: %s", error.where, error.message);
    return status;
}

KT_TEST(numbers_of_a_graph_follow_to_its_tree) {
    static const char *const variables[] = {"m", "bodies.rod.mass", "joints.A.armature", "joints.B.position"};
    for (size_t i = 0; i < sizeof variables / sizeof *variables; i++) {
        const double other = 0.75;
        char setting[80];
        kt_error error = {0};
        kt_scene *varied = kt_test_scene_place(), *anew = kt_test_scene_place();
        (void)snprintf(setting, sizeof setting, "%s=%.17g", variables[i], other);
        kt_need(kt_check_equal_int("varied", read_varied(variables[i], 0.5, NULL, varied), KT_OK));
        kt_need(kt_check_equal_int("anew", read_varied(NULL, 0.0, setting, anew), KT_OK));
        kt_need(kt_check_equal_int(variables[i], kt_scene_vary(varied, &other, &error), KT_OK));
        kt_check_text(variables[i], kt_test_written(varied), kt_test_written(anew));
    }
}

/* A length gives a place of the tree, which cannot follow. */
KT_TEST(places_of_a_graph_need_another_reading) {
    const double other = 0.4;
    kt_error error = {0};
    kt_scene *scene = kt_test_scene_place();
    kt_need(kt_check_equal_int("read", read_varied("L", 0.3, NULL, scene), KT_OK));
    kt_check_equal_int("varied", kt_scene_vary(scene, &other, &error), KT_ERROR_UNSUPPORTED);
    kt_check_contains("its place", error.where, "scene:4:");
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(faults_of_joints_have_their_places) {
    static const struct {
        const char *joints, *fault;
    } table[] = {
        {"joints:\n  - {name: A, type: revolute, between: [world, crank.a], at: [1, 0, 0]}\n",
         "8:62: joint 'A': the first end of `between` gives the joint frame"},
        {"joints:\n  - {name: A, type: revolute}\n", "8:5: joint 'A': the key 'between' is missing"},
        {"joints:\n  - {name: A, type: hinge, between: [world, crank.a]}\n", "joint 'A': type: "},
        {"joints:\n  - {name: A, type: revolute, between: [world, cranc.a]}\n",
         "8:5: joint 'A': body 'cranc' does not exist"},
        {"joints:\n  - {name: A, type: revolute, between: [world, crank.x]}\n",
         "8:5: joint 'A': the body has no marker 'x'"},
        {"joints:\n  - {name: A, type: revolute, between: [world, crank.a]}\n",
         "5:5: body 'rod': no joint connects this body with the world"},
        {"joints: 3\n", "7:9: joints: expected a list of joints"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[1200];
        kt_collected faults;
        kt_scene scene = kt_scene_default();
        (void)snprintf(text, sizeof text, "%s%s", BODIES, table[i].joints);
        kt_check_true(table[i].fault, kt_collect_parse(&faults, text, &scene) != KT_OK);
        kt_check_contains(table[i].fault, faults.text, table[i].fault);
        kt_check_equal_int("one fault", faults.count, 1);
    }
}
