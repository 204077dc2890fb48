/* Free: position in the joint frame and a quaternion; velocity in the joint frame, angular velocity in the body frame.
 * One element, not six: a free link takes nothing from its parent but the wrench, and passes no inertia on. */
#include "joint/kind.h"

static int elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    out[0] = (kt_element){.motion = KT_MOTION_FREE, .frame = kt_mat3_identity()};
    return 1;
}

const kt_joint_kind kt_joint_free = {.nq = 7, .nv = 6, .elements = elements};
