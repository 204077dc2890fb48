/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lu.h"

#include <math.h>

static void exchange_entries(double *a, double *b) {
    const double kept = *a;
    *a = *b;
    *b = kept;
}

/* ---- real -------------------------------------------------------------------------------------------------------- */

static size_t find_largest_entry(const double *column, size_t from, size_t n) {
    size_t best = from;
    for (size_t i = from + 1; i < n; i++)
        if (fabs(column[i]) > fabs(column[best]))
            best = i;
    return best;
}

/* y -= x u, entries first .. last - 1. */
static inline void subtract_real(double *restrict y, const double *restrict x, double u, size_t first, size_t last) {
    for (size_t i = first; i < last; i++)
        y[i] -= x[i] * u;
}

bool kt_lu_factor(double *a, size_t n, int *pivot) {
    for (size_t k = 0; k < n; k++) {
        double *l = a + k * n;
        const size_t p = find_largest_entry(l, k, n);
        pivot[k] = (int)p;
        if (!(fabs(l[p]) > 0.0) || !isfinite(l[p]))
            return false;
        for (size_t j = 0; j < n && p != k; j++)
            exchange_entries(&a[j * n + k], &a[j * n + p]);
        const double r = 1.0 / l[k];
        l[k] = r;
        for (size_t i = k + 1; i < n; i++)
            l[i] *= r;
        for (size_t j = k + 1; j < n; j++) {
            double *column = a + j * n;
            if (column[k] != 0.0)
                subtract_real(column, l, column[k], k + 1, n);
        }
    }
    return true;
}

void kt_lu_solve(const double *a, size_t n, const int *pivot, double *b) {
    for (size_t k = 0; k < n; k++)
        exchange_entries(&b[k], &b[pivot[k]]);
    for (size_t k = 0; k < n; k++)
        subtract_real(b, a + k * n, b[k], k + 1, n);
    for (size_t k = n; k-- > 0;) {
        b[k] *= a[k * n + k];
        subtract_real(b, a + k * n, b[k], 0, k);
    }
}

/* A' = U' L' P: forward with U', backward with L', and the exchanges in reverse. */
void kt_lu_solve_transposed(const double *a, size_t n, const int *pivot, double *b) {
    for (size_t k = 0; k < n; k++) {
        for (size_t i = 0; i < k; i++)
            b[k] -= a[k * n + i] * b[i];
        b[k] *= a[k * n + k];
    }
    for (size_t k = n; k-- > 0;)
        for (size_t i = k + 1; i < n; i++)
            b[k] -= a[k * n + i] * b[i];
    for (size_t k = n; k-- > 0;)
        exchange_entries(&b[k], &b[pivot[k]]);
}

/* ---- complex ----------------------------------------------------------------------------------------------------- */

/* |re| + |im|, as LAPACK chooses pivots. */
static size_t largest_complex(const double *re, const double *im, size_t from, size_t n) {
    size_t best = from;
    for (size_t i = from + 1; i < n; i++)
        if (fabs(re[i]) + fabs(im[i]) > fabs(re[best]) + fabs(im[best]))
            best = i;
    return best;
}

/* y -= x (u_re + i u_im), entries first .. last - 1. */
static inline void subtract_complex_multiple(double *restrict y_re, double *restrict y_im, const double *restrict x_re,
                                             const double *restrict x_im, double u_re, double u_im, size_t first,
                                             size_t last) {
    for (size_t i = first; i < last; i++) {
        y_re[i] -= x_re[i] * u_re - x_im[i] * u_im;
        y_im[i] -= x_re[i] * u_im + x_im[i] * u_re;
    }
}

static inline void multiply_by_complex(double *re, double *im, double by_re, double by_im) {
    const double x = *re * by_re - *im * by_im;
    *im = *re * by_im + *im * by_re;
    *re = x;
}

bool kt_lu_factor_complex(double *re, double *im, size_t n, int *pivot) {
    for (size_t k = 0; k < n; k++) {
        double *l_re = re + k * n, *l_im = im + k * n;
        const size_t p = largest_complex(l_re, l_im, k, n);
        pivot[k] = (int)p;
        const double square = l_re[p] * l_re[p] + l_im[p] * l_im[p];
        if (!(square > 0.0) || !isfinite(square))
            return false;
        for (size_t j = 0; j < n && p != k; j++) {
            exchange_entries(&re[j * n + k], &re[j * n + p]);
            exchange_entries(&im[j * n + k], &im[j * n + p]);
        }
        const double r_re = l_re[k] / square, r_im = -l_im[k] / square;
        l_re[k] = r_re;
        l_im[k] = r_im;
        for (size_t i = k + 1; i < n; i++)
            multiply_by_complex(&l_re[i], &l_im[i], r_re, r_im);
        for (size_t j = k + 1; j < n; j++)
            subtract_complex_multiple(re + j * n, im + j * n, l_re, l_im, re[j * n + k], im[j * n + k], k + 1, n);
    }
    return true;
}

void kt_lu_solve_complex(const double *re, const double *im, size_t n, const int *pivot, double *b_re, double *b_im) {
    for (size_t k = 0; k < n; k++) {
        exchange_entries(&b_re[k], &b_re[pivot[k]]);
        exchange_entries(&b_im[k], &b_im[pivot[k]]);
    }
    for (size_t k = 0; k < n; k++)
        subtract_complex_multiple(b_re, b_im, re + k * n, im + k * n, b_re[k], b_im[k], k + 1, n);
    for (size_t k = n; k-- > 0;) {
        multiply_by_complex(&b_re[k], &b_im[k], re[k * n + k], im[k * n + k]);
        subtract_complex_multiple(b_re, b_im, re + k * n, im + k * n, b_re[k], b_im[k], 0, k);
    }
}
