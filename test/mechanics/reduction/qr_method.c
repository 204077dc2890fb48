/* The ways to factor a group's equations, against LAPACKE's dgeqp3 on every size and rank.
 *
 * A' = B C with B (m x r) and C (r x k) of normal numbers has rank r. Errors are proportional to |A| max(m, k) for
 * factors, and to another 1 / R_rr for solutions (kappa). The bounds are multiples of eps times these. The multiples
 * were measured.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "matrix.h"

#include "linear/lapack.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Q X for reflectors I - t u u' as LAPACK keeps them; X is m x columns. */
static void apply_q(const kt_group_work *w, int rank, double *x, int columns) {
    for (int c = 0; c < columns; c++)
        for (int j = rank - 1; j >= 0; j--) {
            const double *u = w->factor + j * w->m;
            double *y = x + c * w->m, sum = y[j];
            for (int i = j + 1; i < w->m; i++)
                sum += u[i] * y[i];
            sum *= w->reflector_scale[j];
            y[j] -= sum;
            for (int i = j + 1; i < w->m; i++)
                y[i] -= sum * u[i];
        }
}

/* |A' P - Q R|, which at full rank of the factor is rounding. */
static double factor_error(const kt_group_work *w, int rank) {
    double qr[MATRIX_SQUARE], worst = 0.0;
    const int m = w->m;
    for (int c = 0; c < w->k; c++)
        for (int i = 0; i < m; i++)
            qr[c * m + i] = i < rank && i <= c ? w->factor[c * m + i] : 0.0;
    apply_q(w, rank, qr, w->k);
    for (int c = 0; c < w->k; c++)
        for (int i = 0; i < m; i++)
            worst = fmax(worst, fabs(qr[c * m + i] - w->a[w->pivot[c] * m + i]));
    return worst;
}

/* |A N|, or |N' N - 1| */
static double basis_error(const kt_group_work *w, int rank, bool orthonormal) {
    double worst = 0.0;
    const int m = w->m, free = m - rank;
    for (int c = 0; c < free; c++)
        for (int r = 0; r < (orthonormal ? free : w->k); r++) {
            const double *row = orthonormal ? w->basis + r * m : w->a + r * m;
            double sum = orthonormal && r == c ? -1.0 : 0.0;
            for (int i = 0; i < m; i++)
                sum += row[i] * w->basis[c * m + i];
            worst = fmax(worst, fabs(sum));
        }
    return worst;
}

/* The error A x - b, or the part of x in the null space. */
static double solution_error(const kt_group_work *w, int rank, const double *x, const double *b, bool least) {
    double worst = 0.0;
    for (int r = 0; r < (least ? w->m - rank : w->k); r++) {
        const double *row = least ? w->basis + r * w->m : w->a + r * w->m;
        double sum = least ? 0.0 : -b[r];
        for (int i = 0; i < w->m; i++)
            sum += row[i] * x[i];
        worst = fmax(worst, fabs(sum));
    }
    return worst;
}

/* A' lambda - g */
static double multiplier_error(const kt_group_work *w, const double *lambda, const double *g) {
    double worst = 0.0;
    for (int i = 0; i < w->m; i++) {
        double sum = -g[i];
        for (int r = 0; r < w->k; r++)
            sum += w->a[r * w->m + i] * lambda[r];
        worst = fmax(worst, fabs(sum));
    }
    return worst;
}

typedef struct tally {
    kt_worst factor, diagonal, null, orthonormal, solved, least, balanced, spare;
    long ranks, pivots, cases, overrun;
} tally;

static tally make_tally(void) {
    return (tally){.factor = kt_worst_make("A' P = Q R"),
                   .diagonal = kt_worst_make("|R_ii| is that of LAPACK"),
                   .null = kt_worst_make("A N = 0"),
                   .orthonormal = kt_worst_make("N' N = 1"),
                   .solved = kt_worst_make("A x = b"),
                   .least = kt_worst_make("N' x = 0"),
                   .balanced = kt_worst_make("A' lambda = g"),
                   .spare = kt_worst_make("multipliers of dependent equations")};
}

/* Solutions, null space and multipliers of a factored matrix of this rank. */
static void check_solutions(const kt_reduction_kind *kind, const kt_group_work *w, int rank, kt_random *random,
                            tally *t) {
    const int m = w->m, k = w->k, longer = m > k ? m : k;
    double origin[MATRIX_MOST], b[MATRIX_MOST] = {0.0}, x[MATRIX_MOST], g[MATRIX_MOST] = {0.0}, kept[MATRIX_MOST],
                                lambda[MATRIX_MOST];
    const double size = matrix_largest(w->a, m * k) * longer, eps = DBL_EPSILON;
    const double kappa = rank ? size / kind->size(w, rank - 1) : 1.0;
    for (int i = 0; i < m; i++)
        origin[i] = kt_random_normal(random);
    for (int r = 0; r < k; r++)
        for (int i = 0; i < m; i++)
            b[r] += w->a[r * m + i] * origin[i];
    for (int r = 0; r < k; r++)
        kept[r] = kt_random_normal(random);
    for (int i = 0; i < m; i++)
        for (int r = 0; r < k; r++)
            g[i] += w->a[r * m + i] * kept[r];
    const double expected = matrix_largest(g, m);
    memcpy(kept, g, sizeof kept);
    kind->particular(w, rank, b, x);
    kind->basis(w, rank);
    kind->multipliers(w, rank, g, lambda);
    t->cases++;
    /* a basis that is not orthonormal has columns of size |L11^-1 L21'|, and dependent coordinates that large */
    const double width = fmax(1.0, matrix_largest(w->basis, m * (m - rank)));
    kt_worst_below(&t->null, basis_error(w, rank, false), 4.0 * eps * size * width, "%d x %d, rank %d", m, k, rank);
    if (m > rank && kind->least) {
        kt_worst_below(&t->orthonormal, basis_error(w, rank, true), 8.0 * eps * sqrt(m), "%d x %d, rank %d", m, k,
                       rank);
        kt_worst_below(&t->least, solution_error(w, rank, x, NULL, true),
                       8.0 * eps * fmax(1.0, matrix_largest(x, m)) * sqrt(m), "%d x %d, rank %d", m, k, rank);
    }
    if (rank == 0)
        return;
    kt_worst_below(&t->solved, solution_error(w, rank, x, b, false),
                   8.0 * eps * (size * fmax(1.0, matrix_largest(x, m)) + kappa * matrix_largest(b, k)),
                   "%d x %d, rank %d", m, k, rank);
    kt_worst_below(&t->balanced, multiplier_error(w, lambda, kept),
                   8.0 * eps * (size * fmax(1.0, matrix_largest(lambda, k)) + kappa * expected), "%d x %d, rank %d", m,
                   k, rank);
    int spare = 0;
    for (int r = 0; r < k; r++)
        spare += lambda[r] == 0.0;
    if (kind->least && kind->size(w, 0) != w->reflector_scale[0]) /* not singular values, whose lambda is least */
        kt_worst_below(&t->spare, fabs((double)(spare - (k - rank))), 0.5, "%d x %d, rank %d", m, k, rank);
}

static void check_rank(const kt_reduction_kind *kind, kt_random *random, int m, int k, int rank, tally *t) {
    matrix_bench b;
    matrix_set_up(&b, m, k);
    matrix_draw(random, m, k, rank, b.w.a);
    const int found = kind->factor(&b.w, m < k ? m : k);
    t->ranks += found != rank;
    if (found == rank)
        check_solutions(kind, &b.w, rank, random, t);
    t->overrun += !matrix_tear_down(&b);
}

static void check_tally(const tally *t, bool least) {
    kt_check_equal_int("ranks that are not what they should be", t->ranks, 0);
    kt_check_equal_int("matrices that reach beyond their place", t->overrun, 0);
    kt_check_worst(&t->null);
    if (least) {
        kt_check_worst(&t->orthonormal);
        kt_check_worst(&t->least);
    }
    kt_check_worst(&t->solved);
    kt_check_worst(&t->balanced);
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

/* All sizes up to `45 x 45` and all their ranks: 31395 matrices. */
KT_TEST(householder_solves_every_size_and_rank) {
    kt_random random = kt_random_of_test();
    tally t = make_tally();
    for (int m = 1; m <= MATRIX_MOST; m++)
        for (int k = 1; k <= MATRIX_MOST; k++)
            for (int rank = 0; rank <= (m < k ? m : k); rank++)
                check_rank(&kt_reduction_qr_baseline, &random, m, k, rank, &t);
    check_tally(&t, true);
    kt_check_worst(&t.spare);
}

KT_TEST(householder_factors_as_lapack_does) {
    kt_random random = kt_random_of_test();
    tally t = make_tally();
    for (int m = 1; m <= MATRIX_MOST; m++)
        for (int k = 1; k <= MATRIX_MOST; k++)
            for (int rank = 0; rank <= (m < k ? m : k); rank += 1 + rank / 5) {
                matrix_bench b;
                double a[MATRIX_SQUARE], scale[MATRIX_MOST], work[64 * (MATRIX_MOST + 1)];
                int32_t pivot[MATRIX_MOST];
                matrix_set_up(&b, m, k);
                matrix_draw(&random, m, k, rank, b.w.a);
                memcpy(a, b.w.a, (size_t)(m * k) * sizeof *a);
                t.cases += kt_lapack_geqp3(m, k, a, pivot, scale, work, 64 * (MATRIX_MOST + 1)) != 0;
                const int found = kt_reduction_qr_baseline.factor(&b.w, m < k ? m : k);
                const double size = fmax(matrix_largest(b.w.a, m * k), DBL_MIN) * (m > k ? m : k);
                t.ranks += found != rank;
                for (int i = 0; i < rank && found == rank; i++) {
                    const double ours = kt_reduction_qr_baseline.size(&b.w, i);
                    kt_worst_near(&t.diagonal, ours, fabs(a[i * m + i]), 2.0 * DBL_EPSILON * size,
                                  "%d x %d, rank %d, %d", m, k, rank, i);
                    t.pivots += b.w.pivot[i] != pivot[i] - 1;
                }
                if (found == rank)
                    kt_worst_below(&t.factor, factor_error(&b.w, rank), 2.0 * DBL_EPSILON * size, "%d x %d, rank %d", m,
                                   k, rank);
                (void)matrix_tear_down(&b);
            }
    kt_check_equal_int("calls that LAPACK rejects", t.cases, 0);
    kt_check_equal_int("ranks that are not what they should be", t.ranks, 0);
    kt_check_equal_int("pivots that LAPACK does not take", t.pivots, 0);
    kt_check_worst(&t.diagonal);
    kt_check_worst(&t.factor);
}

KT_TEST(singular_values_solve_every_size_and_rank) {
    kt_random random = kt_random_of_test();
    tally t = make_tally();
    for (int m = 1; m <= MATRIX_MOST; m += 1 + m / 12)
        for (int k = 1; k <= MATRIX_MOST; k += 1 + k / 12)
            for (int rank = 0; rank <= (m < k ? m : k); rank += 1 + rank / 8)
                check_rank(&kt_reduction_svd_baseline, &random, m, k, rank, &t);
    check_tally(&t, true);
}

KT_TEST(partitioning_solves_every_size_and_rank) {
    kt_random random = kt_random_of_test();
    tally t = make_tally();
    for (int m = 1; m <= MATRIX_MOST; m += 1 + m / 16)
        for (int k = 1; k <= MATRIX_MOST; k += 1 + k / 16)
            for (int rank = 0; rank <= (m < k ? m : k); rank++)
                check_rank(&kt_reduction_partition_baseline, &random, m, k, rank, &t);
    check_tally(&t, false);
}
