/* Prismatic: one degree of freedom, translation along `axis`. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", "of the translation", .needed = false},
    KT_JOINT_COORDINATE_KEYS("q, the length", "its rate", "kg"),
};

const kt_joint_kind kt_joint_prismatic = {
    .descriptor =
        {
            .name = "prismatic",
            .help = "translation along an axis",
            .formula = "R = 1,  p = q axis",
            .example = KT_EXAMPLE_JOINT("{type: prismatic, axis: [1, 0, -1], velocity: 2}"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_LENGTH},
    .loop = KT_LOOP_PRISMATIC};
