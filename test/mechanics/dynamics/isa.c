/* Equal inputs give equal bits, on every instruction set and for every content of the workspace. No call allocates
 * memory. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "tree.h"

#include "dynamics/dynamics.h"

#include <math.h>
#include <string.h>

enum { TREES = 40, WORK = 1 << 21 };

/* The results of all calls of the dynamics. */
typedef struct results {
    double a[KT_TREE_NV], tau[KT_TREE_NV], h[KT_TREE_NV], mass[KT_TREE_NV * KT_TREE_NV], jacobian[6 * KT_TREE_NV];
    double derivative[5][KT_TREE_NV * KT_TREE_NV];
    kt_pose pose[KT_TREE_SLOTS];
    kt_twist twist[KT_TREE_SLOTS], change[KT_TREE_SLOTS];
    kt_wrench reaction[KT_TREE_SLOTS], momentum;
    double kinetic, potential, total;
    kt_vec3 center;
} results;

/* Called before each step that must not depend on the content of the workspace. */
typedef void disturb(const kt_model *model, kt_data *data, void *user);

static void leave(const kt_model *model, kt_data *data, void *user) {
    (void)model;
    (void)data;
    (void)user;
}

/* In memory full of NaN. */
static bool derive(const kt_model *m, kt_data *d, const kt_tree_state *s, results *r, kt_error *e) {
    static _Alignas(KT_ALIGNMENT) char work[WORK];
    double(*x)[KT_TREE_NV * KT_TREE_NV] = r->derivative;
    memset(work, 0xFF, kt_dynamics_work_size(m));
    return kt_dynamics_forward_derivatives(m, d, work, WORK, s->q, s->v, s->tau, s->external, x[0], x[1], x[2], e) ==
               KT_OK &&
           kt_dynamics_inverse_derivatives(m, d, work, WORK, s->q, s->v, s->a, s->external, x[3], x[4], e) == KT_OK;
}

static bool compute(const kt_tree *tree, const kt_tree_state *s, disturb *spoil, void *user, results *r) {
    const kt_model *m = tree->model;
    kt_data *d = tree->data;
    kt_error e;
    memset(r, 0, sizeof *r);
    spoil(m, d, user);
    bool fine = kt_dynamics_forward(m, d, s->q, s->v, s->tau, s->external, r->a, &e) == KT_OK;
    spoil(m, d, user);
    fine &= kt_dynamics_inverse(m, d, s->q, s->v, s->a, s->external, r->tau, &e) == KT_OK;
    spoil(m, d, user);
    fine &= kt_dynamics_inverse(m, d, s->q, s->v, NULL, NULL, r->h, &e) == KT_OK;
    spoil(m, d, user);
    fine &= kt_dynamics_mass(m, d, s->q, r->mass, &e) == KT_OK;
    spoil(m, d, user);
    fine &= derive(m, d, s, r, &e);
    spoil(m, d, user);
    fine &= kt_kinematics_update(m, d, s->q, s->v, s->a, &e) == KT_OK;
    for (int b = 0; b < tree->count; b++) {
        r->pose[b] = kt_body_pose(m, d, b);
        r->twist[b] = kt_body_twist(m, d, b);
        r->change[b] = kt_body_acceleration(m, d, b);
    }
    kt_point_jacobian(m, d, tree->count - 1, kt_vec3_make(0.1, 0.2, 0.3), r->jacobian);
    kt_joint_reactions(m, d, s->external, r->reaction);
    r->momentum = kt_momentum(m, d);
    r->kinetic = kt_kinetic_energy(m, d);
    r->potential = kt_potential_energy(m, d);
    r->total = kt_mass_center(m, d, &r->center);
    return fine;
}

/* Spatial trees of all types, planar ones, some of each. */
static kt_tree_plan draw_plan(int n) {
    kt_tree_plan plan = n % 4 < 2 ? kt_tree_plan_default() : kt_tree_plan_planar();
    if (n % 4 == 3) {
        plan.planar = 2;
        plan.from_world = 0.4;
    }
    return plan;
}

/* ---- levels -------------------------------------------------------------------------------------------------- */

static void compare_isas(kt_isa isa, const char *what) {
    kt_random random = kt_random_of_test();
    static results base, other;
    int compared = 0, different = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, again;
        kt_tree_state s;
        kt_tree_plan plan = draw_plan(n);
        plan.bodies = kt_random_int(&random, 1, KT_TREE_BODIES);
        plan.is_shuffled = n % 4 == 1;
        kt_tree_describe(&tree, &plan, &random);
        memset(&again, 0, sizeof again);
        again.description = tree.description;
        kt_tree_compile(&tree, &(kt_model_options){.isa = KT_ISA_BASE});
        kt_tree_compile(&again, &(kt_model_options){.isa = isa});
        compared += kt_model_isa(tree.model) == KT_ISA_BASE && kt_model_isa(again.model) == isa;
        kt_tree_state_draw(&tree, &random, &s);
        different += !compute(&tree, &s, leave, NULL, &base) || !compute(&again, &s, leave, NULL, &other) ||
                     memcmp(&base, &other, sizeof base) != 0;
    }
    kt_check_equal_int("trees on both levels", compared, TREES);
    kt_check_equal_int(what, different, 0);
}

KT_TEST(all_instruction_set_levels_give_the_same_bits) {
    compare_isas(KT_ISA_BASE, "trees that differ between two models");
    if (kt_isa_resolve(KT_ISA_V3) == KT_ISA_V3)
        compare_isas(KT_ISA_V3, "trees that differ between baseline and v3");
    else
        kt_skip("v3", KT_NO_ISA);
    if (kt_isa_resolve(KT_ISA_V4) == KT_ISA_V4)
        compare_isas(KT_ISA_V4, "trees that differ between baseline and v4");
    else
        kt_skip("v4", KT_NO_ISA);
    kt_note("this processor and build: best instruction set %d", (int)kt_isa_resolve(KT_ISA_AUTO));
}

/* ---- workspace ----------------------------------------------------------------------------------------------- */

static void fill_with_ones(const kt_model *model, kt_data *data, void *user) {
    const kt_counts *n = &model->n;
    (void)user;
#define FILL(type, name, count, meaning) memset(data->name, 0xFF, (count) * sizeof(type)); /* NaN */
    KT_DATA_FIELDS(FILL)
#undef FILL
}

static void fill_with_noise(const kt_model *model, kt_data *data, void *user) {
    const kt_counts *n = &model->n;
    kt_random *random = user;
#define FILL(type, name, count, meaning)                                                                               \
    for (size_t i = 0; i < (count) * sizeof(type); i++)                                                                \
        ((unsigned char *)data->name)[i] = (unsigned char)kt_random_bits(random);
    KT_DATA_FIELDS(FILL)
#undef FILL
}

KT_TEST(garbage_in_the_workspace_changes_no_bit) {
    kt_random random = kt_random_of_test();
    static results clean, spoilt;
    int different[2] = {0, 0};
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = draw_plan(n);
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_need(kt_check_true("computes", compute(&tree, &s, leave, NULL, &clean)));
        different[0] +=
            !compute(&tree, &s, fill_with_ones, NULL, &spoilt) || memcmp(&clean, &spoilt, sizeof clean) != 0;
        different[1] +=
            !compute(&tree, &s, fill_with_noise, &random, &spoilt) || memcmp(&clean, &spoilt, sizeof clean) != 0;
    }
    kt_check_equal_int("trees that see NaN", different[0], 0);
    kt_check_equal_int("trees that see noise", different[1], 0);
}

/* The workspace of a failed call is as good as any. */
static void fail_first(const kt_model *model, kt_data *data, void *user) {
    const double *bad = user;
    double out[KT_TREE_NV];
    if (kt_dynamics_forward(model, data, bad, NULL, NULL, NULL, out, NULL) == KT_OK)
        kt_check_true("fails", model->n.v == 0);
}

KT_TEST(a_call_that_failed_leaves_no_trace) {
    kt_random random = kt_random_of_test();
    static results clean, after;
    double bad[KT_TREE_NQ];
    int different = 0;
    for (int i = 0; i < KT_TREE_NQ; i++)
        bad[i] = (double)NAN;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = draw_plan(n);
        kt_tree_sample(&tree, &plan, &random, &s);
        different += !compute(&tree, &s, leave, NULL, &clean) || !compute(&tree, &s, fail_first, bad, &after) ||
                     memcmp(&clean, &after, sizeof clean) != 0;
    }
    kt_check_equal_int("trees that differ", different, 0);
}

KT_TEST(no_call_after_set_up_allocates) {
    kt_random random = kt_random_of_test();
    static results r;
    kt_tree tree;
    kt_tree_state s;
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = KT_TREE_BODIES;
    kt_tree_sample(&tree, &plan, &random, &s);
    double q[KT_TREE_NQ], dv[KT_TREE_NV];
    kt_error error;
    kt_interpose_start();
    const bool fine = compute(&tree, &s, leave, NULL, &r);
    kt_position_rate(tree.model, s.q, s.v, q);
    kt_position_add(tree.model, s.q, s.v, q);
    kt_position_subtract(tree.model, s.q, q, dv);
    const bool normal = kt_position_normalize(tree.model, q);
    const int found = kt_body_find(tree.model, "b3");
    s.tau[0] = (double)NAN;
    const kt_status rejected = kt_dynamics_forward(tree.model, tree.data, s.q, s.v, s.tau, s.external, s.a, &error);
    const long allocations = kt_interpose_stop();
    kt_check_true("computes", fine && normal && found > 0);
    kt_check_equal_int("an error among them", rejected, KT_ERROR_NOT_FINITE);
    kt_check_equal_int("allocations", allocations, 0);
}
