/* Markers with axes. An end at a marker is the end with the marker's rotation before its own. This applies to every
 * loop and effect that has one, in space and in the plane. Wrong markers are rejected. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "collect.h"

static kt_collected faults;

static bool compile(const char *text, kt_model **model, kt_data **data) {
    kt_scene *scene = kt_test_scene_place();
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    *model = NULL;
    *data = NULL;
    if (kt_scene_parse("x", text, strlen(text), scene, kt_collect, &faults, &error) != KT_OK) {
        kt_check_text("parses", error.message, "");
        return false;
    }
    kt_status status = kt_model_compile(&scene->description, NULL, model, &error);
    if (status == KT_OK)
        status = kt_data_create(*model, data, &error);
    kt_check_text("compiles", status == KT_OK ? "" : error.message, "");
    return status == KT_OK;
}

/* Two arms about axes of their own, and loops and effects between them. %s: markers of both, and the two ends. */
#define ARMS(axis, loops, effects)                                                                                     \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"                                                                   \
    "  - {name: a, joint: {type: revolute, axis: y}, mass: 1, inertia: [1, 1, 1], %s}\n"                               \
    "  - {name: b, joint: {type: revolute, axis: " axis ", at: [1, 0, 0]}, mass: 1, inertia: [1, 1, 1], %s}\n"         \
    "  - {name: c, parent: b, joint: {type: revolute, axis: y, at: [0, 0, 1]}, mass: 1, inertia: [1, 1, 1]}\n" loops   \
        effects

static const char *const scenes[] = {
    ARMS("y", "loops: [{name: l, type: revolute, axis: y, between: [%s, %s]}]\n", ""),
    ARMS("y", "loops: [{name: l, type: inplane, axis: x, between: [%s, %s]}]\n", ""),
    ARMS("x", "loops: [{name: l, type: weld, between: [%s, %s]}]\n", ""),
    ARMS("x", "loops: [{name: l, type: cylindrical, axis: x, between: [%s, %s]}]\n", ""),
    ARMS("x", "", "effects: [{type: bushing, between: [%s, %s], stiffness: [1, 2, 3, 4, 5, 6]}]\n"),
    ARMS("y", "", "effects: [{type: contact, point: %s, plane: %s, radius: 5, stiffness: 10}]\n"),
};
enum { SCENES = sizeof scenes / sizeof *scenes, NUMBERS = 64 };

#define M_A "rotation: {axis: y, angle: 0.3}"
#define M_B "rotation: {rpy: [0, -0.7, 0]}"

/* Accelerations, and the loops' equations. */
static bool evaluate(const char *text, double *a, double *jacobian, double *residual) {
    const double q[3] = {0.4, -0.2, 0.6}, v[3] = {1.0, 2.0, -1.5};
    kt_model *model;
    kt_data *data;
    kt_error error = {0};
    const bool made = compile(text, &model, &data);
    kt_status status =
        made ? kt_loop_equations(model, data, 0.0, q, v, jacobian, residual, NULL, NULL, &error) : KT_ERROR_MODEL;
    if (status == KT_OK)
        status = kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error);
    if (made)
        kt_check_text("evaluates", status == KT_OK ? "" : error.message, "");
    kt_data_free(data);
    kt_model_free(model);
    return status == KT_OK;
}

static void write(char *text, size_t size, int n, const char *const words[4]) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(text, size, scenes[n], words[0], words[1], words[2], words[3]);
#pragma GCC diagnostic pop
}

KT_TEST(end_at_a_marker_has_its_axes) {
    static const char *const turned[4] = {"markers: {m: {at: [0.5, 0, 0.2], " M_A "}}",
                                          "markers: {m: {" M_B ", at: [0.1, 0, 0.7]}}", "a.m", "b.m"};
    static const char *const plain[4] = {"markers: {m: [0.5, 0, 0.2]}", "markers: {m: {at: [0.1, 0, 0.7]}}",
                                         "{body: a, marker: m, " M_A "}", "{body: b, marker: m, " M_B "}"};
    for (int n = 0; n < SCENES; n++) {
        char text[2][2048];
        double a[2][3] = {{0.0}}, jacobian[2][NUMBERS] = {{0.0}}, residual[2][NUMBERS] = {{0.0}}, most = 0.0;
        KT_WORST worst = kt_worst_make("with markers turned and with ends turned");
        write(text[0], sizeof text[0], n, turned);
        write(text[1], sizeof text[1], n, plain);
        if (!evaluate(text[0], a[0], jacobian[0], residual[0]) || !evaluate(text[1], a[1], jacobian[1], residual[1]))
            return;
        for (int i = 0; i < NUMBERS; i++) {
            kt_worst_near(&worst, jacobian[0][i], jacobian[1][i], 1e-15, "scene %d jacobian %d", n, i);
            kt_worst_near(&worst, residual[0][i], residual[1][i], 1e-15, "scene %d residual %d", n, i);
        }
        for (int i = 0; i < 3; i++) {
            most = fmax(most, fabs(a[1][i]));
            kt_worst_near(&worst, a[0][i], a[1][i], 1e-13 * fmax(1.0, fabs(a[1][i])), "scene %d acceleration %d", n, i);
        }
        kt_check_above("something happens", most, 0.1);
    }
}

/* Both rotations, one after the other: about the same axis their angles add up. */
KT_TEST(end_at_a_marker_is_turned_against_it) {
    static const char *const turned[4] = {"markers: {m: {at: [0.5, 0, 0.2], rotation: {axis: y, angle: 0.3}}}",
                                          "markers: {m: [0.1, 0, 0.7]}",
                                          "{body: a, marker: m, rotation: {axis: y, angle: 0.2}}", "b.m"};
    static const char *const plain[4] = {"markers: {m: [0.5, 0, 0.2]}", "markers: {m: [0.1, 0, 0.7]}",
                                         "{body: a, marker: m, rotation: {axis: y, angle: 0.5}}", "b.m"};
    char text[2][2048];
    double a[2][3], jacobian[2][NUMBERS] = {{0.0}}, residual[2][NUMBERS] = {{0.0}};
    write(text[0], sizeof text[0], 2, turned);
    write(text[1], sizeof text[1], 2, plain);
    if (!evaluate(text[0], a[0], jacobian[0], residual[0]) || !evaluate(text[1], a[1], jacobian[1], residual[1]))
        return;
    KT_WORST worst = kt_worst_make("angles 0.3 + 0.2 and 0.5");
    for (int i = 0; i < NUMBERS; i++) {
        kt_worst_near(&worst, jacobian[0][i], jacobian[1][i], 1e-15, "jacobian %d", i);
        kt_worst_near(&worst, residual[0][i], residual[1][i], 1e-15, "residual %d", i);
    }
}

static void rejects(const char *marker, const char *message) {
    char text[1024];
    kt_scene scene;
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    snprintf(
        text, sizeof text,
        "kinetree: 1\nbodies:\n  - {name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1], markers: {m: %s}}\n",
        marker);
    kt_check_true(marker, kt_scene_parse("x", text, strlen(text), &scene, kt_collect, &faults, &error) != KT_OK);
    kt_check_contains(marker, error.message, message);
}

KT_TEST(marker_that_is_no_frame_is_rejected) {
    rejects("{at: [1, 0, 0], rotation: {axis: [0, 0, 0], angle: 1}}", "axis");
    rejects("{at: [1, 0, 0], turn: 3}", "unknown key 'turn'");
    rejects("{at: [1, 0]}", "three");
    rejects("{rotation: {quaternion: [2, 0, 0, 0]}}", "norm");
}
