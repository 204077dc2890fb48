/* Free: position in the joint frame and a quaternion; velocity in the joint frame, angular velocity in the body frame.
 * One element, not six: a free link takes nothing from its parent but the wrench, and passes no inertia on. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    out[0] = (kt_element){.motion = KT_MOTION_FREE, .frame = kt_mat3_identity()};
    return 1;
}

static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    const kt_mat3 *r = &motion->pose.rotation;
    (void)axes;
    kt_joint_store(q, motion->pose.position);
    kt_joint_store(v, motion->velocity.linear);
    kt_joint_store(a, motion->acceleration.linear);
    kt_measured_quaternion(r, near + 3, q + 3);
    kt_joint_store(v + 3, kt_mat3_apply_transposed(*r, motion->velocity.angular));
    kt_joint_store(a + 3, kt_mat3_apply_transposed(*r, motion->acceleration.angular));
}

static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)axes;
    return (kt_wrench){.moment = kt_mat3_apply(pose->rotation, kt_joint_load(tau + 3)), .force = kt_joint_load(tau)};
}

const kt_joint_kind kt_joint_free = {
    .nq = 7, .nv = 6, .elements = elements, .loop = KT_LOOP_TYPE_COUNT, .measure = measure, .push = push};
