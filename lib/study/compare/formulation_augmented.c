/* The augmented Lagrangian [MSD 9.3 to 9.6].
 *
 * Constraint forces are penalties on the error e, plus multipliers l that take up the remainder. The error is
 *
 *     e = A a - c,   c = b'' - 2 alpha (A v - b') - beta^2 phi
 *
 * as in Baumgarte's stabilisation. The iteration is
 *
 *     M a = f - A' (s (A a - c) + l):    (M + s A' A) a_i+1 = f + A' (s c - l_i),   l_0 = 0
 *     l_i+1 = l_i + s (A a_i+1 - c).
 *
 * Inserting the second line into the first gives M a_i+1 = f - A' l_i+1. The equations of motion hold, and only the
 * constraint equations have an error. Subtracting two iterates gives, with S = A M^-1 A',
 *
 *     M (a_i+1 - a_i) = -s A' e_i+1,   e_i+1 - e_i = -s S e_i+1,   e_i+1 = (I + s S)^-1 e_i.
 *
 * Redundant equations do no harm: S is singular along them, but e has no component along these directions as long as
 * the equations are consistent. The method makes no decision about a rank, which is its advantage. At a singular
 * position an eigenvalue of S goes to zero, and so does the rate at which e vanishes. That equation is violated for a
 * while.
 *
 * Rounding of M + s A' A and of s A' c enters along the degrees of freedom, where M alone acts, multiplied by s S. A
 * large penalty therefore needs few iterations and loses the corresponding digits.
 *
 * Source: Bayo, Garcia de Jalon, Serna, A modified Lagrangian formulation for the dynamic analysis of constrained
 * mechanical systems, Computer Methods in Applied Mechanics and Engineering 71, 1988.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/formulation.h"
#include "linear/lapack.h"

#include <math.h>
#include <string.h>

/* Factors M + s A' A (lower triangle). */
static int factor_augmented(kt_constraint_formulation *formulation) {
    const int n = formulation->n, k = formulation->k;
    for (int j = 0; j < n; j++) {
        const double *right = formulation->jacobian + (size_t)j * (size_t)k;
        for (int i = j; i < n; i++) {
            const double *left = formulation->jacobian + (size_t)i * (size_t)k;
            double sum = 0.0;
            for (int r = 0; r < k; r++)
                sum += left[r] * right[r];
            const size_t at = (size_t)j * (size_t)n + (size_t)i;
            formulation->factor[at] = formulation->mass[at] + formulation->penalty * sum;
        }
    }
    return n > 0 ? kt_lapack_potrf(n, formulation->factor) : 0;
}

/* Solves (M + p A' A) a = f + A' (p b - lambda) with the Cholesky factor of the matrix, for the penalty p. */
static void solve_augmented(kt_constraint_formulation *formulation, double *a) {
    const int n = formulation->n, k = formulation->k;
    for (int i = 0; i < n; i++) {
        a[i] = formulation->force[i];
        for (int r = 0; r < k; r++)
            a[i] += formulation->jacobian[(size_t)i * (size_t)k + (size_t)r] *
                    (formulation->penalty * formulation->target[r] - formulation->multiplier[r]);
    }
    if (n == 0)
        return;
    (void)kt_lapack_trtrs('N', n, 1, formulation->factor, a);
    (void)kt_lapack_trtrs('T', n, 1, formulation->factor, a);
}

/* l += s e; returns the largest |e| over the largest sum of the absolute terms of e. */
static double add_multiplier_errors(kt_constraint_formulation *formulation, const double *a) {
    const int n = formulation->n, k = formulation->k;
    double worst = 0.0, size = 0.0;
    for (int r = 0; r < k; r++) {
        double e = -formulation->target[r], terms = fabs(formulation->target[r]);
        for (int i = 0; i < n; i++) {
            const double term = formulation->jacobian[(size_t)i * (size_t)k + (size_t)r] * a[i];
            e += term;
            terms += fabs(term);
        }
        formulation->slip[r] = formulation->penalty * e;
        formulation->multiplier[r] += formulation->slip[r];
        worst = fmax(worst, fabs(e));
        size = fmax(size, terms);
    }
    return worst > 0.0 ? worst / size : 0.0;
}

/* s A' e relative to f and A' l: the error of the iterate's forces. Equations that contradict each other keep an e
 * without a force. */
static double multiplier_correction(const kt_constraint_formulation *formulation) {
    const size_t n = (size_t)formulation->n, k = (size_t)formulation->k;
    double most = 0.0, size = 0.0;
    for (size_t i = 0; i < n; i++) {
        double change = 0.0, reaction = 0.0;
        for (size_t r = 0; r < k; r++) {
            change += formulation->jacobian[i * k + r] * formulation->slip[r];
            reaction += formulation->jacobian[i * k + r] * formulation->multiplier[r];
        }
        most = fmax(most, fabs(change));
        size = fmax(size, fmax(fabs(formulation->force[i]), fabs(reaction)));
    }
    return most > 0.0 ? most / size : 0.0;
}

kt_status kt_formulation_augmented(kt_constraint_formulation *formulation, double t, double *a, kt_error *error) {
    if (factor_augmented(formulation) != 0)
        return kt_formulation_reject(
            t, KT_ERROR_SINGULAR,
            "M + A' s A is singular or not finite: give the bodies that move inertia, or less penalty", error);
    memset(formulation->multiplier, 0, (size_t)formulation->k * sizeof(double));
    int done = 0;
    double left, off = HUGE_VAL, before;
    do { /* until the error no longer decreases */
        solve_augmented(formulation, a);
        left = add_multiplier_errors(formulation, a);
        before = off;
        off = multiplier_correction(formulation);
        done++;
    } while (done < formulation->options.iterations && off > formulation->options.tolerance && off < 0.9 * before);
    if (done > formulation->found.iterations)
        formulation->found.iterations = done;
    if (left > formulation->found.residual)
        formulation->found.residual = left;
    return KT_OK;
}
