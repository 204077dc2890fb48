/* Points and elements of a <flexcomp> from its attributes, from a mesh, or from a file of Gmsh.
 *
 * A mesh that is a surface has its triangles, and lines are those of OBJ. A volume also has the point `origin`, and a
 * tetrahedron for each triangle that faces away from it. Vertices are single-precision numbers, and equal ones are one,
 * as in MuJoCo.
 *
 * Gmsh writes two formats, as text or as bytes of this machine. Sections are between "$Nodes" and "$EndNodes". Format
 * 2.2 has the number of points, then of each its tag and coordinates. Its elements are in blocks with their type and
 * number of tags; as text each element is a block. Format 4.1 has one block of points, first all tags, then all
 * coordinates, and one block of elements. Source: gmsh.info/doc/texinfo/gmsh.html, chapter on
 * file formats; user_flexcomp.cc. */
#include "document/file.h"
#include "robot/mjcf_flex.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- attributes -------------------------------------------------------------------------------------------------- */

int kt_flex_numbers(kt_mjcf *m, const kt_element *e, const char *name, double **values) {
    const char *text = kt_xml_attribute(e, name);
    const size_t room = text != NULL ? strlen(text) / 2 + 1 : 0;
    *values = kt_reader_take(m->r, &m->r->scratch, room + 1, sizeof **values);
    if (*values == NULL)
        return -1;
    const int count = text != NULL ? kt_parse_numbers(text, (int)room, *values) : 0;
    if (count < 0)
        (void)kt_mjcf_fault(m, e, "%s: expected numbers", name);
    return count;
}

static const char *word_of_count(int dim) { return dim == 1 ? "two" : dim == 2 ? "three" : "four"; }

bool kt_flex_direct(kt_mjcf *m, kt_flex *f) {
    double *points, *ends;
    const int size = f->dim + 1, numbers = kt_flex_numbers(m, f->element, "point", &points),
              count = kt_flex_numbers(m, f->element, "element", &ends);
    if (numbers < 3 * size || numbers % 3 != 0 || count < size || count % size != 0)
        return kt_mjcf_fault(m, f->element, "expected `point` with three numbers each, `element` with %s points each",
                             word_of_count(f->dim));
    const int given = numbers / 3, elements = count / size;
    if (!kt_flex_take(m, f, given, elements))
        return false;
    for (int i = 0; i < numbers; i += 3)
        kt_flex_add_point(f, points[i], points[i + 1], points[i + 2]);
    for (int i = 0; i < count; i += size) {
        int at[4];
        for (int k = 0; k < size; k++) {
            if (!(ends[i + k] >= 0.0 && ends[i + k] < f->count))
                return kt_mjcf_fault(m, f->element, "element: there is no point %g", ends[i + k]);
            at[k] = (int)ends[i + k];
        }
        kt_flex_add_element(f, at);
    }
    return true;
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

typedef struct flex_corner {
    float at[3];
    int number;
} flex_corner;

/* -0 is 0. */
static int compare_flex_places(const flex_corner *x, const flex_corner *y) {
    for (int k = 0; k < 3; k++)
        if (x->at[k] < y->at[k] || x->at[k] > y->at[k])
            return x->at[k] < y->at[k] ? -1 : 1;
    return 0;
}

static int order_corners_of_flex(const void *a, const void *b) {
    const flex_corner *x = a, *y = b;
    const int places = compare_flex_places(x, y);
    return places != 0 ? places : (x->number > y->number) - (x->number < y->number);
}

/* `to` becomes the first vertex at the place of each vertex. */
static void join_equal_vertices(flex_corner *corners, int count, int *to) {
    for (int i = 0; i < count; i++)
        to[i] = i;
    qsort(corners, (size_t)count, sizeof *corners, order_corners_of_flex);
    for (int i = 1; i < count; i++)
        if (compare_flex_places(&corners[i], &corners[i - 1]) == 0)
            to[corners[i].number] = to[corners[i - 1].number];
}

static double facing(const kt_flex *f, const double origin[3], const int *points) {
    kt_vec3 edges[3];
    for (int k = 0; k < 3; k++) {
        const double *p = f->points[points[k]].at;
        edges[k] = kt_vec3_make(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]);
    }
    return kt_vec3_dot(kt_vec3_cross(edges[0], edges[1]), edges[2]);
}

static bool add_flex_surface(kt_mjcf *m, kt_flex *f, const kt_triangles *mesh) {
    const int count = mesh->vertex_count, first = f->dim == 3;
    flex_corner *corners = kt_reader_take(m->r, &m->r->scratch, (size_t)count + 1, sizeof *corners);
    int *to = kt_reader_take(m->r, &m->r->scratch, (size_t)count + 1, sizeof *to);
    double origin[3] = {0.0, 0.0, 0.0};
    if (corners == NULL || to == NULL || !kt_flex_take(m, f, count + 1.0, mesh->triangle_count))
        return false;
    (void)kt_mjcf_numbers(m, f->element, NULL, "origin", 3, 3, origin);
    for (int i = 0; i < count; i++) {
        const kt_vec3 v = mesh->vertices[i];
        corners[i] = (flex_corner){{(float)v.x, (float)v.y, (float)v.z}, i};
    }
    join_equal_vertices(corners, count, to);
    if (first > 0)
        kt_flex_add_point(f, origin[0], origin[1], origin[2]);
    for (int i = 0; i < count; i++) {
        const kt_vec3 v = mesh->vertices[i];
        const int before = to[i];
        to[i] = before == i ? f->count : to[before];
        if (before == i)
            kt_flex_add_point(f, v.x, v.y, v.z);
    }
    for (int i = 0; i < mesh->triangle_count; i++) {
        const int *c = mesh->triangles[i].corner, at[4] = {0, to[c[0]], to[c[1]], to[c[2]]};
        if (first == 0 || facing(f, origin, at + 1) >= 1e-15)
            kt_flex_add_element(f, first > 0 ? at : at + 1);
    }
    return true;
}

bool kt_flex_mesh(kt_mjcf *m, kt_flex *f) {
    const char *file = kt_mjcf_file_of_mesh(m, f->element);
    kt_triangles mesh = {.vertices = NULL};
    kt_error error = {0};
    if (file == NULL)
        return kt_mjcf_fault(m, f->element, "the attribute 'file' is missing");
    error.code = kt_mjcf_read_surface(m, f->element, file, &mesh, &error);
    if (error.code == KT_OK && (mesh.is_hull || (mesh.is_lines && f->dim > 1)))
        error.code = kt_error_set(&error, KT_ERROR_SCENE, file, "it has %s",
                                  mesh.is_hull ? "no triangles" : "lines alone, which need dim=\"1\"");
    if (error.code == KT_OK && !kt_triangles_round(&mesh))
        error.code = kt_error_set(&error, KT_ERROR_SCENE, file, KT_MJCF_TOO_LARGE);
    if (error.code == KT_OK)
        (void)add_flex_surface(m, f, &mesh);
    else
        kt_mjcf_count_unread(m, &m->flex_files, f->element, &error);
    kt_triangles_free(&mesh);
    return error.code == KT_OK && !m->r->out_of_memory && !kt_draft_is_wrong(&m->draft);
}

/* ---- files of Gmsh ----------------------------------------------------------------------------------------------- */

/* A part of a file that is read from its start. */
typedef struct gmsh_text {
    const char *at, *end;
    bool is_binary, is_whole;
    const char *strange; /* after the first coordinate that is not finite; NULL: there is none */
    double large;        /* the number of points or elements, if it is above the most */
} gmsh_text;

/* Of points and elements, the least that either format needs, as text or as bytes. */
enum { BYTES_OF_INT = 4, BYTES_OF_SIZE = 8, BYTES_OF_POINT = 7, BYTES_OF_ELEMENT = 6 };

/* A number in text. */
static double gmsh_word(gmsh_text *g) {
    char word[64], *end;
    size_t length = 0;
    while (g->at < g->end && strchr(" \t\r\n", *g->at) != NULL)
        g->at++;
    while (g->at < g->end && strchr(" \t\r\n", *g->at) == NULL && length + 1 < sizeof word)
        word[length++] = *g->at++;
    word[length] = '\0';
    const double value = strtod(word, &end);
    g->is_whole = g->is_whole && length > 0 && *end == '\0';
    return value;
}

static bool gmsh_bytes(gmsh_text *g, void *to, size_t size) {
    g->is_whole = g->is_whole && (size_t)(g->end - g->at) >= size;
    if (g->is_whole) {
        memcpy(to, g->at, size);
        g->at += size;
    }
    return g->is_whole;
}

/* A number without sign of 4 or 8 bytes, or a word; -1 if it is missing. */
static double gmsh_whole_number(gmsh_text *g, int bytes) {
    int32_t small = 0;
    uint64_t large = 0;
    if (!g->is_binary || bytes == 0)
        return gmsh_word(g);
    if (!(bytes == BYTES_OF_INT ? gmsh_bytes(g, &small, sizeof small) : gmsh_bytes(g, &large, sizeof large)))
        return -1.0;
    return bytes == BYTES_OF_INT ? (double)small : (double)large;
}

/* -1 if it is missing or large. */
static int gmsh_integer(gmsh_text *g, int bytes) {
    const double value = gmsh_whole_number(g, bytes);
    return value >= 0.0 && value <= KT_FLEX_NUMBERS_MOST ? (int)value : -1;
}

/* The number of points or elements; -1 if it is missing or large. */
static int gmsh_count(gmsh_text *g, int bytes) {
    const double value = gmsh_whole_number(g, bytes);
    if (value > KT_FLEX_NUMBERS_MOST)
        g->large = value;
    return value >= 0.0 && value <= KT_FLEX_NUMBERS_MOST ? (int)value : -1;
}

/* Whether so many items of so many bytes or more can be in the rest. */
static bool gmsh_has_room(const gmsh_text *g, int count, size_t bytes) {
    return (size_t)count <= (size_t)(g->end - g->at) / bytes;
}

static double gmsh_real(gmsh_text *g) {
    double value = 0.0;
    if (!g->is_binary)
        return gmsh_word(g);
    (void)gmsh_bytes(g, &value, sizeof value);
    return value;
}

static void add_gmsh_point(kt_flex *f, gmsh_text *g) {
    double p[3];
    for (int k = 0; k < 3; k++)
        p[k] = gmsh_real(g);
    if (g->strange == NULL && !(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2])))
        g->strange = g->at;
    kt_flex_add_point(f, p[0], p[1], p[2]);
}

/* The points of an element, whose first number is `least`. */
static void add_gmsh_element(kt_flex *f, gmsh_text *g, int bytes, int least) {
    int at[4] = {0, 0, 0, 0};
    for (int k = 0; k <= f->dim; k++) {
        at[k] = gmsh_integer(g, bytes) - least;
        g->is_whole = g->is_whole && at[k] >= 0 && at[k] < f->count;
    }
    if (g->is_whole)
        kt_flex_add_element(f, at);
}

/* Sets `dim` by the type of an element: a line, a triangle or a tetrahedron. */
static void set_gmsh_type(kt_flex *f, gmsh_text *g, int type, bool is_first) {
    const int dim = type == 4 ? 3 : type;
    g->is_whole = g->is_whole && (type == 1 || type == 2 || type == 4) && (is_first || dim == f->dim);
    if (g->is_whole)
        f->dim = dim;
}

/* The number of points or elements. It is text in any case, with a line of its own. */
static int gmsh_count_of_lines(gmsh_text *g) {
    const int count = gmsh_count(g, 0);
    while (g->is_binary && g->at < g->end && *g->at != '\n')
        g->at++;
    g->at += g->is_binary && g->at < g->end;
    return count;
}

static bool read_gmsh_2(kt_mjcf *m, kt_flex *f, gmsh_text *nodes, gmsh_text *elements) {
    const int points = gmsh_count_of_lines(nodes), count = gmsh_count_of_lines(elements);
    if (points < 1 || count < 1 || !gmsh_has_room(nodes, points, BYTES_OF_POINT) ||
        !gmsh_has_room(elements, count, BYTES_OF_ELEMENT) || !kt_flex_take(m, f, points, count))
        return false;
    for (int i = 0; i < points && nodes->is_whole; i++) {
        (void)gmsh_integer(nodes, BYTES_OF_INT);
        add_gmsh_point(f, nodes);
    }
    for (int i = 0; i < count && elements->is_whole;) {
        const int tag = elements->is_binary ? 0 : gmsh_integer(elements, 0),
                  type = gmsh_integer(elements, BYTES_OF_INT);
        const int following = elements->is_binary ? gmsh_integer(elements, BYTES_OF_INT) : 1;
        const int tags = gmsh_integer(elements, BYTES_OF_INT);
        set_gmsh_type(f, elements, type, i == 0);
        elements->is_whole = elements->is_whole && tag >= 0 && following > 0 && tags >= 0;
        for (int k = 0; k < following && elements->is_whole; k++, i++) {
            for (int n = elements->is_binary ? -1 : 0; n < tags && elements->is_whole; n++)
                (void)gmsh_integer(elements, BYTES_OF_INT);
            add_gmsh_element(f, elements, BYTES_OF_INT, 1);
        }
    }
    return f->element_count == count;
}

/* The header of the one block; returns the number of items, -1 if there are more blocks. */
static int read_gmsh_block(gmsh_text *g, int *first, int *type) {
    const int blocks = gmsh_integer(g, BYTES_OF_SIZE), all = gmsh_count(g, BYTES_OF_SIZE);
    *first = gmsh_integer(g, BYTES_OF_SIZE);
    (void)gmsh_integer(g, BYTES_OF_SIZE); /* the largest tag */
    (void)gmsh_integer(g, BYTES_OF_INT);  /* dimension and tag of the entity */
    (void)gmsh_integer(g, BYTES_OF_INT);
    *type = gmsh_integer(g, BYTES_OF_INT); /* of elements; of points: whether they have parameters */
    return blocks == 1 && gmsh_integer(g, BYTES_OF_SIZE) == all ? all : -1;
}

static bool read_gmsh_4(kt_mjcf *m, kt_flex *f, gmsh_text *nodes, gmsh_text *elements) {
    int least, type, first;
    const int points = read_gmsh_block(nodes, &least, &type), count = read_gmsh_block(elements, &first, &type);
    if (points < 1 || count < 1 || !gmsh_has_room(nodes, points, BYTES_OF_POINT) ||
        !gmsh_has_room(elements, count, BYTES_OF_ELEMENT) || !kt_flex_take(m, f, points, count))
        return false;
    for (int i = 0; i < points && nodes->is_whole; i++)
        nodes->is_whole = nodes->is_whole && gmsh_integer(nodes, BYTES_OF_SIZE) == least + i;
    for (int i = 0; i < points && nodes->is_whole; i++)
        add_gmsh_point(f, nodes);
    set_gmsh_type(f, elements, type, true);
    for (int i = 0; i < count && elements->is_whole; i++) {
        (void)gmsh_integer(elements, BYTES_OF_SIZE);
        add_gmsh_element(f, elements, BYTES_OF_SIZE, least);
    }
    return f->element_count == count;
}

static const char *find_gmsh_word(const char *text, size_t size, const char *word) {
    const size_t length = strlen(word);
    for (size_t i = 0; i + length <= size; i++)
        if (memcmp(text + i, word, length) == 0)
            return text + i;
    return NULL;
}

/* Returns the text between two words, without the rest of the first line. */
static gmsh_text find_gmsh_section(const char *text, size_t size, const char *begin, const char *end) {
    gmsh_text g = {.at = find_gmsh_word(text, size, begin), .end = find_gmsh_word(text, size, end)};
    g.is_whole = g.at != NULL && g.end != NULL && g.at < g.end;
    while (g.is_whole && g.at < g.end && *g.at != '\n')
        g.at++;
    if (g.is_whole && g.at < g.end)
        g.at++;
    return g;
}

/* A coordinate that is not finite; the file as text has lines. */
static bool fault_of_gmsh_point(kt_mjcf *m, const kt_flex *f, const char *text, const gmsh_text *nodes) {
    const char *file = kt_mjcf_file_of_mesh(m, f->element);
    int line = 1, point = 1;
    for (const char *at = text; at < nodes->strange; at++)
        line += *at == '\n';
    while (point < f->count && isfinite(f->points[point - 1].at[0]) && isfinite(f->points[point - 1].at[1]) &&
           isfinite(f->points[point - 1].at[2]))
        point++;
    return nodes->is_binary
               ? kt_mjcf_fault(m, f->element, "%.100s: point %d has a coordinate that is not finite", file, point)
               : kt_mjcf_fault(m, f->element, "%.100s:%d: point %d has a coordinate that is not finite", file, line,
                               point);
}

static bool parse_gmsh(kt_mjcf *m, kt_flex *f, const char *text, size_t size) {
    gmsh_text head = find_gmsh_section(text, size, "$MeshFormat", "$EndMeshFormat");
    gmsh_text nodes = find_gmsh_section(text, size, "$Nodes", "$EndNodes");
    gmsh_text elements = find_gmsh_section(text, size, "$Elements", "$EndElements");
    if (!head.is_whole || !nodes.is_whole || !elements.is_whole)
        return false;
    const double version = gmsh_word(&head);
    nodes.is_binary = elements.is_binary = gmsh_integer(&head, 0) == 1;
    const bool is_read = version == 2.2   ? read_gmsh_2(m, f, &nodes, &elements)
                         : version == 4.1 ? read_gmsh_4(m, f, &nodes, &elements)
                                          : false;
    if (nodes.strange != NULL)
        return fault_of_gmsh_point(m, f, text, &nodes);
    if (nodes.large > 0.0 || elements.large > 0.0)
        return kt_mjcf_fault(m, f->element, "the file of Gmsh has %.0f points or elements; expected 1 to %d",
                             fmax(nodes.large, elements.large), (int)KT_FLEX_NUMBERS_MOST);
    return is_read && nodes.is_whole && elements.is_whole;
}

bool kt_flex_gmsh(kt_mjcf *m, kt_flex *f) {
    const char *file = kt_mjcf_file_of_mesh(m, f->element);
    kt_error error = {0};
    char *text = NULL;
    size_t size = 0;
    if (file == NULL)
        return kt_mjcf_fault(m, f->element, "the attribute 'file' is missing");
    const char *path = kt_mjcf_whole_path(m, f->element, file, &error);
    error.code = path != NULL ? kt_file_read(path, &text, &size, &error) : error.code;
    if (error.code == KT_OK && !parse_gmsh(m, f, text, size) && !kt_draft_is_wrong(&m->draft))
        error.code = kt_error_set(&error, KT_ERROR_SCENE, path,
                                  "it is no file of Gmsh 2.2 or 4.1 with one block of points, and triangles or "
                                  "tetrahedra alone");
    free(text);
    if (error.code != KT_OK)
        kt_mjcf_count_unread(m, &m->flex_files, f->element, &error);
    return error.code == KT_OK && !m->r->out_of_memory && !kt_draft_is_wrong(&m->draft);
}
