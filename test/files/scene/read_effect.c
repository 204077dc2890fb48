/* Every key of the effects that act in joints, on bodies and between them, and its result in the scene. Missing keys
 * have defaults. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "check.h"
#include "collect.h"
#include "expect.h"

#define HEAD                                                                                                           \
    "kinetree: 1\n"                                                                                                    \
    "bodies:\n"                                                                                                        \
    "  - {name: crank, joint: {type: revolute}, markers: {tip: [1, 0, 0]}}\n"                                          \
    "  - {name: slide, joint: {type: prismatic}}\n"                                                                    \
    "effects:\n"

KT_TEST(effects_in_joints_take_their_keys) {
    static const char text[] =
        HEAD "  - {type: joint_spring, joint: crank, stiffness: 2, rest: 90 deg, damping: 3}\n"
             "  - {type: joint_friction, joint: crank, coulomb: 1, viscous: 2, static: 3, stribeck: 90 deg, "
             "smoothing: 0.5}\n"
             "  - {type: joint_limit, joint: slide, lower: -1, upper: 2, stiffness: 3, damping: 4}\n"
             "  - {type: joint_limit, joint: crank, upper: 90 deg, stiffness: 3}\n"
             "  - {type: joint_spring, joint: crank, rest: {sine: {amplitude: 90 deg, frequency: 2}}, stiffness: 1}\n"
             "  - {type: servo, joint: crank, target: 90 deg, stiffness: 2, damping: 3, limit: 4}\n"
             "  - {type: servo, joint: slide, target: {ramp: {from: 0, to: 2, start: 0, end: 1}}, damping: 3}\n";
    kt_scene *scene = kt_test_scene(text);
    const kt_effect *e = scene->description.effects;
    kt_check_equal_int("type", e[0].type, KT_EFFECT_JOINT_SPRING);
    kt_check_text("joint", e[0].joint, "crank");
    CHECK_NUMBERS("stiffness", &e[0].stiffness, 2);
    CHECK_NUMBERS("rest, an angle", &e[0].rest.value, PI / 2);
    CHECK_NUMBERS("damping", &e[0].damping, 3);
    kt_check_equal_int("type", e[1].type, KT_EFFECT_JOINT_FRICTION);
    CHECK_NUMBERS("coulomb", &e[1].coulomb, 1);
    CHECK_NUMBERS("viscous", &e[1].viscous, 2);
    CHECK_NUMBERS("static", &e[1].breakaway, 3);
    CHECK_NUMBERS("stribeck, of an angle", &e[1].stribeck, PI / 2);
    CHECK_NUMBERS("smoothing", &e[1].smoothing, 0.5);
    kt_check_equal_int("type", e[2].type, KT_EFFECT_JOINT_LIMIT);
    CHECK_NUMBERS("lower", &e[2].lower, -1);
    CHECK_NUMBERS("upper", &e[2].upper, 2);
    CHECK_NUMBERS("stiffness", &e[2].stiffness, 3);
    CHECK_NUMBERS("damping", &e[2].damping, 4);
    kt_check_true("no lower stop", isinf(e[3].lower) && e[3].lower < 0.0);
    CHECK_NUMBERS("upper, an angle", &e[3].upper, PI / 2);
    kt_check_equal_int("rest that moves", e[4].rest.type, KT_FUNCTION_SINE);
    CHECK_NUMBERS("its amplitude, an angle", &e[4].rest.amplitude, PI / 2);
    kt_check_equal_int("type", e[5].type, KT_EFFECT_SERVO);
    CHECK_NUMBERS("target, an angle", &e[5].target.value, PI / 2);
    CHECK_NUMBERS("stiffness", &e[5].stiffness, 2);
    CHECK_NUMBERS("damping", &e[5].damping, 3);
    CHECK_NUMBERS("limit", &e[5].limit, 4);
    kt_check_equal_int("target that moves", e[6].target.type, KT_FUNCTION_RAMP);
    CHECK_NUMBERS("stiffness", &e[6].stiffness, 0);
    kt_check_true("no limit", isinf(e[6].limit) && e[6].limit > 0.0);
}

KT_TEST(springs_dampers_and_motors_take_their_keys) {
    static const char text[] =
        HEAD "  - {type: spring, between: [crank.tip, {body: world, at: [0, 1, 0]}], stiffness: 100}\n"
             "  - {name: s, type: spring, between: [crank, slide], length: 0, damping: 2}\n"
             "  - {type: joint_damper, joint: slide, damping: 0.5}\n"
             "  - {type: motor, joint: crank, torque: 3}\n"
             "  - {type: motor, joint: slide, force: {polynomial: [1, 2]}}\n";
    kt_scene *scene = kt_test_scene(text);
    const kt_effect *e = scene->description.effects;
    kt_check_equal_int("effects", scene->description.effect_count, 5);
    kt_check_equal_int("type", e[0].type, KT_EFFECT_SPRING);
    kt_check_true("no name", e[0].name == NULL);
    kt_check_text("first end", e[0].between[0].marker, "tip");
    CHECK_VECTOR("second end", e[0].between[1].at, 0, 1, 0);
    CHECK_NUMBERS("stiffness", &e[0].stiffness, 100);
    kt_check_true("the initial length", e[0].initial_length);
    kt_check_text("name", e[1].name, "s");
    kt_check_true("a length of its own", !e[1].initial_length);
    CHECK_NUMBERS("length", &e[1].length, 0);
    CHECK_NUMBERS("damping", &e[1].damping, 2);
    kt_check_equal_int("type", e[2].type, KT_EFFECT_JOINT_DAMPER);
    kt_check_text("joint", e[2].joint, "slide");
    CHECK_NUMBERS("damping", &e[2].damping, 0.5);
    kt_check_true("no length", !e[2].initial_length);
    kt_check_equal_int("type", e[3].type, KT_EFFECT_MOTOR);
    CHECK_NUMBERS("torque", &e[3].torque.value, 3);
    kt_check_equal_int("force", e[4].torque.type, KT_FUNCTION_POLYNOMIAL);
}

KT_TEST(effects_on_bodies_take_their_keys) {
    static const char text[] =
        HEAD "  - {type: bushing, between: [crank.tip, slide], stiffness: [1, 2, 3, 4, 5, 6], damping: [6, 5, 4, 3, 2, "
             "1]}\n"
             "  - {type: torque, on: crank, value: [1, {sine: {amplitude: 2, frequency: 3}}, 0], frame: body}\n"
             "  - {type: drag, on: crank, at: [1, 2, 3], linear: 4, quadratic: 5, axes_linear: [1, 2, 3, 4, 5, 6], "
             "axes_quadratic: [6, 5, 4, 3, 2, 1]}\n"
             "  - {type: drag, on: crank.tip}\n"
             "  - {type: drag, on: crank, at: tip}\n"
             "  - {type: drag, on: crank, at: crank.tip}\n"
             "  - {type: attraction, between: [crank, slide], strength: -2}\n"
             "  - {type: contact, point: crank.tip, radius: 0.1, plane: slide, axis: -x, stiffness: 2, exponent: 3, "
             "dissipation: 4, friction: 5, slip: 6}\n";
    kt_scene *scene = kt_test_scene(text);
    const kt_effect *e = scene->description.effects;
    for (int i = 0; i < 6; i++) {
        kt_check_near("stiffness", e[0].stiffnesses[i], i + 1.0, 0.0);
        kt_check_near("damping", e[0].dampings[i], 6.0 - i, 0.0);
    }
    kt_check_text("on", e[1].between[0].body, "crank");
    kt_check_equal_int("value", e[1].value[1].type, KT_FUNCTION_SINE);
    kt_check_equal_int("frame", e[1].frame, KT_FRAME_BODY);
    kt_check_text("on", e[2].between[0].body, "crank");
    CHECK_VECTOR("at", e[2].between[0].at, 1, 2, 3);
    CHECK_NUMBERS("linear", &e[2].linear, 4);
    CHECK_NUMBERS("quadratic", &e[2].quadratic, 5);
    for (int i = 0; i < 6; i++) {
        kt_check_near("linear along an axis", e[2].dampings[i], i + 1.0, 0.0);
        kt_check_near("quadratic along an axis", e[2].quadratics[i], 6.0 - i, 0.0);
    }
    for (int i = 3; i < 6; i++)
        kt_check_text("marker", e[i].between[0].marker, "tip");
    kt_check_equal_int("type", e[6].type, KT_EFFECT_ATTRACTION);
    CHECK_NUMBERS("strength", &e[6].strength, -2);
    kt_check_text("point", e[7].between[0].marker, "tip");
    kt_check_text("plane", e[7].between[1].body, "slide");
    CHECK_VECTOR("axis", e[7].axis, -1, 0, 0);
    CHECK_NUMBERS("radius", &e[7].radius, 0.1);
    CHECK_NUMBERS("stiffness", &e[7].stiffness, 2);
    CHECK_NUMBERS("exponent", &e[7].exponent, 3);
    CHECK_NUMBERS("dissipation", &e[7].dissipation, 4);
    CHECK_NUMBERS("friction", &e[7].friction, 5);
    CHECK_NUMBERS("slip", &e[7].slip, 6);
}

/* The defaults of the header, from which a C caller starts. */
KT_TEST(effects_have_defaults) {
    static const char text[] = HEAD "  - {type: joint_spring, joint: crank, stiffness: 2}\n"
                                    "  - {type: joint_friction, joint: crank, coulomb: 1}\n"
                                    "  - {type: contact, point: crank, plane: world, stiffness: 1}\n"
                                    "  - {type: drag, on: crank, linear: 1}\n";
    const kt_effect rest = kt_effect_default();
    kt_scene *scene = kt_test_scene(text);
    const kt_effect *e = scene->description.effects;
    kt_check_equal_int("rest", e[0].rest.type, KT_FUNCTION_NONE);
    CHECK_NUMBERS("static: as coulomb", &e[1].breakaway, 0);
    CHECK_NUMBERS("stribeck", &e[1].stribeck, 0.01);
    CHECK_NUMBERS("smoothing", &e[1].smoothing, 0.001);
    CHECK_NUMBERS("radius", &e[2].radius, 0);
    CHECK_NUMBERS("exponent", &e[2].exponent, 1.5);
    CHECK_NUMBERS("dissipation", &e[2].dissipation, 0);
    CHECK_NUMBERS("friction", &e[2].friction, 0);
    CHECK_NUMBERS("slip", &e[2].slip, 0.001);
    CHECK_VECTOR("axis", e[2].axis, 0, 0, 1);
    CHECK_VECTOR("at", e[3].between[0].at, 0, 0, 0);
    CHECK_NUMBERS("of the struct", &rest.exponent, 1.5);
    kt_check_true("no stops", isinf(rest.lower) && isinf(rest.upper) && rest.lower < rest.upper);
}
