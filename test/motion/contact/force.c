/* Forces of contacts on their first bodies: Newton's and Euler's laws of the body hold with them, in all states. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>

#include "check.h"
#include "motion/simulation/parsed.h"
#include "random.h"

enum { CORNERS = 4 };
static const double g = 9.81, mass = 2.0, height = 0.1, inertia[3] = {0.02, 0.05, 0.06};

/* A box on four corners slides, sticks or flies. It lies on the plane z = 0 or on a table that moves. step: of fixed
 * steps; 0: steps are adaptive. */
static kt_simulation *start_box(kt_random *random, double friction, double speed, double step, const char *law,
                                kt_parsed *m) {
    char text[4096];
    size_t used = (size_t)snprintf(text, sizeof text,
                                   "kinetree: 1\ngravity: [%.17g, 0, %.17g]\nbodies:\n  - name: box\n    mass: %.17g\n "
                                   "   inertia: [%.17g, %.17g, %.17g]\n"
                                   "    joint: {type: free, position: {position: [0, 0, %.17g]}, velocity: {linear: "
                                   "[%.17g, %.17g, 0], angular: [0, 0, %.17g]}}\n"
                                   "    markers:\n",
                                   kt_random_uniform(random, 0.0, 1.0), -g, mass, inertia[0], inertia[1], inertia[2],
                                   height, speed * kt_random_uniform(random, -1.0, 1.0), speed, 3.0 * speed);
    for (int i = 0; i < CORNERS; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, "      p%d: [%.17g, %.17g, %.17g]\n", i,
                                 i % 2 == 0 ? 0.3 : -0.2, i / 2 == 0 ? 0.1 : -0.3, -height);
    used += (size_t)snprintf(text + used, sizeof text - used, "effects:\n");
    for (int i = 0; i < CORNERS; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: c%d, type: contact, point: box.p%d, radius: 0, plane: world, axis: z, "
                                 "friction: %.17g, %s}\n",
                                 i, i, friction, law);
    kt_parsed_make(m, text);
    kt_run run = step > 0.0 ? kt_run_fixed("rk4", step, 1.0) : kt_run_within("dopri5", 1e-9, 1.0);
    run.record = KT_RECORD_REACTION | KT_RECORD_ACCELERATION;
    const kt_simulation_options options = kt_simulation_options_default();
    return kt_test_simulation(m->model, &run, &options);
}

/* What Newton's and Euler's laws of the box leave, relative to the weight. */
static double imbalance_of(const kt_record *record, const kt_contact_load *load) {
    const kt_model *model = record->model;
    const kt_pose pose = kt_body_pose(model, record->data, 1);
    const kt_vec3 w = kt_body_twist(model, record->data, 1).angular,
                  alpha = kt_body_acceleration(model, record->data, 1).angular;
    const kt_vec3 a = kt_point_acceleration(model, record->data, 1, kt_vec3_make(0.0, 0.0, 0.0));
    kt_vec3 force = kt_vec3_scale(mass, kt_vec3_sub(a, kt_model_gravity(model)));
    const kt_vec3 wb = kt_mat3_apply_transposed(pose.rotation, w), ab = kt_mat3_apply_transposed(pose.rotation, alpha);
    const kt_vec3 spin = kt_vec3_make(inertia[0] * wb.x, inertia[1] * wb.y, inertia[2] * wb.z);
    kt_vec3 moment =
        kt_vec3_add(kt_vec3_make(inertia[0] * ab.x, inertia[1] * ab.y, inertia[2] * ab.z), kt_vec3_cross(wb, spin));
    moment = kt_mat3_apply(pose.rotation, moment);
    for (int i = 0; i < CORNERS; i++) {
        force = kt_vec3_sub(force, load[i].force);
        moment = kt_vec3_sub(moment, kt_vec3_cross(kt_vec3_sub(load[i].point, pose.position), load[i].force));
    }
    return (kt_vec3_norm(force) + kt_vec3_norm(moment)) / (mass * g);
}

/* Checks the forces of a box along a motion. Returns how many of them stick (0), and slip (1). */
static void follow_box(kt_simulation *simulation, double friction, kt_worst *balance, kt_worst *cone, int *seen) {
    for (int n = 1; n <= 10; n++) {
        kt_contact_load load[CORNERS];
        kt_record record;
        kt_error error = {0};
        kt_need_fine("advances", kt_simulation_advance(simulation, 0.02 * n, &error), &error);
        kt_need_fine("senses", kt_simulation_sense(simulation, &record, &error), &error);
        for (int i = 0; i < CORNERS; i++) {
            kt_need_fine("force", kt_record_contact(&record, i, &load[i], &error), &error);
            const double normal = kt_vec3_dot(load[i].force, load[i].normal);
            const kt_vec3 across = kt_vec3_sub(load[i].force, kt_vec3_scale(normal, load[i].normal));
            kt_worst_below(cone, fmax((kt_vec3_norm(across) - friction * normal) / (mass * g), 0.0), 1e-9,
                           "friction %g", friction);
            kt_worst_below(cone, fmax(kt_vec3_dot(across, load[i].slip) / (mass * g), 0.0), 1e-9, "work of friction %g",
                           friction);
            seen[0] += load[i].touches && load[i].sticks;
            seen[1] += load[i].touches && !load[i].sticks;
        }
        kt_worst_below(balance, imbalance_of(&record, load), 1e-9, "friction %g at %g s", friction, 0.02 * n);
    }
}

KT_TEST(forces_of_contacts_balance_the_body_that_sticks_or_slips) {
    static const char *const laws[] = {"restitution: 0", "stiffness: 20000, dissipation: 0.3, slip: 0.01"};
    kt_random random = kt_random_of_test();
    KT_WORST balance = kt_worst_make("Newton's and Euler's laws, relative to the weight"),
             cone = kt_worst_make("beyond the cone, or power of friction, relative");
    int seen[2] = {0, 0};
    for (int n = 0; n < 24; n++) {
        kt_parsed m;
        const double friction = kt_random_uniform(&random, 0.1, 0.9);
        kt_simulation *simulation =
            start_box(&random, friction, n % 3 == 0 ? 0.0 : kt_random_uniform(&random, 0.1, 2.0),
                      n % 2 == 0 ? 5e-3 : 0.0, laws[n % 4 == 3], &m);
        follow_box(simulation, friction, &balance, &cone, seen);
    }
    kt_check_above("contacts that stick", seen[0], 50.0);
    kt_check_above("contacts that slip", seen[1], 50.0);
}

KT_TEST(force_of_a_sliding_ball_is_that_of_coulomb) {
    kt_parsed m;
    kt_error error = {0};
    kt_contact_load load;
    kt_parsed_make(&m,
                   "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n  - name: ball\n    mass: 2\n    inertia: [1, 1, 1]\n"
                   "    joint: {type: free, position: {position: [0, 0, 0.1]}, velocity: {linear: [5, 0, 0]}}\n"
                   "effects:\n  - {name: s, type: spring, between: [world, ball], stiffness: 0, length: 0}\n"
                   "  - {name: c, type: contact, point: ball, radius: 0.1, plane: world, axis: z, restitution: 0, "
                   "friction: 0.3}\n");
    kt_run run = kt_run_fixed("rk4", 1e-3, 1.0);
    const kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_need_fine("advances", kt_simulation_advance(simulation, 0.1, &error), &error);
    kt_check_equal_int("no reactions", kt_contact_force(simulation, 1, &load, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("remedy", error.message, "KT_RECORD_REACTION");
    run.record = KT_RECORD_REACTION;
    simulation = kt_test_simulation(m.model, &run, &options);
    kt_need_fine("advances", kt_simulation_advance(simulation, 0.1, &error), &error);
    kt_check_equal_int("no contact", kt_contact_force(simulation, 0, &load, &error), KT_ERROR_ARGUMENT);
    kt_need_fine("force", kt_contact_force(simulation, 1, &load, &error), &error);
    kt_check_near("along, N", load.force.x, -0.3 * 2.0 * 9.81, 1e-12);
    kt_check_near("up, N", load.force.z, 2.0 * 9.81, 1e-12);
    kt_check_near("height, m", load.point.z, 0.0, 1e-15);
    kt_check_near("normal", load.normal.z, 1.0, 0.0);
    kt_check_true("slips", load.touches && !load.sticks);
}
