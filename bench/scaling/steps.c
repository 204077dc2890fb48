/* Derivatives of steps of one chain or one row of windows, and the gradient over many, by all inputs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bars.h"
#include "interpose.h"
#include "kinetree/sensitivity.h"
#include "scaling.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 50, CALLS = 4 };

typedef struct steps {
    int n; /* coordinates */
    const kt_model *model;
    kt_data *data;
    const double *start_q, *start_v, *tau; /* n, n, n */
    kt_step step;
    kt_rollout rollout;
    size_t size, derived_size;
    void *work, *derived;                      /* of a rollout, and of the derivatives */
    double *q, *v, *A, *B, *inputs, *gradient; /* n; n; 4 n^2; 2 n^2; n x STEPS; 2 n + n x STEPS */
    kt_error error;
} steps;

/* Half |v|^2 at all points. */
static int kinetic(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const steps *s = user;
    (void)by_tau;
    for (int i = 0; i < s->n; i++) {
        *value += 0.5 * at->v[i] * at->v[i];
        if (by_state)
            by_state[s->n + i] = at->v[i];
    }
    return 0;
}

/* All three derivatives of the accelerations: B needs da/dtau. */
static void run_derivatives(void *user, long repetitions) {
    steps *s = user;
    double *by_q = s->A, *by_v = by_q + s->n * s->n;
    for (long k = 0; k < repetitions && s->error.code == KT_OK; k++)
        if (kt_acceleration_derivatives(s->model, s->data, s->derived, s->derived_size, 0.0, s->start_q, s->start_v,
                                        s->tau, NULL, by_q, by_v, s->B, &s->error) != KT_OK)
            return;
}

/* Without loops and effects. */
static void run_tree_derivatives(void *user, long repetitions) {
    steps *s = user;
    double *by_q = s->A, *by_v = by_q + s->n * s->n;
    for (long k = 0; k < repetitions && s->error.code == KT_OK; k++)
        if (kt_dynamics_forward_derivatives(s->model, s->data, s->derived, s->derived_size, s->start_q, s->start_v,
                                            s->tau, NULL, by_q, by_v, s->B, &s->error) != KT_OK)
            return;
}

static void run_matrices(void *user, long repetitions) {
    steps *s = user;
    for (long k = 0; k < repetitions && s->error.code == KT_OK; k++)
        if (kt_step_derivatives(s->model, s->data, s->work, s->size, &s->step, s->start_q, s->start_v, s->q, s->v, s->A,
                                s->B, &s->error) != KT_OK)
            return;
}

static void run_motion(void *user, long repetitions) {
    steps *s = user;
    for (long k = 0; k < repetitions; k++)
        for (int i = 0; i < STEPS && s->error.code == KT_OK; i++)
            if (kt_step_evaluate(s->model, s->data, s->work, s->size, &s->step, i ? s->q : s->start_q,
                                 i ? s->v : s->start_v, s->q, s->v, &s->error) != KT_OK)
                return;
}

static void run_gradient(void *user, long repetitions) {
    steps *s = user;
    double value;
    for (long k = 0; k < repetitions && s->error.code == KT_OK; k++)
        if (kt_rollout_gradient(s->model, s->data, s->work, s->size, &s->rollout, s->start_q, s->start_v, &value,
                                s->gradient, s->gradient + 2 * s->n, kinetic, s, &s->error) != KT_OK)
            return;
}

/* max |A'y - the adjoint's| over the largest sum of terms, with y of entries 1 and -1 in turn. */
static double error_of(steps *s) {
    const int rows = 2 * s->n;
    double *y = s->inputs, *by = s->gradient, worst = 0.0, most = 0.0;
    run_matrices(s, 1);
    for (int i = 0; i < rows; i++)
        y[i] = i % 2 ? -1.0 : 1.0;
    if (s->error.code != KT_OK || kt_step_adjoint(s->model, s->data, s->work, s->size, &s->step, s->start_q, s->start_v,
                                                  y, by, NULL, &s->error) != KT_OK)
        return (double)NAN;
    for (int j = 0; j < rows; j++) {
        double sum = -by[j], size = fabs(sum);
        for (int i = 0; i < rows; i++) {
            sum += s->A[rows * j + i] * y[i];
            size += fabs(s->A[rows * j + i]);
        }
        worst = isfinite(sum) ? fmax(worst, fabs(sum)) : (double)INFINITY;
        most = fmax(most, size);
    }
    for (int i = 0; i < STEPS * s->n; i++)
        s->inputs[i] = s->tau[i % s->n];
    return worst / most;
}

static kt_status time_all(steps *s, bool closed, const kt_bench_options *options, kt_scaling_line *line,
                          kt_error *error) {
    static const int calls[2][CALLS] = {
        {KT_SCALING_FORWARD, KT_SCALING_MATRICES, KT_SCALING_MOTION, KT_SCALING_GRADIENT},
        {KT_SCALING_CLOSED_FORWARD, KT_SCALING_CLOSED_MATRICES, KT_SCALING_CLOSED_MOTION, KT_SCALING_CLOSED_GRADIENT}};
    const kt_bench_task tasks[CALLS] = {
        {closed ? run_derivatives : run_tree_derivatives, s}, {run_matrices, s}, {run_motion, s}, {run_gradient, s}};
    kt_bench_times times[CALLS];
    line->n = s->n;
    line->isa = kt_model_isa(s->model);
    line->model = kt_model_size(s->model);
    line->data = kt_data_size(s->model);
    line->error = error_of(s);
    kt_interpose_start();
    for (int i = 0; i < CALLS; i++)
        tasks[i].run(tasks[i].user, 2);
    line->allocations = kt_interpose_stop();
    kt_bench_measure(tasks, CALLS, options->seconds, times);
    for (int i = 0; i < CALLS; i++) {
        line->measured[calls[closed][i]] = true;
        line->times[calls[closed][i]] = times[i];
    }
    if (s->error.code != KT_OK && error)
        *error = s->error;
    return s->error.code;
}

/* Steps of 1e-4 s from the state and under the torques that s has. */
static kt_status measure(steps *s, bool closed, const kt_bench_options *options, kt_scaling_line *line,
                         kt_error *error) {
    const size_t v = (size_t)s->n;
    const kt_method *method = kt_method_find("rk4");
    kt_status status = KT_OK;
    s->step = (kt_step){.method = method, .h = 1e-4, .tau = s->tau};
    s->rollout = (kt_rollout){.method = method, .h = s->step.h, .steps = STEPS};
    s->size = kt_rollout_work_size(s->model, &s->rollout);
    s->derived_size = closed ? kt_acceleration_work_size(s->model) : kt_dynamics_work_size(s->model);
    s->work = aligned_alloc(KT_ALIGNMENT, s->size);
    s->derived = aligned_alloc(KT_ALIGNMENT, s->derived_size);
    double *numbers = malloc((4 * v + 6 * v * v + 2 * STEPS * v) * sizeof *numbers);
    if (numbers && s->work && s->derived) {
        s->q = numbers, s->v = s->q + v, s->A = s->v + v, s->B = s->A + 4 * v * v;
        s->inputs = s->B + 2 * v * v, s->gradient = s->inputs + STEPS * v;
        s->rollout.inputs = s->inputs;
        status = time_all(s, closed, options, line, error);
    } else {
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the steps of %d links", s->n);
    }
    free(s->derived);
    free(s->work);
    free(numbers);
    return status;
}

kt_status kt_scaling_steps(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    kt_chain chain;
    kt_status status = kt_chain_make(n, options->isa, false, &chain, error);
    *line = (kt_scaling_line){.set_up = chain.set_up};
    if (status == KT_OK) {
        steps s = {
            .n = n, .model = chain.model, .data = chain.data, .start_q = chain.q, .start_v = chain.v, .tau = chain.tau};
        status = measure(&s, false, options, line, error);
    }
    kt_chain_free(&chain);
    return status;
}

kt_status kt_scaling_closed_steps(int loops, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    kt_bars bars;
    kt_model_options chosen = kt_model_options_default();
    chosen.isa = options->isa;
    kt_status status = kt_bars_make(KT_BARS_CHAINED, loops, false, KT_FORMULATION_TREE, &chosen, &bars, error);
    *line = (kt_scaling_line){.set_up = bars.set_up};
    if (status == KT_OK) {
        steps s = {.n = kt_model_nv(bars.stepped),
                   .model = bars.stepped,
                   .data = bars.data,
                   .start_q = bars.q,
                   .start_v = bars.v,
                   .tau = bars.a};
        memset(bars.a, 0, (size_t)s.n * sizeof *bars.a);
        status = measure(&s, true, options, line, error);
    }
    kt_bars_free(&bars);
    return status;
}
