/* C of a step: its derivatives by the numbers of a parameter of the model (kinetree/model.h). The columns of C are
 * those of B with a_p dp in the place of a_tau dtau (stage_parameter.c), and another projection (projection.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "evaluate/evaluate.h"
#include "sensitivity/sensitivity.h"

size_t kt_step_parameter_work_size(const kt_model *model, const kt_method *method) {
    if (!model || !method)
        return 0;
    const size_t size = kt_arena_round(kt_step_work_size(model, method));
    return size ? size + kt_parameter_work_size(model) : 0;
}

kt_status kt_step_parameter_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                        const kt_step *step, const kt_parameter *parameter, const double *q,
                                        const double *v, double *C, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, step, parameter, q || !model->n.q, C || !model->n.v))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    const size_t size = kt_step_parameter_work_size(model, step->method);
    kt_step_work w;
    kt_parameter_work own;
    kt_status status =
        size ? kt_arena_check("work", "kt_step_parameter_work_size", work, work_size, size, error) : KT_OK;
    if (status == KT_OK)
        status = kt_step_begin(&w, model, data, work, work_size, step, error);
    if (status == KT_OK)
        status = kt_parameter_begin(
            &own, model, data, (char *)work + kt_arena_round(kt_step_work_size(model, step->method)), parameter, error);
    if (status != KT_OK)
        return status;
    w.parameter = &own;
    w.states = 0;
    status = kt_step_tangents(&w, q, v, own.count, error);
    if (status == KT_OK)
        kt_step_copy(&w, 0, own.count, C);
    return status;
}
