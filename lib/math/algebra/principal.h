/* Principal axes of an inertia, for set-up and pictures. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_PRINCIPAL_H
#define KT_ALGEBRA_PRINCIPAL_H

#include "kinetree/algebra.h"

#include <math.h>

/* The eigenvectors of a symmetric matrix as columns, by Jacobi rotations. */
static inline kt_mat3 kt_principal_axes(kt_sym3 s) {
    double a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    kt_mat3 axes = kt_mat3_identity();
    for (int sweep = 0; sweep < 30; sweep++)
        for (int k = 0; k < 3; k++) {
            const int p = k, q = (k + 1) % 3, r = (k + 2) % 3;
            if (a[p][q] == 0.0)
                continue;
            const double pp = a[p][p], qq = a[q][q], pq = a[p][q], pr = a[p][r], qr = a[q][r];
            const double angle = 0.5 * atan2(qq >= pp ? 2.0 * pq : -2.0 * pq, fabs(qq - pp)); /* up to 45 degrees */
            const double c = cos(angle), n = sin(angle);
            kt_vec3 *columns[] = {&axes.x, &axes.y, &axes.z};
            const kt_vec3 u = *columns[p], v = *columns[q];
            a[p][p] = c * c * pp - 2.0 * n * c * pq + n * n * qq;
            a[q][q] = n * n * pp + 2.0 * n * c * pq + c * c * qq;
            a[p][q] = a[q][p] = 0.0;
            a[p][r] = a[r][p] = c * pr - n * qr;
            a[q][r] = a[r][q] = n * pr + c * qr;
            *columns[p] = kt_vec3_sub(kt_vec3_scale(c, u), kt_vec3_scale(n, v));
            *columns[q] = kt_vec3_add(kt_vec3_scale(n, u), kt_vec3_scale(c, v));
        }
    return axes;
}

#endif
