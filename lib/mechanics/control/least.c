/* Householder's QR decomposition of one matrix, and the solutions with it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/least.h"

#include <string.h>

void kt_least_factor(kt_least *w, double could_be) {
    const int m = w->qr.m, k = w->qr.k;
    double first = could_be, all;
    for (int c = 0; c < k; c++) {
        const double *column = w->qr.factor + (size_t)c * (size_t)m;
        w->qr.pivot[c] = c;
        w->norm[c] = kt_dense_dot(column, column, m);
    }
    for (w->rank = 0; w->rank < m && w->rank < k; w->rank++) {
        const int j = w->rank, best = kt_longest_column(w->norm, j, k, &all);
        const double size = sqrt(w->norm[best]);
        first = fmax(first, size);
        if (!(size > KT_RANK_TOLERANCE * first))
            return;
        kt_qr_step(&w->qr, m, j, best, w->norm);
    }
}

/* R' y = P' b, x = Q [y; 0] */
void kt_least_solve_transposed(kt_least *w, const double *b, double *x) {
    const int m = w->qr.m;
    kt_qr_solve_transposed(&w->qr, m, w->rank, b, x);
    for (int i = w->rank; i < m; i++)
        x[i] = 0.0;
    for (int j = w->rank - 1; j >= 0; j--)
        kt_reflect(w->qr.factor + (size_t)j * (size_t)m, w->qr.reflector_scale[j], j, m, x);
}

/* R11 y = sum, x = P [y; 0]; the entries after the rank keep their values. */
static void substitute_back(kt_least *w, double *x) {
    kt_qr_solve(&w->qr, w->qr.m, w->rank, w->sum);
    for (int j = 0; j < w->rank; j++)
        x[w->qr.pivot[j]] = w->sum[j];
}

void kt_least_solve(kt_least *w, const double *b, double *x) {
    const int m = w->qr.m;
    memcpy(w->sum, b, (size_t)m * sizeof *b);
    for (int j = 0; j < w->rank; j++)
        kt_reflect(w->qr.factor + (size_t)j * (size_t)m, w->qr.reflector_scale[j], j, m, w->sum);
    substitute_back(w, x);
}

void kt_least_null(kt_least *w, double *z) {
    const double *column = w->qr.factor + (size_t)w->rank * (size_t)w->qr.m;
    memset(z, 0, (size_t)w->qr.k * sizeof *z);
    for (int j = 0; j < w->rank; j++)
        w->sum[j] = -column[j];
    substitute_back(w, z);
    z[w->qr.pivot[w->rank]] = 1.0;
}
