/* Boxes, balls, cylinders and rods (cylinders with hemispherical ends). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/solid.h"

#include <float.h>
#include <math.h>

kt_mat3 kt_solid_rotation(const kt_rotation *rotation) {
    kt_mat3 matrix;
    return kt_rotation_evaluate(rotation, &matrix, NULL) == KT_OK ? matrix : kt_mat3_identity();
}

kt_solid kt_solid_rod(kt_vec3 from, kt_vec3 to, double radius) {
    const kt_vec3 along = kt_vec3_sub(to, from);
    const double length = kt_vec3_norm_wide(along);
    kt_solid rod = {.type = KT_SOLID_ROD, .half = {radius, radius, 0.5 * length}};
    rod.pose.position = kt_vec3_add(from, kt_vec3_scale(0.5, along));
    rod.pose.rotation = length > 0.0 ? kt_triad_from_axis(kt_vec3_normalize(along), 2) : kt_mat3_identity();
    return rod;
}

bool kt_solid_of_shape(const kt_shape *shape, kt_solid *solid) {
    const int body = solid->body;
    const double r = shape->radius;
    kt_solid made = {.source = KT_SOURCE_SHAPE};
    made.pose.rotation = kt_solid_rotation(&shape->rotation);
    made.pose.position = shape->at;
    switch (shape->type) {
    case KT_SHAPE_POINT:
        made.type = KT_SOLID_SPHERE;
        made.source = KT_SOURCE_SLENDER;
        break;
    case KT_SHAPE_ROD:
        made = kt_solid_rod(shape->from, shape->to, r);
        made.source = r > 0.0 ? KT_SOURCE_SHAPE : KT_SOURCE_SLENDER;
        break;
    case KT_SHAPE_BOX:
        made.type = KT_SOLID_BOX;
        made.half = kt_vec3_scale(0.5, shape->size);
        break;
    case KT_SHAPE_SPHERE:
        made.type = KT_SOLID_SPHERE;
        made.half = kt_vec3_make(r, r, r);
        break;
    case KT_SHAPE_CYLINDER:
        made.type = KT_SOLID_CYLINDER;
        made.half = kt_vec3_make(r, r, 0.5 * shape->length);
        made.pose.rotation =
            kt_mat3_multiply(made.pose.rotation, kt_triad_from_axis(kt_vec3_normalize(shape->axis), 2));
        break;
    default:
        return false;
    }
    made.body = body;
    *solid = made;
    return true;
}

/* A corner of a polygon on one of its faces, body frame. */
static kt_vec3 polygon_corner_of(const kt_shape *shape, size_t i, double side) {
    const double *p = shape->points + 2 * (i % (size_t)shape->point_count);
    return kt_vec3_add(shape->at, kt_mat3_apply(kt_solid_rotation(&shape->rotation),
                                                kt_vec3_make(p[0], p[1], 0.5 * side * shape->length)));
}

size_t kt_solid_edge_count(const kt_shape *shape) {
    return shape->type == KT_SHAPE_POLYGON ? 3 * (size_t)shape->point_count : 0;
}

/* Corner i of the polygon has three edges. Edge 3 i leads to the next corner on one face, and edge 3 i + 1 on the other
 * face. Edge 3 i + 2 leads from face to face. */
kt_solid kt_solid_edge(const kt_shape *shape, size_t k) {
    const size_t i = k / 3;
    const double from = k % 3 == 1 ? 1.0 : -1.0, to = k % 3 == 0 ? -1.0 : 1.0;
    kt_solid edge =
        kt_solid_rod(polygon_corner_of(shape, i, from), polygon_corner_of(shape, k % 3 < 2 ? i + 1 : i, to), 0.0);
    edge.source = KT_SOURCE_SLENDER;
    return edge;
}

double kt_solid_reach(const kt_solid *solid, kt_vec3 d) {
    const kt_vec3 h = solid->half;
    switch (solid->type) {
    case KT_SOLID_BOX:
        return h.x * fabs(d.x) + h.y * fabs(d.y) + h.z * fabs(d.z);
    case KT_SOLID_SPHERE:
        return h.x * kt_vec3_norm(d);
    case KT_SOLID_CYLINDER:
        return h.x * hypot(d.x, d.y) + h.z * fabs(d.z);
    default:
        return h.x * kt_vec3_norm(d) + h.z * fabs(d.z);
    }
}

static double clamp_magnitude(double x, double limit) { return fmin(fmax(x, -limit), limit); }

kt_vec3 kt_solid_nearest(const kt_solid *solid, kt_vec3 p) {
    const kt_vec3 h = solid->half;
    const double out = solid->type == KT_SOLID_SPHERE ? kt_vec3_norm(p) : hypot(p.x, p.y);
    const double share = out > h.x ? h.x / out : 1.0;
    switch (solid->type) {
    case KT_SOLID_BOX:
        return kt_vec3_make(clamp_magnitude(p.x, h.x), clamp_magnitude(p.y, h.y), clamp_magnitude(p.z, h.z));
    case KT_SOLID_SPHERE:
        return kt_vec3_scale(share, p);
    case KT_SOLID_CYLINDER:
        return kt_vec3_make(share * p.x, share * p.y, clamp_magnitude(p.z, h.z));
    default:
        return kt_vec3_make(0.0, 0.0, clamp_magnitude(p.z, h.z));
    }
}

/* ---- rays -------------------------------------------------------------------------------------------------------- */

/* A part of a line; empty where low > high. */
typedef struct span {
    double low, high;
} span;

static const span empty = {DBL_MAX, -DBL_MAX}, whole = {-DBL_MAX, DBL_MAX};

static span common(span a, span b) { return (span){fmax(a.low, b.low), fmin(a.high, b.high)}; }
static span hull(span a, span b) { return (span){fmin(a.low, b.low), fmax(a.high, b.high)}; }

/* |x + s d| <= h */
static span cut_slab(double x, double d, double h) {
    if (d == 0.0)
        return fabs(x) <= h ? whole : empty;
    const double a = (-h - x) / d, b = (h - x) / d;
    return (span){fmin(a, b), fmax(a, b)};
}

/* a s^2 + 2 b s + c <= 0, a >= 0 */
static span cut_quadric(double a, double b, double c) {
    const double inside = b * b - a * c;
    if (!(a > 0.0))
        return c <= 0.0 ? whole : empty;
    if (inside < 0.0)
        return empty;
    return (span){(-b - sqrt(inside)) / a, (-b + sqrt(inside)) / a};
}

static span cut_sphere(kt_vec3 p, kt_vec3 d, double r) {
    return cut_quadric(kt_vec3_dot(d, d), kt_vec3_dot(p, d), kt_vec3_dot(p, p) - r * r);
}

static span cut_cylinder(kt_vec3 p, kt_vec3 d, kt_vec3 h) {
    const span side = cut_quadric(d.x * d.x + d.y * d.y, p.x * d.x + p.y * d.y, p.x * p.x + p.y * p.y - h.x * h.x);
    return common(side, cut_slab(p.z, d.z, h.z));
}

bool kt_solid_cut(const kt_solid *solid, kt_vec3 p, kt_vec3 d, double *enter, double *leave) {
    const kt_vec3 h = solid->half, up = kt_vec3_make(0.0, 0.0, h.z);
    span found;
    switch (solid->type) {
    case KT_SOLID_BOX:
        found = common(common(cut_slab(p.x, d.x, h.x), cut_slab(p.y, d.y, h.y)), cut_slab(p.z, d.z, h.z));
        break;
    case KT_SOLID_SPHERE:
        found = cut_sphere(p, d, h.x);
        break;
    case KT_SOLID_CYLINDER:
        found = cut_cylinder(p, d, h);
        break;
    default: { /* a convex union: the hull of the parts of the line */
        const span ends[] = {cut_sphere(kt_vec3_sub(p, up), d, h.x), cut_sphere(kt_vec3_add(p, up), d, h.x)};
        const span side = cut_cylinder(p, d, h);
        found = side.low <= side.high ? side : empty;
        for (int i = 0; i < 2; i++)
            found = ends[i].low <= ends[i].high ? hull(found, ends[i]) : found;
    }
    }
    if (!(found.low <= found.high))
        return false;
    *enter = found.low;
    *leave = found.high;
    return true;
}
