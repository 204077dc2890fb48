/* The order of the items of a problem with Coulomb's friction (coulomb.h). Feet that slip share their load in many
 * ways, and move differently with other shares. The solution found depends on the order of the items. Therefore items
 * whose normal rows depend on each other are sorted by a number that follows from their rows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A number that depends neither on units nor on the order of the items. The couplings of the normal row with tangential
 * rows differ at each place of a plane. The weights are arbitrary: they only have to tell different items apart. */
static double rank_of_item(const kt_coulomb *c, int i) {
    static const double along[] = {0.31, 0.17}, among = 0.11, by_friction = 0.07;
    const kt_coulomb_item *item = &c->item[i];
    double rank = item->type == KT_COULOMB_DRY ? 1.0 : by_friction * item->friction;
    for (int k = 0; k < c->n; k++)
        rank += among * kt_coulomb_coupling(c, item->row, c->item[k].row) / c->n;
    for (int k = 0; k < 2 && (item->type == KT_COULOMB_CONE || item->type == KT_COULOMB_SLIPS); k++)
        rank += along[k] * kt_coulomb_coupling(c, item->row, item->across + k);
    return rank;
}

void kt_coulomb_sort(kt_coulomb *c, kt_coulomb_solver *solver) {
    assert(c->n >= 0);
    for (int i = 0; i < c->n; i++) {
        const double rank = rank_of_item(c, i);
        int k = i;
        for (; k > 0 && solver->rank[k - 1] > rank; k--) {
            solver->rank[k] = solver->rank[k - 1];
            solver->from[k] = solver->from[k - 1];
        }
        solver->rank[k] = rank;
        solver->from[k] = i;
    }
    memcpy(solver->item, c->item, (size_t)c->n * sizeof *c->item);
    for (int i = 0; i < c->n; i++)
        c->item[i] = solver->item[solver->from[i]];
}

void kt_coulomb_restore(kt_coulomb *c, const kt_coulomb_solver *solver, kt_coulomb_solution *to) {
    kt_coulomb_solution *sorted = solver->next;
    assert(to != sorted);
    kt_coulomb_copy(c, to, sorted);
    for (int i = 0; i < c->n; i++) {
        c->item[solver->from[i]] = solver->item[solver->from[i]];
        to->mode[solver->from[i]] = sorted->mode[i];
        memcpy(to->e[solver->from[i]], sorted->e[i], sizeof to->e[i]);
    }
    to->differs = to->count > 1 ? solver->from[sorted->differs] : to->differs;
}
