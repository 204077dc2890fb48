/* Screw: one degree of freedom, rotation about `axis` with an advance of `pitch` metres a radian along it. */
#include "joint/joint.h"

static int screw_elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_SCREW, joint->axis);
    out[0].pitch = joint->pitch;
    return 1;
}

static const kt_key keys[] = {
    {"joint.axis", KT_KEY_AXIS, KT_JOINT_AT(axis), "", KT_WORDS("of the screw"), .needed = false},
    {"joint.pitch", KT_KEY_NUMBER, KT_JOINT_AT(pitch), "m/rad", KT_WORDS("advance along the axis for each radian"),
     .range = KT_RANGE_ANY, .needed = true},
    KT_JOINT_FRAME_KEYS,
    {"joint.position", KT_KEY_POSITION, KT_JOINT_AT(position), "", KT_WORDS("q, the angle"), .needed = false},
    {"joint.velocity", KT_KEY_VELOCITY, KT_JOINT_AT(velocity), "", KT_WORDS("its rate"), .needed = false},
    KT_JOINT_ARMATURE_KEY("kg m^2"),
};

const kt_joint_kind kt_joint_screw = {
    .descriptor =
        {
            .name = "screw",
            .help = KT_WORDS("rotation about an axis, and translation along it in proportion"),
            .formula = KT_WORDS("R = exp(q [axis]),  p = pitch q axis"),
            .example = KT_WORDS("bodies:\n"
                                "  - name: box\n"
                                "    joint: {type: screw, axis: z, pitch: 0.02, velocity: 10}\n"
                                "    mass: 1\n"
                                "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n"),
            KT_DESCRIPTOR_KEYS,
        },
    .coordinate = {KT_COORDINATE_TURNS},
    .elements = screw_elements,
    .loop = KT_LOOP_SCREW};
