/* Files that models in SDF include: from the folder of the model alone, with a warning for those that are not found. */
#define ROBOT "m.sdf"
#include "folder.h"
#include "robot.h"
#include "sdf_text.h"

#include "kinetree/kinetree.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static kt_status read_in(const char *folder, const char *uri, kt_scene *scene) {
    char path[300], text[600];
    kt_error error = {0};
    (void)snprintf(text, sizeof text, SDF(LINK("a") "<include><uri>%s</uri></include>"), uri);
    put_file(folder, "inner/m.sdf", text);
    (void)snprintf(path, sizeof path, "%s/inner/m.sdf", folder);
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, "%.200s", path);
    return kt_robot_read(path, NULL, scene, kt_collect, &faults, &error);
}

KT_TEST(files_are_included_from_the_folder_of_the_model_alone) {
    static const char *const rejected[][2] = {
        {"../outer.sdf", "a file is included from the model's folder alone"},
        {"file:///etc/hostname", "a file is included from the model's folder alone"},
        {"model://../outer.sdf", "a file is included from the model's folder alone"},
        {"link.sdf", "the file lies outside of the model's folder, by a link"},
        {"m.sdf", "files include each other in a circle"},
        {"one.sdf", "files include each other in a circle"},
        {"broken.sdf", "broken.sdf:1:29: this is no well-formed XML"},
        {"robot.urdf", "begins with <robot>, not with <sdf>"},
    };
    static const char *const left_out[] = {"nowhere.sdf", "model://sun", "https://fuel.gazebosim.org/x", "empty.sdf"};
    char folder[] = "/tmp/kinetree-sdf-XXXXXX", path[300];
    kt_scene scene;
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    (void)snprintf(path, sizeof path, "%s/inner", folder);
    kt_check_equal_int("folder", mkdir(path, 0700), 0);
    (void)snprintf(path, sizeof path, "%s/inner/link.sdf", folder);
    kt_check_equal_int("link", symlink("../outer.sdf", path), 0);
    put_file(folder, "outer.sdf", SDF(LINK("b")));
    put_file(folder, "inner/one.sdf", SDF("<include><uri>two.sdf</uri></include>"));
    put_file(folder, "inner/two.sdf", SDF("<include><uri>one.sdf</uri></include>"));
    put_file(folder, "inner/broken.sdf", "<sdf version='1.9'><model></sdf>");
    put_file(folder, "inner/robot.urdf", "<robot/>");
    put_file(folder, "inner/light.sdf", "<sdf version='1.9'><light/></sdf>");
    put_file(folder, "inner/empty.sdf", "<sdf version='1.9'/>");
    put_file(folder, "inner/right.sdf", SDF(LINK("b")));
    for (size_t i = 0; i < sizeof rejected / sizeof *rejected; i++) {
        kt_check_equal_int(rejected[i][0], read_in(folder, rejected[i][0], &scene), KT_ERROR_SCENE);
        kt_check_contains(rejected[i][0], faults.text, rejected[i][1]);
    }
    for (size_t i = 0; i < sizeof left_out / sizeof *left_out; i++)
        if (kt_check_equal_int(left_out[i], read_in(folder, left_out[i], &scene), KT_OK)) {
            kt_check_true("told", has_note(&scene, left_out[i]));
            kt_scene_free(&scene);
        }
    if (kt_check_equal_int("a light", read_in(folder, "light.sdf", &scene), KT_OK)) {
        kt_check_true("no model is missing", !has_note(&scene, "light.sdf"));
        kt_scene_free(&scene);
    }
    if (kt_check_equal_int("one that is right", read_in(folder, "right.sdf", &scene), KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 2);
        (void)find_body(&scene, "m__b");
        kt_scene_free(&scene);
    }
    static const char *const names[] = {"inner/m.sdf",      "inner/one.sdf",   "inner/two.sdf",
                                        "inner/broken.sdf", "inner/light.sdf", "inner/empty.sdf",
                                        "inner/robot.urdf", "inner/right.sdf", "inner/link.sdf",
                                        "outer.sdf",        "inner",           ""};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        kt_check_equal_int("clean", remove(path), 0);
    }
}

/* A world of two models 'a', of one 'a_1', and of a model with two models 'a'. */
#define NAMESAKES(version)                                                                                             \
    "<sdf version='" version "'><world name='w'><model name='a'>" LINK("l") "</model><model name='a'>" LINK(           \
        "l") "</model><model name='a_1'>" LINK("l") "</model><model name='b'><model name='a'>" LINK("l") "</model>"    \
                                                                                                         "<model "     \
                                                                                                         "name='a'"    \
                                                                                                         ">" LINK(     \
                                                                                                             "l") "</" \
                                                                                                                  "mo" \
                                                                                                                  "de" \
                                                                                                                  "l>" \
                                                                                                                  "</" \
                                                                                                                  "mo" \
                                                                                                                  "de" \
                                                                                                                  "l>" \
                                                                                                                  "</" \
                                                                                                                  "wo" \
                                                                                                                  "rl" \
                                                                                                                  "d>" \
                                                                                                                  "</" \
                                                                                                                  "sd" \
                                                                                                                  "f>"

KT_TEST(models_of_one_name_were_allowed_before_1_7) {
    static const char *const bodies[] = {"a__l", "a_1__l", "a_2__l", "b__a__l", "b__a_1__l"};
    static const char old[] = NAMESAKES("1.6"), newer[] = NAMESAKES("1.7");
    kt_scene scene;
    kt_error error = {0};
    if (kt_check_equal_int("before", kt_robot_parse("m", old, strlen(old), NULL, &scene, NULL, NULL, &error), KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 5);
        for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++)
            (void)find_body(&scene, bodies[i]);
        kt_check_true("told", has_note(&scene, "are called NAME_1 here, or a later number: 2"));
        kt_scene_free(&scene);
    }
    kt_check_equal_int("from 1.7 on", kt_robot_parse("m", newer, strlen(newer), NULL, &scene, NULL, NULL, &error),
                       KT_ERROR_SCENE);
    kt_check_contains("words", error.message, "the name is that of the model in line 1, too");
}

/* Versions of a server's model in Gazebo's folder, and a model of the search path, whose version is unknown. */
KT_TEST(the_newest_version_of_a_model_of_a_server_is_read) {
    static const char *const folders[] = {"",
                                          "/host",
                                          "/host/o",
                                          "/host/o/models",
                                          "/host/o/models/n",
                                          "/host/o/models/n/99",
                                          "/host/o/models/n/341",
                                          "/other"};
    static const struct {
        const char *uri, *body;
        bool is_noted;
    } table[] = {
        {"https://host/1.0/o/models/n", "n__newest", false},
        {"https://host/1.0/o/models/n/99", "n__old", false},
        {"https://host/1.0/o/models/other", "n__found", false},
        {"https://host/1.0/o/models/other/3", "n__found", true},
    };
    char base[] = "/tmp/kinetree-versions-XXXXXX", path[400];
    if (!kt_check_true("there is a folder", mkdtemp(base) != NULL))
        return;
    for (size_t i = 1; i < sizeof folders / sizeof *folders; i++) {
        (void)snprintf(path, sizeof path, "%s%s", base, folders[i]);
        kt_check_equal_int("folder", mkdir(path, 0700), 0);
    }
    put_file(base, "host/o/models/n/99/model.sdf", SDF(LINK("old")));
    put_file(base, "host/o/models/n/341/model.sdf", SDF(LINK("newest")));
    put_file(base, "other/model.sdf", SDF(LINK("found")));
    const kt_robot_options options = {.search = base};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[400];
        kt_scene scene;
        kt_error error = {0};
        (void)snprintf(
            text, sizeof text,
            "<sdf version='1.9'><world name='w'><include><uri>%s</uri><name>n</name></include></world></sdf>",
            table[i].uri);
        put_file(base, "w.sdf", text);
        (void)snprintf(path, sizeof path, "%s/w.sdf", base);
        if (kt_check_equal_int(table[i].uri, kt_robot_read(path, &options, &scene, NULL, NULL, &error), KT_OK)) {
            (void)find_body(&scene, table[i].body);
            kt_check_equal_int("told", has_note(&scene, "of whatever version: 1"), table[i].is_noted);
            kt_scene_free(&scene);
        }
    }
    static const char *const files[] = {"w.sdf", "host/o/models/n/99/model.sdf", "host/o/models/n/341/model.sdf",
                                        "other/model.sdf"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", base, files[i]);
        kt_check_equal_int("clean", remove(path), 0);
    }
    for (size_t i = sizeof folders / sizeof *folders; i-- > 0;) {
        (void)snprintf(path, sizeof path, "%s%s", base, folders[i]);
        kt_check_equal_int("clean", remove(path), 0);
    }
}
