/* Column-pivoted QR by Householder's reflectors, one column after the other (Businger & Golub 1965):
 *
 *     A P = Q R,   Q = H_1 H_2 ...,   H = I - t u u'
 *
 * The vector u of a reflector is stored below R without its leading 1, as in LAPACK. The caller decides where the rank
 * ends.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_QR_H
#define KT_LINEAR_QR_H

#include "linear/cholesky.h"

#include <assert.h>
#include <math.h>

/* A matrix A (m x k), then its factors; reflector_scale (t) and pivot: k. */
typedef struct kt_qr {
    int m, k;
    kt_real1 *factor, *reflector_scale;
    kt_index1 *pivot;
} kt_qr;

/* The size, relative to the largest direction of the equations, below which a direction counts as lost to rounding. The
 * largest direction counts as at least KT_RANK_FLOOR of its possible size (rank.c). If all entries are rounding noise,
 * about 1e-16 of that size, no direction is independent. So no direction counts below 1e-13 of its possible size.
 *
 * This tolerance applies while the number of independent equations is not yet determined. Once that number is known and
 * limits the rank, a small direction is a real direction, not rounding. An example is a linkage whose lengths are off
 * by d, near a position at which two loops fold at once. This linkage has directions of the size d, not sqrt(d), and
 * the motion stays near this position for long. Positions can be closed along such a direction down to KT_RANK_CLOSED
 * of the largest. Entries of A are accurate to some tens of eps, 1e-14, and a direction of the size 1e-13 to a tenth.
 * Rates and accelerations use directions down to KT_RANK_MOVING.
 *
 * A direction of the size s that counts has a relative error of 1e-14 / s, in several places. At 1e-12 this error
 * remains a part of the direction, at 1e-13 it may be all. A direction that does not count is off by all of itself, and
 * the linkage moves along it as if it were free. The run of sarrus_flat (test/hard/band.py) at d = 1e-11 warns. In 3 s
 * it loses a part of 113 J:
 *
 *     limit    energy lost
 *     1e-12    1.2e-3 J
 *     1e-11    49 J
 */
#define KT_RANK_TOLERANCE 1e-10
#define KT_RANK_FLOOR 1e-3
#define KT_RANK_CLOSED 1e-13
#define KT_RANK_MOVING 1e-12

#ifndef KT_LANES

/* Brings column `best` to j, with its norm. */
KT_INLINE void kt_bring_column(const kt_qr *w, int m, int j, int best, double *norm) {
    assert(j <= best && best < w->k);
    if (best == j)
        return;
    double *x = w->factor + (size_t)j * (size_t)m, *y = w->factor + (size_t)best * (size_t)m;
    for (int i = 0; i < m; i++) {
        const double t = x[i];
        x[i] = y[i];
        y[i] = t;
    }
    const int32_t p = w->pivot[j];
    w->pivot[j] = w->pivot[best];
    w->pivot[best] = p;
    const double t = norm[j];
    norm[j] = norm[best];
    norm[best] = t;
}

/* The number with this index among k. */
KT_OPERATOR double kt_pick(const double *x, int k, int32_t index) {
    (void)k;
    return x[index];
}
KT_OPERATOR double kt_pick_of(const double *x, int k, int32_t index) { return kt_pick(x, k, index); }

#else

/* Swaps two numbers where a condition holds. */
KT_INLINE void kt_swap_where(kt_condition here, kt_real1 *x, kt_real1 *y) {
    const kt_real1 t = *x;
    *x = kt_choose(here, *y, *x);
    *y = kt_choose(here, t, *y);
}

/* Swaps column `best`, which differs between states, and its norm with column j. */
KT_INLINE void kt_bring_column(const kt_qr *w, int m, int j, kt_index1 best, kt_real1 *norm) {
    for (int c = j + 1; c < w->k; c++) {
        const kt_condition here = best == c;
        kt_real1 *x = w->factor + (size_t)j * (size_t)m, *y = w->factor + (size_t)c * (size_t)m;
        for (int i = 0; i < m; i++)
            kt_swap_where(here, &x[i], &y[i]);
        const kt_index1 p = w->pivot[j];
        w->pivot[j] = (here & w->pivot[c]) | (~here & p);
        w->pivot[c] = (here & p) | (~here & w->pivot[c]);
        kt_swap_where(here, &norm[j], &norm[c]);
    }
}

/* The number with this index among k; of the model's, which all states share. */
KT_INLINE kt_real1 kt_pick(const kt_real1 *x, int k, kt_index1 index) {
    kt_real1 found = x[0];
    for (int c = 1; c < k; c++)
        found = kt_choose(index == c, x[c], found);
    return found;
}
KT_INLINE kt_real1 kt_pick_of(const double *x, int k, kt_index1 index) {
    kt_real1 found = kt_real1_splat(x[0]);
    for (int c = 1; c < k; c++)
        found = kt_choose(index == c, kt_real1_splat(x[c]), found);
    return found;
}

#endif

/* x -= t u (u . x), u = (1, tail) from row j on. Returns the squared norm of x from row j + 1 on. */
KT_INLINE kt_real1 kt_reflect(const kt_real1 *restrict u, kt_real1 t, int j, int m, kt_real1 *restrict x) {
    kt_real1 sum = x[j], squares = kt_real1_splat(0.0);
    for (int i = j + 1; i < m; i++)
        sum += u[i] * x[i];
    sum *= t;
    x[j] -= sum;
    for (int i = j + 1; i < m; i++) {
        x[i] -= sum * u[i];
        squares += x[i] * x[i];
    }
    return squares;
}

#ifndef KT_LANES

/* Reflects four columns, m apart, and computes their squared norms from row j + 1 on. The order of each sum is
 * unchanged, but the four sums no longer wait for one another. */
KT_INLINE void kt_reflect_four(const double *restrict u, double t, int j, int m, double *restrict x, double *norm) {
    enum { FOUR = 4 };
    double sum[FOUR];
    for (int c = 0; c < FOUR; c++)
        sum[c] = x[c * m + j];
    for (int i = j + 1; i < m; i++)
        for (int c = 0; c < FOUR; c++)
            sum[c] += u[i] * x[c * m + i];
    for (int c = 0; c < FOUR; c++) {
        sum[c] *= t;
        x[c * m + j] -= sum[c];
        for (int i = j + 1; i < m; i++)
            x[c * m + i] -= sum[c] * u[i];
        sum[c] = 0.0;
    }
    for (int i = j + 1; i < m; i++)
        for (int c = 0; c < FOUR; c++)
            sum[c] += x[c * m + i] * x[c * m + i];
    for (int c = 0; c < FOUR; c++)
        norm[c] = sum[c];
}

#endif

/* Performs step j of the decomposition. Column `best` moves to position j. A reflector maps its rows j.., of squared
 * norm norm[j], onto (R_jj, 0, ...); this reflector is applied to all columns after it. The array norm holds the
 * squared norms of the columns' rows from j on, and afterwards from j + 1 on. The norms are recomputed at each column:
 * updated norms would lose their digits where the rank is decided. */
KT_INLINE void kt_qr_step(const kt_qr *w, int m, int j, kt_index1 best, kt_real1 *norm) {
    assert(m == w->m && j >= 0 && j < m && j < w->k);
    kt_bring_column(w, m, j, best, norm);
    kt_real1 *u = w->factor + (size_t)j * (size_t)m;
    const kt_real1 size = kt_sqrt1(norm[j]), r = KT_CHOOSE(u[j] > 0.0, -size, size), u0 = u[j] - r, t = -u0 / r;
    for (int i = j + 1; i < m; i++)
        u[i] /= u0;
    w->reflector_scale[j] = t;
    u[j] = r;
    int c = j + 1;
#ifndef KT_LANES
    enum { SHORT = 8 }; /* rows; sums of fewer wait for less than it takes to begin with four columns */
    for (; m - j > SHORT && c + 4 <= w->k; c += 4)
        kt_reflect_four(u, t, j, m, w->factor + (size_t)c * (size_t)m, norm + c);
#endif
    for (; c < w->k; c++)
        norm[c] = kt_reflect(u, t, j, m, w->factor + (size_t)c * (size_t)m);
}

#ifndef KT_LANES

/* The longest column from j on; *all is the sum of the squares of all columns from j on. */
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

#else

/* The longest column of each of several states; the order of columns differs between states. */
KT_INLINE kt_index1 kt_longest_column(const kt_real1 *norm, int j, int k, kt_real1 *all) {
    kt_index1 best = kt_condition_false() + j;
    kt_real1 sum = kt_real1_splat(0.0), most = norm[j];
    for (int c = j; c < k; c++) {
        const kt_condition longer = norm[c] > most;
        sum += norm[c];
        best = (longer & c) | (~longer & best);
        most = kt_choose(longer, norm[c], most);
    }
    *all = sum;
    return best;
}

#endif

/* Divides weights out of the first `rank` columns of R again: A W P = Q R W. */
KT_INLINE void kt_qr_unweight(const kt_qr *w, int m, int rank, const double *weight) {
    assert(m == w->m && rank <= m && rank <= w->k);
    for (int c = 0; c < rank; c++) {
        const kt_real1 by = kt_pick_of(weight, w->k, w->pivot[c]);
        for (int i = 0; i <= c; i++)
            w->factor[(size_t)c * (size_t)m + (size_t)i] /= by;
    }
}

/* y = R1^-T P' b, `rank` numbers: R1' is lower triangular, its row i is column i of R. */
KT_INLINE void kt_qr_solve_transposed(const kt_qr *w, int m, int rank, const kt_real1 *b, kt_real1 *y) {
    assert(m == w->m && rank >= 0 && rank <= m && rank <= w->k);
    assert(rank == 0 || b != y);
    for (int i = 0; i < rank; i++) {
        const kt_real1 *r = w->factor + (size_t)i * (size_t)m;
        kt_real1 sum = kt_pick(b, w->k, w->pivot[i]);
        for (int j = 0; j < i; j++)
            sum -= r[j] * y[j];
        y[i] = sum / r[i];
    }
}

/* y <- R1^-1 y, `rank` numbers. */
KT_INLINE void kt_qr_solve(const kt_qr *w, int m, int rank, kt_real1 *y) {
    assert(m == w->m && rank >= 0 && rank <= m && rank <= w->k);
    for (int i = rank - 1; i >= 0; i--) {
        for (int j = i + 1; j < rank; j++)
            y[i] -= w->factor[(size_t)j * (size_t)m + (size_t)i] * y[j];
        y[i] /= w->factor[(size_t)i * (size_t)(m + 1)];
    }
}

#endif
