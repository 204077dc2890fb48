/* Singular value decomposition: A' = U S V', A = V S U' (Golub & Kahan 1965).
 *
 *   particular:  x = U1 S1^-1 V1' b, the least solution
 *   basis:       U2
 *   multipliers: lambda = V1 S1^-1 U1' g
 *
 * U is stored in `square`, V' in `factor` in place of A' (row i: right vector i).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/reduction.h"
#include "linear/lapack.h"
#include "reduction/maggi_kane.h"

#include <math.h>
#include <string.h>

/* A' = U S V' by LAPACK. Returns the rank, or -1 if a number is not finite. */
static int factor_svd(kt_group_work *w, int cap) {
    const size_t m = (size_t)w->m, k = (size_t)w->k;
    if (m == 0 || k == 0)
        return 0;
    for (size_t i = 0; i < m * k; i++)
        if (!isfinite(w->a[i]))
            return -1;
    memcpy(w->factor, w->a, m * k * sizeof(double));
    for (size_t c = 0; c < k; c++)
        if (w->unit)
            kt_group_scale_equation(w, (int)c, w->factor + c * m);
    if (kt_lapack_gesvd(w->m, w->k, w->factor, kt_group_singular_values(w), w->square, w->work,
                        (int)kt_group_work_count(m, k)) != 0)
        return -1;
    const double first = kt_larger(kt_group_singular_values(w)[0], w->least);
    int rank = 0;
    while (rank < cap && kt_group_singular_values(w)[rank] > w->tolerance * first)
        rank++;
    return rank;
}

/* x = U S^-1 V' b over the singular values of the rank: the least solution. */
static inline void svd_particular(const kt_group_work *w, int rank, const double *b, double *x) {
    const size_t m = (size_t)w->m;
    memset(x, 0, m * sizeof(double));
    for (int i = 0; i < rank; i++) {
        double y = 0.0;
        for (int c = 0; c < w->k; c++)
            y += w->factor[(size_t)c * m + (size_t)i] * (w->unit ? b[c] / w->scale[c] : b[c]);
        y /= kt_group_singular_values(w)[i];
        for (size_t j = 0; j < m; j++)
            x[j] += w->square[(size_t)i * m + j] * y;
    }
    if (w->unit)
        kt_group_scale_coordinates(w, x);
}

/* lambda = V S^-1 U' g over the singular values of the rank. */
static void svd_multipliers(const kt_group_work *w, int rank, double *g, double *lambda) {
    const size_t m = (size_t)w->m;
    memset(lambda, 0, (size_t)w->k * sizeof(double));
    if (w->unit)
        kt_group_scale_coordinates(w, g);
    for (int i = 0; i < rank; i++) {
        double y = 0.0;
        for (size_t j = 0; j < m; j++)
            y += w->square[(size_t)i * m + j] * g[j];
        y /= kt_group_singular_values(w)[i];
        for (int c = 0; c < w->k; c++)
            lambda[c] += w->factor[(size_t)c * m + (size_t)i] * y;
    }
    for (int c = 0; c < w->k && w->unit; c++)
        lambda[c] /= w->scale[c];
}

static bool solve_by_svd(const kt_group_work *w, int rank, int width) {
    return kt_group_solve(svd_particular, kt_square_basis, w, rank, width);
}

const kt_reduction_kind KT_KERNEL(kt_reduction_svd) = {.least = true,
                                                       .open = kt_lapack_open,
                                                       .factor = factor_svd,
                                                       .size = kt_singular_value_of,
                                                       .particular = svd_particular,
                                                       .basis = kt_square_basis,
                                                       .solve = solve_by_svd,
                                                       .multipliers = svd_multipliers};
