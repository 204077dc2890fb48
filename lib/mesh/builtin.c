/* The surfaces that MuJoCo makes from a word and numbers, with its vertices and triangles.
 *
 * With c(x, m) = sign(cos x) |cos x|^m, s(x, m) = sign(sin x) |sin x|^m:
 *
 * sphere n             Starts as an icosahedron. n times, each triangle becomes four, and midpoints move to the unit
 *                      sphere.
 * hemisphere n         Starts as the octahedron |x| + |y| + z = 1 above z = 0. Its 4 k vertices at z = 1 - k / (n + 1)
 *                      move to the unit sphere. The cap at z = 0 has its centre as a vertex.
 * cone n r             The hull of regular polygons of n corners: radius 1 at z = -1, radius r at z = 1. If r <= 0, the
 *                      upper one is a point.
 * supersphere n e m    The points (c(v, m) c(u, e), c(v, m) s(u, e), s(v, m)). There are n longitudes u and n + 1
 *                      latitudes v.
 * supertorus n r m e   The points ((1 + r c(v, m)) c(u, e), (1 + r c(v, m)) s(u, e), r s(v, m)). There are n values of
 *                      u and of v.
 * wedge m n a b g      The hull of m n points of the unit sphere, seen along -z from its centre. The points are the
 *                      centres of cells. With f(x) = g x^5 + (1 - g) x, the edges of cells are at the azimuths a f(x)
 *                      and the heights b f(x). The values x divide -1 ... 1 evenly.
 * plate m n            The centres of m n cells of the square |x| < 1, |y| < 1 at z = -1. It has no volume.
 *
 * MuJoCo keeps vertices in single precision. They are stored as such, since gcc 12 drops a conversion to single and
 * back in a vectorised loop. Near zero, c and s with a small exponent m multiply the rounding of an angle.
 * Angles are therefore computed in MuJoCo's order of operations. */
#include "base/decimal.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* A surface that grows. Its arrays have room for all: see builtin_room. */
typedef struct builtin {
    float *vertices;
    double *corners; /* three each, as of vertices */
    size_t vertex_count, triangle_count;
} builtin;

static void put_vertex(builtin *b, double x, double y, double z) {
    float *to = b->vertices + 3 * b->vertex_count++;
    to[0] = (float)x;
    to[1] = (float)y;
    to[2] = (float)z;
}

static void put_triangle(builtin *b, size_t i, size_t j, size_t k) {
    double *to = b->corners + 3 * b->triangle_count++;
    to[0] = (double)i;
    to[1] = (double)j;
    to[2] = (double)k;
}

/* ---- sphere ------------------------------------------------------------------------------------------------------ */

static void put_icosahedron(builtin *b) {
    static const int signs[12][2] = {{-1, 1},  {1, 1},  {-1, -1}, {1, -1}, {-1, 1},  {1, 1},
                                     {-1, -1}, {1, -1}, {1, -1},  {1, 1},  {-1, -1}, {-1, 1}};
    static const int faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                     {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                     {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                     {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const float golden = (float)((1.0 + sqrt(5.0)) / 2.0);
    const double norm = sqrt(1.0 + (double)(golden * golden));
    for (int i = 0; i < 12; i++) { /* (1, g, 0), (0, 1, g), (g, 0, 1), four signs each */
        const double first = (double)signs[i][0] / norm, second = (double)signs[i][1] / norm, g = (double)golden;
        if (i < 4)
            put_vertex(b, first, g * second, 0.0);
        else if (i < 8)
            put_vertex(b, 0.0, first, g * second);
        else
            put_vertex(b, g * first, 0.0, second);
    }
    for (int i = 0; i < 20; i++)
        put_triangle(b, (size_t)faces[i][0], (size_t)faces[i][1], (size_t)faces[i][2]);
}

/* The vertex between two, which the triangles of an edge share. Vertices of other edges come before `first`. */
static size_t midpoint(builtin *b, size_t first, size_t i, size_t j) {
    const float *u = b->vertices + 3 * i, *v = b->vertices + 3 * j;
    float m[3];
    for (int k = 0; k < 3; k++)
        m[k] = (u[k] + v[k]) / 2.0f;
    const float norm = sqrtf(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    for (int k = 0; k < 3; k++)
        m[k] /= norm;
    for (size_t k = first; k < b->vertex_count; k++) {
        const float *at = b->vertices + 3 * k;
        if (at[0] == m[0] && at[1] == m[1] && at[2] == m[2])
            return k;
    }
    put_vertex(b, (double)m[0], (double)m[1], (double)m[2]);
    return b->vertex_count - 1;
}

/* The first of four triangles takes the place of the old one, the others follow all old ones. */
static void divide_triangles(builtin *b) {
    const size_t count = b->triangle_count, first = b->vertex_count;
    for (size_t i = 0; i < count; i++) {
        double *c = b->corners + 3 * i;
        const size_t v[3] = {(size_t)c[0], (size_t)c[1], (size_t)c[2]};
        const size_t m[3] = {midpoint(b, first, v[0], v[1]), midpoint(b, first, v[1], v[2]),
                             midpoint(b, first, v[2], v[0])};
        put_triangle(b, v[1], m[1], m[0]);
        put_triangle(b, v[2], m[2], m[1]);
        put_triangle(b, m[0], m[1], m[2]);
        c[1] = (double)m[0];
        c[2] = (double)m[2];
    }
}

static void make_sphere(builtin *b, const double *p) {
    put_icosahedron(b);
    for (int i = 0; i < (int)p[0]; i++)
        divide_triangles(b);
}

/* ---- hemisphere -------------------------------------------------------------------------------------------------- */

/* The vertices of row k of the `rows`. */
static void put_row(builtin *b, int k, int rows) {
    static const double equator[5][2] = {{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}, {1.0, 0.0}};
    const double factor = (double)k / rows, z = 1.0 - factor;
    for (int side = 0; side < 4; side++)
        for (int i = 0; i < k; i++) {
            double at[2];
            for (int j = 0; j < 2; j++) {
                const double start = factor * equator[side][j], end = factor * equator[side + 1][j];
                at[j] = start + i * ((end - start) / k);
            }
            const double norm = sqrt(at[0] * at[0] + at[1] * at[1] + z * z);
            put_vertex(b, at[0] / norm, at[1] / norm, z / norm);
        }
}

static void make_hemisphere(builtin *b, const double *p) {
    const size_t rows = (size_t)p[0] + 1;
    put_vertex(b, 0.0, 0.0, 1.0);
    for (size_t k = 1; k <= rows; k++)
        put_row(b, (int)k, (int)rows);
    put_vertex(b, 0.0, 0.0, 0.0);
    for (size_t side = 0; side < 4; side++)
        put_triangle(b, 0, 1 + side, 1 + (side + 1) % 4);
    for (size_t k = 1; k < rows; k++) {
        const size_t upper = 2 * k * (k - 1) + 1, lower = upper + 4 * k;
        for (size_t side = 0; side < 4; side++)
            for (size_t i = 0; i <= k; i++) {
                const size_t u = i + k * side, l = i + (k + 1) * side;
                put_triangle(b, upper + u % (4 * k), lower + l, lower + (l + 1) % (4 * k + 4));
                if (i < k)
                    put_triangle(b, upper + u, lower + (l + 1) % (4 * k + 4), upper + (u + 1) % (4 * k));
            }
    }
    const size_t last = 2 * rows * (rows - 1) + 1, count = 4 * rows;
    for (size_t i = 0; i < count; i++)
        put_triangle(b, last + i, b->vertex_count - 1, last + (i + 1) % count);
}

/* ---- powers of sines --------------------------------------------------------------------------------------------- */

static double power_with_sign(double x, double exponent) { return copysign(pow(fabs(x), exponent), x); }

static void make_supersphere(builtin *b, const double *p) {
    const size_t n = (size_t)p[0], north = (n - 1) * n + 1;
    const int most = (int)p[0];
    put_vertex(b, 0.0, 0.0, -1.0);
    for (int i = 1; i < most; i++)
        for (int j = 0; j < most; j++) {
            const double v = -pi / 2.0 + i * pi / most, u = -pi + j * 2 * pi / most;
            const double radius = power_with_sign(cos(v), p[2]);
            put_vertex(b, radius * power_with_sign(cos(u), p[1]), radius * power_with_sign(sin(u), p[1]),
                       power_with_sign(sin(v), p[2]));
        }
    put_vertex(b, 0.0, 0.0, 1.0);
    for (size_t j = 0; j < n; j++)
        put_triangle(b, 0, 1 + (j + 1) % n, 1 + j);
    for (size_t i = 0; i + 2 < n; i++)
        for (size_t j = 0; j < n; j++) {
            const size_t row = 1 + i * n, next = (j + 1) % n;
            put_triangle(b, row + j, row + next, row + n + j);
            put_triangle(b, row + next, row + n + next, row + n + j);
        }
    for (size_t j = 0; j < n; j++)
        put_triangle(b, north - n + j, north - n + (j + 1) % n, north);
}

static void make_supertorus(builtin *b, const double *p) {
    const size_t n = (size_t)p[0];
    const int most = (int)p[0];
    for (int i = 0; i < most; i++)
        for (int j = 0; j < most; j++) {
            const double u = 2.0 * pi * i / most, v = 2.0 * pi * j / most;
            const double radius = 1.0 + p[1] * power_with_sign(cos(v), p[2]);
            put_vertex(b, radius * power_with_sign(cos(u), p[3]), radius * power_with_sign(sin(u), p[3]),
                       p[1] * power_with_sign(sin(v), p[2]));
        }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const size_t row = i * n, after = (i + 1) % n * n, next = (j + 1) % n;
            put_triangle(b, row + j, after + j, row + next);
            put_triangle(b, after + j, after + next, row + next);
        }
}

/* ---- hulls and plates -------------------------------------------------------------------------------------------- */

static void make_cone(builtin *b, const double *p) {
    const int n = (int)p[0];
    for (int i = 0; i < n; i++)
        put_vertex(b, cos(2 * i * pi / n), sin(2 * i * pi / n), -1.0);
    for (int i = n; i < 2 * n && p[1] > 0.0; i++)
        put_vertex(b, p[1] * cos(2 * i * pi / n), p[1] * sin(2 * i * pi / n), 1.0);
    if (!(p[1] > 0.0))
        put_vertex(b, 0.0, 0.0, 1.0);
}

enum { WEDGE_MOST = 128, CELLS_MOST = 2048 }; /* along a side; MuJoCo has no bound. A hull takes O(m^2 n^2) */

/* The angles of the centres of n cells between -fov and fov degrees. */
static void put_centers(int n, double fov, double gamma, double *centers) {
    double x = -1.0, before = 0.0;
    for (int i = 0; i <= n; i++) {
        const double edge = (gamma != 0.0 ? gamma * pow(x, 5.0) + (1.0 - gamma) * x : x) * (fov * pi / 180.0);
        if (i > 0)
            centers[i - 1] = 0.5 * (edge + before);
        before = edge;
        x += 2.0 / n; /* summed, as there */
    }
}

static void make_wedge(builtin *b, const double *p) {
    const int m = (int)p[0], n = (int)p[1];
    double azimuths[WEDGE_MOST], heights[WEDGE_MOST];
    put_centers(m, p[2], p[4], azimuths);
    put_centers(n, p[3], p[4], heights);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++)
            put_vertex(b, cos(heights[j]) * sin(azimuths[i]), sin(heights[j]), -cos(heights[j]) * cos(azimuths[i]));
}

static void make_plate(builtin *b, const double *p) {
    const size_t m = (size_t)p[0], n = (size_t)p[1];
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < n; j++)
            put_vertex(b, -1.0 + ((double)i + 0.5) * (2.0 / p[0]), -1.0 + ((double)j + 0.5) * (2.0 / p[1]), -1.0);
    for (size_t i = 0; i + 1 < m; i++)
        for (size_t j = 0; j + 1 < n; j++) {
            const size_t row = i * n + j, next = row + n;
            put_triangle(b, row, next, row + 1);
            put_triangle(b, next + 1, row + 1, next);
        }
}

/* ---- words and numbers ------------------------------------------------------------------------------------------- */

enum { NUMBERS_MOST = 5 };

/* A number of a surface: a whole one loses its fraction. Its bounds; it may be equal to them unless it is_above. */
typedef struct number_kind {
    const char *name;
    double lower, upper;
    bool is_whole, is_above;
} number_kind;

typedef struct builtin_kind {
    const char *word;
    void (*make)(builtin *, const double *);
    number_kind numbers[NUMBERS_MOST];
} builtin_kind;

static const builtin_kind kinds[] = {
    {"sphere", make_sphere, {{"subdivision", 0.0, 4.0, true, false}}},
    {"hemisphere", make_hemisphere, {{"resolution", 0.0, 10.0, true, false}}},
    {"cone", make_cone, {{"nvert", 3.0, CELLS_MOST, true, false}, {"radius", -HUGE_VAL, HUGE_VAL, false, false}}},
    {"supersphere",
     make_supersphere,
     {{"resolution", 3.0, CELLS_MOST, true, false},
      {"e", 0.0, HUGE_VAL, false, false},
      {"n", 0.0, HUGE_VAL, false, false}}},
    {"supertorus",
     make_supertorus,
     {{"resolution", 3.0, CELLS_MOST, true, false},
      {"radius", 0.0, 1.0, false, true},
      {"s", 0.0, HUGE_VAL, false, true},
      {"t", 0.0, HUGE_VAL, false, true}}},
    {"wedge",
     make_wedge,
     {{"res_phi", 1.0, WEDGE_MOST, true, false},
      {"res_theta", 1.0, WEDGE_MOST, true, false},
      {"fov_phi", 0.0, 180.0, false, true},
      {"fov_theta", 0.0, 90.0, false, true},
      {"gamma", 0.0, 1.0, false, false}}},
    {"plate", make_plate, {{"res_x", 2.0, CELLS_MOST, true, false}, {"res_y", 2.0, CELLS_MOST, true, false}}},
};

static const builtin_kind *builtin_of(const char *word) {
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i].word, word) == 0)
            return &kinds[i];
    return NULL;
}

static kt_status check_numbers(const builtin_kind *kind, double *numbers, int count, kt_error *error) {
    int expected = 0;
    while (expected < NUMBERS_MOST && kind->numbers[expected].name != NULL)
        expected++;
    if (count != expected)
        return kt_error_set(error, KT_ERROR_SCENE, "", "a %s has %d number%s, and there are %d", kind->word, expected,
                            expected > 1 ? "s" : "", count > 0 ? count : 0);
    for (int i = 0; i < count; i++) {
        const number_kind *n = &kind->numbers[i];
        numbers[i] = n->is_whole ? trunc(numbers[i]) : numbers[i];
        if (!(n->is_above ? numbers[i] > n->lower : numbers[i] >= n->lower))
            return kt_error_set(error, KT_ERROR_SCENE, "", "the %s of a %s has to be %s %g", n->name, kind->word,
                                n->is_above ? "above" : "at least", n->lower);
        if (!(numbers[i] <= n->upper))
            return kt_error_set(error, KT_ERROR_SCENE, "", "the %s of a %s has to be at most %g", n->name, kind->word,
                                n->upper);
    }
    return KT_OK;
}

/* More than the vertices, and half the triangles, that a kind has. */
static size_t builtin_room(const builtin_kind *kind, const double *p) {
    const size_t n = (size_t)p[0];
    if (kind->make == make_sphere)
        return (size_t)12 << 2 * n;
    if (kind->make == make_hemisphere)
        return 4 * (n + 2) * (n + 2);
    if (kind->make == make_cone)
        return 2 * n;
    return kind->make == make_wedge || kind->make == make_plate ? n * (size_t)p[1] : n * n + 2;
}

kt_status kt_triangles_builtin(const char *word, const double *numbers, int count, kt_triangles *mesh,
                               kt_error *error) {
    const builtin_kind *kind = builtin_of(word);
    double p[NUMBERS_MOST] = {0.0};
    if (kind == NULL)
        return kt_error_set(
            error, KT_ERROR_SCENE, "",
            "there is no surface '%.40s'; take sphere, hemisphere, cone, supersphere, supertorus, wedge or "
            "plate",
            word);
    for (int i = 0; i < count && i < NUMBERS_MOST; i++)
        p[i] = numbers[i];
    const kt_status status = check_numbers(kind, p, count, error);
    if (status != KT_OK)
        return status;
    const size_t room = 3 * builtin_room(kind, p);
    double *vertices = malloc(3 * room * sizeof *vertices);
    builtin b = {.vertices = malloc(room * sizeof *b.vertices), .corners = vertices != NULL ? vertices + room : NULL};
    kt_status made = KT_ERROR_MEMORY;
    if (vertices != NULL && b.vertices != NULL) {
        kind->make(&b, p);
        for (size_t i = 0; i < 3 * b.vertex_count; i++)
            vertices[i] = (double)b.vertices[i];
        made = kt_triangles_make(vertices, (int)b.vertex_count, b.corners, (int)b.triangle_count, mesh, error);
    } else {
        (void)kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
    }
    free(vertices);
    free(b.vertices);
    return made;
}

kt_status kt_triangles_builtin_parse(const char *text, kt_triangles *mesh, kt_error *error) {
    char word[20];
    double numbers[NUMBERS_MOST];
    const char *at = text + strspn(text, " ");
    const size_t length = strcspn(at, " ");
    int count = 0;
    (void)snprintf(word, sizeof word, "%.*s", (int)(length < sizeof word ? length : sizeof word - 1), at);
    at += length;
    at += strspn(at, " ");
    while (count < NUMBERS_MOST && kt_decimal_read(at, &numbers[count], &at)) {
        at += strspn(at, " ");
        count++;
    }
    if (*at != '\0')
        return kt_error_set(error, KT_ERROR_SCENE, "", "'%.40s' is not a word with at most %d numbers", text,
                            NUMBERS_MOST);
    return kt_triangles_builtin(word, numbers, count, mesh, error);
}
