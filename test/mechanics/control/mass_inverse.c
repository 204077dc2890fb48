/* M^-1 x and operational-space inertia of trees, against elimination in long double, on every instruction set. Also
 * rejected inputs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "along.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 100, TASK = 6 };

/* M^-1 of the oracle. */
static bool invert(const kt_tree *tree, const double *q, long double *inverse) {
    static long double mass[KT_TREE_NV * KT_TREE_NV];
    const int nv = tree->nv;
    kt_oracle_mass(tree, q, mass);
    for (int i = 0; i < nv * nv; i++)
        inverse[i] = i % (nv + 1) == 0 ? 1.0L : 0.0L;
    return kt_oracle_solve(nv, mass, nv, inverse);
}

/* An object that has its terms. */
static kt_mass_inverse *make(const kt_tree *tree, const double *q, int rows) {
    kt_error e;
    kt_mass_inverse *inverse = kt_test_mass_inverse(tree->model, rows);
    (void)kt_fine("terms", kt_mass_inverse_compute(inverse, tree->data, 0.0, q, &e), &e);
    return inverse;
}

/* Bounds of this file were measured over 20 seeds, and the worst seed reaches about half of the bound. The error of
 * entry i of M^-1 x is compared with s, the effect of relative errors of M:
 *     s = sum |M^-1| |M| |M^-1 x| */
static void compare_column(kt_worst *error, const kt_tree *tree, const long double *inverse, const double *mass,
                           const double *x, const double *y, int n) {
    const int nv = tree->nv;
    double exact[KT_TREE_NV], load[KT_TREE_NV];
    for (int i = 0; i < nv; i++) {
        long double sum = 0.0L;
        for (int k = 0; k < nv; k++)
            sum += inverse[i * nv + k] * (long double)x[k];
        exact[i] = (double)sum;
    }
    for (int i = 0; i < nv; i++) {
        load[i] = fabs(x[i]);
        for (int k = 0; k < nv; k++)
            load[i] += fabs(mass[k * nv + i] * exact[k]);
    }
    for (int i = 0; i < nv; i++) {
        double size = 0.0;
        for (int k = 0; k < nv; k++)
            size += fabs((double)inverse[i * nv + k]) * load[k];
        kt_worst_near(error, y[i], exact[i], 64.0 * EPS * size, "tree %d entry %d", n, i);
    }
}

KT_TEST(inverse_of_mass_matrix_times_columns_agrees_with_elimination) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("M^-1 x");
    for (int n = 0; n < TREES; n++) {
        static long double inverse[KT_TREE_NV * KT_TREE_NV];
        static double mass[ALONG_MOST];
        double x[2 * KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        kt_error e;
        along_grow(&tree, n, &random, &s);
        kt_tree_mass(&tree, &s, mass);
        if (!invert(&tree, s.q, inverse))
            return;
        kt_mass_inverse *w = make(&tree, s.q, 0);
        memcpy(x, s.tau, sizeof s.tau);
        memcpy(x + tree.nv, s.a, sizeof s.a);
        kt_need_fine("applies", kt_mass_inverse_apply(w, 2, x, &e), &e);
        compare_column(&error, &tree, inverse, mass, s.tau, x, n);
        compare_column(&error, &tree, inverse, mass, s.a, x + tree.nv, n);
    }
}

/* J M^-1 J' of a point's frame, in long double. */
static void project(const kt_tree *tree, const long double *inverse, const double *jacobian, long double *out) {
    const int nv = tree->nv;
    for (int r = 0; r < TASK; r++)
        for (int c = 0; c < TASK; c++) {
            long double sum = 0.0L;
            for (int i = 0; i < nv; i++)
                for (int k = 0; k < nv; k++)
                    sum +=
                        (long double)jacobian[TASK * i + r] * inverse[i * nv + k] * (long double)jacobian[TASK * k + c];
            out[TASK * r + c] = sum;
        }
}

KT_TEST(operational_inertia_is_the_inverse_of_what_a_task_feels) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("Lambda (J M^-1 J') against 1"), other = kt_worst_make("J times its inverse");
    int regular = 0;
    for (int n = 0; n < TREES; n++) {
        static long double inverse[KT_TREE_NV * KT_TREE_NV];
        static double jacobian[TASK * KT_TREE_NV], consistent[TASK * KT_TREE_NV];
        long double task[TASK * TASK];
        double inertia[TASK * TASK];
        kt_tree tree;
        kt_tree_state s;
        kt_error e;
        along_grow(&tree, n, &random, &s);
        kt_tree_kinematics(&tree, &s);
        if (!invert(&tree, s.q, inverse))
            return;
        kt_frame_jacobian(tree.model, tree.data, tree.count - 1, kt_vec3_make(0.1, 0.2, -0.3), KT_TWIST_ALIGNED,
                          jacobian);
        kt_mass_inverse *w = make(&tree, s.q, TASK);
        const kt_status status = kt_operational_inertia(w, TASK, jacobian, inertia, consistent, NULL, &e);
        if (status == KT_OK) {
            regular++;
            project(&tree, inverse, jacobian, task);
            for (int r = 0; r < TASK; r++)
                for (int c = 0; c < TASK; c++) {
                    double sum = 0.0, size = 0.0, one = 0.0, whole = 0.0;
                    for (int k = 0; k < TASK; k++) {
                        sum += inertia[TASK * k + r] * (double)task[TASK * k + c];
                        for (int l = 0; l < TASK; l++)
                            size += fabs(inertia[TASK * k + r] * (double)task[TASK * k + l] * inertia[TASK * c + l] *
                                         (double)task[TASK * c + c]);
                    }
                    for (int i = 0; i < tree.nv; i++) {
                        one += jacobian[TASK * i + r] * consistent[c * tree.nv + i];
                        whole += fabs(jacobian[TASK * i + r] * consistent[c * tree.nv + i]);
                    }
                    kt_worst_near(&error, sum, r == c ? 1.0 : 0.0, 100.0 * EPS * (size + 1.0), "tree %d entry %d %d", n,
                                  r, c);
                    kt_worst_near(&other, one, r == c ? 1.0 : 0.0, 100.0 * EPS * (size + whole), "tree %d entry %d %d",
                                  n, r, c);
                }
        } else {
            kt_check_equal_int("singular", status, KT_ERROR_SINGULAR);
        }
    }
    kt_check_above("regular positions", regular, 30);
}

KT_TEST(bits_are_equal_on_every_instruction_set) {
    static const kt_isa levels[] = {KT_ISA_V3, KT_ISA_V4};
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 20; n++) {
        double x[KT_TREE_NV], y[KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        kt_error e;
        kt_model_options options = kt_model_options_default();
        along_grow(&tree, n, &random, &s);
        for (int l = -1; l < 2; l++) {
            kt_tree_free(&tree);
            options.isa = l < 0 ? KT_ISA_BASE : levels[l];
            if (kt_model_compile(&tree.description, &options, &tree.model, &e) == KT_ERROR_UNSUPPORTED) {
                kt_skip("an instruction set", KT_NO_ISA);
                continue;
            }
            const bool fine = kt_fine("data", kt_data_create(tree.model, &tree.data, &e), &e);
            kt_tree_own(&tree);
            if (!fine)
                return;
            kt_mass_inverse *w = make(&tree, s.q, 0);
            memcpy(l < 0 ? x : y, s.tau, (size_t)tree.nv * sizeof *x);
            (void)kt_fine("applies", kt_mass_inverse_apply(w, 1, l < 0 ? x : y, &e), &e);
            if (l >= 0 && tree.nv > 0)
                kt_check_equal_bits("M^-1 x", y, x, (size_t)tree.nv);
        }
    }
}

/* Two prismatic joints in line, the second of which carries no mass; a planar arm's frame; no terms; too many rows. */
KT_TEST(what_has_no_inverse_is_rejected_with_the_joint_or_row) {
    kt_body bodies[2];
    kt_error e;
    double q[2] = {0.4, 0.0}, jacobian[TASK * 2], inertia[TASK * TASK] = {7.0}, x[2] = {1.0, 2.0};
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_of(i ? "elbow" : "shoulder", i ? "shoulder" : NULL, KT_JOINT_REVOLUTE, 1.0);
        bodies[i].joint.at = kt_vec3_make(i ? 1.0 : 0.0, 0.0, 0.0);
        bodies[i].com = kt_vec3_make(0.5, 0.0, 0.0);
    }
    kt_description d = kt_description_of(bodies, 2, NULL, 0, NULL, 0);
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    kt_mass_inverse *w = kt_test_mass_inverse(model, 2);
    kt_mass_inverse *other = NULL;
    kt_check_equal_int("too little memory",
                       kt_mass_inverse_init(model, 2, &e, kt_mass_inverse_size(model, 2) - 1, &other, &e),
                       KT_ERROR_MEMORY);
    kt_check_true("no object", other == NULL);
    kt_check_equal_int("no terms", kt_mass_inverse_apply(w, 1, x, &e), KT_ERROR_ARGUMENT);
    kt_check_equal_bits("x", x, (const double[]){1.0, 2.0}, 2);
    q[1] = (double)NAN;
    kt_check_equal_int("NaN", kt_mass_inverse_compute(w, data, 0.0, q, &e), KT_ERROR_NOT_FINITE);
    kt_check_contains("where", e.where, "elbow");
    q[1] = 0.0; /* stretched: y is the only way */
    kt_need_fine("terms", kt_mass_inverse_compute(w, data, 0.0, q, &e), &e);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, q, NULL, NULL, &e), &e);
    kt_frame_jacobian(model, data, 2, kt_vec3_make(1.0, 0.0, 0.0), KT_TWIST_BODY, jacobian);
    kt_check_equal_int("six rows", kt_operational_inertia(w, TASK, jacobian, inertia, NULL, NULL, &e),
                       KT_ERROR_ARGUMENT);
    const double xy[4] = {jacobian[4], jacobian[3], jacobian[10], jacobian[9]}; /* y, then x */
    kt_check_equal_int("stretched", kt_operational_inertia(w, 2, xy, inertia, NULL, NULL, &e), KT_ERROR_SINGULAR);
    kt_check_contains("row", e.message, "row 1 ");
    kt_check_equal_bits("untouched", inertia, (const double[]){7.0}, 1);
    /* 1 kg at half of each metre: the force along y that moves the tip of the stretched arm. M = [2.5 0.75; 0.75 0.25],
     * J = [2 1]: J M^-1 J' = 8. */
    (void)kt_fine("y", kt_operational_inertia(w, 1, (const double[]){xy[0], xy[2]}, inertia, NULL, NULL, &e), &e);
    kt_check_near("of y alone", inertia[0], 0.125, 4.0 * EPS);
}
