/* Cylindrical: rotation about `axis`, then translation along this axis. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", "of rotation and translation", .needed = false},
    KT_JOINT_COORDINATE_KEYS("[q1, q2], angle and length", "their rates", "[kg m^2, kg]"),
};

const kt_joint_kind kt_joint_cylindrical = {
    .descriptor =
        {
            .name = "cylindrical",
            .help = "rotation about an axis and translation along it",
            .formula = "R = exp(q1 [axis]),  p = q2 axis",
            .example = KT_EXAMPLE_JOINT("{type: cylindrical, axis: x, position: [20 deg, 0.1], velocity: [3, 1]}"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_ANGLE, KT_COORDINATE_LENGTH},
    .loop = KT_LOOP_CYLINDRICAL};
