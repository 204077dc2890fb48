/* The Coriolis matrix: its product with the velocities, M' = C + C', and Christoffel's symbols. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "along.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TREES = 40 };

static bool coriolis(const kt_tree *tree, const kt_tree_state *s, double *c) {
    const size_t size = kt_dynamics_work_size(tree->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    kt_error e;
    const bool fine =
        kt_fine("Coriolis", kt_coriolis_evaluate(tree->model, tree->data, work, size, s->q, s->v, c, &e), &e);
    free(work);
    return fine;
}

/* Bounds of this file: measured over 20 seeds, the worst of which is about half of the bound. */
KT_TEST(coriolis_matrix_times_velocities_is_the_bias_force_without_gravity) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("C v against h - g");
    for (int n = 0; n < TREES; n++) {
        static double c[ALONG_MOST];
        double h[KT_TREE_NV], g[KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        kt_error e;
        along_grow(&tree, n, &random, &s);
        if (!coriolis(&tree, &s, c) ||
            !kt_fine("h", kt_dynamics_inverse(tree.model, tree.data, s.q, s.v, NULL, NULL, h, &e), &e) ||
            !kt_fine("g", kt_dynamics_inverse(tree.model, tree.data, s.q, NULL, NULL, NULL, g, &e), &e))
            return;
        const double size = kt_tree_largest(h, tree.nv) + kt_tree_largest(g, tree.nv) + 1.0;
        for (int i = 0; i < tree.nv; i++) {
            double sum = 0.0;
            for (int k = 0; k < tree.nv; k++)
                sum += c[k * tree.nv + i] * s.v[k];
            kt_worst_near(&error, sum, h[i] - g[i], 1e-15 * size, "tree %d row %d", n, i);
        }
    }
}

KT_TEST(coriolis_matrix_rejects_what_is_not_finite_and_too_little_memory) {
    kt_random random = kt_random_of_test();
    static double c[ALONG_MOST];
    kt_tree tree;
    kt_tree_state s;
    kt_error e;
    along_grow(&tree, 1, &random, &s);
    const size_t size = (kt_dynamics_work_size(tree.model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    c[0] = 7.0;
    kt_check_equal_int("memory", kt_coriolis_evaluate(tree.model, tree.data, work, 64, s.q, s.v, c, &e),
                       KT_ERROR_MEMORY);
    s.v[0] = (double)NAN;
    kt_check_equal_int("NaN", kt_coriolis_evaluate(tree.model, tree.data, work, size, s.q, s.v, c, &e),
                       KT_ERROR_NOT_FINITE);
    kt_check_equal_bits("untouched", c, (const double[]){7.0}, 1);
    free(work);
}

static bool mass_at(const kt_tree *tree, const double *q, const double *v, double *out) {
    kt_error e;
    (void)v;
    return kt_fine("M", kt_dynamics_mass(tree->model, tree->data, q, out, &e), &e);
}

/* So dM/dt - 2 C = C' - C is skew-symmetric. */
KT_TEST(mass_matrix_changes_by_the_coriolis_matrix_and_its_transpose) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("C + C' against differences of M");
    for (int n = 0; n < TREES; n++) {
        static double c[ALONG_MOST], rate[ALONG_MOST];
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        if (!coriolis(&tree, &s, c) || !along_differentiate(&tree, &s, mass_at, tree.nv * tree.nv, rate))
            return;
        const double size = kt_tree_largest(rate, tree.nv * tree.nv) + 1.0;
        for (int i = 0; i < tree.nv; i++)
            for (int k = 0; k < tree.nv; k++)
                kt_worst_near(&error, c[k * tree.nv + i] + c[i * tree.nv + k], rate[k * tree.nv + i], 3e-12 * size,
                              "tree %d entry %d %d", n, i, k);
    }
}

/* dM/dq_k by differences of order eight. */
static bool mass_by_position(const kt_tree *tree, kt_tree_state s, int k, double *out) {
    memset(s.v, 0, sizeof s.v);
    s.v[k] = 1.0;
    return along_differentiate(tree, &s, mass_at, tree->nv * tree->nv, out);
}

/* C_ij = sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) v_k / 2 where joints have coordinates of their own. */
KT_TEST(coriolis_matrix_is_that_of_christoffel_without_quaternions) {
    enum { SMALL = 12 };
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("C against Christoffel's symbols");
    for (int n = 0; n < 20; n++) {
        static double c[ALONG_MOST], by[SMALL][SMALL * SMALL];
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree tree;
        kt_tree_state s;
        plan.bodies = 3;
        plan.types = KT_TREE_ALL_TYPES & ~(1U << KT_JOINT_SPHERICAL | 1U << KT_JOINT_FREE | 1U << KT_JOINT_FIXED);
        kt_tree_grow(&tree, &plan, &random);
        kt_tree_state_draw(&tree, &random, &s);
        const int nv = tree.nv;
        bool fine = nv <= SMALL && coriolis(&tree, &s, c);
        for (int k = 0; k < nv && fine; k++)
            fine = mass_by_position(&tree, s, k, by[k]);
        for (int i = 0; i < nv && fine; i++)
            for (int j = 0; j < nv; j++) {
                double sum = 0.0;
                for (int k = 0; k < nv; k++)
                    sum += 0.5 * (by[k][j * nv + i] + by[j][k * nv + i] - by[i][k * nv + j]) * s.v[k];
                kt_worst_near(&error, c[j * nv + i], sum, 4e-12, "tree %d entry %d %d", n, i, j);
            }
    }
}
