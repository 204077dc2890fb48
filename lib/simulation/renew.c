/* Parameters of the models that a simulation makes. */
#include "simulation/renew.h"

#include "model/switching.h"
#include "simulation/simulation.h"

void kt_simulation_renew_model(const kt_simulation *simulation) {
#if KT_HAS_EVENTS
    const kt_model *model = simulation->model;
    if (simulation->contacts != NULL && model->revision != kt_variants_model(model->variants, 0)->revision)
        simulation->contact_calls->renew(simulation);
#endif
    (void)simulation;
}
