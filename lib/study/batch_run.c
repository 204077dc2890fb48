/* A batch by several threads: each takes the next block that nobody has, until there are none. Which thread computes a
 * block does not matter to its numbers (kt_batch_compute_block). */
#include "base/require.h"
#include "kinetree/study.h"

#include <pthread.h>
#include <stdatomic.h>

enum { THREADS_MOST = 256 };

/* What all threads share: the next block, and the error of the first block that failed. */
typedef struct run {
    kt_batch *batch;
    const kt_batch_job *job;
    size_t blocks;
    atomic_size_t next;
    pthread_mutex_t mutex; /* of what follows */
    kt_status status;
    size_t failed;
    kt_error *error;
} run;

typedef struct worker {
    run *run;
    size_t number;
    pthread_t thread;
} worker;

static void note_failure(run *r, size_t block, const kt_error *error) {
    (void)pthread_mutex_lock(&r->mutex);
    if (r->status == KT_OK || block < r->failed) {
        r->status = error->code;
        r->failed = block;
        if (r->error)
            *r->error = *error;
    }
    (void)pthread_mutex_unlock(&r->mutex);
}

static void *work(void *user) {
    const worker *w = user;
    run *r = w->run;
    for (size_t block; (block = atomic_fetch_add(&r->next, 1)) < r->blocks;) {
        kt_error error;
        if (kt_batch_compute_block(r->batch, w->number, block, r->job, &error) != KT_OK)
            note_failure(r, block, &error);
    }
    return NULL;
}

kt_status kt_batch_run(kt_batch *batch, const kt_batch_job *job, size_t threads, size_t *used, kt_error *error) {
    if (KT_IS_MISSING(error, batch, job))
        return KT_ERROR_ARGUMENT;
    const size_t most = kt_batch_thread_count(batch);
    if (threads == 0 || threads > most || threads > THREADS_MOST)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "threads",
            "%zu threads cannot share the work: the batch was made for %zu (options.threads; at most %d)", threads,
            most, THREADS_MOST);
    run r = {.batch = batch,
             .job = job,
             .blocks = kt_batch_block_count(batch),
             .mutex = PTHREAD_MUTEX_INITIALIZER,
             .status = KT_OK,
             .error = error};
    worker workers[THREADS_MOST];
    size_t started = 1;
    atomic_init(&r.next, 0);
    for (size_t i = 0; i < threads; i++)
        workers[i] = (worker){.run = &r, .number = i};
    while (started < threads && pthread_create(&workers[started].thread, NULL, work, &workers[started]) == 0)
        started++;
    (void)work(&workers[0]);
    for (size_t i = 1; i < started; i++)
        (void)pthread_join(workers[i].thread, NULL);
    if (used)
        *used = started;
    return r.status;
}
