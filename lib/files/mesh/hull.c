/* The convex hull of vertices, for files of vertices without faces and for masses of hulls.
 *
 * Points are added one after another (Edelsbrunner, "Algorithms in Combinatorial Geometry", 1987, ch. 8). A new point p
 * sees the triangles (a, b, c) with
 *     (b - a) x (c - a) . (p - a) > 0
 * These triangles are replaced by triangles between p and the edges around them.
 *
 * Each remaining point outside the hull is in the list of a triangle that it sees. From this triangle, a search across
 * common edges finds all other seen triangles. The points of replaced triangles are distributed among the new
 * ones: a point outside of the new hull that saw a replaced triangle sees a new one (Barber, Dobkin, Huhdanpaa,
 * doi:10.1145/235815.235821). In a random order of n points, all this takes O(n log n) operations on average. Seen
 * triangles and edges are sorted, so that the order of the triangles does not depend on the course of the search.
 *
 * Many points of a box or a cylinder are in one plane, where rounding decides which triangles p sees. Therefore all
 * decisions use slightly moved points. Each coordinate, as a part of its range, is moved by up to MOVE, at random.
 * Points nearer than NEAR count as one point. The resulting triangles have the vertices of the file. The volume that
 * they enclose differs from the hull by the part MOVE of its area times its size. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mesh/mesh.h"

#include "algebra/elementary.h"
#include "base/grow.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

static const double MOVE = 0x1p-34, NEAR = 0x1p-30, FLAT = 0x1p-26; /* FLAT: less than that high is a plane */

/* A vertex without its copies: its position in steps of NEAR. */
typedef struct spot {
    double at[3];
    int vertex;
} spot;

/* An edge of the seen triangles, and the triangle beyond it. */
typedef struct edge {
    int from, to, beyond;
} edge;

typedef struct face {
    int corner[3];
    int neighbour[3]; /* the face beyond the edge from corner k to the next */
    int place;        /* in `order` */
    int first;        /* of the points in its list; -1: none */
    int seen;         /* the last point that saw it */
} face;

enum { NONE = -1 };

/* Three numbers for each vertex: the face whose list contains the vertex, the next vertex in this list, and the new
 * face that begins at the vertex. */
typedef struct link {
    int face, next, begins;
} link;

typedef struct hull {
    kt_vec3 *points; /* moved; of vertices */
    link *links;     /* of vertices */
    spot *spots;
    int count;   /* of spots */
    face *faces; /* in places that do not change */
    int *order;  /* the faces of the hull */
    int *seen;   /* faces that the point sees; then places in `order` */
    int *spare;  /* places of faces that are no more */
    edge *edges;
    size_t face_room, order_room, seen_room, spare_room, edge_room;
    int faces_used, face_count, seen_count, spare_count, edge_count;
} hull;

/* ---- points ------------------------------------------------------------------------------------------------------ */

static int compare_spots(const void *a, const void *b) {
    const spot *s = a, *t = b;
    for (int k = 0; k < 3; k++)
        if (s->at[k] != t->at[k])
            return s->at[k] < t->at[k] ? -1 : 1;
    return (s->vertex > t->vertex) - (s->vertex < t->vertex);
}

/* Returns a number between -1 and 1, from the generator of Numerical Recipes for 64 bits. */
static double next_random(uint64_t *state) {
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) * 0x1p-52 - 1.0;
}

/* Each coordinate as a part of its range; false if the coordinates have no range. */
static bool scale_points(hull *h, const kt_triangles *mesh) {
    kt_vec3 low, high;
    kt_box_of(mesh->vertices, mesh->vertex_count, &low, &high);
    const kt_vec3 size = kt_vec3_sub(high, low);
    if (!(size.x > 0.0 && size.y > 0.0 && size.z > 0.0 && kt_vec3_is_finite(size)))
        return false;
    for (int i = 0; i < mesh->vertex_count; i++) {
        const kt_vec3 d = kt_vec3_sub(mesh->vertices[i], low);
        h->points[i] = kt_vec3_make(d.x / size.x, d.y / size.y, d.z / size.z);
    }
    return true;
}

/* Removes copies of points, moves the remaining points, and puts these in a random order. */
static void scatter_points(hull *h, int vertex_count) {
    uint64_t state = 1;
    for (int i = 0; i < vertex_count; i++) {
        const kt_vec3 x = h->points[i];
        h->spots[i] = (spot){{rint(x.x / NEAR), rint(x.y / NEAR), rint(x.z / NEAR)}, i};
        h->points[i].x += MOVE * next_random(&state);
        h->points[i].y += MOVE * next_random(&state);
        h->points[i].z += MOVE * next_random(&state);
    }
    qsort(h->spots, (size_t)vertex_count, sizeof *h->spots, compare_spots);
    h->count = 0;
    for (int i = 0; i < vertex_count; i++) {
        const spot *last = h->count > 0 ? &h->spots[h->count - 1] : NULL, *s = &h->spots[i];
        if (last == NULL || last->at[0] != s->at[0] || last->at[1] != s->at[1] || last->at[2] != s->at[2])
            h->spots[h->count++] = *s;
    }
    for (int i = h->count - 1; i > 0; i--) {
        const int other = (int)(0.5 * (next_random(&state) + 1.0) * (double)(i + 1));
        const spot swap = h->spots[i];
        h->spots[i] = h->spots[other < i ? other : i];
        h->spots[other < i ? other : i] = swap;
    }
}

/* ---- faces ------------------------------------------------------------------------------------------------------- */

static bool add_number(int **list, int *count, size_t *room, int number) {
    int *grown = kt_heap_grow(*list, (size_t)*count, 1, room, sizeof *grown);
    if (grown == NULL)
        return false;
    *list = grown;
    (*list)[(*count)++] = number;
    return true;
}

/* Adds a face to the end of the order; NONE: no memory. */
static int add_face(hull *h, int a, int b, int c) {
    int at = h->faces_used;
    if (h->spare_count > 0) {
        at = h->spare[--h->spare_count];
    } else {
        face *faces = kt_heap_grow(h->faces, (size_t)h->faces_used, 1, &h->face_room, sizeof *faces);
        if (faces == NULL)
            return NONE;
        h->faces = faces;
        h->faces_used++;
    }
    h->faces[at] = (face){{a, b, c}, {NONE, NONE, NONE}, h->face_count, NONE, NONE};
    return add_number(&h->order, &h->face_count, &h->order_room, at) ? at : NONE;
}

/* Six times the volume between a triangle and a point, above zero on the outer side. */
static double height_above(const hull *h, const int c[3], int point) {
    const kt_vec3 a = h->points[c[0]];
    return kt_vec3_dot(kt_vec3_cross(kt_vec3_sub(h->points[c[1]], a), kt_vec3_sub(h->points[c[2]], a)),
                       kt_vec3_sub(h->points[point], a));
}

static int compare_hull_edges(const void *a, const void *b) {
    const edge *s = a, *t = b;
    const int s_low = s->from < s->to ? s->from : s->to, t_low = t->from < t->to ? t->from : t->to;
    const int s_high = s->from + s->to - s_low, t_high = t->from + t->to - t_low;
    return s_low != t_low ? (s_low > t_low) - (s_low < t_low) : (s_high > t_high) - (s_high < t_high);
}

static bool sees(const hull *h, int point, int at) { return height_above(h, h->faces[at].corner, point) > 0.0; }

/* Lists the faces that a point sees, from one of them on, and the edges around them. */
static bool find_seen_faces(hull *h, int point, int at) {
    h->seen_count = h->edge_count = 0;
    h->faces[at].seen = point;
    if (!add_number(&h->seen, &h->seen_count, &h->seen_room, at))
        return false;
    for (int i = 0; i < h->seen_count; i++)
        for (int k = 0; k < 3; k++) {
            const face *f = &h->faces[h->seen[i]];
            const int beyond = f->neighbour[k], from = f->corner[k], to = f->corner[(k + 1) % 3];
            if (h->faces[beyond].seen == point)
                continue;
            if (sees(h, point, beyond)) {
                h->faces[beyond].seen = point;
                if (!add_number(&h->seen, &h->seen_count, &h->seen_room, beyond))
                    return false;
                continue;
            }
            edge *edges = kt_heap_grow(h->edges, (size_t)h->edge_count, 1, &h->edge_room, sizeof *edges);
            if (edges == NULL)
                return false;
            h->edges = edges;
            h->edges[h->edge_count++] = (edge){from, to, beyond};
        }
    return true;
}

/* Joins the points in the lists of the seen faces into one list, without `point`. Returns the first one. */
static int join_lists(hull *h, int point) {
    int all = NONE;
    for (int i = 0; i < h->seen_count; i++)
        for (int q = h->faces[h->seen[i]].first, next; q != NONE; q = next) {
            next = h->links[q].next;
            if (q == point)
                continue;
            h->links[q].next = all;
            all = q;
        }
    return all;
}

static int compare_ints(const void *a, const void *b) {
    const int s = *(const int *)a, t = *(const int *)b;
    return (s > t) - (s < t);
}

/* Takes the seen faces out of the order: the last face takes the place of each. */
static bool remove_seen_faces(hull *h, int point) {
    for (int i = 0; i < h->seen_count; i++) {
        if (!add_number(&h->spare, &h->spare_count, &h->spare_room, h->seen[i]))
            return false;
        h->seen[i] = h->faces[h->seen[i]].place;
    }
    qsort(h->seen, (size_t)h->seen_count, sizeof *h->seen, compare_ints);
    for (int i = 0; i < h->seen_count; i++) {
        const int place = h->seen[i];
        while (place < h->face_count && h->faces[h->order[place]].seen == point) {
            h->order[place] = h->order[--h->face_count];
            h->faces[h->order[place]].place = place;
        }
    }
    return true;
}

/* Adds a face (from, to, point) for each edge. Its neighbours are the face beyond the edge, and the new faces of the
 * edges that begin at `to` and end at `from`: the edges form one cycle, in which each vertex begins one edge. */
static bool add_new_faces(hull *h, int point) {
    qsort(h->edges, (size_t)h->edge_count, sizeof *h->edges, compare_hull_edges);
    for (int i = 0; i < h->edge_count; i++) {
        const edge *e = &h->edges[i];
        const int at = add_face(h, e->from, e->to, point);
        if (at == NONE)
            return false;
        face *beyond = &h->faces[e->beyond];
        for (int k = 0; k < 3; k++)
            if (beyond->corner[k] == e->to && beyond->corner[(k + 1) % 3] == e->from)
                beyond->neighbour[k] = at;
        h->faces[at].neighbour[0] = e->beyond;
        h->links[e->from].begins = at;
    }
    for (int i = 0; i < h->edge_count; i++) {
        const int at = h->links[h->edges[i].from].begins, next = h->links[h->edges[i].to].begins;
        h->faces[at].neighbour[1] = next;
        h->faces[next].neighbour[2] = at;
    }
    return true;
}

/* Puts points into the lists of new faces that they see. Points that see no new face are inside. */
static void distribute(hull *h, int q) {
    for (int next; q != NONE; q = next) {
        next = h->links[q].next;
        h->links[q].face = NONE;
        for (int i = 0; i < h->edge_count && h->links[q].face == NONE; i++) {
            const int at = h->links[h->edges[i].from].begins;
            if (!sees(h, q, at))
                continue;
            h->links[q].face = at;
            h->links[q].next = h->faces[at].first;
            h->faces[at].first = q;
        }
    }
}

/* Replaces the faces that a point sees. */
static bool add_hull_point(hull *h, int point) {
    if (h->links[point].face == NONE)
        return true;
    if (!find_seen_faces(h, point, h->links[point].face))
        return false;
    const int rest = join_lists(h, point);
    if (!remove_seen_faces(h, point) || !add_new_faces(h, point))
        return false;
    distribute(h, rest);
    return true;
}

/* ---- the hull ---------------------------------------------------------------------------------------------------- */

/* Returns the distance of a point from the span of the first `count` points of a simplex. */
static double distance_from(const hull *h, const int first[4], int count, int point) {
    const kt_vec3 d = kt_vec3_sub(h->points[point], h->points[first[0]]);
    if (count == 1)
        return kt_vec3_norm(d);
    const kt_vec3 u = kt_vec3_normalize(kt_vec3_sub(h->points[first[1]], h->points[first[0]]));
    if (count == 2)
        return kt_vec3_norm(kt_vec3_cross(u, d));
    return fabs(
        kt_vec3_dot(kt_vec3_normalize(kt_vec3_cross(u, kt_vec3_sub(h->points[first[2]], h->points[first[0]]))), d));
}

/* Finds the first four points, each the farthest from the previous points. Returns false if all points are in a
 * plane. */
static bool find_simplex(const hull *h, int first[4]) {
    first[0] = h->spots[0].vertex;
    for (int k = 1; k < 4; k++) {
        double most = FLAT;
        first[k] = -1;
        for (int i = 0; i < h->count; i++) {
            const double distance = distance_from(h, first, k, h->spots[i].vertex);
            if (distance > most) {
                most = distance;
                first[k] = h->spots[i].vertex;
            }
        }
        if (first[k] < 0)
            return false;
    }
    if (height_above(h, first, first[3]) > 0.0) {
        const int swap = first[0];
        first[0] = first[1];
        first[1] = swap;
    }
    return true;
}

/* Makes the first four faces, with the lists of all other points. */
static bool add_simplex(hull *h, const int f[4]) {
    static const int neighbour[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    const bool whole = add_face(h, f[0], f[1], f[2]) != NONE && add_face(h, f[1], f[0], f[3]) != NONE &&
                       add_face(h, f[2], f[1], f[3]) != NONE && add_face(h, f[0], f[2], f[3]) != NONE;
    for (int i = 0; i < 4 && whole; i++)
        for (int k = 0; k < 3; k++)
            h->faces[i].neighbour[k] = neighbour[i][k];
    for (int i = 0; i < h->count && whole; i++) {
        const int q = h->spots[i].vertex;
        h->links[q].face = NONE;
        for (int at = 0; at < 4 && h->links[q].face == NONE; at++)
            if (q != f[0] && q != f[1] && q != f[2] && q != f[3] && sees(h, q, at)) {
                h->links[q] = (link){at, h->faces[at].first, NONE};
                h->faces[at].first = q;
            }
    }
    return whole;
}

/* The faces as triangles, in their order; NULL: no memory. */
static kt_triangle *take_triangles(const hull *h) {
    kt_triangle *triangles = malloc((size_t)h->face_count * sizeof *triangles);
    for (int i = 0; i < h->face_count && triangles != NULL; i++) {
        const int *corner = h->faces[h->order[i]].corner;
        triangles[i] = (kt_triangle){{corner[0], corner[1], corner[2]}};
    }
    return triangles;
}

static kt_status wrap(hull *h, const kt_triangles *mesh, kt_error *error) {
    int f[4];
    const char *flat = "the vertices of the mesh are in one plane, so that their hull encloses nothing";
    if (!scale_points(h, mesh))
        return kt_error_set(error, KT_ERROR_SCENE, "", "%s", flat);
    scatter_points(h, mesh->vertex_count);
    if (!find_simplex(h, f))
        return kt_error_set(error, KT_ERROR_SCENE, "", "%s", flat);
    bool whole = add_simplex(h, f);
    for (int i = 0; i < h->count && whole; i++) {
        const int point = h->spots[i].vertex;
        whole = point == f[0] || point == f[1] || point == f[2] || point == f[3] || add_hull_point(h, point);
    }
    return whole ? KT_OK : kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a hull");
}

kt_status kt_triangles_hull(kt_triangles *mesh, kt_error *error) {
    hull h = {.count = 0};
    if (mesh->vertex_count < 4)
        return kt_error_set(error, KT_ERROR_SCENE, "", "a hull needs four vertices, and the mesh has %d",
                            mesh->vertex_count);
    h.points = calloc((size_t)mesh->vertex_count, sizeof *h.points);
    h.links = calloc((size_t)mesh->vertex_count, sizeof *h.links);
    h.spots = calloc((size_t)mesh->vertex_count, sizeof *h.spots);
    kt_status status = h.points != NULL && h.links != NULL && h.spots != NULL ? wrap(&h, mesh, error) : KT_ERROR_MEMORY;
    kt_triangle *triangles = status == KT_OK ? take_triangles(&h) : NULL;
    if (status == KT_ERROR_MEMORY || (status == KT_OK && triangles == NULL))
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a hull");
    free(h.points);
    free(h.links);
    free(h.spots);
    free(h.faces);
    free(h.order);
    free(h.seen);
    free(h.spare);
    free(h.edges);
    if (status != KT_OK)
        return status;
    free(mesh->triangles);
    mesh->triangles = triangles;
    mesh->triangle_count = h.face_count;
    return KT_OK;
}
