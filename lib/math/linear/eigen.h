/* Eigenvalues and vectors of a real matrix by LAPACK's dgeevx: balancing, Hessenberg form, QR. The caller has these
 * arrays among its own arrays (base/arena.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_EIGEN_H
#define KT_LINEAR_EIGEN_H

#include "linear/lapack.h"

/* The workspace for n rows: more than its minimum, so that LAPACK can use blocks. */
#define KT_EIGEN_WORK(n) (66 * (n) + 64)

#define KT_EIGEN_FIELDS(X)                                                                                             \
    X(double, left, n *n, "left vectors, as LAPACK packs them")                                                        \
    X(double, right, n *n, "right vectors")                                                                            \
    X(double, real, n, "of eigenvalues")                                                                               \
    X(double, imaginary, n, "of eigenvalues")                                                                          \
    X(double, condition, n, "of eigenvalues")                                                                          \
    X(double, scale, n, "of balancing")                                                                                \
    X(double, lapack, KT_EIGEN_WORK(n), "of LAPACK")

/* Returns true if the eigenvalues of the matrix (n x n, overwritten) were found; *norm is the norm of the balanced
 * matrix. */
#define KT_EIGEN_SOLVE(s, n, matrix, norm)                                                                             \
    ((n) == 0 || kt_lapack_geevx((int)(n), matrix, (s)->real, (s)->imaginary, (s)->left, (s)->right, (s)->scale, norm, \
                                 (s)->condition, (s)->lapack, (int)KT_EIGEN_WORK(n)) == 0)

#endif
