/* Calculations in the present state of a simulation. */
#include "present.h"

#include "simulation/simulation.h"

#include "kinetree/mechanism.h"

#include <string.h>

kt_data *kt_fmu_present_data(kt_simulation *simulation) {
    const size_t count = (size_t)kt_own_state_count(simulation->model);
    if (count > 0)
        memcpy(kt_own_states(simulation->model, simulation->data), kt_simulation_own_states(simulation),
               count * sizeof(double));
    return simulation->data;
}

kt_status kt_fmu_own_rates(kt_simulation *simulation, double *rates, kt_error *error) {
    const kt_model *model = simulation->model;
    if (kt_own_state_count(model) == 0)
        return KT_OK;
    return kt_own_state_rates(model, kt_fmu_present_data(simulation), kt_simulation_time(simulation),
                              kt_simulation_positions(simulation), kt_simulation_velocities(simulation), rates, error);
}
