/* URDF of today: quaternions and capsules, infinite bounds, MuJoCo's compiler, masses of meshes, two <inertial>. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"

#define ROBOT "r"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>

static const double pi = 3.14159265358979323846;
static const kt_robot_options plain = {0}, heavy = {.density = 1000.0};

#define INERTIAL(mass, ixx, iyy, izz)                                                                                  \
    "<inertial><mass value='" mass "'/><inertia ixx='" ixx "' iyy='" iyy "' izz='" izz "' ixy='0' ixz='0' iyz='0'/>"   \
    "</inertial>"
#define ARM(before, link, joint)                                                                                       \
    "<robot name='r'>" before "<link name='base'/><link name='arm'>" link "</link><joint name='j' type='revolute'>"    \
    "<parent link='base'/><child link='arm'/><axis xyz='0 1 0'/>" joint "</joint></robot>"
#define LIMITS(lower, upper) "<limit lower='" lower "' upper='" upper "' effort='1' velocity='1'/>"
#define ORIGIN(turn) "<origin xyz='1 2 3' " turn "/>"

/* ---- versions ---------------------------------------------------------------------------------------------------- */

KT_TEST(an_unknown_version_is_reported_once) {
    static const struct {
        const char *attribute;
        bool is_known;
    } table[] = {{"", true},
                 {"version='1.0'", true},
                 {"version='1.1'", true},
                 {"version='1.2'", false},
                 {"version='2'", false},
                 {"version=''", false}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene =
            test_robot_of(&plain, "<robot name='r' %s><link name='a'/></robot>", table[i].attribute);
        kt_check_equal_int(table[i].attribute, count_notes(scene, "of URDF is not known"), table[i].is_known ? 0 : 1);
    }
}

/* The same robot with angles and with quaternions, which may have any length. */
KT_TEST(quaternions_turn_as_angles_do) {
    static const char *const turns[][2] = {
        {"rpy='0 1.5707963267948966 0'", "quat_xyzw='0 0.7071067811865476 0 0.7071067811865476'"},
        {"rpy='0 0 1.5707963267948966'", "quat_xyzw='0 0 -3 -3'"},
        {"rpy='0.5 0 0'", "quat_xyzw='0.24740395925452294 0 0 0.96891242171064478'"},
        {"", "quat_xyzw='0 0 0 1'"}};
    for (size_t i = 0; i < sizeof turns / sizeof *turns; i++) {
        kt_mat3 joint[2];
        kt_sym3 inertia[2];
        for (int k = 0; k < 2; k++) {
            const kt_scene *scene = test_robot_of(
                &plain,
                "<robot name='r' version='1.1'><link name='base'/><link name='arm'><inertial><origin %s/>"
                "<mass value='1'/><inertia ixx='1' iyy='2' izz='2.5' ixy='0' ixz='0' iyz='0'/></inertial></link>"
                "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/><origin "
                "%s/></joint></robot>",
                turns[i][k], turns[i][k]);
            const kt_body *arm = find_body(scene, "arm");
            joint[k] = kt_mat3_identity();
            if (arm->joint.rotation.type != KT_ROTATION_NONE)
                kt_need(
                    kt_check_true("a rotation", kt_rotation_evaluate(&arm->joint.rotation, &joint[k], NULL) == KT_OK));
            inertia[k] = arm->inertia;
        }
        kt_check_near("x of the axes", kt_vec3_norm(kt_vec3_sub(joint[1].x, joint[0].x)), 0.0, 1e-15);
        kt_check_near("y of the axes", kt_vec3_norm(kt_vec3_sub(joint[1].y, joint[0].y)), 0.0, 1e-15);
        kt_check_near("inertia", fabs(inertia[1].xx - inertia[0].xx) + fabs(inertia[1].yz - inertia[0].yz), 0.0, 1e-15);
    }
}

KT_TEST(faulty_quaternions_are_rejected) {
    static const char *const faults_of[][2] = {{"rpy='0 0 1' quat_xyzw='0 0 0 1'", "leave one of them out"},
                                               {"quat_xyzw='0 0 0 0'", "it must be above zero"},
                                               {"quat_xyzw='0 0 1'", "expected four numbers"}};
    for (size_t i = 0; i < sizeof faults_of / sizeof *faults_of; i++) {
        char text[1000];
        kt_scene scene = {0};
        (void)snprintf(text, sizeof text, ARM("", "%s", ORIGIN("%s") LIMITS("0", "1")), INERTIAL("1", "1", "1", "1"),
                       faults_of[i][0]);
        kt_check_equal_int(faults_of[i][0], parse(text, &plain, &scene), KT_ERROR_SCENE);
        kt_check_contains("message", faults.text, faults_of[i][1]);
    }
}

/* The volume of a capsule: a cylinder and two half spheres. It touches a floor with both ends. */
KT_TEST(capsules_weigh_and_touch) {
    static const kt_robot_options options = {.density = 1000.0, .contacts = true, .has_ground = true, .ground = -9.0};
    const double r = 0.1, l = 0.5;
    const kt_scene *scene =
        test_robot(ARM("",
                       "<visual><geometry><capsule radius='.1' length='.5'/></geometry></visual><collision><geometry>"
                       "<capsule radius='.1' length='.5'/></geometry></collision>",
                       LIMITS("-inf", "inf")),
                   &options);
    kt_check_near("mass", find_body(scene, "arm")->mass, 1000.0 * (pi * r * r * l + 4.0 / 3.0 * pi * r * r * r), 1e-12);
    kt_check_equal_int("contacts", scene->description.effect_count, 2);
    kt_check_near("radius", scene->description.effects[0].radius, r, 0.0);
}

/* ---- bounds ------------------------------------------------------------------------------------------------------ */

KT_TEST(bounds_may_be_infinite) {
    static const struct {
        const char *limits;
        double lower, upper;
    } table[] = {{LIMITS("-1", "inf"), -1.0, HUGE_VAL},
                 {LIMITS("-Inf", "2"), -HUGE_VAL, 2.0},
                 {LIMITS("-infinity", "+INFINITY"), -HUGE_VAL, HUGE_VAL},
                 {"<limit lower='0' upper='1' effort='inf' velocity='inf'/>", 0.0, 1.0}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[1000];
        (void)snprintf(text, sizeof text, ARM("", "%s", "%s"), INERTIAL("1", "1", "1", "1"), table[i].limits);
        const kt_joint_limits limits = find_body(test_robot(text, &plain), "arm")->joint.limits;
        kt_check_true("lower", limits.lower == table[i].lower);
        kt_check_true("upper", limits.upper == table[i].upper);
    }
    kt_scene scene = {0};
    kt_check_equal_int("nan", parse(ARM("", INERTIAL("1", "1", "1", "1"), LIMITS("nan", "1")), &plain, &scene),
                       KT_ERROR_SCENE);
    kt_check_contains("message", faults.text, "expected a number or inf, found 'nan'");
    kt_check_equal_int("1e999", parse(ARM("", INERTIAL("1", "1", "1", "1"), LIMITS("0", "1e999")), &plain, &scene),
                       KT_ERROR_SCENE);
    const kt_joint_limits limits =
        find_body(test_robot("<mujoco><worldbody><body name='a'><joint name='j' axis='0 1 0' range='-inf inf'/>"
                             "<geom size='.1' pos='.1 0 0'/></body></worldbody></mujoco>",
                             &plain),
                  "a")
            ->joint.limits;
    kt_check_true("of MJCF", isinf(limits.lower) && isinf(limits.upper));
}

/* A range without a number, such as from inf to inf, has a message with its place. */
KT_TEST(empty_bounds_are_rejected) {
    static const char *const table[] = {
        ARM("", INERTIAL("1", "1", "1", "1"), LIMITS("inf", "inf")),
        ARM("", INERTIAL("1", "1", "1", "1"), LIMITS("-inf", "-inf")),
        "<mujoco><worldbody><body name='a'><joint name='j' range='inf inf'/><geom "
        "size='.1'/></body></worldbody></mujoco>",
        "<mujoco><worldbody><body name='a'><joint name='j' actuatorfrcrange='-inf -inf'/><geom size='.1'/></body>"
        "</worldbody></mujoco>",
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene scene = {0};
        kt_check_equal_int(table[i], parse(table[i], &plain, &scene), KT_ERROR_SCENE);
        kt_check_contains("message", faults.text, "inf there is no number; exchange the signs");
    }
}

/* ---- MuJoCo's compiler, masses ----------------------------------------------------------------------------------- */

#define COMPILER(settings) "<mujoco><compiler " settings "/></mujoco>"

KT_TEST(settings_of_the_compiler_are_obeyed) {
    const kt_body *arm = find_body(
        test_robot(ARM(COMPILER("balanceinertia='true'"), INERTIAL("2", ".5", ".1", ".1"), LIMITS("0", "1")), &plain),
        "arm");
    kt_check_near("balanced", arm->inertia.xx, 0.7 / 3.0, 1e-15);
    kt_check_near("about y", arm->inertia.yy, 0.7 / 3.0, 1e-15);
    arm = find_body(
        test_robot(ARM(COMPILER("boundmass='3' boundinertia='.2'"), INERTIAL("2", ".3", ".1", ".25"), LIMITS("0", "1")),
                   &plain),
        "arm");
    kt_check_near("least mass", arm->mass, 3.0, 0.0);
    kt_check_near("least moment", arm->inertia.yy, 0.2, 1e-15);
    kt_check_near("another moment", arm->inertia.xx, 0.3, 1e-15);
    arm = find_body(
        test_robot(ARM(COMPILER("settotalmass='10'"), INERTIAL("2", ".3", ".2", ".25"), LIMITS("0", "1")), &plain),
        "arm");
    kt_check_near("total mass", arm->mass, 10.0, 1e-14);
    kt_check_near("its moment", arm->inertia.xx, 1.5, 1e-14);
    arm = find_body(test_robot(ARM(COMPILER("inertiafromgeom='true'"),
                                   INERTIAL("2", ".3", ".2", ".25") "<collision><geometry><box size='.1 .2 .3'/>"
                                                                    "</geometry></collision>",
                                   LIMITS("0", "1")),
                               &plain),
                    "arm");
    kt_check_near("mass of the collision", arm->mass, 6.0, 1e-14);
    kt_check_near("its moment", arm->inertia.xx, 6.0 * (0.04 + 0.09) / 12.0, 1e-15);
}

/* A tetrahedron of the corners 0, x, y, z with edges of 1 m and the volume 1/6, beside a cube of 0.001 m^3. */
KT_TEST(meshes_next_to_boxes_have_mass) {
    static const char stl[] =
        "solid t\n"
        "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n"
        "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
        "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\n"
        "facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n"
        "endsolid t\n";
    static const char box[] = "<visual><geometry><box size='.1 .1 .1'/></geometry></visual>";
    const char *folder = kt_test_folder();
    char text[2000];
    (void)kt_test_file(folder, "t.stl", stl);
    for (int both = 0; both < 2; both++) {
        (void)snprintf(text, sizeof text,
                       ARM("", "%s<visual><geometry><mesh filename='t.stl'/></geometry></visual>", LIMITS("0", "1")),
                       both ? box : "");
        const kt_body *arm = find_body(test_robot_file(kt_test_file(folder, "r.urdf", text), &heavy), "arm");
        const double mesh = 1000.0 / 6.0, mass = mesh + both;
        kt_check_near("mass", arm->mass, mass, 1e-12 * mass);
        kt_check_near("centre", arm->com.x, 0.25 * mesh / mass, 1e-13);
    }
    (void)snprintf(text, sizeof text,
                   ARM("", "%s<visual><geometry><mesh filename='none.stl'/></geometry></visual>", LIMITS("0", "1")),
                   box);
    const kt_scene *scene = test_robot_file(kt_test_file(folder, "n.urdf", text), &heavy);
    kt_check_near("without the mesh", find_body(scene, "arm")->mass, 1.0, 1e-14);
    kt_check_true("a warning", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "left out of the mass"));
}

KT_TEST(a_second_inertial_is_a_warning) {
    const kt_scene *scene =
        test_robot(ARM("", INERTIAL("2", "1", "1", "1") INERTIAL("5", "1", "1", "1"), LIMITS("0", "1")), &plain);
    kt_check_near("the first counts", find_body(scene, "arm")->mass, 2.0, 0.0);
    kt_check_true("a warning", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "several <inertial>"));
    scene = test_robot(ARM("", INERTIAL("2", "1", "1", "1"), LIMITS("0", "1")), &plain);
    kt_check_true("one is none", !has_note(scene, "several <inertial>"));
}

KT_TEST(each_renamed_joint_is_named) {
    const kt_scene *scene =
        test_robot("<robot name='r'><link name='a'/><link name='b'/><link name='c'/>"
                   "<joint name='left elbow' type='continuous'><parent link='a'/><child link='b'/></joint>"
                   "<joint name='right/elbow' type='continuous'><parent link='a'/><child link='c'/></joint>"
                   "</robot>",
                   &plain);
    kt_check_true("the first", has_ranked_note(scene, KT_NOTE_RANK_NAME, "joint 'left elbow' is called 'left_elbow'"));
    kt_check_true("the second",
                  has_ranked_note(scene, KT_NOTE_RANK_NAME, "joint 'right/elbow' is called 'right_elbow'"));
}
