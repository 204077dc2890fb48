/* Surfaces of solids as triangles.
 *
 * Each surface is a stack of rings about z (a box: six faces). A ring is a circle of a height and a radius with normals
 * of one slope. A band of triangles lies between two rings. If normals jump, at the rim of a cylinder, two rings lie at
 * one place; at a pole, the ring is a point. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/picture_mesh.h"

#include "base/grow.h"

#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* Makes room for so many further points and triangles. Arrays that have grown before a failure stay valid. */
static bool make_mesh_room(kt_mesh *mesh, int points, int triangles) {
    const size_t point_count = (size_t)mesh->point_count;
    size_t room = mesh->point_room; /* both arrays of points have the same */
    kt_vec3 *places = kt_heap_grow(mesh->points, point_count, (size_t)points, &room, sizeof *places);
    mesh->points = places != NULL ? places : mesh->points;
    kt_vec3 *normals = kt_heap_grow(mesh->normals, point_count, (size_t)points, &mesh->point_room, sizeof *normals);
    mesh->normals = normals != NULL ? normals : mesh->normals;
    int *corners = kt_heap_grow(mesh->corners, (size_t)mesh->triangle_count, (size_t)triangles, &mesh->triangle_room,
                                3 * sizeof *corners);
    mesh->corners = corners != NULL ? corners : mesh->corners;
    return places != NULL && normals != NULL && corners != NULL;
}

void kt_mesh_free(kt_mesh *mesh) {
    free(mesh->points);
    free(mesh->normals);
    free(mesh->corners);
    *mesh = (kt_mesh){0};
}

/* ---- rings ------------------------------------------------------------------------------------------------------- */

static int add_mesh_point(kt_mesh *mesh, kt_pose pose, kt_vec3 point, kt_vec3 normal) {
    mesh->points[mesh->point_count] = kt_pose_apply(pose, point);
    mesh->normals[mesh->point_count] = kt_mat3_apply(pose.rotation, normal);
    return mesh->point_count++;
}

static void add_mesh_triangle(kt_mesh *mesh, int a, int b, int c) {
    int *corners = mesh->corners + 3 * mesh->triangle_count++;
    corners[0] = a;
    corners[1] = b;
    corners[2] = c;
}

/* Adds a ring; slope: of the normal against the plane of the ring. Returns its first point. */
static int add_ring(kt_mesh *mesh, kt_pose pose, int sides, double radius, double z, double slope) {
    const int first = mesh->point_count;
    for (int i = 0; i < sides; i++) {
        const double angle = 2.0 * pi * i / sides, c = cos(angle), s = sin(angle);
        const kt_vec3 normal = kt_vec3_make(c * cos(slope), s * cos(slope), sin(slope));
        (void)add_mesh_point(mesh, pose, kt_vec3_make(radius * c, radius * s, z), normal);
    }
    return first;
}

static int add_pole(kt_mesh *mesh, kt_pose pose, double z, double slope) {
    return add_mesh_point(mesh, pose, kt_vec3_make(0.0, 0.0, z), kt_vec3_make(0.0, 0.0, sin(slope)));
}

/* Triangles between two rings, the upper one having the larger z. */
static void add_band(kt_mesh *mesh, int sides, int lower, int upper) {
    for (int i = 0; i < sides; i++) {
        const int j = (i + 1) % sides;
        add_mesh_triangle(mesh, lower + i, lower + j, upper + j);
        add_mesh_triangle(mesh, lower + i, upper + j, upper + i);
    }
}

/* Triangles between a pole and a ring, counterclockwise as seen from above (is_top) or from below. */
static void add_fan(kt_mesh *mesh, int sides, int ring, int pole, bool is_top) {
    for (int i = 0; i < sides; i++) {
        const int j = (i + 1) % sides;
        add_mesh_triangle(mesh, pole, ring + (is_top ? i : j), ring + (is_top ? j : i));
    }
}

/* ---- solids ------------------------------------------------------------------------------------------------------ */

/* Each face has four points of its own, because normals differ at the edges. */
static bool add_box(kt_mesh *mesh, const kt_solid *solid) {
    if (!make_mesh_room(mesh, 24, 12))
        return false;
    for (int face = 0; face < 6; face++) {
        const double sign = face % 2 == 0 ? 1.0 : -1.0, h[3] = {solid->half.x, solid->half.y, solid->half.z};
        const int out = face / 2, u = (out + 1) % 3, v = (out + 2) % 3, first = mesh->point_count;
        for (int corner = 0; corner < 4; corner++) {
            double p[3], n[3] = {0.0, 0.0, 0.0};
            n[out] = sign;
            p[out] = sign * h[out];
            p[u] = (corner == 1 || corner == 2 ? sign : -sign) * h[u];
            p[v] = (corner >= 2 ? 1.0 : -1.0) * h[v];
            (void)add_mesh_point(mesh, solid->pose, kt_vec3_make(p[0], p[1], p[2]), kt_vec3_make(n[0], n[1], n[2]));
        }
        add_mesh_triangle(mesh, first, first + 1, first + 2);
        add_mesh_triangle(mesh, first, first + 2, first + 3);
    }
    return true;
}

/* Points on the rims exist twice: with normals along the axis for the ends, and outwards for the side. */
static bool add_cylinder(kt_mesh *mesh, const kt_solid *solid, int sides) {
    const double r = solid->half.x, z = solid->half.z;
    if (!make_mesh_room(mesh, 4 * sides + 2, 4 * sides))
        return false;
    const int bottom = add_pole(mesh, solid->pose, -z, -0.5 * pi);
    const int foot = add_ring(mesh, solid->pose, sides, r, -z, -0.5 * pi);
    add_fan(mesh, sides, foot, bottom, false);
    const int lower = add_ring(mesh, solid->pose, sides, r, -z, 0.0);
    const int upper = add_ring(mesh, solid->pose, sides, r, z, 0.0);
    add_band(mesh, sides, lower, upper);
    const int rim = add_ring(mesh, solid->pose, sides, r, z, 0.5 * pi);
    const int top = add_pole(mesh, solid->pose, z, 0.5 * pi);
    add_fan(mesh, sides, rim, top, true);
    return true;
}

/* A ball, or a rod: its lower half is moved down by z, its upper half up. */
static bool add_round(kt_mesh *mesh, const kt_solid *solid, int sides) {
    const double r = solid->half.x, z = solid->type == KT_SOLID_ROD ? solid->half.z : 0.0;
    const int rings = sides / 4 > 1 ? sides / 4 : 1; /* of a hemisphere, the equator included */
    const bool is_long = z > 0.0;
    const int count = 2 * rings - (is_long ? 0 : 1);
    if (!make_mesh_room(mesh, count * sides + 2, 2 * count * sides))
        return false;
    const int bottom = add_pole(mesh, solid->pose, -z - r, -0.5 * pi);
    int below = -1;
    for (int i = 0; i < count; i++) {
        const bool is_upper = i >= rings;
        const int step = is_upper ? i - rings + (is_long ? 0 : 1) : i - rings + 1;
        const double slope = 0.5 * pi * step / rings;
        const int ring =
            add_ring(mesh, solid->pose, sides, r * cos(slope), r * sin(slope) + (is_upper ? z : -z), slope);
        if (below < 0)
            add_fan(mesh, sides, ring, bottom, false);
        else
            add_band(mesh, sides, below, ring);
        below = ring;
    }
    const int top = add_pole(mesh, solid->pose, z + r, 0.5 * pi);
    add_fan(mesh, sides, below, top, true);
    return true;
}

static bool add_surface(kt_mesh *mesh, const kt_solid *solid) {
    const kt_mesh *from = solid->mesh;
    const int first = mesh->point_count;
    if (!make_mesh_room(mesh, from->point_count, from->triangle_count))
        return false;
    for (int i = 0; i < from->point_count; i++)
        (void)add_mesh_point(mesh, solid->pose, from->points[i], from->normals[i]);
    for (int i = 0; i < from->triangle_count; i++)
        add_mesh_triangle(mesh, first + from->corners[3 * i], first + from->corners[3 * i + 1],
                          first + from->corners[3 * i + 2]);
    return true;
}

bool kt_mesh_add_solid(kt_mesh *mesh, const kt_solid *solid, int sides) {
    if (solid->mesh != NULL)
        return add_surface(mesh, solid);
    switch (solid->type) {
    case KT_SOLID_BOX:
        return add_box(mesh, solid);
    case KT_SOLID_CYLINDER:
        return add_cylinder(mesh, solid, sides);
    default:
        return add_round(mesh, solid, sides);
    }
}
