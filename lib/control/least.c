/* Householder's QR decomposition of one matrix, and what is solved with it. */
#include "control/least.h"

#include <string.h>

/* The entry of R. */
static double entry(const kt_least *w, int row, int column) {
    return w->qr.factor[(size_t)column * (size_t)w->qr.m + (size_t)row];
}

void kt_least_factor(kt_least *w, double could_be) {
    const int m = w->qr.m, k = w->qr.k;
    double first = could_be, all;
    for (int c = 0; c < k; c++) {
        w->qr.pivot[c] = c;
        w->norm[c] = kt_squares(w->qr.factor + (size_t)c * (size_t)m, 0, m);
    }
    for (w->rank = 0; w->rank < m && w->rank < k; w->rank++) {
        const int j = w->rank, best = kt_longest_column(w->norm, j, k, &all);
        const double size = sqrt(w->norm[best]);
        first = fmax(first, size);
        if (!(size > KT_RANK_TOLERANCE * first))
            return;
        kt_swap_columns(&w->qr, m, j, best);
        w->norm[best] = w->norm[j];
        w->norm[j] = size * size;
        kt_eliminate_column(&w->qr, m, j, w->norm);
    }
}

/* R' y = P' b, x = Q [y; 0] */
void kt_least_solve_transposed(kt_least *w, const double *b, double *x) {
    const int m = w->qr.m;
    memset(x, 0, (size_t)m * sizeof *x);
    for (int j = 0; j < w->rank; j++) {
        double sum = b[w->qr.pivot[j]];
        for (int i = 0; i < j; i++)
            sum -= entry(w, i, j) * x[i];
        x[j] = sum / entry(w, j, j);
    }
    for (int j = w->rank - 1; j >= 0; j--)
        kt_reflect(w->qr.factor + (size_t)j * (size_t)m, w->qr.reflector[j], j, m, x);
}

/* R11 y = sum, x = P [y; 0] with the entries after the rank as they stand. */
static void substitute_back(kt_least *w, double *x) {
    for (int j = w->rank - 1; j >= 0; j--) {
        double sum = w->sum[j];
        for (int i = j + 1; i < w->rank; i++)
            sum -= entry(w, j, i) * x[w->qr.pivot[i]];
        x[w->qr.pivot[j]] = sum / entry(w, j, j);
    }
}

void kt_least_solve(kt_least *w, const double *b, double *x) {
    const int m = w->qr.m;
    memcpy(w->sum, b, (size_t)m * sizeof *b);
    for (int j = 0; j < w->rank; j++)
        kt_reflect(w->qr.factor + (size_t)j * (size_t)m, w->qr.reflector[j], j, m, w->sum);
    substitute_back(w, x);
}

void kt_least_null(kt_least *w, double *z) {
    memset(z, 0, (size_t)w->qr.k * sizeof *z);
    for (int j = 0; j < w->rank; j++)
        w->sum[j] = -entry(w, j, w->rank);
    substitute_back(w, z);
    z[w->qr.pivot[w->rank]] = 1.0;
}
