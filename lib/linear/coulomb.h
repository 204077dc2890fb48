/* Complementarity with Coulomb's friction: p and u = W p + b of unilateral contacts. Normal rows have 0 <= p
 * complementary to u >= 0. Tangential rows lie in the cone |p_t| <= mu p, not in a pyramid:
 *
 *     stick    u_t = 0,   |p_t| <= mu p
 *     slip     u_t = sigma e,   p_t = -mu p e,   |e| = 1,  sigma >= 0
 *
 * of impulses and rates, or of forces and accelerations. An item that slips from the outset has a given e. Dry friction
 * has one row and a limit of its own, |p| <= S. Each item is in one of a few modes. In each mode all is linear except
 * the directions e of slipping items; for these, Newton's iteration solves e x u_t = 0. The cone solver (cone.h) finds
 * the modes. Friction may have no solution, or two (Painleve 1895).
 *
 * A contact may have a least normal impulse l > 0 (expansion, by Poisson's rule):
 *
 *     0 <= p - l  complementary to  u >= 0
 *
 * It never opens then: while p = l it sticks or slips, too, and there are 6 modes of it.
 *
 * If normal rows of closed contacts depend on each other, contacts are opened until the remaining rows are independent.
 * Tangential forces may not be unique, as of a block on two feet. Then p is the least solution of all, each tangential
 * force in proportion to its normal one. So the feet of a block come to their limits together. Wedges share normal
 * forces, too: these are the least then.
 *
 * F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, 1996; R. Leine, N. van de Wouw, Stability and
 * Convergence of Mechanical Systems with Unilateral Constraints, 2008.
 */
#ifndef KT_LINEAR_COULOMB_H
#define KT_LINEAR_COULOMB_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

struct kt_cone;

enum {
    KT_COULOMB_ITEMS = 16, /* the solver keeps its matrices on the stack */
    KT_COULOMB_ROWS = 24,
    KT_COULOMB_COLUMNS = 1 + KT_COULOMB_ITEMS / 2, /* right-hand sides: at most half of the items slip */
    KT_COULOMB_ITERATIONS = 40,
};

typedef enum kt_coulomb_type {
    KT_COULOMB_FRICTIONLESS, /* one row: closed, open */
    KT_COULOMB_SLIPS,        /* in a given direction: closed, open */
    KT_COULOMB_CONE,         /* at rest: sticks, slips from one guess or the opposite, open */
    KT_COULOMB_DRY,          /* one row: sticks, slips forwards, backwards */
} kt_coulomb_type;

typedef enum kt_coulomb_mode {
    KT_COULOMB_LEAST_STICK, /* the first three: the normal impulse is the least, and the contact may part */
    KT_COULOMB_LEAST_SLIP,
    KT_COULOMB_LEAST_SLIP_BACK,
    KT_COULOMB_STICK, /* or closed */
    KT_COULOMB_SLIP,
    KT_COULOMB_SLIP_BACK,
    KT_COULOMB_OPEN, /* without friction: or the least normal impulse */
    KT_COULOMB_MODES /* how many */
} kt_coulomb_mode;

/* Whether the normal impulse is unknown. */
static inline bool kt_coulomb_presses(kt_coulomb_mode mode) {
    return mode >= KT_COULOMB_STICK && mode < KT_COULOMB_OPEN;
}

/* The tangential mode of the contact: it sticks or slips. */
static inline kt_coulomb_mode kt_coulomb_across(kt_coulomb_mode mode) {
    return mode < KT_COULOMB_STICK ? (kt_coulomb_mode)(mode + KT_COULOMB_STICK) : mode;
}

typedef struct kt_coulomb_item {
    kt_coulomb_type type;
    int row, across;  /* normal (or only) row; the first of two tangential ones */
    double friction;  /* mu; of dry friction S */
    double least;     /* of a normal impulse */
    double e[2];      /* the direction of slip, given */
    unsigned refused; /* modes that are not tried, a bit each */
} kt_coulomb_item;

/* n items with `rows` rows in all. These are the rows and columns `line` of a matrix W with `stride` columns, by rows.
 * size: the magnitude to which rounding of u is relative. */
typedef struct kt_coulomb {
    int n, rows, stride;
    int line[KT_COULOMB_ROWS];
    const double *W;
    kt_coulomb_item item[KT_COULOMB_ITEMS];
    double b[KT_COULOMB_ROWS], size;
} kt_coulomb;

static inline double kt_coulomb_entry(const kt_coulomb *c, int row, int column) {
    return c->W[c->line[row] * c->stride + c->line[column]];
}

typedef struct kt_coulomb_solution {
    kt_coulomb_mode mode[KT_COULOMB_ITEMS];
    double e[KT_COULOMB_ITEMS][2]; /* directions of slip */
    double p[KT_COULOMB_ROWS], u[KT_COULOMB_ROWS];
    bool shares; /* normal forces are not unique: these are the least */
    int count;   /* of solutions with different u */
} kt_coulomb_solution;

/* The unknowns of a combination: p = P x + fixed, of which row equation[k] is that of x_k. */
typedef struct kt_coulomb_system {
    int n, columns; /* unknowns; right-hand sides: of x, and of its derivatives by the directions */
    bool shares;    /* normal forces are not unique */
    int item[KT_COULOMB_ROWS], equation[KT_COULOMB_ROWS];
    bool is_normal[KT_COULOMB_ROWS], is_tangential[KT_COULOMB_ROWS];
    double least[KT_COULOMB_ROWS];              /* of the item's normal impulse */
    double P[KT_COULOMB_ROWS][KT_COULOMB_ROWS]; /* by unknowns */
    double fixed[KT_COULOMB_ROWS];
    double A[KT_COULOMB_ROWS][KT_COULOMB_ROWS + KT_COULOMB_COLUMNS];
    double x[KT_COULOMB_COLUMNS][KT_COULOMB_ROWS];
} kt_coulomb_system;

static inline void kt_coulomb_unknown(kt_coulomb_system *s, int item, int row, int normal) {
    s->item[s->n] = item;
    s->equation[s->n] = row;
    s->is_normal[s->n] = row == normal;
    s->is_tangential[s->n] = false;
    s->least[s->n] = normal < 0 ? 0.0 : s->fixed[normal];
    memset(s->P[s->n], 0, sizeof s->P[s->n]);
    s->P[s->n++][row] = 1.0;
}

static inline bool kt_coulomb_slips(const kt_coulomb *c, const kt_coulomb_solution *to, int i) {
    const kt_coulomb_mode mode = kt_coulomb_across(to->mode[i]);
    return c->item[i].type == KT_COULOMB_CONE && (mode == KT_COULOMB_SLIP || mode == KT_COULOMB_SLIP_BACK);
}

static inline void kt_coulomb_begin(const kt_coulomb *c, const kt_coulomb_solution *to, kt_coulomb_system *s) {
    s->n = s->columns = 0;
    s->shares = false;
    memset(s->fixed, 0, sizeof s->fixed);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        if (item->type == KT_COULOMB_DRY) {
            if (to->mode[i] == KT_COULOMB_STICK)
                kt_coulomb_unknown(s, i, item->row, -1);
            else
                s->fixed[item->row] = to->mode[i] == KT_COULOMB_SLIP ? -item->friction : item->friction;
            continue;
        }
        s->fixed[item->row] = item->least;
        if (to->mode[i] == KT_COULOMB_OPEN)
            continue;
        const bool presses = kt_coulomb_presses(to->mode[i]);
        if (presses)
            kt_coulomb_unknown(s, i, item->row, item->row);
        if (item->type == KT_COULOMB_SLIPS || kt_coulomb_slips(c, to, i)) {
            for (int k = 0; k < 2; k++) {
                if (presses)
                    s->P[s->n - 1][item->across + k] = -item->friction * to->e[i][k];
                s->fixed[item->across + k] = -item->friction * item->least * to->e[i][k];
            }
        } else if (item->type == KT_COULOMB_CONE) {
            kt_coulomb_unknown(s, i, item->across, item->row);
            kt_coulomb_unknown(s, i, item->across + 1, item->row);
            s->is_tangential[s->n - 2] = s->is_tangential[s->n - 1] = true;
        }
    }
}

static inline double kt_coulomb_along(const kt_coulomb *c, int row, const double *p) {
    double sum = 0.0;
    for (int j = 0; j < c->rows; j++)
        sum += kt_coulomb_entry(c, row, j) * p[j];
    return sum;
}

/* A x = -(b + W fixed), and behind it the right-hand sides of dx/de. */
static inline void kt_coulomb_fill(const kt_coulomb *c, const kt_coulomb_solution *to, kt_coulomb_system *s) {
    s->columns = 1;
    for (int k = 0; k < s->n; k++) {
        const int row = s->equation[k];
        for (int j = 0; j < s->n; j++)
            s->A[k][j] = kt_coulomb_along(c, row, s->P[j]);
        s->A[k][s->n] = -c->b[row] - kt_coulomb_along(c, row, s->fixed);
    }
    for (int i = 0; i < c->n; i++) {
        if (!kt_coulomb_slips(c, to, i))
            continue;
        const double mu = c->item[i].friction;
        const int t = c->item[i].across;
        for (int k = 0; k < s->n; k++) { /* p_t = -mu p e, and de = (-e2, e1) */
            const int row = s->equation[k];
            s->A[k][s->n + s->columns] =
                mu * (-kt_coulomb_entry(c, row, t) * to->e[i][1] + kt_coulomb_entry(c, row, t + 1) * to->e[i][0]);
        }
        s->columns++;
    }
}

/* Swaps the largest entry among rows and columns from r on into (r, r). */
static inline void kt_coulomb_pivot(kt_coulomb_system *s, int r, int *order) {
    int row = r, column = r;
    for (int i = r; i < s->n; i++)
        for (int j = r; j < s->n; j++)
            if (fabs(s->A[i][j]) > fabs(s->A[row][column])) {
                row = i;
                column = j;
            }
    for (int j = 0; j < s->n + s->columns; j++) {
        const double a = s->A[r][j];
        s->A[r][j] = s->A[row][j];
        s->A[row][j] = a;
    }
    for (int i = 0; i < s->n; i++) {
        const double a = s->A[i][r];
        s->A[i][r] = s->A[i][column];
        s->A[i][column] = a;
    }
    const int other = order[r];
    order[r] = order[column];
    order[column] = other;
}

/* The units of x_k. Tangential forces that stick have the root of their normal force as unit. With it, the least sum of
 * squares T_i^2 / N_i has T_i in proportion to N_i. */
static inline void kt_coulomb_units(const kt_coulomb_system *s, double *unit) {
    double normal = 0.0;
    for (int k = 0; k < s->n; k++) {
        normal = s->is_normal[k]                         ? s->least[k] + s->x[0][k]
                 : k > 0 && s->item[k - 1] == s->item[k] ? normal
                                                         : s->least[k];
        unit[k] = s->is_tangential[k] && normal > 0.0 ? sqrt(normal) : 1.0;
    }
}

/* The k-th null vector of A, in these units. */
static inline void kt_coulomb_null(const kt_coulomb_system *s, int rank, const int *order, int k, const double *unit,
                                   double *z) {
    memset(z, 0, KT_COULOMB_ROWS * sizeof *z);
    z[order[k]] = 1.0;
    for (int i = 0; i < rank; i++)
        z[order[i]] = -s->A[i][k];
    for (int i = 0; i < s->n; i++)
        z[i] /= unit[i];
}

/* Takes the part along the vectors of `null` before the k-th from it; its length becomes 1. */
static inline void kt_coulomb_orthonormal(int n, double null[][KT_COULOMB_ROWS], int k) {
    double *z = null[k], norm = 0.0;
    for (int pass = 0; pass < 2; pass++)
        for (int j = 0; j < k; j++) {
            double dot = 0.0;
            for (int i = 0; i < n; i++)
                dot += z[i] * null[j][i];
            for (int i = 0; i < n; i++)
                z[i] -= dot * null[j][i];
        }
    for (int i = 0; i < n; i++)
        norm += z[i] * z[i];
    for (int i = 0; i < n; i++)
        z[i] /= sqrt(norm);
}

/* Reduces x to the least solution: removes its part along the null vectors of A, behind the first `rank` pivots. In the
 * first pass all entries have the same unit; it finds normal forces that are not unique. The second pass uses the units
 * of kt_coulomb_units. */
static inline void kt_coulomb_least(kt_coulomb_system *s, int rank, const int *order) {
    double null[KT_COULOMB_ROWS][KT_COULOMB_ROWS], unit[KT_COULOMB_ROWS];
    for (int pass = 0; rank < s->n && pass < 2; pass++) {
        for (int i = 0; i < s->n; i++)
            unit[i] = 1.0;
        if (pass > 0)
            kt_coulomb_units(s, unit);
        for (int k = rank; k < s->n; k++) {
            double *z = null[k - rank];
            kt_coulomb_null(s, rank, order, k, unit, z);
            kt_coulomb_orthonormal(s->n, null, k - rank);
            for (int i = 0; i < s->n; i++)
                s->shares = s->shares || (s->is_normal[i] && fabs(z[i]) > 1e-8);
            for (int m = 0; m < s->columns; m++) {
                double dot = 0.0;
                for (int i = 0; i < s->n; i++)
                    dot += z[i] * s->x[m][i] / unit[i];
                for (int i = 0; i < s->n; i++)
                    s->x[m][i] -= dot * z[i] * unit[i];
            }
        }
    }
}

/* Solves for x by elimination with complete pivoting. */
static inline void kt_coulomb_eliminate(kt_coulomb_system *s) {
    int order[KT_COULOMB_ROWS] = {0}, rank = 0;
    double first = 0.0;
    for (int i = 0; i < s->n; i++)
        order[i] = i;
    for (; rank < s->n; rank++) {
        kt_coulomb_pivot(s, rank, order);
        const double pivot = s->A[rank][rank];
        first = rank == 0 ? fabs(pivot) : first;
        if (!(fabs(pivot) > 1e-11 * first))
            break;
        for (int j = rank; j < s->n + s->columns; j++)
            s->A[rank][j] /= pivot;
        for (int i = 0; i < s->n; i++) {
            const double factor = s->A[i][rank];
            for (int j = rank; i != rank && factor != 0.0 && j < s->n + s->columns; j++)
                s->A[i][j] -= factor * s->A[rank][j];
        }
    }
    memset(s->x, 0, (size_t)s->columns * sizeof s->x[0]);
    for (int m = 0; m < s->columns; m++)
        for (int i = 0; i < rank; i++)
            s->x[m][order[i]] = s->A[i][s->n + m];
    kt_coulomb_least(s, rank, order);
}

/* Whether the normal rows of closed contacts are independent: W of these has a Cholesky factor. */
static inline bool kt_coulomb_is_unique(const kt_coulomb *c, const kt_coulomb_solution *to) {
    double L[KT_COULOMB_ITEMS][KT_COULOMB_ITEMS];
    int row[KT_COULOMB_ITEMS], n = 0;
    for (int i = 0; i < c->n; i++)
        if (c->item[i].type != KT_COULOMB_DRY && kt_coulomb_presses(to->mode[i]))
            row[n++] = c->item[i].row;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = kt_coulomb_entry(c, row[i], row[j]);
            for (int k = 0; k < j; k++)
                sum -= L[i][k] * L[j][k];
            if (i == j && !(sum > 1e-11 * kt_coulomb_entry(c, row[i], row[i])))
                return false;
            L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
        }
    return true;
}

/* p and u of a combination with given directions; in *s dx/de. */
static inline void kt_coulomb_linear(const kt_coulomb *c, kt_coulomb_solution *to, kt_coulomb_system *s) {
    kt_coulomb_begin(c, to, s);
    kt_coulomb_fill(c, to, s);
    kt_coulomb_eliminate(s);
    to->shares = s->shares;
    memcpy(to->p, s->fixed, sizeof to->p);
    for (int k = 0; k < s->n; k++)
        for (int j = 0; j < c->rows; j++)
            to->p[j] += s->P[k][j] * s->x[0][k];
    for (int j = 0; j < c->rows; j++)
        to->u[j] = kt_coulomb_along(c, j, to->p) + c->b[j];
}

/* One step of Newton's iteration for the directions: angles by which they turn. *residual: the largest e x u_t. */
static inline void kt_coulomb_turn(const kt_coulomb *c, const kt_coulomb_solution *to, const kt_coulomb_system *s,
                                   double *angle, double *residual) {
    kt_coulomb_system t;
    t.n = 0;
    t.columns = 1;
    t.shares = false;
    *residual = 0.0;
    for (int i = 0; i < c->n; i++)
        if (kt_coulomb_slips(c, to, i)) {
            t.is_normal[t.n] = t.is_tangential[t.n] = false;
            t.least[t.n] = 0.0;
            t.item[t.n++] = i;
        }
    for (int k = 0; k < t.n; k++) {
        const double *e = to->e[t.item[k]];
        const int row = c->item[t.item[k]].across;
        t.A[k][t.n] = -(e[0] * to->u[row + 1] - e[1] * to->u[row]);
        *residual = fmax(*residual, fabs(t.A[k][t.n]));
        for (int m = 0; m < t.n; m++) { /* du/de of direction m, through x and by itself */
            const int i = t.item[m], across = c->item[i].across;
            double dp[KT_COULOMB_ROWS] = {0.0};
            const double N = to->p[c->item[i].row];
            for (int j = 0; j < s->n; j++)
                for (int r = 0; r < c->rows; r++)
                    dp[r] += s->P[j][r] * s->x[1 + m][j] * N;
            dp[across] += c->item[i].friction * N * to->e[i][1];
            dp[across + 1] -= c->item[i].friction * N * to->e[i][0];
            t.A[k][m] = e[0] * kt_coulomb_along(c, row + 1, dp) - e[1] * kt_coulomb_along(c, row, dp) -
                        (k == m ? e[0] * to->u[row] + e[1] * to->u[row + 1] : 0.0);
        }
    }
    kt_coulomb_eliminate(&t);
    memcpy(angle, t.x[0], (size_t)t.n * sizeof *angle);
}

/* Whether forces and rates agree with the modes. */
static inline bool kt_coulomb_holds(const kt_coulomb *c, const kt_coulomb_solution *to) {
    double most = 0.0;
    for (int j = 0; j < c->rows; j++)
        most = fmax(most, fabs(to->p[j]));
    const double small = 1e-10 * c->size, weak = 1e-10 * most;
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double p = to->p[item->row], u = to->u[item->row];
        const double *pt = to->p + item->across, *ut = to->u + item->across;
        bool holds;
        if (item->type == KT_COULOMB_DRY)
            holds = to->mode[i] == KT_COULOMB_STICK  ? fabs(u) <= small && fabs(p) <= item->friction + weak
                    : to->mode[i] == KT_COULOMB_SLIP ? u >= -small
                                                     : u <= small;
        else if (!kt_coulomb_presses(to->mode[i]))
            holds = u >= -small;
        else
            holds = p - item->least >= -weak && fabs(u) <= small;
        if (item->type == KT_COULOMB_CONE && kt_coulomb_across(to->mode[i]) == KT_COULOMB_STICK)
            holds = holds && hypot(ut[0], ut[1]) <= small && hypot(pt[0], pt[1]) <= item->friction * p + weak;
        if (kt_coulomb_slips(c, to, i))
            holds = holds && ut[0] * to->e[i][0] + ut[1] * to->e[i][1] >= -small;
        if (!holds)
            return false;
    }
    return true;
}

/* Turns the directions of slipping items, by `part` of the angles. */
static inline void kt_coulomb_rotate(const kt_coulomb *c, kt_coulomb_solution *to, const double *angle, double part) {
    for (int i = 0, m = 0; i < c->n; i++) {
        if (!kt_coulomb_slips(c, to, i))
            continue;
        const double by = part * fmax(-0.5, fmin(0.5, angle[m++])), x = to->e[i][0], y = to->e[i][1];
        to->e[i][0] = cos(by) * x - sin(by) * y;
        to->e[i][1] = sin(by) * x + cos(by) * y;
    }
}

/* Newton's iteration for the directions of one combination of modes, from those in `to`. Its steps are halved until the
 * residual falls. */
static inline bool kt_coulomb_iterate(const kt_coulomb *c, kt_coulomb_solution *to) {
    double angle[KT_COULOMB_ROWS], next[KT_COULOMB_ROWS], residual, last = HUGE_VAL, part = 1.0;
    kt_coulomb_system s;
    for (int k = 0; k < KT_COULOMB_ITERATIONS; k++) {
        kt_coulomb_linear(c, to, &s);
        kt_coulomb_turn(c, to, &s, next, &residual);
        if (residual <= 1e-12 * c->size)
            return kt_coulomb_holds(c, to);
        if (!(residual < last) && part > 0.01) {
            part *= 0.5;
            kt_coulomb_rotate(c, to, angle, -part);
            continue;
        }
        last = residual;
        part = 1.0;
        memcpy(angle, next, sizeof angle);
        kt_coulomb_rotate(c, to, angle, part);
    }
    return false;
}

/* Solves the problem, and returns false if no solution is found (coulomb.c). The flag `independent` requires
 * independent normal rows of pressing contacts. The solution has the least impulses; its count is 2 if another motion
 * was found, too. Adds the steps of Newton's method to *steps. The cone solver has room for KT_COULOMB_ITEMS. */
bool kt_coulomb_solve(const kt_coulomb *c, struct kt_cone *cone, bool independent, kt_coulomb_solution *solution,
                      uint64_t *steps);

#endif
