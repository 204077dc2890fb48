/* Mechanisms with loops: equal inputs give equal bits, for every content of the workspace and every instruction set. No
 * call allocates memory, and OpenBLAS's threads are left alone.
 *
 * From 40 coordinates of a group on, LAPACK factors. Its bits are those of its kernels for this processor. They are
 * equal on every level of this library, but are not promised to be equal between processors.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "dynamics/dynamics.h"

#include "kinetree/study.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

/* The results of all calls for a closed mechanism. */
typedef struct results {
    double a[KT_TREE_NV], q[3][KT_TREE_NQ], v[3][KT_TREE_NV];
    double jacobian[TANGLE_ROWS * KT_TREE_NV], residual[TANGLE_ROWS], rate[TANGLE_ROWS], drift[TANGLE_ROWS];
    kt_wrench joint[KT_TREE_SLOTS], loop[LINKAGE_LOOPS];
    kt_residual gap;
    int failed; /* calls */
} results;

/* The state of a call: on the manifold, and a step off it. */
typedef struct question {
    const kt_model *model;
    kt_data *data;
    double t;
    const double *q, *v, *tau;
    const kt_wrench *external;
    bool small; /* the matrices fit */
} question;

/* A change to the workspace before each call. */
typedef void disturb(const question *ask);

static void leave(const question *ask) { (void)ask; }

static unsigned char garbage = 0xA5;

static void spoil(const question *ask) {
    const kt_counts *n = &ask->model->n;
    kt_data *data = ask->data;
#define SPOIL(type, name, count, meaning) memset((void *)data->name, garbage, (count) * sizeof *data->name);
    KT_DATA_FIELDS(SPOIL)
#undef SPOIL
    garbage = (unsigned char)(garbage * 5 + 1);
}

static void ask_all(const question *ask, disturb *before, results *r) {
    const kt_model *m = ask->model;
    const size_t nq = (size_t)kt_model_nq(m), nv = (size_t)kt_model_nv(m);
    kt_error e;
    bool changed;
    memset(r, 0, sizeof *r);
    before(ask);
    r->failed =
        kt_acceleration_evaluate(m, ask->data, ask->t, ask->q, ask->v, ask->tau, ask->external, r->a, &e) != KT_OK;
    for (int k = 0; k < 3; k++) { /* closed already, a step off, far off */
        for (size_t i = 0; i < nv; i++)
            r->v[k][i] = (k == 0 ? 0.0 : k == 1 ? 1e-4 : 0.1) * (i % 3 ? 1.0 : -0.5);
        kt_position_add(m, ask->q, r->v[k], r->q[k]);
        memcpy(r->v[k], ask->v, nv * sizeof(double));
        before(ask);
        r->failed += (k < 2 ? kt_state_project(m, ask->data, ask->t, r->q[k], r->v[k], &changed, &e)
                            : kt_state_assemble(m, ask->data, ask->t, r->q[k], r->v[k], &e)) != KT_OK;
    }
    (void)nq;
    before(ask);
    r->failed += kt_loop_residual(m, ask->data, ask->t, ask->q, ask->v, &r->gap, &e) != KT_OK;
    before(ask);
    r->failed += kt_reaction_evaluate(m, ask->data, ask->t, ask->q, ask->v, ask->tau, ask->external,
                                      ask->small ? r->joint : NULL, r->loop, &e) != KT_OK;
    before(ask);
    if (ask->small)
        r->failed += kt_loop_equations(m, ask->data, ask->t, ask->q, ask->v, r->jacobian, r->residual, r->rate,
                                       r->drift, &e) != KT_OK;
}

static question ask_tangle(const tangle *g) {
    return (question){.model = g->tree.model,
                      .data = g->tree.data,
                      .t = g->t,
                      .q = g->q,
                      .v = g->v,
                      .tau = g->tau,
                      .external = g->external,
                      .small = true};
}

static question ask_linkage(const linkage *l) {
    return (question){.model = l->model, .data = l->data, .q = l->q, .v = l->v};
}

/* In space, and in a plane. */
static tangle_plan plan_of(int i) { return i / 2 % 2 ? tangle_plan_planar() : tangle_plan_default(); }

KT_TEST(garbage_in_the_workspace_changes_no_bit) {
    static tangle g;
    static linkage l;
    static results clean, spoiled;
    kt_random random = kt_random_of_test();
    long different = 0, failures = 0;
    for (int i = 0; i < 60; i++) {
        tangle_plan plan = plan_of(i);
        plan.options.reduction = kt_reduction_method_of((kt_reduction)(i % 3));
        plan.options.metric = i % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        tangle_grow(&g, &plan, &random);
        const question ask = ask_tangle(&g);
        ask_all(&ask, leave, &clean);
        ask_all(&ask, spoil, &spoiled);
        different += memcmp(&clean, &spoiled, sizeof clean) != 0;
        failures += clean.failed;
    }
    kt_check_equal_int("different", different, 0);
    kt_check_below("calls that fail", (double)failures, 1.0); /* assembly from 0.1 rad off may */
    for (int i = 0; i < 9; i++) {                             /* near a singular position; in groups large and small */
        linkage_windows(&l, i % 3 ? 20 : 3, 1.5707963267948966 + (i < 3 ? 0.0 : 0.003), 1.0, KT_LOOP_REVOLUTE);
        l.options.reduction = kt_reduction_method_of((kt_reduction)(i % 3));
        linkage_build(&l, 0.0);
        const question ask = ask_linkage(&l);
        ask_all(&ask, leave, &clean);
        ask_all(&ask, spoil, &spoiled);
        kt_check_true("windows, to the bit", memcmp(&clean, &spoiled, sizeof clean) == 0);
    }
}

static void compare_isas(kt_isa isa, const char *what) {
    static tangle g;
    static linkage l;
    static results base, other;
    kt_random random = kt_random_of_test();
    long compared = 0, different = 0;
    for (int i = 0; i < 60; i++) {
        const tangle_plan plan = plan_of(i);
        tangle_grow(&g, &plan, &random);
        for (int k = 0; k < 2; k++) {
            const kt_model_options options = {
                .isa = k ? isa : KT_ISA_BASE,
                .reduction = kt_reduction_method_of(i % 2 ? KT_REDUCTION_QR : KT_REDUCTION_PARTITION)};
            kt_tree_compile(&g.tree, &options);
            const question ask = ask_tangle(&g);
            ask_all(&ask, leave, k ? &other : &base);
        }
        compared += kt_model_isa(g.tree.model) == isa;
        different += memcmp(&base, &other, sizeof base) != 0;
    }
    for (int k = 0; k < 2; k++) { /* and across a singular position */
        linkage_windows(&l, 4, 1.5707963267948966, 1.0, KT_LOOP_REVOLUTE);
        l.options.isa = k ? isa : KT_ISA_BASE;
        linkage_build(&l, 0.0);
        const question ask = ask_linkage(&l);
        ask_all(&ask, leave, k ? &other : &base);
    }
    different += memcmp(&base, &other, sizeof base) != 0;
    kt_check_equal_int(what, different, 0);
    kt_check_equal_int("compared", compared, 60);
}

KT_TEST(every_level_gives_the_same_bits) {
    const kt_isa best = kt_isa_resolve(KT_ISA_AUTO);
    kt_check_true("there is a level", best >= KT_ISA_BASE);
    if (best >= KT_ISA_V3)
        compare_isas(KT_ISA_V3, "differ on x86-64-v3");
    else
        kt_skip("v3", KT_NO_ISA);
    if (best >= KT_ISA_V4)
        compare_isas(KT_ISA_V4, "differ on x86-64-v4");
    else
        kt_skip("v4", KT_NO_ISA);
}

KT_TEST(nothing_is_allocated_after_set_up) {
    static tangle g;
    static linkage l;
    static results r;
    kt_random random = kt_random_of_test();
    long count = 0;
    const int threads = openblas_get_num_threads();
    for (int i = 0; i < 24; i++) {
        tangle_plan plan = plan_of(i);
        plan.options.reduction = kt_reduction_method_of((kt_reduction)(i % 3));
        plan.options.metric = i % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        tangle_grow(&g, &plan, &random);
        const question ask = ask_tangle(&g);
        kt_interpose_start();
        ask_all(&ask, leave, &r);
        count += kt_interpose_stop();
    }
    kt_check_equal_int("allocations, small groups", count, 0);
    for (int i = 0; i < 6; i++) { /* 81 coordinates, by LAPACK; and across a singular position */
        linkage_windows(&l, 40, i < 3 ? 0.4 : 1.5707963267948966, 1.0, KT_LOOP_REVOLUTE);
        l.options.reduction = kt_reduction_method_of((kt_reduction)(i % 3));
        linkage_build(&l, 0.0);
        const question ask = ask_linkage(&l);
        kt_interpose_start();
        ask_all(&ask, leave, &r);
        kt_check_equal_int("allocations, large group", kt_interpose_stop(), 0);
    }
    kt_check_equal_int("threads of OpenBLAS", openblas_get_num_threads(), threads);
}

/* Everything of windows in a row, with so many threads of OpenBLAS; the caller's number is put back. */
static void accelerate_with(int threads, int windows, double theta, double *a) {
    static linkage l;
    const int before = openblas_get_num_threads();
    openblas_set_num_threads(threads);
    linkage_windows(&l, windows, theta, 1.0, KT_LOOP_REVOLUTE);
    linkage_build(&l, 0.0);
    linkage_accelerate(&l, 0.0, a);
    memcpy(a + LINKAGE_NQ, l.q, (size_t)l.nq * sizeof *a);
    memcpy(a + 2 * LINKAGE_NQ, l.v, (size_t)l.nv * sizeof *a);
    openblas_set_num_threads(before);
}

/* 41 to 95 coordinates in one group. For larger groups OpenBLAS divides the work between threads, which changes
 * rounding. */
KT_TEST(threads_of_openblas_change_no_bit_of_groups_below_96_coordinates) {
    static const int windows[] = {20, 33, 40, 47};
    for (size_t i = 0; i < sizeof windows / sizeof *windows; i++) {
        static double one[3 * LINKAGE_NQ], many[3 * LINKAGE_NQ];
        memset(one, 0, sizeof one);
        memset(many, 0, sizeof many);
        accelerate_with(1, windows[i], 0.4, one);
        accelerate_with(4, windows[i], 0.4, many);
        kt_check_above("accelerations", fabs(one[0]), 0.1);
        kt_check_equal_bits("accelerations, positions, velocities", many, one, 3 * LINKAGE_NQ);
    }
}
