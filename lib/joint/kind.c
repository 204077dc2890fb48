/* The list of joint types, and the functions that follow from their descriptors. Shared code of the types is in axes.c.
 */
#include "joint/joint.h"

#define KT_JOINT_ENTRY(id, name, nq, nv) [id] = &kt_joint_##name,
const kt_joint_kind *const kt_joint_kinds[KT_JOINT_TYPE_COUNT] = {KT_JOINT_LIST(KT_JOINT_ENTRY)};
#undef KT_JOINT_ENTRY

const kt_descriptor *kt_joint_descriptor(kt_joint_type type) {
    return (unsigned)type < KT_JOINT_TYPE_COUNT ? &kt_joint_kinds[type]->descriptor : NULL;
}

/* The coordinates of a quaternion come last, and are one more than those of its rate. */
kt_coordinate_kind kt_joint_coordinate_kind(kt_joint_type type, int k) {
    if ((unsigned)type >= KT_JOINT_TYPE_COUNT || k < 0 || k >= kt_joint_sizes[type].nq)
        return KT_COORDINATE_NONE;
    const int last = kt_joint_sizes[type].nv - 1;
    return (kt_coordinate_kind)kt_joint_kinds[type]->coordinate[k < last ? k : last];
}

void kt_joint_check(kt_checker *checker, const kt_joint *joint) {
    const kt_joint_kind *kind = kt_joint_kinds[joint->type];
    const kt_joint standard = kt_joint_default();
    kt_checker_keys(checker, &kind->descriptor, joint, &standard);
    if (kind->check != NULL)
        kind->check(checker, joint);
}
