/* Models in MJCF: the result of each element, copies, warnings, and faults at their places. Numbers of
 * trees, forces and equalities are compared with MuJoCo in mjcf_mujoco.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.xml"
#include "mjcf_text.h"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- what becomes of a model ------------------------------------------------------------------------------------- */

KT_TEST(single_joint_at_the_origin_is_that_of_its_body) {
    kt_scene *scene = test_robot(
        WORLD("<body name='a' pos='1 2 3'><joint name='j' axis='0 1 0' armature='0.5'/>" BALL "</body>"), NULL);
    const kt_body *a = find_body(scene, "a");
    kt_check_equal_int("bodies", scene->description.body_count, 1);
    kt_check_equal_int("type", a->joint.type, KT_JOINT_REVOLUTE);
    kt_check_equal_bits("place", &a->joint.at.x, (const double[]){1.0, 2.0, 3.0}, 3);
    kt_check_equal_bits("armature", &a->joint.armature[0], &(double){0.5}, 1);
    kt_check_near("mass", a->mass, 4.0 / 3.0 * acos(-1.0), 1e-15);
}

KT_TEST(further_joints_of_a_body_and_those_off_its_origin_have_bodies_of_their_own) {
    kt_scene *scene = test_robot(
        WORLD("<body name='a'><joint name='x' axis='1 0 0'/><joint name='y' pos='0 0 1'/>" BALL "</body>"), NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 3);
    kt_check_text("y is on x", find_body(scene, "y")->parent, "x");
    kt_check_text("a is on y", find_body(scene, "a")->parent, "y");
    kt_check_equal_int("fixed", find_body(scene, "a")->joint.type, KT_JOINT_FIXED);
    kt_check_equal_bits("back at the origin", &find_body(scene, "a")->joint.at.x, (const double[]){-0.0, -0.0, -1.0},
                        3);
    kt_check_equal_bits("without mass", &find_body(scene, "y")->mass, &(double){0.0}, 1);
}

/* The mass matrix at the start, by the compiled model. */
static int mass_of(const char *text, double *matrix) {
    const kt_opened robot = kt_test_open(test_robot(text, NULL), NULL);
    const int nv = kt_model_nv(robot.model);
    kt_error error = {0};
    double q[64], v[8];
    kt_need(kt_check_below("degrees of freedom", nv, 8));
    kt_model_initial(robot.model, q, v);
    kt_need_fine("mass", kt_dynamics_mass(robot.model, robot.data, q, matrix, &error), &error);
    return nv;
}

/* Two texts that describe the same mechanism. */
static void check_same(const char *what, const char *one, const char *other) {
    double a[64], b[64];
    KT_WORST worst = kt_worst_make(what);
    const int n = mass_of(one, a);
    if (kt_check_equal_int("degrees of freedom", n, mass_of(other, b)) && kt_check_above("of both", n, 0.5))
        for (int i = 0; i < n * n; i++)
            kt_worst_near(&worst, a[i], b[i], 64.0 * DBL_EPSILON * fmax(fabs(b[i]), 1.0), "%d", i);
}

#define ARM(placing, extra)                                                                                            \
    "<body name='a' " placing                                                                                          \
    "><joint name='j' axis='1 2 3'/><geom type='box' size='0.1 0.2 0.3' pos='0.3 0 0'/>" extra "</body>"

KT_TEST(frames_stand_where_bodies_written_by_hand_do) {
    check_same("a frame", WORLD("<frame pos='1 2 3' euler='0 0 90'>" ARM("pos='1 0 0'", "") "</frame>"),
               WORLD(ARM("pos='1 3 3' euler='0 0 90'", "")));
    check_same("what is in a frame of a body",
               WORLD("<body><frame pos='0 1 0' euler='90 0 0'><joint axis='0 1 0'/><geom size='0.1 0.2' type='capsule' "
                     "pos='1 0 0'/></frame></body>"),
               WORLD("<body><joint axis='0 0 1' pos='0 1 0'/><geom size='0.1 0.2' type='capsule' pos='1 1 0' euler='90 "
                     "0 0'/></body>"));
}

#define IN_CLASS(attributes, own)                                                                                      \
    "<mujoco><default><geom type='box' " attributes "/></default><worldbody><body><joint axis='1 2 3'/><geom " own     \
    "/></body></worldbody></mujoco>"
#define LINE "size='0.1 0.2 0.3' pos='0.3 0 0' "

/* Of orientations, the innermost counts. MuJoCo prefers all others to a quat. */
KT_TEST(numbers_and_orientations_of_an_element_count_before_those_of_its_class) {
    check_same("fewer numbers", IN_CLASS("size='0.5 0.2 0.3'", "size='0.1' pos='0.3 0 0'"), IN_CLASS("", LINE));
    check_same("xyaxes", IN_CLASS("euler='10 20 30'", LINE "xyaxes='0 1 0 1 0 1'"),
               IN_CLASS("", LINE "xyaxes='0 1 0 1 0 1'"));
    check_same("axisangle", IN_CLASS("zaxis='1 1 0'", LINE "axisangle='1 2 3 40'"),
               IN_CLASS("", LINE "axisangle='1 2 3 40'"));
    check_same("zaxis", IN_CLASS("euler='10 20 30'", LINE "zaxis='1 1 0'"), IN_CLASS("", LINE "zaxis='1 1 0'"));
    check_same("quat", IN_CLASS("zaxis='1 1 0'", LINE "quat='1 2 3 4'"), IN_CLASS("", LINE "zaxis='1 1 0'"));
}

KT_TEST(joints_keep_their_names_and_limits) {
    kt_scene *scene =
        test_robot(WORLD("<body name='a'><joint name='hip' range='-90 45' limited='true' actuatorfrcrange='-20 30' "
                         "actuatorfrclimited='true'/>" BALL "<body name='b'><joint name='a' type='slide'/>" BALL
                         "<body name='c'><joint/>" BALL "</body></body></body>"),
                   NULL);
    const kt_joint *hip = &scene->description.bodies[0].joint;
    kt_check_text("its own", hip->name, "hip");
    kt_check_near("lower", hip->limits.lower, -1.5707963267948966, 1e-15);
    kt_check_near("upper", hip->limits.upper, 0.78539816339744828, 1e-15);
    kt_check_near("effort", hip->limits.effort, 30.0, 1e-15);
    kt_check_text("that of another body, whose joint has its own", scene->description.bodies[1].joint.name, "a");
    kt_check_true("none: that of the body", scene->description.bodies[2].joint.name == NULL);
}

KT_TEST(keyframe_is_the_start_and_gives_controls) {
    static const char text[] =
        "<mujoco><worldbody><body name='f' pos='1 1 1'><freejoint/>" BALL "</body><body name='a'><joint name='a' "
        "ref='30'/>" BALL "<body name='b'><joint type='ball'/>" BALL
        "</body></body></worldbody><actuator><motor name='m' "
        "joint='a' gear='3'/><position joint='a' kp='4' gear='2'/></actuator><keyframe><key name='other'/><key "
        "name='k' "
        "qpos='1 2 3 0 1 0 0 0.5 0 0 1 0' qvel='1 2 3 4 5 6 7 8 9 10' ctrl='0.25 0.5'/></keyframe></mujoco>";
    const kt_robot_options options = {.keyframe = "k"};
    kt_scene *scene = test_robot(text, &options);
    const kt_body *f = find_body(scene, "f");
    kt_check_equal_bits("free", f->joint.position, (const double[]){1, 2, 3, 0, 1, 0, 0}, 7);
    kt_check_equal_bits("its velocity", f->joint.velocity, (const double[]){1, 2, 3, 4, 5, 6}, 6);
    kt_check_equal_bits("hinge", find_body(scene, "a")->joint.position, (const double[]){0.5}, 1);
    kt_check_equal_bits("ball", find_body(scene, "b")->joint.position, (const double[]){0, 0, 1, 0}, 4);
    const kt_effect *effects = scene->description.effects;
    kt_check_near("torque of the motor, gear u", effects[0].torque.value, 0.75, 1e-15);
    kt_check_near("stiffness of the servo, gear^2 kp", effects[1].stiffness, 16.0, 1e-15);
    kt_check_near("its target, u / gear", effects[1].target.value, 0.25, 1e-15);
    scene = test_robot(text, NULL);
    kt_check_near("without a keyframe the reference position", find_body(scene, "a")->joint.position[0],
                  acos(-1.0) / 6.0, 1e-15);
}

#define SWING(name, ref)                                                                                               \
    "<body><joint name='" name "' axis='0 1 0' ref='" ref "'/><geom size='0.1' pos='0.3 0 0'/></body>"
/* The address sanitizer watches the reads. */
KT_TEST(actuators_of_unknown_tendons_are_left_out_and_told) {
    static const char *const actuators[] = {"<position tendon='t' kp='3' inheritrange='1'/>",
                                            "<position joint='z' tendon='t' kp='3' inheritrange='1'/>",
                                            "<position joint='z' tendon='t' kp='3' dampratio='1'/>"};
    for (size_t n = 0; n < sizeof actuators / sizeof *actuators; n++) {
        kt_scene *scene = test_robot_of(
            NULL, "<mujoco><worldbody>" SWING("z", "0") "</worldbody><actuator>%s</actuator></mujoco>", actuators[n]);
        kt_check_true(actuators[n], n > 0 || has_note(scene, "actuator of a tendon that is left out"));
    }
}

/* 90 degrees about z take x to y. */
KT_TEST(bodies_that_a_program_moves_are_where_the_keyframe_puts_them) {
    static const char text[] =
        "<mujoco><worldbody><body name='a'><joint/>" BALL "</body><body name='b' mocap='true' "
        "pos='1 0 0'/><body name='c' mocap='true' pos='5 6 7'/></worldbody><keyframe><key name='k' "
        "qpos='1' mpos='2 3 4 5 6 8' mquat='1 0 0 0 2 0 0 2'/></keyframe></mujoco>";
    const kt_robot_options options = {.keyframe = "k"};
    for (int n = 0; n < 2; n++) {
        kt_scene *scene = test_robot(text, n == 0 ? &options : NULL);
        const kt_joint *b = &find_body(scene, "b")->joint, *c = &find_body(scene, "c")->joint;
        const double at[2][3] = {{5.0, 6.0, 8.0}, {5.0, 6.0, 7.0}};
        kt_check_near("x of the first", b->at.x, n == 0 ? 2.0 : 1.0, 0.0);
        kt_check_equal_bits("the second", &c->at.x, at[n], 3);
        kt_check_equal_int("turns", c->rotation.type, n == 0 ? KT_ROTATION_QUATERNION : KT_ROTATION_NONE);
        if (n == 0)
            kt_check_near("by a quarter", c->rotation.value[3], sqrt(0.5), 4e-16);
    }
}

KT_TEST(quaternions_of_a_keyframe_have_any_length) {
    static const char *const qpos[] = {"1 2 3 2 0 0 2 2 2 2 2", "1 2 3 0 0 0 0 0 0 0 -7",
                                       "1 2 3 3e200 0 0 3e200 2e-200 2e-200 2e-200 2e-200"};
    static const double expected[][2][4] = {{{0.5, 0.0, 0.0, 0.5}, {0.5, 0.5, 0.5, 0.5}},
                                            {{1.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, -1.0}},
                                            {{0.5, 0.0, 0.0, 0.5}, {0.5, 0.5, 0.5, 0.5}}};
    for (int n = 0; n < 3; n++) {
        const kt_robot_options options = {.keyframe = "k"};
        kt_scene *scene = test_robot_of(
            &options,
            "<mujoco><worldbody><body name='a'><freejoint/>" BALL "<body name='b'><joint type='ball'/>" BALL
            "</body></body></worldbody><keyframe><key name='k' qpos='%s'/></keyframe></mujoco>",
            qpos[n]);
        const double root = n != 1 ? sqrt(2.0) : 1.0;
        for (int i = 0; i < 4; i++) {
            kt_check_near("of a free joint", find_body(scene, "a")->joint.position[3 + i], root * expected[n][0][i],
                          4e-16);
            kt_check_near("of a ball", find_body(scene, "b")->joint.position[i], expected[n][1][i], 4e-16);
        }
    }
}

/* A ball of 3 kg and radius `0.1 m`, 0.5 m below its hinge: `I = 0.1 + 2/5 3 0.1^2 + 3 0.5^2`. Along g q the inertia is
 * `I / g^2`, and the damping in the joint `g^2 2 zeta sqrt(kp I / g^2)`. The control 0 is moved into half of `0.2 to
 * 1`. */
KT_TEST(servo_has_a_ratio_of_the_critical_damping_and_the_range_of_its_joint) {
    static const char text[] =
        "<mujoco><compiler angle='radian'/><worldbody><body name='a'><joint name='a' axis='0 1 0' armature='0.1' "
        "range='0.2 1'/>"
        "<geom size='0.1' pos='0 0 -0.5' mass='3'/></body></worldbody>"
        "<actuator><position joint='a' kp='50' dampratio='0.5' gear='2' inheritrange='0.5'/></actuator></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_need(kt_check_equal_int("effects", scene->description.effect_count, 1));
    const kt_effect *servo = &scene->description.effects[0];
    const double inertia = 0.1 + 0.4 * 3.0 * 0.01 + 3.0 * 0.25;
    kt_check_near("stiffness, g^2 kp", servo->stiffness, 200.0, 1e-13);
    kt_check_near("damping", servo->damping, 2.0 * sqrt(50.0 * inertia), 1e-13);
    kt_check_near("target", servo->target.value, 0.2, 1e-15);
}

/* Of radii 1, 4, 9 m along z, x and y: 9 m along y, and sqrt(1 4) = 2 m across. */
KT_TEST(ellipsoids_are_drawn_as_rods_as_long_or_spheres) {
    kt_scene *scene = test_robot(WORLD("<body name='a'><geom type='ellipsoid' size='4 9 1' pos='1 2 3'/></body>"
                                       "<body name='b'><geom type='ellipsoid' size='2 2 2' pos='1 2 3'/></body>"),
                                 NULL);
    const kt_shape *rod = &find_body(scene, "a")->shape, *ball = &find_body(scene, "b")->shape;
    kt_check_equal_int("rod", rod->type, KT_SHAPE_ROD);
    kt_check_near("radius", rod->radius, 2.0, 1e-15);
    kt_check_equal_bits("from", &rod->from.x, (const double[]){1.0, -5.0, 3.0}, 3);
    kt_check_equal_bits("to", &rod->to.x, (const double[]){1.0, 9.0, 3.0}, 3);
    kt_check_equal_int("ball", ball->type, KT_SHAPE_SPHERE);
    kt_check_near("its radius", ball->radius, 2.0, 1e-15);
    kt_check_contains("told", scene->notes[2].what, "ellipsoids, which pictures have as rods");
}

KT_TEST(sites_are_markers_limits_are_stops_and_floating_frees) {
    const kt_robot_options options = {.floating = true, .stop_stiffness = 10.0, .stop_damping = 2.0};
    kt_scene *scene = test_robot(WORLD("<body name='base'>" BALL "<body name='a'><joint range='-90 45'/>" BALL
                                       "<site name='tip' pos='1 2 3'/></body></body>"),
                                 &options);
    const kt_body *a = find_body(scene, "a");
    kt_check_equal_int("base", find_body(scene, "base")->joint.type, KT_JOINT_FREE);
    kt_check_equal_int("markers", a->marker_count, 1);
    kt_check_equal_bits("place", &a->markers[0].at.x, (const double[]){1.0, 2.0, 3.0}, 3);
    kt_check_equal_int("effects", scene->description.effect_count, 1);
    kt_check_near("lower", scene->description.effects[0].lower, -acos(-1.0) / 2.0, 1e-15);
    kt_check_near("upper", scene->description.effects[0].upper, acos(-1.0) / 4.0, 1e-15);
}

/* ---- what is told ------------------------------------------------------------------------------------------------ */

KT_TEST(what_is_changed_or_left_out_is_told_once_with_number_and_place) {
    static const char text[] =
        "<mujoco>\n<worldbody><camera/><camera/>\n<body name='a b'><joint name='j' range='0 1' dampin='1'/>" BALL
        "</body>\n<body name='m' mocap='true'/><attach body='y' "
        "prefix='z'/></worldbody>\n<tendon><spatial/></tendon>\n<actuator><muscle joint='j'/>"
        "<motor joint='j'/></actuator>\n<equality><joint joint1='j' "
        "polycoef='1'/></equality><keyframe><key/></keyframe>"
        "</mujoco>";
    static const char *const expected[][2] = {
        {"m.xml:3:1", "names of bodies that a scene cannot have, with '_' or a number: 1"},
        {"m.xml:4:1", "bodies that are fixed to the world (--floating lets them move): 1"},
        {"m.xml:4:30", "bodies of this model that it attaches again (attach without a model), left out: 1"},
        {"m.xml:4:1", "bodies that a program moves (mocap), fixed to the world: 1"},
        {"m.xml:7:64", "keyframes, none of which is used as the start (import --keyframe NAME uses one): 1"},
        {"m.xml:3:1", "bodies whose mass and inertia are those of their geoms: 1"},
        {"m.xml:7:11", "soft equalities, which are exact loops in the scene: 1"},
        {"m.xml:6:30", "motors, whose torque is that of the control at the start (0 without --keyframe): 1"},
        {"m.xml:3:18", "limits of position, which do not act without --stops: 1"},
        {"m.xml:3:58", "geoms that could touch others, left out, since contacts are effects: 1"},
        {"m.xml:5:9", "a force or an equality that is left out, spatial tendon around a geom that is no sphere or "
                      "cylinder, or without two sites in a "
                      "branch: 1"},
        {"m.xml:6:11", "a force or an equality that is left out, muscle without a lengthrange; "
                       "mj_saveLastXML of MuJoCo writes the ranges: 1"},
        {"m.xml:3:18", "names that are not known here, and left out: dampin (1)"},
        {"m.xml:2:12", "elements and attributes that do not concern the motion, left out: camera (2)"},
    };
    static const kt_note_rank ranks[] = {
        KT_NOTE_RANK_DETAIL, KT_NOTE_RANK_START,  KT_NOTE_RANK_MOTION, KT_NOTE_RANK_START,  KT_NOTE_RANK_START,
        KT_NOTE_RANK_DETAIL, KT_NOTE_RANK_MOTION, KT_NOTE_RANK_START,  KT_NOTE_RANK_MOTION, KT_NOTE_RANK_START,
        KT_NOTE_RANK_MOTION, KT_NOTE_RANK_MOTION, KT_NOTE_RANK_NAME,   KT_NOTE_RANK_DETAIL};
    const int count = (int)(sizeof expected / sizeof *expected);
    kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_int("notes", scene->note_count, count);
    for (int i = 0; i < scene->note_count && i < count; i++) {
        kt_check_text("where", scene->notes[i].where, expected[i][0]);
        kt_check_text("what", scene->notes[i].what, expected[i][1]);
        kt_check_equal_int(expected[i][1], scene->notes[i].rank, ranks[i]);
    }
}

/* Elements that change the motion have a warning of their own. Flags that turn elements off are obeyed. */
KT_TEST(what_changes_the_motion_is_a_warning_of_its_own) {
    static const char text[] =
        "<mujoco><option density='1' wind='1 0 0'><flag actuation='disable' equality='disable' "
        "spring='disable'/></option>"
        "<asset><mesh name='lost' file='lost.stl'/><mesh name='ball' builtin='sphere' "
        "params='3'/></asset><worldbody><body name='a'><joint name='j' stiffness='3' "
        "damping='2'/>" BALL
        "<geom type='mesh' mesh='lost'/><geom type='mesh' mesh='ball'/></body><body name='b'><joint name='k'/>" BALL
        "<geom size='.1' fluidshape='ellipsoid'/></body></worldbody><actuator><motor joint='j' delay='1'/></actuator>"
        "<equality><joint joint1='j' joint2='k'/></equality></mujoco>";
    static const char *const expected[] = {"mj_saveLastXML writes their vertices: 1", "is missing in 1 body (a), since",
                                           "wind, so that the medium is at rest: 1", "on which no medium acts: 1"};
    int warnings = 0;
    kt_scene *scene = test_robot(text, NULL);
    for (int i = 0; i < scene->note_count; i++)
        warnings += scene->notes[i].rank == KT_NOTE_RANK_MOTION;
    kt_check_equal_int("warnings", warnings, 4);
    for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
        int found = 0;
        for (int i = 0; i < scene->note_count; i++)
            found += scene->notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene->notes[i].what, expected[k]) != NULL;
        kt_check_equal_int(expected[k], found, 1);
    }
    kt_check_equal_int("effects: a damper and a drag", scene->description.effect_count, 2);
    kt_check_equal_int("loops", scene->description.loop_count, 0);
}

/* mj_saveLastXML writes a flexcomp as bodies and a flex, and a cable as bodies with plugins. */
KT_TEST(elasticity_of_expanded_models_is_left_out_with_a_warning) {
    static const char text[] =
        "<mujoco><worldbody><body name='a'><joint/>" BALL "<body name='b'><joint type='ball'/>" BALL
        "<plugin plugin='mujoco.elasticity.cable'><config key='bend' value='1e6'/></plugin></body></body></worldbody>"
        "<deformable><flex dim='1' body='a b' element='0 1'><edge stiffness='2'/><elasticity young='3'/></flex>"
        "</deformable></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_true("flex",
                  has_ranked_note(scene, KT_NOTE_RANK_MOTION,
                                  "a flex of <deformable>, whose elastic forces and edges are left to MuJoCo: 1"));
    kt_check_true("plugin", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "plugin"));
    kt_check_equal_int("bodies", scene->description.body_count, 2);
    kt_check_equal_int("effects", scene->description.effect_count, 0);
}

/* MuJoCo fuses bodies without joints with their parents, so that its medium, its gravcomp or its total mass differ. */
KT_TEST(fused_bodies_are_a_warning_if_they_move_otherwise) {
    static const struct {
        const char *settings, *option, *joint, *gravcomp;
        int warnings;
    } rows[] = {{"", "", "<joint/>", "", 0},
                {"", "density='1'", "<joint/>", "", 1},
                {"", "viscosity='1'", "<joint/>", "", 1},
                {"", "viscosity='1'", "", "", 0},
                {"", "", "<joint/>", "gravcomp='1'", 1},
                {"settotalmass='2'", "", "<joint/>", "", 0},
                {"settotalmass='2'", "", "", "", 1}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        for (int fuses = 0; fuses < 2; fuses++) {
            char text[800];
            int warnings = 0;
            (void)snprintf(text, sizeof text,
                           "<mujoco><compiler fusestatic='%s' %s/><option %s/><worldbody><body>%s" BALL "<body %s>" BALL
                           "</body></body><body><joint/>" BALL "</body></worldbody></mujoco>",
                           fuses != 0 ? "true" : "false", rows[k].settings, rows[k].option, rows[k].joint,
                           rows[k].gravcomp);
            const kt_scene *scene = test_robot(text, NULL);
            for (int i = 0; i < scene->note_count; i++)
                warnings +=
                    scene->notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene->notes[i].what, "fusestatic") != NULL;
            kt_check_equal_int(text, warnings, fuses * rows[k].warnings);
        }
}

/* MuJoCo computes forces of actuators only if there are any. */
KT_TEST(compensation_by_missing_actuators_is_a_warning) {
#define LIFTED "<body gravcomp='1'><joint name='j' type='slide' actuatorgravcomp='true'/>" BALL "</body>"
    static const char *const texts[] = {WORLD(LIFTED),
                                        "<mujoco><option><flag actuation='disable'/></option><worldbody>" LIFTED
                                        "</worldbody><actuator><motor joint='j'/></actuator></mujoco>",
                                        "<mujoco><worldbody>" LIFTED
                                        "</worldbody><actuator><motor joint='j'/></actuator></mujoco>"};
    for (int i = 0; i < 3; i++) {
        bool is_told = false;
        const kt_scene *scene = test_robot(texts[i], NULL);
        for (int k = 0; k < scene->note_count; k++)
            is_told = is_told || (scene->notes[k].rank == KT_NOTE_RANK_MOTION &&
                                  strstr(scene->notes[k].what, "which MuJoCo does not compensate: 1") != NULL);
        kt_check_equal_int("it is told", is_told, i < 2);
    }
}

/* Such an element has no class with a number to look up. */
KT_TEST(default_that_is_not_at_the_root_is_no_class) {
    static const char text[] = "<mujoco><worldbody><body name='a'><joint name='j'/>" BALL
                               "</body></worldbody><actuator><default joint='j'/></actuator></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_int("effects", scene->description.effect_count, 0);
    int warnings = 0;
    for (int i = 0; i < scene->note_count; i++)
        warnings +=
            scene->notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene->notes[i].what, "left out, default: 1") != NULL;
    kt_check_equal_int("warnings", warnings, 1);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

#define EXPANDED                                                                                                       \
    "it is not read; mj_saveLastXML of MuJoCo writes the model with the bodies that it stands for, which can be "      \
    "read\n"

KT_TEST(faults_are_told_at_their_places) {
    static const struct {
        const char *text, *fault;
    } table[] = {
        {WORLD("<body name='a'><geom type='box' size='1 2'/></body>"),
         "1:35: body 'a': geom: size: a box needs 3 numbers above zero\n"},
        {WORLD("<body name='a'><geom type='cone' size='1'/></body>"),
         "1:35: body 'a': geom: type: there is no 'cone'; it is one of plane, hfield, sphere, capsule, ellipsoid, "
         "cylinder, box, mesh, sdf\n"},
        {WORLD("<body name='a' pos='0 0'/>"), "1:20: body 'a': pos: expected 3 numbers, found '0 0'\n"},
        {WORLD("<body name='a' pos='0 0 nan'/>"), "1:20: body 'a': pos: expected 3 numbers, found '0 0 nan'\n"},
        {WORLD("<body name='a' quat='0 0 0 0'/>"), "1:20: body 'a': quat: the norm is zero or too large\n"},
        {WORLD("<body name='a'/><body name='a'/>"),
         "1:36: body 'a': there is another body of this name; each needs one of its own\n"},
        {WORLD("<body name='a'><body name='b'><freejoint/></body></body>"),
         "1:50: body 'b': freejoint: a free joint is the only joint of a body of the world\n"},
        {WORLD("<joint/>"), "1:20: joint: the world has no joints; put it into a <body>\n"},
        {WORLD("<body name='a' childclass='x'/>"), "1:20: body 'a': childclass 'x' does not exist\n"},
        {"<mujoco><default><default/></default></mujoco>", "1:18: default: the attribute 'class' is missing\n"},
        {"<mujoco><compiler eulerseq='xyw'/></mujoco>",
         "1:9: compiler: eulerseq: expected three of x, y, z, X, Y, Z, found 'xyw'\n"},
        {"<mujoco><compiler coordinate='global'/></mujoco>",
         "1:9: compiler: coordinate: there is no 'global'; it is one of local\n"},
        {"<mujoco><equality><joint joint1='j'/></equality></mujoco>", "1:19: joint: joint1 'j' does not exist\n"},
        {"<mujoco><include file='b.xml'/></mujoco>",
         "1:9: include: a robot that is no file, but text, cannot include files\n"},
        {WORLD("<replicate count='2'><body/></replicate>"), "1:20: replicate: " EXPANDED},
        {WORLD("<body name='a'><composite type='cable'/><flexcomp/></body>"),
         "1:35: body 'a': composite: " EXPANDED "1:60: body 'a': flexcomp: " EXPANDED},
        {WORLD("<body name='a'><geom size='1'><attach model='x' prefix='p_'/></geom></body>"),
         "1:50: body 'a': attach: it stands in <geom>; put it into <worldbody>, <body> or <frame>\n"},
        {"<mujoco><default><joint><attach model='x' prefix='p_'/></joint></default></mujoco>",
         "1:25: attach: it stands in <joint>; put it into <worldbody>, <body> or <frame>\n"},
        {"<!DOCTYPE mujoco [<!ENTITY a 'b'>]><mujoco/>",
         "1:18: a document type (<!DOCTYPE ...>) is not read; leave it out\n"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene scene;
        kt_check_equal_int("it is rejected", parse(table[i].text, NULL, &scene), KT_ERROR_SCENE);
        kt_check_text(table[i].text, faults.text, table[i].fault);
        kt_check_equal_int("places out of order", faults.strange, 0);
    }
}
