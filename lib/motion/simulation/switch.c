/* Loops and effects that are switched on and off while a simulation runs.
 *
 * The simulation changes to another variant of the model (model/switching.h). All arrays have room for each variant.
 * Loops that are switched on exert an impulse: velocities are projected in the mass metric,
 *
 *     v+ = v + M^-1 A' lambda,   A v+ = b'
 *
 * which is a plastic impact. With d = v+ - v the kinetic energy changes by
 *
 *     T+ - T = -d'M d / 2 + d'M v+ = -d'M d / 2 + lambda . b'
 *
 * The first part is the dissipated energy d'M d / 2, which is never negative. The second part is the supply of moving
 * constraints. The energy of springs counts as dissipated when they are switched off, and as supplied when they are
 * switched on.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "model/switching.h"
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

/* Loops that are switched on may be open, since the last step did not close them. This gap is not rounding. The gap is
 * closed if it is at most this part of its scale (a radian, the mechanism's length), or as long as the caller
 * allows. */
#define OPEN_MOST 1e-6

static kt_status check_gap(kt_simulation *simulation, double t, const double *y, kt_error *error) {
    const kt_model *model = simulation->model;
    const double *v = y + simulation->size.nq, most = simulation->options.switch_gap;
    kt_residual residual;
    kt_violation violation = kt_violation_none;
    const kt_status status = kt_loop_residual(model, simulation->data, t, y, v, &residual, error);
    if (status == KT_OK)
        (void)model->group_kernels->residuals(model, simulation->data, t, y, v, NULL, &violation);
    if (status != KT_OK || (most > 0.0 ? residual.position <= most : violation.gap <= OPEN_MOST))
        return status;
    return kt_error_set(error, KT_ERROR_CONSTRAINT, kt_where_format("t = %.9g s", t).text,
                        "loops are switched on that are open by %.3g (m or rad), more than %.3g; switch them on when "
                        "they are closed: change the start or the event, or use engage_here, which closes a loop with "
                        "the world where its body is. A program in C may raise kt_simulation_options.switch_gap",
                        residual.position, most > 0.0 ? most : OPEN_MOST * residual.position / violation.gap);
}

/* Writes the state and the work done after the switch to y. */
static kt_status close_switched_state(kt_simulation *simulation, const kt_simulation_energy *before,
                                      kt_simulation_energy *after, kt_error *error) {
    const double t = kt_integrator_time(simulation->integrator);
    const double *from = kt_integrator_state(simulation->integrator), *v = from + simulation->size.nq;
    double *y = simulation->y, loss = 0.0;
    bool changed = false;
    memcpy(y, from, simulation->size.n * sizeof(double));
    kt_status status = simulation->groups > 0 ? check_gap(simulation, t, y, error) : KT_OK;
    if (status == KT_OK)
        status = kt_simulation_project(simulation, t, y, &changed, error);
    if (status == KT_OK)
        status = kt_simulation_find_energy(simulation, y, after, error);
    if (status == KT_OK)
        status = kt_simulation_find_loss(simulation, v, y, &loss, error);
    if (status != KT_OK)
        return status;
    /* A loop that does not move supplies nothing: the remaining difference is rounding of the loss. */
    kt_simulation_add_jump(simulation, after->kinetic - before->kinetic, loss, simulation->model->driven);
    kt_simulation_add_jump(simulation, after->potential - before->potential, 0.0, false);
    return KT_OK;
}

static const kt_model *model_of_set(kt_simulation *simulation, uint64_t set) {
    kt_hook_of_variant *variant = simulation->phases.variant[0];
    return variant == NULL ? kt_model_switched(simulation->model, set) : variant(simulation, set);
}

kt_status kt_simulation_set_switches(kt_simulation *simulation, uint64_t set, double *loss, kt_error *error) {
    if (KT_IS_MISSING(error, simulation))
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_simulation_strike_due(simulation, error);
    if (status != KT_OK)
        return status;
    const kt_model *from = simulation->model;
    set &= ~simulation->contact_mask; /* contacts close and open on their own */
    set |= simulation->memory.released & simulation->contact_friction;
    const kt_model *to = model_of_set(simulation, set);
    kt_simulation_energy before, after = {0.0, 0.0};
    if (to == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_simulation_set_switches",
                            "the model has %d loops and effects that are switched (switching, in the description), and "
                            "the set 0x%llx has others",
                            kt_switch_count(from), (unsigned long long)set);
    status = kt_simulation_begin_jump(simulation, true, &before, error);
    if (status != KT_OK)
        return status;
    kt_simulation_take_model(simulation, to);
    status = close_switched_state(simulation, &before, &after, error);
    if (status == KT_OK)
        status = kt_simulation_land(simulation, &before, &after, error);
    if (status != KT_OK) {
        kt_simulation_take_model(simulation, from);
        return status;
    }
    simulation->memory.set = set;
    if (loss != NULL)
        *loss = before.kinetic - after.kinetic;
    return kt_phase_settle(simulation, error);
}
