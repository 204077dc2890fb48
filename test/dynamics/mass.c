/* The mass matrix against sum J' m J in long double, and what every mass matrix is. */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 150 };

/* Bounds of this file: c measured over 20 seeds, whose worst is about half of the bound. */

/* An entry is bounded by its diagonal, |M_ij| <= sqrt(M_ii M_jj); rounding comes from the composite about other axes.
 */
KT_TEST(mass_matrix_is_sum_of_bodies_on_random_trees) {
    kt_random random = kt_random_of_test();
    kt_worst error = kt_worst_make("M against sum J' m J");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    static long double slow[KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 16);
        plan.is_shuffled = n % 2;
        if (!kt_tree_grow(&tree, &plan, &random))
            return;
        kt_tree_state_draw(&tree, &random, &s);
        kt_oracle_mass(&tree, s.q, slow);
        const int nv = tree.nv;
        if (kt_tree_mass(&tree, &s, mass))
            for (int i = 0; i < nv; i++)
                for (int j = 0; j < nv; j++) {
                    const double scale = (double)sqrtl(slow[i * nv + i] * slow[j * nv + j]);
                    kt_worst_near(&error, mass[i * nv + j], (double)slow[i * nv + j], 100.0 * EPS * scale,
                                  "tree %d entry %d %d", n, i, j);
                }
        kt_tree_free(&tree);
    }
    kt_check_worst(&error);
}

/* Cholesky, in place; the least ratio of a pivot to its diagonal entry. */
static double least_pivot(double *m, int n) {
    double least = 1.0;
    for (int k = 0; k < n; k++) {
        const double diagonal = m[k * n + k];
        double pivot = diagonal;
        for (int j = 0; j < k; j++)
            pivot -= m[k * n + j] * m[k * n + j];
        least = fmin(least, pivot / diagonal);
        if (!(pivot > 0.0))
            return least;
        m[k * n + k] = sqrt(pivot);
        for (int i = k + 1; i < n; i++) {
            for (int j = 0; j < k; j++)
                m[i * n + k] -= m[i * n + j] * m[k * n + j];
            m[i * n + k] /= m[k * n + k];
        }
    }
    return least;
}

KT_TEST(mass_matrix_is_symmetric_to_the_bit_and_positive_definite) {
    kt_random random = kt_random_of_test();
    kt_worst asymmetry = kt_worst_make("M - M'");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    double least = 1.0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        if (!kt_tree_grow(&tree, &plan, &random))
            return;
        kt_tree_state_draw(&tree, &random, &s);
        memset(mass, 0xFF, sizeof mass); /* NaN: every entry is written */
        if (kt_tree_mass(&tree, &s, mass)) {
            for (int i = 0; i < tree.nv * tree.nv; i++)
                kt_worst_near(&asymmetry, mass[i], mass[i % tree.nv * tree.nv + i / tree.nv], 0.0, "tree %d", n);
            least = fmin(least, least_pivot(mass, tree.nv));
        }
        kt_tree_free(&tree);
    }
    kt_check_worst(&asymmetry);
    kt_check_above("least pivot against its diagonal entry", least, 1e-5);
}

KT_TEST(kinetic_energy_is_half_v_mass_v) {
    kt_random random = kt_random_of_test();
    kt_worst error = kt_worst_make("T against v'Mv / 2"), slow_error = kt_worst_make("T against the sum over bodies");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        if (!kt_tree_grow(&tree, &plan, &random))
            return;
        kt_tree_state_draw(&tree, &random, &s);
        if (kt_tree_mass(&tree, &s, mass) && kt_tree_kinematics(&tree, &s)) {
            kt_oracle_body bodies[KT_TREE_SLOTS];
            kt_oracle_motion(&tree, s.q, s.v, NULL, bodies);
            const double t = kt_kinetic_energy(tree.model, tree.data);
            double sum = 0.0, size = 0.0;
            for (int i = 0; i < tree.nv; i++)
                for (int j = 0; j < tree.nv; j++) {
                    sum += 0.5 * s.v[i] * mass[i * tree.nv + j] * s.v[j];
                    size += 0.5 * fabs(s.v[i] * mass[i * tree.nv + j] * s.v[j]);
                }
            kt_worst_near(&error, t, sum, 20.0 * EPS * size, "tree %d", n);
            kt_worst_near(&slow_error, t, (double)kt_oracle_kinetic(&tree, bodies), 50.0 * EPS * t, "tree %d", n);
        }
        kt_tree_free(&tree);
    }
    kt_check_worst(&error);
    kt_check_worst(&slow_error);
}

KT_TEST(columns_of_mass_matrix_are_forces_of_unit_accelerations) {
    kt_random random = kt_random_of_test();
    kt_worst error = kt_worst_make("M e_k against tau(e_k) without gravity at rest");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < TREES / 3; n++) {
        kt_tree tree;
        kt_tree_state s, unit;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.weightless = true;
        if (!kt_tree_grow(&tree, &plan, &random))
            return;
        kt_tree_state_draw(&tree, &random, &s);
        memset(&unit, 0, sizeof unit);
        memcpy(unit.q, s.q, sizeof unit.q);
        const bool have = kt_tree_mass(&tree, &s, mass);
        for (int k = 0; have && k < tree.nv; k++) {
            double tau[KT_TREE_NV];
            unit.a[k] = 1.0;
            if (!kt_tree_inverse(&tree, &unit, tau))
                return;
            unit.a[k] = 0.0;
            for (int i = 0; i < tree.nv; i++) {
                const double scale = sqrt(mass[i * tree.nv + i] * mass[k * tree.nv + k]);
                kt_worst_near(&error, mass[k * tree.nv + i], tau[i], 30.0 * EPS * scale, "tree %d %d %d", n, i, k);
            }
        }
        kt_tree_free(&tree);
    }
    kt_check_worst(&error);
}
