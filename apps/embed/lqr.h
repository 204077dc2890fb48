/* A linear quadratic regulator for one input, by LAPACK.
 *
 * For x' = A x + B u, the feedback u = -K x with K = B'X / r minimises the integral of x'Qx + r u^2, where X solves
 *     A'X + X A - X B B'X / r + Q = 0.
 * The columns of (U1; U2) that span the stable subspace of the Hamiltonian matrix (A, -B B'/r; -Q, -A'), computed by
 * LAPACK's ordered Schur form, give X = U2 U1^-1 (Laub 1979, IEEE Trans. Automatic Control 24, 913-921).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMBED_LQR_H
#define EMBED_LQR_H

#include <lapacke.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { LQR_STATES = 4 };

typedef struct lqr {
    double a[LQR_STATES * LQR_STATES], b[LQR_STATES]; /* column-major */
    double gain[LQR_STATES];                          /* K, one row */
    double residual;                                  /* residual of the Riccati equation, over Q's largest element */
} lqr;

static lapack_logical lqr_is_stable(const double *re, const double *im) {
    (void)im;
    return *re < 0.0;
}

/* Returns the largest element of |A'X + X A - X B B'X / r + Q| divided by that of Q, with K = B'X / r. */
static double lqr_residual(const lqr *d, const double *q, double r, const double *x) {
    enum { N = LQR_STATES };
    double most = 0.0, largest = 0.0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double sum = (i == j ? q[i] : 0.0) - r * d->gain[i] * d->gain[j];
            for (int k = 0; k < N; k++)
                sum += d->a[i * N + k] * x[j * N + k] + x[k * N + i] * d->a[j * N + k];
            most = fmax(most, fabs(sum));
            largest = fmax(largest, q[i]);
        }
    return most / largest;
}

/* Computes the regulator. a: LQR_STATES x LQR_STATES, column-major; b: LQR_STATES; q: diagonal of Q. Returns false if
 * there is no solution. */
static bool lqr_find(lqr *d, const double *a, const double *b, const double *q, double r) {
    enum { N = LQR_STATES, M = 2 * N };
    double h[M * M] = {0.0}, u[M * M], re[M], im[M], u1t[N * N], x[N * N];
    lapack_int stable, pivots[N];
    memcpy(d->a, a, sizeof d->a);
    memcpy(d->b, b, sizeof d->b);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            h[j * M + i] = a[j * N + i];
            h[(N + j) * M + i] = -b[i] * b[j] / r;
            h[(N + j) * M + N + i] = -a[i * N + j];
        }
    for (int i = 0; i < N; i++)
        h[i * M + N + i] = -q[i];
    if (LAPACKE_dgees(LAPACK_COL_MAJOR, 'V', 'S', lqr_is_stable, M, h, M, &stable, re, im, u, M) != 0 || stable != N)
        return false;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) { /* X = U2 U1^-1 is symmetric: U1' X = U2' */
            u1t[j * N + i] = u[i * M + j];
            x[j * N + i] = u[i * M + N + j];
        }
    if (LAPACKE_dgesv(LAPACK_COL_MAJOR, N, N, u1t, N, pivots, x, N) != 0)
        return false;
    for (int j = 0; j < N; j++) {
        d->gain[j] = 0.0;
        for (int i = 0; i < N; i++)
            d->gain[j] += b[i] * x[j * N + i] / r;
    }
    d->residual = lqr_residual(d, q, r, x);
    return true;
}

#endif
