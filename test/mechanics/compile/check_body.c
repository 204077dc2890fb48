/* Every rule of a body, each broken once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>

#include "check.h"
#include "mechanism.h"

#define REJECTS(body, change, sub, field, where, message)                                                              \
    MECHANISM_REJECTS(kt_body *b = &m.bodies[body]; (void)b, change, KT_ITEM_BODY, body, sub, field, where, message)
#define PASSES(what, body, change) MECHANISM_PASSES(kt_body *b = &m.bodies[body]; (void)b, change, what)

static const double nan_value = (double)NAN, infinite = (double)INFINITY;

KT_TEST(sound_mechanism_passes) {
    mechanism m;
    mechanism_fill(&m);
    mechanism_passes("mechanism", &m);
    kt_description empty = kt_description_default();
    kt_check_equal_int("faults of nothing", mechanism_faults(&empty).count, 0);
}

KT_TEST(names_of_bodies_are_checked) {
    REJECTS(BASE, b->name = NULL, -1, "name", "bodies[8]", "name is missing; give it one");
    REJECTS(BASE, b->name = "", -1, "name", "bodies[8]", "name is missing; give it one");
    REJECTS(BASE, b->name = "2nd", -1, "name", "body '2nd'",
            "name '2nd' is not valid; begin with a letter or _, go on with letters, digits, _ and -");
    REJECTS(BASE, b->name = "a\nb", -1, "name", "body 'a?b'",
            "name 'a?b' is not valid; begin with a letter or _, go on with letters, digits, _ and -");
    REJECTS(BASE, b->name = "world", -1, "name", "body 'world'", "name 'world' is that of the ground; choose another");
    REJECTS(BASE, b->name = "crank", -1, "name", "body 'crank'",
            "name 'crank' is that of bodies[0] already; choose another");
    PASSES("case counts in names", BASE, b->name = "Crank");
    PASSES("World is a name", BASE, b->name = "World");
}

/* A joint without a name has that of its body. */
KT_TEST(names_of_joints_are_checked) {
    REJECTS(BASE, b->joint.name = "bird", -1, "joint.name", "body 'base'",
            "name 'bird' is that of the joint of bodies[5] already; choose another");
    REJECTS(BASE, (m.bodies[BIRD].joint.name = "wing", b->joint.name = "wing"), -1, "joint.name", "body 'base'",
            "name 'wing' is that of the joint of bodies[5] already; choose another");
    PASSES("the name of a body whose joint has another", BASE,
           (m.bodies[BIRD].joint.name = "wing", b->joint.name = "bird"));
    PASSES("the name of its own body", BASE, b->joint.name = "base");
}

KT_TEST(numbers_of_a_joint_are_finite) {
    REJECTS(CRANK, b->joint.at.y = nan_value, -1, "joint.at", "body 'crank'",
            "joint.at[1] is nan; give a finite number");
    REJECTS(CRANK, b->joint.at.z = 1e150, -1, "joint.at", "body 'crank'",
            "joint.at[2] is 1e+150, and the equations would overflow; magnitudes end at 1e+50");
    REJECTS(CRANK, b->joint.position[0] = infinite, -1, "joint.position", "body 'crank'",
            "joint.position is inf; give a finite number");
    REJECTS(CRANK, b->joint.velocity[0] = -infinite, -1, "joint.velocity", "body 'crank'",
            "joint.velocity is -inf; give a finite number");
    REJECTS(GIMBAL, b->joint.position[1] = -nan_value, -1, "joint.position", "body 'gimbal'",
            "joint.position[1] is nan; give a finite number");
    REJECTS(BALL, b->joint.velocity[2] = nan_value, -1, "joint.velocity", "body 'ball'",
            "joint.velocity[2] is nan; give a finite number");
    REJECTS(BIRD, b->joint.position[6] = nan_value, -1, "joint.position", "body 'bird'",
            "joint.position[6] is nan; give a finite number");
    REJECTS(BIRD, b->joint.velocity[5] = nan_value, -1, "joint.velocity", "body 'bird'",
            "joint.velocity[5] is nan; give a finite number");
    REJECTS(SCREW, b->joint.pitch = nan_value, -1, "joint.pitch", "body 'screw'",
            "joint.pitch is nan; give a finite number");
    REJECTS(CRANK, b->joint.type = (kt_joint_type)42, -1, "joint.type", "body 'crank'",
            "joint.type is 42, and there is no joint of that number; take one of kt_joint_type");
}

KT_TEST(limits_of_joints_are_possible) {
    REJECTS(CRANK, (b->joint.limits.lower = 1.0, b->joint.limits.upper = 0.5), -1, "joint.limits", "body 'crank'",
            "joint.limits.lower is 1, and joint.limits.upper is 0.5; lower must not be above upper");
    REJECTS(CRANK, b->joint.limits.velocity = -2.0, -1, "joint.limits", "body 'crank'",
            "joint.limits.velocity is -2; it cannot be negative");
    REJECTS(CRANK, b->joint.limits.effort = -3.0, -1, "joint.limits", "body 'crank'",
            "joint.limits.effort is -3; it cannot be negative");
    REJECTS(BALL, b->joint.limits.upper = 1.0, -1, "joint.limits", "body 'ball'",
            "joint.limits are those of a joint with one coordinate, and a spherical joint has 4; leave them out");
    PASSES("limits that leave one position", CRANK, b->joint.limits.lower = b->joint.limits.upper = 0.5);
    PASSES("limits that permit no velocity and no effort", CRANK,
           b->joint.limits.velocity = b->joint.limits.effort = 0.0);
}

KT_TEST(what_a_joint_does_not_read_is_not_checked) {
    PASSES("pitch of a revolute", CRANK, b->joint.pitch = nan_value);
    PASSES("second position of a revolute", CRANK, b->joint.position[1] = nan_value);
    PASSES("second velocity of a revolute", CRANK, b->joint.velocity[1] = nan_value);
    PASSES("fourth velocity of a ball", BALL, b->joint.velocity[3] = nan_value);
    PASSES("axis of a ball", BALL, b->joint.axis = kt_vec3_make(nan_value, 0.0, 0.0));
    PASSES("axis of a fixed body", BASE, b->joint.axis = kt_vec3_make(0.0, 0.0, 0.0));
    PASSES("axis of a free body", BIRD, b->joint.axis = kt_vec3_make(0.0, 0.0, 0.0));
    PASSES("position of a fixed body", BASE, b->joint.position[0] = nan_value);
    PASSES("second axis of a revolute", CRANK, b->joint.axis2 = b->joint.axis);
}

KT_TEST(axes_have_a_direction) {
    static const kt_joint_type types[] = {KT_JOINT_REVOLUTE,    KT_JOINT_PRISMATIC, KT_JOINT_SCREW,
                                          KT_JOINT_CYLINDRICAL, KT_JOINT_PLANAR,    KT_JOINT_UNIVERSAL};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        REJECTS(BASE, (b->joint.type = types[i], b->joint.axis = kt_vec3_make(0.0, -0.0, 0.0)), -1, "joint.axis",
                "body 'base'", "joint.axis is zero; give it a direction, such as [0, 0, 1]");
    REJECTS(CRANK, b->joint.axis.x = nan_value, -1, "joint.axis", "body 'crank'",
            "joint.axis[0] is nan; give a finite number");
    PASSES("axis of any length", CRANK, b->joint.axis = kt_vec3_make(1e-320, 0.0, 0.0));
    const char *parallel = "joint.axis2 is parallel to joint.axis; turn it away (default: the axis after joint.axis)";
    REJECTS(GIMBAL, b->joint.axis2 = kt_vec3_make(0.0, 0.0, -3.0), -1, "joint.axis2", "body 'gimbal'", parallel);
    REJECTS(GIMBAL, b->joint.axis2 = kt_vec3_make(0.0, 1e-309, 1e-300), -1, "joint.axis2", "body 'gimbal'", parallel);
    REJECTS(GIMBAL, b->joint.axis2.y = nan_value, -1, "joint.axis2", "body 'gimbal'",
            "joint.axis2[1] is nan; give a finite number");
    REJECTS(GIMBAL, (b->joint.axis = kt_vec3_make(0.0, 0.0, 0.0), b->joint.axis2.x = 1.0), -1, "joint.axis",
            "body 'gimbal'", "joint.axis is zero; give it a direction, such as [0, 0, 1]");
    PASSES("axis2 not given", GIMBAL, b->joint.axis2 = kt_vec3_make(0.0, 0.0, 0.0));
    PASSES("axes that are not at right angles", GIMBAL, b->joint.axis2 = kt_vec3_make(0.0, 2e-8, 1.0));
}

KT_TEST(rotations_and_quaternions_are_checked) {
    /* The tests of algebra cover the rejected rotations and their messages. */
    const kt_rotation wrong = kt_rotation_euler(314, 0.0, 0.0, 0.0);
    kt_mat3 matrix;
    kt_error error;
    kt_check_true("no rotation", kt_rotation_evaluate(&wrong, &matrix, &error) != KT_OK);
    char message[KT_MESSAGE_SIZE + 20];
    snprintf(message, sizeof message, "joint.rotation: %s", error.message);
    REJECTS(CRANK, b->joint.rotation = wrong, -1, "joint.rotation", "body 'crank'", message);
    const char *half = "joint.position: the quaternion [0.5, 0, 0, 0] has norm 0.5; it must be 1 within 0.001";
    REJECTS(BALL, b->joint.position[0] = 0.5, -1, "joint.position", "body 'ball'", half);
    REJECTS(BIRD, b->joint.position[3] = 0.5, -1, "joint.position", "body 'bird'", half);
    REJECTS(BALL, b->joint.position[0] = 1.0011, -1, "joint.position", "body 'ball'",
            "joint.position: the quaternion [1.0011, 0, 0, 0] has norm 1.0011; it must be 1 within 0.001");
    REJECTS(BALL, b->joint.position[2] = 1e-300, -1, "joint.position", "body 'ball'",
            "joint.position: the quaternion [0, 0, 1e-300, 0] has norm 0; it must be 1 within 0.001");
    PASSES("norm within 1e-3", BALL, b->joint.position[0] = 0.9991);
    PASSES("place of a bird is no quaternion", BIRD, b->joint.position[0] = 7.0);
}

KT_TEST(masses_are_possible) {
    REJECTS(CRANK, b->mass = -1.0, -1, "mass", "body 'crank'", "mass is -1; it cannot be negative");
    REJECTS(CRANK, b->mass = nan_value, -1, "mass", "body 'crank'", "mass is nan; give a finite number");
    REJECTS(CRANK, b->mass = 1e-300, -1, "mass", "body 'crank'",
            "mass is 1e-300, too small to compute with; give 0, or 1e-50 or more");
    REJECTS(CRANK, b->mass = 1e51, -1, "mass", "body 'crank'",
            "mass is 1e+51, and the equations would overflow; magnitudes end at 1e+50");
    PASSES("largest", CRANK, b->mass = 1e50);
    PASSES("smallest", CRANK, b->mass = 1e-50);
    PASSES("no mass, inertia and com all the same", CRANK, (b->mass = 0.0, b->com.x = 1.0));
    REJECTS(CRANK, b->com.x = nan_value, -1, "com", "body 'crank'", "com[0] is nan; give a finite number");
    PASSES("com that the shape replaces", BALL, b->com.x = nan_value);
}

KT_TEST(inertias_are_possible) {
    REJECTS(CRANK, b->inertia.xz = nan_value, -1, "inertia", "body 'crank'", "inertia[4] is nan; give a finite number");
    REJECTS(CRANK, b->inertia = kt_sym3_make(1.0, 2.0, 2.0, 0.0, 0.0, 3.0), -1, "inertia", "body 'crank'",
            "inertia has the principal moments -1, 1, 5; none can be negative: check signs and order (Ixx, Iyy, Izz, "
            "Ixy, Ixz, Iyz)");
    REJECTS(CRANK, b->inertia = kt_sym3_make(1.0, 4.0, 2.5, 0.0, 0.0, 0.0), -1, "inertia", "body 'crank'",
            "inertia has the principal moments 1, 2.5, 4; no body has one above the sum of the two others: check "
            "units and order (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), and that it is about the com");
    REJECTS(CRANK, b->inertia = kt_sym3_make(2e150, 2e150, 2e150, 0.0, 0.0, 0.0), -1, "inertia", "body 'crank'",
            "inertia has the entry 2e+150, and the equations would overflow; magnitudes end at 1e+150");
    REJECTS(CRANK, b->inertia = kt_sym3_make(1e-151, 1e-151, 0.0, 0.0, 0.0, 0.0), -1, "inertia", "body 'crank'",
            "inertia is 1e-151 at most, too small to compute with; give 0, or 1e-150 or more");
    REJECTS(CRANK, b->inertia = kt_sym3_make(1.0, 2.0, 3.027, 0.0, 0.0, 0.0), -1, "inertia", "body 'crank'",
            "inertia has the principal moments 1, 2, 3.027; no body has one above the sum of the two others: "
            "check units and order (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), and that it is about the com; rounded data that "
            "breaks this by up to 1 % is accepted with 'inertia_check: warn'");
    PASSES("0.9 % beyond, accepted", CRANK,
           (m.description.inertia_check = KT_INERTIA_WARN, b->inertia = kt_sym3_make(1.0, 2.0, 3.027, 0.0, 0.0, 0.0)));
    REJECTS(CRANK, m.description.inertia_check = KT_INERTIA_WARN;
            b->inertia = kt_sym3_make(1.0, 2.0, 3.033, 0.0, 0.0, 0.0), -1, "inertia", "body 'crank'",
            "inertia has the principal moments 1, 2, 3.033; no body has one above the sum of the two others: "
            "check units and order (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), and that it is about the com");
    PASSES("inertia that the shape replaces", BALL, b->inertia.xx = nan_value);
    PASSES("plate, equal but for rounding", CRANK, b->inertia = kt_sym3_make(0.1, 0.2, 0.1 + 0.2, 0.0, 0.0, 0.0));
    PASSES("rod", CRANK, b->inertia = kt_sym3_make(1.0, 0.0, 1.0, 0.0, 0.0, 0.0));
    PASSES("none", CRANK, b->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    PASSES("largest", CRANK, b->inertia = kt_sym3_make(1e150, 1e150, 1e150, 0.0, 0.0, 0.0));
    PASSES("smallest", CRANK, b->inertia = kt_sym3_make(1e-150, 1e-150, 0.0, 0.0, 0.0, 0.0));
}

KT_TEST(markers_are_checked) {
    REJECTS(CRANK, b->marker_count = -1; m.effects[COIL].between[1].marker = NULL, -1, "markers", "body 'crank'",
                                         "marker_count is -1; it cannot be negative");
    REJECTS(CRANK, b->markers = NULL; m.effects[COIL].between[1].marker = NULL, -1, "markers", "body 'crank'",
                                      "markers is NULL, and marker_count is 2");
    REJECTS(CRANK, m.tips[0].name = NULL, 0, "markers", "body 'crank'", "markers[0] has no name; give it one");
    REJECTS(CRANK, m.tips[0].name = "", 0, "markers", "body 'crank'", "markers[0] has no name; give it one");
    REJECTS(CRANK, m.tips[0].name = "a.b", 0, "markers", "body 'crank'",
            "marker name 'a.b' is not valid; begin with a letter or _, go on with letters, digits, _ and -");
    REJECTS(CRANK, m.tips[0].name = "heel", 1, "markers", "body 'crank'",
            "marker 'heel' is given twice, first as markers[0]; choose another name");
    REJECTS(CRANK, m.tips[1].at.x = nan_value, 1, "markers", "body 'crank'",
            "markers 'heel'[0] is nan; give a finite number");
    REJECTS(CRANK, m.tips[1].at.y = 1e99, 1, "markers", "body 'crank'",
            "markers 'heel'[1] is 1e+99, and the equations would overflow; magnitudes end at 1e+50");
    REJECTS(CRANK, m.tips[1].at.z = -infinite, 1, "markers", "body 'crank'",
            "markers 'heel'[2] is -inf; give a finite number");
    PASSES("the same name on two bodies", ROCKER, (m.end[0].name = "tip", m.loops[CLOSE].between[1].marker = "tip"));
    PASSES("a marker of its body's name", CRANK, (m.tips[0].name = "crank"));
}
