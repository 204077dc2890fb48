/* Back to the constraint manifold: u <- u (+) du with A du = -phi, repeated, then v <- v + dv with A dv = b' - A v
 * [MSD 7.55 to 7.58]. du is least in the model's metric. dv is always least in kinetic energy, which is the impulse
 * that the loops themselves would exert: what an evaluation near a singular position gets wrong is a force of the
 * loops, and only this metric takes it back whole (N-four-bar, RK4 at 1e-3 s over 10 s: 2e-10 m, and 5e-8 m with the
 * identity). */
#include "reduction/project.h"

#include <stdio.h>
#include <string.h>

enum { PROJECT_MOST = 10 };

void kt_aim_at_closure(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_place(model, data, g);
        for (int r = 0; r < w.k; r++)
            w.right[r] = -w.residual[r];
    }
}

int kt_project_in_place(const kt_model *model, kt_data *data, double t, double *q, double *v, int most,
                        double tolerance, bool *changed, kt_violation *violation) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    const double small = model->length * KT_CLOSED_TOLERANCE;
    double before = (double)INFINITY;
    for (int i = 0;; i++) {
        if (!kernels->factor(model, data, t, q, v, NULL, violation))
            return -1;
        /* stop where rounding rules, or where a further step has not halved what is left */
        if (violation->position <= small || i == most || (violation->position > 0.5 * before && before <= 1e3 * small))
            break;
        before = violation->position;
        kt_aim_at_closure(model, data);
        if (!kernels->close(model, data, model->metric, data->delta))
            return -1;
        kt_position_add(model, q, data->delta, q);
        *changed = true;
    }
    if (!(violation->position <= model->length * tolerance))
        return 1;
    if (v && violation->velocity > 0.0) {
        if (!kernels->close(model, data, KT_METRIC_MASS, data->delta))
            return -1;
        for (size_t i = 0; i < model->n.v; i++) {
            const double old = v[i];
            v[i] += data->delta[i];
            *changed |= v[i] != old;
        }
    }
    return 0;
}

/* The gap of one loop as last factored: its largest residual. */
static double gap(const kt_model *model, const kt_data *data, const kt_loop_record *loop) {
    const kt_group *group = &model->group[loop->group];
    const kt_group_work w = kt_group_place(model, data, (size_t)loop->group);
    double largest = 0.0;
    for (int k = 0; k < group->kept_count; k++) {
        const int32_t row = model->kept[group->kept + k] - loop->row;
        if (row >= 0 && row < loop->row_count)
            largest = fmax(largest, fabs(w.residual[k]));
    }
    return largest;
}

kt_status kt_open_loops_error(const kt_model *model, kt_data *data, double t, const char *what, kt_error *error) {
    enum { NAMED = 4 };
    char text[KT_MESSAGE_SIZE] = "";
    size_t used = 0, open = 0;
    bool named[NAMED] = {false};
    int worst[NAMED];
    const double small = 1e-9 * model->length;
    for (int n = 0; n < NAMED; n++) { /* the worst that has not been named */
        worst[n] = -1;
        for (int i = 0; i < (int)model->n.loop; i++) {
            bool seen = false;
            for (int j = 0; j < n; j++)
                seen |= worst[j] == i;
            const double x = gap(model, data, &model->loop[i]);
            open += n == 0 && x > small;
            if (!seen && (x > small || n == 0) && (worst[n] < 0 || x > gap(model, data, &model->loop[worst[n]])))
                worst[n] = i;
        }
        named[n] = worst[n] >= 0;
        if (!named[n] || used >= sizeof text)
            break;
        const kt_loop_record *loop = &model->loop[worst[n]];
        const int length = snprintf(text + used, sizeof text - used, "%s'%.60s' by %.3g", n ? ", " : "",
                                    model->text + loop->name, gap(model, data, loop));
        used += length > 0 ? (size_t)length : 0;
    }
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "t = %.9g s", t);
    return kt_error_set(error, KT_ERROR_CONSTRAINT, where, "%s: %s (m or rad)%s", what, text,
                        open > NAMED ? " and others" : "");
}

kt_status kt_state_project(const kt_model *model, kt_data *data, double t, double *q, double *v, bool *changed,
                           kt_error *error) {
    bool moved = false;
    double *new_q = data->moved_q, *new_v = data->moved_v;
    kt_violation violation;
    memcpy(new_q, q, model->n.q * sizeof *q);
    memcpy(new_v, v, model->n.v * sizeof *v);
    if (!kt_position_normalize(model, new_q))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a quaternion is zero or not finite at t = %.9g s", t);
    if (model->n.group) {
        const int open = kt_project_in_place(model, data, t, new_q, new_v, PROJECT_MOST, 1e-9, &moved, &violation);
        if (open < 0)
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a position or velocity is not finite at t = %.9g s",
                                t);
        if (open)
            return kt_open_loops_error(model, data, t, "the loops can no longer be closed; open are", error);
    }
    moved |= memcmp(q, new_q, model->n.q * sizeof *q) != 0;
    memcpy(q, new_q, model->n.q * sizeof *q);
    memcpy(v, new_v, model->n.v * sizeof *v);
    if (changed)
        *changed = moved;
    return KT_OK;
}

kt_status kt_loop_residual(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           kt_residual *residual, kt_error *error) {
    kt_violation violation = {0.0, 0.0, 0.0};
    if (model->n.group && !kt_reduction_kernels_of(model)->factor(model, data, t, q, v, NULL, &violation))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a position or velocity is not finite at t = %.9g s", t);
    *residual = (kt_residual){.position = violation.position, .velocity = violation.velocity};
    return KT_OK;
}
