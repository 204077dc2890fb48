/* Coefficients of friction of hard contacts that are set while a simulation runs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "motion/simulation/parsed.h"

enum { FEET = 4, METHODS = 5 };

static const char *const methods[METHODS] = {"rk4", "heun", "dopri5", "radau5", "steps"};
static const double g = 9.81, slope = 0.35, height = 0.1, duration = 100.0;
static const double rough = 0.6, smooth = 0.1, rougher = 0.8;

/* A box with four feet on a slope. The axes are those of the slope, along which gravity pulls. */
static const char box[] =
    "kinetree: 1\n"
    "parameters: {mu: %.17g, other: %.17g}\n"
    "gravity: [%.17g, 0, %.17g]\n"
    "bodies:\n"
    "  - {name: box, joint: {type: free, position: {position: [0, 0, 0.1]}}, mass: 2, inertia: [0.02, 0.05, 0.06],\n"
    "     markers: {a: [0.2, 0.1, -0.1], b: [0.2, -0.1, -0.1], c: [-0.2, 0.1, -0.1], d: [-0.2, -0.1, -0.1]}}\n"
    "effects:\n"
    "  - {name: f0, type: contact, point: box.a, radius: 0, plane: world, axis: z, restitution: 0, friction: =mu}\n"
    "  - {name: f1, type: contact, point: box.b, radius: 0, plane: world, axis: z, restitution: 0, friction: =mu + "
    "other}\n"
    "  - {name: f2, type: contact, point: box.c, radius: 0, plane: world, axis: z, restitution: 0, friction: =mu}\n"
    "  - {name: f3, type: contact, point: box.d, radius: 0, plane: world, axis: z, restitution: 0, friction: =mu}\n"
    "%s";

/* `other`: how much the coefficient of the second foot differs. */
static void read_box(kt_scene *scene, double mu, double other, const char *events) {
    char text[4096];
    (void)snprintf(text, sizeof text, box, mu, other, g * sin(slope), -g * cos(slope), events);
    kt_parsed_scene(text, scene);
}

static kt_model *compile_box(const kt_scene *scene) {
    kt_model_options options = kt_model_options_default();
    options.settable = true;
    return kt_test_model(&scene->description, &options);
}

static kt_simulation *start(const kt_model *model, const char *method, int events) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    const bool steps = strcmp(method, "steps") == 0;
    const bool fixed = steps || strcmp(method, "rk4") == 0 || strcmp(method, "heun") == 0;
    run.integrator = steps ? NULL : method;
    run.step = fixed ? 1e-3 : 0.0;
    run.duration = duration;
    run.relative = run.absolute = 1e-10;
    options.contact = steps ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
    options.events = events;
    return kt_test_simulation(model, &run, &options);
}

/* Sets the coefficients of all feet. */
static void set_friction(kt_simulation *simulation, kt_model *model, bool by_change, double mu) {
    kt_parameter_change changes[FEET];
    kt_error error = {0};
    kt_status status = KT_OK;
    for (int k = 0; k < FEET && status == KT_OK; k++) {
        char name[32];
        (void)snprintf(name, sizeof name, "effect f%d.friction", k);
        status = kt_parameter_find(model, name, &changes[k].parameter, &error);
        changes[k].values[0] = mu;
        if (status == KT_OK && !by_change)
            status = kt_simulation_set_parameter(simulation, model, &changes[k].parameter, &mu, &error);
    }
    if (status == KT_OK && by_change)
        status = kt_simulation_change(simulation, model, changes, FEET, NULL, &error);
    kt_need_fine("sets friction", status, &error);
}

static void advance(kt_simulation *simulation, double t) {
    kt_error error = {0};
    kt_need_fine("runs", kt_simulation_advance(simulation, t, &error), &error);
}

/* The motion of the box: it rests until t1, slides with g (sin a - mu cos a) until t2, and is then braked. */
static double distance_at(double t, double t1, double mu1, double t2, double mu2) {
    const double pull = g * (sin(slope) - mu1 * cos(slope)), brake = g * (mu2 * cos(slope) - sin(slope));
    const double slid = fmin(fmax(t - t1, 0.0), t2 - t1), speed = pull * slid;
    const double braked = fmin(fmax(t - t2, 0.0), speed / brake);
    return 0.5 * pull * slid * slid + speed * braked - 0.5 * brake * braked * braked;
}

static void check_distance(const kt_simulation *simulation, double t1, double mu1, double t2, double mu2,
                           double bound) {
    const double t = kt_simulation_time(simulation), *q = kt_simulation_positions(simulation);
    kt_note("at %g s", t);
    kt_check_near("distance, m", q[0], distance_at(t, t1, mu1, t2, mu2), bound);
    kt_check_near("sideways, m", q[1], 0.0, bound);
    kt_check_near("height, m", q[2], height, bound);
}

/* The box stops at t2 + v / g (mu cos a - sin a). A time step of h has an error of the order of h v. */
static void check_slide(const char *method, bool by_change) {
    const double t1 = 0.25, t2 = 0.75, bound = strcmp(method, "steps") == 0 ? 2e-3 : 1e-9;
    const double stop = t2 + (t2 - t1) * (sin(slope) - smooth * cos(slope)) / (rougher * cos(slope) - sin(slope));
    kt_scene scene;
    read_box(&scene, rough, 0.0, "");
    kt_model *model = compile_box(&scene);
    kt_simulation *simulation = start(model, method, 0);
    kt_note("%s, %s", method, by_change ? "kt_simulation_change" : "kt_simulation_set_parameter");
    advance(simulation, t1);
    check_distance(simulation, t1, smooth, t2, rougher, bound);
    set_friction(simulation, model, by_change, smooth);
    for (int k = 1; k <= 4; k++) {
        advance(simulation, t1 + 0.125 * k);
        check_distance(simulation, t1, smooth, t2, rougher, bound);
    }
    set_friction(simulation, model, by_change, rougher);
    for (int k = 0; k < 3; k++) {
        advance(simulation, (double[]){0.5 * (t2 + stop), 0.99 * stop, stop + 0.5}[k]);
        check_distance(simulation, t1, smooth, t2, rougher, bound);
    }
    kt_check_near("rests, m/s", kt_simulation_velocities(simulation)[0], 0.0, 1e-9);
}

KT_TEST(box_slides_and_stops_when_its_friction_is_set) {
    for (int k = 0; k < 2 * METHODS; k++)
        check_slide(methods[k / 2], k % 2 == 1);
}

/* No friction at all: the coefficient is 0, and may be raised again. Without friction, one of the four feet carries
 * nothing and is open. kt_simulation_change closes this foot at once, and the next step of kt_simulation_set_parameter
 * closes it once it penetrates. */
KT_TEST(friction_of_0_is_none) {
    for (int k = 0; k < 2 * METHODS; k++) {
        const char *method = methods[k / 2];
        const double t1 = 0.25, t2 = 0.5, bound = strcmp(method, "steps") == 0 ? 2e-3 : 1e-9;
        kt_scene scene;
        read_box(&scene, rough, 0.0, "");
        kt_model *model = compile_box(&scene);
        kt_simulation *simulation = start(model, method, 0);
        kt_note("%s", method);
        advance(simulation, t1);
        set_friction(simulation, model, k % 2 == 0, 0.0);
        advance(simulation, t2);
        check_distance(simulation, t1, 0.0, t2, rough, bound);
        set_friction(simulation, model, true, rough);
        advance(simulation, 3.0);
        check_distance(simulation, t1, 0.0, t2, rough, bound);
    }
}

/* A run without a change of friction has the bits of a model that was compiled with the coefficient. */
KT_TEST(friction_that_is_set_gives_the_bits_of_compiled_friction) {
    for (int k = 0; k < METHODS; k++) {
        kt_scene scene, other;
        read_box(&scene, rough, 0.0, "");
        read_box(&other, smooth, 0.0, "");
        kt_model *model = compile_box(&scene);
        kt_simulation *set = start(model, methods[k], 0);
        kt_simulation *compiled = start(kt_scene_compile(&other.description), methods[k], 0);
        kt_error error = {0};
        kt_note("%s", methods[k]);
        set_friction(set, model, false, smooth);
        kt_need_fine(
            "state",
            kt_simulation_set_state(set, 0.0, kt_simulation_positions(set), kt_simulation_velocities(set), &error),
            &error);
        advance(set, 0.5);
        advance(compiled, 0.5);
        kt_check_equal_bits("positions", kt_simulation_positions(set), kt_simulation_positions(compiled), 7);
        kt_check_equal_bits("velocities", kt_simulation_velocities(set), kt_simulation_velocities(compiled), 6);
    }
}

/* A block in a slot along the slope, with friction from the load of its joint: m g cos a. */
KT_TEST(friction_from_a_load_is_set) {
    static const char text[] = "kinetree: 1\n"
                               "gravity: [%.17g, 0, %.17g]\n"
                               "bodies: [{name: block, joint: {type: prismatic, axis: x}, mass: 2}]\n"
                               "effects:\n"
                               "  - {name: f0, type: joint_friction, joint: block, coefficient: 0.6, stribeck: 0,\n"
                               "     stick: true}\n";
    for (int k = 0; k < METHODS - 1; k++) {
        const double t1 = 0.25, t2 = 0.75, mus[] = {smooth, rougher};
        char written[1024];
        kt_scene scene;
        kt_parameter parameter;
        kt_error error = {0};
        (void)snprintf(written, sizeof written, text, g * sin(slope), -g * cos(slope));
        kt_parsed_scene(written, &scene);
        kt_model *model = compile_box(&scene);
        kt_simulation *simulation = start(model, methods[k], 0);
        kt_note("%s", methods[k]);
        kt_need_fine("found", kt_parameter_find(model, "effect f0.coefficient", &parameter, &error), &error);
        for (int i = 0; i < 3; i++) {
            advance(simulation, (double[]){t1, t2, 2.0}[i]);
            kt_check_near("distance, m", kt_simulation_positions(simulation)[0],
                          distance_at(kt_simulation_time(simulation), t1, smooth, t2, rougher), 1e-9);
            if (i < 2)
                kt_need_fine("set", kt_simulation_set_parameter(simulation, model, &parameter, &mus[i], &error),
                             &error);
        }
        kt_check_near("rests, m/s", kt_simulation_velocities(simulation)[0], 0.0, 1e-12);
    }
}

/* An event of a scene lowers the coefficient, and a second one raises it. */
KT_TEST(events_of_a_scene_set_friction) {
    static const char events[] = "events:\n"
                                 "  - {name: ice, when: t - 0.25, then: {set: {mu: 0.1}}}\n"
                                 "  - {name: sand, when: t - 0.75, then: {set: {mu: 0.8}}}\n";
    for (int k = 0; k < METHODS; k++) {
        kt_scene scene;
        kt_error error = {0};
        kt_scene_watch *watch = NULL;
        read_box(&scene, rough, 0.0, events);
        kt_model *model = compile_box(&scene);
        kt_simulation *simulation = start(model, methods[k], kt_scene_event_room(&scene));
        kt_note("%s", methods[k]);
        kt_need_fine("events", kt_scene_watch_create(&scene, model, simulation, NULL, 0, &watch, &error), &error);
        const double bound = strcmp(methods[k], "steps") == 0 ? 2e-3 : 1e-9;
        for (int i = 1; i <= 5; i++) {
            advance(simulation, 0.25 * i);
            check_distance(simulation, 0.25, smooth, 0.75, rougher, bound);
        }
        kt_scene_watch_free(watch);
    }
}

/* Wrong coefficients are rejected, and leave the motion as it is. */
KT_TEST(wrong_coefficients_are_rejected) {
    static const double wrong[] = {-0.1, NAN, INFINITY};
    kt_scene scene;
    kt_parameter parameter;
    kt_error error = {0};
    double now = 0.0;
    read_box(&scene, rough, -rough, "");
    kt_model *model = compile_box(&scene);
    kt_simulation *simulation = start(model, "rk4", 0);
    kt_need_fine("found", kt_parameter_find(model, "effect f0.friction", &parameter, &error), &error);
    for (int i = 0; i < 3; i++)
        kt_check_equal_int("wrong", kt_simulation_set_parameter(simulation, model, &parameter, &wrong[i], &error),
                           KT_ERROR_MODEL);
    kt_need_fine("get", kt_parameter_get(model, &parameter, &now, &error), &error);
    kt_check_near("mu", now, rough, 0.0);
    kt_check_equal_int("frictionless", kt_parameter_find(model, "effect f1.friction", &parameter, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "compiled without friction");
    kt_check_equal_int("radius", kt_parameter_find(model, "effect f0.radius", &parameter, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "is hard");
}

/* Setting friction allocates nothing. Checkpoints do not contain parameters. A simulation of another copy in which
 * they are set, too, resumes with equal bits. */
KT_TEST(checkpoints_resume_with_friction_that_is_set) {
    for (int k = 0; k < METHODS; k++) {
        kt_scene scene;
        read_box(&scene, rough, 0.0, "");
        kt_model *model = compile_box(&scene), *copy = compile_box(&scene);
        kt_simulation *one = start(model, methods[k], 0), *other = start(copy, methods[k], 0);
        kt_note("%s", methods[k]);
        advance(one, 0.25);
        kt_interpose_start();
        set_friction(one, model, k % 2 == 0, smooth);
        kt_check_equal_int("allocations", kt_interpose_stop(), 0);
        advance(one, 0.5);
        set_friction(other, copy, false, smooth);
        kt_need(kt_scene_hand_over(one, other));
        advance(one, 1.0);
        advance(other, 1.0);
        kt_check_above("slides, m", kt_simulation_positions(one)[0], 0.1);
        kt_check_equal_bits("positions", kt_simulation_positions(other), kt_simulation_positions(one), 7);
        kt_check_equal_bits("velocities", kt_simulation_velocities(other), kt_simulation_velocities(one), 6);
    }
}

/* A scene keeps the coefficient in a state, and therefore in its checkpoints. */
KT_TEST(checkpoints_of_scenes_contain_friction_that_events_set) {
    static const char events[] = "events: [{name: ice, when: t - 0.25, then: {set: {mu: 0.1}}}]\n";
    kt_simulation *simulation[2];
    kt_scene_watch *watch[2];
    kt_error error = {0};
    for (int k = 0; k < 2; k++) {
        kt_scene scene;
        read_box(&scene, rough, 0.0, events);
        kt_model *model = compile_box(&scene);
        simulation[k] = start(model, "dopri5", kt_scene_event_room(&scene));
        kt_need_fine("events", kt_scene_watch_create(&scene, model, simulation[k], NULL, 0, &watch[k], &error), &error);
    }
    advance(simulation[0], 0.5);
    kt_need(kt_scene_hand_over(simulation[0], simulation[1]));
    kt_need_fine("sync", kt_scene_watch_sync(watch[1], simulation[1], &error), &error);
    for (int k = 0; k < 2; k++)
        advance(simulation[k], 1.0);
    check_distance(simulation[1], 0.25, smooth, 2.0, rougher, 1e-9);
    kt_check_equal_bits("positions", kt_simulation_positions(simulation[1]), kt_simulation_positions(simulation[0]), 7);
    for (int k = 0; k < 2; k++)
        kt_scene_watch_free(watch[k]);
}
