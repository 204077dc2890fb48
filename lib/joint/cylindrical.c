/* Cylindrical: about `axis`, then along it. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_TURN, joint->axis);
    out[1] = kt_element_about(KT_MOTION_SLIDE, joint->axis);
    return 2;
}

const kt_joint_kind kt_joint_cylindrical = {.nq = 2, .nv = 2, .elements = elements};
