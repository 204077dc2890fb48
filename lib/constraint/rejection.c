/* Finds the caller's own loop that rejects a state: its callback is called once more there. */
#include "constraint/rejection.h"

#include "constraint/spatial_rows.h"
#include "loop/custom.h"

int KT_KERNEL(kt_loop_rejecting)(const kt_model *model, const kt_data *data, double t, const double *v, int *code) {
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        kt_loop_equation equations[KT_LOOP_ROW_MAX] = {{.residual = 0.0}};
        kt_loop_end end[2];
        if (loop->kind != KT_LOOP_KIND_CUSTOM || kt_loop_is_off(loop))
            continue;
        for (int k = 0; k < 2; k++)
            kt_end_follow(model, data, loop, k, true, v, &end[k]);
        const kt_loop_relative r = kt_loop_relative_of(end);
        const kt_custom_motion seen = kt_custom_motion_of(end, &r);
        const kt_loop_motion motion = kt_custom_motion_value(&seen);
        *code = loop->equations(loop->user, t, &motion, equations);
        if (*code != 0)
            return (int)i;
    }
    return -1;
}
