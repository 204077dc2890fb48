/* Screw: one freedom, about `axis`, advancing `pitch` metres a radian along it. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_SCREW, joint->axis);
    out[0].pitch = joint->pitch;
    return 1;
}

static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    kt_measure_revolute(axes, motion, near[0], q, v, a);
}

static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)pose;
    return (kt_wrench){.moment = kt_vec3_scale(tau[0], axes->triad.z)};
}

const kt_joint_kind kt_joint_screw = {
    .nq = 1, .nv = 1, .elements = elements, .loop = KT_LOOP_SCREW, .measure = measure, .push = push};
