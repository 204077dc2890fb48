/* Weld: the equations of spherical and parallel; no degree of freedom is left. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_weld, KT_KERNEL(kt_loop_weld), 0, 3, kt_row_parallel, KT_PART_X, KT_PART_Y, KT_PART_Z,
                KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
};
const kt_descriptor kt_loop_weld_descriptor = {
    .name = "weld",
    .help = "both ends are one rigid part",
    .formula = "the equations of spherical and of parallel",
    .example = "bodies:\n"
               "  - name: left\n"
               "    joint: {type: revolute, axis: y, position: 10 deg}\n"
               "    mass: 1\n"
               "    shape: {type: rod, to: [1, 0, 0]}\n"
               "    markers: {end: [1, 0, 0]}\n"
               "  - name: right\n"
               "    parent: left\n"
               "    joint: {type: spherical, at: [1, 0, 0]}\n"
               "    mass: 1\n"
               "    shape: {type: box, size: [0.2, 0.2, 0.2]}\n"
               "loops:\n"
               "  - {name: glue, type: weld, between: [left.end, right]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
