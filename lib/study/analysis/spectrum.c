/* The modes of a mechanism at states along its motion, and the largest steps that they allow.
 *
 * In a run of an explicit method with a fixed step h each step multiplies a mode by R(h lambda). R is the method's
 * stability polynomial [MSD 5.45]. The modes change along the motion; the fastest of all states bounds the step. Each
 * mode is treated as if it persisted for the whole run. A mode must not grow by more than KT_STABILITY_GROWTH times its
 * true growth over the run (kt_stability_growth).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"
#include "base/arena.h"
#include "base/copy.h"
#include "base/require.h"
#include "kinetree/algebra.h"
#include "kinetree/analysis.h"
#include "model/switching.h"
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

typedef struct kt_spectrum_sizes {
    size_t nq, nv, samples, modes, shapes, linearization, system_modes;
} kt_spectrum_sizes;

/* Every array: type, name, count, meaning. */
#define KT_SPECTRUM_FIELDS(X)                                                                                          \
    X(kt_spectrum_mode, mode, s->modes, "by time, and then by falling |lambda|")                                       \
    X(kt_complex, lambda, s->modes, "the same as plain numbers")                                                       \
    X(double, shape, s->shapes * s->nv, "of the fastest of each state")                                                \
    X(double, position, s->samples * s->nq, "q of each state")                                                         \
    X(char, linearization_memory, s->linearization, "of a state")                                                      \
    X(char, modes_memory, s->system_modes, "of a state")

struct kt_spectrum {
    void *owned; /* memory of kt_spectrum_create, or NULL */
    const kt_model *model;
    kt_linearization *linearization;
    kt_modes *modes;
    kt_spectrum_sizes size;
    int samples, count;
    KT_ARENA_DECLARE(KT_SPECTRUM_FIELDS)
};

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* |shape| over the units, scaled so that the largest is 1; returns false if all are zero. */
static bool measure_moves(const double *shape, const double *unit, size_t nv, double *moves) {
    double most = 0.0;
    for (size_t i = 0; i < nv; i++) {
        moves[i] = kt_hypot(shape[2 * i], shape[2 * i + 1]) / unit[i];
        most = fmax(most, moves[i]);
    }
    for (size_t i = 0; i < nv; i++)
        moves[i] = most > 0.0 ? moves[i] / most : 0.0;
    return most > 0.0;
}

/* The error of a linear system at which friction jumps: slip begins, or turns round. */
static const double uncertain = 1e-2;

/* Whether hard contacts slip in the model. */
static bool has_slip(const kt_model *model) { return model->n.slip > 0; }

/* Adds the modes of a state, using a linearisation of the model at this state. */
static kt_status add_state(kt_spectrum *spectrum, kt_linearization *linearization, double t, const double *q,
                           const double *v, const double *tau, kt_error *error) {
    const size_t nv = spectrum->size.nv;
    if ((size_t)spectrum->samples >= spectrum->size.samples)
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "there is room for %lu states",
                            (unsigned long)spectrum->size.samples);
    kt_status status = kt_linearization_evaluate(linearization, t, q, v, tau, error);
    if (status != KT_OK)
        return status;
    const kt_linear_system *system = kt_linearization_system(linearization);
    if (has_slip(linearization->model) && !(system->error <= uncertain))
        return kt_error_set(error, KT_ERROR_SINGULAR, NULL, "a hard contact begins to slip, where its friction jumps");
    status = kt_modes_evaluate(spectrum->modes, system, error);
    if (status != KT_OK)
        return status;
    const int count = kt_modes_count(spectrum->modes);
    for (int i = 0; i < count; i++) {
        const int from = count - 1 - i, to = spectrum->count + i; /* they are ordered by increasing |lambda| */
        double *moves = spectrum->shape + ((size_t)spectrum->samples * KT_SPECTRUM_SHAPES + (size_t)i) * nv;
        const kt_mode mode = kt_modes_at(spectrum->modes, from);
        const bool is_kept = i < KT_SPECTRUM_SHAPES;
        if (is_kept && !measure_moves(kt_modes_positions(spectrum->modes, from), system->unit, nv, moves))
            (void)measure_moves(kt_modes_velocities(spectrum->modes, from), system->unit, nv, moves);
        spectrum->mode[to] = (kt_spectrum_mode){t, mode, is_kept ? moves : NULL};
        spectrum->lambda[to] = (kt_complex){mode.real, mode.imaginary};
    }
    memcpy(spectrum->position + (size_t)spectrum->samples * spectrum->size.nq, q, spectrum->size.nq * sizeof *q);
    spectrum->count += count;
    spectrum->samples++;
    return KT_OK;
}

kt_status kt_spectrum_add(kt_spectrum *spectrum, double t, const double *q, const double *v, const double *tau,
                          kt_error *error) {
    return KT_IS_MISSING(error, spectrum) ? KT_ERROR_ARGUMENT
                                          : add_state(spectrum, spectrum->linearization, t, q, v, tau, error);
}

/* The run whose states are analysed: never with the fixed step, which may be the one in doubt. */
static kt_run run_of(const kt_run *run) {
    kt_run adaptive = *run;
    const kt_method *named = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    adaptive.record = KT_RECORD_POSITION;
    adaptive.marker_count = 0;
    if (run->step > 0.0 || (run->integrator != NULL && (named == NULL || !kt_method_is_adaptive(named)))) {
        adaptive.integrator = NULL;
        adaptive.relative = adaptive.absolute = 1e-6;
        adaptive.step = 0.0;
    }
    return adaptive;
}

/* Options without inputs and outputs. */
static kt_linearization_options nothing_besides(void) {
    static const int input = 0;
    static const kt_marker_index output = {0, 0};
    const kt_linearization_options options = {.inputs = &input, .outputs = &output};
    return options;
}

/* Adds the present state of a simulation. Closed contacts and sticking friction are constraints of the motion. */
static kt_status add_present_state(kt_spectrum *spectrum, kt_simulation *simulation, double t, kt_error *error) {
    const kt_model *model = kt_simulation_resting_model(simulation);
    kt_linearization_options options = nothing_besides();
    options.differences = has_slip(model); /* friction of hard contacts that slip has no exact derivatives */
    const bool is_own = model == spectrum->model || model->variants != spectrum->model->variants;
    kt_linearization *linearization = is_own ? spectrum->linearization : NULL;
    kt_status status = is_own ? KT_OK : kt_linearization_create(model, &options, &linearization, error);
    if (status != KT_OK)
        return status;
    const bool follows = linearization->follows;
    linearization->follows = true;
    kt_copy(kt_linearization_auxiliary_states(linearization), kt_simulation_auxiliary_states(simulation),
            (size_t)kt_auxiliary_state_count(spectrum->model) * sizeof(double));
    status = add_state(spectrum, linearization, t, kt_simulation_positions(simulation),
                       kt_simulation_velocities(simulation), NULL, error);
    linearization->follows = follows;
    if (!is_own)
        kt_linearization_free(linearization);
    return status;
}

/* The largest number of tried steps for the motion. */
enum { STEPS_MAX = 2000000 };

kt_status kt_spectrum_along(kt_spectrum *spectrum, const kt_run *run, kt_error *error) {
    if (KT_IS_MISSING(error, spectrum, run))
        return KT_ERROR_ARGUMENT;
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
        status = add_present_state(spectrum, simulation, t, error);
        if (status == KT_ERROR_SINGULAR)
            status = KT_OK;
    }
    kt_simulation_free(simulation);
    return status;
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

int kt_spectrum_samples(const kt_spectrum *spectrum) { return spectrum ? spectrum->samples : 0; }
const double *kt_spectrum_positions(const kt_spectrum *spectrum, int sample) {
    return spectrum && KT_IS_INDEX(sample, spectrum->samples) ? spectrum->position + (size_t)sample * spectrum->size.nq
                                                              : NULL;
}
int kt_spectrum_count(const kt_spectrum *spectrum) { return spectrum ? spectrum->count : 0; }
kt_spectrum_mode kt_spectrum_at(const kt_spectrum *spectrum, int mode) {
    if (!spectrum || !KT_IS_INDEX(mode, spectrum->count))
        return (kt_spectrum_mode){.t = (double)NAN};
    return spectrum->mode[mode];
}

int kt_spectrum_fastest(const kt_spectrum *spectrum) {
    if (!spectrum)
        return -1;
    int best = -1;
    double most = -1.0;
    for (int i = 0; i < spectrum->count; i++) {
        const double size = kt_hypot(spectrum->lambda[i].re, spectrum->lambda[i].im);
        if (size > most) {
            most = size;
            best = i;
        }
    }
    return best;
}

kt_step_limit kt_spectrum_limit(const kt_spectrum *spectrum, const kt_method *method, double duration, double step) {
    if (!spectrum || !method)
        return (kt_step_limit){(double)NAN, (double)NAN, -1};
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

/* ---- samples a period -------------------------------------------------------------------------------------------- */

#define EXCITED 0.03 /* of the velocities of the most excited oscillation: a thousandth of its energy */

/* The relative error that steps of a method make in the period of lambda. radius: largest |lambda|, which sets the
 * number of stages of stabilised methods. */
static double period_error(const kt_method *method, double radius, kt_complex lambda, double step) {
    kt_stability stability;
    if (kt_stability_make(method, kt_stability_stages(method, step * radius), &stability, NULL) != KT_OK)
        return HUGE_VAL; /* the method does not have enough stages */
    return kt_stability_period_error(&stability, lambda, step);
}

/* The largest step that is accurate enough, by bisection of the logarithm of the step. */
static double step_enough(const kt_method *method, double radius, kt_complex lambda, double step) {
    double low = 1e-6 * step, high = step;
    for (int i = 0; i < 40; i++) {
        const double middle = sqrt(low * high);
        if (period_error(method, radius, lambda, middle) <= KT_SAMPLING_ERROR)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static bool oscillates(const kt_mode *mode) {
    return mode->imaginary > 0.0 && mode->error < 0.01 * mode->imaginary && fabs(mode->damping) < 0.7;
}

/* The largest excitation of an oscillation of the same state. A steady motion is not an oscillation: the nutation of a
 * rotor does not follow from its spin. */
static double most_excited(const kt_spectrum *spectrum, double time) {
    double most = 0.0;
    for (int i = 0; i < spectrum->count; i++)
        if (spectrum->mode[i].t == time && oscillates(&spectrum->mode[i].mode))
            most = fmax(most, spectrum->mode[i].mode.excitation);
    return most;
}

static bool is_excited_oscillation(const kt_spectrum *spectrum, int i) {
    const kt_mode *mode = &spectrum->mode[i].mode;
    return oscillates(mode) && mode->excitation > 0.0 &&
           mode->excitation >= EXCITED * most_excited(spectrum, spectrum->mode[i].t);
}

kt_sampling kt_spectrum_sampling(const kt_spectrum *spectrum, const kt_method *method, double step) {
    if (!spectrum || !method)
        return (kt_sampling){.mode = -1};
    kt_sampling sampling = {-1, HUGE_VAL, 0.0, HUGE_VAL};
    const int fastest = kt_spectrum_fastest(spectrum);
    if (fastest < 0)
        return sampling;
    const double radius = kt_hypot(spectrum->lambda[fastest].re, spectrum->lambda[fastest].im);
    for (int i = 0; i < spectrum->count; i++) {
        const double samples = 2.0 * acos(-1.0) / (step * spectrum->lambda[i].im);
        if (!is_excited_oscillation(spectrum, i) || !(samples < sampling.samples))
            continue;
        const double error = period_error(method, radius, spectrum->lambda[i], step);
        if (error > KT_SAMPLING_ERROR)
            sampling = (kt_sampling){i, samples, error, 0.0};
    }
    if (sampling.mode >= 0)
        sampling.step = step_enough(method, radius, spectrum->lambda[sampling.mode], step);
    return sampling;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_spectrum, KT_SPECTRUM_FIELDS, const kt_spectrum_sizes *s)

static kt_spectrum_sizes measure_spectrum(const kt_model *model, int samples) {
    const kt_linearization_options options = nothing_besides();
    kt_spectrum_sizes s = {.nq = (size_t)kt_model_nq(model),
                           .nv = (size_t)kt_model_nv(model),
                           .samples = samples > 0 ? (size_t)samples : 0};
    s.modes = (2 * s.nv + (size_t)kt_auxiliary_state_count(model)) * s.samples;
    s.shapes = KT_SPECTRUM_SHAPES * s.samples;
    s.linearization = kt_linearization_size(model, &options);
    s.system_modes = kt_modes_size(model);
    return s;
}

size_t kt_spectrum_size(const kt_model *model, int samples) {
    if (!model)
        return 0;
    const kt_spectrum_sizes sizes = measure_spectrum(model, samples);
    return sizes.samples > 0 ? lay_out(NULL, &sizes) : 0;
}

kt_status kt_spectrum_init(const kt_model *model, int samples, void *memory, size_t size, kt_spectrum **spectrum,
                           kt_error *error) {
    if (KT_IS_MISSING(error, model, spectrum))
        return KT_ERROR_ARGUMENT;
    const kt_spectrum_sizes sizes = measure_spectrum(model, samples);
    const kt_linearization_options options = nothing_besides();
    if (sizes.samples == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "samples", "%d: at least one state is needed", samples);
    kt_status status =
        kt_arena_begin("kt_spectrum_init", "kt_spectrum_size", memory, size, lay_out(NULL, &sizes), error);
    if (status != KT_OK)
        return status;
    kt_spectrum *made = memory;
    (void)lay_out(memory, &sizes);
    made->size = sizes;
    made->model = model;
    status = kt_linearization_init(model, &options, made->linearization_memory, sizes.linearization,
                                   &made->linearization, error);
    if (status == KT_OK) /* GCOVR_EXCL_BR_LINE: its memory has the layout that it requires */
        status = kt_modes_init(model, made->modes_memory, sizes.system_modes, &made->modes, error);
    if (status == KT_OK) /* GCOVR_EXCL_BR_LINE: and this */
        *spectrum = made;
    return status;
}

kt_status kt_spectrum_create(const kt_model *model, int samples, kt_spectrum **spectrum, kt_error *error) {
    if (KT_IS_MISSING(error, model, spectrum))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_spectrum_size(model, samples);
    void *memory = kt_arena_allocate(size, "a spectrum", error);
    return memory == NULL ? KT_ERROR_MEMORY
                          : kt_arena_own(memory, kt_spectrum_init(model, samples, memory, size, spectrum, error));
}

void kt_spectrum_free(kt_spectrum *spectrum) { kt_arena_free(spectrum); }
