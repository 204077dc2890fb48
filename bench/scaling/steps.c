/* Derivatives of steps of one chain, and the gradient over many, by all inputs. */
#include "interpose.h"
#include "kinetree/sensitivity.h"
#include "scaling.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { STEPS = 50, CALLS = 4 };

typedef struct steps {
    kt_chain chain;
    kt_step step;
    kt_rollout rollout;
    size_t size;
    void *work;
    double *q, *v, *A, *B, *inputs, *gradient; /* n, n, 4 n^2, 2 n^2, n x STEPS, 2 n + n x STEPS */
} steps;

/* Half |v|^2 at all points. */
static int kinetic(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const steps *s = user;
    (void)by_tau;
    for (int i = 0; i < s->chain.n; i++) {
        *value += 0.5 * at->v[i] * at->v[i];
        if (by_state)
            by_state[s->chain.n + i] = at->v[i];
    }
    return 0;
}

/* All three derivatives of forward dynamics: B needs da/dtau. */
static void run_derivatives(void *user, long repetitions) {
    steps *s = user;
    kt_chain *c = &s->chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_dynamics_forward_derivatives(c->model, c->data, c->work, c->work_size, c->q, c->v, c->tau, NULL,
                                            c->da_dq, c->da_dv, s->B, &c->error) != KT_OK)
            return;
}

static void run_matrices(void *user, long repetitions) {
    steps *s = user;
    kt_chain *c = &s->chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_step_derivatives(c->model, c->data, s->work, s->size, &s->step, c->q, c->v, s->q, s->v, s->A, s->B,
                                &c->error) != KT_OK)
            return;
}

static void run_motion(void *user, long repetitions) {
    steps *s = user;
    kt_chain *c = &s->chain;
    for (long k = 0; k < repetitions; k++)
        for (int i = 0; i < STEPS && c->error.code == KT_OK; i++)
            if (kt_step_evaluate(c->model, c->data, s->work, s->size, &s->step, i ? s->q : c->q, i ? s->v : c->v, s->q,
                                 s->v, &c->error) != KT_OK)
                return;
}

static void run_gradient(void *user, long repetitions) {
    steps *s = user;
    kt_chain *c = &s->chain;
    double value;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_rollout_gradient(c->model, c->data, s->work, s->size, &s->rollout, c->q, c->v, kinetic, s, &value,
                                s->gradient, s->gradient + 2 * c->n, &c->error) != KT_OK)
            return;
}

/* max |A'y - the adjoint's| over the largest sum of terms, y = (1, -1, 1, ...). */
static double error_of(steps *s) {
    kt_chain *c = &s->chain;
    const int rows = 2 * c->n;
    double *y = s->inputs, *by = s->gradient, worst = 0.0, most = 0.0;
    run_matrices(s, 1);
    for (int i = 0; i < rows; i++)
        y[i] = i % 2 ? -1.0 : 1.0;
    if (c->error.code != KT_OK ||
        kt_step_adjoint(c->model, c->data, s->work, s->size, &s->step, c->q, c->v, y, by, NULL, &c->error) != KT_OK)
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
    for (int i = 0; i < STEPS * c->n; i++)
        s->inputs[i] = c->tau[i % c->n];
    return worst / most;
}

static kt_status measure(steps *s, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    static const int calls[CALLS] = {KT_SCALING_FORWARD, KT_SCALING_MATRICES, KT_SCALING_MOTION, KT_SCALING_GRADIENT};
    const kt_bench_task tasks[CALLS] = {{run_derivatives, s}, {run_matrices, s}, {run_motion, s}, {run_gradient, s}};
    kt_bench_times times[CALLS];
    *line = (kt_scaling_line){.n = s->chain.n,
                              .level = kt_model_isa(s->chain.model),
                              .set_up = s->chain.set_up,
                              .model = kt_model_size(s->chain.model),
                              .data = kt_data_size(s->chain.model)};
    line->error = error_of(s);
    kt_interpose_start();
    for (int i = 0; i < CALLS; i++)
        tasks[i].run(tasks[i].user, 2);
    line->allocations = kt_interpose_stop();
    kt_bench_measure(tasks, CALLS, options->seconds, times);
    for (int i = 0; i < CALLS; i++) {
        line->measured[calls[i]] = true;
        line->times[calls[i]] = times[i];
    }
    if (s->chain.error.code != KT_OK && error)
        *error = s->chain.error;
    return s->chain.error.code;
}

kt_status kt_scaling_steps(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    const size_t v = (size_t)n;
    steps s = {.step = {.method = kt_method_find("rk4"), .h = 1e-4}};
    kt_status status = kt_chain_make(n, options->level, false, &s.chain, error);
    if (status == KT_OK)
        status = kt_chain_make_derivatives(&s.chain, error);
    double *numbers = malloc((4 * v + 6 * v * v + 2 * STEPS * v) * sizeof *numbers);
    s.rollout = (kt_rollout){.method = s.step.method, .h = s.step.h, .steps = STEPS};
    s.size = status == KT_OK ? kt_rollout_work_size(s.chain.model, &s.rollout) : 0;
    s.work = status == KT_OK ? aligned_alloc(KT_ALIGNMENT, s.size) : NULL;
    if (status == KT_OK && (!numbers || !s.work))
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the steps of %d links", n);
    if (status == KT_OK) {
        s.step.tau = s.chain.tau;
        s.q = numbers, s.v = s.q + v, s.A = s.v + v, s.B = s.A + 4 * v * v;
        s.inputs = s.B + 2 * v * v, s.gradient = s.inputs + STEPS * v;
        s.rollout.inputs = s.inputs;
        status = measure(&s, options, line, error);
    }
    free(s.work);
    free(numbers);
    kt_chain_free(&s.chain);
    return status;
}
