/* Derivatives of the accelerations of closed mechanisms, against differences of these accelerations. */
#include "tangle.h"

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

/* What is moved: positions, velocities, forces. */
typedef enum input { POSITION, RATE, FORCE } input;

/* Columns that could be compared, and those that were: all but next to what the library holds to be singular. */
typedef struct census {
    int columns, compared;
} census;

/* *near becomes true where the acceleration came from states beside a singular position, which are on the manifold. */
static bool accelerate(const tangle *g, input what, int j, double h, bool *near, double *a) {
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
    const bool fine = kt_tree_fine(
        "acceleration", kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, q, v, tau, g->external, a, &e), &e);
    *near |= tangle_was_near_singular(g->tree.model, g->tree.data);
    return fine;
}

/* Central differences of order eight. */
static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};

static bool difference(const tangle *g, input what, int j, double h, bool *near, double *out) {
    double up[KT_TREE_NV], down[KT_TREE_NV];
    memset(out, 0, sizeof up);
    for (int k = 0; k < 4; k++) {
        if (!accelerate(g, what, j, (k + 1) * h, near, up) || !accelerate(g, what, j, -(k + 1) * h, near, down))
            return false;
        for (int i = 0; i < g->tree.nv; i++)
            out[i] += weight[k] / h * (up[i] - down[i]);
    }
    return true;
}

/* How much of the largest acceleration its rounding is. */
static double relative_rounding(const tangle *g) {
    static tangle_system s;
    double a[KT_TREE_NV], moved[KT_TREE_NV];
    if (!tangle_system_of(g, &s))
        return 0.0;
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, a, moved);
    return EPS + kt_tree_largest(moved, g->tree.nv) / kt_tree_largest(a, g->tree.nv);
}

/* Differences are off by a 255th of what those of twice the step are off by, where both are good (a 32nd is allowed),
 * and by rounding of accelerations over the step; the matrix by rounding of itself. Next to a singular position steps
 * are shorter. */
static void compare(const tangle *g, input what, const double *matrix, kt_worst *worst, census *c, int n) {
    const int nv = g->tree.nv;
    double a[KT_TREE_NV] = {0};
    const double h = what == POSITION ? STEP / fmax(1.0, 0.1 * tangle_reach(g, false)) : STEP;
    bool near = false;
    if (!accelerate(g, what, 0, 0.0, &near, a))
        return;
    const double rounding =
        4.0 * relative_rounding(g) * (kt_tree_largest(a, nv) / h + kt_tree_largest(matrix, nv * nv));
    for (int j = 0; j < nv; j++) {
        double fine[KT_TREE_NV], coarse[KT_TREE_NV];
        near = false;
        if (!difference(g, what, j, h, &near, fine) || !difference(g, what, j, 2.0 * h, &near, coarse))
            return;
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

enum { BURDENS = 4 };

/* The same mechanism with effects upon it, at the same state. */
static bool burden(tangle *g, kt_effect effects[BURDENS]) {
    for (int i = 0; i < BURDENS; i++)
        effects[i] = kt_effect_default();
    effects[0].type = KT_EFFECT_SPRING;
    effects[0].between[0] = (kt_end){.body = "b1", .at = {0.3, -0.2, 4.0}};
    effects[0].between[1] = (kt_end){.body = "b6", .marker = "tip"};
    effects[0].stiffness = 3.0;
    effects[0].damping = 0.4;
    effects[0].length = 0.5;
    effects[1].type = KT_EFFECT_DRAG;
    effects[1].between[0] = (kt_end){.body = "b4", .marker = "tip"};
    effects[1].linear = 0.7;
    effects[2].type = KT_EFFECT_BUSHING;
    effects[2].between[0] = (kt_end){.body = "b2", .at = {0.1, 0.2, -0.3}};
    effects[2].between[1] = (kt_end){.body = "b3"};
    for (int i = 0; i < 3; i++)
        effects[2].stiffnesses[i] = effects[2].dampings[i] = 1.0 + i;
    effects[3].type = KT_EFFECT_CUSTOM;
    effects[3].between[0] = (kt_end){.body = "b5", .marker = "tip"};
    effects[3].end_count = 1;
    effects[3].wrench = tug;
    kt_tree_free(&g->tree);
    g->tree.description.effects = effects;
    g->tree.description.effect_count = BURDENS;
    return kt_tree_compile(&g->tree, NULL);
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
        if (tangle_grow(&g, &plan, &random) && is_plain(g.tree.model) && (n % 2 || burden(&g, effects))) {
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
        tangle_free(&g);
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
        kt_tree_fine("projects", kt_state_project(g->tree.model, g->tree.data, g->t, q, v, NULL, &e), &e) &&
        kt_tree_fine("acceleration",
                     kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, q, v, g->tau, g->external, out, &e),
                     &e);
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
    if (!accelerate(g, FORCE, 0, 0.0, &near, a))
        return false;
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
    kt_worst error = kt_worst_make("da/dq v + da/dv a");
    int redundant = 0, compared = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        kt_error e = {0};
        plan.loops = 2;
        plan.tree.bodies = 10;
        plan.still = true;
        if (tangle_grow(&g, &plan, &random) && derive(&g, &d, &e) == KT_OK) {
            redundant += !is_plain(g.tree.model);
            compared += compare_along(&g, &d, &error, n);
        }
        tangle_free(&g);
    }
    kt_check_worst(&error);
    kt_check_above("redundant ones", redundant, 8);
    kt_check_above("share compared", (double)compared / MECHANISMS, 0.8);
}

/* ---- refusals ---------------------------------------------------------------------------------------------------- */

KT_TEST(what_cannot_be_derived_is_refused_and_nothing_is_written) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static double out[3 * MOST], before[3 * MOST];
    const tangle_plan plan = tangle_plan_default();
    kt_error e = {0};
    if (!tangle_grow(&g, &plan, &random))
        return;
    const size_t size = kt_acceleration_work_size(g.tree.model);
    char *work = aligned_alloc(KT_ALIGNMENT, size + KT_ALIGNMENT);
    const kt_model *m = g.tree.model;
    for (int i = 0; i < 3 * MOST; i++)
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
    free(work);
    tangle_free(&g);
}
