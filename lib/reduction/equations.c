/* The equations of all loops as matrices, for those who want to see them. */
#include "kinetree/reduction.h"
#include "reduction/kernel.h"

#include <string.h>

/* First row of each loop, in the order of the description. */
static size_t first_row(const kt_model *model, int32_t loop) {
    size_t row = 0;
    for (int32_t i = 0; i < loop; i++)
        row += (size_t)model->loop[i].row_count;
    return row;
}

/* The loop and row that a group's row is: its place in the whole. */
static size_t place_of(const kt_model *model, const kt_group *group, int32_t row) {
    for (int i = 0; i < group->loop_count; i++) {
        const int32_t index = model->group_loop[group->loop + i];
        const kt_loop_record *loop = &model->loop[index];
        if (row >= loop->row && row < loop->row + loop->row_count)
            return first_row(model, index) + (size_t)(row - loop->row);
    }
    return 0;
}

kt_status kt_loop_equations(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            double *jacobian, double *residual, double *rate, double *drift, kt_error *error) {
    const size_t rows = model->n.row;
    for (size_t i = 0; i < model->n.q; i++)
        if (!isfinite(q[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a position is not finite");
    kt_reduction_kernels_of(model)->fill(model, data, t, q, v ? v : model->zero);
    if (jacobian)
        memset(jacobian, 0, rows * model->n.v * sizeof *jacobian);
    double *outputs[3] = {residual, rate, drift};
    for (int k = 0; k < 3; k++)
        if (outputs[k])
            memset(outputs[k], 0, rows * sizeof(double));
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_place(model, data, g);
        for (int r = 0; r < w.k; r++) {
            const size_t row = place_of(model, group, model->kept[group->kept + r]);
            for (int i = 0; i < w.m && jacobian; i++)
                jacobian[(size_t)model->group_v[group->v + i] * rows + row] = w.a[(size_t)r * (size_t)w.m + (size_t)i];
            if (residual)
                residual[row] = w.residual[r];
            if (rate)
                rate[row] = 0.0 - w.rate[r]; /* no -0 */
            if (drift)
                drift[row] = w.right[r] + 0.0;
        }
    }
    return KT_OK;
}
