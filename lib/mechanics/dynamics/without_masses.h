/* The kernels that depend on no masses, for models whose other kernels belong to another instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_WITHOUT_MASSES_H
#define KT_DYNAMICS_WITHOUT_MASSES_H

#include "dynamics/dynamics.h"

static inline void mirror(size_t n, double *matrix) { kt_mass_mirror_baseline(n, matrix); }
static inline size_t kinematics(const kt_model *model, kt_data *data, const double *q, const double *v,
                                const double *a) {
    return kt_kernels_of(model->isa, model->sweep, false)->kinematics(model, data, q, v, a);
}
static inline size_t follow(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a) {
    return kt_kernels_of(model->isa, model->sweep, false)->follow(model, data, q, v, a);
}
static inline void force_links(const kt_model *model, kt_data *data, const double *q, const double *v) {
    kt_kernels_of(model->isa, model->sweep, false)->force_links(model, data, q, v);
}

#endif
