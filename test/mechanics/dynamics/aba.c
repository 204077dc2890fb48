/* Forward dynamics against the slow equations of oracle.c, against inverse dynamics and mass matrix, and at its limits.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 150 };

/* Bounds are c EPS times the sensitivity of each acceleration. The sensitivity is the error of a backward-stable
 * solution for any condition of M (oracle.h). The factor c is measured: the worst over 20 seeds is `0.2 to 0.5` of
 * it. */

KT_TEST(aba_inverts_rnea_on_random_trees) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("a from tau(a)");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 14);
        plan.with_armature = n % 2 ? 0.5 : 0.0;
        kt_tree_sample(&tree, &plan, &random, &s);
        double a[KT_TREE_NV], sensitivity[KT_TREE_NV];
        long double slow[KT_TREE_NV];
        kt_tree_inverse(&tree, &s, s.tau);
        kt_tree_forward(&tree, &s, a);
        if (kt_oracle_forward(&tree, &s, slow, sensitivity))
            for (int i = 0; i < tree.nv; i++)
                kt_worst_near(&error, a[i], s.a[i], 10.0 * EPS * sensitivity[i], "tree %d coordinate %d", n, i);
    }
}

KT_TEST(aba_solves_the_slow_equations_on_random_trees) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("a against M^-1 (tau - h) in long double");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 14);
        plan.is_shuffled = n % 2;
        plan.floats = n % 3 == 0;
        kt_tree_sample(&tree, &plan, &random, &s);
        double a[KT_TREE_NV], sensitivity[KT_TREE_NV];
        long double slow[KT_TREE_NV];
        kt_tree_forward(&tree, &s, a);
        if (kt_oracle_forward(&tree, &s, slow, sensitivity))
            for (int i = 0; i < tree.nv; i++)
                kt_worst_near(&error, a[i], (double)slow[i], 20.0 * EPS * sensitivity[i], "tree %d coordinate %d", n,
                              i);
    }
}

/* M of CRBA and h of RNEA. */
KT_TEST(mass_times_acceleration_and_bias_make_the_force) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("M a + h - tau");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s, still;
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree_sample(&tree, &plan, &random, &s);
        still = s;
        memset(still.a, 0, sizeof still.a);
        static double mass[KT_TREE_NV * KT_TREE_NV];
        double a[KT_TREE_NV], h[KT_TREE_NV];
        kt_tree_forward(&tree, &s, a);
        kt_tree_mass(&tree, &s, mass);
        kt_tree_inverse(&tree, &still, h);
        for (int i = 0; i < tree.nv; i++) {
            double sum = h[i], size = fabs(h[i]) + fabs(s.tau[i]);
            for (int j = 0; j < tree.nv; j++) {
                sum += mass[i * tree.nv + j] * a[j];
                size += fabs(mass[i * tree.nv + j] * a[j]);
            }
            kt_worst_near(&error, sum, s.tau[i], 100.0 * EPS * size, "tree %d coordinate %d", n, i);
        }
    }
}
