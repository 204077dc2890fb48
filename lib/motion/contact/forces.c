/* Reactions at an instant, w+ = w + W lambda of the contacts that touch (contact/contact_part.c has the law).
 *
 * Contacts without friction, and dry friction of joints, are a linear complementarity problem. With friction of
 * contacts the problem is Coulomb's (friction.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "cone/lemke.h"
#include "integrator/integrator.h"
#include "kinetree/mechanism.h"
#include "model/switching.h"

#include <float.h>
#include <math.h>

/* The problem of reactions: n rows of contacts and friction at rest, then a second row for each friction. */
typedef struct reactions {
    int n, sides; /* the number of rows, and of contacts */
} reactions;

/* Lists the rows that can have a reaction, with their free accelerations. A contact whose reaction has ended gets no
 * reaction, because the event has found the change of sign. The step ends a few rounding units of the time earlier,
 * where the contact may still have a compressive reaction. */
static void list_reactions(kt_simulation *simulation, const double *W, const double *u, reactions *r) {
    struct kt_contacts *c = simulation->contacts;
    double size;
    *r = (reactions){.n = 0};
    for (int i = 0; i < c->touching; i++) {
        const kt_contact *contact = &c->item[c->list[i]];
        const bool is_side = i < c->meeting;
        (void)kt_contact_rate(c, W, i, &size);
        if (is_side && u[i] > fmax(kt_contact_rest(simulation, W, i), kt_contact_rounding * size))
            continue;
        if (!is_side && fabs(c->v[contact->v]) > c->rest_rate[c->list[i]])
            continue;
        if (is_side && contact->leaves)
            continue;
        const double free = kt_contact_acceleration(c, W, i, &size);
        c->slip[r->n] = is_side ? 0.0 : kt_contact_slip(simulation->model, contact);
        c->limit[r->n] = is_side ? 0.0 : kt_contact_limit(simulation->model, contact);
        c->free[r->n] = is_side && fabs(free) <= kt_contact_rounding * size ? 0.0 : free;
        c->active[r->n++] = i;
        r->sides += is_side;
    }
    /* At rest, the model has friction that slips forwards. */
    for (int i = 0; i < r->n; i++)
        for (int k = r->sides; k < r->n; k++)
            c->free[i] += kt_contacts_between(c, W, c->active[i], c->active[k]) * c->slip[k];
}

/* Solves w = W lambda + free with lambda = z1 - S, and the rows of z2 for friction. */
static bool solve_reactions(struct kt_contacts *c, const double *W, const reactions *r, uint64_t *pivots) {
    const int friction = r->n - r->sides, rows = r->n + friction;
    double *M = c->M, *q = c->q;
    kt_clear(M, (size_t)(rows * rows) * sizeof *M);
    for (int i = 0; i < r->n; i++) {
        q[i] = c->free[i];
        for (int k = 0; k < r->n; k++) {
            M[i * rows + k] = kt_contacts_between(c, W, c->active[i], c->active[k]);
            q[i] -= M[i * rows + k] * c->limit[k];
        }
    }
    for (int k = r->sides; k < r->n; k++) {
        M[k * rows + k + friction] = 1.0;
        M[(k + friction) * rows + k] = -1.0;
        q[k + friction] = 2.0 * c->limit[k];
    }
    return kt_lemke_solve(rows, M, q, c->lemke, c->z, pivots);
}

/* The acceleration of row i under the reactions. *size: of its terms. */
static double find_row_acceleration(const struct kt_contacts *c, const double *W, const reactions *r, int i,
                                    double *size) {
    double w = kt_contact_acceleration(c, W, i, size);
    for (int k = 0; k < r->n; k++)
        w += kt_contacts_between(c, W, i, c->active[k]) * (c->z[k] - c->limit[k] + c->slip[k]);
    return w;
}

/* Raises the rates of rest of friction: an event that ends slip is found up to some roundings of the time, within which
 * forces change the rate. Returns whether friction slips forwards from now on that slipped backwards. */
static bool raise_rates_of_rest(kt_simulation *simulation, double t) {
    static const double roundings = 64.0 * DBL_EPSILON;
    struct kt_contacts *c = simulation->contacts;
    bool changes = false;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        for (int i = c->meeting; i < c->touching; i++) {
            const kt_contact *item = &c->item[c->list[i]];
            const bool is_dry = i < c->resting;
            double size, *resting = &c->rest_rate[c->list[i]];
            (void)kt_contact_acceleration(c, c->W, i, &size);
            if (is_dry)
                size = fmax(size, kt_contacts_own(c, c->W, i) * kt_contact_limit(simulation->model, item));
            *resting = fmax(*resting, roundings * fabs(t) * size);
            changes = changes || (is_dry && item->next == KT_CONTACT_BACK && c->v[item->v] >= -*resting);
        }
    }
    return changes;
}

/* Computes the accelerations with all contacts open, and the equations. */
static kt_status find_open_accelerations(kt_simulation *simulation, double t, const double *y, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_contacts_let_slip(c);
    const kt_model *slipping = kt_contacts_model(simulation, true);
    kt_data_rebind(slipping, simulation->data);
    kt_simulation_use_states(simulation, y);
    kt_contacts_put_rests(simulation, true);
    kt_status status = kt_acceleration_evaluate(slipping, simulation->data, t, y, c->v, simulation->tau,
                                                simulation->external, c->a, error);
    kt_contacts_put_rests(simulation, false);
    if (status == KT_OK)
        status = kt_contacts_find_norm(simulation, slipping, y, c->a, &c->change, error);
    if (status == KT_OK)
        status = kt_contacts_find_own_time(simulation, slipping, y, error);
    if (status == KT_OK)
        status = kt_contacts_find_equations(c, simulation->model, t, y, c->v, true, error);
    return status;
}

kt_status kt_contacts_find_free(kt_simulation *simulation, double t, const double *y, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    for (int k = 0; k < c->n; k++)
        c->rest_rate[k] = kt_contact_resting(simulation, k);
    kt_status status = find_open_accelerations(simulation, t, y, error);
    if (status == KT_OK && raise_rates_of_rest(simulation, t))
        status = find_open_accelerations(simulation, t, y, error);
    /* Friction of a joint that loops hold at rest has no equation. It is against the motion that begins. If none
     * begins, any force up to the limit is possible, and the least one, none, acts. */
    for (int k = c->sides; status == KT_OK && k < c->n; k++) {
        double size;
        const double a = c->item[k].spared ? kt_contacts_residual(c, k, 0, c->a, c->drift, &size) : 0.0;
        if (c->item[k].spared && fabs(c->v[c->item[k].v]) <= c->rest_rate[k])
            c->item[k].next = fabs(a) <= kt_contact_rounding * size ? KT_CONTACT_RELEASED
                              : a < 0.0                             ? KT_CONTACT_BACK
                                                                    : KT_CONTACT_OFF;
    }
    return status;
}

/* The state of friction in row i. At its upper limit, z1 is 2 S except for rounding. At this limit z2 decides, since
 * variables outside of Lemke's basis are exactly 0. Friction at its limit slips, against the force that is its
 * limit. */
static kt_contact_side side_of_friction(const struct kt_contacts *c, const reactions *r, int i,
                                        const kt_contact *contact) {
    const double most = 2.0 * c->limit[i], edge = contact->leaves ? 1e-6 * most : 0.0;
    const double z1 = c->z[i], z2 = c->z[i + r->n - r->sides];
    return z2 > 0.0 || z1 >= most - edge ? KT_CONTACT_BACK : z1 > edge ? KT_CONTACT_ON : KT_CONTACT_OFF;
}

/* Solves contact forces: the touching contacts of the selected island with compressive reactions, and its friction, of
 * the set that follows. */
static kt_status solve_smooth_forces(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *W = c->W, *u = c->u;
    reactions r;
    list_reactions(simulation, W, u, &r);
    if (!solve_reactions(c, W, &r, &simulation->memory.contacts.pivots))
        return kt_contacts_reject(simulation, t, "reactions", error);
    for (int i = 0; i < r.n; i++) {
        kt_contact *contact = &c->item[c->list[c->active[i]]];
        contact->next = i >= r.sides    ? side_of_friction(c, &r, i, contact)
                        : c->z[i] > 0.0 ? KT_CONTACT_ON
                                        : KT_CONTACT_OFF;
    }
    for (int i = 0; i < c->meeting; i++) {
        double size;
        c->w[i] = find_row_acceleration(c, W, &r, i, &size);
    }
    kt_contacts_close_grazing(simulation, W, u, c->w);
    return KT_OK;
}

/* Solves contact forces if contacts with friction touch (friction.c). If no such forces exist, an impulse without a
 * collision may stop slip, unless this has happened already (`again`). c->selected->jams: an impulse has stopped
 * slip. */
static kt_status solve_rough_forces(kt_simulation *simulation, double t, bool again, double *lost, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const int island = (int)(c->selected - c->island);
    const bool jams = !again && kt_contacts_must_jam(c, c->u);
    const kt_status status = jams ? KT_ERROR_CONSTRAINT : kt_contacts_solve_forces(simulation, t, c->W, c->u, error);
    if (status != KT_ERROR_CONSTRAINT || again)
        return status;
    (void)kt_contacts_select(c, island); /* the search for the cause of the error has selected others */
    if (!kt_contacts_jam(simulation, c->W, c->u, lost))
        return jams ? kt_contacts_reject(simulation, t, "reactions", error) : status;
    c->selected->jams = true;
    return KT_OK;
}

/* Solves contact forces of all islands, from the accelerations without contacts in c->a. *jams: whether impulses have
 * stopped slip in any. */
static kt_status solve_islands(kt_simulation *simulation, double t, bool again, bool *jams, double *lost,
                               kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_status status = KT_OK;
    for (int k = 0; k < c->n; k++)
        simulation->contact_state[k].shared = false;
    for (int i = 0; status == KT_OK && i < c->islands; i++) {
        if (!kt_contacts_select(c, i))
            continue;
        c->selected->jams = false;
        status = kt_contacts_have_cones(c) ? solve_rough_forces(simulation, t, again, lost, error)
                                           : solve_smooth_forces(simulation, t, error);
        *jams = *jams || c->selected->jams;
    }
    if (status == KT_OK)
        kt_contacts_hold_together(c);
    return status;
}

/* Solves the contact forces at the present state, together with the loads of joint friction if some friction is
 * proportional to a reaction. again: impulses have stopped slip at this instant, and may not do so again. */
static kt_status solve_all_forces(kt_simulation *simulation, double t, bool again, bool *jams, double *lost,
                                  kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    for (int k = c->sides; k < c->n; k++)
        c->item[k].load = 0.0;
    const kt_status status = kt_contacts_find_free(simulation, t, kt_integrator_state(simulation->integrator), error);
    if (status != KT_OK)
        return status;
    return kt_contacts_have_loads(c) ? kt_contacts_solve_loads(simulation, t, solve_islands, again, jams, lost, error)
                                     : solve_islands(simulation, t, again, jams, lost, error);
}

kt_status kt_contacts_solve_reactions(kt_simulation *simulation, double t, double *lost, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    bool jams = false;
    const kt_status status = solve_all_forces(simulation, t, false, &jams, lost, error);
    if (status != KT_OK || !jams)
        return status;
    for (int k = 0; k < c->n; k++)
        if (c->island[c->item[k].island].jams)
            c->item[k].leaves = false;
    return solve_all_forces(simulation, t, true, &jams, lost, error);
}

/* The own time follows from the rates of the items, and from the acceleration with all contacts open
 * (kt_contacts_find_free). The evaluation binds the data of the simulation to the model with open contacts, and
 * afterwards to the present model again. */
void kt_contacts_begin_own_time(kt_simulation *simulation, double t, const double *y) {
    struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model, *open = kt_model_switched(model, model->set & ~c->mask);
    kt_error made = {0};
    kt_contacts_clear_rows(c);
    kt_data_rebind(open, simulation->data);
    kt_status status = kt_contacts_find_equations(c, model, t, y, c->v, true, &made);
    if (status == KT_OK)
        status = kt_contacts_find_speed(simulation, open, y, &made);
    if (status == KT_OK)
        status = kt_contacts_find_free(simulation, t, y, &made);
    if (status != KT_OK) /* the first step reports it */
        simulation->memory.own_time = 0.0;
    kt_data_rebind(model, simulation->data);
    kt_contacts_put_directions(simulation);
    simulation->cached = KT_CACHED_NOTHING;
}
