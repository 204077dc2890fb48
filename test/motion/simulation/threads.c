/* Equal inputs give equal bits: in a second run, after other runs in the same process, and in threads. Threads share a
 * model, and each has a simulation of its own. A build with -Db_sanitize=thread finds data that they must not share. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "files/scene/collect.h"

#include "kinetree/scene.h"

#include <pthread.h>

static const char *const names[] = {"pendulum",     "double-pendulum", "humanoid",     "four-bar", "n-four-bar-2",
                                    "bricard",      "andrews",         "stewart",      "flip",     "flyball-governor",
                                    "rolling-disc", "bicycle",         "n-four-bar-40"};

enum { SCENES = sizeof names / sizeof names[0], THREADS = 4 };

typedef struct stage {
    const kt_scene *scene;
    kt_model *model;
} stage;

/* The work of one thread: all scenes, from `first` on and around. */
typedef struct task {
    const stage *stages;
    int first;
    uint64_t digest[SCENES];
    long records[SCENES];
    int failed;
} task;

typedef struct digest {
    uint64_t sum; /* FNV-1a */
    long records;
    const kt_model *model;
} digest;

static void add(digest *d, const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < size; i++)
        d->sum = (d->sum ^ byte[i]) * 0x100000001b3U;
}

static int take(const kt_record *record, void *user) {
    digest *d = user;
    add(d, &record->t, sizeof record->t);
    add(d, record->q, (size_t)kt_model_nq(d->model) * sizeof(double));
    add(d, record->v, (size_t)kt_model_nv(d->model) * sizeof(double));
    add(d, record->a, (size_t)kt_model_nv(d->model) * sizeof(double));
    add(d, &record->kinetic, sizeof record->kinetic);
    add(d, &record->potential, sizeof record->potential);
    add(d, record->reactions, (size_t)kt_model_body_count(d->model) * sizeof(kt_wrench));
    d->records++;
    return 0;
}

static bool run_one(const stage *s, uint64_t *sum, long *records) {
    kt_run run = s->scene->run;
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_error error;
    digest d = {.sum = 0xcbf29ce484222325U, .model = s->model};
    run.duration = 0.02 * run.duration;
    run.interval = run.duration / 20.0;
    run.record =
        KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ACCELERATION | KT_RECORD_ENERGY | KT_RECORD_REACTION;
    bool fine = kt_simulation_create(s->model, &run, &options, &simulation, &error) == KT_OK &&
                kt_simulation_run(simulation, take, &d, &error) == KT_OK;
    kt_simulation_free(simulation);
    *sum = d.sum;
    *records = d.records;
    return fine;
}

static void *run_all(void *user) {
    task *t = user;
    for (int i = 0; i < SCENES; i++) {
        const int k = (t->first + i) % SCENES;
        t->failed += !run_one(&t->stages[k], &t->digest[k], &t->records[k]);
    }
    return NULL;
}

static void open_all(stage *stages) {
    for (int i = 0; i < SCENES; i++) {
        stages[i].scene = kt_test_bundled(names[i]);
        stages[i].model = kt_test_model(&stages[i].scene->description, NULL);
    }
}

static void compare(const char *what, const task *one, const task *other) {
    int different = 0;
    for (int i = 0; i < SCENES; i++) {
        if (one->digest[i] != other->digest[i] || one->records[i] != other->records[i]) {
            kt_note("%s: %s differs", what, names[i]);
            different++;
        }
    }
    kt_check_equal_int(what, different, 0);
    kt_check_equal_int("failed", other->failed, 0);
}

KT_TEST(runs_have_equal_bits_again_and_after_others) {
    static stage stages[SCENES], again[SCENES];
    static task once, twice, turned, fresh;
    open_all(stages);
    open_all(again);
    once = twice = (task){.stages = stages};
    turned = (task){.stages = stages, .first = SCENES / 2};
    fresh = (task){.stages = again, .first = 3};
    run_all(&once);
    run_all(&twice);
    run_all(&turned);
    run_all(&fresh);
    for (int i = 0; i < SCENES; i++)
        kt_check_equal_int(names[i], once.records[i], 21);
    compare("again", &once, &twice);
    compare("after others", &once, &turned);
    compare("of a model compiled again", &once, &fresh);
}

KT_TEST(threads_that_share_models_get_equal_bits) {
    static stage stages[SCENES];
    static task alone, tasks[THREADS];
    pthread_t threads[THREADS];
    open_all(stages);
    alone = (task){.stages = stages};
    run_all(&alone);
    int started = 0;
    for (; started < THREADS; started++) {
        tasks[started] = (task){.stages = stages, .first = started};
        if (pthread_create(&threads[started], NULL, run_all, &tasks[started]) != 0)
            break;
    }
    kt_check_equal_int("threads", started, THREADS);
    for (int i = 0; i < started; i++) {
        pthread_join(threads[i], NULL);
        compare("in a thread among others", &alone, &tasks[i]);
    }
}
