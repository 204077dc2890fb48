/* LU factorisation with partial pivoting of small dense matrices, real and complex: P A = L U.
 *
 * Matrices are n x n, column-major; a complex matrix is two such arrays, with the real and the imaginary parts. The
 * factors overwrite the matrix, with the reciprocals of U's diagonal in its place; pivot (n) lists the row that was
 * exchanged with each. No allocation. The order of every sum is fixed, so that equal inputs give equal bits.
 *
 * Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., 2013, algorithm 3.4.1. O(2 n^3 / 3).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_LU_H
#define KT_ALGEBRA_LU_H

#include "base/inner.h"

#include <stdbool.h>
#include <stddef.h>

/* Returns false where a pivot is zero or not finite; the matrix is then of no use. */
KT_INNER bool kt_lu_factor(double *a, size_t n, int *pivot);
bool kt_lu_factor_complex(double *re, double *im, size_t n, int *pivot);

/* b becomes A^-1 b. O(2 n^2). */
KT_INNER void kt_lu_solve(const double *a, size_t n, const int *pivot, double *b);
/* b becomes A'^-1 b. */
void kt_lu_solve_transposed(const double *a, size_t n, const int *pivot, double *b);
void kt_lu_solve_complex(const double *re, const double *im, size_t n, const int *pivot, double *b_re, double *b_im);

#endif
