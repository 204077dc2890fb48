/* Reactions and multipliers of a record. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "evaluate/evaluate.h"
#include "simulation/simulation.h"

#include <string.h>

/* Contacts that share their load in several ways get the least multipliers that press, as in their events. Friction of
 * joints that would exceed its limit is shared, too. *shares: whether multipliers were found in this way. */
static kt_status share_load(kt_simulation *simulation, const kt_dynamic_state *at, bool *shares, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_data *data = simulation->data;
    const kt_instant instant = {
        .model = simulation->model, .data = data, .t = at->t, .q = at->q, .v = at->v, .tau = at->tau};
    kt_contacts_update_loads(c, simulation->model, data, simulation->multiplier);
    kt_contacts_share_load(c, simulation->model, simulation->multiplier);
    *shares = kt_contacts_share_any(c, simulation->model, simulation->multiplier);
    if (!*shares)
        return KT_OK;
    const size_t bytes = simulation->model->n.row * sizeof *c->row;
    memcpy(c->row, simulation->multiplier, bytes);
    const kt_status status = kt_contacts_find_reactions(c, &instant, true, error);
    if (status == KT_OK)
        memcpy(simulation->multiplier, c->reaction, bytes);
    return status;
}

/* Replaces the reactions of a record by those of the least multipliers, if contacts share their load. Otherwise the
 * reactions of the evaluation are unique, and remain. */
static kt_status react_by_least(kt_simulation *simulation, const kt_dynamic_state *at, kt_error *error) {
    kt_data *data = simulation->data;
    bool shares;
    kt_status status = share_load(simulation, at, &shares, error);
    if (status != KT_OK || !shares)
        return status;
    data->given_multipliers = simulation->multiplier;
    status = kt_motion_evaluate(simulation->model, data, at, data->kinematics, simulation->reaction,
                                simulation->loop_reaction, error);
    data->given_multipliers = NULL;
    return status;
}

/* Any multipliers within their bounds show that the law holds. Most evaluations give such multipliers without a problem
 * of shares. */
static kt_status react_within_bounds(kt_simulation *simulation, const kt_dynamic_state *at, kt_error *error) {
    bool shares;
    kt_error made = {0};
    if (kt_contacts_have_loads(simulation->contacts))
        return react_by_least(simulation, at, error);
    return kt_contacts_check_reserves(simulation, at->t, &made) == KT_OK ? KT_OK
                                                                         : share_load(simulation, at, &shares, error);
}

kt_status kt_simulation_react(kt_simulation *simulation, double t, const double *y, bool reported, kt_error *error) {
    const kt_dynamic_state at = {t, y, y + simulation->size.nq, simulation->tau, simulation->external};
    kt_data *data = simulation->data;
    kt_status status = simulation->cached == KT_CACHED_EVALUATION
                           ? KT_OK
                           : kt_acceleration_trusted(simulation->model, data, &at, simulation->a, error);
    if (status == KT_OK)
        status = kt_motion_complete(simulation->model, data, &at, simulation->a, data->kinematics, simulation->reaction,
                                    simulation->loop_reaction, error);
    if (status == KT_OK)
        status = kt_multipliers_take(simulation->model, data, t, simulation->multiplier, error);
    if (status == KT_OK && simulation->contacts != NULL)
        status = (reported ? react_by_least : react_within_bounds)(simulation, &at, error);
    return status;
}
