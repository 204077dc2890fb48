/* One combination of modes of a problem with Coulomb's friction (coulomb.h): the linear equations of its impulses, and
 * Newton's iteration for the directions of slip. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"

#include "cone/cone.h"
#include "cone/statics.h"
#include "kinetree/algebra.h"
#include "linear/cholesky.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { ITERATIONS = 40 };

KT_ARENA_LAYOUT(lay_out_system, kt_coulomb_system, KT_COULOMB_SYSTEM_FIELDS, size_t rows)
KT_ARENA_ARRAYS(lay_out_matrices, kt_coulomb_system, KT_COULOMB_SYSTEM_MATRICES, size_t unknowns, size_t most)
KT_ARENA_LAYOUT(lay_out_solution, kt_coulomb_solution, KT_COULOMB_SOLUTION_FIELDS, size_t items, size_t rows)
KT_ARENA_LAYOUT(lay_out_problem, kt_coulomb, KT_COULOMB_FIELDS, size_t items, size_t rows)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* Initialises a system of up to this many unknowns, with a right-hand side for x and one for each of `directions`. */
static kt_coulomb_system *init_system(size_t rows, size_t unknowns, size_t directions, char *memory) {
    kt_coulomb_system *system = (kt_coulomb_system *)(void *)memory;
    (void)lay_out_system(memory, rows);
    system->most = (int)unknowns;
    system->width = (int)(unknowns + 1 + directions);
    return system;
}

/* The unknowns of `most` items. */
static size_t unknowns_of_items(size_t rows, size_t most) { return rows < 3 * most ? rows : 3 * most; }

size_t kt_coulomb_matrices_size(size_t rows, size_t most) {
    const size_t system = lay_out_matrices(NULL, NULL, unknowns_of_items(rows, most), most);
    const size_t unknowns = unknowns_of_items(rows, most), statics = kt_statics_size(unknowns, unknowns);
    const size_t cone = kt_cone_matrices_size((int)most), most_of_two = statics > cone ? statics : cone;
    return system > most_of_two ? system : most_of_two;
}

size_t kt_coulomb_size(size_t items, size_t rows) {
    return lay_out_problem(NULL, items, rows) + lay_out_system(NULL, rows) + lay_out_system(NULL, items);
}

/* The equations of the turns are set up after x is known, when the matrix of x is no longer needed. Therefore both
 * share memory. */
kt_coulomb *kt_coulomb_init(size_t items, size_t rows, size_t most, void *memory, void *matrices) {
    kt_coulomb *c = memory;
    char *behind = (char *)memory + lay_out_problem(memory, items, rows);
    c->n = c->rows = c->stride = 0;
    c->most = (int)most;
    c->W = NULL;
    c->matrices = matrices;
    c->system = init_system(rows, unknowns_of_items(rows, most), most, behind);
    c->turns = init_system(items, most, 0, behind + lay_out_system(NULL, rows));
    (void)lay_out_matrices(c->system, matrices, unknowns_of_items(rows, most), most);
    c->turns->A = c->system->A;
    c->turns->x = c->turn;
    return c;
}

size_t kt_coulomb_solution_size(size_t items, size_t rows) { return lay_out_solution(NULL, items, rows); }

kt_coulomb_solution *kt_coulomb_solution_init(size_t items, size_t rows, void *memory) {
    kt_coulomb_solution *solution = memory;
    (void)lay_out_solution(memory, items, rows);
    solution->shares = solution->redundant = false;
    solution->count = solution->differs = 0;
    return solution;
}

void kt_coulomb_copy(const kt_coulomb *c, const kt_coulomb_solution *from, kt_coulomb_solution *to) {
    assert(from != to);
    to->shares = from->shares;
    to->count = from->count;
    to->redundant = from->redundant;
    to->differs = from->differs;
    memcpy(to->mode, from->mode, (size_t)c->n * sizeof *to->mode);
    memcpy(to->e, from->e, (size_t)c->n * sizeof *to->e);
    memcpy(to->p, from->p, (size_t)c->rows * sizeof *to->p);
    memcpy(to->u, from->u, (size_t)c->rows * sizeof *to->u);
}

/* ---- unknowns ---------------------------------------------------------------------------------------------------- */

static void add_unknown(kt_coulomb_system *s, int item, int row) {
    assert(s->n < s->most);
    s->item[s->n] = item;
    s->equation[s->n] = row;
    s->across[s->n++] = -1;
}

bool kt_coulomb_slips(const kt_coulomb *c, const kt_coulomb_solution *to, int i) {
    assert(i >= 0 && i < c->n);
    const kt_coulomb_mode mode = kt_coulomb_across(to->mode[i]);
    return c->item[i].type == KT_COULOMB_CONE && (mode == KT_COULOMB_SLIP || mode == KT_COULOMB_SLIP_BACK);
}

double kt_coulomb_weight(const kt_coulomb *c, int i) {
    assert(i >= 0 && i < c->n);
    const kt_coulomb_item *item = &c->item[i];
    const int rows = item->type == KT_COULOMB_CONE ? 3 : 1;
    double trace = kt_coulomb_entry(c, item->row, item->row);
    for (int k = 1; k < rows; k++)
        trace += kt_coulomb_entry(c, item->across + k - 1, item->across + k - 1);
    return trace > 0.0 ? trace / rows : 1.0;
}

double kt_coulomb_strength(const kt_coulomb *c, const double *p) {
    double most = 0.0;
    for (int i = 0; i < c->n; i++) {
        const double scale = sqrt(kt_coulomb_weight(c, i));
        for (int k = 0; k < kt_coulomb_rows(&c->item[i]); k++)
            most = fmax(most, scale * fabs(p[kt_coulomb_row_of(&c->item[i], k)]));
    }
    return most;
}

double kt_coulomb_rate_size(const kt_coulomb *c, int i, double strength) {
    return fmax(c->item[i].size, sqrt(kt_coulomb_weight(c, i)) * strength);
}

/* Lists the forces that are unknown in the modes of `to`, and writes the fixed forces. A sticking cone has three
 * unknowns. A slipping cone has one, because its tangential force is -mu p e. Dry friction that slips is fixed. */
static void begin_system(const kt_coulomb *c, const kt_coulomb_solution *to, kt_coulomb_system *s) {
    s->n = s->columns = 0;
    s->shares = false;
    s->is_weighted = true;
    memset(s->fixed, 0, (size_t)c->rows * sizeof *s->fixed);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        if (item->type == KT_COULOMB_DRY) {
            if (to->mode[i] == KT_COULOMB_STICK)
                add_unknown(s, i, item->row);
            else
                s->fixed[item->row] = to->mode[i] == KT_COULOMB_SLIP ? -item->friction : item->friction;
            continue;
        }
        s->fixed[item->row] = item->least;
        if (to->mode[i] == KT_COULOMB_OPEN)
            continue;
        const bool is_active = kt_coulomb_is_active(to->mode[i]);
        if (is_active)
            add_unknown(s, i, item->row);
        if (item->type == KT_COULOMB_SLIPS || kt_coulomb_slips(c, to, i)) {
            if (is_active)
                s->across[s->n - 1] = item->across;
            for (int k = 0; k < 2; k++) {
                if (is_active)
                    s->by[s->n - 1][k] = -item->friction * to->e[i][k];
                s->fixed[item->across + k] = -item->friction * item->least * to->e[i][k];
            }
        } else if (item->type == KT_COULOMB_CONE) {
            add_unknown(s, i, item->across);
            add_unknown(s, i, item->across + 1);
        }
    }
}

/* The rate due to the forces p in one row, of which most are zero: row . p, for a row of W. */
static inline double sum_along(const kt_coulomb *c, int row, const double *p) {
    double sum = 0.0;
    for (int j = 0; j < c->rows; j++)
        sum += p[j] != 0.0 ? kt_coulomb_entry(c, row, j) * p[j] : 0.0;
    return sum;
}

void kt_coulomb_find_rates(const kt_coulomb *c, const double *p, const double *b, double *rate) {
    for (int row = 0; row < c->rows; row++)
        rate[row] = sum_along(c, row, p) + (b != NULL ? b[row] : 0.0);
}

bool kt_coulomb_fits(const kt_coulomb *c, const kt_coulomb_solution *to) {
    int closed = 0;
    for (int i = 0; i < c->n; i++)
        closed += to->mode[i] != KT_COULOMB_OPEN;
    return closed <= c->most;
}

/* The rate of a row due to a unit of x_k: W P. */
static double along_unknown(const kt_coulomb *c, const kt_coulomb_system *s, int row, int k) {
    double sum = kt_coulomb_entry(c, row, s->equation[k]);
    for (int i = 0; s->across[k] >= 0 && i < 2; i++)
        sum += kt_coulomb_entry(c, row, s->across[k] + i) * s->by[k][i];
    return sum;
}

/* Adds the impulses P of x_k, times a factor. */
static void add_unit_impulses(const kt_coulomb_system *s, int k, double x, double factor, double *p) {
    p[s->equation[k]] += x * factor;
    for (int i = 0; s->across[k] >= 0 && i < 2; i++)
        p[s->across[k] + i] += s->by[k][i] * x * factor;
}

/* A x = -(b + W fixed), followed by the right-hand sides of dx/de. */
static void fill_system(const kt_coulomb *c, const kt_coulomb_solution *to, kt_coulomb_system *s) {
    s->columns = 1;
    for (int k = 0; k < s->n; k++) {
        const int row = s->equation[k];
        double *A = kt_coulomb_matrix_row(s->A, k, s->width);
        for (int j = 0; j < s->n; j++)
            A[j] = along_unknown(c, s, row, j);
        A[s->n] = -c->b[row] - sum_along(c, row, s->fixed);
    }
    for (int i = 0; i < c->n; i++) {
        if (!kt_coulomb_slips(c, to, i))
            continue;
        const double mu = c->item[i].friction;
        const int t = c->item[i].across;
        for (int k = 0; k < s->n; k++) { /* p_t = -mu p e, and de = (-e2, e1) */
            const int row = s->equation[k];
            kt_coulomb_matrix_row(s->A, k, s->width)[s->n + s->columns] =
                mu * (-kt_coulomb_entry(c, row, t) * to->e[i][1] + kt_coulomb_entry(c, row, t + 1) * to->e[i][0]);
        }
        s->columns++;
    }
}

/* Swaps the largest entry among rows and columns from r on into (r, r). */
static void swap_pivot(kt_coulomb_system *s, int r) {
    int row = r, column = r;
    for (int i = r; i < s->n; i++) {
        const double *A = kt_coulomb_matrix_row(s->A, i, s->width);
        for (int j = r; j < s->n; j++)
            if (fabs(A[j]) > fabs(kt_coulomb_matrix_row(s->A, row, s->width)[column])) {
                row = i;
                column = j;
            }
    }
    double *to = kt_coulomb_matrix_row(s->A, r, s->width), *from = kt_coulomb_matrix_row(s->A, row, s->width);
    for (int j = 0; j < s->n + s->columns; j++)
        kt_coulomb_swap(to + j, from + j);
    for (int i = 0; i < s->n; i++) {
        double *A = kt_coulomb_matrix_row(s->A, i, s->width);
        kt_coulomb_swap(A + r, A + column);
    }
    const int other = s->order[r];
    s->order[r] = s->order[column];
    s->order[column] = other;
}

/* A power of two of about 1 / sqrt(w), for the item of an unknown. */
static double scale_of(const kt_coulomb *c, const kt_coulomb_system *s, int k) {
    int exponent;
    (void)frexp(sqrt(kt_coulomb_weight(c, s->item[k])), &exponent);
    return ldexp(1.0, -exponent);
}

static double scale_of_force(const kt_coulomb *c, const kt_coulomb_system *s, int k) {
    return s->is_weighted ? scale_of(c, s, k) : 1.0;
}

/* Multiplies equations by these scales, and measures forces in them, so that pivots of different units can be
 * compared. */
static void scale_equations(const kt_coulomb *c, kt_coulomb_system *s) {
    for (int k = 0; k < s->n; k++) {
        const double by_row = scale_of(c, s, k), by_column = scale_of_force(c, s, k);
        double *A = kt_coulomb_matrix_row(s->A, k, s->width);
        for (int j = 0; j < s->n + s->columns; j++)
            A[j] *= by_row;
        for (int i = 0; i < s->n; i++)
            kt_coulomb_matrix_row(s->A, i, s->width)[k] *= by_column;
    }
}

/* The k-th null vector of A, behind `rank` pivots, replaces row k of A. The part along earlier null vectors is removed,
 * and the length becomes 1. */
static void find_null_vector(const kt_coulomb *c, kt_coulomb_system *s, int rank, int k) {
    double *z = s->dp, *to = kt_coulomb_matrix_row(s->A, k, s->width);
    memset(z, 0, (size_t)s->n * sizeof *z);
    z[s->order[k]] = 1.0;
    for (int i = 0; i < rank; i++)
        z[s->order[i]] = -kt_coulomb_matrix_row(s->A, i, s->width)[k];
    for (int i = 0; i < s->n; i++)
        z[i] *= scale_of_force(c, s, i) / s->unit[i];
    for (int pass = 0; pass < 2; pass++)
        for (int j = rank; j < k; j++) {
            const double *other = kt_coulomb_matrix_row(s->A, j, s->width), dot = kt_dense_dot(z, other, s->n);
            for (int i = 0; i < s->n; i++)
                z[i] -= dot * other[i];
        }
    const double norm = sqrt(kt_dense_dot(z, z, s->n));
    for (int i = 0; i < s->n; i++)
        to[i] = z[i] / norm;
}

/* The units of the unknowns: the weights of the items. In the second pass, tangential forces have the square root of
 * mu N as unit, relative to the largest N. Then tangential forces are in proportion to their limits mu N, so that feet
 * reach these together. */
static void set_units(const kt_coulomb *c, kt_coulomb_system *s, bool second) {
    double normal = 0.0, most = 0.0;
    for (int k = 0; k < s->n; k++) {
        const kt_coulomb_item *item = &c->item[s->item[k]];
        const double force = s->equation[k] == item->row ? item->least + s->x[k] : item->least;
        most = fmax(most, force * sqrt(kt_coulomb_weight(c, s->item[k])));
    }
    for (int k = 0; k < s->n; k++) {
        const kt_coulomb_item *item = &c->item[s->item[k]];
        const bool is_normal = s->equation[k] == item->row;
        normal = is_normal ? item->least + s->x[k] : k > 0 && s->item[k - 1] == s->item[k] ? normal : item->least;
        const double scale = sqrt(kt_coulomb_weight(c, s->item[k])), limit = item->friction * normal;
        s->unit[k] = s->is_weighted ? 1.0 / scale : 1.0;
        s->unit[k] *= second && !is_normal && limit > 0.0 ? sqrt(limit * scale / most) : 1.0;
    }
}

/* Reduces all columns of x to the least solution in these units. */
static void reduce_to_least(const kt_coulomb *c, kt_coulomb_system *s, int rank) {
    s->shares = true;
    for (int pass = 0; pass < (s->is_weighted ? 2 : 1); pass++) {
        set_units(c, s, pass > 0);
        for (int k = rank; k < s->n; k++)
            find_null_vector(c, s, rank, k);
        for (int j = 0; j < (s->n - rank) * s->columns; j++) {
            const double *z = kt_coulomb_matrix_row(s->A, rank + j / s->columns, s->width);
            double *x = kt_coulomb_matrix_row(s->x, j % s->columns, s->most), dot = 0.0;
            for (int i = 0; i < s->n; i++)
                dot += z[i] * x[i] / s->unit[i];
            for (int i = 0; i < s->n; i++)
                x[i] -= dot * z[i] * s->unit[i];
        }
    }
}

/* Solves for x by elimination with complete pivoting. */
static void solve_system(const kt_coulomb *c, kt_coulomb_system *s) {
    const int width = s->n + s->columns;
    int rank = 0;
    double first = 0.0;
    scale_equations(c, s);
    for (int i = 0; i < s->n; i++)
        s->order[i] = i;
    for (; rank < s->n; rank++) {
        double *top = kt_coulomb_matrix_row(s->A, rank, s->width);
        swap_pivot(s, rank);
        const double pivot = top[rank];
        first = rank == 0 ? fabs(pivot) : first;
        if (!(fabs(pivot) > 1e-11 * first))
            break;
        for (int j = rank; j < width; j++)
            top[j] /= pivot;
        for (int i = 0; i < s->n; i++) {
            double *A = kt_coulomb_matrix_row(s->A, i, s->width);
            const double factor = A[rank];
            for (int j = rank; i != rank && factor != 0.0 && j < width; j++)
                A[j] -= factor * top[j];
        }
    }
    memset(s->x, 0, (size_t)(s->columns * s->most) * sizeof *s->x);
    for (int m = 0; m < s->columns; m++)
        for (int i = 0; i < rank; i++)
            kt_coulomb_matrix_row(s->x, m, s->most)[s->order[i]] =
                scale_of_force(c, s, s->order[i]) * kt_coulomb_matrix_row(s->A, i, s->width)[s->n + m];
    if (rank < s->n)
        reduce_to_least(c, s, rank);
}

void kt_coulomb_linear(const kt_coulomb *c, kt_coulomb_solution *to) {
    assert(kt_coulomb_fits(c, to));
    kt_coulomb_system *s = c->system;
    begin_system(c, to, s);
    fill_system(c, to, s);
    solve_system(c, s);
    to->shares = s->shares;
    memcpy(to->p, s->fixed, (size_t)c->rows * sizeof *to->p);
    for (int k = 0; k < s->n; k++)
        add_unit_impulses(s, k, s->x[k], 1.0, to->p);
    kt_coulomb_find_rates(c, to->p, c->b, to->u);
}

/* dp/de of the m-th direction, through x and by itself. */
static void find_change(const kt_coulomb *c, const kt_coulomb_solution *to, int m) {
    const kt_coulomb_system *s = c->system;
    const int i = c->turns->item[m], across = c->item[i].across;
    const double N = to->p[c->item[i].row], *x = kt_coulomb_matrix_row(s->x, 1 + m, s->most);
    memset(s->dp, 0, (size_t)c->rows * sizeof *s->dp);
    for (int j = 0; j < s->n; j++)
        add_unit_impulses(s, j, x[j], N, s->dp);
    s->dp[across] += c->item[i].friction * N * to->e[i][1];
    s->dp[across + 1] -= c->item[i].friction * N * to->e[i][0];
}

/* One step of Newton's iteration for the directions: angles by which the directions turn. *residual: the largest e x
 * u_t, relative to the size of its terms. */
static void find_turns(const kt_coulomb *c, const kt_coulomb_solution *to, double *angle, double *residual) {
    kt_coulomb_system *t = c->turns;
    t->n = 0;
    t->columns = 1;
    t->shares = t->is_weighted = false;
    *residual = 0.0;
    for (int i = 0; i < c->n; i++)
        if (kt_coulomb_slips(c, to, i)) {
            t->item[t->n++] = i;
        }
    for (int m = 0; m < t->n; m++) {
        find_change(c, to, m);
        for (int k = 0; k < t->n; k++) {
            const double *e = to->e[t->item[k]], *dp = c->system->dp;
            const int row = c->item[t->item[k]].across;
            kt_coulomb_matrix_row(t->A, k, t->width)[m] = e[0] * sum_along(c, row + 1, dp) -
                                                          e[1] * sum_along(c, row, dp) -
                                                          (k == m ? e[0] * to->u[row] + e[1] * to->u[row + 1] : 0.0);
        }
    }
    const double strength = kt_coulomb_strength(c, to->p);
    for (int k = 0; k < t->n; k++) {
        const double *e = to->e[t->item[k]], size = kt_coulomb_rate_size(c, t->item[k], strength);
        const int row = c->item[t->item[k]].across;
        double *right = &kt_coulomb_matrix_row(t->A, k, t->width)[t->n];
        *right = -(e[0] * to->u[row + 1] - e[1] * to->u[row]);
        *residual = fmax(*residual, *right != 0.0 ? fabs(*right) / size : 0.0);
    }
    solve_system(c, t);
    memcpy(angle, t->x, (size_t)t->n * sizeof *angle);
}

/* Whether forces and rates agree with the modes. */
bool kt_coulomb_holds(const kt_coulomb *c, const kt_coulomb_solution *to) {
    const double strength = kt_coulomb_strength(c, to->p);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double small = 1e-10 * kt_coulomb_rate_size(c, i, strength),
                     weak = 1e-10 * strength / sqrt(kt_coulomb_weight(c, i));
        const double p = to->p[item->row], u = to->u[item->row];
        const double *pt = to->p + item->across, *ut = to->u + item->across;
        bool holds;
        if (item->type == KT_COULOMB_DRY)
            holds = to->mode[i] == KT_COULOMB_STICK  ? fabs(u) <= small && fabs(p) <= item->friction + weak
                    : to->mode[i] == KT_COULOMB_SLIP ? u >= -small
                                                     : u <= small;
        else if (!kt_coulomb_is_active(to->mode[i]))
            holds = u >= -small;
        else
            holds = p - item->least >= -weak && fabs(u) <= small;
        if (item->type == KT_COULOMB_CONE && kt_coulomb_across(to->mode[i]) == KT_COULOMB_STICK)
            holds = holds && kt_hypot(ut[0], ut[1]) <= small && kt_hypot(pt[0], pt[1]) <= item->friction * p + weak;
        if (kt_coulomb_slips(c, to, i))
            holds = holds && ut[0] * to->e[i][0] + ut[1] * to->e[i][1] >= -small;
        if (!holds)
            return false;
    }
    return true;
}

/* Turns the directions of slipping items, by `part` of the angles. */
static void rotate_directions(const kt_coulomb *c, kt_coulomb_solution *to, const double *angle, double part) {
    for (int i = 0, m = 0; i < c->n; i++) {
        if (!kt_coulomb_slips(c, to, i))
            continue;
        const double by = part * fmax(-0.5, fmin(0.5, angle[m++])), x = to->e[i][0], y = to->e[i][1];
        to->e[i][0] = cos(by) * x - sin(by) * y;
        to->e[i][1] = sin(by) * x + cos(by) * y;
    }
}

bool kt_coulomb_iterate(const kt_coulomb *c, kt_coulomb_solution *to) {
    double residual, last = HUGE_VAL, part = 1.0;
    for (int k = 0; k < ITERATIONS; k++) {
        kt_coulomb_linear(c, to);
        find_turns(c, to, c->next_angle, &residual);
        if (residual <= 1e-12)
            return kt_coulomb_holds(c, to);
        if (!(residual < last) && part > 0.01) {
            part *= 0.5;
            rotate_directions(c, to, c->angle, -part);
            continue;
        }
        last = residual;
        part = 1.0;
        memcpy(c->angle, c->next_angle, (size_t)c->turns->n * sizeof *c->angle);
        rotate_directions(c, to, c->angle, part);
    }
    return false;
}

void kt_coulomb_polish(const kt_coulomb *c, kt_coulomb_solution *to) {
    double residual;
    kt_coulomb_linear(c, to);
    find_turns(c, to, c->angle, &residual);
    rotate_directions(c, to, c->angle, 1.0);
}
