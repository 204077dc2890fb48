/* Variables of formulas: every one has a name, the name of its column, and is found by it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"

#include "kinetree/description.h"

#include <string.h>

static const kt_marker markers[] = {{.name = "tip", .at = {1.0, 0.0, 0.0}}, {.name = "tip-2", .at = {2.0, 0.0, 0.0}}};

static kt_description describe(kt_body bodies[3]) {
    static const struct {
        const char *name;
        kt_joint_type type;
    } made[] = {{"arm", KT_JOINT_REVOLUTE}, {"arm-2", KT_JOINT_FREE}, {"base", KT_JOINT_FIXED}};
    for (int i = 0; i < 3; i++) {
        bodies[i] = kt_body_of(made[i].name, NULL, made[i].type, 0.0);
        bodies[i].markers = markers;
        bodies[i].marker_count = 2;
    }
    kt_description description = kt_description_of(bodies, 3, NULL, 0, NULL, 0);
    return description;
}

KT_TEST(every_variable_is_found_by_its_name) {
    enum { MOST = 64 };
    kt_body bodies[3];
    const kt_description description = describe(bodies);
    int count = 0, wrong = 0, repeated = 0;
    char names[MOST][64];
    kt_variable variable, found;
    for (; count < MOST && kt_variable_at(&description, count, &variable); count++) {
        char *name = names[count];
        (void)kt_variable_name(&description, &variable, name, sizeof names[count]);
        for (int k = 0; k < count; k++)
            repeated += strcmp(names[k], name) == 0;
        wrong += !kt_variable_find(&description, name, &found) || found.type != variable.type ||
                 found.body != variable.body || found.marker != variable.marker ||
                 found.component != variable.component;
    }
    kt_check_equal_int("wrong", wrong, 0);
    kt_check_equal_int("names of two variables", repeated, 0);
    kt_check_equal_int("t, 3 of arm, 19 of arm-2, 6 of each of 6 markers", count, 1 + 3 + 19 + 36);
}

KT_TEST(names_are_those_of_columns) {
    static const struct {
        const char *name;
        kt_variable expected;
    } rows[] = {
        {"t", {KT_VARIABLE_TIME, -1, 0, 0}},
        {"position.arm", {KT_VARIABLE_POSITION, 0, 0, 0}},
        {"velocity.arm", {KT_VARIABLE_VELOCITY, 0, 0, 0}},
        {"position.arm-2[6]", {KT_VARIABLE_POSITION, 1, 0, 6}},
        {"velocity.arm-2[5]", {KT_VARIABLE_VELOCITY, 1, 0, 5}},
        {"gravity.arm", {KT_VARIABLE_GRAVITY, 0, 0, 0}},
        {"gravity.arm-2[3]", {KT_VARIABLE_GRAVITY, 1, 0, 3}},
        {"marker.arm.tip.x", {KT_VARIABLE_MARKER, 0, 0, 0}},
        {"marker.arm.tip-2.vz", {KT_VARIABLE_MARKER_VELOCITY, 0, 1, 2}},
        {"marker.arm-2.tip-2.y", {KT_VARIABLE_MARKER, 1, 1, 1}},
    };
    kt_body bodies[3];
    const kt_description description = describe(bodies);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        kt_variable found = {KT_VARIABLE_TIME, -9, -9, -9};
        char name[64];
        kt_check_true(rows[i].name, kt_variable_find(&description, rows[i].name, &found));
        kt_check_equal_int("type", found.type, rows[i].expected.type);
        kt_check_equal_int("body", found.body, rows[i].expected.body);
        kt_check_equal_int("marker", found.marker, rows[i].expected.marker);
        kt_check_equal_int("component", found.component, rows[i].expected.component);
        const int length = kt_variable_name(&description, &rows[i].expected, name, sizeof name);
        kt_check_equal_int("length", length, (long long)strlen(rows[i].name));
        kt_check_text("name", name, rows[i].name);
    }
}

KT_TEST(what_is_no_variable_is_not_found) {
    static const char *const names[] = {"",
                                        "time",
                                        "position",
                                        "position.",
                                        "position.leg",
                                        "position.arm[0]",
                                        "position.arm.x",
                                        "position.arm-2",
                                        "position.arm-2[7]",
                                        "velocity.arm-2[6]",
                                        "velocity.base",
                                        "acceleration.arm",
                                        "marker.arm",
                                        "marker.arm.tip",
                                        "marker.arm.tip.w",
                                        "marker.arm.heel.x",
                                        "marker.arm.tip.xx"};
    kt_body bodies[3];
    const kt_description description = describe(bodies);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        kt_variable found = {KT_VARIABLE_MARKER, -9, -9, -9};
        kt_check_true(names[i], !kt_variable_find(&description, names[i], &found));
        kt_check_equal_int("untouched", found.component, -9);
    }
}

KT_TEST(variables_of_nothing_are_rejected) {
    kt_body bodies[3];
    const kt_description description = describe(bodies);
    kt_variable found;
    const kt_variable none[] = {{KT_VARIABLE_POSITION, 3, 0, 0}, {KT_VARIABLE_MARKER, 0, 2, 0}};
    char name[64] = "x";
    kt_check_true("no description", !kt_variable_find(NULL, "t", &found) && !kt_variable_at(NULL, 0, &found));
    kt_check_true("no name", !kt_variable_find(&description, NULL, &found));
    kt_check_true("below the first", !kt_variable_at(&description, -1, &found));
    for (int i = 0; i < 2; i++) {
        kt_check_equal_int("length", kt_variable_name(&description, &none[i], name, sizeof name), 0);
        kt_check_text("name", name, "");
    }
}
