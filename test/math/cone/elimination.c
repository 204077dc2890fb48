/* Elimination in sparse blocks (cone/cone_equations.c) on random heaps: each contact touches one or two bodies. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

enum { CONTACTS = 50, BODIES = 20, ROWS = 3 * CONTACTS, DOFS = 6 * BODIES };

/* W = J J' of n contacts, in the solver's matrix, and a diagonal that makes A = W + 0.1 1 positive definite. */
static void draw_heap(kt_random *random, int n, double (*J)[DOFS], double *W) {
    memset(J, 0, ROWS * sizeof *J);
    for (int i = 0; i < 3 * n; i += 3)
        for (int end = 0, ends = kt_random_int(random, 1, 2); end < ends; end++) {
            const int body = kt_random_int(random, 0, BODIES - 1);
            for (int k = 0; k < 18; k++)
                J[i + k / 6][6 * body + k % 6] = kt_random_normal(random);
        }
    for (int i = 0; i < 3 * n; i++)
        for (int j = 0; j < 3 * n; j++) {
            double sum = i == j ? 0.1 : 0.0;
            for (int k = 0; k < DOFS; k++)
                sum += J[i][k] * J[j][k];
            W[i * 3 * n + j] = sum;
        }
}

/* Writes A to the solver. y = A x. */
static void multiply_blocks(kt_cone *cone, const double *x, double *y) {
    const int n = cone->n, m = 3 * n;
    kt_cone_clear_equations(cone);
    for (int r = 0; r < m; r++) {
        y[r] = 0.0;
        for (int k = 3 * cone->first[r / 3]; k < 3 * cone->first[r / 3 + 1]; k++) {
            const int j = cone->block[k / 3], c = 3 * j + k % 3;
            kt_cone_block(cone, r / 3, j)[3 * (r % 3) + k % 3] = cone->W[r * m + c];
            y[r] += cone->W[r * m + c] * x[c];
        }
    }
}

KT_TEST(elimination_in_blocks_solves_equations_of_heaps) {
    kt_random random = kt_random_of_test();
    const size_t size = kt_cone_size(CONTACTS, CONTACTS);
    char *memory = aligned_alloc(KT_ARENA_ALIGNMENT, size + kt_cone_matrices_size(CONTACTS));
    kt_cone *cone = kt_cone_init(CONTACTS, CONTACTS, memory, memory + size);
    KT_WORST error = kt_worst_make("solution, error");
    double(*J)[DOFS] = malloc(ROWS * sizeof *J);
    int zeros = 0;
    for (int k = 0; k < 100 && J != NULL; k++) {
        double x[ROWS], y[ROWS];
        cone->n = kt_random_int(&random, 1, CONTACTS);
        draw_heap(&random, cone->n, J, cone->W);
        kt_cone_list_blocks(cone);
        for (int r = 0; r < 3 * cone->n; r++)
            x[r] = kt_random_normal(&random);
        multiply_blocks(cone, x, y);
        kt_cone_eliminate(cone, y);
        for (int r = 0; r < 3 * cone->n; r++)
            kt_worst_below(&error, fabs(y[r] - x[r]), 1e-12, "problem %d: row %d", k, r);
        zeros += cone->n * cone->n - cone->blocks;
    }
    kt_check_above("blocks that stay zero", zeros, 1000.0);
    free(J);
    free(memory);
}
