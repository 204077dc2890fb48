#include "fixture.h"

bool kt_fine(const char *what, kt_status status, const kt_error *error) {
    if (status == KT_OK)
        return true;
    kt_note("%s: %s: %s", what, error->where, error->message);
    return kt_check_true(what, false);
}

void kt_need_fine(const char *what, kt_status status, const kt_error *error) { kt_need(kt_fine(what, status, error)); }

static void release_model(void *model) { kt_model_free(model); }

kt_model *kt_test_model(const kt_description *description, const kt_model_options *options) {
    kt_model *model = NULL;
    kt_error error = {0};
    kt_need_fine("model", kt_model_compile(description, options, &model, &error), &error);
    kt_test_own(model, release_model);
    return model;
}

static void release_data(void *data) { kt_data_free(data); }

kt_data *kt_test_data(const kt_model *model) {
    kt_data *data = NULL;
    kt_error error = {0};
    kt_need_fine("data", kt_data_create(model, &data, &error), &error);
    kt_test_own(data, release_data);
    return data;
}

static void release_linearization(void *linearization) { kt_linearization_free(linearization); }

kt_linearization *kt_test_linearization(const kt_model *model) {
    kt_linearization *linearization = NULL;
    kt_error error = {0};
    kt_need_fine("linearisation", kt_linearization_create(model, NULL, &linearization, &error), &error);
    kt_test_own(linearization, release_linearization);
    return linearization;
}

static void release_simulation(void *simulation) { kt_simulation_free(simulation); }

kt_simulation *kt_test_simulation(const kt_model *model, const kt_run *run, const kt_simulation_options *options) {
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    kt_need_fine("simulation", kt_simulation_create(model, run, options, &simulation, &error), &error);
    kt_test_own(simulation, release_simulation);
    return simulation;
}
