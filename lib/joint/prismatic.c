/* Prismatic: one degree of freedom, translation along `axis`. */
#include "joint/joint.h"

static int prismatic_elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_PRISMATIC, joint->axis);
    return 1;
}

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", KT_WORDS("of the translation"), .needed = false},
    KT_JOINT_FRAME_KEYS,
    {"joint.position", KT_KEY_POSITION, KT_JOINT_AT(position), "", KT_WORDS("q, the length"), .needed = false},
    {"joint.velocity", KT_KEY_VELOCITY, KT_JOINT_AT(velocity), "", KT_WORDS("its rate"), .needed = false},
    KT_JOINT_ARMATURE_KEY("kg"),
};

const kt_joint_kind kt_joint_prismatic = {
    .descriptor =
        {
            .name = "prismatic",
            .help = KT_WORDS("translation along an axis"),
            .formula = KT_WORDS("R = 1,  p = q axis"),
            .example = KT_WORDS("bodies:\n"
                                "  - name: box\n"
                                "    joint: {type: prismatic, axis: [1, 0, -1], velocity: 2}\n"
                                "    mass: 1\n"
                                "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_LENGTH},
    .elements = prismatic_elements,
    .loop = KT_LOOP_PRISMATIC};
