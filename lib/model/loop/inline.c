/* Inline: the second point stays on the first end's z axis; d_x = d_y = 0. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

KT_LOOP_OF_ENDS(evaluate_inline, KT_KERNEL(kt_loop_inline), 0, 2, kt_row_none, KT_PART_X, KT_PART_Y)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "the line, in the frame of the first end", .needed = false},
};
const kt_descriptor kt_loop_inline_descriptor = {
    .name = "inline",
    .help = "the second point stays on a line through the first",
    .formula =
        "e_x . d = 0,  e_y . d = 0    e_x, e_y, e_z = axis: axes of the first end;  d: from its point to the second",
    .example = "bodies:\n"
               "  - name: box\n"
               "    joint: {type: free, position: {position: [-0.1, -0.15, -0.2]}}\n"
               "    mass: 1\n"
               "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n"
               "    markers: {corner: [0.1, 0.15, 0.2]}\n"
               "loops:\n"
               "  - {name: hold, type: inline, between: [world, box.corner], axis: z}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
