/* The largest margin and the least forces of contacts at rest (statics.h): a barrier method in the few directions in
 * which forces are not determined.
 *
 * For f = -t, or f = |x|^2 / 2 with t = 0, Newton's method minimises tau f + F for a growing tau. F is the sum of
 *
 *     -log(p_n - l - t),    -log(mu^2 (p_n - l - t)^2 - |p_t|^2),    -log(S - t - p) - log(S - t + p),    -log(cap - t)
 *
 * and, for t, a small part of |p|^2. F is self-concordant, and f at this minimum exceeds the least f by at most (nu +
 * that part) / tau, with the number nu of logarithms (Y. Nesterov, A. Nemirovskii, Interior-Point Polynomial Algorithms
 * in Convex Programming, doi:10.1137/1.9781611970791). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/statics.h"

#include "algebra/lu.h"
#include "kinetree/algebra.h"
#include "linear/cholesky.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum { STAGES = 10, NEWTON = 30, HALVINGS = 40 };
/* The factor of tau from stage to stage, so that nu / tau ends below kt_statics_exact. */
static const double growth = 20.0;
/* The factor of |p|^2 / 2 in F, for t. Forces that press bodies together without a bound end near its -1/2 power. */
static const double square_of_forces = 1e-4;
/* An item whose margin exceeds the least margin by more than this part of `unit` does not bound the margin. */
static const double bounding = 1e-7;
/* Curvatures below this part of the diagonal are rounding. */
static const double hidden = 1e-13;
/* Columns of A' below this part of the longest one are rounding. */
static const double dependent = 1e-10;

KT_ARENA_LAYOUT(lay_out_statics, kt_statics, KT_STATICS_FIELDS, size_t rows, size_t columns)

size_t kt_statics_size(size_t rows, size_t columns) { return lay_out_statics(NULL, rows, columns); }

kt_statics *kt_statics_init(size_t rows, size_t columns, void *memory) {
    kt_statics *statics = memory;
    (void)lay_out_statics(memory, rows, columns);
    statics->n = statics->rows = statics->rank = statics->nullity = 0;
    statics->columns = (int)columns;
    statics->unit = statics->margin = 0.0;
    return statics;
}

kt_statics_item *kt_statics_add(kt_statics *statics, kt_statics_type type, double friction, double least,
                                double metric) {
    assert(type == KT_STATICS_FREE || friction >= 0.0);
    kt_statics_item *item = &statics->item[statics->n++];
    *item =
        (kt_statics_item){.type = type, .row = statics->rows, .friction = friction, .least = least, .metric = metric};
    statics->rows += type == KT_STATICS_CONE ? 3 : 1;
    return item;
}

/* ---- p0 and Z ---------------------------------------------------------------------------------------------------- */

/* Removes the parts along the first n vectors of the basis from x, twice. Returns the square of the remainder. */
static double remove_basis(const kt_statics *statics, int n, double *x) {
    for (int pass = 0; pass < 2; pass++)
        for (int j = 0; j < n; j++) {
            const double *z = statics->basis + j * statics->rows, along = kt_dense_dot(z, x, statics->rows);
            for (int i = 0; i < statics->rows; i++)
                x[i] -= along * z[i];
        }
    return kt_dense_dot(x, x, statics->rows);
}

static void normalise_vector(kt_statics *statics, int n, double square) {
    double *z = statics->basis + n * statics->rows;
    for (int i = 0; i < statics->rows; i++)
        z[i] /= sqrt(square);
}

/* Writes the longest remaining column of A' to vector n of the basis. Returns the square of its length. */
static double copy_longest_column(kt_statics *statics, int n) {
    double most = 0.0, *z = statics->basis + n * statics->rows;
    int longest = 0;
    for (int j = 0; j < statics->columns; j++) {
        double square = 0.0;
        for (int i = 0; i < statics->rows; i++)
            square += statics->work[i * statics->columns + j] * statics->work[i * statics->columns + j];
        longest = square > most ? j : longest;
        most = fmax(most, square);
    }
    for (int i = 0; i < statics->rows; i++)
        z[i] = statics->work[i * statics->columns + longest];
    return remove_basis(statics, n, z);
}

/* Removes vector n of the basis from the remaining columns. */
static void remove_from_columns(kt_statics *statics, int n) {
    const double *z = statics->basis + n * statics->rows;
    for (int j = 0; j < statics->columns; j++) {
        double along = 0.0;
        for (int i = 0; i < statics->rows; i++)
            along += z[i] * statics->work[i * statics->columns + j];
        for (int i = 0; i < statics->rows; i++)
            statics->work[i * statics->columns + j] -= along * z[i];
    }
}

/* Orthonormalises the columns by Gram-Schmidt with pivoting, the longest remaining column first. Stops at columns
 * that depend on earlier ones, and stores the rank. */
static void find_range(kt_statics *statics) {
    double first = 0.0;
    memcpy(statics->work, statics->matrix, (size_t)(statics->rows * statics->columns) * sizeof *statics->work);
    for (statics->rank = 0; statics->rank < statics->rows && statics->rank < statics->columns; statics->rank++) {
        const double square = copy_longest_column(statics, statics->rank);
        first = statics->rank == 0 ? square : first;
        if (!(square > dependent * dependent * first))
            break;
        normalise_vector(statics, statics->rank, square);
        remove_from_columns(statics, statics->rank);
    }
}

/* Completes the basis with unit vectors, in each step the unit vector that is farthest from the basis. */
static void find_null_space(kt_statics *statics) {
    statics->nullity = statics->rows - statics->rank;
    for (int n = statics->rank; n < statics->rows; n++) {
        double least = HUGE_VAL, *z = statics->basis + n * statics->rows;
        int farthest = 0;
        for (int i = 0; i < statics->rows; i++) {
            double inside = 0.0;
            for (int j = 0; j < n; j++)
                inside += statics->basis[j * statics->rows + i] * statics->basis[j * statics->rows + i];
            farthest = inside < least ? i : farthest;
            least = fmin(least, inside);
        }
        memset(z, 0, (size_t)statics->rows * sizeof *z);
        z[farthest] = 1.0;
        normalise_vector(statics, n, remove_basis(statics, n, z));
    }
}

/* Scales the rows of A': a force p is scale^-1 times the scaled force. columns: A is square, and its equations are
 * scaled likewise, so that a symmetric A stays symmetric. */
static void scale_rows(kt_statics *statics, bool columns) {
    for (int k = 0; k < statics->n; k++) {
        const kt_statics_item *item = &statics->item[k];
        for (int i = item->row; i < item->row + (item->type == KT_STATICS_CONE ? 3 : 1); i++)
            statics->scale[i] = item->metric > 0.0 ? sqrt(item->metric) : 1.0;
    }
    for (int i = 0; i < statics->rows; i++)
        for (int j = 0; j < statics->columns; j++)
            statics->matrix[i * statics->columns + j] /= statics->scale[i] * (columns ? statics->scale[j] : 1.0);
}

/* Determines `unit`, and expresses forces and limits in this unit. */
static void choose_unit(kt_statics *statics) {
    statics->unit = 0.0;
    for (int i = 0; i < statics->rows; i++)
        statics->unit = fmax(statics->unit, fabs(statics->p[i]));
    for (int k = 0; k < statics->n; k++)
        statics->unit = fmax(statics->unit, statics->item[k].least * statics->scale[statics->item[k].row]);
    for (int k = 0; k < statics->n && statics->unit > 0.0; k++) {
        kt_statics_item *item = &statics->item[k];
        const double by = statics->scale[item->row] / statics->unit;
        item->least *= by;
        item->friction *= item->type == KT_STATICS_DRY ? by : 1.0;
    }
    for (int i = 0; i < statics->rows && statics->unit > 0.0; i++)
        statics->p[i] /= statics->unit;
}

void kt_statics_begin(kt_statics *statics) {
    scale_rows(statics, false);
    find_range(statics);
    find_null_space(statics);
    for (int i = 0; i < statics->rows; i++)
        statics->p[i] *= statics->scale[i];
    for (int n = statics->rank; n < statics->rows; n++) {
        const double *z = statics->basis + n * statics->rows, along = kt_dense_dot(z, statics->p, statics->rows);
        for (int i = 0; i < statics->rows; i++)
            statics->p[i] -= along * z[i];
    }
    choose_unit(statics);
}

/* Solves the r equations A y = c, by column. A symmetric matrix has to be positive definite. */
static bool solve_range(kt_statics *statics, int r, bool symmetric, double *A, double *y) {
    if (symmetric) {
        if (r > 0 && !kt_dense_cholesky(A, (size_t)r, r, NULL))
            return false;
        kt_dense_solve(A, r, y);
        return true;
    }
    if (!kt_lu_factor(A, (size_t)r, statics->pivot))
        return false;
    kt_lu_solve_transposed(A, (size_t)r, statics->pivot, y);
    return true;
}

/* Solves Q'A Q y = Q'c with the basis Q of the range, and writes Q y to p, which is c at first. */
static bool solve_in_range(kt_statics *statics, bool symmetric) {
    const int r = statics->rank, m = statics->rows;
    double *A = statics->hessian, *y = statics->step; /* A': its columns are rows of Q'A Q */
    for (int j = 0; j < r; j++) {
        const double *z = statics->basis + j * m;
        y[j] = kt_dense_dot(z, statics->p, m);
        for (int i = 0; i < m; i++)
            statics->change[i] = kt_dense_dot(statics->matrix + i * m, z, m);
        for (int i = 0; i < r; i++)
            A[j * r + i] = kt_dense_dot(statics->basis + i * m, statics->change, m);
    }
    if (!solve_range(statics, r, symmetric, A, y))
        return false;
    memset(statics->p, 0, (size_t)m * sizeof *statics->p);
    for (int j = 0; j < r; j++)
        for (int i = 0; i < m; i++)
            statics->p[i] += y[j] * statics->basis[j * m + i];
    return true;
}

bool kt_statics_begin_square(kt_statics *statics, bool symmetric) {
    assert(statics->columns == statics->rows);
    scale_rows(statics, true);
    find_range(statics);
    find_null_space(statics);
    for (int i = 0; i < statics->rows; i++)
        statics->p[i] /= statics->scale[i];
    const bool solves = solve_in_range(statics, symmetric);
    choose_unit(statics);
    return solves;
}

/* ---- the barrier ------------------------------------------------------------------------------------------------- */

/* The largest t with which the forces p of an item are in its cone: p_n - l - |p_t| / mu of a contact, S - |p| of dry
 * friction; negative outside of the cone. */
static double margin_of_item(const kt_statics_item *item, const double *p) {
    if (item->type == KT_STATICS_FREE)
        return HUGE_VAL;
    if (item->type == KT_STATICS_DRY)
        return item->friction - fabs(p[item->row]);
    const double normal = p[item->row] - item->least;
    return item->type == KT_STATICS_NORMAL ? normal
                                           : normal - kt_hypot(p[item->row + 1], p[item->row + 2]) / item->friction;
}

static double margin_of_all(const kt_statics *statics, const double *p) {
    double least = HUGE_VAL;
    for (int k = 0; k < statics->n; k++)
        least = fmin(least, margin_of_item(&statics->item[k], p));
    return least;
}

/* The barrier F of an item: infinite outside of its cone or of its bounds. */
static double barrier_of(const kt_statics_item *item, const double *p, double t) {
    const double *x = p + item->row, s = x[0] - item->least - t, mu = item->friction;
    if (!(margin_of_item(item, p) > t))
        return HUGE_VAL;
    if (item->type == KT_STATICS_FREE)
        return 0.0;
    if (item->type == KT_STATICS_DRY)
        return -log(mu - t - x[0]) - log(mu - t + x[0]);
    const double across = item->type == KT_STATICS_CONE ? kt_hypot(x[1], x[2]) : 0.0;
    return item->type == KT_STATICS_CONE ? -log(mu * s - across) - log(mu * s + across) : -log(s);
}

/* Derivatives of F of an item by its (up to three) forces and by t: g, and h by rows (4 x 4). */
static void differentiate_barrier(const kt_statics_item *item, const double *p, double t, double *g, double *h) {
    const double *x = p + item->row, s = x[0] - item->least - t, mu = item->friction;
    memset(g, 0, 4 * sizeof *g);
    memset(h, 0, 16 * sizeof *h);
    if (item->type == KT_STATICS_FREE)
        return;
    if (item->type == KT_STATICS_DRY) {
        const double above = 1.0 / (mu - t - x[0]), below = 1.0 / (mu - t + x[0]);
        g[0] = above - below;
        g[3] = above + below;
        h[0] = h[15] = above * above + below * below;
        h[3] = h[12] = above * above - below * below;
        return;
    }
    if (item->type == KT_STATICS_NORMAL) {
        g[0] = -1.0 / s;
        h[0] = 1.0 / (s * s);
    } else {
        const double size = kt_hypot(x[1], x[2]), D = (mu * s - size) * (mu * s + size);
        const double a[3] = {2.0 * mu * mu * s, -2.0 * x[1], -2.0 * x[2]};
        for (int i = 0; i < 3; i++) {
            g[i] = -a[i] / D;
            for (int j = 0; j < 3; j++)
                h[4 * i + j] = a[i] * a[j] / (D * D);
            h[5 * i] -= (i == 0 ? 2.0 * mu * mu : -2.0) / D;
        }
    }
    g[3] = -g[0];
    h[15] = h[0];
    for (int i = 0; i < 3; i++)
        h[12 + i] = h[4 * i + 3] = -h[i];
}

/* The function that is minimised: tau f + F. moves: t is an unknown, f = -t; otherwise f = |p|^2 / 2. With the unknown
 * t, the square of p is a part of F, too, because internal forces of wedges have no bound, and the logarithms have no
 * minimum along such forces. */
typedef struct target {
    double tau;
    bool moves;
} target;

/* The change of tau f + F over a part of the step. Since tau f is large compared with its change, the change is
 * computed directly, not as a difference. */
static double change_of_value(const kt_statics *statics, const target *of, double part, double t, double next) {
    const double along = kt_dense_dot(statics->p, statics->change, statics->rows),
                 square = kt_dense_dot(statics->change, statics->change, statics->rows);
    double sum = (of->moves ? square_of_forces : of->tau) * part * (along + 0.5 * part * square);
    if (!(next < kt_statics_cap))
        return HUGE_VAL;
    sum += of->moves ? -of->tau * (next - t) - log((kt_statics_cap - next) / (kt_statics_cap - t)) : 0.0;
    for (int k = 0; k < statics->n; k++)
        sum += barrier_of(&statics->item[k], statics->next, next) - barrier_of(&statics->item[k], statics->p, t);
    return sum;
}

/* Writes the part of each unknown in an item: a row for each of its forces along Z, and one for t. Loops along rows
 * take several unknowns at a time. */
static void copy_local_rows(const kt_statics *statics, const kt_statics_item *item, int n) {
    const int forces = item->type == KT_STATICS_CONE ? 3 : 1;
    memset(statics->local, 0, 4 * (size_t)n * sizeof *statics->local);
    for (int j = 0; j < statics->nullity; j++)
        for (int k = 0; k < forces; k++)
            statics->local[k * n + j] = statics->basis[(statics->rank + j) * statics->rows + item->row + k];
    if (n > statics->nullity)
        statics->local[4 * n - 1] = 1.0;
}

/* Adds the derivatives of an item's terms to the derivatives by all unknowns. */
static void add_item_derivatives(kt_statics *statics, int n, const kt_statics_item *item, double t) {
    double g[4], h[16], column[4];
    const double *x = statics->local, *y = x + n, *z = y + n, *w = z + n;
    differentiate_barrier(item, statics->p, t, g, h);
    copy_local_rows(statics, item, n);
    for (int j = 0; j < n; j++) {
        double *restrict hessian = statics->hessian + j * n;
        statics->step[j] -= g[0] * x[j] + g[1] * y[j] + g[2] * z[j] + g[3] * w[j];
        for (int a = 0; a < 4; a++)
            column[a] = h[4 * a] * x[j] + h[4 * a + 1] * y[j] + h[4 * a + 2] * z[j] + h[4 * a + 3] * w[j];
        for (int i = j; i < n; i++)
            hessian[i] += x[i] * column[0] + y[i] * column[1] + z[i] * column[2] + w[i] * column[3];
    }
}

/* Newton's step of x and t. Returns the square of its length in the metric of F; 0: there is none. */
static double find_newton_step(kt_statics *statics, const target *of, double t) {
    const int n = statics->nullity + of->moves;
    memset(statics->hessian, 0, (size_t)(n * n) * sizeof *statics->hessian);
    const double square = of->moves ? square_of_forces : of->tau;
    for (int j = 0; j < statics->nullity; j++) {
        statics->step[j] =
            -square * kt_dense_dot(statics->basis + (statics->rank + j) * statics->rows, statics->p, statics->rows);
        statics->hessian[j * n + j] = square;
    }
    if (of->moves) {
        const double left = kt_statics_cap - t;
        statics->step[statics->nullity] = of->tau - 1.0 / left;
        statics->hessian[n * n - 1] = 1.0 / (left * left);
    }
    for (int k = 0; k < statics->n; k++)
        add_item_derivatives(statics, n, &statics->item[k], t);
    memcpy(statics->change, statics->step, (size_t)n * sizeof *statics->step);
    for (int j = 0; j < n;
         j++) /* next to a bound, rounding hides the directions along it, which have converged before */
        statics->hessian[j * n + j] *= 1.0 + hidden;
    if (!kt_dense_cholesky(statics->hessian, (size_t)n, n, NULL))
        return 0.0;
    kt_dense_solve(statics->hessian, n, statics->step);
    return kt_dense_dot(statics->change, statics->step, n);
}

/* Takes a part of the step that lowers tau f + F. Returns whether there is one. */
static bool take_newton_step(kt_statics *statics, const target *of, double *t, double square) {
    memset(statics->change, 0, (size_t)statics->rows * sizeof *statics->change);
    for (int j = 0; j < statics->nullity; j++)
        for (int i = 0; i < statics->rows; i++)
            statics->change[i] += statics->step[j] * statics->basis[(statics->rank + j) * statics->rows + i];
    for (int k = 0; k < HALVINGS; k++) {
        const double part = ldexp(1.0, -k);
        const double next = *t + (of->moves ? part * statics->step[statics->nullity] : 0.0);
        for (int i = 0; i < statics->rows; i++)
            statics->next[i] = statics->p[i] + part * statics->change[i];
        if (!(change_of_value(statics, of, part, *t, next) <= -1e-3 * part * square))
            continue;
        memcpy(statics->p, statics->next, (size_t)statics->rows * sizeof *statics->p);
        *t = next;
        return true;
    }
    return false;
}

/* Minimises f, from a point inside: over x and t (moves), or over x at the given t. Returns the last tau. */
static double follow_path(kt_statics *statics, bool moves, double *t) {
    target of = {.tau = 1.0, .moves = moves};
    for (int stage = 0; stage < STAGES; stage++) {
        for (int k = 0; k < NEWTON; k++) {
            const double square = find_newton_step(statics, &of, *t);
            if (!(square > 1e-8) || !take_newton_step(statics, &of, t, square))
                break;
        }
        of.tau *= growth;
    }
    return of.tau / growth;
}

bool kt_statics_bounds_margin(const kt_statics *statics, int item) {
    assert(item >= 0 && item < statics->n);
    return margin_of_item(&statics->item[item], statics->p) <= statics->margin + bounding;
}

void kt_statics_find_margin(kt_statics *statics) {
    const double margin = margin_of_all(statics, statics->p);
    statics->margin = fmin(margin, kt_statics_cap);
    if (statics->unit == 0.0 || statics->nullity == 0 || statics->margin == kt_statics_cap)
        return;
    double t = statics->margin - 1.0;
    const double tau = follow_path(statics, true, &t);
    statics->margin = t;
    for (int k = 0; k < statics->n; k++) /* each item that bounds the margin leaves 1 / tau of it */
        statics->margin += kt_statics_bounds_margin(statics, k) && t < kt_statics_cap - bounding ? 1.0 / tau : 0.0;
}

void kt_statics_find_least(kt_statics *statics) {
    double t = 0.0;
    if (statics->unit > 0.0 && statics->nullity > 0 && statics->margin > kt_statics_exact &&
        statics->margin < kt_statics_cap)
        (void)follow_path(statics, false, &t);
}
