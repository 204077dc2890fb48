/* Rest of contacts and dry friction (coulomb.h), as a problem of statics (statics.h).
 *
 * If all items are at rest, their forces p satisfy W p + b = 0. If contacts slip in given directions e, their friction
 * -mu N e follows the normal force N. Let G have a column for each unknown force, with the friction that follows this
 * force. Let P have the rows of the items without the tangential rows of slip. Then
 *
 *     P' W G x + P' b = 0,    p = G x
 *
 * The matrix is square, and symmetric if no contact slips. Two bodies may share a load in many ways, and rest on each
 * other, while other contacts slip: a load that a bar clamps to a sliding sled rests on the sled. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"
#include "cone/statics.h"
#include "kinetree/algebra.h"

#include <math.h>
#include <string.h>

/* Rows of an item that sticks, or is closed, in these modes; 0: its force is known. */
static int rows_at_rest(const kt_coulomb *c, const kt_coulomb_solution *to, int i) {
    return to->mode[i] != KT_COULOMB_STICK ? 0 : c->item[i].type == KT_COULOMB_CONE ? 3 : 1;
}

/* The rate of row j due to a unit of the force in row i of an item. If the contact slips in a given direction, friction
 * follows this force, and its rate is added. */
static double rate_due_to(const kt_coulomb *c, const kt_coulomb_item *item, int i, int j) {
    double rate = kt_coulomb_entry(c, i, j);
    for (int k = 0; k < 2 && item->type == KT_COULOMB_SLIPS; k++)
        rate -= item->friction * item->e[k] * kt_coulomb_entry(c, item->across + k, j);
    return rate;
}

/* Writes the equations of the listed rows: statics.h's A' by rows, and c. */
static void write_resting(const kt_coulomb *c, const kt_coulomb_solution *to, kt_statics *statics) {
    const int n = statics->columns = statics->rows;
    for (int k = 0, i = 0; k < c->n; k++)
        for (int r = rows_at_rest(c, to, k); r > 0; r--, i++) {
            statics->p[i] = -c->b[c->nonzero[i]] - to->u[c->nonzero[i]];
            for (int j = 0; j < n; j++)
                statics->matrix[i * n + j] = rate_due_to(c, &c->item[k], c->nonzero[i], c->nonzero[j]);
        }
}

/* Adds the items of the problem of statics (statics.h), and lists their rows in c->nonzero. The solution `to` has the
 * known forces of dry friction that slips, and the rates that these forces cause. */
static void list_resting(const kt_coulomb *c, const kt_coulomb_solution *to, kt_statics *statics) {
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const int rows = rows_at_rest(c, to, i);
        const bool is_dry = item->type == KT_COULOMB_DRY;
        for (int r = 0; r < rows; r++)
            c->nonzero[statics->rows + r] = r == 0 ? item->row : item->across + r - 1;
        if (rows > 0)
            (void)kt_statics_add(statics,
                                 rows == 3 ? KT_STATICS_CONE
                                 : is_dry  ? KT_STATICS_DRY
                                           : KT_STATICS_NORMAL,
                                 item->friction, is_dry ? 0.0 : item->least, kt_coulomb_weight(c, i));
    }
    write_resting(c, to, statics);
}

/* Whether contacts that slip have the same forces in all distributions of the load. If not, the motion depends on the
 * distribution. */
static bool slip_is_unique(const kt_coulomb *c, const kt_coulomb_solution *to, const kt_statics *statics) {
    static const double rounding = 1e-9; /* of a unit vector */
    bool unique = true;
    for (int i = 0, row = 0; i < c->n; row += rows_at_rest(c, to, i++))
        for (int n = statics->rank; n < statics->rows && c->item[i].type == KT_COULOMB_SLIPS; n++)
            unique = unique &&
                     (to->mode[i] != KT_COULOMB_STICK || fabs(statics->basis[n * statics->rows + row]) <= rounding);
    return unique;
}

/* Writes the forces of the statics' solution to p. */
static void copy_resting(const kt_coulomb *c, const kt_statics *statics, double *p) {
    for (int i = 0; i < statics->rows; i++)
        p[c->nonzero[i]] = kt_statics_force(statics, i);
    for (int i = 0; i < c->n; i++)
        for (int k = 0; k < 2 && c->item[i].type == KT_COULOMB_SLIPS; k++)
            p[c->item[i].across + k] = -c->item[i].friction * c->item[i].e[k] * p[c->item[i].row];
}

/* Writes the forces that dry friction has while it slips, and the rates due to these. *slips: whether contacts slip in
 * given directions. Returns the number of all other rows; -1 if contacts begin to slip or cannot stick. */
static int begin_rest(const kt_coulomb *c, kt_coulomb_solution *to, bool *slips) {
    int rows = 0;
    *slips = false;
    memset(to->p, 0, (size_t)c->rows * sizeof *to->p);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const bool is_dry = item->type == KT_COULOMB_DRY, sticks = to->mode[i] == KT_COULOMB_STICK;
        const bool is_smooth = item->type == KT_COULOMB_CONE && !(item->friction > 0.0);
        if (to->mode[i] != KT_COULOMB_OPEN && (sticks ? is_smooth : !is_dry))
            return -1;
        *slips = *slips || (sticks && item->type == KT_COULOMB_SLIPS);
        if (is_dry && !sticks)
            to->p[item->row] = to->mode[i] == KT_COULOMB_SLIP ? -item->friction : item->friction;
        rows += rows_at_rest(c, to, i);
    }
    kt_coulomb_find_rates(c, to->p, NULL, to->u);
    return rows;
}

/* Whether the rates satisfy the laws of the modes. */
static bool rates_agree(const kt_coulomb *c, const kt_coulomb_solution *to, int i, double strength) {
    const kt_coulomb_item *item = &c->item[i];
    const double small = 1e-10 * kt_coulomb_rate_size(c, i, strength), u = to->u[item->row];
    const double across = rows_at_rest(c, to, i) == 3 ? kt_hypot(to->u[item->across], to->u[item->across + 1]) : 0.0;
    return to->mode[i] == KT_COULOMB_STICK       ? fabs(u) <= small && across <= small
           : to->mode[i] == KT_COULOMB_SLIP_BACK ? u <= small
                                                 : u >= -small;
}

bool kt_coulomb_stick(const kt_coulomb *c, kt_coulomb_solution *to) {
    bool slips = false;
    const int rows = kt_coulomb_fits(c, to) ? begin_rest(c, to, &slips) : -1;
    if (rows < 0)
        return false;
    kt_statics *statics = kt_statics_init((size_t)rows, (size_t)rows, c->matrices);
    list_resting(c, to, statics);
    if (!kt_statics_begin_square(statics, !slips) || !slip_is_unique(c, to, statics))
        return false;
    kt_statics_find_margin(statics);
    kt_statics_find_least(statics);
    to->shares = statics->nullity > 0;
    copy_resting(c, statics, to->p);
    const double weak = kt_statics_exact * statics->unit, strength = kt_coulomb_strength(c, to->p);
    bool holds = statics->margin >= -kt_statics_exact;
    kt_coulomb_find_rates(c, to->p, c->b, to->u);
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        holds = holds && rates_agree(c, to, i, strength);
        if (item->type != KT_COULOMB_DRY && to->p[item->row] * sqrt(kt_coulomb_weight(c, i)) <= weak)
            to->mode[i] = KT_COULOMB_OPEN;
    }
    return holds;
}

bool kt_coulomb_find_rest(const kt_coulomb *c, kt_coulomb_solution *to, bool slips) {
    bool any = !slips;
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const bool is_open = kt_coulomb_is_open_alone(item), may_close = slips || item->type != KT_COULOMB_SLIPS;
        if (!is_open && (!may_close || (item->rejected & 1U << KT_COULOMB_STICK) != 0))
            return false;
        any = any || (!is_open && item->type == KT_COULOMB_CONE);
        to->mode[i] = is_open ? KT_COULOMB_OPEN : KT_COULOMB_STICK;
        memcpy(to->e[i], item->e, sizeof to->e[i]);
    }
    return any && kt_coulomb_stick(c, to);
}
