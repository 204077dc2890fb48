/* Spherical: the two points coincide; d = 0, in the first end's axes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

KT_LOOP_OF_ENDS(evaluate_spherical, KT_KERNEL(kt_loop_spherical), 0, 3, kt_row_none, KT_PART_X, KT_PART_Y, KT_PART_Z)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
};
const kt_descriptor kt_loop_spherical_descriptor = {
    .name = "spherical",
    .help = "the two points coincide",
    .formula = "d = 0    d: from the first point to the second",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: spherical, between: [world, box.corner]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
