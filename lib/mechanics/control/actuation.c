/* Forces of actuators from accelerations, with loops and effects. The forces that the motion requires on all
 * coordinates are n = M a + h - J' external - Q. Actuators and loops supply them: n = S' forces + A' lambda. With A Z =
 * 0
 *     Z' S' forces = Z' n
 * and with y = sqrt(W) forces, the least y has the least forces' W forces. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "control/control.h"
#include "evaluate/evaluate.h"
#include "evaluate/load_friction.h"
#include "linear/cholesky.h"

#include <string.h>

/* ---- accelerations that the loops allow -------------------------------------------------------------------------- */

/* A a - b'' of one equation; *size receives its largest term. */
static double residual_of(const kt_actuation_work *w, const double *a, size_t row, double *size) {
    const kt_counts *n = &w->model->n;
    double sum = -w->drift[row];
    *size = fabs(sum);
    for (size_t i = 0; i < n->v; i++) {
        const double term = w->jacobian[i * n->row + row] * a[i];
        sum += term;
        *size = fmax(*size, fabs(term));
    }
    return fabs(sum);
}

/* The largest possible term of an equation: an entry of A times the largest acceleration or the square of the largest
 * velocity. In a loop that is locked, and in directions that a plane leaves out, all terms are rounding errors. */
static double largest_term(const kt_actuation_work *w, const double *v, const double *a) {
    const kt_counts *n = &w->model->n;
    double entry = 0.0, rate = 0.0;
    for (size_t i = 0; i < n->row * n->v; i++)
        entry = fmax(entry, fabs(w->jacobian[i]));
    for (size_t i = 0; i < n->v; i++)
        rate = fmax(rate, fmax(fabs(a[i]), v[i] * v[i]));
    return entry * rate;
}

/* Rejects accelerations that the loops do not allow: A a - b'' of an equation must be rounding relative to the largest
 * possible term. The message names the loop with the largest violation. */
static kt_status check_actuated_loops(kt_actuation_work *w, kt_data *data, double t, const double *q, const double *v,
                                      const double *a, kt_error *error) {
    const kt_model *model = w->model;
    double worst = 0.0, size;
    int loop = 0;
    if (!model->n.row)
        return KT_OK;
    const kt_status status = kt_loop_equations(model, data, t, q, v, w->jacobian, NULL, NULL, w->drift, error);
    if (status != KT_OK)
        return status;
    double largest = largest_term(w, v, a);
    for (size_t i = 0; i < model->n.loop; i++)
        for (int r = 0; r < model->loop[i].row_count; r++) {
            const double x = residual_of(w, a, (size_t)model->loop[i].equation + (size_t)r, &size);
            largest = fmax(largest, size);
            if (x > worst) {
                worst = x;
                loop = (int)i;
            }
        }
    if (worst <= KT_ACTUATION_TOLERANCE * largest)
        return KT_OK;
    return kt_error_set(
        error, KT_ERROR_CONSTRAINT, kt_where_format("loop '%.100s', t = %.9g s", kt_loop_name(model, loop), t).text,
        "the accelerations miss its equations by %g m/s^2 or rad/s^2; choose independent coordinates and "
        "let kt_acceleration_complete find the others",
        worst);
}

/* ---- forces ------------------------------------------------------------------------------------------------------ */

/* n into w->force. */
static kt_status find_need(kt_actuation_work *w, kt_data *data, double t, const double *q, const double *v,
                           const double *a, const kt_wrench *external, kt_error *error) {
    const kt_model *model = w->model;
    kt_dynamic_state loaded = {.t = t, .q = q, .v = v, .external = external};
    kt_status status = kt_load_reject(model, "actuation", "add its force to the joint forces that are found", error);
    if (status == KT_OK && model->n.effect)
        status = kt_effects_apply(model, data, &loaded, error);
    if (status != KT_OK)
        return status;
    kt_copy_or_clear(w->right, loaded.tau, model->n.v * sizeof *w->right);
    status = kt_inverse_trusted(model, data, q, v, a, loaded.external, w->force, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        w->force[i] -= w->right[i];
    return status;
}

static kt_status check_weights(kt_coordinate_list list, const double *weights, kt_error *error) {
    for (int i = 0; i < list.count && weights; i++)
        if (!(weights[i] > 0.0) || !isfinite(weights[i]))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "weights",
                                "weight %d is %g; give a positive number (a larger weight means less force)", i,
                                weights[i]);
    return KT_OK;
}

/* Returns a reciprocal condition number. With B = Z (W^-1/2 S Z)^+ W^-1/2 the forces are B' n. The number is the
 * reciprocal of the largest entry of B, in units. */
static double condition(kt_actuation_work *w, kt_coordinate_list actuated) {
    const size_t nv = w->model->n.v;
    double most = 1.0;
    for (int i = 0; i < actuated.count; i++) {
        memset(w->right, 0, nv * sizeof *w->right);
        w->right[i] = w->scale[i];
        kt_least_solve(&w->least, w->right, w->solution);
        kt_dense_apply(w->basis, (int)nv, w->dofs, w->solution, w->right);
        most = fmax(most, kt_actuation_amplification(w, w->right, actuated.index[i]));
    }
    return 1.0 / most;
}

kt_status kt_actuation_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size, double t,
                                const double *q, const double *v, const double *a, const kt_wrench *external,
                                kt_coordinate_list actuated, const double *weights, double *forces, double *rcond,
                                kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, forces || actuated.count <= 0))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v, .x = a, .what = "acceleration", .external = external};
    const size_t nv = model->n.v;
    kt_actuation_work w;
    kt_status status = kt_actuation_begin(model, work, work_size, actuated, &w, error);
    if (status == KT_OK)
        status = check_weights(actuated, weights, error);
    if (status == KT_OK)
        status = kt_input_check(model, &input, error);
    if (status == KT_OK)
        status =
            kt_open_contacts_reject(model, data, &(kt_dynamic_state){.t = t, .q = q, .v = v ? v : model->zero}, error);
    if (status == KT_OK)
        status = check_actuated_loops(&w, data, t, q, v ? v : model->zero, a ? a : model->zero, error);
    if (status == KT_OK)
        status = find_need(&w, data, t, q, v ? v : model->zero, a, external, error);
    for (int i = 0; i < actuated.count && status == KT_OK; i++)
        w.scale[i] = weights ? 1.0 / sqrt(weights[i]) : 1.0;
    if (status == KT_OK)
        status = kt_actuation_factor(&w, data, t, q, actuated, w.scale, "that no actuator drives", error);
    if (status != KT_OK)
        return status;
    for (int c = 0; c < w.dofs; c++)
        w.right[c] = kt_dense_dot(w.basis + (size_t)c * nv, w.force, (int)nv);
    kt_least_solve_transposed(&w.least, w.right, w.solution);
    if (!kt_all_finite(w.solution, (size_t)actuated.count))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "actuators",
                            "their forces overflow: look for an acceleration, velocity or weight that is huge");
    for (int i = 0; i < actuated.count; i++)
        forces[i] = w.solution[i] * w.scale[i];
    if (rcond)
        *rcond = condition(&w, actuated);
    return KT_OK;
}
