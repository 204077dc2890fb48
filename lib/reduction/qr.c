/* Column-pivoted QR of A' (Businger & Golub 1965): A' P = [Q1 Q2] [R1 R3; 0 0] [MSD 7.33].
 *
 *   particular: y from R1' y = P' b (first `rank` rows), x = Q1 y: the least solution
 *   basis:      Q2
 *   multipliers: R1 lambda = Q1' g
 *
 * Q is kept as reflectors I - t u u', u below R with its leading 1 left out, as LAPACK does. For the small matrices of
 * small loops, the loop below takes a fraction of the time of LAPACK's call; from KT_LARGE coordinates on, LAPACK's
 * blocks win (bench/scaling).
 */
#include "reduction/lapack.h"
#include "reduction/reduce.h"

#include <math.h>
#include <string.h>

/* The column with the largest squared norm *n2 of its rows from j on, among the columns from j on. Norms are taken
 * anew: brought up to date instead, they would lose their digits where the rank ends. *all is their sum. */
static int largest_column(const kt_group_work *w, int j, double *n2, double *all) {
    int best = j;
    *n2 = *all = 0.0;
    for (int c = j; c < w->k; c++) {
        const double *column = w->factor + (size_t)c * (size_t)w->m;
        double sum = 0.0;
        for (int i = j; i < w->m; i++)
            sum += column[i] * column[i];
        *all += sum;
        if (sum > *n2) {
            *n2 = sum;
            best = c;
        }
    }
    return best;
}

static void swap_columns(const kt_group_work *w, int a, int b) {
    double *x = w->factor + (size_t)a * (size_t)w->m, *y = w->factor + (size_t)b * (size_t)w->m;
    for (int i = 0; i < w->m; i++) {
        const double t = x[i];
        x[i] = y[i];
        y[i] = t;
    }
    const int32_t p = w->pivot[a];
    w->pivot[a] = w->pivot[b];
    w->pivot[b] = p;
}

/* x -= t u (u . x), u = (1, tail) from row j on. */
static inline void reflect(const double *u, double t, int j, int m, double *x) {
    double sum = x[j];
    for (int i = j + 1; i < m; i++)
        sum += u[i] * x[i];
    sum *= t;
    x[j] -= sum;
    for (int i = j + 1; i < m; i++)
        x[i] -= sum * u[i];
}

/* The reflector that turns rows j.. of column j, of squared norm n2, into (R_jj, 0, ...). */
static void eliminate(const kt_group_work *w, int j, double n2) {
    const int m = w->m;
    double *column = w->factor + (size_t)j * (size_t)m;
    const double head = column[j], r = head > 0.0 ? -sqrt(n2) : sqrt(n2);
    const double u0 = head - r;
    for (int i = j + 1; i < m; i++)
        column[i] /= u0;
    w->reflector[j] = -u0 / r;
    column[j] = r;
    for (int c = j + 1; c < w->k; c++)
        reflect(column, w->reflector[j], j, m, w->factor + (size_t)c * (size_t)m);
}

static int factor_small(kt_group_work *w, int cap) {
    double first = 0.0, n2, all;
    for (int c = 0; c < w->k; c++)
        w->pivot[c] = c;
    for (int j = 0; j < cap; j++) {
        const int best = largest_column(w, j, &n2, &all);
        if (!isfinite(all))
            return -1;
        if (j == 0)
            first = n2;
        if (!(n2 > KT_RANK_TOLERANCE * KT_RANK_TOLERANCE * first))
            return j;
        if (best != j)
            swap_columns(w, j, best);
        eliminate(w, j, n2);
    }
    return cap;
}

static int factor_large(kt_group_work *w, int cap) {
    const int size = (int)kt_group_work_count((size_t)w->m, (size_t)w->k);
    for (size_t i = 0; i < (size_t)w->m * (size_t)w->k; i++)
        if (!isfinite(w->factor[i]))
            return -1;
    (void)kt_lapack_geqp3(w->m, w->k, w->factor, w->pivot, w->reflector, w->work, size);
    for (int c = 0; c < w->k; c++)
        w->pivot[c]--; /* from Fortran's count */
    int rank = 0;
    while (rank < cap && fabs(w->factor[(size_t)rank * (size_t)(w->m + 1)]) > KT_RANK_TOLERANCE * fabs(w->factor[0]))
        rank++;
    return rank;
}

static int factor(kt_group_work *w, int cap) {
    memcpy(w->factor, w->a, (size_t)w->m * (size_t)w->k * sizeof(double));
    if (w->m == 0 || w->k == 0)
        return 0;
    return w->m >= KT_LARGE ? factor_large(w, cap) : factor_small(w, cap);
}

/* X (m x columns) = Q X with the first `count` reflectors, or Q' X. */
static void apply(const kt_group_work *w, int count, bool transposed, double *x, int columns) {
    const size_t m = (size_t)w->m;
    if (w->m >= KT_LARGE && count > 0) {
        const int size = (int)kt_group_work_count(m, (size_t)w->k);
        (void)kt_lapack_ormqr(transposed ? 'T' : 'N', w->m, columns, count, w->factor, w->reflector, x, w->work, size);
        return;
    }
    for (int c = 0; c < columns; c++)
        for (int i = 0; i < count; i++) {
            const int j = transposed ? i : count - 1 - i;
            reflect(w->factor + (size_t)j * m, w->reflector[j], j, w->m, x + (size_t)c * m);
        }
}

static void particular(const kt_group_work *w, int rank, const double *b, double *x) {
    for (int i = 0; i < rank; i++) { /* R1' is lower triangular: its row i is column i of R */
        const double *r = w->factor + (size_t)i * (size_t)w->m;
        double sum = b[w->pivot[i]];
        for (int j = 0; j < i; j++)
            sum -= r[j] * x[j];
        x[i] = sum / r[i];
    }
    for (int i = rank; i < w->m; i++)
        x[i] = 0.0;
    apply(w, rank, false, x, 1);
}

static void basis(const kt_group_work *w, int rank) {
    const size_t m = (size_t)w->m;
    memset(w->basis, 0, m * (m - (size_t)rank) * sizeof(double));
    for (size_t c = (size_t)rank; c < m; c++)
        w->basis[(c - (size_t)rank) * m + c] = 1.0;
    apply(w, rank, false, w->basis, w->m - rank);
}

static void multipliers(const kt_group_work *w, int rank, double *g, double *lambda) {
    apply(w, rank, true, g, 1);
    for (int i = rank - 1; i >= 0; i--) {
        for (int j = i + 1; j < rank; j++)
            g[i] -= w->factor[(size_t)j * (size_t)w->m + (size_t)i] * g[j];
        g[i] /= w->factor[(size_t)i * (size_t)(w->m + 1)];
    }
    for (int i = 0; i < w->k; i++)
        lambda[w->pivot[i]] = i < rank ? g[i] : 0.0;
}

static double size(const kt_group_work *w, int i) { return fabs(w->factor[(size_t)i * (size_t)(w->m + 1)]); }

const kt_reduction_kind KT_KERNEL(kt_reduction_qr) = {.least = true,
                                                      .factor = factor,
                                                      .size = size,
                                                      .particular = particular,
                                                      .basis = basis,
                                                      .multipliers = multipliers};
