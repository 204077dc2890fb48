/* The kernels and the reduction for an instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/kernel.h"

const kt_reduction_kernels *kt_reduction_kernels_of(const kt_model *model) {
    if (model->sweep == KT_SWEEP_SPATIAL)
        return kt_reduction_kernels_in_space(model);
    KT_BY_ISA(model->isa, return &, kt_reduction_planar_kernels, );
}

const kt_reduction_kernels *kt_reduction_kernels_in_space(const kt_model *model) {
    KT_BY_ISA(model->isa, return &, kt_reduction_kernels, );
}

const kt_reduction_kind *kt_reduction_kind_of(const kt_reduction_method *method, kt_isa isa) {
    static const kt_reduction_method qr = KT_REDUCTION_METHOD(kt_reduction_qr);
    const kt_reduction_method *from = method ? method : &qr;
    return isa == KT_ISA_V4 ? from->v4 : isa == KT_ISA_V3 ? from->v3 : from->baseline;
}
