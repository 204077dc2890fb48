/* SPDX-License-Identifier: Apache-2.0 */
#include "matrix.h"

#include <math.h>
#include <stdlib.h>

enum { CANARY = 16 };

static const double guard = 1234.5;

void matrix_set_up(matrix_bench *b, int m, int k) {
    kt_group group = {.v_count = m, .row_count = k, .count = {k, k}};
    b->count = kt_group_layout(&group);
    b->memory = aligned_alloc(64, (b->count + CANARY) * sizeof(double));
    for (size_t i = 0; i < b->count + CANARY; i++)
        b->memory[i] = i < b->count ? (double)NAN : guard; /* nothing that has not been written may be read */
    const size_t *at = group.at;
    b->w = (kt_group_work){.m = m, .k = k, .pivot = b->pivot, .tolerance = KT_RANK_TOLERANCE};
#define MATRIX_PLACE(name, count, meaning) b->w.name = b->memory + *at++;
    KT_GROUP_FIELDS(MATRIX_PLACE)
#undef MATRIX_PLACE
}

bool matrix_tear_down(matrix_bench *b) {
    bool whole = true;
    for (size_t i = b->count; i < b->count + CANARY; i++)
        whole &= b->memory[i] == guard;
    free(b->memory);
    return whole;
}

void matrix_draw(kt_random *random, int m, int k, int rank, double *a) {
    double b[MATRIX_SQUARE], c[MATRIX_SQUARE];
    for (int i = 0; i < m * rank; i++)
        b[i] = kt_random_normal(random);
    for (int i = 0; i < rank * k; i++)
        c[i] = kt_random_normal(random);
    for (int j = 0; j < k; j++)
        for (int i = 0; i < m; i++) {
            a[j * m + i] = 0.0;
            for (int l = 0; l < rank; l++)
                a[j * m + i] += b[l * m + i] * c[j * rank + l];
        }
}

double matrix_largest(const double *x, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}
