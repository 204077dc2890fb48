/* Files of models in MJCF: included files, and models that are attached, from the folder of the model alone. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.xml"
#include "folder.h"
#include "mjcf_text.h"
#include "robot.h"

#include "kinetree/kinetree.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- included files ---------------------------------------------------------------------------------------------- */

static kt_status read_in(const char *folder, const char *text, const kt_robot_options *options, kt_scene *scene) {
    const char *path = kt_test_file(folder, "inner/m.xml", text);
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, "%.200s", path);
    return kt_robot_read(path, options, scene, kt_collect, &faults, &error);
}

/* The same of a text that must be right. */
static kt_scene *read_right(const char *folder, const char *text, const kt_robot_options *options) {
    kt_scene *scene = kt_test_scene_place();
    if (read_in(folder, text, options, scene) != KT_OK) {
        kt_note("%s", faults.text);
        kt_need(kt_check_true("it is read", false));
    }
    return scene;
}

#define INCLUDE(file) "<mujoco><include file='" file "'/></mujoco>"

KT_TEST(files_are_included_from_the_folder_of_the_model_alone) {
    static const char *const wrong[][2] = {
        {INCLUDE("../outer.xml"), "a file is included from the model's folder alone"},
        {INCLUDE("sub/../../outer.xml"), "a file is included from the model's folder alone"},
        {INCLUDE("/etc/hostname"), "a file is included from the model's folder alone"},
        {INCLUDE("link.xml"), "the file lies outside of the model's folder, by a link"},
        {INCLUDE("missing.xml"), "cannot be read: No such file or directory"},
        {INCLUDE("circle.xml"), "files include each other in a circle, or more than 64 deep"},
        {INCLUDE("m.xml"), "files include each other in a circle, or more than 64 deep"},
        {INCLUDE("broken.xml"), "broken.xml:2:14: this is no well-formed XML: mismatched tag"},
        {INCLUDE("wrong.xml"), "wrong.xml:1:27: body 'w': pos: expected 3 numbers, found 'x'"},
        {INCLUDE("other.xml"), "begins with <robot>, and is no part of a model in MJCF"},
    };
    const char *folder = kt_test_folder();
    kt_scene rejected;
    (void)kt_test_file(folder, "outer.xml", "<mujocoinclude/>");
    (void)kt_test_file(folder, "inner/part.xml",
                       "<parts><worldbody><body name='part'><joint/>" BALL
                       "</body></worldbody></parts>"); /* of any name */
    (void)kt_test_file(folder, "inner/circle.xml", INCLUDE("circle.xml"));
    (void)kt_test_file(folder, "inner/broken.xml", "<mujoco>\n<worldbody></mujoco>");
    (void)kt_test_file(folder, "inner/wrong.xml",
                       "<mujocoinclude><worldbody><body name='w' pos='x'/></worldbody></mujocoinclude>");
    (void)kt_test_file(folder, "inner/other.xml", "<robot/>");
    kt_check_equal_int("link", symlink("../outer.xml", kt_test_path(folder, "inner/link.xml")), 0);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        kt_check_equal_int(wrong[i][0], read_in(folder, wrong[i][0], NULL, &rejected), KT_ERROR_SCENE);
        kt_check_true(wrong[i][1], strstr(faults.text, wrong[i][1]) != NULL);
        if (strstr(faults.text, wrong[i][1]) == NULL)
            kt_note("%s", faults.text);
    }
    const kt_scene *scene = read_right(folder, INCLUDE("part.xml"), NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 1);
    kt_check_true("its note names the included file",
                  scene->note_count > 0 && strstr(scene->notes[0].where, "part.xml:1:"));
}

/* A file that is in both folders is the model's, as MuJoCo 3.14 finds it. */
/* Each level includes the next one ten times: without a limit of all copies, a file of 300 bytes claims any memory. */
KT_TEST(copies_of_included_files_have_one_limit) {
    const char *folder = kt_test_folder();
    kt_scene rejected;
    (void)kt_test_file(folder, "inner/i8.xml", "<mujoco><worldbody><body/></worldbody></mujoco>");
    for (int level = 7; level >= 0; level--) {
        char name[32], text[512] = "<mujoco>";
        (void)snprintf(name, sizeof name, "inner/i%d.xml", level);
        for (int i = 0; i < 10; i++)
            (void)snprintf(text + strlen(text), sizeof text - strlen(text), "<include file='i%d.xml'/>", level + 1);
        (void)snprintf(text + strlen(text), sizeof text - strlen(text), "</mujoco>");
        (void)kt_test_file(folder, name, text);
    }
    kt_check_equal_int("status", read_in(folder, INCLUDE("i0.xml"), NULL, &rejected), KT_ERROR_SCENE);
    kt_check_contains("words", faults.text, "more than 4096 files are included");
}

KT_TEST(what_an_included_file_names_is_in_the_folder_of_the_model_or_in_its_own) {
    const char *folder = kt_test_folder();
    static const char *const files[][2] = {
        {"inner/sub/both.xml",
         "<mujoco><asset><mesh name='s' file='solid.obj'/><model name='x' file='leaf.xml'/></asset>"
         "<include file='part.xml'/><worldbody><include file='near.xml'/>"
         "<attach model='x' prefix='p_'/></worldbody></mujoco>"},
        {"inner/sub/leaf.xml", WORLD("<body name='leaf'><joint/>" BALL "</body>")},
        {"inner/sub/near.xml",
         "<mujoco><body name='near'><joint/><geom type='mesh' mesh='s' density='600'/></body></mujoco>"},
        {"inner/sub/part.xml", "<mujoco><worldbody><body name='wrong'/></worldbody></mujoco>"},
        {"inner/part.xml", "<mujoco><worldbody><body name='part'><joint/>" BALL "</body></worldbody></mujoco>"},
        {"inner/sub/solid.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
        {"inner/keyed.xml",
         "<mujoco><worldbody><body name='c'><joint name='d'/>" BALL "</body><body name='e' "
         "mocap='true'/></worldbody><actuator><general joint='d' dyntype='integrator'/></actuator>"
         "<keyframe><key name='up' qpos='1' act='2' mpos='1 2 3' mquat='0 1 0 0'/></keyframe></mujoco>"},
        {"inner/m.xml", ""},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        (void)kt_test_file(folder, files[i][0], files[i][1]);
    const kt_scene *scene = read_right(folder, INCLUDE("sub/both.xml"), NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 3);
    kt_check_text("of the part's folder", find_body(scene, "p_leaf")->name, "p_leaf");
    kt_check_text("of the model's folder", find_body(scene, "part")->name, "part");
    kt_check_near("mass by a mesh of the part's folder", find_body(scene, "near")->mass, 100.0, 1e-12);
    kt_check_true("drawn from there",
                  scene->mesh_count == 1 && strstr(scene->meshes[0].file, "/sub/solid.obj") != NULL);
}

/* Paths of Windows, too, as in MuJoCo. */
KT_TEST(a_stripped_path_leaves_the_name_of_the_file) {
    static const char *const paths[] = {"no/where/solid.obj", "C:\\no\\where\\solid.obj", "no/where\\solid.obj"};
    const char *folder = kt_test_folder();
    (void)kt_test_file(folder, "inner/meshes/solid.obj",
                       "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        char text[500];
        (void)snprintf(text, sizeof text,
                       "<mujoco><compiler strippath='true' meshdir='meshes'/><asset><mesh name='s' file='%s'/></asset>"
                       "<worldbody><body name='a'><joint/><geom type='mesh' mesh='s' density='600'/></body></worldbody>"
                       "</mujoco>",
                       paths[i]);
        kt_check_near(paths[i], find_body(read_right(folder, text, NULL), "a")->mass, 100.0, 1e-12);
    }
}

/* MuJoCo rejects such a mesh. */
KT_TEST(lines_of_a_mesh_have_no_mass_which_is_reported_with_the_file) {
    const char *folder = kt_test_folder();
    static const char text[] =
        "<mujoco><asset><mesh name='s' file='lines.obj' inertia='convex'/></asset><worldbody>"
        "<body name='b'><joint/>" BALL "<geom type='mesh' mesh='s'/></body></worldbody></mujoco>";
    (void)kt_test_file(folder, "inner/lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nl 1 2 3 4\n");
    const kt_scene *scene = read_right(folder, text, NULL);
    kt_check_true("reason", has_ranked_note(scene, KT_NOTE_RANK_MOTION,
                                            "(lines.obj: the mesh consists of lines, which enclose nothing: give it "
                                            "faces, or its body an <inertial>)"));
    kt_check_true("the mesh",
                  has_note(scene, "meshes that cannot be read, or enclose nothing: 1; the first: lines.obj"));
}

/* ---- attached models --------------------------------------------------------------------------------------------- */

#define ATTACH(assets, how)                                                                                            \
    "<mujoco><asset>" assets "</asset><worldbody><body name='host'><joint/>" BALL "<attach " how                       \
    "/></body></worldbody></mujoco>"
#define MODEL(file) "<model name='x' file='" file "'/>"
#define OF_X "model='x' prefix='p_'"

static const char *const attached_files[][2] = {
    {"outer.xml", "<mujoco/>"},
    {"inner/part.xml",
     "<mujoco model='part'><compiler angle='radian' eulerseq='zyx' meshdir='meshes'/>"
     "<option gravity='0 0 -1'/>"
     "<default><joint damping='0.7'/><default class='c'><joint armature='2'/></default></default>"
     "<asset><mesh file='solid.obj'/>" MODEL(
         "sub/leaf.xml") "</asset>"
                         "<worldbody><frame pos='9 9 9'><body name='arm' pos='1 0 0' euler='0.5 0 0'>"
                         "<joint name='j' class='c' range='-1 1' ref='0.5'/>" BALL "<attach model='x' prefix='in_'/>"
                         "<site name='tip' pos='0 0 1'/></body></frame>"
                         "<body name='far'><joint name='k' type='ball'/><geom type='mesh' mesh='solid'/>"
                         "<joint name='l'/></body></worldbody>"
                         "<tendon><fixed name='t' stiffness='3'><joint joint='in_m' coef='2'/></fixed>"
                         "<fixed name='u' stiffness='3'><joint joint='l' coef='2'/></fixed></tendon>"
                         "<equality><joint joint1='j' joint2='in_m'/><connect body1='arm' body2='far' anchor='0 0 0'/>"
                         "<connect body1='arm' anchor='0 0 0'/></equality>"
                         "<actuator><position joint='l' kp='2'/><position name='a' joint='j' kp='4'/>"
                         "<motor tendon='u'/><motor name='b' tendon='t'/></actuator>"
                         "<keyframe><key name='up' qpos='0.75 0.125 1 0 0 0 7' qvel='1 2 3 4 5 6' ctrl='1 2 3 4'/>"
                         "</keyframe></mujoco>"},
    {"inner/sub/leaf.xml", "<mujoco><worldbody><body name='leaf' euler='90 0 0'><joint name='m' springref='90' "
                           "stiffness='1'/>" BALL "</body></worldbody></mujoco>"},
    {"inner/meshes/solid.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
    {"inner/circle.xml", ATTACH(MODEL("circle.xml"), OF_X)},
    {"inner/round.xml", ATTACH(MODEL("sub/back.xml"), OF_X)},
    {"inner/sub/back.xml", ATTACH(MODEL("../round.xml"), OF_X)},
    {"inner/bare.xml", "<mujocoinclude/>"},
    {"inner/around.xml",
     "<mujoco><default><default class='c'><joint damping='0.7' axis='0 1 0'/><geom density='500'/></default></default>"
     "<asset>" MODEL("sub/leaf.xml") "</asset><worldbody><frame childclass='c'><body name='base'>" BALL
                                     "<frame pos='1 0 0'><body name='hand'><joint/>" BALL
                                     "</body><attach model='x' prefix='in_'/></frame></body>"
                                     "</frame></worldbody></mujoco>"},
    {"inner/keyed.xml", "<mujoco><worldbody><body name='c'><joint name='d'/>" BALL "</body><body name='e' "
                        "mocap='true'/></worldbody><actuator><general joint='d' dyntype='integrator'/></actuator>"
                        "<keyframe><key name='up' qpos='1' act='2' mpos='1 2 3' mquat='0 1 0 0'/></keyframe></mujoco>"},
    {"inner/m.xml", ""},
};

static const char *make_attached(void) {
    const char *folder = kt_test_folder();
    for (size_t i = 0; i < sizeof attached_files / sizeof *attached_files; i++)
        (void)kt_test_file(folder, attached_files[i][0], attached_files[i][1]);
    return folder;
}

KT_TEST(models_are_attached_from_the_folder_of_the_model_alone) {
    static const char *const wrong[][2] = {
        {ATTACH(MODEL("../outer.xml"), OF_X), "a file is included from the model's folder alone"},
        {ATTACH(MODEL("missing.xml"), OF_X), "cannot be read: No such file or directory"},
        {ATTACH(MODEL("m.xml"), OF_X), "the file is attached within itself"},
        {ATTACH(MODEL("circle.xml"), OF_X), "circle.xml:1:16: model 'x': the file is attached within itself"},
        {ATTACH(MODEL("round.xml"), OF_X), "the file is attached within itself"},
        {ATTACH(MODEL("bare.xml"), OF_X), "begins with <mujocoinclude>, not with <mujoco>"},
        {ATTACH("", OF_X), "there is no <model> 'x' in <asset>"},
        {ATTACH("<model name='x'/>", OF_X), "model 'x': the attribute 'file' is missing"},
        {ATTACH(MODEL("part.xml"), "model='x'"), "attach: the attribute 'prefix' is missing"},
        {ATTACH(MODEL("part.xml"), OF_X " body='nobody'"), "attach: body 'nobody' does not exist in the model"},
        {ATTACH(MODEL("part.xml"), "model='x' prefix='' body='arm'/><body name='arm'"),
         "there is another body of this name"},
    };
    const char *folder = make_attached();
    kt_scene scene;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        kt_check_equal_int(wrong[i][0], read_in(folder, wrong[i][0], NULL, &scene), KT_ERROR_SCENE);
        kt_check_true(wrong[i][1], strstr(faults.text, wrong[i][1]) != NULL);
        if (strstr(faults.text, wrong[i][1]) == NULL)
            kt_note("%s", faults.text);
    }
}

/* The scene of a model as text. */
static const char *text_of_model(const char *folder, const char *model, const char *keyframe) {
    const kt_robot_options options = {.keyframe = keyframe};
    return kt_test_written(read_right(folder, model, &options));
}

/* The same, with names, classes and units of the whole; numbers of a keyframe are those of MuJoCo 3.14's. */
KT_TEST(attached_models_are_those_written_by_hand) {
#define HAND_HEAD                                                                                                      \
    "<mujoco model='m'><compiler angle='radian'/><option gravity='0 0 -5'/><default><joint damping='0.1'/>"            \
    "<default class='c'><joint armature='1'/></default>"
#define HAND_BODY                                                                                                      \
    "<worldbody><body name='host' childclass='c'><joint name='h' springref='0.5' stiffness='1'/>" BALL                 \
    "<frame pos='0 1 0' quat='1 0 0 1'>"
    static const char attached[] =
        HAND_HEAD "</default><asset><model file='part.xml'/></asset>" HAND_BODY
                  "<attach model='part' body='arm' prefix='p_'/></frame><body name='last'><joint name='n'/>" BALL
                  "</body></body></worldbody><actuator><motor name='q' joint='n'/></actuator></mujoco>";
    static const char by_hand[] = HAND_HEAD
        "<default class='part'><joint damping='0.7'/></default><default class='leaf'><joint damping='0'/></default>"
        "</default>" HAND_BODY "<body name='p_arm' childclass='part' pos='1 0 0' euler='0 0 0.5'>"
        "<joint name='p_j' armature='2' range='-1 1' ref='0.5'/>" BALL
        "<body name='p_in_leaf' euler='1.5707963267948966 0 0' childclass='leaf'>"
        "<joint name='p_in_m' springref='1.5707963267948966' stiffness='1'/>" BALL "</body>"
        "<site name='p_tip' pos='0 0 1'/></body></frame><body name='last'><joint name='n'/>" BALL
        "</body></body></worldbody>"
        "<tendon><fixed name='p_t' stiffness='3'><joint joint='p_in_m' coef='2'/></fixed></tendon>"
        "<equality><joint joint1='p_j' joint2='p_in_m'/><connect body1='p_arm' anchor='0 0 0'/></equality>"
        "<actuator><motor name='q' joint='n'/><position name='p_a' joint='p_j' kp='4'/>"
        "<motor name='p_b' tendon='p_t'/></actuator>"
        "<keyframe><key name='p_up' qpos='0 0.75 0.125 0' qvel='0 1 2 0' ctrl='0 2 4'/></keyframe></mujoco>";
    const char *folder = make_attached();
    for (int i = 0; i < 2; i++)
        kt_check_text(i > 0 ? "from the keyframe" : "the scene", text_of_model(folder, attached, i > 0 ? "p_up" : NULL),
                      text_of_model(folder, by_hand, i > 0 ? "p_up" : NULL));
}

/* Frames around it are lost, their classes are not; those of another model never were its own. Numbers of MuJoCo
 * 3.14. */
KT_TEST(an_attached_body_has_the_class_of_what_is_around_it_in_its_model) {
    const char *folder = make_attached();
    kt_scene *scene = read_right(folder, ATTACH(MODEL("around.xml"), OF_X " body='hand'"), NULL);
    const kt_body *hand = find_body(scene, "p_hand");
    kt_check_near("mass", hand->mass, 2.0 / 3.0 * acos(-1.0), 1e-15);
    kt_check_equal_bits("axis", &hand->joint.axis.x, (const double[]){0.0, 1.0, 0.0}, 3);
    kt_check_equal_bits("place", &hand->joint.at.x, (const double[]){0.0, 0.0, 0.0}, 3);
    if (kt_check_equal_int("effects", scene->description.effect_count, 1))
        kt_check_equal_bits("damping", &scene->description.effects[0].damping, &(double){0.7}, 1);
    scene = read_right(folder, ATTACH(MODEL("around.xml"), OF_X " body='in_leaf'"), NULL);
    kt_check_near("mass of a leaf", find_body(scene, "p_in_leaf")->mass, 4.0 / 3.0 * acos(-1.0), 1e-15);
}

KT_TEST(long_prefixes_are_rejected) {
    kt_scene scene;
    char *text = repeat("<mujoco><asset>" MODEL("part.xml") "</asset><worldbody><attach model='x' prefix='", "long",
                        1 << 20, "'/></worldbody></mujoco>");
    if (text != NULL) {
        kt_check_equal_int("it is rejected", read_in(make_attached(), text, NULL, &scene), KT_ERROR_SCENE);
        kt_check_contains("fault", faults.text, "names with prefixes take more than 64 MB");
    }
    free(text);
}

KT_TEST(numbers_of_keyframes_of_attached_models_that_are_left_out_are_warnings) {
    static const char *const words[] = {"act of the keyframe of an attached model", "mpos of the keyframe of an",
                                        "mquat of the keyframe of an"};
    const kt_robot_options options = {.keyframe = "p_up"};
    const char *folder = make_attached();
    const kt_scene *scene = read_right(folder, ATTACH(MODEL("keyed.xml"), OF_X), &options);
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        kt_check_true(words[i], has_ranked_note(scene, KT_NOTE_RANK_MOTION, words[i]));
    kt_check_equal_bits("position", find_body(scene, "p_c")->joint.position, &(double){1.0}, 1);
}

/* The whole world of a model that is attached twice. A joint of a body that stays behind keeps its numbers. */
KT_TEST(a_model_is_attached_whole_and_more_than_once) {
    const char *folder = make_attached();
    const kt_robot_options options = {.keyframe = "b_up"};
    const kt_scene *scene =
        read_right(folder, ATTACH(MODEL("part.xml"), "model='x' prefix='a_'/><attach model='x' prefix='b_'"), &options);
    kt_check_equal_int("bodies", scene->description.body_count, 9);
    kt_check_equal_int("effects", scene->description.effect_count,
                       2 * (3 + 1 + 2 + 4)); /* dampers, springs, of tendons, actuators */
    kt_check_near("mass of a mesh", find_body(scene, "b_far")->mass, 1000.0 / 6.0, 1e-12);
    kt_check_equal_bits("of the keyframe", find_body(scene, "b_arm")->joint.position, (const double[]){0.75}, 1);
    kt_check_equal_bits("of the other's reference", find_body(scene, "a_arm")->joint.position, (const double[]){0.5},
                        1);
    kt_check_equal_bits("of the last joint", find_body(scene, "b_far")->joint.velocity, (const double[]){6.0}, 1);
}
