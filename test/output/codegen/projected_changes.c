/* A and B of generated steps of mechanisms with loops, against the library and against differences of the steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "closed_tree.h"
#include "generated.h"

#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"

#include <dlfcn.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    NV_MOST = 7,
    ENTRIES = 6 * NV_MOST * NV_MOST,
    FUNCTIONS = KT_CODEGEN_STEPS | KT_CODEGEN_STEP_DERIVATIVES,
    MECHANISMS = 2 * KT_CLOSED_TYPES
};

static const double length_of_step = 2e-3;

static const char *const method_names[3] = {"heun", "rk4", "semi_implicit"};

/* ---- functions of a file ----------------------------------------------------------------------------------------- */

typedef int changes_function(const void *model, const double *q, const double *v, const double *tau, double h,
                             double *a, double *b);
typedef int timed_changes_function(const void *model, double t, const double *q, const double *v, const double *tau,
                                   double h, double *a, double *b);

static int derive_now(const kt_generated *g, int method, const kt_tree_state *s, int nv, double *out) {
    char name[64];
    changes_function *plain;
    timed_changes_function *timed;
    (void)snprintf(name, sizeof name, "mech_%s_derivatives", method_names[method]);
    void *const at = dlsym(g->library, name);
    if (!kt_check_true(name, at != NULL))
        return 1;
    memcpy(&plain, &at, sizeof plain);
    memcpy(&timed, &at, sizeof timed);
    double *const b = out + 4 * nv * nv;
    return g->loops_have_time ? timed(g->model, KT_CLOSED_NOW, s->q, s->v, s->tau, length_of_step, out, b)
                              : plain(g->model, s->q, s->v, s->tau, length_of_step, out, b);
}

static int step_now(const kt_generated *g, int k, const kt_tree_state *s, int nv, double *next) {
    kt_generated_step *const take[3] = {g->heun, g->rk4, g->semi_implicit};
    kt_generated_timed_step *const take_at[3] = {g->heun_at, g->rk4_at, g->semi_implicit_at};
    return g->loops_have_time ? take_at[k](g->model, KT_CLOSED_NOW, s->q, s->v, s->tau, length_of_step, next, next + nv)
                              : take[k](g->model, s->q, s->v, s->tau, length_of_step, next, next + nv);
}

/* ---- comparisons ------------------------------------------------------------------------------------------------- */

/* A and B of the library, in turn. */
static bool derive_by_library(const kt_tree *tree, int method, const kt_tree_state *s, double *out) {
    const kt_step step = {
        .method = kt_method_find(method_names[method]), .t = KT_CLOSED_NOW, .h = length_of_step, .tau = s->tau};
    const size_t size = kt_step_work_size(tree->model, step.method);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_error error = {0};
    const kt_status status = kt_step_derivatives(tree->model, tree->data, work, size, &step, s->q, s->v, NULL, NULL,
                                                 out, out + 4 * tree->nv * tree->nv, &error);
    free(work);
    return status == KT_OK;
}

static double largest(const double *x, int count) {
    double most = 1.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* The bound has the change of the derivatives with a part of 2^-30 of the state. Returns 1 if they were compared. */
static int compare_with_library(const kt_generated *g, const kt_tree *tree, int method, const kt_tree_state *s,
                                const double *own, kt_worst *worst, int n) {
    static double right[ENTRIES], moved[ENTRIES];
    const int nv = tree->nv, count = 6 * nv * nv;
    const double part = ldexp(1.0, -30);
    kt_tree_state near = *s;
    double most = 0.0;
    (void)g;
    for (int i = 0; i < nv; i++) {
        near.q[i] += part * (i % 2 ? 1.0 : -0.7);
        near.v[i] *= 1.0 + part;
    }
    if (!derive_by_library(tree, method, s, right) || !derive_by_library(tree, method, &near, moved))
        return 0; /* too near to a singular position */
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(moved[i] - right[i]) / part);
    const double bound = 1e-12 * largest(right, count) + 400.0 * DBL_EPSILON * most;
    for (int i = 0; i < count; i++)
        kt_worst_near(worst, own[i], right[i], bound, "mechanism %d, %s, entry %d of A and B", n, method_names[method],
                      i);
    return 1;
}

/* Central differences of the generated step along a direction, of order four; two steps estimate their error. */
static void compare_with_differences(const kt_generated *g, const kt_tree *tree, int method, const kt_tree_state *s,
                                     const double *own, kt_random *random, kt_worst *worst, int n) {
    const int nv = tree->nv;
    double by[3 * NV_MOST], change[2][2 * NV_MOST];
    for (int i = 0; i < 3 * nv; i++)
        by[i] = kt_random_uniform(random, -1.0, 1.0);
    for (int k = 0; k < 2; k++) {
        const double d = k == 0 ? 1e-4 : 2e-4;
        double next[2][2 * NV_MOST];
        for (int side = 0; side < 2; side++) {
            kt_tree_state near = *s;
            for (int i = 0; i < nv; i++) {
                near.q[i] += (side == 0 ? -d : d) * by[i];
                near.v[i] += (side == 0 ? -d : d) * by[nv + i];
                near.tau[i] += (side == 0 ? -d : d) * by[2 * nv + i];
            }
            if (step_now(g, method, &near, nv, next[side]) != 0)
                return;
        }
        for (int i = 0; i < 2 * nv; i++)
            change[k][i] = (next[1][i] - next[0][i]) / (2.0 * d);
    }
    const double size = largest(own, 6 * nv * nv);
    for (int i = 0; i < 2 * nv; i++) {
        const double better = (4.0 * change[0][i] - change[1][i]) / 3.0, apart = fabs(change[0][i] - change[1][i]);
        double sum = 0.0;
        for (int c = 0; c < 3 * nv; c++)
            sum += own[2 * nv * c + i] * by[c];
        kt_worst_near(worst, sum, better, 0.01 * apart + 1e-9 * size, "mechanism %d, %s, number %d", n,
                      method_names[method], i);
    }
}

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

/* A closed state near the first one. Returns how many methods were compared. */
static int compare_mechanism(const kt_generated *g, const kt_closed_tree *m, kt_random *random, kt_worst worst[2],
                             int n) {
    static double own[ENTRIES];
    const kt_tree *tree = &m->tree;
    kt_tree_state s = m->state;
    int compared = 0;
    kt_error error = {0};
    for (int i = 0; i < tree->nv; i++)
        s.q[i] += kt_random_uniform(random, -0.1, 0.1);
    if (kt_state_project(tree->model, tree->data, KT_CLOSED_NOW, s.q, s.v, NULL, &error) != KT_OK)
        return 0;
    for (int k = 0; k < 3; k++) {
        if (derive_now(g, k, &s, tree->nv, own) != 0)
            continue;
        const int fits = k == 2 || compare_with_library(g, tree, k, &s, own, &worst[0], n);
        if (fits)
            compare_with_differences(g, tree, k, &s, own, random, &worst[1], n);
        compared += fits;
    }
    return compared;
}

/* Semi-implicit steps have no derivatives in the library. */
KT_TEST(changes_of_steps_with_loops_are_those_of_the_library) {
    kt_random random = kt_random_of_test();
    kt_worst worst[2] = {kt_worst_make("A and B of the library"), kt_worst_make("differences of the step")};
    static kt_generated g;
    static kt_closed_tree m;
    int files = 0, compared = 0;
    kt_generated_need_compiler();
    const char *text = getenv("KT_MECHANISMS");
    const int count = text != NULL ? (int)strtol(text, NULL, 10) : MECHANISMS;
    for (int n = 0; n < count; n++) {
        if (!kt_closed_grow(&m, &random, n) || m.tree.nv > NV_MOST || m.tree.nv != kt_model_nq(m.tree.model))
            continue;
        kt_generated_make_some(&g, m.tree.model, FUNCTIONS, "cc -O0", false);
        files++;
        for (int k = 0; k < 2; k++)
            compared += compare_mechanism(&g, &m, &random, worst, n);
    }
    kt_check_worst(&worst[0]);
    kt_check_worst(&worst[1]);
    kt_check_above("files", files, 5);
    kt_check_above("comparisons", compared, 3 * files);
}
