/* Converts the settings of a scene's `simulate` section for its computation to options of the libraries, and returns
 * the state that a scene gives. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"

#include <stdlib.h>

kt_model_options kt_compile_options(const kt_scene *scene) {
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_reduction_method_of(scene->reduction);
    options.metric = scene->run.metric;
    options.plan = scene->run.plan;
    options.settable = kt_scene_needs_settable(scene);
    return options;
}

const char *kt_scene_method_name(const kt_scene *scene, const kt_model *model, kt_method *storage) {
    return scene->contact == KT_CONTACT_STEPS ? "moreau-jean" : kt_run_method(&scene->run, model, storage)->name;
}

kt_variant kt_own_variant(const kt_scene *scene) {
    kt_variant variant = kt_variant_default(&scene->run);
    variant.model = kt_compile_options(scene);
    variant.formulation = scene->formulation;
    return variant;
}

double *kt_given_state(const kt_model *model) {
    double *state = calloc((size_t)(kt_model_nq(model) + kt_model_nv(model)) + 1, sizeof *state);
    if (state != NULL)
        kt_model_initial(model, state, state + kt_model_nq(model));
    return state;
}
