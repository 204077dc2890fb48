/* All LAPACK calls of the library: column-major, with workspaces given by the caller, so that the _work calls do not
 * allocate.
 *
 * OpenBLAS starts its threads as soon as it is loaded. The shared library does not link OpenBLAS, so that a program
 * that never needs LAPACK has no such threads. The function kt_lapack_open loads a module that links OpenBLAS
 * (lapack_load.c, lapack_table.c) when a model is compiled or an analysis begins. The static library, and the shared
 * one on systems without dlopen, link OpenBLAS directly (lapack_call.c in lib/math/linear and in lib/study/compare).
 * FMUs, the one-file engine and libraries for other processors compile lapack_call.c without LAPACK (KT_NO_LAPACK).
 * Functions that need LAPACK then return an error.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_LAPACK_H
#define KT_LINEAR_LAPACK_H

#include "kinetree/status.h"

#include <stdint.h>

/* Two lists give the functions, the module's table and the calls through it: X(name, parameters, arguments). The second
 * lists the functions that only libkinetree-study needs: the core does not contain them.
 *
 * geqp3: A P = Q R with column pivoting; returns LAPACK's info.
 *
 * ormqr: C = Q C or Q' C for the reflectors of geqp3; applied one by one if size, of `work`, is only `columns`.
 *
 * gesvd: A (m x n) = U S V': all of U (m x m), the first min(m, n) rows of V' over A.
 *
 * geevx: eigenvalues and the left and right vectors of A (n x n, overwritten; balanced first), as LAPACK packs them;
 *        norm: of the balanced matrix; condition: |w' x| for unit vectors of the balanced matrix; scale: n numbers.
 *
 * potrf: A = L L' over the lower triangle of A (n x n); info > 0 where A is not positive definite.
 *
 * trtrs: X = L^-1 X ('N') or L^-T X ('T') for the lower triangle L (n x n) and n x columns X.
 *
 * gesv:  x = A^-1 x by LU with row pivoting (A: n x n, overwritten; pivot: n); 0, or info where A is singular.
 */
/* clang-format off */
#define KT_LAPACK_CORE_LIST(X)                                                                                         \
    X(geqp3, (int m, int n, double *a, int32_t *pivot, double *tau, double *work, int size),                           \
      (m, n, a, pivot, tau, work, size))                                                                               \
    X(ormqr, (char trans, int m, int columns, int reflectors, const double *a, const double *tau, double *c,           \
              double *work, int size),                                                                                 \
      (trans, m, columns, reflectors, a, tau, c, work, size))                                                          \
    X(geevx, (int n, double *a, double *real, double *imaginary, double *left, double *right, double *scale,           \
              double *norm, double *condition, double *work, int size),                                                \
      (n, a, real, imaginary, left, right, scale, norm, condition, work, size))                                        \
    X(potrf, (int n, double *a), (n, a))                                                                               \
    X(gesv, (int n, double *a, int32_t *pivot, double *x), (n, a, pivot, x))
#define KT_LAPACK_STUDY_LIST(X)                                                                                        \
    X(gesvd, (int m, int n, double *a, double *s, double *u, double *work, int size), (m, n, a, s, u, work, size))     \
    X(trtrs, (char trans, int n, int columns, const double *l, double *x), (trans, n, columns, l, x))
#define KT_LAPACK_LIST(X) KT_LAPACK_CORE_LIST(X) KT_LAPACK_STUDY_LIST(X)
/* clang-format on */

#define KT_LAPACK_DECLARE(name, parameters, arguments) int kt_lapack_##name parameters;
KT_LAPACK_LIST(KT_LAPACK_DECLARE)
#undef KT_LAPACK_DECLARE

/* Loads LAPACK unless it is loaded already; before this call the functions above return an error. Any number of threads
 * may call this function at the same time. Errors: KT_ERROR_UNSUPPORTED if LAPACK cannot be loaded. */
kt_status kt_lapack_open(kt_error *error);

/* The contents of the module: its version, which must equal the library's, and the functions. */
typedef struct kt_lapack_table {
    const char *version;
#define KT_LAPACK_MEMBER(name, parameters, arguments) int(*name) parameters;
    KT_LAPACK_LIST(KT_LAPACK_MEMBER)
#undef KT_LAPACK_MEMBER
} kt_lapack_table;

#endif
