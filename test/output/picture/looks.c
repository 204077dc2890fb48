/* Meshes, boxes of inertia and rods in pictures. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"
#include "shown.h"

#include "kinetree/dynamics.h"
#include "picture/load.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- files ------------------------------------------------------------------------------------------------------- */

enum { SIDES = 48 };

/* Writes a tube as OBJ, with radius 1 and height 3 about z and a lid on top. Its base is at (2, 0, 0). */
static const char *write_tube(void) {
    const char *path = kt_test_path(kt_test_folder(), "tube.obj");
    FILE *file = fopen(path, "w");
    kt_need(kt_check_true("the file is there", file != NULL));
    for (int i = 0; i < SIDES; i++) {
        const double x = 2.0 + cos(2.0 * pi * i / SIDES), y = sin(2.0 * pi * i / SIDES);
        (void)fprintf(file, "v %.17g %.17g 0\nv %.17g %.17g 3\n", x, y, x, y);
    }
    for (int i = 0; i < SIDES; i++) {
        const int a = 2 * i + 1, b = 2 * ((i + 1) % SIDES) + 1;
        (void)fprintf(file, "f %d %d %d %d\n", a, b, b + 1, a + 1);
        if (i > 0 && i < SIDES - 1)
            (void)fprintf(file, "f 2 %d %d\n", a + 1, b + 1);
    }
    kt_need(kt_check_equal_int("it is written", fclose(file), 0));
    return path;
}

/* The box of the tube is 2 x 2 x 3 about (2, 0, 1.5). It is scaled by (1, 2, 1/2), turned about x by 90 degrees and
 * moved. Points are compared in the frame of the body. On the side normals are radial, on the lid along z: the edge
 * stays sharp. */
KT_TEST(mesh_stands_where_the_scene_says_round_and_with_sharp_edges) {
    const char *path = write_tube();
    const kt_scene_mesh from = {.body = "a",
                                .file = path,
                                .scale = {1.0, 2.0, 0.5},
                                .at = {0.1, 0.2, 0.3},
                                .rotation = kt_rotation_rpy(0.5 * pi, 0.0, 0.0)};
    kt_mesh mesh = {0};
    kt_solid solid = {.body = 1};
    kt_error error = {0};
    kt_check_equal_int("status", kt_mesh_load(&from, 10000, &mesh, &solid, &error), KT_OK);
    kt_check_equal_int("triangles", mesh.triangle_count, 3 * SIDES - 2);
    kt_check_near("half x", solid.half.x, 1.0, 1e-15);
    kt_check_near("half y", solid.half.y, 2.0, 1e-15);
    kt_check_near("half z", solid.half.z, 0.75, 1e-15);
    const kt_vec3 centre = kt_vec3_make(0.1 + 2.0, 0.2 - 0.75, 0.3); /* y goes to z, z to -y */
    kt_check_near("centre", kt_vec3_norm(kt_vec3_sub(solid.pose.position, centre)), 0.0, 1e-15);
    KT_WORST side = kt_worst_make("normals of the side"), lid = kt_worst_make("normals of the lid"),
             length = kt_worst_make("their length");
    for (int i = 0; i < mesh.triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const kt_vec3 p = mesh.points[3 * i + k], n = mesh.normals[3 * i + k];
            /* The normal of x^2 + y^2 / 4 = 1, except for the angle between facets, which the mean of two halves. */
            const kt_vec3 radial = kt_vec3_normalize(kt_vec3_make(p.x, 0.25 * p.y, 0.0));
            kt_worst_near(&length, kt_vec3_norm(n), 1.0, 4.0 * DBL_EPSILON, "triangle %d", i);
            if (n.z > 0.5)
                kt_worst_near(&lid, n.z, 1.0, 1e-15, "triangle %d", i);
            else
                kt_worst_near(&side, kt_vec3_dot(n, radial), 1.0, 2e-3, "triangle %d", i);
        }
    kt_mesh_free(&mesh);
}

/* A tetrahedron in centimetres, whose node is moved by 3 cm along x and doubled in z. The file declares y as up.
 * Lengths are then converted to metres. Axes stay, as robots use them. */
static const char collada[] =
    "<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">"
    "<asset><unit name=\"centimeter\" meter=\"0.01\"/><up_axis>Y_UP</up_axis></asset>"
    "<library_geometries><geometry id=\"g\"><mesh>"
    "<source id=\"p\"><float_array id=\"n\" count=\"12\">0 0 0 4 0 0 0 6 0 0 0 8</float_array><technique_common>"
    "<accessor source=\"#n\" count=\"4\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" "
    "type=\"float\"/>"
    "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
    "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>"
    "<triangles count=\"4\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 2 1 0 1 3 0 3 2 1 2 "
    "3</p></triangles>"
    "</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id=\"s\"><node>"
    "<matrix>1 0 0 3 0 1 0 0 0 0 2 0 0 0 0 1</matrix><instance_geometry url=\"#g\"/></node></visual_scene>"
    "</library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n";

/* The box around it in cm is (3..7, 0..6, 0..16). The numbers are read in single precision. */
#ifdef KT_WITH_ASSIMP
/* The mesh of a file with this text, or the error message. */
static kt_status load_collada(const char *text, kt_mesh *mesh, kt_solid *solid, kt_error *error) {
    const kt_scene_mesh from = {
        .body = "a", .file = kt_test_file(kt_test_folder(), "t.dae", text), .scale = {1.0, 1.0, 1.0}};
    return kt_mesh_load(&from, 100, mesh, solid, error);
}
#endif

KT_TEST(collada_stands_in_metres_where_its_nodes_place_it) {
#ifdef KT_WITH_ASSIMP
    kt_mesh mesh = {0};
    kt_solid solid = {.body = 1};
    kt_error error = {0};
    kt_check_equal_int("status", load_collada(collada, &mesh, &solid, &error), KT_OK);
    kt_check_text("error", error.message, "");
    kt_check_equal_int("triangles", mesh.triangle_count, 4);
    const kt_vec3 half = kt_vec3_make(0.02, 0.03, 0.08), centre = kt_vec3_make(0.05, 0.03, 0.08);
    kt_check_near("half edges", kt_vec3_norm(kt_vec3_sub(solid.half, half)), 0.0, 1e-7);
    kt_check_near("centre", kt_vec3_norm(kt_vec3_sub(solid.pose.position, centre)), 0.0, 1e-7);
    kt_mesh_free(&mesh);
#else
    (void)collada;
    kt_skip("COLLADA", "this build is without assimp");
#endif
}

/* Found by fuzzing: assimp ends the process at an empty file and at a list of numbers without their count. It also
 * allocates the gigabytes that a file announces. */
KT_TEST(files_that_end_assimp_do_not_end_the_program) {
#ifdef KT_WITH_ASSIMP
    char damaged[sizeof collada];
    memcpy(damaged, collada, sizeof collada);
    strstr(damaged, "count=")[2] = 'k';
    const char *const texts[][2] = {
        {"", "the file is empty"},
        {"<COLLADA><float_array count = '900000000'>0</float_array></COLLADA>",
         "the file announces more numbers (count) than it has bytes"},
        {damaged, "it could not be read: "}, /* up to assimp 5.2; 5.4 does not end, and reports the fault */
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        kt_mesh mesh = {0};
        kt_solid solid = {.body = 1};
        kt_error error = {0};
        kt_check_equal_int("status", load_collada(texts[i][0], &mesh, &solid, &error), KT_ERROR_SCENE);
        const bool says_why = i == 2 && strncmp(error.message, "assimp: ", 8) == 0;
        kt_check_true(texts[i][1], says_why || strncmp(error.message, texts[i][1], strlen(texts[i][1])) == 0);
        kt_check_true("it has no mesh", mesh.triangle_count == 0);
    }
#else
    kt_skip("COLLADA", "this build is without assimp");
#endif
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

KT_TEST(meshes_take_the_place_of_balls_and_rods_and_lost_ones_are_counted) {
    char text[1500];
    const char *path = write_tube();
    (void)snprintf(
        text, sizeof text,
        "kinetree: 1\ninertia_check: accept\nbodies:\n  - {name: a, mass: 1, com: [9, 9, 9], joint: {type: revolute}}\n"
        "  - {name: sensor, parent: a, mass: 1, joint: {type: fixed, at: [5, 0, 0]}}\n"
        "  - {name: b, parent: a, mass: 1, joint: {type: revolute, at: [0, 5, 0]}}\n"
        "meshes:\n  - {body: a, file: %s}\n  - {body: b, file: %s.none}\n  - {body: b, file: /none.dae}\n",
        path, path);
    const shown s = show(kt_test_scene(text), NULL);
    const kt_picture *p = s.picture;
    int of[3] = {0, 0, 0}; /* a, sensor, b */
    for (int i = 0; p != NULL && i < p->solid_count; i++) {
        of[p->solids[i].body - 1]++;
        kt_check_equal_int("meshes", p->solids[i].mesh != NULL, p->solids[i].body == 1);
    }
    kt_check_equal_int("the mesh alone", of[0], 1);
    kt_check_equal_int("nothing next to it", of[1], 0);
    kt_check_above("a ball without it", of[2], 0.5);
    if (p != NULL) {
        kt_check_equal_int("lost", p->lost_meshes, 2);
        kt_check_contains("why", p->lost_reason, ".none: cannot be read: No such file");
    }
}

/* A uniform box has the box of its inertia; a ball of radius r the cube of half edge sqrt(3/5) r. */
KT_TEST(boxes_have_mass_and_inertia_of_the_bodies) {
    static const char text[] =
        "kinetree: 1\ninertia_check: accept\nbodies:\n  - {name: a, mass: 3, joint: {type: revolute}, shape: {type: "
        "box, size: [0.2, 0.4, 0.6], at: [1, 2, 3],"
        " rotation: {rpy: [0.3, 0.2, 0.1]}}}\n  - {name: b, parent: a, mass: 2, joint: {type: "
        "revolute}, shape: {type: sphere, radius: 0.5}}\n"
        "  - {name: c, parent: b, joint: {type: revolute}}\n  - {name: d, parent: c, mass: 1, "
        "joint: {type: revolute}}\n";
    const kt_picture_options boxes = {.boxes = true};
    const shown s = show(kt_test_scene(text), &boxes);
    const kt_picture *p = s.picture;
    for (int i = 0; p != NULL && i < p->solid_count; i++) {
        const kt_solid *solid = &p->solids[i];
        if (solid->source != KT_SOURCE_INERTIA)
            continue;
        kt_check_equal_int("box", solid->type, KT_SOLID_BOX);
        const double h[3] = {solid->half.x, solid->half.y, solid->half.z}, sum = h[0] + h[1] + h[2];
        if (solid->body == 1) {
            kt_mat3 turn = kt_mat3_identity();
            kt_check_equal_int("rotation",
                               kt_rotation_evaluate(&s.at.scene->description.bodies[0].shape.rotation, &turn, NULL),
                               KT_OK);
            kt_check_near("edges", sum, 0.6, 1e-14);
            kt_check_near("volume", h[0] * h[1] * h[2], 0.1 * 0.2 * 0.3, 1e-15);
            kt_check_near("place", kt_vec3_norm(kt_vec3_sub(solid->pose.position, kt_vec3_make(1.0, 2.0, 3.0))), 0.0,
                          1e-15);
            const kt_vec3 axes[] = {solid->pose.rotation.x, solid->pose.rotation.y, solid->pose.rotation.z};
            for (int k = 0; k < 3; k++)
                if (h[k] > 0.25)
                    kt_check_near("the longest edge", fabs(kt_vec3_dot(axes[k], turn.z)), 1.0, 1e-14);
        } else if (solid->body == 2) {
            kt_check_near("of the ball", sum, 3.0 * sqrt(0.6) * 0.5, 1e-14);
        } else {
            kt_check_equal_int("a point mass is seen, a body without mass is not", solid->body, 4);
            kt_check_above("its edge", h[0], 0.005);
        }
    }
}

/* Rigid parts are connected: every solid touches another one of the part, across bodies without mass. One of them is at
 * the centre of mass, and nothing has to be joined there. */
KT_TEST(rods_join_what_is_fixed_across_bodies_without_solids) {
    static const char text[] =
        "kinetree: 1\ninertia_check: accept\nbodies:\n  - {name: a, mass: 1, com: [0, 0, 1], joint: {type: revolute}}\n"
        "  - {name: flange, parent: a, joint: {type: fixed, at: [0, 0, 1]}}\n"
        "  - {name: hand, parent: flange, mass: 1, com: [1, 0, 0], joint: {type: fixed, at: [2, 0, 0]}}\n";
    const shown s = show(kt_test_scene(text), NULL);
    const kt_picture *p = s.picture;
    bool reached[16] = {true};
    for (int sweep = 0; p != NULL && sweep < 8; sweep++)
        for (int i = 0; i < p->solid_count && i < 16; i++)
            for (int k = 0; k < p->solid_count && reached[i]; k++) {
                /* Ends of rods are at the surfaces of the solids that they join. */
                const kt_pose a = kt_pose_compose(s.poses[p->solids[i].body], p->solids[i].pose),
                              b = kt_pose_compose(s.poses[p->solids[k].body], p->solids[k].pose);
                for (int end = -1; end <= 1; end++) {
                    const kt_vec3 at = kt_pose_apply(b, kt_vec3_make(0.0, 0.0, end * p->solids[k].half.z));
                    const kt_vec3 local = kt_pose_apply(kt_pose_invert(a), at);
                    const kt_vec3 back =
                        kt_pose_apply(kt_pose_invert(b), kt_pose_apply(a, kt_solid_nearest(&p->solids[i], local)));
                    reached[k] =
                        reached[k] ||
                        kt_vec3_norm(kt_vec3_sub(kt_solid_nearest(&p->solids[i], local), local)) < 2.0 * p->radius ||
                        kt_vec3_norm(kt_vec3_sub(kt_solid_nearest(&p->solids[k], back), back)) < 2.0 * p->radius;
                }
            }
    kt_check_above("solids", p != NULL ? p->solid_count : 0, 3.5);
    for (int i = 0; p != NULL && i < p->solid_count && i < 16; i++)
        kt_check_true("it is connected", reached[i]);
}

#define COUPLED(mass)                                                                                                  \
    "kinetree: 1\nbodies:\n  - {name: a, joint: {type: revolute, axis: y}, mass: 1, com: [0, 0, -1]}\n"                \
    "  - {name: length, joint: {type: prismatic}" mass "}\nloops:\n"                                                   \
    "  - {name: c, type: coupling, coefficients: {length: 1, a: -2}}\n"

/* The length of a tendon is one. */
KT_TEST(a_slider_that_is_a_number_alone_is_not_drawn) {
    static const char *const texts[] = {COUPLED(""), COUPLED(", mass: 1")};
    for (int i = 0; i < 2; i++) {
        const shown s = show(kt_test_scene(texts[i]), NULL);
        const kt_picture *p = s.picture;
        int solids = 0;
        for (int k = 0; p != NULL && k < p->solid_count; k++)
            solids += p->solids[k].body == 2;
        kt_check_equal_int("joints", p != NULL ? p->joint_count : -1, 1 + i);
        kt_check_equal_int("its block", solids > 0, i);
    }
}
