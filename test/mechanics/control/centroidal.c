/* Momentum about the centre of mass as a function of joint rates, against sums over bodies in long double, and its
 * derivative against differences. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "along.h"

#include <string.h>

enum { TREES = 60, ROWS = 6 };

/* Centre of mass and momentum about it: angular, linear. */
static double momentum_of(const kt_tree *tree, const double *q, const double *v, kt_vec3 *velocity, double out[ROWS]) {
    kt_oracle_body bodies[KT_TREE_SLOTS];
    long double mass = 0.0L, first[3] = {0.0L}, m[3], p[3];
    kt_oracle_motion(tree, q, v, NULL, bodies);
    const kt_oracle_wrench all = kt_oracle_momentum(tree, bodies);
    for (int b = 1; b < tree->count; b++) {
        const kt_body *body = &tree->body[kt_body_source(tree->model, b)];
        const long double c[3] = {(long double)body->com.x, (long double)body->com.y, (long double)body->com.z};
        const long double own = (long double)body->mass;
        if (!kt_oracle_moves(tree, b))
            continue;
        mass += own;
        for (int i = 0; i < 3; i++)
            first[i] +=
                own * (bodies[b].p[i] + bodies[b].r[i][0] * c[0] + bodies[b].r[i][1] * c[1] + bodies[b].r[i][2] * c[2]);
    }
    for (int i = 0; i < 3; i++) {
        p[i] = all.force[i];
        m[i] = all.moment[i];
        first[i] /= mass > 0.0L ? mass : 1.0L;
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = (double)(m[i] - (first[j] * p[k] - first[k] * p[j]));
        out[3 + i] = (double)p[i];
    }
    *velocity =
        kt_vec3_scale(mass > 0.0L ? 1.0 / (double)mass : 0.0, kt_vec3_make((double)p[0], (double)p[1], (double)p[2]));
    return (double)mass;
}

/* Bounds of this file: measured over 20 seeds, the worst of which is about half of the bound; parts of the mass. */
KT_TEST(columns_are_momenta_of_unit_rates) {
    kt_random random = kt_random_of_test();
    KT_WORST momentum = kt_worst_make("columns of A"), center = kt_worst_make("columns of J of the centre of mass");
    for (int n = 0; n < TREES; n++) {
        static double matrix[ROWS * KT_TREE_NV], jacobian[3 * KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        kt_tree_kinematics(&tree, &s);
        kt_centroidal_matrix(tree.model, tree.data, matrix);
        kt_mass_center_jacobian(tree.model, tree.data, jacobian);
        for (int i = 0; i < tree.nv; i++) {
            double unit[KT_TREE_NV] = {0.0}, expected[ROWS];
            kt_vec3 velocity;
            unit[i] = 1.0;
            const double mass = momentum_of(&tree, s.q, unit, &velocity, expected), bound = 1e-14 * (mass + 1.0);
            for (int r = 0; r < ROWS; r++)
                kt_worst_near(&momentum, matrix[ROWS * i + r], expected[r], bound, "tree %d column %d row %d", n, i, r);
            for (int r = 0; r < 3; r++)
                kt_worst_near(&center, jacobian[3 * i + r], (&velocity.x)[r], 8e-15, "tree %d column %d row %d", n, i,
                              r);
        }
    }
}

/* A v, and the velocity of the centre of mass. */
static bool momentum_at(const kt_tree *tree, const double *q, const double *v, double *out) {
    kt_vec3 velocity;
    (void)momentum_of(tree, q, v, &velocity, out);
    memcpy(out + ROWS, &velocity, sizeof velocity);
    return true;
}

KT_TEST(bias_is_the_rate_of_momentum_at_rest_of_all_rates) {
    kt_random random = kt_random_of_test();
    KT_WORST momentum = kt_worst_make("A' v"), center = kt_worst_make("J' v of the centre of mass");
    for (int n = 0; n < TREES; n++) {
        double rate[ROWS + 3];
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        if (!along_differentiate(&tree, &s, momentum_at, ROWS + 3, rate))
            return;
        kt_tree_kinematics(&tree, &s); /* with accelerations, which must not enter */
        const kt_wrench bias = kt_centroidal_bias(tree.model, tree.data);
        const kt_vec3 a = kt_mass_center_bias(tree.model, tree.data);
        for (int r = 0; r < ROWS; r++)
            kt_worst_near(&momentum, ((const double *)&bias)[r], rate[r], 3e-11, "tree %d row %d", n, r);
        for (int r = 0; r < 3; r++)
            kt_worst_near(&center, (&a.x)[r], rate[ROWS + r], 1e-12, "tree %d row %d", n, r);
    }
}
