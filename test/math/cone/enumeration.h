/* All combinations of modes of a problem with Coulomb's friction, one after another: at most 4^items, or 6^items with
 * least impulses. They are the reference for the cone solver. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_LINEAR_ENUMERATION_H
#define KT_TEST_LINEAR_ENUMERATION_H

#include "cone/coulomb.h"

#include <math.h>
#include <string.h>

enum { STARTS = 8, TRIALS = 256 /* up to here all combinations are tried, and solutions counted */ };

/* First directions: against the tangential forces that would make all of these stick; and the opposite. */
static inline void enumeration_guess(const kt_coulomb *c, double turned, kt_coulomb_solution *stuck,
                                     kt_coulomb_solution *to) {
    kt_coulomb_copy(c, to, stuck);
    for (int i = 0; i < c->n; i++)
        stuck->mode[i] = !kt_coulomb_slips(c, to, i)         ? to->mode[i]
                         : kt_coulomb_is_active(to->mode[i]) ? KT_COULOMB_STICK
                                                             : KT_COULOMB_LEAST_STICK;
    kt_coulomb_linear(c, stuck);
    for (int i = 0; i < c->n; i++) {
        if (!kt_coulomb_slips(c, to, i))
            continue;
        const double *p = stuck->p + c->item[i].across;
        const double sign = kt_coulomb_across(to->mode[i]) == KT_COULOMB_SLIP ? 1.0 : -1.0;
        const double norm = hypot(p[0], p[1]), x = norm > 0.0 ? -sign * p[0] / norm : sign;
        const double y = norm > 0.0 ? -sign * p[1] / norm : 0.0;
        to->e[i][0] = cos(turned) * x - sin(turned) * y;
        to->e[i][1] = sin(turned) * x + cos(turned) * y;
    }
}

/* Solves one combination of modes, from directions that are turned from the guess. */
static inline bool enumeration_try(const kt_coulomb *c, double turned, kt_coulomb_solution *stuck,
                                   kt_coulomb_solution *to) {
    if (!kt_coulomb_is_unique(c, to))
        return false;
    for (int i = 0; i < c->n; i++)
        if (c->item[i].type == KT_COULOMB_SLIPS)
            memcpy(to->e[i], c->item[i].e, sizeof to->e[i]);
    enumeration_guess(c, turned, stuck, to);
    return kt_coulomb_iterate(c, to);
}

/* The next mode of an item behind another, or behind -1; false: there is none. */
static inline bool enumeration_next(const kt_coulomb_item *item, int behind, kt_coulomb_mode *mode) {
    const unsigned closed = 1U << KT_COULOMB_STICK, open = 1U << KT_COULOMB_OPEN;
    const unsigned moves = closed | 1U << KT_COULOMB_SLIP | 1U << KT_COULOMB_SLIP_BACK;
    const unsigned sets[] = {[KT_COULOMB_FRICTIONLESS] = closed | open,
                             [KT_COULOMB_SLIPS] = closed | open,
                             [KT_COULOMB_CONE] = moves | (item->least > 0.0 ? moves >> KT_COULOMB_STICK : open),
                             [KT_COULOMB_DRY] = moves};
    const unsigned left = sets[item->type] & ~item->rejected;
    for (int next = behind + 1; next < (int)KT_COULOMB_MODES; next++)
        if (left >> next & 1U) {
            *mode = (kt_coulomb_mode)next;
            return true;
        }
    return false;
}

/* Sets the sizes of items from the rates b of their rows. */
static inline void enumeration_set_sizes(kt_coulomb *c) {
    for (int i = 0; i < c->n; i++) {
        c->item[i].size = 0.0;
        for (int k = 0; k < kt_coulomb_rows(&c->item[i]); k++)
            c->item[i].size = fmax(c->item[i].size, fabs(c->b[kt_coulomb_row_of(&c->item[i], k)]));
    }
}

/* The largest rate without forces. */
static inline double enumeration_rate(const kt_coulomb *c) {
    double most = 0.0;
    for (int i = 0; i < c->n; i++)
        most = fmax(most, c->item[i].size);
    return most;
}

/* Whether it is another motion, not other forces for the same. */
static inline bool enumeration_differs(const kt_coulomb *c, const kt_coulomb_solution *a,
                                       const kt_coulomb_solution *b) {
    for (int j = 0; j < c->rows; j++)
        if (fabs(a->u[j] - b->u[j]) > 1e-7 * enumeration_rate(c))
            return true;
    return false;
}

/* Tries all combinations. */
static inline void enumeration_search(const kt_coulomb *c, double turned, kt_coulomb_solution *scratch[2],
                                      kt_coulomb_solution *solution, uint64_t *trials) {
    kt_coulomb_solution *tried = scratch[0];
    tried->count = 0;
    for (int i = 0; i < c->n; i++)
        if (!enumeration_next(&c->item[i], -1, &tried->mode[i]))
            return;
    for (int trial = 1, i = 0; i < c->n || trial == 1; trial++) {
        ++*trials;
        if (enumeration_try(c, turned, scratch[1], tried)) {
            if (solution->count == 0) {
                kt_coulomb_copy(c, tried, solution);
                solution->count = 1;
            } else if (enumeration_differs(c, solution, tried)) {
                solution->count++;
            }
        }
        if (solution->count > 0 && trial >= TRIALS)
            return;
        for (i = 0; i < c->n && !enumeration_next(&c->item[i], (int)tried->mode[i], &tried->mode[i]); i++)
            (void)enumeration_next(&c->item[i], -1, &tried->mode[i]);
    }
}

/* Writes the first solution and how many there are, or returns false: there is none. If none is found, the search for
 * directions starts from others, too. Adds the combinations that were tried to *trials. */
static inline bool enumeration_solve(const kt_coulomb *c, kt_coulomb_solution *scratch[2],
                                     kt_coulomb_solution *solution, uint64_t *trials) {
    solution->count = 0;
    for (int start = 0; start < STARTS && solution->count == 0; start++)
        enumeration_search(c, 0.4 * start, scratch, solution, trials);
    return solution->count > 0;
}

#endif
