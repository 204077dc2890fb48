/* The equations of motion with multipliers for many right-hand sides, and their use: derivatives along the tree against
 * those of dense factors. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "kinetree/effect.h"

#include "derivative/kkt.h"
#include "derivative/stiffness.h"
#include "model/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 11, MOST = KT_TREE_NV * KT_TREE_NV };

typedef struct right_sides {
    double f[COLUMNS * KT_TREE_NV], b[COLUMNS * TANGLE_ROWS], x[COLUMNS * KT_TREE_NV];
} right_sides;

/* x and lambda at random, f = M x - A' lambda, b = A x. */
static void draw(const tangle *g, const tangle_system *s, kt_random *random, right_sides *r) {
    const int nv = g->tree.nv, rows = g->rows;
    memset(r, 0, sizeof *r);
    for (int c = 0; c < COLUMNS; c++) {
        double *x = r->x + c * nv, *f = r->f + c * nv, *b = r->b + c * rows;
        for (int i = 0; i < nv; i++)
            x[i] = kt_random_uniform(random, -1.0, 1.0);
        for (int j = 0; j < nv; j++)
            for (int i = 0; i < nv; i++)
                f[i] += s->mass[j * nv + i] * x[j];
        for (int e = 0; e < rows; e++) {
            const double lambda = kt_random_uniform(random, -1.0, 1.0);
            for (int j = 0; j < nv; j++) {
                b[e] += s->jacobian[j * rows + e] * x[j];
                f[j] -= s->jacobian[j * rows + e] * lambda;
            }
        }
    }
}

static void solve(const kt_model *model, kt_data *data, const tangle *g, kt_metric metric, right_sides *r) {
    const size_t size = kt_kkt_init(NULL, NULL, model, NULL);
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_kkt w;
    kt_error e = {0};
    memset(memory, 0xFF, size);
    (void)kt_kkt_init(&w, memory, model, data);
    kt_need_fine("factors", kt_kkt_factor(&w, KT_ROWS_ALL, metric, g->t, g->q, &e), &e);
    kt_kkt_solve(&w, COLUMNS, r->f, r->b);
    free(memory);
}

typedef struct census {
    int compared, near, fronts, dense, carried, redundant, planar;
} census;

static void count(const tangle *g, census *c) {
    const kt_model *m = g->tree.model;
    c->compared++;
    for (size_t i = 0; i < m->n.group; i++) {
        const kt_group *group = &m->group[i];
        *(group->has_fronts ? &c->fronts : &c->dense) += 1;
        c->carried += group->parent != 0;
        c->redundant += group->rank[KT_ROWS_ALL] < group->count[KT_ROWS_ALL];
        c->planar += (size_t)m->group_link[group->link] >= m->n.spatial;
    }
}

/* Bounds: the effect of rounding of the matrices on each right-hand side (tangle_solve), or 1e-12 of scale. */
static void check(const tangle *g, const tangle_system *s, const right_sides *r, const right_sides *solved,
                  kt_worst *worst) {
    static tangle_system of;
    const int nv = g->tree.nv;
    double expected[KT_TREE_NV], moved[KT_TREE_NV];
    of = *s;
    for (int c = 0; c < COLUMNS; c++) {
        memcpy(of.force, r->f + c * nv, (size_t)nv * sizeof *of.force);
        memcpy(of.drift, r->b + c * g->rows, (size_t)g->rows * sizeof *of.drift);
        (void)tangle_solve(g, &of, (tangle_way){.mixes = true}, expected, moved);
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, solved->f[c * nv + i], r->x[c * nv + i], fmax(1e-12, 8.0 * moved[i]),
                          "nv %d, column %d, %d", nv, c, i);
    }
}

/* With the metric of the coordinates M is the matrix 1. */
static void run(const tangle_plan *plan, int mechanisms, kt_metric metric, census *c) {
    static tangle g;
    static tangle_system s;
    static right_sides r, solved;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("x");
    *c = (census){0};
    for (int n = 0; n < mechanisms; n++) {
        tangle_plan some = *plan;
        some.tree.with_armature = n % 3 ? 0.0 : 0.5;
        some.options.structure = n % 2 ? KT_STRUCTURE_FRONTS : KT_STRUCTURE_AUTO;
        tangle_grow(&g, &some, &random);
        tangle_system_of(&g, &s);
        const int nv = g.tree.nv;
        for (int i = 0; i < nv * nv && metric == KT_METRIC_IDENTITY; i++)
            s.mass[i] = i % (nv + 1) == 0;
        draw(&g, &s, &random, &r);
        solved = r;
        solve(g.tree.model, g.tree.data, &g, metric, &solved);
        if (tangle_was_near_singular(g.tree.model, g.tree.data)) {
            c->near++;
        } else {
            count(&g, c);
            check(&g, &s, &r, &solved, &worst);
        }
    }
    kt_note(
        "%d compared, %d near singular, %d groups by fronts, %d by dense matrices, %d carried, %d redundant, %d planar",
        c->compared, c->near, c->fronts, c->dense, c->carried, c->redundant, c->planar);
    kt_check_above("compared", c->compared, 0.7 * mechanisms);
    kt_check_above("by fronts", c->fronts, 0.3 * mechanisms);
    kt_check_above("by dense matrices", c->dense, 0.3 * mechanisms);
}

KT_TEST(right_hand_sides_are_solved_in_space) {
    const tangle_plan plan = tangle_plan_default();
    census c;
    run(&plan, 60, KT_METRIC_MASS, &c);
    kt_check_above("carried", c.carried, 5);
}

KT_TEST(right_hand_sides_are_solved_in_a_plane) {
    const tangle_plan plan = tangle_plan_planar();
    census c;
    run(&plan, 60, KT_METRIC_MASS, &c);
    kt_check_above("planar", c.planar, 40);
    kt_check_above("carried", c.carried, 5);
}

KT_TEST(right_hand_sides_of_redundant_loops_are_solved) {
    tangle_plan plan = tangle_plan_planar();
    census c;
    plan.options.plan = KT_PLAN_SPATIAL;
    run(&plan, 60, KT_METRIC_MASS, &c);
    kt_check_above("redundant", c.redundant, 40);
}

KT_TEST(right_hand_sides_of_projections_are_solved) {
    tangle_plan plan[3] = {tangle_plan_default(), tangle_plan_planar(), tangle_plan_planar()};
    plan[2].options.plan = KT_PLAN_SPATIAL;
    for (int k = 0; k < 3; k++) {
        census c;
        run(&plan[k], 30, KT_METRIC_IDENTITY, &c);
        kt_check_above("carried", c.carried, 2);
    }
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

typedef struct derivatives {
    double q[MOST], v[MOST], tau[MOST];
} derivatives;

/* Z x, x of f x n. */
static void spread(const double *z, const double *x, int n, int f, double *to) {
    memset(to, 0, sizeof(double) * (size_t)(n * n));
    for (int c = 0; c < n; c++)
        for (int j = 0; j < f; j++)
            for (int i = 0; i < n; i++)
                to[c * n + i] += z[j * n + i] * x[c * f + j];
}

/* Z stiffness, Z damping and Z mass Z', which do not depend on the choice of Z. */
static bool derive_reduced(const tangle *g, const kt_model *model, kt_data *data, derivatives *d) {
    static double z[MOST], mass[MOST], out[2][MOST], half[MOST];
    const int n = kt_model_nv(model), f = kt_model_mobility(model).minimal;
    const size_t size = kt_stiffness_work_size(model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    kt_error e = {0};
    memset(work, 0xFF, size);
    const bool fine = kt_stiffness_evaluate(model, data, work, size, g->t, g->q, g->v, g->tau, g->external, NULL, z,
                                            mass, out[0], out[1], &e) == KT_OK;
    free(work);
    for (int c = 0; c < n && fine; c++) /* mass Z' */
        for (int i = 0; i < f; i++) {
            half[c * f + i] = 0.0;
            for (int j = 0; j < f; j++)
                half[c * f + i] += mass[j * f + i] * z[j * n + c];
        }
    if (fine) {
        spread(z, half, n, f, d->tau);
        spread(z, out[0], n, f, d->q);
        spread(z, out[1], n, f, d->v);
    }
    return fine;
}

/* Derivatives of accelerations, or of them Z times the reduced matrices. */
static bool derive(const tangle *g, kt_structure structure, bool reduced, derivatives *d, bool *dense) {
    kt_model_options options = kt_model_options_default();
    kt_error e = {0};
    options.plan = g->tree.model->n.planar ? KT_PLAN_AUTO : KT_PLAN_SPATIAL;
    options.structure = structure;
    kt_model *model = kt_test_model(&g->tree.description, &options);
    kt_data *data = kt_test_data(model);
    *dense = kt_linearized_is_dense(model);
    if (reduced)
        return derive_reduced(g, model, data, d);
    const size_t size = kt_acceleration_work_size(model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    memset(work, 0xFF, size);
    const bool fine = kt_acceleration_derivatives(model, data, work, size, g->t, g->q, g->v, g->tau, g->external, d->q,
                                                  d->v, d->tau, &e) == KT_OK;
    free(work);
    return fine;
}

/* How much of the largest acceleration its rounding is. */
static double relative_rounding(const tangle *g) {
    static tangle_system s;
    double a[KT_TREE_NV], moved[KT_TREE_NV];
    tangle_system_of(g, &s);
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, a, moved);
    return kt_tree_largest(moved, g->tree.nv) / kt_tree_largest(a, g->tree.nv);
}

static bool is_plain(const kt_model *model) {
    int rows = 0;
    for (size_t g = 0; g < model->n.group; g++)
        rows += model->group[g].count[KT_ROWS_ALL];
    return rows == kt_model_mobility(model).rank;
}

/* If equations are redundant, positions that violate the loops have the accelerations of the chosen equations. For such
 * mechanisms only the response to forces, or the mass matrix, is compared. */
static void compare_ways(bool reduced, const char *const name[3]) {
    enum { MECHANISMS = 60 };
    static tangle g;
    static derivatives along, dense;
    kt_random random = kt_random_of_test();
    kt_worst worst[3] = {kt_worst_make(name[0]), kt_worst_make(name[1]), kt_worst_make(name[2])};
    int compared = 0, ways = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        const tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        bool first = true, second = false;
        tangle_grow(&g, &plan, &random);
        if (derive(&g, KT_STRUCTURE_FRONTS, reduced, &along, &first) &&
            derive(&g, KT_STRUCTURE_DENSE, reduced, &dense, &second)) {
            const double *const to[3] = {along.q, along.v, along.tau}, *const of[3] = {dense.q, dense.v, dense.tau};
            const double rounding = fmax(1e-12, 32.0 * relative_rounding(&g));
            const int all = g.tree.nv * g.tree.nv;
            ways += !first && second;
            for (int k = is_plain(g.tree.model) ? 0 : 2; k < 3; k++)
                for (int i = 0; i < all; i++)
                    kt_worst_near(&worst[k], to[k][i], of[k][i], rounding * kt_tree_largest(of[k], all),
                                  "mechanism %d, %d", n, i);
            compared++;
        }
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&worst[k]);
    kt_check_above("compared", compared, 0.7 * MECHANISMS);
    kt_check_equal_int("in two ways", ways, compared);
}

KT_TEST(derivatives_along_the_tree_are_those_of_dense_factors) {
    static const char *const name[3] = {"da/dq", "da/dv", "da/dtau"};
    compare_ways(false, name);
}

KT_TEST(reduced_matrices_along_the_tree_are_those_of_dense_factors) {
    static const char *const name[3] = {"Z stiffness", "Z damping", "Z mass Z'"};
    compare_ways(true, name);
}

/* ---- stiffness --------------------------------------------------------------------------------------------------- */

enum { WINDOWS = 15, ROW_NV = 2 * WINDOWS + 1 };

/* Z mass Z', Z stiffness, Z damping, and in the first column Z times the forces by the auxiliary state. None depends on
 * the choice of Z. */
typedef struct matrices {
    double mass[ROW_NV * ROW_NV], stiffness[ROW_NV * ROW_NV], damping[ROW_NV * ROW_NV], force[ROW_NV * ROW_NV];
} matrices;

/* to = z x, x of f x ROW_NV */
static void multiply(const double *z, const double *x, int f, double *to) {
    memset(to, 0, sizeof(double) * ROW_NV * ROW_NV);
    for (int c = 0; c < ROW_NV; c++)
        for (int j = 0; j < f; j++)
            for (int i = 0; i < ROW_NV; i++)
                to[c * ROW_NV + i] += z[j * ROW_NV + i] * x[c * f + j];
}

static void stiffen(linkage *l, matrices *m) {
    static double z[ROW_NV * ROW_NV], mass[ROW_NV * ROW_NV], out[3][ROW_NV * ROW_NV], half[ROW_NV * ROW_NV];
    double rate[2][ROW_NV], rate_x;
    const kt_state_derivatives states = {out[2], rate[0], rate[1], &rate_x};
    const kt_stiffness_matrices to = {z, mass, out[0], out[1], &states, true};
    const kt_dynamic_state at = {0.0, l->q, l->v, NULL, NULL};
    const int f = kt_model_mobility(l->model).minimal;
    const size_t size = kt_stiffness_work_size(l->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    kt_error e = {0};
    memset(work, 0xFF, size);
    memset(out, 0, sizeof out);
    kt_need_fine("stiffness", kt_stiffness_evaluate_at(l->model, l->data, work, size, &at, NULL, &to, &e), &e);
    free(work);
    for (int c = 0; c < ROW_NV; c++) /* mass Z' */
        for (int i = 0; i < f; i++) {
            half[c * f + i] = 0.0;
            for (int j = 0; j < f; j++)
                half[c * f + i] += mass[j * f + i] * z[j * ROW_NV + c];
        }
    multiply(z, half, f, m->mass);
    multiply(z, out[0], f, m->stiffness);
    multiply(z, out[1], f, m->damping);
    multiply(z, out[2], f, m->force);
}

/* A row of windows that leans, with springs, rotors and a filtered force in some of its joints, along the tree and by
 * dense factors. */
KT_TEST(stiffness_matrices_along_the_tree_are_those_of_dense_factors) {
    static linkage l[2];
    static matrices m[2];
    kt_effect spring[4];
    kt_auxiliary_state filter = kt_auxiliary_state_default();
    for (int k = 0; k < 3; k++) {
        spring[k] = kt_effect_of(KT_EFFECT_JOINT_SPRING, k == 0 ? "crank0" : k == 1 ? "bar4" : "crank9");
        spring[k].stiffness = 30.0 + k;
        spring[k].damping = 2.0;
    }
    spring[3] = kt_effect_of(KT_EFFECT_EXPRESSION, "crank6");
    spring[3].formula[0] = "-5*filter";
    filter.name = "filter";
    filter.rate = "velocity.crank6 - filter";
    for (int k = 0; k < 2; k++) {
        linkage_windows(&l[k], WINDOWS, 0.5, 1.0, KT_LOOP_REVOLUTE);
        l[k].options.structure = k ? KT_STRUCTURE_DENSE : KT_STRUCTURE_AUTO;
        for (int i = 0; i < l[k].description.body_count; i += 4)
            l[k].body[i].joint.armature[0] = 0.3;
        l[k].description.effects = spring;
        l[k].description.effect_count = 4;
        l[k].description.states = &filter;
        l[k].description.state_count = 1;
        linkage_build(&l[k], 0.0);
        stiffen(&l[k], &m[k]);
        kt_check_equal_int("dense", kt_linearized_is_dense(l[k].model), k);
    }
    const double *const of[4][2] = {{m[0].mass, m[1].mass},
                                    {m[0].stiffness, m[1].stiffness},
                                    {m[0].damping, m[1].damping},
                                    {m[0].force, m[1].force}};
    static const char *const name[4] = {"mass", "stiffness", "damping", "force"};
    for (int k = 0; k < 4; k++) {
        KT_WORST worst = kt_worst_make(name[k]);
        for (int i = 0; i < ROW_NV * ROW_NV; i++) /* measured: 4e-15 */
            kt_worst_near(&worst, of[k][0][i], of[k][1][i], 1e-12 * kt_tree_largest(of[k][1], ROW_NV * ROW_NV), "%d",
                          i);
        kt_check_above("largest", kt_tree_largest(of[k][1], ROW_NV * ROW_NV), 0.01);
    }
}
