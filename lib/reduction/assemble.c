/* Assembly [MSD 8.5]: the closed state nearest to the given one.
 *
 * With d = u - u_given, min |d|^2 subject to phi(u) = 0. From far off the loops are closed first (far.c). Then the way
 * is along the manifold: d's part in it, (1 - A+ A) d, is what can still be gained, and where it vanishes d is normal
 * to the manifold. With -d for a step, A d_new = A d - phi, that part comes out as the least d_new less d. Steps are
 * scaled after Barzilai & Borwein (1988) and shortened until |d| falls; held coordinates have no column in A.
 *
 * Velocities are linear: A dv = b' - A v, dv least.
 */
#include "reduction/far.h"

#include "dynamics/kernel.h"

#include <stdio.h>
#include <string.h>

enum { SHORTER_MOST = 12 };

static double square(const double *x, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sum;
}

/* right <- A d - phi */
static void aim_nearest(const kt_model *model, const kt_data *data, const double *d) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_place(model, data, g, KT_ROWS_CLOSED);
        for (int r = 0; r < w.k; r++) {
            w.right[r] = -w.residual[r];
            for (int i = 0; i < w.m; i++)
                w.right[r] += w.a[(size_t)r * (size_t)w.m + (size_t)i] * d[model->group_v[group->v + i]];
        }
    }
}

/* An assembly under way: from `given` to q; d = q - given. */
typedef struct approach {
    const kt_model *model;
    kt_data *data;
    double t;
    const double *given;
    double *q, *d, *way; /* way: the step that the linearisation asks for */
} approach;

/* The way from q towards the nearest state; false where it cannot be had. */
static bool look_ahead(const approach *a) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(a->model);
    kt_violation violation;
    if (!kernels->look(a->model, a->data, a->t, a->q, NULL, a->model->held, &violation) ||
        !kernels->factor(a->model, a->data, KT_ROWS_CLOSED, false))
        return false;
    kt_position_subtract(a->model, a->q, a->given, a->d);
    aim_nearest(a->model, a->data, a->d);
    if (!kernels->close(a->model, a->data, KT_METRIC_IDENTITY, a->way))
        return false;
    for (size_t k = 0; k < a->model->n.v; k++)
        a->way[k] = a->model->held[k] ? 0.0 : a->way[k] - a->d[k];
    return true;
}

/* Goes part of the way, as far as brings q nearer to `given`; false where no part does. Close to the goal rounding
 * hides what is gained, and the step is right. */
static bool go(const approach *a, double part) {
    const size_t nv = a->model->n.v;
    double *near = a->data->near_q, *step = a->data->moved_v;
    const double from = square(a->d, nv);
    const bool close = square(a->way, nv) < 1e-10 * from;
    for (int i = 0; i < SHORTER_MOST; i++) {
        for (size_t k = 0; k < nv; k++)
            step[k] = ldexp(part, -i) * a->way[k];
        kt_move(a->model, a->model->held, a->q, step, near);
        if (!(kt_close_from_far(a->model, a->data, a->t, a->model->held, false, near) <= KT_CLOSED_FAR))
            continue;
        kt_position_subtract(a->model, near, a->given, step);
        if (!close && !(square(step, nv) < from))
            continue;
        memcpy(a->q, near, a->model->n.q * sizeof *near);
        return true;
    }
    return false;
}

/* The largest number of the way, against its unit. */
static double reach(const approach *a) {
    double most = 0.0;
    for (size_t i = 0; i < a->model->n.group_v; i++)
        if (fabs(a->way[a->model->group_v[i]]) > most * a->model->unit[i])
            most = fabs(a->way[a->model->group_v[i]]) / a->model->unit[i];
    return most;
}

/* From q, closed, to the closed state nearest to `given` around it. */
static void come_nearer(const approach *a, double *before) {
    const size_t nv = a->model->n.v;
    kt_iterations *taken = &a->data->iterations;
    double part = 1.0;
    for (uint32_t i = 0; look_ahead(a); i++) {
        const double most = reach(a);
        if (i) { /* the step that would have brought the way to nothing, had it changed as it did */
            double change = 0.0;
            for (size_t k = 0; k < nv; k++)
                change += before[k] * (before[k] - a->way[k]);
            part = change > 0.0 ? fmin(fmax(part * square(before, nv) / change, 0.1), 10.0) : 1.0;
        }
        memcpy(before, a->way, nv * sizeof *before);
        if (most * part > 0.2) /* the linearisation reaches no farther */
            part = 0.2 / most;
        if (!(most > 1e-11))
            return;
        if (i == KT_ASSEMBLY_STEPS_MAX) { /* closed, but another state may be nearer */
            taken->capped++;
            return;
        }
        taken->assembly = i + 1 > taken->assembly ? i + 1 : taken->assembly;
        if (!go(a, part))
            return;
    }
}

static kt_status assemble_positions(const kt_model *model, kt_data *data, double t, const double *given, double *q,
                                    kt_error *error) {
    const size_t lanes = kt_lanes8(model->n.v);
    const approach a = {
        .model = model, .data = data, .t = t, .given = given, .q = q, .d = data->side, .way = data->side + lanes};
    if (kt_close_from_far(model, data, t, model->held, true, q) <= KT_CLOSED_FAR) {
        come_nearer(&a, data->side + 2 * lanes);
        if (kt_close_from_far(model, data, t, model->held, false, q) <= KT_CLOSED_FAR)
            return KT_OK;
    }
    return kt_open_loops_error(model, data, t,
                               "the loops cannot be closed from the given positions (they are out of reach, contradict "
                               "each other, or held joints prevent it); open are",
                               false, error);
}

static kt_status assemble_velocities(const kt_model *model, kt_data *data, double t, const double *q, double *v,
                                     kt_error *error) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    kt_violation violation;
    double given = 0.0;     /* what is left of a speed that loops forbid is rounding of it, not of itself */
    for (int i = 0;; i++) { /* once would do but for rounding */
        if (!kernels->look(model, data, t, q, v, model->held, &violation))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the initial velocities are too large");
        given = fmax(violation.speed, given);
        if (i == 2 || violation.slip <= KT_CLOSED * violation.speed)
            break;
        if (!kernels->factor(model, data, KT_ROWS_ALL, false) ||
            !kernels->close(model, data, KT_METRIC_IDENTITY, data->delta))
            break;
        for (size_t k = 0; k < model->n.v; k++)
            v[k] += model->held[k] ? 0.0 : data->delta[k];
    }
    if (violation.slip <= KT_CLOSED_FAR * given || kt_velocities_fit(model, data, v, KT_CLOSED_FAR))
        return KT_OK;
    return kt_open_loops_error(model, data, t,
                               "the initial velocities contradict the loops; hold fewer joints, or make loops agree; "
                               "apart are",
                               true, error);
}

kt_status kt_state_assemble(const kt_model *model, kt_data *data, double t, double *q, double *v, kt_error *error) {
    const kt_input input = {.q = q, .v = v};
    double *new_q = data->assembled_q, *new_v = data->assembled_v, *given = data->given_q;
    kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    memcpy(new_q, q, model->n.q * sizeof *q);
    memcpy(new_v, v, model->n.v * sizeof *v);
    (void)kt_unit_quaternions(model, new_q); /* none is zero */
    memcpy(given, new_q, model->n.q * sizeof *q);
    if (model->n.group) {
        status = assemble_positions(model, data, t, given, new_q, error);
        if (status == KT_OK)
            status = assemble_velocities(model, data, t, new_q, new_v, error);
    }
    if (status != KT_OK)
        return status;
    memcpy(q, new_q, model->n.q * sizeof *q);
    memcpy(v, new_v, model->n.v * sizeof *v);
    return KT_OK;
}

void kt_assemble_initial(const kt_model *model, kt_data *data, double *q, double *v) {
    if (kt_state_assemble(model, data, 0.0, q, v, NULL) != KT_OK)
        return;
}
