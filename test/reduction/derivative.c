/* Derivatives of the accelerations of closed mechanisms, against differences of these accelerations. */
#include "tangle.h"

#include "model/internal.h"

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

static bool accelerate(const tangle *g, input what, int j, double h, double *a) {
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
    return kt_tree_fine("acceleration",
                        kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, q, v, tau, g->external, a, &e), &e);
}

/* Central differences of order eight. */
static bool difference(const tangle *g, input what, int j, double *out) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    double up[KT_TREE_NV], down[KT_TREE_NV];
    memset(out, 0, sizeof up);
    for (int k = 0; k < 4; k++) {
        if (!accelerate(g, what, j, (k + 1) * STEP, up) || !accelerate(g, what, j, -(k + 1) * STEP, down))
            return false;
        for (int i = 0; i < g->tree.nv; i++)
            out[i] += weight[k] / STEP * (up[i] - down[i]);
    }
    return true;
}

/* 1e-8 of the largest of a matrix; where mechanisms are next to singular, differences are not that exact. */
static void compare(const tangle *g, input what, const double *matrix, kt_worst *worst, int n) {
    const int nv = g->tree.nv;
    double a[KT_TREE_NV] = {0};
    if (!accelerate(g, what, 0, 0.0, a))
        return;
    const double bound = 1e-8 * kt_tree_largest(matrix, nv * nv) + 10.0 * EPS / STEP * kt_tree_largest(a, nv);
    for (int j = 0; j < nv; j++) {
        double expected[KT_TREE_NV];
        if (!difference(g, what, j, expected))
            return;
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, matrix[j * nv + i], expected[i], bound, "mechanism %d row %d column %d", n, i, j);
    }
}

/* Every equation is independent of the others, so that the accelerations off the manifold are defined. */
static bool is_plain(const kt_model *model) {
    const kt_freedom f = kt_model_freedom(model);
    int rows = 0;
    for (size_t g = 0; g < model->n.group; g++)
        rows += model->group[g].count[KT_ROWS_ALL];
    return rows == f.rank;
}

KT_TEST(derivatives_of_closed_mechanisms_are_those_of_differences) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static derivatives d;
    kt_worst error[3] = {kt_worst_make("da/dq"), kt_worst_make("da/dv"), kt_worst_make("da/dtau")};
    int taken = 0, types[KT_LOOP_TYPE_COUNT] = {0};
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_plan plan = tangle_plan_default();
        kt_error e = {0};
        plan.loops = 2;
        plan.tree.bodies = 10;
        if (tangle_grow(&g, &plan, &random) && is_plain(g.tree.model)) {
            const kt_status status = derive(&g, &d, &e);
            if (status == KT_OK) {
                taken++;
                for (int i = 0; i < g.loops; i++)
                    types[g.loop[i].type]++;
                compare(&g, POSITION, d.q, &error[0], n);
                compare(&g, RATE, d.v, &error[1], n);
                compare(&g, FORCE, d.tau, &error[2], n);
            } else {
                kt_check_equal_int("singular", status, KT_ERROR_SINGULAR);
            }
        }
        tangle_free(&g);
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&error[k]);
    kt_check_above("mechanisms", taken, MECHANISMS / 4);
    int kinds = 0;
    for (int i = 0; i < KT_LOOP_TYPE_COUNT; i++)
        kinds += types[i] > 0;
    kt_check_above("types of loops among them", kinds, 10);
}
