/* Computes a job for all states of a batch, or for the states of a block. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "batch/batch.h"

#include <string.h>

/* Copies the results of the lanes that have been computed, n numbers each. */
static void commit_lanes(const kt_batch_work *w, const kt_batch_group *group, double *all) {
    const size_t width = w->batch->n.width, nv = w->batch->n.nv;
    double *to = all + group->first * nv;
    if (group->active == kt_lanes_first(width)) {
        kt_copy(to, w->result, width * nv * sizeof *to);
        return;
    }
    for (size_t lane = 0; lane < width; lane++)
        for (size_t i = 0; i < nv && kt_lane_is_in(group->active, lane); i++)
            to[i * width + lane] = w->result[i * width + lane];
}

/* ---- jobs -------------------------------------------------------------------------------------------------------- */

/* Computes the task of a job for one group of states. */
static void compute_group(kt_batch_work *w, const kt_batch_job *job, size_t number, kt_batch_fault *fault) {
    kt_batch *batch = w->batch;
    kt_batch_group group = kt_batch_group_of(w, number);
    memset(batch->status + group.first, KT_OK, group.used);
    switch (job->task) {
    case KT_BATCH_FORWARD:
        kt_batch_accelerate(w, &group, batch->t + group.first, fault);
        commit_lanes(w, &group, batch->a);
        break;
    case KT_BATCH_INVERSE:
        kt_batch_invert(w, &group, fault);
        commit_lanes(w, &group, batch->tau);
        break;
    case KT_BATCH_SENSE:
        kt_batch_sense_group(w, &group, job->sensors, fault);
        break;
    case KT_BATCH_STEP:
    case KT_BATCH_SEMI_IMPLICIT_STEP:
        kt_batch_advance(w, &group, job, fault);
        break;
    }
}

static kt_status check_job(const kt_batch *batch, const kt_batch_job *job, kt_error *error) {
    if ((unsigned)job->task > KT_BATCH_SENSE)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "job.task", "there is no task %d", (int)job->task);
    if (job->task == KT_BATCH_FORWARD || job->task == KT_BATCH_INVERSE)
        return KT_OK;
    if (job->task == KT_BATCH_SENSE)
        return kt_batch_check_sensors(batch, job->sensors, error);
    return kt_batch_check_step(batch, job, error);
}

size_t kt_batch_thread_count(const kt_batch *batch) { return batch ? batch->n.threads : 0; }

size_t kt_batch_block_count(const kt_batch *batch) { return batch ? batch->n.groups : 0; }

kt_status kt_batch_compute_block(kt_batch *batch, size_t thread, size_t block, const kt_batch_job *job,
                                 kt_error *error) {
    if (KT_IS_MISSING(error, batch, job))
        return KT_ERROR_ARGUMENT;
    if (thread >= batch->n.threads)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "thread", "there is no thread %lu: the batch was made for %lu",
                            (unsigned long)thread, (unsigned long)batch->n.threads);
    if (block >= batch->n.groups)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "block", "there is no block %lu: the batch has %lu",
                            (unsigned long)block, (unsigned long)batch->n.groups);
    kt_batch_fault fault = {KT_OK, 0, error};
    const kt_status status = check_job(batch, job, error);
    if (status != KT_OK)
        return status;
    compute_group(kt_batch_work_of(batch, thread), job, block, &fault);
    return fault.status;
}

kt_status kt_batch_compute(kt_batch *batch, const kt_batch_job *job, kt_error *error) {
    if (KT_IS_MISSING(error, batch, job))
        return KT_ERROR_ARGUMENT;
    kt_batch_fault fault = {KT_OK, 0, error};
    const kt_status status = check_job(batch, job, error);
    if (status != KT_OK)
        return status;
    for (size_t g = 0; g < batch->n.groups; g++)
        compute_group(kt_batch_work_of(batch, 0), job, g, &fault);
    return fault.status;
}

kt_status kt_batch_forward(kt_batch *batch, kt_error *error) {
    return kt_batch_compute(batch, &(kt_batch_job){.task = KT_BATCH_FORWARD}, error);
}

kt_status kt_batch_inverse(kt_batch *batch, kt_error *error) {
    return kt_batch_compute(batch, &(kt_batch_job){.task = KT_BATCH_INVERSE}, error);
}

kt_status kt_batch_step(kt_batch *batch, double h, int steps, kt_error *error) {
    return kt_batch_compute(batch, &(kt_batch_job){.task = KT_BATCH_STEP, .h = h, .steps = steps}, error);
}

kt_status kt_batch_step_semi_implicit(kt_batch *batch, double h, int steps, kt_error *error) {
    return kt_batch_compute(batch, &(kt_batch_job){.task = KT_BATCH_SEMI_IMPLICIT_STEP, .h = h, .steps = steps}, error);
}

kt_status kt_batch_sense(kt_batch *batch, const kt_batch_sensors *sensors, kt_error *error) {
    return kt_batch_compute(batch, &(kt_batch_job){.task = KT_BATCH_SENSE, .sensors = sensors}, error);
}
