/* Every key of loops, the initial state and functions, and its result in the scene. The library rejects these
 * sections until its engine supports them; the tables that read them are complete. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "expect.h"

#define HEAD "kinetree: 1\n" HEAD_BODIES
#define HEAD_BODIES                                                                                                    \
    "bodies:\n"                                                                                                        \
    "  - {name: crank, joint: {type: revolute}, markers: {tip: [1, 0, 0]}}\n"                                          \
    "  - {name: slide, joint: {type: prismatic}}\n"                                                                    \
    "  - {name: bolt, joint: {type: screw, pitch: 0.1}}\n"

KT_TEST(loops_take_their_keys) {
    static const char text[] = HEAD
        "loops:\n"
        "  - {name: a, type: spherical, between: [crank.tip, world]}\n"
        "  - {name: b, type: revolute, between: [crank, {body: slide, at: [1, 2, 3], rotation: {rpy: [0, 0, 1]}}], "
        "axis: x}\n"
        "  - {name: c, type: weld, between: [{body: world, at: [1, 2, 3]}, {body: crank, marker: tip}]}\n"
        "  - {name: d, type: orthogonal, between: [crank, slide], axis: x, axis2: [0, 1, 1]}\n"
        "  - {name: e, type: screw, between: [crank, slide], pitch: -0.5}\n"
        "  - {name: f, type: coupling, coefficients: {crank: 1, slide: -2.5}, offset: 90 deg}\n"
        "  - {name: g, type: rolling, wheel: crank.tip, axis: y, radius: 0.3, on: {body: slide}, normal: -x, "
        "holonomic: false}\n"
        "  - {name: h, type: distance, between: [crank, slide]}\n"
        "  - {name: i, type: distance, between: [crank, slide], length: 2}\n"
        "initial: {hold: [slide, crank]}\n";
    kt_scene *scene = kt_test_scene(text);
    const kt_loop *l = scene->description.loops;
    kt_check_equal_int("loops", scene->description.loop_count, 9);
    kt_check_text("name", l[0].name, "a");
    kt_check_equal_int("type", l[0].type, KT_LOOP_SPHERICAL);
    kt_check_text("first body", l[0].between[0].body, "crank");
    kt_check_text("first marker", l[0].between[0].marker, "tip");
    kt_check_true("the world", l[0].between[1].body == NULL && l[0].between[1].marker == NULL);
    CHECK_VECTOR("axis", l[1].axis, 1, 0, 0);
    kt_check_text("second body", l[1].between[1].body, "slide");
    CHECK_VECTOR("at", l[1].between[1].at, 1, 2, 3);
    kt_check_equal_int("rotation", l[1].between[1].rotation.type, KT_ROTATION_RPY);
    kt_check_true("the world, at a point", l[2].between[0].body == NULL);
    CHECK_VECTOR("point", l[2].between[0].at, 1, 2, 3);
    kt_check_text("marker", l[2].between[1].marker, "tip");
    CHECK_VECTOR("axis by default", l[2].axis, 0, 0, 1);
    CHECK_VECTOR("axis2", l[3].axis2, 0, 1, 1);
    CHECK_NUMBERS("pitch", &l[4].pitch, -0.5);
    kt_check_equal_int("terms", l[5].term_count, 2);
    kt_check_text("joint of a term", l[5].terms[1].joint, "slide");
    CHECK_NUMBERS("its coefficient", &l[5].terms[1].coefficient, -2.5);
    CHECK_NUMBERS("offset, of an angle", &l[5].offset, PI / 2);
    kt_check_text("wheel", l[6].between[0].marker, "tip");
    kt_check_text("on", l[6].between[1].body, "slide");
    CHECK_NUMBERS("radius", &l[6].radius, 0.3);
    CHECK_VECTOR("axle", l[6].axis, 0, 1, 0);
    CHECK_VECTOR("normal", l[6].axis2, -1, 0, 0);
    kt_check_true("holonomic", !l[6].holonomic && l[5].holonomic);
    kt_check_equal_int("length by default", l[7].function.type, KT_FUNCTION_NONE);
    kt_check_equal_int("length", l[8].function.type, KT_FUNCTION_CONSTANT);
    CHECK_NUMBERS("length", &l[8].function.value, 2);
    kt_check_equal_int("hold", scene->description.hold_count, 2);
    kt_check_text("hold", scene->description.hold[1], "crank");
}

/* A loop with a fault of these words. Returns the number of faults. */
static int check_wrong_loop(const char *given, const char *loop, const char *says) {
    static kt_collected faults;
    char text[600];
    snprintf(text, sizeof text, HEAD "loops: [{name: l, %s, %s}]\n", given, loop);
    const kt_status status = kt_collect_parse(&faults, text, kt_test_scene_place());
    kt_note("%s", faults.text);
    kt_check_true(loop, status != KT_OK && strstr(faults.text, says) != NULL);
    return faults.count;
}

/* The joints that a formula reads become terms without a coefficient. */
KT_TEST(couplings_take_formulas_of_joints_of_one_coordinate) {
    static const struct {
        const char *loop, *says;
    } wrong[] = {
        {"formula: \"position.crnak^2\"",
         "6:45: loop 'l': formula: there is no name 'position.crnak'; did you mean 'position.crank'?"},
        {"formula: \"2*velocity.crank\"",
         "6:47: loop 'l': formula: there is no name 'velocity.crank'; names are position.crank, position.slide,"},
        {"formula: \"2*3\"", "the formula reads no joint; write position.JOINT"},
        {"formula: [1]", "expected a formula"},
        {"formula: \"position.crank*(\"", "6:61: loop"},
        {"offset: 1", "coefficients are missing"},
    };
    kt_scene *scene =
        kt_test_scene("kinetree: 1\nparameters: {c: 0.25}\n" HEAD_BODIES "loops:\n"
                      "  - {name: f, type: coupling, coefficients: {slide: 1}, formula: \"-c*position.crank^2 + "
                      "0*position.slide\", offset: 2}\n");
    const kt_loop *l = scene->description.loops;
    kt_check_equal_int("terms", l->term_count, 2);
    kt_check_text("joint of a coefficient", l->terms[0].joint, "slide");
    kt_check_text("joint of the formula alone", l->terms[1].joint, "crank");
    CHECK_NUMBERS("its coefficient", &l->terms[1].coefficient, 0);
    kt_check_text("formula", l->formula, "-(0.25)*position.crank^2 + 0*position.slide");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        (void)check_wrong_loop("type: coupling", wrong[i].loop, wrong[i].says);
}

KT_TEST(every_loop_between_two_ends_has_its_name) {
    static const char *const types[] = {"spherical",  "inline",    "inplane",    "distance",   "parallel",    "coaxial",
                                        "orthogonal", "revolute",  "prismatic",  "screw",      "cylindrical", "planar",
                                        "weld",       "universal", "knife_edge", "homokinetic"};
    static const kt_loop_type values[] = {
        KT_LOOP_SPHERICAL, KT_LOOP_INLINE,    KT_LOOP_INPLANE,     KT_LOOP_DISTANCE,
        KT_LOOP_PARALLEL,  KT_LOOP_COAXIAL,   KT_LOOP_ORTHOGONAL,  KT_LOOP_REVOLUTE,
        KT_LOOP_PRISMATIC, KT_LOOP_SCREW,     KT_LOOP_CYLINDRICAL, KT_LOOP_PLANAR,
        KT_LOOP_WELD,      KT_LOOP_UNIVERSAL, KT_LOOP_KNIFE_EDGE,  KT_LOOP_HOMOKINETIC};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        kt_scene *scene = kt_test_scene_of(HEAD "loops: [{name: l, type: %s, between: [crank, slide]%s}]\n", types[i],
                                           values[i] == KT_LOOP_SCREW ? ", pitch: 1" : "");
        kt_check_equal_int(types[i], scene->description.loops[0].type, values[i]);
    }
}

KT_TEST(surfaces_curves_and_rates_take_their_keys) {
    static const char text[] =
        HEAD "loops:\n"
             "  - {name: a, type: surface, between: [world, crank], surface: {plane: {}}}\n"
             "  - {name: b, type: surface, between: [world, crank], surface: {cylinder: {radius: 2}}, axis: x}\n"
             "  - {name: c, type: surface, between: [world, crank], surface: {sphere: {radius: 3}}}\n"
             "  - {name: d, type: surface, between: [world, crank], surface: {torus: {radius: 4, tube: 0.5}}}\n"
             "  - {name: e, type: curve, between: [world, crank], curve: {line: {}}, distance: 1}\n"
             "  - {name: f, type: curve, between: [world, crank], curve: {circle: {radius: 5}}}\n"
             "  - {name: g, type: curve, between: [world, crank], curve: {helix: {radius: 6, pitch: -0.1}}}\n"
             "  - {name: h, type: curve, between: [world, crank], curve: {spline: [[1, 2, 3], [4, 5, 6]]}}\n"
             "  - {name: i, type: rates, coefficients: {crank: 1, slide: 2}, rate: 90 deg}\n"
             "  - {name: j, type: rates, coefficients: {slide: 2}}\n";
    kt_scene *scene = kt_test_scene(text);
    const kt_loop *l = scene->description.loops;
    for (int i = 0; i < 4; i++) {
        kt_check_equal_int("surface", l[i].surface.type, KT_SURFACE_PLANE + i);
        kt_check_equal_int("curve", l[4 + i].curve.type, KT_TRACK_LINE + i);
    }
    CHECK_NUMBERS("radius of a cylinder", &l[1].surface.radius, 2);
    CHECK_VECTOR("axis", l[1].axis, 1, 0, 0);
    CHECK_NUMBERS("radius of a sphere", &l[2].surface.radius, 3);
    CHECK_NUMBERS("tube", &l[3].surface.tube, 0.5);
    CHECK_NUMBERS("distance", &l[4].function.value, 1);
    kt_check_equal_int("a free arc length", l[5].function.type, KT_FUNCTION_NONE);
    CHECK_NUMBERS("radius of a circle", &l[5].curve.radius, 5);
    CHECK_NUMBERS("pitch", &l[6].curve.pitch, -0.1);
    kt_check_equal_int("points", l[7].curve.point_count, 2);
    CHECK_VECTOR("point", l[7].curve.points[1], 4, 5, 6);
    CHECK_NUMBERS("rate, of an angle", &l[8].function.value, PI / 2);
    kt_check_equal_int("terms", l[8].term_count, 2);
    kt_check_equal_int("rate by default", l[9].function.type, KT_FUNCTION_NONE);
}

/* One fault each, and how to mend it. */
KT_TEST(wrong_surfaces_and_curves_are_told) {
    static const struct {
        const char *loop, *says;
    } table[] = {
        {"type: surface", "surface"},
        {"type: surface, surface: {}", "one of plane, cylinder, sphere, torus"},
        {"type: surface, surface: 3", "a surface (one of plane, cylinder, sphere, torus)"},
        {"type: surface, surface: {cone: {}}", "cone"},
        {"type: surface, surface: {plane: {}, sphere: {radius: 1}}", "'plane' and 'sphere' are two surfaces"},
        {"type: surface, surface: {sphere: {}}", "radius"},
        {"type: surface, surface: {sphere: {radius: -1}}", "must be greater than 0"},
        {"type: curve, curve: {helix: {radius: 1, pitch: 0}}", "which is a circle"},
        {"type: curve, curve: {spline: [[0, 0, 0]]}", "two points or more"},
        {"type: curve, curve: {spline: [[0, 0, 0], [1, 0, 0], [1, 0, 0]]}",
         "points 1 and 2 of the spline are the same"},
        {"type: curve, curve: {spline: {}}", "a list of points"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        kt_check_equal_int("faults", check_wrong_loop("between: [world, crank]", table[i].loop, table[i].says), 1);
}

typedef struct function_row {
    const char *text;
    kt_function function;
} function_row;

/* All of these functions drive a joint that turns. The scene may give each of their angles, and the phase, in
 * degrees. */
KT_TEST(functions_give_angles_where_the_joint_turns) {
    static const double line[] = {PI, 2, 3}, points[] = {0, 0, 1, PI};
    static const function_row table[] = {
        {"180 deg", {.type = KT_FUNCTION_CONSTANT, .value = PI}},
        {"-2", {.type = KT_FUNCTION_CONSTANT, .value = -2}},
        {"{sine: {amplitude: 180 deg, frequency: 2, phase: 90 deg, offset: -180 deg}}",
         {.type = KT_FUNCTION_SINE, .amplitude = PI, .frequency = 2, .phase = PI / 2, .offset = -PI}},
        {"{sine: {amplitude: 1, frequency: 2}}", {.type = KT_FUNCTION_SINE, .amplitude = 1, .frequency = 2}},
        {"{ramp: {from: 0, to: 180 deg, start: 1, end: 2}}",
         {.type = KT_FUNCTION_RAMP, .from = 0, .to = PI, .start = 1, .end = 2}},
        {"{polynomial: [180 deg, 2, 3]}", {.type = KT_FUNCTION_POLYNOMIAL, .numbers = line, .number_count = 3}},
        {"{table: [[0, 0], [1, 180 deg]]}", {.type = KT_FUNCTION_TABLE, .numbers = points, .number_count = 4}},
        {"{interpolation: cubic, table: [[0, 0], [1, 180 deg]]}",
         {.type = KT_FUNCTION_TABLE, .numbers = points, .number_count = 4, .interpolation = KT_INTERPOLATION_CUBIC}},
    };
    for (size_t i = 0; i < 2 * sizeof table / sizeof *table; i++) {
        const function_row *row = &table[i / 2];
        char text[600];
        snprintf(text, sizeof text, HEAD "loops: [{name: l, type: motion, position: %s, joint: %s}]\n", row->text,
                 i % 2 == 0 ? "crank" : "bolt");
        kt_scene *scene = kt_test_scene(text);
        const kt_function *f = &scene->description.loops[0].function;
        kt_check_equal_int(row->text, f->type, row->function.type);
        const kt_function *e = &row->function;
        const double seen[] = {f->value, f->amplitude, f->frequency, f->phase, f->offset,
                               f->from,  f->to,        f->start,     f->end};
        CHECK_NUMBERS("members", seen, e->value, e->amplitude, e->frequency, e->phase, e->offset, e->from, e->to,
                      e->start, e->end);
        kt_check_equal_int("numbers", f->number_count, row->function.number_count);
        if (f->number_count == row->function.number_count && f->number_count > 0)
            kt_check_equal_bits("numbers", f->numbers, row->function.numbers, (size_t)f->number_count);
        kt_check_equal_int("interpolation", f->interpolation, row->function.interpolation);
    }
}

KT_TEST(unknown_key_is_offered_those_there_are) {
    static const char text[] = "kinetree: 1\noutput: {xyzzy: 1}\n";
    kt_scene scene;
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int("status", kt_scene_parse(NULL, text, strlen(text), &scene, NULL, NULL, &error), KT_ERROR_SCENE);
    kt_check_text("message", error.message,
                  "output: unknown key 'xyzzy'; it can be interval, record, markers, columns");
}

/* Commas end values between braces. The rest of a formula after a comma looks like keys. The scene also has no
 * bodies. */
KT_TEST(rest_of_a_formula_that_a_comma_ends_is_no_key) {
    static const char text[] = "kinetree: 1\nstates: {x: {rate: 1, 4): 2}}\n";
    kt_scene scene;
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int("status", kt_scene_parse(NULL, text, strlen(text), &scene, NULL, NULL, &error), KT_ERROR_SCENE);
    kt_check_contains("message", error.message, "unknown key '4)'; if it is part of a formula, put that in quotes");
}
