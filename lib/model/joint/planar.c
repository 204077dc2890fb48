/* Planar: translation along the two in-plane axes e1, e2 of the triad (e1, e2, axis), then rotation about the axis. The
 * translations come first, so that x, y and their rates are components in the triad of the joint frame. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

static int planar_elements(const kt_joint *joint, kt_element *out) {
    const kt_mat3 triad = kt_triad_from_axis(kt_joint_unit(joint->axis), 2);
    for (int k = 0; k < 3; k++)
        out[k] = (kt_element){.motion = k < 2 ? KT_MOTION_PRISMATIC : KT_MOTION_REVOLUTE, .axis = k, .frame = triad};
    return 3;
}

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", "the normal of the plane", .needed = false},
    KT_JOINT_COORDINATE_KEYS("[q1, q2, q3], along e1, along e2, and the angle", "their rates", "[kg, kg, kg m^2]"),
};

const kt_joint_kind kt_joint_planar = {
    .descriptor =
        {
            .name = "planar",
            .help = "translations in a plane and a rotation about its normal",
            .formula = "R = exp(q3 [axis]),  p = q1 e1 + q2 e2    e1, e2, axis: right-handed;  e1, e2 = x, y for axis "
                       "z;  y, z for x;  z, x for y",
            .example = KT_EXAMPLE_JOINT("{type: planar, axis: y, position: [0, 0, 10 deg], velocity: [0, 1, 2]}"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_TRANSLATION, KT_COORDINATE_TRANSLATION, KT_COORDINATE_ANGLE},
    .elements = planar_elements,
    .loop = KT_LOOP_PLANAR};
