/* Multipliers of the loops' equations, the null space of these equations, and the forces of effects along the
 * coordinates.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "kinetree/effect.h"
#include "kinetree/study.h"

#include <float.h>
#include <math.h>

#define EPS DBL_EPSILON
static const kt_reduction ways[] = {KT_REDUCTION_QR, KT_REDUCTION_SVD, KT_REDUCTION_PARTITION};

/* ---- M a + h = tau + J' external + A' lambda --------------------------------------------------------------------- */

/* The row that is off most, against the sum of the sizes of the largest row's terms. */
static double imbalance(const tangle *g, const double *a, const double *lambda, const tangle_system *s) {
    double off = 0.0, size = 0.0;
    for (int i = 0; i < g->tree.nv; i++) {
        double sum = -s->force[i], terms = fabs(s->force[i]);
        for (int j = 0; j < g->tree.nv; j++) {
            sum += s->mass[j * g->tree.nv + i] * a[j];
            terms += fabs(s->mass[j * g->tree.nv + i] * a[j]);
        }
        for (int r = 0; r < g->rows; r++) {
            sum -= s->jacobian[i * g->rows + r] * lambda[r];
            terms += fabs(s->jacobian[i * g->rows + r] * lambda[r]);
        }
        off = isnan(sum) ? (double)NAN : fmax(off, fabs(sum));
        size = fmax(size, terms);
    }
    return off / size;
}

/* The bound is measured over 10 seeds, whose worst is a third of it. */
static void check_balance(bool planar) {
    static tangle g;
    static tangle_system s;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("M a + h - tau - A' lambda");
    int taken = 0;
    for (int n = 0; n < 90; n++) {
        tangle_plan plan = planar ? tangle_plan_planar() : tangle_plan_default();
        double a[KT_TREE_NV], lambda[TANGLE_ROWS];
        kt_error e = {0};
        plan.options.reduction = kt_reduction_method_of(ways[n % 3]);
        if (n % 6 == 3) { /* fronts carry rotors by themselves */
            plan.options.structure = KT_STRUCTURE_FRONTS;
            plan.tree.with_armature = 0.5;
        }
        tangle_grow(&g, &plan, &random);
        tangle_system_of(&g, &s);
        kt_need_fine("acceleration",
                     kt_acceleration_evaluate(g.tree.model, g.tree.data, g.t, g.q, g.v, g.tau, g.external, a, &e), &e);
        if (!tangle_was_near_singular(g.tree.model, g.tree.data) &&
            kt_fine("multipliers",
                    kt_multiplier_evaluate(g.tree.model, g.tree.data, g.t, g.q, g.v, g.tau, g.external, lambda, &e),
                    &e)) {
            taken++;
            kt_worst_below(&worst, imbalance(&g, a, lambda, &s), 20.0 * EPS, /* measured: 10.5 of twelve seeds */
                           "mechanism %d, nv %d", n, g.tree.nv);
        }
    }
    kt_check_above("mechanisms", taken, 72);
}

KT_TEST(multipliers_balance_the_equations_of_motion_in_space) { check_balance(false); }
KT_TEST(multipliers_balance_the_equations_of_motion_in_planes) { check_balance(true); }

/* ---- redundant equations ----------------------------------------------------------------------------------------- */

/* A bar of 1 kg and 2 m that two equal drives hold level. The moment about its hinge is m g l / 2 = 9.81 N m. Each
 * drive carries half, whichever of them the reduction has chosen. */
KT_TEST(two_equal_drives_carry_half_each_with_every_reduction) {
    for (int way = 0; way < 3; way++) {
        linkage l;
        linkage_begin(&l);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(2.0, 0.0, 0.0), 0.0, 0.0)->mass = 1.0;
        for (int i = 0; i < 2; i++) {
            kt_loop *drive = linkage_close(&l, i ? "second" : "first", KT_LOOP_MOTION, NULL,
                                           kt_vec3_make(0.0, 0.0, 0.0), NULL, kt_vec3_make(0.0, 0.0, 0.0));
            drive->joint = "bar";
            drive->function = kt_function_constant(0.0);
        }
        double lambda[2] = {(double)NAN, (double)NAN};
        kt_error e = {0};
        linkage_build(&l, 0.0);
        kt_need_fine("multipliers", kt_multiplier_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, NULL, lambda, &e), &e);
        kt_check_near("larger", fmax(lambda[0], lambda[1]), 9.81 / 2.0, 1e-14);
        kt_check_near("smaller", fmin(lambda[0], lambda[1]), 9.81 / 2.0, 1e-14);
    }
}

/* ---- the null space ---------------------------------------------------------------------------------------------- */

/* Columns left of N by elimination with full pivoting. */
static int rank_of(double *x, int rows, int columns) {
    int rank = 0;
    for (; rank < rows && rank < columns; rank++) {
        int p = rank, q = rank;
        for (int c = rank; c < columns; c++)
            for (int r = rank; r < rows; r++)
                if (fabs(x[c * rows + r]) > fabs(x[q * rows + p]))
                    p = r, q = c;
        if (!(fabs(x[q * rows + p]) > 1e-9))
            break;
        for (int c = 0; c < columns; c++) {
            const double t = x[c * rows + p];
            x[c * rows + p] = x[c * rows + rank];
            x[c * rows + rank] = t;
        }
        for (int r = 0; r < rows; r++) {
            const double t = x[q * rows + r];
            x[q * rows + r] = x[rank * rows + r];
            x[rank * rows + r] = t;
        }
        for (int c = rank + 1; c < columns; c++) {
            const double f = x[c * rows + rank] / x[rank * rows + rank];
            for (int r = rank; r < rows; r++)
                x[c * rows + r] -= f * x[rank * rows + r];
        }
    }
    return rank;
}

KT_TEST(null_space_is_whole_and_does_not_move_the_loops) {
    static tangle g;
    static double basis[KT_TREE_NV * KT_TREE_NV], jacobian[TANGLE_ROWS * KT_TREE_NV];
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A N");
    int dependent = 0, miscounted = 0, taken = 0;
    for (int n = 0; n < 60; n++) {
        tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        kt_error e = {0};
        int columns = -1;
        plan.options.reduction = kt_reduction_method_of(ways[n % 3]);
        tangle_grow(&g, &plan, &random);
        kt_need_fine("equations",
                     kt_loop_equations(g.tree.model, g.tree.data, g.t, g.q, NULL, jacobian, NULL, NULL, NULL, &e), &e);
        kt_need_fine("null space", kt_loop_nullspace(g.tree.model, g.tree.data, g.t, g.q, basis, &columns, &e), &e);
        const int nv = g.tree.nv;
        const double size = kt_tree_largest(basis, nv * columns);
        taken++;
        miscounted += columns != kt_model_mobility(g.tree.model).minimal;
        for (int c = 0; c < columns; c++)
            for (int r = 0; r < g.rows; r++) {
                double sum = 0.0, terms = 1.0;
                for (int i = 0; i < nv; i++) {
                    sum += jacobian[i * g.rows + r] * basis[c * nv + i];
                    terms += fabs(jacobian[i * g.rows + r]);
                }
                kt_worst_below(&worst, fabs(sum), 10.0 * EPS * terms * size, "mechanism %d row %d", n, r);
            }
        dependent += rank_of(basis, nv, columns) != columns;
    }
    kt_check_equal_int("of another size than the freedoms", miscounted, 0);
    kt_check_equal_int("with columns that depend on others", dependent, 0);
    kt_check_above("mechanisms", taken, 48);
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* On a tree M a + h = tau + J' external + Q, with a of the whole and the left side by inverse dynamics. */
KT_TEST(forces_of_effects_are_what_inverse_dynamics_misses) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("M a + h - tau - Q");
    double least = HUGE_VAL;
    for (int n = 0; n < 40; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = n % 2 ? kt_tree_plan_planar() : kt_tree_plan_default();
        kt_effect effects[KT_TREE_BURDENS];
        double a[KT_TREE_NV], left[KT_TREE_NV], forces[KT_TREE_NV], size = 1.0;
        kt_error e = {0};
        plan.massless = false;
        kt_tree_describe(&tree, &plan, &random);
        kt_tree_burden(effects);
        tree.description.effects = effects;
        tree.description.effect_count = KT_TREE_BURDENS;
        kt_tree_compile(&tree, NULL);
        kt_tree_state_draw(&tree, &random, &s);
        kt_need_fine("acceleration",
                     kt_acceleration_evaluate(tree.model, tree.data, 0.0, s.q, s.v, s.tau, s.external, a, &e), &e);
        kt_need_fine("forces", kt_effect_forces(tree.model, tree.data, 0.0, s.q, s.v, forces, &e), &e);
        kt_need_fine("inverse", kt_dynamics_inverse(tree.model, tree.data, s.q, s.v, a, s.external, left, &e), &e);
        for (int i = 0; i < tree.nv; i++)
            size = fmax(size, fabs(a[i]));
        for (int i = 0; i < tree.nv; i++)
            kt_worst_near(&worst, left[i] - s.tau[i], forces[i], 2e-13 * size, "tree %d coordinate %d", n, i);
        least = fmin(least, kt_tree_largest(forces, tree.nv));
    }
    kt_check_above("forces at least", least, 0.01);
}
