/* The terms of M^-1 for a model's instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba_inverse.h"

KT_ARENA_ARRAYS(place_arrays, kt_inverse_terms, KT_INVERSE_FIELDS, const kt_counts *n)

size_t kt_inverse_layout(kt_inverse_terms *terms, void *memory, const kt_counts *n) {
    return place_arrays(terms, memory, n);
}

kt_status kt_inverse_compute(const kt_model *model, kt_data *data, const double *q, kt_inverse_terms *terms,
                             kt_error *error) {
    const kt_input input = {.q = q};
    model = kt_model_now(model, data);
    const kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    size_t failed;
    KT_BY_ISA(model->isa, failed =, kt_inverse_compute, (model, data, q, model->zero, terms));
    return failed ? kt_link_reject_inertia(model, failed, error) : KT_OK;
}

void kt_inverse_apply(const kt_model *model, const kt_inverse_terms *terms, double *x) {
    KT_BY_ISA(model->isa, , kt_inverse_apply, (model, terms, x));
}
