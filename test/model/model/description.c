/* The structs to start from, and names of types. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <limits.h>

#include "check.h"
#include "kinetree/model.h"

KT_TEST(types_have_the_names_of_the_scene_format) {
    /* Written out once more from the format's page. */
    static const char *const joints[] = {"fixed",  "revolute",  "prismatic", "screw", "cylindrical",
                                         "planar", "universal", "spherical", "free"};
    static const char *const shapes[] = {"none", "point", "rod", "box", "sphere", "cylinder", "polygon"};
    static const char *const loops[] = {
        "spherical", "inline",    "inplane", "distance",    "parallel", "coaxial",     "orthogonal",
        "revolute",  "prismatic", "screw",   "cylindrical", "planar",   "weld",        "universal",
        "coupling",  "motion",    "rolling", "knife_edge",  "rates",    "homokinetic", "surface",
        "curve",     "gear",      "rack",    "worm",        "span",     "belt"};
    static const char *const effects[] = {"spring",  "joint_spring", "joint_damper", "joint_friction", "joint_limit",
                                          "bushing", "motor",        "servo",        "force",          "torque",
                                          "drag",    "attraction",   "contact",      "expression",     "thrust"};
    kt_check_equal_int("joints", sizeof joints / sizeof *joints, KT_JOINT_TYPE_COUNT);
    kt_check_equal_int("shapes", sizeof shapes / sizeof *shapes, KT_SHAPE_TYPE_COUNT);
    kt_check_equal_int("effects", sizeof effects / sizeof *effects, KT_EFFECT_TYPE_COUNT);
    kt_check_equal_int("loops", sizeof loops / sizeof *loops, KT_LOOP_TYPE_COUNT);
    for (int i = 0; i < KT_JOINT_TYPE_COUNT; i++)
        kt_check_text("joint", kt_joint_type_name((kt_joint_type)i), joints[i]);
    for (int i = 0; i < KT_SHAPE_TYPE_COUNT; i++)
        kt_check_text("shape", kt_shape_type_name((kt_shape_type)i), shapes[i]);
    for (int i = 0; i < KT_LOOP_TYPE_COUNT; i++)
        kt_check_text("loop", kt_loop_type_name((kt_loop_type)i), loops[i]);
    for (int i = 0; i < (int)(sizeof effects / sizeof *effects); i++)
        kt_check_text("effect", kt_effect_type_name((kt_effect_type)i), effects[i]);
}

KT_TEST(values_that_are_no_type_have_no_name) {
    static const int values[] = {-1, INT_MAX};
    for (int i = 0; i < 2; i++) {
        kt_check_true("joint", kt_joint_type_name((kt_joint_type)values[i]) == NULL);
        kt_check_true("shape", kt_shape_type_name((kt_shape_type)values[i]) == NULL);
        kt_check_true("loop", kt_loop_type_name((kt_loop_type)values[i]) == NULL);
        kt_check_true("effect", kt_effect_type_name((kt_effect_type)values[i]) == NULL);
    }
    kt_check_true("joint count", kt_joint_type_name(KT_JOINT_TYPE_COUNT) == NULL);
    kt_check_true("shape count", kt_shape_type_name(KT_SHAPE_TYPE_COUNT) == NULL);
    kt_check_true("loop count", kt_loop_type_name(KT_LOOP_TYPE_COUNT) == NULL);
    kt_check_true("effect count", kt_effect_type_name(KT_EFFECT_TYPE_COUNT) == NULL);
}

KT_TEST(defaults_are_at_rest_with_axes_z) {
    static const double z[3] = {0.0, 0.0, 1.0}, zero[3] = {0.0, 0.0, 0.0};
    const kt_body body = kt_body_default();
    const kt_loop loop = kt_loop_default();
    kt_check_equal_int("joint", body.joint.type, KT_JOINT_FIXED);
    kt_check_equal_int("shape", body.shape.type, KT_SHAPE_NONE);
    kt_check_true("no name, no parent, no markers", !body.name && !body.parent && !body.markers);
    kt_check_equal_int("marker count", body.marker_count, 0);
    kt_check_equal_bits("joint axis", &body.joint.axis.x, z, 3);
    kt_check_equal_bits("second joint axis is not given", &body.joint.axis2.x, zero, 3);
    kt_check_equal_bits("shape axis", &body.shape.axis.x, z, 3);
    kt_check_equal_bits("loop axis", &loop.axis.x, z, 3);
    kt_check_near("pressure angle of 20 degrees", loop.pressure_angle, 20.0 / 180.0 * 3.14159265358979323846, 1e-16);
    kt_check_equal_bits("second loop axis", &loop.axis2.x, z, 3);
    kt_check_equal_bits("mass", &body.mass, zero, 1);
    kt_check_equal_int("rotation", body.joint.rotation.type, KT_ROTATION_NONE);
    kt_check_equal_int("shape's rotation", body.shape.rotation.type, KT_ROTATION_NONE);
    const kt_end end = kt_end_default();
    kt_check_true("end on the world", !end.body && !end.marker && end.rotation.type == KT_ROTATION_NONE);
    kt_check_equal_int("function of a loop", loop.function.type, KT_FUNCTION_NONE);
    const kt_effect effect = kt_effect_default();
    kt_check_equal_int("function of an effect", effect.torque.type, KT_FUNCTION_NONE);
    const kt_description d = kt_description_default();
    kt_check_equal_bits("gravity", &d.gravity.x, zero, 3);
    kt_check_equal_int("items", d.body_count + d.loop_count + d.effect_count + d.hold_count, 0);
}
