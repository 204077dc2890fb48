/* An integrator in the caller's memory: layout, options, start, checkpoints. */
#include "integrator/integrator.h"

#include <math.h>
#include <string.h>

/* ---- layout ------------------------------------------------------------------------------------------------------ */

/* Arrays begin on cache lines. Slopes lie one line more than that apart, so that the same component of all of them
 * does not fall into one set of the cache where n is a power of two. */
enum { LINE = 64, LINE_DOUBLES = 8 };

static size_t round_up(size_t bytes) { return (bytes + (LINE - 1)) / LINE * LINE; }

static kt_integrator_sizes measure(const kt_method *method, size_t n) {
    const size_t s = (size_t)method->stages, w = (size_t)kt_method_fresh(method) + 1, d = (size_t)method->dense_stages;
    kt_integrator_sizes sizes;
    sizes.n = n;
    sizes.stride = (n + LINE_DOUBLES - 1) / LINE_DOUBLES * LINE_DOUBLES + LINE_DOUBLES;
    sizes.slots = w + d;
    sizes.rows = s + KT_ROW_DENSE + d;
    sizes.terms = s * (s - 1) / 2 + KT_ROW_DENSE * s + d * w + d * (d - 1) / 2 + 1;
    sizes.moved = method->stabilised ? 2 * n : 0;
    sizes.krylov = method->stabilised ? (KT_RADIUS_VECTORS + 1) * n : 0;
    return sizes;
}

/* Places the arrays behind the struct, or only measures if there is none; returns the bytes of all. */
static size_t lay_out(kt_integrator *it, const kt_integrator_sizes *s) {
    size_t at = round_up(sizeof *it);
#define KT_INTEGRATOR_PLACE(type, name, count, kind, meaning)                                                          \
    if (it != NULL)                                                                                                    \
        it->name = (type *)(void *)((unsigned char *)it + at);                                                         \
    at += round_up((count) * sizeof(type));
    KT_INTEGRATOR_FIELDS(KT_INTEGRATOR_PLACE)
#undef KT_INTEGRATOR_PLACE
    return at;
}

size_t kt_integrator_size(const kt_method *method, size_t n) {
    const size_t most =
        SIZE_MAX / (sizeof(double) * 2 * (KT_METHOD_STAGES_MAX + 8)); /* about twice what there can be */
    if (n < 1 || n > most || kt_method_check_sizes(method, NULL) != KT_OK)
        return 0;
    const kt_integrator_sizes sizes = measure(method, n);
    return lay_out(NULL, &sizes) + LINE - 1; /* the memory may begin anywhere */
}

void kt_integrator_poison(kt_integrator *it, unsigned char byte) {
    const kt_integrator_sizes *s = &it->sizes;
#define KT_POISON_KEPT(name, bytes) (void)(it->name)
#define KT_POISON_SCRATCH(name, bytes) memset(it->name, byte, bytes)
#define KT_INTEGRATOR_POISON(type, name, count, kind, meaning) KT_POISON_##kind(name, (count) * sizeof(type));
    KT_INTEGRATOR_FIELDS(KT_INTEGRATOR_POISON)
#undef KT_INTEGRATOR_POISON
#undef KT_POISON_SCRATCH
#undef KT_POISON_KEPT
    it->stages_known = false;
    it->dense_known = false;
    it->derivative_slot = -1;
}

/* ---- the compiled table ------------------------------------------------------------------------------------------ */

/* Appends a row of `count` weights; zeros drop out. */
static void compile_row(kt_integrator *it, size_t row, const double *weights, size_t count) {
    size_t at = it->row[row];
    for (size_t j = 0; weights != NULL && j < count; j++)
        if (weights[j] != 0.0) {
            it->terms[at].weight = weights[j];
            it->terms[at].slot = j;
            at++;
        }
    it->row[row + 1] = at;
}

static void compile(kt_integrator *it) {
    const kt_method *m = it->method;
    const size_t s = (size_t)m->stages;
    it->row[0] = 0;
    for (size_t i = 0; i < s; i++)
        compile_row(it, i, m->a + i * (i - (i > 0)) / 2, i);
    compile_row(it, s + KT_ROW_B, m->b, s);
    compile_row(it, s + KT_ROW_E, m->e, s);
    compile_row(it, s + KT_ROW_E_LOW, m->e_low, s);
    size_t row_start = 0;
    for (size_t r = 0; r < (size_t)m->dense_stages; r++) {
        compile_row(it, s + KT_ROW_DENSE + r, m->dense_a + row_start, it->fresh + 1 + r);
        row_start += it->fresh + 1 + r;
    }
}

/* ---- options ----------------------------------------------------------------------------------------------------- */

kt_integrator_options kt_integrator_options_default(void) {
    const kt_integrator_options options = {
        .relative_tolerance = 1e-6,
        .absolute_tolerance = 1e-9,
        .safety = 0.9,
        .alpha = 0.85,
        .beta = 0.2,
        .factor_min = 0.2,
        .factor_max = 10.0,
    };
    return options;
}

static kt_status refuse(kt_error *error, const char *where, const char *message) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, where, "%s", message);
}

static bool not_negative(double x) { return isfinite(x) && x >= 0.0; }

static kt_status check_tolerances(const kt_integrator_options *o, size_t n, kt_error *error) {
    if (!not_negative(o->relative_tolerance) || !not_negative(o->absolute_tolerance))
        return refuse(error, "options", "tolerances must be finite and not negative");
    if (o->relative_tolerance > 0.0 && o->relative_tolerance < KT_TOLERANCE_LEAST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options",
                            "the relative tolerance %g is below the rounding of numbers, which no step can undercut; "
                            "take %.2g or more, or 0 for the absolute one alone",
                            o->relative_tolerance, KT_TOLERANCE_LEAST);
    for (size_t i = 0; o->absolute_tolerances != NULL && i < n; i++)
        if (!not_negative(o->absolute_tolerances[i]) ||
            (o->absolute_tolerances[i] == 0.0 && o->relative_tolerance == 0.0))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "options",
                                "absolute_tolerances[%zu] is %g; it must be finite and "
                                "not negative, and above 0 where the relative tolerance is 0",
                                i, o->absolute_tolerances[i]);
    if (o->absolute_tolerances == NULL && o->absolute_tolerance == 0.0 && o->relative_tolerance == 0.0)
        return refuse(error, "options", "one of the tolerances must be above 0");
    return KT_OK;
}

static kt_status check_adaptive(const kt_integrator_options *o, const kt_method *method, size_t n, kt_error *error) {
    if (method->e == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options",
                            "method '%s' has no error estimate: give a step, or take one "
                            "that has (heun, rkc2, bs32, rkc4, dopri5, tsit5, dop853)",
                            method->name == NULL ? "" : method->name);
    if (!not_negative(o->initial_step) || !not_negative(o->min_step) || !not_negative(o->max_step))
        return refuse(error, "options",
                      "initial_step, min_step and max_step must be finite and not negative; 0 leaves them open");
    if (o->max_step > 0.0 && o->max_step < o->min_step)
        return refuse(error, "options", "max_step must not be below min_step");
    if (!(o->safety > 0.0 && o->safety < 1.0))
        return refuse(error, "options", "safety must be between 0 and 1, 0.9 say");
    if (!(o->alpha > 0.0 && o->alpha <= 2.0) || !(o->beta >= 0.0 && o->beta <= o->alpha))
        return refuse(error, "options", "the control needs 0 < alpha <= 2 and 0 <= beta <= alpha");
    if (!(o->factor_min > 0.0 && o->factor_min < 1.0) || !(o->factor_max > 1.0 && isfinite(o->factor_max)))
        return refuse(error, "options", "the control needs 0 < factor_min < 1 < factor_max");
    return check_tolerances(o, n, error);
}

/* ---- place and start --------------------------------------------------------------------------------------------- */

kt_status kt_integrator_init(void *memory, size_t size, const kt_method *method, size_t n,
                             const kt_integrator_options *options, kt_integrator **integrator, kt_error *error) {
    if (options == NULL || integrator == NULL)
        return refuse(error, "kt_integrator_init", "options and the integrator to be set must be given");
    kt_status status = kt_method_check_sizes(method, error);
    if (status == KT_OK && !kt_method_is_built_in(method))
        status = method->stabilised ? refuse(error, "method", "a stabilised method must be a built-in one: rkc2, rkc4")
                                    : kt_method_check(method, error);
    if (status != KT_OK)
        return status;
    const size_t needed = kt_integrator_size(method, n);
    if (needed == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_init",
                            "%zu equations: there must be at least one, and not "
                            "more than the memory's addresses can hold",
                            n);
    if (!not_negative(options->step))
        return refuse(error, "options", "step must be above 0, or 0 for adaptive steps");
    if (options->quadratures >= n)
        return refuse(error, "options", "quadratures must be fewer than the equations");
    if (options->step == 0.0 && (status = check_adaptive(options, method, n, error)) != KT_OK)
        return status;
    if (memory == NULL || size < needed)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_integrator_init",
                            "%zu bytes were given, kt_integrator_size asks for %zu", memory == NULL ? 0 : size, needed);

    kt_integrator *it = (kt_integrator *)(void *)((unsigned char *)memory + (LINE - (uintptr_t)memory % LINE) % LINE);
    memset(it, 0, sizeof *it);
    it->method = method;
    it->options = *options;
    it->sizes = measure(method, n);
    it->counted = n - options->quadratures;
    it->fresh = (size_t)kt_method_fresh(method);
    it->derivative_slot = -1;
    it->gives_end_derivative =
        method->fsal && !(method->stabilised && options->step > 0.0); /* which has no use for it */
    it->error_order = method->embedded_order_low > 0
                          ? 2 * method->embedded_order - method->embedded_order_low + 1
                          : 1 + (method->embedded_order < method->order ? method->embedded_order : method->order);
    lay_out(it, &it->sizes);
    for (size_t slot = 0; slot < it->sizes.slots; slot++)
        it->k[slot] = it->slopes + slot * it->sizes.stride;
    compile(it);
    *integrator = it;
    return KT_OK;
}

static kt_status check_state(const kt_integrator *it, double t, const double *y, kt_error *error) {
    if (y == NULL)
        return refuse(error, "state", "no state is given");
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "state", "the time %g is not finite", t);
    const size_t bad = kt_first_not_finite(y, it->sizes.n);
    if (bad < it->sizes.n)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "state", "y[%zu] = %g is not finite", bad, y[bad]);
    return KT_OK;
}

static void set_state(kt_integrator *it, const double *y) {
    memmove(it->y, y, it->sizes.n * sizeof *y);
    it->stages_known = false;
    it->dense_known = false;
    it->derivative_slot = -1;
}

kt_status kt_integrator_start(kt_integrator *it, double t, const double *y, const kt_integrator_callbacks *callbacks,
                              kt_error *error) {
    if (callbacks == NULL || callbacks->rhs == NULL)
        return refuse(error, "kt_integrator_start", "a right-hand side must be given");
    kt_status status = check_state(it, t, y, error);
    if (status != KT_OK)
        return status;
    it->callbacks = *callbacks;
    const kt_integrator_memory fresh = {
        .t = t,
        .previous_t = t,
        .origin = t,
        .next_step = it->options.initial_step,
        .last_error = (double)NAN,
        .control_error = KT_CONTROL_ERROR_FLOOR,
        .radius = -1.0,
        .on_grid = true,
    };
    it->memory = fresh;
    set_state(it, y);
    it->started = true;
    return KT_OK;
}

kt_status kt_integrator_jump(kt_integrator *it, const double *y, kt_error *error) {
    if (!it->started)
        return refuse(error, "kt_integrator_jump", "call kt_integrator_start first");
    kt_status status = check_state(it, it->memory.t, y, error);
    if (status != KT_OK)
        return status;
    it->memory.previous_t = it->memory.t;
    it->memory.last_step = 0.0;
    it->memory.last_error = (double)NAN;
    it->memory.control_error = KT_CONTROL_ERROR_FLOOR;
    it->memory.radius = -1.0;
    it->memory.has_previous = false;
    set_state(it, y);
    return KT_OK;
}

/* ---- checkpoints and looks --------------------------------------------------------------------------------------- */

void kt_integrator_save(const kt_integrator *it, kt_integrator_memory *memory, double *y, double *previous_y) {
    *memory = it->memory;
    memcpy(y, it->y, it->sizes.n * sizeof *y);
    if (previous_y != NULL)
        memcpy(previous_y, it->memory.has_previous ? it->previous_y : it->y, it->sizes.n * sizeof *y);
}

kt_status kt_integrator_restore(kt_integrator *it, const kt_integrator_memory *memory, const double *y,
                                const double *previous_y, const kt_integrator_callbacks *callbacks, kt_error *error) {
    if (memory == NULL || callbacks == NULL || callbacks->rhs == NULL)
        return refuse(error, "kt_integrator_restore", "the memory and a right-hand side must be given");
    kt_status status = check_state(it, memory->t, y, error);
    if (status != KT_OK)
        return status;
    const size_t n = it->sizes.n;
    if (previous_y != NULL && kt_first_not_finite(previous_y, n) < n)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "state", "the previous state is not finite");
    if (!isfinite(memory->previous_t) || !isfinite(memory->origin) || !isfinite(memory->last_step) ||
        !not_negative(memory->next_step) || !(memory->control_error > 0.0 && isfinite(memory->control_error)) ||
        !isfinite(memory->radius))
        return refuse(error, "kt_integrator_restore",
                      "the memory is damaged: a time, step or error in it is out of range");
    it->callbacks = *callbacks;
    it->memory = *memory;
    set_state(it, y);
    it->memory.has_previous = memory->has_previous && previous_y != NULL;
    if (it->memory.has_previous)
        memmove(it->previous_y, previous_y, n * sizeof *y);
    it->started = true;
    return KT_OK;
}

double kt_integrator_time(const kt_integrator *it) { return it->memory.t; }
const double *kt_integrator_state(const kt_integrator *it) { return it->y; }
double kt_integrator_previous_time(const kt_integrator *it) { return it->memory.previous_t; }
size_t kt_integrator_dimension(const kt_integrator *it) { return it->sizes.n; }
const kt_method *kt_integrator_method(const kt_integrator *it) { return it->method; }
kt_integrator_counts kt_integrator_counts_get(const kt_integrator *it) { return it->memory.counts; }
const kt_integrator_memory *kt_integrator_memory_get(const kt_integrator *it) { return &it->memory; }
