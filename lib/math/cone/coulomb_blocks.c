/* Blocks of a problem with Coulomb's friction (coulomb.h).
 *
 * Contacts of one island need not act on each other. Boxes on a driven floor are an example: loops connect them to one
 * body, but the drive holds this body, so that a force on one box does not accelerate another. Then W consists of
 * blocks, and so does the problem:
 *
 *     u_k = W_kk p_k + b_k
 *
 * Each block is solved alone. So a box rests while another one slips, as on a floor that is not driven. Two items
 * belong to one block if couplings abs(W_ij) > `rounding` sqrt(W_ii W_jj) join them, directly or through other items.
 * Forces whose couplings are smaller change no rate by more than its rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const double rounding = 1e-12;

/* Whether a force on one item changes a rate of the other. */
static bool changes_rate(const kt_coulomb *c, const kt_coulomb_item *a, const kt_coulomb_item *b) {
    for (int r = 0; r < kt_coulomb_rows(a); r++)
        for (int s = 0; s < kt_coulomb_rows(b); s++)
            if (fabs(kt_coulomb_coupling(c, kt_coulomb_row_of(a, r), kt_coulomb_row_of(b, s))) > rounding)
                return true;
    return false;
}

/* Items that are listed find those that are coupled with them. W of contacts that slip is not symmetric (slip.c). */
int kt_coulomb_list_blocks(const kt_coulomb *c, int *place, int *end) {
    int blocks = 0, listed = 0;
    for (int i = 0; i < c->n; i++)
        place[i] = i;
    for (int next = 0; next < c->n; blocks++) {
        for (listed = next + 1; next < listed; next++)
            for (int i = listed; i < c->n; i++) {
                const kt_coulomb_item *a = &c->item[place[next]], *b = &c->item[place[i]];
                if (!changes_rate(c, a, b) && !changes_rate(c, b, a))
                    continue;
                const int other = place[listed];
                place[listed++] = place[i];
                place[i] = other;
            }
        end[blocks] = listed;
    }
    return blocks;
}

/* Adds the solution of a block, whose items are those of the problem now. place: of the items in the whole. */
static void add_block(const kt_coulomb *c, const kt_coulomb_solution *part, const int *place, kt_coulomb_solution *to) {
    for (int k = 0; k < c->n; k++) {
        to->mode[place[k]] = part->mode[k];
        memcpy(to->e[place[k]], part->e[k], sizeof part->e[k]);
        for (int r = 0; r < kt_coulomb_rows(&c->item[k]); r++) {
            const int row = kt_coulomb_row_of(&c->item[k], r);
            to->p[row] = part->p[row];
            to->u[row] = part->u[row];
        }
    }
    to->shares = to->shares || part->shares;
    if (part->count > 1 && to->count == 1) {
        to->count = part->count;
        to->redundant = part->redundant;
        to->differs = place[part->differs];
    }
}

bool kt_coulomb_solve(kt_coulomb *c, kt_coulomb_solver *solver, bool independent, kt_coulomb_solution *solution,
                      uint64_t *steps) {
    assert(solution != solver->part);
    const int n = c->n, blocks = c->W != NULL ? kt_coulomb_list_blocks(c, solver->place, solver->end) : 1;
    if (blocks < 2)
        return kt_coulomb_solve_block(c, solver, independent, solution, steps);
    bool found = true;
    memcpy(solver->whole, c->item, (size_t)n * sizeof *c->item);
    memset(solution->p, 0, (size_t)c->rows * sizeof *solution->p);
    solution->shares = solution->redundant = false;
    solution->count = 1;
    for (int k = 0, begin = 0; k < blocks && found; begin = solver->end[k++]) {
        const int *place = solver->place + begin;
        c->n = solver->end[k] - begin;
        for (int i = 0; i < c->n; i++)
            c->item[i] = solver->whole[place[i]];
        found = kt_coulomb_solve_block(c, solver, independent, solver->part, steps);
        add_block(c, solver->part, place, solution);
    }
    c->n = n;
    memcpy(c->item, solver->whole, (size_t)n * sizeof *c->item);
    return found;
}
