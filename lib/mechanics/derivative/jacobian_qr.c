/* One QR decomposition of all loops' equations, like the decomposition of a group in
 * lib/mechanics/reduction/qr_method.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/jacobian_qr.h"

#include "linear/cholesky.h"
#include "linear/qr.h"

#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_jacobian_qr, KT_JACOBIAN_QR_FIELDS, size_t n, size_t p)

size_t kt_jacobian_qr_init(kt_jacobian_qr *w, void *memory, size_t n, size_t p) {
    if (memory)
        *w = (kt_jacobian_qr){.n = n, .p = p};
    return place_arrays(w, memory, n, p);
}

kt_status kt_jacobian_singular(kt_error *error) {
    return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                        "fewer equations of the loops are independent here than elsewhere");
}

/* The weights by which evaluations choose among dependent equations of a kind (group.h); zero for vanishing equations.
 * Returns the rank. */
static int weight_equations(kt_jacobian_qr *w, const kt_model *model, kt_rows rows) {
    int rank = 0;
    memset(w->weight, 0, w->p * sizeof *w->weight);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const double *weight = model->weight + (size_t)rows * model->n.row + group->row;
        rank += group->rank[rows];
        kt_rows_scatter(model, group, group->count[rows], weight, w->weight);
    }
    return rank;
}

static kt_qr qr_of(const kt_jacobian_qr *w) {
    return (kt_qr){
        .m = (int)w->n, .k = (int)w->p, .factor = w->factor, .reflector_scale = w->reflector_scale, .pivot = w->pivot};
}

/* basis = Q, column by column. H_j does not change rows before j, and therefore no unit vector c < j. */
static void write_orthogonal_basis(const kt_jacobian_qr *w) {
    const size_t n = w->n;
    memset(w->basis, 0, n * n * sizeof *w->basis);
    for (size_t c = 0; c < n; c++) {
        w->basis[c * n + c] = 1.0;
        for (int j = (int)c < w->rank ? (int)c : w->rank - 1; j >= 0; j--)
            kt_reflect(w->factor + (size_t)j * n, w->reflector_scale[j], j, (int)n, w->basis + c * n);
    }
}

kt_status kt_jacobian_qr_factor(kt_jacobian_qr *w, const kt_model *model, kt_rows rows, const double *a,
                                kt_error *error) {
    const size_t n = w->n, p = w->p;
    const kt_qr qr = qr_of(w);
    w->rank = weight_equations(w, model, rows);
    for (size_t r = 0; r < p; r++) {
        for (size_t i = 0; i < n; i++)
            w->factor[r * n + i] = w->weight[r] * a[i * p + r];
        w->pivot[r] = (int32_t)r;
        w->norm[r] = kt_dense_dot(w->factor + r * n, w->factor + r * n, (int)n);
    }
    for (int j = 0; j < w->rank; j++) {
        double all;
        const int best = kt_longest_column(w->norm, j, (int)p, &all);
        if (!(w->norm[best] > 0.0 && isfinite(all)))
            return kt_jacobian_singular(error);
        kt_qr_step(&qr, (int)n, j, best, w->norm);
    }
    kt_qr_unweight(&qr, (int)n, w->rank, w->weight);
    write_orthogonal_basis(w);
    return KT_OK;
}

void kt_jacobian_qr_solve_lower(const kt_jacobian_qr *w, const double *e, double *y) {
    const kt_qr qr = qr_of(w);
    kt_qr_solve_transposed(&qr, (int)w->n, w->rank, e, y);
}

void kt_jacobian_qr_multipliers(const kt_jacobian_qr *w, const double *f, double *lambda) {
    const kt_qr qr = qr_of(w);
    double *y = w->norm; /* no longer needed */
    for (int k = 0; k < w->rank; k++)
        y[k] = kt_dense_dot(w->basis + (size_t)k * w->n, f, (int)w->n);
    kt_qr_solve(&qr, (int)w->n, w->rank, y);
    memset(lambda, 0, w->p * sizeof *lambda);
    for (int k = 0; k < w->rank; k++)
        lambda[w->pivot[k]] = y[k];
}
