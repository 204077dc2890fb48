/* Free: position in the joint frame and a quaternion; velocity in the joint frame, angular velocity in the body frame.
 * A free joint is one element, not six: a free link transmits neither force nor inertia to its parent. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static int free_elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    out[0] = (kt_element){.motion = KT_MOTION_FREE, .frame = kt_mat3_identity()};
    return 1;
}

/* Of the two quaternions of the rotation, q receives the nearer to that of `near`. */
static void measure_free(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q,
                         double *v, double *a) {
    const kt_mat3 *r = &motion->pose.rotation;
    (void)axes;
    kt_joint_store(q, motion->pose.position);
    kt_joint_store(v, motion->velocity.linear);
    kt_joint_store(a, motion->acceleration.linear);
    kt_measured_quaternion(r, near + 3, q + 3);
    kt_joint_store(v + 3, kt_mat3_apply_transposed(*r, motion->velocity.angular));
    kt_joint_store(a + 3, kt_mat3_apply_transposed(*r, motion->acceleration.angular));
}

static kt_wrench free_wrench(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)axes;
    return (kt_wrench){.moment = kt_mat3_apply(pose->rotation, kt_joint_load(tau + 3)), .force = kt_joint_load(tau)};
}

static const kt_key keys[] = {
    KT_JOINT_COORDINATE_KEYS("{position: p, orientation: a rotation, as the quaternion q}",
                             "{linear: p' in the joint frame, angular: w in the body frame}", "kg, kg m^2"),
};

const kt_joint_kind kt_joint_free = {
    .descriptor =
        {
            .name = "free",
            .help = "all six degrees of freedom",
            .formula = "R = R(q),  p    q' = q (0, w) / 2",
            .example = "bodies:\n"
                       "  - name: box\n"
                       "    joint:\n"
                       "      type: free\n"
                       "      position: {position: [0, 0, 1], orientation: {rpy: [0, 0, 30 deg]}}\n"
                       "      velocity: {linear: [1, 0, 0], angular: [0, 0.1, 5]}\n"
                       "    mass: 1\n"
                       "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n",
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_TRANSLATION, KT_COORDINATE_TRANSLATION, KT_COORDINATE_TRANSLATION,
                   KT_COORDINATE_ROTATION, KT_COORDINATE_ROTATION, KT_COORDINATE_ROTATION},
    .elements = free_elements,
    .loop = KT_LOOP_TYPE_COUNT,
    .measure = measure_free,
    .wrench = free_wrench};
