/* Outlines of solids as convex polygons: hull, intersection and area.
 *
 * Three corners a, b, c turn to the left if (b - a) x (c - a) is above zero. The hull keeps only corners that turn to
 * the left. A point is inside of a polygon if each edge and the point turn to the left. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/outline.h"

#include <math.h>
#include <stdlib.h>

enum { CIRCLE = 16 /* corners that replace a circle */ };

static const double pi = 3.14159265358979323846;

static double turn_of_corner(kt_outline_point a, kt_outline_point b, kt_outline_point c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static int compare_corners(const void *a, const void *b) {
    const kt_outline_point *p = a, *q = b;
    return p->x != q->x ? (p->x > q->x) - (p->x < q->x) : (p->y > q->y) - (p->y < q->y);
}

/* The convex hull, anticlockwise (Andrew's monotone chain). */
static kt_outline hull_of(kt_outline_point *points, int count) {
    kt_outline hull = {0};
    qsort(points, (size_t)count, sizeof *points, compare_corners);
    for (int pass = 0; pass < 2; pass++) {
        const int start = hull.count;
        for (int i = 0; i < count; i++) {
            const kt_outline_point point = points[pass == 0 ? i : count - 1 - i];
            while (hull.count >= start + 2 &&
                   turn_of_corner(hull.corners[hull.count - 2], hull.corners[hull.count - 1], point) <= 0.0)
                hull.count--;
            hull.corners[hull.count++] = point;
        }
        hull.count--; /* the last one begins the other chain */
    }
    return hull;
}

/* The hull of points that the surface of the solid has. */
kt_outline kt_outline_of(const kt_solid *solid) {
    kt_outline_point points[2 * CIRCLE] = {{0.0, 0.0}};
    const kt_vec3 h = solid->half;
    int count = 0;
    for (int i = 0; i < (solid->type == KT_SOLID_BOX ? 8 : 2 * CIRCLE); i++) {
        const double angle = 2.0 * pi * floor(0.5 * i) / CIRCLE, sign = i % 2 == 0 ? 1.0 : -1.0;
        const double c = h.x * cos(angle), s = h.x * sin(angle);
        kt_vec3 local = kt_vec3_make(c, s, sign * h.z); /* of a cylinder */
        if (solid->type == KT_SOLID_BOX)
            local = kt_vec3_make((i & 2) != 0 ? h.x : -h.x, (i & 4) != 0 ? h.y : -h.y, sign * h.z);
        else if (solid->type != KT_SOLID_CYLINDER)
            local = kt_vec3_make(0.0, 0.0, solid->type == KT_SOLID_SPHERE ? 0.0 : sign * h.z);
        points[count] = kt_outline_point_of(kt_pose_apply(solid->pose, local));
        if (solid->type == KT_SOLID_SPHERE || solid->type == KT_SOLID_ROD) {
            points[count].x += c;
            points[count].y += s;
        }
        count++;
    }
    return hull_of(points, count);
}

/* Cuts the first polygon at each edge of the second (Sutherland and Hodgman). */
kt_outline kt_outline_overlap(const kt_outline *a, const kt_outline *b) {
    kt_outline part = *a;
    for (int i = 0; i < b->count && part.count > 0; i++) {
        const kt_outline_point from = b->corners[i], to = b->corners[(i + 1) % b->count];
        kt_outline rest = {0};
        for (int k = 0; k < part.count && rest.count + 2 <= KT_OUTLINE_CORNERS; k++) {
            const kt_outline_point p = part.corners[k], q = part.corners[(k + 1) % part.count];
            const double inside = turn_of_corner(from, to, p), next = turn_of_corner(from, to, q);
            if (inside >= 0.0)
                rest.corners[rest.count++] = p;
            if ((inside > 0.0 && next < 0.0) || (inside < 0.0 && next > 0.0)) {
                const double share = inside / (inside - next);
                rest.corners[rest.count++] = (kt_outline_point){p.x + share * (q.x - p.x), p.y + share * (q.y - p.y)};
            }
        }
        part = rest;
    }
    return part;
}

double kt_outline_area(const kt_outline *outline) {
    double sum = 0.0;
    for (int i = 1; i + 1 < outline->count; i++)
        sum += 0.5 * turn_of_corner(outline->corners[0], outline->corners[i], outline->corners[i + 1]);
    return sum;
}
