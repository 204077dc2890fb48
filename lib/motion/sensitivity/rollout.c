/* Gradients over many steps, from the last to the first. The adjoint of a step needs the state at its start:
 * checkpoints (revolve.c) supply this state.
 *
 * Once the step from a checkpoint has been taken, the checkpoint also has the accelerations of its stages. The adjoint
 * of this step then needs no evaluation again. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "evaluate/evaluate.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

#define KT_ROLLOUT_FIELDS(X)                                                                                           \
    X(double, state, c *N, "checkpoints: states at the start of steps")                                                \
    X(double, slope, c *s *kept, "of the slopes of the stages of the steps from these, where they have been taken")    \
    X(double, next, c *N, "states after these steps")                                                                  \
    X(uint32_t, iterations, c, "of the positions, by their projections")                                               \
    X(bool, taken, c, "whether they have been taken")                                                                  \
    X(int, index, c, "of which steps")                                                                                 \
    X(double, here, N, "a state between checkpoints")                                                                  \
    X(double, gradient, changes, "with respect to a state")                                                            \
    X(double, by_tau, n, "with respect to the input of a step")                                                        \
    X(double, inputs, steps *n, "result")                                                                              \
    X(char, step_work, kt_step_work_size(model, rollout->method), "of a step")

typedef struct rollout_work {
    const kt_model *model;
    kt_data *data;
    const kt_rollout *rollout;
    kt_cost *cost;
    void *user;
    double value;
    int reached; /* steps whose cost is in the value */
    KT_ARENA_DECLARE(KT_ROLLOUT_FIELDS)
} rollout_work;

KT_ARENA_ARRAYS(place_arrays, rollout_work, KT_ROLLOUT_FIELDS, const kt_model *model, const kt_rollout *rollout,
                size_t N, size_t n, size_t changes, size_t kept, size_t s, size_t c, size_t steps)

static size_t lay_out_rollout(rollout_work *w, void *memory, const kt_model *model, const kt_rollout *rollout) {
    return place_arrays(w, memory, model, rollout, kt_state_numbers(model), model->n.v, kt_tangent_numbers(model),
                        kt_step_kept(model, rollout->method), kt_step_stages_of(rollout->method),
                        (size_t)kt_checkpoints_of(rollout), (size_t)rollout->steps);
}

size_t kt_rollout_work_size(const kt_model *model, const kt_rollout *rollout) {
    if (!model || !rollout || !rollout->method)
        return 0;
    return rollout->steps > 0 && rollout->checkpoints >= 0 && kt_step_work_size(model, rollout->method) > 0
               ? lay_out_rollout(NULL, NULL, model, rollout)
               : 0;
}

/* ---- steps and costs --------------------------------------------------------------------------------------------- */

static kt_step rollout_step_at(const rollout_work *w, int k, const double *state) {
    const kt_rollout *r = w->rollout;
    return (kt_step){.method = r->method,
                     .t = r->t + k * r->h,
                     .h = r->h,
                     .tau = r->inputs ? r->inputs + (size_t)k * w->model->n.v : NULL,
                     .unprojected = r->unprojected,
                     .x = state + w->model->n.q + w->model->n.v};
}

kt_cost_point kt_rollout_point(const kt_model *model, const kt_rollout *r, int k, const double *y) {
    return (kt_cost_point){.step = k,
                           .t = r->t + k * r->h,
                           .q = y,
                           .v = y + model->n.q,
                           .x = kt_has_auxiliary_states(model) ? y + model->n.q + model->n.v : NULL,
                           .tau = r->inputs && k < r->steps ? r->inputs + (size_t)k * model->n.v : NULL};
}

static kt_status call_rollout_cost(rollout_work *w, int k, const double *state, double *value, double *by_state,
                                   double *by_tau, kt_error *error) {
    const kt_cost_point at = kt_rollout_point(w->model, w->rollout, k, state);
    *value = 0.0;
    const int result = w->cost(&at, value, by_state, by_tau, w->user);
    if (result != 0)
        return kt_error_set(error, KT_ERROR_CALLBACK, "cost", "the caller's cost of step %d returned %d", k, result);
    return isfinite(*value)
               ? KT_OK
               : kt_error_set(error, KT_ERROR_NOT_FINITE, "cost", "the caller's cost of step %d is %g", k, *value);
}

/* Advances from the state at the start of step k to the start of step k + 1, in place. Adds the cost of step k at the
 * first pass. */
static kt_status advance_rollout(void *user, int k, int checkpoint, double *state, kt_error *error) {
    rollout_work *w = user;
    const size_t nq = w->model->n.q, N = kt_state_numbers(w->model), at = checkpoint < 0 ? 0 : (size_t)checkpoint;
    const kt_step step = rollout_step_at(w, k, state);
    kt_step_work s;
    kt_status status = KT_OK;
    if (k == w->reached) {
        double value;
        status = call_rollout_cost(w, k, state, &value, NULL, NULL, error);
        w->value += value;
        w->reached += status == KT_OK;
    }
    if (status == KT_OK)
        status =
            kt_step_begin(&s, w->model, w->data, w->step_work, kt_step_work_size(w->model, step.method), &step, error);
    if (status == KT_OK)
        status = kt_adjoint_run(&s, state, state + nq, error);
    if (status != KT_OK)
        return status;
    if (checkpoint >= 0)
        kt_adjoint_save(&s, w->slope + at * s.stages * kt_step_kept(w->model, step.method), w->next + at * N,
                        &w->iterations[at]);
    memcpy(state, s.next, N * sizeof *state);
    return KT_OK;
}

/* Turns the gradient with respect to the state after step k into the gradient before the step, including the cost of
 * step k. */
static kt_status reverse_rollout(void *user, int k, int checkpoint, const double *state, kt_error *error) {
    rollout_work *w = user;
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, changes = kt_tangent_numbers(model), N = kt_state_numbers(model);
    const size_t at = checkpoint < 0 ? 0 : (size_t)checkpoint;
    const kt_step step = rollout_step_at(w, k, state);
    double value;
    kt_step_work s;
    kt_status status =
        kt_step_begin(&s, model, w->data, w->step_work, kt_step_work_size(model, step.method), &step, error);
    if (status == KT_OK && checkpoint >= 0)
        status = kt_adjoint_recall(&s, state, state + nq, w->slope + at * s.stages * kt_step_kept(model, step.method),
                                   w->next + at * N, w->iterations[at], error);
    else if (status == KT_OK)
        status = kt_adjoint_run(&s, state, state + nq, error);
    if (status == KT_OK && k == w->rollout->steps - 1) {
        status = call_rollout_cost(w, k + 1, s.next, &value, w->gradient, NULL, error);
        w->value += value;
    }
    if (status != KT_OK)
        return status;
    memcpy(s.by_next, w->gradient, changes * sizeof *w->gradient);
    status = kt_adjoint_sweep(&s, error);
    if (status != KT_OK)
        return status;
    memset(w->gradient, 0, changes * sizeof *w->gradient);
    memset(w->by_tau, 0, n * sizeof *w->by_tau);
    status = call_rollout_cost(w, k, state, &value, w->gradient, w->by_tau, error);
    for (size_t i = 0; i < changes; i++)
        w->gradient[i] += s.by_next[i];
    for (size_t i = 0; i < n; i++)
        w->inputs[(size_t)k * n + i] = w->by_tau[i] + s.by_force[i];
    w->value += k == w->reached ? value : 0.0;
    return status;
}

/* ---- the public function ----------------------------------------------------------------------------------------- */

kt_status kt_rollout_gradient(const kt_model *model, kt_data *data, void *work, size_t work_size,
                              const kt_rollout *rollout, const double *q, const double *v, double *value,
                              double *by_start, double *by_inputs, kt_cost *cost, void *user, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, rollout, q || !model->n.q, value, cost))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    const size_t nq = model->n.q, n = model->n.v, changes = kt_tangent_numbers(model);
    rollout_work w = {.model = model, .data = data, .rollout = rollout, .cost = cost, .user = user};
    if (rollout->steps <= 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "rollout", "there are %d steps", rollout->steps);
    if (rollout->checkpoints < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "rollout", "there are %d checkpoints; 0 keeps all steps",
                            rollout->checkpoints);
    if (kt_step_work_size(model, rollout->method) == 0) { /* kt_step_begin sets the error */
        const kt_step step = {.method = rollout->method, .h = rollout->h};
        kt_step_work s;
        return kt_step_begin(&s, model, data, NULL, 0, &step, error);
    }
    kt_status status =
        kt_arena_check("work", "kt_rollout_work_size", work, work_size, kt_rollout_work_size(model, rollout), error);
    if (status != KT_OK)
        return status;
    (void)lay_out_rollout(&w, work, model, rollout);
    kt_copy(w.state, q, nq * sizeof *q);
    memcpy(w.state + nq, v, n * sizeof *v);
    if (kt_has_auxiliary_states(model))
        kt_copy(w.state + nq + n, rollout->x ? rollout->x : data->x, model->n.x * sizeof *v);
    memset(w.gradient, 0, changes * sizeof *w.gradient);
    kt_revolve checkpoints = kt_revolve_of(rollout, kt_state_numbers(model), w.state, w.here, w.index, w.taken);
    status = kt_revolve_run(&checkpoints, advance_rollout, reverse_rollout, &w, error);
    if (status != KT_OK)
        return status;
    *value = w.value;
    if (by_start)
        memcpy(by_start, w.gradient, changes * sizeof *by_start);
    if (by_inputs)
        memcpy(by_inputs, w.inputs, (size_t)rollout->steps * n * sizeof *by_inputs);
    return KT_OK;
}
