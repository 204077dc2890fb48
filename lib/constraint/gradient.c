/* The gradient of sums of the loops' equations at a state: planar loops by their own forms, others by dual numbers; all
 * by dual numbers if one of them has equations without a form in the plane. */
#include "constraint/gradient.h"

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
        if (model->loop[i].term_count) /* a relation: A is constant, and b'' a function of time; or off */
            continue;
        if (!in_space)
            KT_BY_ISA(model->isa, , kt_planar_loop_gradient, (model, at->data, (int32_t)i, sum, by_q, by_v));
        else
            kt_dual_loop_gradient(at, (int32_t)i, sum, by_q, by_v);
    }
}

/* The coordinates on one path of a planar loop. */
static int32_t coordinate_of(const kt_model *model, const kt_loop_record *loop, int k, int i) {
    return model->link[model->path[loop->path[k] + i]].v;
}

/* Adds `sign` times the gradient of a sum to the entries of a matrix, `stride` apart for successive coordinates. */
static void add_gradient(const kt_model *model, const kt_data *data, int32_t index, const kt_loop_sum *sum, double sign,
                         double *work, double *to, size_t stride) {
    const kt_loop_record *loop = &model->loop[index];
    memset(work, 0, 2 * model->n.v * sizeof *work);
    KT_BY_ISA(model->isa, , kt_planar_loop_gradient, (model, data, index, sum, work, work + model->n.v));
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < loop->length[k]; i++) {
            const size_t j = (size_t)coordinate_of(model, loop, k, i);
            to[j * stride] += sign * work[j];
        }
}

/* Rows of d(J z)/dq, and columns of the symmetric d(J' lambda)/dq, one by one. */
static void write_planar_matrices(const kt_dual_motion *at, int32_t index, const double *lambda, const double *z,
                                  double *unit, double *work, double *d_q, double *c_q) {
    const kt_model *model = at->model;
    const kt_data *data = at->data;
    const kt_loop_record *loop = &model->loop[index];
    const kt_planar_loop *flat = &model->planar_loop[index];
    double *row = unit + model->n.v;
    for (int i = 0; i < flat->count; i++) {
        const size_t r = (size_t)loop->equation + (size_t)flat->row[i].row;
        const kt_loop_sum sum = {.lambda = {row}, .p = {z}};
        row[r] = 1.0;
        add_gradient(model, data, index, &sum, 1.0, work, c_q + r, model->n.row);
        row[r] = 0.0;
    }
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < loop->length[k]; i++) {
            const size_t j = (size_t)coordinate_of(model, loop, k, i);
            const kt_loop_sum sum = {.lambda = {lambda}, .p = {unit}};
            unit[j] = 1.0;
            add_gradient(model, data, index, &sum, -1.0, work, d_q + j, model->n.v);
            unit[j] = 0.0;
        }
}

void kt_loop_matrices(const kt_dual_motion *at, const double *lambda, const double *z, double *unit, double *work,
                      double *d_q, double *c_q) {
    const kt_model *model = at->model;
    const bool in_space = kt_loop_gradient_reads_space(model);
    memset(c_q, 0, model->n.row * model->n.v * sizeof *c_q);
    for (size_t i = 0; i < model->n.loop; i++) {
        if (model->loop[i].term_count)
            continue;
        if (!in_space)
            write_planar_matrices(at, (int32_t)i, lambda, z, unit, work, d_q, c_q);
        else
            kt_dual_loop_matrices(at, (int32_t)i, lambda, z, d_q, c_q);
    }
}
