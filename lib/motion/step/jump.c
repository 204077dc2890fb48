/* Jumps of the state: the energies before and after, their share in the work done, and the commit (simulation.h).
 *
 * A jump that fails leaves the simulation as it was. Without hard contacts, nothing is written before the last call
 * that may fail. Hard contacts open before a jump, and close behind it. Therefore the persistent state and the memory
 * of the integrator are copied before the jump, and copied back if it fails. Data are scratch: they are bound to the
 * previous model again. Only their counts since the last step are copied, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "step/simulation_core.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

/* The counts of the data since the last step. */
typedef struct kt_counts_of_data {
    kt_iterations iterations;
    kt_crossings crossings;
    kt_passage passage;
    uint32_t unconverged;
} kt_counts_of_data;

/* The mask that is the model of a simulation (contact/model.c). If none is, this is the first mask, which is then
 * overwritten before its next use, as all other masks are. */
static char *mask_in_use(const kt_simulation *simulation, const kt_model *model) {
    const size_t one = simulation->size.mask, all = KT_CONTACT_MASKS * one;
    const size_t at = (uintptr_t)model - (uintptr_t)simulation->mask_memory;
    return simulation->mask_memory + (at < all ? at / one * one : 0);
}

/* The parts of a copy: location, bytes. The mask comes last, because the model determines its location. One list
 * measures, copies and copies back. */
#define KT_UNDO_PARTS(X)                                                                                               \
    X(kt_simulation_block(simulation), kt_simulation_block_size(size))                                                 \
    X(simulation->integrator_memory, size->integrator)                                                                 \
    X(&simulation->breakpoints, sizeof(kt_breakpoints))                                                                \
    X(&counts, sizeof(kt_counts_of_data))                                                                              \
    X(&model, sizeof(const kt_model *))                                                                                \
    X(mask_in_use(simulation, model), size->mask)

size_t kt_simulation_undo_size(const kt_simulation_sizes *size) {
    size_t total = 0;
#define KT_UNDO_MEASURE(part, bytes) total += (bytes);
    KT_UNDO_PARTS(KT_UNDO_MEASURE)
#undef KT_UNDO_MEASURE
    return total;
}

void kt_simulation_begin_change(kt_simulation *simulation) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_model *model = simulation->model;
    const kt_data *data = simulation->data;
    const kt_counts_of_data counts = {data->iterations, data->crossings, data->passage, data->unconverged};
    char *to = simulation->undo;
    if (size->undo == 0)
        return;
#define KT_UNDO_COPY(part, bytes)                                                                                      \
    kt_copy(to, part, bytes);                                                                                          \
    to += (bytes);
    KT_UNDO_PARTS(KT_UNDO_COPY)
#undef KT_UNDO_COPY
}

/* Restores everything that a change which failed may have altered, from the copy in simulation->undo. */
static void undo_change(kt_simulation *simulation) {
    const kt_simulation_sizes *size = &simulation->size;
    kt_data *data = simulation->data;
    const kt_model *model;
    kt_counts_of_data counts;
    const char *from = simulation->undo;
#define KT_UNDO_RETURN(part, bytes)                                                                                    \
    kt_copy(part, from, bytes);                                                                                        \
    from += (bytes);
    KT_UNDO_PARTS(KT_UNDO_RETURN)
#undef KT_UNDO_RETURN
    simulation->breakpoints.passing = true; /* breakpoints are those of before, too */
    kt_simulation_take_model(simulation, model);
    simulation->breakpoints.passing = false;
    kt_phase_renew(simulation); /* parameters have been undone before */
    kt_phase_resume(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    kt_simulation_inputs_use(simulation);
    data->iterations = counts.iterations;
    data->crossings = counts.crossings;
    data->passage = counts.passage;
    data->unconverged = counts.unconverged;
}

kt_status kt_simulation_end_change(kt_simulation *simulation, kt_status status) {
    if (status != KT_OK && simulation->size.undo > 0)
        undo_change(simulation);
    return status;
}

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

kt_status kt_simulation_find_loss(kt_simulation *simulation, const double *v, const double *y, double *loss,
                                  kt_error *error) {
    assert(simulation->size.nv == 0 || v != simulation->a);
    double *d = simulation->a;
    for (size_t i = 0; i < simulation->size.nv; i++)
        d[i] = y[simulation->size.nq + i] - v[i];
    simulation->cached = KT_CACHED_NOTHING;
    kt_status status = kt_simulation_date_masses(simulation, kt_integrator_time(simulation->integrator), error);
    if (status == KT_OK)
        status = kt_kinematics_update(simulation->model, simulation->data, y, d, NULL, error);
    if (status == KT_OK)
        *loss = kt_kinetic_energy(simulation->model, simulation->data);
    return status;
}

kt_status kt_simulation_begin_jump(kt_simulation *simulation, bool needed, kt_simulation_energy *before,
                                   kt_error *error) {
    *before = (kt_simulation_energy){0.0, 0.0};
    kt_phase_complete(simulation);
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

/* The energy that the jump removes counts as net work done, which is dissipated minus supplied. */
kt_status kt_simulation_land(kt_simulation *simulation, const kt_simulation_energy *before,
                             const kt_simulation_energy *after, kt_error *error) {
    const kt_status status = kt_integrator_jump(simulation->integrator, simulation->y, error);
    if (status != KT_OK) /* GCOVR_EXCL_BR_LINE: a state at its own time, both finite */
        return status;   /* GCOVR_EXCL_LINE */
    memcpy(simulation->state, simulation->y, simulation->size.state * sizeof(double));
    simulation->memory.powers.count = 0; /* powers jump, too: their cubic begins anew */
    simulation->memory.powers.sum[1].net += before->kinetic + before->potential - (after->kinetic + after->potential);
    kt_phase_forget(simulation);
    kt_simulation_renew_breakpoints(simulation);
    return KT_OK;
}

/* Applies the strikes to a simulation with hard contacts, which may open or slip. A failure changes nothing. */
static kt_status strike_with_contacts(kt_simulation *simulation, kt_hook_of_strike *const *strike, kt_error *error) {
    kt_status status = KT_OK;
    kt_simulation_begin_change(simulation);
    simulation->breakpoints.passing = true;
    for (; status == KT_OK && *strike != NULL; strike++)
        status = (*strike)(simulation, error);
    simulation->breakpoints.passing = false;
    status = kt_simulation_end_change(simulation, status);
    memcpy(simulation->y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
    return status;
}

/* Moves y of the simulation, the present state, to the velocities of drives just after this time, at which they jump.
 * The drives supply the change of the energy. The change of velocities does not count as an error of a step. */
static kt_status strike_drives(kt_simulation *simulation, kt_error *error) {
    if (simulation->phases.strike[0] != NULL)
        return strike_with_contacts(simulation, simulation->phases.strike, error);
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
    kt_phase_forget(simulation);
    return KT_OK;
}

kt_status kt_simulation_pass_breakpoint(kt_simulation *simulation, kt_error *error) {
    bool strikes;
    if (!kt_simulation_pass_piece(simulation, &strikes))
        return KT_OK;
    kt_phase_interrupt(simulation);
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

/* Progress of steps towards a breakpoint is judged by the whole motion (kt_integrator.until). */
static kt_status enter_breakpoints(kt_simulation *simulation, const kt_step_progress *progress, kt_error *error) {
    simulation->integrator->until = isfinite(progress->t_limit) ? progress->t_limit : 0.0;
    return kt_simulation_pass_breakpoint(simulation, error);
}

static bool has_breakpoints_of_time(const kt_simulation *simulation) { return simulation->breakpoints.any; }

const kt_part kt_jump_part = {.is_active = has_breakpoints_of_time, .enter = enter_breakpoints};
