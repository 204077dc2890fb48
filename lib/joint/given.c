/* Which parts of a joint's initial state are given: what is not zero is, and what `given` names. */
#include "joint/joint.h"

#include <string.h>

static bool is_zero(const double *x, int count) {
    static const double zero[KT_JOINT_NQ_MAX] = {0.0};
    return memcmp(x, zero, (size_t)count * sizeof *x) == 0; /* -0 is written as such, and so it is given */
}

/* Fixed joints have nothing that could be given. */
unsigned kt_joint_given(const kt_joint *joint) {
    if (kt_joint_type_name(joint->type) == NULL || joint->type == KT_JOINT_FIXED)
        return 0;
    const kt_joint_kind *kind = kt_joint_kinds[joint->type];
    const bool is_free = joint->type == KT_JOINT_FREE, has_quaternion = kind->nq > kind->nv;
    const int plain = has_quaternion ? kind->nq - 4 : kind->nq, linear = is_free ? 3 : kind->nv;
    unsigned given = joint->given & (plain ? KT_GIVEN_POSITION : 0U);
    given |= joint->given & (KT_GIVEN_VELOCITY | (is_free ? KT_GIVEN_ANGULAR : 0U));
    given |= is_zero(joint->position, plain) ? 0U : KT_GIVEN_POSITION;
    given |= has_quaternion && !is_zero(joint->position + plain, 4) ? KT_GIVEN_ORIENTATION : 0U;
    given |= is_zero(joint->velocity, linear) ? 0U : KT_GIVEN_VELOCITY;
    given |= is_free && !is_zero(joint->velocity + linear, 3) ? KT_GIVEN_ANGULAR : 0U;
    return given;
}
