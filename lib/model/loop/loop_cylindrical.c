/* Cylindrical: the equations of inline and coaxial; rotation about z and translation along z are not constrained. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_cylindrical, KT_KERNEL(kt_loop_cylindrical), 0, 2, kt_row_coaxial, KT_PART_X, KT_PART_Y,
                KT_PART_TILT_X, KT_PART_TILT_Y)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frames of both ends", .needed = false},
};
const kt_descriptor kt_loop_cylindrical_descriptor = {
    .name = "cylindrical",
    .help = "a rotation about the axis and a translation along it are left free",
    .formula = "the equations of inline and of coaxial",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: cylindrical, between: [world, box], axis: z}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
