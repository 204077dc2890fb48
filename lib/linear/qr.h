/* Column-pivoted QR by Householder's reflectors, one column after the other: A P = Q R, Q = H_1 H_2 ... with reflectors
 * H = I - t u u'; u is stored below R without its leading 1, as in LAPACK (Businger & Golub 1965). The caller decides
 * where the rank ends.
 */
#ifndef KT_LINEAR_QR_H
#define KT_LINEAR_QR_H

#include "algebra/lane.h"

#include <math.h>

/* A matrix A (m x k), then its factors; reflector_scale (t) and pivot: k. */
typedef struct kt_qr {
    int m, k;
    double *factor, *reflector_scale;
    int32_t *pivot;
} kt_qr;

/* The size, relative to the largest direction of the equations, below which a direction counts as lost to rounding. The
 * largest direction counts as at least KT_RANK_FLOOR of what it could be (rank.c): if all entries are rounding noise,
 * about 1e-16 of that, no direction is independent. So no direction counts below 1e-13 of what it could be.
 *
 * That is asked where the number of independent equations is not known yet. Where it is, and caps the rank, a small
 * direction is a real one: of linkages whose lengths are off by d, positions at which two loops fold at once have
 * directions of the size d, not of its root, and the motion stays there for long. Positions can be closed along it down
 * to KT_RANK_CLOSED of the largest; rates and accelerations, in whose errors it counts more than once, are computed
 * with it down to KT_RANK_MOVING (measured by test/hard/band.py, scissor_lift and sarrus_flat). */
#define KT_RANK_TOLERANCE 1e-10
#define KT_RANK_FLOOR 1e-3
#define KT_RANK_CLOSED 1e-13
#define KT_RANK_MOVING 1e-11

static inline void kt_swap_columns(const kt_qr *w, int m, int a, int b) {
    double *x = w->factor + (size_t)a * (size_t)m, *y = w->factor + (size_t)b * (size_t)m;
    for (int i = 0; i < m; i++) {
        const double t = x[i];
        x[i] = y[i];
        y[i] = t;
    }
    const int32_t p = w->pivot[a];
    w->pivot[a] = w->pivot[b];
    w->pivot[b] = p;
}

/* x -= t u (u . x), u = (1, tail) from row j on. */
KT_INLINE void kt_reflect(const double *restrict u, double t, int j, int m, double *restrict x) {
    double sum = x[j];
    for (int i = j + 1; i < m; i++)
        sum += u[i] * x[i];
    sum *= t;
    x[j] -= sum;
    for (int i = j + 1; i < m; i++)
        x[i] -= sum * u[i];
}

KT_INLINE double kt_squares(const double *x, int from, int m) {
    double sum = 0.0;
    for (int i = from; i < m; i++)
        sum += x[i] * x[i];
    return sum;
}

/* The reflector that maps rows j.. of column j, of squared norm norm[j], onto (R_jj, 0, ...). norm holds the squared
 * norms of the columns' rows from j on, and afterwards from j + 1 on. They are recomputed at each column: updated norms
 * would lose their digits where the rank ends. */
KT_INLINE void kt_eliminate_column(const kt_qr *w, int m, int j, double *norm) {
    double *u = w->factor + (size_t)j * (size_t)m;
    const double size = sqrt(norm[j]), r = u[j] > 0.0 ? -size : size, u0 = u[j] - r, t = -u0 / r;
    for (int i = j + 1; i < m; i++)
        u[i] /= u0;
    w->reflector_scale[j] = t;
    u[j] = r;
    for (int c = j + 1; c < w->k; c++) {
        double *x = w->factor + (size_t)c * (size_t)m;
        kt_reflect(u, t, j, m, x);
        norm[c] = kt_squares(x, j + 1, m);
    }
}

/* The longest column from j on; *all is the sum of all squares from there. */
KT_INLINE int kt_longest_column(const double *norm, int j, int k, double *all) {
    int best = j;
    double sum = 0.0;
    for (int c = j; c < k; c++) {
        sum += norm[c];
        if (norm[c] > norm[best])
            best = c;
    }
    *all = sum;
    return best;
}

/* Step j of the decomposition: column `best` comes to j, and its reflector is applied to all after it. */
KT_INLINE void kt_qr_step(const kt_qr *w, int m, int j, int best, double *norm) {
    if (best != j) {
        const double t = norm[j];
        kt_swap_columns(w, m, j, best);
        norm[j] = norm[best];
        norm[best] = t;
    }
    kt_eliminate_column(w, m, j, norm);
}

/* Divides weights out of the first `rank` columns of R again: A W P = Q R W. */
KT_INLINE void kt_qr_unweight(const kt_qr *w, int m, int rank, const double *weight) {
    for (int c = 0; c < rank; c++) {
        const double by = weight[w->pivot[c]];
        for (int i = 0; i <= c; i++)
            w->factor[(size_t)c * (size_t)m + (size_t)i] /= by;
    }
}

/* y = R1^-T P' b, `rank` numbers: R1' is lower triangular, its row i is column i of R. */
KT_INLINE void kt_qr_solve_transposed(const kt_qr *w, int m, int rank, const double *b, double *y) {
    for (int i = 0; i < rank; i++) {
        const double *r = w->factor + (size_t)i * (size_t)m;
        double sum = b[w->pivot[i]];
        for (int j = 0; j < i; j++)
            sum -= r[j] * y[j];
        y[i] = sum / r[i];
    }
}

/* y <- R1^-1 y, `rank` numbers. */
KT_INLINE void kt_qr_solve(const kt_qr *w, int m, int rank, double *y) {
    for (int i = rank - 1; i >= 0; i--) {
        for (int j = i + 1; j < rank; j++)
            y[i] -= w->factor[(size_t)j * (size_t)m + (size_t)i] * y[j];
        y[i] /= w->factor[(size_t)i * (size_t)(m + 1)];
    }
}

#endif
