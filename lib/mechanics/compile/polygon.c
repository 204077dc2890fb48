/* Flat polygons. With p_i, p_j the ends of an edge, from the first corner, and c = p_i x p_j (Green's theorem):
 *
 *   A = sum c / 2,   A x = sum (x_i + x_j) c / 6,
 *   A xx = sum (x_i^2 + x_i x_j + x_j^2) c / 12,   A xy = sum (x_i y_j + 2 x_i y_i + 2 x_j y_j + x_j y_i) c / 24
 *
 * and less the squares of the centroid.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"

#include <math.h>

kt_polygon kt_polygon_measure(const double *points, int count) {
    kt_polygon sum = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    for (int i = 0; i < count; i++) {
        const double *p = points + 2 * i, *q = points + 2 * ((i + 1) % count);
        const double a = p[0] - points[0], b = p[1] - points[1], c = q[0] - points[0], d = q[1] - points[1];
        const double cross = a * d - b * c;
        sum.area += 0.5 * cross;
        sum.x += (a + c) * cross / 6.0;
        sum.y += (b + d) * cross / 6.0;
        sum.xx += (a * a + a * c + c * c) * cross / 12.0;
        sum.yy += (b * b + b * d + d * d) * cross / 12.0;
        sum.xy += (a * d + 2.0 * a * b + 2.0 * c * d + c * b) * cross / 24.0;
    }
    const double x = sum.x / sum.area, y = sum.y / sum.area;
    return (kt_polygon){.area = fabs(sum.area),
                        .x = points[0] + x,
                        .y = points[1] + y,
                        .xx = sum.xx / sum.area - x * x,
                        .yy = sum.yy / sum.area - y * y,
                        .xy = sum.xy / sum.area - x * y};
}

/* Twice the area of the triangle, with its sign. */
static double doubled_area(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static bool lies_between(const double *a, const double *b, const double *p) {
    return fmin(a[0], b[0]) <= p[0] && p[0] <= fmax(a[0], b[0]) && fmin(a[1], b[1]) <= p[1] && p[1] <= fmax(a[1], b[1]);
}

/* Whether the segments a b and c d have a point in common: they cross, or an end of one lies on the other. */
static bool edges_meet(const double *a, const double *b, const double *c, const double *d) {
    const double ac = doubled_area(a, b, c), ad = doubled_area(a, b, d), ca = doubled_area(c, d, a),
                 cb = doubled_area(c, d, b);
    if (((ac > 0.0 && ad < 0.0) || (ac < 0.0 && ad > 0.0)) && ((ca > 0.0 && cb < 0.0) || (ca < 0.0 && cb > 0.0)))
        return true;
    return (ac == 0.0 && lies_between(a, b, c)) || (ad == 0.0 && lies_between(a, b, d)) ||
           (ca == 0.0 && lies_between(c, d, a)) || (cb == 0.0 && lies_between(c, d, b));
}

/* Two edges that follow each other have a corner in common: b. */
static bool doubles_back(const double *a, const double *b, const double *c) {
    return doubled_area(a, b, c) == 0.0 && (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) <= 0.0;
}

bool kt_polygon_crosses(const double *points, int count, int *first, int *second) {
    for (int i = 0; i < count; i++)
        for (int j = i + 1; j < count; j++) {
            const double *a = points + 2 * i, *b = points + 2 * ((i + 1) % count);
            const double *c = points + 2 * j, *d = points + 2 * ((j + 1) % count);
            const bool follows = j == i + 1, precedes = (j + 1) % count == i;
            *first = i;
            *second = j;
            if (follows ? doubles_back(a, b, d) : precedes ? doubles_back(c, d, b) : edges_meet(a, b, c, d))
                return true;
        }
    return false;
}
