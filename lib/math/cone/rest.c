/* The largest margin and the least forces of contacts at rest (rest.h): a barrier method in the few directions in which
 * forces are not determined.
 *
 * For f = -t, or f = |x|^2 / 2 with t = 0, Newton's method minimises tau f + F for a growing tau. F is the sum of
 *
 *     -log(p_n - l - t),    -log(mu^2 (p_n - l - t)^2 - |p_t|^2),    -log(S - t - p) - log(S - t + p),    -log(cap - t)
 *
 * and, for t, |p|^2 / 2. F is self-concordant, and f at this minimum exceeds the least f by at most (nu + |p|^2 / 2) /
 * tau, with the number nu of logarithms (Y. Nesterov, A. Nemirovskii, Interior-Point Polynomial Algorithms in Convex
 * Programming, doi:10.1137/1.9781611970791). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/rest.h"

#include "kinetree/algebra.h"
#include "linear/cholesky.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum { STAGES = 10, NEWTON = 30, HALVINGS = 40 };
/* The factor of tau from stage to stage, so that nu / tau ends below kt_rest_exact. */
static const double growth = 20.0;
/* An item whose margin exceeds the least margin by more than this part of `unit` does not bound the margin. */
static const double bounding = 1e-7;
/* Curvatures below this part of the diagonal are rounding. */
static const double hidden = 1e-13;
/* Columns of A' below this part of the longest one are rounding. */
static const double dependent = 1e-10;

KT_ARENA_LAYOUT(lay_out_rest, kt_rest, KT_REST_FIELDS, size_t rows, size_t columns)

size_t kt_rest_size(size_t rows, size_t columns) { return lay_out_rest(NULL, rows, columns); }

kt_rest *kt_rest_init(size_t rows, size_t columns, void *memory) {
    kt_rest *rest = memory;
    (void)lay_out_rest(memory, rows, columns);
    rest->n = rest->rows = rest->rank = rest->nullity = 0;
    rest->columns = (int)columns;
    rest->unit = rest->margin = 0.0;
    return rest;
}

kt_rest_item *kt_rest_add(kt_rest *rest, kt_rest_type type, double friction, double least, double metric) {
    assert(type == KT_REST_FREE || friction >= 0.0);
    kt_rest_item *item = &rest->item[rest->n++];
    *item = (kt_rest_item){.type = type, .row = rest->rows, .friction = friction, .least = least, .metric = metric};
    rest->rows += type == KT_REST_CONE ? 3 : 1;
    return item;
}

/* ---- p0 and Z ---------------------------------------------------------------------------------------------------- */

/* Removes the parts along the first n vectors of the basis from x, twice. Returns the square of the remainder. */
static double remove_basis(const kt_rest *rest, int n, double *x) {
    for (int pass = 0; pass < 2; pass++)
        for (int j = 0; j < n; j++) {
            const double *z = rest->basis + j * rest->rows, along = kt_dense_dot(z, x, rest->rows);
            for (int i = 0; i < rest->rows; i++)
                x[i] -= along * z[i];
        }
    return kt_dense_dot(x, x, rest->rows);
}

static void normalise_vector(kt_rest *rest, int n, double square) {
    double *z = rest->basis + n * rest->rows;
    for (int i = 0; i < rest->rows; i++)
        z[i] /= sqrt(square);
}

/* Writes the longest remaining column of A' to vector n of the basis. Returns the square of its length. */
static double copy_longest_column(kt_rest *rest, int n) {
    double most = 0.0, *z = rest->basis + n * rest->rows;
    int longest = 0;
    for (int j = 0; j < rest->columns; j++) {
        double square = 0.0;
        for (int i = 0; i < rest->rows; i++)
            square += rest->work[i * rest->columns + j] * rest->work[i * rest->columns + j];
        longest = square > most ? j : longest;
        most = fmax(most, square);
    }
    for (int i = 0; i < rest->rows; i++)
        z[i] = rest->work[i * rest->columns + longest];
    return remove_basis(rest, n, z);
}

/* Removes vector n of the basis from the remaining columns. */
static void remove_from_columns(kt_rest *rest, int n) {
    const double *z = rest->basis + n * rest->rows;
    for (int j = 0; j < rest->columns; j++) {
        double along = 0.0;
        for (int i = 0; i < rest->rows; i++)
            along += z[i] * rest->work[i * rest->columns + j];
        for (int i = 0; i < rest->rows; i++)
            rest->work[i * rest->columns + j] -= along * z[i];
    }
}

/* Orthonormalises the columns by Gram-Schmidt with pivoting, the longest remaining column first. Stops at columns
 * that depend on earlier ones, and stores the rank. */
static void find_range(kt_rest *rest) {
    double first = 0.0;
    memcpy(rest->work, rest->matrix, (size_t)(rest->rows * rest->columns) * sizeof *rest->work);
    for (rest->rank = 0; rest->rank < rest->rows && rest->rank < rest->columns; rest->rank++) {
        const double square = copy_longest_column(rest, rest->rank);
        first = rest->rank == 0 ? square : first;
        if (!(square > dependent * dependent * first))
            break;
        normalise_vector(rest, rest->rank, square);
        remove_from_columns(rest, rest->rank);
    }
}

/* Completes the basis with unit vectors, in each step the unit vector that is farthest from the basis. */
static void find_null_space(kt_rest *rest) {
    rest->nullity = rest->rows - rest->rank;
    for (int n = rest->rank; n < rest->rows; n++) {
        double least = HUGE_VAL, *z = rest->basis + n * rest->rows;
        int farthest = 0;
        for (int i = 0; i < rest->rows; i++) {
            double inside = 0.0;
            for (int j = 0; j < n; j++)
                inside += rest->basis[j * rest->rows + i] * rest->basis[j * rest->rows + i];
            farthest = inside < least ? i : farthest;
            least = fmin(least, inside);
        }
        memset(z, 0, (size_t)rest->rows * sizeof *z);
        z[farthest] = 1.0;
        normalise_vector(rest, n, remove_basis(rest, n, z));
    }
}

/* Scales the rows of A': a force p is scale^-1 times the scaled force. */
static void scale_rows(kt_rest *rest, bool columns) {
    for (int k = 0; k < rest->n; k++) {
        const kt_rest_item *item = &rest->item[k];
        for (int i = item->row; i < item->row + (item->type == KT_REST_CONE ? 3 : 1); i++)
            rest->scale[i] = item->metric > 0.0 ? sqrt(item->metric) : 1.0;
    }
    for (int i = 0; i < rest->rows; i++)
        for (int j = 0; j < rest->columns; j++)
            rest->matrix[i * rest->columns + j] /= rest->scale[i] * (columns ? rest->scale[j] : 1.0);
}

/* Determines `unit`, and expresses forces and limits in this unit. */
static void choose_unit(kt_rest *rest) {
    rest->unit = 0.0;
    for (int i = 0; i < rest->rows; i++)
        rest->unit = fmax(rest->unit, fabs(rest->p[i]));
    for (int k = 0; k < rest->n && rest->unit > 0.0; k++) {
        kt_rest_item *item = &rest->item[k];
        const double by = rest->scale[item->row] / rest->unit;
        item->least *= by;
        item->friction *= item->type == KT_REST_DRY ? by : 1.0;
    }
    for (int i = 0; i < rest->rows && rest->unit > 0.0; i++)
        rest->p[i] /= rest->unit;
}

void kt_rest_begin(kt_rest *rest) {
    scale_rows(rest, false);
    find_range(rest);
    find_null_space(rest);
    for (int i = 0; i < rest->rows; i++)
        rest->p[i] *= rest->scale[i];
    for (int n = rest->rank; n < rest->rows; n++) {
        const double *z = rest->basis + n * rest->rows, along = kt_dense_dot(z, rest->p, rest->rows);
        for (int i = 0; i < rest->rows; i++)
            rest->p[i] -= along * z[i];
    }
    choose_unit(rest);
}

/* Solves Q'A Q y = Q'c with the basis Q of the range, and writes Q y to p, which is c at first. */
static bool solve_in_range(kt_rest *rest) {
    const int r = rest->rank, m = rest->rows;
    double *A = rest->hessian, *y = rest->step;
    for (int j = 0; j < r; j++) {
        const double *z = rest->basis + j * m;
        y[j] = kt_dense_dot(z, rest->p, m);
        for (int i = 0; i < m; i++)
            rest->change[i] = kt_dense_dot(rest->matrix + i * m, z, m);
        for (int i = 0; i < r; i++)
            A[j * r + i] = kt_dense_dot(rest->basis + i * m, rest->change, m);
    }
    if (r > 0 && !kt_dense_cholesky(A, (size_t)r, r, NULL))
        return false;
    kt_dense_solve(A, r, y);
    memset(rest->p, 0, (size_t)m * sizeof *rest->p);
    for (int j = 0; j < r; j++)
        for (int i = 0; i < m; i++)
            rest->p[i] += y[j] * rest->basis[j * m + i];
    return true;
}

bool kt_rest_begin_symmetric(kt_rest *rest) {
    assert(rest->columns == rest->rows);
    scale_rows(rest, true);
    find_range(rest);
    find_null_space(rest);
    for (int i = 0; i < rest->rows; i++)
        rest->p[i] /= rest->scale[i];
    const bool solves = solve_in_range(rest);
    choose_unit(rest);
    return solves;
}

/* ---- the barrier ------------------------------------------------------------------------------------------------- */

/* The largest t with which the forces p of an item are in its cone. */
static double margin_of_item(const kt_rest_item *item, const double *p) {
    if (item->type == KT_REST_FREE)
        return HUGE_VAL;
    if (item->type == KT_REST_DRY)
        return item->friction - fabs(p[item->row]);
    const double normal = p[item->row] - item->least;
    return item->type == KT_REST_NORMAL ? normal
                                        : normal - kt_hypot(p[item->row + 1], p[item->row + 2]) / item->friction;
}

static double margin_of_all(const kt_rest *rest, const double *p) {
    double least = HUGE_VAL;
    for (int k = 0; k < rest->n; k++)
        least = fmin(least, margin_of_item(&rest->item[k], p));
    return least;
}

/* The barrier F of an item: infinite outside of its cone or of its bounds. */
static double barrier_of(const kt_rest_item *item, const double *p, double t) {
    const double *x = p + item->row, s = x[0] - item->least - t, mu = item->friction;
    if (!(margin_of_item(item, p) > t))
        return HUGE_VAL;
    if (item->type == KT_REST_FREE)
        return 0.0;
    if (item->type == KT_REST_DRY)
        return -log(mu - t - x[0]) - log(mu - t + x[0]);
    const double across = item->type == KT_REST_CONE ? kt_hypot(x[1], x[2]) : 0.0;
    return item->type == KT_REST_CONE ? -log(mu * s - across) - log(mu * s + across) : -log(s);
}

/* Derivatives of F of an item by its (up to three) forces and by t: g, and h by rows (4 x 4). */
static void differentiate_barrier(const kt_rest_item *item, const double *p, double t, double *g, double *h) {
    const double *x = p + item->row, s = x[0] - item->least - t, mu = item->friction;
    memset(g, 0, 4 * sizeof *g);
    memset(h, 0, 16 * sizeof *h);
    if (item->type == KT_REST_FREE)
        return;
    if (item->type == KT_REST_DRY) {
        const double above = 1.0 / (mu - t - x[0]), below = 1.0 / (mu - t + x[0]);
        g[0] = above - below;
        g[3] = above + below;
        h[0] = h[15] = above * above + below * below;
        h[3] = h[12] = above * above - below * below;
        return;
    }
    if (item->type == KT_REST_NORMAL) {
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
static double change_of_value(const kt_rest *rest, const target *of, double part, double t, double next) {
    const double along = kt_dense_dot(rest->p, rest->change, rest->rows),
                 square = kt_dense_dot(rest->change, rest->change, rest->rows);
    double sum = (of->moves ? 1.0 : of->tau) * part * (along + 0.5 * part * square);
    if (!(next < kt_rest_cap))
        return HUGE_VAL;
    sum += of->moves ? -of->tau * (next - t) - log((kt_rest_cap - next) / (kt_rest_cap - t)) : 0.0;
    for (int k = 0; k < rest->n; k++)
        sum += barrier_of(&rest->item[k], rest->next, next) - barrier_of(&rest->item[k], rest->p, t);
    return sum;
}

/* Writes the part of each unknown in an item, four numbers each: its forces along Z, and t. */
static void copy_local_columns(const kt_rest *rest, const kt_rest_item *item, int n) {
    const int forces = item->type == KT_REST_CONE ? 3 : 1;
    memset(rest->local, 0, 4 * (size_t)n * sizeof *rest->local);
    for (int j = 0; j < rest->nullity; j++)
        memcpy(rest->local + 4 * j, rest->basis + (rest->rank + j) * rest->rows + item->row,
               (size_t)forces * sizeof *rest->local);
    if (n > rest->nullity)
        rest->local[4 * n - 1] = 1.0;
}

/* Adds the derivatives of an item's terms to the derivatives by all unknowns. */
static void add_item_derivatives(kt_rest *rest, int n, const kt_rest_item *item, double t) {
    double g[4], h[16], column[4];
    differentiate_barrier(item, rest->p, t, g, h);
    copy_local_columns(rest, item, n);
    for (int j = 0; j < n; j++) {
        const double *x = rest->local + 4 * j;
        rest->step[j] -= g[0] * x[0] + g[1] * x[1] + g[2] * x[2] + g[3] * x[3];
        for (int a = 0; a < 4; a++)
            column[a] = h[4 * a] * x[0] + h[4 * a + 1] * x[1] + h[4 * a + 2] * x[2] + h[4 * a + 3] * x[3];
        for (int i = j; i < n; i++) {
            const double *y = rest->local + 4 * i;
            rest->hessian[j * n + i] += y[0] * column[0] + y[1] * column[1] + y[2] * column[2] + y[3] * column[3];
        }
    }
}

/* Newton's step of x and t. Returns the square of its length in the metric of F; 0: there is none. */
static double find_newton_step(kt_rest *rest, const target *of, double t) {
    const int n = rest->nullity + of->moves;
    memset(rest->hessian, 0, (size_t)(n * n) * sizeof *rest->hessian);
    const double square = of->moves ? 1.0 : of->tau;
    for (int j = 0; j < rest->nullity; j++) {
        rest->step[j] = -square * kt_dense_dot(rest->basis + (rest->rank + j) * rest->rows, rest->p, rest->rows);
        rest->hessian[j * n + j] = square;
    }
    if (of->moves) {
        const double left = kt_rest_cap - t;
        rest->step[rest->nullity] = of->tau - 1.0 / left;
        rest->hessian[n * n - 1] = 1.0 / (left * left);
    }
    for (int k = 0; k < rest->n; k++)
        add_item_derivatives(rest, n, &rest->item[k], t);
    memcpy(rest->change, rest->step, (size_t)n * sizeof *rest->step);
    for (int j = 0; j < n;
         j++) /* next to a bound, rounding hides the directions along it, which have converged before */
        rest->hessian[j * n + j] *= 1.0 + hidden;
    if (!kt_dense_cholesky(rest->hessian, (size_t)n, n, NULL))
        return 0.0;
    kt_dense_solve(rest->hessian, n, rest->step);
    return kt_dense_dot(rest->change, rest->step, n);
}

/* Takes a part of the step that lowers tau f + F. Returns whether there is one. */
static bool take_newton_step(kt_rest *rest, const target *of, double *t, double square) {
    memset(rest->change, 0, (size_t)rest->rows * sizeof *rest->change);
    for (int j = 0; j < rest->nullity; j++)
        for (int i = 0; i < rest->rows; i++)
            rest->change[i] += rest->step[j] * rest->basis[(rest->rank + j) * rest->rows + i];
    for (int k = 0; k < HALVINGS; k++) {
        const double part = ldexp(1.0, -k);
        const double next = *t + (of->moves ? part * rest->step[rest->nullity] : 0.0);
        for (int i = 0; i < rest->rows; i++)
            rest->next[i] = rest->p[i] + part * rest->change[i];
        if (!(change_of_value(rest, of, part, *t, next) <= -1e-3 * part * square))
            continue;
        memcpy(rest->p, rest->next, (size_t)rest->rows * sizeof *rest->p);
        *t = next;
        return true;
    }
    return false;
}

/* Minimises f, from a point inside. Returns the last tau. */
static double follow_path(kt_rest *rest, bool moves, double *t) {
    target of = {.tau = 1.0, .moves = moves};
    for (int stage = 0; stage < STAGES; stage++) {
        for (int k = 0; k < NEWTON; k++) {
            const double square = find_newton_step(rest, &of, *t);
            if (!(square > 1e-8) || !take_newton_step(rest, &of, t, square))
                break;
        }
        of.tau *= growth;
    }
    return of.tau / growth;
}

bool kt_rest_bounds_margin(const kt_rest *rest, int item) {
    assert(item >= 0 && item < rest->n);
    return margin_of_item(&rest->item[item], rest->p) <= rest->margin + bounding;
}

void kt_rest_find_margin(kt_rest *rest) {
    const double margin = margin_of_all(rest, rest->p);
    rest->margin = fmin(margin, kt_rest_cap);
    if (rest->unit == 0.0 || rest->nullity == 0 || rest->margin == kt_rest_cap)
        return;
    double t = rest->margin - 1.0;
    const double tau = follow_path(rest, true, &t);
    rest->margin = t;
    for (int k = 0; k < rest->n; k++) /* each item that bounds the margin leaves 1 / tau of it */
        rest->margin += kt_rest_bounds_margin(rest, k) && t < kt_rest_cap - bounding ? 1.0 / tau : 0.0;
}

void kt_rest_find_least(kt_rest *rest) {
    double t = 0.0;
    if (rest->unit > 0.0 && rest->nullity > 0 && rest->margin > kt_rest_exact && rest->margin < kt_rest_cap)
        (void)follow_path(rest, false, &t);
}
