/* Mechanisms in a plane against the same mechanisms by the spatial kernels: every query of their loops has the same
 * answer but for rounding. (acceleration.c and equations.c hold both against other formulations.) */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "model/model.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON

/* A mechanism compiled twice. */
typedef struct pair {
    tangle g; /* in its plane */
    kt_model *space;
    kt_data *data;
} pair;

static void pair_grow(pair *p, const tangle_plan *plan, kt_random *random) {
    kt_model_options options = plan->options;
    options.plan = KT_PLAN_SPATIAL;
    p->space = NULL;
    p->data = NULL;
    tangle_grow(&p->g, plan, random);
    p->space = kt_test_model(&p->g.tree.description, &options);
    p->data = kt_test_data(p->space);
}

/* Four of five in one plane, the others mixed; every way of reduction, and both metrics. */
static tangle_plan draw_plan(int i) {
    tangle_plan plan = tangle_plan_planar();
    if (i % 5 == 4) {
        plan.tree.planar = 2;
        plan.tree.from_world = 0.4;
        plan.nearby = 1.0;
    }
    plan.options.reduction = kt_reduction_method_of((kt_reduction)(i % 3));
    plan.options.metric = i % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
    return plan;
}

/* Every equation in the plane is independent of the others, so that none is left out. */
static bool is_plain(const kt_model *model) {
    int rows = 0;
    for (size_t g = 0; g < model->n.group; g++)
        rows += model->group[g].count[KT_ROWS_ALL];
    return rows == kt_model_mobility(model).rank;
}

/* ---- what a model tells of its loops -----------------------------------------------------------------------------
 */

static void compare_words(const pair *p, kt_worst *worst) {
    const kt_model *flat = p->g.tree.model;
    const kt_mobility a = kt_model_mobility(flat), b = kt_model_mobility(p->space);
    kt_worst_below(worst, a.tree != b.tree || a.equations != b.equations || a.rank != b.rank || a.minimal != b.minimal,
                   0.5, "freedoms: %d of %d equations independent, %d of %d in space", a.rank, a.equations, b.rank,
                   b.equations);
    const int groups = kt_loop_group_count(flat);
    kt_worst_near(worst, groups, kt_loop_group_count(p->space), 0.5, "groups");
    for (int i = 0; i < groups && i < kt_loop_group_count(p->space); i++) {
        const kt_loop_group c = kt_loop_group_at(flat, i), d = kt_loop_group_at(p->space, i);
        kt_worst_near(worst, c.equations, d.equations, 0.5, "equations of group %d", i);
        kt_worst_near(worst, c.rank, d.rank, 0.5, "rank of group %d", i);
        kt_worst_near(worst, c.coordinates, d.coordinates, 0.5, "coordinates of group %d", i);
    }
}

KT_TEST(counts_of_loops_in_a_plane_are_those_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("freedoms and groups");
    int planar = 0, mixed = 0;
    for (int i = 0; i < 100; i++) {
        const tangle_plan plan = draw_plan(i);
        pair_grow(&p, &plan, &random);
        compare_words(&p, &worst);
        planar += strcmp(kt_model_plan(p.g.tree.model), "planar") == 0;
        mixed += strcmp(kt_model_plan(p.g.tree.model), "mixed") == 0;
        kt_worst_below(&worst, strcmp(kt_model_plan(p.space), "spatial") != 0, 0.5, "plan: spatial");
    }
    kt_check_above("planar", planar, 75.0);
    kt_check_above("mixed", mixed, 10.0);
}

/* ---- equations ----------------------------------------------------------------------------------------------------
 */

typedef struct equations {
    double jacobian[TANGLE_ROWS * KT_TREE_NV], residual[TANGLE_ROWS], rate[TANGLE_ROWS], drift[TANGLE_ROWS];
} equations;

static void ask(const kt_model *model, kt_data *data, double t, const double *q, const double *v, equations *x) {
    kt_error e = {0};
    kt_need_fine("equations", kt_loop_equations(model, data, t, q, v, x->jacobian, x->residual, x->rate, x->drift, &e),
                 &e);
}

/* Lengths along a loop are some ten metres, and rounding of each link moves all that it carries: 10 eps were measured.
 * Terms of b'' are such lengths times v^2. */
KT_TEST(equations_in_a_plane_are_those_of_space_row_by_row) {
    static pair p;
    static equations flat, space;
    kt_random random = kt_random_of_test();
    KT_WORST slopes = kt_worst_make("A"), residuals = kt_worst_make("phi");
    KT_WORST rates = kt_worst_make("phi_t"), drifts = kt_worst_make("b''");
    for (int i = 0; i < 100; i++) {
        const tangle_plan plan = draw_plan(i);
        pair_grow(&p, &plan, &random);
        double q[KT_TREE_NQ], v[KT_TREE_NV];
        tangle_disturb(&p.g, &random, 0.1, q, v);
        const int n = p.g.rows * p.g.tree.nv;
        ask(p.g.tree.model, p.g.tree.data, p.g.t, q, v, &flat);
        ask(p.space, p.data, p.g.t, q, v, &space);
        const double size = fmax(1.0, kt_tree_largest(space.jacobian, n));
        const double most = fmax(1.0, kt_tree_largest(v, p.g.tree.nv));
        for (int k = 0; k < n; k++)
            kt_worst_near(&slopes, flat.jacobian[k], space.jacobian[k], 100.0 * EPS * size, "%d", k);
        for (int k = 0; k < p.g.rows; k++) {
            kt_worst_near(&residuals, flat.residual[k], space.residual[k], 100.0 * EPS * size, "%d", k);
            kt_worst_near(&rates, flat.rate[k], space.rate[k], EPS * size, "%d", k);
            kt_worst_near(&drifts, flat.drift[k], space.drift[k], 100.0 * EPS * size * most * most, "%d", k);
        }
    }
}

/* ---- closing ------------------------------------------------------------------------------------------------------
 */

/* How rounding may move the least step that closes g's positions, or velocities: [W A'; A 0] (step, .) = (0, -open). */
static void round_step(const tangle *g, bool positions, bool mass, double *moved) {
    static tangle_system s;
    static equations x;
    double step[KT_TREE_NV];
    const int nv = g->tree.nv;
    tangle_system_of(g, &s);
    ask(g->tree.model, g->tree.data, g->t, g->q, g->v, &x);
    memset(s.force, 0, sizeof s.force);
    for (int i = 0; i < nv * nv && !mass; i++)
        s.mass[i] = i % (nv + 1) == 0;
    for (int r = 0; r < g->rows; r++) {
        s.drift[r] = positions ? -x.residual[r] : x.rate[r];
        for (int i = 0; i < nv && !positions; i++)
            s.drift[r] -= s.jacobian[i * g->rows + r] * g->v[i];
    }
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, step, moved);
}

/* Each projection leaves gaps of some roundings. Closing these gaps moves positions by `reach` (tangle_reach) times as
 * much. Velocities change with them, as A depends on the positions, and steps are rounded too. The first step leaves
 * the dropped redundant equations open to second order. Another choice of them appears in the second step, with the
 * square of that. */
KT_TEST(projection_in_a_plane_is_that_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    KT_WORST positions = kt_worst_make("q"), velocities = kt_worst_make("v"), gaps = kt_worst_make("residuals");
    const double off = 1e-4;
    int compared = 0;
    for (int i = 0; i < 90; i++) {
        const tangle_plan plan = draw_plan(i);
        pair_grow(&p, &plan, &random);
        if (tangle_reach(&p.g, false) < 20.0) {
            double q[2][KT_TREE_NQ], v[2][KT_TREE_NV];
            kt_error e = {0};
            kt_residual r[2];
            const bool mass = plan.options.metric == KT_METRIC_MASS;
            double moved_q[KT_TREE_NV], moved_v[KT_TREE_NV];
            tangle_disturb(&p.g, &random, off, q[0], v[0]);
            memcpy(q[1], q[0], sizeof q[0]);
            memcpy(v[1], v[0], sizeof v[0]);
            memcpy(p.g.q, q[0], sizeof q[0]);
            memcpy(p.g.v, v[0], sizeof v[0]);
            round_step(&p.g, true, mass, moved_q);
            round_step(&p.g, false, true, moved_v);
            kt_need_fine("residual", kt_loop_residual(p.g.tree.model, p.g.tree.data, p.g.t, q[0], v[0], &r[0], &e), &e);
            kt_need_fine("residual", kt_loop_residual(p.space, p.data, p.g.t, q[1], v[1], &r[1], &e), &e);
            kt_need_fine("projects", kt_state_project(p.g.tree.model, p.g.tree.data, p.g.t, q[0], v[0], NULL, &e), &e);
            kt_need_fine("projects", kt_state_project(p.space, p.data, p.g.t, q[1], v[1], NULL, &e), &e);
            const double most = fmax(1.0, kt_tree_largest(v[1], p.g.tree.nv));
            memcpy(p.g.q, q[1], sizeof q[1]);
            memcpy(p.g.v, v[1], sizeof v[1]);
            const double reach = tangle_reach(&p.g, mass), swift = tangle_reach(&p.g, true) * (1.0 + reach);
            const double other = is_plain(p.g.tree.model) ? 0.0 : pow(off * reach, 4.0);
            const double near = 16.0 * EPS * reach + other + 4.0 * kt_tree_largest(moved_q, p.g.tree.nv);
            const double slow = 16.0 * EPS * swift * most + 4.0 * kt_tree_largest(moved_v, p.g.tree.nv);
            for (int k = 0; k < p.g.tree.nq; k++)
                kt_worst_near(&positions, q[0][k], q[1][k], near, "%d, q %d", i, k);
            for (int k = 0; k < p.g.tree.nv; k++)
                kt_worst_near(&velocities, v[0][k], v[1][k], slow, "%d, v %d", i, k);
            kt_worst_near(&gaps, r[0].position, r[1].position, 1e-14, "%d", i);
            kt_worst_near(&gaps, r[0].velocity, r[1].velocity, 1e-14 * most, "%d", i);
            compared++;
        }
    }
    kt_check_above("compared", compared, 70.0);
}

/* Two searches take the same path, but for rounding: 2e-15 was measured. If one takes a step more than the other, both
 * are within 1e-11 of a unit, some metres, of the end. */
KT_TEST(assembly_in_a_plane_is_that_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    KT_WORST positions = kt_worst_make("q"), velocities = kt_worst_make("v");
    int assembled = 0, held = 0;
    for (int i = 0; i < 60; i++) {
        tangle_plan plan = draw_plan(i);
        plan.loops = 2;
        pair_grow(&p, &plan, &random);
        double q[2][KT_TREE_NQ], v[2][KT_TREE_NV];
        kt_error e = {0};
        tangle_disturb(&p.g, &random, 0.02, q[0], v[0]);
        memcpy(q[1], q[0], sizeof q[0]);
        memcpy(v[1], v[0], sizeof v[0]);
        const int k0 = kt_random_int(&random, 0, p.g.tree.nv - 1); /* a joint that is held */
        p.g.tree.model->held[k0] = p.space->held[k0] = i % 2;
        (void)kt_data_iterations(p.g.tree.data);
        (void)kt_data_iterations(p.data);
        const kt_status a = kt_state_assemble(p.g.tree.model, p.g.tree.data, p.g.t, q[0], v[0], &e);
        const kt_status b = kt_state_assemble(p.space, p.data, p.g.t, q[1], v[1], &e);
        kt_worst_below(&positions, a != b, 0.5, "%d: one can be assembled and the other not", i);
        assembled += a == KT_OK && b == KT_OK;
        held += i % 2 && a == KT_OK;
        const bool alike = kt_data_iterations(p.g.tree.data).assembly == kt_data_iterations(p.data).assembly;
        const double most = fmax(1.0, kt_tree_largest(v[1], p.g.tree.nv)), near = alike ? 1e-13 : 1e-10;
        for (int k = 0; k < p.g.tree.nq && a == KT_OK && b == KT_OK; k++)
            kt_worst_near(&positions, q[0][k], q[1][k], near, "%d, q %d", i, k);
        for (int k = 0; k < p.g.tree.nv && alike && a == KT_OK && b == KT_OK; k++)
            kt_worst_near(&velocities, v[0][k], v[1][k], 1e-13 * most, "%d, v %d", i, k);
    }
    kt_check_above("assembled", assembled, 50.0);
    kt_check_above("with a joint held", held, 20.0);
}

/* ---- reactions ----------------------------------------------------------------------------------------------------
 */

static double apart(const kt_wrench *a, const kt_wrench *b) {
    return fmax(kt_vec3_norm(kt_vec3_sub(a->moment, b->moment)), kt_vec3_norm(kt_vec3_sub(a->force, b->force)));
}

/* The effect of rounded accelerations and forces on reactions. They follow from A' lambda = M a + h - tau, so that
 * lambda has `reach` times the error of the right side. */
static double round_reactions(const tangle *g) {
    static tangle_system s;
    double a[KT_TREE_NV], moved[KT_TREE_NV], most = 0.0;
    const int nv = g->tree.nv;
    tangle_system_of(g, &s);
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, a, moved);
    for (int i = 0; i < nv; i++) {
        double sum = EPS * fabs(s.force[i]);
        for (int j = 0; j < nv; j++)
            sum += fabs(s.mass[j * nv + i]) * (moved[j] + EPS * fabs(a[j]));
        most = fmax(most, sum);
    }
    return 0.5 * (1.0 + tangle_reach(g, false)) * most;
}

typedef struct reactions {
    kt_wrench joint[KT_TREE_SLOTS], loop[TANGLE_LOOPS];
} reactions;

static void react(const tangle *g, const kt_model *model, kt_data *data, reactions *r) {
    kt_error e = {0};
    kt_need_fine("reactions",
                 kt_reaction_evaluate(model, data, g->t, g->q, g->v, g->tau, g->external, r->joint, r->loop, &e), &e);
}

/* The forces include components out of the plane. If loops can share a reaction in many ways, both share it the same
 * way, with a few exceptions. The sizes of equations decide which of them count as dependent, and either choice can be
 * valid. */
KT_TEST(reactions_in_a_plane_are_those_of_space) {
    static pair p;
    static reactions flat, space;
    kt_random random = kt_random_of_test();
    KT_WORST joints = kt_worst_make("joints"), loops = kt_worst_make("loops");
    double out = 0.0;
    int shared = 0;
    for (int i = 0; i < 60; i++) {
        const tangle_plan plan = draw_plan(i);
        const tangle *g = &p.g;
        pair_grow(&p, &plan, &random);
        react(g, g->tree.model, g->tree.data, &flat);
        react(g, p.space, p.data, &space);
        const double bound = round_reactions(g);
        const double arm = 1.0 + g->tree.model->length; /* a joint carries the moments of loops' forces, too */
        double most = 0.0;
        for (int k = 0; k < g->loops; k++)
            most = fmax(most, apart(&flat.loop[k], &space.loop[k]));
        const bool otherwise = most > 1e6 * bound && !is_plain(g->tree.model);
        shared += otherwise;
        for (int k = 0; k < g->loops && !otherwise; k++)
            kt_worst_below(&loops, apart(&flat.loop[k], &space.loop[k]), bound, "%d, loop %d", i, k);
        for (int k = 1; k < g->tree.count && !otherwise; k++) {
            kt_worst_below(&joints, apart(&flat.joint[k], &space.joint[k]), arm * bound, "%d, joint %d", i, k);
            out = fmax(out, fabs(kt_vec3_dot(flat.joint[k].force, g->tree.normal)));
        }
    }
    kt_check_below("mechanisms that share a reaction in another way", shared, 1.0);
    kt_check_above("some of it out of the plane", out, 100.0);
}
