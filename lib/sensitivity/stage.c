/* The start of a step, and the derivatives of the accelerations of one of them. */
#include "base/copy.h"
#include "derivative/stiffness.h"
#include "dynamics/dynamics.h"
#include "kinetree/joint.h"
#include "mechanism/evaluate.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

void kt_step_start(kt_step_work *w, const double *q, const double *v) {
    kt_copy(w->y, q, w->model->n.q * sizeof *q);
    memcpy(w->y + w->model->n.q, v, w->model->n.v * sizeof *v);
    if (kt_has_own_states(w->model))
        kt_copy(w->y + w->model->n.q + w->model->n.v, w->step->x ? w->step->x : w->before, w->model->n.x * sizeof *v);
}

kt_status kt_step_rates(const kt_step_work *w, double t, const double *y, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const double *q = y, *v = y + model->n.q;
    kt_own_states_put(model, w->data, y);
    const kt_status status =
        kt_acceleration_evaluate(model, w->data, t, q, v, w->step->tau, w->step->external, a, error);
    return status == KT_OK && KT_HAS_FORMULAS && kt_has_own_states(model)
               ? kt_own_state_rates_trusted(model, w->data, t, q, v, a + model->n.v, error)
               : status;
}

kt_status kt_step_slope(const kt_step_work *w, double t, const double *y, double *slope, kt_error *error) {
    const size_t nq = w->model->n.q;
    kt_position_rate(w->model, y, y + nq, slope);
    return kt_step_rates(w, t, y, slope + nq, error);
}

/* For a tree without effects, the accelerations are written to `a` unless that is NULL. Otherwise `known` holds
 * them. */
static kt_status differentiate(kt_step_work *w, const kt_dynamic_state *at, double *a, const double *known,
                               const kt_forward_matrices *by, kt_error *error) {
    const kt_model *model = w->model;
    if (!model->n.group && !model->n.effect)
        return kt_forward_derivatives_fill(model, w->data, w->tree, kt_derivative_work_size(model), at, a, by, error);
    return kt_acceleration_derivatives_at(model, w->data, w->derivative, kt_acceleration_work_size(model), at, known,
                                          &(kt_acceleration_matrices){.by = *by}, error);
}

kt_status kt_step_differentiate_at(kt_step_work *w, double t, const double *y, const double *a, size_t place,
                                   bool inputs, kt_error *error) {
    const size_t all = place * w->model->n.v * w->model->n.v;
    const kt_dynamic_state at = {t, y, y + w->model->n.q, w->step->tau, w->step->external};
    const kt_forward_matrices by = {w->by_q + all, w->by_v + all, inputs ? w->by_tau : NULL};
    if (!(KT_HAS_FORMULAS && kt_has_own_states(w->model)))
        return differentiate(w, &at, NULL, a, &by, error);
    kt_own_states_put(w->model, w->data, y);
    return kt_own_differentiate(w, place, &at, a, &by, error);
}

/* y += factor x */
static void add(double *y, double factor, const double *x, size_t n) {
    for (size_t l = 0; l < n && factor != 0.0; l++)
        y[l] += factor * x[l];
}

void kt_slope_change(const kt_step_work *w, size_t place, const double *y, const double *dy, double *xi, double *out) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v;
    const double *by_q = w->by_q + place * n * n, *by_v = w->by_v + place * n * n;
    kt_tangent_rate(model, y, y + nq, dy, dy + nq, out);
    kt_tangent_drop(model, y, dy, xi);
    memset(out + nq, 0, n * sizeof *out);
    for (size_t l = 0; l < n; l++) { /* most changes are unit vectors */
        add(out + nq, xi[l], by_q + l * n, n);
        add(out + nq, dy[nq + l], by_v + l * n, n);
    }
    if (KT_HAS_FORMULAS && kt_has_own_states(model))
        kt_own_slope_change(w, place, xi, dy, out);
}

kt_status kt_step_differentiate(kt_step_work *w, size_t i, bool inputs, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const size_t n = kt_state_numbers(model);
    const double *y = w->stage + i * n, *known = w->slope + i * n + model->n.q;
    const kt_dynamic_state at = {kt_step_time(w->step, i), y, y + model->n.q, w->step->tau, w->step->external};
    if (a && (model->n.group || model->n.effect)) {
        const kt_status status =
            kt_acceleration_evaluate(model, w->data, at.t, at.q, at.v, at.tau, at.external, a, error);
        if (status != KT_OK)
            return status;
    }
    return differentiate(w, &at, a, known, &(kt_forward_matrices){w->by_q, w->by_v, inputs ? w->by_tau : NULL}, error);
}
