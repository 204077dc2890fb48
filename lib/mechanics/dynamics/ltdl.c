/* M = L'DL along the tree (Featherstone 2008, 6.5). No zero entry becomes non-zero, so factors, products and solutions
 * cost O(n depth^2), O(n depth) and O(n depth) operations.
 *
 * Factors, from the last degree of freedom k to the first; i, j: of its support:
 *   M_ij -= M_ki M_kj / M_kk,   then   L_ki = M_ki / M_kk
 * Passes over the rows with the path from the root to k, p_i: one number for each i of its support:
 *   down, k ascending:    y_k = x_k +- sum_i L_ki p_i,   p_k = x_k or y_k                    (L x and L^-1 x)
 *   up, k descending:     y_k = x_k +- p_k,   p_i += L_ki (x_k or y_k),   p_k = 0            (L' x and L'^-1 x)
 * The numbers p_i of the passes up are all zero before and after. In depth-first order, the path is a stack: the entry
 * at a depth belongs to k's support as long as the entry is needed.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/ltdl.h"

#include <string.h>

enum { LANES = 4 };

/* Lanes before the n-th. */
typedef int64_t lane_mask __attribute__((vector_size(32)));
/* The mask of the first n lanes, read from a table of ones and zeros at an offset. */
KT_INLINE lane_mask lanes_before(size_t n) {
    static const int64_t on[2 * LANES] = {-1, -1, -1, -1};
    lane_mask mask;
    memcpy(&mask, on + LANES - n, sizeof mask);
    return mask;
}

/* Sets y[0, n) += a x[0, n), and y[n] = 0, whole vectors at a time. No load of a vector waits for numbers that have
 * just been stored one by one. The lanes after y[n] are zero before and after; x is read up to the end of the same
 * vector. */
KT_INLINE void add_multiple(size_t n, double a, const double *x, double *y) {
    const kt_v4 aa = kt_v4_splat(a);
    const size_t whole = n / LANES * LANES;
    for (size_t p = 0; p < whole; p += LANES)
        kt_v4_store(y + p, kt_v4_load(y + p) + aa * kt_v4_load(x + p));
    const kt_v4 rest = kt_v4_load(y + whole) + aa * kt_v4_load(x + whole);
    kt_v4_store(y + whole, (kt_v4)((lane_mask)rest & lanes_before(n % LANES)));
}

/* Does the same number by number; n < 2 LANES. Compilers unroll this loop. Compilers would vectorise a loop from one to
 * n, which would wait for numbers that have just been stored. */
KT_INLINE void add_short(size_t n, double a, const double *x, double *y) {
    for (size_t p = 0; p < 2 * LANES; p++) {
        if (p == n)
            break;
        y[p] += a * x[p];
    }
    y[n] = 0.0;
}

/* sum + x . y; n < 2 LANES */
KT_INLINE double dot_short(size_t n, const double *x, const double *y, double sum) {
    for (size_t p = 0; p < 2 * LANES; p++) {
        if (p == n)
            break;
        sum += x[p] * y[p];
    }
    return sum;
}

/* Returns x . y: eight sums over groups of eight entries, and the rest in its order. */
KT_INLINE double dot(size_t n, const double *x, const double *y) {
    if (n < 2 * LANES)
        return dot_short(n, x, y, 0.0);
    kt_v4 even = kt_v4_splat(0.0), odd = even;
    size_t p = 0;
    for (; p + 2 * LANES <= n; p += 2 * LANES) {
        even += kt_v4_load(x + p) * kt_v4_load(y + p);
        odd += kt_v4_load(x + p + LANES) * kt_v4_load(y + p + LANES);
    }
    const kt_v4 s = even + odd;
    return dot_short(n - p, x + p, y + p, (s[0] + s[2]) + (s[1] + s[3]));
}

/* ---- factors ----------------------------------------------------------------------------------------------------- */

/* The number of rows k, k - 1, ... that are subtracted together from the rows of their support. Each of these rows
 * belongs to a degree of freedom that carries the previous one. */
enum { PANEL = 4 };

typedef struct panel {
    size_t count;
    const double *row[PANEL];
    double inverse[PANEL]; /* of the pivots */
} panel;

/* Subtracts M_ki M_kj / M_kk from M_ij for i, the p-th of the support of the rows [first, end) of a panel, and all j <=
 * i. The last vector of a row may receive anything after its last number. */
KT_INLINE void subtract_rows(const panel *w, size_t first, size_t end, size_t p, double *diagonal, double *row) {
    double a[PANEL];
    for (size_t s = first; s < end; s++) {
        a[s] = w->row[s][p] * w->inverse[s];
        *diagonal -= a[s] * w->row[s][p];
    }
    for (size_t j = 0; j < p; j += LANES) {
        kt_v4 x = kt_v4_load(row + j);
        for (size_t s = first; s < end; s++)
            x -= kt_v4_splat(a[s]) * kt_v4_load(w->row[s] + j);
        kt_v4_store(row + j, x);
    }
}

/* From the rows of a panel; `count` is a constant. */
KT_INLINE void subtract_panel(kt_mass_factor *f, const panel *w, size_t count, size_t last) {
    int32_t i = f->parent[last];
    for (size_t p = (size_t)f->depth[last]; p-- > 0; i = f->parent[i])
        subtract_rows(w, 0, count, p, &f->diagonal[i], f->number + f->row[i]);
}

/* Computes the factors of a panel that begins at row k. Returns false if a pivot is not positive, with its row in
 * *failed. */
KT_INLINE bool factor_panel(kt_mass_factor *f, size_t k, panel *w, size_t *failed) {
    for (w->count = 0; w->count < PANEL; w->count++) {
        const size_t m = k - w->count;
        for (size_t s = 0; s < w->count; s++)
            subtract_rows(w, s, s + 1, (size_t)f->depth[m], &f->diagonal[m], f->number + f->row[m]);
        if (!(f->diagonal[m] > 0.0)) {
            *failed = m;
            return false;
        }
        w->inverse[w->count] = 1.0 / f->diagonal[m];
        w->row[w->count] = f->number + f->row[m];
        if (m == 0 || f->parent[m] != (int32_t)m - 1) {
            w->count++;
            break;
        }
    }
    return true;
}

/* Computes the factors of a row of at most LANES numbers, one by one, because the numbers may just have been stored one
 * by one. */
KT_INLINE bool factor_short(kt_mass_factor *f, size_t k) {
    double *number = f->number, *diagonal = f->diagonal, *row = number + f->row[k];
    const double pivot = diagonal[k], inverse = 1.0 / pivot;
    int32_t i = f->parent[k];
    for (size_t p = (size_t)f->depth[k]; p-- > 0; i = f->parent[i]) {
        double *to = number + f->row[i], x = row[p], a = x * inverse;
        diagonal[i] -= a * x;
        for (size_t j = 0; j < p; j++)
            to[j] -= a * row[j];
        row[p] = inverse * x;
    }
    return pivot > 0.0;
}

/* Factors M = L' D L, from the last coordinate to the first. Long rows are factored in panels, so that each loaded
 * number serves several rows. Returns n.v, or a coordinate whose pivot is not positive. */
static size_t factor_mass(kt_mass_factor *f) {
    size_t failed = f->model->n.v;
    for (size_t end = failed; end > 0;) {
        if (f->depth[end - 1] <= LANES) {
            if (!factor_short(f, end - 1))
                return end - 1;
            end--;
            continue;
        }
        panel w;
        if (!factor_panel(f, end - 1, &w, &failed))
            break;
        if (w.count == PANEL)
            subtract_panel(f, &w, PANEL, end - PANEL);
        else
            subtract_panel(f, &w, w.count, end - w.count);
        for (size_t s = 0; s < w.count; s++) {
            double *row = f->number + f->row[end - 1 - s];
            for (size_t p = 0; p < (size_t)f->depth[end - 1 - s]; p += LANES)
                kt_v4_store(row + p, kt_v4_splat(w.inverse[s]) * kt_v4_load(row + p));
        }
        end -= w.count;
    }
    return failed;
}

/* ---- passes ------------------------------------------------------------------------------------------------------ */

/* Numbers of the path that the next row needs immediately are also passed in a register. If all rows are short
 * (is_short), numbers are processed one by one. */

/* x becomes L x or, to solve, L^-1 x, from the root to the tips. With `scale`, the result is multiplied by D. `path`
 * holds the numbers of the ancestors, by their depth. */
KT_INLINE void pass_down(const kt_mass_factor *f, bool is_short, bool solve, bool scale, double *x) {
    const size_t nv = f->model->n.v, *begin = f->row;
    const int32_t *depths = f->depth;
    const double *number = f->number, *diagonal = f->diagonal;
    double *path = f->path, last = 0.0;
    size_t before = SIZE_MAX;
    for (size_t k = 0; k < nv; k++) {
        const size_t depth = (size_t)depths[k];
        const double *row = number + begin[k];
        double sum;
        if (is_short)
            sum = dot_short(depth, row, path, 0.0);
        else if (depth % (2 * LANES) == 0)
            sum = dot(depth, row, path);
        else
            sum = dot(depth - 1, row, path) + row[depth - 1] * (depth == before + 1 ? last : path[depth - 1]);
        const double y = solve ? x[k] - sum : x[k] + sum;
        path[depth] = last = solve ? y : x[k];
        x[k] = scale ? y * diagonal[k] : y;
        before = depth;
    }
}

/* x becomes L' x or, to solve, L^-T x, from the tips to the root. With `scale`, x is divided by `diagonal`. `path`
 * holds the sums for the ancestors, by their depth. */
KT_INLINE void pass_up(const kt_mass_factor *f, bool is_short, bool solve, bool scale, double *x) {
    const size_t nv = f->model->n.v, *begin = f->row;
    const int32_t *depths = f->depth;
    const double *number = f->number, *diagonal = f->diagonal;
    double *path = f->sum, next = 0.0;
    size_t after = 0;
    for (size_t k = nv; k-- > 0;) {
        const size_t depth = (size_t)depths[k];
        const double *row = number + begin[k];
        const double sum = !is_short && depth + 1 == after ? next : path[depth], y = solve ? x[k] - sum : x[k] + sum;
        const double by = solve ? y : x[k];
        if (is_short) {
            add_short(depth, by, row, path);
        } else if (depth > 0) {
            next = path[depth - 1] + by * row[depth - 1];
            add_multiple(depth, by, row, path);
        } else {
            kt_v4_store(path, kt_v4_splat(0.0));
        }
        x[k] = scale ? y / diagonal[k] : y;
        after = depth;
    }
}

/* Applies M^-1 = L^-1 D^-1 L^-T, a part of it, or M = L' D L. `call` names which. The compiler knows is_short at each
 * use. */
KT_INLINE void pass(const kt_mass_factor *f, bool is_short, kt_factor_call call, double *x) {
    const bool solve = call != KT_FACTOR_MULTIPLY;
    if (call == KT_FACTOR_SOLVE || call == KT_FACTOR_SOLVE_UPPER)
        pass_up(f, is_short, true, call == KT_FACTOR_SOLVE, x);
    if (call != KT_FACTOR_SOLVE_UPPER)
        pass_down(f, is_short, solve, !solve, x);
    if (call == KT_FACTOR_MULTIPLY)
        pass_up(f, is_short, false, false, x);
}

KT_INLINE void pass_columns(const kt_mass_factor *f, kt_factor_call call, int columns, double *x) {
    for (; columns > 0; columns--, x += f->model->n.v)
        if (f->is_short)
            pass(f, true, call, x);
        else
            pass(f, false, call, x);
}

static void solve_factored(const kt_mass_factor *f, int columns, double *x) {
    pass_columns(f, KT_FACTOR_SOLVE, columns, x);
}
static void solve_lower(const kt_mass_factor *f, int columns, double *x) {
    pass_columns(f, KT_FACTOR_SOLVE_LOWER, columns, x);
}
static void solve_upper(const kt_mass_factor *f, int columns, double *x) {
    pass_columns(f, KT_FACTOR_SOLVE_UPPER, columns, x);
}
static void multiply_factored(const kt_mass_factor *f, int columns, double *x) {
    pass_columns(f, KT_FACTOR_MULTIPLY, columns, x);
}

const kt_factor_kernels KT_KERNEL(kt_factor_kernels) = {.compute = factor_mass,
                                                        .apply = {[KT_FACTOR_SOLVE] = solve_factored,
                                                                  [KT_FACTOR_SOLVE_LOWER] = solve_lower,
                                                                  [KT_FACTOR_SOLVE_UPPER] = solve_upper,
                                                                  [KT_FACTOR_MULTIPLY] = multiply_factored}};
