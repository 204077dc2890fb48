/* Prismatic: the equations of inline and parallel; translation along z is free. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_prismatic, KT_KERNEL(kt_loop_prismatic), 0, 2, kt_row_parallel, KT_PART_X, KT_PART_Y,
                KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frame of the first end", .needed = false},
};
const kt_descriptor kt_loop_prismatic_descriptor = {
    .name = "prismatic",
    .help = "a translation along the axis is left free",
    .formula = "the equations of inline and of parallel",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: prismatic, between: [world, box], axis: z}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
