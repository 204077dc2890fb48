/* Steps of random trees, with every joint type, effects, inputs and wrenches. */
#include "differences.h"

#include "kinetree/simulation.h"

#include <stdlib.h>
#include <string.h>

enum { TREES = 24 };

typedef struct scene {
    kt_tree tree;
    kt_tree_state state;
    kt_effect effect[4];
} scene;

static void add_effects(scene *s, kt_random *random) {
    kt_description *d = &s->tree.description;
    const int last = (int)d->body_count - 1;
    for (int i = 0; i < 4; i++) {
        kt_effect *e = &s->effect[i];
        *e = kt_effect_default();
        e->type = (kt_effect_type[]){KT_EFFECT_SPRING, KT_EFFECT_DRAG, KT_EFFECT_FORCE, KT_EFFECT_SPRING}[i];
        e->between[0] =
            (kt_end){.body = s->tree.name[kt_random_int(random, 0, last)], .at = kt_tree_vector(random, -0.5, 0.5)};
        if (e->type == KT_EFFECT_SPRING)
            e->between[1] = (kt_end){.body = i ? s->tree.name[last] : NULL, .at = kt_tree_vector(random, -0.5, 0.5)};
        if (e->type == KT_EFFECT_SPRING && i && strcmp(e->between[0].body, e->between[1].body) == 0)
            e->between[1] = (kt_end){.body = NULL, .at = kt_tree_vector(random, 1.0, 2.0)};
        e->stiffness = 1.3;
        e->damping = 0.4;
        e->length = 0.5;
        e->linear = 0.6;
        for (int k = 0; k < 3; k++)
            e->value[k] = kt_function_sine(0.7, 0.2, 0.1, 0.2 * k);
    }
    d->effects = s->effect;
    d->effect_count = 4;
}

static bool grow(scene *s, int n, kt_random *random) {
    kt_tree_plan plan = n % 4 == 3 ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = 5 + n % 3;
    plan.massless = false;
    plan.floats = n % 3 == 0 && n % 4 != 3;
    kt_tree_describe(&s->tree, &plan, random);
    if (n % 2)
        add_effects(s, random);
    const bool fine = kt_tree_compile(&s->tree, NULL);
    if (fine)
        kt_tree_state_draw(&s->tree, random, &s->state);
    return fine;
}

KT_TEST(derivatives_of_a_step_are_those_of_the_step_itself) {
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("A and B");
    int taken = 0;
    for (int n = 0; n < TREES; n++) {
        static scene s;
        const kt_method *method = explicit_method(n % 11);
        if (grow(&s, n, &random)) {
            const step_case c = {
                s.tree.model,
                s.tree.data,
                s.state.q,
                s.state.v,
                {.method = method, .t = 0.1, .h = 0.01, .tau = s.state.tau, .external = s.state.external},
                0.01};
            taken += compare_step(&c, &worst, method->name);
        }
        kt_tree_free(&s.tree);
    }
    kt_check_worst(&worst);
    kt_check_equal_int("trees", taken, TREES);
}

KT_TEST(step_has_the_bits_of_a_simulation) {
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 11; n++) {
        static scene s;
        double q[KT_TREE_NQ], v[KT_TREE_NV];
        kt_run run = kt_run_default();
        kt_simulation *simulation = NULL;
        kt_error error;
        run.integrator = explicit_method(n)->name;
        run.step = 0.01;
        if (grow(&s, n, &random) &&
            kt_tree_fine("simulation", kt_simulation_create(s.tree.model, &run, NULL, &simulation, &error), &error) &&
            kt_tree_fine("state", kt_simulation_set_state(simulation, 0.0, s.state.q, s.state.v, &error), &error)) {
            const kt_step step = {.method = explicit_method(n), .h = 0.01};
            const size_t size = kt_step_work_size(s.tree.model, step.method);
            void *work = aligned_alloc(64, (size + 63) / 64 * 64);
            memcpy(q, kt_simulation_positions(simulation), (size_t)s.tree.nq * sizeof *q);
            memcpy(v, kt_simulation_velocities(simulation), (size_t)s.tree.nv * sizeof *v);
            kt_tree_fine("step", kt_step_evaluate(s.tree.model, s.tree.data, work, size, &step, q, v, q, v, &error),
                         &error);
            kt_tree_fine("simulated", kt_simulation_step(simulation, 0.01, &error), &error);
            kt_check_equal_bits(run.integrator, q, kt_simulation_positions(simulation), (size_t)s.tree.nq);
            kt_check_equal_bits(run.integrator, v, kt_simulation_velocities(simulation), (size_t)s.tree.nv);
            free(work);
        }
        kt_simulation_free(simulation);
        kt_tree_free(&s.tree);
    }
}
