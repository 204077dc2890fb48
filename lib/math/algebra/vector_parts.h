/* Parts and multiples of vectors and matrices, by index. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_VECTOR_PARTS_H
#define KT_ALGEBRA_VECTOR_PARTS_H

#include "kinetree/algebra.h"

#include <stdbool.h>

static inline double kt_vec3_part(kt_vec3 a, int k) { return k == 0 ? a.x : k == 1 ? a.y : a.z; }
static inline kt_vec3 kt_mat3_column(kt_mat3 m, int k) { return k == 0 ? m.x : k == 1 ? m.y : m.z; }

static inline bool kt_mat3_is_same(kt_mat3 a, kt_mat3 b) {
    return a.x.x == b.x.x && a.y.y == b.y.y && a.z.z == b.z.z && a.x.y == b.x.y && a.x.z == b.x.z && a.y.x == b.y.x &&
           a.y.z == b.y.z && a.z.x == b.z.x && a.z.y == b.z.y;
}

/* s S */
static inline kt_sym3 kt_sym3_scaled(double s, kt_sym3 a) {
    return kt_sym3_make(s * a.xx, s * a.yy, s * a.zz, s * a.xy, s * a.xz, s * a.yz);
}

#endif
