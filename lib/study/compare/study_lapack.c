/* The calls of LAPACK that the core does not need. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "linear/lapack.h"

#ifdef KT_NO_LAPACK

#pragma GCC diagnostic ignored "-Wunused-parameter"
#define KT_LAPACK_NONE(name, parameters, arguments)                                                                    \
    int kt_lapack_##name parameters { return -1; }
KT_LAPACK_STUDY_LIST(KT_LAPACK_NONE)
#undef KT_LAPACK_NONE

#else

#include <lapacke.h>
#include <stddef.h>

int kt_lapack_gesvd(int m, int n, double *a, double *s, double *u, double *work, int size) {
    return LAPACKE_dgesvd_work(LAPACK_COL_MAJOR, 'A', 'O', m, n, a, m, s, u, m, NULL, 1, work, size);
}

int kt_lapack_trtrs(char trans, int n, int columns, const double *l, double *x) {
    return LAPACKE_dtrtrs_work(LAPACK_COL_MAJOR, 'L', trans, 'N', n, columns, l, n, x, n);
}

#endif
