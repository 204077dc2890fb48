/* Derivatives of inverse and forward dynamics: against differences of the slow equations in long double, against each
 * other, and against a closed form. */
#include "interpose.h"
#include "oracle.h"

#include "model/internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON
#define STEP 0.01 /* of differences: their error is some h^8 */
enum { TREES = 40, MOST = KT_TREE_NV * KT_TREE_NV };

typedef struct derivatives {
    double tau_q[MOST], tau_v[MOST], a_q[MOST], a_v[MOST], a_tau[MOST];
} derivatives;

static bool derive(const kt_tree *t, const kt_tree_state *s, const kt_wrench *external, derivatives *d) {
    const size_t size = kt_derivative_work_size(t->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    kt_error e = {0};
    const bool fine =
        kt_tree_fine("inverse derivatives",
                     kt_dynamics_inverse_derivatives(t->model, t->data, work, size, s->q, s->v, s->a, external,
                                                     d->tau_q, d->tau_v, &e),
                     &e) &&
        kt_tree_fine("forward derivatives",
                     kt_dynamics_forward_derivatives(t->model, t->data, work, size, s->q, s->v, s->tau, external,
                                                     d->a_q, d->a_v, d->a_tau, &e),
                     &e);
    free(work);
    return fine;
}

/* ---- differences ------------------------------------------------------------------------------------------------- */

/* f at q (+) h e_j, or v + h e_j: inverse or forward dynamics by the library. */
typedef struct slope {
    const kt_tree *tree;
    const kt_tree_state *state;
    bool forward, rate;
    int j;
} slope;

static bool sample(const slope *p, double h, double *f) {
    static kt_tree_state s;
    double step[KT_TREE_NV] = {0};
    s = *p->state;
    step[p->j] = h;
    if (p->rate)
        s.v[p->j] += h;
    else
        kt_position_add(p->tree->model, s.q, step, s.q);
    return p->forward ? kt_tree_forward(p->tree, &s, f) : kt_tree_inverse(p->tree, &s, f);
}

/* Central differences of order eight. */
static bool difference(const slope *p, double h, double *out) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    double up[KT_TREE_NV], down[KT_TREE_NV];
    memset(out, 0, (size_t)p->tree->nv * sizeof *out);
    for (int k = 0; k < 4; k++) {
        if (!sample(p, (k + 1) * h, up) || !sample(p, -(k + 1) * h, down))
            return false;
        for (int i = 0; i < p->tree->nv; i++)
            out[i] += weight[k] / h * (up[i] - down[i]);
    }
    return true;
}

/* 1e-8 of the largest in the column; where a column vanishes, differences leave rounding errors of the function. */
static void compare_column(const slope *p, const double *column, kt_worst *worst, int n) {
    double expected[KT_TREE_NV], f[KT_TREE_NV];
    if (!difference(p, STEP, expected) || !sample(p, 0.0, f))
        return;
    const double size = kt_tree_largest(expected, p->tree->nv), rounding = kt_tree_largest(f, p->tree->nv) * EPS / STEP;
    for (int i = 0; i < p->tree->nv; i++)
        kt_worst_near(worst, column[i], expected[i], 1e-8 * size + rounding, "tree %d row %d column %d", n, i, p->j);
}

KT_TEST(derivatives_are_those_of_differences_on_random_trees) {
    kt_random random = kt_random_of_test();
    static derivatives d;
    kt_worst error[4] = {kt_worst_make("dtau/dq"), kt_worst_make("dtau/dv"), kt_worst_make("da/dq"),
                         kt_worst_make("da/dv")};
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = n % 4 == 3 ? kt_tree_plan_planar() : kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 14);
        if (!kt_tree_grow(&tree, &plan, &random))
            return;
        kt_tree_state_draw(&tree, &random, &s);
        if (derive(&tree, &s, s.external, &d))
            for (int k = 0; k < 4; k++)
                for (int j = 0; j < tree.nv; j++) {
                    const double *const matrix[] = {d.tau_q, d.tau_v, d.a_q, d.a_v};
                    const slope p = {.tree = &tree, .state = &s, .forward = k >= 2, .rate = k % 2, .j = j};
                    compare_column(&p, matrix[k] + j * tree.nv, &error[k], n);
                }
        kt_tree_free(&tree);
    }
    for (int k = 0; k < 4; k++)
        kt_check_worst(&error[k]);
}
