/* Revolute: the equations of spherical and coaxial; rotation about z is free. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

KT_LOOP_OF_ENDS(evaluate_revolute, KT_KERNEL(kt_loop_revolute), 0, 3, kt_row_coaxial, KT_PART_X, KT_PART_Y, KT_PART_Z,
                KT_PART_TILT_X, KT_PART_TILT_Y)

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frames of both ends", .needed = false},
};
const kt_descriptor kt_loop_revolute_descriptor = {
    .name = "revolute",
    .help = "a rotation about the axis is left free",
    .formula = "the equations of spherical and of coaxial",
    .example = "bodies:\n"
               "  - name: crank\n"
               "    joint: {type: revolute, axis: y, position: -60 deg}\n"
               "    mass: 1\n"
               "    shape: {type: rod, to: [1, 0, 0]}\n"
               "  - name: rod\n"
               "    parent: crank\n"
               "    joint: {type: revolute, axis: y, at: [1, 0, 0], position: 60 deg}\n"
               "    mass: 1\n"
               "    shape: {type: rod, to: [1, 0, 0]}\n"
               "    markers: {end: [1, 0, 0]}\n"
               "  - name: rocker\n"
               "    joint: {type: revolute, axis: y, at: [1, 0, 0], position: -60 deg}\n"
               "    mass: 1\n"
               "    shape: {type: rod, to: [1, 0, 0]}\n"
               "    markers: {end: [1, 0, 0]}\n"
               "loops:\n"
               "  - {name: pin, type: revolute, between: [rod.end, rocker.end], axis: y}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
