/* Outlines of convex solids in the picture. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_OUTLINE_H
#define KT_PICTURE_OUTLINE_H

#include "picture/picture.h"

enum { KT_OUTLINE_CORNERS = 64 /* room of an outline */ };

typedef struct kt_outline_point {
    double x, y;
} kt_outline_point;

/* A convex polygon, anticlockwise. */
typedef struct kt_outline {
    int count;
    kt_outline_point corners[KT_OUTLINE_CORNERS];
} kt_outline;

static inline kt_outline_point kt_outline_point_of(kt_vec3 point) { return (kt_outline_point){point.x, point.y}; }

/* The outline of a solid in the camera's frame. Polygons with 16 corners replace circles. */
kt_outline kt_outline_of(const kt_solid *solid);

/* The part of an outline that lies in another; without corners if there is none. */
kt_outline kt_outline_overlap(const kt_outline *a, const kt_outline *b);
double kt_outline_area(const kt_outline *outline);

#endif
