/* Screw: one freedom, about `axis`, advancing `pitch` metres a radian along it. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_HELIX, joint->axis);
    out[0].pitch = joint->pitch;
    return 1;
}

const kt_joint_kind kt_joint_screw = {.nq = 1, .nv = 1, .elements = elements};
