/* Mechanisms on a driven floor move as on the world, because a drive takes every force. Loops connect all that touches
 * the floor, so that it is one island. Its contacts still act on each other only within a mechanism
 * (cone/coulomb_blocks.c). An arm rests by dry friction of its joints while a box slides and turns next to it. If both
 * slide, fixed steps predict the slip of each from the friction on its own mechanism (slip_prediction.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "motion/simulation/parsed.h"

enum { NQ = 9, NV = 8 }; /* of the box and of the arm */
static const double duration = 0.3;

/* An arm whose tip falls onto a plane of `floor`, and a box on one point of this plane. drive: the body
 * `floor`, if it is not the world, which has a constant speed (m/s). slides: the tip has friction, the joints have
 * little, and the box is slow. */
static void make_scene(const char *drive, const char *floor, double speed, bool slides, kt_parsed *m) {
    char text[2048], of[64] = "";
    if (*drive != '\0')
        (void)snprintf(of, sizeof of, "parent: %s, ", floor);
    (void)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [-2.17, -0.67, -9.81]\nbodies:\n%s"
        "  - {name: box, %sjoint: {type: free, position: {position: [3, 0, 0.138]}, velocity: {linear: [%g, %g, "
        "0], "
        "angular: [0, 0, 0.11]}}, mass: 4.9, inertia: [0.028, 0.043, 0.054], markers: {foot: [0.27, 0.007, -0.118]}}\n"
        "  - {name: upper, %sjoint: {type: revolute, axis: y, at: [3, 2, 0.1761], position: 0.289, velocity: 0.196}, "
        "mass: "
        "0.205, com: [0.2, 0, 0], inertia: [0.0018, 0.0022, 0.0028]}\n"
        "  - {name: lower, parent: upper, joint: {type: revolute, axis: y, at: [0.4, 0, 0], position: -0.383, "
        "velocity: "
        "0.15}, mass: 1.467, com: [0.2, 0, 0], inertia: [0.0132, 0.0158, 0.0190], markers: {tip: [0.4, 0, -0.1]}}\n"
        "effects:\n"
        "  - {name: foot, type: contact, point: box.foot, radius: 0, plane: {body: %s}, restitution: 0, friction: "
        "0.73}\n"
        "  - {name: tip, type: contact, point: lower.tip, radius: 0, plane: {body: %s}, restitution: 0, friction: "
        "%g}\n"
        "  - {name: d0, type: joint_friction, joint: upper, coulomb: %g, stick: true}\n"
        "  - {name: d1, type: joint_friction, joint: lower, coulomb: %g, stick: true}\n",
        drive, of, slides ? -0.05 : -0.59, slides ? 0.07 : 0.69, of, floor, floor, slides ? 0.4 : 0.0,
        slides ? 0.01 : 1.11, slides ? 0.01 : 2.73);
    const size_t used = strlen(text);
    if (*drive != '\0')
        (void)snprintf(text + used, sizeof text - used,
                       "loops: [{name: belt, type: motion, joint: floor, position: {polynomial: [0, %.17g]}}]\n",
                       speed);
    kt_parsed_make(m, text);
}

/* Runs the scene. Returns the number of steps that are rejected. first: of the coordinates that are not the floor's. */
static double run_scene(const kt_parsed *m, const char *method, size_t first, double *q, double *v) {
    kt_run run = kt_run_fixed(method, strcmp(method, "rk4") == 0 ? 1e-3 : 0.0, duration);
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {0};
    run.relative = run.absolute = 1e-10;
    options.max_steps = 3000;
    kt_simulation *simulation = kt_test_simulation(m->model, &run, &options);
    kt_need_fine(method, kt_simulation_advance(simulation, duration, &error), &error);
    memcpy(q, kt_simulation_positions(simulation) + first, NQ * sizeof *q);
    memcpy(v, kt_simulation_velocities(simulation) + first, NV * sizeof *v);
    return (double)kt_simulation_counts_of(simulation).rejected;
}

static void compare_floors(const char *method, double speed, bool slides, double bound) {
    kt_parsed world, driven;
    double q[2][NQ], v[2][NV], most = 0.0;
    make_scene("", "world", 0.0, slides, &world);
    make_scene("  - {name: floor, joint: {type: prismatic, axis: x}, mass: 1}\n", "floor", speed, slides, &driven);
    const double rejected = run_scene(&world, method, 0, q[0], v[0]);
    const double rejected_driven = run_scene(&driven, method, 1, q[1], v[1]);
    for (int i = 0; i < NQ; i++)
        most = fmax(most, fabs(q[1][i] - q[0][i]));
    for (int i = 0; i < NV; i++)
        most = fmax(most, fabs(v[1][i] - v[0][i]));
    kt_check_below(method, most, bound);
    kt_check_below("  steps that are rejected", rejected_driven, rejected + 10.0);
}

KT_TEST(an_arm_rests_beside_a_box_that_slides) {
    static const double speeds[] = {0.0, 2.0};
    for (size_t k = 0; k < sizeof speeds / sizeof *speeds; k++) {
        compare_floors("rk4", speeds[k], false, 1e-9);
        compare_floors("dopri5", speeds[k], false, 1e-8);
    }
}

KT_TEST(an_arm_slides_beside_a_box_as_alone) {
    compare_floors("rk4", 2.0, true, 1e-11);
    compare_floors("dopri5", 2.0, true, 1e-8);
}
