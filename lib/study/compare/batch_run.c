/* A batch by several threads, each of which takes the next block (kt_batch_compute_block). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "compare/threads.h"
#include "kinetree/study.h"

typedef struct run {
    kt_batch *batch;
    const kt_batch_job *job;
} run;

static kt_status compute_block(void *user, size_t thread, size_t block, kt_error *error) {
    const run *r = user;
    return kt_batch_compute_block(r->batch, thread, block, r->job, error);
}

kt_status kt_batch_run(kt_batch *batch, const kt_batch_job *job, size_t threads, size_t *used, kt_error *error) {
    if (KT_IS_MISSING(error, batch, job))
        return KT_ERROR_ARGUMENT;
    const size_t most = kt_batch_thread_count(batch);
    if (threads == 0 || threads > most || threads > KT_THREADS_MOST)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "threads",
            "%zu threads cannot share the work: the batch was made for %zu (options.threads; at most %d)", threads,
            most, KT_THREADS_MOST);
    run r = {.batch = batch, .job = job};
    return kt_threads_share(kt_batch_block_count(batch), threads, compute_block, &r, used, error);
}
