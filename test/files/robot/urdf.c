/* Robots in URDF: the result of each element, omissions and their warnings, and faults at their places. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "r.urdf"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MASS "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"

/* ---- the mechanism ----------------------------------------------------------------------------------------------- */

KT_TEST(joint_types_are_ours) {
    static const struct {
        const char *type;
        kt_joint_type ours;
    } table[] = {{"revolute", KT_JOINT_REVOLUTE}, {"continuous", KT_JOINT_REVOLUTE}, {"prismatic", KT_JOINT_PRISMATIC},
                 {"fixed", KT_JOINT_FIXED},       {"floating", KT_JOINT_FREE},       {"planar", KT_JOINT_PLANAR}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene =
            test_robot_of(NULL,
                          "<robot name='r'><link name='a'/><link name='b'>" MASS "</link><joint name='j' type='%s'>"
                          "<parent link='a'/><child link='b'/><origin xyz='1 2 3' rpy='0.1 0.2 0.3'/></joint></robot>",
                          table[i].type);
        const kt_joint *joint = &find_body(scene, "b")->joint;
        kt_check_equal_int(table[i].type, joint->type, table[i].ours);
        kt_check_equal_bits("place", &joint->at.x, (const double[]){1.0, 2.0, 3.0}, 3);
        kt_check_equal_bits("roll, pitch, yaw", joint->rotation.value, (const double[]){0.1, 0.2, 0.3}, 3);
        if (table[i].ours != KT_JOINT_FIXED && table[i].ours != KT_JOINT_FREE)
            kt_check_equal_bits("axis that is not given", &joint->axis.x, (const double[]){1.0, 0.0, 0.0}, 3);
    }
}

/* Axes turned by 90 degrees about z: x' = y and y' = -x. */
KT_TEST(inertia_is_turned_to_the_axes_of_the_link) {
    kt_scene *scene =
        test_robot("<robot name='r'><link name='a'><inertial><origin xyz='0 0.5 0' rpy='0 0 1.5707963267948966'/>"
                   "<mass value='2'/><inertia ixx='2' iyy='3' izz='4' ixy='0.2' ixz='0.3' iyz='0.4'/></inertial>"
                   "</link></robot>",
                   NULL);
    const kt_body *body = find_body(scene, "a");
    const double seen[] = {body->inertia.xx, body->inertia.yy, body->inertia.zz,
                           body->inertia.xy, body->inertia.xz, body->inertia.yz};
    const double expected[] = {3.0, 2.0, 4.0, -0.2, -0.4, 0.3};
    for (int i = 0; i < 6; i++)
        kt_check_near("entry", seen[i], expected[i], 8.0 * DBL_EPSILON);
    kt_check_equal_bits("mass", &body->mass, &(double){2.0}, 1);
    kt_check_equal_bits("com", &body->com.x, (const double[]){0.0, 0.5, 0.0}, 3);
}

#define PAIR(limit, rest)                                                                                              \
    "<robot name='r'><link name='a'/><link name='b'>" MASS "</link><joint name='j' type='revolute'><parent link='a'/>" \
    "<child link='b'/>" limit "</joint>" rest "</robot>"

KT_TEST(limits_become_stops_where_a_stiffness_is_given) {
    const kt_robot_options options = {.stop_stiffness = 1e4, .stop_damping = 5.0};
    kt_scene *scene = test_robot(PAIR("<limit lower='-2' upper='-0.5' effort='1' velocity='1'/>", ""), &options);
    const kt_effect *stop = &scene->description.effects[0];
    kt_check_equal_int("effects", scene->description.effect_count, 1);
    kt_check_equal_int("type", stop->type, KT_EFFECT_JOINT_LIMIT);
    kt_check_equal_bits("numbers", (const double[]){stop->lower, stop->upper, stop->stiffness, stop->damping},
                        (const double[]){-2.0, -0.5, 1e4, 5.0}, 4);
    kt_check_equal_bits("start at the limit next to zero", &find_body(scene, "b")->joint.position[0], &(double){-0.5},
                        1);
    scene = test_robot(PAIR("<limit effort='1' velocity='1'/>", ""), &options);
    kt_check_equal_int("no limits of position, no stops", scene->description.effect_count, 0);
}

/* The motion of a damped pendulum read from URDF is, to the bit, that of the description written by hand. */
KT_TEST(damped_pendulum_swings_as_described_by_hand) {
    double q[2];
    kt_error error = {0};
    kt_scene *scene = test_robot(
        "<robot name='p'><link name='world'/><link name='bob'><inertial><origin xyz='0 0 -1'/><mass value='2'/>"
        "<inertia ixx='0.1' iyy='0.2' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        "<joint name='pivot' type='revolute'><parent link='world'/><child link='bob'/><axis xyz='0 1 0'/>"
        "<limit lower='0.7' upper='3' effort='0' velocity='0'/><dynamics damping='0.3' friction='0.1'/></joint>"
        "</robot>",
        NULL);
    kt_body bob = kt_body_of("bob", NULL, KT_JOINT_REVOLUTE, 2.0);
    bob.joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    bob.joint.position[0] = 0.7;
    bob.com = kt_vec3_make(0.0, 0.0, -1.0);
    bob.inertia = kt_sym3_make(0.1, 0.2, 0.1, 0.0, 0.0, 0.0);
    kt_effect effects[] = {kt_effect_default(), kt_effect_default()};
    effects[0].type = KT_EFFECT_JOINT_DAMPER;
    effects[0].damping = 0.3;
    effects[1].type = KT_EFFECT_JOINT_FRICTION;
    effects[1].coulomb = 0.1;
    effects[0].joint = effects[1].joint = "bob";
    kt_description by_hand = kt_description_default();
    by_hand.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    kt_describe(&by_hand, &bob, 1, NULL, 0, effects, 2);
    const kt_description *descriptions[] = {&scene->description, &by_hand};
    for (int i = 0; i < 2; i++) {
        kt_simulation *simulation = kt_test_simulation(kt_test_model(descriptions[i], NULL), NULL, NULL);
        kt_need_fine("run", kt_simulation_advance(simulation, 2.0, &error), &error);
        q[i] = kt_simulation_positions(simulation)[0];
    }
    kt_check_equal_bits("angle after 2 s", &q[0], &q[1], 1);
    kt_check_below("it has swung", q[0], 0.65);
}

KT_TEST(mimic_joint_is_a_coupling) {
    kt_scene *scene =
        test_robot(PAIR("", "<link name='c'>" MASS "</link><joint name='k' type='prismatic'><parent link='a'/>"
                            "<child link='c'/><mimic joint='j' multiplier='-2' offset='0.25'/></joint>"),
                   NULL);
    const kt_loop *loop = &scene->description.loops[0];
    kt_need(kt_check_equal_int("loops", scene->description.loop_count, 1));
    kt_check_text("name", loop->name, "mimic_k");
    kt_check_text("joint", loop->terms[0].joint, "k");
    kt_check_text("the other", loop->terms[1].joint, "j");
    kt_check_equal_bits("q - multiplier q' = offset",
                        (const double[]){loop->terms[0].coefficient, loop->terms[1].coefficient, loop->offset},
                        (const double[]){1.0, 2.0, 0.25}, 3);
}

KT_TEST(joints_keep_their_names_and_limits) {
    kt_error error = {0};
    kt_scene *scene =
        test_robot(PAIR("<limit lower='-2' upper='0.5' effort='7' velocity='3'/>",
                        "<link name='c'>" MASS "</link><joint name='a' type='continuous'><parent link='b'/>"
                        "<child link='c'/><limit effort='2' velocity='-1'/></joint>"),
                   NULL);
    const kt_model *model = kt_test_model(&scene->description, NULL);
    int j = 0, c = 0;
    kt_check_equal_int("j", kt_joint_find(model, "j", &j, &error), KT_OK);
    kt_check_text("carries", kt_body_name(model, j), "b");
    const kt_joint_limits limits = kt_joint_limits_of(model, j);
    kt_check_equal_bits("limits", &limits.lower, (const double[]){-2.0, 0.5, 3.0, 7.0}, 4);
    kt_check_equal_int("the name of the fixed root", kt_joint_find(model, "a", &c, &error), KT_OK);
    kt_check_text("carries", kt_body_name(model, c), "c");
    kt_check_true("no name is changed", !has_note(scene, "names of joints"));
    const kt_joint_limits other = kt_joint_limits_of(model, c);
    kt_check_equal_bits("a speed below zero is none", &other.lower,
                        (const double[]){-HUGE_VAL, HUGE_VAL, HUGE_VAL, 2.0}, 4);
}

KT_TEST(root_is_the_world_or_fixed_or_free) {
    const kt_robot_options floats = {.floating = true};
    kt_scene *scene = test_robot("<robot name='r'><link name='base'>" MASS "</link></robot>", NULL);
    kt_check_equal_int("fixed", find_body(scene, "base")->joint.type, KT_JOINT_FIXED);
    kt_check_equal_bits("gravity", &scene->description.gravity.x, (const double[]){0.0, 0.0, -9.81}, 3);
    scene = test_robot("<robot name='r'><link name='base'>" MASS "</link></robot>", &floats);
    kt_check_equal_int("free", find_body(scene, "base")->joint.type, KT_JOINT_FREE);
    scene = test_robot("<robot name='r'><link name='world'/><link name='b'>" MASS "</link><joint name='j' type='fixed'>"
                       "<parent link='world'/><child link='b'/></joint></robot>",
                       NULL);
    kt_check_equal_int("bodies besides the world", scene->description.body_count, 1);
    kt_check_true("on the world", find_body(scene, "b")->parent == NULL);
}

KT_TEST(picture_is_the_first_solid_of_visuals_or_collisions) {
    kt_scene *scene =
        test_robot("<robot name='r'><link name='a'><visual><geometry><mesh filename='m.dae'/></geometry></visual>"
                   "<visual><origin xyz='0 0 1' rpy='0.5 0 0'/><geometry><box size='1 2 3'/></geometry></visual>"
                   "<collision><geometry><sphere radius='1'/></geometry></collision></link>"
                   "<link name='b'><collision><origin xyz='1 0 0'/><geometry><cylinder radius='0.1' length='2'/>"
                   "</geometry></collision></link>"
                   "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint></robot>",
                   NULL);
    const kt_shape *box = &find_body(scene, "a")->shape, *cylinder = &find_body(scene, "b")->shape;
    kt_check_equal_int("box", box->type, KT_SHAPE_BOX);
    kt_check_equal_bits("edges", &box->size.x, (const double[]){1.0, 2.0, 3.0}, 3);
    kt_check_equal_bits("place", &box->at.x, (const double[]){0.0, 0.0, 1.0}, 3);
    kt_check_equal_bits("roll", box->rotation.value, (const double[]){0.5}, 1);
    kt_check_equal_int("cylinder", cylinder->type, KT_SHAPE_CYLINDER);
    kt_check_equal_bits("radius, length", (const double[]){cylinder->radius, cylinder->length},
                        (const double[]){0.1, 2.0}, 2);
}

/* n^2 J at the joint. */
KT_TEST(rotors_of_transmissions_are_armature) {
    static const char text[] =
        PAIR("", "<transmission name='t'><type>transmission_interface/SimpleTransmission</type><joint name='j'/>"
                 "<actuator name='m'><mechanicalReduction> 50 </mechanicalReduction><rotorInertia>2e-4</rotorInertia>"
                 "</actuator></transmission>"
                 "<transmission><joint name='j'/><actuator name='n'><drake:gear_ratio value='3'/><drake:rotor_inertia "
                 "value='0.5'/></actuator></transmission>"
                 "<transmission name='u'><joint name='j'/><actuator name='n'><mechanicalReduction>7"
                 "</mechanicalReduction></actuator></transmission>");
    kt_scene *scene = test_robot(text, NULL);
    kt_check_near("armature", find_body(scene, "b")->joint.armature[0], 50.0 * 50.0 * 2e-4 + 9.0 * 0.5, 1e-15);
    kt_check_true("both are told", has_note(scene, "transmissions whose rotor inertia"));
    kt_check_true("the third is left out", has_note(scene, "transmissions that are left out"));
}

/* ---- what simulators add ----------------------------------------------------------------------------------------- */

static const kt_effect *find_urdf_effect(const kt_scene *scene, kt_effect_type type) {
    for (int i = 0; i < scene->description.effect_count; i++)
        if (scene->description.effects[i].type == type)
            return &scene->description.effects[i];
    return NULL;
}

/* A link without weight has the force -m g at its centre of mass, for gravity that <mujoco> gives. */
KT_TEST(springs_and_weights_of_simulators_act) {
    kt_scene *scene =
        test_robot(PAIR("", "<gazebo reference='j'><springStiffness>5</springStiffness><springReference>0.1"
                            "</springReference><stopErp>0.2</stopErp></gazebo><gazebo reference='b'><kp>1e6</kp>"
                            "<turnGravityOff> true </turnGravityOff></gazebo><gazebo reference='a'>"
                            "<turnGravityOff>false</turnGravityOff></gazebo><gazebo><static>false</static></gazebo>"
                            "<mujoco><compiler balanceinertia='true'/><option gravity='1 2 -3'/></mujoco>"),
                   NULL);
    const kt_effect *spring = find_urdf_effect(scene, KT_EFFECT_JOINT_SPRING);
    const kt_effect *force = find_urdf_effect(scene, KT_EFFECT_FORCE);
    kt_check_equal_int("effects", scene->description.effect_count, 2);
    kt_check_equal_bits("gravity", &scene->description.gravity.x, (const double[]){1.0, 2.0, -3.0}, 3);
    kt_need(kt_check_true("both act", spring != NULL && force != NULL));
    kt_check_text("joint", spring->joint, "j");
    kt_check_equal_bits("stiffness", &spring->stiffness, &(double){5.0}, 1);
    kt_check_equal_bits("rest", &spring->rest.value, &(double){0.1}, 1);
    kt_check_text("link", force->between[0].body, "b");
    for (int i = 0; i < 3; i++)
        kt_check_equal_bits("against a weight", &force->value[i].value, &(double[]){-1.0, -2.0, 3.0}[i], 1);
    kt_check_true("all are read", !has_note(scene, "not known") && !has_ranked_note(scene, KT_NOTE_RANK_MOTION, "'"));
}

KT_TEST(additions_of_simulators_that_move_a_robot_are_warnings) {
    static const char *const words[] = {"'static' is left out: 1", "'plugin' is left out: 1",
                                        "'dampingFactor' is left out: 1", "'density' is left out: 1"};
    kt_scene *scene =
        test_robot(PAIR("", "<gazebo><static>true</static><plugin name='p' filename='p.so'/></gazebo>"
                            "<gazebo reference='b'><dampingFactor>0.1</dampingFactor><material>Red</material></gazebo>"
                            "<mujoco><option density='1.2'/></mujoco>"),
                   NULL);
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        kt_check_true(words[i], has_ranked_note(scene, KT_NOTE_RANK_MOTION, words[i]));
    kt_check_equal_int("warnings", count_notes(scene, "is left out: "), 4);
}

/* ---- what is left out -------------------------------------------------------------------------------------------- */

KT_TEST(what_is_left_out_is_told_once_with_number_and_place) {
    static const char *const expected[][2] = {
        {"r.urdf:1:17", "link 'a' is fixed to the world (--floating lets it move), gravity is 9.81 m/s^2 along -z"},
        {"r.urdf:5:1", "joints that start at a limit, since zero is outside their limits: 1"},
        {"r.urdf:5:1", "limits of position, which do not act without --stops: 1"},
        {"r.urdf:1:1", "no link has a mass, so that only positions, pictures and degrees of freedom can be computed "
                       "(--density computes masses from shapes, --mass LINK=MASS sets one mass)"},
        {"r.urdf:5:1", "limits of effort or speed that are left out, since they are no numbers, or below zero: 1"},
        {"r.urdf:2:1",
         "meshes that are not found, left out of pictures (--search FOLDER:FOLDER, or KINETREE_SEARCH, names "
         "where packages and models are): 1; the first: m.dae"},
        {"r.urdf:3:16", "collision shapes that are left out, since contacts are effects: 1"},
        {"r.urdf:6:1", "names that are not known here, and left out: ryp (1)"},
    };
    kt_scene *scene =
        test_robot("<robot name='r'><link name='a'>\n"
                   "<visual><geometry><mesh filename='m.dae'/></geometry></visual></link>\n"
                   "<link name='b'><collision><geometry><sphere radius='1'/></geometry></collision></link>\n"
                   "<joint name='j' type='revolute'><parent link='a'/><child link='b'/>\n"
                   "<limit lower='1' upper='2' effort='1' velocity='fast'/>\n"
                   "<origin xyz='0 0 1' ryp='1 0 0'/></joint><gazebo/><gazebo/></robot>",
                   NULL);
    const int count = (int)(sizeof expected / sizeof *expected);
    kt_check_equal_int("notes", scene->note_count, count);
    for (int i = 0; i < count && i < scene->note_count; i++) {
        kt_check_text("where", scene->notes[i].where, expected[i][0]);
        kt_check_text("what", scene->notes[i].what, expected[i][1]);
    }
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(faults_are_told_at_their_places) {
    static const struct {
        const char *text, *fault;
    } table[] = {
        {"", "1:1: this is no well-formed XML: no element found\n"},
        {"<robot>\n<link name='a'>\n</robot>", "3:3: this is no well-formed XML: mismatched tag\n"},
        {"<!DOCTYPE robot [<!ENTITY a 'b'>]><robot/>",
         "1:17: a document type (<!DOCTYPE ...>) is not read; leave it out\n"},
        {"<rigid/>", "1:1: a robot in URDF begins with <robot name=\"...\">, one in MJCF with <mujoco>, "
                     "one in SDF with <sdf version=\"...\">, not with <rigid>\n"},
        {"<robot name='r'/>", "1:1: there is no link\n"},
        {"<robot name='r'><xacro:macro/></robot>",
         "1:17: <xacro:macro> is for the macro processor xacro; run it first, and read what it writes\n"},
        {"<robot name='r'><link/></robot>", "1:17: link: the attribute 'name' is missing\n"},
        {"<robot name='r'>\n<link name='a'/>\n<link name='a'/></robot>",
         "3:1: link 'a': the name is that of the link in line 2, too; each needs one of its own\n"
         "3:1: link 'a': no joint has this link as child, nor the one in line 2; only one can be the root\n"},
        {PAIR("<limit lower='nan' upper='-1'/>", ""),
         "1:218: joint 'j': limit: lower: expected a number or inf, found 'nan'\n"},
        {PAIR("<axis xyz='0 0'/>", ""), "1:218: joint 'j': axis: xyz: expected three numbers, found '0 0'\n"},
        {PAIR("<axis xyz='0 0 nan'/>", ""), "1:218: joint 'j': axis: xyz: expected three numbers, found '0 0 nan'\n"},
        {PAIR("<axis xyz='0 0 1e999'/>", ""),
         "1:218: joint 'j': axis: xyz: expected three numbers, found '0 0 1e999'\n"},
        {PAIR("<dynamics damping='0x10'/>", ""),
         "1:218: joint 'j': dynamics: damping: expected a number, found '0x10'\n"},
        {PAIR("<mimic joint='jj'/>", ""), "1:218: joint 'j': mimic: joint 'jj' does not exist; did you mean 'j'?\n"},
        {PAIR("", "<link name='b2'/><joint name='k' type='hinge'><parent link='b'/><child link='b2'/></joint>"),
         "1:243: joint 'k': there is no type 'hinge'; it is revolute, continuous, prismatic, fixed, floating or "
         "planar\n"},
        {PAIR("", "<joint name='k' type='fixed'><parent link='a'/><child link='b'/></joint>"),
         "1:226: joint 'k': link 'b' is the child of the joint in line 1, too; a link has one joint to its parent: "
         "close "
         "loops in the scene, by 'loops'\n"},
        {"<robot name='r'><link name='a'><inertial><mass value='1'/></inertial></link></robot>",
         "1:32: link 'a': inertial: <inertia/> is missing\n"},
        {PAIR("<axis xyz='0 0 0'/>", ""), "1:151: body 'b': joint.axis is zero"},
        {PAIR("<dynamics damping='-1'/>", ""), "1:151: effects[0]: damping is -1"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene scene;
        const kt_status status = parse(table[i].text, NULL, &scene);
        kt_check_true("it is rejected", status == KT_ERROR_SCENE || status == KT_ERROR_MODEL);
        faults.text[strlen(table[i].fault)] = '\0'; /* the last two go on in words of the description's check */
        kt_check_text(table[i].text, faults.text, table[i].fault);
        kt_check_equal_int("places out of order", faults.strange, 0);
    }
}

KT_TEST(notes_have_the_whole_path) {
    char path[400], where[400];
    kt_scene *scene = kt_test_scene_place();
    kt_error error;
    memset(path, 'f', 300);
    (void)snprintf(path + 300, sizeof path - 300, "/r.urdf");
    (void)snprintf(where, sizeof where, "%.390s:1:17", path);
    static const char text[] = "<robot name='r'><link name='a'/></robot>";
    kt_need(
        kt_check_equal_int("status", kt_robot_parse(path, text, strlen(text), NULL, scene, NULL, NULL, &error), KT_OK));
    kt_check_text("where", scene->notes[0].where, where);
}

KT_TEST(nesting_ends_at_a_depth) {
    static char text[40000];
    kt_scene scene;
    size_t length = 0;
    for (int i = 0; i < 5000; i++)
        length += (size_t)snprintf(text + length, sizeof text - length, "<robot>");
    kt_check_equal_int("status", parse(text, NULL, &scene), KT_ERROR_SCENE);
    kt_check_text("fault", faults.text, "1:28673: elements are nested more than 4096 deep\n");
}

KT_TEST(stops_of_negative_or_endless_stiffness_are_rejected) {
    const kt_robot_options wrong[] = {
        {.stop_stiffness = -1.0}, {.stop_stiffness = (double)INFINITY}, {.stop_damping = (double)NAN}};
    kt_error error;
    kt_scene scene;
    for (int i = 0; i < 3; i++)
        kt_check_equal_int("status", kt_robot_parse("r", "<robot/>", 8, &wrong[i], &scene, NULL, NULL, &error),
                           KT_ERROR_ARGUMENT);
}

/* ---- whole robots ------------------------------------------------------------------------------------------------ */

KT_TEST(robot_that_is_written_as_a_scene_reads_back_the_same) {
    kt_scene *robot = kt_test_scene_place();
    kt_error error = {0};
    kt_need_fine("robot", kt_robot_read(KT_MODELS "/arm.urdf", NULL, robot, NULL, NULL, &error), &error);
    const char *text = kt_test_written(robot);
    kt_check_text("the same scene", kt_test_written(kt_test_scene(text)), text);
}

/* Time and memory in proportion: the second half of the links costs as much as the first. */
KT_TEST(robot_of_many_links_is_read) {
    enum { LINKS = 20000 };
    char *text = malloc((size_t)LINKS * 400);
    size_t n = 0;
    if (text == NULL) {
        kt_check_true("memory", false);
        return;
    }
    n += (size_t)sprintf(text, "<robot name='chain'><link name='l0'/>");
    for (int i = 1; i < LINKS; i++)
        n += (size_t)sprintf(text + n,
                             "<link name='l%d'>" MASS "</link><joint name='j%d' type='continuous'><parent link='l%d'/>"
                             "<child link='l%d'/></joint>",
                             i, i, i - 1, i);
    (void)sprintf(text + n, "</robot>");
    kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_int("bodies", scene->description.body_count, LINKS);
    free(text);
}

/* ---- what others read, too --------------------------------------------------------------------------------------- */

#define LINK(name) "<link name='" name "'>" MASS "</link>"
#define HINGE(name, parent, child, rest)                                                                               \
    "<joint name='" name "' type='revolute'><parent link='" parent "'/><child link='" child "'/>" rest "</joint>"

/* q = multiplier q' + offset, along a chain of followers in any order: `c = 2 b + 0.5, b = -3 a + 0.25, a = 0.1`. */
KT_TEST(joints_that_follow_start_where_their_masters_put_them) {
    kt_scene *scene =
        test_robot("<robot name='r'><link name='base'/>" LINK("a") LINK("b") LINK("c")
                       HINGE("jc", "base", "c", "<mimic joint='jb' multiplier='2' offset='0.5'/>")
                           HINGE("jb", "base", "b",
                                 "<limit lower='-0.01' upper='1'/><mimic joint='ja' multiplier='-3' offset='0.25'/>")
                               HINGE("ja", "base", "a", "<limit lower='0.1' upper='1'/>") "</robot>",
                   NULL);
    const double b = -3.0 * 0.1 + 0.25;
    const double expected[] = {0.1, b, 2.0 * b + 0.5};
    static const char *const names[] = {"a", "b", "c"};
    for (int i = 0; i < 3; i++)
        kt_check_equal_bits(names[i], find_body(scene, names[i])->joint.position, &expected[i], 1);
    kt_check_equal_int("loops", scene->description.loop_count, 2);
    kt_check_equal_int("of followers", count_notes(scene, "and therefore do not start at zero: 2"), 1);
    kt_check_equal_int("beyond limits", count_notes(scene, "beyond their own limits, since they follow others: 1"), 1);
    kt_check_equal_int("at a limit", count_notes(scene, "start at a limit"), 1);

    const kt_model *model = kt_test_model(&scene->description, NULL);
    kt_run run = kt_run_default();
    run.duration = 1.0;
    const kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    for (int i = 0; i < 3; i++) {
        const int q = kt_body_coordinates(model, kt_body_find(model, names[i])).q;
        kt_check_near(names[i], kt_simulation_positions(simulation)[q], expected[i], 4.0 * DBL_EPSILON);
    }
}

/* Circles of fixed joints. Their rigid parts are traversed before the check of the description. */
KT_TEST(links_fixed_to_each_other_in_a_circle_are_rejected) {
    static const char *const robots[] = {
        "<robot name='r'><link name='a'/><joint name='1' type='fixed'><parent link='a'/><child "
        "link='a'/></joint></robot>",
        "<robot name='r'><link name='w'/><link name='a'/><link name='b'/>"
        "<joint name='1' type='fixed'><parent link='a'/><child link='b'/></joint>"
        "<joint name='2' type='fixed'><parent link='b'/><child link='a'/></joint></robot>"};
    for (size_t k = 0; k < sizeof robots / sizeof *robots; k++) {
        kt_scene scene;
        kt_error error = {0};
        kt_check_true("rejected", kt_robot_parse("r.urdf", robots[k], strlen(robots[k]), NULL, &scene, NULL, NULL,
                                                 &error) != KT_OK);
        kt_check_true("in words", error.message[0] != '\0');
        kt_note("%s: %s", error.where, error.message);
    }
}

KT_TEST(joints_that_follow_each_other_in_a_circle_are_rejected) {
    kt_scene scene;
    const kt_status status =
        parse("<robot name='r'><link name='base'/>" LINK("a") LINK("b") LINK("c")
                  HINGE("ja", "base", "a", "<mimic joint='jb'/>") HINGE("jb", "base", "b", "<mimic joint='ja'/>")
                      HINGE("jc", "base", "c", "<mimic joint='jc'/>") "</robot>",
              NULL, &scene);
    kt_check_equal_int("status", status, KT_ERROR_SCENE);
    kt_check_equal_int("two circles", faults.count, 2);
    kt_check_contains("words", faults.text, "joints follow each other in a circle");
}

KT_TEST(what_is_fixed_follows_nothing) {
    kt_scene *scene = test_robot("<robot name='r'><link name='base'/>" LINK("a") "<link name='b'/>" HINGE(
                                     "ja", "base", "a", "") "<joint name='k' type='fixed'><parent link='a'/><child "
                                                            "link='b'/><mimic joint='ja'/></joint></robot>",
                                 NULL);
    kt_check_equal_int("loops", scene->description.loop_count, 0);
    kt_check_equal_int("told", count_notes(scene, "mimics that are left out"), 1);
}

KT_TEST(shapes_without_a_size_and_limits_without_order_are_told) {
    kt_scene rejected;
    const kt_robot_options stops = {.stop_stiffness = 1.0};
    static const char text[] =
        "<robot name='r'><link name='base'><visual><geometry><box size='0 0 0'/></geometry></visual><visual><geometry>"
        "<sphere radius='1e51'/></geometry></visual><visual><geometry><sphere "
        "radius='0.2'/></geometry></visual></link>" LINK("a")
            HINGE("ja", "base", "a", "<limit lower='1' upper='-1'/>") "</robot>";
    kt_check_equal_int("with stops the order matters", parse(text, &stops, &rejected), KT_ERROR_SCENE);
    const kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_int("the shape that has a size", find_body(scene, "base")->shape.type, KT_SHAPE_SPHERE);
    kt_check_equal_bits("start", find_body(scene, "a")->joint.position, &(double){0.0}, 1);
    kt_check_equal_int("of shapes", count_notes(scene, "since a dimension is not above zero, or above 1e50: 2"), 1);
    kt_check_equal_int("of limits", count_notes(scene, "since lower is above upper: 1"), 1);
}

KT_TEST(declaration_may_follow_blanks_and_comments) {
    static const char *const before[] = {"\n", "<!-- made\nby hand -->\n "};
    for (int i = 0; i < 2; i++) {
        const kt_scene *scene =
            test_robot_of(NULL, "%s<?xml version='1.0'?><robot name='r'><link name='a'/></robot>", before[i]);
        kt_check_equal_int("told", count_notes(scene, "declaration is not at the beginning"), 1);
        kt_check_text("where", scene->notes[scene->note_count - 1].where, i == 0 ? "r.urdf:2:1" : "r.urdf:3:2");
    }
    kt_scene scene;
    kt_check_equal_int("after an element", parse("<robot name='r'/><?xml version='1.0'?>", NULL, &scene),
                       KT_ERROR_SCENE);
}

#define ON_WORLD(declared, type)                                                                                       \
    "<robot name='r'>" declared LINK("arm") "<joint name='j' type='" type                                              \
                                            "'><parent link='world'/><child link='arm'/>"                              \
                                            "<origin xyz='1 2 3'/></joint></robot>"

KT_TEST(world_need_not_be_declared_and_frees_what_is_fixed_to_it) {
    const kt_robot_options floating = {.floating = true};
    static const char *const texts[] = {ON_WORLD("<link name='world'/>", "fixed"), ON_WORLD("", "fixed")};
    kt_scene *scene;
    for (int i = 0; i < 2; i++) {
        scene = test_robot(texts[i], &floating);
        const kt_joint *joint = &find_body(scene, "arm")->joint;
        kt_check_equal_int("bodies", scene->description.body_count, 1);
        kt_check_equal_int("it is free", joint->type, KT_JOINT_FREE);
        kt_check_equal_bits("and starts where it was", &joint->at.x, (const double[]){1.0, 2.0, 3.0}, 3);
        kt_check_equal_int("told", count_notes(scene, "--floating lets move freely: 1"), 1);
        kt_check_equal_int("of the world", count_notes(scene, "no link 'world' is declared"), i);
    }
    scene = test_robot(ON_WORLD("", "revolute"), &floating);
    kt_check_equal_int("nothing to free", count_notes(scene, "--floating frees nothing"), 1);
}
