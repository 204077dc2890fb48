/* A loop between links of one plane, with its equations in that plane.
 *
 * Rotations about n and translations normal to it change no height along n and no angle to n. Therefore an equation of
 * the loop is either constant or one equation in the plane with the same phi. A constant equation is a vanishing row:
 * no motion changes the residual, which must be zero. The equations in the plane are as follows.
 *
 *   along       phi = e . d + constant. The vector e is fixed in end 1's frame, d leads from point 1 to point 2.
 *   rotation    phi = factor 4 tan(theta / 4). The angle theta leads from end 1's direction to end 2's.
 *   orthogonal  phi = 2 tan(eps / 2), sin(eps) = cos(theta)
 *   distance    phi = sqrt(d^2 + height^2) - L(t)
 *   spatial     as in space, of ends that move in the plane. No motion may change such an equation either.
 *
 * Each row has its index among the loop's equations, which counts and reports use.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_PLANAR_LOOP_H
#define KT_MODEL_PLANAR_LOOP_H

#include "kinetree/model.h"

#include <stdint.h>

enum { KT_PLANAR_ROW_MAX = 6 };

typedef enum kt_planar_row_kind {
    KT_PLANAR_ROW_VOID = 0,
    KT_PLANAR_ROW_ALONG,
    KT_PLANAR_ROW_ROTATION,
    KT_PLANAR_ROW_ORTHOGONAL,
    KT_PLANAR_ROW_DISTANCE,
    KT_PLANAR_ROW_SPATIAL
} kt_planar_row_kind;

typedef struct kt_planar_row {
    double e[2];     /* along: at q = 0; distance: the direction used where the points coincide */
    double constant; /* along: contribution of the heights; rotation: the factor */
    int32_t kind;    /* kt_planar_row_kind */
    int32_t row;     /* among the loop's equations */
} kt_planar_row;

/* A loop in its plane. Relations of joint positions have none of these data. */
typedef struct kt_planar_loop {
    double arm[2][2]; /* from the ends' links' origins to their points, at q = 0 */
    double origin[2]; /* origin of positions on the paths, as in kt_loop_record */
    int32_t link[2];  /* planar indices of the links of the ends */
    int32_t ancestor; /* planar index of the link that carries both */
    double c, s;      /* cosine, sine of the angle between the ends' directions (from end 1) at q = 0 */
    double height;    /* height of point 2 over point 1 */
    int32_t count;    /* rows in the plane; they come first */
    int32_t vanishing_count;
    int32_t placed; /* the place of an end has been set (compile/loop_place.c); then, as compiled: */
    double c0, s0, e0[KT_PLANAR_ROW_MAX][2];
    kt_mat3 axes0; /* axes of this end's frame */
    kt_planar_row row[KT_PLANAR_ROW_MAX];
} kt_planar_loop;

#endif
