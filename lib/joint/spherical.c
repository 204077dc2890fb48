/* Spherical: a quaternion; angular velocity in the body frame. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    out[0] = (kt_element){.motion = KT_MOTION_SPHERICAL, .frame = kt_mat3_identity()};
    return 1;
}

static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    const kt_mat3 *r = &motion->pose.rotation;
    (void)axes;
    kt_measured_quaternion(r, near, q);
    kt_joint_store(v, kt_mat3_apply_transposed(*r, motion->velocity.angular));
    kt_joint_store(a, kt_mat3_apply_transposed(*r, motion->acceleration.angular));
}

static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)axes;
    return (kt_wrench){.moment = kt_mat3_apply(pose->rotation, kt_joint_load(tau))};
}

const kt_joint_kind kt_joint_spherical = {
    .nq = 4, .nv = 3, .elements = elements, .loop = KT_LOOP_SPHERICAL, .measure = measure, .push = push};
