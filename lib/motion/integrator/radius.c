/* The spectral radius of f_y, which determines how many stages a stabilised method needs.
 *
 * The method of Arnoldi computes it without the matrix f_y. The quotient w approximates f_y v_j:
 *
 *     w = (f(y + delta v_j) - f(y)) / delta
 *
 * The components of w along v_0 .. v_j form column j of the Hessenberg matrix H, and the normalised remainder is
 * v_{j+1}. The spectral radius of the leading j + 1 rows and columns of H converges to that of f_y. The start must have
 * a component in every mode. The radius converges far faster than the quotients of the power method. The start may hold
 * little of the fastest mode, and much of a mode that is nearly as fast. Then the quotients of the power method would
 * stagnate for many iterations at 3/4 of the true value.
 *
 * The iteration ends if two successive radii differ by less than one in a hundred, or if the vectors span all excited
 * modes.
 *
 * The radius of the small matrix is the limit of |H^p|^(1/p), computed with repeated squaring up to p = 2^8. The result
 * is never too small.
 *
 * Each estimate starts from scratch, so that a checkpoint contains no vectors. A start that misses the fastest mode is
 * rare but would make steps unstable: therefore an estimate lowers the radius by no more than a seventh.
 * KT_RADIUS_MARGIN covers the remaining error, and the growth of the radius until the next estimate. Estimates are made
 * more often if the step is fixed, since then no error estimate would show that the radius has grown.
 *
 * Sources: W. E. Arnoldi, Quart. Appl. Math. 9 (1951) 17; for the differences and the margin RKC (1998), section 3.3.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/stabilised.h"

#include "linear/cholesky.h"

#include <float.h>
#include <math.h>

enum { AGE_MAX = 25, AGE_MAX_FIXED = 5, SQUARINGS = 8, N = KT_RADIUS_VECTORS };

typedef struct hessenberg {
    double h[N][N]; /* row-major */
} hessenberg;

/* The spectral radius of the leading k rows and columns. The norm is divided out before each squaring, and its root is
 * multiplied back. */
static double radius_of(const hessenberg *matrix, int k) {
    hessenberg b = *matrix, square;
    double radius = 1.0;
    for (int p = 0; p <= SQUARINGS; p++) {
        double norm = 0.0;
        for (int i = 0; i < k; i++)
            norm += kt_dense_dot(b.h[i], b.h[i], k);
        norm = sqrt(norm);
        if (!(norm > 0.0) || !isfinite(norm))
            return norm;
        double root = norm;
        for (int i = 0; i < p; i++)
            root = sqrt(root);
        radius *= root;
        for (int i = 0; i < k; i++)
            for (int j = 0; j < k; j++) {
                double sum = 0.0;
                for (int l = 0; l < k; l++)
                    sum += b.h[i][l] * b.h[l][j];
                square.h[i][j] = sum / (norm * norm);
            }
        b = square;
    }
    return radius;
}

/* A start vector of length 1 with a component in every mode, different at each step: fractional parts of multiples of
 * the golden ratio. (The slope f is unsuitable, because a mode that dominates f hides the other modes.) */
static void first_direction(double *v, size_t n, uint64_t step) {
    for (size_t i = 0; i < n; i++) {
        const double x = 0.61803398874989485 * (double)(i + 1 + step % 4096);
        v[i] = x - floor(x) - 0.5;
    }
    const double length = sqrt(kt_dense_dot(v, v, (int)n));
    for (size_t i = 0; i < n; i++)
        v[i] /= length;
}

/* Computes column j of H and v_{j+1}; *left: the length of the remainder of f_y v_j over that of f_y v_j. */
static kt_try_result extend_krylov_space(kt_integrator *it, hessenberg *matrix, int j, double delta, double *left,
                                         kt_try *result) {
    const size_t n = it->counted;
    double *v = kt_stabilised_scratch_of(it)->krylov + (size_t)j * n, *w = v + n;
    for (size_t i = 0; i < n; i++)
        it->trial[i] = it->y[i] + delta * v[i];
    if (kt_evaluate(it, it->memory.t, it->trial, 1, result) != KT_TRY_PASSED)
        return result->result;
    for (size_t i = 0; i < n; i++)
        w[i] = (it->k[1][i] - it->k[0][i]) / delta;
    const double before = sqrt(kt_dense_dot(w, w, (int)n));
    for (int l = 0; l <= j; l++) {
        const double *u = v - (size_t)(j - l) * n, part = kt_dense_dot(u, w, (int)n);
        matrix->h[l][j] = part;
        for (size_t i = 0; i < n; i++)
            w[i] -= part * u[i];
    }
    const double length = sqrt(kt_dense_dot(w, w, (int)n));
    *left = before > 0.0 ? length / before : 0.0;
    if (j + 1 < N)
        matrix->h[j + 1][j] = length;
    for (size_t i = 0; i < n && length > 0.0; i++)
        w[i] /= length;
    return KT_TRY_PASSED;
}

/* The size of y. A small part of it is the step delta of the differences. Near y = 0, their rounding error eps |f| /
 * delta would exceed the differences. Therefore the size is at least 1e-6, and 1 at y = 0. */
static double state_size_of(const double *y, size_t n) {
    const double size = sqrt(kt_dense_dot(y, y, (int)n));
    return size > 0.0 ? fmax(size, 1e-6) : 1.0;
}

/* Estimates the radius at (t, y), without margin. Requires f(t, y) in slot 0; slot 1 and `trial` are scratch. A
 * remainder below 1e-5 counts as zero, since differences leave some 1e-6 of a zero remainder. */
static kt_try_result estimate_radius(kt_integrator *it, double *radius, kt_try *result) {
    const size_t n = it->counted; /* the columns of f_y of quadratures are zero */
    const double delta = sqrt(DBL_EPSILON) * state_size_of(it->y, n);
    hessenberg matrix = {{{0.0}}};
    double last = HUGE_VAL, left = 1.0;
    bool settled = false;
    first_direction(kt_stabilised_scratch_of(it)->krylov, n, it->memory.counts.steps);
    for (size_t i = n; i < it->sizes.n; i++)
        it->trial[i] = it->y[i];
    *radius = 0.0;
    int j = 0;
    for (; j < N && (size_t)j < n && left > 1e-5 && !settled; j++) {
        if (extend_krylov_space(it, &matrix, j, delta, &left, result) != KT_TRY_PASSED)
            return result->result;
        *radius = j < 3 && left > 1e-5 && (size_t)j + 1 < n ? HUGE_VAL : radius_of(&matrix, j + 1);
        settled = fabs(*radius - last) <= 0.01 * *radius;
        last = *radius;
    }
    it->memory.counts.capped += j == N && (size_t)N < n && left > 1e-5 && !settled;
    return KT_TRY_PASSED;
}

KT_ARENA_ARRAYS(place_arrays, kt_stabilised_scratch, KT_STABILISED_FIELDS, size_t n)

size_t kt_stabilised_scratch_size(size_t n) {
    return kt_arena_round(sizeof(kt_stabilised_scratch)) + place_arrays(NULL, NULL, n);
}

kt_try_result kt_need_radius(kt_integrator *it, bool rejected, kt_try *result) {
    kt_stabilised_scratch *scratch = kt_stabilised_scratch_of(it);
    const double known = it->history[KT_HISTORY_RADIUS], age = it->history[KT_HISTORY_AGE];
    result->result = KT_TRY_PASSED;
    if (rejected && scratch->radius_is_of_now)
        return KT_TRY_PASSED;
    (void)place_arrays(scratch, it->scratch + kt_arena_round(sizeof *scratch), it->sizes.n);
    scratch->radius_is_of_now = rejected || known < 0.0 || age >= (it->options.step > 0.0 ? AGE_MAX_FIXED : AGE_MAX);
    scratch->radius = known;
    if (!scratch->radius_is_of_now)
        return KT_TRY_PASSED;
    double radius;
    if (estimate_radius(it, &radius, result) == KT_TRY_PASSED)
        scratch->radius = fmax(KT_RADIUS_MARGIN * radius, 0.86 * known);
    return result->result;
}

void kt_radius_accept(kt_integrator *it) {
    const kt_stabilised_scratch *scratch = kt_stabilised_scratch_of(it);
    it->history[KT_HISTORY_RADIUS] = scratch->radius;
    it->history[KT_HISTORY_AGE] = scratch->radius_is_of_now ? 1.0 : it->history[KT_HISTORY_AGE] + 1.0;
}

void kt_radius_forget(kt_integrator *it) { it->history[KT_HISTORY_RADIUS] = -1.0; }
