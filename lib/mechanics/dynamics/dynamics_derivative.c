/* The calls of dynamics.h for derivatives: memory, checks, the kernels of the model's instruction set, results. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics_derivative.h"
#include "base/copy.h"
#include "dynamics/rnea_gradient.h"
#include "kinetree/dynamics.h"

#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_derivative_work, KT_DERIVATIVE_FIELDS, const kt_counts *n)

size_t kt_dynamics_work_size(const kt_model *model) { return model ? place_arrays(NULL, NULL, &model->n) : 0; }

static kt_status take_work(const kt_model *model, void *memory, size_t size, kt_derivative_work *w, kt_error *error) {
    const size_t needed = kt_dynamics_work_size(model);
    const kt_status status = kt_arena_check("work", "kt_dynamics_work_size", memory, size, needed, error);
    if (status == KT_OK)
        (void)place_arrays(w, memory, &model->n);
    return status;
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

kt_status kt_derivatives_overflow(kt_error *error) {
    return kt_error_set(error, KT_ERROR_NOT_FINITE, "derivatives",
                        "they overflow: look for a position, velocity, force or torque that is huge");
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

kt_status kt_inverse_derivatives_fill(const kt_model *model, kt_data *data, void *memory, const kt_dynamic_state *at,
                                      const double *a, bool in_space, kt_derivative_work *w, kt_error *error) {
    const double *v = at->v ? at->v : model->zero;
    const kt_wrench *external = at->external;
    const kt_input input = {.q = at->q, .v = at->v, .x = a, .what = "acceleration", .external = external};
    const bool planar = model->sweep == KT_SWEEP_PLANAR && !in_space;
    a = a ? a : model->zero;
    (void)place_arrays(w, memory, &model->n);
    kt_status status = external || planar ? kt_input_check(model, &input, error) : KT_OK;
    if (status == KT_OK && !planar)
        status = kt_motion_update(model, data, at->q, at->v, input.x, error);
    if (status != KT_OK)
        return status;
    if (planar) {
        KT_BY_ISA(model->isa, , kt_planar_derivative_inverse,
                  (model, data, &(kt_dynamic_state){.q = at->q, .v = v, .external = external}, a, w));
        return KT_OK;
    }
    KT_BY_ISA(model->isa, , kt_derivative_terms, (model, data, v, a, external, KT_MOTION_WEIGHTLESS, false, w));
    KT_BY_ISA(model->isa, , kt_derivative_inverse, (model, external != NULL, w));
    return KT_OK;
}

kt_status kt_dynamics_inverse_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                          const double *q, const double *v, const double *a, const kt_wrench *external,
                                          double *dtau_dq, double *dtau_dv, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, q || !model->n.q, dtau_dq || !model->n.v, dtau_dv || !model->n.v))
        return KT_ERROR_ARGUMENT;
    model = kt_model_now(model, data);
    const size_t square = model->n.v * model->n.v;
    kt_derivative_work w;
    kt_status status = take_work(model, work, work_size, &w, error);
    if (status == KT_OK)
        status = kt_inverse_derivatives_fill(
            model, data, work, &(kt_dynamic_state){.q = q, .v = v, .external = external}, a, false, &w, error);
    if (status == KT_OK && !(kt_all_finite((double *)w.dq, square) && kt_all_finite((double *)w.dv, square)))
        status = kt_derivatives_overflow(error);
    if (status != KT_OK)
        return status;
    kt_copy(dtau_dq, w.dq, square * sizeof *dtau_dq);
    kt_copy(dtau_dv, w.dv, square * sizeof *dtau_dv);
    return KT_OK;
}

kt_status kt_forward_derivatives_fill(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                      const kt_dynamic_state *at, double *a, const kt_forward_matrices *by,
                                      kt_error *error) {
    model = kt_model_now(model, data);
    kt_derivative_work w;
    bool fine;
    kt_status status = take_work(model, work, work_size, &w, error);
    if (status == KT_OK)
        status = kt_dynamics_forward(model, data, at->q, at->v, at->tau, at->external, w.a, error);
    const bool kept = model->sweep == KT_SWEEP_SPATIAL; /* by forward dynamics, in data->motion */
    if (status == KT_OK && !kept)
        status = kt_motion_update(model, data, at->q, at->v, w.a, error);
    if (status != KT_OK)
        return status;
    KT_BY_ISA(model->isa, , kt_derivative_terms,
              (model, data, at->v ? at->v : model->zero, w.a, at->external,
               kept ? KT_MOTION_HEAVY : KT_MOTION_WEIGHTLESS, true, &w));
    KT_BY_ISA(model->isa, fine =, kt_derivative_forward, (model, by->tau != NULL, at->external != NULL, &w));
    if (!fine)
        return kt_derivatives_overflow(error);
    if (a)
        memcpy(a, w.a, model->n.v * sizeof *a);
    KT_BY_ISA(model->isa, , kt_derivative_hand_over, (model, &w, w.dq, by->q));
    KT_BY_ISA(model->isa, , kt_derivative_hand_over, (model, &w, w.dv, by->v));
    if (by->tau)
        KT_BY_ISA(model->isa, , kt_derivative_hand_over, (model, &w, w.dtau, by->tau));
    return KT_OK;
}

kt_status kt_dynamics_forward_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                          const double *q, const double *v, const double *tau,
                                          const kt_wrench *external, double *da_dq, double *da_dv, double *da_dtau,
                                          kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, q || !model->n.q, da_dq || !model->n.v, da_dv || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {.q = q, .v = v, .tau = tau, .external = external};
    return kt_forward_derivatives_fill(model, data, work, work_size, &at, NULL,
                                       &(kt_forward_matrices){da_dq, da_dv, da_dtau}, error);
}
