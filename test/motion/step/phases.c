/* Parts of a simulation: an inactive part has no hook in any phase, and every part resumes from a checkpoint. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"

#include "motion/simulation/scenes.h"

#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT_HOOKS(result, phase, parameters, meaning)                                                                \
    for (size_t i = 0; phases->phase[i] != NULL; i++)                                                                  \
        count++;

static int count_step_hooks(const kt_simulation *simulation) {
    const kt_phases *phases = &simulation->phases;
    int count = 0;
    KT_PHASES_OF_STEP(COUNT_HOOKS)
    return count;
}

static int count_record_hooks(const kt_simulation *simulation) {
    const kt_phases *phases = &simulation->phases;
    int count = 0;
    KT_PHASES_OF_RECORDS(COUNT_HOOKS)
    return count;
}

/* A slider with a stop at 1 m, or with none. */
typedef struct slider {
    kt_body body;
    kt_effect stop;
    kt_description description;
    kt_model *model;
} slider;

static void make_slider(slider *s, bool stops) {
    s->body = kt_body_of("slider", NULL, KT_JOINT_PRISMATIC, 1.0);
    s->stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "slider");
    s->stop.upper = 1.0;
    s->stop.lower = -1.0;
    s->stop.stiffness = 1000.0;
    s->description = kt_description_of(&s->body, 1, NULL, 0, &s->stop, stops);
    s->model = kt_scene_compile(&s->description);
}

/* The hooks in a step: a failure is explained, and the state is copied at the end. */
KT_TEST(motion_without_features_is_judged_by_no_part) {
    kt_run run = kt_run_default();
    slider s;
    make_slider(&s, false);
    const kt_simulation *simulation = kt_test_simulation(s.model, &run, NULL);
    kt_check_equal_int("hooks in a step", count_step_hooks(simulation), 2);
    kt_check_equal_int("hooks of records", count_record_hooks(simulation), 0);
    kt_check_true("no part judges tries", !simulation->phases.may_repeat);
}

/* Inputs become a part of steps with the first call that sets some. */
KT_TEST(inputs_take_part_once_they_are_set) {
    const double torque = 1.0;
    kt_run run = kt_run_default();
    kt_error error;
    slider s;
    make_slider(&s, false);
    kt_simulation *simulation = kt_test_simulation(s.model, &run, NULL);
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &torque, &error), &error);
    kt_check_equal_int("hooks in a step", count_step_hooks(simulation), 3);
    (void)kt_fine("step", kt_simulation_advance(simulation, 1.0, &error), &error);
    kt_check_near("the torque acts", kt_simulation_velocities(simulation)[0], 1.0, 1e-9);
}

KT_TEST(stop_judges_adaptive_steps_alone) {
    kt_run run = kt_run_default();
    slider s;
    make_slider(&s, true);
    const kt_simulation *adaptive = kt_test_simulation(s.model, &run, NULL);
    kt_check_equal_int("hooks in an adaptive step", count_step_hooks(adaptive), 4);
    kt_check_true("it is judged", adaptive->phases.may_repeat);
    kt_check_equal_int("hooks of its records", count_record_hooks(adaptive), 1);
    run.step = 0.01;
    const kt_simulation *fixed = kt_test_simulation(s.model, &run, NULL);
    kt_check_equal_int("hooks in a fixed step", count_step_hooks(fixed), 2);
    kt_check_true("it is not judged", !fixed->phases.may_repeat);
    kt_check_equal_int("hooks of its records", count_record_hooks(fixed), 1);
}

static int passes_half(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0] - 0.5;
    return 0;
}

KT_TEST(event_joins_when_it_is_added) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error;
    slider s;
    make_slider(&s, false);
    options.events = 1;
    kt_simulation *simulation = kt_test_simulation(s.model, &run, &options);
    kt_check_true("no part judges tries", !simulation->phases.may_repeat);
    const kt_event event = {.name = "half", .function = passes_half};
    kt_need_fine("added", kt_simulation_event_add(simulation, &event, &error), &error);
    kt_check_equal_int("hooks in a step", count_step_hooks(simulation), 6);
    kt_check_true("the event judges tries", simulation->phases.may_repeat);
}

/* ---- checkpoints of a run with everything ------------------------------------------------------------------------ */

/* Four feet with friction on the ground, a stop, a torque of time, an event and a balance. */
static const char everything[] =
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
    "  - {name: b, joint: {type: free, position: {position: [0, 0, 0.12]}, velocity: {linear: [0.4, 0.1, 0],"
    " angular: [0.5, 1, 0]}}, mass: 2, inertia: [0.01, 0.02, 0.02], markers: {k: [0.2, 0.1, -0.1], l: [0.2, -0.1, "
    "-0.1],"
    " m: [-0.2, 0.1, -0.1], n: [-0.2, -0.1, -0.1]}}\n"
    "  - {name: arm, joint: {type: revolute, axis: y, at: [0, 3, 0], position: 0.7}, mass: 1, com: [0, 0, -0.5],"
    " inertia: [0.1, 0.1, 0.1]}\n"
    "  - {name: cart, joint: {type: prismatic, axis: x, at: [0, 5, 0], velocity: 1}, mass: 1}\n"
    "effects:\n"
    "  - {name: k, type: contact, point: b.k, radius: 0, plane: world, restitution: 0.3, friction: 0.4}\n"
    "  - {name: l, type: contact, point: b.l, radius: 0, plane: world, restitution: 0.3, friction: 0.4}\n"
    "  - {name: m, type: contact, point: b.m, radius: 0, plane: world, restitution: 0.3, friction: 0.4}\n"
    "  - {name: n, type: contact, point: b.n, radius: 0, plane: world, restitution: 0.3, friction: 0.4}\n"
    "  - {type: joint_limit, joint: arm, lower: -0.5, upper: 0.9, stiffness: 500}\n"
    "  - {type: joint_spring, joint: cart, stiffness: 40, damping: 0.1}\n"
    "  - {type: motor, joint: arm, torque: {sine: {amplitude: 3, frequency: 2}}}\n"
    "events:\n  - {name: turn, when: position.cart, then: record}\n"
    "simulate: {duration: 0.6}\n";

enum { PLACES = 200, BEHIND = 6 };

/* Whether two simulations have the same bits, except for counts of evaluations: after a checkpoint, stages that the
 * integrator does not save are evaluated again. */
static bool have_same_bits(const kt_simulation *a, const kt_simulation *b) {
    const kt_simulation_sizes *size = &a->size;
    return kt_simulation_time(a) == kt_simulation_time(b) &&
           memcmp(kt_integrator_state(a->integrator), kt_integrator_state(b->integrator), size->n * sizeof(double)) ==
               0 &&
           memcmp(a->contact_state, b->contact_state, size->contacts * sizeof *a->contact_state) == 0 &&
           memcmp(a->event_memory, b->event_memory, size->event * sizeof *a->event_memory) == 0 &&
           memcmp(a->event_root, b->event_root, size->event * sizeof *a->event_root) == 0 &&
           memcmp(&a->memory.contacts, &b->memory.contacts, sizeof a->memory.contacts) == 0;
}

static kt_simulation *start_everything(kt_scene *scene, const kt_model *model, kt_scene_watch **watch) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_run run = scene->run;
    kt_error error;
    options.events = kt_scene_event_room(scene);
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_REACTION | KT_RECORD_BALANCE;
    kt_need_fine("create", kt_simulation_create(model, &run, &options, &simulation, &error), &error);
    kt_need_fine("events", kt_scene_watch_create(scene, model, simulation, NULL, -1, watch, &error), &error);
    return simulation;
}

static void take_steps(kt_simulation *simulation, int count) {
    kt_error error;
    for (int i = 0; i < count; i++)
        kt_need_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
}

KT_TEST(run_with_everything_resumes_with_equal_bits_at_200_places) {
    kt_random random = kt_random_of_test();
    kt_error error;
    kt_scene scene;
    kt_model *model = NULL;
    kt_need_fine("scene", kt_scene_parse("all", everything, sizeof everything - 1, &scene, NULL, NULL, &error), &error);
    kt_model_options options = kt_model_options_default();
    options.settable = kt_scene_needs_settable(&scene);
    kt_need_fine("model", kt_model_compile(&scene.description, &options, &model, &error), &error);
    kt_scene_watch *watch[2];
    kt_simulation *whole = start_everything(&scene, model, &watch[0]);
    const size_t size = kt_simulation_state_size(whole);
    char *block = malloc(size);
    int different = 0;
    for (int k = 0; k < PLACES; k++) {
        take_steps(whole, kt_random_int(&random, 1, 5));
        kt_simulation *other = start_everything(&scene, model, &watch[1]);
        kt_simulation_save(whole, block);
        kt_need_fine("restore", kt_simulation_restore(other, block, &error), &error);
        kt_need_fine("sync", kt_scene_watch_sync(watch[1], other, &error), &error);
        take_steps(whole, BEHIND);
        take_steps(other, BEHIND);
        different += !have_same_bits(whole, other);
        kt_simulation_free(other);
        kt_scene_watch_free(watch[1]);
    }
    const kt_contact_counts contacts = kt_simulation_contacts(whole);
    kt_check_equal_int("places with other bits", different, 0);
    kt_check_above("impacts", (double)contacts.impacts, 4.0);
    kt_check_above("ends of slip", (double)contacts.sticks, 1.0);
    kt_check_above("events", (double)kt_simulation_event_count(whole, "turn"), 1.0);
    free(block);
    kt_simulation_free(whole);
    kt_scene_watch_free(watch[0]);
    kt_model_free(model);
    kt_scene_free(&scene);
}
