/* The points in which a mesh touches planes.
 *
 * A plane touches the convex hull. On a flat face of the hull, such as a sole, the mesh needs the corners of this face,
 * because they determine the area of support. The triangles of the mesh show its flat faces. Their normals n are
 * counted in the cells of a cube's surface, n and -n as one. In each cell, the largest triangle gives the normal. A
 * side of the hull is flat if triangles of the part FLAT of the surface are within the tolerance of its plane. Its
 * corners are the vertices in the plane that are the farthest in TURNS directions along it. The directions are turned
 * by half an angle between them, since most edges are parallel to an axis.
 *
 * Else the mesh needs vertices that are the farthest in the directions to faces, edges and corners of its box. A point
 * that surpasses all others by less than the tolerance is left out. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot_contact.h"

#include "algebra/elementary.h"

#include <math.h>

enum { ACROSS = 16, CELLS = 3 * ACROSS * ACROSS, SIDES = 12, TURNS = 8 };

static const double TOLERANCE = 1e-4; /* as a part of the diagonal of the box */
static const double FLAT = 0.05, PARALLEL = 1e-6;

typedef struct point_choice {
    const kt_triangles *mesh;
    kt_vec3 *points;
    int count, most;
    double tolerance;
} point_choice;

/* The normals of one cell. */
typedef struct normal_cell {
    int triangle; /* the largest one, -1: none */
    double largest, area;
} normal_cell;

kt_vec3 kt_contact_direction(int i, kt_vec3 extent) {
    const int k = i < KT_CONTACT_EXTREMES / 2 ? i : i + 1; /* not the centre */
    const int x = k % 3 - 1, y = k / 3 % 3 - 1, z = k / 9 - 1;
    return kt_vec3_make(extent.x > 0.0 ? x / extent.x : 0.0, extent.y > 0.0 ? y / extent.y : 0.0,
                        extent.z > 0.0 ? z / extent.z : 0.0);
}

/* The normal of a triangle, whose length is twice the area. */
static kt_vec3 area_normal(const kt_triangles *mesh, int i) {
    const int *c = mesh->triangles[i].corner;
    const kt_vec3 a = mesh->vertices[c[0]];
    return kt_vec3_cross(kt_vec3_sub(mesh->vertices[c[1]], a), kt_vec3_sub(mesh->vertices[c[2]], a));
}

/* The cell of a normal n, which is also the cell of -n: the axis of the largest component, and the two other components
 * divided by the largest one. */
static int cell_of_normal(kt_vec3 n) {
    const double v[3] = {n.x, n.y, n.z};
    int axis = fabs(n.y) > fabs(n.x);
    axis = fabs(n.z) > fabs(v[axis]) ? 2 : axis;
    const double u = v[(axis + 1) % 3] / v[axis], w = v[(axis + 2) % 3] / v[axis];
    const int i = (int)(0.5 * (u + 1.0) * ACROSS), k = (int)(0.5 * (w + 1.0) * ACROSS);
    return (axis * ACROSS + (i < ACROSS ? i : ACROSS - 1)) * ACROSS + (k < ACROSS ? k : ACROSS - 1);
}

/* Adds the vertex that is the farthest in the direction n, among those above the height `least` along `up`, unless a
 * point is as far. */
static void choose_farthest(point_choice *c, kt_vec3 n, kt_vec3 up, double least) {
    int best = -1;
    double most = 0.0;
    for (int i = 0; i < c->mesh->vertex_count; i++) {
        const kt_vec3 x = c->mesh->vertices[i];
        const double far = kt_vec3_dot(n, x);
        if ((best < 0 || far > most) && kt_vec3_dot(up, x) >= least) {
            best = i;
            most = far;
        }
    }
    for (int i = 0; i < c->count; i++)
        if (kt_vec3_dot(up, c->points[i]) >= least && kt_vec3_dot(n, c->points[i]) >= most - c->tolerance)
            return;
    if (best >= 0 && c->count < c->most)
        c->points[c->count++] = c->mesh->vertices[best];
}

/* The corners of the hull's side with the normal n, if it is flat. */
static bool choose_side(point_choice *c, kt_vec3 n, double surface) {
    double height = -HUGE_VAL, area = 0.0;
    for (int i = 0; i < c->mesh->vertex_count; i++)
        height = fmax(height, kt_vec3_dot(n, c->mesh->vertices[i]));
    const double least = height - c->tolerance;
    for (int i = 0; i < c->mesh->triangle_count; i++) {
        const int *corner = c->mesh->triangles[i].corner;
        bool is_near = true;
        for (int k = 0; k < 3; k++)
            is_near = is_near && kt_vec3_dot(n, c->mesh->vertices[corner[k]]) >= least;
        area += is_near ? kt_vec3_norm(area_normal(c->mesh, i)) : 0.0;
    }
    if (area < FLAT * surface)
        return false;
    const kt_vec3 axis = fabs(n.x) < 0.6 ? kt_vec3_make(1.0, 0.0, 0.0) : kt_vec3_make(0.0, 1.0, 0.0);
    const kt_vec3 s = kt_vec3_normalize(kt_vec3_cross(n, axis)), t = kt_vec3_cross(n, s);
    for (int i = 0; i < TURNS; i++) {
        const double turn = 2.0 * 3.14159265358979323846 * (i + 0.5) / TURNS;
        choose_farthest(c, kt_vec3_add(kt_vec3_scale(cos(turn), s), kt_vec3_scale(sin(turn), t)), n, least);
    }
    return true;
}

static double fill_cells(const kt_triangles *mesh, normal_cell cells[CELLS]) {
    double surface = 0.0;
    for (int i = 0; i < CELLS; i++)
        cells[i] = (normal_cell){.triangle = -1};
    for (int i = 0; i < mesh->triangle_count; i++) {
        const kt_vec3 n = area_normal(mesh, i);
        const double area = kt_vec3_norm(n);
        if (!(area > 0.0 && isfinite(area)))
            continue;
        normal_cell *cell = &cells[cell_of_normal(n)];
        surface += area;
        if (area > cell->largest) {
            cell->triangle = i;
            cell->largest = area;
        }
    }
    for (int i = 0; i < mesh->triangle_count; i++) {
        const kt_vec3 n = area_normal(mesh, i);
        const double area = kt_vec3_norm(n);
        if (!(area > 0.0 && isfinite(area)))
            continue;
        normal_cell *cell = &cells[cell_of_normal(n)];
        const double along = kt_vec3_dot(n, area_normal(mesh, cell->triangle)) / (area * cell->largest);
        cell->area += fabs(along) > 1.0 - PARALLEL ? area : 0.0;
    }
    return surface;
}

/* The corners of flat sides, those of the largest area first. */
static void choose_sides(point_choice *c) {
    normal_cell cells[CELLS];
    const double surface = fill_cells(c->mesh, cells);
    for (int count = 0; count < SIDES;) {
        normal_cell *cell = &cells[0];
        for (int i = 1; i < CELLS; i++)
            if (cells[i].area > cell->area)
                cell = &cells[i];
        if (!(cell->area >= FLAT * surface && cell->area > 0.0))
            return;
        const kt_vec3 n = kt_vec3_normalize(area_normal(c->mesh, cell->triangle));
        cell->area = 0.0;
        count += choose_side(c, n, surface);
        count += choose_side(c, kt_vec3_scale(-1.0, n), surface);
    }
}

int kt_contact_mesh_points(const kt_triangles *mesh, kt_vec3 points[KT_CONTACT_POINTS_MOST]) {
    if (mesh->vertex_count == 0)
        return 0;
    kt_vec3 low, high;
    kt_box_of(mesh->vertices, mesh->vertex_count, &low, &high);
    const kt_vec3 extent = kt_vec3_sub(high, low);
    point_choice c = {.mesh = mesh,
                      .points = points,
                      .most = KT_CONTACT_POINTS_MOST - KT_CONTACT_EXTREMES,
                      .tolerance = TOLERANCE * kt_vec3_norm(extent)};
    choose_sides(&c);
    c.most = KT_CONTACT_POINTS_MOST;
    for (int i = 0; i < KT_CONTACT_EXTREMES; i++) {
        const kt_vec3 n = kt_contact_direction(i, extent);
        if (kt_vec3_norm(n) > 0.0)
            choose_farthest(&c, kt_vec3_normalize(n), n, -HUGE_VAL);
    }
    if (c.count == 0)
        points[c.count++] = mesh->vertices[0];
    return c.count;
}

/* A wheel about an axis reaches as far from its middle in all directions across the axis. The points of an octagon
 * reach 92 % of their largest distance in the worst direction, and those of a square 71 %. */
bool kt_contact_is_round(const kt_vec3 *points, int count) {
    enum { DIRECTIONS = 16 };
    kt_vec3 low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < count; i++) {
        low = kt_vec3_make(fmin(low.x, points[i].x), fmin(low.y, points[i].y), fmin(low.z, points[i].z));
        high = kt_vec3_make(fmax(high.x, points[i].x), fmax(high.y, points[i].y), fmax(high.z, points[i].z));
    }
    const kt_vec3 middle = kt_vec3_scale(0.5, kt_vec3_add(low, high));
    for (int axis = 0; axis < 3 && count > 0; axis++) {
        double farthest = 0.0, least = HUGE_VAL;
        for (int k = 0; k < DIRECTIONS; k++) {
            const double turn = 2.0 * 3.14159265358979323846 * k / DIRECTIONS, c = cos(turn), s = sin(turn);
            double reach = 0.0;
            for (int i = 0; i < count; i++) {
                const kt_vec3 p = kt_vec3_sub(points[i], middle);
                const double x = axis == 0 ? p.y : p.x, y = axis == 2 ? p.y : p.z;
                reach = fmax(reach, c * x + s * y);
                farthest = fmax(farthest, hypot(x, y));
            }
            least = fmin(least, reach);
        }
        if (least > 0.9 * farthest)
            return true;
    }
    return false;
}
