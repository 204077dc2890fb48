/* The pointers of kt_simulation_positions and _velocities stay valid. They show the state after every call, with the
 * bits of a sensor reading there. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BODIES = 5 };

typedef struct watched {
    kt_simulation *simulation;
    const double *q, *v; /* asked for once */
    int nq, nv;
} watched;

/* Compares with a sensor reading of the present time, which lies in memory of its own. */
static void look(const char *when, const char *method, watched *w) {
    kt_error error = {0};
    kt_record now = {0};
    kt_note("%s, after %s", method, when);
    kt_check_true("positions: the same address", kt_simulation_positions(w->simulation) == w->q);
    kt_check_true("velocities: the same address", kt_simulation_velocities(w->simulation) == w->v);
    kt_need_fine("sense", kt_simulation_sense(w->simulation, &now, &error), &error);
    kt_check_equal_bits("positions", w->q, now.q, (size_t)w->nq);
    kt_check_equal_bits("velocities", w->v, now.v, (size_t)w->nv);
}

/* A recorder receives a state within the last step, while the pointers show the end of the step. */
static int stop_at_third(const kt_record *record, void *user) {
    (void)user;
    return record->index >= 3;
}

static bool moved(const watched *w, const double *before) { return memcmp(before, w->q, sizeof *before) != 0; }

static void follow(const kt_tree *tree, const kt_tree_state *state, const kt_run *run) {
    kt_error error = {0};
    watched w = {.simulation = kt_test_simulation(tree->model, run, NULL), .nq = tree->nq, .nv = tree->nv};
    if (!w.simulation)
        return;
    w.q = kt_simulation_positions(w.simulation);
    w.v = kt_simulation_velocities(w.simulation);
    void *block = malloc(kt_simulation_state_size(w.simulation));
    const double first = w.q[0];
    look("its start", run->integrator, &w);
    (void)kt_fine("state", kt_simulation_set_state(w.simulation, 0.5, state->q, state->v, &error), &error);
    look("kt_simulation_set_state", run->integrator, &w);
    kt_check_true("the state is another one", moved(&w, &first));
    for (int k = 0; k < 4; k++) { /* more than the integrator has arrays for states */
        const double before = w.q[0];
        (void)kt_fine("step", kt_simulation_step(w.simulation, HUGE_VAL, &error), &error);
        look("a step", run->integrator, &w);
        kt_check_true("it has moved", moved(&w, &before));
    }
    if (block)
        kt_simulation_save(w.simulation, block);
    const double kept = w.q[0];
    kt_test_advance(w.simulation, kt_simulation_time(w.simulation) + 0.02);
    look("kt_simulation_advance", run->integrator, &w);
    (void)kt_fine("tick", kt_simulation_tick(w.simulation, 0.01, &error), &error);
    look("kt_simulation_tick", run->integrator, &w);
    kt_check_equal_int("stopped", kt_simulation_run(w.simulation, stop_at_third, NULL, &error), KT_ERROR_CALLBACK);
    look("kt_simulation_run", run->integrator, &w);
    kt_check_true("it has moved", moved(&w, &kept));
    if (block && kt_fine("restore", kt_simulation_restore(w.simulation, block, &error), &error))
        kt_check_equal_bits("as it was", w.q, &kept, 1);
    look("kt_simulation_restore", run->integrator, &w);
    kt_check_equal_int("rejected", kt_simulation_advance(w.simulation, 0.0, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_bits("unchanged", w.q, &kept, 1);
    free(block);
}

KT_TEST(pointers_to_the_state_stay_and_show_it_whatever_the_method) {
    static kt_tree tree;
    static kt_tree_state state;
    kt_random random = kt_random_of_test();
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = BODIES;
    kt_tree_grow(&tree, &plan, &random);
    kt_tree_state_draw(&tree, &random, &state);
    for (int i = 0; i < kt_method_count(); i++) {
        kt_run run = kt_run_fixed(kt_method_at(i)->name, 1e-3, 2.0);
        run.interval = 0.01;
        follow(&tree, &state, &run);
    }
}
