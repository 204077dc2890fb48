/* Random actions on contacts and friction whose sets are masks: the motion and the sets are those of models of all
 * sets. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <stdlib.h>
#include <string.h>

#include "mask_pair.h"
#include "motion/simulation/scenes.h"

enum { ADVANCE, RESTORE, RESTORE_ANEW, SET_STATE, RELEASE, SWITCH, SET, CHANGE, ACTIONS };

static const char *const action_names[ACTIONS] = {
    "kt_simulation_advance",       "kt_simulation_restore",      "kt_simulation_restore of another one",
    "kt_simulation_set_state",     "kt_simulation_set_released", "kt_simulation_set_switches",
    "kt_simulation_set_parameter", "kt_simulation_change"};

/* A pendulum on a slider, both with friction, and a foot with friction on another slider: seven switches. */
static const char text[] =
    "kinetree: 1\n"
    "gravity: [0, 0, -9.81]\n"
    "bodies:\n"
    "  - {name: b0, joint: {type: prismatic, axis: x, velocity: 0.3}, mass: 2}\n"
    "  - {name: b1, parent: b0, joint: {type: revolute, axis: y, position: 0.5}, mass: 1, com: [0, 0, -0.5],\n"
    "     inertia: [0.1, 0.1, 0.1]}\n"
    "  - {name: b2, joint: {type: prismatic, axis: x, velocity: 1}, mass: 0.5}\n"
    "  - {name: b3, parent: b2, joint: {type: prismatic, axis: z, position: 0.3}, mass: 1}\n"
    "effects:\n"
    "  - {name: f0, type: joint_friction, joint: b0, coulomb: 3, stribeck: 0, viscous: 0.2, stick: true,\n"
    "     switched: off}\n"
    "  - {name: f1, type: joint_friction, joint: b1, coulomb: 0.8, static: 1, stribeck: 0.1, stick: true}\n"
    "  - {name: c3, type: contact, point: b3, plane: world, axis: [0, 0, 1], radius: 0.1, friction: 0.3,\n"
    "     restitution: 0.2, rest_velocity: 0.01}\n"
    "  - {name: s0, type: joint_spring, joint: b0, stiffness: 20, switched: on}\n"
    "simulate: {duration: 1000, integrator: rk4, step: 0.001}\n";

/* An action and its numbers, in 0 ... 1, and the state of the first simulation before it. */
typedef struct action {
    int kind;
    double x[3];
    uint64_t released;
    double q[4], v[4];
} action;

/* The bits of the switches that may be released: those of the loops of effects. */
static uint64_t hard_bits_of(const kt_model *model) {
    uint64_t bits = 0;
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE)
            bits |= kt_switch_bits(model, kt_loop_switch(model, i));
    for (int i = 0; i < 2; i++)
        bits |= kt_switch_bits(model, kt_loop_switch(model, kt_effect_stick_loop(model, i)));
    return bits;
}

static action draw(const mask_pair *pair, kt_random *random) {
    const kt_simulation *first = pair->simulation[0];
    action a = {.kind = kt_random_int(random, 0, ACTIONS + 1)};
    a.kind = a.kind < ACTIONS ? a.kind : ADVANCE;
    for (int i = 0; i < 3; i++)
        a.x[i] = kt_random_uniform(random, 0.0, 1.0);
    a.released = (uint64_t)kt_random_int(random, 0, 1023) & hard_bits_of(pair->model[0]);
    memcpy(a.q, kt_simulation_positions(first), sizeof a.q);
    memcpy(a.v, kt_simulation_velocities(first), sizeof a.v);
    return a;
}

/* A new gravity or friction. */
static kt_status find_change(const kt_model *model, const action *a, kt_parameter_change *change, kt_error *error) {
    static const char *const names[] = {"gravity", "effect f0.coulomb", "effect f1.coulomb", "effect c3.friction"};
    const int which = a->x[2] < 0.3 ? 0 : a->x[2] < 0.5 ? 1 : a->x[2] < 0.7 ? 2 : 3;
    *change = (kt_parameter_change){.values = {3.0 * (a->x[1] - 0.5), 0.0, -9.81 - 4.0 * (a->x[0] - 0.5)}};
    if (which > 0)
        change->values[0] = which == 1 ? 1.0 + 4.0 * a->x[0] : which == 2 ? 0.3 + 0.5 * a->x[0] : 0.8 * a->x[0];
    return kt_parameter_find(model, names[which], &change->parameter, error);
}

static kt_status restore(mask_pair *pair, int k, const action *a, kt_error *error) {
    kt_simulation *one = pair->simulation[k];
    void *block = malloc(kt_simulation_state_size(one));
    kt_status status = block != NULL ? KT_OK : KT_ERROR_MEMORY;
    if (status == KT_OK)
        kt_simulation_save(one, block);
    if (status == KT_OK && a->kind == RESTORE)
        status = kt_simulation_advance(one, kt_simulation_time(one) + 0.1 * a->x[0], error);
    if (status == KT_OK && a->kind == RESTORE_ANEW)
        status = mask_pair_renew(pair, k, error);
    if (status == KT_OK)
        status = kt_simulation_restore(pair->simulation[k], block, error);
    free(block);
    return status;
}

static kt_status set_state(kt_simulation *one, const action *a, kt_error *error) {
    double v[4];
    memcpy(v, a->v, sizeof v);
    v[0] += a->x[0] - 0.5;
    v[1] += a->x[1] - 0.5;
    v[2] *= a->x[2];
    return kt_simulation_set_state(one, kt_simulation_time(one), a->q, v, error);
}

static kt_status act(mask_pair *pair, int k, const action *a, kt_error *error) {
    kt_simulation *one = pair->simulation[k];
    kt_model *model = pair->model[k];
    const double t = kt_simulation_time(one);
    const uint64_t set = kt_switch_set(kt_simulation_model(one));
    const uint64_t spring = kt_switch_bits(model, kt_effect_switch(model, kt_effect_find(model, "s0")));
    kt_parameter_change change;
    kt_status status = KT_OK;
    switch (a->kind) {
    case RESTORE:
    case RESTORE_ANEW:
        return restore(pair, k, a, error);
    case SET_STATE:
        return set_state(one, a, error);
    case RELEASE:
        return kt_simulation_set_released(one, a->released, error);
    case SWITCH:
        return kt_simulation_set_switches(one, a->x[0] < 0.5 ? set & ~spring : set | spring, NULL, error);
    case SET:
    case CHANGE:
        status = find_change(model, a, &change, error);
        if (status != KT_OK)
            return status;
        return a->kind == SET ? kt_simulation_set_parameter(one, model, &change.parameter, change.values, error)
                              : kt_simulation_change(one, model, &change, 1, NULL, error);
    default:
        return kt_simulation_advance(one, t + 0.3 * a->x[0], error);
    }
}

/* Both simulations may fail alike, and are replaced by new ones. */
static bool act_on_both(mask_pair *pair, const action *a) {
    kt_error error[MASK_PAIR] = {{0}};
    const kt_status one = act(pair, 0, a, &error[0]), other = act(pair, 1, a, &error[1]);
    if (one != other)
        kt_note("%s: '%s', '%s'", action_names[a->kind], error[0].message, error[1].message);
    if (one != KT_OK || other != KT_OK)
        for (int k = 0; k < MASK_PAIR; k++)
            if (mask_pair_renew(pair, k, &error[k]) != KT_OK)
                return false;
    return one == other;
}

/* Draws actions from new simulations on. The bound is 300 times the largest difference of seven seeds. */
static void check_actions(const char *name, bool steps) {
    enum { SEEDS = 12, COUNT = 40 };
    kt_random random = kt_random_named(name);
    KT_WORST states = kt_worst_make("states, m, rad and 0.1 of their rates");
    mask_pair pair;
    int differ = 0;
    double sticks = 0.0;
    bool fine = mask_pair_make(&pair, text, steps);
    for (int n = 0; fine && n < SEEDS * COUNT; n++) {
        kt_error error = {0};
        for (int k = 0; n % COUNT == 0 && k < MASK_PAIR; k++)
            fine = kt_fine("a new one", mask_pair_renew(&pair, k, &error), &error) && fine;
        const action a = draw(&pair, &random);
        fine = fine && act_on_both(&pair, &a);
        kt_worst_near(&states, mask_pair_difference(&pair, 0.1), 0.0, 1e-12, "%s, action %d", action_names[a.kind], n);
        sticks += (double)kt_simulation_contacts(pair.simulation[1]).sticks;
        differ += kt_switch_set(kt_simulation_model(pair.simulation[0])) !=
                  kt_switch_set(kt_simulation_model(pair.simulation[1]));
    }
    kt_check_true("all actions", fine);
    kt_check_equal_int("sets that differ", differ, 0);
    kt_check_above("sticks, in all actions", sticks, 100.0);
    mask_pair_free(&pair);
}

KT_TEST(random_actions_on_masks_with_events) { check_actions("events", false); }

KT_TEST(random_actions_on_masks_with_time_stepping) { check_actions("steps", true); }
