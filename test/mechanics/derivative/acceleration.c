/* Derivatives of the accelerations of closed mechanisms, against differences of these accelerations. Also mass,
 * stiffness and damping matrices, against differences of inverse dynamics and against these derivatives. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "kinetree/effect.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON
#define STEP 0.003
enum { MECHANISMS = 40, MOST = KT_TREE_NV * KT_TREE_NV };

typedef struct derivatives {
    double q[MOST], v[MOST], tau[MOST];
} derivatives;

static kt_status derive(const tangle *g, derivatives *d, kt_error *e) {
    const size_t size = kt_acceleration_work_size(g->tree.model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    memset(work, 0xFF, size);
    const kt_status status = kt_acceleration_derivatives(g->tree.model, g->tree.data, work, size, g->t, g->q, g->v,
                                                         g->tau, g->external, d->q, d->v, d->tau, e);
    free(work);
    return status;
}

/* The input that is varied: positions, velocities, forces. */
typedef enum input { POSITION, RATE, FORCE } input;

/* Columns that could be compared, and those that were. Columns next to positions that the library regards as singular
 * are left out. */
typedef struct census {
    int columns, compared;
} census;

/* *near becomes true where the acceleration came from neighbouring states of a singular position, which are on the
 * manifold. */
static void accelerate(const tangle *g, input what, int j, double h, bool *near, double *a) {
    double q[KT_TREE_NQ], v[KT_TREE_NV], tau[KT_TREE_NV], step[KT_TREE_NV] = {0};
    kt_error e = {0};
    memcpy(q, g->q, sizeof q);
    memcpy(v, g->v, sizeof v);
    memcpy(tau, g->tau, sizeof tau);
    step[j] = h;
    if (what == POSITION)
        kt_position_add(g->tree.model, g->q, step, q);
    else
        (what == RATE ? v : tau)[j] += h;
    kt_need_fine("acceleration",
                 kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, q, v, tau, g->external, a, &e), &e);
    *near |= tangle_was_near_singular(g->tree.model, g->tree.data);
}

/* Central differences of order eight. */
static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};

static void difference(const tangle *g, input what, int j, double h, bool *near, double *out) {
    double up[KT_TREE_NV], down[KT_TREE_NV];
    memset(out, 0, sizeof up);
    for (int k = 0; k < 4; k++) {
        accelerate(g, what, j, (k + 1) * h, near, up);
        accelerate(g, what, j, -(k + 1) * h, near, down);
        for (int i = 0; i < g->tree.nv; i++)
            out[i] += weight[k] / h * (up[i] - down[i]);
    }
}

/* How much of the largest acceleration its rounding is. */
static double relative_rounding(const tangle *g) {
    static tangle_system s;
    double a[KT_TREE_NV], moved[KT_TREE_NV];
    tangle_system_of(g, &s);
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, a, moved);
    return EPS + kt_tree_largest(moved, g->tree.nv) / kt_tree_largest(a, g->tree.nv);
}

/* The error of differences has two parts. One is a 255th of the error with twice the step, if both are good (a 32nd is
 * allowed). The other is rounding of accelerations over the step. The error of the matrix is its own rounding. Next to
 * a singular position steps are shorter. */
static void compare(const tangle *g, input what, const double *matrix, kt_worst *worst, census *c, int n) {
    const int nv = g->tree.nv;
    double a[KT_TREE_NV] = {0};
    const double h = what == POSITION ? STEP / fmax(1.0, 0.1 * tangle_reach(g, false)) : STEP;
    bool near = false;
    accelerate(g, what, 0, 0.0, &near, a);
    const double rounding =
        4.0 * relative_rounding(g) * (kt_tree_largest(a, nv) / h + kt_tree_largest(matrix, nv * nv));
    for (int j = 0; j < nv; j++) {
        double fine[KT_TREE_NV], coarse[KT_TREE_NV];
        near = false;
        difference(g, what, j, h, &near, fine);
        difference(g, what, j, 2.0 * h, &near, coarse);
        c->columns++;
        c->compared += !near;
        for (int i = 0; i < nv && !near; i++)
            kt_worst_near(worst, matrix[j * nv + i], fine[i], fabs(coarse[i] - fine[i]) / 32.0 + rounding,
                          "mechanism %d row %d column %d", n, i, j);
    }
}

/* Every equation is independent of the others, so that the accelerations off the manifold are defined. */
static bool is_plain(const kt_model *model) {
    const kt_mobility f = kt_model_mobility(model);
    int rows = 0;
    for (size_t g = 0; g < model->n.group; g++)
        rows += model->group[g].count[KT_ROWS_ALL];
    return rows == f.rank;
}

/* A caller's own: a spring to a place in the world that stiffens, and drag. */
static int tug(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    (void)user, (void)t, (void)balance;
    const kt_vec3 p = ends[0].point, pull = kt_vec3_scale(-0.1 * sqrt(1.0 + kt_vec3_dot(p, p)), p);
    wrenches[0].force = kt_vec3_sub(pull, kt_vec3_scale(0.4, ends[0].velocity));
    wrenches[0].moment = kt_vec3_scale(-0.2, ends[0].omega);
    return 0;
}

static int differentiate_tug(void *user, double t, const kt_effect_end *ends, kt_effect_derivatives *of_wrenches) {
    const kt_vec3 p = ends[0].point;
    const double root = sqrt(1.0 + kt_vec3_dot(p, p));
    kt_wrench_derivatives *of = &of_wrenches->wrench[0][0];
    (void)user, (void)t;
    of->by_pose[1][1] = (kt_mat3){kt_vec3_scale(-0.1 * p.x / root, p), kt_vec3_scale(-0.1 * p.y / root, p),
                                  kt_vec3_scale(-0.1 * p.z / root, p)};
    of->by_pose[1][1] = kt_mat3_add(of->by_pose[1][1], kt_mat3_scale(-0.1 * root, kt_mat3_identity()));
    of->by_twist[1][1] = kt_mat3_scale(-0.4, kt_mat3_identity());
    of->by_twist[0][0] = kt_mat3_scale(-0.2, kt_mat3_identity());
    return 0;
}

enum { BURDENS = KT_TREE_BURDENS + 1 };

/* The same mechanism with effects upon it, at the same state. */
static void burden(tangle *g, kt_effect effects[BURDENS], bool differenced) {
    kt_tree_burden(effects);
    effects[3] = kt_effect_of(KT_EFFECT_CUSTOM, NULL);
    effects[3].between[0] = (kt_end){.body = "b5", .marker = "tip"};
    effects[3].end_count = 1;
    effects[3].wrench = tug;
    effects[3].wrench_derivatives = differenced ? NULL : differentiate_tug;
    g->tree.description.effects = effects;
    g->tree.description.effect_count = BURDENS;
    kt_tree_compile(&g->tree, NULL);
}

KT_TEST(derivatives_of_closed_mechanisms_are_those_of_differences) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static derivatives d;
    kt_worst error[3] = {kt_worst_make("da/dq"), kt_worst_make("da/dv"), kt_worst_make("da/dtau")};
    census c = {0, 0};
    int taken = 0, singular = 0, types[KT_LOOP_TYPE_COUNT] = {0};
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_plan plan = tangle_plan_default();
        kt_error e = {0};
        plan.loops = 2;
        plan.tree.bodies = 10;
        kt_effect effects[BURDENS];
        tangle_grow(&g, &plan, &random);
        if (n % 2 == 0)
            burden(&g, effects, n % 4 != 0);
        if (is_plain(g.tree.model)) {
            const kt_status status = derive(&g, &d, &e);
            if (status == KT_OK) {
                taken++;
                for (int i = 0; i < g.loops; i++)
                    types[g.loop[i].type]++;
                compare(&g, POSITION, d.q, &error[0], &c, n);
                compare(&g, RATE, d.v, &error[1], &c, n);
                compare(&g, FORCE, d.tau, &error[2], &c, n);
            } else {
                kt_check_equal_int("singular", status, KT_ERROR_SINGULAR);
                singular++;
            }
        }
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&error[k]);
    kt_check_above("mechanisms", taken, 0.25 * MECHANISMS);
    kt_check_above("share of them that are not singular", (double)taken / (taken + singular), 0.8);
    kt_check_above("share of columns compared", (double)c.compared / c.columns, 0.8);
    int kinds = 0;
    for (int i = 0; i < KT_LOOP_TYPE_COUNT; i++)
        kinds += types[i] > 0;
    kt_check_above("types of loops among them", kinds, 10);
}

/* ---- along the loops --------------------------------------------------------------------------------------------- */

/* a at (q (+) s v, v + s a), projected: a smooth family of states that the loops allow, whose first derivative at 0 is
 * (v, a). */
static bool accelerate_along(const tangle *g, const double *a, double s, bool *near, double *out) {
    double q[KT_TREE_NQ], v[KT_TREE_NV], step[KT_TREE_NV];
    kt_error e = {0};
    for (int i = 0; i < g->tree.nv; i++) {
        step[i] = s * g->v[i];
        v[i] = g->v[i] + s * a[i];
    }
    kt_position_add(g->tree.model, g->q, step, q);
    const bool fine =
        kt_fine("projects", kt_state_project(g->tree.model, g->tree.data, g->t, q, v, NULL, &e), &e) &&
        kt_fine("acceleration",
                kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, q, v, g->tau, g->external, out, &e), &e);
    *near |= tangle_was_near_singular(g->tree.model, g->tree.data);
    return fine;
}

/* A step that moves no coordinate far, since accelerations of mechanisms with little inertia are huge. False where
 * nothing was compared. */
static bool compare_along(const tangle *g, const derivatives *d, kt_worst *worst, int n) {
    const int nv = g->tree.nv;
    double a[KT_TREE_NV], expected[KT_TREE_NV] = {0}, coarse[KT_TREE_NV] = {0}, up[KT_TREE_NV], down[KT_TREE_NV],
                          most = 0.0;
    bool near = false;
    accelerate(g, FORCE, 0, 0.0, &near, a);
    const double step = STEP / fmax(1.0, kt_tree_largest(a, nv));
    for (int k = 0; k < 8; k++) {
        const double s = (k % 4 + 1) * (k < 4 ? step : 2.0 * step);
        if (!accelerate_along(g, a, s, &near, up) || !accelerate_along(g, a, -s, &near, down))
            return false;
        for (int i = 0; i < nv; i++)
            (k < 4 ? expected : coarse)[i] += weight[k % 4] / (k < 4 ? step : 2.0 * step) * (up[i] - down[i]);
    }
    if (near)
        return false;
    for (int i = 0; i < nv; i++) {
        double sum = 0.0;
        for (int j = 0; j < nv; j++) {
            sum += d->q[j * nv + i] * g->v[j] + d->v[j * nv + i] * a[j];
            most = fmax(most, fabs(d->q[j * nv + i] * g->v[j]) + fabs(d->v[j * nv + i] * a[j]));
        }
        up[i] = sum;
    }
    const double rounding = 4.0 * relative_rounding(g) * (kt_tree_largest(a, nv) / step + most);
    for (int i = 0; i < nv; i++)
        kt_worst_near(worst, up[i], expected[i], fabs(coarse[i] - expected[i]) / 32.0 + rounding, "mechanism %d row %d",
                      n, i);
    return true;
}

KT_TEST(derivatives_along_a_motion_hold_where_equations_are_redundant) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static derivatives d;
    KT_WORST error = kt_worst_make("da/dq v + da/dv a");
    int redundant = 0, compared = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        kt_error e = {0};
        plan.loops = 2;
        plan.tree.bodies = 10;
        plan.still = true;
        tangle_grow(&g, &plan, &random);
        if (derive(&g, &d, &e) == KT_OK) {
            redundant += !is_plain(g.tree.model);
            compared += compare_along(&g, &d, &error, n);
        }
    }
    kt_check_above("redundant ones", redundant, 8);
    kt_check_above("share compared", (double)compared / MECHANISMS, 0.8);
}

/* ---- mass, stiffness and damping matrices ------------------------------------------------------------------------ */

typedef struct matrices {
    double basis[MOST], mass[MOST], stiffness[MOST], damping[MOST];
} matrices;

/* At the accelerations a, or if NULL at those of the motion. */
static kt_status evaluate_matrices(const tangle *g, const double *a, matrices *m, kt_error *e) {
    const size_t size = kt_stiffness_work_size(g->tree.model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    memset(work, 0xFF, size);
    const kt_status status = kt_stiffness_evaluate(g->tree.model, g->tree.data, work, size, g->t, g->q, g->v, g->tau,
                                                   g->external, a, m->basis, m->mass, m->stiffness, m->damping, e);
    free(work);
    return status;
}

/* The residual: inverse dynamics at the accelerations a, less the forces of the effects. */
static void leave(const tangle *g, const double *q, const double *v, const double *a, double *r) {
    double f[KT_TREE_NV];
    kt_error e = {0};
    const kt_tree *tree = &g->tree;
    kt_need_fine("forces", kt_effect_forces(tree->model, tree->data, g->t, q, v, f, &e), &e);
    kt_need_fine("inverse", kt_dynamics_inverse(tree->model, tree->data, q, v, a, g->external, r, &e), &e);
    for (int i = 0; i < tree->nv; i++)
        r[i] -= f[i];
}

/* Central differences of order eight of the residual, by q_j, v_j or (FORCE) a_j. */
static void difference_of_inverse(const tangle *g, input what, int j, double h, const double *a, double *out) {
    double up[KT_TREE_NV];
    memset(out, 0, sizeof up);
    for (int k = -4; k <= 4; k++) {
        double q[KT_TREE_NQ], v[KT_TREE_NV], moved[KT_TREE_NV], step[KT_TREE_NV] = {0};
        if (k == 0)
            continue;
        memcpy(v, g->v, sizeof v);
        memcpy(moved, a, sizeof moved);
        (what == POSITION ? step : what == RATE ? v : moved)[j] += k * h;
        kt_position_add(g->tree.model, g->q, step, q);
        leave(g, q, v, moved, up);
        for (int i = 0; i < g->tree.nv; i++)
            out[i] += (k < 0 ? -weight[-k - 1] : weight[k - 1]) / h * up[i];
    }
}

/* The largest force in the residual: inertia, gravity, effects, and the residual itself. */
static double largest_force(const tangle *g, const double *a) {
    static const double rest[KT_TREE_NV];
    double r[KT_TREE_NV], largest = 0.0;
    for (int k = 0; k < 4; k++) {
        leave(g, g->q, k & 1 ? g->v : rest, k & 2 ? a : rest, r);
        largest = fmax(largest, kt_tree_largest(r, g->tree.nv));
    }
    return largest;
}

/* Rounding was measured over 40 seeds: up to 0.60 of the bounds. */
static void compare_with_inverse(const tangle *g, input what, const double *a, const double *matrix, kt_worst *worst,
                                 int n) {
    const int nv = g->tree.nv;
    double fine[KT_TREE_NV], coarse[KT_TREE_NV];
    const double rounding = 100.0 * EPS * (largest_force(g, a) / STEP + kt_tree_largest(matrix, nv * nv));
    for (int j = 0; j < nv; j++) {
        double apart = 0.0;
        difference_of_inverse(g, what, j, STEP, a, fine);
        difference_of_inverse(g, what, j, 2.0 * STEP, a, coarse);
        for (int i = 0; i < nv; i++)
            apart = fmax(apart, fabs(coarse[i] - fine[i]));
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, matrix[j * nv + i], fine[i], apart / 32.0 + rounding, "tree %d row %d column %d", n, i,
                          j);
    }
}

/* -M da/dx = D, with the backward error of the solution. */
static void compare_with_solution(const matrices *m, const double *stiffness, const double *slope, int nv,
                                  kt_worst *worst, int n) {
    const double size = kt_tree_largest(m->mass, nv * nv);
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < nv; i++) {
            double sum = 0.0;
            for (int k = 0; k < nv; k++)
                sum -= m->mass[k * nv + i] * slope[j * nv + k];
            kt_worst_near(worst, stiffness[j * nv + i], sum,
                          nv * EPS * (size * kt_tree_largest(slope + j * nv, nv) + fabs(sum)),
                          "tree %d row %d column %d", n, i, j);
        }
}

KT_TEST(matrices_of_trees_are_those_of_differences_of_inverse_dynamics) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static matrices m, evaluated;
    static derivatives d;
    kt_worst error[3] = {kt_worst_make("stiffness"), kt_worst_make("damping"), kt_worst_make("mass")};
    kt_worst solved[2] = {kt_worst_make("-M da/dq"), kt_worst_make("-M da/dv")};
    int others = 0, apart = 0;
    for (int n = 0; n < MECHANISMS / 2; n++) {
        tangle_plan plan = n % 4 == 3 ? tangle_plan_planar() : tangle_plan_default();
        kt_error e = {0};
        kt_effect effects[BURDENS];
        double a[KT_TREE_NV];
        bool near = false;
        plan.loops = 0;
        plan.tree.bodies = 8;
        tangle_grow(&g, &plan, &random);
        if (n % 2 == 0)
            burden(&g, effects, n % 4 != 0);
        accelerate(&g, FORCE, 0, 0.0, &near, a);
        kt_need_fine("matrices", evaluate_matrices(&g, a, &m, &e), &e);
        kt_need_fine("evaluated", evaluate_matrices(&g, NULL, &evaluated, &e), &e);
        kt_need_fine("derivatives", derive(&g, &d, &e), &e);
        const int nv = g.tree.nv;
        compare_with_inverse(&g, POSITION, a, m.stiffness, &error[0], n);
        compare_with_inverse(&g, RATE, a, m.damping, &error[1], n);
        compare_with_inverse(&g, FORCE, a, m.mass, &error[2], n);
        compare_with_solution(&m, m.stiffness, d.q, nv, &solved[0], n);
        compare_with_solution(&m, m.damping, d.v, nv, &solved[1], n);
        apart += memcmp(evaluated.stiffness, m.stiffness, (size_t)(nv * nv) * sizeof *m.stiffness) != 0;
        for (int i = 0; i < nv * nv; i++)
            others += m.basis[i] != (i % (nv + 1) ? 0.0 : 1.0);
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&error[k]);
    for (int k = 0; k < 2; k++)
        kt_check_worst(&solved[k]);
    kt_check_equal_int("entries of bases that are not the identity's", others, 0);
    kt_check_equal_int("matrices that differ at accelerations that are given", apart, 0);
}

/* out = X' Y, X and Y of n rows and f columns. */
static void project(const double *x, const double *y, int n, int f, double *out) {
    for (int j = 0; j < f; j++)
        for (int i = 0; i < f; i++) {
            out[j * f + i] = 0.0;
            for (int k = 0; k < n; k++)
                out[j * f + i] += x[i * n + k] * y[j * n + k];
        }
}

/* out = matrix Z */
static void apply_to_basis(const double *matrix, int rows, const double *z, int n, int f, double *out) {
    for (int j = 0; j < f; j++)
        for (int i = 0; i < rows; i++) {
            out[j * rows + i] = 0.0;
            for (int k = 0; k < n; k++)
                out[j * rows + i] += matrix[k * rows + i] * z[j * n + k];
        }
}

/* stiffness Z = -mass (Z' da/dx Z), with rounding errors of both sides. */
static void compare_reduced(const matrices *m, const double *matrix, const double *slope, int nv, int f,
                            kt_worst *worst, int n) {
    static double along[MOST], inner[MOST], reduced[MOST];
    apply_to_basis(matrix, f, m->basis, nv, f, reduced);
    apply_to_basis(slope, nv, m->basis, nv, f, along);
    project(m->basis, along, nv, f, inner);
    const double bound =
        nv * EPS * (kt_tree_largest(m->mass, f * f) * kt_tree_largest(along, nv * f) + kt_tree_largest(matrix, f * nv));
    for (int j = 0; j < f; j++)
        for (int i = 0; i < f; i++) {
            double sum = 0.0;
            for (int k = 0; k < f; k++)
                sum -= m->mass[k * f + i] * inner[j * f + k];
            kt_worst_near(worst, reduced[j * f + i], sum, 4.0 * bound, "mechanism %d row %d column %d", n, i, j);
        }
}

/* Also across the loops, where their equations are independent: stiffness = -mass (Z' da/dx). */
static void compare_across(const matrices *m, const double *matrix, const double *slope, int nv, int f, kt_worst *worst,
                           int n) {
    static double inner[MOST];
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < f; i++) {
            inner[j * f + i] = 0.0;
            for (int k = 0; k < nv; k++)
                inner[j * f + i] += m->basis[i * nv + k] * slope[j * nv + k];
        }
    const double bound =
        nv * EPS *
        (kt_tree_largest(m->mass, f * f) * kt_tree_largest(slope, nv * nv) + kt_tree_largest(matrix, f * nv));
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < f; i++) {
            double sum = 0.0;
            for (int k = 0; k < f; k++)
                sum -= m->mass[k * f + i] * inner[j * f + k];
            kt_worst_near(worst, matrix[j * f + i], sum, 4.0 * bound, "mechanism %d row %d column %d", n, i, j);
        }
}

/* A Z = 0, Z'Z = 1, mass = Z' M Z; M is that of composite bodies. */
static void check_basis(const tangle *g, const matrices *m, int f, kt_worst worst[3], int n) {
    static double jacobian[TANGLE_ROWS * KT_TREE_NV], open[TANGLE_ROWS * KT_TREE_NV], mass[MOST], product[MOST];
    const int nv = g->tree.nv;
    kt_error e = {0};
    kt_fine("mass", kt_dynamics_mass(g->tree.model, g->tree.data, g->q, mass, &e), &e);
    kt_fine("equations",
            kt_loop_equations(g->tree.model, g->tree.data, g->t, g->q, NULL, jacobian, NULL, NULL, NULL, &e), &e);
    apply_to_basis(jacobian, g->rows, m->basis, nv, f, open);
    kt_worst_below(&worst[0], kt_tree_largest(open, g->rows * f), nv * EPS * kt_tree_largest(jacobian, g->rows * nv),
                   "mechanism %d", n);
    project(m->basis, m->basis, nv, f, open);
    for (int i = 0; i < f * f; i++)
        kt_worst_near(&worst[1], open[i], i % (f + 1) ? 0.0 : 1.0, nv * EPS, "mechanism %d", n);
    apply_to_basis(mass, nv, m->basis, nv, f, product);
    project(product, m->basis, nv, f, open);
    for (int i = 0; i < f * f; i++)
        kt_worst_near(&worst[2], m->mass[i], open[i], nv * EPS * kt_tree_largest(mass, nv * nv), "mechanism %d", n);
}

KT_TEST(matrices_of_closed_mechanisms_are_those_of_their_derivatives_along_the_loops) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static matrices m;
    static derivatives d;
    kt_worst basis[3] = {kt_worst_make("A Z"), kt_worst_make("Z'Z"), kt_worst_make("Z' M Z")};
    kt_worst error[4] = {kt_worst_make("stiffness"), kt_worst_make("damping"),
                         kt_worst_make("stiffness, all directions"), kt_worst_make("damping, all directions")};
    int taken = 0, redundant = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_plan plan = n % 4 == 3 ? tangle_plan_planar() : tangle_plan_default();
        kt_error e = {0};
        kt_effect effects[BURDENS];
        plan.loops = 2;
        plan.tree.bodies = 10;
        tangle_grow(&g, &plan, &random);
        if (n % 2 == 0)
            burden(&g, effects, n % 4 != 0);
        if (derive(&g, &d, &e) == KT_OK) {
            kt_need_fine("matrices", evaluate_matrices(&g, NULL, &m, &e), &e);
            const int f = kt_model_mobility(g.tree.model).minimal;
            check_basis(&g, &m, f, basis, n);
            compare_reduced(&m, m.stiffness, d.q, g.tree.nv, f, &error[0], n);
            compare_reduced(&m, m.damping, d.v, g.tree.nv, f, &error[1], n);
            if (is_plain(g.tree.model)) {
                compare_across(&m, m.stiffness, d.q, g.tree.nv, f, &error[2], n);
                compare_across(&m, m.damping, d.v, g.tree.nv, f, &error[3], n);
            }
            redundant += !is_plain(g.tree.model);
            taken++;
        }
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&basis[k]);
    for (int k = 0; k < 4; k++)
        kt_check_worst(&error[k]);
    kt_check_above("mechanisms", taken, 0.5 * MECHANISMS);
    kt_check_above("redundant ones", redundant, 2);
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

KT_TEST(what_cannot_be_derived_is_rejected_and_nothing_is_written) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static double out[4 * MOST], before[4 * MOST];
    const tangle_plan plan = tangle_plan_default();
    kt_error e = {0};
    tangle_grow(&g, &plan, &random);
    const size_t size = kt_acceleration_work_size(g.tree.model);
    char *work = aligned_alloc(KT_ALIGNMENT, size + KT_ALIGNMENT);
    const kt_model *m = g.tree.model;
    for (int i = 0; i < 4 * MOST; i++)
        out[i] = before[i] = i;
#define CALL(memory, bytes)                                                                                            \
    kt_acceleration_derivatives(m, g.tree.data, memory, bytes, g.t, g.q, g.v, g.tau, g.external, out, out + MOST,      \
                                out + 2 * MOST, &e)
    kt_check_equal_int("short", CALL(work, size - 1), KT_ERROR_MEMORY);
    kt_check_equal_int("askew", CALL(work + 8, size), KT_ERROR_MEMORY);
    const double kept = g.v[1];
    g.v[1] = (double)NAN;
    kt_check_equal_int("not finite", CALL(work, size), KT_ERROR_NOT_FINITE);
    g.v[1] = kept;
    kt_check_equal_bits("outputs", out, before, 3 * MOST);
    kt_check_equal_int("well", CALL(work, size), KT_OK);
#undef CALL
#define CALL(memory, bytes)                                                                                            \
    kt_stiffness_evaluate(m, g.tree.data, memory, bytes, g.t, g.q, g.v, g.tau, g.external, NULL, out, out + MOST,      \
                          out + 2 * MOST, out + 3 * MOST, &e)
    memcpy(out, before, sizeof out);
    kt_check_equal_int("short", CALL(work, kt_stiffness_work_size(m) - 1), KT_ERROR_MEMORY);
    g.v[1] = (double)NAN;
    kt_check_equal_int("not finite", CALL(work, size), KT_ERROR_NOT_FINITE);
    g.v[1] = kept;
    kt_check_equal_bits("outputs", out, before, 4 * MOST);
    kt_check_equal_int("well", CALL(work, size), KT_OK);
#undef CALL
    free(work);
}
