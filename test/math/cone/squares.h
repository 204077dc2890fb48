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
    double normal[SQUARES_ROWS][SQUARES_ROWS], z[SQUARES_ROWS];
} squares;

/* Solves the normal equations of the passive columns, to z. Returns false if they are dependent. */
static inline bool solve_passive(squares *s) {
    for (int i = 0; i < s->n; i++) {
        s->z[i] = 0.0;
        for (int k = 0; k < s->m; k++)
            s->z[i] += s->A[s->passive[i]][k] * s->c[k];
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = 0; k < s->m; k++)
                sum += s->A[s->passive[i]][k] * s->A[s->passive[j]][k];
            const double own = sum;
            for (int k = 0; k < j; k++)
                sum -= s->normal[i][k] * s->normal[j][k];
            if (i == j && !(sum > 1e-12 * own))
                return false;
            s->normal[i][j] = i == j ? sqrt(sum) : sum / s->normal[j][j];
        }
    }
    for (int i = 0; i < s->n; i++) {
        for (int k = 0; k < i; k++)
            s->z[i] -= s->normal[i][k] * s->z[k];
        s->z[i] /= s->normal[i][i];
    }
    for (int i = s->n - 1; i >= 0; i--) {
        for (int k = i + 1; k < s->n; k++)
            s->z[i] -= s->normal[k][i] * s->z[k];
        s->z[i] /= s->normal[i][i];
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

/* Minimises |A x - c| for x >= 0. Returns the minimum, relative to |c|. */
static inline double solve_squares(squares *s) {
    double norm = 0.0, left = 0.0;
    memset(s->x, 0, sizeof s->x);
    memset(s->barred, 0, sizeof s->barred);
    s->n = 0;
    for (int k = 0; k < s->m; k++)
        norm += s->c[k] * s->c[k];
    for (int turn = 0; turn < 2000; turn++) {
        double r[SQUARES_ROWS], most = 1e-9 * sqrt(norm);
        int best = -1;
        left = 0.0;
        for (int k = 0; k < s->m; k++) {
            r[k] = s->c[k];
            for (int i = 0; i < s->n; i++)
                r[k] -= s->A[s->passive[i]][k] * s->x[s->passive[i]];
            left += r[k] * r[k];
        }
        for (int j = 0; j < s->columns; j++) {
            double along = 0.0;
            for (int k = 0; k < s->m; k++)
                along += s->A[j][k] * r[k];
            const bool may = s->x[j] == 0.0 && !s->barred[j];
            best = along > most && may ? j : best;
            most = may ? fmax(most, along) : most;
        }
        if (best < 0 || s->n == s->m)
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
