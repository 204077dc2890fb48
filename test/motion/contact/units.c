/* Limits of gaps and rates, which count in the units of the mechanism: a mass above a stop, at the end of an arm of any
 * length. Gravity grows with the length, so that the motion is the same in these units. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "check.h"
#include "fixture.h"
#include "motion/simulation/parsed.h"

static const double lengths[] = {1.0, 0x1p-20, 0x1p20};
enum { LENGTHS = sizeof lengths / sizeof *lengths };

typedef struct subject {
    kt_body body;
    kt_effect stop;
    kt_loop lock;
    kt_term term;
    kt_description description;
} subject;

/* A mass on a slide at the distance `length`. The stop and the lock are at 0; the lock is switched off. */
static void make_subject(double length, subject *s) {
    *s = (subject){.lock = kt_loop_default(), .description = kt_description_default()};
    s->body = kt_body_of("mass", NULL, KT_JOINT_PRISMATIC, 1.0);
    s->body.joint.at = kt_vec3_make(length, 0.0, 0.0);
    s->stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "mass");
    s->stop.lower = 0.0;
    s->stop.restitution = 0.0;
    s->term = (kt_term){.joint = "mass", .coefficient = 1.0};
    s->lock.name = "lock";
    s->lock.type = KT_LOOP_COUPLING;
    s->lock.terms = &s->term;
    s->lock.term_count = 1;
    s->lock.switching = KT_SWITCHED_OFF;
    s->description.gravity = kt_vec3_make(0.0, 0.0, -10.0 * length);
    s->description.bodies = &s->body;
    s->description.body_count = 1;
}

/* The status of a step of 0.1 s, within which the mass falls by 0.05 lengths: down to the stop, or up to one above. */
static kt_status status_of_step(double length, bool up, double height) {
    const double q = up ? -height : height;
    subject s;
    make_subject(length, &s);
    if (up) {
        s.stop.lower = -(double)INFINITY;
        s.stop.upper = 0.0;
        s.description.gravity.z = 10.0 * length;
    }
    s.description.effects = &s.stop;
    s.description.effect_count = 1;
    const kt_model *model = kt_test_model(&s.description, NULL);
    const double v = 0.0;
    double A[4];
    kt_error error = {0};
    const kt_step step = {.method = kt_method_find("rk4"), .h = 0.1};
    const size_t size = (kt_step_work_size(model, step.method) + 63) / 64 * 64;
    void *work = aligned_alloc(64, size);
    const kt_status status =
        kt_step_derivatives(model, kt_test_data(model), work, size, &step, &q, &v, NULL, NULL, A, NULL, &error);
    free(work);
    return status;
}

KT_TEST(steps_with_derivatives_reject_the_same_gaps_in_all_units) {
    for (int k = 0; k < 2 * LENGTHS; k++) {
        const double length = lengths[k / 2];
        const bool up = k % 2;
        kt_check_equal_int("ends before the stop", status_of_step(length, up, 0.0501 * length), KT_OK);
        kt_check_equal_int("ends beyond it", status_of_step(length, up, 0.0499 * length), KT_ERROR_UNSUPPORTED);
        kt_check_equal_int("by rounding", status_of_step(length, up, (0.05 - 1e-10) * length), KT_OK);
    }
}

/* The status of an acceleration of the model without closed contacts, above a stop, or below one in the mirror. */
static kt_status status_of_acceleration(double length, double sense, double q, double v) {
    const double position = sense * q, velocity = sense * v;
    subject s;
    make_subject(length, &s);
    if (sense < 0.0) {
        s.stop.lower = -(double)INFINITY;
        s.stop.upper = 0.0;
    }
    s.description.effects = &s.stop;
    s.description.effect_count = 1;
    const kt_model *model = kt_test_model(&s.description, NULL);
    double a;
    kt_error error = {0};
    return kt_acceleration_evaluate(model, kt_test_data(model), 0.0, &position, &velocity, NULL, NULL, &a, &error);
}

KT_TEST(accelerations_are_rejected_in_the_same_states_in_all_units) {
    static const kt_status none = KT_OK, touches = KT_ERROR_UNSUPPORTED;
    for (int k = 0; k < 2 * LENGTHS; k++) {
        const double L = lengths[k / 2], sense = k % 2 ? -1.0 : 1.0;
        kt_check_equal_int("a gap", status_of_acceleration(L, sense, 1e-5 * L, 0.0), none);
        kt_check_equal_int("touches", status_of_acceleration(L, sense, 1e-10 * L, 0.0), touches);
        kt_check_equal_int("parts", status_of_acceleration(L, sense, 0.0, 1e-7 * L), none);
        kt_check_equal_int("parts by rounding", status_of_acceleration(L, sense, 0.0, 1e-10 * L), touches);
    }
}

KT_TEST(contacts_that_are_released_from_the_start_have_no_gap) {
    subject s;
    make_subject(1.0, &s);
    s.stop.switching = KT_SWITCHED_OFF;
    s.description.effects = &s.stop;
    s.description.effect_count = 1;
    const kt_model *model = kt_test_model(&s.description, NULL);
    const double q = -1.0, v = -1.0;
    double a = 0.0;
    kt_error error = {0};
    kt_fine("below the stop", kt_acceleration_evaluate(model, kt_test_data(model), 0.0, &q, &v, NULL, NULL, &a, &error),
            &error);
    kt_check_near("falls, m/s^2", a, -10.0, 1e-14);
}

/* The status of a switch that closes the lock over a gap. */
static kt_status status_of_switch(double length, double gap) {
    subject s;
    make_subject(length, &s);
    s.body.joint.position[0] = gap;
    s.description.loops = &s.lock;
    s.description.loop_count = 1;
    kt_simulation *simulation = kt_test_simulation(kt_test_model(&s.description, NULL), NULL, NULL);
    kt_error error = {0};
    return kt_simulation_set_switches(simulation, 1, NULL, &error);
}

KT_TEST(a_switch_closes_the_same_gaps_in_all_units) {
    for (int k = 0; k < LENGTHS; k++) {
        kt_check_equal_int("a small gap", status_of_switch(lengths[k], 1e-7 * lengths[k]), KT_OK);
        kt_check_equal_int("a large one", status_of_switch(lengths[k], 1e-5 * lengths[k]), KT_ERROR_CONSTRAINT);
    }
}

/* A plate stands on three feet, and a bar holds it. Its size is one of `lengths`. Ten forces act on its six
 * coordinates. Those with the largest margin are chosen. The moments of short levers must not be lost beside the
 * forces. */
KT_TEST(feet_share_the_same_load_in_all_units) {
    double normal[LENGTHS][3];
    for (int k = 0; k < LENGTHS; k++) {
        const double L = lengths[k], foot[3][2] = {{0.3, 0.2}, {-0.2, 0.25}, {-0.25, -0.3}};
        char text[2048];
        int at = snprintf(text, sizeof text,
                          "kinetree: 1\ngravity: [%.17g, %.17g, %.17g]\nbodies:\n  - {name: plate, mass: 2, inertia: "
                          "[%.17g, %.17g, %.17g],\n     joint: {type: free, position: {position: [0, 0, %.17g]}},\n"
                          "     markers: {end: [%.17g, 0, 0]",
                          L, 0.3 * L, -9.81 * L, 0.02 * L * L, 0.03 * L * L, 0.04 * L * L, 0.1 * L, 0.1 * L);
        for (int i = 0; i < 3; i++)
            at += snprintf(text + at, sizeof text - (size_t)at, ", foot%d: [%.17g, %.17g, %.17g]", i, foot[i][0] * L,
                           foot[i][1] * L, -0.1 * L);
        at += snprintf(
            text + at, sizeof text - (size_t)at,
            "}}\nloops: [{name: bar, type: distance, between: [{body: world, at: [%.17g, 0, %.17g]}, plate.end]}]\n"
            "effects:\n",
            0.2 * L, 0.7 * L);
        for (int i = 0; i < 3; i++)
            at += snprintf(
                text + at, sizeof text - (size_t)at,
                "  - {name: c%d, type: contact, point: plate.foot%d, radius: 0, plane: world, restitution: 0,\n"
                "     friction: 0.5, rest_velocity: %.17g}\n",
                i, i, 1e-6 * L);
        kt_parsed m;
        kt_error error = {0};
        const kt_run run = kt_run_within(NULL, 1e-9, 0.01);
        kt_record record = {0};
        kt_simulation_options options = kt_simulation_options_default();
        options.record = KT_RECORD_REACTION;
        kt_parsed_make(&m, text);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_need_fine("record", kt_simulation_sense(simulation, &record, &error), &error);
        for (int i = 0; i < 3; i++) {
            normal[k][i] = record.loop_reactions[1 + 2 * i].force.z / L;
            kt_check_near("normal force over the length, N/m", normal[k][i], normal[0][i], 1e-12);
        }
    }
}

/* A drive holds the joint of an arm whose end rests on a floor. No force moves the dry friction of this joint. */
KT_TEST(driven_joints_share_the_same_load_in_all_units) {
    double normal[LENGTHS];
    for (int k = 0; k < LENGTHS; k++) {
        const double L = lengths[k], I = L * L;
        char text[2048];
        kt_parsed m;
        kt_error error = {0};
        kt_record record = {0};
        const kt_run run = kt_run_within(NULL, 1e-9, 0.01);
        kt_simulation_options options = kt_simulation_options_default();
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, %.17g]\nbodies:\n"
                       "  - {name: a, mass: 2, com: [%.17g, 0, 0], inertia: [%.17g, %.17g, %.17g],\n"
                       "     joint: {type: revolute, axis: y, at: [0, 0, %.17g], position: -0.1}}\n"
                       "  - {name: b, parent: a, mass: 8, com: [%.17g, 0, 0], inertia: [%.17g, %.17g, %.17g],\n"
                       "     joint: {type: revolute, axis: y, at: [%.17g, 0, 0], position: -0.4},\n"
                       "     markers: {tip: [%.17g, 0, %.17g]}}\n"
                       "effects:\n  - {name: c, type: contact, point: b.tip, radius: 0, plane: world,\n"
                       "     restitution: 0, friction: 0.8, rest_velocity: %.17g}\n"
                       "  - {name: dry, type: joint_friction, joint: b, coulomb: %.17g, stick: true}\n"
                       "loops: [{name: drive, type: motion, joint: b, position: {polynomial: [-0.4]}}]\n",
                       -9.81 * L, 0.2 * L, 0.02 * I, 0.03 * I, 0.03 * I,
                       (0.1 * cos(0.5) - 0.4 * sin(0.1) - 0.4 * sin(0.5)) * L, 0.2 * L, 0.08 * I, 0.12 * I, 0.12 * I,
                       0.4 * L, 0.4 * L, -0.1 * L, 1e-6 * L, 64.0 * I);
        options.record = KT_RECORD_REACTION;
        kt_parsed_make(&m, text);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_need_fine("record", kt_simulation_sense(simulation, &record, &error), &error);
        normal[k] = record.loop_reactions[1].force.z / L;
        kt_check_near("normal force over the length, N/m", normal[k], normal[0], 1e-12);
    }
}
