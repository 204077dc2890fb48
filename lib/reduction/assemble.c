/* Assembly [MSD 8.5]: the closed state nearest to the given one.
 *
 * With d = u - u_given, min |d|^2 subject to phi(u) = 0 by repeated linearisation: A d_new = A d - phi, d_new least,
 * which is the particular solution of the factored equations; held coordinates have no column in A. From far off the
 * loops are closed first (far.c). Velocities are linear: A dv = b' - A v.
 */
#include "reduction/far.h"

#include <stdio.h>
#include <string.h>

enum { NEAREST_MOST = 60 };

/* right <- A d - phi */
static void aim_nearest(const kt_model *model, const kt_data *data, const double *d) {
    kt_aim_at_closure(model, data);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_place(model, data, g);
        for (int r = 0; r < w.k; r++)
            for (int i = 0; i < w.m; i++)
                w.right[r] += w.a[(size_t)r * (size_t)w.m + (size_t)i] * d[model->group_v[group->v + i]];
    }
}

/* Towards the closed state nearest to `given`, from one that is closed; stays where that gains nothing. */
static void approach(const kt_model *model, kt_data *data, double t, const double *given, double *q) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    double *d = data->side, *near = data->near_q;
    for (int i = 0; i < NEAREST_MOST; i++) {
        kt_violation violation;
        double largest = 0.0;
        if (!kernels->factor(model, data, t, q, NULL, model->held, &violation))
            return;
        kt_position_subtract(model, q, given, d);
        aim_nearest(model, data, d);
        (void)kernels->close(model, data, KT_METRIC_IDENTITY, data->delta);
        for (size_t k = 0; k < model->n.v; k++) {
            data->delta[k] -= d[k];
            largest = fmax(largest, fabs(data->delta[k]));
        }
        for (size_t k = 0; k < model->n.v && largest > 0.2; k++) /* the linearisation reaches no farther */
            data->delta[k] *= 0.2 / largest;
        kt_position_add(model, q, data->delta, near);
        if (!(kt_close_from_far(model, data, t, model->held, near) <= model->length * 1e-9))
            return;
        memcpy(q, near, model->n.q * sizeof *q);
        if (!(largest > 1e-10))
            return;
    }
}

static kt_status assemble_positions(const kt_model *model, kt_data *data, double t, const double *given, double *q,
                                    kt_error *error) {
    double gap = kt_close_from_far(model, data, t, model->held, q);
    if (gap <= model->length * 1e-9) {
        approach(model, data, t, given, q);
        gap = kt_close_from_far(model, data, t, model->held, q);
    }
    if (!isfinite(gap))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "an initial position is not finite");
    if (!(gap <= model->length * 1e-9))
        return kt_open_loops_error(
            model, data, t,
            "the loops cannot be closed from the given positions (they are out of reach, contradict "
            "each other, or held joints prevent it); open are",
            error);
    return KT_OK;
}

/* The loop whose velocity equation is violated most. */
static const char *worst_velocity(const kt_model *model, const kt_data *data) {
    const char *name = "";
    double largest = -1.0;
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        const kt_group *group = &model->group[loop->group];
        const kt_group_work w = kt_group_place(model, data, (size_t)loop->group);
        for (int k = 0; k < group->kept_count; k++) {
            const int32_t row = model->kept[group->kept + k] - loop->row;
            if (row >= 0 && row < loop->row_count && fabs(w.right[k]) > largest) {
                largest = fabs(w.right[k]);
                name = model->text + loop->name;
            }
        }
    }
    return name;
}

static kt_status assemble_velocities(const kt_model *model, kt_data *data, double t, const double *q, double *v,
                                     kt_error *error) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    kt_violation violation = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; i++) { /* once would do but for rounding */
        if (!kernels->factor(model, data, t, q, v, model->held, &violation))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "an initial velocity is not finite");
        if (i == 2)
            break;
        (void)kernels->close(model, data, KT_METRIC_IDENTITY, data->delta);
        for (size_t k = 0; k < model->n.v; k++)
            v[k] += data->delta[k];
    }
    if (violation.velocity <= 1e-9 * (violation.speed + model->length))
        return KT_OK;
    return kt_error_set(
        error, KT_ERROR_CONSTRAINT, NULL,
        "the initial velocities contradict the loops: '%.60s' would open at %.3g (m/s or rad/s); hold fewer "
        "joints, or make loops agree",
        worst_velocity(model, data), violation.velocity);
}

kt_status kt_state_assemble(const kt_model *model, kt_data *data, double t, double *q, double *v, kt_error *error) {
    if (!model->n.group) {
        if (!kt_position_normalize(model, q))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "an initial quaternion is zero or not finite");
        return KT_OK;
    }
    double *new_q = data->assembled_q, *new_v = data->assembled_v;
    memcpy(new_q, q, model->n.q * sizeof *q);
    memcpy(new_v, v, model->n.v * sizeof *v);
    if (!kt_position_normalize(model, new_q))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "an initial quaternion is zero or not finite");
    kt_status status = assemble_positions(model, data, t, q, new_q, error);
    if (status == KT_OK)
        status = assemble_velocities(model, data, t, new_q, new_v, error);
    if (status != KT_OK)
        return status;
    memcpy(q, new_q, model->n.q * sizeof *q);
    memcpy(v, new_v, model->n.v * sizeof *v);
    return KT_OK;
}
