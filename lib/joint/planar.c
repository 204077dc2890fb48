/* Planar: along the two in-plane axes e1, e2 of the triad (e1, e2, axis), then about the axis. The slides come first,
 * so that x, y and their rates are components in the joint frame's triad. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    const kt_mat3 triad = kt_triad_from_axis(kt_joint_unit(joint->axis), 2);
    for (int k = 0; k < 3; k++)
        out[k] = (kt_element){.motion = k < 2 ? KT_MOTION_SLIDE : KT_MOTION_TURN, .axis = k, .frame = triad};
    return 3;
}

const kt_joint_kind kt_joint_planar = {.nq = 3, .nv = 3, .elements = elements};
