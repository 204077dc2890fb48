/* Dependence of the rows of items (coulomb.h): whether forces are unique, and a vertex of the set of forces that are
 * not. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"
#include "linear/cholesky.h"

#include <assert.h>
#include <math.h>

/* Factors W of the first rows of n items (c->active), relative to its diagonal, into L L'; row k of L is row k of
 * c->system->A. Returns the rank; dependent items are last. The row with the largest remainder is the next pivot.
 * Without this order, rounding of feet that are nearly in line would hide that a further foot depends on them. */
static int factor_items(const kt_coulomb *c, int n) {
    double *left = c->system->dp;
    for (int i = 0; i < n; i++)
        left[i] = kt_coulomb_coupling(c, c->item[c->active[i]].row, c->item[c->active[i]].row);
    for (int rank = 0; rank < n; rank++) {
        double *top = kt_coulomb_matrix_row(c->system->A, rank, c->system->width);
        int r = rank;
        for (int i = rank; i < n; i++)
            r = left[i] > left[r] ? i : r;
        if (!(left[r] > 1e-11))
            return rank;
        double *row = kt_coulomb_matrix_row(c->system->A, r, c->system->width);
        for (int j = 0; j < rank; j++)
            kt_coulomb_swap(top + j, row + j);
        kt_coulomb_swap(left + rank, left + r);
        const int item = c->active[rank];
        c->active[rank] = c->active[r];
        c->active[r] = item;
        top[rank] = sqrt(left[rank]);
        for (int i = rank + 1; i < n; i++) {
            double *L = kt_coulomb_matrix_row(c->system->A, i, c->system->width);
            const double sum = kt_coulomb_coupling(c, c->item[c->active[i]].row, c->item[c->active[rank]].row) -
                               kt_dense_dot(L, top, rank);
            L[rank] = sum / top[rank];
            left[i] -= L[rank] * L[rank];
        }
    }
    return n;
}

bool kt_coulomb_is_unique(const kt_coulomb *c, const kt_coulomb_solution *to) {
    int n = 0;
    if (!kt_coulomb_fits(c, to))
        return false;
    for (int i = 0; i < c->n; i++)
        if (c->item[i].type != KT_COULOMB_DRY && kt_coulomb_is_active(to->mode[i]))
            c->active[n++] = i;
    return factor_items(c, n) == n;
}

/* Writes forces of the dependent item behind `rank` pivots, and of these pivots, that change no rate: L' z = -L_rank in
 * the units of factor_items. */
static void find_idle_forces(const kt_coulomb *c, int rank, double *z) {
    const int width = c->system->width;
    z[rank] = 1.0;
    for (int j = rank - 1; j >= 0; j--) {
        double sum = 0.0;
        for (int k = j + 1; k <= rank; k++)
            sum += kt_coulomb_matrix_row(c->system->A, k, width)[j] * z[k];
        z[j] = -sum / kt_coulomb_matrix_row(c->system->A, j, width)[j];
    }
    for (int k = 0; k <= rank; k++) {
        const int row = c->item[c->active[k]].row;
        const double W = kt_coulomb_entry(c, row, row);
        z[k] /= W > 0.0 ? sqrt(W) : 1.0;
    }
}

/* How far the force p of an item can change at the rate z until it reaches a bound. */
static double distance_to_bound(const kt_coulomb_item *item, double p, double z) {
    const bool is_dry = item->type == KT_COULOMB_DRY;
    const double bound = !is_dry && z < 0.0 ? item->least : is_dry ? copysign(item->friction, z) : HUGE_VAL;
    return z != 0.0 ? fmax((bound - p) / z, 0.0) : HUGE_VAL;
}

/* Moves forces of n items (c->active), of which the first `rank` are independent, until an item reaches a bound. */
static void move_to_bound(const kt_coulomb *c, kt_coulomb_solution *to, int rank) {
    double step = HUGE_VAL, *z = c->system->x;
    int first = rank, side = 1;
    find_idle_forces(c, rank, z);
    for (int k = 0; k < 2 * (rank + 1); k++) {
        const kt_coulomb_item *item = &c->item[c->active[k / 2]];
        const int sign = k % 2 ? -1 : 1;
        const double most = distance_to_bound(item, to->p[item->row], sign * z[k / 2]);
        if (most < step) {
            step = most;
            first = k / 2;
            side = sign;
        }
    }
    for (int k = 0; k <= rank; k++)
        to->p[c->item[c->active[k]].row] += side * step * z[k];
    const kt_coulomb_item *item = &c->item[c->active[first]];
    const bool is_dry = item->type == KT_COULOMB_DRY, falls = side * z[first] < 0.0;
    to->mode[c->active[first]] = !is_dry ? KT_COULOMB_OPEN : falls ? KT_COULOMB_SLIP : KT_COULOMB_SLIP_BACK;
    to->p[item->row] = !is_dry ? item->least : falls ? -item->friction : item->friction;
}

void kt_coulomb_find_vertex(const kt_coulomb *c, kt_coulomb_solution *to) {
    for (int rank = -1, n = 0; rank < n && kt_coulomb_fits(c, to);) {
        n = 0;
        for (int i = 0; i < c->n; i++)
            if (to->mode[i] == KT_COULOMB_STICK)
                c->active[n++] = i;
        rank = factor_items(c, n);
        if (rank < n)
            move_to_bound(c, to, rank);
    }
}

/* Adds a row to n independent rows (c->nonzero), unless the row depends on these: its remainder in the metric of W is
 * rounding. Returns their number. The rows of their Cholesky factor are those of c->system->A. */
static int add_independent_row(const kt_coulomb *c, int n, int row) {
    static const double apart = 1e-9;
    const int width = c->system->width;
    double *L = kt_coulomb_matrix_row(c->system->A, n, width);
    const double square = kt_coulomb_entry(c, row, row);
    for (int j = 0; j < n; j++)
        L[j] = kt_coulomb_entry(c, row, c->nonzero[j]);
    const double left = kt_cholesky_add_row(c->system->A, width, n, square);
    L[n] = sqrt(fmax(left, 0.0));
    c->nonzero[n] = row;
    return left / square > apart ? n + 1 : n;
}

int kt_coulomb_held_rows(const kt_coulomb *c, const kt_coulomb_solution *to, int i, bool slip) {
    assert(i >= 0 && i < c->n);
    const kt_coulomb_type type = c->item[i].type;
    const bool sticks = to->mode[i] == KT_COULOMB_STICK;
    if (!kt_coulomb_is_active(to->mode[i]) || (type == KT_COULOMB_DRY && !sticks))
        return 0;
    return type == KT_COULOMB_CONE && (sticks || slip) ? 3 : 1;
}

/* The number of independent rows that all items hold, except item i (-1: all of them). *all: of all these rows. */
static int count_independent(const kt_coulomb *c, const kt_coulomb_solution *to, int i, bool slip, int *all) {
    int n = *all = 0;
    for (int j = 0; j < c->n; j++)
        for (int k = 0; j != i && k < kt_coulomb_held_rows(c, to, j, slip); k++, ++*all)
            n = add_independent_row(c, n, kt_coulomb_row_of(&c->item[j], k));
    return n;
}

bool kt_coulomb_shares(const kt_coulomb *c, const kt_coulomb_solution *to) {
    int all;
    return count_independent(c, to, -1, false, &all) < all;
}

bool kt_coulomb_is_held(const kt_coulomb *c, const kt_coulomb_solution *to, int i, int rows, bool slip) {
    assert(i >= 0 && i < c->n && rows >= 0 && rows <= 3);
    int all;
    const int n = count_independent(c, to, i, slip, &all);
    for (int k = 0; k < rows; k++)
        if (add_independent_row(c, n, kt_coulomb_row_of(&c->item[i], k)) > n)
            return false;
    return true;
}
