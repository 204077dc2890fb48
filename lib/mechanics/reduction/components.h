/* Accelerations, wrenches and inertias of links as plain numbers. In a plane, each has three components, (alpha, a) or
 * (n, f_x, f_y); in space, six. Thus the recursions of fronts, Delassus and the KKT system are written once for plane
 * and space. A component may also be a vector, with one column in each lane. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_COMPONENTS_H
#define KT_REDUCTION_COMPONENTS_H

#include "constraint/group.h"
#include "dynamics/aba.h"
#include "dynamics/aba_planar.h"

#include <string.h>

/* Defines two functions for numbers, or vectors of them:
 *
 *   kt_motion_shift...   shifts an acceleration x from the beginning of r to its end
 *   kt_wrench_shift...   shifts a wrench x from the end of r to its beginning
 */
#define KT_SHIFTS(number, suffix)                                                                                      \
    KT_INLINE void kt_motion_shift##suffix(int components, kt_real3 r, number *x) {                                    \
        if (components == KT_FRONT_SPACE / 2) {                                                                        \
            x[1] -= x[0] * KT_PART3(r, 1);                                                                             \
            x[2] += x[0] * KT_PART3(r, 0);                                                                             \
        } else {                                                                                                       \
            x[3] += x[1] * KT_PART3(r, 2) - x[2] * KT_PART3(r, 1);                                                     \
            x[4] += x[2] * KT_PART3(r, 0) - x[0] * KT_PART3(r, 2);                                                     \
            x[5] += x[0] * KT_PART3(r, 1) - x[1] * KT_PART3(r, 0);                                                     \
        }                                                                                                              \
    }                                                                                                                  \
    KT_INLINE void kt_wrench_shift##suffix(int components, kt_real3 r, number *x) {                                    \
        if (components == KT_FRONT_SPACE / 2) {                                                                        \
            x[0] += KT_PART3(r, 0) * x[2] - KT_PART3(r, 1) * x[1];                                                     \
        } else {                                                                                                       \
            x[0] += KT_PART3(r, 1) * x[5] - KT_PART3(r, 2) * x[4];                                                     \
            x[1] += KT_PART3(r, 2) * x[3] - KT_PART3(r, 0) * x[5];                                                     \
            x[2] += KT_PART3(r, 0) * x[4] - KT_PART3(r, 1) * x[3];                                                     \
        }                                                                                                              \
    }
KT_SHIFTS(kt_real1, )

#ifndef KT_LANES

KT_SHIFTS(kt_v4, _of4)

/* ---- inertias, by columns ---------------------------------------------------------------------------------------- */

/* The 6 x 6 matrix [J H; G M] of an articulated inertia, by columns; H = G'. */
KT_INLINE void kt_inertia_to_matrix(const kt_articulated *x, double *to) {
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++) {
            to[6 * c + r] = x->j[c][r];
            to[6 * c + 3 + r] = x->g[c][r];
            to[6 * (c + 3) + r] = x->g[r][c];
            to[6 * (c + 3) + 3 + r] = x->m[c][r];
        }
}

/* The bias wrench becomes zero. */
KT_INLINE void kt_inertia_from_mat3(const double *from, kt_articulated *x) {
    for (int c = 0; c < 3; c++) {
        const double *a = from + 6 * c, *l = from + 6 * (c + 3) + 3;
        x->j[c] = (kt_v4){a[0], a[1], a[2], 0.0};
        x->g[c] = (kt_v4){a[3], a[4], a[5], 0.0};
        x->m[c] = (kt_v4){l[0], l[1], l[2], 0.0};
    }
    x->moment = x->force = kt_v4_splat(0.0);
}

KT_INLINE void kt_planar_inertia_to_matrix(const kt_planar_inertia *x, double *to) {
    const double all[9] = {x->j, x->h[0], x->h[1], x->h[0], x->xx, x->xy, x->h[1], x->xy, x->yy};
    memcpy(to, all, sizeof all);
}

/* The bias wrench becomes zero. */
KT_INLINE kt_planar_inertia kt_planar_inertia_from_mat3(const double *from) {
    return (kt_planar_inertia){.j = from[0], .h = {from[1], from[2]}, .xx = from[4], .xy = from[5], .yy = from[8]};
}

#endif

#endif
