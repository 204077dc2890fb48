/* The modes of a mechanism at states along its motion, and the largest steps that they allow.
 *
 * A run of an explicit method with a fixed step h multiplies each mode by R(h lambda) in each step, R the method's
 * stability polynomial [MSD 5.45]. The modes change along the motion; the fastest of all states bounds the step. What
 * is asked of a mode is that it grows no more than it does in truth over the whole run (kt_stability_growth), as if it
 * lasted so long.
 */
#include "kinetree/analysis.h"

#include "base/arena.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_spectrum_sizes {
    size_t nv, samples, modes, shapes, linearization, system_modes;
} kt_spectrum_sizes;

/* Every array: type, name, count, meaning. */
#define KT_SPECTRUM_FIELDS(X)                                                                                          \
    X(kt_spectrum_mode, mode, s->modes, "by time, and then by falling |lambda|")                                       \
    X(kt_complex, lambda, s->modes, "the same as plain numbers")                                                       \
    X(double, shape, s->shapes * s->nv, "of the fastest of each state")                                                \
    X(char, linearization_memory, s->linearization, "of a state")                                                      \
    X(char, modes_memory, s->system_modes, "of a state")

struct kt_spectrum {
    void *owned; /* memory of kt_spectrum_create, or NULL */
    const kt_model *model;
    kt_linearization *linearization;
    kt_modes *modes;
    kt_spectrum_sizes size;
    int samples, count;
#define KT_SPECTRUM_DECLARE(type, name, count, meaning) type *name;
    KT_SPECTRUM_FIELDS(KT_SPECTRUM_DECLARE)
#undef KT_SPECTRUM_DECLARE
};

/* ---- layout ------------------------------------------------------------------------------------------------------ */

/* Neither inputs nor outputs. */
static kt_linearization_options nothing_besides(void) {
    static const int input = 0;
    static const kt_marker_index output = {0, 0};
    const kt_linearization_options options = {.inputs = &input, .outputs = &output};
    return options;
}

static kt_spectrum_sizes measure(const kt_model *model, int samples) {
    const kt_linearization_options options = nothing_besides();
    kt_spectrum_sizes s = {.nv = (size_t)kt_model_nv(model), .samples = samples > 0 ? (size_t)samples : 0};
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

kt_status kt_spectrum_place(const kt_model *model, int samples, void *memory, size_t size, kt_spectrum **spectrum,
                            kt_error *error) {
    const kt_spectrum_sizes sizes = measure(model, samples);
    const kt_linearization_options options = nothing_besides();
    if (sizes.samples == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "samples", "%d: at least one state is needed", samples);
    const size_t needed = lay_out(NULL, &sizes);
    const bool misaligned = (uintptr_t)memory % KT_ALIGNMENT != 0;
    if (memory == NULL || size < needed || misaligned)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL,
                            "a spectrum takes %zu bytes at a multiple of %d; given: %zu bytes%s", needed, KT_ALIGNMENT,
                            memory == NULL ? 0 : size, misaligned ? ", misaligned" : "");
    kt_spectrum *placed = memory;
    memset(placed, 0, sizeof *placed);
    (void)lay_out(memory, &sizes);
    placed->model = model;
    kt_status status = kt_linearization_place(model, &options, placed->linearization_memory, sizes.linearization,
                                              &placed->linearization, error);
    if (status == KT_OK)
        status = kt_modes_place(model, placed->modes_memory, sizes.system_modes, &placed->modes, error);
    if (status == KT_OK)
        *spectrum = placed;
    return status;
}

kt_status kt_spectrum_create(const kt_model *model, int samples, kt_spectrum **spectrum, kt_error *error) {
    const size_t needed = kt_spectrum_size(model, samples);
    void *memory = needed > 0 ? aligned_alloc(KT_ALIGNMENT, needed) : NULL;
    kt_spectrum *placed = NULL;
    if (needed > 0 && memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "%zu bytes for a spectrum are not to be had", needed);
    kt_status status = kt_spectrum_place(model, samples, memory, needed, &placed, error);
    if (status != KT_OK) {
        free(memory);
        return status;
    }
    placed->owned = memory;
    *spectrum = placed;
    return KT_OK;
}

void kt_spectrum_free(kt_spectrum *spectrum) {
    if (spectrum != NULL)
        free(spectrum->owned);
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* |shape| against the units, the largest 1; false where nothing moves. */
static bool measure_moves(const double *shape, const double *unit, size_t nv, double *moves) {
    double most = 0.0;
    for (size_t i = 0; i < nv; i++) {
        moves[i] = hypot(shape[2 * i], shape[2 * i + 1]) / unit[i];
        most = fmax(most, moves[i]);
    }
    for (size_t i = 0; i < nv; i++)
        moves[i] = most > 0.0 ? moves[i] / most : 0.0;
    return most > 0.0;
}

kt_status kt_spectrum_add(kt_spectrum *spectrum, double t, const double *q, const double *v, const double *tau,
                          kt_error *error) {
    const size_t nv = spectrum->size.nv;
    if ((size_t)spectrum->samples >= spectrum->size.samples)
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "there is room for %zu states", spectrum->size.samples);
    kt_status status = kt_linearization_evaluate(spectrum->linearization, t, q, v, tau, error);
    if (status != KT_OK)
        return status;
    const kt_linear_system *system = kt_linearization_system(spectrum->linearization);
    status = kt_modes_evaluate(spectrum->modes, system, error);
    if (status != KT_OK)
        return status;
    const int count = kt_modes_count(spectrum->modes);
    for (int i = 0; i < count; i++) {
        const int from = count - 1 - i, to = spectrum->count + i; /* they come by rising |lambda| */
        double *moves = spectrum->shape + ((size_t)spectrum->samples * KT_SPECTRUM_SHAPES + (size_t)i) * nv;
        const kt_mode mode = kt_modes_at(spectrum->modes, from);
        const bool is_kept = i < KT_SPECTRUM_SHAPES;
        if (is_kept && !measure_moves(kt_modes_positions(spectrum->modes, from), system->unit, nv, moves))
            (void)measure_moves(kt_modes_velocities(spectrum->modes, from), system->unit, nv, moves);
        spectrum->mode[to] = (kt_spectrum_mode){t, mode, is_kept ? moves : NULL};
        spectrum->lambda[to] = (kt_complex){mode.real, mode.imaginary};
    }
    spectrum->count += count;
    spectrum->samples++;
    return KT_OK;
}

/* The motion whose states are looked at: never by a fixed step, which may be the very one that is in doubt. */
static kt_run run_of(const kt_run *run) {
    kt_run adaptive = *run;
    const kt_method *method = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    adaptive.formulation = KT_FORMULATION_TREE;
    adaptive.record = KT_RECORD_POSITION;
    adaptive.marker_count = 0;
    if (run->step > 0.0 || method == NULL || method->embedded_order == 0) {
        adaptive.integrator = "dopri5";
        adaptive.relative = adaptive.absolute = 1e-6;
        adaptive.step = 0.0;
    }
    return adaptive;
}

/* Tries that a look at a motion is worth. */
enum { STEPS_MAX = 2000000 };

kt_status kt_spectrum_along(kt_spectrum *spectrum, const kt_run *run, kt_error *error) {
    const kt_run adaptive = run_of(run);
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    options.max_steps = STEPS_MAX;
    spectrum->samples = spectrum->count = 0;
    kt_status status = kt_simulation_create(spectrum->model, &adaptive, &options, &simulation, error);
    const int last = (int)spectrum->size.samples - 1;
    for (int i = 0; status == KT_OK && i <= last; i++) {
        const double t =
            i == last && last > 0 ? run->duration : run->duration * (double)i / (double)(last > 0 ? last : 1);
        if (i > 0 && t > kt_simulation_time(simulation))
            status = kt_simulation_advance(simulation, t, error);
        if (status != KT_OK)
            break;
        status = kt_spectrum_add(spectrum, t, kt_simulation_positions(simulation), kt_simulation_velocities(simulation),
                                 NULL, error);
        if (status == KT_ERROR_SINGULAR)
            status = KT_OK;
    }
    kt_simulation_free(simulation);
    return status;
}

/* ---- what is found ----------------------------------------------------------------------------------------------- */

int kt_spectrum_samples(const kt_spectrum *spectrum) { return spectrum->samples; }
int kt_spectrum_count(const kt_spectrum *spectrum) { return spectrum->count; }
kt_spectrum_mode kt_spectrum_at(const kt_spectrum *spectrum, int mode) { return spectrum->mode[mode]; }

int kt_spectrum_fastest(const kt_spectrum *spectrum) {
    int best = -1;
    double most = -1.0;
    for (int i = 0; i < spectrum->count; i++) {
        const double size = hypot(spectrum->lambda[i].re, spectrum->lambda[i].im);
        if (size > most) {
            most = size;
            best = i;
        }
    }
    return best;
}

kt_step_limit kt_spectrum_limit(const kt_spectrum *spectrum, const kt_method *method, double duration, double step) {
    kt_step_limit limit = {HUGE_VAL, 1.0, -1};
    ptrdiff_t index = -1;
    limit.step =
        kt_stability_step(method, spectrum->lambda, (size_t)spectrum->count, duration, KT_STABILITY_GROWTH, &index);
    limit.mode = (int)index;
    if (step > 0.0)
        limit.growth = kt_stability_worst(method, spectrum->lambda, (size_t)spectrum->count, step, duration, &index);
    if (step > limit.step && index >= 0)
        limit.mode = (int)index;
    return limit;
}
