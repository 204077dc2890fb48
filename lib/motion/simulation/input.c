/* The inputs of a step: torques and wrenches. Inputs are set between steps, and take effect at the beginning of the
 * next step, as changed parameters do. Unless the inputs are smooth, the right-hand side then jumps, and the integrator
 * discards earlier slopes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

static bool inputs_differ(const kt_simulation *simulation) {
    const kt_simulation_memory *memory = &simulation->memory;
    const kt_simulation_sizes *size = &simulation->size;
    if (memory->changed)
        return true;
    if (memory->now.torque != memory->next.torque || memory->now.wrenches != memory->next.wrenches)
        return true;
    return memcmp(simulation->torque, simulation->torque_next, size->nv * sizeof(double)) != 0 ||
           memcmp(simulation->wrench, simulation->wrench_next, size->body * sizeof(kt_wrench)) != 0;
}

kt_status kt_simulation_inputs_commit(kt_simulation *simulation, kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    if (!simulation->memory.pending)
        return KT_OK;
    if (inputs_differ(simulation)) {
        kt_phase_complete(simulation);
        /* The right-hand side jumps: slopes before the jump are invalid in the next step, except for smooth inputs. */
        memcpy(simulation->y, kt_integrator_state(simulation->integrator), size->n * sizeof(double));
        kt_status status = KT_OK;
        if (simulation->memory.changed) /* the model itself */
            status = kt_integrator_jump(simulation->integrator, simulation->y, error);
        else
            kt_integrator_change(simulation->integrator, simulation->options.smooth_inputs);
        if (status != KT_OK) /* GCOVR_EXCL_BR_LINE: its own state at its own time, both finite */
            return status;   /* GCOVR_EXCL_LINE */
        memcpy(simulation->torque, simulation->torque_next, size->nv * sizeof(double));
        memcpy(simulation->wrench, simulation->wrench_next, size->body * sizeof(kt_wrench));
        simulation->memory.now = simulation->memory.next;
        kt_simulation_inputs_use(simulation);
        kt_simulation_forget_breakpoints(simulation);
        kt_phase_interrupt(simulation);
    }
    simulation->memory.pending = simulation->memory.changed = false;
    return KT_OK;
}

static kt_status enter_inputs(kt_simulation *simulation, const kt_step_progress *progress, kt_error *error) {
    (void)progress;
    return simulation->memory.pending ? kt_simulation_inputs_commit(simulation, error) : KT_OK;
}

static bool takes_inputs(const kt_simulation *simulation) { return simulation->takes_inputs; }

const kt_part kt_input_part = {.is_active = takes_inputs, .enter = enter_inputs};

void kt_simulation_await_inputs(kt_simulation *simulation) {
    simulation->memory.pending = true;
    if (!simulation->takes_inputs) {
        simulation->takes_inputs = true;
        kt_parts_list(simulation);
    }
}

kt_status kt_simulation_set_torque(kt_simulation *simulation, const double *torque, kt_error *error) {
    if (KT_IS_MISSING(error, simulation))
        return KT_ERROR_ARGUMENT;
    size_t nv = simulation->size.nv;
    for (int body = 1; torque != NULL && body < (int)simulation->size.body; body++) {
        kt_coordinates at = kt_body_coordinates(simulation->model, body);
        for (int i = 0; i < at.nv; i++)
            if (!isfinite(torque[at.v + i])) {
                return kt_error_set(error, KT_ERROR_NOT_FINITE,
                                    kt_where_format("joint '%s'", kt_joint_name(simulation->model, body)).text,
                                    "the torque is %g; give a finite number", torque[at.v + i]);
            }
    }
    kt_copy_or_clear(simulation->torque_next, torque, nv * sizeof(double));
    simulation->memory.next.torque = torque != NULL;
    kt_simulation_await_inputs(simulation);
    return KT_OK;
}

static bool wrench_is_finite(const kt_wrench *wrench) {
    return isfinite(wrench->moment.x) && isfinite(wrench->moment.y) && isfinite(wrench->moment.z) &&
           isfinite(wrench->force.x) && isfinite(wrench->force.y) && isfinite(wrench->force.z);
}

kt_status kt_simulation_set_wrenches(kt_simulation *simulation, const kt_wrench *wrenches, kt_error *error) {
    if (KT_IS_MISSING(error, simulation))
        return KT_ERROR_ARGUMENT;
    size_t count = simulation->size.body;
    for (int body = 1; wrenches != NULL && body < (int)count; body++)
        if (!wrench_is_finite(&wrenches[body])) {
            return kt_error_set(error, KT_ERROR_NOT_FINITE,
                                kt_where_format("body '%s'", kt_body_name(simulation->model, body)).text,
                                "the wrench is not finite");
        }
    kt_copy_or_clear(simulation->wrench_next, wrenches, count * sizeof(kt_wrench));
    simulation->memory.next.wrenches = wrenches != NULL;
    kt_simulation_await_inputs(simulation);
    return KT_OK;
}
