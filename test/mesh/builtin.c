/* Surfaces that MuJoCo has built in. They have the right numbers of vertices and triangles, and are closed. Polyhedra
 * have their volumes in closed form. Wrong words and numbers are rejected. test/robot compares masses with MuJoCo's. */
#include "check.h"

#include "mesh/mesh.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static bool make(const char *word, int count, const double *numbers, kt_triangles *mesh) {
    kt_error error = {0};
    kt_note("%s %g", word, numbers[0]);
    const kt_status status = kt_triangles_builtin(word, numbers, count, mesh, &error);
    if (status != KT_OK)
        kt_note("%s", error.message);
    return kt_check_equal_int("status", status, KT_OK);
}

static bool is_single_precision(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & UINT64_C(0x1fffffff)) == 0; /* 52 - 23 bits */
}

static int count_rounded(const kt_triangles *mesh) {
    int count = 0;
    for (int i = 0; i < mesh->vertex_count; i++) {
        const kt_vec3 x = mesh->vertices[i];
        count += is_single_precision(x.x) && is_single_precision(x.y) && is_single_precision(x.z);
    }
    return count;
}

typedef struct expected_surface {
    const char *word;
    double numbers[5];
    int count, vertices, triangles;
    double volume, error; /* relative: rounding to single precision, which each of the vertices has */
} expected_surface;

/* With n corners and the area A = n / 2 sin(2 pi / n), a cone has the volume 2 A / 3, and a truncated one
 * 2 A (1 + r + r^2) / 3. An icosahedron has 5 / 12 (3 + sqrt 5) a^3, with the edge a = 4 / sqrt(10 + 2 sqrt 5). Squares
 * of sines and cosines are on an octahedron. Six points at angles of 120 and 45 degrees make a prism. */
KT_TEST(surfaces_are_closed_and_have_the_vertices_and_volumes_of_their_polyhedra) {
    const double single = 4.0 * (double)FLT_EPSILON, edge = 4.0 / sqrt(10.0 + 2.0 * sqrt(5.0));
    const double area5 = 2.5 * sin(0.4 * pi), area7 = 3.5 * sin(2.0 * pi / 7.0);
    const expected_surface all[] = {
        {"sphere", {0}, 1, 12, 20, 5.0 / 12.0 * (3.0 + sqrt(5.0)) * edge * edge * edge, single},
        {"sphere", {3.9}, 1, 642, 1280, 4.0 / 3.0 * pi, 0.01},
        {"sphere", {4}, 1, 2562, 5120, 4.0 / 3.0 * pi, 0.003},
        {"hemisphere", {0}, 1, 6, 8, 2.0 / 3.0, single},
        {"hemisphere", {10}, 1, 266, 528, 2.0 / 3.0 * pi, 0.015},
        {"cone", {7, 0}, 2, 8, 12, 2.0 / 3.0 * area7, single},
        {"cone", {5, 0.5}, 2, 10, 16, 2.0 / 3.0 * area5 * 1.75, single},
        {"supersphere", {4, 2, 2}, 3, 14, 24, 4.0 / 3.0, single},
        {"supersphere", {8, 0, 0}, 3, 58, 112, 8.0, single},
        {"supersphere", {100, 1, 1}, 3, 9902, 19800, 4.0 / 3.0 * pi, 0.002},
        {"supertorus", {100, 0.25, 1, 1}, 4, 10000, 20000, 2.0 * pi * pi * 0.0625, 0.002},
        {"supertorus", {7, 0.5, 2, 0.3}, 4, 49, 98, 0.0, HUGE_VAL},
        {"wedge", {3, 2, 180, 90, 0}, 5, 6, 8, 0.375 * sqrt(6.0), single},
        {"wedge", {12, 10, 180, 90, 1}, 5, 120, 236, 0.0, HUGE_VAL},
    };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        kt_triangles mesh = {.vertices = NULL};
        kt_error error = {0};
        if (!make(all[i].word, all[i].count, all[i].numbers, &mesh))
            continue;
        const kt_enclosed e = kt_triangles_enclosed(&mesh, KT_VOLUME_SIGNED);
        kt_check_equal_int("vertices", mesh.vertex_count, all[i].vertices);
        kt_check_equal_int("triangles", mesh.triangle_count, all[i].triangles);
        kt_check_equal_int("of single precision", count_rounded(&mesh), mesh.vertex_count);
        kt_check_equal_int("closed", kt_triangles_check_closed(&mesh, &error), KT_OK);
        kt_check_above("volume", e.volume, 0.0);
        if (all[i].error < 1.0)
            kt_check_near("volume", e.volume, all[i].volume, all[i].error * all[i].volume);
        kt_triangles_free(&mesh);
    }
}

/* The outer cells are cut off at half: the area is `4 (1 - 1 / m) (1 - 1 / n)`. */
KT_TEST(plate_is_a_surface_between_the_centres_of_its_cells) {
    kt_triangles mesh = {.vertices = NULL};
    if (!make("plate", 2, (const double[]){4, 8}, &mesh))
        return;
    const kt_enclosed e = kt_triangles_enclosed(&mesh, KT_VOLUME_SURFACE);
    kt_check_equal_int("vertices", mesh.vertex_count, 32);
    kt_check_equal_int("triangles", mesh.triangle_count, 42);
    kt_check_near("area", e.volume, 4.0 * 0.75 * 0.875, 16.0 * DBL_EPSILON);
    kt_check_near("height", e.com.z, -1.0, DBL_EPSILON);
    kt_triangles_free(&mesh);
}

KT_TEST(hulls_are_marked_as_such) {
    kt_triangles cone = {.vertices = NULL}, plate = cone;
    if (make("cone", 2, (const double[]){5, 0.5}, &cone) && make("plate", 2, (const double[]){3, 3}, &plate)) {
        kt_check_true("a hull", cone.is_hull);
        kt_check_true("no hull", !plate.is_hull);
    }
    kt_triangles_free(&cone);
    kt_triangles_free(&plate);
}

typedef struct wrong_surface {
    const char *word;
    int count;
    double numbers[6];
    const char *reason;
} wrong_surface;

KT_TEST(numbers_that_mujoco_rejects_are_rejected_by_name) {
    static const wrong_surface all[] = {
        {"prism", 1, {3}, "there is no surface 'prism'"},
        {"none", 1, {1}, "there is no surface 'none'"},
        {"sphere", 2, {1, 2}, "a sphere has 1 number, and there are 2"},
        {"sphere", -1, {0}, "a sphere has 1 number, and there are 0"},
        {"sphere", 1, {5}, "the subdivision of a sphere has to be at most 4"},
        {"sphere", 1, {-1}, "the subdivision of a sphere has to be at least 0"},
        {"sphere", 1, {(double)NAN}, "the subdivision of a sphere has to be at least 0"},
        {"hemisphere", 1, {11}, "the resolution of a hemisphere has to be at most 10"},
        {"cone", 2, {2, 1}, "the nvert of a cone has to be at least 3"},
        {"supersphere", 3, {3, -1, 1}, "the e of a supersphere has to be at least 0"},
        {"supertorus", 4, {8, 0, 1, 1}, "the radius of a supertorus has to be above 0"},
        {"supertorus", 4, {8, 1.5, 1, 1}, "the radius of a supertorus has to be at most 1"},
        {"supertorus", 6, {8, 1, 1, 1, 1, 1}, "a supertorus has 4 numbers, and there are 6"},
        {"wedge", 5, {1e9, 2, 45, 45, 0}, "the res_phi of a wedge has to be at most 128"},
        {"wedge", 5, {2, 2, 45, 91, 0}, "the fov_theta of a wedge has to be at most 90"},
        {"wedge", 5, {1, 2, 45, 45, 0}, "there is no triangle in the mesh"},
        {"wedge", 5, {5, 1, 180, 45, 0}, "the vertices of the mesh are in one plane"},
        {"plate", 2, {1, 5}, "the res_x of a plate has to be at least 2"},
    };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        kt_triangles mesh = {.vertices = NULL};
        kt_error error = {0};
        kt_note("%s", all[i].reason);
        kt_check_equal_int("status", kt_triangles_builtin(all[i].word, all[i].numbers, all[i].count, &mesh, &error),
                           KT_ERROR_SCENE);
        kt_check_contains("reason", error.message, all[i].reason);
        kt_check_true("nothing is made", mesh.vertices == NULL);
    }
}
