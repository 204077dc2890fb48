/* Files of triangles: STL, OBJ, and MuJoCo's MSH. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mesh/mesh.h"

#include "base/grow.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- a mesh that grows ------------------------------------------------------------------------------------------- */

typedef struct maker {
    kt_triangles mesh;
    size_t vertex_room, triangle_room;
    long before; /* vertices before the line that is read, from which negative numbers count */
    kt_status status;
    kt_error *error;
} maker;

static bool fail_mesh(maker *m, kt_status code, const char *what) {
    m->status = kt_error_set(m->error, code, "", "%s", what);
    return false;
}

/* Room for one more item. */
static void *grow_mesh(maker *m, void *items, size_t *room, int count, size_t size) {
    void *more = count < KT_TRIANGLES_MOST ? kt_heap_grow(items, (size_t)count, 1, room, size) : NULL;
    if (more == NULL)
        (void)fail_mesh(m, count < KT_TRIANGLES_MOST ? KT_ERROR_MEMORY : KT_ERROR_SCENE,
                        count < KT_TRIANGLES_MOST ? "there is not enough memory for a mesh"
                                                  : "a mesh has too many triangles");
    return more;
}

static bool add_vertex(maker *m, const double *x) {
    kt_vec3 *more = grow_mesh(m, m->mesh.vertices, &m->vertex_room, m->mesh.vertex_count, sizeof *more);
    if (more == NULL)
        return false;
    m->mesh.vertices = more;
    m->mesh.vertices[m->mesh.vertex_count] = kt_vec3_make(x[0], x[1], x[2]);
    return kt_vec3_is_finite(m->mesh.vertices[m->mesh.vertex_count++]) ||
           fail_mesh(m, KT_ERROR_SCENE, "a vertex of the mesh is not finite");
}

static bool add_read_triangle(maker *m, long a, long b, long c) {
    const long most = m->mesh.vertex_count;
    kt_triangle *more = grow_mesh(m, m->mesh.triangles, &m->triangle_room, m->mesh.triangle_count, sizeof *more);
    if (more == NULL)
        return false;
    m->mesh.triangles = more;
    if (a < 0 || b < 0 || c < 0 || a >= most || b >= most || c >= most)
        return fail_mesh(m, KT_ERROR_SCENE, "a triangle of the mesh names a vertex that is not there");
    m->mesh.triangles[m->mesh.triangle_count++] = (kt_triangle){{(int)a, (int)b, (int)c}};
    return true;
}

/* Adds a triangle with three new vertices. */
static bool add_corners(maker *m, const double x[9]) {
    const int first = m->mesh.vertex_count;
    return add_vertex(m, x) && add_vertex(m, x + 3) && add_vertex(m, x + 6) &&
           add_read_triangle(m, first, first + 1, first + 2);
}

/* ---- binary ------------------------------------------------------------------------------------------------------ */

/* Numbers are little-endian in these files. */
static uint32_t integer_at(const char *text) {
    const unsigned char *b = (const unsigned char *)text;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static double float_at(const char *text) {
    const uint32_t bits = integer_at(text);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

/* 80 bytes, the number of triangles, and 50 bytes each: normal, corners, attribute. */
bool kt_triangles_is_binary_stl(const char *text, size_t size) {
    return size >= 84 && (size - 84) % 50 == 0 && (size - 84) / 50 == integer_at(text + 80) && size > 84;
}

static void read_binary_stl(maker *m, const char *text, size_t size) {
    for (size_t at = 84; at + 50 <= size; at += 50) {
        double x[9];
        for (size_t k = 0; k < 9; k++)
            x[k] = float_at(text + at + 12 + 4 * k);
        if (!add_corners(m, x))
            return;
    }
}

/* Numbers of vertices, normals, texture coordinates, triangles; then all of them. */
static bool is_msh(const char *text, size_t size) {
    if (size < 16)
        return false;
    const uint64_t v = integer_at(text), n = integer_at(text + 4), t = integer_at(text + 8), f = integer_at(text + 12);
    return v > 0 && v <= KT_TRIANGLES_MOST && n <= v && t <= v && f <= KT_TRIANGLES_MOST &&
           16 + 12 * v + 12 * n + 8 * t + 12 * f == size;
}

/* MuJoCo's format: the numbers of vertices, normals, texture coordinates and triangles, then these arrays. */
static void read_msh(maker *m, const char *text) {
    const uint32_t vertices = integer_at(text), triangles = integer_at(text + 12);
    const char *at = text + 16, *faces = at + 12 * (size_t)vertices + 12 * (size_t)integer_at(text + 4) +
                                         8 * (size_t)integer_at(text + 8);
    for (uint32_t i = 0; i < vertices; i++, at += 12)
        if (!add_vertex(m, (const double[]){float_at(at), float_at(at + 4), float_at(at + 8)}))
            return;
    for (uint32_t i = 0; i < triangles; i++, faces += 12)
        if (!add_read_triangle(m, (long)integer_at(faces), (long)integer_at(faces + 4), (long)integer_at(faces + 8)))
            return;
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

/* A number in decimal at *text; false where there is none. Text ends with a zero byte. */
static bool take_mesh_number(const char **text, double *value) {
    const char *at = *text + strspn(*text, " \t");
    char *end;
    if (*at == '\0' || strchr("+-.0123456789", *at) == NULL)
        return false;
    *value = strtod(at, &end);
    if (end == at)
        return false;
    *text = end;
    return true;
}

static const char *next_mesh_line(const char *at) {
    at += strcspn(at, "\r\n");
    return at + strspn(at, "\r\n");
}

static const char *first_word(const char *line) { return line + strspn(line, " \t"); }

static bool line_begins(const char *line, const char *word) {
    const size_t length = strlen(word);
    return strncmp(line, word, length) == 0 && (line[length] == ' ' || line[length] == '\t');
}

static bool read_vertex(maker *m, const char *at, double x[3]) {
    for (int k = 0; k < 3; k++)
        if (!take_mesh_number(&at, &x[k]))
            return fail_mesh(m, KT_ERROR_SCENE, "a vertex of the mesh has less than three numbers");
    return true;
}

/* Each three lines that begin with `vertex` are a triangle. */
static void read_text_stl(maker *m, const char *text) {
    double x[9];
    int corners = 0;
    for (const char *line = text; *line != '\0'; line = next_mesh_line(line)) {
        const char *word = first_word(line);
        if (!line_begins(word, "vertex"))
            continue;
        if (!read_vertex(m, word + 6, x + 3 * corners))
            return;
        corners = (corners + 1) % 3;
        if (corners == 0 && !add_corners(m, x))
            return;
    }
}

/* Divides a quadrilateral along the shorter diagonal, as MuJoCo does. If the corners are in no plane, volumes depend on
 * the choice. */
static bool add_quadrilateral(maker *m, const long c[4]) {
    const kt_vec3 *x = m->mesh.vertices;
    const kt_vec3 d02 = kt_vec3_sub(x[c[2]], x[c[0]]), d13 = kt_vec3_sub(x[c[3]], x[c[1]]);
    if (kt_vec3_dot(d02, d02) < kt_vec3_dot(d13, d13))
        return add_read_triangle(m, c[0], c[1], c[2]) && add_read_triangle(m, c[0], c[2], c[3]);
    return add_read_triangle(m, c[0], c[1], c[3]) && add_read_triangle(m, c[1], c[2], c[3]);
}

/* `1/2/3` or `4//5`: the first number of a corner, from 1, or from the end if negative. The index is -1 after
 * reporting. False if there is no corner. */
static bool take_corner(maker *m, const char **at, long *index) {
    double number;
    if (!take_mesh_number(at, &number))
        return false;
    const long named = (long)(fabs(number) < 1e9 ? number : 0.0);
    *index = named > 0 ? named - 1 : m->before + named;
    if (*index < 0 || *index >= m->mesh.vertex_count) {
        (void)fail_mesh(m, KT_ERROR_SCENE, "a face or a line of the mesh names a vertex that is not there");
        *index = -1;
    }
    *at += strcspn(*at, " \t\r\n"); /* past the numbers of texture and normal */
    return true;
}

/* `f 1 2 3`. A polygon of more than four corners is a fan. */
static bool read_face(maker *m, const char *at) {
    long c[4] = {0, 0, 0, 0}, last = 0, index;
    int count = 0;
    for (; take_corner(m, &at, &index); count++) {
        if (index < 0)
            return false;
        if (count == 4 && !(add_read_triangle(m, c[0], c[1], c[2]) && add_read_triangle(m, c[0], c[2], c[3])))
            return false;
        if (count >= 4 && !add_read_triangle(m, c[0], last, index))
            return false;
        if (count < 4)
            c[count] = index;
        last = index;
    }
    return count == 3 ? add_read_triangle(m, c[0], c[1], c[2]) : count != 4 || add_quadrilateral(m, c);
}

/* `l 1 2 3`: lines from each vertex to the next. */
static bool read_polyline(maker *m, const char *at) {
    long last = 0, index;
    for (int count = 0; take_corner(m, &at, &index); count++) {
        if (index < 0 || (count > 0 && !add_read_triangle(m, last, index, index)))
            return false;
        last = index;
    }
    return true;
}

static void read_obj_lines(maker *m, const char *text) {
    m->before = 0;
    for (const char *line = text; *line != '\0'; line = next_mesh_line(line)) {
        const char *word = first_word(line);
        m->before += line_begins(word, "v");
        if (line_begins(word, "l") && !read_polyline(m, word + 1))
            return;
    }
    m->mesh.is_lines = m->mesh.triangle_count > 0;
}

static void read_obj(maker *m, const char *text) {
    double x[3];
    for (const char *line = text; *line != '\0'; line = next_mesh_line(line)) {
        const char *word = first_word(line);
        m->before = m->mesh.vertex_count;
        if (line_begins(word, "v") && (!read_vertex(m, word + 1, x) || !add_vertex(m, x)))
            return;
        if (line_begins(word, "f") && !read_face(m, word + 1))
            return;
    }
    if (m->mesh.triangle_count == 0)
        read_obj_lines(m, text);
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* Text that ends with a zero byte, for the functions of strings. */
static void read_mesh_text(maker *m, const char *text, size_t size) {
    char *copy = memchr(text, '\0', size) == NULL ? malloc(size + 1) : NULL;
    if (copy == NULL) {
        const bool is_text = memchr(text, '\0', size) == NULL;
        (void)fail_mesh(m, is_text ? KT_ERROR_MEMORY : KT_ERROR_SCENE,
                        is_text ? "there is not enough memory for a mesh" : "this is neither STL nor OBJ nor MSH");
        return;
    }
    memcpy(copy, text, size);
    copy[size] = '\0';
    if (strncmp(first_word(copy), "solid", 5) == 0)
        read_text_stl(m, copy);
    else
        read_obj(m, copy);
    free(copy);
}

/* Vertices without a triangle stand for their hull. */
static kt_status finish_mesh(maker *m, kt_triangles *mesh) {
    if (m->status == KT_OK && m->mesh.triangle_count == 0 && m->mesh.vertex_count < 4)
        (void)fail_mesh(m, KT_ERROR_SCENE, "there is no triangle in the mesh");
    m->mesh.is_hull = m->mesh.triangle_count == 0;
    if (m->status == KT_OK && m->mesh.is_hull)
        m->status = kt_triangles_hull(&m->mesh, m->error);
    if (m->status == KT_OK)
        *mesh = m->mesh;
    else
        kt_triangles_free(&m->mesh);
    return m->status;
}

kt_status kt_triangles_parse(const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    maker m = {.status = KT_OK, .error = error};
    if (kt_triangles_is_binary_stl(text, size))
        read_binary_stl(&m, text, size);
    else if (is_msh(text, size))
        read_msh(&m, text);
    else
        read_mesh_text(&m, text, size);
    return finish_mesh(&m, mesh);
}

kt_status kt_triangles_make(const double *vertices, int vertex_count, const double *corners, int triangle_count,
                            kt_triangles *mesh, kt_error *error) {
    maker m = {.status = KT_OK, .error = error};
    for (int i = 0; i < vertex_count && m.status == KT_OK; i++)
        (void)add_vertex(&m, vertices + 3 * i);
    for (int i = 0; i < triangle_count && m.status == KT_OK; i++) {
        long c[3];
        for (int k = 0; k < 3; k++)
            c[k] = fabs(corners[3 * i + k]) < 1e9 ? (long)corners[3 * i + k] : -1;
        (void)add_read_triangle(&m, c[0], c[1], c[2]);
    }
    return finish_mesh(&m, mesh);
}

void kt_triangles_free(kt_triangles *mesh) {
    free(mesh->vertices);
    free(mesh->triangles);
    *mesh = (kt_triangles){.vertices = NULL};
}

/* A variable that is not volatile loses the conversion: gcc 12 omits the conversion for two of three coordinates
 * (-O3). */
static double round_to_single(double x) {
    volatile float single = (float)x;
    return (double)single;
}

bool kt_triangles_round(kt_triangles *mesh) {
    bool is_finite = true;
    for (int i = 0; i < mesh->vertex_count; i++) {
        kt_vec3 *x = &mesh->vertices[i];
        *x = kt_vec3_make(round_to_single(x->x), round_to_single(x->y), round_to_single(x->z));
        is_finite = is_finite && kt_vec3_is_finite(*x);
    }
    return is_finite;
}

void kt_triangles_turn_over(kt_triangles *mesh) {
    for (int i = 0; i < mesh->triangle_count; i++) {
        int *c = mesh->triangles[i].corner;
        const int first = c[0];
        c[0] = c[1];
        c[1] = first;
    }
}

void kt_triangles_place(kt_triangles *mesh, kt_pose frame, kt_vec3 scale) {
    for (int i = 0; i < mesh->vertex_count; i++) {
        const kt_vec3 x = kt_mat3_apply_transposed(frame.rotation, kt_vec3_sub(mesh->vertices[i], frame.position));
        mesh->vertices[i] = kt_vec3_make(scale.x * x.x, scale.y * x.y, scale.z * x.z);
    }
}
