/* The family of Adams methods, predictor and corrector: explicit, of fixed steps.
 *
 *     predict    y  = y0 + h sum_{j=1..n} p_j f_{1-j}            Adams-Bashforth
 *     evaluate   f  = f(t1, y)
 *     correct    y1 = y0 + h (b_0 f + sum_{j=1..n} b_j f_{1-j})  Adams-Moulton
 *     evaluate   f_1 = f(t1, y1), with which the next step begins
 *
 * The last evaluation is at the state after the projection, so that slopes of the past are those of states on the
 * manifold. Past slopes are those of equal steps.
 *
 * There may be fewer than n - 1 past slopes: at the start, after a jump, and after a step of another length. (A step
 * that ends at a given time has another length.) Then the Runge-Kutta method of the table computes the step. This
 * method has the same order, so that the error is that of a single step.
 *
 * Source: E. Hairer, S. P. Norsett, G. Wanner, Solving ODE I, section III.1; [MSD 5.6.1].
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/multistep.h"

#include <string.h>

/* The history: the number of past slopes, the step between them, and the slopes, the latest first. */
enum { HISTORY_COUNT, HISTORY_STEP, HISTORY_SLOPES };

/* The slot of f(t1, y) of the prediction. */
enum { SLOT_START, SLOT_PREDICTED };

static int past_count_of(const kt_method *m) { return m->steps - 1; }

static void measure_adams(const kt_method *method, kt_integrator_sizes *sizes) {
    kt_explicit_measure(method, sizes);
    sizes->history = HISTORY_SLOPES + (size_t)past_count_of(method) * sizes->n;
}

static void forget_past(kt_integrator *it) { memset(it->history, 0, it->sizes.history * sizeof(double)); }

/* With smooth inputs, past slopes, which used the inputs of their own time, remain slopes of the motion. */
static void adams_change(kt_integrator *it, bool smooth) {
    if (!smooth)
        forget_past(it);
}

/* The state with these weights of f (0: none), f_0 and the past slopes. */
static void advance_weighted(kt_integrator *it, const kt_interval *in, const double *weights) {
    double *k[KT_METHOD_STEPS_MAX + 1] = {it->k[SLOT_PREDICTED], it->k[SLOT_START]};
    kt_stage_term terms[KT_METHOD_STEPS_MAX + 1];
    for (int j = 2; j <= it->method->steps; j++)
        k[j] = it->history + HISTORY_SLOPES + (size_t)(j - 2) * it->sizes.n;
    const size_t count = kt_stage_terms(weights, (size_t)it->method->steps + 1, terms);
    kt_combine(it->trial, in->y, in->h, terms, count, k, it->sizes.n);
}

/* PECE: predict with past slopes, evaluate f at the prediction, correct. Without enough past slopes at the distance h,
 * a Runge-Kutta step. */
static kt_try_result adams_try(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const double *history = it->history;
    if ((int)history[HISTORY_COUNT] < past_count_of(it->method) || !kt_is_same_step(in->h, history[HISTORY_STEP]))
        return kt_explicit_step(it, in, result);
    const kt_multistep w = kt_multistep_of(it->method);
    advance_weighted(it, in, w.predictor);
    if (kt_evaluate(it, in->end, it->trial, SLOT_PREDICTED, result) != KT_TRY_PASSED)
        return result->result;
    advance_weighted(it, in, w.slopes);
    return KT_TRY_PASSED;
}

/* Shifts the past slopes by one step. A step of another length begins a new past. */
static void adams_accept(kt_integrator *it) {
    const size_t n = it->sizes.n;
    double *history = it->history, *slopes = history + HISTORY_SLOPES;
    const size_t room = (size_t)past_count_of(it->method);
    const size_t count =
        kt_is_same_step(it->memory.last_step, history[HISTORY_STEP]) ? (size_t)history[HISTORY_COUNT] : 0;
    if (count == 0)
        history[HISTORY_STEP] = it->memory.last_step;
    memmove(slopes + n, slopes, (room - 1) * n * sizeof *slopes);
    memcpy(slopes, it->k[SLOT_START], n * sizeof *slopes);
    history[HISTORY_COUNT] = (double)(count < room ? count + 1 : room);
}

static const kt_history_word adams_words[] = {
    {"past slopes", KT_HISTORY_START, HISTORY_COUNT, 0.0, KT_METHOD_STEPS_MAX}, {.name = NULL}};

const kt_method_family kt_family_adams = {
    .name = "adams",
    .check_sizes = kt_multistep_check_sizes,
    .check_order = kt_multistep_check_order,
    .measure = measure_adams,
    .init = kt_explicit_init,
    .words = adams_words,
    .start = forget_past,
    .change = adams_change,
    .try_step = adams_try,
    .error = kt_no_error,
    .error_at = kt_no_error_at,
    .accept = adams_accept,
    .interpolate = kt_table_interpolate,
    .stability = kt_multistep_stability,
    .value = kt_multistep_value,
    .gain = kt_multistep_gain,
    .real_limit = kt_multistep_real_limit,
    .imaginary_limit = kt_multistep_imaginary_limit,
};
