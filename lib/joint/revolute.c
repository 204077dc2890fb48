/* Revolute: one degree of freedom, rotation about `axis`. */
#include "joint/joint.h"

static int revolute_elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_REVOLUTE, joint->axis);
    return 1;
}

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", KT_WORDS("of the rotation"), .needed = false},
    KT_JOINT_FRAME_KEYS,
    {"joint.position", KT_KEY_POSITION, KT_JOINT_AT(position), "", KT_WORDS("q, the angle"), .needed = false},
    {"joint.velocity", KT_KEY_VELOCITY, KT_JOINT_AT(velocity), "", KT_WORDS("its rate"), .needed = false},
    KT_JOINT_ARMATURE_KEY("kg m^2"),
};

const kt_joint_kind kt_joint_revolute = {
    .descriptor =
        {
            .name = "revolute",
            .help = KT_WORDS("rotation about an axis"),
            .formula = KT_WORDS("R = exp(q [axis]),  p = 0"),
            .example = KT_WORDS("bodies:\n"
                                "  - {name: box, joint: {type: revolute, axis: y, position: 30 "
                                "deg}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_ANGLE},
    .elements = revolute_elements,
    .loop = KT_LOOP_REVOLUTE};
