/* Column-pivoted QR of A' (Businger & Golub 1965): A' P = [Q1 Q2] [R1 R3; 0 0] [MSD 7.33].
 *
 *   particular: y from R1' y = P' b (first `rank` rows), x = Q1 y: the least solution
 *   basis:      Q2
 *   multipliers: R1 lambda = Q1' g
 *
 * Q is stored as reflectors I - t u u', u below R without its leading 1, as in LAPACK. For the small matrices of small
 * loops, the code below takes a fraction of the time of LAPACK's call. From KT_LARGE coordinates on, LAPACK is faster
 * (bench/scaling).
 *
 * Reflectors are applied one by one; LAPACK is given no work memory for blocks. Compared with blocks this takes a
 * fourth of the instructions for one column. The method without blocks takes as many or fewer for m / 4 columns, and a
 * tenth more for m / 2. The method also makes results independent of the number of OpenBLAS's threads below KT_BLOCKED
 * coordinates. The products with one reflector are so small that OpenBLAS computes them on one thread. Products of
 * blocks are divided, and rounded, according to the number of threads.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/maggi_kane.h"

#ifndef KT_LANES
#include "linear/lapack.h"
#endif

#include <assert.h>
#include <math.h>
#include <string.h>

/* From this number of coordinates on (96^2 numbers) OpenBLAS divides the product of a matrix and a vector, too. */
enum { KT_BLOCKED = 96 };

KT_INLINE kt_qr qr_of(const kt_group_work *w) {
    return (kt_qr){.m = w->m, .k = w->k, .factor = w->factor, .reflector_scale = w->reflector_scale, .pivot = w->pivot};
}

/* Removes weights of equations, and the scales of a balanced group, from R, so that R belongs to A again. */
static void unweight(const kt_group_work *w, int rank) {
    const kt_qr qr = qr_of(w);
    if (w->weight)
        kt_qr_unweight(&qr, w->m, rank, w->weight);
#ifndef KT_LANES
    if (w->unit)
        kt_group_unscale_columns(w, rank);
#endif
}

/* Copies A' with the columns' weights, and factors it. Returns the rank, at most cap, or -1 if a number is not finite.
 * In lanes, *full becomes the states whose rank is cap, and the result is cap. */
KT_INLINE int factor_any(const kt_group_work *w, int cap, kt_condition *full) {
    assert(cap >= 0 && cap <= w->m && cap <= w->k);
    assert(w->tolerance >= 0.0 && w->least >= 0.0);
    const int m = w->m;
    kt_real1 first = kt_real1_splat(0.0), all, *norm = w->work;
    const kt_qr qr = qr_of(w);
    for (int c = 0; c < w->k; c++) {
        const kt_real1 *restrict a = w->a + (size_t)c * (size_t)m;
        kt_real1 *restrict x = w->factor + (size_t)c * (size_t)m;
        const double weight = w->weight ? w->weight[c] : 1.0;
        kt_real1 squares = kt_real1_splat(0.0);
        w->pivot[c] = kt_index1_of(c);
        for (int i = 0; i < m; i++) {
            x[i] = weight * a[i];
            squares += x[i] * x[i];
        }
#ifndef KT_LANES
        if (w->unit) {
            kt_group_scale_equation(w, c, x);
            squares = kt_dense_dot(x, x, m);
        }
#endif
        norm[c] = squares;
    }
    for (int j = 0; j < cap; j++) {
        const kt_index1 best = kt_longest_column(norm, j, w->k, &all);
        if (kt_fails(full, kt_is_finite1(all)))
            return -1;
        const kt_real1 longest = kt_pick(norm, w->k, best);
        if (j == 0)
            first = kt_larger(longest, kt_real1_splat(w->least * w->least));
        if (kt_fails(full, longest > w->tolerance * w->tolerance * first))
            return j;
        kt_qr_step(&qr, m, j, best, norm);
    }
    return cap;
}

/* Three coordinates and two equations, as in a closed planar chain. Loops of constant length are unrolled, which halves
 * the cost of such a group. Returns whether the group is such a chain; then *known is the group with these numbers as
 * constants. */
KT_INLINE bool is_four_bar(const kt_group_work *w, int rank, kt_group_work *known) {
    if (w->m != 3 || w->k != 2 || rank != 2 || w->unit)
        return false;
    *known = *w;
    known->m = 3;
    known->k = 2;
    known->weight = known->unit = NULL;
    return true;
}

/* Factors a group as factor_any does, with constant sizes for a four-bar linkage. */
static int factor_small(const kt_group_work *w, int cap, kt_condition *full) {
    kt_group_work known;
    if (is_four_bar(w, cap, &known))
        return factor_any(&known, 2, full);
    const int rank = factor_any(w, cap, full);
    unweight(w, rank);
    return rank;
}

#ifndef KT_LANES

/* Factors a group by LAPACK. Returns the rank, at most `cap`, or -1 if a number is not finite. The i-th direction is
 * lost if |R_ii| is not above the tolerance relative to the first. */
static int factor_large(kt_group_work *w, int cap) {
    assert(cap >= 0 && cap <= w->m && cap <= w->k);
    const int size = (int)kt_group_work_count((size_t)w->m, (size_t)w->k);
    const size_t m = (size_t)w->m, k = (size_t)w->k;
    for (size_t i = 0; i < m * k; i++) {
        w->factor[i] = w->weight ? w->weight[i / m] * w->a[i] : w->a[i];
        if (!isfinite(w->factor[i]))
            return -1;
    }
    for (size_t c = 0; c < k; c++)
        if (w->unit)
            kt_group_scale_equation(w, (int)c, w->factor + c * m);
    (void)kt_lapack_geqp3(w->m, w->k, w->factor, w->pivot, w->reflector_scale, w->work, size);
    for (int c = 0; c < w->k; c++)
        w->pivot[c]--; /* Fortran counts from 1 */
    const double first = kt_larger(fabs(w->factor[0]), w->least);
    int rank = 0;
    while (rank < cap && fabs(w->factor[(size_t)rank * (size_t)(w->m + 1)]) > w->tolerance * first)
        rank++;
    unweight(w, rank);
    return rank;
}

static int factor_qr_method(kt_group_work *w, int cap) {
    if (w->m == 0 || w->k == 0)
        return 0;
    return w->m >= KT_LARGE ? factor_large(w, cap) : factor_small(w, cap, NULL);
}

#endif

/* X (m x columns) = Q X with the first `count` reflectors, or Q' X if `transposed`. */
KT_INLINE void apply(const kt_group_work *w, int count, bool transposed, kt_real1 *x, int columns) {
    assert(count >= 0 && count <= w->m && count <= w->k);
    const size_t m = (size_t)w->m;
#ifndef KT_LANES
    if (w->m >= KT_LARGE && count > 0 && columns > 0) {
        const bool blocks = w->m >= KT_BLOCKED && 4 * columns > w->m;
        const int size = blocks ? (int)kt_group_work_count(m, (size_t)w->k) : columns;
        (void)kt_lapack_ormqr(transposed ? 'T' : 'N', w->m, columns, count, w->factor, w->reflector_scale, x, w->work,
                              size);
        return;
    }
#endif
    for (int c = 0; c < columns; c++)
        for (int i = 0; i < count; i++) {
            const int j = transposed ? i : count - 1 - i;
            kt_reflect(w->factor + (size_t)j * m, w->reflector_scale[j], j, w->m, x + (size_t)c * m);
        }
}

/* x = Q1 y with R1' y = P' b: the least solution. */
KT_INLINE void particular(const kt_group_work *w, int rank, const kt_real1 *b, kt_real1 *x) {
    const kt_qr qr = qr_of(w);
    kt_qr_solve_transposed(&qr, w->m, rank, b, x);
    for (int i = rank; i < w->m; i++)
        x[i] = kt_real1_splat(0.0);
    apply(w, rank, false, x, 1);
#ifndef KT_LANES
    if (w->unit)
        kt_group_scale_coordinates(w, x);
#endif
}

/* w->basis = Q2, as the last columns of Q applied to unit vectors. */
KT_INLINE void basis(const kt_group_work *w, int rank) {
    const size_t m = (size_t)w->m;
    memset(w->basis, 0, m * (m - (size_t)rank) * sizeof *w->basis);
    for (size_t c = (size_t)rank; c < m; c++)
        w->basis[(c - (size_t)rank) * m + c] = kt_real1_splat(1.0);
    apply(w, rank, false, w->basis, w->m - rank);
#ifndef KT_LANES
    if (w->unit)
        kt_group_scale_basis(w, rank);
#endif
}

static kt_condition solve_by_qr(const kt_group_work *w, int rank, int width) {
    kt_group_work known;
    if (is_four_bar(w, rank, &known))
        return kt_group_solve(particular, basis, &known, 2, width);
    return kt_group_solve(particular, basis, w, rank, width);
}

#ifndef KT_LANES

/* R1 lambda = Q1' g, for the independent equations; lambda of the others is 0. */
static void qr_multipliers(const kt_group_work *w, int rank, double *g, double *lambda) {
    const kt_qr qr = qr_of(w);
    if (w->unit)
        kt_group_scale_coordinates(w, g);
    apply(w, rank, true, g, 1);
    kt_qr_solve(&qr, w->m, rank, g);
    for (int i = 0; i < w->k; i++)
        lambda[w->pivot[i]] = i < rank ? g[i] : 0.0;
}

static double qr_size(const kt_group_work *w, int i) { return fabs(w->factor[(size_t)i * (size_t)(w->m + 1)]); }

const kt_reduction_kind KT_KERNEL(kt_reduction_qr) = {.least = true,
                                                      .chooses = true,
                                                      .pins = true,
                                                      .fronts = true,
                                                      .large = KT_LARGE,
                                                      .open = kt_lapack_open,
                                                      .factor = factor_qr_method,
                                                      .size = qr_size,
                                                      .particular = particular,
                                                      .basis = basis,
                                                      .solve = solve_by_qr,
                                                      .multipliers = qr_multipliers};

#else

kt_condition KT_KERNEL(kt_qr_factor)(const kt_group_work *w, int cap) {
    kt_condition full = kt_condition_true();
    if (w->m > 0 && w->k > 0)
        (void)factor_small(w, cap, &full);
    return full;
}

void KT_KERNEL(kt_qr_particular)(const kt_group_work *w, int rank, const kt_real1 *b, kt_real1 *x) {
    particular(w, rank, b, x);
}

kt_condition KT_KERNEL(kt_qr_solve_group)(const kt_group_work *w, int rank, int width) {
    return solve_by_qr(w, rank, width);
}

#endif
