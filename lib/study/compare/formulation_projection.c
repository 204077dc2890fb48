/* Force projection [MSD 9.7 to 9.17].
 *
 * The rates of positions u are distinguished from the integrated velocities w. The vector w is the integral of the
 * accelerations, and u' is the part of w that the loop equations allow,
 *
 *     u' + A' mu = w,  A u' = b':     u' = w - A' (A A')^+ (A w - b')                             [MSD 9.11a, W = I]
 *     M w' + A' lambda = f,  A w' = b'':   w' by Gauss' principle, f and b'' at u'                [MSD 9.11b]
 *
 * The multiplier mu is zero for exact integration. With A' P = Q R of rank r,
 *
 *     Q1' u' = R1^-T (P' b')_1,   Q2' u' = Q2' w.
 *
 * An error e = A w - b' of the velocities obeys
 *
 *     e' = A w' + (dA/dt) w - b'' - (dA/dt) u' = (dA/dt) (w - u') = (dA/dt) A^+ e
 *
 * Thus w - u' grows and falls with the size of A, and nothing damps this difference; but positions do not follow it.
 * The drift of positions comes from the local errors of the steps. After each step, the least displacement that closes
 * the loops removes this drift [MSD 9.16, 9.17], as in kt_state_project, which does not change w.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/formulation.h"

#include <string.h>

void kt_formulation_project_velocity(kt_constraint_formulation *formulation, double t, const double *v) {
    const size_t n = (size_t)formulation->n, k = (size_t)formulation->k;
    for (size_t r = 0; r < k; r++)
        for (size_t i = 0; i < n; i++)
            formulation->factor[r * n + i] = formulation->jacobian[i * k + r];
    memcpy(formulation->velocity, v, n * sizeof *v);
    kt_formulation_constrain(formulation, kt_formulation_factor(formulation, t, false), formulation->rate,
                             formulation->velocity);
}

int kt_formulation_project_positions(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error,
                                     void *user) {
    kt_constraint_formulation *formulation = user;
    memcpy(formulation->state_v, v, (size_t)formulation->n * sizeof *v);
    return kt_state_project(at->model, at->data, at->t, q, formulation->state_v, changed, error) == KT_OK ? 0 : 1;
}
