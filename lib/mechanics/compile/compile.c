/* Compiles a description: checks the options and the description, and builds the model (build.c). If loops or effects
 * are switched, one model is built for each set of these (variants.c). At the end springs that start unstretched are
 * measured (measure.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "base/options.h"
#include "compile/one_sided.h"

#include <stdlib.h>

/* Rejects values that are no member of their type, as in a struct that was not initialised by kt_model_options_default.
 * The instruction set is checked when the model is built. */
static kt_status check_model_options(const kt_model_options *options, kt_error *error) {
    const struct {
        const char *name;
        unsigned value, count;
    } choices[] = {{"options.metric", options->metric, KT_METRIC_MASS + 1},
                   {"options.structure", options->structure, KT_STRUCTURE_FRONTS + 1},
                   {"options.excluded_forms", options->excluded_forms, 1u << KT_GROUP_FORM_COUNT},
                   {"options.plan", options->plan, KT_PLAN_COUNT}};
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; i++)
        if (choices[i].value >= choices[i].count)
            return kt_error_set(error, KT_ERROR_ARGUMENT, choices[i].name,
                                "%u is not a value of this option; begin with kt_model_options_default",
                                choices[i].value);
    if (options->contact_switches < 0 || options->contact_switches > KT_SWITCH_MAX)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options.contact_switches",
                            "%d: the number must be at least 0 and at most %d, which makes %d models",
                            options->contact_switches, KT_SWITCH_MAX, 1 << KT_SWITCH_MAX);
    return KT_OK;
}

/* Builds the model of one set of switched loops and effects: all others are off (KT_SWITCHED_OFF). */
static kt_status compile_one(const kt_description *description, const kt_model_options *options, kt_model **model,
                             kt_error *error) {
    kt_model *tree = NULL;
    kt_status status = kt_model_build(description, options, &tree, error);
    if (status == KT_OK)
        status = kt_model_measure_springs(tree, description, error);
    if (status == KT_OK && tree->n.massless)
        status = kt_massless_find(tree, description, error);
    if (status == KT_OK)
        status = kt_delassus_check_accuracy(tree, error);
    if (status == KT_OK)
        *model = tree;
    else
        kt_model_free(tree);
    return status;
}

/* Hard contacts and stops become switched loops first. */
static kt_status compile_contacts(const kt_description *description, const kt_model_options *options, kt_model **model,
                                  kt_error *error) {
    kt_expansion expanded = {.memory = NULL};
    kt_status status = kt_contacts_expand(description, &expanded, error);
    if (status == KT_OK)
        status = kt_variants_compile(&expanded.description, expanded.hard, options, compile_one, model, error);
    free(expanded.memory);
    return status;
}

kt_status kt_model_compile(const kt_description *description, const kt_model_options *options, kt_model **model,
                           kt_error *error) {
    if (KT_IS_MISSING(error, description, model))
        return KT_ERROR_ARGUMENT;
    kt_model_options own = kt_model_options_default();
    const kt_model_options *settings = KT_OPTIONS(kt_model_options, settable, &own, options, error);
    kt_status status = settings == NULL ? KT_ERROR_ARGUMENT : check_model_options(settings, error);
    if (status == KT_OK)
        status = kt_description_check(description, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    if (kt_contacts_count(description) > 0)
        return compile_contacts(description, settings, model, error);
    if (kt_switches_count(description) > 0)
        return kt_variants_compile(description, NULL, settings, compile_one, model, error);
    return compile_one(description, settings, model, error);
}
