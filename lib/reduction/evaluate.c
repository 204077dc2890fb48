/* The accelerations of a whole mechanism.
 *
 * Where an evaluation hits a singular position of the loops exactly, an equation drops out and the acceleration is
 * wrong to first order. But the motion goes through smoothly, and so does its acceleration: it is evaluated at two
 * states beside, moved by -+ dt along the motion and projected, and averaged, which leaves an error of dt^2. The step
 * is that in which the fastest coordinate of the groups moves by BESIDE.
 */
#include "reduction/evaluate.h"

#include "dynamics/kernel.h"

#include <stdio.h>
#include <string.h>

#define BESIDE 5e-5 /* rad or m */

static bool is_singular(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->rank[g] < model->group[g].rank)
            return true;
    return false;
}

/* The state dt later, to first order and projected; false where that fails. */
static bool move_beside(const kt_model *model, kt_data *data, double t, double dt, const double *q, const double *v,
                        const double *a, double *beside_q, double *beside_v) {
    bool changed;
    kt_violation violation;
    for (size_t i = 0; i < model->n.v; i++)
        beside_v[i] = dt * v[i];
    kt_position_add(model, q, beside_v, beside_q);
    for (size_t i = 0; i < model->n.v; i++)
        beside_v[i] = v[i] + dt * a[i];
    return kt_project_in_place(model, data, t + dt, beside_q, beside_v, 5, 1e-9, &changed, &violation) == 0;
}

/* Replaces a, the acceleration with dropped equations, by the average from both sides; leaves it where there is no
 * motion to go along, or no regular position beside. */
static void average_beside(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           const double *tau, const kt_wrench *external, double *a) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    const size_t nv = model->n.v;
    double fastest = 0.0, *sum = data->side, *one = data->side + kt_lanes8(nv);
    for (size_t i = 0; i < model->n.group_v; i++)
        fastest = fmax(fastest, fabs(v[model->group_v[i]]));
    if (!(fastest > 0.0))
        return;
    const double dt = BESIDE / fastest;
    for (int side = 0; side < 2; side++) {
        const double step = side ? dt : -dt;
        if (!move_beside(model, data, t, step, q, v, a, data->beside_q, data->beside_v) ||
            kernels->forward(model, data, t + step, data->beside_q, data->beside_v, tau, external, one) != 0 ||
            is_singular(model, data))
            return;
        for (size_t i = 0; i < nv; i++)
            sum[i] = side ? 0.5 * (sum[i] + one[i]) : one[i];
    }
    memcpy(a, sum, nv * sizeof *a);
}

static kt_status refuse_singular(const kt_model *model, size_t link, double t, const double *q, const double *v,
                                 kt_error *error) {
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.100s', t = %.9g s",
                   model->text + model->body[model->link[link].body].name, t);
    for (size_t i = 0; i < model->n.q; i++)
        if (!isfinite(q[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, where, "a position is not finite");
    for (size_t i = 0; i < model->n.v; i++)
        if (!isfinite(v[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, where, "a velocity is not finite");
    return kt_error_set(
        error, KT_ERROR_SINGULAR, where,
        "the mechanism has no inertia along one of the freedoms that its loops leave: give the bodies that "
        "move there mass or inertia");
}

kt_status kt_closed_forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    const size_t failed = kt_reduction_kernels_of(model)->forward(model, data, t, q, v, tau, external, data->scratch);
    if (failed)
        return refuse_singular(model, failed, t, q, v, error);
    if (is_singular(model, data))
        average_beside(model, data, t, q, v, tau, external, data->scratch);
    return kt_commit(model, data->scratch, a, "acceleration", error);
}

kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                   const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    if (model->n.effect)
        kt_effects_apply(model, data, t, q, v, &tau, &external);
    if (!model->n.group)
        return kt_dynamics_forward(model, data, q, v, tau, external, a, error);
    return kt_closed_forward(model, data, t, q, v, tau ? tau : model->zero, external, a, error);
}
