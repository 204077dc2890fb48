/* Cylindrical: rotation about `axis`, then translation along it. */
#include "joint/joint.h"

static int cylindrical_elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_REVOLUTE, joint->axis);
    out[1] = kt_element_about(KT_MOTION_PRISMATIC, joint->axis);
    return 2;
}

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", KT_WORDS("of rotation and translation"), .needed = false},
    KT_JOINT_FRAME_KEYS,
    {"joint.position", KT_KEY_POSITION, KT_JOINT_AT(position), "", KT_WORDS("[q1, q2], angle and length"),
     .needed = false},
    {"joint.velocity", KT_KEY_VELOCITY, KT_JOINT_AT(velocity), "", KT_WORDS("their rates"), .needed = false},
    KT_JOINT_ARMATURE_KEY("[kg m^2, kg]"),
};

const kt_joint_kind kt_joint_cylindrical = {
    .descriptor =
        {
            .name = "cylindrical",
            .help = KT_WORDS("rotation about an axis and translation along it"),
            .formula = KT_WORDS("R = exp(q1 [axis]),  p = q2 axis"),
            .example = KT_WORDS("bodies:\n"
                                "  - name: box\n"
                                "    joint: {type: cylindrical, axis: x, position: [20 deg, 0.1], velocity: [3, 1]}\n"
                                "    mass: 1\n"
                                "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_ANGLE, KT_COORDINATE_LENGTH},
    .elements = cylindrical_elements,
    .loop = KT_LOOP_CYLINDRICAL};
