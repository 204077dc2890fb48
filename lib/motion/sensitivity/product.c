/* Products, sums and solutions of small matrices, whose columns are padded to whole vectors. A tile of rows is summed
 * in registers, over all columns of A and then of B, in their order. Therefore results have the same bits for every
 * width of the registers. Several columns are computed together, since each column waits for its own sums. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sensitivity/sensitivity.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

enum { AT_ONCE = 4 /* columns */ };

/* Rows first .. first + 7 of M, a vector a column; zeros below the last row. */
KT_INLINE void copy_tile(size_t n, size_t first, const double *m, kt_v8 *tile) {
    const size_t rows = n - first < KT_LANES ? n - first : KT_LANES;
    for (size_t k = 0; k < n; k++) {
        tile[k] = (kt_v8){0.0};
        memcpy(&tile[k], m + k * n + first, rows * sizeof *m);
    }
}

/* `count` columns of a tile, count <= AT_ONCE. */
KT_INLINE void multiply(size_t n, size_t stride, size_t count, const kt_v8 *a, const kt_v8 *b, const double *x,
                        const double *z, double *y) {
    kt_v8 sum[AT_ONCE];
    for (size_t j = 0; j < count; j++)
        memcpy(&sum[j], y + j * stride, sizeof *sum);
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < count; j++)
            sum[j] += a[k] * x[j * stride + k];
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < count; j++)
            sum[j] += b[k] * z[j * stride + k];
    for (size_t j = 0; j < count; j++)
        memcpy(y + j * stride, &sum[j], sizeof *sum);
}

void KT_KERNEL(kt_product)(size_t n, const double *a, const double *b, double *scratch, size_t columns, const double *x,
                           const double *z, double *y) {
    assert((uintptr_t)scratch % _Alignof(kt_v8) == 0);
    assert(n == 0 || columns == 0 || (x != y && z != y)); /* arrays without entries share their place */
    const size_t stride = kt_padded(n);
    kt_v8 *tile = (kt_v8 *)(void *)scratch;
    for (size_t first = 0; first < n; first += KT_LANES) {
        size_t j = 0;
        copy_tile(n, first, a, tile);
        copy_tile(n, first, b, tile + n);
        for (; j + AT_ONCE <= columns; j += AT_ONCE)
            multiply(n, stride, AT_ONCE, tile, tile + n, x + j * stride, z + j * stride, y + j * stride + first);
        for (; j < columns; j++)
            multiply(n, stride, 1, tile, tile + n, x + j * stride, z + j * stride, y + j * stride + first);
    }
}

void KT_KERNEL(kt_sum)(double *out, const double *start, double h, const double *row, size_t count, const double *k,
                       size_t n) {
    assert(n % KT_LANES == 0);
    for (size_t at = 0; at < n; at += KT_LANES) {
        kt_v8 sum, x;
        memcpy(&sum, start + at, sizeof sum);
        for (size_t j = 0; j < count; j++) {
            if (row[j] == 0.0)
                continue;
            memcpy(&x, k + j * n + at, sizeof x);
            sum += h * row[j] * x;
        }
        memcpy(out + at, &sum, sizeof sum);
    }
}

/* A vector of eight numbers as four pairs, which stay in registers where wider vectors would not. */
typedef double pair __attribute__((vector_size(16)));
enum { PAIRS = KT_LANES / 2 };

/* row -= sum over `count` rows of x, starting at the first row, in steps of `next`, each times its factor. */
KT_INLINE void eliminate(pair *row, size_t count, const double *factor, ptrdiff_t stride, const pair *x,
                         ptrdiff_t next) {
    pair a = row[0], b = row[1], c = row[2], d = row[3];
    for (size_t k = 0; k < count; k++, factor += stride, x += next) {
        const pair by = {*factor, *factor};
        a -= by * x[0];
        b -= by * x[1];
        c -= by * x[2];
        d -= by * x[3];
    }
    row[0] = a, row[1] = b, row[2] = c, row[3] = d;
}

/* Solves L U x = P x for eight right-hand sides at once. The diagonal of `lu` holds reciprocals. */
void KT_KERNEL(kt_solve_lanes)(const double *lu, size_t n, const int *pivot, kt_v8 *x) {
    pair *row = (pair *)(void *)x;
    const ptrdiff_t stride = (ptrdiff_t)n;
    for (size_t k = 0; k < n; k++) {
        const kt_v8 kept = x[k];
        x[k] = x[pivot[k]];
        x[pivot[k]] = kept;
    }
    for (size_t i = 1; i < n; i++)
        eliminate(row + PAIRS * i, i, lu + i, stride, row, PAIRS);
    for (size_t i = n; i-- > 0;) {
        if (i + 1 < n)
            eliminate(row + PAIRS * i, n - 1 - i, lu + (n - 1) * n + i, -stride, row + PAIRS * (n - 1), -PAIRS);
        for (int l = 0; l < PAIRS; l++)
            row[PAIRS * i + (size_t)l] *= lu[i * n + i];
    }
}
