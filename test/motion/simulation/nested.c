/* Calls in the wrong place: by a recorder or an action, within a call with the same simulation. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include "kinetree/sensitivity.h"

#include <stdlib.h>

typedef kt_status mover(kt_simulation *simulation, kt_error *error);

static mover steps, advances, ticks, runs, starts, goes_back, differentiates;

static kt_status steps(kt_simulation *s, kt_error *error) { return kt_simulation_step(s, 9.0, error); }
static kt_status advances(kt_simulation *s, kt_error *error) { return kt_simulation_advance(s, 9.0, error); }
static kt_status ticks(kt_simulation *s, kt_error *error) { return kt_simulation_tick(s, 1.0, error); }
static kt_status starts(kt_simulation *s, kt_error *error) {
    return kt_simulation_set_state(s, 0.0, &(double){0.0}, NULL, error);
}
static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}
static kt_status runs(kt_simulation *s, kt_error *error) { return kt_simulation_run(s, ignore, NULL, error); }
static kt_status goes_back(kt_simulation *s, kt_error *error) {
    void *block = malloc(kt_simulation_state_size(s));
    kt_need(kt_check_true("memory", block != NULL));
    kt_simulation_save(s, block);
    const kt_status status = kt_simulation_restore(s, block, error);
    free(block);
    return status;
}
static kt_status differentiates(kt_simulation *s, kt_error *error) {
    const size_t size = (kt_motion_work_size(s) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    const kt_status status = kt_motion_derivatives(s, work, size, 9.0, NULL, NULL, error);
    free(work);
    return status;
}

static const struct {
    const char *name;
    mover *move;
} movers[] = {
    {"kt_simulation_step", steps},
    {"kt_simulation_advance", advances},
    {"kt_simulation_advance", ticks},
    {"kt_simulation_run", runs},
    {"kt_simulation_set_state", starts},
    {"kt_simulation_restore", goes_back},
    {"kt_motion_derivatives", differentiates},
};

typedef struct nest {
    kt_simulation *simulation;
    const char *who;
    int count;
} nest;

static void move_within(nest *n) {
    for (size_t i = 0; i < sizeof movers / sizeof *movers; i++) {
        kt_error error = {0};
        const double t = kt_simulation_time(n->simulation);
        kt_check_equal_int(movers[i].name, movers[i].move(n->simulation, &error), KT_ERROR_ARGUMENT);
        kt_check_text("where", error.where, movers[i].name);
        kt_check_contains("who", error.message, n->who);
        kt_check_near("time", kt_simulation_time(n->simulation), t, 0.0);
    }
    n->count++;
}

static int move_at_record(const kt_record *record, void *user) {
    (void)record;
    move_within(user);
    return 0;
}

static int clock_of(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->t - 0.5;
    return 0;
}

static int move_at_event(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    (void)simulation, (void)what, (void)error;
    move_within(user);
    return 0;
}

static kt_simulation *make(kt_model **model, const kt_event *event) {
    kt_lone lone;
    kt_error error = {0};
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_default();
    kt_pendulum_make(&lone, 1.0, 0.0);
    run.duration = 1.0;
    run.interval = 0.25;
    options.events = 1;
    *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(*model, &run, &options);
    if (event != NULL)
        (void)kt_fine("event", kt_simulation_event_add(simulation, event, &error), &error);
    return simulation;
}

/* The motion is that without these calls, and later calls are accepted again. */
KT_TEST(callbacks_cannot_move_their_simulation_in_time) {
    kt_model *model[3] = {NULL};
    kt_error error = {0};
    nest n = {.who = "a recorder"};
    n.simulation = make(&model[0], NULL);
    kt_test_run(n.simulation, move_at_record, &n);
    kt_check_equal_int("records", n.count, 5);
    (void)kt_fine("starts again", starts(n.simulation, &error), &error);

    n = (nest){.who = "the action of an event"};
    const kt_event event = {.name = "half", .function = clock_of, .action = move_at_event, .user = &n},
                   idle = {.name = "half", .function = clock_of};
    kt_simulation *alone = make(&model[1], &idle);
    n.simulation = make(&model[2], &event);
    kt_test_advance(n.simulation, 1.0);
    kt_test_advance(alone, 1.0);
    kt_check_equal_int("actions", n.count, 1);
    kt_check_near("time", kt_simulation_time(n.simulation), 1.0, 0.0);
    kt_check_equal_bits("position", kt_simulation_positions(n.simulation), kt_simulation_positions(alone), 1);
}
