/* Derivatives of many steps, and gradients of many motions, by several threads, one each at a time. */
#include "base/copy.h"
#include "base/require.h"
#include "kinetree/study.h"
#include "model/model.h"
#include "study/threads.h"

/* What is computed, and what threads have of their own. */
typedef struct run {
    const kt_model *model;
    kt_data *const *data;
    void *const *work;
    size_t work_size;
    kt_step_task *steps;
    kt_rollout_task *motions;
    kt_cost *cost;
} run;

static kt_status differentiate(void *user, size_t thread, size_t item, kt_error *error) {
    const run *r = user;
    kt_step_task *task = &r->steps[item];
    const size_t count = (size_t)kt_own_state_count(r->model) * sizeof *task->x;
    double *x = kt_own_states(r->model, r->data[thread]);
    if (task->x)
        kt_copy(x, task->x, count);
    else
        kt_own_states_initial(r->model, x);
    task->status = kt_step_derivatives(r->model, r->data[thread], r->work[thread], r->work_size, &task->step, task->q,
                                       task->v, task->next_q, task->next_v, task->A, task->B, error);
    if (task->status == KT_OK && task->next_x)
        kt_copy(task->next_x, x, count);
    return task->status;
}

static kt_status compute_gradient(void *user, size_t thread, size_t item, kt_error *error) {
    const run *r = user;
    kt_rollout_task *task = &r->motions[item];
    task->status =
        kt_rollout_gradient(r->model, r->data[thread], r->work[thread], r->work_size, &task->rollout, task->q, task->v,
                            &task->value, task->by_start, task->by_inputs, r->cost, task->user, error);
    return task->status;
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
    return status == KT_OK ? kt_threads_share(count, threads, differentiate, &r, used, error) : status;
}

kt_status kt_rollout_run(const kt_model *model, kt_data *const *data, void *const *work, size_t work_size,
                         size_t threads, kt_rollout_task *tasks, size_t count, kt_cost *cost, size_t *used,
                         kt_error *error) {
    if (KT_IS_MISSING(error, model, data, work, cost, tasks || !count))
        return KT_ERROR_ARGUMENT;
    run r = {.model = model, .data = data, .work = work, .work_size = work_size, .motions = tasks, .cost = cost};
    const kt_status status = check_threads(&r, threads, error);
    return status == KT_OK ? kt_threads_share(count, threads, compute_gradient, &r, used, error) : status;
}
