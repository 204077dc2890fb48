/* The Coriolis matrix from the derivatives of inverse dynamics. With B of dynamics_derivative.h and S'_k = V x S_k, the
 * velocity V being that of the node of degree of freedom k,
 *     C_ik = S_i . (I^C S'_k + B^C S_k)                                            (Echeandia & Wensing 2021)
 *     dtau_i / dv_k = S_i . (I^C (S'_k + psi'_k) + 2B^C S_k),   psi'_k = C x S_k
 * S'_k and psi'_k differ only among the rotations of a quaternion. The difference is w x S_k = sum_j S_j (w x e_k)_j,
 * with w the rate of the quaternion in body axes. Let W be the matrix with w x on the diagonal blocks of such
 * rotations, and zeros elsewhere. Then
 *     C = (dtau/dv + M W) / 2
 * Armature is no part of this M: it does not change with the position, and belongs to no body that turns.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "control/control.h"
#include "dynamics/dynamics_derivative.h"

/* Adds M W for the rotations from coordinate v on, whose rates are w. */
static void add_turned(const double *mass, size_t nv, size_t v, const double *w, double *c) {
    for (size_t k = 0; k < 3; k++) {
        const size_t i = (k + 1) % 3, j = (k + 2) % 3; /* w x e_k = w_j e_i - w_i e_j */
        for (size_t r = 0; r < nv; r++)
            c[(v + k) * nv + r] += w[j] * mass[(v + i) * nv + r] - w[i] * mass[(v + j) * nv + r];
    }
}

kt_status kt_coriolis_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size, const double *q,
                               const double *v, double *coriolis, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, coriolis || !model->n.v))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    const size_t nv = model->n.v;
    kt_derivative_work w;
    kt_status status =
        kt_arena_check("work", "kt_dynamics_work_size", work, work_size, kt_dynamics_work_size(model), error);
    if (status == KT_OK)
        status =
            kt_inverse_derivatives_fill(model, data, work, &(kt_dynamic_state){.q = q, .v = v}, NULL, false, &w, error);
    if (status != KT_OK)
        return status;
    double *c = (double *)w.dv;
    for (size_t i = 0; i < nv && model->has_armature; i++)
        ((double *)w.dtau)[i * (nv + 1)] -= model->armature[i];
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const size_t first = (size_t)link->v + (size_t)kt_link_lengths(link);
        if (kt_motion_facts_of(link->motion).quaternions)
            add_turned((const double *)w.dtau, nv, first, v + first, c);
    }
    for (size_t k = 0; k < nv * nv; k++)
        c[k] *= 0.5;
    if (!kt_all_finite(c, nv * nv))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "Coriolis matrix",
                            "it overflows: look for a position or velocity that is huge");
    kt_copy(coriolis, c, nv * nv * sizeof *c);
    return KT_OK;
}
