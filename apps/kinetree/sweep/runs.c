/* Runs over several threads. Each takes the next run that nobody has; the calling thread hands the lines over in the order of
 * the runs. So that those that wait for a slow run do not fill memory, no thread is further than a window of
 * runs ahead. */
#include "sweep/sweep.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { WINDOW = 1024, WINDOW_OF_RECORDS = 64, THREADS_MAX = 256 };

typedef struct shared {
    const kt_sweep *sweep;
    int64_t next, end; /* runs that are to be taken */
    int64_t written;   /* runs before this one have been handed over */
    int64_t window;
    kt_sweep_result results[WINDOW]; /* of run k in k % WINDOW; without a line: not there yet */
    bool failed, stops;
    kt_sweep_worker *all;
    pthread_mutex_t mutex;
    pthread_cond_t line, room; /* there is a new line; there is room for one */
} shared;

static void add_counts(kt_sweep_worker *all, const kt_sweep_worker *worker) {
    all->runs += worker->runs;
    all->anew += worker->anew;
    if (all->why[0] == '\0')
        memcpy(all->why, worker->why, sizeof all->why);
}

static void *work(void *user) {
    shared *s = user;
    kt_sweep_worker worker = {.has_scene = false};
    (void)pthread_mutex_lock(&s->mutex);
    for (;;) {
        while (!s->stops && s->next < s->end && s->next >= s->written + s->window)
            (void)pthread_cond_wait(&s->room, &s->mutex);
        if (s->stops || s->next >= s->end)
            break;
        const int64_t run = s->next++;
        (void)pthread_mutex_unlock(&s->mutex);
        const kt_sweep_result result = kt_sweep_one(s->sweep, &worker, run);
        (void)pthread_mutex_lock(&s->mutex);
        s->results[run % WINDOW] = result;
        s->failed = s->failed || result.line == NULL;
        (void)pthread_cond_signal(&s->line);
        if (s->failed)
            break;
    }
    add_counts(s->all, &worker);
    (void)pthread_mutex_unlock(&s->mutex);
    kt_sweep_worker_free(&worker);
    return NULL;
}

/* Hands lines over until the last one, or the first that fails. */
static int hand_over(shared *s, int64_t first, kt_sweep_sink *sink, void *user) {
    int failed = 0;
    (void)pthread_mutex_lock(&s->mutex);
    for (int64_t run = first; run < s->end && failed == 0; run++) {
        while (s->results[run % WINDOW].line == NULL && !s->failed)
            (void)pthread_cond_wait(&s->line, &s->mutex);
        kt_sweep_result result = s->results[run % WINDOW];
        s->results[run % WINDOW] = (kt_sweep_result){.line = NULL};
        if (result.line == NULL) {
            kt_sweep_result_free(&result);
            kt_say("sweep: there is not enough memory");
            failed = -1;
            break;
        }
        s->written = run + 1;
        (void)pthread_cond_broadcast(&s->room);
        (void)pthread_mutex_unlock(&s->mutex);
        failed = sink(user, run, &result) != 0 ? -1 : 0;
        kt_sweep_result_free(&result);
        (void)pthread_mutex_lock(&s->mutex);
    }
    s->stops = true;
    (void)pthread_cond_broadcast(&s->room);
    (void)pthread_mutex_unlock(&s->mutex);
    return failed;
}

int kt_sweep_run_all(const kt_sweep *sweep, int64_t first, int64_t end, int threads, kt_sweep_sink *sink, void *user,
                     kt_sweep_worker *all) {
    pthread_t thread[THREADS_MAX];
    shared *s = calloc(1, sizeof *s);
    int count = 0, failed = -1;
    if (s == NULL) {
        kt_say("sweep: there is not enough memory");
        return -1;
    }
    s->sweep = sweep;
    s->all = all;
    s->next = s->written = first;
    s->end = end;
    s->window = sweep->arguments->keep != NULL ? WINDOW_OF_RECORDS : WINDOW;
    (void)pthread_mutex_init(&s->mutex, NULL);
    (void)pthread_cond_init(&s->line, NULL);
    (void)pthread_cond_init(&s->room, NULL);
    threads = threads < THREADS_MAX ? threads : THREADS_MAX;
    while (count < threads && pthread_create(&thread[count], NULL, work, s) == 0)
        count++;
    if (count == 0)
        kt_say("sweep: no thread can be started");
    else
        failed = hand_over(s, first, sink, user);
    for (int i = 0; i < count; i++)
        (void)pthread_join(thread[i], NULL);
    for (int i = 0; i < WINDOW; i++)
        kt_sweep_result_free(&s->results[i]);
    (void)pthread_cond_destroy(&s->room);
    (void)pthread_cond_destroy(&s->line);
    (void)pthread_mutex_destroy(&s->mutex);
    free(s);
    return failed;
}
