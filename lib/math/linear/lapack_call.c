/* The calls of LAPACK; lib/study/compare/study_lapack.c has the calls that the core does not need. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "linear/lapack.h"

#include <assert.h>
#include <stddef.h>

#ifdef KT_NO_LAPACK

#pragma GCC diagnostic ignored "-Wunused-parameter"
#define KT_LAPACK_NONE(name, parameters, arguments)                                                                    \
    int kt_lapack_##name parameters { return -1; }
/* NOLINTNEXTLINE(misc-unused-parameters): the functions of this list do nothing */
KT_LAPACK_CORE_LIST(KT_LAPACK_NONE)
#undef KT_LAPACK_NONE

kt_status kt_lapack_open(kt_error *error) {
    static const char message[] =
        "this build has no LAPACK, which groups of loops with 40 coordinates and more need, and modes, equilibria and "
        "constraint formulations: use libkinetree, or compile the one-file engine with -DKINETREE_FULL";
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL, "%s", message);
}

#else

#include <lapacke.h>

int kt_lapack_geqp3(int m, int n, double *a, int32_t *pivot, double *tau, double *work, int size) {
    assert(m >= 0 && n >= 0 && size > 3 * n);
    for (int i = 0; i < n; i++)
        pivot[i] = 0; /* LAPACK may permute every column */
    return LAPACKE_dgeqp3_work(LAPACK_COL_MAJOR, m, n, a, m, pivot, tau, work, size);
}

int kt_lapack_ormqr(char trans, int m, int columns, int reflectors, const double *a, const double *tau, double *c,
                    double *work, int size) {
    assert(trans == 'N' || trans == 'T');
    assert(reflectors <= m && size >= columns);
    return LAPACKE_dormqr_work(LAPACK_COL_MAJOR, 'L', trans, m, columns, reflectors, a, m, tau, c, m, work, size);
}

int kt_lapack_geevx(int n, double *a, double *real, double *imaginary, double *left, double *right, double *scale,
                    double *norm, double *condition, double *work, int size) {
    assert(n >= 0 && size >= 3 * n);
    int low, high;
    return LAPACKE_dgeevx_work(LAPACK_COL_MAJOR, 'B', 'V', 'V', 'E', n, a, n, real, imaginary, left, n, right, n, &low,
                               &high, scale, norm, condition, NULL, work, size, NULL);
}

int kt_lapack_potrf(int n, double *a) { return LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', n, a, n); }

int kt_lapack_gesv(int n, double *a, int32_t *pivot, double *x) {
    assert(n >= 0 && (n == 0 || a != x));
    return LAPACKE_dgesv_work(LAPACK_COL_MAJOR, n, 1, a, n, pivot, x, n);
}

kt_status kt_lapack_open(kt_error *error) {
    (void)error;
    return KT_OK;
}

#endif
