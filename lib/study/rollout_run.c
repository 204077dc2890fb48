/* Gradients of many motions by several threads, a motion each at a time. */
#include "base/require.h"
#include "kinetree/study.h"
#include "study/threads.h"

typedef struct run {
    const kt_model *model;
    kt_data *const *data;
    void *const *work;
    size_t work_size;
    kt_rollout_task *tasks;
    kt_cost *cost;
} run;

static kt_status compute(void *user, size_t thread, size_t item, kt_error *error) {
    const run *r = user;
    kt_rollout_task *task = &r->tasks[item];
    task->status =
        kt_rollout_gradient(r->model, r->data[thread], r->work[thread], r->work_size, &task->rollout, task->q, task->v,
                            &task->value, task->by_start, task->by_inputs, r->cost, task->user, error);
    return task->status;
}

kt_status kt_rollout_run(const kt_model *model, kt_data *const *data, void *const *work, size_t work_size,
                         size_t threads, kt_rollout_task *tasks, size_t count, kt_cost *cost, size_t *used,
                         kt_error *error) {
    if (KT_IS_MISSING(error, model, data, work, cost, tasks || !count))
        return KT_ERROR_ARGUMENT;
    if (threads == 0 || threads > KT_THREADS_MOST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "threads", "%zu threads cannot share the work: take 1 to %d",
                            threads, KT_THREADS_MOST);
    for (size_t i = 0; i < threads; i++)
        if (KT_IS_MISSING(error, data[i], work[i]))
            return KT_ERROR_ARGUMENT;
    run r = {.model = model, .data = data, .work = work, .work_size = work_size, .tasks = tasks, .cost = cost};
    return kt_threads_share(count, threads, compute, &r, used, error);
}
