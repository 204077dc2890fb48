/* The laws that the check of each time step compares: wrong numbers disobey them, and rounding does not. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"
#include "kinetree/simulation.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stdio.h>

#include "check.h"
#include "motion/simulation/parsed.h"

/* A scene in time steps. */
static kt_simulation *start_steps(const char *text, double step) {
    kt_parsed m;
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    kt_parsed_make(&m, text);
    run.integrator = NULL;
    run.step = step;
    run.duration = 100.0;
    options.contact = KT_CONTACT_STEPS;
    return kt_test_simulation(m.model, &run, &options);
}

/* A rod of 2 kg falls flat on a floor, slides and rests in time steps. A number of the last step is then replaced by a
 * wrong one, which the check of steps must find, with its place. */
KT_TEST(steps_with_a_wrong_number_are_rejected) {
    static const struct {
        const char *what, *where, *message;
        int impulse, velocity; /* index; -1: right */
        double factor, more;
    } wrong[] = {
        {"normal impulse", "body 'rod'", "Newton's law", 0, -1, 1.0 + 1e-6, 0.0},
        {"velocity", "body 'rod'", "Newton's law", -1, 4, 1.0, 1e-7},
        {"impulse that pulls", "contact 'foot'", "disobeys", 0, -1, -1.0, 0.0},
        {"friction beyond its cone", "contact 'foot'", "disobeys", 1, -1, 1.01, 0.0},
        {"friction that does not resist", "contact 'foot'", "disobeys", 1, -1, 0.9, 0.0},
        {"velocity into the floor", "contact 'foot'", "disobeys", -1, 2, 1.0, -1e-3},
        {"velocity off the floor", "contact 'foot'", "disobeys", -1, 2, 1.0, 1e-3},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        kt_error error = {0};
        kt_simulation *simulation =
            start_steps("kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                        "  - {name: rod, mass: 2, inertia: [0.1, 0.2, 0.2], markers: {tip: [0, 0, 0]},\n"
                        "     joint: {type: free, velocity: {linear: [1, 0, 0], angular: [0, 0, 0]}}}\n"
                        "effects:\n  - {name: foot, type: contact, point: rod.tip, radius: 0, plane: world, "
                        "restitution: 0, friction: 0.5}\n",
                        1e-3);
        kt_test_advance(simulation, 0.01);
        kt_moreau *moreau = simulation->moreau;
        kt_need_fine("law", kt_moreau_check(simulation, moreau->h, &error), &error);
        if (wrong[i].impulse >= 0)
            moreau->p[wrong[i].impulse] *= wrong[i].factor;
        if (wrong[i].velocity >= 0)
            moreau->after[wrong[i].velocity] += wrong[i].more;
        kt_check_equal_int(wrong[i].what, kt_moreau_check(simulation, moreau->h, &error), KT_ERROR_STEP);
        kt_check_contains("place", error.where, wrong[i].where);
        kt_check_contains("time", error.where, "t = 0.0095 s");
        kt_check_contains("message", error.message, wrong[i].message);
    }
}

/* The foot of an arm with two joints rests on a floor, in time steps. The lower joint is then turned by 1e-4 rad, so
 * that the foot is 1.6e-5 m deep. The next step moves the arm out of the floor, which changes its mass matrix by 1e-5.
 */
KT_TEST(steps_out_of_a_depth_obey_newtons_law) {
    kt_error error = {0};
    kt_simulation *simulation =
        start_steps("kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                    "  - {name: upper, mass: 2, inertia: [0.02, 0.02, 0.02], com: [0, 0, -0.25],\n"
                    "     joint: {type: revolute, axis: y, at: [0, 0, 0.9], position: 0.6}}\n"
                    "  - {name: lower, parent: upper, mass: 1, inertia: [0.01, 0.01, 0.01], com: [0, 0, -0.25],\n"
                    "     markers: {tip: [0, 0, -0.5]},\n"
                    "     joint: {type: revolute, axis: y, at: [0, 0, -0.5], position: -1}}\n"
                    "effects:\n  - {name: foot, type: contact, point: lower.tip, radius: 0, plane: world, "
                    "restitution: 0, friction: 0.3}\n",
                    1e-3);
    kt_test_advance(simulation, 0.1);
    const double *q = kt_simulation_positions(simulation), deep[] = {q[0], q[1] + 1e-4};
    kt_need_fine("jump", kt_simulation_jump(simulation, deep, NULL, &error), &error);
    kt_test_advance(simulation, 0.101);
    kt_check_above("depth, m", simulation->moreau->counts.penetration, 1e-5);
    kt_check_below("gap after, m", fabs(simulation->contacts->gap[0]), 1e-13);
}

/* Without gravity, the impulses of a step may be nothing but rounding. The rate of a joint that friction stops falls to
 * subnormal numbers, and a sphere rolls off its plane. The errors of such impulses are as large as the impulses. They
 * disobey no law. */
KT_TEST(impulses_of_rounding_obey_their_laws) {
    static const char *const scene[] = {
        "kinetree: 1\ngravity: [0, 0, 0]\nbodies:\n"
        "  - {name: b, mass: 0.9, com: [0.2, 0, 0], inertia: [0.008, 0.0097, 0.012],\n"
        "     joint: {type: revolute, axis: y, velocity: 0.0563}}\n"
        "effects:\n  - {type: joint_friction, joint: b, coulomb: 6.9, stick: true}\n",
        "kinetree: 1\ngravity: [0, 0, 0]\nbodies:\n"
        "  - {name: s, mass: 4, inertia: [0.011, 0.011, 0.011], markers: {c: [0, 0, 0]}, joint: {type: free,\n"
        "     position: {position: [-0.015, -0.0049, 0.52]},\n"
        "     velocity: {linear: [0.41, 0.2, -1.2], angular: [-0.43, 1.1, -4.1]}}}\n"
        "effects:\n  - {type: contact, point: s.c, radius: 0.082, plane: world, axis: [-0.67, 0, 0.74],\n"
        "     restitution: 0, friction: 0.2}\n"};
    for (int k = 0; k < 2; k++) {
        kt_error error = {0};
        kt_simulation *simulation = start_steps(scene[k], k == 0 ? 1e-3 : 4e-3);
        (void)kt_fine("advance", kt_simulation_advance(simulation, 1.0, &error), &error);
    }
}

/* A drive turns the lower joint of an arm, or holds this joint at rest. No impulse changes its rate: dry friction has
 * its limit against the rate, and is zero at rest, where rounding has a sign. The motion has the same bits with all
 * masses times a power of two. Before, the cone solver took 15,000 steps for such a joint, in units of SI. */
KT_TEST(dry_friction_of_a_driven_joint_has_its_limit) {
    static const double rates[] = {0.0, 0.1, -0.1};
    for (int k = 0; k < 3; k++) {
        double end[2] = {0.0, 0.0};
        for (int twin = 0; twin < 2; twin++) {
            const double M = twin == 0 ? 1.0 : 0x1p-20;
            char text[1024];
            (void)snprintf(
                text, sizeof text,
                "kinetree: 1\ngravity: [1, 4, -9]\nbodies:\n"
                "  - {name: a, joint: {type: revolute, axis: y, position: -0.17, velocity: -0.1}, mass: %.17g,\n"
                "     com: [0.2, 0, 0], inertia: [%.17g, %.17g, %.17g]}\n"
                "  - {name: b, parent: a, joint: {type: revolute, axis: y, at: [0.4, 0, 0], position: 0.086,\n"
                "     velocity: %.17g}, mass: %.17g, com: [0.2, 0, 0], inertia: [%.17g, %.17g, %.17g],\n"
                "     markers: {tip: [0.4, 0, -0.1]}}\n"
                "effects:\n  - {type: contact, point: b.tip, radius: 0, plane: world, restitution: 0,\n"
                "     friction: 0.66}\n  - {name: dry, type: joint_friction, joint: b, coulomb: %.17g, "
                "stick: true}\n"
                "loops: [{name: drive, type: motion, joint: b, position: {polynomial: [0.086, %.17g]}}]\n",
                0.73 * M, 0.0066 * M, 0.0079 * M, 0.0099 * M, rates[k], 0.33 * M, 0.003 * M, 0.0036 * M, 0.0045 * M,
                64.0 * M, rates[k]);
            kt_simulation *simulation = start_steps(text, 1e-3);
            kt_test_advance(simulation, 0.05);
            const kt_contact_counts counts = kt_simulation_contacts(simulation);
            kt_check_equal_int("failures", (long long)counts.failures, 0);
            kt_check_below("steps of the cone solver", (double)counts.pivots, 1000.0);
            const int dry = simulation->contacts->n - 1;
            kt_check_near("friction, N m", simulation->contact_state[dry].force[0] / M,
                          k == 0 ? 0.0 : copysign(64.0, -rates[k]), 0.0);
            end[twin] = kt_simulation_velocities(simulation)[0];
        }
        kt_check_near("rate of the twin, rad/s", end[1], end[0], 0.0);
    }
}
