/* Products of small matrices. A tile of rows is summed in registers over all columns of M, in their order, so that results
 * have the same bits whatever the width of the registers. Columns of X begin as unit vectors: their zeros are skipped. */
#include "sensitivity/sensitivity.h"

static void copy_tiles(size_t n, const double *m, double *tiles) {
    for (size_t first = 0; first < n; first += KT_PRODUCT_TILE)
        for (size_t k = 0; k < n; k++)
            for (size_t l = 0; l < KT_PRODUCT_TILE; l++)
                *tiles++ = first + l < n ? m[k * n + first + l] : 0.0;
}

void KT_KERNEL(kt_product)(size_t n, const double *m, double *tiles, size_t columns, size_t stride, const double *x,
                           double *y) {
    copy_tiles(n, m, tiles);
    for (size_t first = 0; first < n; first += KT_PRODUCT_TILE) {
        const double *tile = tiles + first * n;
        const size_t rows = n - first < KT_PRODUCT_TILE ? n - first : KT_PRODUCT_TILE;
        for (size_t j = 0; j < columns; j++) {
            double sum[KT_PRODUCT_TILE] = {0.0};
            const double *of = x + j * stride;
            double *to = y + j * stride + first;
            for (size_t k = 0; k < n; k++) {
                const double xk = of[k];
                if (xk == 0.0)
                    continue;
                for (int l = 0; l < KT_PRODUCT_TILE; l++)
                    sum[l] += tile[k * KT_PRODUCT_TILE + (size_t)l] * xk;
            }
            for (size_t l = 0; l < rows; l++)
                to[l] += sum[l];
        }
    }
}
