/* A caller's equations, its projection or an effect fail: the origin and time of the message, and the state after it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "motion/simulation/scenes.h"

#include <float.h>
#include <math.h>

/* A slider that rejects where its owner wants it to. */
typedef struct owner {
    double from; /* its equations, or its projection, reject from this time on */
    int code;    /* with this result */
    bool in_projection, in_effect;
    bool records_only; /* rejects in records alone; the recorder sets `recording` */
    bool recording;
} owner;

static bool rejects(const owner *o, double t) {
    return o->code != 0 && t >= o->from && (!o->records_only || o->recording);
}

/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int stand_still(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    const owner *o = user;
    (void)rate;
    (void)error;
    a[0] = 0.0;
    return !o->in_projection && !o->in_effect && rejects(o, at->t) ? o->code : 0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int leave_it(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user) {
    const owner *o = user;
    (void)q;
    (void)v;
    (void)error;
    *changed = false;
    return o->in_projection && rejects(o, at->t) ? o->code : 0;
}

static int drive_nothing(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const owner *o = user;
    (void)q;
    (void)v;
    (void)balance;
    *force = 0.0;
    return o->in_effect && rejects(o, t) ? o->code : 0;
}

typedef struct stand {
    kt_lone lone;
    kt_effect effect;
    kt_model *model;
    kt_simulation *simulation;
} stand;

/* A block that slides at 1 m/s from 0; own: by the caller's equations and projection, else by the engine's. */
static void make_stand(stand *s, owner *o, kt_run run, bool own) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_lone_make(&s->lone, KT_JOINT_PRISMATIC, 2.0);
    s->lone.body.joint.velocity[0] = 1.0;
    s->effect = kt_effect_of(KT_EFFECT_CUSTOM, s->lone.body.name);
    s->effect.name = "hand";
    s->effect.joint_force = drive_nothing;
    s->effect.user = o;
    s->lone.description.effects = &s->effect;
    s->lone.description.effect_count = 1;
    s->model = kt_scene_compile(&s->lone.description);
    options.events = 1;
    if (own) {
        options.acceleration = stand_still;
        options.projection = leave_it;
        options.user = o;
    }
    s->simulation = kt_test_simulation(s->model, &run, &options);
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* The step from 0.5 s on fails, and the simulation stays there. */
static void check_step(owner o, bool own, unsigned record, kt_status expected, const char *where, const char *message) {
    stand s;
    kt_error error = {KT_OK, "", ""};
    kt_run run = kt_run_fixed("rk4", 0.25, 10.0);
    run.record = record;
    make_stand(&s, &o, run, own);
    kt_test_advance(s.simulation, 0.5);
    const double before[2] = {kt_simulation_positions(s.simulation)[0], kt_simulation_velocities(s.simulation)[0]};
    kt_check_equal_int("status", kt_simulation_advance(s.simulation, 1.0, &error), expected);
    kt_check_text("where", error.where, where);
    kt_check_contains("message", error.message, message);
    const double after[2] = {kt_simulation_positions(s.simulation)[0], kt_simulation_velocities(s.simulation)[0]};
    kt_check_equal_bits("state", after, before, 2);
    kt_check_near("clock", kt_simulation_time(s.simulation), 0.5, 0.0);
}

KT_TEST(projection_that_rejects_is_told_and_leaves_the_state) {
    check_step((owner){.from = 0.6, .code = 2, .in_projection = true}, true, KT_RECORD_POSITION, KT_ERROR_CALLBACK,
               "t = 0.5 s", "the caller's projection returned 2");
    check_step((owner){.from = 0.6, .code = -4, .in_projection = true}, true, KT_RECORD_POSITION, KT_ERROR_CALLBACK,
               "t = 0.5 s", "the caller's projection returned -4");
}

/* Its first stage after 0.5 s is that at 0.625 s. If a balance is kept, the power of the effect is evaluated, too. This
 * also applies under equations of the caller's. */
KT_TEST(effect_that_rejects_is_told_and_leaves_the_state) {
    static const char where[] = "effect 'hand' (custom) on joint 'block', t = 0.625 s";
    static const char small[] = "its callback cannot compute its force here (code 1) (the step is fixed at 0.25 s: a "
                                "smaller one may help, or an adaptive method)";
    static const char never[] = "its callback stopped (code -1)";
    const owner here = {.from = 0.6, .code = 1, .in_effect = true}, stop = {.from = 0.6, .code = -1, .in_effect = true};
    check_step(here, false, KT_RECORD_POSITION, KT_ERROR_EFFECT, where, small);
    check_step(stop, false, KT_RECORD_POSITION, KT_ERROR_CALLBACK, where, never);
    check_step(here, false, KT_RECORD_BALANCE, KT_ERROR_EFFECT, where, small);
    check_step(stop, false, KT_RECORD_BALANCE, KT_ERROR_CALLBACK, where, never);
    check_step(here, true, KT_RECORD_BALANCE, KT_ERROR_EFFECT, where, small);
}

/* Stays positive, and varies by more than its size, so that each step is searched. */
static int never_happen(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = 1.0 + 100.0 * at->t * at->t;
    return 0;
}

/* The search of an event evaluates the force at the end of the step, which the step itself does not need. */
KT_TEST(effect_that_stops_in_the_search_of_an_event_is_named) {
    const kt_event event = {.name = "never", .function = never_happen};
    stand s;
    owner o = {.from = 0.75, .code = -1, .in_effect = true};
    kt_error error = {KT_OK, "", ""};
    make_stand(&s, &o, kt_run_fixed("euler", 0.25, 10.0), false);
    (void)kt_fine("adds an event", kt_simulation_event_add(s.simulation, &event, &error), &error);
    kt_check_equal_int("status", kt_simulation_advance(s.simulation, 1.0, &error), KT_ERROR_CALLBACK);
    kt_check_text("where", error.where, "effect 'hand' (custom) on joint 'block', t = 0.75 s");
    kt_check_text("message", error.message, "its callback stopped (code -1)");
    kt_check_near("clock", kt_simulation_time(s.simulation), 0.5, 0.0);
}

/* At 0.5 s, where the step begins: there a smaller one begins, too. */
KT_TEST(effect_that_rejects_the_present_state_is_not_told_to_want_a_smaller_step) {
    const owner now = {.from = 0.5, .code = 1, .in_effect = true};
    stand s;
    owner o = now;
    kt_error error = {KT_OK, "", ""};
    make_stand(&s, &o, kt_run_fixed("euler", 0.25, 10.0), false);
    kt_test_advance(s.simulation, 0.5);
    kt_check_equal_int("status", kt_simulation_advance(s.simulation, 1.0, &error), KT_ERROR_EFFECT);
    kt_check_text("where", error.where, "effect 'hand' (custom) on joint 'block', t = 0.5 s");
    kt_check_text("message", error.message, "its callback cannot compute its force here (code 1)");
}

/* An adaptive method goes around a projection that rejects after long steps only; it stops at one that rejects for
 * good.
 */
/* NOLINTNEXTLINE(readability-non-const-parameter): the type is the library's */
static int reject_long_steps(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user) {
    double *last = user;
    (void)q;
    (void)v;
    (void)error;
    *changed = false;
    if (at->t - *last > 0.05)
        return 1;
    *last = at->t;
    return 0;
}

KT_TEST(projection_that_rejects_long_steps_shortens_them) {
    kt_lone lone;
    double last = 0.0;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    lone.body.joint.velocity[0] = 1.0;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation_options options = kt_simulation_options_default();
    options.projection = reject_long_steps;
    options.user = &last;
    kt_simulation *simulation = kt_test_simulation(model, NULL, &options);
    kt_test_advance(simulation, 1.0);
    kt_check_above("steps", (double)kt_simulation_counts_of(simulation).steps, 20.0);
    kt_check_above("rejected", (double)kt_simulation_counts_of(simulation).rejected, 1.0);
    kt_check_near("q", kt_simulation_positions(simulation)[0], 1.0, 64.0 * DBL_EPSILON);
}

/* A state is projected, too; nobody need hear why it was rejected. */
KT_TEST(state_that_the_callers_projection_rejects_is_not_taken) {
    stand s;
    owner o = {.from = 2.0, .code = -1, .in_projection = true};
    const double q = 3.0, v = 4.0;
    make_stand(&s, &o, kt_run_fixed("rk4", 0.25, 10.0), true);
    kt_check_equal_int("status", kt_simulation_set_state(s.simulation, 2.0, &q, &v, NULL), KT_ERROR_CALLBACK);
    o.code = 1;
    kt_check_equal_int("status", kt_simulation_set_state(s.simulation, 2.0, &q, &v, NULL), KT_ERROR_CONSTRAINT);
    kt_check_near("q", kt_simulation_positions(s.simulation)[0], 0.0, 0.0);
    kt_check_near("v", kt_simulation_velocities(s.simulation)[0], 1.0, 0.0);
}

KT_TEST(state_at_no_time_is_rejected) {
    stand s;
    owner o = {0};
    kt_error error = {KT_OK, "", ""};
    const double q = 3.0, v = 4.0;
    make_stand(&s, &o, kt_run_fixed("rk4", 0.25, 10.0), true);
    kt_check_equal_int("status", kt_simulation_set_state(s.simulation, HUGE_VAL, &q, &v, &error), KT_ERROR_NOT_FINITE);
    kt_check_text("message", error.message, "the time is inf; give a finite number");
    kt_check_near("q", kt_simulation_positions(s.simulation)[0], 0.0, 0.0);
}

KT_TEST(acceleration_that_is_rejected_is_told_with_the_time) {
    stand s;
    owner o = {.code = -7};
    kt_error error = {KT_OK, "", ""};
    double a = 5.0;
    make_stand(&s, &o, kt_run_fixed("rk4", 0.25, 10.0), true);
    kt_check_equal_int("status", kt_simulation_acceleration(s.simulation, &a, &error), KT_ERROR_CALLBACK);
    kt_check_text("where", error.where, "t = 0 s");
    kt_check_text("message", error.message, "the caller's right-hand side returned -7");
    kt_check_near("the acceleration is not touched", a, 5.0, 0.0);
}

/* ---- records ----------------------------------------------------------------------------------------------------- */

/* Rejections begin after this record. */
typedef struct watcher {
    owner *owner;
    int seen, last;
} watcher;

static int watch(const kt_record *record, void *user) {
    watcher *w = user;
    w->seen++;
    w->owner->recording = record->index >= w->last;
    return 0;
}

/* Steps of 0.25 s and records of 0.1 s. The record at 0.2 s is accepted, and that at 0.3 s is rejected. The step to 0.5
 * s precedes the rejected record. Once nothing is rejected any more the run goes on with it. */
static void check_record(owner o, unsigned record, kt_status expected, const char *where, const char *message) {
    stand s;
    watcher w = {&o, 0, 2};
    kt_error error = {KT_OK, "", ""};
    kt_run run = kt_run_fixed("rk4", 0.25, 1.0);
    run.interval = 0.1;
    run.record = record;
    o.records_only = true;
    make_stand(&s, &o, run, true);
    /* the step to 0.5 s is taken while nothing is rejected */
    w.last = 3;
    kt_check_equal_int("status", kt_simulation_run(s.simulation, watch, &w, &error), expected);
    kt_check_equal_int("records", w.seen, 4);
    kt_check_text("where", error.where, where);
    kt_check_text("message", error.message, message);
    kt_check_near("clock", kt_simulation_time(s.simulation), 0.5, 0.0);
    o.code = 0;
    kt_test_run(s.simulation, watch, &w);
    kt_check_equal_int("records", w.seen, 11);
}

/* No step failed, and a smaller one is no help. */
KT_TEST(record_that_is_rejected_comes_when_it_no_longer_is) {
    const owner equations = {.code = -1}, projection = {.code = -1, .in_projection = true},
                effect = {.code = 1, .in_effect = true};
    check_record(equations, KT_RECORD_ACCELERATION, KT_ERROR_CALLBACK, "t = 0.5 s",
                 "the caller's right-hand side returned -1");
    check_record(projection, KT_RECORD_POSITION, KT_ERROR_CALLBACK, "t = 0.5 s", "the caller's projection returned -1");
    check_record(effect, KT_RECORD_REACTION, KT_ERROR_EFFECT, "effect 'hand' (custom) on joint 'block', t = 0.4 s",
                 "its callback cannot compute its force here (code 1)");
}

static int count_records(const kt_record *record, void *user) {
    (void)record;
    ++*(int *)user;
    return 0;
}

/* Euler's method needs no slope at the end of a step, but the states between two steps do. */
KT_TEST(records_within_a_step_to_where_there_is_no_acceleration_are_missing) {
    stand s;
    owner o = {.from = 0.5, .code = -1};
    int records = 0;
    kt_error error = {KT_OK, "", ""};
    kt_run run = kt_run_fixed("euler", 0.25, 1.0);
    run.interval = 0.1;
    run.record = KT_RECORD_POSITION;
    make_stand(&s, &o, run, true);
    kt_check_equal_int("status", kt_simulation_run(s.simulation, count_records, &records, &error), KT_ERROR_CALLBACK);
    kt_check_equal_int("records: those up to 0.2 s", records, 3);
    kt_check_text("where", error.where, "t = 0.5 s");
    kt_check_contains("message", error.message, "the caller's right-hand side returned -1");
    kt_check_near("clock", kt_simulation_time(s.simulation), 0.5, 0.0);
}

KT_TEST(records_that_nobody_asked_for_in_time_are_gone) {
    stand s;
    owner o = {0};
    int records = 0;
    kt_run run = kt_run_fixed("rk4", 0.25, 1.0);
    run.interval = 0.5;
    make_stand(&s, &o, run, true);
    kt_test_run(s.simulation, count_records, &records);
    kt_check_equal_int("records", records, 3);
    kt_test_advance(s.simulation, 2.0);
    kt_test_run(s.simulation, count_records, &records);
    kt_check_equal_int("records after all", records, 3);
    kt_check_near("clock", kt_simulation_time(s.simulation), 2.0, 0.0);

    run.duration = run.interval = 0.0;
    records = 0;
    make_stand(&s, &o, run, true);
    kt_check_equal_int("of a run without duration", kt_simulation_record_count(s.simulation), 1);
    kt_test_advance(s.simulation, 0.5);
    kt_test_run(s.simulation, count_records, &records);
    kt_check_equal_int("records after its end", records, 0);
}

/* ---- formulations ------------------------------------------------------------------------------------------------ */

static kt_either simulate(const kt_lone *lone, kt_formulation formulation) {
    kt_model *model = kt_scene_compile(&lone->description);
    return kt_either_begin(model, kt_formulate(&lone->description, NULL, model, formulation), NULL, NULL);
}

/* Checks a lone body in either formulation. In the tree's formulation, a loop may also tie the world and the body. */
static void check_zeros(kt_formulation formulation, bool tied) {
    kt_lone lone;
    kt_loop loop = kt_loop_default();
    kt_error error = {KT_OK, "", ""};
    const double zeros[7] = {0.0}, still[6] = {0.0};
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    loop.name = "tie";
    loop.type = KT_LOOP_SPHERICAL;
    loop.between[1].body = lone.body.name;
    lone.description.loops = &loop;
    lone.description.loop_count = tied ? 1 : 0;
    const kt_either e = simulate(&lone, formulation);
    kt_check_equal_int("status", kt_either_set_state(e, 0.0, zeros, still, &error), KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "joint 'block'");
    kt_check_text("message", error.message,
                  "its quaternion is zero, which is no rotation; give one of norm 1 (1, 0, 0, 0: not turned)");
    kt_check_near("w", kt_either_positions(e)[3], 1.0, 0.0);
}

KT_TEST(quaternion_of_zeros_is_rejected_alike_in_every_formulation) {
    check_zeros(KT_FORMULATION_TREE, false);
    check_zeros(KT_FORMULATION_TREE, true);
    check_zeros(KT_FORMULATION_ABSOLUTE, false);
}

/* A screw so fast that its slide overflows has no free bodies. */
KT_TEST(state_that_free_bodies_cannot_have_is_rejected) {
    kt_lone lone;
    kt_error error = {KT_OK, "", ""};
    const double q = 0.0, v = 1e300;
    kt_lone_make(&lone, KT_JOINT_SCREW, 2.0);
    lone.body.joint.pitch = 1e10;
    const kt_either e = simulate(&lone, KT_FORMULATION_ABSOLUTE);
    kt_check_equal_int("screw", kt_either_set_state(e, 0.0, &q, &v, &error), KT_ERROR_NOT_FINITE);
    kt_note("%s: %s", error.where, error.message);
    kt_check_near("velocity", kt_either_velocities(e)[0], 0.0, 0.0);
}
