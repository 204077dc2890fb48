/* Revolute: one degree of freedom, rotation about `axis`. */
#include "joint/joint.h"

static int revolute_elements(const kt_joint *joint, kt_element *out) {
    out[0] = kt_element_about(KT_MOTION_REVOLUTE, joint->axis);
    return 1;
}

static void measure_revolute(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q,
                             double *v, double *a) {
    kt_measure_revolute(axes, motion, near[0], q, v, a);
}

static kt_wrench revolute_wrench(const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    (void)pose;
    return (kt_wrench){.moment = kt_vec3_scale(tau[0], axes->triad.z)};
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
    .loop = KT_LOOP_REVOLUTE,
    .measure = measure_revolute,
    .wrench = revolute_wrench};
