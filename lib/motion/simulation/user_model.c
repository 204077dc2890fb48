/* The state of the user model. If a transformation of that model is integrated: its coordinates, forces and reactions.
 *
 * `state` is the user model's state at the current time. The state has its own memory, because the integrator exchanges
 * its arrays in every step, whereas a controller stores the pointers to the state. With a transformation, each step
 * derives `state` from the previous state, so that angles count whole turns. A checkpoint then contains `state` in
 * addition to the state that is integrated.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <string.h>

#include "contact/contact.h"

const kt_model *kt_simulation_model(const kt_simulation *simulation) {
    return simulation ? simulation->user_model : NULL;
}

const double *kt_simulation_positions(const kt_simulation *simulation) { return simulation ? simulation->state : NULL; }

const double *kt_simulation_velocities(const kt_simulation *simulation) {
    return simulation ? simulation->state + simulation->size.user_nq : NULL;
}

const double *kt_simulation_auxiliary_states(const kt_simulation *simulation) {
    return simulation ? simulation->state + simulation->size.user_nq + simulation->size.user_nv : NULL;
}

void kt_simulation_export(kt_simulation *simulation, double t, const double *y, const double *a, const double **q,
                          const double **v, const double **exported_a) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_transformation *by = simulation->transformation;
    *q = y;
    *v = y + size->nq;
    *exported_a = a;
    if (by == NULL)
        return;
    double *to_q = simulation->shown, *to_v = to_q + size->user_nq, *to_a = to_v + size->user_nv;
    memcpy(to_q, simulation->state, size->state * sizeof(double));
    by->from_free(by, y, y + size->nq, a, t - kt_integrator_time(simulation->integrator), to_q, to_v, to_a);
    *q = to_q;
    *v = to_v;
    *exported_a = a != NULL ? to_a : NULL;
}

kt_status kt_simulation_import_state(kt_simulation *simulation, double t, const double *q, const double *v, double *y,
                                     kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_transformation *by = simulation->transformation;
    kt_status status = kt_kinematics_update(simulation->user_model, simulation->user_data, q, v, NULL, error);
    if (status != KT_OK)
        return status;
    by->to_free(by, simulation->user_data, q, v, y, y + size->nq);
    return kt_state_project(simulation->model, simulation->data, t, y, y + size->nq, NULL, error);
}

/* Contacts that share their load in several ways get the least multipliers that press, as in their events. Friction of
 * joints that would exceed its limit is shared, too. */
static kt_status react_by_least(kt_simulation *simulation, const kt_dynamic_state *at, kt_wrench *joints,
                                kt_wrench *loops, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_data *data = simulation->data;
    const kt_instant instant = {
        .model = simulation->model, .data = data, .t = at->t, .q = at->q, .v = at->v, .tau = at->tau};
    kt_contacts_take_loads(c, simulation->model, data, simulation->multiplier);
    kt_contacts_share_load(c, simulation->model, simulation->multiplier);
    if (!kt_contacts_share_any(c, simulation->model) &&
        !kt_contacts_exceed_any(c, simulation->model, simulation->multiplier))
        return KT_OK;
    const size_t bytes = simulation->model->n.row * sizeof *c->row;
    memcpy(c->row, simulation->multiplier, bytes);
    kt_status status = kt_contacts_find_reactions(c, &instant, true, error);
    if (status != KT_OK)
        return status;
    memcpy(simulation->multiplier, c->reaction, bytes);
    data->given_multipliers = simulation->multiplier;
    status = kt_motion_evaluate(simulation->model, data, at, data->kinematics, joints, loops, error);
    data->given_multipliers = NULL;
    return status;
}

kt_status kt_simulation_react(kt_simulation *simulation, double t, const double *y, kt_error *error) {
    kt_dynamic_state at = {t, y, y + simulation->size.nq, simulation->tau, simulation->external};
    kt_data *data = simulation->data;
    const kt_transformation *by = simulation->transformation;
    if (by != NULL && (at.tau != NULL || at.external != NULL))
        kt_simulation_inputs(simulation, y, &at.tau, &at.external);
    kt_wrench *joints = by != NULL ? NULL : simulation->reaction;
    kt_wrench *loops = by != NULL ? simulation->free_reaction : simulation->loop_reaction;
    kt_status status = simulation->cached == KT_CACHED_EVALUATION
                           ? KT_OK
                           : kt_acceleration_trusted(simulation->model, data, &at, simulation->a, error);
    if (status == KT_OK)
        status =
            kt_motion_complete(simulation->model, data, &at, simulation->a, data->kinematics, joints, loops, error);
    if (status == KT_OK)
        status = kt_multipliers_take(simulation->model, data, t, simulation->multiplier, error);
    if (status == KT_OK && simulation->contacts != NULL)
        status = react_by_least(simulation, &at, joints, loops, error);
    if (status == KT_OK && by != NULL)
        by->reactions(by, y, simulation->tau, simulation->free_reaction, simulation->reaction,
                      simulation->loop_reaction);
    return status;
}
