/* Surfaces with fewer triangles, by clusters of vertices. Source: Rossignac and Borrel, "Multi-resolution 3D
 * approximations for rendering complex scenes", 1993. Space is divided into cubes. All vertices in a cube become their
 * mean, and triangles with two corners in one cube vanish. With cubes as fine as rounding, the result is the surface
 * with its vertices shared. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mesh/mesh.h"

#include "algebra/elementary.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FINEST = 1 << 20 }; /* cubes along the longest edge */

typedef struct clusters {
    const kt_triangles *mesh;
    kt_vec3 low;
    double size;       /* of the longest edge of the box around the mesh */
    uint64_t *keys;    /* of slots: the cube and 1; 0: free */
    int *slot_cluster; /* of slots */
    size_t mask;
    int *cluster_of; /* of vertices */
    int count;       /* clusters */
} clusters;

static void find_box(clusters *c) {
    kt_vec3 low, high;
    kt_box_of(c->mesh->vertices, c->mesh->vertex_count, &low, &high);
    c->low = low;
    c->size = fmax(high.x - low.x, fmax(high.y - low.y, high.z - low.z));
}

/* The number of the cube that contains a point, from 1. Points on the upper faces of the box belong to the last cubes,
 * so that each point has a cube. */
static uint64_t cube_of(const clusters *c, kt_vec3 x, int cubes) {
    const double scale = c->size > 0.0 ? (double)cubes / c->size : 0.0, last = (double)(cubes - 1);
    const uint64_t i = (uint64_t)fmin(scale * (x.x - c->low.x), last),
                   j = (uint64_t)fmin(scale * (x.y - c->low.y), last),
                   k = (uint64_t)fmin(scale * (x.z - c->low.z), last);
    return (i << 42 | j << 21 | k) + 1;
}

static size_t cluster_slot_of(const clusters *c, uint64_t key) {
    size_t at = (size_t)((key * 0x9E3779B97F4A7C15U) >> 20) & c->mask;
    while (c->keys[at] != 0 && c->keys[at] != key)
        at = (at + 1) & c->mask;
    return at;
}

/* Numbers the clusters of all vertices. */
static void number_clusters(clusters *c, int cubes) {
    memset(c->keys, 0, (c->mask + 1) * sizeof *c->keys);
    c->count = 0;
    for (int i = 0; i < c->mesh->vertex_count; i++) {
        const uint64_t key = cube_of(c, c->mesh->vertices[i], cubes);
        const size_t at = cluster_slot_of(c, key);
        if (c->keys[at] == 0) {
            c->keys[at] = key;
            c->slot_cluster[at] = c->count++;
        }
        c->cluster_of[i] = c->slot_cluster[at];
    }
}

static bool remains(const clusters *c, int triangle, kt_triangle *made) {
    const int *v = c->mesh->triangles[triangle].corner;
    *made = (kt_triangle){{c->cluster_of[v[0]], c->cluster_of[v[1]], c->cluster_of[v[2]]}};
    return made->corner[0] != made->corner[1] && made->corner[1] != made->corner[2] &&
           made->corner[2] != made->corner[0];
}

static int count_remaining(clusters *c, int cubes) {
    kt_triangle ignored;
    int count = 0;
    number_clusters(c, cubes);
    for (int i = 0; i < c->mesh->triangle_count; i++)
        count += remains(c, i, &ignored);
    return count;
}

/* The finest cubes with which no more than `most` triangles remain. */
static int choose_cubes(clusters *c, int most) {
    int low = 1, high = FINEST;
    if (count_remaining(c, FINEST) <= most)
        return FINEST;
    high = 4096;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (count_remaining(c, middle) <= most)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Means of vertices, and the triangles that remain. */
static kt_status build_decimated(clusters *c, kt_triangles *made, kt_error *error) {
    int *members = calloc((size_t)c->count + 1, sizeof *members);
    made->vertices = calloc((size_t)c->count + 1, sizeof *made->vertices);
    made->triangles = calloc((size_t)c->mesh->triangle_count + 1, sizeof *made->triangles);
    if (members == NULL || made->vertices == NULL || made->triangles == NULL) {
        free(members);
        kt_triangles_free(made);
        return kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
    }
    for (int i = 0; i < c->mesh->vertex_count; i++)
        members[c->cluster_of[i]]++;
    for (int i = 0; i < c->mesh->vertex_count; i++) {
        kt_vec3 *mean = &made->vertices[c->cluster_of[i]];
        *mean = kt_vec3_add(*mean, kt_vec3_scale(1.0 / members[c->cluster_of[i]], c->mesh->vertices[i]));
    }
    made->vertex_count = c->count;
    for (int i = 0; i < c->mesh->triangle_count; i++)
        made->triangle_count += remains(c, i, &made->triangles[made->triangle_count]);
    free(members);
    return KT_OK;
}

kt_status kt_triangles_decimate(kt_triangles *mesh, int most, kt_error *error) {
    clusters c = {.mesh = mesh, .mask = 1};
    kt_triangles made = {.vertices = NULL};
    kt_status status = KT_ERROR_MEMORY;
    while (c.mask + 1 < 2 * (size_t)mesh->vertex_count)
        c.mask = 2 * c.mask + 1;
    if (mesh->vertex_count == 0)
        return KT_OK;
    find_box(&c);
    c.keys = calloc(c.mask + 1, sizeof *c.keys);
    c.slot_cluster = calloc(c.mask + 1, sizeof *c.slot_cluster);
    c.cluster_of = calloc((size_t)mesh->vertex_count, sizeof *c.cluster_of);
    if (c.keys != NULL && c.slot_cluster != NULL && c.cluster_of != NULL) {
        number_clusters(&c, choose_cubes(&c, most));
        status = build_decimated(&c, &made, error);
    } else {
        (void)kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
    }
    free(c.keys);
    free(c.slot_cluster);
    free(c.cluster_of);
    if (status == KT_OK) {
        kt_triangles_free(mesh);
        *mesh = made;
    }
    return status;
}
