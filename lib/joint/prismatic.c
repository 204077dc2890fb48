/* Prismatic: one freedom, along `axis`. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_PRISMATIC, joint->axis);
    return 1;
}

static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    (void)near;
    kt_measure_prismatic(axes->triad.z, motion, q, v, a);
}

static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)pose;
    return (kt_wrench){.force = kt_vec3_scale(tau[0], axes->triad.z)};
}

const kt_joint_kind kt_joint_prismatic = {
    .nq = 1, .nv = 1, .elements = elements, .loop = KT_LOOP_PRISMATIC, .measure = measure, .push = push};
