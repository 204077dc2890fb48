/* Footholds: a leg that lands anywhere, and is welded there by {engage_here: LOOP}. Places, checkpoints, a scene that
 * goes on from a result, files, and rejected actions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "random.h"
#include "running.h"

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

/* A leg with a sole is thrown, lands at an angle that no one knows before, and is welded there. Its trunk swings on.
 * Later the leg is let go, is thrown once more, and lands at another place. */
#define LEG(foot, trunk, loop, up, more)                                                                               \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  - {name: foot, joint: " foot ", mass: 0.5, inertia: [0.01, 0.02, 0.03], markers: {sole: [0.01, 0, -0.05]}}\n"   \
    "  - {name: trunk, parent: foot, joint: " trunk ", mass: 2, com: [0, 0, 0.3], inertia: [0.1, 0.2, 0.1]}\n"         \
    "effects: [{type: joint_spring, joint: trunk, stiffness: 80, damping: 1}]\n"                                       \
    "loops: [{name: hold, type: " loop ", between: [foot.sole, world], switched: off}]\n"                              \
    "events:\n"                                                                                                        \
    "  - {name: lands, when: marker.foot.sole.z, direction: falling, limit: 1, then: {engage_here: hold}}\n"           \
    "  - {name: lets go, when: t - 0.6, then: {release: hold}}\n"                                                      \
    "  - {name: jumps, when: t - 0.601, then: {set: {" up "}}}\n"                                                      \
    "  - {name: lands again, when: marker.foot.sole.z + 10*(t < 0.7), direction: falling, limit: 1, then: "            \
    "{engage_here: hold}}\n" more "simulate: {duration: 1.5, integrator: dopri5, tolerance: 1e-9}\n"

#define IN_SPACE                                                                                                       \
    "{type: free, position: {position: [0.3, -0.2, 0.5]}, velocity: {linear: [0.7, 0.4, 0.2], angular: [0.5, -0.3, "   \
    "1.1]}}"
#define IN_PLANE "{type: planar, axis: y, position: [0.3, 0.5, 0.2], velocity: [0.7, 0.2, 1.3]}"
#define HIP "{type: revolute, axis: y, at: [0, 0, 0.1]}"

static const char in_space[] = LEG(IN_SPACE, HIP, "weld", "\"velocity.foot[2]\": 2.5, \"velocity.foot[0]\": 0.8", "");
static const char in_plane[] = LEG(IN_PLANE, HIP, "weld", "\"velocity.foot[0]\": 2.5, \"velocity.foot[1]\": 2.5", "");

static kt_vec3 sole_of(const running *r) {
    kt_error error = {0};
    kt_data *data = kt_test_data(r->model);
    kt_need_fine("kinematics",
                 kt_kinematics_update(r->model, data, kt_simulation_positions(r->simulation), NULL, NULL, &error),
                 &error);
    return kt_point_position(r->model, data, kt_body_find(r->model, "foot"), kt_vec3_make(0.01, 0.0, -0.05));
}

static double distance(kt_vec3 a, kt_vec3 b) { return kt_vec3_norm(kt_vec3_sub(a, b)); }

static kt_vec3 held_place(const running *r) {
    const double *x = kt_simulation_auxiliary_states(r->simulation);
    return kt_vec3_make(x[0], x[1], x[2]);
}

/* ---- where it lands ---------------------------------------------------------------------------------------------- */

/* Bounds: the tolerance of projections, 1e-12 of the length; for the height ten times the tolerance of steps. */
static void check_landings(const char *text) {
    const running r = running_start(text, NULL);
    kt_check_near("described place, m", kt_vec3_norm(held_place(&r)), 0.0, 0.0);
    running_advance(&r, 0.5);
    const kt_vec3 first = sole_of(&r);
    kt_check_equal_int("landings", (long long)kt_simulation_event_count(r.simulation, "lands"), 1);
    kt_check_near("lands on the ground, m", first.z, 0.0, 1e-8);
    kt_check_above("far from the described place, m", kt_vec3_norm(first), 0.3);
    kt_check_near("its states hold the place", distance(first, held_place(&r)), 0.0, 1e-11);
    running_advance(&r, 0.599);
    kt_check_near("the sole stays, m", distance(sole_of(&r), first), 0.0, 1e-11);
    running_advance(&r, 1.5);
    kt_check_equal_int("landings", (long long)kt_simulation_event_count(r.simulation, "lands again"), 1);
    kt_check_above("at another place, m", distance(sole_of(&r), first), 0.1);
    kt_check_near("its states hold the place", distance(sole_of(&r), held_place(&r)), 0.0, 1e-11);
}

KT_TEST(a_leg_is_welded_where_it_lands) { check_landings(in_space); }
KT_TEST(a_leg_in_a_plane_is_welded_where_it_lands) { check_landings(in_plane); }
KT_TEST(a_leg_is_pinned_where_it_lands) {
    check_landings(LEG(IN_SPACE, HIP, "spherical", "\"velocity.foot[2]\": 2.5, \"velocity.foot[0]\": 1", ""));
}

/* A hinge at the origin, held at its tip. The described place is out of reach: no position of the description tells how
 * many equations are independent. The hinge then rests where the event was. */
KT_TEST(a_tip_is_held_although_its_described_place_is_out_of_reach) {
    const running r =
        running_start("kinetree: 1\n"
                      "gravity: [0, 0, -9.81]\n"
                      "bodies: [{name: a, joint: {type: revolute, axis: y, position: 0.5}, mass: 1, com: [0, 0, -0.5], "
                      "inertia: [0.1, 0.1, 0.1], markers: {tip: [0, 0, -1]}}]\n"
                      "loops: [{name: grab, type: spherical, between: [a.tip, world], switched: off}]\n"
                      "events: [{name: low, when: position.a - 0.1, direction: falling, limit: 1, then: "
                      "{engage_here: grab}}]\n",
                      NULL);
    running_advance(&r, 1.0);
    kt_check_near("position, rad", kt_simulation_positions(r.simulation)[0], 0.1, 1e-8); /* ten tolerances */
    kt_check_near("velocity, rad/s", kt_simulation_velocities(r.simulation)[0], 0.0, 1e-12);
}

/* Two legs of equal length on a hip land one after the other. Both feet have the same described place, where three of
 * their equations are independent. At two places, four are: the feet stay, and only one degree of freedom is left. */
KT_TEST(two_equal_legs_stand_at_different_places) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  - {name: hip, joint: {type: planar, rotation: {rpy: [90 deg, 0, 0]}, position: [0, 1, 0], velocity: "
        "[0.6, 0, 0.3]}, mass: 3, inertia: [0.1, 0.1, 0.1]}\n"
        "  - {name: legA, parent: hip, joint: {type: revolute, axis: z, position: -1.2}, mass: 1, com: [0.5, 0, 0], "
        "inertia: [0.1, 0.1, 0.1], markers: {tip: [1, 0, 0]}}\n"
        "  - {name: legB, parent: hip, joint: {type: revolute, axis: z, position: -1.9}, mass: 1, com: [0.5, 0, 0], "
        "inertia: [0.1, 0.1, 0.1], markers: {tip: [1, 0, 0]}}\n"
        "effects:\n"
        "  - {type: joint_spring, joint: legA, stiffness: 300, damping: 8, rest: -1.3}\n"
        "  - {type: joint_spring, joint: legB, stiffness: 300, damping: 8, rest: -1.8}\n"
        "loops:\n"
        "  - {name: fA, type: spherical, between: [legA.tip, {body: world, rotation: {rpy: [90 deg, 0, 0]}}], "
        "switched: off}\n"
        "  - {name: fB, type: spherical, between: [legB.tip, {body: world, rotation: {rpy: [90 deg, 0, 0]}}], "
        "switched: off}\n"
        "events:\n"
        "  - {name: landA, when: marker.legA.tip.z, direction: falling, limit: 1, then: {engage_here: fA}}\n"
        "  - {name: landB, when: marker.legB.tip.z, direction: falling, limit: 1, then: {engage_here: fB}}\n";
    const running r = running_start(text, NULL);
    running_advance(&r, 0.5);
    const double *x = kt_simulation_auxiliary_states(r.simulation);
    kt_check_equal_int("landings", (long long)kt_simulation_event_count(r.simulation, "landA"), 1);
    kt_check_equal_int("landings", (long long)kt_simulation_event_count(r.simulation, "landB"), 1);
    kt_check_above("the feet are apart, m", fabs(x[0] - x[6]), 0.1);
}

/* Both feet act at one point at first, where three of their equations are independent. This count is kept. At another
 * place four are: the run ends with an error, and no foot slips. If footholds are off at first, four are counted. */
KT_TEST(footholds_at_one_point_at_first_end_a_run_at_another_one) {
    static const char legs[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  - {name: hip, joint: {type: planar, rotation: {rpy: [90 deg, 0, 0]}, position: [0, 1, 0]}, mass: 3, "
        "inertia: "
        "[0.1, 0.1, 0.1]}\n"
        "  - {name: legA, parent: hip, joint: {type: revolute, axis: z, position: -90 deg}, mass: 1, com: [0.5, 0, 0], "
        "inertia: [0.1, 0.1, 0.1], markers: {tip: [1, 0, 0]}}\n"
        "  - {name: legB, parent: hip, joint: {type: revolute, axis: z, position: -90 deg}, mass: 1, com: [0.5, 0, 0], "
        "inertia: [0.1, 0.1, 0.1], markers: {tip: [1, 0, 0]}}\n"
        "effects:\n"
        "  - {type: joint_spring, joint: legA, stiffness: 300, damping: 8, rest: -1.3}\n"
        "  - {type: joint_spring, joint: legB, stiffness: 300, damping: 8, rest: -1.8}\n"
        "loops:\n"
        "  - {name: fA, type: spherical, between: [legA.tip, {body: world, at: [%s, 0, 0], rotation: {rpy: [90 deg, 0, "
        "0]}}]%s}\n"
        "  - {name: fB, type: spherical, between: [legB.tip, {body: world, rotation: {rpy: [90 deg, 0, 0]}}]%s}\n"
        "events: [%s{name: off, when: t - 0.1, then: {release: fA}}, {name: on, when: t - 0.2, then: {engage_here: "
        "fA}}]\n";
    char text[2000];
    kt_error error = {0};
    (void)snprintf(text, sizeof text, legs, "0", "", "", "");
    running r = running_start(text, NULL);
    kt_check_true("ends", kt_simulation_advance(r.simulation, 0.5, &error) == KT_ERROR_CONSTRAINT);
    kt_check_contains("why", error.message, "contradict each other");
    kt_check_near("at the event", kt_simulation_time(r.simulation), 0.2, 1e-12);
    (void)snprintf(text, sizeof text, legs, "0.5", ", switched: off", ", switched: off",
                   "{name: stand, when: t - 0.01, then: [{engage_here: fA}, {engage_here: fB}]}, ");
    r = running_start(text, NULL);
    running_advance(&r, 0.5);
    kt_check_above(
        "the feet are apart, m",
        fabs(kt_simulation_auxiliary_states(r.simulation)[0] - kt_simulation_auxiliary_states(r.simulation)[6]), 0.1);
}

/* Two legs stand on footholds and on hard contacts. One foothold is released at rest. Its contact then closes at
 * 3e-42 m/s, and no joint has a lever against it. */
KT_TEST(contacts_that_close_by_rounding_rest) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  - {name: hip, joint: {type: planar, rotation: {rpy: [90 deg, 0, 0]}, position: [0, 1, 0], velocity: [0.6, "
        "0, 0.3]}, mass: 3, inertia: [0.1,0.1,0.1]}\n"
        "  - {name: legA, parent: hip, joint: {type: revolute, axis: z, position: -1.2}, mass: 1, com: [0.5,0,0], "
        "inertia: [0.1,0.1,0.1], markers: {tip: [1,0,0]}}\n"
        "  - {name: legB, parent: hip, joint: {type: revolute, axis: z, position: -1.9}, mass: 1, com: [0.5,0,0], "
        "inertia: [0.1,0.1,0.1], markers: {tip: [1,0,0]}}\n"
        "loops:\n"
        "  - {name: fA, type: spherical, between: [legA.tip, {body: world, at: [0.3,0,0], rotation: {rpy: [90 "
        "deg,0,0]}}], switched: off}\n"
        "  - {name: fB, type: spherical, between: [legB.tip, {body: world, rotation: {rpy: [90 deg,0,0]}}], switched: "
        "off}\n"
        "effects:\n"
        "  - {name: sA, type: joint_spring, joint: legA, stiffness: 300, damping: 8, rest: -1.3}\n"
        "  - {name: sB, type: joint_spring, joint: legB, stiffness: 300, damping: 8, rest: -1.8}\n"
        "  - {name: top, type: joint_limit, joint: legA, lower: -2.5, upper: -0.2, restitution: 0}\n"
        "  - {name: top2, type: joint_limit, joint: legB, lower: -2.9, upper: -0.2, restitution: 0}\n"
        "  - {name: fr, type: joint_friction, joint: legB, coulomb: 0.5, stick: true}\n"
        "  - {name: cA, type: contact, point: legA.tip, plane: world, restitution: 0, friction: 0.4}\n"
        "  - {name: cB, type: contact, point: legB.tip, plane: world, restitution: 0, friction: 0.4}\n"
        "events:\n"
        "  - {name: landA, when: marker.legA.tip.z, direction: falling, limit: 1, then: {engage_here: fA}}\n"
        "  - {name: landB, when: marker.legB.tip.z, direction: falling, limit: 1, then: {engage_here: fB}}\n"
        "  - {name: offA, when: t - 0.5, then: {release: fA}}\n";
    const running r = running_start(text, NULL);
    running_advance(&r, 0.51);
    kt_check_equal_int("let go", (long long)kt_simulation_event_count(r.simulation, "offA"), 1);
}

/* ---- contacts at feet ------------------------------------------------------------------------------------------ */

/* A box with two feet is thrown. Its feet have hard contacts and footholds at the same points, and the feet land one
 * after the other. Each foothold holds the gap of the contact at its foot, and a weld holds the gaps of both. */
#define TWO_FEET(loop, contact) THROWN_FEET(loop, contact, "0.7, 0.4, 0.2", "0.5, -0.3, 1.1")
#define THROWN_FEET(loop, contact, linear, angular)                                                                    \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "bodies: [{name: foot, joint: {type: free, position: {position: [0.3, -0.2, 0.5]}, velocity: {linear: [" linear    \
    "], angular: [" angular "]}}, mass: 3, shape: {type: box, size: [0.4, 0.3, 0.2]}, markers: {a: "                   \
    "[0.2, 0, -0.2], b: [-0.2, 0, -0.2]}}]\n"                                                                          \
    "loops:\n"                                                                                                         \
    "  - {name: fA, type: " loop ", between: [foot.a, world], switched: off}\n"                                        \
    "  - {name: fB, type: " loop ", between: [foot.b, world], switched: off}\n"                                        \
    "effects:\n"                                                                                                       \
    "  - {name: cA, type: contact, point: foot.a, plane: world, restitution: 0" contact "}\n"                          \
    "  - {name: cB, type: contact, point: foot.b, plane: world, restitution: 0" contact "}\n"                          \
    "events:\n"                                                                                                        \
    "  - {name: landA, when: marker.foot.a.z, direction: falling, limit: 1, then: {engage_here: fA}}\n"                \
    "  - {name: landB, when: marker.foot.b.z, direction: falling, limit: 1, then: {engage_here: fB}}\n"                \
    "  - {name: offA, when: t - 1.2, then: {release: fA}}\n"                                                           \
    "  - {name: offB, when: t - 1.2, then: {release: fB}}\n"

static double energy_of(const running *r) {
    kt_error error = {0};
    kt_data *data = kt_test_data(r->model);
    kt_need_fine("kinematics",
                 kt_kinematics_update(r->model, data, kt_simulation_positions(r->simulation),
                                      kt_simulation_velocities(r->simulation), NULL, &error),
                 &error);
    return kt_kinetic_energy(r->model, data) + kt_potential_energy(r->model, data);
}

typedef struct two_feet {
    double rise;        /* of the energy within 0.05 s, J */
    double taken, lost; /* energy that impacts take, and that the mechanism loses, J */
    bool open;          /* all contacts are open while footholds act */
} two_feet;

/* Runs to 1.5 s. */
static two_feet run_two_feet(const char *text) {
    two_feet found = {.rise = 0.0};
    const running r = running_start(text, NULL);
    const double start = energy_of(&r);
    double energy = start;
    for (int k = 1; k <= 30; k++) {
        const double before = energy;
        running_advance(&r, 0.05 * k);
        energy = energy_of(&r);
        found.rise = fmax(found.rise, energy - before);
        const kt_contact_counts counts = kt_simulation_contacts(r.simulation);
        found.open = k == 23 ? counts.closings == counts.openings : found.open;
    }
    found.taken = kt_simulation_contacts(r.simulation).dissipated;
    found.lost = start - energy;
    return found;
}

/* Bound of energies: rounding of 1e5 evaluations at 16 J. Impacts take no more energy than the mechanism loses. */
KT_TEST(footholds_hold_contacts_at_their_feet) {
    static const char *const texts[] = {TWO_FEET("spherical", ""), TWO_FEET("spherical", ", friction: 0.4"),
                                        TWO_FEET("weld", ""), TWO_FEET("weld", ", friction: 0.4"),
                                        TWO_FEET("spherical", ", friction: 0.4, poisson: true")};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        kt_note("scene %d", (int)i);
        const two_feet found = run_two_feet(texts[i]);
        kt_check_below("impacts take, J", found.taken, found.lost);
        kt_check_below("the energy rises, J", found.rise, 16.0 * 1e-11);
        kt_check_true("contacts at held feet are open", found.open);
    }
}

/* Fixed steps of 1 ms, of the first order in the energy at impacts. Bound: 16 J times 1e-3 / 50. */
KT_TEST(footholds_hold_contacts_at_their_feet_in_time_stepping) {
    const two_feet found =
        run_two_feet(TWO_FEET("spherical", ", friction: 0.4") "simulate: {contact: steps, step: 1e-3}\n");
    kt_check_below("impacts take, J", found.taken, found.lost);
    kt_check_below("the energy rises, J", found.rise, 3.2e-4);
}

/* Which foot lands first, and when a contact at a held foot penetrates by rounding, depends on the throw. */
KT_TEST(footholds_hold_contacts_at_thrown_feet_in_time_stepping) {
    kt_random random = kt_random_of_test();
    for (int i = 0; i < 12; i++) {
        char text[4096];
        double u[5];
        for (int k = 0; k < 5; k++)
            u[k] = kt_random_uniform(&random, -0.2, 0.2);
        (void)snprintf(text, sizeof text,
                       THROWN_FEET("spherical", ", friction: 0.4", "%.17g, %.17g, 0.2",
                                   "%.17g, %.17g, %.17g") "simulate: {contact: steps, step: 1e-3}\n",
                       0.7 + u[0], 0.4 + u[1], 0.5 + u[2], -0.3 + u[3], 1.1 + u[4]);
        kt_note("throw %d", i);
        const two_feet found = run_two_feet(text);
        kt_check_below("impacts take, J", found.taken, found.lost + 3.2e-4);
        kt_check_true("impacts take energy", found.taken > 0.0);
        kt_check_below("the energy rises, J", found.rise, 3.2e-4);
    }
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* A second simulation goes on from a checkpoint of the first one, in all phases. It has been at other footholds
 * before. */
static void check_checkpoints(const char *text) {
    static const double times[] = {0.0, 0.2, 0.45, 0.55, 0.62, 0.8, 1.4};
    kt_error error = {0};
    const running a = running_start(text, NULL);
    const running b = running_start(text, NULL);
    const size_t size = kt_simulation_state_size(a.simulation), nq = (size_t)kt_model_nq(a.model);
    const size_t count = sizeof times / sizeof *times, nx = (size_t)kt_auxiliary_state_count(a.model);
    char *blocks = running_room(&a, count);
    for (size_t i = 0; i < count; i++) {
        running_advance(&a, times[i]);
        kt_simulation_save(a.simulation, blocks + i * size);
    }
    running_advance(&a, 1.5);
    for (size_t i = count; i-- > 0;) {
        kt_note("from %g s", times[i]);
        kt_need_fine("restored", kt_simulation_restore(b.simulation, blocks + i * size, &error), &error);
        kt_need_fine("synchronised", kt_scene_watch_sync(b.watch, b.simulation, &error), &error);
        for (size_t k = i + 1; k < count; k++)
            running_advance(&b, times[k]);
        running_advance(&b, 1.5);
        kt_check_equal_bits("positions", kt_simulation_positions(b.simulation), kt_simulation_positions(a.simulation),
                            nq);
        kt_check_equal_bits("places", kt_simulation_auxiliary_states(b.simulation),
                            kt_simulation_auxiliary_states(a.simulation), nx);
    }
}

KT_TEST(checkpoints_hold_footholds) { check_checkpoints(in_space); }
KT_TEST(checkpoints_hold_footholds_in_a_plane) { check_checkpoints(in_plane); }

/* Two pendulums beside the leg rest on hard stops of theirs, and a third one never does: sets of stops are masked, and
 * the model of a checkpoint is made before the foothold is known. */
KT_TEST(checkpoints_hold_footholds_beside_stops) {
    static const char stops[] =
        "  - {name: b1, joint: {type: revolute, axis: y, at: [3, 0, 0]}, mass: 1, com: [0.2, 0, "
        "0], inertia: [0.1, 0.1, 0.1]}\n"
        "  - {name: b2, joint: {type: revolute, axis: y, at: [3, 0, 0]}, mass: 1, com: [0.3, 0, "
        "0], inertia: [0.1, 0.1, 0.1]}\n"
        "  - {name: b3, joint: {type: revolute, axis: y, at: [3, 0, 0]}, mass: 1, com: [0, 0, "
        "-0.2], inertia: [0.1, 0.1, 0.1]}\n"
        "effects:\n"
        "  - {type: joint_limit, joint: b1, upper: 0.1, restitution: 0}\n"
        "  - {type: joint_limit, joint: b2, upper: 0.2, restitution: 0}\n"
        "  - {type: joint_limit, joint: b3, upper: 1, restitution: 0}\n"
        "  - ";
    char text[sizeof in_space + sizeof stops];
    const char *effects = strstr(in_space, "effects: [");
    const char *rest = strchr(effects, ']');
    (void)snprintf(text, sizeof text, "%.*s%s%.*s%s", (int)(effects - in_space), in_space, stops,
                   (int)(rest - effects) - 10, effects + 10, rest + 1);
    check_checkpoints(text);
}

/* ---- other starts ------------------------------------------------------------------------------------------------ */

KT_TEST(a_state_that_is_set_has_the_described_place) {
    kt_error error = {0};
    double place[KT_PARAMETER_MAX];
    kt_parameter parameter;
    const running r = running_start(in_space, NULL);
    running_advance(&r, 0.5);
    kt_check_true("finds", kt_parameter_find(r.model, "loop hold.place", &parameter, &error) == KT_OK);
    kt_check_true("gets", kt_parameter_get(r.model, &parameter, place, &error) == KT_OK);
    kt_check_near("at the foothold", distance(kt_vec3_make(place[0], place[1], place[2]), sole_of(&r)), 0.0, 1e-11);
    kt_status status = kt_simulation_set_state(r.simulation, 0.0, kt_simulation_positions(r.simulation), NULL, &error);
    if (status == KT_OK)
        status = kt_scene_watch_sync(r.watch, r.simulation, &error);
    kt_check_text("sets", status == KT_OK ? "" : error.message, "");
    kt_check_true("gets", kt_parameter_get(r.model, &parameter, place, &error) == KT_OK);
    for (int k = 0; k < 6; k++)
        kt_check_near("described", place[k], 0.0, 0.0);
}

/* A scene that goes on from a state in which the foot is held, as `--from` does: nothing moves at the start. */
KT_TEST(a_scene_goes_on_with_its_foothold) {
    kt_error error = {0};
    const running a = running_start(in_space, NULL);
    running_advance(&a, 0.5);
    kt_scene *scene = running_read(in_space, NULL);
    const double *q = kt_simulation_positions(a.simulation), *v = kt_simulation_velocities(a.simulation);
    kt_need_fine("state", kt_scene_start_from(scene, a.model, q, v, &error), &error);
    kt_need_fine("places", kt_scene_start_states(scene, kt_simulation_auxiliary_states(a.simulation), &error), &error);
    ((kt_loop *)(uintptr_t)scene->description.loops)[0].switching = KT_SWITCHED_ON;
    const running b = running_begin(scene, kt_simulation_options_default().record);
    double worst = 0.0;
    for (int i = 0; i < kt_model_nq(a.model); i++)
        worst = fmax(worst, fabs(kt_simulation_positions(b.simulation)[i] - q[i]));
    kt_check_near("positions", worst, 0.0, 1e-14);
    kt_check_equal_bits("places", kt_simulation_auxiliary_states(b.simulation),
                        kt_simulation_auxiliary_states(a.simulation), 6);
    running_advance(&b, 0.09);
    kt_check_near("the sole stays, m", distance(sole_of(&b), sole_of(&a)), 0.0, 1e-11);
}

/* A loop that acts keeps its place, although the event happens again. */
KT_TEST(an_acting_loop_keeps_its_place) {
    const running r = running_start(LEG(IN_SPACE, HIP, "spherical", "\"velocity.foot[2]\": 2.5",
                                        "  - {name: again, when: t - 0.5, then: {engage_here: hold}}\n"),
                                    NULL);
    running_advance(&r, 0.45);
    const kt_vec3 place = held_place(&r);
    double x[6];
    memcpy(x, kt_simulation_auxiliary_states(r.simulation), sizeof x);
    running_advance(&r, 0.55);
    kt_check_equal_int("again", (long long)kt_simulation_event_count(r.simulation, "again"), 1);
    kt_check_equal_bits("place", kt_simulation_auxiliary_states(r.simulation), x, 6);
    kt_check_near("the sole stays, m", distance(sole_of(&r), place), 0.0, 1e-11);
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

/* The described place counts for the states, also with an axis and a rotation; and a written scene is read back. */
KT_TEST(a_scene_with_a_foothold_is_written_and_read) {
    static const char text[] =
        "kinetree: 1\n"
        "bodies: [{name: foot, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}]\n"
        "loops: [{name: hold, type: revolute, axis: x, between: [{body: world, at: [1, 2, 3], rotation: "
        "{axis: [0, 0, 1], angle: 0.5}}, foot], switched: off}]\n"
        "events: [{name: lands, when: \"position.foot[2] + hold_x\", then: {engage_here: hold}}]\n";
    const kt_scene *scene = running_read(text, NULL), *again = running_read(kt_test_written(scene), NULL);
    kt_check_equal_int("states", again->description.state_count, 6);
    kt_check_true("here", again->events[0].switches[0].here);
    const double expected[] = {1.0, 2.0, 3.0};
    for (int k = 0; k < 6; k++) {
        kt_check_near("initial value", again->description.states[k].initial, scene->description.states[k].initial,
                      1e-15);
        if (k < 3)
            kt_check_near("point", scene->description.states[k].initial, expected[k], 0.0);
    }
}

/* Bennett's linkage moves at its described place, and is rigid at most others. It is closed there to 2e-7 rad. The
 * second scene sets a parameter, so that its model is settable. */
KT_TEST(a_linkage_that_is_closed_at_its_described_place_moves) {
    static const char bennett[] =
        "kinetree: 1\n"
        "parameters: {m: 1}\n"
        "gravity: [0, -9.81, 0]\n"
        "bodies:\n"
        "  - {name: a, joint: {type: revolute, axis: z, position: 1}, mass: =m, shape: {type: rod, to: [1, 0, 0]}}\n"
        "  - {name: b, parent: a, joint: {type: revolute, axis: z, at: [1, 0, 0], rotation: {axis: [1, 0, 0], angle: "
        "30 "
        "deg}, position: %s}, mass: 1.7, shape: {type: rod, to: [1.7320508075688772, 0, 0]}}\n"
        "  - {name: c, parent: b, joint: {type: revolute, axis: z, at: [1.7320508075688772, 0, 0], rotation: {axis: "
        "[1, "
        "0, 0], angle: 60 deg}, position: -1}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
        "loops: [{name: close, type: revolute, axis: z, switched: off, between: [{body: c, at: [1, 0, 0], rotation: "
        "{axis: [1, 0, 0], angle: 30 deg}}, {body: world, at: [-1.7320508075688772, 0, 0], rotation: {axis: [1, 0, 0], "
        "angle: -60 deg}}]}]\n"
        "events: [{name: locks, when: t - 1e-5, limit: 1, then: [{engage: close}%s]}]\n"
        "simulate: {duration: 0.4}\n";
    running r;
    char text[2000];
    for (int sets = 0; sets < 2; sets++) {
        (void)snprintf(text, sizeof text, bennett, "2.7468771", sets ? ", {set: {m: 1}}" : "");
        r = running_start(text, NULL);
        running_advance(&r, 0.4);
        const kt_simulation_counts counts = kt_simulation_counts_of(r.simulation);
        kt_check_equal_int("degrees of freedom", kt_model_mobility(kt_simulation_model(r.simulation)).minimal, 1);
        kt_check_below("steps that are rejected", (double)counts.rejected, 10.0);
    }
    (void)snprintf(text, sizeof text, bennett, "2.5", "");
    r = running_start(text, NULL);
    kt_check_equal_int("described far away", kt_model_mobility(kt_model_switched(r.model, 1)).minimal, 1);
}

KT_TEST(wrong_footholds_name_the_fault_and_the_mend) {
    static const struct {
        const char *loop, *action, *words;
    } wrong[] = {
        {"{name: hold, type: distance, between: [world, foot], length: 1}", "{engage_here: hold}",
         "or write {engage: hold}"},
        {"{name: hold, type: weld, between: [other, foot.sole]}", "{engage_here: hold}",
         "is a marker, whose place is fixed"},
        {"{name: hold, type: weld, between: [slab, foot]}", "{engage_here: hold}", "is fixed to the world"},
        {"{name: hold, type: weld, between: [world, foot]}", "{engage_here: hald}", "did you mean 'hold'"},
        {"{name: hold, type: weld, between: [world, foot]}", "{engage_here: push}", "which has no place"},
        {"{name: hold, type: weld, between: [world, foot]}", "{engage_heer: hold}",
         "'engage_heer' is no action; did you mean {engage_here: NAME}?"},
        {"{name: hold, type: weld, between: [world, foot]}", "{engagehere: hold}", "did you mean {engage_here: NAME}?"},
        {"{name: hold, type: weld, between: [world, foot]}", "{relese: hold}", "did you mean {release: NAME}?"},
        {"{name: hold, type: weld, between: [world, foot]}", "[stop, {sett: {gain_x: 1}}]", "did you mean {set: {"},
        {"{name: hold, type: weld, between: [world, foot]}", "{engage_here: hold, stop: 1}", "one action in each map"},
        {"{name: hold, type: weld, between: [world, foot]}", "[{engage_here: hold}, {set: {hold_x: 1}}]",
         "'hold_x' holds the place of the loop 'hold'"},
        {"{name: hold, type: weld, between: [world, foot]}", "[{set: {hold_rz: 1}}, {engage_here: hold}]",
         "use {engage_here: hold}"},
        {"{name: hold, type: weld, between: [world, foot]}", "[{engage_here: hold}, {set: {hold_xy: 1}}]",
         "there is no parameter, state or velocity 'hold_xy'; did you mean 'cold_xyz'?"},
        {"{name: gain, type: weld, between: [world, foot]}", "{engage_here: gain}",
         "makes the state 'gain_x', which is one of `parameters`"},
        {"{name: angle, type: weld, between: [world, foot]}", "{engage_here: angle}",
         "makes the state 'angle_rx', which is one of `expressions`"},
        {"{name: heat, type: weld, between: [world, foot]}", "[{engage_here: heat}, {set: {heat_z: 1}}]",
         "makes the state 'heat_z', which is one of `states`"},
        {"{name: hold, type: coupling, coefficients: {slide: 1}}", "{engage_here: hold}", "may be open"},
    };
    char text[1024];
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        (void)snprintf(
            text, sizeof text,
            "kinetree: 1\nparameters: {gain_x: 2}\nexpressions: {angle_rx: 2*t}\n"
            "states: {heat_z: {rate: \"angle_rx + gain_x\"}, cold_xyz: {rate: \"0\"}}\nbodies:\n"
            "  - {name: foot, joint: {type: free}, mass: 1, inertia: [1, 1, 1], markers: {sole: [0, 0, 0]}}\n"
            "  - {name: other, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}\n"
            "  - {name: slide, joint: {type: prismatic}, mass: 1}\n"
            "  - {name: slab, joint: {type: fixed}, mass: 1}\n"
            "effects: [{name: push, type: joint_spring, joint: slide, stiffness: 1}]\n"
            "loops: [%s]\nevents: [{name: a, when: t - 1, then: %s}]\n",
            wrong[i].loop, wrong[i].action);
        running_check_fault(text, text, NULL, wrong[i].words);
    }
}
