/* The start of a step, and the derivatives of the accelerations of one of its stages. */
#include "base/copy.h"
#include "derivative/stiffness.h"
#include "dynamics/dynamics.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

void kt_step_start(kt_step_work *w, const double *q, const double *v) {
    kt_copy(w->y, q, w->model->n.q * sizeof *q);
    memcpy(w->y + w->model->n.q, v, w->model->n.v * sizeof *v);
}

kt_status kt_step_differentiate_at(kt_step_work *w, size_t i, const double *a, double *by_q, double *by_v,
                                   double *by_tau, kt_error *error) {
    const kt_model *model = w->model;
    const kt_step *step = w->step;
    const double *q = w->stage + i * (model->n.q + model->n.v), *v = q + model->n.q;
    if (!model->n.group && !model->n.effect)
        return kt_forward_derivatives_fill(model, w->data, w->tree, kt_derivative_work_size(model), q, v, step->tau,
                                           step->external, NULL, by_q, by_v, by_tau, error);
    return kt_acceleration_derivatives_at(model, w->data, w->derivative, kt_acceleration_work_size(model),
                                          kt_step_time(step, i), q, v, step->tau, step->external, a, by_q, by_v, by_tau,
                                          NULL, error);
}

kt_status kt_step_differentiate(kt_step_work *w, size_t i, bool inputs, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const kt_step *step = w->step;
    const double *q = w->stage + i * (model->n.q + model->n.v), *v = q + model->n.q;
    const double t = kt_step_time(step, i), *known = w->slope + i * (model->n.q + model->n.v) + model->n.q;
    double *by_tau = inputs ? w->by_tau : NULL;
    if (!model->n.group && !model->n.effect)
        return kt_forward_derivatives_fill(model, w->data, w->tree, kt_derivative_work_size(model), q, v, step->tau,
                                           step->external, a, w->by_q, w->by_v, by_tau, error);
    if (a) {
        const kt_status status = kt_acceleration_evaluate(model, w->data, t, q, v, step->tau, step->external, a, error);
        if (status != KT_OK)
            return status;
    }
    return kt_acceleration_derivatives_at(model, w->data, w->derivative, kt_acceleration_work_size(model), t, q, v,
                                          step->tau, step->external, known, w->by_q, w->by_v, by_tau, NULL, error);
}
