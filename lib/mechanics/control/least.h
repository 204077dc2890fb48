/* Equations with a matrix A (m x k), factored by QR decomposition with column pivoting, A P = Q [R; 0]
 * (linear/qr.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONTROL_LEAST_H
#define KT_CONTROL_LEAST_H

#include "linear/qr.h"

typedef struct kt_least {
    kt_qr qr;           /* factor: A (m x k), then its factors */
    double *norm, *sum; /* k; the larger of m and k */
    int rank;
} kt_least;

/* Factors w->qr.factor. A direction counts above KT_RANK_TOLERANCE of the largest, or of `could_be`, the size that a
 * row could have. */
void kt_least_factor(kt_least *w, double could_be);

/* The least x (m) with A' x = b (k); the rank is k. */
void kt_least_solve_transposed(kt_least *w, const double *b, double *x);

/* x (k) with A x = b (m); the rank is m = k. */
void kt_least_solve(kt_least *w, const double *b, double *x);

/* A vector z (k) with A z = 0; the rank is less than k. */
void kt_least_null(kt_least *w, double *z);

#endif
