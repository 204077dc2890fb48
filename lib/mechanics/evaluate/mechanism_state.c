/* States of a whole mechanism. Quaternions have unit norm, and loops are closed. A projection closes loops after a step
 * (project.c), and an assembly at the start (assemble.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/finite.h"
#include "assembly/project.h"
#include "assembly/rejected_loops.h"
#include "base/copy.h"
#include "constraint/rejecting_loop.h"
#include "evaluate/evaluate.h"

#include "dynamics/dynamics.h"
#include "joint/joint.h"
#include "joint/turn.h"
#include "kinetree/joint.h"

#include <string.h>

bool kt_unit_quaternions(const kt_model *model, double *q) {
    return kt_turns_make_units(model, q, true) || kt_position_normalize(model, q);
}

/* Measures the error of the velocities in loops before the projection. If the steps resolve the motion, this is the
 * error of a step. After a step across a dead point, the error is as large as the velocities themselves. */
static void measure_correction(const kt_model *model, kt_data *data, const double *from, const double *to) {
    data->correction = data->fastest = 0.0;
    for (size_t i = 0; i < model->n.group_v; i++) {
        const int32_t v = model->group_v[i];
        const double change = fabs(to[v] - from[v]) / model->unit[i];
        data->fastest = fmax(data->fastest, fabs(to[v]) / model->unit[i]);
        if (change > data->correction) {
            data->correction = change;
            data->corrected_v = v;
        }
    }
}

kt_status kt_state_project_trusted(const kt_model *model, kt_data *data, double t, double *q, double *v, bool *changed,
                                   kt_error *error) {
    bool moved = false;
    double *new_q = data->assembled_q, *new_v = data->assembled_v;
    const kt_input input = {.q = q, .v = v};
    data->dead = false;
    memcpy(new_q, q, model->n.q * sizeof *q);
    memcpy(new_v, v, model->n.v * sizeof *v);
    if (model->n.q > model->n.v && !kt_unit_quaternions(model, new_q))
        return kt_input_reject_not_finite(model, t, &input, error);
    if (model->n.group) {
        kt_status status = kt_loops_project(model, data, t, &input, new_q, new_v, &moved, error);
        if (model->custom)
            status = kt_stop_report(model, data, t, status, error);
        if (status != KT_OK)
            return status;
    }
    measure_correction(model, data, v, new_v);
    moved |= memcmp(q, new_q, model->n.q * sizeof *q) != 0;
    memcpy(q, new_q, model->n.q * sizeof *q);
    memcpy(v, new_v, model->n.v * sizeof *v);
    if (changed)
        *changed = moved;
    return KT_OK;
}

kt_status kt_state_project(const kt_model *model, kt_data *data, double t, double *q, double *v, bool *changed,
                           kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, v || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v};
    const kt_status status = kt_input_check(model, &input, error);
    double none = 0.0; /* a model that does not move may have no arrays */
    return status == KT_OK ? kt_state_project_trusted(model, data, t, q ? q : &none, v ? v : &none, changed, error)
                           : status;
}

kt_status kt_state_close(const kt_model *model, kt_data *data, double t, bool projects, double *q, double *v,
                         kt_error *error) {
    if (model->n.group && projects)
        return kt_state_project(model, data, t, q, v, NULL, error);
    if (!kt_all_finite(q, model->n.q) || !kt_all_finite(v, model->n.v))
        return kt_input_check(model, &(kt_input){.q = q, .v = v}, error);
    return kt_position_make_units(model, q)
               ? KT_OK
               : kt_error_set(error, KT_ERROR_NOT_FINITE, "step", "a quaternion has become zero");
}

kt_status kt_loop_residual(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           kt_residual *residual, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, residual))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    kt_violation violation = kt_violation_none;
    const kt_input input = {.q = q, .v = v};
    if (model->n.group && !model->group_kernels->residuals(model, data, t, q, v, NULL, &violation))
        return kt_stop_report(model, data, t, kt_input_reject_not_finite(model, t, &input, error), error);
    *residual = (kt_residual){.position = violation.position, .velocity = violation.velocity};
    return KT_OK;
}

kt_status kt_state_assemble(const kt_model *model, kt_data *data, double t, double *q, double *v, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, v || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v};
    double *new_q = data->assembled_q, *new_v = data->assembled_v, *given = data->given_q;
    kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    kt_copy(new_q, q, model->n.q * sizeof *q);
    kt_copy(new_v, v, model->n.v * sizeof *v);
    (void)kt_unit_quaternions(model, new_q); /* none is zero */
    memcpy(given, new_q, model->n.q * sizeof *q);
    if (model->n.group)
        status = kt_loops_assemble(model, data, t, given, new_q, new_v, error);
    if (kt_stop_report(model, data, t, KT_OK, error) != KT_OK)
        return KT_ERROR_CALLBACK;
    if (status != KT_OK)
        return kt_loops_explain(model, data, t, given, v, status, error);
    kt_copy(q, new_q, model->n.q * sizeof *q);
    kt_copy(v, new_v, model->n.v * sizeof *v);
    return KT_OK;
}

void kt_assembly_reached(const kt_model *model, const kt_data *data, double *q) {
    if (!kt_data_serve(model, data) || !q)
        return;
    memcpy(q, data->assembled_q, model->n.q * sizeof *q);
}

void kt_assemble_initial(const kt_model *model, kt_data *data, double *q, double *v) {
    if (kt_state_assemble(model, data, 0.0, q, v, NULL) != KT_OK)
        return;
}
