/* The zero-eigenvalue method [MSD 7.1.3; W. C. Walton, E. C. Steeves, NASA TR R-326, 1969]: A'A = U L U' (m x m). The
 * eigenvectors of its zero eigenvalues span the null space of A.
 *
 *   particular:  x = U1 L1^-1 U1' A' b, the least solution
 *   basis:       U2
 *   multipliers: lambda = A U1 L1^-1 U1' g
 *
 * Eigenvalues are the squares of singular values, and so is the condition. SVD distinguishes singular values from zero
 * down to 1e-16 of the largest; this method loses them at 1e-8. Therefore accelerations near singular positions become
 * inaccurate. The purpose of this file is to show that.
 *
 * Eigenvalues by the cyclic method of Jacobi [Golub & Van Loan, Matrix Computations, 4th ed., 8.5]. `basis` holds A'A
 * during the rotations. U is in `square`, by falling eigenvalues; the square roots of these are in `reflector`.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/reduction.h"
#include "reduction/maggi_kane.h"

#include <limits.h>
#include <math.h>
#include <string.h>

enum { SWEEPS = 30 };

/* The rounding error of a zero eigenvalue, divided by the largest eigenvalue and by the number of coordinates. */
#define KT_EIGENVALUE_TOLERANCE 1e-15

/* An entry of equation c, scaled if the group is balanced. */
static inline double eigen_entry(const kt_group_work *w, size_t c, size_t i) {
    const double a = w->a[c * (size_t)w->m + i];
    return w->unit ? a * w->unit[i] / w->scale[c] : a;
}

/* G = A'A, U = 1; the sum of the squares of all entries of G is not finite if A is not finite. */
static bool begin_jacobi(const kt_group_work *w) {
    const size_t m = (size_t)w->m;
    double size = 0.0;
    memset(w->square, 0, m * m * sizeof(double));
    for (size_t i = 0; i < m; i++) {
        w->square[i * m + i] = 1.0;
        for (size_t j = 0; j <= i; j++) {
            double sum = 0.0;
            for (size_t c = 0; c < (size_t)w->k; c++)
                sum += eigen_entry(w, c, i) * eigen_entry(w, c, j);
            w->basis[i * m + j] = w->basis[j * m + i] = sum;
            size += sum * sum;
        }
    }
    return isfinite(size);
}

/* A rotation of coordinates p and q that makes G_pq zero. */
static void rotate_coordinates(const kt_group_work *w, size_t p, size_t q) {
    const size_t m = (size_t)w->m;
    double *g = w->basis, *u = w->square;
    const double theta = (g[q * m + q] - g[p * m + p]) / (2.0 * g[p * m + q]);
    const double t = (theta >= 0.0 ? 1.0 : -1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
    const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
    for (size_t i = 0; i < m; i++) {
        const double a = g[p * m + i], b = g[q * m + i];
        g[p * m + i] = c * a - s * b;
        g[q * m + i] = s * a + c * b;
    }
    for (size_t i = 0; i < m; i++) {
        const double a = g[i * m + p], b = g[i * m + q];
        g[i * m + p] = c * a - s * b;
        g[i * m + q] = s * a + c * b;
        const double x = u[p * m + i], y = u[q * m + i];
        u[p * m + i] = c * x - s * y;
        u[q * m + i] = s * x + c * y;
    }
}

/* Rotates until the entries off the diagonal are rounding errors. */
static void diagonalise(const kt_group_work *w) {
    const size_t m = (size_t)w->m;
    const double *g = w->basis;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        bool done = true;
        for (size_t p = 0; p + 1 < m; p++)
            for (size_t q = p + 1; q < m; q++)
                if (fabs(g[p * m + q]) > 1e-17 * sqrt(fabs(g[p * m + p] * g[q * m + q])) &&
                    fabs(g[p * m + q]) > 1e-300) {
                    rotate_coordinates(w, p, q);
                    done = false;
                }
        if (done)
            return;
    }
}

/* Columns of U and the diagonal of G by falling eigenvalues. */
static void sort_eigenvectors(const kt_group_work *w) {
    const size_t m = (size_t)w->m;
    double *g = w->basis, *u = w->square;
    for (size_t i = 0; i + 1 < m; i++) {
        size_t best = i;
        for (size_t j = i + 1; j < m; j++)
            best = g[j * m + j] > g[best * m + best] ? j : best;
        const double value = g[i * m + i];
        g[i * m + i] = g[best * m + best];
        g[best * m + best] = value;
        for (size_t l = 0; l < m && best != i; l++) {
            const double x = u[i * m + l];
            u[i * m + l] = u[best * m + l];
            u[best * m + l] = x;
        }
    }
}

/* Finds the eigenvectors of A' A, the largest eigenvalue first, and the singular values of A as their roots. Returns
 * the rank, or -1 if a number is not finite. */
static int factor_eigen(kt_group_work *w, int cap) {
    const size_t m = (size_t)w->m;
    if (w->m == 0 || w->k == 0)
        return 0;
    if (!begin_jacobi(w))
        return -1;
    diagonalise(w);
    sort_eigenvectors(w);
    const double first = kt_larger(w->basis[0], w->least * w->least);
    const double floor = KT_EIGENVALUE_TOLERANCE * (double)m * first;
    int rank = 0;
    for (; rank < cap && w->basis[(size_t)rank * m + (size_t)rank] > floor; rank++)
        kt_group_singular_values(w)[rank] = sqrt(w->basis[(size_t)rank * m + (size_t)rank]);
    return rank;
}

/* x = U1 L1^-1 U1' y */
static inline void invert_by_eigen(const kt_group_work *w, int rank, const double *y, double *x) {
    const size_t m = (size_t)w->m;
    memset(x, 0, m * sizeof(double));
    for (int i = 0; i < rank; i++) {
        const double *u = w->square + (size_t)i * m;
        double part = 0.0;
        for (size_t j = 0; j < m; j++)
            part += u[j] * y[j];
        part /= kt_group_singular_values(w)[i] * kt_group_singular_values(w)[i];
        for (size_t j = 0; j < m; j++)
            x[j] += u[j] * part;
    }
}

/* x = (A' A)^+ A' b, the least solution. */
static inline void eigen_particular(const kt_group_work *w, int rank, const double *b, double *x) {
    const size_t m = (size_t)w->m;
    double *y = w->work;
    memset(y, 0, m * sizeof(double));
    for (size_t c = 0; c < (size_t)w->k; c++)
        for (size_t i = 0; i < m; i++)
            y[i] += eigen_entry(w, c, i) * (w->unit ? b[c] / w->scale[c] : b[c]);
    invert_by_eigen(w, rank, y, x);
    if (w->unit)
        kt_group_scale_coordinates(w, x);
}

/* lambda = A U1 L1^-1 U1' g. Scales g in place. */
static void eigen_multipliers(const kt_group_work *w, int rank, double *g, double *lambda) {
    const size_t m = (size_t)w->m;
    double *y = w->work;
    if (w->unit)
        kt_group_scale_coordinates(w, g);
    invert_by_eigen(w, rank, g, y);
    for (size_t c = 0; c < (size_t)w->k; c++) {
        lambda[c] = 0.0;
        for (size_t i = 0; i < m; i++)
            lambda[c] += eigen_entry(w, c, i) * y[i];
        lambda[c] /= w->unit ? w->scale[c] : 1.0;
    }
}

static bool solve_by_eigen(const kt_group_work *w, int rank, int width) {
    return kt_group_solve(eigen_particular, kt_square_basis, w, rank, width);
}

const kt_reduction_kind KT_KERNEL(kt_reduction_eigen) = {.least = true,
                                                         .large = INT_MAX,
                                                         .factor = factor_eigen,
                                                         .size = kt_singular_value_of,
                                                         .particular = eigen_particular,
                                                         .basis = kt_square_basis,
                                                         .solve = solve_by_eigen,
                                                         .multipliers = eigen_multipliers};
