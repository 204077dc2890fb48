/* Functions of time as formulas, sums, products and bumps: the description has exactly the functions of the scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"

#include <stdio.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "difference.h"

#define HEAD                                                                                                           \
    "kinetree: 1\n"                                                                                                    \
    "parameters: {A: -2.5, w: \"=2*pi\", tilt: 30 deg}\n"                                                              \
    "bodies:\n"                                                                                                        \
    "  - {name: crank, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"

static kt_collected faults;

static kt_status parse(const char *function, const char *key, kt_scene *scene) {
    char text[2000];
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    snprintf(text, sizeof text, HEAD "effects:\n  - {type: %s, joint: crank, stiffness: 1, %s: %s}\n",
             strcmp(key, "torque") == 0 ? "motor" : "joint_spring", key, function);
    if (strcmp(key, "torque") == 0)
        snprintf(text, sizeof text, HEAD "effects:\n  - {type: motor, joint: crank, torque: %s}\n", function);
    return kt_scene_parse_with("x", text, strlen(text), NULL, scene, kt_collect, &faults, &error);
}

KT_TEST(formulas_hold_numbers_in_place_of_parameters) {
    static const struct {
        const char *key, *text, *expected;
    } rows[] = {
        {"torque", "\"3*t\"", "3*t"},
        {"torque", "A*sin(w*t)", "(-2.5)*sin((6.283185307179586)*t)"},
        {"torque", "\"A^2 + At*0\"", NULL},
        {"torque", "A", "(-2.5)"},
        {"torque", "exp(-t)*(tilt/1 rad)", "exp(-t)*((0.5235987755982989 rad)/1 rad)"},
        {"rest", "tilt*t", "(0.5235987755982989 rad)*t"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        kt_scene *scene = kt_test_scene_place();
        const kt_status status = parse(rows[i].text, rows[i].key, scene);
        kt_check_equal_int(rows[i].text, status == KT_OK, rows[i].expected != NULL);
        if (status != KT_OK)
            continue;
        const kt_effect *effect = &scene->description.effects[0];
        const kt_function *f = i < 5 ? &effect->torque : &effect->rest;
        kt_check_equal_int("type", f->type, KT_FUNCTION_EXPRESSION);
        kt_check_text("formula", f->text, rows[i].expected);
    }
}

KT_TEST(faults_of_formulas_are_located) {
    static const struct {
        const char *text, *message;
        int column; /* from where the value begins */
    } rows[] = {
        {"sin(w*tt)", "there is no name 'tt'; did you mean 't'?", 7},
        {"\"3*sine(t)\"", "there is no function 'sine'; did you mean 'sin'?", 4},
        {"\"2 N/m\"", "an operator is missing before 'N'", 4},
        {"2 Nm", "found '2 Nm'", 1},
        {"tilt*t", "expected a number, found the angle 'tilt*t'", 1},
        {"\"-2*velocity.a\"", "use an effect of the type 'expression'", 5},
        {"{product: [1, 2 t*t]}", "an operator is missing before 't'", 17},
        {"{sum: []}", "expected a list of functions of time", 7},
        {"{bump: {height: 1, start: 2, end: 1}}", "bump starts at 2 and ends at 1; it must end later", 1},
        {"{sum: [{sum: [{sum: [{sum: [{sum: [1]}]}]}]}]}", "more than 4 sums and products", 35},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        kt_scene scene;
        char column[16];
        kt_check_true(rows[i].text, parse(rows[i].text, "torque", &scene) != KT_OK);
        snprintf(column, sizeof column, ":6:%d", 40 + rows[i].column);
        kt_check_equal_int("faults", faults.count, 1);
        kt_check_contains("message", faults.first.message, rows[i].message);
        kt_check_contains("place", faults.first.where, column);
    }
}

/* Written, and read again. */
KT_TEST(functions_are_written_as_they_are_read) {
    static const char *const texts[] = {
        "\"A*max(0, sin(w*t))\"", "{bump: {height: 2, start: 0.25, end: 1}}",
        "{sum: [1, \"t^2\", {product: [{sine: {amplitude: 1, frequency: 2}}, \"exp(-t)\"]}]}"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        kt_scene *scene = kt_test_scene_place();
        if (!kt_check_equal_int(texts[i], parse(texts[i], "torque", scene), KT_OK))
            continue;
        kt_check_text("difference", kt_scene_difference(scene, kt_test_scene(kt_test_written(scene))), "");
    }
}
