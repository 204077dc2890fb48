/* The solution of a problem with Coulomb's friction (coulomb.h). The cone solver finds the mode of each item. Then the
 * directions of slip are made exact. Among impulses that give the same motion, the least are taken.
 *
 * A problem may have several solutions. If all items can stick, they stick. Otherwise the cone solver starts from the
 * impulses with which all items would stick. If this start leads to no solution, the solver starts from zero impulses.
 * A count records whether a start from zero impulses leads to another motion.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"

#include "cone/cone.h"
#include "kinetree/algebra.h"

#include <assert.h>
#include <math.h>
#include <string.h>

KT_ARENA_LAYOUT(lay_out_solver, kt_coulomb_solver, KT_COULOMB_SOLVER_FIELDS, size_t items, size_t cone)

size_t kt_coulomb_solver_size(size_t items, size_t rows, size_t most) {
    return lay_out_solver(NULL, items, kt_cone_size((int)items, (int)most)) + 4 * kt_coulomb_solution_size(items, rows);
}

kt_coulomb_solver *kt_coulomb_solver_init(size_t items, size_t rows, size_t most, void *memory, void *matrices) {
    kt_coulomb_solver *solver = memory;
    const size_t size = kt_coulomb_solution_size(items, rows);
    char *behind = (char *)memory + lay_out_solver(memory, items, kt_cone_size((int)items, (int)most));
    solver->cone = kt_cone_init((int)items, (int)most, solver->cone_memory, matrices);
    solver->other = kt_coulomb_solution_init(items, rows, behind);
    solver->next = kt_coulomb_solution_init(items, rows, behind + size);
    solver->best = kt_coulomb_solution_init(items, rows, behind + 2 * size);
    solver->part = kt_coulomb_solution_init(items, rows, behind + 3 * size);
    return solver;
}

/* Writes the rows that make up the r-th row of an item: `row` and `by` (factor) of each. Returns their number. Slip in
 * a given direction has one row. */
static int rows_of(const kt_coulomb_item *item, int r, int *row, double *by) {
    row[0] = r == 0 ? item->row : item->across + r - 1;
    by[0] = 1.0;
    if (item->type == KT_COULOMB_CONE)
        return 1;
    if (r > 0)
        return 0;
    for (int k = 0; k < 2 && item->type == KT_COULOMB_SLIPS; k++) {
        row[1 + k] = item->across + k;
        by[1 + k] = -item->friction * item->e[k];
    }
    return item->type == KT_COULOMB_SLIPS ? 3 : 1;
}

/* W of items i and j in the rows of the cone solver, 3 x 3 by rows that are `stride` numbers apart. */
static void pose_block(const kt_coulomb *c, int i, int j, int stride, double *W) {
    const kt_coulomb_item *item = &c->item[i];
    const int rows = item->type == KT_COULOMB_CONE ? 3 : 1;
    int column[3];
    double by[3];
    for (int s = 0; s < 3; s++) {
        const int n = rows_of(&c->item[j], s, column, by);
        for (int r = 0; r < 3; r++) {
            const int row = r == 0 ? item->row : item->across + r - 1;
            double sum = 0.0;
            for (int k = n - 1; k >= 0 && r < rows; k--)
                sum += by[k] * kt_coulomb_entry(c, row, column[k]);
            W[r * stride + s] = sum;
        }
    }
}

/* Writes the impulses of all rows from x of the cone solver. An item that slips in a given direction has friction from
 * its normal impulse (rows_of). */
static void scatter_rows(const kt_coulomb *c, const double *x, double *p) {
    int row[3];
    double by[3];
    memset(p, 0, (size_t)c->rows * sizeof *p);
    for (int r = 0; r < 3 * c->n; r++)
        for (int k = rows_of(&c->item[r / 3], r % 3, row, by) - 1; k >= 0; k--)
            p[row[k]] += by[k] * x[r];
}

/* Takes impulses or rates of the rows for the cone solver, three per item. Rows that the solver does not use are 0. */
static void gather(const kt_coulomb *c, const double *p, double *x) {
    int row[3];
    double by[3];
    for (int r = 0; r < 3 * c->n; r++)
        x[r] = rows_of(&c->item[r / 3], r % 3, row, by) > 0 ? p[row[0]] : 0.0;
}

/* Writes the problem as a problem of cones (cone.h): three rows for each item, with the friction coefficient, the
 * least normal force and the largest force that the item's type implies. */
static void pose(const kt_coulomb *c, kt_coulomb_solver *p) {
    const int m = 3 * c->n;
    gather(c, c->b, p->b);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        p->mu[i] = item->type == KT_COULOMB_CONE ? item->friction : 0.0;
        p->least[i] = item->least;
        p->limit[i] = item->type == KT_COULOMB_DRY ? item->friction : kt_coulomb_is_open_alone(item) ? 0.0 : -1.0;
    }
    for (int i = 0; i < c->n && c->n <= c->most; i++)
        for (int j = 0; j < c->n; j++)
            pose_block(c, i, j, m, kt_cone_matrix(p->cone) + 3 * i * m + 3 * j);
}

/* Returns block (i, j) of the W of the problem, for more items than the matrices have room for. */
static void posed_block(const void *user, int i, int j, double *w) { pose_block(user, i, j, 3, w); }

static void posed_rates(const void *user, const double *x, double *rate) {
    const kt_coulomb *c = user;
    scatter_rows(c, x, c->system->dp);
    kt_coulomb_find_rates(c, c->system->dp, NULL, c->rate);
    gather(c, c->rate, rate);
}

/* ---- modes ------------------------------------------------------------------------------------------------------- */

/* Whether a contact with a cone slips in its tangential directions, and the direction *e of the slip. size: of the
 * terms of its rates. */
static bool slips_across(const kt_coulomb_item *item, double size, const double *p, const double *u, double *e) {
    const double *pt = p + item->across, *ut = u + item->across;
    const double speed = kt_hypot(ut[0], ut[1]), force = kt_hypot(pt[0], pt[1]);
    const bool moves = speed > 1e-9 * size, leaves = (item->rejected & 1U << KT_COULOMB_STICK) != 0;
    e[0] = moves ? ut[0] / speed : leaves && force > 0.0 ? -pt[0] / force : 1.0;
    e[1] = moves ? ut[1] / speed : leaves && force > 0.0 ? -pt[1] / force : 0.0;
    return moves || leaves;
}

/* Finds the mode of each item from the forces p and the rates u = W p + b: open, sticking, or slipping along e.
 * Forces and rates that are a tiny part of the largest ones count as zero. */
static void find_modes(const kt_coulomb *c, kt_coulomb_solution *to) {
    const double strength = kt_coulomb_strength(c, to->p);
    kt_coulomb_find_rates(c, to->p, c->b, to->u);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double p = to->p[item->row], u = to->u[item->row], size = kt_coulomb_rate_size(c, i, strength);
        const bool leaves = (item->rejected & 1U << KT_COULOMB_STICK) != 0;
        const bool is_active =
            (p - item->least) * sqrt(kt_coulomb_weight(c, i)) > 1e-10 * strength && !kt_coulomb_is_open_alone(item);
        memcpy(to->e[i], item->e, sizeof to->e[i]);
        if (item->type == KT_COULOMB_DRY) {
            const bool moves = fabs(u) > 1e-9 * size;
            to->mode[i] = !moves && !leaves             ? KT_COULOMB_STICK
                          : (moves ? u > 0.0 : p < 0.0) ? KT_COULOMB_SLIP
                                                        : KT_COULOMB_SLIP_BACK;
        } else if (item->type == KT_COULOMB_CONE && (is_active || item->least > 0.0)) {
            const bool slips = slips_across(item, size, to->p, to->u, to->e[i]);
            to->mode[i] = is_active ? (slips ? KT_COULOMB_SLIP : KT_COULOMB_STICK)
                                    : (slips ? KT_COULOMB_LEAST_SLIP : KT_COULOMB_LEAST_STICK);
        } else {
            to->mode[i] = is_active ? KT_COULOMB_STICK : KT_COULOMB_OPEN;
        }
    }
}

/* Whether the motion depends on the distribution of forces, since contacts have friction. */
static bool has_friction(const kt_coulomb *c) {
    bool any = false;
    for (int i = 0; i < c->n; i++)
        any = any || c->item[i].type == KT_COULOMB_CONE || c->item[i].type == KT_COULOMB_SLIPS;
    return any;
}

/* ---- one start --------------------------------------------------------------------------------------------------- */

/* Refines the directions of slip by one more Newton step. Slip that just begins is slow: the cone solver finds its
 * directions only up to rounding relative to the fastest slip. */
static bool polish(const kt_coulomb *c, kt_coulomb_solution *to) {
    kt_coulomb_polish(c, to);
    return kt_coulomb_iterate(c, to);
}

/* Solves from the start solver->x. If the exact solution for the modes exists, it replaces the solution of the cone
 * solver. */
static bool solve_from(const kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to, uint64_t *steps) {
    pose(c, solver);
    const kt_cone_blocks blocks = {.block = posed_block, .rates = posed_rates, .user = c};
    const kt_cone_problem problem = {.n = c->n,
                                     .W = kt_cone_matrix(solver->cone),
                                     .blocks = c->n <= c->most ? NULL : &blocks,
                                     .b = solver->b,
                                     .mu = solver->mu,
                                     .least = solver->least,
                                     .limit = solver->limit};
    const kt_cone_result result = kt_cone_solve(solver->cone, &problem, solver->x);
    *steps += (uint64_t)result.newton;
    if (!result.converged)
        return false;
    scatter_rows(c, solver->x, to->p);
    to->shares = false;
    find_modes(c, to);
    if (!has_friction(c))
        kt_coulomb_find_vertex(c, to);
    kt_coulomb_copy(c, to, solver->best);
    if (kt_coulomb_is_unique(c, solver->best) && polish(c, solver->best))
        kt_coulomb_copy(c, solver->best, to);
    return true;
}

/* Whether two solutions differ in the motion, not only in forces that cause the same motion. */
static bool differs(const kt_coulomb *c, const kt_coulomb_solution *a, const kt_coulomb_solution *b) {
    const double strength = fmax(kt_coulomb_strength(c, a->p), kt_coulomb_strength(c, b->p));
    for (int i = 0; i < c->n; i++) {
        const double small = 1e-7 * kt_coulomb_rate_size(c, i, strength);
        for (int k = 0; k < kt_coulomb_rows(&c->item[i]); k++) {
            const int row = kt_coulomb_row_of(&c->item[i], k);
            if (fabs(a->u[row] - b->u[row]) > small)
                return true;
        }
    }
    return false;
}

/* Whether the other contacts hold all contacts open that may only be open, but for those with a mask in `except`. */
static bool holds_opened(const kt_coulomb *c, const unsigned *except, const kt_coulomb_solution *to) {
    const double strength = kt_coulomb_strength(c, to->p);
    bool holds = true;
    for (int i = 0; i < c->n; i++)
        holds = holds && (!kt_coulomb_is_open_alone(&c->item[i]) || (except && c->item[i].rejected == except[i]) ||
                          to->u[c->item[i].row] >= -1e-9 * kt_coulomb_rate_size(c, i, strength));
    return holds;
}

static void start_from_zero(const kt_coulomb *c, kt_coulomb_solver *solver) {
    memset(solver->x, 0, 3 * (size_t)c->n * sizeof *solver->x);
}

/* Opens contact i, from the start solver->x. Returns whether the other contacts then hold contact i, and all contacts
 * opened before, open; with `same`, also whether the motion is the same as before. except: contacts with these masks
 * need not be held open; NULL: all must be. */
static bool open_one(kt_coulomb *c, kt_coulomb_solver *solver, int i, const unsigned *except, bool same,
                     kt_coulomb_solution *to, uint64_t *steps) {
    kt_coulomb_item *item = &c->item[i];
    const unsigned rejected = item->rejected;
    item->rejected = ~(1U << KT_COULOMB_OPEN);
    if (solve_from(c, solver, solver->next, steps) && holds_opened(c, except, solver->next) &&
        !(same && differs(c, solver->next, to))) {
        kt_coulomb_copy(c, solver->next, to);
        return true;
    }
    item->rejected = rejected;
    return false;
}

/* Opens one contact that presses, from the impulses in `to` without its own. held: only a contact whose rows depend on
 * the rows of other contacts, which then carry the load of the opened contact. Opening any other contact may change the
 * motion. same: only a contact without which the motion is the same. */
static bool open_any(kt_coulomb *c, kt_coulomb_solver *solver, bool held, bool same, kt_coulomb_solution *to,
                     uint64_t *steps) {
    for (int k = 0; k < c->n; k++) {
        const int i = (solver->first + k) % c->n;
        if (c->item[i].type == KT_COULOMB_DRY || !kt_coulomb_is_active(to->mode[i]) ||
            (held && !kt_coulomb_is_held(c, to, i, kt_coulomb_held_rows(c, to, i, false), false)))
            continue;
        kt_coulomb_copy(c, to, solver->next);
        solver->next->p[c->item[i].row] = 0.0;
        gather(c, solver->next->p, solver->x);
        if (open_one(c, solver, i, solver->rejected, same, to, steps))
            return true;
    }
    return false;
}

/* ---- independent rows ------------------------------------------------------------------------------------------- */

/* Whether a contact with a cone is at rest, whether or not the contact presses. */
static bool is_resting(const kt_coulomb *c, const kt_coulomb_solution *to, int i) {
    const double small = 1e-9 * kt_coulomb_rate_size(c, i, kt_coulomb_strength(c, to->p));
    const double *ut = to->u + c->item[i].across;
    return c->item[i].type == KT_COULOMB_CONE && fabs(to->u[c->item[i].row]) <= small &&
           kt_hypot(ut[0], ut[1]) <= small;
}

/* Whether the normal row of item i depends on the normal rows of other contacts, whether or not they press. closed:
 * scratch. */
static bool depends_on_others(const kt_coulomb *c, kt_coulomb_solution *closed, int i) {
    for (int k = 0; k < c->n; k++)
        closed->mode[k] = kt_coulomb_is_open_alone(&c->item[k]) ? KT_COULOMB_OPEN : KT_COULOMB_SLIP;
    return c->item[i].type != KT_COULOMB_DRY && !kt_coulomb_is_open_alone(&c->item[i]) && kt_coulomb_fits(c, closed) &&
           kt_coulomb_is_held(c, closed, i, 1, false);
}

/* Opens contacts that slip or part, and whose normal rows depend on the normal rows of other contacts, in their order
 * from solver->first on. Contacts count whether or not they press, because the contacts that press in the first
 * solution depend on its path, and thereby on rounding. Tangential rows do not count, because the others may slip
 * without the opened contact. Contacts that the caller has opened must not close by this. Returns whether any contact
 * was opened: others may slip then. */
static bool open_dependent(kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to, uint64_t *steps) {
    bool any = false;
    for (int k = 0; k < c->n; k++) {
        const int i = (solver->first + k) % c->n;
        if (!is_resting(c, to, i) && depends_on_others(c, solver->next, i)) {
            kt_coulomb_copy(c, to, solver->next); /* what is known of other solutions stays */
            start_from_zero(c, solver);
            any = open_one(c, solver, i, NULL, false, to, steps) || any;
        }
    }
    return any;
}

/* Whether the normal row of a contact that slips depends on rows of others. */
static bool slips_on_shared_load(const kt_coulomb *c, const kt_coulomb_solution *to) {
    bool any = false;
    for (int i = 0; i < c->n && !any; i++)
        any = (c->item[i].type == KT_COULOMB_SLIPS ? kt_coulomb_is_active(to->mode[i])
                                                   : to->mode[i] == KT_COULOMB_SLIP && kt_coulomb_slips(c, to, i)) &&
              kt_coulomb_is_held(c, to, i, 1, false);
    return any;
}

/* Contacts and dry friction of a joint may share a load in many ways. Friction of a contact that slips follows its
 * normal force, so that each way has another motion, and the equations of the modes have no unique forces. At a vertex
 * of these forces, such a contact is open, or dry friction is at its limit. Returns whether there is such a vertex. */
static bool separate_dry_friction(kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to, uint64_t *steps) {
    static const kt_coulomb_mode limit[] = {KT_COULOMB_SLIP, KT_COULOMB_SLIP_BACK};
    bool found = true;
    for (int i = 0; i < c->n && slips_on_shared_load(c, to); i++) {
        if (c->item[i].type != KT_COULOMB_DRY || to->mode[i] != KT_COULOMB_STICK ||
            !kt_coulomb_is_held(c, to, i, 1, false))
            continue;
        found = open_any(c, solver, true, false, to, steps);
        for (int k = 0; k < 2 && !found; k++) {
            kt_coulomb_copy(c, to, solver->next);
            solver->next->mode[i] = limit[k];
            found = kt_coulomb_iterate(c, solver->next);
            if (found)
                kt_coulomb_copy(c, solver->next, to);
        }
    }
    return found;
}

/* Opens contacts until the normal rows of pressing contacts are independent. An open contact exerts no tangential
 * force. Therefore, if all contacts can stick, a contact whose tangential rows are independent, such as a driven wheel
 * of a car, is not opened. Returns false if the contacts that were opened first leave no other to open. */
static bool open_until_independent(kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to, uint64_t *steps) {
    bool found = true;
    while (found) {
        while (open_dependent(c, solver, to, steps)) {
        }
        if (kt_coulomb_is_unique(c, to))
            break;
        found = kt_coulomb_fits(c, to) &&
                (open_any(c, solver, true, true, to, steps) || open_any(c, solver, true, false, to, steps));
        if (!found) {
            kt_coulomb_copy(c, to, solver->next);
            if (kt_coulomb_stick(c, solver->next)) {
                kt_coulomb_copy(c, solver->next, to);
                found = true;
                break;
            }
        }
        found = found || open_any(c, solver, false, false, to, steps);
    }
    return found && separate_dry_friction(c, solver, to, steps);
}

/* Opens contacts until the others are independent. In a stack that slips, each body has to open one of its feet, but
 * not every foot of a body can be open together with those that were opened before. If the order of the items leads to
 * no solution, the search is repeated from the next item on. */
static bool make_independent(kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to, uint64_t *steps) {
    bool found = false, opened = true;
    for (int i = 0; i < c->n; i++)
        solver->rejected[i] = c->item[i].rejected;
    kt_coulomb_copy(c, to, solver->other);
    for (solver->first = 0; opened && !found && solver->first < c->n; solver->first++) {
        kt_coulomb_copy(c, solver->other, to);
        found = open_until_independent(c, solver, to, steps);
        opened = false;
        for (int i = 0; i < c->n; i++) {
            opened = opened || c->item[i].rejected != solver->rejected[i];
            c->item[i].rejected = solver->rejected[i];
        }
    }
    return found;
}

/* Whether contact i, which touches without pressing, could press because its normal row depends on other rows, and
 * would then restrain more motions: for example, an open wheel spins freely. */
static bool is_loose(const kt_coulomb *c, kt_coulomb_solution *to, int i) {
    const kt_coulomb_item *item = &c->item[i];
    if (item->type != KT_COULOMB_CONE || to->mode[i] != KT_COULOMB_OPEN || kt_coulomb_is_open_alone(item) ||
        !(fabs(to->u[item->row]) <= 1e-9 * kt_coulomb_rate_size(c, i, kt_coulomb_strength(c, to->p))))
        return false;
    to->mode[i] = KT_COULOMB_STICK;
    const bool spins =
        kt_coulomb_fits(c, to) && kt_coulomb_is_held(c, to, i, 1, true) && !kt_coulomb_is_held(c, to, i, 3, true);
    to->mode[i] = KT_COULOMB_OPEN;
    return spins;
}

/* Counts a second solution if a contact is loose. */
static void count_loose(const kt_coulomb *c, kt_coulomb_solution *to) {
    for (int i = 0; i < c->n; i++)
        if (is_loose(c, to, i)) {
            to->count = 2;
            to->redundant = true;
            to->differs = i;
            return;
        }
}

/* Makes all items stick or close; items that cannot do so remain unchanged. Impulses are zero if the matrices have no
 * room. */
static void stick_all(const kt_coulomb *c, kt_coulomb_solution *to) {
    for (int i = 0; i < c->n; i++) {
        to->mode[i] = kt_coulomb_is_open_alone(&c->item[i]) ? KT_COULOMB_OPEN : KT_COULOMB_STICK;
        memcpy(to->e[i], c->item[i].e, sizeof to->e[i]);
    }
    if (kt_coulomb_fits(c, to))
        kt_coulomb_linear(c, to);
    else
        memset(to->p, 0, (size_t)c->rows * sizeof *to->p);
}

/* Whether some item may not stick, other than those that may only be open. */
static bool any_is_rejected(const kt_coulomb *c) {
    for (int i = 0; i < c->n; i++)
        if ((c->item[i].rejected & 1U << KT_COULOMB_STICK) != 0 && !kt_coulomb_is_open_alone(&c->item[i]))
            return true;
    return false;
}

/* Describes two solutions with different motions. next: scratch, for the contacts that either solution closes. */
static void compare_solutions(const kt_coulomb *c, kt_coulomb_solution *to, const kt_coulomb_solution *other,
                              kt_coulomb_solution *next) {
    double most = -1.0;
    kt_coulomb_copy(c, to, next);
    for (int i = 0; i < c->n; i++) {
        const double apart = fabs(to->p[c->item[i].row] - other->p[c->item[i].row]) * sqrt(kt_coulomb_weight(c, i));
        if (!kt_coulomb_is_active(next->mode[i]))
            next->mode[i] = other->mode[i];
        to->differs = apart > most ? i : to->differs;
        most = fmax(most, apart);
    }
    to->redundant = !kt_coulomb_is_unique(c, next);
}

/* Solves the problem in the order of its items. The items do not rest. independent: as in kt_coulomb_solve. */
static bool solve_moving(kt_coulomb *c, kt_coulomb_solver *solver, bool independent, kt_coulomb_solution *solution,
                         uint64_t *steps) {
    kt_coulomb_solution *other = solver->other;
    stick_all(c, solution);
    gather(c, solution->p, solver->x);
    bool found = !any_is_rejected(c) && kt_coulomb_is_unique(c, solution) && kt_coulomb_holds(c, solution);
    found = found || solve_from(c, solver, solution, steps);
    start_from_zero(c, solver);
    const bool again = solve_from(c, solver, other, steps);
    if (!found && again)
        kt_coulomb_copy(c, other, solution);
    if (!found && !again)
        return false;
    solution->count = found && again && differs(c, solution, other) ? 2 : 1;
    if (solution->count > 1)
        compare_solutions(c, solution, other, solver->next);
    if (!independent)
        return true;
    found = make_independent(c, solver, solution, steps);
    count_loose(c, solution);
    solution->shares = solution->shares || (kt_coulomb_fits(c, solution) && kt_coulomb_shares(c, solution));
    return found;
}

/* Finds rest on a body that slips on more feet than it needs. The load of these feet is not unique, and friction
 * follows the load, so that one of them opens. Returns whether the others rest, and hold this foot open. closed:
 * scratch. */
static bool rest_without_one(kt_coulomb *c, kt_coulomb_solution *closed, kt_coulomb_solution *to) {
    bool found = false;
    for (int i = 0; i < c->n && !found; i++) {
        const unsigned rejected = c->item[i].rejected;
        if (c->item[i].type == KT_COULOMB_CONE || !depends_on_others(c, closed, i))
            continue;
        c->item[i].rejected = ~(1U << KT_COULOMB_OPEN);
        found = kt_coulomb_find_rest(c, to, true) && holds_opened(c, NULL, to);
        c->item[i].rejected = rejected;
    }
    return found;
}

/* Solves the problem of one block. Forces of friction that leaves may still be those of rest. */
static bool solve_items(kt_coulomb *c, kt_coulomb_solver *solver, bool independent, kt_coulomb_solution *solution,
                        uint64_t *steps) {
    assert(c->n >= 0 && c->rows >= c->n && (c->n == 0 || c->W != NULL || c->entry != NULL));
    assert(solution != solver->other && solution != solver->next && solution != solver->best);
    solution->count = 1;
    if (!has_friction(c)) {
        start_from_zero(c, solver);
        return solve_from(c, solver, solution, steps);
    }
    if (kt_coulomb_find_rest(c, solution, false))
        return true;
    stick_all(c, solution);
    const bool sorts = !kt_coulomb_is_unique(c, solution);
    if (sorts && kt_coulomb_find_rest(c, solution, true))
        return true;
    if (sorts)
        kt_coulomb_sort(c, solver);
    const bool found = (sorts && independent && rest_without_one(c, solver->next, solution)) ||
                       solve_moving(c, solver, independent, solution, steps);
    if (sorts)
        kt_coulomb_restore(c, solver, solution);
    return found;
}

/* Whether friction that may not stick has its largest force. */
static bool friction_leaves(const kt_coulomb *c, const kt_coulomb_solution *to) {
    const double strength = kt_coulomb_strength(c, to->p);
    bool leaves = true;
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double weak = 1e-9 * strength / sqrt(kt_coulomb_weight(c, i)), force = to->p[item->row];
        const double *across = to->p + item->across;
        if ((item->rejected & 1U << KT_COULOMB_STICK) == 0 || kt_coulomb_is_open_alone(item))
            continue;
        if (item->type == KT_COULOMB_DRY)
            leaves = leaves && fabs(force) >= item->friction - weak;
        else
            leaves = leaves && kt_hypot(across[0], across[1]) >= item->friction * force - weak;
    }
    return leaves;
}

bool kt_coulomb_solve_block(kt_coulomb *c, kt_coulomb_solver *solver, bool independent, kt_coulomb_solution *solution,
                            uint64_t *steps) {
    return solve_items(c, solver, independent, solution, steps) && friction_leaves(c, solution);
}

/* ---- contacts that do not part ----------------------------------------------------------------------------------- */

/* Changes modes that the solution contradicts. Returns whether any has changed. */
static bool change_modes(const kt_coulomb *c, kt_coulomb_solution *to) {
    bool changes = false;
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double *pt = to->p + item->across, *ut = to->u + item->across, size = kt_hypot(pt[0], pt[1]);
        if (item->type != KT_COULOMB_CONE)
            continue;
        const bool sticks = to->mode[i] == KT_COULOMB_STICK;
        if (sticks && size > item->friction * to->p[item->row]) {
            to->mode[i] = KT_COULOMB_SLIP;
            to->e[i][0] = -pt[0] / size;
            to->e[i][1] = -pt[1] / size;
            changes = true;
        } else if (!sticks && ut[0] * to->e[i][0] + ut[1] * to->e[i][1] < 0.0) {
            to->mode[i] = KT_COULOMB_STICK;
            changes = true;
        }
    }
    return changes;
}

bool kt_coulomb_solve_modes(const kt_coulomb *c, kt_coulomb_solver *solver, kt_coulomb_solution *to) {
    uint64_t steps = 0;
    start_from_zero(c, solver);
    return solve_from(c, solver, to, &steps) && kt_coulomb_iterate(c, to);
}

bool kt_coulomb_iterate_modes(const kt_coulomb *c, kt_coulomb_solution *to) {
    bool found = kt_coulomb_iterate(c, to);
    for (int i = 0; !found && i < c->n; i++)
        if (c->item[i].type == KT_COULOMB_CONE)
            to->mode[i] = KT_COULOMB_STICK;
    for (int k = 0; !found && k <= 2 * c->n; k++) {
        found = kt_coulomb_iterate(c, to);
        if (!found && !change_modes(c, to))
            return false;
    }
    return found;
}
