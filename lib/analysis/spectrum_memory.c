/* Laying a spectrum out in memory. */
#include "analysis/spectrum.h"

#include "base/aligned.h"
#include "base/arena.h"

#include <string.h>

/* Neither inputs nor outputs. */
static kt_linearization_options nothing_besides(void) {
    static const int input = 0;
    static const kt_marker_index output = {0, 0};
    const kt_linearization_options options = {.inputs = &input, .outputs = &output};
    return options;
}

static kt_spectrum_sizes measure(const kt_model *model, int samples) {
    const kt_linearization_options options = nothing_besides();
    kt_spectrum_sizes s = {.nq = (size_t)kt_model_nq(model),
                           .nv = (size_t)kt_model_nv(model),
                           .samples = samples > 0 ? (size_t)samples : 0};
    s.modes = 2 * s.nv * s.samples;
    s.shapes = KT_SPECTRUM_SHAPES * s.samples;
    s.linearization = kt_linearization_size(model, &options);
    s.system_modes = kt_modes_size(model);
    return s;
}

static size_t lay_out(void *memory, const kt_spectrum_sizes *s) {
    kt_spectrum scratch;
    size_t used = 0;
    kt_spectrum *spectrum = kt_arena_take(memory, &used, sizeof *spectrum);
    if (spectrum == NULL)
        spectrum = &scratch;
#define KT_SPECTRUM_PLACE(type, name, count, meaning)                                                                  \
    spectrum->name = kt_arena_take(memory, &used, (count) * sizeof(type));
    KT_SPECTRUM_FIELDS(KT_SPECTRUM_PLACE)
#undef KT_SPECTRUM_PLACE
    spectrum->size = *s;
    return used;
}

size_t kt_spectrum_size(const kt_model *model, int samples) {
    const kt_spectrum_sizes sizes = measure(model, samples);
    return sizes.samples > 0 ? lay_out(NULL, &sizes) : 0;
}

kt_status kt_spectrum_init(const kt_model *model, int samples, void *memory, size_t size, kt_spectrum **spectrum,
                           kt_error *error) {
    const kt_spectrum_sizes sizes = measure(model, samples);
    const kt_linearization_options options = nothing_besides();
    if (sizes.samples == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "samples", "%d: at least one state is needed", samples);
    const size_t needed = lay_out(NULL, &sizes);
    if (!kt_arena_fits(memory, size, needed))
        return kt_arena_refuse("kt_spectrum_init", "kt_spectrum_size", memory, size, needed, error);
    kt_spectrum *placed = memory;
    memset(placed, 0, sizeof *placed);
    (void)lay_out(memory, &sizes);
    placed->model = model;
    kt_status status = kt_linearization_init(model, &options, placed->linearization_memory, sizes.linearization,
                                             &placed->linearization, error);
    if (status == KT_OK) /* GCOVR_EXCL_BR_LINE: its memory is laid out as it asks for */
        status = kt_modes_init(model, placed->modes_memory, sizes.system_modes, &placed->modes, error);
    if (status == KT_OK) /* GCOVR_EXCL_BR_LINE: and this */
        *spectrum = placed;
    return status;
}

kt_status kt_spectrum_create(const kt_model *model, int samples, kt_spectrum **spectrum, kt_error *error) {
    const size_t needed = kt_spectrum_size(model, samples);
    void *memory = needed > 0 ? kt_aligned_allocate(needed) : NULL;
    kt_spectrum *placed = NULL;
    if (needed > 0 && memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "%zu bytes for a spectrum are not to be had", needed);
    kt_status status = kt_spectrum_init(model, samples, memory, needed, &placed, error);
    if (placed == NULL) {
        kt_aligned_release(memory);
        return status;
    }
    placed->owned = memory;
    *spectrum = placed;
    return KT_OK;
}

void kt_spectrum_free(kt_spectrum *spectrum) {
    if (spectrum != NULL)
        kt_aligned_release(spectrum->owned);
}
