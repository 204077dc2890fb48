/* Universal (Cardan joint): the equations of spherical and orthogonal. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_universal, KT_KERNEL(kt_loop_universal), 0, 3, kt_row_orthogonal, KT_PART_X, KT_PART_Y,
                KT_PART_Z, KT_PART_NORMAL)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frame of the first end", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(axis2), "", "in the frame of the second end", .needed = false},
};
const kt_descriptor kt_loop_universal_descriptor = {
    .name = "universal",
    .help = "Cardan joint: rotations about an axis of either end are left free",
    .formula = "the equations of spherical and of orthogonal",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: universal, between: [world, box.corner], axis: x, axis2: y}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
