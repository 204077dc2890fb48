/* The memory of a linearisation: options, sizes and layout. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"
#include "base/options.h"

#include "evaluate/evaluate.h"

#include <string.h>

int kt_motor_coordinates(const kt_model *model, int *coordinates) {
    if (!model)
        return 0;
    int count = 0;
    for (size_t i = 0; i < model->n.effect; i++) {
        if (model->effect[i].type != KT_EFFECT_MOTOR)
            continue;
        if (coordinates)
            coordinates[count] = model->link[model->effect[i].link[0]].v;
        count++;
    }
    return count;
}

static int count_markers(const kt_model *model) {
    int count = 0;
    for (int body = 0; body < kt_model_body_count(model); body++)
        count += kt_marker_count(model, body);
    return count;
}

static kt_status check_linearization_options(const kt_model *model, const kt_linearization_options *options,
                                             kt_error *error) {
    for (int i = 0; options->inputs && i < options->input_count; i++)
        if (options->inputs[i] < 0 || options->inputs[i] >= (int)model->n.v)
            return kt_error_set(error, KT_ERROR_ARGUMENT, "inputs",
                                "%d is no velocity coordinate: they go from 0 to %d", options->inputs[i],
                                (int)model->n.v - 1);
    for (int i = 0; options->outputs && i < options->output_count; i++) {
        const kt_marker_index *at = &options->outputs[i];
        if (at->body < 0 || at->body >= kt_model_body_count(model))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "outputs", "there is no body %d", at->body);
        if (at->marker < 0 || at->marker >= kt_marker_count(model, at->body))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "outputs", "body '%s' has no marker %d",
                                kt_body_name(model, at->body), at->marker);
    }
    if (options->input_count < 0 || options->output_count < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, options->input_count < 0 ? "input_count" : "output_count",
                            "a count is negative");
    return KT_OK;
}

static kt_linearization_sizes measure_linearization(const kt_model *model, const kt_linearization_options *options) {
    kt_linearization_sizes s = {.q = model->n.q,
                                .v = model->n.v,
                                .x = model->n.x,
                                .n = 2 * model->n.v + model->n.x,
                                .rows = model->n.row,
                                .link = model->n.link};
    s.inputs = (size_t)(options->inputs ? options->input_count : kt_motor_coordinates(model, NULL));
    s.markers = (size_t)(options->outputs ? options->output_count : count_markers(model));
    s.f = kt_probe_count(s.v, s.markers, s.x);
    s.work = kt_acceleration_work_size(model);
    s.data = kt_data_size(model);
    return s;
}

KT_ARENA_LAYOUT(place_linearization, kt_linearization, KT_LINEARIZATION_FIELDS, const kt_linearization_sizes *s)
KT_ARENA_ARRAYS(place_system, kt_system_arrays, KT_SYSTEM_FIELDS, const kt_linearization_sizes *s)

/* The arrays of the two systems follow those of the linearisation. */
static size_t lay_out_linearization(void *memory, const kt_linearization_sizes *s) {
    kt_linearization *l = memory;
    size_t used = place_linearization(memory, s);
    for (int k = 0; k < 2; k++)
        used += memory ? place_system(&l->arrays[k], (char *)memory + used, s) : place_system(NULL, NULL, s);
    return used;
}

static void list_output_markers(const kt_model *model, kt_marker_index *list) {
    for (int body = 0; body < kt_model_body_count(model); body++)
        for (int marker = 0; marker < kt_marker_count(model, body); marker++)
            *list++ = (kt_marker_index){body, marker};
}

size_t kt_linearization_size(const kt_model *model, const kt_linearization_options *options) {
    if (!model)
        return 0;
    kt_linearization_options own = kt_linearization_options_default();
    const kt_linearization_options *settings = KT_OPTIONS(kt_linearization_options, differences, &own, options, NULL);
    if (!settings || check_linearization_options(model, settings, NULL) != KT_OK)
        return 0;
    const kt_linearization_sizes sizes = measure_linearization(model, settings);
    return lay_out_linearization(NULL, &sizes);
}

kt_status kt_linearization_init(const kt_model *model, const kt_linearization_options *options, void *memory,
                                size_t size, kt_linearization **linearization, kt_error *error) {
    if (KT_IS_MISSING(error, model, linearization))
        return KT_ERROR_ARGUMENT;
    kt_linearization_options own = kt_linearization_options_default();
    const kt_linearization_options *settings = KT_OPTIONS(kt_linearization_options, differences, &own, options, error);
    if (settings == NULL)
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_massless_reject(model, "kt_linearization_init",
                                          "its accelerations have no derivatives: no modes, stability limits or "
                                          "equilibria are computed",
                                          error);
    if (status == KT_OK)
        status = check_linearization_options(model, settings, error);
    if (status != KT_OK)
        return status;
    const kt_linearization_sizes sizes = measure_linearization(model, settings);
    status = kt_arena_begin("kt_linearization_init", "kt_linearization_size", memory, size,
                            lay_out_linearization(NULL, &sizes), error);
    if (status != KT_OK)
        return status;
    kt_linearization *l = memory;
    (void)lay_out_linearization(memory, &sizes);
    l->size = sizes;
    l->model = model;
    l->differences = settings->differences;
    status = kt_data_init(model, l->data_memory, sizes.data, &l->data, error);
    if (status != KT_OK)      /* GCOVR_EXCL_BR_LINE: its memory has the layout that it requires */
        return status;        /* GCOVR_EXCL_LINE */
    l->data->followed = true; /* states between are not checked, only the first or the last (kt_open_contacts_check) */
    if (settings->inputs)
        memcpy(l->input_coordinate, settings->inputs, sizes.inputs * sizeof(int));
    else
        (void)kt_motor_coordinates(model, l->input_coordinate);
    if (settings->outputs)
        memcpy(l->marker, settings->outputs, sizes.markers * sizeof *l->marker);
    else
        list_output_markers(model, l->marker);
    kt_model_units(model, l->unit);
    kt_auxiliary_states_initial(model, l->x0);
    *linearization = l;
    return KT_OK;
}

kt_status kt_linearization_create(const kt_model *model, const kt_linearization_options *options,
                                  kt_linearization **linearization, kt_error *error) {
    kt_linearization_options own = kt_linearization_options_default();
    if (KT_IS_MISSING(error, model, linearization) ||
        KT_OPTIONS(kt_linearization_options, differences, &own, options, error) == NULL)
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_linearization_size(model, options);
    void *memory = kt_arena_allocate(size, "a linearisation", error);
    return memory == NULL
               ? KT_ERROR_MEMORY
               : kt_arena_own(memory, kt_linearization_init(model, options, memory, size, linearization, error));
}

double *kt_linearization_auxiliary_states(kt_linearization *l) { return l && l->size.x > 0 ? l->x0 : NULL; }

void kt_linearization_free(kt_linearization *linearization) { kt_arena_free(linearization); }
