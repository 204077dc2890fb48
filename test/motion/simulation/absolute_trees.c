/* Random trees in the absolute formulation: accelerations, reactions and coordinates are those of the recursions, which
 * share neither coordinates nor a matrix with it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"

#include "formulation.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <string.h>

enum { FREE_BODIES = 2 * KT_TREE_BODIES + 1, FREE_NQ = 7 * FREE_BODIES, LOOPS = 3 * KT_TREE_BODIES };

/* A tree with its absolute formulation, in one state of both. */
typedef struct pair {
    kt_tree tree;
    kt_tree_state state;
    kt_absolute *formulation;
    const kt_model *absolute;
    kt_data *data;
    double q[FREE_NQ], v[FREE_NQ], a[FREE_NQ]; /* free */
    kt_wrench push[FREE_BODIES];
} pair;

static void pair_grow(pair *p, const kt_tree_plan *plan, kt_random *random) {
    memset(p, 0, sizeof *p);
    kt_tree_describe(&p->tree, plan, random);
    kt_tree_compile(&p->tree, NULL);
    p->formulation = kt_formulate(&p->tree.description, NULL, p->tree.model, KT_FORMULATION_ABSOLUTE);
    kt_need(p->formulation != NULL);
    p->absolute = kt_absolute_model(p->formulation);
    p->data = kt_test_data(p->absolute);
}

/* A random state, and the acceleration that the tree has in it. */
static void pair_move(pair *p, kt_random *random) {
    kt_tree_state_draw(&p->tree, random, &p->state);
    kt_tree_forward(&p->tree, &p->state, p->state.a);
    kt_tree_kinematics(&p->tree, &p->state);
    kt_absolute_from_tree(p->formulation, p->tree.data, p->state.q, p->state.v, p->q, p->v);
    kt_absolute_wrenches(p->formulation, p->q, p->state.tau, p->state.external, p->push);
}

/* The n-th of some trees that are all different: shuffled, floating, of one type and of all. */
static kt_tree_plan plan_of(int n) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = 2 + n / 2;
    plan.is_shuffled = n % 2 == 1;
    plan.floats = n % 3 == 1;
    if (n < KT_JOINT_TYPE_COUNT && n != KT_JOINT_FIXED)
        plan.types = 1U << n;
    return plan;
}

enum { TREES = 36 };
static pair p;

/* Bounds throughout: five times the largest of forty seeds; accelerations, forces and moments relative to the largest
 * of the tree. */
KT_TEST(accelerations_are_those_of_the_recursion) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("acceleration, relative");
    for (int n = 0; n < TREES; n++) {
        const kt_tree_plan plan = plan_of(n);
        kt_error e = {0};
        static double q[KT_TREE_NQ], v[KT_TREE_NV], a[KT_TREE_NV];
        pair_grow(&p, &plan, &random);
        pair_move(&p, &random);
        kt_need_fine("free bodies", kt_acceleration_evaluate(p.absolute, p.data, 0.0, p.q, p.v, NULL, p.push, p.a, &e),
                     &e);
        const double scale = kt_tree_largest(p.state.a, p.tree.nv);
        memcpy(q, p.state.q, sizeof q);
        kt_absolute_to_tree(p.formulation, p.q, p.v, p.a, 0.0, q, v, a);
        for (int i = 0; i < p.tree.nv; i++)
            kt_worst_near(&error, a[i] / scale, p.state.a[i] / scale, 2.5e-12, "tree %d, coordinate %d", n, i);
    }
}

/* The force and moment that carry each body, constraint and applied parts together, about the joint frame's origin. */
KT_TEST(reactions_are_those_of_the_recursion) {
    kt_random random = kt_random_of_test();
    KT_WORST force = kt_worst_make("force, relative"), moment = kt_worst_make("moment, relative");
    for (int n = 0; n < TREES; n++) {
        const kt_tree_plan plan = plan_of(n);
        kt_error e = {0};
        static kt_wrench from[LOOPS], here[KT_TREE_SLOTS], there[KT_TREE_SLOTS];
        pair_grow(&p, &plan, &random);
        pair_move(&p, &random);
        kt_need_fine("free bodies",
                     kt_reaction_evaluate(p.absolute, p.data, 0.0, p.q, p.v, NULL, p.push, NULL, from, &e), &e);
        double scale = 0.0;
        kt_joint_reactions(p.tree.model, p.tree.data, p.state.external, here);
        kt_absolute_reactions(p.formulation, p.q, p.state.tau, from, there, NULL);
        for (int b = 1; b < p.tree.count; b++)
            scale = fmax(scale, fmax(kt_vec3_norm(here[b].force), kt_vec3_norm(here[b].moment)));
        for (int b = 1; b < p.tree.count; b++) {
            const kt_vec3 f = kt_vec3_sub(here[b].force, there[b].force);
            const kt_vec3 m = kt_vec3_sub(here[b].moment, there[b].moment);
            kt_worst_below(&force, kt_vec3_norm(f) / scale, 3e-12, "tree %d, joint %d", n, b);
            kt_worst_below(&moment, kt_vec3_norm(m) / scale, 7e-12, "tree %d, joint %d", n, b);
        }
    }
}

/* Adds some turns to the state's angles. Writes a past that is 2 rad or 2 m away in every plain coordinate. For
 * quaternions the past is near and only selects one of the two signs. */
static void wind(const kt_tree *tree, double *q, double *past, kt_random *random) {
    memcpy(past, q, (size_t)tree->nq * sizeof *past);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates at = kt_body_coordinates(tree->model, b);
        for (int k = 0; k < at.nq && at.nq == at.nv; k++) {
            const bool is_angle = at.type == KT_JOINT_UNIVERSAL || (at.type == KT_JOINT_PLANAR && k == 2) ||
                                  (at.type != KT_JOINT_PLANAR && at.type != KT_JOINT_PRISMATIC && k == 0);
            q[at.q + k] += is_angle ? 6.283185307179586 * kt_random_int(random, -5, 5) : 0.0;
            past[at.q + k] = q[at.q + k] + kt_random_uniform(random, -2.0, 2.0);
        }
    }
}

/* There and back: the same numbers, whole turns and signs of quaternions included. And where the free bodies are, every
 * loop is closed. */
KT_TEST(coordinates_come_back_from_the_free_bodies) {
    kt_random random = kt_random_of_test();
    KT_WORST position = kt_worst_make("position"), velocity = kt_worst_make("velocity");
    KT_WORST open = kt_worst_make("closure, positions"), moving = kt_worst_make("closure, velocities");
    for (int n = 0; n < TREES; n++) {
        const kt_tree_plan plan = plan_of(n);
        kt_error e = {0};
        kt_residual residual = {(double)NAN, (double)NAN};
        static double q[KT_TREE_NQ], v[KT_TREE_NV];
        pair_grow(&p, &plan, &random);
        kt_tree_state_draw(&p.tree, &random, &p.state);
        wind(&p.tree, p.state.q, q, &random);
        kt_tree_kinematics(&p.tree, &p.state);
        kt_absolute_from_tree(p.formulation, p.tree.data, p.state.q, p.state.v, p.q, p.v);
        kt_absolute_to_tree(p.formulation, p.q, p.v, NULL, 0.0, q, v, NULL);
        for (int i = 0; i < p.tree.nq; i++)
            kt_worst_near(&position, q[i], p.state.q[i], 2e-14, "tree %d, %d", n, i);
        for (int i = 0; i < p.tree.nv; i++)
            kt_worst_near(&velocity, v[i], p.state.v[i], 3e-14, "tree %d, %d", n, i);
        kt_need_fine("residual", kt_loop_residual(p.absolute, p.data, 0.0, p.q, p.v, &residual, &e), &e);
        kt_worst_below(&open, residual.position, 1e-13, "tree %d", n);
        kt_worst_below(&moving, residual.velocity, 1e-13, "tree %d", n);
    }
}
