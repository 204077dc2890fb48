/* The linear equations A x = y of the cone solver, in blocks of 3 x 3, one row of blocks for each contact.
 *
 * Contacts share a body with a few others. So most blocks of W are zero, and most blocks of A. Elimination without
 * exchanges of contacts keeps it so: block (i, j) becomes nonzero only if an earlier contact couples i and j. A heap of
 * 20 spheres with 50 contacts has 280 blocks, and elimination adds 150. Pivots are chosen within a block of 3 x 3. A
 * small number replaces a pivot that vanishes (static pivoting), since the next step corrects a step that is not exact.
 *
 * X. S. Li, J. W. Demmel, SuperLU_DIST: A scalable distributed-memory sparse direct solver for unsymmetric linear
 * systems, 2003.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include "algebra/lane.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Pivots below this number vanish: scaled problems have entries of about 1. The other number replaces them, so that
 * singular equations have a finite solution. */
static const double vanishing = 1e-11, replacement = 1e-8;

/* ---- the pattern ------------------------------------------------------------------------------------------------- */

/* Whether the block (i, j) of W is not zero. */
static bool is_coupled(const kt_cone *cone, int i, int j) {
    const double *W = cone->W + 9 * i * cone->n + 3 * j;
    const int m = 3 * cone->n;
    bool any = i == j;
    for (int k = 0; k < 9 && !any; k++)
        any = W[k / 3 * m + k % 3] != 0.0;
    return any;
}

/* Lists the later contacts to which elimination of contact k couples it, and couples these with each other. */
static int list_later(kt_cone *cone, int k, int count) {
    const int n = cone->n;
    cone->later_first[k] = count;
    for (int j = k + 1; j < n; j++)
        if (cone->place[k * n + j] >= 0)
            cone->later[count++] = j;
    for (int a = cone->later_first[k]; a < count; a++)
        for (int b = cone->later_first[k]; b < count; b++)
            cone->place[cone->later[a] * n + cone->later[b]] = 0;
    return count;
}

void kt_cone_list_blocks(kt_cone *cone) {
    const int n = cone->n;
    int count = 0, later = 0;
    for (int k = 0; k < n * n; k++)
        cone->place[k] = -1;
    for (int i = 0; i < n; i++) {
        cone->first[i] = count;
        for (int j = 0; j < n; j++)
            if (is_coupled(cone, i, j)) {
                cone->block[count++] = j;
                cone->place[i * n + j] = cone->place[j * n + i] = 0;
            }
    }
    cone->first[n] = count;
    cone->blocks = 0;
    for (int k = 0; k < n; k++) {
        later = list_later(cone, k, later);
        cone->place[k * n + k] = cone->blocks++;
        for (int a = cone->later_first[k]; a < later; a++) {
            cone->place[k * n + cone->later[a]] = cone->blocks++;
            cone->place[cone->later[a] * n + k] = cone->blocks++;
        }
    }
    cone->later_first[n] = later;
}

/* ---- elimination ------------------------------------------------------------------------------------------------- */

void kt_cone_clear_equations(kt_cone *cone) { memset(cone->A, 0, 9 * (size_t)cone->blocks * sizeof *cone->A); }

/* A block has rows of three numbers, which are read and written as a pair and one more. */
typedef struct block_row {
    kt_v2 pair;
    double last;
} block_row;

static inline block_row load_row(const double *x) { return (block_row){kt_v2_load(x), x[2]}; }
static inline void store_row(double *x, block_row row) {
    kt_v2_store(x, row.pair);
    x[2] = row.last;
}

/* A row of a b, for a row of a and the block b. */
static inline block_row multiply_row(const double *a, const block_row b[3]) {
    return (block_row){kt_v2_splat(a[0]) * b[0].pair + kt_v2_splat(a[1]) * b[1].pair + kt_v2_splat(a[2]) * b[2].pair,
                       a[0] * b[0].last + a[1] * b[1].last + a[2] * b[2].last};
}

/* to -= a b of blocks. */
static inline void subtract_product(const double *a, const double *restrict b, double *restrict to) {
    const block_row row[3] = {load_row(b), load_row(b + 3), load_row(b + 6)};
    for (int r = 0; r < 3; r++) {
        const block_row old = load_row(to + 3 * r), product = multiply_row(a + 3 * r, row);
        store_row(to + 3 * r, (block_row){old.pair - product.pair, old.last - product.last});
    }
}

/* b = a b of blocks. */
static inline void multiply_block(const double *a, double *b) {
    const block_row row[3] = {load_row(b), load_row(b + 3), load_row(b + 6)};
    for (int r = 0; r < 3; r++)
        store_row(b + 3 * r, multiply_row(a + 3 * r, row));
}

/* to -= a x for a block a and numbers x of a contact. */
static inline void subtract_column(const double *a, const double *restrict x, double *restrict to) {
    for (int r = 0; r < 3; r++)
        to[r] -= a[3 * r] * x[0] + a[3 * r + 1] * x[1] + a[3 * r + 2] * x[2];
}

/* The inverse of a block, with partial pivoting. */
static void invert_block(const double *block, double *inverse) {
    double a[3][6] = {{block[0], block[1], block[2], 1.0, 0.0, 0.0},
                      {block[3], block[4], block[5], 0.0, 1.0, 0.0},
                      {block[6], block[7], block[8], 0.0, 0.0, 1.0}};
    for (int k = 0; k < 3; k++) {
        int r = k;
        for (int i = k + 1; i < 3; i++)
            r = fabs(a[i][k]) > fabs(a[r][k]) ? i : r;
        if (fabs(a[r][k]) <= vanishing)
            a[r][k] = replacement;
        const double over = 1.0 / a[r][k];
        for (int c = 0; c < 6; c++) {
            const double t = a[r][c] * over;
            a[r][c] = a[k][c];
            a[k][c] = t;
        }
        for (int i = 0; i < 3; i++) {
            const double factor = i == k ? 0.0 : a[i][k];
            for (int c = 0; c < 6; c++)
                a[i][c] -= factor * a[k][c];
        }
    }
    for (int k = 0; k < 9; k++)
        inverse[k] = a[k / 3][3 + k % 3];
}

/* Eliminates the unknowns of contact k from later contacts. The inverse of its pivot multiplies its row of blocks. */
static void eliminate_contact(kt_cone *cone, int k, double *x) {
    const int *later = cone->later + cone->later_first[k], count = cone->later_first[k + 1] - cone->later_first[k];
    double inverse[9], *own = x + 3 * k;
    invert_block(kt_cone_block(cone, k, k), inverse);
    const double y[3] = {own[0], own[1], own[2]};
    for (int r = 0; r < 3; r++)
        own[r] = inverse[3 * r] * y[0] + inverse[3 * r + 1] * y[1] + inverse[3 * r + 2] * y[2];
    for (int b = 0; b < count; b++)
        multiply_block(inverse, kt_cone_block(cone, k, later[b]));
    for (int a = 0; a < count; a++) {
        const double *below = kt_cone_block(cone, later[a], k);
        subtract_column(below, own, x + 3 * later[a]);
        for (int b = 0; b < count; b++)
            subtract_product(below, kt_cone_block(cone, k, later[b]), kt_cone_block(cone, later[a], later[b]));
    }
}

void kt_cone_eliminate(kt_cone *cone, double *x) {
    for (int k = 0; k < cone->n; k++)
        eliminate_contact(cone, k, x);
    for (int k = cone->n - 1; k >= 0; k--)
        for (int b = cone->later_first[k]; b < cone->later_first[k + 1]; b++)
            subtract_column(kt_cone_block(cone, k, cone->later[b]), x + 3 * cone->later[b], x + 3 * k);
}
