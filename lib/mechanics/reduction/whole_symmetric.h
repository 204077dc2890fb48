/* Symmetric matrices with all their elements, for the links of several states that carry constraint groups in space.
 *
 * For several states algebra/real3.h has only the elements on and below the diagonal. A group passes the matrix Ic - F
 * K (spatial_group.h) on to a link in space. This matrix is symmetric only to rounding, and for one state both halves
 * are stored. This header is included before the headers of the recursion, so that the recursion is compiled with the
 * operations below. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_WHOLE_SYMMETRIC_H
#define KT_REDUCTION_WHOLE_SYMMETRIC_H

#ifdef KT_LANES

#include "algebra/real3.h"

KT_OPERATOR void kt_whole3_mirror(kt_real3 a[3]) {
    a[1].x = a[0].y;
    a[2].x = a[0].z;
    a[2].y = a[1].z;
}

KT_OPERATOR void kt_whole3_columns(const kt_real3 a[3], kt_real3 out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = a[k];
}

KT_OPERATOR void kt_whole3_add(kt_real3 a[3], const kt_real3 b[3]) {
    for (int k = 0; k < 3; k++)
        a[k] = kt_add3(a[k], b[k]);
}

/* A += B + B' */
KT_OPERATOR void kt_whole3_add_both(kt_real3 a[3], const kt_real3 b[3]) {
    a[0] = kt_add3(a[0], kt_add3(b[0], kt_make3(b[0].x, b[1].x, b[2].x)));
    a[1] = kt_add3(a[1], kt_add3(b[1], kt_make3(b[0].y, b[1].y, b[2].y)));
    a[2] = kt_add3(a[2], kt_add3(b[2], kt_make3(b[0].z, b[1].z, b[2].z)));
}

/* A -= d u u' */
KT_OPERATOR void kt_whole3_subtract_square(kt_real3 a[3], kt_real1 d, kt_real3 u) {
    a[0] = kt_sub_scaled3(a[0], d, kt_scale3(u.x, u));
    a[1] = kt_sub_scaled3(a[1], d, kt_scale3(u.y, u));
    a[2] = kt_sub_scaled3(a[2], d, kt_scale3(u.z, u));
}

KT_OPERATOR kt_real3 kt_whole3_apply(const kt_real3 a[3], kt_real3 u) { return kt_apply3(a, u); }

#define kt_symmetric3_mirror kt_whole3_mirror
#define kt_symmetric3_columns kt_whole3_columns
#define kt_symmetric3_add kt_whole3_add
#define kt_symmetric3_add_both kt_whole3_add_both
#define kt_symmetric3_subtract_square kt_whole3_subtract_square
#define kt_symmetric3_apply kt_whole3_apply

#endif

#endif
