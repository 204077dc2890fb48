/* Models in one formulation or the other, for tests that run both. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_FORMULATION_H
#define KT_TEST_FORMULATION_H

#include "check.h"

#include "kinetree/study.h"

static inline void kt_release_absolute(void *absolute) { kt_absolute_free(absolute); }

/* The absolute formulation of a model of this description, which the running test owns. NULL if the formulation is
 * another one, or after a failed check. */
static inline kt_absolute *kt_formulate(const kt_description *description, const kt_model_options *options,
                                        const kt_model *model, kt_formulation formulation) {
    kt_absolute *absolute = NULL;
    kt_error error = {KT_OK, "", ""};
    if (model == NULL || formulation != KT_FORMULATION_ABSOLUTE)
        return NULL;
    if (!kt_check_equal_int("absolute formulation", kt_absolute_create(description, options, model, &absolute, &error),
                            KT_OK))
        kt_note("%s: %s", error.where, error.message);
    kt_test_own(absolute, kt_release_absolute);
    return absolute;
}

/* The default options of simulations in a formulation. */
static inline kt_simulation_options kt_formulated(const kt_absolute *absolute) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_absolute_use(absolute, &options);
    return options;
}

#endif
