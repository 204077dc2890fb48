/* Modes along a motion with hard contacts, against closed forms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/scenes.h"

#include "kinetree/analysis.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"

/* Writes the modes of the states along a scene's motion. */
static kt_spectrum *spectrum_of_text(const char *text, int samples, kt_scene *scene, kt_model **model) {
    kt_error error = {0};
    kt_need_fine("scene", kt_scene_parse("x", text, strlen(text), scene, NULL, NULL, &error), &error);
    *model = kt_test_model(&scene->description, NULL);
    kt_spectrum *spectrum = kt_test_spectrum(*model, samples);
    (void)kt_fine("along", kt_spectrum_along(spectrum, &scene->run, &error), &error);
    return spectrum;
}

/* The number of modes of the state at a time, and the fastest one. */
static int modes_at(const kt_spectrum *spectrum, double time, kt_mode *first) {
    int count = 0;
    for (int i = kt_spectrum_count(spectrum) - 1; i >= 0; i--)
        if (fabs(kt_spectrum_at(spectrum, i).t - time) < 1e-12) {
            *first = kt_spectrum_at(spectrum, i).mode;
            count++;
        }
    return count;
}

/* A block stands on a stop, or on four contacts with friction, and carries a pendulum. Closed contacts are constraints.
 * Only the pendulum moves, with lambda^2 = -3 g / (2 l). Friction holds the block at any place and angle: three modes
 * of the rate 0. The simulation closes two of the four contacts, and all four rest. */
KT_TEST(closed_contacts_are_constraints_of_the_modes) {
    static const char *const grounds[] = {
        "  - {name: block, joint: {type: prismatic, axis: z}, mass: 2, inertia: [1, 1, 1]}\n",
        "  - {name: block, joint: {type: free}, mass: 20, inertia: [1, 1, 1], markers: {a: [2, 3, 0], b: [-2, 3, 0], "
        "c: [2, -3, 0], d: [-2, -3, 0]}}\n"};
    static const char *const contacts[] = {
        "  - {name: floor, type: joint_limit, joint: block, lower: 0, restitution: 0}\n",
        "  - {type: contact, point: block.a, plane: world, friction: 0.5, restitution: 0}\n"
        "  - {type: contact, point: block.b, plane: world, friction: 0.5, restitution: 0}\n"
        "  - {type: contact, point: block.c, plane: world, friction: 0.5, restitution: 0}\n"
        "  - {type: contact, point: block.d, plane: world, friction: 0.5, restitution: 0}\n"};
    for (int i = 0; i < 2; i++) {
        char text[2048];
        kt_scene scene = {0};
        kt_model *model = NULL;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n%s"
                       "  - {name: pend, parent: block, joint: {type: revolute, axis: y}, mass: 1, shape: {type: rod, "
                       "to: [0, 0, -1]}}\neffects:\n%ssimulate: {duration: 1}\n",
                       grounds[i], contacts[i]);
        kt_spectrum *spectrum = spectrum_of_text(text, 3, &scene, &model);
        kt_check_equal_int("states", kt_spectrum_samples(spectrum), 3);
        int swings = 0;
        for (int k = 0; k < kt_spectrum_count(spectrum); k++) {
            const kt_mode mode = kt_spectrum_at(spectrum, k).mode;
            const bool is_swing = fabs(mode.imaginary) > 1e-3;
            swings += is_swing;
            kt_check_near("rate", mode.real, 0.0, 1e-8);
            kt_check_near("frequency", fabs(mode.imaginary), is_swing ? sqrt(1.5 * 9.81) : 0.0, 1e-8);
        }
        kt_check_equal_int("swings", swings, 3);
        kt_check_equal_int("modes", kt_spectrum_count(spectrum), i == 0 ? 3 : 12);
        kt_scene_free(&scene);
    }
}

/* A block on a spring slides on a floor from x = 0 at 1 m/s. While it slips, friction is constant: lambda^2 = -k / m.
 * From its turn on, friction holds it at any place. */
KT_TEST(friction_that_slips_leaves_modes_and_friction_that_sticks_takes_them) {
    static const char text[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: rail, joint: {type: prismatic, axis: x, velocity: 1}, mass: 0}\n"
        "  - {name: block, parent: rail, joint: {type: prismatic, axis: z}, mass: 2, markers: {foot: [0, 0, 0]}}\n"
        "effects:\n"
        "  - {type: contact, point: block.foot, plane: world, friction: 0.5, restitution: 0}\n"
        "  - {type: joint_spring, joint: rail, stiffness: 18}\n"
        "simulate: {duration: 1}\n";
    kt_scene scene = {0};
    kt_model *model = NULL;
    kt_spectrum *spectrum = spectrum_of_text(text, 11, &scene, &model);
    kt_mode first = {0};
    kt_check_equal_int("states", kt_spectrum_samples(spectrum), 11);
    kt_check_equal_int("modes that slip", modes_at(spectrum, 0.1, &first), 1);
    kt_check_near("frequency", fabs(first.imaginary), 3.0, 1e-9);
    kt_check_equal_int("modes that stick", modes_at(spectrum, 0.9, &first), 1);
    kt_check_near("rate", hypot(first.real, first.imaginary), 0.0, 1e-9);
    kt_scene_free(&scene);
}
