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
