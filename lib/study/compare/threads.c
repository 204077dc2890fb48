/* Several threads share a list of items. Each thread computes the next item that no thread has taken, until the list is
 * finished. The numbers of an item do not depend on the thread. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/threads.h"

#include <pthread.h>
#include <stdatomic.h>

/* The data that all threads share: the next item, and the error of the first item that failed. */
typedef struct work {
    kt_threads_call *call;
    void *user;
    size_t count;
    atomic_size_t next;
    pthread_mutex_t mutex; /* of the members below */
    kt_status status;
    size_t failed;
    kt_error *error;
} work;

typedef struct worker {
    work *work;
    size_t number;
    pthread_t thread;
} worker;

/* Keeps the error of the first item in the list that failed, whichever thread was faster. */
static void note_item_failure(work *w, size_t item, const kt_error *error) {
    (void)pthread_mutex_lock(&w->mutex);
    if (w->status == KT_OK || item < w->failed) {
        w->status = error->code;
        w->failed = item;
        if (w->error)
            *w->error = *error;
    }
    (void)pthread_mutex_unlock(&w->mutex);
}

static void *take_items(void *user) {
    const worker *self = user;
    work *w = self->work;
    for (size_t item; (item = atomic_fetch_add(&w->next, 1)) < w->count;) {
        kt_error error;
        if (w->call(w->user, self->number, item, &error) != KT_OK)
            note_item_failure(w, item, &error);
    }
    return NULL;
}

kt_status kt_threads_share(size_t count, size_t threads, kt_threads_call *call, void *user, size_t *used,
                           kt_error *error) {
    work w = {.call = call,
              .user = user,
              .count = count,
              .mutex = PTHREAD_MUTEX_INITIALIZER,
              .status = KT_OK,
              .error = error};
    worker workers[KT_THREADS_MOST];
    size_t started = 1;
    atomic_init(&w.next, 0);
    workers[0] = (worker){.work = &w, .number = 0};
    for (size_t i = 1; i < threads; i++)
        workers[i] = (worker){.work = &w, .number = i};
    while (started < threads && pthread_create(&workers[started].thread, NULL, take_items, &workers[started]) == 0)
        started++;
    (void)take_items(&workers[0]);
    for (size_t i = 1; i < started; i++)
        (void)pthread_join(workers[i].thread, NULL);
    if (used)
        *used = started;
    return w.status;
}
