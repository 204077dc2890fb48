/* Universal: a rotation about `axis`, then one about `axis2`, which the first carries along. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

/* Two axes whose sine is smaller are taken for parallel: their joint would turn about one axis to half the digits of a
 * double. */
static const double least_sine = 1e-8;

static double sine_between(kt_vec3 a, kt_vec3 b) {
    return kt_vec3_norm(kt_vec3_cross(kt_vec3_normalize(a), kt_vec3_normalize(b)));
}

static void universal_check(kt_checker *checker, const kt_joint *joint) {
    if (kt_axis_is_fine(joint->axis) && kt_axis_is_fine(joint->axis2) &&
        !(sine_between(joint->axis, joint->axis2) >= least_sine))
        kt_checker_fault(checker, "joint.axis2", -1,
                         "joint.axis2 is parallel to joint.axis; turn it away (default: the axis after joint.axis)");
}

static int universal_elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_REVOLUTE, joint->axis);
    out[1] = kt_element_about(KT_MOTION_REVOLUTE, kt_joint_second_axis(joint));
    return 2;
}

/* Computes the numbers y with x = y1 e1 + y2 e2, for the axes e1 and e2 (carried along), with c = e1 . e2. The vector x
 * lies in the plane of the axes; a part of x normal to that plane does not count. */
static void split_along_axes(kt_vec3 e1, kt_vec3 e2, kt_vec3 x, double *y) {
    const double c = kt_vec3_dot(e1, e2), x1 = kt_vec3_dot(e1, x), x2 = kt_vec3_dot(e2, x);
    const kt_vec3 n = kt_vec3_cross(e1, e2);
    const double s2 = kt_vec3_dot(n, n);
    y[0] = (x1 - c * x2) / s2;
    y[1] = (x2 - c * x1) / s2;
}

/* R = R1(q1) R2(q2). R2 does not move e2, so R e2 = R1 e2, and q1 is the angle about e1 from e2 to R e2. Then R1' R =
 * R2 is the rotation about e2. Rates:
 *     w  = v1 e1 + v2 e2
 *     w' = a1 e1 + a2 e2 + v1 v2 e1 x e2 */
static void measure_universal(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q,
                              double *v, double *a) {
    const double turn = 6.283185307179586;
    const kt_vec3 e1 = axes->triad.z, rest = axes->second, e2 = kt_mat3_apply(motion->pose.rotation, rest);
    const kt_vec3 across = kt_vec3_cross(e1, rest); /* normal to e1 and to e2 at q = 0 */
    const kt_vec3 outward = kt_vec3_cross(across, e1);
    const double first = atan2(kt_vec3_dot(across, e2), kt_vec3_dot(outward, e2));
    q[0] = first + turn * rint((near[0] - first) / turn);
    const kt_mat3 base =
        kt_mat3_multiply(axes->triad, kt_mat3_multiply(kt_mat3_about(2, first), kt_mat3_transpose(axes->triad)));
    const kt_mat3 left = kt_mat3_multiply(kt_mat3_transpose(base), motion->pose.rotation);
    const kt_mat3 triad = kt_triad_from_axis(rest, 2);
    q[1] = kt_measured_angle(&triad, &left, near[1]);
    split_along_axes(e1, e2, motion->velocity.angular, v);
    split_along_axes(e1, e2, motion->acceleration.angular, a); /* e1 x e2 is normal to both */
}

/* m . e1 = tau1, m . e2 = tau2, m in the plane of both */
static kt_wrench universal_wrench(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    const kt_vec3 e1 = axes->triad.z, e2 = kt_mat3_apply(pose->rotation, axes->second);
    const kt_vec3 n = kt_vec3_cross(e1, e2);
    const double c = kt_vec3_dot(e1, e2), s2 = kt_vec3_dot(n, n);
    return (kt_wrench){.moment = kt_vec3_add(kt_vec3_scale((tau[0] - c * tau[1]) / s2, e1),
                                             kt_vec3_scale((tau[1] - c * tau[0]) / s2, e2))};
}

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", "of the first rotation", .needed = false},
    {"joint.axis2", KT_KEY_AXIS, KT_JOINT_AT(axis2), "", "of the second rotation, carried along by the first",
     "the axis after 'axis'", .needed = false},
    KT_JOINT_COORDINATE_KEYS("[q1, q2], the angles", "their rates", "kg m^2"),
};

const kt_joint_kind kt_joint_universal = {
    .descriptor =
        {
            .name = "universal",
            .help = "rotation about an axis, then about a second one: Cardan joint",
            .formula = "R = exp(q1 [axis]) exp(q2 [axis2]),  p = 0    the axis after z is x, after x y, after y z",
            .example = "bodies:\n"
                       "  - name: box\n"
                       "    joint: {type: universal, axis: x, axis2: y, position: [20 deg, 40 deg]}\n"
                       "    mass: 1\n"
                       "    shape: {type: box, size: [0.1, 0.1, 1], at: [0, 0, -0.5]}\n",
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_ANGLE, KT_COORDINATE_ANGLE},
    .check = universal_check,
    .elements = universal_elements,
    .loop = KT_LOOP_UNIVERSAL,
    .measure = measure_universal,
    .wrench = universal_wrench};
