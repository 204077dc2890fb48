/* A loop between links of one plane, as the planar kernels close it: its rows one by one as they lie in the plane.
 *
 * Turns about n and slides normal to it keep all heights along n and all angles against n. So of an equation either
 * nothing is left, which must hold as it is (a void row), or one equation in the plane, with the same phi:
 *   along       phi = e . d + constant, e fixed in end 1's frame, d from point 1 to point 2
 *   turn        phi = factor 4 tan(theta / 4), theta from end 1's direction to end 2's
 *   orthogonal  phi = 2 tan(eps / 2), sin(eps) = cos(theta)
 *   distance    phi = sqrt(d^2 + height^2) - L(t)
 * Rows keep their places among the loop's equations, so that those who count and report equations see no difference.
 */
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
    KT_PLANAR_ROW_DISTANCE
} kt_planar_row_kind;

typedef struct kt_planar_row {
    double e[2];     /* along: at q = 0; distance: the direction that stands in where the points coincide */
    double constant; /* along: what heights add; turn: the factor */
    int32_t kind;    /* kt_planar_row_kind */
    int32_t row;     /* among the loop's equations */
} kt_planar_row;

/* Of relations nothing is used. */
typedef struct kt_planar_loop {
    double arm[2][2]; /* from the ends' links' origins to their points, at q = 0 */
    double origin[2]; /* what places on the paths are counted from, as kt_loop_record has it */
    int32_t place[2]; /* of the ends' links */
    int32_t ancestor; /* place of the link that carries both */
    double c, s;      /* of end 2's direction against end 1's, at q = 0 */
    double height;    /* of point 2 over point 1 */
    int32_t count;    /* rows in the plane; they come first */
    int32_t void_count;
    kt_planar_row row[KT_PLANAR_ROW_MAX];
} kt_planar_loop;

#endif
