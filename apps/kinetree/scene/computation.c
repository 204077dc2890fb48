/* Converts the settings of a scene's `simulate` section for its computation to options of the libraries. */
#include "command.h"

kt_model_options kt_compile_options(const kt_scene *scene) {
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_reduction_method_of(scene->reduction);
    options.metric = scene->run.metric;
    options.plan = scene->run.plan;
    options.settable = kt_scene_sets(scene);
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
