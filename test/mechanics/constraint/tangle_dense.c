/* The equations of motion of random closed mechanisms, solved densely in long double, apart from the library. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tangle.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void tangle_system_of(const tangle *g, tangle_system *s) {
    const kt_tree *tree = &g->tree;
    kt_error e = {0};
    kt_need_fine("mass matrix", kt_dynamics_mass(tree->model, tree->data, g->q, s->mass, &e), &e);
    kt_need_fine("bias", kt_dynamics_inverse(tree->model, tree->data, g->q, g->v, NULL, g->external, s->force, &e), &e);
    for (int i = 0; i < tree->nv; i++)
        s->force[i] = g->tau[i] - s->force[i];
    kt_need_fine("equations",
                 kt_loop_equations(tree->model, tree->data, g->t, g->q, g->v, s->jacobian, NULL, NULL, s->drift, &e),
                 &e);
}

/* Independent rows of A, by Gram-Schmidt with pivots; returns their number. */
static int choose_rows(const tangle_system *s, int rows, int nv, int *chosen) {
    static long double a[TANGLE_ROWS][KT_TREE_NV];
    bool taken[TANGLE_ROWS] = {false};
    long double first = 0.0L;
    for (int r = 0; r < rows; r++)
        for (int i = 0; i < nv; i++)
            a[r][i] = (long double)s->jacobian[i * rows + r];
    for (int count = 0;; count++) {
        int best = -1;
        long double most = 0.0L;
        for (int r = 0; r < rows; r++) {
            long double norm = 0.0L;
            for (int i = 0; i < nv; i++)
                norm += a[r][i] * a[r][i];
            if (!taken[r] && norm > most) {
                most = norm;
                best = r;
            }
        }
        if (count == 0)
            first = most;
        if (best < 0 || most < 1e-22L * first) /* 1e-11 of the first */
            return count;
        taken[best] = true;
        chosen[count] = best;
        for (int r = 0; r < rows; r++) {
            long double dot = 0.0L;
            for (int i = 0; i < nv && !taken[r]; i++)
                dot += a[r][i] * a[best][i];
            for (int i = 0; i < nv && !taken[r]; i++)
                a[r][i] -= dot / most * a[best][i];
        }
    }
}

/* K <- K^-1 by Gauss and Jordan with row pivots. */
static void invert(long double *k, int n) {
    int *order = malloc((size_t)n * sizeof *order);
    for (int j = 0; j < n; j++) {
        int best = j;
        for (int i = j; i < n; i++)
            if (fabsl(k[i * n + j]) > fabsl(k[best * n + j]))
                best = i;
        order[j] = best;
        for (int c = 0; c < n; c++) {
            const long double t = k[j * n + c];
            k[j * n + c] = k[best * n + c];
            k[best * n + c] = t;
        }
        const long double d = 1.0L / k[j * n + j];
        k[j * n + j] = 1.0L;
        for (int c = 0; c < n; c++)
            k[j * n + c] *= d;
        for (int i = 0; i < n; i++) {
            const long double f = k[i * n + j];
            if (i == j)
                continue;
            k[i * n + j] = 0.0L;
            for (int c = 0; c < n; c++)
                k[i * n + c] -= f * k[j * n + c];
        }
    }
    for (int j = n - 1; j >= 0; j--)
        for (int i = 0; i < n; i++) {
            const long double t = k[i * n + j];
            k[i * n + j] = k[i * n + order[j]];
            k[i * n + order[j]] = t;
        }
    free(order);
}

/* x <- x + K^-1 (right - K x). Multipliers may be so large that their part of the inverse's rounding appears in other
 * coordinates, which the loops hold still. Once x is near, the rest of the right side no longer has this part. */
static void refine(const long double *k, const long double *inverse, int n, const long double *right, long double *x,
                   long double *left) {
    for (int i = 0; i < n; i++) {
        left[i] = right[i];
        for (int j = 0; j < n; j++)
            left[i] -= k[i * n + j] * x[j];
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            x[i] += inverse[i * n + j] * left[j];
}

/* K = [M A'; A 0] of the rows chosen. */
static void lay(const tangle *g, const tangle_system *s, const int *chosen, int rank, long double *k) {
    const int nv = g->tree.nv, n = nv + rank;
    for (int i = 0; i < nv; i++) {
        for (int j = 0; j < nv; j++)
            k[i * n + j] = (long double)s->mass[j * nv + i];
        for (int r = 0; r < rank; r++)
            k[i * n + nv + r] = k[(nv + r) * n + i] = (long double)s->jacobian[i * g->rows + chosen[r]];
    }
}

static long double length(const long double *x, int n) {
    long double sum = 0.0L;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrtl(sum);
}

/* |K_i| |x| + |right_i| and the same of a = way.by, of force or equation i. */
static long double products(const long double *row, int i, int n, int nv, const long double *x, tangle_way way) {
    long double sum = 0.0L, by = 0.0L;
    for (int j = 0; j < nv && way.by; j++) {
        sum += fabsl(row[j] * (long double)way.by[j]);
        by += (long double)way.by[j] * (long double)way.by[j];
    }
    if (way.mixes && i >= nv)
        return length(row, nv) * (length(x, nv) + sqrtl(by));
    for (int j = 0; j < n; j++)
        sum += fabsl(row[j] * x[j]);
    return sum;
}

/* K = [M A'; A 0], x = (a, -lambda), K x = (tau - h, b''). The error is bounded by
 *     |dx| <= eps |K^-1| (|K| |x| + |right|).
 * The last bracket is the largest among forces, and among equations, since orthogonal factors mix them. */
int tangle_solve(const tangle *g, const tangle_system *s, tangle_way way, double *a, double *moved) {
    const int nv = g->tree.nv;
    int chosen[TANGLE_ROWS];
    const int rank = choose_rows(s, g->rows, nv, chosen), n = nv + rank;
    long double *k = calloc((size_t)n * (size_t)n, sizeof *k), *inverse = malloc((size_t)n * (size_t)n * sizeof *k);
    long double *right = malloc(3 * (size_t)n * sizeof *right), *x = right + n, *left = x + n;
    for (int i = 0; i < n; i++)
        right[i] = (long double)(i < nv ? s->force[i] : s->drift[chosen[i - nv]]);
    lay(g, s, chosen, rank, k);
    memcpy(inverse, k, (size_t)(n * n) * sizeof *k);
    invert(inverse, n);
    memset(x, 0, (size_t)n * sizeof *x);
    for (int round = 0; round < 3; round++)
        refine(k, inverse, n, right, x, left);
    long double most[2] = {0.0L, 0.0L};
    for (int i = 0; i < n; i++)
        most[i >= nv] = fmaxl(most[i >= nv], fabsl(right[i]) + products(k + i * n, i, n, nv, x, way));
    for (int i = 0; i < nv; i++) {
        long double sum = 0.0L;
        for (int j = 0; j < n; j++)
            sum += fabsl(inverse[i * n + j]) * most[j >= nv];
        a[i] = (double)x[i];
        moved[i] = DBL_EPSILON * (double)sum;
    }
    free(right);
    free(inverse);
    free(k);
    return rank;
}

double tangle_reach(const tangle *g, bool mass) {
    static tangle_system s;
    const int nv = g->tree.nv;
    int chosen[TANGLE_ROWS];
    long double most = 0.0L;
    tangle_system_of(g, &s);
    for (int i = 0; i < nv * nv && !mass; i++)
        s.mass[i] = i % (nv + 1) == 0;
    const int rank = choose_rows(&s, g->rows, nv, chosen), n = nv + rank;
    long double *k = calloc((size_t)n * (size_t)n, sizeof *k);
    lay(g, &s, chosen, rank, k);
    invert(k, n);
    for (int i = 0; i < nv; i++) {
        long double sum = 0.0L;
        for (int r = nv; r < n; r++)
            sum += fabsl(k[i * n + r]);
        most = fmaxl(most, sum);
    }
    free(k);
    return (double)most;
}
