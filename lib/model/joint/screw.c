/* Screw: one degree of freedom, rotation about `axis` with an advance along `axis` of `pitch` metres per radian. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", "of the screw", .needed = false},
    {"joint.pitch", KT_KEY_NUMBER, KT_JOINT_AT(pitch), "m/rad", "advance along the axis for each radian",
     .range = KT_RANGE_ANY, .needed = true},
    KT_JOINT_COORDINATE_KEYS("q, the angle", "its rate", "kg m^2"),
};

const kt_joint_kind kt_joint_screw = {
    .descriptor =
        {
            .name = "screw",
            .help = "rotation about an axis, and translation along it in proportion",
            .formula = "R = exp(q [axis]),  p = pitch q axis",
            .example = KT_EXAMPLE_JOINT("{type: screw, axis: z, pitch: 0.02, velocity: 10}"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_TURNS},
    .loop = KT_LOOP_SCREW};
