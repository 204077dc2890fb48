/* Steps of random trees, with every joint type, effects, inputs and wrenches. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"
#include "grown.h"

#include "kinetree/simulation.h"

#include <stdlib.h>
#include <string.h>

enum { TREES = 24 };

KT_TEST(derivatives_of_a_step_are_those_of_the_step_itself) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A and B");
    int taken = 0;
    for (int n = 0; n < TREES; n++) {
        static grown s;
        const kt_method *method = explicit_method(n % 11);
        grown_make(&s, n, &random);
        const step_case c = {s.tree.model,
                             s.tree.data,
                             s.state.q,
                             s.state.v,
                             {.method = method, .t = 0.1, .h = 0.01, .tau = s.state.tau, .external = s.state.external},
                             0.01};
        taken += compare_step(&c, &worst, method->name);
    }
    kt_check_equal_int("trees", taken, TREES);
}

KT_TEST(step_has_the_bits_of_a_simulation) {
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 11; n++) {
        static grown s;
        double q[KT_TREE_NQ], v[KT_TREE_NV];
        kt_run run = kt_run_default();
        kt_error error;
        run.integrator = explicit_method(n)->name;
        run.step = 0.01;
        grown_make(&s, n, &random);
        kt_simulation *simulation = kt_test_simulation(s.tree.model, &run, NULL);
        kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, s.state.q, s.state.v, &error), &error);
        const kt_step step = {.method = explicit_method(n), .h = 0.01};
        const size_t size = kt_step_work_size(s.tree.model, step.method);
        void *work = aligned_alloc(64, (size + 63) / 64 * 64);
        memcpy(q, kt_simulation_positions(simulation), (size_t)s.tree.nq * sizeof *q);
        memcpy(v, kt_simulation_velocities(simulation), (size_t)s.tree.nv * sizeof *v);
        kt_fine("step", kt_step_evaluate(s.tree.model, s.tree.data, work, size, &step, q, v, q, v, &error), &error);
        kt_fine("simulated", kt_simulation_step(simulation, 0.01, &error), &error);
        kt_check_equal_bits(run.integrator, q, kt_simulation_positions(simulation), (size_t)s.tree.nq);
        kt_check_equal_bits(run.integrator, v, kt_simulation_velocities(simulation), (size_t)s.tree.nv);
        free(work);
    }
}
