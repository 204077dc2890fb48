/* Small dense matrices, column-major: products, and Cholesky's factors. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_CHOLESKY_H
#define KT_LINEAR_CHOLESKY_H

#include "algebra/real.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>

/* y = a x for an m x n matrix */
static inline void kt_dense_apply(const kt_real1 *a, int m, int n, const kt_real1 *x, kt_real1 *y) {
    assert(m >= 0 && n >= 0);
    assert((uintptr_t)(y + m) <= (uintptr_t)x || (uintptr_t)(x + n) <= (uintptr_t)y);
    for (int i = 0; i < m; i++)
        y[i] = kt_real1_splat(0.0);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++)
            y[i] += a[(size_t)j * (size_t)m + (size_t)i] * x[j];
}

KT_INLINE kt_real1 kt_dense_dot(const kt_real1 *a, const kt_real1 *b, int n) {
    kt_real1 sum = kt_real1_splat(0.0);
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* A = L L': L replaces the lower triangle of A (n x n in columns `stride` numbers apart), which alone is read. Returns
 * false if A is not positive definite beyond rounding errors, which are proportional to size[j] in A_jj (NULL: to A_jj
 * itself). */
KT_INLINE kt_condition kt_dense_cholesky(kt_real1 *a, size_t stride, int n, const kt_real1 *size) {
    assert(n >= 0 && stride >= (size_t)n);
    kt_condition positive = kt_condition_true();
    for (int j = 0; j < n; j++) {
        kt_real1 *column = a + (size_t)j * stride;
        const kt_real1 whole = size ? size[j] : column[j];
        for (int k = 0; k < j; k++) {
            const kt_real1 f = a[(size_t)k * stride + (size_t)j];
            for (int i = j; i < n; i++)
                column[i] -= a[(size_t)k * stride + (size_t)i] * f;
        }
        if (kt_fails(&positive, column[j] > 1e-14 * whole))
            return kt_condition_false();
        const kt_real1 d = 1.0 / kt_sqrt1(column[j]);
        for (int i = j; i < n; i++)
            column[i] *= d;
    }
    return positive;
}

/* Adds a row to a Cholesky factor L of n rows, which are `stride` numbers apart. On entry, row n of L has the products
 * of the new row with earlier rows; on return, the row of the factor without its diagonal. own: the product of the new
 * row with itself. Returns the square of the diagonal, which is of the size of rounding if the new row depends on
 * earlier rows. */
static inline double kt_cholesky_add_row(double *L, ptrdiff_t stride, int n, double own) {
    assert(n >= 0 && (stride >= n || stride <= -n)); /* row n has n numbers */
    double *row = L + n * stride;
    for (int j = 0; j < n; j++) {
        const double *other = L + j * stride;
        double sum = row[j];
        for (int k = 0; k < j; k++)
            sum -= row[k] * other[k];
        row[j] = sum / other[j];
        own -= row[j] * row[j];
    }
    return own;
}

/* x = (L L')^-1 x */
KT_INLINE void kt_dense_solve(const kt_real1 *l, int n, kt_real1 *x) {
    assert(n >= 0);
    assert((uintptr_t)(x + n) <= (uintptr_t)l || (uintptr_t)(l + (size_t)n * (size_t)n) <= (uintptr_t)x);
    for (int j = 0; j < n; j++) {
        x[j] /= l[(size_t)j * (size_t)(n + 1)];
        for (int i = j + 1; i < n; i++)
            x[i] -= l[(size_t)j * (size_t)n + (size_t)i] * x[j];
    }
    for (int j = n - 1; j >= 0; j--) {
        for (int i = j + 1; i < n; i++)
            x[j] -= l[(size_t)j * (size_t)n + (size_t)i] * x[i];
        x[j] /= l[(size_t)j * (size_t)(n + 1)];
    }
}

#endif
