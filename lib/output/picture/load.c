/* Meshes of a scene as surfaces of solids: read, scaled, thinned out, with normals.
 *
 * Files have no normals worth having, and often not even shared vertices. The normal at a triangle's corner is a mean
 * over triangles around the vertex, weighted by area. Only triangles whose inclination to this triangle is below an
 * angle count, so that round surfaces appear round, and edges remain sharp. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/load.h"
#include "algebra/elementary.h"
#include "document/file.h"
#include "mesh/mesh.h"
#include "picture/foreign.h"
#include "picture/picture_mesh.h"
#include "picture/solid.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double cos_crease = 0.76; /* 40 degrees */

enum { AROUND_MOST = 64 }; /* triangles at a vertex of which means are taken */

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* Whether this program reads the format, by the ending of the file's name. Names without an ending count as such
 * formats. */
static bool is_own_format(const char *path) {
    static const char *const endings[] = {".stl", ".obj", ".msh"};
    const char *dot = strrchr(path, '.');
    bool own = dot == NULL || strchr(dot, '/') != NULL;
    for (size_t i = 0; i < sizeof endings / sizeof *endings && !own; i++)
        own = strcasecmp(dot, endings[i]) == 0;
    return own;
}

static kt_status read_mesh_file(const char *path, kt_triangles *mesh, kt_error *error) {
    char *text = NULL;
    size_t size = 0;
    kt_status status = kt_file_read(path, &text, &size, error);
    if (status == KT_OK)
        status = is_own_format(path) ? kt_triangles_parse(text, size, mesh, error)
                                     : kt_foreign_parse(path, text, size, mesh, error);
    if (status == KT_ERROR_SCENE)
        (void)kt_error_set(error, status, path, "%s", error->message);
    free(text);
    return status;
}

/* Scales a mesh, and moves the centre of the box around it to the origin. Returns the centre. */
static kt_vec3 centre_mesh(kt_triangles *mesh, kt_vec3 scale, kt_vec3 *half) {
    kt_vec3 low = kt_vec3_make(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = kt_vec3_scale(-1.0, low);
    for (int i = 0; i < mesh->vertex_count; i++) {
        const kt_vec3 v = mesh->vertices[i], x = kt_vec3_make(scale.x * v.x, scale.y * v.y, scale.z * v.z);
        mesh->vertices[i] = x;
        kt_box_widen(&low, &high, x);
    }
    const kt_vec3 centre = kt_vec3_scale(0.5, kt_vec3_add(low, high));
    *half = kt_vec3_scale(0.5, kt_vec3_sub(high, low));
    for (int i = 0; i < mesh->vertex_count; i++)
        mesh->vertices[i] = kt_vec3_sub(mesh->vertices[i], centre);
    return centre;
}

/* ---- normals ----------------------------------------------------------------------------------------------------- */

/* Twice the area along the normal. */
static kt_vec3 triangle_area_of(const kt_triangles *mesh, int triangle) {
    const int *v = mesh->triangles[triangle].corner;
    return kt_vec3_cross(kt_vec3_sub(mesh->vertices[v[1]], mesh->vertices[v[0]]),
                         kt_vec3_sub(mesh->vertices[v[2]], mesh->vertices[v[0]]));
}

static kt_vec3 unit(kt_vec3 v) {
    const double length = kt_vec3_norm(v);
    return length > 0.0 ? kt_vec3_scale(1.0 / length, v) : kt_vec3_make(0.0, 0.0, 1.0);
}

/* Triangles around each vertex: of vertex i list[first[i]] to list[first[i + 1] - 1]. */
static void list_around(const kt_triangles *mesh, int *first, int *list) {
    for (int i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            first[mesh->triangles[i].corner[k] + 1]++;
    for (int i = 0; i < mesh->vertex_count; i++)
        first[i + 1] += first[i];
    for (int i = mesh->triangle_count; i-- > 0;)
        for (int k = 0; k < 3; k++)
            list[--first[mesh->triangles[i].corner[k] + 1]] = i;
    memmove(first, first + 1, (size_t)mesh->vertex_count * sizeof *first); /* first[k + 1] begins list k */
    first[mesh->vertex_count] = 3 * mesh->triangle_count;
}

/* The normal at a corner of a triangle: the mean over the triangles around the vertex, weighted with their areas.
 * Triangles beyond a crease are left out, so that edges stay sharp. */
static kt_vec3 corner_normal(const kt_triangles *mesh, const int *first, const int *list, int triangle, int vertex) {
    const kt_vec3 own = triangle_area_of(mesh, triangle), n = unit(own);
    kt_vec3 sum = kt_vec3_make(0.0, 0.0, 0.0);
    if (first[vertex + 1] - first[vertex] > AROUND_MOST)
        return n;
    for (int i = first[vertex]; i < first[vertex + 1]; i++) {
        const kt_vec3 area = triangle_area_of(mesh, list[i]);
        if (kt_vec3_dot(area, n) >= cos_crease * kt_vec3_norm(area))
            sum = kt_vec3_add(sum, area);
    }
    return kt_vec3_dot(sum, sum) > 0.0 ? unit(sum) : n;
}

/* Each triangle has its own three points. */
static bool fill_surface(const kt_triangles *mesh, const int *first, const int *list, kt_mesh *surface) {
    const size_t points = 3 * (size_t)mesh->triangle_count;
    surface->points = malloc((points + 1) * sizeof *surface->points);
    surface->normals = malloc((points + 1) * sizeof *surface->normals);
    surface->corners = malloc((points + 1) * sizeof *surface->corners);
    if (surface->points == NULL || surface->normals == NULL || surface->corners == NULL) {
        kt_mesh_free(surface);
        return false;
    }
    surface->point_room = points;
    surface->triangle_room = (size_t)mesh->triangle_count;
    surface->point_count = (int)points;
    surface->triangle_count = mesh->triangle_count;
    for (int i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const int at = 3 * i + k, vertex = mesh->triangles[i].corner[k];
            surface->corners[at] = at;
            surface->points[at] = mesh->vertices[vertex];
            surface->normals[at] = corner_normal(mesh, first, list, i, vertex);
        }
    return true;
}

/* first, list: the triangles at each vertex (list_around). */
static kt_status make_surface(const kt_triangles *mesh, kt_mesh *surface, kt_error *error) {
    int *first = calloc((size_t)mesh->vertex_count + 2, sizeof *first);
    int *list = calloc(3 * (size_t)mesh->triangle_count + 1, sizeof *list);
    bool fine = first != NULL && list != NULL;
    if (fine) {
        list_around(mesh, first, list);
        fine = fill_surface(mesh, first, list, surface);
    }
    free(first);
    free(list);
    return fine ? KT_OK : kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
}

/* ---- one mesh ---------------------------------------------------------------------------------------------------- */

kt_status kt_mesh_load(const kt_scene_mesh *from, int most, kt_mesh *surface, kt_solid *solid, kt_error *error) {
    kt_triangles mesh = {.vertices = NULL};
    kt_status status = read_mesh_file(from->file, &mesh, error);
    if (status == KT_OK)
        status = kt_triangles_decimate(&mesh, most, error);
    if (status == KT_OK && mesh.triangle_count == 0)
        status = kt_error_set(error, KT_ERROR_SCENE, from->file, "the surface has no area");
    if (status == KT_OK) {
        const kt_vec3 centre = centre_mesh(&mesh, from->scale, &solid->half);
        solid->type = KT_SOLID_BOX;
        solid->source = KT_SOURCE_SHAPE;
        solid->pose.rotation = kt_solid_rotation(&from->rotation);
        solid->pose.position = kt_vec3_add(from->at, kt_mat3_apply(solid->pose.rotation, centre));
        if (!(kt_vec3_is_finite(solid->pose.position) && kt_vec3_is_finite(solid->half)))
            status = kt_error_set(error, KT_ERROR_SCENE, from->file, "the surface is too large");
    }
    if (status == KT_OK)
        status = make_surface(&mesh, surface, error);
    kt_triangles_free(&mesh);
    return status;
}
