/* Spherical: a quaternion; angular velocity in the body frame. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    out[0] = (kt_element){.motion = KT_MOTION_BALL, .frame = kt_mat3_identity()};
    return 1;
}

const kt_joint_kind kt_joint_spherical = {.nq = 4, .nv = 3, .elements = elements};
