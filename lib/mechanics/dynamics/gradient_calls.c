/* The gradient of a sum of joint forces, and M^-1 x, by the kernels of a model's instruction set and sweep. Models with
 * spatial and planar links are computed in space. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba_inverse.h"
#include "dynamics/rnea_gradient.h"

kt_status kt_gradient_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a,
                               unsigned choice, const double *w, const kt_gradient *out, kt_error *error) {
    const kt_gradient_state in = {at->v, a, at->external, choice & KT_GRADIENT_WEIGHTLESS};
    model = kt_model_now(model, data);
    if (model->sweep == KT_SWEEP_PLANAR && choice & KT_GRADIENT_POSED) {
        KT_BY_ISA(model->isa, , kt_planar_gradient, (model, data, &in, w, out));
        return KT_OK;
    }
    const bool posed = choice & KT_GRADIENT_POSED && model->sweep == KT_SWEEP_SPATIAL && model->n.group == 0;
    const kt_status status = kt_links_update(model, data, at->q, at->v, a, posed, NULL, error);
    if (status == KT_OK)
        KT_BY_ISA(model->isa, , kt_inverse_gradient, (model, data, &in, w, out));
    return status;
}

kt_status kt_tree_respond(const kt_model *model, kt_data *data, const double *q, void *memory, double *x,
                          kt_error *error) {
    kt_inverse_terms terms;
    model = kt_model_now(model, data);
    if (model->sweep == KT_SWEEP_PLANAR) {
        size_t failed;
        KT_BY_ISA(model->isa, failed =, kt_planar_respond, (model, data, q, model->zero, x, x));
        if (!failed)
            return KT_OK;
    }
    (void)kt_inverse_layout(&terms, memory, &model->n);
    const kt_status status = kt_inverse_compute(model, data, q, &terms, error);
    if (status == KT_OK)
        kt_inverse_apply(model, &terms, x);
    return status;
}
