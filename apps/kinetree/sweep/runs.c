/* Runs over several threads, the calling one among them. Each takes the next run that nobody has, and computes as
 * many at once as an ensemble has lanes (kinetree/batch.h). A thread that has the line that is due hands it over,
 * and those that are there behind it, in the order of the runs: none waits for lines, and nobody has to be woken
 * for one. So that those that wait for a slow run do not fill memory, no thread is further than a window of runs
 * ahead. */
/* SPDX-License-Identifier: Apache-2.0 */
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
    int64_t threads;                 /* requested threads */
    kt_sweep_result results[WINDOW]; /* of run k in k % WINDOW; without a line: not there yet */
    bool failed, stops;              /* memory has run out; the sink wants no more */
    bool is_writing;                 /* a thread hands lines over */
    kt_sweep_sink *sink;
    void *user;
    kt_sweep_worker *all;
    pthread_mutex_t mutex;
    pthread_cond_t room; /* there is room for another line */
} shared;

static void add_counts(kt_sweep_worker *all, const kt_sweep_worker *worker) {
    all->runs += worker->runs;
    all->anew += worker->anew;
    all->unmade += worker->unmade;
    all->natively += worker->natively;
    all->computed += worker->computed;
    all->left += worker->left;
    all->together += worker->together;
    all->width = worker->width > all->width ? worker->width : all->width; /* a thread without runs has 0 */
    all->alone = worker->alone != NULL ? worker->alone : all->alone;
    if (all->why[0] == '\0')
        memcpy(all->why, worker->why, sizeof all->why);
}

/* A thread, and the simulations that it runs at once. */
typedef struct runner {
    shared *shared;
    kt_sweep_worker worker;
    kt_ensemble *ensemble; /* NULL: no run has had a model yet */
    kt_sweep_run *first;   /* that has been prepared, before there is an ensemble */
    int64_t live;          /* simulations that are running */
} runner;

/* Hands over the lines that are there, from the one that is due on. Called, and left, with the mutex. */
static void hand_over_lines(shared *s) {
    s->is_writing = true;
    while (!s->stops && !s->failed && s->results[s->written % WINDOW].line != NULL) {
        const int64_t run = s->written;
        kt_sweep_result result = s->results[run % WINDOW];
        s->results[run % WINDOW] = (kt_sweep_result){.line = NULL};
        (void)pthread_mutex_unlock(&s->mutex);
        const bool stops = s->sink(s->user, run, &result) != 0;
        kt_sweep_result_free(&result);
        (void)pthread_mutex_lock(&s->mutex);
        s->stops = stops;
        s->written = run + 1;
        (void)pthread_cond_broadcast(&s->room);
    }
    s->is_writing = false;
}

static void store_line(shared *s, int64_t number, const kt_sweep_result *result) {
    (void)pthread_mutex_lock(&s->mutex);
    s->results[number % WINDOW] = *result;
    s->failed = s->failed || result->line == NULL;
    if (!s->is_writing)
        hand_over_lines(s);
    if (s->failed)
        (void)pthread_cond_broadcast(&s->room);
    (void)pthread_mutex_unlock(&s->mutex);
}

/* The next run that nobody has; -1: there is none, none is wanted, or, unless `may_block`, others must come first.
 * A thread takes at most its share of the remaining runs, so that all threads have work to the end. */
static int64_t take_run_number(runner *r, bool may_block) {
    shared *s = r->shared;
    int64_t number = -1;
    (void)pthread_mutex_lock(&s->mutex);
    while (may_block && !s->stops && !s->failed && s->next < s->end && s->next >= s->written + s->window)
        (void)pthread_cond_wait(&s->room, &s->mutex);
    const bool is_open = !s->stops && !s->failed && s->next < s->end && s->next < s->written + s->window;
    if (is_open && (r->live == 0 || r->live < 1 + (s->end - s->next) / s->threads))
        number = s->next++;
    (void)pthread_mutex_unlock(&s->mutex);
    return number;
}

/* Prepares runs until one can be run; NULL: there is none. */
static kt_sweep_run *take_run(runner *r, bool may_block, kt_ensemble_member *member) {
    for (int64_t number = take_run_number(r, may_block); number >= 0; number = take_run_number(r, may_block)) {
        kt_sweep_run *run = kt_sweep_begin(r->shared->sweep, &r->worker, number);
        kt_sweep_result result = {.line = NULL};
        if (run != NULL && kt_sweep_member(run, member))
            return run;
        if (run != NULL)
            result = kt_sweep_end(run, KT_OK, NULL);
        store_line(r->shared, number, &result);
    }
    return NULL;
}

static bool next_member(void *user, bool may_block, kt_ensemble_member *member) {
    runner *r = user;
    kt_sweep_run *run = r->first;
    r->first = NULL;
    if (run != NULL)
        (void)kt_sweep_member(run, member);
    else
        run = take_run(r, may_block, member);
    r->live += run != NULL;
    return run != NULL;
}

static void end_member(void *user, const kt_ensemble_member *member, kt_status status, const kt_error *error) {
    runner *r = user;
    const int64_t number = kt_sweep_number(member->user);
    const kt_sweep_result result = kt_sweep_end(member->user, status, error);
    r->live--;
    store_line(r->shared, number, &result);
}

static void fail_runs(shared *s) {
    (void)pthread_mutex_lock(&s->mutex);
    s->failed = true;
    (void)pthread_cond_broadcast(&s->room);
    (void)pthread_mutex_unlock(&s->mutex);
}

/* Runs in lanes, which are laid out for the first one that has a model. */
static void work_in_lanes(runner *r) {
    kt_ensemble_member member;
    kt_status status = KT_OK;
    r->first = take_run(r, true, &member);
    if (r->first != NULL)
        status = kt_ensemble_create(kt_sweep_model(r->first), &r->ensemble, NULL);
    if (r->ensemble != NULL)
        status = kt_ensemble_run(r->ensemble, next_member, end_member, r, NULL);
    if (status != KT_OK)
        fail_runs(r->shared);
    if (r->first != NULL) { /* there was no memory for the others */
        kt_sweep_result result = kt_sweep_end(r->first, KT_OK, NULL);
        kt_sweep_result_free(&result);
    }
    const kt_ensemble_report report = kt_ensemble_report_of(r->ensemble);
    r->worker.together = (int64_t)report.together;
    r->worker.width = report.width;
    r->worker.alone = report.why != NULL && r->worker.natively > 0 ? "--native is given" : report.why;
    kt_ensemble_free(r->ensemble);
}

static void work_one_by_one(runner *r) {
    for (int64_t number = take_run_number(r, true); number >= 0; number = take_run_number(r, true)) {
        const kt_sweep_result result = kt_sweep_one(r->shared->sweep, &r->worker, number);
        store_line(r->shared, number, &result);
    }
    r->worker.alone = r->shared->sweep->is_absolute ? "the scene has formulation: absolute" : "--one-by-one is given";
}

static void *work_on_runs(void *user) {
    shared *s = user;
    runner r = {.shared = s};
    if (s->sweep->arguments->one_by_one || s->sweep->is_absolute)
        work_one_by_one(&r);
    else
        work_in_lanes(&r);
    (void)pthread_mutex_lock(&s->mutex);
    add_counts(s->all, &r.worker);
    (void)pthread_mutex_unlock(&s->mutex);
    kt_sweep_worker_free(&r.worker);
    return NULL;
}

int kt_sweep_run_all(const kt_sweep *sweep, int64_t first, int64_t end, int threads, kt_sweep_sink *sink, void *user,
                     kt_sweep_worker *all) {
    pthread_t thread[THREADS_MAX];
    shared *s = calloc(1, sizeof *s);
    int count = 1;
    if (s == NULL) {
        kt_say("sweep: there is not enough memory");
        return -1;
    }
    s->sweep = sweep;
    s->sink = sink;
    s->user = user;
    s->all = all;
    s->next = s->written = first;
    s->end = end;
    s->window = sweep->arguments->keep != NULL ? WINDOW_OF_RECORDS : WINDOW;
    (void)pthread_mutex_init(&s->mutex, NULL);
    (void)pthread_cond_init(&s->room, NULL);
    threads = threads < THREADS_MAX ? threads : THREADS_MAX;
    s->threads = threads;
    while (count < threads && pthread_create(&thread[count], NULL, work_on_runs, s) == 0)
        count++;
    (void)work_on_runs(s);
    for (int i = 1; i < count; i++)
        (void)pthread_join(thread[i], NULL);
    const bool failed = s->failed || s->stops;
    if (s->failed)
        kt_say("sweep: there is not enough memory");
    for (int i = 0; i < WINDOW; i++)
        kt_sweep_result_free(&s->results[i]);
    (void)pthread_cond_destroy(&s->room);
    (void)pthread_mutex_destroy(&s->mutex);
    free(s);
    return failed ? -1 : 0;
}
