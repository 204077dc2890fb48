/* Which parts of a joint's initial state are given: the parts that are not zero, and the parts that `given` names. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

#include <string.h>

static bool all_are_zero(const double *x, int count) {
    static const double zero[KT_JOINT_NQ_MAX] = {0.0};
    return memcmp(x, zero, (size_t)count * sizeof *x) == 0; /* -0 is written as such, and so it is given */
}

/* If a quaternion follows other positions, linear and angular velocity are given each by itself. A joint without
 * coordinates has nothing to give. */
unsigned kt_joint_given(const kt_joint *joint) {
    if (!joint)
        return 0;
    if (kt_joint_type_name(joint->type) == NULL || kt_joint_sizes[joint->type].nv == 0)
        return 0;
    const kt_joint_size *size = &kt_joint_sizes[joint->type];
    const int quaternion = kt_joint_quaternion(joint->type);
    const bool has_quaternion = quaternion >= 0, has_both = quaternion > 0;
    const int plain = has_quaternion ? quaternion : size->nq, linear = has_both ? quaternion : size->nv;
    unsigned given = joint->given & (plain ? KT_GIVEN_POSITION : 0U);
    given |= joint->given & (KT_GIVEN_VELOCITY | (has_both ? KT_GIVEN_ANGULAR : 0U));
    given |= all_are_zero(joint->position, plain) ? 0U : KT_GIVEN_POSITION;
    given |= has_quaternion && !all_are_zero(joint->position + plain, 4) ? KT_GIVEN_ORIENTATION : 0U;
    if (joint->guess)
        given &= ~(unsigned)(KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION);
    given |= all_are_zero(joint->velocity, linear) ? 0U : KT_GIVEN_VELOCITY;
    given |= has_both && !all_are_zero(joint->velocity + linear, 3) ? KT_GIVEN_ANGULAR : 0U;
    return given;
}
