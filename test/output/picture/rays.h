/* Painted solids against rays. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_PICTURE_RAYS_H
#define KT_TEST_PICTURE_RAYS_H

#include "picture/hiding.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>

/* The point at which the ray through a point of the picture leaves a solid towards the viewer; -DBL_MAX if it misses
 * it. */
static inline double front_of(const kt_solid *solid, double x, double y) {
    const kt_pose inverse = kt_pose_invert(solid->pose);
    double enter, leave;
    return kt_solid_cut(solid, kt_pose_apply(inverse, kt_vec3_make(x, y, 0.0)), inverse.rotation.z, &enter, &leave)
               ? leave
               : -DBL_MAX;
}

/* How much nearer the nearest object at a point of the picture is than the object painted last there. 0: the picture is
 * correct. -1: nothing is there. */
static inline double error_at(const kt_pieces *sorted, double x, double y) {
    double nearest = -DBL_MAX, painted = -DBL_MAX;
    for (int i = 0; i < sorted->count; i++) {
        const kt_solid piece = kt_piece_solid(&sorted->items[i]);
        const double whole = front_of(&sorted->items[i].solid, x, y);
        nearest = fmax(nearest, whole);
        painted = front_of(&piece, x, y) > -DBL_MAX ? whole : painted;
    }
    return painted > -DBL_MAX ? nearest - painted : nearest > -DBL_MAX ? 0.0 : -1.0;
}

/* The share of points of a square picture, of those where something is, at which more than `least` is painted
 * wrongly. NaN: nothing is there. */
static inline double wrong_share(const kt_pieces *sorted, kt_vec3 middle, double half, int points, double least) {
    int wrong = 0, all = 0;
    for (int i = 0; i < points * points; i++) {
        const double x = middle.x + half * ((i % points + 0.5) / (0.5 * points) - 1.0);
        const double y = middle.y + half * ((i / points + 0.5) / (0.5 * points) - 1.0);
        const double error = error_at(sorted, x, y);
        all += error >= 0.0;
        wrong += error > least;
    }
    return all > 0 ? (double)wrong / all : (double)NAN;
}

#endif
