/* A hard case at work: its description read or made, compiled, run, watched. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include "kinetree/study.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- what is said ------------------------------------------------------------------------------------------------ */

void kt_hard_say(kt_hard *h, const char *format, ...) {
    const size_t used = strlen(h->words);
    va_list arguments;
    va_start(arguments, format);
    if (used + 2 < sizeof h->words) {
        if (used > 0)
            memcpy(h->words + used, "; ", sizeof "; ");
        const size_t at = strlen(h->words);
        (void)vsnprintf(h->words + at, sizeof h->words - at, format, arguments);
    }
    va_end(arguments);
}

bool kt_hard_fine(kt_hard *h, kt_status status, const kt_error *error) {
    if (status != KT_OK)
        kt_hard_say(h, "%s: %s", error->where, error->message);
    return status == KT_OK;
}

void kt_hard_claim(kt_hard *h, int measure, bool holds, const char *what) {
    if (isnan(h->observed[measure]))
        h->observed[measure] = 0.0;
    if (holds)
        return;
    h->observed[measure] += 1.0;
    kt_hard_say(h, "NOT: %s", what);
}

/* ---- the description --------------------------------------------------------------------------------------------- */

/* A copy that may be changed; never NULL but without memory. */
static void *copy_of(const void *items, int count, size_t size) {
    void *copy = calloc((size_t)count + 1, size);
    if (copy && count > 0 && items)
        memcpy(copy, items, (size_t)count * size);
    return copy;
}

static bool take(kt_hard *h) {
    kt_description *d = &h->description;
    h->bodies = copy_of(d->bodies, d->body_count, sizeof *h->bodies);
    h->loops = copy_of(d->loops, d->loop_count, sizeof *h->loops);
    h->effects = copy_of(d->effects, d->effect_count, sizeof *h->effects);
    h->parent = copy_of(NULL, d->body_count, sizeof *h->parent);
    h->pose = copy_of(NULL, d->body_count, sizeof *h->pose);
    h->twist = copy_of(NULL, d->body_count, sizeof *h->twist);
    d->bodies = h->bodies;
    d->loops = h->loops;
    d->effects = h->effects;
    if (h->bodies && h->loops && h->effects && h->parent && h->pose && h->twist)
        return true;
    kt_hard_say(h, "no memory");
    return false;
}

bool kt_hard_make(kt_hard *h, int bodies, int loops, int effects) {
    h->description = kt_description_default();
    h->description.body_count = bodies;
    h->description.loop_count = loops;
    h->description.effect_count = effects;
    if (!take(h))
        return false;
    for (int i = 0; i < bodies; i++)
        h->bodies[i] = kt_body_default();
    for (int i = 0; i < loops; i++)
        h->loops[i] = kt_loop_default();
    for (int i = 0; i < effects; i++)
        h->effects[i] = kt_effect_default();
    return true;
}

static bool read_scene(kt_hard *h, const char *name) {
    char path[2][300];
    kt_error error;
    (void)snprintf(path[0], sizeof path[0], "%s/%s.yaml", KT_HARD_SCENES, name);
    (void)snprintf(path[1], sizeof path[1], "%s/%s.yaml", KT_SCENES, name);
    FILE *own = fopen(path[0], "r");
    if (own)
        (void)fclose(own);
    if (!kt_hard_fine(h, kt_scene_read(path[own ? 0 : 1], &h->scene, NULL, NULL, &error), &error))
        return false;
    h->description = h->scene.description;
    return take(h);
}

bool kt_hard_open(kt_hard *h, const kt_hard_motion *motion) {
    return (!motion->scene || read_scene(h, motion->scene)) && (!motion->change || motion->change(h));
}

void kt_hard_close(kt_hard *h) {
    kt_simulation_free(h->simulation);
    kt_model_free(h->model);
    kt_scene_free(&h->scene);
    free(h->bodies);
    free(h->loops);
    free(h->effects);
    free(h->names);
    free(h->parent);
    free(h->pose);
    free(h->twist);
    h->simulation = NULL;
    h->model = NULL;
    h->bodies = NULL;
    h->loops = NULL;
    h->effects = NULL;
    h->names = NULL;
    h->parent = NULL;
    h->pose = NULL;
    h->twist = NULL;
}

/* ---- the model and its simulation -------------------------------------------------------------------------------- */

bool kt_hard_compile(kt_hard *h, const kt_hard_motion *motion) {
    kt_model_options options = kt_model_options_default();
    kt_error error;
    options.reduction = kt_reduction_method_of(motion->reduction);
    options.plan = motion->plan;
    if (!kt_hard_fine(h, kt_model_compile(&h->description, &options, &h->model, &error), &error))
        return false;
    for (int b = 1; b < kt_model_body_count(h->model); b++)
        h->parent[kt_body_source(h->model, b)] = kt_body_source(h->model, kt_body_parent(h->model, b));
    const int rank = kt_model_mobility(h->model).rank;
    if (motion->rank == 0 || motion->rank == rank)
        return true;
    kt_hard_say(h, "rank %d, not %d", rank, motion->rank);
    return false;
}

double kt_hard_duration(const kt_hard *h, const kt_hard_motion *motion) {
    return h->full || motion->shorter == 0.0 ? motion->duration : motion->shorter;
}

kt_run kt_hard_settings(const kt_hard *h, const kt_hard_motion *motion) {
    kt_run run = kt_run_default();
    run.duration = kt_hard_duration(h, motion);
    run.integrator = motion->integrator;
    run.step = motion->tolerance > 0.0 ? 0.0 : motion->step;
    run.relative = run.absolute = motion->tolerance;
    run.interval = motion->interval;
    run.record = KT_RECORD_POSITION;
    return run;
}

bool kt_hard_start(kt_hard *h, const kt_hard_motion *motion) {
    kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_hard_settings(h, motion);
    kt_error error;
    options.kinematics = true;
    return kt_hard_compile(h, motion) &&
           kt_hard_fine(h, kt_simulation_create(h->model, &run, &options, &h->simulation, &error), &error);
}

kt_hard_view kt_hard_look(const kt_hard *h, const kt_data *data, double t) {
    for (int b = 1; b < kt_model_body_count(h->model); b++) {
        const int i = kt_body_source(h->model, b);
        h->pose[i] = kt_body_pose(h->model, data, b);
        h->twist[i] = kt_body_twist(h->model, data, b);
    }
    return (kt_hard_view){&h->description, h->parent, h->pose, h->twist, t};
}

typedef struct follower {
    const kt_hard *h;
    const kt_hard_motion *motion;
    kt_hard_watch *watch;
} follower;

static int watch_record(const kt_record *record, void *user) {
    const follower *f = user;
    const kt_hard_view view = kt_hard_look(f->h, record->data, record->t);
    f->motion->watch(f->watch, &view);
    f->watch->count++;
    return 0;
}

bool kt_hard_follow(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch) {
    follower f = {h, motion, watch};
    kt_error error;
    memset(watch, 0, sizeof *watch);
    return kt_hard_fine(h, kt_simulation_run(h->simulation, watch_record, &f, &error), &error);
}

/* ---- a case ------------------------------------------------------------------------------------------------------ */

void kt_hard_run(kt_hard *h, const kt_hard_case *c, bool full) {
    kt_hard_watch watch;
    *h = (kt_hard){.c = c, .full = full, .scene = kt_scene_default()};
    for (int i = 0; i < KT_HARD_MEASURES; i++)
        h->observed[i] = (double)NAN;
    if (c->run)
        c->run(h);
    else if (kt_hard_open(h, c->motion) && kt_hard_start(h, c->motion) && kt_hard_follow(h, c->motion, &watch))
        memcpy(h->observed, watch.observed, sizeof h->observed);
    kt_hard_close(h);
}

int kt_hard_count(void) {
    int count = 0;
    while (kt_hard_at(count))
        count++;
    return count;
}

const kt_hard_case *kt_hard_at(int index) {
    static const kt_hard_case *const lists[] = {kt_hard_windows, kt_hard_loops,   kt_hard_masses,  kt_hard_turning,
                                                kt_hard_stiff,   kt_hard_trouble, kt_hard_extremes};
    /* Sorted by kinds, over all files. */
    for (int kind = 1, seen = 0; kind <= KT_HARD_KINDS; kind++)
        for (size_t l = 0; l < sizeof lists / sizeof *lists; l++)
            for (const kt_hard_case *c = lists[l]; c->name; c++)
                if (c->number == kind && seen++ == index)
                    return c;
    return NULL;
}
