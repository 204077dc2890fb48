/* What has been done, and how far iterations have gone. */
#include "simulation/simulation.h"

void kt_simulation_count(kt_simulation *simulation) {
    kt_iterations *most = &simulation->memory.iterations;
    for (int i = 0; i < 2; i++) {
        const kt_iterations new = kt_data_iterations(i == 0 ? simulation->data : simulation->user_data);
        most->position = new.position > most->position ? new.position : most->position;
        most->velocity = new.velocity > most->velocity ? new.velocity : most->velocity;
        most->assembly = new.assembly > most->assembly ? new.assembly : most->assembly;
        most->capped += new.capped;
    }
}

kt_simulation_counts kt_simulation_counts_get(const kt_simulation *simulation) {
    kt_integrator_counts from = kt_integrator_counts_get(simulation->integrator);
    kt_simulation_counts counts = {from.steps, from.rejected, from.evaluations, simulation->memory.factorizations,
                                   simulation->memory.iterations};
    counts.iterations.capped += (uint32_t)from.capped;
    return counts;
}
