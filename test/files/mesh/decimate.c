/* Surfaces with fewer triangles: shared vertices, bounds of their number, and the remains of a ball. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "mesh/mesh.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

/* A ball of radius r about the origin, of n rings with 2 n corners each; every triangle has vertices of its own. */
static kt_triangles make_ball(int n, double r) {
    const int quads = 2 * n * n;
    kt_triangles mesh = {.vertices = calloc(6 * (size_t)quads, sizeof(kt_vec3)),
                         .triangles = calloc(2 * (size_t)quads, sizeof(kt_triangle))};
    for (int i = 0; i < quads && mesh.vertices != NULL && mesh.triangles != NULL; i++) {
        static const int steps[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
        for (int k = 0; k < 6; k++) {
            const int ring = i / (2 * n) + steps[k][0], side = (i % (2 * n) + steps[k][1]) % (2 * n);
            const double a = pi * ring / n, b = pi * side / n, s = ring == 0 || ring == n ? 0.0 : sin(a);
            mesh.vertices[mesh.vertex_count++] = kt_vec3_make(r * s * cos(b), r * s * sin(b), r * cos(a));
        }
        for (int k = 0; k < 2; k++)
            mesh.triangles[mesh.triangle_count++] =
                (kt_triangle){{6 * i + 3 * k, 6 * i + 3 * k + 1, 6 * i + 3 * k + 2}};
    }
    return mesh;
}

/* n rings have `2 n (n - 1) + 2` vertices. Triangles at the poles without area vanish: `2 n` of each. */
KT_TEST(vertices_become_shared_and_nothing_else_changes) {
    kt_triangles ball = make_ball(12, 0.3);
    const double volume = kt_triangles_enclosed(&ball, KT_VOLUME_SIGNED).volume;
    kt_error error = {0};
    kt_check_equal_int("status", kt_triangles_decimate(&ball, 1000, &error), KT_OK);
    kt_check_equal_int("vertices", ball.vertex_count, 2 * 12 * 11 + 2);
    kt_check_equal_int("triangles", ball.triangle_count, 2 * 2 * 12 * 12 - 2 * 2 * 12);
    kt_check_near("volume", kt_triangles_enclosed(&ball, KT_VOLUME_SIGNED).volume, volume, 2e-14 * volume);
    kt_triangles_free(&ball);
}

/* Vertices are means of vertices in a cube of edge e. Their distance from the surface is at most three times `e^2 / 2
 * r`. The number of triangles is within the bound, and not below a quarter of it. Cubes of an edge shorter by one in n
 * leave fewer than four times as many. */
KT_TEST(no_more_triangles_remain_than_are_asked_for) {
    static const int most[] = {3000, 700, 100};
    for (int i = 0; i < 3; i++) {
        kt_triangles ball = make_ball(60, 2.0);
        kt_error error = {0};
        kt_check_equal_int("status", kt_triangles_decimate(&ball, most[i], &error), KT_OK);
        kt_check_below("triangles", ball.triangle_count, most[i] + 0.5);
        kt_check_above("not far fewer", ball.triangle_count, 0.25 * most[i]);
        double nearest = 1e300, farthest = 0.0;
        for (int k = 0; k < ball.vertex_count; k++) {
            nearest = fmin(nearest, kt_vec3_norm(ball.vertices[k]));
            farthest = fmax(farthest, kt_vec3_norm(ball.vertices[k]));
        }
        const double edge =
            4.0 / sqrt(ball.triangle_count / (2.0 * pi)); /* about: `pi (2 r / e)^2 / 2` cubes, two triangles each */
        kt_check_below("no vertex outside", farthest, 2.0 * (1.0 + 4.0 * DBL_EPSILON));
        kt_check_above("none far inside", nearest, 2.0 - 3.0 * edge * edge / 4.0);
        kt_triangles_free(&ball);
    }
}

KT_TEST(surface_without_area_vanishes) {
    const double vertices[] = {1, 2, 3, 1, 2, 3, 1, 2, 3}, face[] = {0, 1, 2};
    kt_triangles mesh = {.vertices = NULL};
    kt_error error = {0};
    kt_check_equal_int("made", kt_triangles_make(vertices, 3, face, 1, &mesh, &error), KT_OK);
    kt_check_equal_int("status", kt_triangles_decimate(&mesh, 10, &error), KT_OK);
    kt_check_equal_int("triangles", mesh.triangle_count, 0);
    kt_check_equal_int("vertices", mesh.vertex_count, 1);
    kt_triangles_free(&mesh);
}

/* Found by fuzzing: corners at the upper ends of the box were in cubes of their own, even of one cube for all. */
KT_TEST(no_more_remain_of_triangles_that_lie_over_each_other) {
    enum { COPIES = 20 };
    double vertices[9] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0}, triangles[3 * COPIES];
    kt_triangles mesh = {.vertices = NULL};
    kt_error error = {0};
    for (int i = 0; i < 3 * COPIES; i++)
        triangles[i] = i % 3;
    kt_need(kt_check_equal_int("made", kt_triangles_make(vertices, 3, triangles, COPIES, &mesh, &error), KT_OK));
    kt_check_equal_int("status", kt_triangles_decimate(&mesh, COPIES - 1, &error), KT_OK);
    kt_check_equal_int("all in one cube", mesh.triangle_count, 0);
    kt_triangles_free(&mesh);
}
