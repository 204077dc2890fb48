/* Cylindrical: about `axis`, then along it. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_REVOLUTE, joint->axis);
    out[1] = kt_element_about(KT_MOTION_PRISMATIC, joint->axis);
    return 2;
}

static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    kt_measure_revolute(axes, motion, near[0], q, v, a);
    kt_measure_prismatic(axes->triad.z, motion, q + 1, v + 1, a + 1);
}

static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)pose;
    return (kt_wrench){.moment = kt_vec3_scale(tau[0], axes->triad.z), .force = kt_vec3_scale(tau[1], axes->triad.z)};
}

const kt_joint_kind kt_joint_cylindrical = {
    .nq = 2, .nv = 2, .elements = elements, .loop = KT_LOOP_CYLINDRICAL, .measure = measure, .push = push};
