/* All of LAPACK that the library uses: column-major, workspaces given, which the _work calls promise not to allocate.
 *
 * A build without loops (KT_NO_LOOPS) does not have it: no model with loops can be compiled there, and all else that
 * needs it refuses.
 */
#ifndef KT_REDUCTION_LAPACK_H
#define KT_REDUCTION_LAPACK_H

#include <stdint.h>

#ifdef KT_NO_LOOPS
enum { KT_HAS_LAPACK = 0 };
#define KT_LAPACK(call) (-1)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#else
#include <lapacke.h>
enum { KT_HAS_LAPACK = 1 };
#define KT_LAPACK(call) (call)
#endif

/* What those say who cannot do without. */
#define KT_NEEDS_LAPACK "this library was built for trees alone: build it with -Dloops=enabled, which needs LAPACK"

/* A P = Q R with column pivoting; returns LAPACK's info. */
static inline int kt_lapack_geqp3(int m, int n, double *a, int32_t *pivot, double *tau, double *work, int size) {
    for (int i = 0; i < n; i++)
        pivot[i] = 0; /* every column is free to move */
    return KT_LAPACK(LAPACKE_dgeqp3_work(LAPACK_COL_MAJOR, m, n, a, m, pivot, tau, work, size));
}

/* C = Q C or Q' C for the reflectors of geqp3; one by one where size, of `work`, is `columns` alone. */
static inline int kt_lapack_ormqr(char trans, int m, int columns, int reflectors, const double *a, const double *tau,
                                  double *c, double *work, int size) {
    return KT_LAPACK(
        LAPACKE_dormqr_work(LAPACK_COL_MAJOR, 'L', trans, m, columns, reflectors, a, m, tau, c, m, work, size));
}

/* A (m x n) = U S V': all of U (m x m), the first min(m, n) rows of V' over A. */
static inline int kt_lapack_gesvd(int m, int n, double *a, double *s, double *u, double *work, int size) {
    return KT_LAPACK(LAPACKE_dgesvd_work(LAPACK_COL_MAJOR, 'A', 'O', m, n, a, m, s, u, m, NULL, 1, work, size));
}

/* Eigenvalues and the left and right vectors of A (n x n, overwritten; balanced first), as LAPACK packs them; norm: of
 * the balanced matrix; condition: |w' x| for unit vectors of the balanced matrix; scale: n numbers of scratch. */
static inline int kt_lapack_geevx(int n, double *a, double *real, double *imaginary, double *left, double *right,
                                  double *scale, double *norm, double *condition, double *work, int size) {
    int low, high;
    return KT_LAPACK(LAPACKE_dgeevx_work(LAPACK_COL_MAJOR, 'B', 'V', 'V', 'E', n, a, n, real, imaginary, left, n, right,
                                         n, &low, &high, scale, norm, condition, NULL, work, size, NULL));
}

/* A = L L' over the lower triangle of A (n x n); returns LAPACK's info: > 0 where A is not positive definite. */
static inline int kt_lapack_potrf(int n, double *a) {
    return KT_LAPACK(LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', n, a, n));
}

/* X = L^-1 X ('N') or L^-T X ('T') for the lower triangle L (n x n) and n x columns X. */
static inline int kt_lapack_trtrs(char trans, int n, int columns, const double *l, double *x) {
    return KT_LAPACK(LAPACKE_dtrtrs_work(LAPACK_COL_MAJOR, 'L', trans, 'N', n, columns, l, n, x, n));
}

/* x = A^-1 x by LU with row pivoting (A: n x n, overwritten; pivot: n); 0, or LAPACK's info where A is singular. */
static inline int kt_lapack_gesv(int n, double *a, int32_t *pivot, double *x) {
    return KT_LAPACK(LAPACKE_dgesv_work(LAPACK_COL_MAJOR, n, 1, a, n, pivot, x, n));
}

#ifdef KT_NO_LOOPS
#pragma GCC diagnostic pop
#endif
#undef KT_LAPACK
#endif
