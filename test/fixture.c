/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

bool kt_fine(const char *what, kt_status status, const kt_error *error) {
    if (status == KT_OK)
        return true;
    kt_note("%s: %s: %s", what, error->where, error->message);
    return kt_check_true(what, false);
}

void kt_need_fine(const char *what, kt_status status, const kt_error *error) { kt_need(kt_fine(what, status, error)); }

/* A function that makes an object, and the release of this object. */
#define MADE_FOR_TEST(name, parameters, call)                                                                          \
    static void release_##name(void *object) { kt_##name##_free(object); }                                             \
    kt_##name *kt_test_##name parameters {                                                                             \
        kt_##name *object = NULL;                                                                                      \
        kt_error error = {0};                                                                                          \
        kt_need_fine(#name, call, &error);                                                                             \
        kt_test_own(object, release_##name);                                                                           \
        return object;                                                                                                 \
    }

MADE_FOR_TEST(model, (const kt_description *description, const kt_model_options *options),
              kt_model_compile(description, options, &object, &error))
MADE_FOR_TEST(data, (const kt_model *model), kt_data_create(model, &object, &error))
MADE_FOR_TEST(linearization, (const kt_model *model, const kt_linearization_options *options),
              kt_linearization_create(model, options, &object, &error))
MADE_FOR_TEST(modes, (const kt_model *model), kt_modes_create(model, &object, &error))
MADE_FOR_TEST(spectrum, (const kt_model *model, int samples), kt_spectrum_create(model, samples, &object, &error))
MADE_FOR_TEST(floquet, (const kt_model *model, const kt_floquet_options *options),
              kt_floquet_create(model, options, &object, &error))
MADE_FOR_TEST(mass_inverse, (const kt_model *model, int rows), kt_mass_inverse_create(model, rows, &object, &error))
MADE_FOR_TEST(simulation, (const kt_model *model, const kt_run *run, const kt_simulation_options *options),
              kt_simulation_create(model, run, options, &object, &error))

void kt_test_advance(kt_simulation *simulation, double time) {
    kt_error error = {0};
    kt_need_fine("advance", kt_simulation_advance(simulation, time, &error), &error);
}

void kt_test_run(kt_simulation *simulation, kt_recorder *recorder, void *user) {
    kt_error error = {0};
    kt_need_fine("run", kt_simulation_run(simulation, recorder, user, &error), &error);
}
