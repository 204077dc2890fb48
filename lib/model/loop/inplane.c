/* Inplane: the second point stays in the plane through the first, normal to its z axis; d_z = 0. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

KT_LOOP_OF_ENDS(evaluate_inplane, KT_KERNEL(kt_loop_inplane), 2, 3, kt_row_none, KT_PART_Z)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "the normal of the plane, in the frame of the first end",
     .needed = false},
};
const kt_descriptor kt_loop_inplane_descriptor = {
    .name = "inplane",
    .help = "the second point stays in a plane through the first",
    .formula = "e_z . d = 0    e_z = axis, of the first end;  d: from its point to the second",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: inplane, between: [world, box], axis: x}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
