/* Parallel: equal orientation. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_parallel, KT_KERNEL(kt_loop_parallel), 0, 0, kt_row_parallel, KT_PART_ROTATION_X,
                KT_PART_ROTATION_Y, KT_PART_ROTATION_Z)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
};
const kt_descriptor kt_loop_parallel_descriptor = {
    .name = "parallel",
    .help = "both ends have the same orientation",
    .formula = "4 tan(theta / 4) n = 0    theta n: the rotation from the first frame to the second",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: parallel, between: [world, box]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
