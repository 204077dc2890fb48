/* Fixed: no degree of freedom; the body is on the link of its parent. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static const kt_key keys[] = {KT_JOINT_FRAME_KEYS};

const kt_joint_kind kt_joint_fixed = {
    .descriptor =
        {
            .name = "fixed",
            .help = "no motion: the body is one rigid part with its parent",
            .formula = "R = 1,  p = 0    R, p: rotation and position of the body frame in the joint frame",
            KT_DESCRIPTOR_KEYS,
            .example =
                "bodies:\n"
                "  - {name: arm, joint: {type: revolute, axis: y}, mass: 1, shape: {type: rod, to: [0.5, 0, 0]}}\n"
                "  - {name: tool, parent: arm, joint: {type: fixed, at: [0.5, 0, 0]}, mass: 0.2, shape: {type: sphere, "
                "radius: 0.05}}\n",
        },
    .loop = KT_LOOP_WELD};
