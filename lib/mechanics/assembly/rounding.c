/* The part of a violation that rounding may leave. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/rounding.h"

#include "model/function.h"

double kt_group_rounding(const kt_model *model, size_t g, const double *q) {
    const kt_group *group = &model->group[g];
    double most = 1.0;
    for (int l = 0; l < group->link_count; l++) {
        const kt_link *link = &model->link[model->group_link[group->link + l]];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            most = fmax(most, fabs(q[link->q + k]) / (k < motion.lengths ? model->length : 1.0));
    }
    return fmax(model->rounding, fmin(KT_ROUNDING * most, KT_CLOSED_ASSEMBLED));
}

double kt_loops_rounding(const kt_model *model, const double *q) {
    double most = 0.0;
    for (size_t g = 0; g < model->n.group; g++)
        most = fmax(most, kt_group_rounding(model, g, q));
    return most;
}

bool kt_group_is_closed(const kt_model *model, const kt_data *data, size_t g, const double *q, double tolerance) {
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_CLOSED);
    kt_violation violation = kt_violation_none;
    kt_group_position_residuals(&w, &violation);
    return isfinite(violation.position) &&
           (violation.gap <= tolerance || violation.gap <= kt_group_rounding(model, g, q));
}

/* The largest speed in a group: of a coordinate over its unit, or of the terms of a drive's rate over its row's
 * scale. */
static double group_speed_of(const kt_model *model, size_t g, const kt_group_work *w, double t, const double *v) {
    const kt_group *group = &model->group[g];
    double speed = KT_SPEED_LEAST;
    for (int i = 0; i < w->m; i++)
        speed = fmax(speed, fabs(v[model->group_v[group->v + i]]) / model->unit[group->v + i]);
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const double rate = kt_curve_speed(&loop->curve, model->number, t);
        for (int r = 0; r < loop->row_count && rate > 0.0; r++) {
            const int32_t k = model->slot[loop->slot + r];
            if (k >= 0)
                speed = fmax(speed, rate / w->scale[k]);
        }
    }
    return speed;
}

bool kt_group_velocities_fit(const kt_model *model, const kt_data *data, size_t g, double t, const double *q,
                             const double *v, double tolerance) {
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const double most = fmax(tolerance, kt_group_rounding(model, g, q)) * group_speed_of(model, g, &w, t, v);
    bool fit = true;
    for (int r = 0; r < w.k; r++)
        fit &= fabs(w.right[r]) <= most * w.scale[r];
    return fit;
}

bool kt_velocities_fit(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                       double tolerance) {
    bool fit = true;
    for (size_t g = 0; g < model->n.group; g++)
        fit &= kt_group_velocities_fit(model, data, g, t, q, v, tolerance);
    return fit;
}
