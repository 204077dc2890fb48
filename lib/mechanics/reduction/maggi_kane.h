/* Maggi-Kane for one group with small dense matrices.
 *
 * Among the accelerations x = x0 + N z with A x0 = b'' and A N = 0 the dynamics determine z by [MSD 7.33, 7.34]
 *   (N' M N) z = N' (tau - h - M x0 - F' A)
 * where F couples the group to the parent's acceleration A (spatial_group.h). So
 *   x = y - K A
 *   y = x0 + N (N' M N)^-1 (N' (tau - h) - (M N)' x0)      free acceleration
 *   K = N (N' M N)^-1 N' F'                                parent gain
 * Most groups have a handful of coordinates and one degree of freedom: the loops are short and free of calls.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_MAGGI_KANE_H
#define KT_REDUCTION_MAGGI_KANE_H

#include "linear/cholesky.h"
#include "reduction/method.h"

#include <assert.h>

/* From this number of coordinates on, loops run along columns, so that vector instructions process several entries. */
enum { KT_SHORT = 9 };

/* y += N (N' M N)^-1 z, or with `anew` y = N (N' M N)^-1 z; z is overwritten. */
KT_INLINE void kt_group_expand_basis(const kt_group_work *w, int dofs, bool anew, kt_real1 *z, kt_real1 *restrict y) {
    const int m = w->m;
    kt_dense_solve(w->reduced, dofs, z);
    for (int i = 0; i < m && anew; i++)
        y[i] = dofs ? w->basis[i] * z[0] : kt_real1_splat(0.0);
    for (int c = anew ? 1 : 0; c < dofs; c++) {
        const kt_real1 *restrict n = w->basis + (size_t)c * (size_t)m;
        for (int i = 0; i < m; i++)
            y[i] += n[i] * z[c];
    }
}

/* y = M x */
KT_INLINE void kt_group_apply_mass(const kt_group_work *w, const kt_real1 *x, kt_real1 *y) {
    const int m = w->m;
    if (m >= KT_SHORT)
        kt_dense_apply(w->mass, m, m, x, y);
    else
        for (int i = 0; i < m; i++)
            y[i] = kt_dense_dot(w->mass + (size_t)i * (size_t)m, x, m);
}

/* Computes the lower triangle of N' M N. The rounding error of entry cc is proportional to size[c]: n' M n may be the
 * remainder of terms n_i^2 M_ii that cancel. */
KT_INLINE void kt_group_reduce(const kt_group_work *w, int dofs, kt_real1 *size) {
    const int m = w->m;
    kt_real1 *half = w->half; /* M n */
    for (int c = 0; c < dofs; c++) {
        const kt_real1 *n = w->basis + (size_t)c * (size_t)m;
        kt_real1 sum = kt_real1_splat(0.0);
        kt_group_apply_mass(w, n, half);
        for (int i = 0; i < m; i++)
            sum += n[i] * n[i] * w->mass[i * (m + 1)];
        size[c] = sum;
        for (int r = c; r < dofs; r++)
            w->reduced[(size_t)c * (size_t)dofs + (size_t)r] = kt_dense_dot(w->basis + (size_t)r * (size_t)m, half, m);
    }
}

/* Computes y (free) and K (gain) from the factored equations with right-hand side `right`. Returns false if N' M N is
 * singular. `width`: rows of F, or 0 if the parent does not accelerate. Each kind of reduction calls this function with
 * its own functions, which are then inlined. */
KT_INLINE kt_condition kt_group_solve(kt_particular *particular, kt_basis *basis, const kt_group_work *w, int rank,
                                      int width) {
    assert(rank >= 0 && rank <= w->m);
    assert(width == 0 || width == 3 || width == 6);
    const int m = w->m, dofs = m - rank;
    kt_real1 *size = w->work, *z = w->work + m, *half = w->half;
    particular(w, rank, w->right, w->free);
    basis(w, rank);
    kt_group_reduce(w, dofs, size);
    kt_condition regular = kt_dense_cholesky(w->reduced, (size_t)dofs, dofs, size);
    if (kt_fails(&regular, regular))
        return regular;
    kt_group_apply_mass(w, w->free, half);
    for (int i = 0; i < m; i++)
        half[i] = w->bias[i] - half[i];
    for (int c = 0; c < dofs; c++)
        z[c] = kt_dense_dot(w->basis + (size_t)c * (size_t)m, half, m);
    kt_group_expand_basis(w, dofs, false, z, w->free);
    for (int c = 0; c < width; c++) {
        kt_real1 *k = w->gain + (size_t)c * (size_t)m;
        for (int r = 0; r < dofs; r++) {
            const kt_real1 *n = w->basis + (size_t)r * (size_t)m;
            kt_real1 sum = kt_real1_splat(0.0);
            for (int i = 0; i < m; i++)
                sum += n[i] * w->coupling[width * i + c];
            z[r] = sum;
        }
        kt_group_expand_basis(w, dofs, true, z, k);
    }
    return regular;
}

#ifndef KT_LANES
/* x <- x - N (N' N)^-1 N' x for x in `free`: the least of the solutions. Returns false if N' N is singular. */
static inline bool kt_group_make_least(const kt_reduction_kind *kind, const kt_group_work *w, int rank) {
    const int m = w->m, dofs = m - rank;
    double *z = w->work + m;
    kind->basis(w, rank);
    for (int c = 0; c < dofs; c++) {
        const double *n = w->basis + (size_t)c * (size_t)m;
        for (int r = c; r < dofs; r++)
            w->reduced[(size_t)c * (size_t)dofs + (size_t)r] = kt_dense_dot(n, w->basis + (size_t)r * (size_t)m, m);
        z[c] = -kt_dense_dot(n, w->free, m);
    }
    if (!kt_dense_cholesky(w->reduced, (size_t)dofs, dofs, NULL))
        return false;
    kt_group_expand_basis(w, dofs, false, z, w->free);
    return true;
}

#endif

#endif
