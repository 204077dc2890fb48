/* Events: found to rounding and in order. Further subjects are the changes by their actions, and chains without end. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "scenes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- functions and actions --------------------------------------------------------------------------------------- */

/* The values that a function reads, and those that an action receives and sets. */
typedef struct told {
    double level, restitution;
    char letter; /* to be written to `order` */
    char *order;
    int count;
    double time[64], v[64];
} told;

/* The first position, above the level. */
static int height(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error;
    *value = at->q[0] - ((const told *)user)->level;
    return 0;
}

static void note(told *t, double time, double v) {
    if (t->count < 64) {
        t->time[t->count] = time;
        t->v[t->count] = v;
    }
    t->count++;
}

static int bounce(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    told *t = user;
    const double v = -t->restitution * kt_simulation_velocities(simulation)[0];
    note(t, what->time, kt_simulation_velocities(simulation)[0]);
    return kt_simulation_jump(simulation, NULL, &v, error) == KT_OK ? 0 : -1;
}

static int count(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    told *t = user;
    (void)error;
    note(t, what->time, kt_simulation_velocities(simulation)[0]);
    if (t->order != NULL)
        t->order[strlen(t->order)] = t->letter;
    return 0;
}

/* ---- a ball ------------------------------------------------------------------------------------------------------ */

/* One kilogram that falls from 1 m; along x, gravity along -x. */
static void ball_make(kt_lone *lone) {
    kt_lone_make(lone, KT_JOINT_PRISMATIC, 1.0);
    lone->description.gravity = kt_vec3_make(-9.81, 0.0, 0.0);
    lone->body.joint.position[0] = 1.0;
}

static kt_model *ball_model(void) {
    kt_lone lone;
    ball_make(&lone);
    return kt_scene_compile(&lone.description);
}

static kt_simulation *simulate(const kt_model *model, const kt_run *run, int events, unsigned record) {
    kt_simulation_options options = kt_simulation_options_default();
    options.events = events;
    options.record = record;
    return kt_test_simulation(model, run, &options);
}

/* The default run of a ball. */
static kt_simulation *drop_ball(int events, unsigned record) {
    const kt_run run = kt_run_default();
    return simulate(ball_model(), &run, events, record);
}

static void add(kt_simulation *simulation, const kt_event *event) {
    kt_error error = {0};
    (void)kt_fine("adds an event", kt_simulation_event_add(simulation, event, &error), &error);
}

/* At the level, downwards. */
static void add_falling(kt_simulation *simulation, const char *name, kt_event_action *action, told *t) {
    add(simulation,
        &(kt_event){.name = name, .function = height, .action = action, .user = t, .direction = KT_DIRECTION_FALLING});
}

/* The n-th impact, from 0: at T + 2 T (e + ... + e^n), with T = sqrt(2 h / g). */
static double time_of_impact(int n, double restitution) {
    double first = sqrt(2.0 / 9.81), sum = first;
    for (int i = 1; i <= n; i++)
        sum += 2.0 * first * pow(restitution, i);
    return sum;
}

KT_TEST(impacts_of_a_ball_are_found_to_rounding_by_every_method) {
    kt_model *model = ball_model();
    KT_WORST when = kt_worst_make("time of an impact, s"), speed = kt_worst_make("speed at the ninth, m/s");
    for (int m = 0; m < kt_method_count(); m++) {
        const kt_method *method = kt_method_at(m);
        if (method->order < 2)
            continue;
        for (int fixed = kt_method_is_adaptive(method) ? 0 : 1; fixed < 2; fixed++) {
            kt_error error = {0};
            told t = {.restitution = 0.8};
            kt_run run = kt_run_default();
            run.integrator = method->name;
            run.step = fixed ? 0.01 : 0.0;
            kt_simulation *simulation = simulate(model, &run, 1, 0);
            add_falling(simulation, "impact", bounce, &t);
            (void)kt_fine(method->name, kt_simulation_advance(simulation, 3.5, &error), &error);
            kt_check_equal_int(method->name, t.count, 9);
            for (int n = 0; n < 9 && n < t.count; n++)
                kt_worst_near(&when, t.time[n], time_of_impact(n, 0.8), 1e-12, "%s, %d", method->name, n);
            if (t.count > 8)
                kt_worst_near(&speed, t.v[8], -sqrt(2.0 * 9.81) * pow(0.8, 8), 1e-12, "%s", method->name);
        }
    }
}

/* The impacts accumulate at T (1 + e) / (1 - e). The time does not advance beyond this limit, and the error reports
 * it. */
KT_TEST(chain_of_events_without_end_ends_in_words) {
    kt_error error = {0};
    told t = {.restitution = 0.5};
    kt_simulation *simulation = drop_ball(1, 0);
    add_falling(simulation, "impact", bounce, &t);
    kt_check_equal_int("status", kt_simulation_advance(simulation, 3.0, &error), KT_ERROR_STEP);
    kt_check_contains("message", error.message, "without end");
    kt_check_contains("where", error.where, "impact");
    kt_check_near("where impacts accumulate, s", kt_simulation_time(simulation), sqrt(2.0 / 9.81) * 3.0, 1e-9);
}

/* Puts the ball 3e-12 m above the floor again. */
static int lift(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const double q = 3e-12, v = -1.0;
    (void)what, (void)user;
    return kt_simulation_jump(simulation, &q, &v, error) == KT_OK ? 0 : -1;
}

/* Events follow each other at equal intervals of 3e-12 s. After 64 of them in a row, the error reports the chain, long
 * before the limit of 10,000 instants. */
KT_TEST(events_in_a_row_at_once_end_in_words) {
    kt_error error = {0};
    told t = {.restitution = 0.0};
    kt_simulation *simulation = drop_ball(1, 0);
    add_falling(simulation, "floor", lift, &t);
    kt_check_equal_int("status", kt_simulation_advance(simulation, 3.0, &error), KT_ERROR_STEP);
    kt_check_contains("message", error.message, "without end");
    kt_check_below("events", (double)kt_simulation_event_count(simulation, "floor"), 70.0);
}

/* With an energy balance, the energy lost in an impact counts as dissipated. The first impact dissipates 9.81 J (1 -
 * e^2). */
KT_TEST(energy_that_a_jump_loses_is_in_the_balance) {
    told t = {.restitution = 0.8};
    kt_simulation *simulation = drop_ball(1, KT_RECORD_BALANCE);
    add_falling(simulation, "impact", bounce, &t);
    kt_test_advance(simulation, 1.0);
    kt_check_equal_int("impacts", t.count, 1);
    kt_check_near("dissipated, J", kt_simulation_work(simulation).dissipated, 9.81 * (1.0 - 0.64), 1e-11);
    kt_check_near("supplied, J", kt_simulation_work(simulation).supplied, 0.0, 1e-11);
}

/* ---- what is found ----------------------------------------------------------------------------------------------- */

/* x = 0.5 - t + t^2, by a force: above 0.25 but for t = 0.5, in steps of 10 s; a level of 0.25 + 1e-6 is crossed twice
 * within 2 ms. */
KT_TEST(two_roots_in_one_step_are_found_where_a_parabola_shows_them) {
    kt_lone lone;
    told t = {.level = 0.25 + 1e-6};
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    lone.description.gravity = kt_vec3_make(2.0, 0.0, 0.0);
    lone.body.joint.position[0] = 0.5;
    lone.body.joint.velocity[0] = -1.0;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 10.0, 10.0);
    kt_simulation *simulation = simulate(model, &run, 1, 0);
    add(simulation, &(kt_event){.name = "level", .function = height, .action = count, .user = &t});
    kt_test_advance(simulation, 10.0);
    kt_check_equal_int("events", t.count, 2);
    kt_check_near("first, s", t.time[0], 0.5 - 1e-3, 1e-12);
    kt_check_near("second, s", t.time[1], 0.5 + 1e-3, 1e-12);
}

static int sine(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error;
    (void)user;
    *value = sin(at->q[0]);
    return 0;
}

static int square_wave(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error;
    *value = fabs(at->t - *(const double *)user) < 1e-3 ? 1.0 : -1.0;
    return 0;
}

static double edge_of_wave(void *user, double t) {
    const double middle = *(const double *)user;
    return t < middle ? middle : HUGE_VAL;
}

/* A wheel turns freely at 7 rad/s from 0.1 rad. It passes multiples of pi at 0.1 + 7 t = k pi, for any length of steps.
 * A pulse of 2 ms is seen, since its middle is given as a corner. */
KT_TEST(turns_and_pulses_are_found_however_long_the_steps_are) {
    static const char *const methods[] = {"auto", "dopri5", "bs32", "dop853", "rkc2", "radau5", "rodas5p"};
    static const double pi = 3.14159265358979323846;
    double middle = 13.37;
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_REVOLUTE, 1.0);
    lone.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    lone.body.joint.position[0] = 0.1;
    lone.body.joint.velocity[0] = 7.0;
    kt_model *model = kt_scene_compile(&lone.description);
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; m++) {
        told t = {.level = 0.0};
        kt_run run = kt_run_default();
        run.integrator = methods[m];
        run.duration = run.interval = 28.0;
        kt_simulation *simulation = simulate(model, &run, 2, 0);
        kt_note("%s", methods[m]);
        add(simulation, &(kt_event){.name = "turn", .function = sine, .action = count, .user = &t});
        add(simulation,
            &(kt_event){.name = "pulse", .function = square_wave, .breakpoint = edge_of_wave, .user = &middle});
        kt_test_advance(simulation, 28.0);
        kt_check_equal_int("turns", t.count, 62);
        for (int k = 0; k < t.count && k < 62; k += 20)
            kt_check_near("turn, s", t.time[k], ((k + 1) * pi - 0.1) / 7.0, 16.0 * DBL_EPSILON * t.time[k]);
        kt_check_equal_int("pulse, both edges", (long)kt_simulation_event_count(simulation, "pulse"), 2);
    }
}

/* Two levels are crossed at one time, up to rounding. The event that was added first comes first, for any signs. */
KT_TEST(events_at_one_time_happen_in_the_order_in_which_they_were_added) {
    kt_error error = {0};
    char order[16] = "";
    told a = {.level = 1e-13, .letter = 'a', .order = order}, b = {.level = 0.0, .letter = 'b', .order = order};
    told c = {.level = 0.5, .letter = 'c', .order = order};
    kt_simulation *simulation = drop_ball(3, 0);
    add(simulation, &(kt_event){.name = "b", .function = height, .action = count, .user = &b});
    add(simulation, &(kt_event){.name = "a", .function = height, .action = count, .user = &a});
    add(simulation, &(kt_event){.name = "c", .function = height, .action = count, .user = &c});
    kt_test_advance(simulation, 1.0);
    kt_check_text("order", order, "cba");
    kt_check_true("one time", a.time[0] == b.time[0]);
    const kt_event more = {.name = "d", .function = height, .user = &b};
    kt_check_equal_int("a fourth", kt_simulation_event_add(simulation, &more, &error), KT_ERROR_MEMORY);
    kt_check_contains("words", error.message, "room for 3 events");
}

/* A value of zero at the start is no event; one direction leaves the other out; a limit ends an event. */
KT_TEST(directions_limits_and_starts_at_zero) {
    kt_lone lone;
    told rising = {.level = 0.0}, falling = {.level = 0.0}, twice = {.level = 0.0};
    kt_pendulum_make(&lone, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    const kt_run run = kt_run_default();
    kt_simulation *simulation = simulate(model, &run, 3, 0);
    add(simulation,
        &(kt_event){
            .name = "rising", .function = height, .action = count, .user = &rising, .direction = KT_DIRECTION_RISING});
    add(simulation, &(kt_event){.name = "falling",
                                .function = height,
                                .action = count,
                                .user = &falling,
                                .direction = KT_DIRECTION_FALLING});
    add(simulation, &(kt_event){.name = "twice", .function = height, .action = count, .user = &twice, .limit = 2});
    /* half a period: 2 K(sin(theta0 / 2)) sqrt(l / g), here 1.0092 s */
    kt_test_advance(simulation, 6.5);
    kt_check_equal_int("rising", rising.count, 3);
    kt_check_equal_int("falling", falling.count, 3);
    kt_check_equal_int("limited", twice.count, 2);
    kt_check_equal_int("by name", (long long)kt_simulation_event_count(simulation, "falling"), 3);
    static const char *const names[] = {"rising", "falling", "twice"};
    size_t listed = 0;
    for (const char *name; (name = kt_simulation_event_name(simulation, listed)) != NULL; listed++)
        kt_check_text("a name", name, names[listed]);
    kt_check_equal_int("all events are listed", (long long)listed, (long long)(sizeof names / sizeof *names));
}

/* How many of the times lie behind `from`, up to `to`. */
static int within(const told *t, double from, double to) {
    int number = 0;
    for (int i = 0; i < t->count && i < 64; i++)
        number += t->time[i] > from && t->time[i] <= to;
    return number;
}

/* A pendulum whose event is off from 2 s to 4 s. A second pendulum continues from its checkpoint at 4 s. The
 * oracle is one whose event is always on. */
KT_TEST(events_that_are_off_do_not_happen) {
    kt_lone lone;
    kt_error error = {0};
    told seen[3] = {{.level = 0.0}, {.level = 0.0}, {.level = 0.0}};
    kt_simulation *s[3] = {NULL};
    kt_pendulum_make(&lone, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    const kt_run run = kt_run_default();
    for (int i = 0; i < 3; i++) {
        s[i] = simulate(model, &run, 1, 0);
        add(s[i], &(kt_event){.name = "level", .function = height, .action = count, .user = &seen[i]});
    }
    kt_test_advance(s[2], 6.5);
    kt_test_advance(s[0], 2.0);
    (void)kt_fine("sets off", kt_simulation_event_set_on(s[0], "level", false, &error), &error);
    kt_test_advance(s[0], 4.0);
    const int before = within(&seen[2], 0.0, 2.0), left_out = within(&seen[2], 2.0, 4.0);
    const int behind = within(&seen[2], 4.0, 6.5);
    kt_note("%d before, %d left out, %d behind", before, left_out, behind);
    kt_check_true("there are some", before > 0 && left_out > 0 && behind > 0);
    kt_check_equal_int("off", seen[0].count, before);
    (void)kt_scene_hand_over(s[0], s[1]);
    kt_test_advance(s[1], 6.5);
    kt_check_equal_int("off behind the checkpoint", seen[1].count, 0);
    (void)kt_fine("arms", kt_simulation_event_set_on(s[0], "level", true, &error), &error);
    kt_test_advance(s[0], 6.5);
    kt_check_equal_int("on again", seen[0].count, before + behind);
    kt_check_equal_int("by name", (long long)kt_simulation_event_count(s[0], "level"), before + behind);
    kt_check_equal_int("no event", kt_simulation_event_set_on(s[0], "up", true, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("named", error.where, "up");
}

/* An event that is off has no value. Another value is left in the memory of each of the two simulations. */
KT_TEST(equal_states_give_equal_bytes_with_events_that_are_off) {
    static double block[2][512];
    kt_lone lone;
    kt_error error = {0};
    told seen = {.level = 0.0};
    kt_simulation *s[3] = {NULL};
    kt_pendulum_make(&lone, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    const kt_run run = kt_run_fixed("rk4", 0.01, 10.0);
    for (int i = 0; i < 3; i++) {
        s[i] = simulate(model, &run, 2, 0);
        add(s[i], &(kt_event){.name = "level", .function = height, .user = &seen});
        add(s[i], &(kt_event){.name = "on", .function = height, .user = &seen});
        (void)kt_fine("runs", kt_simulation_advance(s[i], 0.1 + 0.2 * i, &error), &error);
    }
    (void)kt_fine("sets off", kt_simulation_event_set_on(s[2], "level", false, &error), &error);
    for (int i = 0; i < 2; i++) {
        (void)kt_scene_hand_over(s[2], s[i]);
        (void)kt_fine("runs", kt_simulation_advance(s[i], 1.5, &error), &error);
        kt_need(kt_check_below("bytes", (double)kt_simulation_state_size(s[i]), sizeof block[i]));
        kt_simulation_save(s[i], block[i]);
    }
    kt_check_true("equal bytes", memcmp(block[0], block[1], kt_simulation_state_size(s[0])) == 0);
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

static int keep_events(const kt_record *record, void *user) {
    told *t = user;
    if (record->event != NULL)
        note(t, record->t, record->v[0]);
    else
        t->level = record->t; /* the last of the others */
    return 0;
}

KT_TEST(event_that_stops_ends_the_run_with_its_record_and_a_call_goes_on) {
    told t = {.level = 0.0}, kept = {.level = 0.0};
    kt_model *model = ball_model();
    kt_run run = kt_run_default();
    run.interval = 0.1;
    kt_simulation *simulation = simulate(model, &run, 1, 0);
    add(simulation, &(kt_event){.name = "landed", .function = height, .user = &t, .stop = true});
    kt_test_run(simulation, keep_events, &kept);
    const double expected = sqrt(2.0 / 9.81);
    kt_check_near("time of the end, s", kt_simulation_time(simulation), expected, 1e-14);
    kt_check_true("by the event", kt_simulation_stopped(simulation) != NULL &&
                                      strcmp(kt_simulation_stopped(simulation)->name, "landed") == 0);
    kt_check_equal_int("records of events", kept.count, 1);
    kt_check_near("time of the record, s", kept.time[0], expected, 1e-14);
    kt_check_near("speed in the record", kept.v[0], -sqrt(2.0 * 9.81), 1e-13);
    kt_check_near("last record before, s", kept.level, 0.4, 1e-15);
    kt_test_run(simulation, keep_events, &kept);
    kt_check_true("to the end", kt_simulation_time(simulation) == run.duration && !kt_simulation_stopped(simulation));
}

static int fail(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)user;
    *value = 1.0;
    return at->t > 0.25 ? kt_error_set(error, KT_ERROR_EFFECT, NULL, "the sensor is cold") != KT_OK : 0;
}

static int fall_apart(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)user;
    (void)error;
    *value = at->t > 0.25 ? (double)NAN : 1.0;
    return 0;
}

KT_TEST(function_that_fails_ends_the_call_and_leaves_the_state) {
    kt_model *model = ball_model();
    const kt_run run = kt_run_default();
    for (int i = 0; i < 2; i++) {
        kt_error error = {0};
        kt_simulation *simulation = simulate(model, &run, 1, 0);
        add(simulation, &(kt_event){.name = "cold", .function = i == 0 ? fail : fall_apart});
        kt_check_equal_int("status", kt_simulation_advance(simulation, 1.0, &error),
                           i == 0 ? KT_ERROR_EFFECT : KT_ERROR_NOT_FINITE);
        kt_check_contains("where", error.where, "event 'cold'");
        const double t = kt_simulation_time(simulation), x = kt_simulation_positions(simulation)[0];
        kt_check_below("time of the last step that succeeded", t, 0.25);
        kt_check_near("position there", x, 1.0 - 0.5 * 9.81 * t * t, 1e-14);
    }
}

static int jump_nowhere(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    (void)what, (void)user;
    return kt_simulation_jump(simulation, NULL, &(double){(double)NAN}, error) == KT_OK ? 0 : -1;
}

KT_TEST(action_that_fails_names_the_event_and_what_its_call_named) {
    kt_error error = {0};
    told t = {.level = 0.5};
    kt_simulation *simulation = drop_ball(1, 0);
    add(simulation, &(kt_event){.name = "half", .function = height, .action = jump_nowhere, .user = &t});
    kt_check_equal_int("status", kt_simulation_advance(simulation, 1.0, &error), KT_ERROR_NOT_FINITE);
    kt_check_text("where", error.where, "event 'half' at t = 0.319275428 s, joint 'block'");
    kt_check_contains("message", error.message, "its velocity is nan");
}

/* ---- checkpoints, memory ----------------------------------------------------------------------------------------- */

KT_TEST(checkpoint_between_events_goes_on_with_the_same_bits_and_nothing_allocates) {
    kt_error error = {0};
    told t = {.restitution = 0.8}, again = t;
    kt_model *model = ball_model();
    const kt_run run = kt_run_default();
    kt_event event = {.name = "impact",
                      .function = height,
                      .action = bounce,
                      .user = &t,
                      .direction = KT_DIRECTION_FALLING,
                      .limit = 5};
    kt_simulation *one = simulate(model, &run, 1, 0);
    kt_simulation *two = simulate(model, &run, 1, 0);
    add(one, &event);
    event.user = &again;
    add(two, &event);
    kt_test_advance(one, 1.6);
    (void)kt_scene_hand_over(one, two);
    kt_interpose_start();
    const kt_status whole = kt_simulation_advance(one, 4.0, &error);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    (void)kt_fine("whole", whole, &error);
    kt_test_advance(two, 4.0);
    kt_scene_check_equal("state", two, one);
    kt_check_equal_int("impacts, whole", t.count, 5);
    kt_check_equal_int("impacts, with those before", (long long)kt_simulation_event_count(two, "impact"), 5);
}

/* ---- a run that pauses ------------------------------------------------------------------------------------------- */

typedef struct pausing {
    told rows;
    int pause_at; /* stops at each record from this one on; -1: never */
    int taken;
} pausing;

static int pause(const kt_record *record, void *user) {
    pausing *p = user;
    note(&p->rows, record->t, record->v[0]);
    return p->pause_at >= 0 && p->taken++ >= p->pause_at ? 1 : 0;
}

/* Runs to the end through all pauses; after each, in another simulation from a checkpoint. */
static void run_with_pauses(const kt_model *model, const kt_run *run, const kt_event *event, pausing *p) {
    kt_simulation *now = simulate(model, run, 1, 0);
    kt_error error = {0};
    add(now, event);
    while (kt_simulation_run(now, pause, p, &error) == KT_ERROR_CALLBACK) {
        kt_simulation *next = simulate(model, run, 1, 0);
        add(next, event);
        (void)kt_scene_hand_over(now, next);
        now = next;
    }
}

/* Records before and behind each of the impacts; a pause at any of them, and a checkpoint there, changes none. */
KT_TEST(run_that_pauses_at_every_record_gives_the_same_records) {
    told t = {.restitution = 0.8};
    pausing whole = {.pause_at = -1}, paused = {.pause_at = 0};
    kt_model *model = ball_model();
    kt_run run = kt_run_default();
    run.interval = 0.25;
    run.duration = 3.0;
    const kt_event event = {.name = "impact",
                            .function = height,
                            .action = bounce,
                            .user = &t,
                            .direction = KT_DIRECTION_FALLING,
                            .record = true};
    run_with_pauses(model, &run, &event, &whole);
    run_with_pauses(model, &run, &event, &paused);
    kt_check_equal_int("records", whole.rows.count, 13 + 2 * 6);
    kt_check_equal_int("records with pauses", paused.rows.count, whole.rows.count);
    kt_check_equal_bits("times", paused.rows.time, whole.rows.time, 25);
    kt_check_equal_bits("velocities", paused.rows.v, whole.rows.v, 25);
    kt_check_near("behind the first impact", whole.rows.v[3], -0.8 * whole.rows.v[2], 1e-13);
}
