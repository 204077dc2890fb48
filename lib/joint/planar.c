/* Planar: along the two in-plane axes e1, e2 of the triad (e1, e2, axis), then about the axis. The slides come first,
 * so that x, y and their rates are components in the joint frame's triad. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    const kt_mat3 triad = kt_triad_from_axis(kt_joint_unit(joint->axis), 2);
    for (int k = 0; k < 3; k++)
        out[k] = (kt_element){.motion = k < 2 ? KT_MOTION_PRISMATIC : KT_MOTION_REVOLUTE, .axis = k, .frame = triad};
    return 3;
}

static void measure(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a) {
    kt_measure_prismatic(axes->triad.x, motion, q, v, a);
    kt_measure_prismatic(axes->triad.y, motion, q + 1, v + 1, a + 1);
    kt_measure_revolute(axes, motion, near[2], q + 2, v + 2, a + 2);
}

static kt_wrench push(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    const kt_mat3 *e = &axes->triad;
    (void)pose;
    return (kt_wrench){.moment = kt_vec3_scale(tau[2], e->z),
                       .force = kt_vec3_add(kt_vec3_scale(tau[0], e->x), kt_vec3_scale(tau[1], e->y))};
}

const kt_joint_kind kt_joint_planar = {
    .nq = 3, .nv = 3, .elements = elements, .loop = KT_LOOP_PLANAR, .measure = measure, .push = push};
