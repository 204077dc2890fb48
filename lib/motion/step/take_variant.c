/* The change to another variant of the model (model/switching.h): data, sizes and values that follow from the model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/gaps.h"
#include "integrator/integrator.h"
#include "model/switching.h"
#include "step/simulation_core.h"

#include <assert.h>

void kt_simulation_take_model(kt_simulation *simulation, const kt_model *model) {
    assert(model->n.q == simulation->size.nq && model->n.v == simulation->size.nv);
    kt_simulation_sizes *size = &simulation->size;
    kt_integrator *integrator = simulation->integrator;
    kt_data_rebind(model, simulation->data);
    simulation->model = model;
    size->gap = kt_gap_list(model, NULL);
    if ((simulation->records.bits & KT_RECORD_REACTIONS) != 0)
        size->multiplier = (size_t)kt_model_mobility(model).equations;
    if (integrator->options.newton != NULL)
        kt_simulation_newton_measure(model, kt_method_family_of(kt_integrator_method(integrator))->exact, size);
    kt_simulation_follow_model(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    integrator->noise = simulation->groups > 0 ? &kt_simulation_noise : NULL;
    integrator->callbacks = kt_simulation_callbacks(simulation);
}
