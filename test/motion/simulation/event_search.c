/* The search for the time of events: random wheels and pulses, whose events have closed forms. Every step takes a
 * limited number of values of the event's function. If the search finds all events, the closed form must agree. If the
 * search misses events, its counts must report them.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "random.h"
#include "scenes.h"
#include "simulation/simulation.h"

#include <limits.h>
#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* A wheel that turns at `rate`, and the function and counts of the search. */
typedef struct search {
    double rate;           /* rad/s */
    double factor, phase;  /* of the sine, with which the wheel's angle is multiplied at most by 1 */
    double pulse, spacing; /* s: the middle of the pulse, and from corner to corner */
    int calls, found;
    double worst; /* s, of all times of roots */
} search;

static int sine(const kt_instant *at, double *value, kt_error *error, void *user) {
    search *s = user;
    (void)error;
    s->calls++;
    *value = sin(s->factor * at->q[0] + s->phase);
    return 0;
}

static int check_sine(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    search *s = user;
    const double w = s->factor * s->rate, k = nearbyint((w * what->time + s->phase) / pi);
    (void)simulation, (void)error;
    s->found++;
    s->worst = fmax(s->worst, fabs(what->time - (k * pi - s->phase) / w) / what->time);
    return 0;
}

/* How many multiples of pi the sine's argument passes until t. */
static int count_of_sine(const search *s, double t) {
    return (int)(floor((s->factor * s->rate * t + s->phase) / pi) - floor(s->phase / pi));
}

/* One pulse as long as half of the spacing of corners. */
static int pulse(const kt_instant *at, double *value, kt_error *error, void *user) {
    search *s = user;
    (void)error;
    s->calls++;
    *value = fabs(at->t - s->pulse) < 0.25 * s->spacing ? 1.0 : -1.0;
    return 0;
}

static double corner(void *user, double t) {
    const search *s = user;
    const double k = ceil((t - s->pulse) / s->spacing);
    const double next = s->pulse + k * s->spacing;
    return next > t ? next : s->pulse + (k + 1.0) * s->spacing;
}

static int count(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    search *s = user;
    (void)simulation, (void)what, (void)error;
    s->found++;
    return 0;
}

/* Runs to t; returns the most values of the event that a step took. */
static int run_to(kt_simulation *simulation, double t, search *s) {
    kt_error error = {0};
    int most = 0;
    while (kt_simulation_time(simulation) < t) {
        s->calls = 0;
        kt_need_fine("steps", kt_simulation_step(simulation, t, &error), &error);
        most = s->calls > most ? s->calls : most;
    }
    return most;
}

typedef struct outcome {
    int most, right, cut, missed, silent;
    double worst;
} outcome;

typedef struct kind {
    const char *method;
    double step, fastest, finest; /* s, 0: adaptive; rad/s; of a step, from corner to corner */
    bool is_pulse;
    int count;
} kind;

/* At most ten roots of the sine. */
static search choose(kt_random *random, const kind *what, double t) {
    search s = {.rate = exp(kt_random_uniform(random, 0.0, log(what->fastest)))};
    s.factor = fmin(1.0, kt_random_uniform(random, 0.0, 10.0 * pi) / (s.rate * t));
    s.phase = kt_random_uniform(random, 0.1, 3.0);
    s.spacing = 1e-3 * exp(kt_random_uniform(random, log(what->finest), log(0.5)));
    s.pulse = kt_random_uniform(random, 0.01, 0.99) * t;
    if (what->is_pulse)
        s.rate = 1.0;
    return s;
}

static kt_simulation *prepare(const kt_model *model, const kind *what, double t, search *s) {
    const kt_event sines = {.name = "sine", .function = sine, .action = check_sine, .user = s};
    const kt_event pulses = {.name = "pulse", .function = pulse, .breakpoint = corner, .action = count, .user = s};
    const double q = 0.0;
    kt_error error = {0};
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_fixed(what->method, what->step, t);
    run.interval = t;
    options.events = 1;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_need_fine("starts", kt_simulation_set_state(simulation, 0.0, &q, &s->rate, &error), &error);
    kt_need_fine("adds", kt_simulation_event_add(simulation, what->is_pulse ? &pulses : &sines, &error), &error);
    return simulation;
}

static void judge(const kt_simulation *simulation, const kind *what, double t, const search *s, outcome *o) {
    const int expected = what->is_pulse ? 2 : count_of_sine(s, t);
    const kt_event_cuts cuts = kt_simulation_event_cuts(simulation);
    const bool is_told = cuts.count > 0 && cuts.event != NULL && cuts.time >= 0.0 && cuts.time < t;
    o->cut += cuts.count > 0;
    o->right += s->found == expected;
    o->missed += cuts.count == 0 && s->found != expected;
    o->silent += cuts.count > 0 && !is_told;
    if (!what->is_pulse)
        o->worst = fmax(o->worst, s->worst);
}

/* Random events, each for one to twenty milliseconds. */
static outcome try_many(const kind *what) {
    kt_random random = kt_random_of_test();
    kt_lone lone;
    outcome o = {0};
    kt_lone_make(&lone, KT_JOINT_REVOLUTE, 1.0);
    lone.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    for (int i = 0; i < what->count; i++) {
        const double t = 1e-3 * kt_random_int(&random, 1, 20);
        search s = choose(&random, what, t);
        kt_simulation *simulation = prepare(model, what, t, &s);
        const int most = run_to(simulation, t, &s);
        o.most = most < 0 || most > o.most ? most : o.most;
        judge(simulation, what, t, &s, &o);
    }
    kt_note("%s: of %d all events were found in %d, %d cut", what->method, what->count, o.right, o.cut);
    kt_check_below("most values of an event in a step", o.most, KT_EVENT_EVALUATIONS + 0.5);
    kt_check_above("some need many", o.most, 300.0);
    kt_check_equal_int("missed, and not counted", o.missed, 0);
    kt_check_equal_int("counted without time or event", o.silent, 0);
    return o;
}

KT_TEST(steps_of_fixed_length_take_limited_values_and_count_what_they_cut) {
    const outcome wheel =
        try_many(&(kind){.method = "rk4", .step = 1e-3, .fastest = 1e9, .finest = 1e-5, .count = 200});
    const outcome pulses = try_many(
        &(kind){.method = "rk4", .step = 1e-3, .fastest = 1e9, .finest = 1e-5, .is_pulse = true, .count = 200});
    kt_check_below("times of events, relative", wheel.worst, 1e-13);
    kt_check_above("wheels that are cut", wheel.cut, 20.0);
    kt_check_below("wheels that are cut", wheel.cut, 120.0);
    kt_check_above("pulses that are cut", pulses.cut, 20.0);
    kt_check_below("pulses that are cut", pulses.cut, 180.0);
}

KT_TEST(adaptive_steps_become_shorter_instead) {
    static const char *const methods[] = {"dopri5", "rodas5p"};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; m++) {
        if (kt_method_find(methods[m]) == NULL)
            continue;
        const outcome wheel = try_many(&(kind){.method = methods[m], .fastest = 1e6, .finest = 1e-4, .count = 50});
        const outcome pulses =
            try_many(&(kind){.method = methods[m], .fastest = 1e6, .finest = 1e-4, .is_pulse = true, .count = 50});
        kt_check_below("times of events, relative", wheel.worst, 1e-12);
        kt_check_equal_int("wheels that are cut", wheel.cut, 0);
        kt_check_equal_int("pulses that are cut", pulses.cut, 0);
        kt_check_equal_int("wheels that are right", wheel.right, 50);
        kt_check_equal_int("pulses that are right", pulses.right, 50);
    }
}

KT_TEST(values_of_a_step_are_an_option_with_a_least_number) {
    const double t = 1e-3;
    kt_lone lone;
    kt_error error = {0};
    search s = {.rate = 1e8, .factor = 1e-8, .phase = 1.0};
    kt_run run = kt_run_fixed("rk4", t, t);
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    const double q = 0.0;
    options.events = 1;
    kt_lone_make(&lone, KT_JOINT_REVOLUTE, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    static const int wrong[] = {-1, 1, KT_EVENT_EVALUATIONS_LEAST - 1};
    for (int i = 0; i < 3; i++) {
        options.event_evaluations = wrong[i];
        kt_check_equal_int("is rejected", kt_simulation_create(model, &run, &options, &simulation, &error),
                           KT_ERROR_ARGUMENT);
        kt_check_text("where", error.where, "event_evaluations");
    }
    for (int most = KT_EVENT_EVALUATIONS_LEAST; most < 1000000; most *= 9) {
        options.event_evaluations = most;
        simulation = kt_test_simulation(model, &run, &options);
        (void)kt_fine("starts", kt_simulation_set_state(simulation, 0.0, &q, &s.rate, &error), &error);
        const kt_event event = {.name = "sine", .function = sine, .user = &s};
        (void)kt_fine("adds", kt_simulation_event_add(simulation, &event, &error), &error);
        const int taken = run_to(simulation, t, &s);
        kt_check_above("values", taken, most > KT_EVENT_EVALUATIONS_LEAST ? fmin(most / 4, 1e5 / pi * 4.0) : 3);
        kt_check_below("values", taken, most + 0.5);
        kt_check_equal_int("cut", (long)kt_simulation_event_cuts(simulation).count, taken < 1e5 / pi * 4.0);
    }
}

static int passes(const kt_instant *at, double *value, kt_error *error, void *user) {
    int *calls = user;
    (void)error;
    ++*calls;
    *value = at->q[0] - 0.3;
    return 0;
}

/* A cart that a pole pulls to and fro between two buffers. */
static kt_model *make_cart(kt_body bodies[2], kt_effect *buffers) {
    bodies[0] = bodies[1] = kt_body_default();
    bodies[0].name = "cart";
    bodies[0].joint.type = KT_JOINT_PRISMATIC;
    bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[1].name = "pole";
    bodies[1].parent = "cart";
    bodies[1].joint.type = KT_JOINT_REVOLUTE;
    bodies[1].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    bodies[0].mass = 1.0;
    bodies[1].mass = 0.3;
    bodies[1].com = kt_vec3_make(0.0, 0.0, 0.5);
    bodies[1].inertia = (kt_sym3){.xx = 0.025, .yy = 0.025, .zz = 1e-4};
    *buffers = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "cart");
    buffers->lower = -0.4;
    buffers->upper = 0.4;
    buffers->stiffness = 5e3;
    buffers->damping = 50.0;
    kt_description d = kt_description_of(bodies, 2, NULL, 0, buffers, 1);
    return kt_scene_compile(&d);
}

/* The state that a simulation shows is the one from which it continues: its own checkpoint changes nothing. */
static void check_own_checkpoint(kt_simulation *simulation) {
    static double block[512];
    kt_error error;
    const double *state = kt_simulation_positions(simulation);
    double before[4];
    memcpy(before, state, sizeof before);
    kt_need(kt_check_below("bytes", (double)kt_simulation_state_size(simulation), sizeof block));
    kt_simulation_save(simulation, block);
    (void)kt_fine("restores", kt_simulation_restore(simulation, block, &error), &error);
    kt_check_equal_bits("state", state, before, 4);
}

/* The pole turns so fast that a step contains 10^3 to 10^9 turns. Then the motion of a step is nonsense, and the cart
 * seems to pass 0.3 m at a time that no shorter step confirms. The search ends all the same. */
KT_TEST(events_end_where_steps_are_far_too_long) {
    const double q[2] = {0.1, 0.1};
    const kt_run run = kt_run_fixed("rk4", 1e-3, 1e-3);
    kt_simulation_options options = kt_simulation_options_default();
    kt_body bodies[2];
    kt_effect buffers;
    int rejected = 0;
    options.events = 1;
    kt_model *model = make_cart(bodies, &buffers);
    for (int i = 0; i <= 60; i++) {
        int calls = 0;
        kt_error error = {0};
        const double v[2] = {0.0, 1e7 * pow(10.0, 0.1 * i)};
        const kt_event event = {.name = "passes", .function = passes, .user = &calls};
        kt_simulation *simulation = kt_test_simulation(model, &run, &options);
        kt_need_fine("starts", kt_simulation_set_state(simulation, 0.0, q, v, &error), &error);
        kt_need_fine("adds", kt_simulation_event_add(simulation, &event, &error), &error);
        const bool done = kt_simulation_tick(simulation, 1e-3, &error) == KT_OK;
        const bool missed = !done && strstr(error.message, "steps were cut short for this event") != NULL;
        rejected += missed;
        if (missed) /* the step that failed is not among them */
            kt_check_equal_int("successive misses", (long)simulation->memory.event_missed, 100);
        kt_check_below("values of the event", calls, 100.0 * KT_EVENT_EVALUATIONS);
        check_own_checkpoint(simulation);
    }
    kt_check_above("rejected", rejected, 0.5);
}

/* A function that jumps behind t = 0, and the earliest time above zero at which it was evaluated. */
typedef struct jump_behind_zero {
    double earliest;
    int calls;
} jump_behind_zero;

static int jumps(const kt_instant *at, double *value, kt_error *error, void *user) {
    jump_behind_zero *jump = user;
    (void)error;
    jump->calls++;
    jump->earliest = at->t > 0.0 ? fmin(jump->earliest, at->t) : jump->earliest;
    *value = at->t > 0.0 ? -1.0 : 1.0;
    return 0;
}

/* A root at t = 0 happens at 0, since steps have a floor. Without it the step shrank to 1e-144 s, where radau5 found no
 * number. */
KT_TEST(steps_from_zero_do_not_shrink_without_end) {
    static const struct {
        const char *method;
        double step;
    } ways[] = {{"radau5", 1e-3}, {"rk4", 1e-3}, {"dopri5", 1e-3}, {"radau5", 0.0}, {"dopri5", 0.0}};
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    lone.body.joint.velocity[0] = 1.0;
    kt_model *model = kt_scene_compile(&lone.description);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        jump_behind_zero jump = {.earliest = HUGE_VAL};
        const kt_event event = {.name = "jump", .function = jumps, .user = &jump};
        const kt_run run = kt_run_fixed(ways[i].method, ways[i].step, 1.0);
        kt_simulation_options options = kt_simulation_options_default();
        kt_error error = {0};
        options.events = 1;
        kt_simulation *simulation = kt_test_simulation(model, &run, &options);
        kt_need_fine("adds", kt_simulation_event_add(simulation, &event, &error), &error);
        kt_need_fine(ways[i].method, kt_simulation_tick(simulation, 1e-3, &error), &error);
        kt_check_equal_int("happens", (long)kt_simulation_event_count(simulation, "jump"), 1);
        kt_check_above("earliest time above 0, s", jump.earliest, 1e-35);
        kt_check_below("values", jump.calls, 400.0);
    }
}
