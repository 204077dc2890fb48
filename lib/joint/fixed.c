/* Fixed: no freedom; the body shares its parent's link. */
#include "joint/joint.h"

static int elements(const kt_joint *joint, kt_element *out) {
    (void)joint;
    (void)out;
    return 0;
}

const kt_joint_kind kt_joint_fixed = {.nq = 0, .nv = 0, .elements = elements, .loop = KT_LOOP_WELD};
