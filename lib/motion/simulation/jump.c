/* Jumps of the state: the energies before and after, their share in the work done, and the commit (simulation.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

kt_status kt_simulation_find_energy(kt_simulation *simulation, const double *y, kt_simulation_energy *energy,
                                    kt_error *error) {
    const kt_model *model = simulation->model;
    const double *v = y + simulation->size.nq, t = kt_integrator_time(simulation->integrator);
    simulation->cached = KT_CACHED_NOTHING;
    kt_simulation_use_states(simulation, y);
    kt_status status = kt_simulation_date_masses(simulation, t, error);
    if (status == KT_OK)
        status = kt_kinematics_update(model, simulation->data, y, v, NULL, error);
    if (status == KT_OK)
        *energy = (kt_simulation_energy){.kinetic = kt_kinetic_energy(model, simulation->data),
                                         .potential = kt_potential_energy(model, simulation->data) +
                                                      kt_effect_energy(model, simulation->data, t, y, v)};
    return status;
}

kt_status kt_simulation_begin_jump(kt_simulation *simulation, bool needed, kt_simulation_energy *before,
                                   kt_error *error) {
    *before = (kt_simulation_energy){0.0, 0.0};
    kt_simulation_complete_powers(simulation);
    return needed || kt_simulation_accounts(simulation)
               ? kt_simulation_find_energy(simulation, kt_integrator_state(simulation->integrator), before, error)
               : KT_OK;
}

void kt_simulation_add_jump(kt_simulation *simulation, double gain, double lost, bool driven) {
    double *work = simulation->y + simulation->size.work;
    if (!simulation->size.integrates_works)
        return;
    work[0] += driven ? lost : gain > 0.0 ? 0.0 : -gain; /* both are NaN if the energy is */
    work[1] += driven ? gain + lost : gain < 0.0 ? 0.0 : gain;
}

/* Discards values of gaps and events, and the work done along the last step, because all belong to the state before the
 * jump. */
static void forget_motion(kt_simulation *simulation) {
    simulation->gap_time = simulation->event_time = (double)NAN;
    simulation->memory.refined = false;
    if (simulation->size.panel > 0)
        simulation->panel->known = false;
}

kt_status kt_simulation_land(kt_simulation *simulation, const double *to, const kt_simulation_energy *before,
                             const kt_simulation_energy *after, kt_error *error) {
    const kt_status status = kt_integrator_jump(simulation->integrator, simulation->y, error);
    if (status != KT_OK) /* GCOVR_EXCL_BR_LINE: a state at its own time, both finite */
        return status;   /* GCOVR_EXCL_LINE */
    memcpy(simulation->state, to, simulation->size.state * sizeof(double));
    simulation->memory.powers.count = 0;
    simulation->memory.powers.sum[1].net += before->kinetic + before->potential - (after->kinetic + after->potential);
    forget_motion(simulation);
    kt_simulation_renew_breakpoints(simulation);
    return KT_OK;
}

/* Likewise, with hard contacts, which may open or slip. A failure changes nothing. */
static kt_status strike_with_contacts(kt_simulation *simulation, const kt_contact_calls *calls, kt_error *error) {
    calls->keep(simulation);
    simulation->breakpoints.passing = true;
    const kt_status status = calls->strike(simulation, error);
    simulation->breakpoints.passing = false;
    if (status != KT_OK)
        calls->undo(simulation);
    memcpy(simulation->y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
    return status;
}

/* Moves y of the simulation, the present state, to the velocities of drives just after this time, at which they jump.
 * The drives supply the change of the energy. The change of velocities does not count as an error of a step. */
static kt_status strike_drives(kt_simulation *simulation, kt_error *error) {
    const kt_contact_calls *calls = kt_contact_calls_of(simulation);
    if (calls != NULL && calls->strike != NULL)
        return strike_with_contacts(simulation, calls, error);
    kt_simulation_energy before, after = {0.0, 0.0};
    bool changed;
    kt_status status = kt_simulation_begin_jump(simulation, false, &before, error);
    if (status == KT_OK)
        status = kt_simulation_project(simulation, simulation->breakpoints.after, simulation->y, &changed, error);
    if (status == KT_OK && kt_simulation_accounts(simulation))
        status = kt_simulation_find_energy(simulation, simulation->y, &after, error);
    if (status != KT_OK)
        return status;
    const double gain = after.kinetic + after.potential - before.kinetic - before.potential;
    kt_simulation_add_jump(simulation, gain, 0.0, true);
    simulation->memory.powers.sum[1].net -= gain;
    forget_motion(simulation);
    return KT_OK;
}

kt_status kt_simulation_pass_breakpoint(kt_simulation *simulation, kt_error *error) {
    bool strikes;
    if (!kt_simulation_pass_piece(simulation, &strikes))
        return KT_OK;
    simulation->memory.powers.count = 0;
    kt_simulation_note_jump(simulation);
    memcpy(simulation->y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
    const kt_status status = strikes && simulation->closes_loops ? strike_drives(simulation, error) : KT_OK;
    if (status != KT_OK) {
        kt_simulation_forget_breakpoints(simulation); /* the next call tries again */
        return status;
    }
    return kt_integrator_jump(simulation->integrator, simulation->y, error);
}

kt_status kt_simulation_strike_due(kt_simulation *simulation, kt_error *error) {
    const kt_breakpoints *c = &simulation->breakpoints;
    const double t = kt_integrator_time(simulation->integrator);
    if (c->any)
        kt_simulation_recall_breakpoints(simulation);
    return c->strikes && c->end == t ? kt_simulation_pass_breakpoint(simulation, error) : KT_OK;
}
