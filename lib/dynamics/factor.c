/* M = L'DL along the tree (Featherstone 2008, 6.5): no entry becomes non-zero that was zero, so factors, products and
 * solutions cost O(n depth^2), O(n depth) and O(n depth) operations.
 *
 * Factors, from the last degree of freedom k to the first; i, j: of its support:
 *   M_ij -= M_ki M_kj / M_kk,   then   L_ki = M_ki / M_kk
 * Passes over the rows with the path from the root to k, p_i: one number for each i of its support:
 *   down, k ascending:    y_k = x_k +- sum_i L_ki p_i,   p_k = x_k or y_k                    (L x and L^-1 x)
 *   up, k descending:     y_k = x_k +- p_k,   p_i += L_ki (x_k or y_k),   p_k = 0            (L' x and L'^-1 x)
 * In depth-first order, the path is a stack: its entry at a depth belongs to k's support as long as it is needed.
 */
#include "dynamics/factor.h"

#include <string.h>

enum { LANES = 4 };

KT_INLINE kt_v4 load(const double *x) {
    kt_v4 v;
    memcpy(&v, x, sizeof v);
    return v;
}
KT_INLINE void store(double *x, kt_v4 v) { memcpy(x, &v, sizeof v); }

/* y[0, n) += a x[0, n). What has just been stored number by number is loaded so, too: no load waits for two stores. */
KT_INLINE void add_multiple(size_t n, double a, const double *x, double *y) {
    const kt_v4 aa = kt_v4_splat(a);
    size_t p = 0;
    for (; p + LANES <= n; p += LANES)
        store(y + p, load(y + p) + aa * load(x + p));
    for (; p < n; p++)
        y[p] += a * x[p];
}

/* x . y: eight sums of what comes in eights, and the rest in its order. */
KT_INLINE double dot(size_t n, const double *x, const double *y) {
    kt_v4 even = kt_v4_splat(0.0), odd = even;
    size_t p = 0;
    for (; p + 2 * LANES <= n; p += 2 * LANES) {
        even += load(x + p) * load(y + p);
        odd += load(x + p + LANES) * load(y + p + LANES);
    }
    const kt_v4 s = even + odd;
    double sum = (s[0] + s[2]) + (s[1] + s[3]);
    for (; p < n; p++)
        sum += x[p] * y[p];
    return sum;
}

/* ---- factors ----------------------------------------------------------------------------------------------------- */

/* Rows k, k - 1, ..., each of which carries the one before it, are subtracted from the rows of their support together. */
enum { PANEL = 4 };

typedef struct panel {
    size_t count;
    const double *row[PANEL];
    double inverse[PANEL]; /* of the pivots */
} panel;

/* M_ij -= M_ki M_kj / M_kk for i, the p-th of the support of the rows [first, end) of a panel, and all j <= i. The last
 * vector of a row may receive anything after its last number. */
KT_INLINE void subtract_rows(const panel *w, size_t first, size_t end, size_t p, double *diagonal, double *row) {
    double a[PANEL];
    for (size_t s = first; s < end; s++) {
        a[s] = w->row[s][p] * w->inverse[s];
        *diagonal -= a[s] * w->row[s][p];
    }
    for (size_t j = 0; j < p; j += LANES) {
        kt_v4 x = load(row + j);
        for (size_t s = first; s < end; s++)
            x -= kt_v4_splat(a[s]) * load(w->row[s] + j);
        store(row + j, x);
    }
}

/* From the rows of a panel; `count` is a constant. */
KT_INLINE void subtract_panel(kt_mass_factor *f, const panel *w, size_t count, size_t last) {
    int32_t i = f->parent[last];
    for (size_t p = (size_t)f->depth[last]; p-- > 0; i = f->parent[i])
        subtract_rows(w, 0, count, p, &f->diagonal[i], f->number + f->row[i]);
}

/* The factors of a panel that begins at row k; returns false with *failed where a pivot is not positive. */
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

size_t KT_KERNEL(kt_factor_compute)(kt_mass_factor *f) {
    size_t failed = f->model->n.v;
    for (size_t end = failed; end > 0;) {
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
                store(row + p, kt_v4_splat(w.inverse[s]) * load(row + p));
        }
        end -= w.count;
    }
    return failed;
}

/* ---- passes ------------------------------------------------------------------------------------------------------ */

KT_INLINE void pass_down(kt_mass_factor *f, bool solve, double *x) {
    for (size_t k = 0; k < f->model->n.v; k++) {
        const size_t depth = (size_t)f->depth[k];
        const double sum = dot(depth, f->number + f->row[k], f->path), y = solve ? x[k] - sum : x[k] + sum;
        f->path[depth] = solve ? y : x[k];
        x[k] = y;
    }
}

KT_INLINE void pass_up(kt_mass_factor *f, bool solve, double *x) {
    memset(f->path, 0, f->path_length * sizeof *f->path);
    for (size_t k = f->model->n.v; k-- > 0;) {
        const size_t depth = (size_t)f->depth[k];
        const double sum = f->path[depth], y = solve ? x[k] - sum : x[k] + sum;
        f->path[depth] = 0.0;
        add_multiple(depth, solve ? y : x[k], f->number + f->row[k], f->path);
        x[k] = y;
    }
}

void KT_KERNEL(kt_factor_down)(kt_mass_factor *f, kt_factor_use use, double *x) {
    if (use == KT_FACTOR_SOLVE)
        pass_down(f, true, x);
    else
        pass_down(f, false, x);
}

void KT_KERNEL(kt_factor_up)(kt_mass_factor *f, kt_factor_use use, double *x) {
    if (use == KT_FACTOR_SOLVE)
        pass_up(f, true, x);
    else
        pass_up(f, false, x);
}
