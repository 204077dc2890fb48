/* The impulses of a step (moreau.c): the problem for the cone solver, island by island, and penetration. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"

#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"

#include <math.h>

/* The cone solver ends at this residual. */
static const double enough = 1e-7;
enum { HALVINGS = 10 };

/* The rows of an item in the problem for the cone solver: all, or the normal row alone. */
static int posed_rows(const kt_moreau *m, int i) { return m->only_normal ? 1 : kt_moreau_rows(m, i); }

/* W of two of the chosen items, 3 x 3 by rows that are `stride` numbers apart. */
static void write_block(const kt_simulation *simulation, int i, int k, int stride, double *W) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const int rows = posed_rows(m, m->chosen[i]), columns = posed_rows(m, m->chosen[k]);
    const int a = m->first[m->chosen[i]] - c->selected->row, b = m->first[m->chosen[k]] - c->selected->row;
    const bool couples = kt_moreau_couples(m, m->chosen[i], m->chosen[k]);
    for (int r = 0; couples && r < rows; r++)
        for (int s = 0; s < columns; s++)
            W[r * stride + s] = kt_moreau_entry(c, a + r, b + s);
}

static void step_block(const void *user, int i, int k, double *w) {
    kt_clear(w, 9 * sizeof *w);
    write_block(user, i, k, 3, w);
}

/* Clears velocities of the selected island. */
static void clear_island(const struct kt_contacts *c, double *v) {
    const int32_t *coordinate = c->all->island_coordinate + c->selected->of->v;
    for (int j = 0; j < c->selected->of->v_count; j++)
        v[coordinate[j]] = 0.0;
}

/* Rates of the chosen items due to impulses, from the rates of the mechanism. */
static void step_rates(const void *user, const double *p, double *rate) {
    const kt_simulation *simulation = user;
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    clear_island(c, m->change);
    kt_clear(rate, 3 * (size_t)m->posed * sizeof *rate);
    for (int i = 0; i < m->posed; i++)
        for (int r = 0; r < posed_rows(m, m->chosen[i]); r++)
            kt_moreau_add_response(simulation, m->chosen[i], r, p[3 * i + r], m->change);
    for (int i = 0; i < m->posed; i++)
        for (int r = 0; r < posed_rows(m, m->chosen[i]); r++)
            rate[3 * i + r] = kt_contacts_along(c, m->first[m->chosen[i]] - c->selected->row + r, m->change);
}

/* Solves a problem of the chosen items, from p to p. normal: of their normal rows alone. */
static kt_cone_result solve_cones(kt_simulation *simulation, int count, bool normal, double *p) {
    kt_moreau *m = simulation->moreau;
    const int size = 3 * count;
    double *W = kt_cone_matrix(m->cone);
    const kt_cone_blocks blocks = {step_block, step_rates, simulation};
    const bool has_room = count <= kt_cone_room(m->cone);
    m->posed = count;
    m->only_normal = normal;
    if (has_room)
        kt_clear(W, (size_t)(size * size) * sizeof *W);
    for (int i = 0; i < count && has_room; i++)
        for (int k = 0; k < count; k++)
            write_block(simulation, i, k, size, W + 3 * i * size + 3 * k);
    const kt_cone_problem problem = {.n = count,
                                     .W = W,
                                     .blocks = has_room ? NULL : &blocks,
                                     .b = m->b,
                                     .mu = normal ? m->none : m->coefficient,
                                     .limit = m->limits,
                                     .enough = enough};
    const kt_cone_result result = kt_cone_solve(m->cone, &problem, p);
    m->counts.newton += (uint64_t)result.newton;
    return result;
}

int kt_moreau_choose_island(const kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    int count = 0;
    for (int r = 0; r < c->touching; r += kt_moreau_rows(m, m->chosen[count++]))
        m->chosen[count] = m->item_of[c->list[r]];
    return count;
}

/* The energy that the impulses of the chosen items dissipate; *size: the sum of the magnitudes of its terms. */
static double dissipation_of(const kt_simulation *simulation, int count, double *size) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double lost = 0.0;
    *size = 0.0;
    for (int j = 0; j < count; j++) {
        const int i = m->chosen[j];
        for (int k = 0; k < kt_moreau_rows(m, i); k++) {
            const int r = m->first[i] + k;
            const double end = kt_contacts_rate(c, c->rows[r], c->components[r], m->after);
            lost -= 0.5 * m->p[3 * i + k] * (m->begin[r] + end);
            *size += 0.5 * fabs(m->p[3 * i + k]) * (fabs(m->begin[r]) + fabs(end));
        }
    }
    return lost;
}

/* Stores the impulses of the chosen items, and finds the velocities at the end with them. */
static void add_impulses_of_chosen(kt_simulation *simulation, int count) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const int32_t *coordinate = c->all->island_coordinate + c->selected->of->v;
    for (int j = 0; j < c->selected->of->v_count; j++)
        m->after[coordinate[j]] = m->y[simulation->size.nq + (size_t)coordinate[j]];
    for (int j = 0; j < count; j++) {
        const int i = m->chosen[j];
        kt_copy(m->p + 3 * i, m->impulse + 3 * j, 3 * sizeof *m->p);
        for (int k = 0; k < kt_moreau_rows(m, i); k++)
            kt_moreau_add_response(simulation, i, k, m->p[3 * i + k], m->after);
    }
}

/* ---- rest -------------------------------------------------------------------------------------------------------- */

/* Coulomb's law may permit motion and rest in the same state (Painleve). As with events, contacts at rest then remain
 * at rest. The cone solver stays near its start, the impulses of the step before, so rest continues by itself. Where it
 * has begun to move, rest is sought as a problem of statics (cone/statics.h). */

/* Whether item i is a contact with a gap, which may close within the step. A body at rest does not touch it. */
static bool has_gap(const kt_moreau *m, int i) { return m->limit[i] < 0.0 && kt_moreau_bound(m, i) < 0.0; }

/* Whether the chosen items are at rest at the beginning of the step, but not at its end. Rates of rows i have different
 * units, so that each is compared in the metric of W: |u_i| / sqrt(W_ii). */
static bool begins_to_move(const kt_simulation *simulation, int count) {
    static const double still = 1e-6; /* of the rates that forces cause within the step */
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double before = 0.0, after = 0.0, forced = 0.0;
    for (int j = 0; j < count; j++)
        for (int k = 0; k < kt_moreau_rows(m, m->chosen[j]); k++) {
            const int r = m->first[m->chosen[j]] + k, i = r - c->selected->row;
            const double own = kt_moreau_entry(c, i, i), unit = own > 0.0 ? sqrt(own) : HUGE_VAL;
            const double bound =
                k == 0 && m->limit[m->chosen[j]] < 0.0 ? fmax(kt_moreau_bound(m, m->chosen[j]), 0.0) : 0.0;
            const double end = kt_contacts_rate(c, c->rows[r], c->components[r], m->after) - bound;
            before = fmax(before, fabs(m->begin[r]) / unit);
            after = fmax(after, fabs(end) / unit);
            forced = fmax(forced, fabs(m->free[r] - m->begin[r]) / unit);
        }
    return before <= still * forced && after > still * forced;
}

/* Whether a contact with a gap, the chosen item j, closes within the step under the impulses of rest. */
static bool gap_closes(const kt_simulation *simulation, int j) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double rate = m->b[3 * j]; /* from its bound */
    for (int k = 0; k < c->problem->rows; k++)
        rate += kt_moreau_entry(c, m->first[m->chosen[j]] - c->selected->row, c->problem->line[k]) * c->solution->p[k];
    return has_gap(m, m->chosen[j]) && !(rate >= 0.0);
}

static double rest_entry(const void *user, int line, int column) { return kt_moreau_entry(user, line, column); }

/* Finds impulses with which the chosen items are at rest at the end of the step: the least ones. */
static bool find_rest_of_chosen(kt_simulation *simulation, int count) {
    struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    kt_coulomb *p = c->problem;
    p->n = p->rows = 0;
    p->W = NULL;
    p->entry = rest_entry;
    p->user = c;
    for (int j = 0; j < count; j++) {
        const int i = m->chosen[j], rows = kt_moreau_rows(m, i);
        if (has_gap(m, i))
            continue;
        kt_coulomb_item *item = &p->item[p->n++];
        *item = (kt_coulomb_item){.type = rows == 3           ? KT_COULOMB_CONE
                                          : m->limit[i] < 0.0 ? KT_COULOMB_FRICTIONLESS
                                                              : KT_COULOMB_DRY,
                                  .row = p->rows,
                                  .across = p->rows + 1,
                                  .friction = rows == 3 ? m->mu[i] : fmax(m->limit[i], 0.0)};
        for (int k = 0; k < rows; k++) {
            p->line[p->rows] = m->first[i] + k - c->selected->row;
            p->b[p->rows++] = m->b[3 * j + k];
            item->size = fmax(item->size, fabs(m->free[m->first[i] + k]));
        }
    }
    bool rests = kt_coulomb_find_rest(p, c->solution, false);
    for (int j = 0; rests && j < count; j++)
        rests = !gap_closes(simulation, j);
    if (!rests)
        return false;
    kt_clear(m->impulse, 3 * (size_t)count * sizeof *m->impulse);
    for (int j = 0, at = 0; j < count; j++)
        for (int k = 0; !has_gap(m, m->chosen[j]) && k < kt_moreau_rows(m, m->chosen[j]); k++)
            m->impulse[3 * j + k] = c->solution->p[at++];
    return true;
}

/* Solves for the chosen items with the present restitutions. Returns false if there is no finite solution. */
static bool solve_once(kt_simulation *simulation, int count) {
    kt_moreau *m = simulation->moreau;
    kt_clear(m->b, 3 * (size_t)count * sizeof *m->b);
    for (int j = 0; j < count; j++) {
        const int i = m->chosen[j];
        for (int k = 0; k < kt_moreau_rows(m, i); k++)
            m->b[3 * j + k] = m->free[m->first[i] + k];
        m->b[3 * j] -= m->limit[i] < 0.0 ? kt_moreau_bound(m, i) : 0.0;
        m->limits[j] = m->limit[i];
        m->coefficient[j] = m->mu[i];
        kt_copy(m->impulse + 3 * j, m->p + 3 * i, 3 * sizeof *m->p);
    }
    const kt_cone_result result = solve_cones(simulation, count, false, m->impulse);
    add_impulses_of_chosen(simulation, count);
    const bool rests = begins_to_move(simulation, count) && find_rest_of_chosen(simulation, count);
    if (rests)
        add_impulses_of_chosen(simulation, count);
    m->counts.failures += !rests && !(result.residual <= enough);
    return rests || isfinite(result.residual);
}

static kt_status reject_step(const kt_simulation *simulation, int count, kt_error *error) {
    const kt_moreau *m = simulation->moreau;
    const int loop = simulation->contacts->item[m->item[m->chosen[0]]].loop;
    return kt_error_set(error, KT_ERROR_CONSTRAINT,
                        kt_where_at("contact", kt_loop_name(simulation->model, loop), m->t).text,
                        "no impulses satisfy it and the %d other contacts of the step: a prescribed motion drives it "
                        "through its boundary, or no joint has a lever against it; end the motion earlier, or take a "
                        "smaller step",
                        count - 1);
}

/* Solves for the items of the selected island. */
static kt_status solve_island(kt_simulation *simulation, kt_moreau_island *island, kt_error *error) {
    kt_moreau *m = simulation->moreau;
    const int count = kt_moreau_choose_island(simulation);
    double size;
    bool found = true, bounces = false;
    for (int j = 0; j < count; j++)
        bounces = bounces || m->e[m->chosen[j]] > 0.0;
    for (int halving = 0; found; halving++) {
        const uint64_t failures = m->counts.failures;
        found = solve_once(simulation, count);
        island->fails = m->counts.failures > failures;
        island->dissipated = found ? dissipation_of(simulation, count, &size) : 0.0;
        if (!found || !bounces || !(island->dissipated < -1e-12 * size) || halving > HALVINGS)
            break;
        m->counts.reduced += halving == 0;
        for (int j = 0; j < count; j++)
            m->e[m->chosen[j]] = halving < HALVINGS ? 0.5 * m->e[m->chosen[j]] : 0.0;
    }
    island->known = found ? simulation->contacts->touching : -1;
    return found ? KT_OK : reject_step(simulation, count, error);
}

kt_status kt_moreau_solve(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    kt_status status = KT_OK;
    m->counts.dissipated = 0.0;
    m->counts.closed = 0;
    for (int k = 0; status == KT_OK && k < c->islands; k++) {
        kt_moreau_island *island = &m->island[k];
        (void)kt_contacts_select(c, k);
        if (island->known != c->touching)
            status = solve_island(simulation, island, error);
        m->counts.dissipated += island->dissipated;
    }
    for (int i = m->dry; i < m->count; i++)
        m->counts.closed += m->p[3 * i] > 0.0;
    return status;
}

/* ---- penetration ------------------------------------------------------------------------------------------------- */

/* Bounds that remove a depth leave at most this part of kt_moreau_tolerance, and displacements at most this part of the
 * largest gap of a contact at rest. */
static const double removed = 1e-3;

/* Poses the problem of a displacement that moves an island out of its contacts:
 *
 *     g + h u + W p >= 0,   p >= 0,   one of both zero
 *
 * with the gaps g (m), the least rates u (m/s) that the contacts' laws permit, and the step h (s). Friction does not
 * take part. Before the impulses of the step are known (`begins`), only rates that open count. Gaps of contacts at rest
 * are then closed exactly: g + W p = 0 with p of either sign (limits: infinity).
 *
 * Returns the number of contacts in the problem; 0 if no gap needs a displacement. */
static int choose_deep(const kt_simulation *simulation, double h, bool begins) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const int all = kt_moreau_choose_island(simulation);
    bool any = false;
    int count = 0;
    for (int j = 0; j < all; j++) {
        const int i = m->chosen[j];
        if (i < m->dry)
            continue;
        const double settles = begins ? kt_moreau_settled_gap(simulation, m->item[i], h) : -1.0;
        const bool closes = fabs(c->gap[m->item[i]]) <= settles;
        const double rate = begins ? fmax(kt_moreau_bound(m, i), 0.0) : kt_moreau_bound(m, i);
        const double gap = c->gap[m->item[i]] + (closes ? 0.0 : h * rate);
        any = any || (closes ? fabs(gap) > removed * settles : gap < -removed * kt_moreau_tolerance(c));
        m->limits[count] = closes ? (double)INFINITY : -1.0;
        m->b[3 * count] = gap;
        m->b[3 * count + 1] = m->b[3 * count + 2] = 0.0;
        m->chosen[count++] = i;
    }
    return any ? count : 0;
}

/* Adds the displacement of the selected island to m->change. Returns whether there is one. begins: as in
 * choose_deep. */
static bool correct_island(kt_simulation *simulation, double h, bool begins) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const int count = choose_deep(simulation, h, begins);
    if (count == 0)
        return false;
    kt_clear(m->impulse, 3 * (size_t)count * sizeof *m->impulse);
    (void)solve_cones(simulation, count, true, m->impulse);
    clear_island(c, m->change);
    for (int j = 0; j < count; j++)
        kt_moreau_add_response(simulation, m->chosen[j], 0, m->impulse[3 * j], m->change);
    return true;
}

void kt_moreau_correct(kt_simulation *simulation, double h, bool begins) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    bool any = false;
    kt_clear(m->change, simulation->size.nv * sizeof *m->change);
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        any = correct_island(simulation, h, begins) || any;
    }
    kt_copy(m->position, m->y, simulation->size.nq * sizeof *m->y);
    if (!any)
        return;
    kt_position_add(simulation->model, m->position, m->change, m->y);
    for (int k = 0; k < c->sides; k++)
        c->gap[k] += kt_contacts_rate(c, k, 0, m->change) + c->item[k].sign * kt_moreau_right(c, k, 0);
}
