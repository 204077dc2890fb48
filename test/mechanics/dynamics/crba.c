/* The mass matrix against sum J' m J in long double, and the properties of every mass matrix. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include "model/model.h"

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
    KT_WORST error = kt_worst_make("M against sum J' m J");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    static long double slow[KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 16);
        plan.is_shuffled = n % 2;
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_oracle_mass(&tree, s.q, slow);
        const int nv = tree.nv;
        kt_tree_mass(&tree, &s, mass);
        for (int i = 0; i < nv; i++)
            for (int j = 0; j < nv; j++) {
                const double scale = (double)sqrtl(slow[i * nv + i] * slow[j * nv + j]);
                kt_worst_near(&error, mass[i * nv + j], (double)slow[i * nv + j], 100.0 * EPS * scale,
                              "tree %d entry %d %d", n, i, j);
            }
    }
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
    KT_WORST asymmetry = kt_worst_make("M - M'");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    double least = 1.0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree_sample(&tree, &plan, &random, &s);
        memset(mass, 0xFF, sizeof mass); /* NaN: every entry is written */
        kt_tree_mass(&tree, &s, mass);
        for (int i = 0; i < tree.nv * tree.nv; i++)
            kt_worst_near(&asymmetry, mass[i], mass[i % tree.nv * tree.nv + i / tree.nv], 0.0, "tree %d", n);
        least = fmin(least, least_pivot(mass, tree.nv));
    }
    kt_check_above("least pivot against its diagonal entry", least, 1e-5);
}

KT_TEST(kinetic_energy_is_half_v_mass_v) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("T against v'Mv / 2"), slow_error = kt_worst_make("T against the sum over bodies");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_mass(&tree, &s, mass);
        kt_tree_kinematics(&tree, &s);
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
}

KT_TEST(columns_of_mass_matrix_are_forces_of_unit_accelerations) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("M e_k against tau(e_k) without gravity at rest");
    static double mass[KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < TREES / 3; n++) {
        kt_tree tree;
        kt_tree_state s, unit;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.weightless = true;
        kt_tree_sample(&tree, &plan, &random, &s);
        memset(&unit, 0, sizeof unit);
        memcpy(unit.q, s.q, sizeof unit.q);
        kt_tree_mass(&tree, &s, mass);
        for (int k = 0; k < tree.nv; k++) {
            double tau[KT_TREE_NV];
            unit.a[k] = 1.0;
            kt_tree_inverse(&tree, &unit, tau);
            unit.a[k] = 0.0;
            for (int i = 0; i < tree.nv; i++) {
                const double scale = sqrt(mass[i * tree.nv + i] * mass[k * tree.nv + k]);
                kt_worst_near(&error, mass[k * tree.nv + i], tau[i], 30.0 * EPS * scale, "tree %d %d %d", n, i, k);
            }
        }
    }
}

/* ---- columns side by side, and one by one ------------------------------------------------------------------------ */

static kt_tree_plan draw_plan(int n, kt_random *random) {
    kt_tree_plan plan = n % 3 == 0 ? kt_tree_plan_default() : kt_tree_plan_planar();
    plan.planar = n % 3;
    plan.types &= ~(1U << KT_JOINT_FIXED); /* bodies on one link have no order */
    plan.bodies = kt_random_int(random, 1, KT_TREE_BODIES);
    plan.from_world = n % 4 ? 0.05 : 0.3;
    return plan;
}

/* The same tree with the bodies in the order of their links, so that velocity coordinates have it, too. */
static void sort_by_link(const kt_tree *from, kt_tree *to) {
    int order[KT_TREE_BODIES];
    const int count = from->description.body_count;
    *to = *from;
    for (int i = 0; i < count; i++) {
        int at = i;
        for (; at > 0 && from->model->body[order[at - 1]].link > from->model->body[i + 1].link; at--)
            order[at] = order[at - 1];
        order[at] = i + 1;
    }
    for (int i = 0; i < count; i++)
        to->body[i] = from->body[kt_body_source(from->model, order[i])];
    to->description.bodies = to->body;
    kt_tree_compile(to, NULL);
}

/* The indices in `b` of the coordinates of `a`. */
static void find_coordinates(const kt_tree *a, const kt_tree *b, const double *qa, double *qb, int *v) {
    for (int i = 1; i < a->count; i++) {
        const kt_coordinates x = kt_body_coordinates(a->model, i);
        const kt_coordinates y = kt_body_coordinates(b->model, kt_body_find(b->model, kt_body_name(a->model, i)));
        for (int k = 0; k < x.nq; k++)
            qb[y.q + k] = qa[x.q + k];
        for (int k = 0; k < x.nv; k++)
            v[x.v + k] = y.v + k;
    }
}

KT_TEST(mass_matrix_has_equal_bits_in_any_order_of_the_bodies) {
    kt_random random = kt_random_of_test();
    static double mass[KT_TREE_NV * KT_TREE_NV], sorted[KT_TREE_NV * KT_TREE_NV], lower[KT_TREE_NV * KT_TREE_NV];
    int kinds[2] = {0, 0}, unordered = 0, differ = 0, lower_differ = 0;
    for (int n = 0; n < TREES; n++) {
        static kt_tree a, b;
        kt_tree_state s;
        double q[KT_TREE_NQ];
        int v[KT_TREE_NV];
        kt_error e;
        const kt_tree_plan plan = draw_plan(n, &random);
        kt_tree_grow(&a, &plan, &random);
        sort_by_link(&a, &b);
        kt_tree_state_draw(&a, &random, &s);
        find_coordinates(&a, &b, s.q, q, v);
        kinds[a.model->ordered]++;
        unordered += !b.model->ordered;
        memset(sorted, 0xFF, sizeof sorted);
        memset(lower, 0xFF, sizeof lower);
        kt_tree_mass(&a, &s, mass);
        kt_need_fine("mass", kt_dynamics_mass(b.model, b.data, q, sorted, &e), &e);
        kt_need_fine("lower", kt_dynamics_mass_lower(a.model, a.data, s.q, lower, &e), &e);
        for (int i = 0; i < a.nv; i++)
            for (int j = 0; j < a.nv; j++) {
                differ += memcmp(&mass[i * a.nv + j], &sorted[v[i] * a.nv + v[j]], sizeof *mass) != 0;
                lower_differ += j >= i && memcmp(&mass[i * a.nv + j], &lower[i * a.nv + j], sizeof *mass) != 0;
            }
    }
    kt_check_equal_int("sorted trees that are not in the order of their links", unordered, 0);
    kt_check_equal_int("entries that differ", differ, 0);
    kt_check_equal_int("entries of the lower triangle alone that differ", lower_differ, 0);
    kt_check_above("trees whose order is that of the links", kinds[true], TREES / 10);
    kt_check_above("others", kinds[false], TREES / 10);
}
