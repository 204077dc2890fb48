/* Contacts and friction whose sets are masks, and loops that the caller switches: the motion is that of models of all
 * sets. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mask_pair.h"
#include "motion/simulation/scenes.h"

/* Copies each simulation by a checkpoint into a new one. */
static bool restore(mask_pair *pair) {
    kt_error error = {0};
    kt_status status = KT_OK;
    for (int k = 0; status == KT_OK && k < MASK_PAIR; k++) {
        void *block = malloc(kt_simulation_state_size(pair->simulation[k]));
        status = block != NULL ? KT_OK : KT_ERROR_MEMORY;
        if (status == KT_OK) {
            kt_simulation_save(pair->simulation[k], block);
            status = mask_pair_renew(pair, k, &error);
        }
        if (status == KT_OK)
            status = kt_simulation_restore(pair->simulation[k], block, &error);
        free(block);
    }
    return kt_fine("restores", status, &error);
}

/* Five sliders on stops. A coupling of all of them would join their five groups into one, but is off. */
KT_TEST(masks_have_room_for_the_groups_that_a_loop_would_join) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  - {name: a, joint: {type: prismatic, axis: z, position: 0.3}, mass: 1}\n"
        "  - {name: b, joint: {type: prismatic, axis: z, position: 0.4}, mass: 1}\n"
        "  - {name: c, joint: {type: prismatic, axis: z, position: 0.5}, mass: 1}\n"
        "  - {name: d, joint: {type: prismatic, axis: z, position: 0.6}, mass: 1}\n"
        "  - {name: e, joint: {type: prismatic, axis: z, position: 0.7}, mass: 1}\n"
        "loops:\n"
        "  - {name: clutch, type: coupling, coefficients: {a: 1, b: 1, c: 1, d: 1, e: 1}, offset: 0, switched: off}\n"
        "effects:\n"
        "  - {name: fa, type: joint_limit, joint: a, lower: 0, restitution: 0}\n"
        "  - {name: fb, type: joint_limit, joint: b, lower: 0, restitution: 0.5}\n"
        "  - {name: fc, type: joint_limit, joint: c, lower: 0, restitution: 0}\n"
        "  - {name: fd, type: joint_limit, joint: d, lower: 0, restitution: 0}\n"
        "  - {name: fe, type: joint_limit, joint: e, lower: 0, restitution: 0}\n"
        "simulate: {duration: 10, integrator: rk4, step: 0.001}\n";
    mask_pair pair;
    bool fine = mask_pair_make(&pair, text, false);
    double most = 0.0;
    for (int k = 1; fine && k <= 10; k++) {
        fine = mask_pair_advance(&pair, 0.1 * k) && restore(&pair);
        const double difference = fine ? mask_pair_difference(&pair, 1.0) : 0.0;
        most = difference <= most ? most : difference;
    }
    if (fine) {
        kt_check_below("difference of states", most, 1e-10);
        kt_check_below("slider a rests, m", fabs(kt_simulation_positions(pair.simulation[1])[0]), 1e-14);
        kt_check_above("impacts", (double)kt_simulation_contacts(pair.simulation[1]).impacts, 10.0);
    }
    mask_pair_free(&pair);
}

/* A linkage of Bennett: two of the five equations of its loop are independent where it is closed, and three where it is
 * open. The position of link b is a guess. Friction in the joints is released at first. */
static void write_linkage(char text[2000], double guess, const char *switched) {
    (void)snprintf(
        text, 2000,
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  - {name: a, joint: {type: revolute, axis: z, position: 1, velocity: 0.5}, mass: 1,\n"
        "     shape: {type: rod, to: [1, 0, 0], radius: 0.05}}\n"
        "  - {name: b, parent: a, joint: {type: revolute, axis: z, at: [1, 0, 0],\n"
        "     rotation: {axis: [1, 0, 0], angle: 30 deg}, position: %g}, mass: 1.7,\n"
        "     shape: {type: rod, to: [1.7320508075688772, 0, 0], radius: 0.05}}\n"
        "  - {name: c, parent: b, joint: {type: revolute, axis: z, at: [1.7320508075688772, 0, 0],\n"
        "     rotation: {axis: [1, 0, 0], angle: 60 deg}, position: -1}, mass: 1,\n"
        "     shape: {type: rod, to: [1, 0, 0], radius: 0.05}}\n"
        "loops:\n"
        "  - {name: close, type: revolute, axis: z, between: [\n"
        "     {body: c, at: [1, 0, 0], rotation: {axis: [1, 0, 0], angle: 30 deg}},\n"
        "     {body: world, at: [-1.7320508075688772, 0, 0], rotation: {axis: [1, 0, 0], angle: -60 deg}}]%s}\n"
        "initial: {hold: [a]}\n"
        "effects:\n"
        "  - {name: fa, type: joint_friction, joint: a, coulomb: 2, stribeck: 0, stick: true, switched: off}\n"
        "  - {name: fb, type: joint_friction, joint: b, coulomb: 0.4, stribeck: 0, stick: true, switched: off}\n"
        "simulate: {duration: 10, integrator: rk4, step: 0.001}\n",
        guess, switched);
}

/* A state is set after a motion with friction, which is released again. The motion is that of a new simulation. */
KT_TEST(states_are_set_whatever_the_motion_before) {
    for (int steps = 0; steps < 2; steps++) {
        char text[2000];
        mask_pair pair;
        kt_error error = {0};
        kt_simulation *used = NULL;
        write_linkage(text, 2.4, "");
        kt_note("%s", steps ? "time stepping" : "events");
        const bool is_made = mask_pair_make(&pair, text, steps);
        kt_simulation *fresh = pair.simulation[1];
        kt_status status = is_made ? kt_simulation_create(pair.model[1], &pair.scene.run, &pair.options, &used, &error)
                                   : KT_ERROR_MEMORY;
        if (status == KT_OK)
            status = kt_simulation_set_released(used, 0, &error);
        if (status == KT_OK)
            status = kt_simulation_advance(used, 0.01, &error);
        if (status == KT_OK)
            status = kt_simulation_set_state(used, 0.0, kt_simulation_positions(fresh), kt_simulation_velocities(fresh),
                                             &error);
        kt_need_fine("set", status, &error);
        kt_check_equal_int("degrees of freedom", kt_model_mobility(kt_simulation_model(used)).minimal, 1);
        status = kt_simulation_advance(used, 0.5, &error);
        kt_need(mask_pair_advance(&pair, 0.5));
        kt_need_fine("goes on", status, &error);
        kt_check_below("difference from a new one", mask_difference(pair.model[1], fresh, used, 1.0), 1e-10);
        kt_check_below("difference from models of all sets", mask_pair_difference(&pair, 1.0), 1e-10);
        kt_simulation_free(used);
        mask_pair_free(&pair);
    }
}

/* The loop is switched on in a state in which it is open by less than switch_gap. */
KT_TEST(loops_that_are_switched_on_within_their_gap_keep_their_ranks) {
    const double most = 0.05, moved = 2e-3;
    char text[2000];
    mask_pair pair;
    kt_error error = {0};
    write_linkage(text, 2.4, ", switched: on");
    kt_status status = mask_pair_make(&pair, text, false) ? KT_OK : KT_ERROR_MEMORY;
    pair.options.switch_gap = most;
    for (int k = 0; status == KT_OK && k < MASK_PAIR; k++) {
        status = mask_pair_renew(&pair, k, &error);
        kt_simulation *simulation = pair.simulation[k];
        const uint64_t all = status == KT_OK ? kt_switch_set(kt_simulation_model(simulation)) : 0;
        const int loop = kt_loop_switch(pair.model[k], kt_loop_find(pair.model[k], "close"));
        if (status == KT_OK)
            status = kt_simulation_set_switches(simulation, all & ~kt_switch_bits(pair.model[k], loop), NULL, &error);
        if (status != KT_OK)
            continue;
        double q[3];
        memcpy(q, kt_simulation_positions(simulation), sizeof q);
        q[1] += moved;
        status = kt_simulation_set_state(simulation, 0.0, q, kt_simulation_velocities(simulation), &error);
        if (status == KT_OK)
            status = kt_simulation_set_switches(simulation, all, NULL, &error);
        if (status == KT_OK)
            kt_check_equal_int("degrees of freedom", kt_model_mobility(kt_simulation_model(simulation)).minimal, 1);
    }
    kt_need_fine("switched", status, &error);
    kt_need(mask_pair_advance(&pair, 0.5));
    kt_check_below("difference of states", mask_pair_difference(&pair, 1.0), 1e-10);
    mask_pair_free(&pair);
}
