/* Files of models in MJCF: included files, and models that are attached, from the folder of the model alone. */
#define ROBOT "m.xml"
#include "folder.h"
#include "mjcf_text.h"
#include "robot.h"

#include "kinetree/kinetree.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- included files ---------------------------------------------------------------------------------------------- */

static kt_status read_in(const char *folder, const char *text, const kt_robot_options *options, kt_scene *scene) {
    char path[300];
    kt_error error = {0};
    (void)snprintf(path, sizeof path, "%s/inner/m.xml", folder);
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, "%.200s", path);
    return put_file(folder, "inner/m.xml", text) ? kt_robot_read(path, options, scene, kt_collect, &faults, &error)
                                                 : KT_ERROR_FILE;
}

#define INCLUDE(file) "<mujoco><include file='" file "'/></mujoco>"

KT_TEST(files_are_included_from_the_folder_of_the_model_alone) {
    static const char *const rejected[][2] = {
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
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX", inner[300], link[300];
    kt_scene scene;
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    (void)snprintf(inner, sizeof inner, "%s/inner", folder);
    (void)snprintf(link, sizeof link, "%s/inner/link.xml", folder);
    kt_check_equal_int("folder", mkdir(inner, 0700), 0);
    kt_check_equal_int("link", symlink("../outer.xml", link), 0);
    put_file(folder, "outer.xml", "<mujocoinclude/>");
    put_file(folder, "inner/part.xml",
             "<parts><worldbody><body name='part'><joint/>" BALL "</body></worldbody></parts>"); /* of any name */
    put_file(folder, "inner/circle.xml", INCLUDE("circle.xml"));
    put_file(folder, "inner/broken.xml", "<mujoco>\n<worldbody></mujoco>");
    put_file(folder, "inner/wrong.xml",
             "<mujocoinclude><worldbody><body name='w' pos='x'/></worldbody></mujocoinclude>");
    put_file(folder, "inner/other.xml", "<robot/>");
    for (size_t i = 0; i < sizeof rejected / sizeof *rejected; i++) {
        kt_check_equal_int(rejected[i][0], read_in(folder, rejected[i][0], NULL, &scene), KT_ERROR_SCENE);
        kt_check_true(rejected[i][1], strstr(faults.text, rejected[i][1]) != NULL);
        if (strstr(faults.text, rejected[i][1]) == NULL)
            kt_note("%s", faults.text);
    }
    if (kt_check_equal_int("status", read_in(folder, INCLUDE("part.xml"), NULL, &scene), KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 1);
        kt_check_true("its note names the included file",
                      scene.note_count > 0 && strstr(scene.notes[0].where, "part.xml:1:"));
        kt_scene_free(&scene);
    }
    static const char *const names[] = {"inner/m.xml",     "inner/part.xml",  "inner/circle.xml", "inner/broken.xml",
                                        "inner/wrong.xml", "inner/other.xml", "inner/link.xml",   "outer.xml"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        (void)snprintf(link, sizeof link, "%s/%s", folder, names[i]);
        kt_check_equal_int("removed", unlink(link), 0);
    }
    kt_check_equal_int("removed", rmdir(inner) + rmdir(folder), 0);
}

/* A file that is in both folders is the model's, as MuJoCo 3.14 finds it. */
KT_TEST(what_an_included_file_names_is_in_the_folder_of_the_model_or_in_its_own) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX", path[300];
    static const char *const folders[] = {"inner/sub", "inner"};
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
    kt_scene scene;
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    for (int i = 1; i >= 0; i--) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, folders[i]);
        kt_check_equal_int("folder", mkdir(path, 0700), 0);
    }
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        put_file(folder, files[i][0], files[i][1]);
    if (kt_check_equal_int("status", read_in(folder, INCLUDE("sub/both.xml"), NULL, &scene), KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 3);
        kt_check_text("of the part's folder", find_body(&scene, "p_leaf")->name, "p_leaf");
        kt_check_text("of the model's folder", find_body(&scene, "part")->name, "part");
        kt_check_near("mass by a mesh of the part's folder", find_body(&scene, "near")->mass, 100.0, 1e-12);
        kt_check_true("drawn from there",
                      scene.mesh_count == 1 && strstr(scene.meshes[0].file, "/sub/solid.obj") != NULL);
        kt_scene_free(&scene);
    }
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, files[i][0]);
        kt_check_equal_int("removed", unlink(path), 0);
    }
    for (int i = 0; i < 2; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, folders[i]);
        kt_check_equal_int("removed", rmdir(path), 0);
    }
    kt_check_equal_int("removed", rmdir(folder), 0);
}

/* MuJoCo rejects such a mesh. */
KT_TEST(lines_of_a_mesh_have_no_mass_which_is_reported_with_the_file) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX", path[300];
    static const char text[] =
        "<mujoco><asset><mesh name='s' file='lines.obj' inertia='convex'/></asset><worldbody>"
        "<body name='b'><joint/>" BALL "<geom type='mesh' mesh='s'/></body></worldbody></mujoco>";
    kt_scene scene;
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    (void)snprintf(path, sizeof path, "%s/inner", folder);
    kt_check_equal_int("folder", mkdir(path, 0700), 0);
    put_file(folder, "inner/lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nl 1 2 3 4\n");
    if (kt_check_equal_int("status", read_in(folder, text, NULL, &scene), KT_OK)) {
        kt_check_true("reason",
                      has_ranked_note(&scene, KT_NOTE_RANK_MOTION,
                                      "(lines.obj: the mesh consists of lines, which enclose nothing: give it "
                                      "faces, or its body an <inertial>)"));
        kt_check_true("the mesh",
                      has_note(&scene, "meshes that cannot be read, or enclose nothing: 1; the first: lines.obj"));
        kt_scene_free(&scene);
    }
    (void)snprintf(path, sizeof path, "%s/inner/lines.obj", folder);
    kt_check_equal_int("removed", unlink(path), 0);
    (void)snprintf(path, sizeof path, "%s/inner/m.xml", folder);
    kt_check_equal_int("removed", unlink(path), 0);
    (void)snprintf(path, sizeof path, "%s/inner", folder);
    kt_check_equal_int("removed", rmdir(path) + rmdir(folder), 0);
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
static const char *const attached_folders[] = {"", "/inner", "/inner/sub", "/inner/meshes"};

static bool make_attached(char *folder) {
    char path[300];
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return false;
    for (size_t i = 1; i < sizeof attached_folders / sizeof *attached_folders; i++) {
        (void)snprintf(path, sizeof path, "%s%s", folder, attached_folders[i]);
        kt_check_equal_int("folder", mkdir(path, 0700), 0);
    }
    for (size_t i = 0; i < sizeof attached_files / sizeof *attached_files; i++)
        put_file(folder, attached_files[i][0], attached_files[i][1]);
    return true;
}

static void remove_attached(const char *folder) {
    char path[300];
    for (size_t i = 0; i < sizeof attached_files / sizeof *attached_files; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, attached_files[i][0]);
        kt_check_equal_int("removed", unlink(path), 0);
    }
    for (size_t i = sizeof attached_folders / sizeof *attached_folders; i-- > 0;) {
        (void)snprintf(path, sizeof path, "%s%s", folder, attached_folders[i]);
        kt_check_equal_int("removed", rmdir(path), 0);
    }
}

KT_TEST(models_are_attached_from_the_folder_of_the_model_alone) {
    static const char *const rejected[][2] = {
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
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    for (size_t i = 0; i < sizeof rejected / sizeof *rejected; i++) {
        kt_check_equal_int(rejected[i][0], read_in(folder, rejected[i][0], NULL, &scene), KT_ERROR_SCENE);
        kt_check_true(rejected[i][1], strstr(faults.text, rejected[i][1]) != NULL);
        if (strstr(faults.text, rejected[i][1]) == NULL)
            kt_note("%s", faults.text);
    }
    remove_attached(folder);
}

/* The scene of a model as text; "" after a failed check. */
static void write_scene(const char *folder, const char *model, const char *keyframe, char *text, size_t room) {
    const kt_robot_options options = {.keyframe = keyframe};
    kt_error error = {0};
    kt_scene scene;
    memset(text, 0, room);
    if (!kt_check_equal_int("status", read_in(folder, model, &options, &scene), KT_OK)) {
        kt_note("%s", faults.text);
        return;
    }
    FILE *stream = fmemopen(text, room - 1, "w");
    kt_check_true("it is written",
                  stream != NULL && kt_scene_write(&scene, stream, &error) == KT_OK && fclose(stream) == 0);
    kt_scene_free(&scene);
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
    static char one[20000], other[20000];
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    if (!make_attached(folder))
        return;
    for (int i = 0; i < 2; i++) {
        write_scene(folder, attached, i > 0 ? "p_up" : NULL, one, sizeof one);
        write_scene(folder, by_hand, i > 0 ? "p_up" : NULL, other, sizeof other);
        kt_check_text(i > 0 ? "from the keyframe" : "the scene", one, other);
    }
    remove_attached(folder);
}

/* Frames around it are lost, their classes are not; those of another model never were its own. Numbers of MuJoCo
 * 3.14. */
KT_TEST(an_attached_body_has_the_class_of_what_is_around_it_in_its_model) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    if (kt_check_equal_int("status", read_in(folder, ATTACH(MODEL("around.xml"), OF_X " body='hand'"), NULL, &scene),
                           KT_OK)) {
        const kt_body *hand = find_body(&scene, "p_hand");
        kt_check_near("mass", hand->mass, 2.0 / 3.0 * acos(-1.0), 1e-15);
        kt_check_equal_bits("axis", &hand->joint.axis.x, (const double[]){0.0, 1.0, 0.0}, 3);
        kt_check_equal_bits("place", &hand->joint.at.x, (const double[]){0.0, 0.0, 0.0}, 3);
        if (kt_check_equal_int("effects", scene.description.effect_count, 1))
            kt_check_equal_bits("damping", &scene.description.effects[0].damping, &(double){0.7}, 1);
        kt_scene_free(&scene);
    } else {
        kt_note("%s", faults.text);
    }
    if (kt_check_equal_int("status", read_in(folder, ATTACH(MODEL("around.xml"), OF_X " body='in_leaf'"), NULL, &scene),
                           KT_OK)) {
        kt_check_near("mass of a leaf", find_body(&scene, "p_in_leaf")->mass, 4.0 / 3.0 * acos(-1.0), 1e-15);
        kt_scene_free(&scene);
    }
    remove_attached(folder);
}

KT_TEST(long_prefixes_are_rejected) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    char *text = repeat("<mujoco><asset>" MODEL("part.xml") "</asset><worldbody><attach model='x' prefix='", "long",
                        1 << 20, "'/></worldbody></mujoco>");
    if (text != NULL && make_attached(folder)) {
        kt_check_equal_int("it is rejected", read_in(folder, text, NULL, &scene), KT_ERROR_SCENE);
        kt_check_contains("fault", faults.text, "names with prefixes and numbers of copies take more than 64 MB");
        remove_attached(folder);
    }
    free(text);
}

/* Such joints exist only as copies. A keyframe has no number for each, and their class is that of the attached
 * model. */
KT_TEST(keyframes_of_models_in_replicates_are_rejected_at_their_place) {
    static const char within[] = "<mujoco><default><joint type='ball'/></default><asset>" MODEL(
        "part.xml") "</asset><worldbody><replicate count='2' offset='0 1 0'><attach model='x' prefix='p_'/>"
                    "</replicate></worldbody></mujoco>";
    static const char told[] = "its model is attached in a <replicate>; which copy it is of is not known";
    const kt_robot_options options = {.keyframe = "p_up"};
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    kt_check_equal_int("status", read_in(folder, within, &options, &scene), KT_ERROR_SCENE);
    kt_check_true(told, strstr(faults.text, "part.xml:1:") != NULL && strstr(faults.text, told) != NULL);
    kt_check_equal_int("without it", read_in(folder, within, NULL, &scene), KT_OK);
    kt_check_equal_int("bodies", scene.description.body_count, 2 * 4);
    kt_scene_free(&scene);
    remove_attached(folder);
}

KT_TEST(numbers_of_keyframes_of_attached_models_that_are_left_out_are_warnings) {
    static const char *const words[] = {"act of the keyframe of an attached model", "mpos of the keyframe of an",
                                        "mquat of the keyframe of an"};
    const kt_robot_options options = {.keyframe = "p_up"};
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    if (kt_check_equal_int("status", read_in(folder, ATTACH(MODEL("keyed.xml"), OF_X), &options, &scene), KT_OK)) {
        for (size_t i = 0; i < sizeof words / sizeof *words; i++)
            kt_check_true(words[i], has_ranked_note(&scene, KT_NOTE_RANK_MOTION, words[i]));
        kt_check_equal_bits("position", find_body(&scene, "p_c")->joint.position, &(double){1.0}, 1);
        kt_scene_free(&scene);
    } else {
        kt_note("%s", faults.text);
    }
    remove_attached(folder);
}

/* The whole world of a model that is attached twice. A joint of a body that stays behind keeps its numbers. */
KT_TEST(a_model_is_attached_whole_and_more_than_once) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    const kt_robot_options options = {.keyframe = "b_up"};
    kt_scene scene;
    if (!make_attached(folder))
        return;
    if (kt_check_equal_int("status",
                           read_in(folder,
                                   ATTACH(MODEL("part.xml"), "model='x' prefix='a_'/><attach model='x' prefix='b_'"),
                                   &options, &scene),
                           KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 9);
        kt_check_equal_int("effects", scene.description.effect_count,
                           2 * (3 + 1 + 2 + 4)); /* dampers, springs, of tendons, actuators */
        kt_check_near("mass of a mesh", find_body(&scene, "b_far")->mass, 1000.0 / 6.0, 1e-12);
        kt_check_equal_bits("of the keyframe", find_body(&scene, "b_arm")->joint.position, (const double[]){0.75}, 1);
        kt_check_equal_bits("of the other's reference", find_body(&scene, "a_arm")->joint.position,
                            (const double[]){0.5}, 1);
        kt_check_equal_bits("of the last joint", find_body(&scene, "b_far")->joint.velocity, (const double[]){6.0}, 1);
        kt_scene_free(&scene);
    } else {
        kt_note("%s", faults.text);
    }
    remove_attached(folder);
}
