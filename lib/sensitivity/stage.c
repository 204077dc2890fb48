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

kt_status kt_step_differentiate_at(kt_step_work *w, double t, const double *y, const double *a, double *by_q,
                                   double *by_v, double *by_tau, kt_error *error) {
    const kt_model *model = w->model;
    const kt_step *step = w->step;
    const double *q = y, *v = y + model->n.q;
    if (!model->n.group && !model->n.effect)
        return kt_forward_derivatives_fill(model, w->data, w->tree, kt_derivative_work_size(model), q, v, step->tau,
                                           step->external, NULL, by_q, by_v, by_tau, error);
    return kt_acceleration_derivatives_at(model, w->data, w->derivative, kt_acceleration_work_size(model), t, q, v,
                                          step->tau, step->external, a, by_q, by_v, by_tau, NULL, error);
}

/* y += factor x */
static void add(double *y, double factor, const double *x, size_t n) {
    for (size_t l = 0; l < n && factor != 0.0; l++)
        y[l] += factor * x[l];
}

void kt_slope_change(const kt_model *model, const double *y, const double *by_q, const double *by_v, const double *dx,
                     double *xi, double *out) {
    const size_t nq = model->n.q, n = model->n.v;
    kt_tangent_rate(model, y, y + nq, dx, dx + nq, out);
    kt_tangent_drop(model, y, dx, xi);
    memset(out + nq, 0, n * sizeof *out);
    for (size_t l = 0; l < n; l++) { /* most changes are unit vectors */
        add(out + nq, xi[l], by_q + l * n, n);
        add(out + nq, dx[nq + l], by_v + l * n, n);
    }
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
