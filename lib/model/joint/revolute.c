/* Revolute: one degree of freedom, rotation about `axis`. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", "of the rotation", .needed = false},
    KT_JOINT_COORDINATE_KEYS("q, the angle", "its rate", "kg m^2"),
};

const kt_joint_kind kt_joint_revolute = {.descriptor =
                                             {
                                                 .name = "revolute",
                                                 .help = "rotation about an axis",
                                                 .formula = "R = exp(q [axis]),  p = 0",
                                                 .example =
                                                     "bodies:\n"
                                                     "  - {name: box, joint: {type: revolute, axis: y, position: 30 "
                                                     "deg}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n",
                                                 KT_DESCRIPTOR_KEYS,
                                             },
                                         .coordinate = {KT_COORDINATE_ANGLE},
                                         .loop = KT_LOOP_REVOLUTE};
