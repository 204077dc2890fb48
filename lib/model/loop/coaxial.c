/* Coaxial: the z axes of both ends have one direction. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_coaxial, KT_KERNEL(kt_loop_coaxial), 0, 0, kt_row_coaxial, KT_PART_TILT_X, KT_PART_TILT_Y)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frames of both ends", .needed = false},
};
const kt_descriptor kt_loop_coaxial_descriptor = {
    .name = "coaxial",
    .help = "the axes of both ends are parallel",
    .formula = "4 tan(theta / 4) h = 0    theta, h: angle and direction of the least rotation from the first axis to "
               "the second",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: coaxial, between: [world, box], axis: z}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
