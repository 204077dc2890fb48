/* Files that models in SDF include: from the folder of the model alone, with a warning for those that are not found. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.sdf"
#include "folder.h"
#include "robot.h"
#include "sdf_text.h"

#include "kinetree/kinetree.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static kt_status read_in(const char *folder, const char *uri, kt_scene *scene) {
    char text[600];
    kt_error error = {0};
    (void)snprintf(text, sizeof text, SDF(LINK("a") "<include><uri>%s</uri></include>"), uri);
    const char *path = kt_test_file(folder, "inner/m.sdf", text);
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, "%.200s", path);
    return kt_robot_read(path, NULL, scene, kt_collect, &faults, &error);
}

/* The same of a file that must be right. */
static const kt_scene *read_right(const char *folder, const char *uri) {
    kt_scene *scene = kt_test_scene_place();
    kt_need(kt_check_equal_int(uri, read_in(folder, uri, scene), KT_OK));
    return scene;
}

KT_TEST(files_are_included_from_the_folder_of_the_model_alone) {
    static const char *const wrong[][2] = {
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
    const char *folder = kt_test_folder();
    kt_scene rejected;
    (void)kt_test_file(folder, "outer.sdf", SDF(LINK("b")));
    (void)kt_test_file(folder, "inner/one.sdf", SDF("<include><uri>two.sdf</uri></include>"));
    (void)kt_test_file(folder, "inner/two.sdf", SDF("<include><uri>one.sdf</uri></include>"));
    (void)kt_test_file(folder, "inner/broken.sdf", "<sdf version='1.9'><model></sdf>");
    (void)kt_test_file(folder, "inner/robot.urdf", "<robot/>");
    (void)kt_test_file(folder, "inner/light.sdf", "<sdf version='1.9'><light/></sdf>");
    (void)kt_test_file(folder, "inner/empty.sdf", "<sdf version='1.9'/>");
    (void)kt_test_file(folder, "inner/right.sdf", SDF(LINK("b")));
    kt_check_equal_int("link", symlink("../outer.sdf", kt_test_path(folder, "inner/link.sdf")), 0);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        kt_check_equal_int(wrong[i][0], read_in(folder, wrong[i][0], &rejected), KT_ERROR_SCENE);
        kt_check_contains(wrong[i][0], faults.text, wrong[i][1]);
    }
    for (size_t i = 0; i < sizeof left_out / sizeof *left_out; i++)
        kt_check_true("told", has_note(read_right(folder, left_out[i]), left_out[i]));
    kt_check_true("no model is missing", !has_note(read_right(folder, "light.sdf"), "light.sdf"));
    const kt_scene *right = read_right(folder, "right.sdf");
    kt_check_equal_int("bodies", right->description.body_count, 2);
    (void)find_body(right, "m__b");
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
    kt_scene rejected;
    const kt_scene *scene = test_robot(old, NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 5);
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++)
        (void)find_body(scene, bodies[i]);
    kt_check_true("told", has_note(scene, "are called NAME_1, NAME_2, ... in the scene: 2"));
    kt_check_equal_int("from 1.7 on", parse(newer, NULL, &rejected), KT_ERROR_SCENE);
    kt_check_contains("words", faults.text, "the name is that of the model in line 1, too");
}

/* Versions of a server's model in Gazebo's folder, and a model of the search path, whose version is unknown. */
KT_TEST(the_newest_version_of_a_model_of_a_server_is_read) {
    static const struct {
        const char *uri, *body;
        bool is_noted;
    } table[] = {
        {"https://host/1.0/o/models/n", "n__newest", false},
        {"https://host/1.0/o/models/n/99", "n__old", false},
        {"https://host/1.0/o/models/other", "n__found", false},
        {"https://host/1.0/o/models/other/3", "n__found", true},
    };
    const char *base = kt_test_folder();
    (void)kt_test_file(base, "host/o/models/n/99/model.sdf", SDF(LINK("old")));
    (void)kt_test_file(base, "host/o/models/n/341/model.sdf", SDF(LINK("newest")));
    (void)kt_test_file(base, "other/model.sdf", SDF(LINK("found")));
    const kt_robot_options options = {.search = base};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[400];
        (void)snprintf(
            text, sizeof text,
            "<sdf version='1.9'><world name='w'><include><uri>%s</uri><name>n</name></include></world></sdf>",
            table[i].uri);
        const kt_scene *scene = test_robot_file(kt_test_file(base, "w.sdf", text), &options);
        (void)find_body(scene, table[i].body);
        kt_check_equal_int("told", has_note(scene, "any version on the search path is taken: 1"), table[i].is_noted);
    }
}

/* In a merged model, __model__ follows the canonical link of that model, and not that of the model around. */
KT_TEST(a_merged_model_follows_its_own_canonical_link) {
    static const struct { const char *canonical, *parent; } rows[] = {{"", "b"}, {" canonical_link='d'", "d"}};
    const char *folder = kt_test_folder();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char inner[1000];
        (void)snprintf(inner, sizeof inner,
                       "<sdf version='1.9'><model name='inner'%s>" LINK("b") LINK("c") LINK(
                           "d") "<joint name='j' type='revolute'><parent>__model__</parent><child>c</child></joint>"
                                "</model></sdf>",
                       rows[i].canonical);
        (void)kt_test_file(folder, "inner.sdf", inner);
        const kt_scene *scene = test_robot_file(
            kt_test_file(folder, "m.sdf", SDF(LINK("a") "<include merge='true'><uri>inner.sdf</uri></include>")), NULL);
        kt_check_text("carried by", find_body(scene, "c")->parent, rows[i].parent);
    }
}

/* Names of the including file come first. */
KT_TEST(what_included_models_lose_is_a_warning_at_its_place) {
    static const char wind[] = "<enable_wind>true</enable_wind><plugin name='p' filename='lift.so'/>";
    static const char *const warnings[] = {"'plugin' is left out: 3", "'enable_wind' is left out: 2",
                                           "'experimental:params' is left out: 1"};
    const char *folder = kt_test_folder();
    char inner[400];
    (void)snprintf(inner, sizeof inner, SDF("%s<misspelt/><link name='b'/>"), wind);
    (void)kt_test_file(folder, "inner.sdf", inner);
    const char *path =
        kt_test_file(folder, "m.sdf",
                     SDF("<include><uri>inner.sdf</uri><name>one</name><experimental:params/></include>"
                         "<include><uri>inner.sdf</uri><name>two</name><plugin name='q' filename='q.so'/></include>"));
    const kt_scene *scene = test_robot_file(path, NULL);
    for (size_t i = 0; i < sizeof warnings / sizeof *warnings; i++)
        kt_check_true(warnings[i], has_ranked_note(scene, KT_NOTE_RANK_MOTION, warnings[i]));
    kt_check_true("of no format", has_ranked_note(scene, KT_NOTE_RANK_NAME, "misspelt (2)"));
    for (int i = 0; i < scene->note_count; i++) {
        const bool is_outer = strstr(scene->notes[i].what, "'plugin'") != NULL;
        const bool is_inner = strstr(scene->notes[i].what, "'enable_wind'") != NULL;
        if (is_outer || is_inner)
            kt_check_contains("place", scene->notes[i].where, is_outer ? "m.sdf:1:" : "inner.sdf:1:");
    }
}
