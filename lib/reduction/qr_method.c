/* Column-pivoted QR of A' (Businger & Golub 1965): A' P = [Q1 Q2] [R1 R3; 0 0] [MSD 7.33].
 *
 *   particular: y from R1' y = P' b (first `rank` rows), x = Q1 y: the least solution
 *   basis:      Q2
 *   multipliers: R1 lambda = Q1' g
 *
 * Q is stored as reflectors I - t u u', u below R without its leading 1, as in LAPACK. For the small matrices of small
 * loops, the code below takes a fraction of the time of LAPACK's call; from KT_LARGE coordinates on, LAPACK is faster
 * (bench/scaling).
 *
 * Reflectors are applied one by one; LAPACK is given no work memory for blocks. Compared with blocks this takes a
 * fourth of the instructions for one column, as many or fewer for m / 4 columns, and a tenth more for m / 2. It also
 * makes results independent of the number of OpenBLAS's threads below KT_BLOCKED coordinates: the products of one
 * reflector are so small that OpenBLAS leaves them to one thread, while products of blocks are divided, and rounded,
 * according to the number of threads.
 */
#include "linear/lapack.h"
#include "reduction/maggi_kane.h"

#include <math.h>
#include <string.h>

/* From this number of coordinates on (96^2 numbers) OpenBLAS divides the product of a matrix and a vector, too. */
enum { KT_BLOCKED = 96 };

/* Copies A' with the columns' weights, and computes their squared norms. */
KT_INLINE void begin(const kt_group_work *w, int m, double *norm) {
    const double *restrict a = w->a;
    double *restrict x = w->factor;
    for (int c = 0; c < w->k; c++, a += m, x += m) {
        const double weight = w->weight ? w->weight[c] : 1.0;
        w->pivot[c] = c;
        for (int i = 0; i < m; i++)
            x[i] = weight * a[i];
        norm[c] = kt_squares(x, 0, m);
    }
}

KT_INLINE kt_qr qr_of(const kt_group_work *w) {
    return (kt_qr){.m = w->m, .k = w->k, .factor = w->factor, .reflector_scale = w->reflector_scale, .pivot = w->pivot};
}

static void unweight(const kt_group_work *w, int rank) {
    const kt_qr qr = qr_of(w);
    if (w->weight)
        kt_qr_unweight(&qr, w->m, rank, w->weight);
}

KT_INLINE int factor_any(const kt_group_work *w, int cap) {
    const int m = w->m;
    double first = 0.0, all, *norm = w->work;
    const kt_qr qr = qr_of(w);
    begin(w, m, norm);
    for (int j = 0; j < cap; j++) {
        const int best = kt_longest_column(norm, j, w->k, &all);
        if (!isfinite(all))
            return -1;
        if (j == 0)
            first = kt_larger(norm[best], w->least * w->least);
        if (!(norm[best] > w->tolerance * w->tolerance * first))
            return j;
        kt_qr_step(&qr, m, j, best, norm);
    }
    return cap;
}

/* Three coordinates and two equations, as in a closed planar chain: loops of known length are unrolled, which halves
 * the cost of such a group. */
KT_INLINE bool is_four_bar(const kt_group_work *w, int rank) { return w->m == 3 && w->k == 2 && rank == 2; }

KT_INLINE kt_group_work four_bar(const kt_group_work *w) {
    kt_group_work known = *w;
    known.m = 3;
    known.k = 2;
    known.weight = NULL;
    return known;
}

static int factor_small(const kt_group_work *w, int cap) {
    if (is_four_bar(w, cap)) {
        const kt_group_work known = four_bar(w);
        return factor_any(&known, 2);
    }
    const int rank = factor_any(w, cap);
    unweight(w, rank);
    return rank;
}

static int factor_large(kt_group_work *w, int cap) {
    const int size = (int)kt_group_work_count((size_t)w->m, (size_t)w->k);
    const size_t m = (size_t)w->m, k = (size_t)w->k;
    for (size_t i = 0; i < m * k; i++) {
        w->factor[i] = w->weight ? w->weight[i / m] * w->a[i] : w->a[i];
        if (!isfinite(w->factor[i]))
            return -1;
    }
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

static int factor(kt_group_work *w, int cap) {
    if (w->m == 0 || w->k == 0)
        return 0;
    return w->m >= KT_LARGE ? factor_large(w, cap) : factor_small(w, cap);
}

/* X (m x columns) = Q X with the first `count` reflectors, or Q' X. */
KT_INLINE void apply(const kt_group_work *w, int count, bool transposed, double *x, int columns) {
    const size_t m = (size_t)w->m;
    if (w->m >= KT_LARGE && count > 0) {
        const bool blocks = w->m >= KT_BLOCKED && 4 * columns > w->m;
        const int size = blocks ? (int)kt_group_work_count(m, (size_t)w->k) : columns;
        (void)kt_lapack_ormqr(transposed ? 'T' : 'N', w->m, columns, count, w->factor, w->reflector_scale, x, w->work,
                              size);
        return;
    }
    for (int c = 0; c < columns; c++)
        for (int i = 0; i < count; i++) {
            const int j = transposed ? i : count - 1 - i;
            kt_reflect(w->factor + (size_t)j * m, w->reflector_scale[j], j, w->m, x + (size_t)c * m);
        }
}

KT_INLINE void particular(const kt_group_work *w, int rank, const double *b, double *x) {
    const kt_qr qr = qr_of(w);
    kt_qr_solve_transposed(&qr, w->m, rank, b, x);
    for (int i = rank; i < w->m; i++)
        x[i] = 0.0;
    apply(w, rank, false, x, 1);
}

KT_INLINE void basis(const kt_group_work *w, int rank) {
    const size_t m = (size_t)w->m;
    memset(w->basis, 0, m * (m - (size_t)rank) * sizeof(double));
    for (size_t c = (size_t)rank; c < m; c++)
        w->basis[(c - (size_t)rank) * m + c] = 1.0;
    apply(w, rank, false, w->basis, w->m - rank);
}

static void multipliers(const kt_group_work *w, int rank, double *g, double *lambda) {
    const kt_qr qr = qr_of(w);
    apply(w, rank, true, g, 1);
    kt_qr_solve(&qr, w->m, rank, g);
    for (int i = 0; i < w->k; i++)
        lambda[w->pivot[i]] = i < rank ? g[i] : 0.0;
}

static bool solve(const kt_group_work *w, int rank, int width) {
    if (is_four_bar(w, rank)) {
        const kt_group_work known = four_bar(w);
        return kt_group_solve(particular, basis, &known, 2, width);
    }
    return kt_group_solve(particular, basis, w, rank, width);
}

static double size(const kt_group_work *w, int i) { return fabs(w->factor[(size_t)i * (size_t)(w->m + 1)]); }

const kt_reduction_kind KT_KERNEL(kt_reduction_qr) = {.least = true,
                                                      .chooses = true,
                                                      .pins = true,
                                                      .fronts = true,
                                                      .large = KT_LARGE,
                                                      .open = kt_lapack_open,
                                                      .factor = factor,
                                                      .size = size,
                                                      .particular = particular,
                                                      .basis = basis,
                                                      .solve = solve,
                                                      .multipliers = multipliers};
