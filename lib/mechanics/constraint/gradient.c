/* The gradient of sums of the loops' equations at a state. Planar loops use their own forms, and others dual numbers.
 * If one loop has equations without a form in the plane, all loops use dual numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/formula_row.h"

#include <string.h>

bool kt_loop_gradient_reads_space(const kt_model *model) {
    bool reads = model->sweep != KT_SWEEP_PLANAR;
    for (size_t l = 0; l < model->n.planar_loop; l++)
        for (int i = 0; i < model->planar_loop[l].count; i++)
            reads |= model->planar_loop[l].row[i].kind == KT_PLANAR_ROW_SPATIAL;
    return reads;
}

void kt_loop_gradient(const kt_dual_motion *at, const kt_loop_sum *sum, double *by_q, double *by_v) {
    const kt_model *model = at->model;
    const bool in_space = kt_loop_gradient_reads_space(model);
    for (size_t i = 0; i < model->n.loop; i++) {
        if (kt_has_formula_row(&model->loop[i]))
            kt_formula_row_gradient(at, &model->loop[i], sum, by_q, by_v);
        if (model->loop[i].term_count) /* a relation: A is constant else, and b'' a function of time; or off */
            continue;
        if (!in_space)
            KT_BY_ISA(model->isa, , kt_planar_loop_gradient, (model, at->data, (int32_t)i, sum, by_q, by_v));
        else
            kt_dual_loop_gradient(at, (int32_t)i, sum, by_q, by_v);
    }
}

void kt_loop_matrices(const kt_dual_motion *at, const double *lambda, bool moving, double *d_q, double *by_q,
                      double *by_v) {
    const kt_model *model = at->model;
    const bool in_space = kt_loop_gradient_reads_space(model);
    const size_t bytes = model->n.row * model->n.v * sizeof *by_q;
    memset(by_q, 0, bytes);
    if (moving)
        memset(by_v, 0, bytes);
    for (size_t i = 0; i < model->n.loop; i++) {
        if (kt_has_formula_row(&model->loop[i]))
            kt_formula_row_matrices(at, &model->loop[i], lambda, moving, d_q, by_q, by_v);
        if (model->loop[i].term_count)
            continue;
        if (!in_space)
            KT_BY_ISA(model->isa, , kt_planar_loop_matrices, (at, (int32_t)i, lambda, moving, d_q, by_q, by_v));
        else
            kt_dual_loop_matrices(at, (int32_t)i, lambda, moving, d_q, by_q, by_v);
    }
}
