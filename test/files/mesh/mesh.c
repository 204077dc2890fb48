/* Files of triangles, and the volumes that surfaces enclose: closed forms of a box and a tetrahedron, in each of the
 * formats. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "mesh/mesh.h"
#include "random.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double corners[4][3] = {{0.5, 0.25, 1.0}, {2.5, 0.25, 1.0}, {0.5, 3.25, 1.0}, {0.5, 0.25, 5.0}};
static const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

/* The tetrahedron has edges a, b, c along the axes from the first corner. Its volume is `V = a b c / 6`, and its
 * centroid is a quarter of each edge away. About the centroid, `Ixx = V (3/80) (b^2 + c^2)` and `Ixy = V a b / 80`. */
static void check_tetrahedron(const char *what, const kt_triangles *mesh, kt_volume_rule rule) {
    const double a = 2.0, b = 3.0, c = 4.0, v = 4.0;
    const kt_enclosed e = kt_triangles_enclosed(mesh, rule);
    const double seen[] = {e.volume,     e.com.x,      e.com.y,      e.com.z,      e.inertia.xx,
                           e.inertia.yy, e.inertia.zz, e.inertia.xy, e.inertia.xz, e.inertia.yz};
    const double expected[] = {v,
                               0.5 + a / 4.0,
                               0.25 + b / 4.0,
                               1.0 + c / 4.0,
                               0.0375 * v * (b * b + c * c),
                               0.0375 * v * (a * a + c * c),
                               0.0375 * v * (a * a + b * b),
                               v * a * b / 80.0,
                               v * a * c / 80.0,
                               v * b * c / 80.0};
    kt_note("%s", what);
    kt_check_equal_int("triangles", mesh->triangle_count, 4);
    for (int i = 0; i < 10; i++)
        kt_check_near("volume, centroid, inertia", seen[i], expected[i], 32.0 * DBL_EPSILON * fmax(1.0, expected[i]));
}

static bool parse(const char *text, size_t size, kt_triangles *mesh) {
    kt_error error = {0};
    const kt_status status = kt_triangles_parse(text, size, mesh, &error);
    if (status != KT_OK)
        kt_note("%s", error.message);
    return kt_check_equal_int("status", status, KT_OK);
}

static void put_number(char *to, double value) {
    const float x = (float)value; /* all of the corners are exact */
    memcpy(to, &x, sizeof x);
}

static size_t write_binary_stl(char *text) {
    const uint32_t count = 4;
    memset(text, 0, 84 + 200);
    (void)sprintf(text, "solid, as some writers begin it");
    memcpy(text + 80, &count, sizeof count);
    for (int f = 0; f < 4; f++)
        for (int k = 0; k < 9; k++)
            put_number(text + 84 + 50 * f + 12 + 4 * k, corners[faces[f][k / 3]][k % 3]);
    return 84 + 200;
}

static size_t write_text_stl(char *text) {
    size_t length = (size_t)sprintf(text, "solid part\r\n");
    for (int f = 0; f < 4; f++) {
        length += (size_t)sprintf(text + length, "facet normal 0 0 0\n outer loop\n");
        for (int k = 0; k < 3; k++)
            length += (size_t)sprintf(text + length, "  vertex %g %g %e\n", corners[faces[f][k]][0],
                                      corners[faces[f][k]][1], corners[faces[f][k]][2]);
        length += (size_t)sprintf(text + length, " endloop\nendfacet\n");
    }
    return length + (size_t)sprintf(text + length, "endsolid");
}

static size_t write_msh(char *text) {
    const uint32_t head[4] = {4, 0, 0, 4};
    memcpy(text, head, 16);
    for (int k = 0; k < 12; k++)
        put_number(text + 16 + 4 * k, corners[k / 3][k % 3]);
    memcpy(text + 64, faces, 48);
    return 112;
}

static const char obj[] =
    "# a part\nmtllib m.mtl\nv 0.5 0.25 1\nv 2.5 0.25 1 1.0\n\tv 0.5 3.25 1\nv 0.5 0.25 5\nvn 0 0 1\n"
    "vt 0 0\nf 1 3 2\nf 1/1/1 2/1/1 4/1/1\nf -4//1 -1//1 -2//1\r\nf 2 3 4";

KT_TEST(every_format_gives_the_same_tetrahedron) {
    static char text[4000];
    kt_triangles mesh;
    static size_t (*const writers[])(char *) = {write_binary_stl, write_text_stl, write_msh};
    static const char *const names[] = {"binary STL", "STL in text", "MSH"};
    for (int i = 0; i < 3; i++)
        if (parse(text, writers[i](text), &mesh)) {
            check_tetrahedron(names[i], &mesh, KT_VOLUME_SIGNED);
            kt_triangles_free(&mesh);
        }
    if (parse(obj, sizeof obj - 1, &mesh)) {
        check_tetrahedron("OBJ", &mesh, KT_VOLUME_SIGNED);
        check_tetrahedron("OBJ, volumes without signs", &mesh, KT_VOLUME_ABSOLUTE);
        kt_triangles_free(&mesh);
    }
}

/* A box of polygons: `I = m (b^2 + c^2) / 12`; turned inside out it encloses nothing. */
KT_TEST(polygons_are_divided_and_inside_out_encloses_nothing) {
    static const char box[] = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 0 0 4\nv 2 0 4\nv 2 3 4\nv 0 3 4\n"
                              "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    kt_triangles mesh;
    if (!parse(box, sizeof box - 1, &mesh))
        return;
    const kt_enclosed e = kt_triangles_enclosed(&mesh, KT_VOLUME_SIGNED);
    kt_check_near("volume", e.volume, 24.0, 1e-13);
    kt_check_near("inertia", e.inertia.xx, 24.0 * (9.0 + 16.0) / 12.0, 1e-12);
    kt_check_near("product", e.inertia.xy, 0.0, 1e-12);
    kt_triangles_place(&mesh, kt_pose_identity(), kt_vec3_make(1.0, 1.0, -0.5));
    kt_check_near("mirrored and half as high", kt_triangles_enclosed(&mesh, KT_VOLUME_SIGNED).volume, -12.0, 1e-13);
    kt_check_near("without signs", kt_triangles_enclosed(&mesh, KT_VOLUME_ABSOLUTE).volume, 12.0, 1e-13);
    kt_triangles_free(&mesh);
}

/* The diagonal between the corners at height 1 is the shorter one, wherever the face begins. */
KT_TEST(quadrilaterals_are_divided_by_their_shorter_diagonal_polygons_as_fans) {
    static const char quad[] = "v 0 0 0\nv 2 0 1\nv 3 3 0\nv 0 2 1\nf 1 2 3 4\n",
                      turned[] = "v 0 2 1\nv 0 0 0\nv 2 0 1\nv 3 3 0\nf 1 2 3 4\n";
    static const char five[] = "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n";
    static const int expected[][9] = {{0, 1, 3, 1, 2, 3}, {0, 1, 2, 0, 2, 3}, {0, 1, 2, 0, 2, 3, 0, 3, 4}};
    static const char *const texts[] = {quad, turned, five};
    for (int i = 0; i < 3; i++) {
        kt_triangles mesh;
        if (!parse(texts[i], strlen(texts[i]), &mesh))
            continue;
        kt_check_equal_int("triangles", mesh.triangle_count, i < 2 ? 2 : 3);
        for (int k = 0; k < 3 * mesh.triangle_count; k++)
            kt_check_equal_int("corner", mesh.triangles[k / 3].corner[k % 3], expected[i][k]);
        kt_triangles_free(&mesh);
    }
}

/* Six faces of a box, with vertices shared or not. */
#define BOX "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 0 0 4\nv 2 0 4\nv 2 3 4\nv 0 3 4\n"
KT_TEST(holes_and_faces_that_are_turned_over_have_a_place) {
    static const struct {
        const char *text, *words; /* NULL: it is closed */
    } table[] = {
        {BOX "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n", NULL},
        {BOX "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n", NULL},
        {BOX BOX "f 4 3 10 1\nf 5 14 7 8\nf 9 2 6 5\nf 2 3 15 6\nf 3 4 8 7\nf 12 1 5 16\n", NULL},
        {BOX "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 1 1 2\n", NULL},
        {BOX "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n",
         "the surface is not closed: 4 edges are those of a single triangle, the first from (0, 0, 4) to (0, 3, 4) in "
         "units of the file"},
        {BOX "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 7 3 2 6\nf 3 4 8 7\nf 4 1 5 8\n",
         "triangles of the surface are turned inside out against their neighbours, at 4 edges, the first from "},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_triangles mesh;
        kt_error error = {0};
        kt_note("surface %zu", i);
        if (!parse(table[i].text, strlen(table[i].text), &mesh))
            continue;
        kt_check_equal_int("closed", kt_triangles_check_closed(&mesh, &error), table[i].words ? KT_ERROR_SCENE : KT_OK);
        if (table[i].words)
            kt_check_contains("words", error.message, table[i].words);
        kt_triangles_free(&mesh);
    }
}

/* Lines without area, unless there are polygons. */
KT_TEST(lines_of_obj_are_read_without_polygons) {
    static const char *const texts[] = {"v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 3/5 2\nl -1 1\nv 0 0 1\n",
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nf 1 2 3\n"};
    static const int ends[3][3] = {{0, 2, 2}, {2, 1, 1}, {2, 0, 0}};
    for (int i = 0; i < 2; i++) {
        kt_triangles mesh;
        if (!parse(texts[i], strlen(texts[i]), &mesh))
            continue;
        kt_check_equal_int("lines alone", mesh.is_lines, i == 0);
        kt_check_true("no hull", !mesh.is_hull);
        if (kt_check_equal_int("triangles", mesh.triangle_count, i == 0 ? 3 : 1) && i == 0)
            for (int k = 0; k < 9; k++)
                kt_check_equal_int("corner", mesh.triangles[k / 3].corner[k % 3], ends[k / 3][k % 3]);
        kt_check_equal_bits("volume", &(double){kt_triangles_enclosed(&mesh, KT_VOLUME_SIGNED).volume}, &(double){0.0},
                            1);
        kt_triangles_free(&mesh);
    }
}

KT_TEST(what_is_no_mesh_is_told) {
    static const char *const table[][2] = {
        {"", "there is no triangle in the mesh"},
        {"v 0 0 0\n", "there is no triangle in the mesh"},
        {"v 0 0\n", "a vertex of the mesh has less than three numbers"},
        {"v 0 0 0\nf 1 2 3\n", "a face or a line of the mesh names a vertex that is not there"},
        {"v 0 0 0\nf 1 -9 0\n", "a face or a line of the mesh names a vertex that is not there"},
        {"v 0 0 0\nl 1 2\n", "a face or a line of the mesh names a vertex that is not there"},
        {"v 1e999 0 0\n", "a vertex of the mesh is not finite"},
        {"solid\nvertex 1 2\n", "a vertex of the mesh has less than three numbers"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_triangles mesh;
        kt_error error = {0};
        kt_check_equal_int("status", kt_triangles_parse(table[i][0], strlen(table[i][0]), &mesh, &error),
                           KT_ERROR_SCENE);
        kt_check_text(table[i][0], error.message, table[i][1]);
    }
    kt_error error = {0};
    kt_triangles mesh;
    kt_check_equal_int("bytes", kt_triangles_parse("\0\1\2", 3, &mesh, &error), KT_ERROR_SCENE);
}

/* ---- hulls ------------------------------------------------------------------------------------------------------- */

/* A hull of points: closed, outwards, with no point beyond a triangle by more than `slack`. */
static bool hull_of(const double *points, int count, double slack, kt_triangles *mesh) {
    kt_error error = {0};
    double beyond = 0.0;
    if (!kt_check_equal_int("status", kt_triangles_make(points, count, NULL, 0, mesh, &error), KT_OK)) {
        kt_note("%s", error.message);
        return false;
    }
    for (int i = 0; i < mesh->triangle_count; i++) {
        const int *c = mesh->triangles[i].corner;
        const kt_vec3 a = mesh->vertices[c[0]];
        const kt_vec3 n = kt_vec3_cross(kt_vec3_sub(mesh->vertices[c[1]], a), kt_vec3_sub(mesh->vertices[c[2]], a));
        const double area = kt_vec3_norm(n);
        for (int k = 0; k < count && area > 1e-12; k++) /* slivers within a plane have no direction */
            beyond = fmax(beyond, kt_vec3_dot(n, kt_vec3_sub(mesh->vertices[k], a)) / area);
    }
    kt_check_below("beyond a triangle", beyond, slack);
    kt_check_equal_int("closed", kt_triangles_check_closed(mesh, &error), KT_OK);
    return true;
}

/* A box a, b, c with points in its faces, edges and inside, some of them twice: volume and inertia are the box's. Far
 * from the origin, and flat. */
KT_TEST(hulls_of_many_points_of_a_box_are_that_box) {
    enum { MOST = 400 };
    static double points[3 * MOST];
    kt_random random = kt_random_of_test();
    KT_WORST volume = kt_worst_make("volume"), com = kt_worst_make("centre"), inertia = kt_worst_make("inertia");
    for (int n = 0; n < 50; n++) {
        const double size[3] = {kt_random_uniform(&random, 0.1, 3.0), kt_random_uniform(&random, 0.1, 3.0),
                                pow(10.0, kt_random_uniform(&random, -5.0, 1.0))};
        const double away = kt_random_uniform(&random, -10.0, 10.0);
        const int count = kt_random_int(&random, 8, MOST);
        for (int i = 0; i < count; i++)
            for (int k = 0; k < 3; k++) {
                const int kind = i < 8 ? i >> k & 1 : kt_random_int(&random, 0, 4);
                const double part = kind < 2 ? kind : 0.125 * kt_random_int(&random, 0, 8);
                points[3 * i + k] = away + part * size[k];
            }
        kt_triangles mesh = {.vertices = NULL};
        if (!hull_of(points, count, 1e-13, &mesh))
            return;
        const kt_enclosed e = kt_triangles_enclosed(&mesh, KT_VOLUME_SIGNED);
        const double v = size[0] * size[1] * size[2], flat = 1.0 + 10.0 / size[2]; /* rounding far from the origin */
        kt_worst_near(&volume, e.volume / v, 1.0, 1e-14 * flat, "%d", n);
        kt_worst_near(&com, e.com.x, away + 0.5 * size[0], 4e-14, "%d", n);
        kt_worst_near(&inertia, e.inertia.zz / (v * (size[0] * size[0] + size[1] * size[1]) / 12.0), 1.0, 1e-13 * flat,
                      "%d", n);
        kt_triangles_free(&mesh);
    }
}

/* n points on a sphere are all corners: 2 n - 4 triangles. Rounding of equal heights does not matter: those of a ring
 * are. */
KT_TEST(hulls_of_points_on_a_sphere_have_all_of_them) {
    enum { RINGS = 19, SPOKES = 30, COUNT = RINGS * SPOKES + 2 };
    static double points[3 * COUNT];
    const double pi = 3.14159265358979323846;
    for (int i = 0; i < COUNT - 2; i++) {
        const double tilt = pi * (double)(i / SPOKES + 1) / (RINGS + 1),
                     turn = 2.0 * pi * (double)(i % SPOKES) / SPOKES;
        points[3 * i] = sin(tilt) * cos(turn);
        points[3 * i + 1] = sin(tilt) * sin(turn);
        points[3 * i + 2] = cos(tilt);
    }
    points[3 * (COUNT - 2) + 2] = 1.0;
    points[3 * (COUNT - 1) + 2] = -1.0;
    kt_triangles mesh = {.vertices = NULL};
    if (!hull_of(points, COUNT, 1e-15, &mesh))
        return;
    kt_check_equal_int("triangles", mesh.triangle_count, 2 * COUNT - 4);
    const double volume = kt_triangles_enclosed(&mesh, KT_VOLUME_SIGNED).volume / (4.0 / 3.0 * pi);
    kt_check_near("of the ball", volume, 0.985, 0.015);
    kt_triangles_free(&mesh);
}

KT_TEST(points_in_a_plane_have_no_hull) {
    static const double flat[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 3, 4, 0},
                        slanted[] = {0, 0, 0, 1, 0, 1, 0, 1, 1, 1, 1, 2, 3, 4, 7},
                        line[] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3}, one[] = {1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3};
    const double *const all[] = {flat, slanted, line, one};
    const int counts[] = {5, 5, 4, 4};
    for (int i = 0; i < 4; i++) {
        kt_triangles mesh = {.vertices = NULL};
        kt_error error = {0};
        kt_check_equal_int("status", kt_triangles_make(all[i], counts[i], NULL, 0, &mesh, &error), KT_ERROR_SCENE);
        kt_check_contains("words", error.message, "in one plane");
        kt_check_true("nothing is kept", mesh.vertices == NULL && mesh.triangles == NULL);
    }
}

/* The surface of a box: m = area, I_zz of each pair of faces. */
KT_TEST(shells_of_boxes_have_the_mass_of_their_faces) {
    const double a = 2.0, b = 3.0, c = 4.0;
    const double points[] = {0, 0, 0, a, 0, 0, 0, b, 0, a, b, 0, 0, 0, c, a, 0, c, 0, b, c, a, b, c};
    kt_triangles mesh = {.vertices = NULL};
    if (!hull_of(points, 8, 1e-15, &mesh))
        return;
    const kt_enclosed e = kt_triangles_enclosed(&mesh, KT_VOLUME_SURFACE);
    const double ab = 2.0 * a * b, bc = 2.0 * b * c, ac = 2.0 * a * c;
    const double zz =
        ab * (a * a + b * b) / 12.0 + bc * (b * b / 12.0 + a * a / 4.0) + ac * (a * a / 12.0 + b * b / 4.0);
    kt_check_near("area", e.volume, ab + bc + ac, 1e-13);
    kt_check_near("centre", e.com.y, 0.5 * b, 1e-14);
    kt_check_near("inertia", e.inertia.zz, zz, 1e-12);
    kt_triangles_free(&mesh);
}

/* ---- any bytes --------------------------------------------------------------------------------------------------- */

/* Changes up to four bytes, to extremes as often as to anything, or cuts the text; returns its new length. */
static size_t mutate(kt_random *random, char *text, size_t size) {
    static const char extremes[] = {0, 1, 0x7f, (char)0x80, (char)0xff, '-', '9', ' ', '\n', 'e', '.'};
    for (int n = kt_random_int(random, 1, 4); n > 0; n--) {
        const int at = kt_random_int(random, 0, (int)size - 1);
        text[at] = kt_random_int(random, 0, 1) == 1 ? extremes[kt_random_int(random, 0, (int)sizeof extremes - 1)]
                                                    : (char)kt_random_int(random, -128, 127);
    }
    return kt_random_int(random, 0, 9) > 0 ? size : (size_t)kt_random_int(random, 0, (int)size);
}

/* The use of a surface that a file names. Its triangles name its vertices, for all bytes of the file. */
static bool use(kt_triangles *mesh) {
    kt_error error = {0};
    bool sound = mesh->triangle_count > 0;
    for (int i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            sound = sound && mesh->triangles[i].corner[k] >= 0 && mesh->triangles[i].corner[k] < mesh->vertex_count;
    (void)kt_triangles_enclosed(mesh, KT_VOLUME_ABSOLUTE);
    (void)!kt_triangles_check_closed(mesh, &error);
    sound = kt_triangles_decimate(mesh, 2, &error) == KT_OK && mesh->triangle_count <= 2 && sound;
    kt_triangles_free(mesh);
    return sound;
}

/* The sanitizers' builds detect reads at wrong lengths. KT_MESHES sets a larger number of cases. */
KT_TEST(any_bytes_are_a_surface_or_rejected_in_words) {
    static size_t (*const writers[])(char *) = {write_binary_stl, write_text_stl, write_msh};
    static char text[4000];
    kt_random random = kt_random_of_test();
    const char *wanted = getenv("KT_MESHES");
    const long count = wanted != NULL ? strtol(wanted, NULL, 10) : 20000;
    long read = 0, wrong = 0;
    for (long n = 0; n < count; n++) {
        size_t size = sizeof obj - 1;
        memcpy(text, obj, sizeof obj);
        if (n % 4 < 3)
            size = writers[n % 4](text);
        size = mutate(&random, text, size);
        char *exact = malloc(size > 0 ? size : 1); /* its end is the end of the memory */
        kt_triangles mesh = {.vertices = NULL};
        kt_error error = {0};
        if (exact == NULL)
            break;
        memcpy(exact, text, size);
        const kt_status status = kt_triangles_parse(exact, size, &mesh, &error);
        read += status == KT_OK;
        wrong += status == KT_OK ? !use(&mesh)
                                 : status != KT_ERROR_SCENE || error.message[0] == '\0' || mesh.vertices != NULL;
        free(exact);
    }
    kt_check_equal_int("neither", wrong, 0);
    kt_check_above("read", (double)read, 0.2 * (double)count);
    kt_check_above("rejected", (double)(count - read), 0.2 * (double)count);
}
