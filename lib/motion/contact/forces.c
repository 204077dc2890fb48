/* Reactions at an instant, w+ = w + W lambda of the contacts that touch (contact/contact_part.c has the law). Reactions
 * of an island are Coulomb's problem (friction.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "integrator/integrator.h"
#include "kinetree/mechanism.h"
#include "model/switching.h"

#include <math.h>

/* Raises the rates of rest of friction: an event that ends slip is found up to some roundings of the time, within which
 * forces change the rate. Returns whether friction slips forwards from now on that slipped backwards. */
static bool raise_rates_of_rest(kt_simulation *simulation, double t) {
    struct kt_contacts *c = simulation->contacts;
    bool changes = false;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        for (int i = c->meeting; i < c->touching; i++) {
            const kt_contact *item = &c->item[c->list[i]];
            const bool is_dry = i < c->resting;
            double size, *resting = &c->rest_rate[c->list[i]];
            (void)kt_contact_acceleration(c, i, &size);
            if (is_dry)
                size = fmax(size, kt_contacts_own(c, i) * kt_contact_limit(simulation->model, item));
            *resting = fmax(*resting, kt_time_step(t) * size);
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

/* Solves contact forces of the selected island (friction.c). If no such forces exist, an impulse without a collision
 * may stop slip, unless this has happened already (`again`). c->selected->jams: an impulse has stopped slip. */
static kt_status solve_forces_of_island(kt_simulation *simulation, double t, bool again, double *lost,
                                        kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const int island = (int)(c->selected - c->island);
    const bool jams = !again && kt_contacts_must_jam(c);
    const kt_status status = jams ? KT_ERROR_CONSTRAINT : kt_contacts_solve_forces(simulation, t, error);
    if (status != KT_ERROR_CONSTRAINT || again)
        return status;
    (void)kt_contacts_select(c, island); /* the search for the cause of the error has selected others */
    if (!kt_contacts_jam(simulation, lost))
        return jams ? kt_contacts_reject(simulation, t, "reactions", error) : status;
    c->selected->jams = true;
    return KT_OK;
}

/* Solves contact forces of all islands, from the accelerations without contacts in c->a. If impulses have stopped slip
 * at this instant (`again`), no others may do so. */
static kt_status solve_islands(kt_simulation *simulation, double t, bool again, double *lost, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_status status = KT_OK;
    for (int k = 0; k < c->n; k++)
        simulation->contact_state[k].shared = false;
    for (int i = 0; status == KT_OK && i < c->islands; i++) {
        if (kt_contacts_select(c, i))
            status = solve_forces_of_island(simulation, t, again, lost, error);
    }
    if (status == KT_OK)
        kt_contacts_hold_together(c);
    return status;
}

/* Solves the contact forces at the present state, together with the loads of joint friction if some friction is
 * proportional to a reaction. again: as in solve_islands. */
static kt_status solve_all_forces(kt_simulation *simulation, double t, bool again, double *lost, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    for (int k = c->sides; k < c->n; k++)
        c->item[k].load = 0.0;
    const kt_status status = kt_contacts_find_free(simulation, t, kt_integrator_state(simulation->integrator), error);
    if (status != KT_OK)
        return status;
    return kt_contacts_have_loads(c) ? kt_contacts_solve_loads(simulation, t, solve_islands, again, lost, error)
                                     : solve_islands(simulation, t, again, lost, error);
}

kt_status kt_contacts_solve_reactions(kt_simulation *simulation, double t, double *lost, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    bool jams = false;
    for (int i = 0; i < c->islands; i++)
        c->island[i].jams = false;
    const kt_status status = solve_all_forces(simulation, t, false, lost, error);
    for (int k = 0; status == KT_OK && k < c->n; k++)
        if (c->island[c->item[k].island].jams) {
            c->item[k].leaves = false;
            jams = true;
        }
    return jams ? solve_all_forces(simulation, t, true, lost, error) : status;
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
