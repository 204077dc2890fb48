/* Steps of co-simulation. Two abilities of the importer decide what an event of the scene or of a contact does:
 *
 *     event mode, early return     the step ends before the event, which takes effect in event mode
 *     early return alone           the step ends behind the event
 *     event mode alone             an event at the end of the step takes effect in event mode, others within the step
 *     neither                      all events take effect within the step
 *
 * After each accepted step of the integrator the importer may read variables, in an intermediate update.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"

#include "simulation/simulation.h"

#include <math.h>

kt_status kt_fmu_fire(kt_fmu *fmu, kt_error *error) {
    kt_status status = kt_simulation_set_torque(fmu->simulation, fmu->torque, error);
    if (status == KT_OK)
        status = kt_simulation_fire(fmu->simulation, NULL, NULL, error);
    kt_fmu_change(fmu);
    fmu->is_over = status == KT_OK && kt_simulation_stopped(fmu->simulation) != NULL;
    return status;
}

/* Lets the importer read variables. Returns the end of the step that it requests. */
static double update_importer(kt_fmu *fmu, double end) {
    bool returns = false;
    double at = end;
    fmu->phase = KT_FMU_UPDATE;
    fmu->update(fmu->environment, fmu->time, false, true, true, fmu->returns_early, &returns, &at);
    fmu->phase = KT_FMU_STEP;
    return returns && fmu->returns_early ? fmin(end, fmax(at, fmu->time)) : end;
}

kt_status kt_fmu_advance(kt_fmu *fmu, double step, bool *needs_event, bool *early, kt_error *error) {
    kt_simulation *simulation = fmu->simulation;
    const double goal = kt_simulation_period_end(simulation, step);
    double end = goal;
    simulation->memory.stopped = 0;
    kt_status status = kt_fmu_fire(fmu, error);
    fmu->signals.are_set = false;
    if (status == KT_OK && !fmu->is_over)
        status = kt_fmu_take_signals(fmu, error);
    while (status == KT_OK && !*needs_event && !fmu->is_over && fmu->time < end) {
        status = kt_simulation_take_step(simulation, end, error);
        fmu->time = kt_simulation_time(simulation);
        kt_fmu_change(fmu);
        if (status == KT_OK && fmu->update != NULL)
            end = update_importer(fmu, end);
        if (status != KT_OK || simulation->memory.fires == 0)
            continue;
        *needs_event = fmu->has_event_mode && (fmu->returns_early || fmu->time == end);
        if (!*needs_event)
            status = kt_fmu_fire(fmu, error);
        if (fmu->returns_early)
            end = fmu->time;
    }
    kt_simulation_skip_records(simulation);
    *early = status == KT_OK && fmu->returns_early && fmu->time < goal;
    return status;
}
