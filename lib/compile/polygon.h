/* Flat polygons: area, centroid and second moments (polygon.c). */
#ifndef KT_COMPILE_POLYGON_H
#define KT_COMPILE_POLYGON_H

#include <stdbool.h>

/* Area, centroid, and the mean squares and product of the coordinates from the centroid. */
typedef struct kt_polygon {
    double area;       /* above 0 whichever way round the corners go */
    double x, y;       /* centroid */
    double xx, yy, xy; /* means over the area */
} kt_polygon;

/* points: x, y of each corner. O(count). */
kt_polygon kt_polygon_measure(const double *points, int count);

/* Whether two edges meet that do not follow each other, or two that do lie on each other; their indices. O(count^2). */
bool kt_polygon_crosses(const double *points, int count, int *first, int *second);

#endif
