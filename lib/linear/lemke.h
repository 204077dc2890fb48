/* Lemke's method for the linear complementarity problem
 *
 *     w = M z + q >= 0,  z >= 0,  w' z = 0.
 *
 * An artificial variable z0 that is added to all w makes a feasible start, and pivots follow complementary variables
 * until it leaves. Ties are broken lexicographically (the columns of w hold the inverse of the basis), so that no basis
 * comes again. The method finds a solution if M is positive semidefinite and a solution exists.
 *
 * Source: Cottle, Pang, Stone 1992, The linear complementarity problem, algorithm 4.4.5.
 */
#ifndef KT_LINEAR_LEMKE_H
#define KT_LINEAR_LEMKE_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { KT_LEMKE_MAX = 20, KT_LEMKE_PIVOTS = 50 /* for each unknown */, KT_LEMKE_PROXIMAL = 4 };

/* Columns: w, z, z0, right-hand side. */
typedef struct kt_lemke {
    int n;
    int basis[KT_LEMKE_MAX]; /* the column of the variable of each row */
    double row[KT_LEMKE_MAX][2 * KT_LEMKE_MAX + 2];
} kt_lemke;

static inline int kt_lemke_width(const kt_lemke *t) { return 2 * t->n + 2; }

static inline void kt_lemke_pivot(kt_lemke *t, int r, int column) {
    const double by = t->row[r][column];
    for (int j = 0; j < kt_lemke_width(t); j++)
        t->row[r][j] /= by;
    for (int i = 0; i < t->n; i++) {
        const double factor = t->row[i][column];
        for (int j = 0; i != r && factor != 0.0 && j < kt_lemke_width(t); j++)
            t->row[i][j] -= factor * t->row[r][j];
    }
    t->basis[r] = column;
}

/* Whether row a leaves before row b: the smaller ratio of right-hand sides, then of the columns of w one by one. */
static inline bool kt_lemke_leaves_first(const kt_lemke *t, int a, int b, int column) {
    const double pa = t->row[a][column], pb = t->row[b][column];
    const int last = kt_lemke_width(t) - 1;
    for (int k = -1; k < t->n; k++) {
        const int j = k < 0 ? last : k;
        const double x = t->row[a][j] / pa, y = t->row[b][j] / pb;
        if (x != y)
            return x < y;
    }
    return false;
}

/* The row whose variable leaves for that of `column`, or -1: none bounds it, a ray. */
static inline int kt_lemke_leaving(const kt_lemke *t, int column, double least) {
    int r = -1;
    for (int i = 0; i < t->n; i++)
        if (t->row[i][column] > least && (r < 0 || kt_lemke_leaves_first(t, i, r, column)))
            r = i;
    return r;
}

/* The tableau of the problem, scaled to a diagonal of ones: with D = diag(M)^-1/2, D M D + delta and D q - delta z0. */
static inline kt_lemke kt_lemke_begin(int n, const double *M, const double *q, double delta, const double *z0,
                                      double *scale) {
    kt_lemke t = {.n = n};
    for (int i = 0; i < n; i++)
        scale[i] = M[i * n + i] > 0.0 ? 1.0 / sqrt(M[i * n + i]) : 1.0;
    for (int i = 0; i < n; i++) {
        t.basis[i] = i;
        t.row[i][i] = 1.0;
        for (int j = 0; j < n; j++)
            t.row[i][n + j] = -scale[i] * M[i * n + j] * scale[j];
        t.row[i][n + i] -= delta;
        t.row[i][2 * n] = -1.0;
        t.row[i][2 * n + 1] = scale[i] * q[i] - delta * z0[i] / scale[i];
    }
    return t;
}

/* Pivots to a solution, and writes it to z. */
static inline bool kt_lemke_run(kt_lemke *t, const double *scale, double *z, uint64_t *pivots) {
    static const double least = 1e-10; /* of an entry that is not rounding, where the diagonal is 1 */
    const int n = t->n, last = 2 * n + 1;
    int entering = 2 * n, r = 0;
    for (int i = 0; i < n; i++) {
        z[i] = 0.0;
        r = t->row[i][last] < t->row[r][last] ? i : r;
    }
    if (n == 0 || t->row[r][last] >= 0.0)
        return true;
    for (int k = 0; k < KT_LEMKE_PIVOTS * n && r >= 0; k++) {
        const int left = t->basis[r];
        kt_lemke_pivot(t, r, entering);
        ++*pivots;
        if (left == 2 * n) {
            for (int i = 0; i < n; i++)
                if (t->basis[i] >= n)
                    z[t->basis[i] - n] = scale[t->basis[i] - n] * fmax(t->row[i][last], 0.0);
            return true;
        }
        entering = left < n ? left + n : left - n;
        r = kt_lemke_leaving(t, entering, least);
    }
    return false;
}

/* Writes z (n); M is n x n by rows. Adds the pivots to *pivots. If M is singular, rounding can leave a solvable problem
 * without a solution. Then the proximal points z_k+1 of (M + delta) z + q - delta z_k are taken. They converge to a
 * solution (Rockafellar 1976). Each point reduces the error by a factor of delta over the least nonzero eigenvalue.
 * Returns false if no solution is found. n <= KT_LEMKE_MAX. Cost: O(n^2) a pivot. */
static inline bool kt_lemke_solve(int n, const double *M, const double *q, double *z, uint64_t *pivots) {
    static const double delta = 1e-7;
    double scale[KT_LEMKE_MAX], from[KT_LEMKE_MAX] = {0.0};
    kt_lemke t = kt_lemke_begin(n, M, q, 0.0, from, scale);
    bool solved = kt_lemke_run(&t, scale, z, pivots);
    for (int k = 0; k < KT_LEMKE_PROXIMAL && (!solved || k > 0); k++) {
        t = kt_lemke_begin(n, M, q, delta, from, scale);
        solved = kt_lemke_run(&t, scale, z, pivots);
        memcpy(from, z, (size_t)n * sizeof *from);
    }
    return solved;
}

#endif
