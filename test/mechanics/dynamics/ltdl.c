/* The factors M = L'DL against M itself, against forward dynamics, and against themselves at each instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tree.h"

#include "dynamics/dynamics.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 100, COLUMNS = 2 };

typedef struct factored {
    kt_tree tree;
    kt_tree_state s;
    double mass[KT_TREE_NV * KT_TREE_NV];
    kt_mass_factor *factor;
} factored;

/* Without gravity; of the mass matrix, the lower triangle alone, and NaN above. */
static void draw(factored *f, int n, kt_random *random, const kt_model_options *options) {
    kt_tree_plan plan = n % 3 == 0 ? kt_tree_plan_planar() : kt_tree_plan_default();
    kt_error e;
    plan.planar = n % 3 == 0 ? 1 + n % 2 : 0;
    plan.bodies = kt_random_int(random, 1, KT_TREE_BODIES);
    plan.is_shuffled = n % 3 == 1;
    plan.weightless = true;
    plan.massless = false;
    kt_tree_describe(&f->tree, &plan, random);
    f->factor = NULL;
    kt_tree_compile(&f->tree, options);
    kt_tree_state_draw(&f->tree, random, &f->s);
    const int nv = f->tree.nv;
    kt_tree_mass(&f->tree, &f->s, f->mass);
    for (int j = 0; j < nv; j++)
        for (int i = 0; i < j; i++)
            f->mass[j * nv + i] = (double)NAN;
    kt_need_fine("factor", kt_mass_factor_create(f->tree.model, &f->factor, &e), &e);
    kt_need_fine("computes", kt_mass_factor_compute(f->factor, f->mass, &e), &e);
}

static void release(factored *f) { kt_mass_factor_free(f->factor); }

static double entry(const factored *f, int i, int j) { return f->mass[(i < j ? i : j) * f->tree.nv + (i < j ? j : i)]; }

/* Bounds of this file: c measured over 20 seeds, whose worst is about half of the bound. */
KT_TEST(product_of_factors_is_that_of_the_mass_matrix) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("L'DLx against M x");
    static factored f;
    for (int n = 0; n < TREES; n++) {
        double x[COLUMNS * KT_TREE_NV];
        kt_error e;
        draw(&f, n, &random, NULL);
        const int nv = f.tree.nv;
        memcpy(x, f.s.v, sizeof f.s.v);
        memcpy(x + nv, f.s.a, (size_t)nv * sizeof *x);
        kt_need_fine("multiplies", kt_mass_factor_multiply(f.factor, COLUMNS, x, &e), &e);
        for (int c = 0; c < COLUMNS; c++)
            for (int i = 0; i < nv; i++) {
                double sum = 0.0, size = 0.0;
                for (int j = 0; j < nv; j++) {
                    const double y = c ? f.s.a[j] : f.s.v[j];
                    sum += entry(&f, i, j) * y;
                    size += sqrt(entry(&f, i, i) * entry(&f, j, j)) * fabs(y);
                }
                kt_worst_near(&error, x[c * nv + i], sum, 4.0 * EPS * size, "tree %d column %d entry %d", n, c, i);
            }
        release(&f);
    }
}

/* At rest without gravity a = M^-1 tau. The test compares M a, which does not depend on a condition number. */
KT_TEST(solution_by_factors_is_forward_dynamics_at_rest) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("M (M^-1 tau) against tau"), same = kt_worst_make("M a - tau of both");
    static factored f;
    for (int n = 0; n < TREES; n++) {
        double x[KT_TREE_NV], a[KT_TREE_NV];
        kt_error e;
        draw(&f, n, &random, NULL);
        const int nv = f.tree.nv;
        memcpy(x, f.s.tau, sizeof x);
        kt_need_fine("solves", kt_mass_factor_solve(f.factor, 1, x, &e), &e);
        kt_need_fine("forward", kt_dynamics_forward(f.tree.model, f.tree.data, f.s.q, NULL, f.s.tau, NULL, a, &e), &e);
        for (int i = 0; i < nv; i++) {
            double sum = 0.0, other = 0.0, size = fabs(f.s.tau[i]);
            for (int j = 0; j < nv; j++) {
                sum += entry(&f, i, j) * x[j];
                other += entry(&f, i, j) * a[j];
                size += sqrt(entry(&f, i, i) * entry(&f, j, j)) * fabs(x[j]);
            }
            kt_worst_near(&error, sum, f.s.tau[i], 2.0 * EPS * size, "tree %d entry %d", n, i);
            kt_worst_near(&same, sum, other, 6.0 * EPS * size, "tree %d entry %d", n, i);
        }
        release(&f);
    }
}

/* v' M^-1 v by the half that is solved; and M^-1 by both halves, in bits. */
KT_TEST(halves_of_the_solution_belong_together) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("u'D^-1u against v'M^-1v");
    int differ = 0;
    static factored f;
    for (int n = 0; n < TREES; n++) {
        double u[KT_TREE_NV], x[KT_TREE_NV], d[KT_TREE_NV];
        kt_error e;
        draw(&f, n, &random, NULL);
        const int nv = f.tree.nv;
        memcpy(u, f.s.v, sizeof u);
        memcpy(x, f.s.v, sizeof x);
        kt_mass_factor_diagonal(f.factor, d);
        kt_need_fine("solves", kt_mass_factor_solve(f.factor, 1, x, &e), &e);
        kt_need_fine("solves the upper half", kt_mass_factor_solve_upper(f.factor, 1, u, &e), &e);
        double half = 0.0, whole = 0.0, size = 0.0;
        for (int i = 0; i < nv; i++) {
            half += u[i] * u[i] / d[i];
            whole += f.s.v[i] * x[i];
            size += fabs(f.s.v[i] * x[i]);
            u[i] /= d[i];
        }
        kt_worst_near(&error, half, whole, 14.0 * EPS * size, "tree %d", n);
        kt_need_fine("solves the lower half", kt_mass_factor_solve_lower(f.factor, 1, u, &e), &e);
        differ += memcmp(u, x, (size_t)nv * sizeof *u) != 0;
        release(&f);
    }
    kt_check_equal_int("solutions that differ", differ, 0);
}

/* A solution, then a product. */
static void compute(factored *f, int n, kt_isa isa, double x[2][KT_TREE_NV]) {
    char name[32];
    kt_error e;
    snprintf(name, sizeof name, "tree %d", n);
    kt_random random = kt_random_named(name);
    draw(f, n, &random, &(kt_model_options){.isa = isa});
    memset(x, 0, 2 * sizeof *x);
    memcpy(x[0], f->s.v, (size_t)f->tree.nv * sizeof **x);
    memcpy(x[1], f->s.v, (size_t)f->tree.nv * sizeof **x);
    kt_need_fine("solves", kt_mass_factor_solve(f->factor, 1, x[0], &e), &e);
    kt_need_fine("multiplies", kt_mass_factor_multiply(f->factor, 1, x[1], &e), &e);
    release(f);
}

KT_TEST(factors_have_equal_bits_on_every_instruction_set) {
    static factored f;
    for (kt_isa isa = KT_ISA_V3; isa <= KT_ISA_V4; isa++) {
        if (kt_isa_resolve(isa) != isa) {
            kt_skip(isa == KT_ISA_V3 ? "factors at x86-64-v3" : "factors at x86-64-v4", KT_NO_ISA);
            continue;
        }
        int differ = 0;
        for (int n = 0; n < TREES / 5; n++) {
            double base[2][KT_TREE_NV], x[2][KT_TREE_NV];
            compute(&f, n, KT_ISA_BASE, base);
            compute(&f, n, isa, x);
            differ += memcmp(base, x, sizeof x) != 0;
        }
        kt_check_equal_int("trees whose results differ", differ, 0);
    }
}

KT_TEST(matrix_that_is_not_positive_definite_is_rejected_by_its_joint) {
    kt_random random = kt_random_of_test();
    static factored f;
    double x[KT_TREE_NV] = {0.0};
    kt_error e;
    draw(&f, 1, &random, NULL);
    const int nv = f.tree.nv, last = nv - 1;
    kt_check_equal_int("factors", kt_mass_factor_solve(f.factor, 1, x, &e), KT_OK);
    f.mass[last * nv + last] = -1.0;
    kt_check_equal_int("negative", kt_mass_factor_compute(f.factor, f.mass, &e), KT_ERROR_SINGULAR);
    char where[64];
    snprintf(where, sizeof where, "joint '%s'", kt_body_name(f.tree.model, kt_velocity_body(f.tree.model, last)));
    kt_check_text("where", e.where, where);
    kt_check_equal_int("no factors", kt_mass_factor_solve(f.factor, 1, x, &e), KT_ERROR_ARGUMENT);
    f.mass[last * nv + last] = (double)NAN;
    kt_check_equal_int("not a number", kt_mass_factor_compute(f.factor, f.mass, &e), KT_ERROR_SINGULAR);
    release(&f);
}

KT_TEST(column_that_is_not_finite_is_rejected_and_leaves_all_alone) {
    kt_random random = kt_random_of_test();
    int same = 0;
    for (int n = 0; n < TREES; n++) {
        static factored f;
        double x[2][KT_TREE_NV], bad[KT_TREE_NV], kept[KT_TREE_NV];
        kt_error e;
        draw(&f, n, &random, NULL);
        const size_t nv = (size_t)f.tree.nv;
        for (size_t i = 0; i < nv; i++)
            bad[i] = i % 2 ? (double)NAN : (double)INFINITY;
        memcpy(kept, bad, nv * sizeof *kept);
        memcpy(x[0], f.s.v, nv * sizeof **x);
        memcpy(x[1], f.s.v, nv * sizeof **x);
        kt_need_fine("solves", kt_mass_factor_solve(f.factor, 1, x[0], &e), &e);
        if (!kt_check_equal_int("NaN", kt_mass_factor_solve(f.factor, 1, bad, &e),
                                nv > 0 ? KT_ERROR_NOT_FINITE : KT_OK) ||
            !kt_check_equal_int("-1 columns", kt_mass_factor_solve(f.factor, -1, bad, &e), KT_ERROR_ARGUMENT) ||
            !kt_fine("solves again", kt_mass_factor_solve(f.factor, 1, x[1], &e), &e))
            return;
        same += memcmp(x[0], x[1], nv * sizeof **x) == 0 && memcmp(bad, kept, nv * sizeof *bad) == 0;
        release(&f);
    }
    kt_check_equal_int("trees whose solutions have equal bits", same, TREES);
}

/* A chain of n revolute joints has n (n - 1) / 2 entries; n arms on the ground have none. */
KT_TEST(factors_take_room_for_what_is_not_zero_alone) {
    enum { N = 512 };
    static kt_body body[N];
    static char name[N][8];
    size_t size[2] = {0, 0};
    for (int arms = 0; arms < 2; arms++) {
        kt_description d = kt_description_default();
        for (int i = 0; i < N; i++) {
            snprintf(name[i], sizeof name[i], "b%d", i);
            body[i] = kt_body_of(name[i], i && !arms ? name[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
            body[i].com = kt_vec3_make(1.0, 0.0, 0.0);
        }
        kt_describe(&d, body, N, NULL, 0, NULL, 0);
        kt_model *model = kt_test_model(&d, NULL);
        size[arms] = kt_mass_factor_size(model);
    }
    kt_check_below("bytes of a chain's over those of its entries", (double)size[0], 1.1 * 8.0 * N * (N - 1) / 2);
    kt_check_below("bytes of the arms'", (double)size[1], 120.0 * N);
}
