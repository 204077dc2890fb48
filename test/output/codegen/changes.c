/* Generated derivatives of the forces of effects, and A and B of steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "effect_set.h"

#include "kinetree/descriptor.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"

#include <dlfcn.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NV = 24, CHANGES = KT_CODEGEN_STEPS | KT_CODEGEN_STEP_DERIVATIVES | KT_CODEGEN_EFFECTS };

typedef int changes_function(const void *model, double t, const double *q, const double *v, const double *tau, double h,
                             double *a, double *b);

static changes_function *find_changes(const kt_generated *g, const char *method) {
    char name[64];
    changes_function *function;
    snprintf(name, sizeof name, "mech_%s_derivatives", method);
    void *const at = dlsym(g->library, name);
    kt_check_true(name, at != NULL);
    memcpy(&function, &at, sizeof function);
    return function;
}

/* Joints of all types without quaternions. The long tier adds larger trees: three bodies have every pair that effects
 * can join, and the compiler needs half the time. */
static void grow_plain_tree(kt_tree *tree, kt_random *random) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = KT_SHORT(3, 5);
    plan.massless = false;
    plan.types = 1u << KT_JOINT_REVOLUTE | 1u << KT_JOINT_PRISMATIC | 1u << KT_JOINT_SCREW |
                 1u << KT_JOINT_CYLINDRICAL | 1u << KT_JOINT_UNIVERSAL;
    plan.with_armature = 0.5;
    kt_tree_grow(tree, &plan, random);
}

static double find_largest(const double *x, int count) {
    double most = 1.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

enum { ENTRIES = 6 * NV * NV };

/* A and B of the library, in turn. */
static void derive_step(const kt_tree *tree, const kt_step *step, const kt_tree_state *s, double *out) {
    const size_t size = kt_step_work_size(tree->model, step->method);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_error error = {0};
    const kt_status status = kt_step_derivatives(tree->model, tree->data, work, size, step, s->q, s->v, NULL, NULL, out,
                                                 out + 4 * tree->nv * tree->nv, &error);
    free(work);
    kt_need_fine("derivatives of the step", status, &error);
}

/* Against kt_step_derivatives, whose effects are differentiated in closed form or by dual numbers. The bound has the
 * change of the derivatives with a part of 2^-30 of the state, as a bushing near half a turn has few digits. */
static void compare_explicit(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, const char *name,
                             kt_worst *worst, int n) {
    static double own[ENTRIES], right[ENTRIES], moved[ENTRIES];
    const int nv = tree->nv, count = 6 * nv * nv;
    const double part = ldexp(1.0, -30);
    const kt_step step = {.method = kt_method_find(name), .t = 0.4, .h = 1e-2, .tau = s->tau};
    kt_tree_state near = *s;
    double most = 0.0;
    for (int i = 0; i < nv; i++) {
        near.q[i] += part * (i % 2 ? 1.0 : -0.7);
        near.v[i] *= 1.0 + part;
    }
    kt_check_equal_int(name, find_changes(g, name)(g->model, 0.4, s->q, s->v, s->tau, 1e-2, own, own + 4 * nv * nv), 0);
    derive_step(tree, &step, s, right);
    derive_step(tree, &step, &near, moved);
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(moved[i] - right[i]) / part);
    const double bound = 1e-13 * find_largest(right, count) + 400.0 * DBL_EPSILON * most;
    for (int i = 0; i < count; i++)
        kt_worst_near(worst, own[i], right[i], bound, "file %d, %s, entry %d of A and B", n, name, i);
}

/* Against central differences of the generated step, over d of each number: errors of d^2 and of rounding over d. */
static void compare_semi_implicit(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, kt_worst *worst,
                                  int n) {
    static double a[6 * NV * NV];
    const int nv = tree->nv;
    const double d = 1e-5;
    double *const b = a + 4 * nv * nv;
    changes_function *const derive = find_changes(g, "semi_implicit");
    kt_check_equal_int("semi_implicit", derive(g->model, 0.4, s->q, s->v, s->tau, 1e-2, a, b), 0);
    const double bound = 1e-6 * find_largest(a, 6 * nv * nv);
    for (int c = 0; c < 3 * nv; c++) {
        double next[2][2 * NV];
        for (int k = 0; k < 2; k++) {
            kt_tree_state near = *s;
            *(c < nv ? &near.q[c] : c < 2 * nv ? &near.v[c - nv] : &near.tau[c - 2 * nv]) += k == 0 ? -d : d;
            (void)g->semi_implicit_at(g->model, 0.4, near.q, near.v, near.tau, 1e-2, next[k], next[k] + nv);
        }
        for (int i = 0; i < 2 * nv; i++)
            kt_worst_near(worst, a[2 * nv * c + i], (next[1][i] - next[0][i]) / (2.0 * d), bound,
                          "file %d column %d row %d", n, c, i);
    }
}

static int count_rounds(int usual) {
    const char *text = getenv("KT_MECHANISMS");
    return text != NULL ? (int)strtol(text, NULL, 10) : usual;
}

KT_TEST(changes_of_steps_are_those_of_the_library_for_each_type_of_effect) {
    kt_random random = kt_random_of_test();
    KT_WORST exact = kt_worst_make("heun and rk4"), near = kt_worst_make("semi-implicit");
    static kt_generated g;
    static kt_effect_set set;
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(1) * KT_EFFECT_TYPE_COUNT; n++) {
        const kt_effect_type type = (kt_effect_type)(n % KT_EFFECT_TYPE_COUNT);
        kt_tree tree;
        grow_plain_tree(&tree, &random);
        kt_effect_set_draw(&set, type, &tree, &random);
        kt_need(kt_check_below("coordinates", tree.nv, NV + 0.5));
        kt_generated_make_some(&g, tree.model, CHANGES, "cc -O0", false);
        for (int k = 0; k < 4; k++) {
            kt_tree_state s;
            kt_tree_state_draw(&tree, &random, &s);
            if (k == 3)
                memset(s.v, 0, sizeof s.v); /* speeds of effects are zero, too */
            compare_explicit(&g, &tree, &s, "heun", &exact, n);
            compare_explicit(&g, &tree, &s, "rk4", &exact, n);
            if (k < 3 && type != KT_EFFECT_EXPRESSION && type != KT_EFFECT_CONTACT)
                compare_semi_implicit(&g, &tree, &s, &near, n);
        }
    }
}
