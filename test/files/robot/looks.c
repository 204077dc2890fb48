/* The looks of robots: which solids and meshes of a file become shapes and meshes of a scene, and where files of meshes
 * are found. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m"
#include "folder.h"
#include "robot.h"

#include <stdlib.h>
#include <unistd.h>

/* ---- solids ------------------------------------------------------------------------------------------------------ */

#define BOX "<geometry><box size='1 2 3'/></geometry>"
#define URDF(within) "<robot name='r'><link name='a'>" within "</link></robot>"
#define MJCF(within) "<mujoco><worldbody><body name='a'><joint/>" within "</body></worldbody></mujoco>"
#define SDF(within) "<sdf version='1.9'><model name='m'><link name='a'>" within "</link></model></sdf>"
#define SDF_BALL "<geometry><sphere><radius>2</radius></sphere></geometry>"

/* One number is the scale along all axes; a word is none, and does not end the import. */
KT_TEST(scales_of_meshes_that_are_not_three_numbers_are_read) {
    static const char *const texts[] = {
        URDF("<visual><geometry><mesh filename='no.stl' scale='.5'/></geometry></visual>"),
        URDF("<visual><geometry><mesh filename='no.stl' scale='big'/></geometry></visual>")};
    for (int i = 0; i < 2; i++) {
        kt_scene *scene = test_robot(texts[i], NULL);
        kt_check_equal_int("told", count_notes(scene, "scales of meshes that are not three numbers"), i);
    }
}

/* Visuals: a box and a ball; collisions: a ball that is not seen with them. */
KT_TEST(all_visuals_are_seen_and_collisions_only_without_them) {
    static const struct {
        const char *text;
        int count, first; /* shapes, and the type of the first */
    } table[] = {
        {URDF("<visual>" BOX "</visual><visual><geometry><sphere radius='2'/></geometry></visual>"
              "<collision><geometry><sphere radius='3'/></geometry></collision>"),
         2, KT_SHAPE_BOX},
        {URDF("<visual><geometry><mesh filename='no.stl'/></geometry></visual><collision>" BOX "</collision>"
              "<collision><geometry><sphere radius='3'/></geometry></collision>"),
         2, KT_SHAPE_BOX},
        {URDF("<visual>" BOX "</visual>"), 1, KT_SHAPE_BOX},
        {MJCF("<geom type='box' size='1 2 3' group='2'/><geom size='2'/><geom size='3' group='3'/>"), 2, KT_SHAPE_BOX},
        {MJCF("<geom size='3' group='3'/>"), 1, KT_SHAPE_SPHERE},
        {MJCF("<geom type='plane' size='1 1 1'/><geom size='3'/>"), 1, KT_SHAPE_SPHERE},
        {SDF("<visual name='u'>" SDF_BALL "</visual><visual name='v'>" SDF_BALL "</visual><collision name='c'>" SDF_BALL
             "</collision>"),
         2, KT_SHAPE_SPHERE},
        {SDF("<visual name='u'><geometry><plane/></geometry></visual><collision name='c'>" SDF_BALL "</collision>"), 1,
         KT_SHAPE_SPHERE},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot(table[i].text, NULL);
        const kt_body *a = find_body(scene, "a");
        const bool is_one = a->shape.type != KT_SHAPE_NONE;
        kt_note("case %d", (int)i);
        kt_check_equal_int("shapes", is_one + a->shape_count, table[i].count);
        kt_check_equal_int("either one or a list", is_one, table[i].count == 1);
        kt_check_equal_int("the first", (int)(is_one ? a->shape.type : a->shapes[0].type), table[i].first);
        const char *text = kt_test_written(scene);
        kt_scene *again = kt_test_scene(text);
        kt_check_equal_int("as a scene", find_body(again, "a")->shape_count, a->shape_count);
        kt_check_equal_bits("mass", &find_body(again, "a")->mass, &a->mass, 1);
    }
}

#define ARM(size, source)                                                                                              \
    "<robot name='r'><link name='a'><" source "><geometry><box size='" size "'/></geometry></" source ">"              \
    "</link><link name='b'/><joint name='j' type='fixed'><parent link='a'/><child link='b'/>"                          \
    "<origin xyz='0.5 0 0'/></joint></robot>"

/* The robot reaches 0.5 m; a cube's corners are `sqrt(3) / 2` of its edge away. */
KT_TEST(collision_far_larger_than_the_robot_is_not_seen) {
    static const struct {
        const char *text;
        bool is_seen;
    } table[] = {
        {ARM("100 100 0.1", "collision"), false}, {ARM("100 100 0.1", "visual"), true},
        {ARM("1 1 1", "collision"), true},        {ARM("2.9 2.9 2.9", "collision"), false},
        {ARM("2.8 2.8 2.8", "collision"), true},  {URDF("<collision>" BOX "</collision>"), true},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot(table[i].text, NULL);
        kt_note("case %d", (int)i);
        kt_check_equal_int("seen", find_body(scene, "a")->shape.type == KT_SHAPE_BOX, table[i].is_seen);
        kt_check_equal_int("told", count_notes(scene, "far larger than the robot: 1"), !table[i].is_seen);
    }
}

KT_TEST(other_collisions_of_the_link_stay) {
    kt_scene *scene =
        test_robot("<robot name='r'><link name='a'><collision><geometry><box size='90 90 1'/></geometry></collision>"
                   "<collision><geometry><sphere radius='0.1'/></geometry></collision><collision><geometry>"
                   "<box size='9 9 9'/></geometry></collision></link><link name='b'/><joint name='j' type='fixed'>"
                   "<parent link='a'/><child link='b'/><origin xyz='0.5 0 0'/></joint></robot>",
                   NULL);
    const kt_body *a = find_body(scene, "a");
    kt_check_equal_int("shapes", a->shape_count, 1);
    kt_check_equal_int("the ball", (int)a->shapes[0].type, KT_SHAPE_SPHERE);
    kt_check_equal_int("told", count_notes(scene, "far larger than the robot: 2"), 1);
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

static const char *const mesh_files[] = {"arm/meshes/a.stl", "arm/urdf/b.stl", "else/hand/c.stl", "else/d.stl"};

static const char *make_folders(void) {
    const char *base = kt_test_folder();
    for (size_t i = 0; i < sizeof mesh_files / sizeof *mesh_files; i++)
        (void)kt_test_file(base, mesh_files[i], "solid s\nendsolid s\n");
    return base;
}

/* Which of the files a name leads to; -1: none. */
static int find_file(const char *base, const char *name, const char *search) {
    int found[2] = {-1, -1};
    for (int k = 0; k < 2; k++) {
        const kt_robot_options options = {.search = search};
        char text[1200];
        if (k == 0)
            (void)snprintf(text, sizeof text, URDF("<visual><geometry><mesh filename='%s'/></geometry></visual>"),
                           name);
        else
            (void)snprintf(text, sizeof text,
                           SDF("<visual name='v'><geometry><mesh><uri>%s</uri></mesh></geometry></visual>"), name);
        const kt_scene *scene = test_robot_file(kt_test_file(base, "arm/urdf/r", text), &options);
        for (size_t i = 0; i < sizeof mesh_files / sizeof *mesh_files && scene->mesh_count == 1; i++)
            found[k] = strcmp(scene->meshes[0].file, kt_test_path(base, mesh_files[i])) == 0 ? (int)i : found[k];
        kt_check_equal_int("or told", count_notes(scene, "meshes that are not found"), found[k] < 0);
    }
    kt_check_equal_int("the same in both formats", found[0], found[1]);
    return found[0];
}

KT_TEST(meshes_are_found_by_package_model_and_search_path) {
    const char *base = make_folders();
    char search[900], whole[400];
    const struct {
        const char *name;
        int alone, searched; /* without and with a search path */
    } table[] = {
        {"b.stl", 1, 1},
        {"../meshes/a.stl", 0, 0},
        {"package://arm/meshes/a.stl", 0, 0},
        {"model://arm/meshes/a.stl", 0, 0},
        {"package://hand/c.stl", -1, 2},
        {"package://else/d.stl", 3, 3}, /* next to the robot's package; by the search path the package itself */
        {"package://arm/none.stl", -1, -1},
        {"package://", -1, -1},
        {"d.stl", -1, 3},
        {whole, 0, 0},
        {whole + 7, 0, 0},
        {"", -1, -1},
    };
    (void)snprintf(whole, sizeof whole, "file://%s/arm/meshes/a.stl", base);
    (void)snprintf(search, sizeof search, "/nowhere::%s/else/", base);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_note("'%s'", table[i].name);
        kt_check_equal_int("around the robot", find_file(base, table[i].name, NULL), table[i].alone);
        kt_check_equal_int("by the search path", find_file(base, table[i].name, search), table[i].searched);
    }
    (void)snprintf(search, sizeof search, "%s/else/hand", base);
    kt_check_equal_int("the package itself", find_file(base, "package://hand/c.stl", search), 2);
    kt_check_equal_int("whose name is another", find_file(base, "package://and/c.stl", search), -1);
}

/* The robot is read through a link to its package, which has the name that the mesh calls the package by. */
KT_TEST(link_that_has_the_name_of_a_package_is_the_package) {
    const char *base = make_folders();
    kt_check_equal_int("link", symlink(kt_test_path(base, "arm"), kt_test_path(base, "robot")), 0);
    (void)kt_test_file(base, "arm/urdf/r",
                       URDF("<visual><geometry><mesh filename='package://robot/meshes/a.stl'/></geometry></visual>"));
    kt_check_equal_int("meshes", test_robot_file(kt_test_path(base, "robot/urdf/r"), NULL)->mesh_count, 1);
}

/* A mesh at `refpos`, turned by `refquat` and scaled, in a geom that is moved and turned itself. Two of its points are
 * at the places that the format's compiler gives, p + R s R0' (x - x0). */
KT_TEST(meshes_of_mjcf_stand_where_their_geoms_do) {
    kt_error error = {0};
    const char *path = kt_test_file(
        make_folders(), "arm/urdf/r",
        "<mujoco><compiler meshdir='../meshes'/><asset><mesh name='m' file='a.stl' refpos='1 2 3' scale='2 2 2' "
        "refquat='0.8 0.6 0 0'/><mesh name='n' file='a.stl' scale='1 2 3' refquat='0.8 0.6 0 0'/></asset>"
        "<worldbody><body name='a'><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"
        "<geom type='mesh' mesh='m' pos='4 5 6' quat='0 0 0.6 0.8'/><geom type='mesh' mesh='n'/></body>"
        "</worldbody></mujoco>");
    const kt_scene *scene = test_robot_file(path, NULL);
    kt_check_equal_int("meshes", scene->mesh_count, 1);
    kt_check_equal_int("the other cannot be placed", count_notes(scene, "a scene cannot place: 1"), 1);
    const kt_mat3 reference = kt_mat3_from_quat(kt_quat_make(0.8, 0.6, 0.0, 0.0));
    const kt_mat3 own = kt_mat3_from_quat(kt_quat_make(0.0, 0.0, 0.6, 0.8));
    for (int k = 0; k < 2 && scene->mesh_count == 1; k++) {
        const kt_scene_mesh *mesh = &scene->meshes[0];
        const kt_vec3 x = k == 0 ? kt_vec3_make(0.0, 0.0, 0.0) : kt_vec3_make(0.3, -0.7, 1.1);
        kt_mat3 turn = kt_mat3_identity();
        kt_check_equal_int("rotation", kt_rotation_evaluate(&mesh->rotation, &turn, &error), KT_OK);
        const kt_vec3 scaled = kt_vec3_make(mesh->scale.x * x.x, mesh->scale.y * x.y, mesh->scale.z * x.z);
        const kt_vec3 is = kt_vec3_add(mesh->at, kt_mat3_apply(turn, scaled));
        const kt_vec3 from = kt_vec3_sub(x, kt_vec3_make(1.0, 2.0, 3.0));
        const kt_vec3 should =
            kt_vec3_add(kt_vec3_make(4.0, 5.0, 6.0),
                        kt_mat3_apply(own, kt_vec3_scale(2.0, kt_mat3_apply_transposed(reference, from))));
        kt_check_near("distance", kt_vec3_norm(kt_vec3_sub(is, should)), 0.0, 1e-14);
    }
}

/* ---- scene files ------------------------------------------------------------------------------------------------- */

KT_TEST(meshes_of_a_scene_are_written_and_read_back) {
    static const char text[] =
        "kinetree: 1\nbodies:\n  - {name: a, mass: 1}\nmeshes:\n  - {body: a, file: \"/no/a b.stl\", "
        "scale: [1, 2, 3], at: [4, 5, 6], rotation: {rpy: [0, 0, 0.5]}}\n  - {body: a, file: x.obj}\n";
    kt_scene *scene = kt_test_scene(text);
    const char *written = kt_test_written(scene);
    kt_scene *again = kt_test_scene(written);
    kt_check_equal_int("how many", again->mesh_count, 2);
    for (int i = 0; i < 2 && again->mesh_count == 2; i++) {
        kt_check_text("file", again->meshes[i].file, scene->meshes[i].file);
        kt_check_text("body", again->meshes[i].body, "a");
        kt_check_equal_bits("scale, place", &again->meshes[i].scale.x, &scene->meshes[i].scale.x, 6);
    }
    kt_check_equal_bits("read as given", &scene->meshes[0].scale.x, (const double[]){1.0, 2.0, 3.0, 4.0, 5.0, 6.0}, 6);
    kt_check_equal_bits("of itself", &scene->meshes[1].scale.x, (const double[]){1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, 6);
}

KT_TEST(mesh_of_no_body_is_a_fault) {
    kt_scene scene;
    kt_error error = {0};
    static const char text[] = "kinetree: 1\nbodies:\n  - {name: a, mass: 1}\nmeshes:\n  - {body: b, file: x.obj}\n";
    kt_check_equal_int("status", kt_scene_parse(ROBOT, text, sizeof text - 1, &scene, NULL, NULL, &error),
                       KT_ERROR_SCENE);
    kt_check_text("where", error.where, "m:5:12");
    kt_check_contains("words", error.message, "meshes[0]: body 'b' does not exist");
}
