/* Shared by the joint types: axes, elementary joints about or along an axis, and angles and quaternions measured from a
 * rotation. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

#include "algebra/elementary.h"

kt_vec3 kt_joint_unit(kt_vec3 axis) {
    const int zeros = (axis.x == 0.0) + (axis.y == 0.0) + (axis.z == 0.0);
    return zeros == 2 ? kt_vec3_make(kt_sign_of(axis.x), kt_sign_of(axis.y), kt_sign_of(axis.z))
                      : kt_vec3_normalize(axis);
}

kt_element kt_element_about(kt_motion motion, kt_vec3 axis) {
    const kt_vec3 n = kt_joint_unit(axis);
    const double component[3] = {n.x, n.y, n.z};
    for (int k = 0; k < 3; k++)
        if (component[k] == 1.0 && component[(k + 1) % 3] == 0.0 && component[(k + 2) % 3] == 0.0)
            return (kt_element){.motion = motion, .axis = k, .frame = kt_mat3_identity()};
    return (kt_element){.motion = motion, .axis = 2, .frame = kt_triad_from_axis(n, 2)};
}

/* The default second axis follows the first one: x follows z, y follows x, and z follows y. For any other axis, the
 * second axis is the x axis of the axis' triad. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint) {
    if (joint->axis2.x != 0.0 || joint->axis2.y != 0.0 || joint->axis2.z != 0.0)
        return joint->axis2;
    return kt_triad_from_axis(kt_joint_unit(joint->axis), 2).x;
}

kt_joint_axes kt_joint_axes_of(const kt_joint *joint) {
    kt_joint_axes axes;
    axes.triad = kt_triad_from_axis(kt_joint_unit(joint->axis), 2);
    axes.second = kt_joint_unit(kt_joint_second_axis(joint));
    return axes;
}

/* The angle of the quaternion's part about z, as in loop/loop_screw.c. */
double kt_measured_angle(const kt_mat3 *triad, const kt_mat3 *rotation, double near) {
    const double turn = 6.283185307179586;
    const kt_vec3 x = kt_mat3_apply(*rotation, triad->x), y = kt_mat3_apply(*rotation, triad->y);
    const double angle =
        atan2(kt_vec3_dot(triad->y, x) - kt_vec3_dot(triad->x, y), kt_vec3_dot(triad->x, x) + kt_vec3_dot(triad->y, y));
    return angle + turn * rint((near - angle) / turn);
}

void kt_measured_quaternion(const kt_mat3 *rotation, const double *near, double *q) {
    const kt_quat p = kt_quat_from_mat3(*rotation);
    const double sign = p.w * near[0] + p.x * near[1] + p.y * near[2] + p.z * near[3] < 0.0 ? -1.0 : 1.0;
    q[0] = sign * p.w;
    q[1] = sign * p.x;
    q[2] = sign * p.y;
    q[3] = sign * p.z;
}
