/* Rates of auxiliary states in the present state of a simulation. */
#include "own_rates.h"

#include "simulation/simulation.h"

#include "kinetree/mechanism.h"

#include <string.h>

kt_status kt_fmu_own_rates(kt_simulation *simulation, double *rates, kt_error *error) {
    const kt_model *model = simulation->model;
    const int count = kt_own_state_count(model);
    if (count == 0)
        return KT_OK;
    memcpy(kt_own_states(model, simulation->data), kt_simulation_own_states(simulation),
           (size_t)count * sizeof(double));
    return kt_own_state_rates(model, simulation->data, kt_simulation_time(simulation),
                              kt_simulation_positions(simulation), kt_simulation_velocities(simulation), rates, error);
}
