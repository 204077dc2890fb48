/* The ways to factor a group's equations: their common properties, their limits, and the inputs that they reject. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "matrix.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const kt_reduction_kind *const kinds[] = {&kt_reduction_qr_baseline, &kt_reduction_svd_baseline,
                                                 &kt_reduction_partition_baseline};

/* A solution that is independent of the null space's basis: the x0 + N z that is nearest to y. */
static void nearest(const kt_reduction_kind *kind, const kt_group_work *w, int rank, const double *b, const double *y,
                    double *x) {
    double n[MATRIX_SQUARE];
    const int m = w->m, free = m - rank;
    kind->particular(w, rank, b, x);
    kind->basis(w, rank);
    memcpy(n, w->basis, (size_t)(m * free) * sizeof *n);
    for (int c = 0; c < free; c++) { /* Gram-Schmidt, twice */
        for (int again = 0; again < 2; again++)
            for (int r = 0; r <= c; r++) {
                double dot = 0.0;
                for (int i = 0; i < m; i++)
                    dot += n[r * m + i] * n[c * m + i];
                for (int i = 0; i < m; i++)
                    n[c * m + i] = r == c ? n[c * m + i] / sqrt(dot) : n[c * m + i] - dot * n[r * m + i];
            }
        double along = 0.0;
        for (int i = 0; i < m; i++)
            along += n[c * m + i] * (y[i] - x[i]);
        for (int i = 0; i < m; i++)
            x[i] += along * n[c * m + i];
    }
}

/* A random matrix of the rank, consistent right-hand sides, and a random vector. */
static void draw_equations(kt_random *random, int m, int k, int rank, matrix_bench *b, double *right, double *y) {
    double origin[MATRIX_MOST];
    matrix_set_up(b, m, k);
    matrix_draw(random, m, k, rank, b->w.a);
    for (int i = 0; i < m; i++) {
        origin[i] = kt_random_normal(random);
        y[i] = kt_random_normal(random);
    }
    for (int r = 0; r < k; r++) {
        right[r] = 0.0;
        for (int i = 0; i < m; i++)
            right[r] += b->w.a[r * m + i] * origin[i];
    }
}

/* From 40 coordinates on, LAPACK replaces the plain loop. The test covers the sizes on either side of this limit, and
 * the common properties of all three ways. */
KT_TEST(ways_and_sizes_agree_on_solutions) {
    kt_random random = kt_random_of_test();
    KT_WORST ways = kt_worst_make("the same solution by each way");
    for (int m = 2; m <= MATRIX_MOST; m += m < 36 ? 7 : 1)
        for (int k = 1; k <= MATRIX_MOST; k += 11)
            for (int rank = 1; rank <= (m < k ? m : k); rank += 5) {
                matrix_bench b;
                double right[MATRIX_MOST], y[MATRIX_MOST], x[3][MATRIX_MOST];
                draw_equations(&random, m, k, rank, &b, right, y);
                double kappa = 1.0;
                for (int way = 0; way < 3; way++) {
                    if (kinds[way]->factor(&b.w, m < k ? m : k) == rank)
                        nearest(kinds[way], &b.w, rank, right, y, x[way]);
                    if (way == 1)
                        kappa = kinds[1]->size(&b.w, 0) / kinds[1]->size(&b.w, rank - 1);
                }
                for (int i = 0; i < m; i++) {
                    const double bound = 16.0 * DBL_EPSILON * kappa * fmax(matrix_largest(x[0], m), 1.0);
                    kt_worst_near(&ways, x[1][i], x[0][i], bound, "svd, %d x %d, rank %d", m, k, rank);
                    kt_worst_near(&ways, x[2][i], x[0][i], bound, "partition, %d x %d, rank %d", m, k, rank);
                }
                (void)matrix_tear_down(&b);
            }
}

/* A coordinate that enters no equation makes 40 of 39: the other path, the same answers. */
KT_TEST(large_matrices_are_solved_as_small_ones) {
    kt_random random = kt_random_of_test();
    KT_WORST solution = kt_worst_make("x of 39 and of 40 coordinates");
    for (int k = 1; k < KT_LARGE; k += 4) {
        matrix_bench small, large;
        double right[MATRIX_MOST], x[MATRIX_MOST], y[MATRIX_MOST];
        matrix_set_up(&small, KT_LARGE - 1, k);
        matrix_set_up(&large, KT_LARGE, k);
        matrix_draw(&random, KT_LARGE - 1, k, k, small.w.a);
        for (int r = 0; r < k; r++) {
            right[r] = kt_random_normal(&random);
            memcpy(large.w.a + r * KT_LARGE, small.w.a + r * (KT_LARGE - 1), (KT_LARGE - 1) * sizeof(double));
            large.w.a[r * KT_LARGE + KT_LARGE - 1] = 0.0;
        }
        kt_check_equal_int("rank of 39", kinds[0]->factor(&small.w, k), k);
        kt_check_equal_int("rank of 40", kinds[0]->factor(&large.w, k), k);
        kinds[0]->particular(&small.w, k, right, x);
        kinds[0]->particular(&large.w, k, right, y);
        const double kappa = kinds[0]->size(&small.w, 0) / kinds[0]->size(&small.w, k - 1);
        for (int i = 0; i < KT_LARGE; i++)
            kt_worst_near(&solution, y[i], i < KT_LARGE - 1 ? x[i] : 0.0,
                          8.0 * DBL_EPSILON * kappa * matrix_largest(x, 39), "%d equations", k);
        (void)matrix_tear_down(&small);
        (void)matrix_tear_down(&large);
    }
}

/* The rank ends at the tolerance, which is 1e-10 or 1e-13 of the first direction. The first direction counts as `least`
 * at least. The sizes lie on both sides of the limit from which LAPACK factors. The cases are written for 1e-10;
 * numbers of that size are scaled for 1e-13. */
KT_TEST(rank_ends_at_the_tolerance_of_what_the_first_direction_counts_as) {
    static const int sizes[] = {2, KT_LARGE};
    static const struct {
        double first, second, least;
        int rank;
    } cases[] = {{1.0, 1.1e-10, 0.0, 2}, {1.0, 0.9e-10, 0.0, 1},   {3.0, 3.3e-10, 0.0, 2},      {3.0, 2.7e-10, 0.0, 1},
                 {1.0, 1.1e-10, 1.0, 2}, {1e-3, 1.1e-10, 1.0, 2},  {1e-3, 0.9e-10, 1.0, 1},     {1.1e-10, 0.0, 1.0, 1},
                 {0.9e-10, 0.0, 1.0, 0}, {5e-324, 0.0, 1e-300, 0}, {2e-150, 1e-150, 1e-120, 0}, {0.0, 0.0, 0.0, 0}};
    for (int way = 0; way < 3; way++)
        for (int s = 0; s < 4; s++)
            for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
                const int m = sizes[s % 2];
                const double scale = s < 2 ? 1.0 : 1e-3, first = cases[c].first;
                matrix_bench b;
                matrix_set_up(&b, m, 2);
                memset(b.w.a, 0, (size_t)(2 * m) * sizeof *b.w.a);
                b.w.a[0] = first > 1e-100 && first < 1e-5 ? first * scale : first;
                b.w.a[m + 1] = cases[c].second * scale;
                b.w.least = cases[c].least;
                b.w.tolerance = KT_RANK_TOLERANCE * scale;
                kt_note("way %d, %d coordinates, %g and %g of %g, tolerance %g", way, m, b.w.a[0], b.w.a[m + 1],
                        cases[c].least, b.w.tolerance);
                kt_check_equal_int("rank", kinds[way]->factor(&b.w, 2), cases[c].rank);
                (void)matrix_tear_down(&b);
            }
}

/* More rows look independent than are: those of the matrix_largest pivots count, and are solved. */
KT_TEST(rank_is_capped) {
    kt_random random = kt_random_of_test();
    KT_WORST solved = kt_worst_make("the equations that count");
    for (int way = 0; way < 3; way += 2)
        for (int m = 3; m <= MATRIX_MOST; m += 6)
            for (int k = 3; k <= MATRIX_MOST; k += 6)
                for (int cap = 0; cap < (m < k ? m : k); cap += 1 + cap / 2) {
                    matrix_bench b;
                    double right[MATRIX_MOST], x[MATRIX_MOST];
                    matrix_set_up(&b, m, k);
                    matrix_draw(&random, m, k, m < k ? m : k, b.w.a);
                    for (int r = 0; r < k; r++)
                        right[r] = kt_random_normal(&random);
                    if (kinds[way]->factor(&b.w, cap) != cap) {
                        kt_check_true("the rank is the cap", false);
                        break;
                    }
                    kinds[way]->particular(&b.w, cap, right, x);
                    const double kappa =
                        cap ? matrix_largest(b.w.a, m * k) * (m > k ? m : k) / kinds[way]->size(&b.w, cap - 1) : 1.0;
                    for (int r = 0; r < cap; r++) {
                        const int row = b.w.pivot[r];
                        double sum = 0.0;
                        for (int i = 0; i < m; i++)
                            sum += b.w.a[row * m + i] * x[i];
                        kt_worst_near(&solved, sum, right[row], 2.0 * DBL_EPSILON * kappa * matrix_largest(right, k),
                                      "way %d, %d x %d, cap %d", way, m, k, cap);
                    }
                    (void)matrix_tear_down(&b);
                }
}

/* A and A scaled row by row with its weights, which are powers of two: the same equations are chosen. */
static void weigh(kt_random *random, int m, int k, int rank, double *weight, matrix_bench *given,
                  matrix_bench *scaled) {
    matrix_set_up(given, m, k);
    matrix_set_up(scaled, m, k);
    matrix_draw(random, m, k, rank, given->w.a);
    for (int r = 0; r < k; r++) {
        weight[r] = kt_random_uniform(random, 0.0, 1.0) < 0.5 ? 16.0 : 1.0;
        for (int i = 0; i < m; i++)
            scaled->w.a[r * m + i] = weight[r] * given->w.a[r * m + i];
    }
    given->w.weight = weight;
}

/* Measures the largest errors of A x - b and of A' lambda - g, for right sides b and g that have solutions. The errors
 * are relative to the possible effect of rounding. */
static void solve_both(const kt_reduction_kind *kind, const kt_group_work *w, int rank, kt_random *random,
                       kt_worst *x_error, kt_worst *lambda_error) {
    double b[MATRIX_MOST] = {0.0}, g[MATRIX_MOST] = {0.0}, left[MATRIX_MOST], x[MATRIX_MOST], lambda[MATRIX_MOST];
    const int m = w->m, k = w->k;
    double least = HUGE_VAL, origin[MATRIX_MOST];
    for (int i = 0; i < (m > k ? m : k); i++)
        origin[i] = kt_random_normal(random);
    for (int r = 0; r < k; r++)
        for (int i = 0; i < m; i++) {
            b[r] += w->a[r * m + i] * origin[i];
            g[i] += w->a[r * m + i] * origin[r];
        }
    for (int i = 0; i < rank; i++)
        least = fmin(least, kind->size(w, i));
    const double size = matrix_largest(w->a, m * k) * (m > k ? m : k), kappa = size / least;
    const double b_most = matrix_largest(b, k), g_most = matrix_largest(g, m);
    memcpy(left, g, sizeof left);
    kind->particular(w, rank, b, x);
    kind->multipliers(w, rank, g, lambda);
    for (int r = 0; r < k; r++)
        for (int i = 0; i < m; i++) {
            b[r] -= w->a[r * m + i] * x[i];
            left[i] -= w->a[r * m + i] * lambda[r];
        }
    kt_worst_below(x_error, matrix_largest(b, k),
                   DBL_EPSILON * (size * fmax(1.0, matrix_largest(x, m)) + kappa * b_most), "%d x %d, rank %d", m, k,
                   rank);
    kt_worst_below(lambda_error, matrix_largest(left, m),
                   DBL_EPSILON * (size * fmax(1.0, matrix_largest(lambda, k)) + kappa * g_most), "%d x %d, rank %d", m,
                   k, rank);
}

/* Factors with QR, at sizes below and above the limit for LAPACK, and with partitioning. */
KT_TEST(weights_choose_the_equations_and_leave_the_solutions) {
    static const int sizes[] = {4, 7, 12, 31, KT_LARGE + 1};
    kt_random random = kt_random_of_test();
    KT_WORST solved = kt_worst_make("A x = b"), balanced = kt_worst_make("A' lambda = g");
    long ranks = 0, choices = 0;
    for (int way = 0; way < 3; way += 2)
        for (int s = 0; s < 5; s++)
            for (int rank = 1; rank < sizes[s]; rank += 1 + rank / 3) {
                matrix_bench given, scaled;
                double weight[MATRIX_MOST];
                weigh(&random, sizes[s], sizes[s], rank, weight, &given, &scaled);
                const int found = kinds[way]->factor(&given.w, rank);
                ranks += found != rank || kinds[way]->factor(&scaled.w, rank) != rank;
                for (int i = 0; i < rank; i++)
                    choices += given.w.pivot[i] != scaled.w.pivot[i];
                if (found == rank)
                    solve_both(kinds[way], &given.w, rank, &random, &solved, &balanced);
                (void)matrix_tear_down(&given);
                (void)matrix_tear_down(&scaled);
            }
    kt_check_equal_int("ranks that are not what they should be", ranks, 0);
    kt_check_equal_int("other equations than the longer ones", choices, 0);
}

/* The number is rejected at every place, no matter which numbers are found before it. */
KT_TEST(numbers_that_are_not_finite_are_rejected) {
    static const int sizes[][2] = {{1, 1}, {3, 2}, {2, 3}, {7, 6}, {12, 10}, {10, 14}, {39, 5}, {42, 6}, {6, 42}};
    kt_random random = kt_random_of_test();
    long taken = 0, tried = 0;
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++)
        for (int way = 0; way < 3; way++)
            for (int place = 0; place < sizes[s][0] * sizes[s][1]; place += 1 + place / 16) {
                matrix_bench b;
                const int m = sizes[s][0], k = sizes[s][1];
                matrix_set_up(&b, m, k);
                matrix_draw(&random, m, k, m < k ? m : k, b.w.a);
                b.w.a[place] = place % 2 ? (double)NAN : (double)INFINITY;
                taken += kinds[way]->factor(&b.w, 1 + place % (m < k ? m : k)) != -1;
                tried++;
                (void)matrix_tear_down(&b);
            }
    kt_check_above("matrices", (double)tried, 500.0);
    kt_check_equal_int("taken", taken, 0);
}

/* The zero-eigenvalue method finds the ranks and solutions of QR, but for the square of the condition. */
KT_TEST(zero_eigenvalues_span_the_null_space_to_the_square_of_the_condition) {
    kt_random random = kt_random_of_test();
    KT_WORST ways = kt_worst_make("the same solution as by QR");
    const kt_reduction_kind *const eigen = &kt_reduction_eigen_baseline, *const qr = &kt_reduction_qr_baseline;
    int ranks = 0, all = 0;
    for (int m = 2; m <= 30; m += 7)
        for (int k = 1; k <= 30; k += 7)
            for (int rank = 1; rank <= (m < k ? m : k); rank += 5) {
                matrix_bench b;
                double right[MATRIX_MOST], y[MATRIX_MOST], x[2][MATRIX_MOST];
                draw_equations(&random, m, k, rank, &b, right, y);
                all++;
                const int cap = m < k ? m : k;
                bool found = qr->factor(&b.w, cap) == rank;
                if (found)
                    nearest(qr, &b.w, rank, right, y, x[0]);
                found = found && eigen->factor(&b.w, cap) == rank;
                if (found) {
                    const double kappa = eigen->size(&b.w, 0) / eigen->size(&b.w, rank - 1);
                    const double bound = 16.0 * DBL_EPSILON * kappa * kappa * fmax(matrix_largest(x[0], m), 1.0);
                    nearest(eigen, &b.w, rank, right, y, x[1]);
                    for (int i = 0; i < m; i++)
                        kt_worst_near(&ways, x[1][i], x[0][i], bound, "%d x %d, rank %d", m, k, rank);
                    ranks++;
                }
                (void)matrix_tear_down(&b);
            }
    kt_check_equal_int("ranks found", ranks, all);
}
