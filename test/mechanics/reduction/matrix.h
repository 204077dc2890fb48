/* A group that exists in its matrices alone, for the ways to factor it. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_REDUCTION_MATRIX_H
#define KT_TEST_REDUCTION_MATRIX_H

#include "check.h"

#include "compare/reduction.h"

enum { MATRIX_MOST = 45, MATRIX_SQUARE = MATRIX_MOST * MATRIX_MOST };

typedef struct matrix_bench {
    kt_group_work w;
    double *memory;
    size_t count;
    int32_t pivot[MATRIX_MOST];
} matrix_bench;

/* m coordinates, k equations; every number is NaN. */
void matrix_set_up(matrix_bench *b, int m, int k);

/* Releases it; false where something was written beyond its place. */
bool matrix_tear_down(matrix_bench *b);

/* a (m x k) = B C of normal numbers, B m x rank. */
void matrix_draw(kt_random *random, int m, int k, int rank, double *a);

/* The largest magnitude of n numbers. */
double matrix_largest(const double *x, int n);

#endif
