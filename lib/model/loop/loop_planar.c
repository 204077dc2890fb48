/* Planar: the equations of inplane and coaxial; translation along x and y and rotation about z are free. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_planar, KT_KERNEL(kt_loop_planar), 2, 3, kt_row_coaxial, KT_PART_Z, KT_PART_TILT_X,
                KT_PART_TILT_Y)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "the normal of the plane, in the frames of both ends", .needed = false},
};
const kt_descriptor kt_loop_planar_descriptor = {
    .name = "planar",
    .help = "translations in a plane and a rotation about its normal are left free",
    .formula = "the equations of inplane and of coaxial",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: planar, between: [world, box], axis: x}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
