/* Accelerations of random closed mechanisms against [M A'; A 0] (a, -lambda) = (tau - h, b'') solved densely. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"
#include "mechanics/dynamics/oracle.h"

#include "model/model.h"

#include "kinetree/study.h"
#include "reduction/method.h"

#include <float.h>
#include <math.h>

/* The features of the mechanisms, so that a test without its object is detected. */
typedef struct census {
    int grown, groups, carried, nested, planar, mixed, both, joint[KT_JOINT_TYPE_COUNT], loop[KT_LOOP_TYPE_COUNT],
        redundant, several;
} census;

static void count(const tangle *g, census *c) {
    const kt_model *model = g->tree.model;
    c->grown++;
    c->groups += (int)model->n.group;
    c->several += model->n.group > 1;
    c->planar += model->sweep == KT_SWEEP_PLANAR;
    c->mixed += model->sweep == KT_SWEEP_MIXED;
    size_t planar = 0;
    for (size_t i = 0; i < model->n.group; i++)
        planar += (size_t)model->group_link[model->group[i].link] >= model->n.spatial;
    c->both += planar > 0 && planar < model->n.group;
    for (size_t i = 0; i < model->n.group; i++) {
        const kt_group *group = &model->group[i];
        c->carried += group->parent != 0;
        c->nested += group->parent != 0 && model->link[group->parent].group >= 0;
        c->redundant += group->rank[KT_ROWS_ALL] < group->count[KT_ROWS_ALL];
        for (int l = 0; l < group->link_count; l++)
            c->joint[model->body[model->link[model->group_link[group->link + l]].body].type]++;
    }
    for (int i = 0; i < g->loops; i++)
        c->loop[g->loop[i].type]++;
}

/* Compares with the dense solution. The bound is the possible effect of rounded matrices times a number: 1.4 was
 * measured in `30 x 200` mechanisms. Returns false if nothing was compared because the library treats the position as
 * near a singular one. */
static bool compare(const tangle *g, double times, kt_worst *worst, kt_worst *closed, kt_worst *rank) {
    static tangle_system s;
    double a[KT_TREE_NV], expected[KT_TREE_NV], moved[KT_TREE_NV];
    kt_error e = {0};
    kt_need_fine("acceleration",
                 kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, g->q, g->v, g->tau, g->external, a, &e),
                 &e);
    tangle_system_of(g, &s);
    if (tangle_was_near_singular(g->tree.model, g->tree.data))
        return false;
    const tangle_way way = {.mixes = g->tree.model->reduction->least};
    const int found = tangle_solve(g, &s, way, expected, moved);
    kt_worst_near(rank, kt_model_mobility(g->tree.model).rank, found, 0.5, "nv %d", g->tree.nv);
    const double least = 16.0 * DBL_EPSILON * kt_tree_largest(expected, g->tree.nv);
    /* an equation that depends on others is a sum of them, times up to this */
    const double share = found < g->rows ? fmax(1.0, tangle_reach(g, false)) : 1.0;
    for (int i = 0; i < g->tree.nv; i++)
        kt_worst_near(worst, a[i], expected[i], times * moved[i] + least, "nv %d, %d", g->tree.nv, i);
    for (int r = 0; r < g->rows; r++) {
        double sum = -s.drift[r], size = fabs(s.drift[r]);
        for (int i = 0; i < g->tree.nv; i++) {
            sum += s.jacobian[i * g->rows + r] * a[i];
            size += fabs(s.jacobian[i * g->rows + r]) * kt_tree_largest(a, g->tree.nv);
        }
        size += kt_tree_largest(a, g->tree.nv); /* an axis almost along the normal also has an error of eps */
        kt_worst_below(closed, fabs(sum), 8.0 * DBL_EPSILON * share * size, "nv %d, row %d", g->tree.nv, r);
    }
    return true;
}

static census run(const tangle_plan *plan, kt_random *random, int mechanisms, double times) {
    static tangle g;
    census c = {0};
    KT_WORST worst = kt_worst_make("accelerations are those of the dense solution");
    KT_WORST closed = kt_worst_make("A a = b''");
    KT_WORST rank = kt_worst_make("rank");
    int compared = 0;
    for (int i = 0; i < mechanisms; i++) {
        tangle_grow(&g, plan, random);
        count(&g, &c);
        compared += compare(&g, times, &worst, &closed, &rank);
    }
    kt_check_above("share compared", (double)compared / mechanisms, 0.8);
    return c;
}

KT_TEST(closed_mechanisms_accelerate_as_the_dense_equations_say) {
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    const census c = run(&plan, &random, 200, 4.0);
    kt_check_above("groups that a moving body carries", c.carried, 50.0);
    kt_check_above("groups that hang on a body of another", c.nested, 10.0);
    kt_check_above("mechanisms of several groups", c.several, 50.0);
    for (int i = 1; i < KT_JOINT_TYPE_COUNT; i++)
        kt_check_above(kt_joint_type_name((kt_joint_type)i), c.joint[i], 20.0);
    for (int i = 0; i < KT_LOOP_GEAR; i++)
        kt_check_above(kt_loop_type_name((kt_loop_type)i), c.loop[i], 10.0);
}

/* `partition` and `svd` by their own means, and fronts in space. */
KT_TEST(every_way_of_reduction_accelerates_as_the_dense_equations_say) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    plan.options.reduction = kt_reduction_method_of(KT_REDUCTION_PARTITION);
    (void)run(&plan, &random, 100, 4.0);
    plan.options.reduction = kt_reduction_method_of(KT_REDUCTION_SVD);
    (void)run(&plan, &random, 100, 4.0);
    plan.options = kt_model_options_default();
    plan.options.structure = KT_STRUCTURE_FRONTS;
    (void)run(&plan, &random, 60, 4.0);
}

/* Many loops in one group, with more equations than are independent. The long tier adds mechanisms. */
KT_TEST(redundant_loops_accelerate_as_the_dense_equations_say) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    plan.loops = 6;
    plan.nearby = 1.0;
    plan.still = true;
    plan.tree.bodies = 10;
    plan.types = 1U << KT_LOOP_WELD | 1U << KT_LOOP_REVOLUTE | 1U << KT_LOOP_PRISMATIC | 1U << KT_LOOP_PLANAR;
    const int count = KT_SHORT(25, 100);
    const census c = run(&plan, &random, count, 4.0);
    kt_check_above("groups with redundant equations", c.redundant, 0.6 * count);
}

/* In an oblique plane; masses and forces lie anywhere. */
KT_TEST(planar_mechanisms_accelerate_as_the_dense_equations_say) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_planar();
    for (int way = 0; way < 3; way++) {
        plan.options.reduction = kt_reduction_method_of((kt_reduction)way);
        const census c = run(&plan, &random, 150, 4.0);
        kt_check_above("planar", c.planar, 149.0);
        kt_check_above("groups that a moving body carries", c.carried, 20.0);
        kt_check_above("groups that hang on a body of another", c.nested, 4.0);
        for (int i = 0; i < KT_LOOP_TYPE_COUNT; i++)
            if (plan.types & 1U << i)
                kt_check_above(kt_loop_type_name((kt_loop_type)i), c.loop[i], 10.0);
    }
}

/* Every second tree is spatial, and so are those that loops connect with it. */
KT_TEST(mixed_mechanisms_accelerate_as_the_dense_equations_say) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_planar();
    plan.tree.planar = 2;
    plan.tree.from_world = 0.4;
    plan.tree.bodies = 16;
    plan.nearby = 1.0;
    const census c = run(&plan, &random, 200, 4.0);
    kt_check_above("mixed", c.mixed, 20.0);
    kt_check_above("with groups of both kinds", c.both, 5.0);
}

/* kt_dynamics_forward of a model with loops is that of its tree. Bounds as in dynamics/aba.c. */
KT_TEST(forward_dynamics_of_the_tree_leaves_the_loops_out) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("a from tau(a)");
    for (int n = 0; n < 60; n++) {
        static tangle g;
        static kt_tree_state s;
        const tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        double a[KT_TREE_NV], sensitivity[KT_TREE_NV];
        long double slow[KT_TREE_NV];
        tangle_grow(&g, &plan, &random);
        kt_tree_state_draw(&g.tree, &random, &s);
        kt_tree_inverse(&g.tree, &s, s.tau);
        kt_tree_forward(&g.tree, &s, a);
        if (kt_oracle_forward(&g.tree, &s, slow, sensitivity))
            for (int i = 0; i < g.tree.nv; i++)
                kt_worst_near(&worst, a[i], s.a[i], 10.0 * DBL_EPSILON * sensitivity[i], "%d, coordinate %d", n, i);
    }
}
