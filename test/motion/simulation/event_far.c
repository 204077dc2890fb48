/* Fixed steps far from all events take no evaluation for the search. A pendulum has a torque that changes with every
 * step, so that its slopes at the ends of steps serve no other purpose. A twin has another event that is never far,
 * whose search needs all slopes: the two have the same events and the same motion, to the last bit. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parsed.h"
#include "random.h"
#include "scenes.h"

#include <math.h>
#include <setjmp.h>
#include <stdio.h>

enum { STEPS = 1000, EVENTS_MOST = 400, SETTLING = 10 };

/* The event of a pendulum, its twin's, and their times. */
typedef struct watch {
    double factor, phase; /* of a sine of the angle */
    double time[EVENTS_MOST];
    int count;
} watch;

static int sine_of_angle(const kt_instant *at, double *value, kt_error *error, void *user) {
    const watch *w = user;
    (void)error;
    *value = sin(w->factor * at->q[0] + w->phase);
    return 0;
}

static int unreached(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0] - 20.0;
    return 0;
}

/* Positive, and its range along a step exceeds its least value. */
static int restless(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = 1e-9 + 1e6 * at->q[0] * at->q[0] + 1e9 * at->v[0] * at->v[0];
    return 0;
}

static int note_time(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    watch *w = user;
    (void)simulation, (void)error;
    if (w->count < EVENTS_MOST)
        w->time[w->count++] = what->time;
    return 0;
}

static kt_model *make_pendulum(bool stops) {
    kt_error error;
    kt_model *model;
    kt_body body = kt_body_default();
    kt_effect stop = kt_effect_default();
    body.name = "arm";
    body.joint.type = KT_JOINT_REVOLUTE;
    body.joint.position[0] = 0.4;
    body.mass = 1.0;
    body.com = kt_vec3_make(0.0, -0.4, 0.0);
    stop.type = KT_EFFECT_JOINT_LIMIT;
    stop.joint = body.name;
    stop.lower = -2.0;
    stop.restitution = 0.5;
    kt_description d = kt_description_default();
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    d.bodies = &body;
    d.body_count = 1;
    d.effects = &stop;
    d.effect_count = stops ? 1 : 0;
    kt_need_fine("compiles", kt_model_compile(&d, NULL, &model, &error), &error);
    return model;
}

/* Runs 1 s with another torque in each step. Returns the evaluations; end: angle and rate. */
static uint64_t run(const kt_model *model, const char *method, watch *w, const kt_event *events, int count,
                    double end[2]) {
    kt_error error = {0};
    kt_run r = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation;
    r.integrator = method;
    r.step = 1e-3;
    options.events = 2;
    w->count = 0;
    kt_need_fine("begins", kt_simulation_create(model, &r, &options, &simulation, &error), &error);
    for (int i = 0; i < count; i++)
        kt_need_fine("takes an event", kt_simulation_event_add(simulation, &events[i], &error), &error);
    for (int i = 0; i < STEPS; i++) {
        const double torque = sin((double)i);
        kt_need_fine("takes a torque", kt_simulation_set_torque(simulation, &torque, &error), &error);
        kt_need_fine("steps", kt_simulation_tick(simulation, r.step, &error), &error);
    }
    end[0] = kt_simulation_positions(simulation)[0];
    end[1] = kt_simulation_velocities(simulation)[0];
    const uint64_t evaluations = kt_simulation_counts_of(simulation).evaluations;
    kt_simulation_free(simulation);
    return evaluations;
}

static const struct {
    const char *name;
    int stages;
} method[] = {{"rk4", 4}, {"heun", 2}, {"euler", 1}};
enum { METHODS = sizeof method / sizeof *method };

KT_TEST(step_far_from_an_event_evaluates_its_stages_only) {
    watch w = {0};
    const kt_event event = {.name = "up", .function = unreached};
    kt_model *model = make_pendulum(false);
    for (int m = 0; m < METHODS; m++) {
        double with[2], without[2];
        const uint64_t own = run(model, method[m].name, &w, &event, 1, with);
        const uint64_t least = run(model, method[m].name, &w, NULL, 0, without);
        kt_check_equal_int("evaluations with an event", (int64_t)own, (int64_t)method[m].stages * STEPS);
        kt_check_equal_int("evaluations without", (int64_t)least, (int64_t)method[m].stages * STEPS);
        kt_check_equal_bits("the motion", with, without, 2);
    }
    kt_model_free(model);
}

KT_TEST(step_far_from_a_contact_evaluates_its_stages_only) {
    watch w = {0};
    kt_model *model = make_pendulum(true);
    for (int m = 0; m < METHODS; m++) {
        double end[2];
        kt_check_equal_int("evaluations", (int64_t)run(model, method[m].name, &w, NULL, 0, end),
                           (int64_t)method[m].stages * STEPS);
    }
    kt_model_free(model);
}

/* A box rests on four feet that stick, while the force on it changes with every step. The reactions
 * of closed contacts are far from zero, too. */
static int64_t evaluations_of_box(const char *name, double friction, double *moved) {
    kt_parsed m;
    kt_error error = {0};
    char text[2048];
    size_t used = (size_t)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n  - name: box\n    mass: 2\n    inertia: [0.02, 0.05, 0.06]\n"
        "    joint: {type: free, position: {position: [0, 0, 0.1]}}\n    markers: {a: [0.2, 0.1, -0.1], b: [0.2, -0.1, "
        "-0.1], c: [-0.2, 0.1, -0.1], d: [-0.2, -0.1, -0.1]}\neffects:\n");
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: f%d, type: contact, point: box.%c, radius: 0, plane: world, axis: z, "
                                 "restitution: 0, friction: %g}\n",
                                 i, 'a' + i, friction);
    kt_parsed_make(&m, text);
    kt_run r = kt_run_fixed(name, 1e-3, 10.0);
    const kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = kt_test_simulation(m.model, &r, &options);
    kt_wrench wrench[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
    uint64_t first = 0;
    for (int i = 0; i < SETTLING + STEPS; i++) {
        wrench[1].force = kt_vec3_make(3.0 + sin((double)i), cos(2.0 * i), sin(3.0 * i));
        kt_need_fine("takes a wrench", kt_simulation_set_wrenches(simulation, wrench, &error), &error);
        kt_need_fine("steps", kt_simulation_tick(simulation, r.step, &error), &error);
        if (i + 1 == SETTLING) /* the feet have closed, and slip */
            first = kt_simulation_counts_of(simulation).evaluations;
    }
    *moved = kt_simulation_positions(simulation)[0];
    return (int64_t)(kt_simulation_counts_of(simulation).evaluations - first);
}

KT_TEST(step_on_closed_contacts_evaluates_its_stages_only) {
    for (int m = 0; m < METHODS; m++) {
        double rests, slides;
        kt_check_equal_int("evaluations of a box that rests", evaluations_of_box(method[m].name, 0.8, &rests),
                           (int64_t)method[m].stages * STEPS);
        kt_check_equal_int("evaluations of a box that slides", evaluations_of_box(method[m].name, 0.05, &slides),
                           (int64_t)method[m].stages * STEPS);
        kt_check_near("rests, m", rests, 0.0, 1e-9);
        kt_check_above("slides, m", slides, 0.1);
    }
}

KT_TEST(skipped_searches_move_no_event) {
    kt_random random = kt_random_of_test();
    kt_model *model = make_pendulum(false);
    int events = 0, saved = 0;
    for (int i = 0; i < 40; i++) {
        watch own = {.factor = kt_random_uniform(&random, 0.5, 60.0), .phase = kt_random_uniform(&random, 0.0, 6.0)};
        watch twin = own;
        const char *name = method[i % METHODS].name;
        const kt_event event[2] = {{.name = "own", .function = sine_of_angle, .action = note_time, .user = &own}};
        const kt_event both[2] = {{.name = "own", .function = sine_of_angle, .action = note_time, .user = &twin},
                                  {.name = "restless", .function = restless}};
        double end[2], twin_end[2];
        const uint64_t evaluations = run(model, name, &own, event, 1, end);
        saved += evaluations < run(model, name, &twin, both, 2, twin_end);
        events += own.count;
        kt_check_equal_int("events", own.count, twin.count);
        kt_check_equal_bits("their times", own.time, twin.time, EVENTS_MOST);
        kt_check_equal_bits("the motions", end, twin_end, 2);
    }
    kt_check_above("events in all", events, 100.0);
    kt_check_equal_int("runs that took fewer evaluations than their twins", saved, 40);
    kt_model_free(model);
}
