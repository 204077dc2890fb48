/* Universal: about `axis`, then about `axis2`, which the first turn carries along. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_REVOLUTE, joint->axis);
    out[1] = kt_element_about(KT_MOTION_REVOLUTE, kt_joint_second_axis(joint));
    return 2;
}

/* Left out, the second axis is the one after the first: x after z, y after x, z after y, and likewise in the triad of
 * an axis that is none of these. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint) {
    if (joint->axis2.x != 0.0 || joint->axis2.y != 0.0 || joint->axis2.z != 0.0)
        return joint->axis2;
    return kt_triad_from_axis(kt_joint_unit(joint->axis), 2).x;
}

/* The axes e1, e2 (carried along), c = e1 . e2, and of a vector x in their plane the numbers y with
 * x = y1 e1 + y2 e2: of no other part of x is anything seen. */
static void split(kt_vec3 e1, kt_vec3 e2, kt_vec3 x, double *y) {
    const double c = kt_vec3_dot(e1, e2), x1 = kt_vec3_dot(e1, x), x2 = kt_vec3_dot(e2, x);
    const kt_vec3 n = kt_vec3_cross(e1, e2);
    const double s2 = kt_vec3_dot(n, n);
    y[0] = (x1 - c * x2) / s2;
    y[1] = (x2 - c * x1) / s2;
}

/* R = R1(q1) R2(q2): R leaves e2 where R1 takes it, so R1 is a turn about e1 by the angle between the two, and R1' R
 * one about e2. Rates: w = v1 e1 + v2 e2, w' = a1 e1 + a2 e2 + v1 v2 e1 x e2. */
static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    const double turn = 6.283185307179586;
    const kt_vec3 e1 = axes->triad.z, rest = axes->second, e2 = kt_mat3_apply(motion->pose.rotation, rest);
    const kt_vec3 across = kt_vec3_cross(e1, rest); /* of e2 at rest: normal to e1, and to it */
    const kt_vec3 outward = kt_vec3_cross(across, e1);
    const double first = atan2(kt_vec3_dot(across, e2), kt_vec3_dot(outward, e2));
    q[0] = first + turn * rint((near[0] - first) / turn);
    const kt_mat3 base =
        kt_mat3_multiply(axes->triad, kt_mat3_multiply(kt_matrix_about(2, first), kt_mat3_transpose(axes->triad)));
    const kt_mat3 left = kt_mat3_multiply(kt_mat3_transpose(base), motion->pose.rotation);
    const kt_mat3 triad = kt_triad_from_axis(rest, 2);
    q[1] = kt_measured_angle(&triad, &left, near[1]);
    split(e1, e2, motion->velocity.angular, v);
    split(e1, e2, motion->acceleration.angular, a); /* e1 x e2 does not show */
}

/* m . e1 = tau1, m . e2 = tau2, m in the plane of both */
static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    const kt_vec3 e1 = axes->triad.z, e2 = kt_mat3_apply(pose->rotation, axes->second);
    const kt_vec3 n = kt_vec3_cross(e1, e2);
    const double c = kt_vec3_dot(e1, e2), s2 = kt_vec3_dot(n, n);
    return (kt_wrench){.moment = kt_vec3_add(kt_vec3_scale((tau[0] - c * tau[1]) / s2, e1),
                                             kt_vec3_scale((tau[1] - c * tau[0]) / s2, e2))};
}

const kt_joint_kind kt_joint_universal = {
    .nq = 2, .nv = 2, .elements = elements, .loop = KT_LOOP_UNIVERSAL, .measure = measure, .push = push};
