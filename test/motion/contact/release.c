/* Friction of joints that is released, in models whose sets of contacts are masked: it does not act, and the model of
 * its set has the parameters that are set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "model/switching.h"
#include "motion/simulation/parsed.h"

enum { SLIDERS = 2, METHODS = 4 };

static const char *const methods[METHODS] = {"dopri5", "radau5", "rk4", "steps"};
static const double coulomb = 0.8, pull = 1.5;
static const double speeds[SLIDERS] = {0.7, 0.0};

/* Sliders with dry friction that is released at first, on an axis along which nothing acts. */
typedef struct scene {
    kt_body body[SLIDERS];
    kt_effect effect[SLIDERS + 1];
    kt_description description;
} scene;

static void scene_make(scene *s) {
    static const char *const names[SLIDERS] = {"a", "b"};
    *s = (scene){.description = kt_description_default()};
    s->description.bodies = s->body;
    s->description.effects = s->effect;
    s->description.body_count = s->description.effect_count = SLIDERS;
    s->description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    for (int i = 0; i < SLIDERS; i++) {
        s->body[i] = kt_body_of(names[i], NULL, KT_JOINT_PRISMATIC, 1.0);
        s->body[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        s->body[i].joint.velocity[0] = speeds[i];
        s->effect[i] = kt_effect_of(KT_EFFECT_JOINT_FRICTION, names[i]);
        s->effect[i].coulomb = coulomb;
        s->effect[i].stribeck = 0.0;
        s->effect[i].stick = true;
        s->effect[i].switching = KT_SWITCHED_OFF;
    }
}

static kt_simulation *start_for(const kt_model *model, const char *method, double duration) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    const bool steps = strcmp(method, "steps") == 0; /* time stepping */
    run.integrator = steps ? NULL : method;
    run.step = steps || strcmp(method, "rk4") == 0 ? 1e-3 : 0.0;
    run.duration = duration;
    run.relative = run.absolute = 1e-11;
    options.contact = steps ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
    return kt_test_simulation(model, &run, &options);
}

static kt_simulation *start(const kt_model *model, const char *method) { return start_for(model, method, 100.0); }

static kt_status advance(kt_simulation *simulation, double t, kt_error *error) {
    return kt_simulation_advance(simulation, t, error);
}

/* Speeds stay as they are at first. From 0.5 s on friction acts: both come to rest, and stay there. */
static void check_release(const scene *s, const char *method) {
    kt_model *model = kt_scene_compile(&s->description);
    kt_simulation *simulation = start(model, method);
    kt_error error = {0};
    kt_note("%s, %d switches", method, kt_switch_count(model));
    kt_need_fine("released", advance(simulation, 0.5, &error), &error);
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    for (int i = 0; i < s->description.body_count; i++) {
        kt_check_near("its speed stays, m/s", v[i], speeds[i], 1e-14);
        kt_check_near("its path, m", q[i], 0.5 * speeds[i], 1e-12);
    }
    kt_status status = kt_simulation_set_released(simulation, 0, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 1.0, &error);
    kt_need_fine("engaged", status, &error);
    for (int i = 0; i < s->description.body_count; i++)
        kt_check_near("is braked, m/s", v[i], speeds[i] - (speeds[i] > 0.0 ? 0.5 * coulomb : 0.0), 1e-12);
}

KT_TEST(friction_that_is_released_at_first_does_not_act) {
    for (int m = 0; m < METHODS; m++) {
        scene s;
        scene_make(&s);
        check_release(&s, methods[m]);
    }
}

/* One slider with a stop on one side that is far away: three switches. */
KT_TEST(friction_that_is_released_at_first_does_not_act_with_a_far_stop) {
    for (int m = 0; m < METHODS; m++) {
        scene s;
        scene_make(&s);
        s.description.body_count = 1;
        s.effect[1] = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "a");
        s.effect[1].lower = -100.0;
        s.effect[1].upper = 100.0;
        s.effect[1].restitution = 0.0;
        check_release(&s, methods[m]);
    }
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* Both sliders have come to rest under a weak pull. Their friction is released or not, and the simulation is restored
 * into another one. A force on the first slider then moves both alike. */
static void check_restored(const scene *s, const char *method, bool is_released) {
    const double weak = 0.5, force[SLIDERS] = {5.0, 0.0}, saved = 3.0, last = 3.5;
    const double held = is_released ? 0.0 : coulomb;
    kt_model *model = kt_scene_compile(&s->description);
    kt_simulation *one = start(model, method), *other = start(model, method);
    const uint64_t set = kt_switch_bits(model, kt_loop_switch(model, kt_effect_stick_loop(model, 0))) |
                         kt_switch_bits(model, kt_loop_switch(model, kt_effect_stick_loop(model, 1)));
    kt_error error = {0};
    kt_note("%s, %s", method, is_released ? "released" : "not released");
    kt_status status = advance(one, saved, &error);
    if (status == KT_OK && is_released)
        status = kt_simulation_set_released(one, set, &error);
    kt_need(kt_scene_hand_over(one, other));
    for (kt_simulation *next = one; status == KT_OK && next != NULL; next = next == one ? other : NULL) {
        status = kt_simulation_set_torque(next, force, &error);
        if (status == KT_OK)
            status = kt_simulation_advance(next, last, &error);
    }
    kt_need_fine("runs", status, &error);
    const double *v = kt_simulation_velocities(one), times = last - saved;
    kt_check_near("the pushed one, m/s", v[0], (weak + force[0] - held) * times, 1e-12);
    kt_check_near("the other one, m/s", v[1], is_released ? weak * times : 0.0, 1e-12);
    kt_check_equal_bits("restored", kt_simulation_velocities(other), v, SLIDERS);
}

KT_TEST(checkpoints_keep_which_friction_is_released) {
    for (int k = 0; k < 2 * METHODS; k++) {
        scene s;
        scene_make(&s);
        s.description.gravity.x = 0.5;
        for (int i = 0; i < SLIDERS; i++)
            s.effect[i].switching = KT_ALWAYS_ON;
        check_restored(&s, methods[k / 2], k % 2 == 1);
    }
}

/* ---- parameters -------------------------------------------------------------------------------------------------- */

enum { BY_SIMULATION, BY_CHANGE, BEFORE_STATE, WAYS };
static const char *const way_names[WAYS] = {"kt_simulation_set_parameter", "kt_simulation_change",
                                            "kt_parameter_set, kt_simulation_set_state"};

static kt_status set_gravity(kt_simulation *simulation, kt_model *model, int way, kt_error *error) {
    kt_parameter_change change = {.values = {pull, 0.0, 0.0}};
    kt_status status = kt_parameter_find(model, "gravity", &change.parameter, error);
    if (status != KT_OK)
        return status;
    if (way == BY_SIMULATION)
        return kt_simulation_set_parameter(simulation, model, &change.parameter, change.values, error);
    if (way == BY_CHANGE)
        return kt_simulation_change(simulation, model, &change, 1, NULL, error);
    status = kt_parameter_set(model, &change.parameter, change.values, error);
    return status == KT_OK ? kt_simulation_set_state(simulation, kt_simulation_time(simulation),
                                                     kt_simulation_positions(simulation),
                                                     kt_simulation_velocities(simulation), error)
                           : status;
}

/* Gravity along the axis, however it is set, accelerates both sliders from 0.25 s on. */
KT_TEST(parameters_that_are_set_act_while_friction_is_released) {
    for (int k = 0; k < METHODS * WAYS; k++) {
        const char *method = methods[k / WAYS];
        scene s;
        scene_make(&s);
        kt_model *compiled = kt_scene_compile(&s.description), *model = NULL;
        const size_t size = kt_model_size(compiled);
        void *memory = aligned_alloc(KT_ALIGNMENT, size);
        kt_error error = {0};
        kt_status status = memory != NULL ? kt_model_copy(compiled, memory, size, &model, &error) : KT_ERROR_MEMORY;
        kt_simulation *simulation = status == KT_OK ? start(model, method) : NULL;
        kt_note("%s, %s", method, way_names[k % WAYS]);
        status = advance(simulation, 0.25, &error);
        if (status == KT_OK)
            status = set_gravity(simulation, model, k % WAYS, &error);
        if (status == KT_OK)
            status = kt_simulation_advance(simulation, 0.75, &error);
        for (int i = 0; kt_fine("runs", status, &error) && i < SLIDERS; i++)
            kt_check_near("speed, m/s", kt_simulation_velocities(simulation)[i], speeds[i] + 0.5 * pull, 1e-12);
        free(memory);
    }
}

static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

/* One slider slips and the other one sticks: their set is a mask. A friction that kt_parameter_set sets acts in
 * accelerations and in a whole run. (Friction is an impulse in time stepping, and no acceleration.) */
KT_TEST(accelerations_and_runs_take_friction_over) {
    const double weaker[] = {0.1}, duration = 0.5;
    for (int m = 0; m < 2 * METHODS - 1; m++) {
        const bool is_run = m % 2 == 0;
        scene s;
        kt_model_options options = kt_model_options_default();
        kt_parameter coulomb_of_a;
        kt_error error = {0};
        double a[SLIDERS];
        scene_make(&s);
        s.effect[0].name = "fa";
        s.effect[0].switching = s.effect[1].switching = KT_ALWAYS_ON;
        options.settable = true;
        kt_model *model = kt_test_model(&s.description, &options);
        kt_simulation *simulation = start_for(model, methods[m / 2], duration);
        kt_note("%s, %s", methods[m / 2], is_run ? "run" : "acceleration");
        kt_status status = kt_parameter_find(model, "effect fa.coulomb", &coulomb_of_a, &error);
        if (status == KT_OK)
            status = kt_parameter_set(model, &coulomb_of_a, weaker, &error);
        if (status == KT_OK)
            status = is_run ? kt_simulation_run(simulation, ignore, NULL, &error)
                            : kt_simulation_acceleration(simulation, a, &error);
        if (kt_fine("runs", status, &error) && is_run)
            kt_check_near("speed, m/s", kt_simulation_velocities(simulation)[0], speeds[0] - duration * weaker[0],
                          1e-12);
        else if (status == KT_OK)
            kt_check_near("acceleration, m/s^2", a[0], -weaker[0], 1e-14);
    }
}

/* Friction that slips at C from the start has a new C. The rules of a description hold: C is not 0. */
KT_TEST(coulomb_of_friction_that_sticks_is_set) {
    const double weaker[] = {0.4}, none[] = {0.0};
    scene s;
    kt_model_options options = kt_model_options_default();
    kt_parameter parameter;
    kt_error error = {0};
    scene_make(&s);
    s.effect[0].name = "fa";
    s.effect[0].switching = KT_ALWAYS_ON;
    options.settable = true;
    kt_model *model = kt_test_model(&s.description, &options);
    kt_simulation *simulation = start(model, "rk4");
    kt_status status = kt_parameter_find(model, "effect fa.coulomb", &parameter, &error);
    if (status == KT_OK)
        status = kt_simulation_set_parameter(simulation, model, &parameter, weaker, &error);
    kt_need_fine("set", status == KT_OK ? advance(simulation, 0.5, &error) : status, &error);
    kt_check_near("is braked, m/s", kt_simulation_velocities(simulation)[0], speeds[0] - 0.5 * weaker[0], 1e-12);
    kt_check_equal_int("0", kt_simulation_set_parameter(simulation, model, &parameter, none, &error), KT_ERROR_MODEL);
    kt_check_contains("words", error.message, "coulomb is 0");
}

/* ---- events of scenes -------------------------------------------------------------------------------------------- */

/* Runs a scene with its events to 1 s. Returns false after a failed check. */
static bool run_scene(const char *text, kt_contact_scheme contact, double v[SLIDERS]) {
    kt_scene read;
    kt_error error = {0};
    kt_scene_watch *watch = NULL;
    kt_simulation_options options = kt_simulation_options_default();
    kt_parsed_scene(text, &read);
    options.contact = contact;
    options.events = kt_scene_event_room(&read);
    kt_model *model = kt_scene_compile(&read.description);
    kt_simulation *simulation = kt_test_simulation(model, &read.run, &options);
    kt_status status = kt_scene_watch_create(&read, model, simulation, NULL, 0, &watch, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 1.0, &error);
    if (status == KT_OK)
        memcpy(v, kt_simulation_velocities(simulation), SLIDERS * sizeof *v);
    kt_scene_watch_free(watch);
    return kt_fine("runs", status, &error);
}

/* A scene whose events release and engage friction, by time stepping: two sliders are braked but between 0.2 s and
 * 0.5 s. */
KT_TEST(events_release_and_engage_friction_in_time_stepping) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, 0]\n"
        "bodies:\n"
        "  - {name: a, joint: {type: prismatic, axis: x, velocity: 1}, mass: 1}\n"
        "  - {name: b, joint: {type: prismatic, axis: x, velocity: -1}, mass: 1}\n"
        "effects:\n"
        "  - {name: fa, type: joint_friction, joint: a, coulomb: 0.8, stribeck: 0, stick: true}\n"
        "  - {name: fb, type: joint_friction, joint: b, coulomb: 0.4, stribeck: 0, stick: true}\n"
        "events:\n"
        "  - {name: off, when: t - 0.2, then: [{release: fa}, {release: fb}]}\n"
        "  - {name: on, when: t - 0.5, then: [{engage: fa}, {engage: fb}]}\n"
        "simulate: {duration: 1, contact: steps, step: 0.001}\n";
    double v[SLIDERS];
    if (run_scene(text, KT_CONTACT_STEPS, v)) {
        kt_check_near("a, m/s", v[0], 1.0 - 0.7 * 0.8, 1e-10);
        kt_check_near("b, m/s", v[1], -1.0 + 0.7 * 0.4, 1e-10);
    }
}

/* Stops without bits of their own share two bits, which are none of friction: an event that engages a stop leaves
 * friction released. */
KT_TEST(events_on_contacts_of_shared_bits_leave_friction_as_it_is) {
    enum { STOPS = 64 };
    static char text[100 * (STOPS + 10)];
    size_t used =
        (size_t)snprintf(text, sizeof text,
                         "kinetree: 1\n"
                         "gravity: [0, 0, 0]\n"
                         "bodies:\n"
                         "  - {name: a, joint: {type: prismatic, axis: x, velocity: 1}, mass: 1}\n"
                         "  - {name: b, joint: {type: prismatic, axis: x, velocity: -1}, mass: 1}\n"
                         "effects:\n"
                         "  - {name: fa, type: joint_friction, joint: a, coulomb: 0.8, stribeck: 0, stick: true}\n");
    for (int i = 0; i < STOPS; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: s%d, type: joint_limit, joint: b, lower: -1%02d, restitution: 0}\n", i, i);
    (void)snprintf(text + used, sizeof text - used,
                   "events:\n"
                   "  - {name: off, when: t - 0.2, then: [{release: fa}]}\n"
                   "  - {name: on, when: t - 0.5, then: [{engage: s3}]}\n"
                   "simulate: {duration: 1, integrator: rk4, step: 0.001}\n");
    double v[SLIDERS];
    if (run_scene(text, KT_CONTACT_EVENTS, v)) {
        kt_check_near("a, m/s", v[0], 1.0 - 0.2 * 0.8, 1e-12);
        kt_check_near("b, m/s", v[1], -1.0, 1e-14);
    }
}

/* ---- models ------------------------------------------------------------------------------------------------------ */

/* Evaluates accelerations by data of the caller's. */
static kt_status accelerate(const kt_model *model, const double *v, double *a, kt_error *error) {
    const double q[SLIDERS] = {0.0};
    kt_data *data = NULL;
    kt_status status = kt_data_create(model, &data, error);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, error);
    kt_data_free(data);
    return status;
}

/* Without a simulation, the compiled model has this friction slip: it is rejected at any speed, with the remedy. */
KT_TEST(released_friction_of_a_compiled_model_is_rejected) {
    static const double rates[][SLIDERS] = {{0.0, 0.0}, {1.0, 1.0}, {-1.0, 1.0}};
    scene s;
    scene_make(&s);
    kt_model *model = kt_scene_compile(&s.description);
    for (int i = 0; i < 3; i++) {
        kt_error error = {0};
        double a[SLIDERS];
        kt_note("%g, %g m/s", rates[i][0], rates[i][1]);
        kt_check_equal_int("rejected", accelerate(model, rates[i], a, &error), KT_ERROR_UNSUPPORTED);
        kt_check_contains("words", error.message, "it is released at first");
    }
}

/* A set of switches lets friction slip forwards or backwards, and has its force in this direction alone. */
KT_TEST(friction_slips_in_the_direction_of_the_set_alone) {
    scene s;
    scene_make(&s);
    s.effect[0].switching = s.effect[1].switching = KT_ALWAYS_ON;
    kt_model_options options = kt_model_options_default();
    options.contact_switches = 2 * SLIDERS;
    const kt_model *model = kt_test_model(&s.description, &options);
    for (int back = 0; back < 2; back++)
        for (int sense = -1; sense <= 1; sense++) {
            const uint64_t set = back ? kt_switch_bits(model, kt_effect_switch(model, 0)) : 0;
            const double v[SLIDERS] = {sense, 1.0};
            const bool fits = sense == (back ? -1 : 1);
            double a[SLIDERS] = {0.0};
            kt_error error = {0};
            const kt_status status = accelerate(kt_model_switched(model, set), v, a, &error);
            kt_check_equal_int(back ? "backwards" : "forwards", status, fits ? KT_OK : KT_ERROR_UNSUPPORTED);
            kt_check_near("acceleration, m/s^2", a[0], fits ? -sense * coulomb : 0.0, 1e-15);
        }
}

/* The remedy, the model of a simulation, has the friction that acts: none at first, and then that of both sliders. */
KT_TEST(friction_that_a_simulation_engages_acts_in_its_model) {
    const double rates[SLIDERS] = {0.7, 0.4};
    scene s;
    scene_make(&s);
    for (int i = 0; i < SLIDERS; i++)
        s.body[i].joint.velocity[0] = rates[i];
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(model, "rk4");
    kt_error error = {0};
    kt_status status = KT_OK;
    for (int acts = 0; acts < 2 && kt_fine("runs", status, &error); acts++) {
        double a[SLIDERS] = {0.0};
        if (acts == 1)
            status = kt_simulation_set_released(simulation, 0, &error);
        if (status == KT_OK)
            status = accelerate(kt_simulation_model(simulation), rates, a, &error);
        for (int i = 0; kt_fine("evaluates", status, &error) && i < SLIDERS; i++)
            kt_check_near("acceleration, m/s^2", a[i], acts == 1 ? -coulomb : 0.0, 1e-15);
    }
}
