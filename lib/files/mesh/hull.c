/* The convex hull of vertices, for files of vertices without faces and for masses of hulls.
 *
 * Points are added one after another (Edelsbrunner, "Algorithms in Combinatorial Geometry", 1987, ch. 8). A new point p
 * sees the triangles (a, b, c) with
 *     (b - a) x (c - a) . (p - a) > 0
 * These are replaced by triangles between p and the edges around them.
 *
 * Many points of a box or a cylinder are in one plane, where rounding decides which triangles p sees. So all decisions
 * are those of moved points. Each coordinate, as a part of its range, is moved by up to MOVE, at random. Points nearer
 * than NEAR are one. The triangles then have the vertices of the file. The volume that they enclose differs from the
 * hull by the part MOVE of its area times its size. */
#include "mesh/mesh.h"

#include "algebra/elementary.h"
#include "base/grow.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

static const double MOVE = 0x1p-34, NEAR = 0x1p-30, FLAT = 0x1p-26; /* FLAT: less than that high is a plane */

/* A vertex without its copies: where it is in steps of NEAR. */
typedef struct spot {
    double at[3];
    int vertex;
} spot;

typedef struct edge {
    int from, to;
} edge;

typedef struct hull {
    kt_vec3 *points; /* moved; of vertices */
    spot *spots;
    int count; /* of spots */
    kt_triangle *faces;
    edge *edges; /* of faces that are seen */
    size_t face_room, edge_room;
    int face_count, edge_count;
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

/* Each coordinate as a part of its range; false where they have none. */
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

/* Leaves one of points that are the same, moves all, and puts them in a random order. */
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

static bool add_face(hull *h, int a, int b, int c) {
    kt_triangle *faces = kt_heap_grow(h->faces, (size_t)h->face_count, 1, &h->face_room, sizeof *faces);
    if (faces == NULL)
        return false;
    h->faces = faces;
    h->faces[h->face_count++] = (kt_triangle){{a, b, c}};
    return true;
}

static bool add_edges(hull *h, const int c[3]) {
    edge *edges = kt_heap_grow(h->edges, (size_t)h->edge_count, 3, &h->edge_room, sizeof *edges);
    if (edges == NULL)
        return false;
    h->edges = edges;
    for (int k = 0; k < 3; k++)
        h->edges[h->edge_count++] = (edge){c[k], c[(k + 1) % 3]};
    return true;
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

/* Replaces the faces that a point sees. An edge between two of them is there in both directions. */
static bool add_hull_point(hull *h, int point) {
    h->edge_count = 0;
    for (int i = 0; i < h->face_count;) {
        if (!(height_above(h, h->faces[i].corner, point) > 0.0)) {
            i++;
            continue;
        }
        if (!add_edges(h, h->faces[i].corner))
            return false;
        h->faces[i] = h->faces[--h->face_count];
    }
    if (h->edge_count > 0) /* none of the edges has memory yet otherwise */
        qsort(h->edges, (size_t)h->edge_count, sizeof *h->edges, compare_hull_edges);
    for (int i = 0; i < h->edge_count; i++) {
        const bool is_inner = i + 1 < h->edge_count && compare_hull_edges(&h->edges[i], &h->edges[i + 1]) == 0;
        if (is_inner)
            i++;
        else if (!add_face(h, h->edges[i].from, h->edges[i].to, point))
            return false;
    }
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

/* The first four points: each the farthest from those before it. False where all are in a plane. */
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

static kt_status wrap(hull *h, const kt_triangles *mesh, kt_error *error) {
    int f[4];
    const char *flat = "the vertices of the mesh are in one plane, so that their hull encloses nothing";
    if (!scale_points(h, mesh))
        return kt_error_set(error, KT_ERROR_SCENE, "", "%s", flat);
    scatter_points(h, mesh->vertex_count);
    if (!find_simplex(h, f))
        return kt_error_set(error, KT_ERROR_SCENE, "", "%s", flat);
    bool whole = add_face(h, f[0], f[1], f[2]) && add_face(h, f[1], f[0], f[3]) && add_face(h, f[2], f[1], f[3]) &&
                 add_face(h, f[0], f[2], f[3]);
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
    h.spots = calloc((size_t)mesh->vertex_count, sizeof *h.spots);
    kt_status status = h.points != NULL && h.spots != NULL
                           ? wrap(&h, mesh, error)
                           : kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a hull");
    free(h.points);
    free(h.spots);
    free(h.edges);
    if (status != KT_OK) {
        free(h.faces);
        return status;
    }
    free(mesh->triangles);
    mesh->triangles = h.faces;
    mesh->triangle_count = h.face_count;
    return KT_OK;
}
