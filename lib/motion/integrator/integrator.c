/* An integrator in the caller's memory: layout, options, start, dense output, checkpoints, queries. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "base/options.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- layout ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_integrator, KT_INTEGRATOR_FIELDS, const kt_integrator_sizes *s)

/* The slopes are padded by one cache line beyond whole lines. Otherwise, if n is a power of two, the same component of
 * all slopes would fall into one set of the cache. */
static kt_integrator_sizes measure_integrator(const kt_method *method, size_t n, bool owns_matrices) {
    const size_t line = KT_ARENA_ALIGNMENT / sizeof(double);
    kt_integrator_sizes sizes = {.n = n, .stride = (n + line - 1) / line * line + line, .owns_matrices = owns_matrices};
    kt_method_family_of(method)->measure(method, &sizes);
    return sizes;
}

/* Bytes of an integrator, 0 if there is none of this size. The memory may begin at any address; the integrator begins
 * at the first cache line in it. owns_matrices: it solves Newton's equations with its own n x n matrices. */
static size_t integrator_bytes(const kt_method *method, size_t n, bool owns_matrices) {
    const size_t most =
        SIZE_MAX / (sizeof(double) * 2 * (KT_METHOD_STAGES_MAX + 8)); /* twice the largest number of arrays */
    if (n < 1 || n > most || kt_method_check_sizes(method, NULL) != KT_OK)
        return 0;
    if (kt_method_needs_newton(method) && owns_matrices && n > most / n)
        return 0;
    const kt_integrator_sizes sizes = measure_integrator(method, n, owns_matrices);
    return lay_out(NULL, &sizes) + KT_ARENA_ALIGNMENT - 1;
}

size_t kt_integrator_size(const kt_method *method, size_t n) { return method ? integrator_bytes(method, n, true) : 0; }

size_t kt_integrator_size_with(const kt_method *method, size_t n, const kt_integrator_options *options) {
    return integrator_bytes(method, n, options->newton == NULL);
}

void kt_integrator_poison(kt_integrator *it, unsigned char byte) {
    kt_integrator *object = it;
    const kt_integrator_sizes *s = &it->sizes;
    KT_INTEGRATOR_SCRATCH(KT_ARENA_POISON)
    it->stages_known = false;
    it->dense_known = false;
    it->jacobian_known = it->factors_known = false;
    it->derivative_slot = -1;
}

/* ---- options ----------------------------------------------------------------------------------------------------- */

static kt_status reject_argument(kt_error *error, const char *where, const char *message) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, where, "%s", message);
}

static kt_status check_component_tolerances(const kt_integrator_options *o, size_t n, kt_error *error) {
    if (!kt_is_not_negative(o->relative_tolerance) || !kt_is_not_negative(o->absolute_tolerance))
        return reject_argument(error, "options",
                               "relative_tolerance, absolute_tolerance: tolerances must be finite and not negative");
    if (o->relative_tolerance > 0.0 && o->relative_tolerance < KT_TOLERANCE_LEAST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options",
                            "the relative tolerance %g is below the rounding of numbers; give %.2g or more, or 0 to "
                            "use the absolute tolerance alone",
                            o->relative_tolerance, 1.04 * KT_TOLERANCE_LEAST); /* two digits, rounded up */
    for (size_t i = 0; o->absolute_tolerances != NULL && i < n; i++)
        if (!kt_is_not_negative(o->absolute_tolerances[i]) ||
            (o->absolute_tolerances[i] == 0.0 && o->relative_tolerance == 0.0))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "options",
                                "absolute_tolerances[%lu] is %g; it must be finite and "
                                "not negative, and above 0 where the relative tolerance is 0",
                                (unsigned long)i, o->absolute_tolerances[i]);
    if (o->absolute_tolerances == NULL && o->absolute_tolerance == 0.0 && o->relative_tolerance == 0.0)
        return reject_argument(error, "options", "one of the tolerances must be above 0");
    return KT_OK;
}

static kt_status check_adaptive(const kt_integrator_options *o, const kt_method *method, size_t n, kt_error *error) {
    if (!kt_method_is_adaptive(method)) {
        char names[256];
        (void)kt_method_names(true, names, sizeof names);
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "options",
            "method '%s' has no error estimate; give a step, or use a method with an error estimate (%s)",
            method->name == NULL ? "" : method->name, names);
    }
    if (!kt_is_not_negative(o->initial_step) || !kt_is_not_negative(o->min_step) || !kt_is_not_negative(o->max_step))
        return reject_argument(
            error, "options",
            "initial_step, min_step and max_step must be finite and not negative; 0 leaves them open");
    if (o->max_step > 0.0 && o->max_step < o->min_step)
        return reject_argument(error, "options", "max_step must not be below min_step");
    if (!(o->safety > 0.0 && o->safety < 1.0))
        return reject_argument(error, "options", "safety must be between 0 and 1, such as 0.9");
    if (!(o->alpha > 0.0 && o->alpha <= 2.0) || !(o->beta >= 0.0 && o->beta <= o->alpha))
        return reject_argument(error, "options", "the control needs 0 < alpha <= 2 and 0 <= beta <= alpha");
    if (!(o->factor_min > 0.0 && o->factor_min < 1.0) || !(o->factor_max > 1.0 && isfinite(o->factor_max)))
        return reject_argument(error, "options", "the control needs 0 < factor_min < 1 < factor_max");
    return check_component_tolerances(o, n, error);
}

/* ---- initialise and start ---------------------------------------------------------------------------------------- */

static kt_status check_own(const kt_method *method, kt_error *error) {
    if (!kt_method_family_of(method)->open)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "method",
                            "'%s': a %s method must be a built-in one (kt_method_find); a table of your own is that of "
                            "an explicit method: leave `family` NULL",
                            method->name == NULL ? "" : method->name, kt_method_family_name(method));
    return kt_method_check(method, error);
}

kt_status kt_integrator_init(void *memory, size_t size, const kt_method *method, size_t n,
                             const kt_integrator_options *given, kt_integrator **integrator, kt_error *error) {
    const kt_integrator_options *options = given;
    if (KT_IS_MISSING(error, method, options, integrator))
        return KT_ERROR_ARGUMENT;
    kt_integrator_options own = kt_integrator_options_default();
    options = KT_OPTIONS(kt_integrator_options, newton, &own, given, error);
    if (options == NULL)
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_method_check_sizes(method, error);
    if (status == KT_OK && !kt_method_is_built_in(method))
        status = check_own(method, error);
    if (status != KT_OK)
        return status;
    const size_t needed = kt_integrator_size_with(method, n, options);
    if (needed == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_init",
                            "there are %lu equations; give one or more, as many as fit into memory", (unsigned long)n);
    if (!kt_is_not_negative(options->step))
        return reject_argument(error, "options", "step must be above 0, or 0 for adaptive steps");
    if (options->quadratures >= n || options->positions > n)
        return reject_argument(error, "options", "quadratures must be fewer than the equations, positions no more");
    if (options->newton != NULL &&
        (options->newton->jacobian == NULL || options->newton->factor == NULL || options->newton->solve == NULL))
        return reject_argument(error, "options", "newton needs all of jacobian, factor and solve");
    if (options->step == 0.0 && (status = check_adaptive(options, method, n, error)) != KT_OK)
        return status;
    if (memory == NULL || size < needed)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_integrator_init",
                            "%lu bytes were given, kt_integrator_size needs %lu",
                            memory == NULL ? 0 : (unsigned long)size, (unsigned long)needed);

    kt_integrator *it =
        (kt_integrator *)(void *)((unsigned char *)memory +
                                  (KT_ARENA_ALIGNMENT - (uintptr_t)memory % KT_ARENA_ALIGNMENT) % KT_ARENA_ALIGNMENT);
    memset(it, 0, sizeof *it);
    it->method = method;
    it->family = kt_method_family_of(method);
    it->table = method;
    it->options = *options;
    it->sizes = measure_integrator(method, n, options->newton == NULL);
    it->counted = n - options->quadratures;
    it->derivative_slot = -1;
    it->error_order = kt_method_error_order(method);
    (void)lay_out(it, &it->sizes);
    for (size_t slot = 0; slot < it->sizes.slots; slot++)
        it->k[slot] = it->slopes + slot * it->sizes.stride;
    it->family->init(it);
    *integrator = it;
    return KT_OK;
}

static kt_status check_given_state(const kt_integrator *it, double t, const double *y, kt_error *error) {
    if (y == NULL)
        return reject_argument(error, "state", "no state is given");
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "state", "the time %g is not finite", t);
    const size_t bad = kt_first_not_finite(y, it->sizes.n);
    if (bad < it->sizes.n)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "state", "y[%lu] = %g is not finite", (unsigned long)bad,
                            y[bad]);
    return KT_OK;
}

/* Sets the state. Slopes, stages and matrices in memory do not belong to it. */
static void set_integrator_state(kt_integrator *it, const double *y) {
    memmove(it->y, y, it->sizes.n * sizeof *y);
    it->stages_known = false;
    it->dense_known = false;
    it->jacobian_known = it->factors_known = false;
    it->derivative_slot = -1;
}

static void forget_history(kt_integrator *it) {
    if (it->family->start != NULL)
        it->family->start(it);
}

kt_status kt_integrator_start(kt_integrator *it, double t, const double *y, const kt_integrator_callbacks *callbacks,
                              kt_error *error) {
    if (KT_IS_MISSING(error, it))
        return KT_ERROR_ARGUMENT;
    if (callbacks == NULL || callbacks->rhs == NULL)
        return reject_argument(error, "kt_integrator_start", "a right-hand side must be given");
    kt_status status = check_given_state(it, t, y, error);
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
        .on_grid = true,
    };
    it->memory = fresh;
    forget_history(it);
    set_integrator_state(it, y);
    it->started = true;
    return KT_OK;
}

/* Forgets the last step, and the memory of the step control. */
static void forget_step(kt_integrator *it) {
    it->memory.previous_t = it->memory.t;
    it->memory.last_step = 0.0;
    it->memory.last_error = (double)NAN;
    it->memory.control_error = KT_CONTROL_ERROR_FLOOR;
    it->memory.has_previous = false;
}

kt_status kt_integrator_jump(kt_integrator *it, const double *y, kt_error *error) {
    if (KT_IS_MISSING(error, it))
        return KT_ERROR_ARGUMENT;
    if (!it->started)
        return reject_argument(error, "kt_integrator_jump", "call kt_integrator_start first");
    kt_status status = check_given_state(it, it->memory.t, y, error);
    if (status != KT_OK)
        return status;
    forget_step(it);
    forget_history(it);
    set_integrator_state(it, y);
    return KT_OK;
}

void kt_integrator_change(kt_integrator *it, bool smooth) {
    forget_step(it);
    if (it->family->change != NULL)
        it->family->change(it, smooth);
    else
        forget_history(it);
    set_integrator_state(it, it->y);
}

/* Finds the position of the present time in the grid of fixed steps. */
static void find_grid(kt_integrator *it) {
    kt_integrator_memory *m = &it->memory;
    const double h = it->options.step, k = (m->t - m->origin) / h, near = nearbyint(k);
    m->on_grid = fabs(m->origin + near * h - m->t) <= 8.0 * DBL_EPSILON * fmax(fabs(m->origin), fabs(m->t));
    m->grid = (int64_t)(m->on_grid ? near : floor(k));
}

void kt_integrator_limit_call(kt_integrator *it, uint64_t tries) {
    it->tries_in_call = tries;
    it->call_began = it->memory.t;
    it->tries_end = tries > 0 ? it->memory.counts.steps + it->memory.counts.rejected + tries : 0;
    it->used_up = false;
}

void kt_integrator_retreat(kt_integrator *it, double step) {
    assert(it->started && step >= 0.0);
    kt_integrator_memory *m = &it->memory;
    if (!m->has_previous)
        return;
    if (it->leap != NULL)
        it->leap->retreat(it->callbacks.user);
    m->advanced = fmax(0.0, m->advanced - fabs(m->last_step));
    m->t = m->previous_t;
    m->next_step = step;
    forget_step(it);
    m->counts.steps--;
    m->counts.rejected++;
    if (it->options.step > 0.0)
        find_grid(it);
    forget_history(it);
    set_integrator_state(it, it->previous_y);
}

/* ---- within the last step ---------------------------------------------------------------------------------------- */

kt_status kt_integrator_derivative(kt_integrator *it, const double **slope, kt_error *error) {
    if (KT_IS_MISSING(error, it, slope))
        return KT_ERROR_ARGUMENT;
    kt_try r;
    if (!it->started)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_derivative", "call kt_integrator_start first");
    if (it->derivative_slot < 0) { /* not in a slot of the last step's stages, which its dense output may need */
        if (kt_evaluate(it, it->memory.t, it->y, it->fresh, &r) != KT_TRY_PASSED)
            return kt_try_report(it, &r, "the motion cannot continue from this state: check the model here", error);
        it->derivative_slot = (int)it->fresh;
    }
    *slope = it->k[it->derivative_slot];
    return KT_OK;
}

static kt_status reject_time(const kt_integrator *it, double t, kt_error *error) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_interpolate",
                        "t = %.17g is outside of the last step, from %.17g to %.17g", t, it->memory.previous_t,
                        it->memory.t);
}

kt_status kt_integrator_interpolate(kt_integrator *it, double t, double *y_out, kt_error *error) {
    if (KT_IS_MISSING(error, it, y_out))
        return KT_ERROR_ARGUMENT;
    if (!it->started)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_interpolate", "call kt_integrator_start first");
    const double t0 = it->memory.previous_t, t1 = it->memory.t;
    const size_t n = it->sizes.n;
    const bool inside = t0 < t1 ? t0 <= t && t <= t1 : t1 <= t && t <= t0;
    if (!inside || (t != t1 && !it->memory.has_previous))
        return reject_time(it, t, error);
    if (t == t1 || t == t0) {
        memcpy(y_out, t == t1 ? it->y : it->previous_y, n * sizeof *y_out);
        return KT_OK;
    }

    kt_try r;
    if (it->family->interpolate(it, t, y_out, &r) != KT_TRY_PASSED)
        return kt_try_report(it, &r, "the step was accepted; request the state at its end only", error);
    return KT_OK;
}

/* ---- checkpoints and queries ------------------------------------------------------------------------------------- */

size_t kt_integrator_history_size(const kt_integrator *it) { return it ? it->sizes.history : 0; }

void kt_integrator_save(const kt_integrator *it, kt_integrator_memory *memory, double *y, double *previous_y,
                        double *history) {
    if (!it || !memory || !y || (!history && it->sizes.history > 0))
        return;
    *memory = it->memory;
    memcpy(y, it->y, it->sizes.n * sizeof *y);
    for (size_t i = 0; i < it->sizes.history; i++)
        history[i] = it->history[i];
    if (previous_y != NULL)
        memcpy(previous_y, it->memory.has_previous ? it->previous_y : it->y, it->sizes.n * sizeof *y);
}

kt_status kt_integrator_restore(kt_integrator *it, const kt_integrator_memory *memory, const double *y,
                                const double *previous_y, const double *history,
                                const kt_integrator_callbacks *callbacks, kt_error *error) {
    if (KT_IS_MISSING(error, it, history || !it->sizes.history))
        return KT_ERROR_ARGUMENT;
    if (memory == NULL || callbacks == NULL || callbacks->rhs == NULL)
        return reject_argument(error, "kt_integrator_restore", "the memory and a right-hand side must be given");
    kt_status status = check_given_state(it, memory->t, y, error);
    if (status != KT_OK)
        return status;
    const size_t n = it->sizes.n;
    if (previous_y != NULL && kt_first_not_finite(previous_y, n) < n)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "state", "the previous state is not finite");
    status = kt_integrator_check_memory(it, memory, history, error);
    if (status != KT_OK)
        return status;
    it->callbacks = *callbacks;
    it->memory = *memory;
    for (size_t i = 0; i < it->sizes.history; i++)
        it->history[i] = history[i];
    if (it->family->restore != NULL)
        it->family->restore(it);
    set_integrator_state(it, y);
    it->memory.has_previous = memory->has_previous && previous_y != NULL;
    if (it->memory.has_previous)
        memmove(it->previous_y, previous_y, n * sizeof *y);
    it->started = true;
    return KT_OK;
}

const double *kt_integrator_known_derivative(const kt_integrator *it) {
    return it->derivative_slot >= 0 ? it->k[it->derivative_slot] : NULL;
}

const double *kt_integrator_previous_state(const kt_integrator *it) {
    return it->memory.has_previous ? it->previous_y : it->y;
}

double kt_integrator_time(const kt_integrator *it) { return it ? it->memory.t : (double)NAN; }
const double *kt_integrator_state(const kt_integrator *it) { return it ? it->y : NULL; }
double kt_integrator_previous_time(const kt_integrator *it) { return it ? it->memory.previous_t : (double)NAN; }
size_t kt_integrator_dimension(const kt_integrator *it) { return it ? it->sizes.n : 0; }
const kt_method *kt_integrator_method(const kt_integrator *it) { return it ? it->method : NULL; }
kt_integrator_counts kt_integrator_counts_of(const kt_integrator *it) {
    return it ? it->memory.counts : (kt_integrator_counts){.steps = 0};
}
const kt_integrator_memory *kt_integrator_memory_of(const kt_integrator *it) { return it ? &it->memory : NULL; }
