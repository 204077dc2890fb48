/* Coordinate partitioning [MSD 7.1.1]: full pivoting chooses dependent coordinates, which are solved for.
 *
 * Gaussian elimination on A' (m x k) with rows (coordinates) and columns (equations) exchanged:
 *   P A' S = [L11; L21] [U11 U12],   L unit lower, U upper triangular
 *
 *   particular:  the independent coordinates are zero; U11' L11' x_d = b_1
 *   basis:       x_i = unit vectors, x_d = -L11'^-1 L21' x_i
 *   multipliers: L11 U11 lambda = g_d
 *
 * The dependent coordinates are chosen anew at every evaluation. A position at which a fixed choice would fail (the
 * pendulum in x and y, horizontal or vertical) is then like any other. The result does not depend on earlier
 * evaluations. The order of the coordinates is stored in `square`.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/reduction.h"
#include "reduction/maggi_kane.h"

#include <limits.h>
#include <math.h>
#include <string.h>

static double *partition_entry(const kt_group_work *w, int row, int column) {
    return &w->factor[(size_t)column * (size_t)w->m + (size_t)row];
}

/* Exchanges the coordinates in rows a and b. */
static void swap_partition_rows(const kt_group_work *w, int a, int b) {
    for (int c = 0; c < w->k; c++) {
        const double t = *partition_entry(w, a, c);
        *partition_entry(w, a, c) = *partition_entry(w, b, c);
        *partition_entry(w, b, c) = t;
    }
    const double t = w->square[a];
    w->square[a] = w->square[b];
    w->square[b] = t;
}

/* Exchanges the equations a and b, and their pivots. */
static void swap_columns(const kt_group_work *w, int a, int b) {
    for (int i = 0; i < w->m; i++) {
        const double t = *partition_entry(w, i, a);
        *partition_entry(w, i, a) = *partition_entry(w, i, b);
        *partition_entry(w, i, b) = t;
    }
    const int32_t t = w->pivot[a];
    w->pivot[a] = w->pivot[b];
    w->pivot[b] = t;
}

/* square[i] is the coordinate in row i. */
static int eliminate_partition(const kt_group_work *w, int cap) {
    for (int i = 0; i < w->m; i++)
        w->square[i] = i;
    for (int c = 0; c < w->k; c++) {
        w->pivot[c] = c;
        for (int i = 0; i < w->m; i++)
            *partition_entry(w, i, c) = (w->weight ? w->weight[c] : 1.0) * w->a[(size_t)c * (size_t)w->m + (size_t)i];
        if (w->unit)
            kt_group_scale_equation(w, c, partition_entry(w, 0, c));
    }
    double first = 0.0;
    for (int j = 0; j < cap; j++) {
        int row = j, column = j;
        for (int c = j; c < w->k; c++)
            for (int i = j; i < w->m; i++) {
                if (!isfinite(*partition_entry(w, i, c)))
                    return -1;
                if (fabs(*partition_entry(w, i, c)) > fabs(*partition_entry(w, row, column))) {
                    row = i;
                    column = c;
                }
            }
        const double pivot = fabs(*partition_entry(w, row, column));
        if (j == 0)
            first = kt_larger(pivot, w->least);
        if (!(pivot > w->tolerance * first))
            return j;
        if (row != j)
            swap_partition_rows(w, row, j);
        if (column != j)
            swap_columns(w, column, j);
        for (int i = j + 1; i < w->m; i++) {
            const double l = *partition_entry(w, i, j) / *partition_entry(w, j, j);
            *partition_entry(w, i, j) = l;
            for (int c = j + 1; c < w->k; c++)
                *partition_entry(w, i, c) -= l * *partition_entry(w, j, c);
        }
    }
    return cap;
}

/* The weights (group.h) are divided out of U again: A' W S = P' L U W. */
static int factor_partition(kt_group_work *w, int cap) {
    const int rank = eliminate_partition(w, cap);
    for (int c = 0; c < rank && w->weight; c++)
        for (int i = 0; i <= c; i++)
            *partition_entry(w, i, c) /= w->weight[w->pivot[c]];
    if (w->unit)
        kt_group_unscale_columns(w, rank);
    return rank;
}

/* x (first `rank` rows) = L11'^-1 x */
static void solve_lower_transposed(const kt_group_work *w, int rank, double *x) {
    for (int i = rank - 1; i >= 0; i--)
        for (int j = i + 1; j < rank; j++)
            x[i] -= *partition_entry(w, j, i) * x[j];
}

/* The solution of A x = b whose independent coordinates are 0, from the triangular factors of the dependent columns. */
static inline void partition_particular(const kt_group_work *w, int rank, const double *b, double *x) {
    double *y = w->work;
    for (int i = 0; i < rank; i++) {
        y[i] = b[w->pivot[i]];
        for (int j = 0; j < i; j++)
            y[i] -= *partition_entry(w, j, i) * y[j];
        y[i] /= *partition_entry(w, i, i);
    }
    solve_lower_transposed(w, rank, y);
    for (int i = 0; i < w->m; i++)
        x[(int)w->square[i]] = i < rank ? y[i] : 0.0;
    if (w->unit)
        kt_group_scale_coordinates(w, x);
}

/* The null space of A: the column of an independent coordinate has 1 there and the motions of the dependent
 * coordinates. */
static inline void partition_basis(const kt_group_work *w, int rank) {
    const size_t m = (size_t)w->m;
    double *y = w->work;
    memset(w->basis, 0, m * (m - (size_t)rank) * sizeof(double));
    for (int c = rank; c < w->m; c++) {
        double *column = w->basis + (size_t)(c - rank) * m;
        for (int i = 0; i < rank; i++)
            y[i] = -*partition_entry(w, c, i);
        solve_lower_transposed(w, rank, y);
        for (int i = 0; i < rank; i++)
            column[(int)w->square[i]] = y[i];
        column[(int)w->square[c]] = 1.0;
    }
    if (w->unit)
        kt_group_scale_basis(w, rank);
}

/* Solves A' lambda = g in the dependent coordinates. */
static void partition_multipliers(const kt_group_work *w, int rank, double *g, double *lambda) {
    double *y = w->work;
    if (w->unit)
        kt_group_scale_coordinates(w, g);
    for (int i = 0; i < rank; i++) {
        y[i] = g[(int)w->square[i]];
        for (int j = 0; j < i; j++)
            y[i] -= *partition_entry(w, i, j) * y[j];
    }
    for (int i = rank - 1; i >= 0; i--) {
        for (int j = i + 1; j < rank; j++)
            y[i] -= *partition_entry(w, i, j) * y[j];
        y[i] /= *partition_entry(w, i, i);
    }
    for (int i = 0; i < w->k; i++)
        lambda[w->pivot[i]] = i < rank ? y[i] : 0.0;
}

static bool solve_by_partition(const kt_group_work *w, int rank, int width) {
    return kt_group_solve(partition_particular, partition_basis, w, rank, width);
}

static double partition_size(const kt_group_work *w, int i) { return fabs(*partition_entry(w, i, i)); }

const kt_reduction_kind KT_KERNEL(kt_reduction_partition) = {.chooses = true,
                                                             .large = INT_MAX,
                                                             .factor = factor_partition,
                                                             .size = partition_size,
                                                             .particular = partition_particular,
                                                             .basis = partition_basis,
                                                             .solve = solve_by_partition,
                                                             .multipliers = partition_multipliers};
