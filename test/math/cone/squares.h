/* Nonnegative least squares (Lawson and Hanson, doi:10.1137/1.9781611971217): an oracle of cones that are polygons. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SQUARES_H
#define KT_TEST_SQUARES_H

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { SQUARES_ROWS = 30, SQUARES_COLUMNS = 8 * 96 };

typedef struct squares {
    int m, columns, n, passive[SQUARES_ROWS];
    double A[SQUARES_COLUMNS][SQUARES_ROWS], c[SQUARES_ROWS], x[SQUARES_COLUMNS];
    bool barred[SQUARES_COLUMNS]; /* they depend on passive columns */
    double basis[SQUARES_ROWS][SQUARES_ROWS], factor[SQUARES_ROWS][SQUARES_ROWS], z[SQUARES_ROWS];
} squares;

/* Finds the least squares of the passive columns, z, with an orthonormal basis of them. Returns false if they are
 * dependent. */
static inline bool solve_passive(squares *s) {
    for (int i = 0; i < s->n; i++) {
        double *q = s->basis[i], own = 0.0, left = 0.0;
        memcpy(q, s->A[s->passive[i]], sizeof s->basis[i]);
        memset(s->factor[i], 0, sizeof s->factor[i]);
        for (int k = 0; k < s->m; k++)
            own += q[k] * q[k];
        for (int pass = 0; pass < 2; pass++)
            for (int j = 0; j < i; j++) {
                double along = 0.0;
                for (int k = 0; k < s->m; k++)
                    along += q[k] * s->basis[j][k];
                for (int k = 0; k < s->m; k++)
                    q[k] -= along * s->basis[j][k];
                s->factor[i][j] += along;
            }
        for (int k = 0; k < s->m; k++)
            left += q[k] * q[k];
        if (!(left > 1e-20 * own))
            return false;
        s->factor[i][i] = sqrt(left);
        for (int k = 0; k < s->m; k++)
            q[k] /= sqrt(left);
    }
    for (int i = s->n - 1; i >= 0; i--) {
        s->z[i] = 0.0;
        for (int k = 0; k < s->m; k++)
            s->z[i] += s->basis[i][k] * s->c[k];
        for (int k = i + 1; k < s->n; k++)
            s->z[i] -= s->factor[k][i] * s->z[k];
        s->z[i] /= s->factor[i][i];
    }
    return true;
}

/* Moves x of the passive columns to z, as far as it stays positive. Returns whether all of it did. */
static inline bool move_to_passive(squares *s) {
    double part = 1.0;
    int kept = 0, first = -1;
    for (int i = 0; i < s->n; i++) {
        const double x = s->x[s->passive[i]];
        if (s->z[i] <= 0.0 && x / (x - s->z[i]) < part) {
            part = x / (x - s->z[i]);
            first = i;
        }
    }
    for (int i = 0; i < s->n; i++) {
        double *x = &s->x[s->passive[i]];
        *x += part * (s->z[i] - *x);
        if (i == first || *x <= 0.0)
            *x = 0.0;
        else
            s->passive[kept++] = s->passive[i];
    }
    const bool all = kept == s->n;
    s->n = kept;
    return all;
}

/* Minimises |A x - c| for x >= 0. Returns the minimum, relative to |c|. The slope A' r is compared with the residual r,
 * because r^2 = x' A' r if c is in the cone. */
static inline double solve_squares(squares *s) {
    double norm = 0.0, left = 0.0;
    memset(s->x, 0, sizeof s->x);
    memset(s->barred, 0, sizeof s->barred);
    s->n = 0;
    for (int k = 0; k < s->m; k++)
        norm += s->c[k] * s->c[k];
    for (int turn = 0; turn < 2000; turn++) {
        double r[SQUARES_ROWS], most;
        int best = -1;
        left = 0.0;
        for (int k = 0; k < s->m; k++) {
            r[k] = s->c[k];
            for (int i = 0; i < s->n; i++)
                r[k] -= s->A[s->passive[i]][k] * s->x[s->passive[i]];
            left += r[k] * r[k];
        }
        most = 1e-9 * sqrt(left);
        for (int j = 0; j < s->columns; j++) {
            double along = 0.0;
            for (int k = 0; k < s->m; k++)
                along += s->A[j][k] * r[k];
            const bool may = s->x[j] == 0.0 && !s->barred[j];
            best = along > most && may ? j : best;
            most = may ? fmax(most, along) : most;
        }
        if (best < 0 || s->n == s->m || !(left > 1e-26 * norm))
            break;
        s->passive[s->n++] = best;
        if (!solve_passive(s)) {
            s->barred[s->passive[--s->n]] = true;
            continue;
        }
        memset(s->barred, 0, sizeof s->barred);
        while (!move_to_passive(s) && solve_passive(s)) {
        }
    }
    return sqrt(left / norm);
}

#endif
