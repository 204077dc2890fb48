/* Products of small matrices. A tile of rows is summed in registers over all columns, in their order, so that results
 * have the same bits whatever the width of the registers. */
#include "algebra/lane.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* Rows first .. first + 7 of M, in two vectors a column; zeros below the last row. */
KT_INLINE void copy_tile(size_t n, size_t first, const double *m, kt_v4 *tile) {
    for (size_t k = 0; k < n; k++, tile += 2) {
        tile[0] = tile[1] = kt_v4_splat(0.0);
        for (size_t l = first; l < n && l < first + KT_PRODUCT_TILE; l++)
            tile[(l - first) / 4][(l - first) % 4] = m[k * n + l];
    }
}

KT_INLINE void add_columns(size_t n, const kt_v4 *tile, const double *x, kt_v4 sum[2]) {
    for (size_t k = 0; k < n; k++) {
        const kt_v4 xk = kt_v4_splat(x[k]);
        sum[0] += tile[2 * k] * xk;
        sum[1] += tile[2 * k + 1] * xk;
    }
}

KT_INLINE void add_rows(kt_v4 sum, size_t rows, double *y) {
    kt_v4 old;
    if (rows >= 4) {
        memcpy(&old, y, sizeof old);
        old += sum;
        memcpy(y, &old, sizeof old);
        return;
    }
    for (size_t l = 0; l < rows; l++)
        y[l] += sum[l];
}

void KT_KERNEL(kt_product)(size_t n, const double *a, const double *b, double *scratch, size_t columns, size_t stride,
                           const double *x, const double *z, double *y) {
    kt_v4 *tile = (kt_v4 *)(void *)scratch;
    for (size_t first = 0; first < n; first += KT_PRODUCT_TILE) {
        copy_tile(n, first, a, tile);
        copy_tile(n, first, b, tile + 2 * n);
        for (size_t j = 0; j < columns; j++) {
            kt_v4 sum[2] = {kt_v4_splat(0.0), kt_v4_splat(0.0)};
            double *to = y + j * stride + first;
            add_columns(n, tile, x + j * stride, sum);
            add_columns(n, tile + 2 * n, z + j * stride, sum);
            add_rows(sum[0], n - first, to);
            if (n > first + 4)
                add_rows(sum[1], n - first - 4, to + 4);
        }
    }
}
