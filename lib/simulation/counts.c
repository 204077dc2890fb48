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

int kt_simulation_body_of(const kt_simulation *simulation, size_t at) {
    const int i = (int)at, nq = (int)simulation->size.nq;
    for (int body = 1; body < kt_model_body_count(simulation->model); body++) {
        const kt_coordinates c = kt_body_coordinates(simulation->model, body);
        if ((i >= c.q && i < c.q + c.nq) || (i >= nq + c.v && i < nq + c.v + c.nv))
            return body;
    }
    return 0;
}

kt_velocity_correction kt_simulation_velocity_correction(const kt_simulation *simulation) {
    const kt_corrections *corrections = &simulation->memory.corrections;
    if (!(corrections->most > 0.0))
        return (kt_velocity_correction){0.0, (double)NAN, 0};
    return (kt_velocity_correction){corrections->most / corrections->fastest, corrections->time,
                                    kt_simulation_body_of(simulation, simulation->size.nq + (size_t)corrections->v)};
}

kt_simulation_counts kt_simulation_counts_get(const kt_simulation *simulation) {
    kt_integrator_counts from = kt_integrator_counts_get(simulation->integrator);
    kt_simulation_counts counts = {from.steps, from.rejected, from.evaluations, simulation->memory.factorizations,
                                   simulation->memory.iterations};
    counts.iterations.capped += (uint32_t)from.capped;
    return counts;
}
