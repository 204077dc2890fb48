/* Inverse dynamics against the slow equations of oracle.c, gravity against the potential, and the defaults of NULL. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 150 };

/* size: the magnitude of the terms that tau is the sum of; c measured over 20 seeds, whose worst is half of it. */
KT_TEST(rnea_agrees_with_kane_in_long_double_on_random_trees) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("tau against sum J' (inertia - gravity - external)");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 20);
        plan.is_shuffled = n % 2;
        plan.floats = n % 3 == 0;
        kt_tree_sample(&tree, &plan, &random, &s);
        double tau[KT_TREE_NV];
        long double slow[KT_TREE_NV], size[KT_TREE_NV];
        kt_oracle_inverse(&tree, &s, s.a, slow, size);
        kt_tree_inverse(&tree, &s, tau);
        for (int i = 0; i < tree.nv; i++)
            kt_worst_near(&error, tau[i], (double)slow[i], 20.0 * EPS * (double)size[i], "tree %d coordinate %d", n, i);
    }
}

KT_TEST(null_stands_for_zeros) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s, zero;
    const kt_tree_plan plan = kt_tree_plan_default();
    kt_error e;
    double x[KT_TREE_NV], y[KT_TREE_NV];
    kt_tree_sample(&tree, &plan, &random, &s);
    memset(&zero, 0, sizeof zero);
    memcpy(zero.q, s.q, sizeof zero.q);
    const kt_model *m = tree.model;
    const size_t nv = (size_t)tree.nv;
    kt_check_equal_int("gravity force", kt_dynamics_inverse(m, tree.data, s.q, NULL, NULL, NULL, x, &e), KT_OK);
    kt_tree_inverse(&tree, &zero, y);
    kt_check_equal_bits("gravity force", x, y, nv);
    kt_check_equal_int("fall", kt_dynamics_forward(m, tree.data, s.q, NULL, NULL, NULL, x, &e), KT_OK);
    kt_tree_forward(&tree, &zero, y);
    kt_check_equal_bits("fall", x, y, nv);
    kt_check_equal_int("pose", kt_kinematics_update(m, tree.data, s.q, NULL, NULL, &e), KT_OK);
    kt_vec3 at = kt_body_acceleration(m, tree.data, tree.count - 1).linear;
    kt_check_equal_bits("no acceleration", &at.x, (double[]){0.0, 0.0, 0.0}, 3);
}

/* V at q (+) s dq */
static double potential(const kt_tree *tree, const double *q, const double *dq, double s) {
    kt_tree_state moved;
    double step[KT_TREE_NV];
    memset(&moved, 0, sizeof moved);
    for (int i = 0; i < tree->nv; i++)
        step[i] = s * dq[i];
    kt_position_add(tree->model, q, step, moved.q);
    kt_tree_kinematics(tree, &moved);
    return kt_potential_energy(tree->model, tree->data);
}

/* Fourth-order differences with h = 2e-3. The truncation is `h^4 / 30` times the fifth derivative. This is of the order
 * of V, as positions are sines and cosines. The rounding is EPS V / h. Both are near 1e-12 of V. */
KT_TEST(gravity_force_is_gradient_of_potential_energy) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("dV along each coordinate");
    const double h = 2e-3;
    for (int n = 0; n < 40; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_error e;
        double force[KT_TREE_NV], one[KT_TREE_NV] = {0};
        kt_tree_sample(&tree, &plan, &random, &s);
        double scale = 0.0;
        for (int b = 1; b < tree.count; b++)
            scale += kt_body_mass(tree.model, b) * 9.81 * 4.0;
        kt_need_fine("gravity", kt_dynamics_inverse(tree.model, tree.data, s.q, NULL, NULL, NULL, force, &e), &e);
        for (int i = 0; i < tree.nv; i++) {
            one[i] = 1.0;
            const double near = potential(&tree, s.q, one, h) - potential(&tree, s.q, one, -h);
            const double far = potential(&tree, s.q, one, 2.0 * h) - potential(&tree, s.q, one, -2.0 * h);
            one[i] = 0.0;
            kt_worst_near(&error, (8.0 * near - far) / (12.0 * h), force[i], 1e-12 * scale, "tree %d %d", n, i);
        }
    }
}

/* tau(q, v, a) = M a + h(q, v): affine in a; and the part of h that v brings is quadratic in v. */
KT_TEST(bias_is_quadratic_in_velocity_and_force_affine_in_acceleration) {
    kt_random random = kt_random_of_test();
    KT_WORST affine = kt_worst_make("tau(2a) - 2 tau(a) + tau(0)"),
             quadratic = kt_worst_make("h(2v) - 4 h(v) + 3 h(0)");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_error e;
        double a2[KT_TREE_NV], v2[KT_TREE_NV], t0[KT_TREE_NV], t1[KT_TREE_NV], t2[KT_TREE_NV], h2[KT_TREE_NV];
        double g[KT_TREE_NV];
        kt_tree_sample(&tree, &plan, &random, &s);
        for (int i = 0; i < tree.nv; i++) {
            a2[i] = 2.0 * s.a[i];
            v2[i] = 2.0 * s.v[i];
        }
        const kt_model *m = tree.model;
        if (kt_dynamics_inverse(m, tree.data, s.q, s.v, NULL, NULL, t0, &e) == KT_OK &&
            kt_dynamics_inverse(m, tree.data, s.q, s.v, s.a, NULL, t1, &e) == KT_OK &&
            kt_dynamics_inverse(m, tree.data, s.q, s.v, a2, NULL, t2, &e) == KT_OK &&
            kt_dynamics_inverse(m, tree.data, s.q, v2, NULL, NULL, h2, &e) == KT_OK &&
            kt_dynamics_inverse(m, tree.data, s.q, NULL, NULL, NULL, g, &e) == KT_OK) {
            const double scale =
                kt_tree_largest(t2, tree.nv) + kt_tree_largest(h2, tree.nv) + kt_tree_largest(g, tree.nv);
            for (int i = 0; i < tree.nv; i++) {
                kt_worst_near(&affine, t2[i] - 2.0 * t1[i] + t0[i], 0.0, 20.0 * EPS * scale, "tree %d %d", n, i);
                kt_worst_near(&quadratic, h2[i] - 4.0 * t0[i] + 3.0 * g[i], 0.0, 20.0 * EPS * scale, "tree %d %d", n,
                              i);
            }
        }
    }
}
