/* Complementarity with Coulomb's friction: p and u = W p + b of unilateral contacts. Normal rows have 0 <= p
 * complementary to u >= 0. Tangential rows lie in the cone |p_t| <= mu p, not in a pyramid:
 *
 *     stick    u_t = 0,   |p_t| <= mu p
 *     slip     u_t = sigma e,   p_t = -mu p e,   |e| = 1,  sigma >= 0
 *
 * of impulses and rates, or of forces and accelerations. If an item slips from the outset, e is known. Dry friction of
 * a joint has one row, whose limit S does not depend on a normal force: abs(p) <= S. Each item is in one of a few
 * modes. In each mode all is linear except the directions e of slipping items. For these, Newton's iteration solves
 * e x u_t = 0. The cone solver (cone.h) finds the modes. Friction may have no solution, or two (Painleve 1895).
 *
 * A contact may have a least normal impulse l > 0 (expansion, by Poisson's rule):
 *
 *     0 <= p - l  complementary to  u >= 0
 *
 * Such a contact never opens. While p = l, the contact can also stick or slip, so that the contact has 6 modes.
 *
 * If forces exist with which all items rest, the items rest with the least such forces (coulomb_rest.c). If normal rows
 * of closed contacts depend on each other, rest is also preferred while other contacts slip in given directions.
 * Otherwise contacts are opened until the remaining rows are independent. Tangential forces that are not unique are the
 * least ones. Without friction of contacts, forces that are not unique do not change the motion. They become a vertex
 * of the set of all such forces, so that redundant contacts are open, and redundant dry friction is at its limit.
 *
 * Matrices have room for `most` items. If a problem has more, the cone solver takes a working set of these
 * (cone_members.c), and only combinations of modes with at most so many closed items are made exact. W need not be
 * stored then.
 *
 * F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, 1996; R. Leine, N. van de Wouw, Stability and
 * Convergence of Mechanical Systems with Unilateral Constraints, 2008.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_COULOMB_H
#define KT_LINEAR_COULOMB_H

#include "base/arena.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

struct kt_cone;

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
static inline bool kt_coulomb_is_active(kt_coulomb_mode mode) {
    return mode >= KT_COULOMB_STICK && mode < KT_COULOMB_OPEN;
}

/* The tangential mode of the contact: sticking or slipping. */
static inline kt_coulomb_mode kt_coulomb_across(kt_coulomb_mode mode) {
    return mode < KT_COULOMB_STICK ? (kt_coulomb_mode)(mode + KT_COULOMB_STICK) : mode;
}

typedef struct kt_coulomb_item {
    kt_coulomb_type type;
    int row, across;   /* normal (or only) row; the first of two tangential ones */
    double friction;   /* mu; of dry friction S */
    double least;      /* lower bound of a normal impulse */
    double e[2];       /* the direction of slip, given */
    double size;       /* the magnitude of the terms of its rates */
    unsigned rejected; /* modes that are not tried, a bit each */
} kt_coulomb_item;

/* Whether the item may only be open. */
static inline bool kt_coulomb_is_open_alone(const kt_coulomb_item *item) {
    return item->rejected == ~(1U << KT_COULOMB_OPEN);
}

typedef double kt_coulomb_pair[2];

/* The rows of an item. The normal row of a contact with friction has two tangential ones behind it. */
static inline int kt_coulomb_rows(const kt_coulomb_item *item) {
    return item->type == KT_COULOMB_CONE || item->type == KT_COULOMB_SLIPS ? 3 : 1;
}
static inline int kt_coulomb_row_of(const kt_coulomb_item *item, int k) {
    return k == 0 ? item->row : item->across + k - 1;
}

/* Every array of a solution: type, name, count, meaning. */
#define KT_COULOMB_SOLUTION_FIELDS(X)                                                                                  \
    X(kt_coulomb_mode, mode, items, "of each item")                                                                    \
    X(kt_coulomb_pair, e, items, "directions of slip")                                                                 \
    X(double, p, rows, "impulses, or forces")                                                                          \
    X(double, u, rows, "rates, or accelerations")

typedef struct kt_coulomb_solution {
    bool shares;    /* forces are not unique: these are the least */
    int count;      /* number of solutions with different u */
    bool redundant; /* several solutions: their closed contacts together have dependent normal rows */
    int differs;    /* several solutions: the item whose normal impulses differ most */
    KT_ARENA_DECLARE(KT_COULOMB_SOLUTION_FIELDS)
} kt_coulomb_solution;

/* The unknowns of a combination: p = P x + fixed. A unit of x_k is a unit in row equation[k], and by[k] in the
 * tangential rows from across[k] on, unless that is negative. Matrices are stored by rows. Once A is solved, its rows
 * behind the rank take its null vectors. */
#define KT_COULOMB_SYSTEM_FIELDS(X)                                                                                    \
    X(int, item, rows, "of each unknown")                                                                              \
    X(int, equation, rows, "its row")                                                                                  \
    X(int, across, rows, "the first tangential row of a normal impulse that slips; -1")                                \
    X(kt_coulomb_pair, by, rows, "impulses in these rows")                                                             \
    X(double, fixed, rows, "impulses that are known")                                                                  \
    X(double, unit, rows, "of the unknowns")                                                                           \
    X(double, dp, rows, "change of p with a direction")                                                                \
    X(int, order, rows, "of the columns")

/* With room for `most` items, and for `unknowns`. */
#define KT_COULOMB_SYSTEM_MATRICES(X)                                                                                  \
    X(double, A, unknowns *(unknowns + 1 + most), "equations, and their right-hand sides behind them")                 \
    X(double, x, (1 + most) * unknowns, "unknowns, then dx/de of each direction")

typedef struct kt_coulomb_system {
    int most, width;  /* unknowns that have room; numbers of a row of A */
    int n, columns;   /* unknowns; right-hand sides: of x, and of its derivatives by the directions */
    bool shares;      /* x is not unique: it is the least */
    bool is_weighted; /* in the weights of the items */
    KT_ARENA_DECLARE(KT_COULOMB_SYSTEM_FIELDS)
    KT_ARENA_DECLARE(KT_COULOMB_SYSTEM_MATRICES)
} kt_coulomb_system;

/* Every array of a problem. The last arrays are scratch. */
#define KT_COULOMB_FIELDS(X)                                                                                           \
    X(int, line, rows, "rows and columns of W")                                                                        \
    X(kt_coulomb_item, item, items, "items")                                                                           \
    X(double, b, rows, "of the rows")                                                                                  \
    X(int, active, items, "these rows")                                                                                \
    X(double, angle, items, "by which directions turn")                                                                \
    X(double, next_angle, items, "likewise")                                                                           \
    X(double, turn, items, "unknowns of their system")                                                                 \
    X(int, nonzero, rows, "rows with an impulse")                                                                      \
    X(double, rate, rows, "rates")

/* n items with `rows` rows in all. Row k is row and column line[k] of a matrix W with `stride` columns, by rows. If W
 * is NULL, `entry` computes its numbers. */
typedef struct kt_coulomb {
    int n, rows, stride;
    int most; /* items that have room in matrices */
    const double *W;
    double (*entry)(const void *user, int line, int column);
    const void *user;
    kt_coulomb_system *system, *turns; /* scratch: of a combination, and of its directions */
    void *matrices;                    /* scratch, like all matrices: also of a problem of statics (statics.h) */
    KT_ARENA_DECLARE(KT_COULOMB_FIELDS)
} kt_coulomb;

static inline double kt_coulomb_entry(const kt_coulomb *c, int row, int column) {
    return c->W != NULL ? c->W[c->line[row] * c->stride + c->line[column]]
                        : c->entry(c->user, c->line[row], c->line[column]);
}

/* W_ij / sqrt(W_ii W_jj) */
static inline double kt_coulomb_coupling(const kt_coulomb *c, int i, int j) {
    const double size = sqrt(kt_coulomb_entry(c, i, i) * kt_coulomb_entry(c, j, j));
    return size > 0.0 ? kt_coulomb_entry(c, i, j) / size : 0.0;
}

/* Bytes of the matrices of a problem and its solver, with room for `most` items: the cone solver and the exact modes
 * never run at the same time. The matrices are scratch: between two solutions the caller may use the memory
 * otherwise. */
size_t kt_coulomb_matrices_size(size_t rows, size_t most);
/* Bytes of a problem of up to so many items and rows, and its object in memory of that size, without items. */
size_t kt_coulomb_size(size_t items, size_t rows);
kt_coulomb *kt_coulomb_init(size_t items, size_t rows, size_t most, void *memory, void *matrices);
/* Bytes of a solution of such a problem, and its object in memory of that size. */
size_t kt_coulomb_solution_size(size_t items, size_t rows);
kt_coulomb_solution *kt_coulomb_solution_init(size_t items, size_t rows, void *memory);
/* Copies a solution of the problem. */
void kt_coulomb_copy(const kt_coulomb *c, const kt_coulomb_solution *from, kt_coulomb_solution *to);

/* ---- one combination of modes (coulomb_system.c) ----------------------------------------------------------------- */

/* The weight of an item's forces in least sums: the mean of the diagonal of its block of W (statics.h). */
double kt_coulomb_weight(const kt_coulomb *c, int i);
/* The largest of the forces p, each times the root of its item's weight w. Items have different units, N and N m: so
 * forces are only compared in this metric. */
double kt_coulomb_strength(const kt_coulomb *c, const double *p);
/* The magnitude to which rounding of an item's rates is relative: of their terms, and of the response to forces of this
 * strength, |W_ij p_j| <= sqrt(w_i) strength. */
double kt_coulomb_rate_size(const kt_coulomb *c, int i, double strength);
/* Whether the item slips in an unknown direction. */
bool kt_coulomb_slips(const kt_coulomb *c, const kt_coulomb_solution *to, int i);
/* Whether the matrices have room for the closed items. All functions below, except the rate and the check, require
 * this. */
bool kt_coulomb_fits(const kt_coulomb *c, const kt_coulomb_solution *to);
/* The rates of all rows: W p + b. b: NULL for zeros. */
void kt_coulomb_find_rates(const kt_coulomb *c, const double *p, const double *b, double *rate);
/* Whether the closed items have room, and the normal rows of closed contacts are independent. */
bool kt_coulomb_is_unique(const kt_coulomb *c, const kt_coulomb_solution *to);
/* The number of rows that an item holds. The number is 0 for an open item and for dry friction that slips. A cone that
 * sticks holds its normal row and two tangential ones. With `slip`, a slipping cone counts like a sticking one. */
int kt_coulomb_held_rows(const kt_coulomb *c, const kt_coulomb_solution *to, int i, bool slip);
/* Whether rows at which contacts rest or slide depend on each other, so that their forces are not unique. */
bool kt_coulomb_shares(const kt_coulomb *c, const kt_coulomb_solution *to);
/* Moves the forces of a solution without friction of contacts to a vertex of all forces with this motion: items reach
 * bounds until the rows of the others are independent. */
void kt_coulomb_find_vertex(const kt_coulomb *c, kt_coulomb_solution *to);
/* Whether the first rows of item i depend on rows that other items hold, so that item i need not hold these rows. rows:
 * 1 for the normal row, 3 with the tangential ones. Other items hold their normal rows if they press, and their
 * tangential rows if they stick. With `slip`, tangential rows of contacts that slip count, too. */
bool kt_coulomb_is_held(const kt_coulomb *c, const kt_coulomb_solution *to, int i, int rows, bool slip);
/* Writes p and u of a combination with given directions; in c->system dx/de. */
void kt_coulomb_linear(const kt_coulomb *c, kt_coulomb_solution *to);
/* Whether forces and rates agree with the modes. */
bool kt_coulomb_holds(const kt_coulomb *c, const kt_coulomb_solution *to);
/* Iterates by Newton's method for the directions of one combination of modes, from the directions in `to`. A step is
 * halved until the residual falls. Returns whether the combination is a solution. */
bool kt_coulomb_iterate(const kt_coulomb *c, kt_coulomb_solution *to);
/* Iterates for the directions and modes of contacts with cones that do not part (coulomb.c). First all slip in the
 * directions in `to`. If this is no solution, all stick, and modes that a solution contradicts change. Returns whether
 * a solution is found. */
bool kt_coulomb_iterate_modes(const kt_coulomb *c, kt_coulomb_solution *to);
/* One step of this iteration, without a check. */
void kt_coulomb_polish(const kt_coulomb *c, kt_coulomb_solution *to);

static inline void kt_coulomb_swap(double *a, double *b) {
    const double other = *a;
    *a = *b;
    *b = other;
}
/* Row k of a matrix with so many columns. */
static inline double *kt_coulomb_matrix_row(double *matrix, int k, int columns) {
    return matrix + (ptrdiff_t)k * columns;
}

/* ---- rest (coulomb_rest.c) --------------------------------------------------------------------------------------- */

/* Finds the least forces in the cones of all contacts that press, if these stick, or slip on in given directions. The
 * distribution of the load among these contacts has no influence on the motion: contacts that share the load are at
 * rest, or only dry friction of joints slips. Returns whether such forces exist. */
bool kt_coulomb_stick(const kt_coulomb *c, kt_coulomb_solution *to);
/* Finds the least forces under which all items are at rest; with `slips`, except contacts that slip on in given
 * directions. Returns whether such forces exist. */
bool kt_coulomb_find_rest(const kt_coulomb *c, kt_coulomb_solution *to, bool slips);

/* ---- a solution (coulomb.c) -------------------------------------------------------------------------------------- */

/* The arrays of the solver: an item has three rows in the cone solver. */
#define KT_COULOMB_SOLVER_FIELDS(X)                                                                                    \
    X(double, b, 3 * items, "of the cone solver")                                                                      \
    X(double, x, 3 * items, "likewise")                                                                                \
    X(double, mu, items, "likewise")                                                                                   \
    X(double, least, items, "likewise")                                                                                \
    X(double, limit, items, "likewise")                                                                                \
    X(unsigned, rejected, items, "modes of the items that are rejected, of the problem itself")                        \
    X(int, place, items, "items by blocks")                                                                            \
    X(int, end, items, "of each block")                                                                                \
    X(kt_coulomb_item, whole, items, "the items of all blocks")                                                        \
    X(kt_coulomb_item, item, items, "the items before they are sorted")                                                \
    X(double, rank, items, "by which items are sorted")                                                                \
    X(int, from, items, "indices of sorted items before")                                                              \
    X(char, cone_memory, cone, "the cone solver")

typedef struct kt_coulomb_solver {
    int first; /* the item with which the search for contacts that open begins */
    struct kt_cone *cone;
    kt_coulomb_solution *other, *next, *best, *part;
    KT_ARENA_DECLARE(KT_COULOMB_SOLVER_FIELDS)
} kt_coulomb_solver;

/* Bytes of a solver of problems of up to so many items and rows, and the solver in memory of that size. */
size_t kt_coulomb_solver_size(size_t items, size_t rows, size_t most);
kt_coulomb_solver *kt_coulomb_solver_init(size_t items, size_t rows, size_t most, void *memory, void *matrices);

/* Sorts the items by numbers that depend neither on units nor on the order of the items, and restores the order, also
 * in the solution (coulomb_order.c). */
void kt_coulomb_sort(kt_coulomb *c, kt_coulomb_solver *solver);
void kt_coulomb_restore(kt_coulomb *c, const kt_coulomb_solver *solver, kt_coulomb_solution *to);

/* Lists the items by blocks of W in `place`, and the end of each block in `end` (coulomb_blocks.c). Returns how many
 * blocks there are. */
int kt_coulomb_list_blocks(const kt_coulomb *c, int *place, int *end);
/* Solves the problem, one block after the other, and returns false if no solution is found. Friction that may not
 * stick has its largest force in every solution. A smaller force would be a force of rest, and the next step, in which
 * the item slips, would have another. The flag `independent` requires independent normal rows of active contacts. The
 * solution has the least impulses; its count is 2 if another motion was found, too. Adds the steps of Newton's method
 * to *steps. */
bool kt_coulomb_solve(kt_coulomb *c, kt_coulomb_solver *solver, bool independent, kt_coulomb_solution *solution,
                      uint64_t *steps);
/* Solves the problem of one block likewise (coulomb.c). */
bool kt_coulomb_solve_block(kt_coulomb *c, kt_coulomb_solver *solver, bool independent, kt_coulomb_solution *solution,
                            uint64_t *steps);
/* Solves a problem of contacts that do not part, for which kt_coulomb_iterate_modes finds no solution, with the cone
 * solver. Contacts of one body may have rates with which not all contacts can stick, and forces that are not unique.
 * Returns false if the solution is not exact for its modes. */
bool kt_coulomb_solve_modes(const kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to);

#endif
