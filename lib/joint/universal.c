/* Universal: about `axis`, then about `axis2`, which the first turn carries along. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_TURN, joint->axis);
    out[1] = kt_element_about(KT_MOTION_TURN, kt_joint_second_axis(joint));
    return 2;
}

/* Left out, the second axis is the one after the first: x after z, y after x, z after y, and likewise in the triad of
 * an axis that is none of these. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint) {
    if (joint->axis2.x != 0.0 || joint->axis2.y != 0.0 || joint->axis2.z != 0.0)
        return joint->axis2;
    return kt_triad_from_axis(kt_joint_unit(joint->axis), 2).x;
}

const kt_joint_kind kt_joint_universal = {.nq = 2, .nv = 2, .elements = elements};
