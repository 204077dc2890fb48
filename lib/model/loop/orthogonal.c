/* Orthogonal: the first end's z axis is normal to the second's. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_orthogonal, KT_KERNEL(kt_loop_orthogonal), 0, 0, kt_row_orthogonal, KT_PART_NORMAL)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frame of the first end", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(axis2), "", "in the frame of the second end", .needed = false},
};
const kt_descriptor kt_loop_orthogonal_descriptor = {
    .name = "orthogonal",
    .help = "the axes of both ends are at right angles",
    .formula = "2 tan(eps / 2) = 0    eps: the angle that is missing to a right one",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: orthogonal, between: [world, box], axis: x, axis2: y}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
