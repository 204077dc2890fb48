/* Small dense matrices, column-major: products, and Cholesky's factors. */
#ifndef KT_LINEAR_CHOLESKY_H
#define KT_LINEAR_CHOLESKY_H

#include "algebra/lane.h"

#include <math.h>

/* y = a x for an m x n matrix */
static inline void kt_dense_apply(const double *a, int m, int n, const double *x, double *y) {
    for (int i = 0; i < m; i++)
        y[i] = 0.0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++)
            y[i] += a[(size_t)j * (size_t)m + (size_t)i] * x[j];
}

KT_INLINE double kt_dense_dot(const double *a, const double *b, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* A = L L': L replaces the lower triangle of A (n x n in columns `stride` numbers apart), which alone is read. Returns
 * false if A is not positive definite beyond rounding errors, which are proportional to size[j] in A_jj (NULL: to A_jj
 * itself). */
KT_INLINE bool kt_dense_cholesky_within(double *a, size_t stride, int n, const double *size) {
    for (int j = 0; j < n; j++) {
        double *column = a + (size_t)j * stride;
        const double whole = size ? size[j] : column[j];
        for (int k = 0; k < j; k++) {
            const double f = a[(size_t)k * stride + (size_t)j];
            for (int i = j; i < n; i++)
                column[i] -= a[(size_t)k * stride + (size_t)i] * f;
        }
        if (!(column[j] > 1e-14 * whole))
            return false;
        const double d = 1.0 / sqrt(column[j]);
        for (int i = j; i < n; i++)
            column[i] *= d;
    }
    return true;
}

/* The same of a matrix that is stored as a whole. */
KT_INLINE bool kt_dense_cholesky(double *a, int n, const double *size) {
    return kt_dense_cholesky_within(a, (size_t)n, n, size);
}

/* x = (L L')^-1 x */
KT_INLINE void kt_dense_solve(const double *l, int n, double *x) {
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
