/* Every key of joints and rotations, and its result in the scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "check.h"
#include "collect.h"
#include "expect.h"

typedef struct joint_row {
    const char *text;
    kt_joint_type type;
    double position[7], velocity[6];
} joint_row;

KT_TEST(joints_take_their_coordinates) {
    static const joint_row table[] = {
        {"{type: fixed}", KT_JOINT_FIXED, {0}, {0}},
        {"{type: revolute, position: -45 deg, velocity: 90 deg}", KT_JOINT_REVOLUTE, {-PI / 4}, {PI / 2}},
        {"{type: prismatic, position: 0.25, velocity: -2}", KT_JOINT_PRISMATIC, {0.25}, {-2}},
        {"{type: screw, pitch: 0.1, position: 1 rad, velocity: 3}", KT_JOINT_SCREW, {1}, {3}},
        {"{type: cylindrical, position: [180 deg, 2], velocity: [3, 4]}", KT_JOINT_CYLINDRICAL, {PI, 2}, {3, 4}},
        {"{type: planar, position: [1, 2, 90 deg], velocity: [4, 5, 180 deg]}",
         KT_JOINT_PLANAR,
         {1, 2, PI / 2},
         {4, 5, PI}},
        {"{type: universal, position: [90 deg, '180 deg'], velocity: [1, 2]}",
         KT_JOINT_UNIVERSAL,
         {PI / 2, PI},
         {1, 2}},
        {"{type: spherical, position: [0.6, 0, 0.8, 0], velocity: [1, 2, 3]}",
         KT_JOINT_SPHERICAL,
         {0.6, 0, 0.8, 0},
         {1, 2, 3}},
        {"{type: spherical, position: {quaternion: [0, -1, 0, 0]}}", KT_JOINT_SPHERICAL, {0, -1, 0, 0}, {0}},
        {"{type: spherical, position: {matrix: [[1, 0, 0], [0, 0, -1], [0, 1, 0]]}}",
         KT_JOINT_SPHERICAL,
         {0.70710678118654757, 0.70710678118654757, 0, 0},
         {0}},
        {"{type: free, position: {position: [1, 2, 3], orientation: [0.6, 0.8, 0, 0]}, "
         "velocity: {linear: [4, 5, 6], angular: [7, 8, 180 deg]}}",
         KT_JOINT_FREE,
         {1, 2, 3, 0.6, 0.8, 0, 0},
         {4, 5, 6, 7, 8, PI}},
        {"{type: free, position: {orientation: {quaternion: [0, 0, 0, 1]}}}",
         KT_JOINT_FREE,
         {0, 0, 0, 0, 0, 0, 1},
         {0}},
        {"{type: free, position: {position: [1, 2, 3]}, velocity: {angular: [0, 0, 1]}}",
         KT_JOINT_FREE,
         {1, 2, 3},
         {0, 0, 0, 0, 0, 1}},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[400];
        snprintf(text, sizeof text, "kinetree: 1\nbodies:\n  - {name: a, joint: %s}\n", table[i].text);
        kt_scene *scene = kt_test_scene(text);
        const kt_joint *joint = &scene->description.bodies[0].joint;
        kt_check_equal_int(table[i].text, joint->type, table[i].type);
        /* Half an ulp of 1/sqrt(2) where a rotation was converted, else to the bit. */
        KT_WORST error = kt_worst_make("coordinates");
        for (int k = 0; k < 7; k++)
            kt_worst_near(&error, joint->position[k], table[i].position[k], i == 9 ? 1.2e-16 : 0.0, "position %d", k);
        for (int k = 0; k < 6; k++)
            kt_worst_near(&error, joint->velocity[k], table[i].velocity[k], 0.0, "velocity %d", k);
    }
}

KT_TEST(armature_is_one_number_or_one_for_each_degree_of_freedom) {
    static const struct {
        const char *text;
        double armature[6];
    } table[] = {
        {"{type: revolute, armature: 0.5}", {0.5}},
        {"{type: revolute, armature: [0.5]}", {0.5}},
        {"{type: screw, pitch: 1, armature: [0.5]}", {0.5}},
        {"{type: cylindrical, armature: 0.5}", {0.5, 0.5}},
        {"{type: planar, armature: [1, 2, 0.25]}", {1, 2, 0.25}},
        {"{type: spherical, armature: 3}", {3, 3, 3}},
        {"{type: free, armature: [1, 2, 3, 4, 5, 6]}", {1, 2, 3, 4, 5, 6}},
        {"{type: prismatic}", {0}},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[400];
        snprintf(text, sizeof text, "kinetree: 1\nbodies:\n  - {name: a, joint: %s}\n", table[i].text);
        kt_scene *scene = kt_test_scene(text);
        KT_WORST error = kt_worst_make(table[i].text);
        for (int k = 0; k < 6; k++)
            kt_worst_near(&error, scene->description.bodies[0].joint.armature[k], table[i].armature[k], 0.0, "%d", k);
    }
}

KT_TEST(axes_are_letters_or_lists) {
    static const struct {
        const char *text;
        double x, y, z;
    } table[] = {{"x", 1, 0, 0},   {"y", 0, 1, 0},   {"z", 0, 0, 1},          {"-x", -1, 0, 0},
                 {"-y", 0, -1, 0}, {"-z", 0, 0, -1}, {"[3, -4, 0]", 3, -4, 0}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[200];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n  - {name: a, joint: {type: universal, axis: %s, axis2: [1, 1, 1]}}\n",
                 table[i].text);
        kt_scene *scene = kt_test_scene(text);
        const kt_joint *joint = &scene->description.bodies[0].joint;
        CHECK_VECTOR(table[i].text, joint->axis, table[i].x, table[i].y, table[i].z);
        CHECK_VECTOR("axis2", joint->axis2, 1, 1, 1);
    }
}

KT_TEST(rotations_are_kept_as_they_are_given) {
    static const struct {
        const char *text;
        kt_rotation_type type;
        int sequence;
        double value[9];
    } table[] = {
        {"{quaternion: [0.6, 0, 0, -0.8]}", KT_ROTATION_QUATERNION, 0, {0.6, 0, 0, -0.8}},
        {"{rpy: [1, 2 rad, 180 deg]}", KT_ROTATION_RPY, 0, {1, 2, PI}},
        {"{euler: {sequence: 313, angles: [1, 90 deg, 3]}}", KT_ROTATION_EULER, 313, {1, PI / 2, 3}},
        {"{euler: {angles: [1, 2, 3], sequence: 121}}", KT_ROTATION_EULER, 121, {1, 2, 3}},
        {"{vector: [0, 0, 90 deg]}", KT_ROTATION_VECTOR, 0, {0, 0, PI / 2}},
        {"{cgr: [1, 2, 3]}", KT_ROTATION_CGR, 0, {1, 2, 3}},
        {"{axis: [0, 3, 4], angle: 90 deg}", KT_ROTATION_AXIS_ANGLE, 0, {0, 3, 4, PI / 2}},
        {"{angle: 1, axis: -z}", KT_ROTATION_AXIS_ANGLE, 0, {0, 0, -1, 1}},
        {"{matrix: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}", KT_ROTATION_MATRIX, 0, {0, -1, 0, 1, 0, 0, 0, 0, 1}},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[300];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n  - {name: a, joint: {type: fixed, rotation: %s}, "
                 "shape: {type: box, size: [1, 2, 3], at: [4, 5, 6], rotation: %s}}\n",
                 table[i].text, table[i].text);
        kt_scene *scene = kt_test_scene(text);
        const kt_rotation *rotation = &scene->description.bodies[0].joint.rotation;
        kt_check_equal_int(table[i].text, rotation->type, table[i].type);
        kt_check_equal_int("sequence", rotation->sequence, table[i].sequence);
        kt_check_equal_bits("value", rotation->value, table[i].value, 9);
        kt_check_true("the same for a shape",
                      kt_same_bytes(rotation, &scene->description.bodies[0].shape.rotation, sizeof *rotation));
    }
}

/* Off by up to 1e-3 in norm: brought to norm one, and not again when it is read once more. */
KT_TEST(quaternions_are_normalised) {
    kt_random random = kt_random_of_test();
    KT_WORST norm = kt_worst_make("norm of a quaternion off by up to 1e-3");
    int moved = 0;
    for (int i = 0; i < 300; i++) {
        double q[4], off = 1.0 + kt_random_uniform(&random, -0.999e-3, 0.999e-3);
        kt_random_direction(&random, 4, q);
        kt_scene *scene = kt_test_scene_of(
            "kinetree: 1\nbodies:\n  - {name: a, joint: {type: spherical, position: [%.17g, %.17g, %.17g, %.17g]}}\n",
            off * q[0], off * q[1], off * q[2], off * q[3]);
        const double *p = scene->description.bodies[0].joint.position;
        /* Five roundings of eps / 2 in each component. */
        kt_worst_near(&norm, sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]), 1.0, 8e-16, "%d", i);
        for (int k = 0; k < 4; k++)
            kt_worst_near(&norm, p[k], q[k], 1.2e-15, "component %d of %d", k, i);
        const char *written = kt_test_written(scene);
        kt_scene *again = kt_test_scene(written);
        moved += !kt_same_bytes(p, again->description.bodies[0].joint.position, 4 * sizeof *p);
    }
    kt_check_equal_int("changed by reading them again", moved, 0);
}
