/* The order of a group's equations and that of the loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/group.h"

void kt_rows_scatter(const kt_model *model, const kt_group *group, int count, const double *slots, double *equations) {
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const int32_t *slot = model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            if (slot[r] >= 0 && slot[r] < count)
                equations[loop->equation + r] = slots[slot[r]];
    }
}

void kt_rows_gather(const kt_model *model, const kt_group *group, int count, const double *equations, double *slots) {
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const int32_t *slot = model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            if (slot[r] >= 0 && slot[r] < count)
                slots[slot[r]] = equations[loop->equation + r];
    }
}
