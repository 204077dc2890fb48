/* Calculations in the present state of a simulation, and times at which functions of time jump. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "present.h"

#include "expression/formula_breakpoint.h"
#include "simulation/simulation.h"

#include "kinetree/mechanism.h"

#include <math.h>
#include <string.h>

kt_data *kt_fmu_present_data(kt_simulation *simulation) {
    const size_t count = (size_t)kt_auxiliary_state_count(simulation->model);
    if (count > 0)
        memcpy(kt_auxiliary_states(simulation->model, simulation->data), kt_simulation_auxiliary_states(simulation),
               count * sizeof(double));
    return simulation->data;
}

kt_status kt_fmu_own_rates(kt_simulation *simulation, double *rates, kt_error *error) {
    const kt_model *model = simulation->model;
    if (kt_auxiliary_state_count(model) == 0)
        return KT_OK;
    return kt_auxiliary_state_rates(model, kt_fmu_present_data(simulation), kt_simulation_time(simulation),
                                    kt_simulation_positions(simulation), kt_simulation_velocities(simulation), rates,
                                    error);
}

void kt_fmu_forget_present(kt_simulation *simulation) {
    simulation->memory.pending = simulation->memory.changed = true;
    simulation->cached = KT_CACHED_NOTHING;
    kt_simulation_renew_model(simulation);
}

/* Returns the first jump of a function after t, or `least` if that is less. Passes over breakpoints without a jump. */
static double next_jump_of(const kt_model *model, const kt_curve *curve, double t, int64_t *left, double least) {
    enum { ORDERS = 2, MOST = 64 };
    for (int k = 0; k < MOST && t < least; k++) {
        const kt_breakpoint next = kt_curve_next_breakpoint(curve, model->number, t, least, left);
        if (next.order <= ORDERS)
            return fmin(next.time, least);
        t = next.time;
    }
    return least;
}

double kt_fmu_next_jump(const kt_model *model, double t) {
    int64_t left = KT_BREAKPOINT_OPERATIONS;
    double next = HUGE_VAL;
    for (size_t i = 0; i < model->n.loop; i++)
        next = next_jump_of(model, &model->loop[i].curve, t, &left, next);
    for (size_t i = 0; i < model->n.effect; i++)
        for (int k = 0; k < 3; k++)
            next = next_jump_of(model, &model->effect[i].curve[k], t, &left, next);
    for (size_t i = 0; i < model->n.time_part; i++)
        next = next_jump_of(model, &model->time_part[i], t, &left, next);
    for (size_t k = 0; k < kt_mass_curve_count(model); k++)
        next = next_jump_of(model, kt_mass_curve(model, k), t, &left, next);
    return next;
}
