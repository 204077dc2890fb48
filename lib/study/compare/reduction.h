/* Reductions that serve comparison with QR decomposition. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STUDY_REDUCTION_H
#define KT_STUDY_REDUCTION_H

#include "reduction/method.h"

#include <string.h>

KT_REDUCTION_EXTERN(kt_reduction_svd)
KT_REDUCTION_EXTERN(kt_reduction_eigen)
KT_REDUCTION_EXTERN(kt_reduction_partition)

/* The basis of the null space where its vectors are the last columns of `square`; without equations all coordinates are
 * free. */
static inline void kt_square_basis(const kt_group_work *w, int rank) {
    const size_t m = (size_t)w->m, r = (size_t)rank;
    if (w->k > 0) {
        memcpy(w->basis, w->square + r * m, m * (m - r) * sizeof(double));
        if (w->unit)
            kt_group_scale_basis(w, rank);
        return;
    }
    memset(w->basis, 0, m * m * sizeof(double));
    for (size_t i = 0; i < m; i++)
        w->basis[i * m + i] = 1.0;
}

/* The size of direction i: a singular value. */
static inline double kt_singular_value_of(const kt_group_work *w, int i) { return kt_group_singular_values(w)[i]; }

#endif
