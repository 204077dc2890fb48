/* The layout of a group's matrices. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/group.h"

size_t kt_group_layout(kt_group *group) {
    const size_t m = (size_t)group->v_count, k = (size_t)group->row_count;
    const size_t n = group->has_fronts ? 0 : m, s = n < k ? n : k;
    size_t used = 0, *at = group->at;
#define KT_GROUP_PLACE(name, count, meaning)                                                                           \
    *at++ = used;                                                                                                      \
    used += ((count) + 7) / 8 * 8;
    KT_GROUP_FIELDS(KT_GROUP_PLACE)
#undef KT_GROUP_PLACE
    return used;
}
