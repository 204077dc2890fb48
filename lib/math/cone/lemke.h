/* Lemke's method for the linear complementarity problem
 *
 *     w = M z + q >= 0,  z >= 0,  w' z = 0.
 *
 * An artificial variable z0 that is added to all w makes a feasible start, and pivots follow complementary variables
 * until z0 leaves the basis. Ties are broken lexicographically (the columns of w hold the inverse of the basis), so
 * that no basis comes again. The method finds a solution if M is positive semidefinite and a solution exists.
 *
 * Source: Cottle, Pang, Stone 1992, The linear complementarity problem, algorithm 4.4.5.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_LEMKE_H
#define KT_LINEAR_LEMKE_H

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { KT_LEMKE_PIVOTS = 50 /* for each unknown */, KT_LEMKE_PROXIMAL = 100 };

/* Columns: w, z, z0, right-hand side. */
typedef struct kt_lemke {
    int n;
    double *basis; /* n: the column of the variable of each row */
    double *scale; /* n: of the variables */
    double *from;  /* n: a proximal point */
    double *rows;  /* n rows */
} kt_lemke;

static inline int kt_lemke_width(const kt_lemke *t) { return 2 * t->n + 2; }
static inline double *kt_lemke_row(const kt_lemke *t, int i) { return t->rows + (ptrdiff_t)i * kt_lemke_width(t); }
static inline int kt_lemke_basis(const kt_lemke *t, int i) { return (int)t->basis[i]; }

/* The count of numbers that kt_lemke_solve needs for n unknowns. */
static inline size_t kt_lemke_count(size_t n) { return n * (2 * n + 2) + 3 * n; }

/* The variable of `column` replaces the variable of row r in the basis: the column becomes the unit vector of that
 * row. */
static inline void kt_lemke_pivot(kt_lemke *t, int r, int column) {
    assert(r >= 0 && r < t->n && column >= 0 && column < kt_lemke_width(t) - 1);
    assert(kt_lemke_row(t, r)[column] != 0.0);
    double *row = kt_lemke_row(t, r);
    const double by = row[column];
    for (int j = 0; j < kt_lemke_width(t); j++)
        row[j] /= by;
    for (int i = 0; i < t->n; i++) {
        double *other = kt_lemke_row(t, i);
        const double factor = other[column];
        for (int j = 0; i != r && factor != 0.0 && j < kt_lemke_width(t); j++)
            other[j] -= factor * row[j];
    }
    t->basis[r] = column;
}

/* The lexicographic ratio test, which excludes cycles: whether row a leaves the basis before row b. The row with the
 * smaller ratio (right-hand side over the entry in the entering column) leaves. Among equal ratios, those of the
 * columns of w decide, one after the other. */
static inline bool kt_lemke_leaves_first(const kt_lemke *t, int a, int b, int column) {
    const double *of_a = kt_lemke_row(t, a), *of_b = kt_lemke_row(t, b), pa = of_a[column], pb = of_b[column];
    const int last = kt_lemke_width(t) - 1;
    for (int k = -1; k < t->n; k++) {
        const int j = k < 0 ? last : k; /* the right-hand sides first; columns 0 to n - 1 are those of w */
        const double x = of_a[j] / pa, y = of_b[j] / pb;
        if (x != y)
            return x < y;
    }
    return false;
}

/* The row whose variable leaves the basis when the variable of `column` enters, or -1 if no row bounds the entering
 * variable (a ray). */
static inline int kt_lemke_leaving(const kt_lemke *t, int column, double least) {
    int r = -1;
    for (int i = 0; i < t->n; i++)
        if (kt_lemke_row(t, i)[column] > least && (r < 0 || kt_lemke_leaves_first(t, i, r, column)))
            r = i;
    return r;
}

/* Writes the tableau of the problem, scaled to a diagonal of ones: with D = diag(M)^-1/2, D M D + delta and D q - delta
 * z0, where z0 is t->from. */
static inline void kt_lemke_begin(kt_lemke *t, const double *M, const double *q, double delta) {
    const int n = t->n;
    for (int i = 0; i < n; i++)
        t->scale[i] = M[i * n + i] > 0.0 ? 1.0 / sqrt(M[i * n + i]) : 1.0;
    memset(t->rows, 0, (size_t)(n * kt_lemke_width(t)) * sizeof *t->rows);
    for (int i = 0; i < n; i++) {
        double *row = kt_lemke_row(t, i);
        t->basis[i] = i;
        row[i] = 1.0;
        for (int j = 0; j < n; j++)
            row[n + j] = -t->scale[i] * M[i * n + j] * t->scale[j];
        row[n + i] -= delta;
        row[2 * n] = -1.0;
        row[2 * n + 1] = t->scale[i] * q[i] - delta * t->from[i] / t->scale[i];
    }
}

/* Pivots until a solution is found, and writes this solution to z. */
static inline bool kt_lemke_run(kt_lemke *t, double *z, uint64_t *pivots) {
    static const double least = 1e-10; /* least entry that is not rounding, where the diagonal is 1 */
    const int n = t->n, last = 2 * n + 1;
    int entering = 2 * n, r = 0;
    for (int i = 0; i < n; i++) {
        z[i] = 0.0;
        r = kt_lemke_row(t, i)[last] < kt_lemke_row(t, r)[last] ? i : r;
    }
    if (n == 0 || kt_lemke_row(t, r)[last] >= 0.0)
        return true;
    for (int k = 0; k < KT_LEMKE_PIVOTS * n && r >= 0; k++) {
        const int left = kt_lemke_basis(t, r);
        kt_lemke_pivot(t, r, entering);
        ++*pivots;
        if (left == 2 * n) {
            for (int i = 0; i < n; i++) {
                const int variable = kt_lemke_basis(t, i) - n;
                if (variable >= 0)
                    z[variable] = t->scale[variable] * fmax(kt_lemke_row(t, i)[last], 0.0);
            }
            return true;
        }
        entering = left < n ? left + n : left - n;
        r = kt_lemke_leaving(t, entering, least);
    }
    return false;
}

/* Whether z, the solution of the proximal problem of t->from, solves the problem itself up to rounding. In row i, the
 * two problems differ by delta (z - z0), in scaled variables. */
static inline bool kt_lemke_has_converged(const kt_lemke *t, const double *M, const double *q, double delta,
                                          const double *z) {
    double residual = 0.0, size = 0.0;
    for (int i = 0; i < t->n; i++) {
        double terms = fabs(q[i]);
        for (int j = 0; j < t->n; j++)
            terms += fabs(M[i * t->n + j] * z[j]);
        residual = fmax(residual, delta * fabs(z[i] - t->from[i]) / t->scale[i]);
        size = fmax(size, terms * t->scale[i]);
    }
    return residual <= t->n * DBL_EPSILON * size;
}

/* Writes z (n); M is n x n by rows; work has room for kt_lemke_count(n) numbers. Adds the pivots to *pivots. If M is
 * singular, rounding can leave a solvable problem without a solution. Then the proximal points z_k+1 solve the problem
 * of (M + delta) z + q - delta z_k, and converge to a solution (Rockafellar 1976). Most problems need two points. The
 * least nonzero eigenvalue of M may be near delta, or below. For symmetric M, the residual in w after k points is
 * nevertheless at most delta / k times the distance of the start from a solution (Guler, doi:10.1137/0329022). Returns
 * false if no solution is found. Cost: O(n^2) a pivot. */
static inline bool kt_lemke_solve(int n, const double *M, const double *q, double *work, double *z, uint64_t *pivots) {
    static const double delta = 1e-7;
    kt_lemke t = {.n = n, .basis = work, .scale = work + n, .from = work + 2 * n, .rows = work + 3 * n};
    memset(work + 2 * n, 0, (size_t)n * sizeof *work);
    kt_lemke_begin(&t, M, q, 0.0);
    bool solved = kt_lemke_run(&t, z, pivots), converged = solved;
    for (int k = 0; k < KT_LEMKE_PROXIMAL && !converged && (solved || k == 0); k++) {
        kt_lemke_begin(&t, M, q, delta);
        solved = kt_lemke_run(&t, z, pivots);
        converged = kt_lemke_has_converged(&t, M, q, delta, z);
        memcpy(t.from, z, (size_t)n * sizeof *z);
    }
    return solved;
}

#endif
