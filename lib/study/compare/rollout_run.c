/* Derivatives of many steps, one each at a time, and gradients of many motions, a group each, by several threads. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/require.h"
#include "compare/threads.h"
#include "kinetree/study.h"
#include "model/model.h"

/* The tasks, and the separate memory of each thread. */
typedef struct run {
    const kt_model *model;
    kt_data *const *data;
    void *const *work;
    size_t work_size;
    kt_step_task *steps;
    kt_rollout_task *motions;
    size_t count, width; /* motions, and how many of them at once */
    kt_cost *cost;
} run;

/* Without x of its own, a task starts with the auxiliary states of the step, or else with the model's. */
static kt_status differentiate_task(void *user, size_t thread, size_t item, kt_error *error) {
    const run *r = user;
    kt_step_task *task = &r->steps[item];
    kt_step step = task->step;
    if (task->x)
        step.x = task->x;
    else if (!step.x)
        step.x = r->model->v0 + r->model->n.v;
    task->status = kt_step_derivatives(r->model, r->data[thread], r->work[thread], r->work_size, &step, task->q,
                                       task->v, task->next_q, task->next_v, task->A, task->B, error);
    if (task->status == KT_OK && task->next_x)
        kt_copy(task->next_x, kt_auxiliary_states(r->model, r->data[thread]),
                (size_t)kt_auxiliary_state_count(r->model) * sizeof *task->next_x);
    return task->status;
}

/* An item is a group of up to `width` motions. */
static kt_status compute_gradients(void *user, size_t thread, size_t item, kt_error *error) {
    const run *r = user;
    const size_t first = item * r->width, left = r->count - first;
    return kt_rollout_gradients(r->model, r->data[thread], r->work[thread], r->work_size, r->motions + first,
                                left < r->width ? left : r->width, r->cost, error);
}

static kt_status check_threads(const run *r, size_t threads, kt_error *error) {
    if (threads == 0 || threads > KT_THREADS_MOST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "threads", "%zu threads cannot share the work: take 1 to %d",
                            threads, KT_THREADS_MOST);
    for (size_t i = 0; i < threads; i++) {
        const kt_data *data = r->data[i];
        const void *work = r->work[i];
        if (KT_IS_MISSING(error, data, work))
            return KT_ERROR_ARGUMENT;
        if (!kt_data_serve(r->model, data))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "data",
                                "those of thread %zu are another model's; take data that were made for this one "
                                "(kt_data_create)",
                                i);
    }
    return KT_OK;
}

kt_status kt_step_run(const kt_model *model, kt_data *const *data, void *const *work, size_t work_size, size_t threads,
                      kt_step_task *tasks, size_t count, size_t *used, kt_error *error) {
    if (KT_IS_MISSING(error, model, data, work, tasks || !count))
        return KT_ERROR_ARGUMENT;
    run r = {.model = model, .data = data, .work = work, .work_size = work_size, .steps = tasks};
    const kt_status status = check_threads(&r, threads, error);
    return status == KT_OK ? kt_threads_share(count, threads, differentiate_task, &r, used, error) : status;
}

kt_status kt_rollout_run(const kt_model *model, kt_data *const *data, void *const *work, size_t work_size,
                         size_t threads, kt_rollout_task *tasks, size_t count, kt_cost *cost, size_t *used,
                         kt_error *error) {
    if (KT_IS_MISSING(error, model, data, work, cost, tasks || !count))
        return KT_ERROR_ARGUMENT;
    run r = {.model = model,
             .data = data,
             .work = work,
             .work_size = work_size,
             .motions = tasks,
             .count = count,
             .width = 1,
             .cost = cost};
    const kt_status status = check_threads(&r, threads, error);
    if (count > 0 && work_size >= kt_rollout_gradients_work_size(model, &tasks[0].rollout))
        r.width = kt_rollout_width(model, &tasks[0].rollout, NULL);
    return status == KT_OK
               ? kt_threads_share((count + r.width - 1) / r.width, threads, compute_gradients, &r, used, error)
               : status;
}
