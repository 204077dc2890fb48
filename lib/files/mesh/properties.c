/* Volume, centroid and inertia of the body that a surface of triangles encloses.
 *
 * A triangle (a, b, c) and a point p make a tetrahedron with the volume and the centroid
 *     V = (a - p) . (b - p) x (c - p) / 6
 *     (p + a + b + c) / 4
 * Seen from its vertex p, with a, b, c from there, its second moments are
 *     integral of x x' = V / 20 (a a' + b b' + c c' + (a + b + c)(a + b + c)')
 * If the surface is closed, the sums over all triangles do not depend on p. MuJoCo's `legacy` takes each V as positive.
 * `legacy` uses the centroid of the surface as p for the centre of mass, and the centre of mass as p for the second
 * moments.
 *
 * A shell has the area A of each triangle in place of V, and the centroid (a + b + c) / 3. Its second moments have
 * A / 12 in place of V / 20.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mesh/mesh.h"

#include <math.h>

typedef struct corners {
    kt_vec3 a, b, c;
} corners;

/* The corners of a triangle, seen from a point. */
static corners corners_of(const kt_triangles *mesh, int i, kt_vec3 from) {
    const int *v = mesh->triangles[i].corner;
    corners t;
    t.a = kt_vec3_sub(mesh->vertices[v[0]], from);
    t.b = kt_vec3_sub(mesh->vertices[v[1]], from);
    t.c = kt_vec3_sub(mesh->vertices[v[2]], from);
    return t;
}

static kt_vec3 corner_sum_of(const corners *t) { return kt_vec3_add(kt_vec3_add(t->a, t->b), t->c); }

static double corner_area_of(const corners *t) {
    return 0.5 * kt_vec3_norm(kt_vec3_cross(kt_vec3_sub(t->b, t->a), kt_vec3_sub(t->c, t->a)));
}

/* Returns the volume of a tetrahedron, or the area for a shell. */
static double volume_under(const corners *t, kt_volume_rule rule) {
    if (rule == KT_VOLUME_SURFACE)
        return corner_area_of(t);
    const double volume = kt_vec3_dot(t->a, kt_vec3_cross(t->b, t->c)) / 6.0;
    return rule == KT_VOLUME_ABSOLUTE ? fabs(volume) : volume;
}

/* The centroid of the surface itself, by areas. */
static kt_vec3 surface_centroid(const kt_triangles *mesh) {
    kt_vec3 moment = kt_vec3_make(0.0, 0.0, 0.0);
    double area = 0.0;
    for (int i = 0; i < mesh->triangle_count; i++) {
        const corners t = corners_of(mesh, i, mesh->vertices[0]);
        const double own = corner_area_of(&t);
        area += own;
        moment = kt_vec3_add(moment, kt_vec3_scale(own / 3.0, corner_sum_of(&t)));
    }
    return area > 0.0 ? kt_vec3_add(mesh->vertices[0], kt_vec3_scale(1.0 / area, moment)) : mesh->vertices[0];
}

/* Adds weight u u' to a matrix of second moments. */
static kt_sym3 add_second_moment(kt_sym3 s, double weight, kt_vec3 u) {
    return kt_sym3_add(s, kt_sym3_make(weight * u.x * u.x, weight * u.y * u.y, weight * u.z * u.z, weight * u.x * u.y,
                                       weight * u.x * u.z, weight * u.y * u.z));
}

/* The integral of x x', with x from `from`. A tetrahedron with the corners 0, a, b, c, the volume V and s = a + b + c
 * has
 *     V / 20 (a a' + b b' + c c' + s s')
 * A triangle of a surface has the area in place of the volume, and 12 in place of 20. */
static kt_sym3 second_moments(const kt_triangles *mesh, kt_vec3 from, kt_volume_rule rule, double *volume) {
    kt_sym3 s = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    *volume = 0.0;
    for (int i = 0; i < mesh->triangle_count; i++) {
        const corners t = corners_of(mesh, i, from);
        const double own = volume_under(&t, rule), weight = own / (rule == KT_VOLUME_SURFACE ? 12.0 : 20.0);
        *volume += own;
        s = add_second_moment(add_second_moment(s, weight, t.a), weight, t.b);
        s = add_second_moment(add_second_moment(s, weight, t.c), weight, corner_sum_of(&t));
    }
    return s;
}

kt_enclosed kt_triangles_enclosed(const kt_triangles *mesh, kt_volume_rule rule) {
    kt_enclosed all = {.volume = 0.0};
    if (mesh->triangle_count == 0)
        return all;
    const kt_vec3 from = surface_centroid(mesh);
    const double mean = rule == KT_VOLUME_SURFACE ? 1.0 / 3.0 : 0.25; /* of the corners, in the centroid */
    kt_vec3 moment = kt_vec3_make(0.0, 0.0, 0.0);
    for (int i = 0; i < mesh->triangle_count; i++) {
        const corners t = corners_of(mesh, i, from);
        const double volume = volume_under(&t, rule);
        all.volume += volume;
        moment = kt_vec3_add(moment, kt_vec3_scale(mean * volume, corner_sum_of(&t)));
    }
    if (!(all.volume > 0.0))
        return all;
    all.com = kt_vec3_add(from, kt_vec3_scale(1.0 / all.volume, moment));
    const kt_sym3 s = second_moments(mesh, all.com, rule, &all.volume); /* I = tr(S) 1 - S */
    all.inertia = kt_sym3_make(s.yy + s.zz, s.xx + s.zz, s.xx + s.yy, -s.xy, -s.xz, -s.yz);
    return all;
}
