/* Prismatic: one freedom, along `axis`. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_SLIDE, joint->axis);
    return 1;
}

const kt_joint_kind kt_joint_prismatic = {.nq = 1, .nv = 1, .elements = elements};
