/* Whether a surface is closed and its triangles all have one sense. If so, for each edge that one triangle passes from
 * a to b, another triangle passes the edge from b to a. Vertices with equal positions are one vertex, for any number of
 * copies in the file.
 *
 * Edges are sorted by their two ends, so that those of one pair follow each other. O(n log n).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mesh/mesh.h"

#include "base/order.h"

#include <stdlib.h>

typedef struct edge {
    int low, high;  /* its ends, as numbers of places */
    int from;       /* the vertex where its triangle begins it */
    int to;         /* and ends it */
    bool is_rising; /* from low to high */
} edge;

typedef struct corner {
    kt_vec3 at;
    int vertex;
} corner;

static int order_corners(const void *a, const void *b) {
    const kt_vec3 x = ((const corner *)a)->at, y = ((const corner *)b)->at;
    const int by_x = kt_order_numbers(x.x, y.x), by_y = kt_order_numbers(x.y, y.y);
    return by_x != 0 ? by_x : by_y != 0 ? by_y : kt_order_numbers(x.z, y.z);
}

static int order_edges(const void *a, const void *b) {
    const edge *x = a, *y = b;
    return x->low != y->low ? (x->low > y->low) - (x->low < y->low) : (x->high > y->high) - (x->high < y->high);
}

/* place[i]: the number of the place of vertex i. */
static void find_places(const kt_triangles *mesh, corner *corners, int *place) {
    const size_t count = (size_t)mesh->vertex_count;
    for (size_t i = 0; i < count; i++)
        corners[i] = (corner){mesh->vertices[i], (int)i};
    qsort(corners, count, sizeof *corners, order_corners);
    for (size_t i = 0; i < count; i++) {
        const bool is_new = i == 0 || order_corners(&corners[i - 1], &corners[i]) != 0;
        place[corners[i].vertex] = is_new ? (int)i : place[corners[i - 1].vertex];
    }
}

/* Edges of no length, of triangles that have shrunk to a line or a point, are left out. Returns the number of edges. */
static size_t list_edges(const kt_triangles *mesh, const int *place, edge *edges) {
    size_t count = 0;
    for (int i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const int from = mesh->triangles[i].corner[k], to = mesh->triangles[i].corner[(k + 1) % 3];
            const int a = place[from], b = place[to];
            if (a != b)
                edges[count++] =
                    (edge){.low = a < b ? a : b, .high = a < b ? b : a, .from = from, .to = to, .is_rising = a < b};
        }
    qsort(edges, count, sizeof *edges, order_edges);
    return count;
}

/* Edges that do not balance. */
typedef struct open_edges {
    int holes, turned;        /* of one triangle too few, and between triangles of opposite sense */
    const edge *hole, *twist; /* the first of them */
} open_edges;

/* Edges are sorted, so that edges between the same vertices are neighbours. In a closed surface as many triangles rise
 * along an edge as fall. An odd number is a hole; an even number without balance, a triangle inside out. */
static open_edges find_open_edges(const edge *edges, size_t count) {
    open_edges found = {.holes = 0};
    for (size_t i = 0, end = 0; i < count; i = end) {
        int balance = 0;
        for (end = i; end < count && order_edges(&edges[i], &edges[end]) == 0; end++)
            balance += edges[end].is_rising ? 1 : -1;
        if (balance == 0)
            continue;
        const bool is_hole = (end - i) % 2 != 0;
        if (is_hole && found.holes++ == 0)
            found.hole = &edges[i];
        if (!is_hole && found.turned++ == 0)
            found.twist = &edges[i];
    }
    return found;
}

static kt_status reject_open_mesh(const kt_triangles *mesh, const open_edges *found, kt_error *error) {
    const edge *first = found->holes > 0 ? found->hole : found->twist;
    const kt_vec3 a = mesh->vertices[first->from], b = mesh->vertices[first->to];
    if (found->holes > 0)
        return kt_error_set(error, KT_ERROR_SCENE, "",
                            "the surface is not closed: %d edge%s of a single triangle, the first from (%.6g, %.6g, "
                            "%.6g) to (%.6g, %.6g, %.6g) in units of the file",
                            found->holes, found->holes == 1 ? " is that" : "s are those", a.x, a.y, a.z, b.x, b.y, b.z);
    return kt_error_set(error, KT_ERROR_SCENE, "",
                        "triangles of the surface are turned inside out against their neighbours, at %d edge%s, the "
                        "first from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g) in units of the file",
                        found->turned, found->turned == 1 ? "" : "s", a.x, a.y, a.z, b.x, b.y, b.z);
}

kt_status kt_triangles_check_closed(const kt_triangles *mesh, kt_error *error) {
    const size_t vertices = (size_t)mesh->vertex_count, sides = 3 * (size_t)mesh->triangle_count;
    corner *corners = malloc((vertices + 1) * sizeof *corners);
    int *place = malloc((vertices + 1) * sizeof *place);
    edge *edges = malloc((sides + 1) * sizeof *edges);
    kt_status status = KT_OK;
    if (corners == NULL || place == NULL || edges == NULL)
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for the edges of a mesh");
    else {
        find_places(mesh, corners, place);
        const size_t count = list_edges(mesh, place, edges);
        const open_edges found = find_open_edges(edges, count);
        if (found.holes + found.turned > 0)
            status = reject_open_mesh(mesh, &found, error);
    }
    free(corners);
    free(place);
    free(edges);
    return status;
}
