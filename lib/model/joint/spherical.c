/* Spherical: a quaternion; angular velocity in the body frame. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static int spherical_elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    out[0] = (kt_element){.motion = KT_MOTION_SPHERICAL, .frame = kt_mat3_identity()};
    return 1;
}

static void measure_spherical(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q,
                              double *v, double *a) {
    const kt_mat3 *r = &motion->pose.rotation;
    (void)axes;
    kt_measured_quaternion(r, near, q);
    kt_joint_store(v, kt_mat3_apply_transposed(*r, motion->velocity.angular));
    kt_joint_store(a, kt_mat3_apply_transposed(*r, motion->acceleration.angular));
}

static kt_wrench spherical_wrench(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)axes;
    return (kt_wrench){.moment = kt_mat3_apply(pose->rotation, kt_joint_load(tau))};
}

static const kt_key keys[] = {
    KT_JOINT_COORDINATE_KEYS("a rotation, as the quaternion q", "w, angular velocity in the body frame", "kg m^2"),
};

const kt_joint_kind kt_joint_spherical = {
    .descriptor =
        {
            .name = "spherical",
            .help = "every rotation about the origin of the joint frame",
            .formula = "R = R(q),  p = 0    q' = q (0, w) / 2",
            .example = "bodies:\n"
                       "  - name: box\n"
                       "    joint:\n"
                       "      type: spherical\n"
                       "      position: {axis: [1, 0, 0], angle: 20 deg}\n"
                       "      velocity: [0, 0, 40]\n"
                       "    mass: 1\n"
                       "    shape: {type: cylinder, radius: 0.2, length: 0.02, at: [0, 0, 0.2]}\n",
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_ROTATION, KT_COORDINATE_ROTATION, KT_COORDINATE_ROTATION},
    .elements = spherical_elements,
    .loop = KT_LOOP_SPHERICAL,
    .measure = measure_spherical,
    .wrench = spherical_wrench};
