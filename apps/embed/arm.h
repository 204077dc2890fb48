/* The seven-axis arm of computed_torque.c and of apps/firmware: that of apps/scenes/arm7.yaml, standing instead of
 * hanging. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMBED_ARM_H
#define EMBED_ARM_H

#include <kinetree/kinetree.h>

enum { ARM_JOINTS = 7, ARM_BODIES = 8 };

typedef struct arm_part {
    const char *name;
    char axis;         /* the axis of the joint: 'x', 'y' or 'z' */
    double up;         /* origin above the parent's, m, along the parent's z */
    double mass;       /* kg */
    double com[3];     /* position in the body frame, m */
    double inertia[6]; /* xx, yy, zz, xy, xz, yz about the centre of mass, kg m^2 */
} arm_part;

static const arm_part arm_parts[ARM_BODIES] = {
    {"shoulder_yaw", 'z', 0.15, 4.8, {0, -0.028, 0.122}, {0.0331, 0.0314, 0.0123, 0, 0, 0.0049}},
    {"shoulder_pitch", 'y', 0.19, 4.6, {0, 0.041, 0.062}, {0.0305, 0.0287, 0.0115, 0, 0, -0.0042}},
    {"upper_arm_roll", 'z', 0.21, 3.7, {0, 0.026, 0.131}, {0.0246, 0.0238, 0.0078, 0, 0, -0.0031}},
    {"elbow", 'Y', 0.19, 3.2, {0, 0.034, 0.067}, {0.0176, 0.0164, 0.0061, 0, 0, 0.0027}},
    {"forearm_roll", 'z', 0.21, 2.4, {0.0005, 0.021, 0.076}, {0.0127, 0.0116, 0.0046, 0.0001, 0, 0.0022}},
    {"wrist", 'y', 0.19, 1.9, {0, 0.0006, 0.0009}, {0.0049, 0.0043, 0.0036, 0, 0, 0}},
    {"flange", 'z', 0.08, 0.6, {0, 0, 0.02}, {0.0006, 0.0006, 0.0009, 0, 0, 0}},
    {"tool", '-', 0.045, 1.5, {0.03, 0, 0.06}, {0.0035, 0.0041, 0.0019, 0, 0.0004, 0}},
};

static kt_body arm_body(int i, double scale) {
    const arm_part *p = &arm_parts[i];
    kt_body body = kt_body_default();
    body.name = p->name;
    body.parent = i > 0 ? arm_parts[i - 1].name : NULL;
    body.joint.type = p->axis == '-' ? KT_JOINT_FIXED : KT_JOINT_REVOLUTE;
    body.joint.axis = p->axis == 'y'   ? kt_vec3_make(0.0, 1.0, 0.0)
                      : p->axis == 'Y' ? kt_vec3_make(0.0, -1.0, 0.0)
                                       : kt_vec3_make(0.0, 0.0, 1.0);
    body.joint.at = kt_vec3_make(0.0, 0.0, p->up);
    body.mass = scale * p->mass;
    body.com = kt_vec3_make(p->com[0], p->com[1], p->com[2]);
    body.inertia = kt_sym3_make(scale * p->inertia[0], scale * p->inertia[1], scale * p->inertia[2],
                                scale * p->inertia[3], scale * p->inertia[4], scale * p->inertia[5]);
    return body;
}

/* Compiles the arm. Masses and inertias of body i are those of the table times scale[i]. */
static kt_status arm_compile(const double scale[ARM_BODIES], const kt_effect *effects, int effect_count,
                             kt_model **model, kt_error *error) {
    kt_body bodies[ARM_BODIES];
    kt_description arm = kt_description_default();
    for (int i = 0; i < ARM_BODIES; i++)
        bodies[i] = arm_body(i, scale[i]);
    arm.name = "seven-axis arm";
    arm.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    arm.bodies = bodies;
    arm.body_count = ARM_BODIES;
    arm.effects = effects;
    arm.effect_count = effect_count;
    return kt_model_compile(&arm, NULL, model, error);
}

#endif
