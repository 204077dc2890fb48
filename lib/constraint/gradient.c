/* What adjoints need of loops at a state, over the kernels of the model's instruction set and sweep, and the gradient
 * of sums of the equations: planar loops by their own forms, others by dual numbers. */
#include "constraint/gradient.h"

#include "closure/project.h"
#include "reduction/driver.h"

#include <string.h>

static kt_status refuse_overflow(kt_error *error) {
    return kt_error_set(error, KT_ERROR_NOT_FINITE, "derivatives",
                        "the loops' equations overflow: look for a position that is huge");
}

kt_status kt_loops_refuse_singular(const kt_model *model, const kt_data *data, kt_error *error) {
    return !kt_is_near_singular(model, data)
               ? KT_OK
               : kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                              "the loops are at a singular position, or next to one, where accelerations have no "
                              "defined derivative; take a neighbouring one");
}

kt_status kt_loops_factor(const kt_model *model, kt_data *data, double t, const double *q, kt_rows rows,
                          kt_error *error) {
    kt_violation violation;
    if (!kt_reduction_kernels_of(model)->look(model, data, t, q, NULL, NULL, &violation))
        return refuse_overflow(error);
    return kt_loops_factor_again(model, data, rows, error);
}

kt_status kt_loops_factor_again(const kt_model *model, kt_data *data, kt_rows rows, kt_error *error) {
    return kt_reduction_kernels_of(model)->ready(model, data, rows, true) ? kt_loops_refuse_singular(model, data, error)
                                                                          : refuse_overflow(error);
}

/* The arrays of a group's equations. */
typedef enum array { RIGHT, MULTIPLIER, RESIDUAL } array;

static double *array_of(const kt_group_work *w, array of) {
    return of == RIGHT ? w->right : of == MULTIPLIER ? w->multiplier : w->residual;
}

/* Copies numbers of the equations that are factored from the groups' order to that of the loops, with zeros for others;
 * or back, from `given` (NULL: zeros) where `out` is NULL. */
static void exchange(const kt_model *model, const kt_data *data, array of, const double *given, double *out) {
    if (out)
        memset(out, 0, model->n.row * sizeof *out);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        double *numbers = array_of(&w, of);
        if (out)
            kt_rows_scatter(model, group, w.k, numbers, out);
        else if (given)
            kt_rows_gather(model, group, w.k, given, numbers);
        else
            memset(numbers, 0, (size_t)w.k * sizeof *numbers);
    }
}

void kt_loops_residuals(const kt_model *model, const kt_data *data, double *phi) {
    exchange(model, data, RESIDUAL, NULL, phi);
}

kt_status kt_loops_respond(const kt_model *model, kt_data *data, kt_metric metric, const double *right,
                           const double *force, double *x, kt_error *error) {
    exchange(model, data, RIGHT, right, NULL);
    if (kt_reduction_kernels_of(model)->close(model, data, metric, force, x))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                        "the mechanism has no inertia along one of the degrees of freedom that its loops leave");
}

/* Groups that have been solved in their own form are factored. */
static kt_status unsolve(const kt_model *model, kt_data *data, kt_error *error) {
    bool some = false, fine;
    for (size_t g = 0; g < model->n.group; g++)
        some |= data->solved[g];
    if (!some)
        return KT_OK;
    KT_BY_LEVEL(model->level, fine =, kt_groups_unsolve, (model, data));
    return fine ? kt_loops_refuse_singular(model, data, error) : refuse_overflow(error);
}

kt_status kt_loops_share(const kt_model *model, kt_data *data, const double *force, double *lambda, kt_error *error) {
    const kt_status status = unsolve(model, data, error);
    if (status != KT_OK)
        return status;
    KT_BY_LEVEL(model->level, , kt_groups_share, (model, data, force));
    exchange(model, data, MULTIPLIER, NULL, lambda);
    return KT_OK;
}

void kt_loops_apply(const kt_model *model, kt_data *data, const double *x, double *out) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        if (group->front.used)
            kt_reduction_kernels_of(model)->apply(model, data, g, data->factored[g], x, w.multiplier, NULL);
        for (int r = 0; r < w.k && !group->front.used; r++) {
            w.multiplier[r] = 0.0;
            for (int i = 0; i < w.m; i++)
                w.multiplier[r] += w.a[(size_t)r * (size_t)w.m + (size_t)i] * x[model->group_v[group->v + i]];
        }
    }
    exchange(model, data, MULTIPLIER, NULL, out);
}

void kt_loop_gradient(const kt_model *model, kt_data *data, double t, const double *q, const kt_loop_sum *sum,
                      kt_support_dof *dof, int32_t *chain, double *by_q, double *by_v) {
    for (size_t i = 0; i < model->n.loop; i++) {
        if (model->loop[i].term_count) /* a relation: A is constant, and b'' a function of time */
            continue;
        if (model->sweep == KT_SWEEP_PLANAR)
            KT_BY_LEVEL(model->level, , kt_planar_loop_gradient, (model, data, (int32_t)i, sum, by_q, by_v));
        else
            kt_dual_loop_gradient(model, data, t, q, (int32_t)i, sum, dof, chain, by_q, by_v);
    }
}

/* The coordinates on one path of a planar loop. */
static int32_t coordinate_of(const kt_model *model, const kt_loop_record *loop, int k, int i) {
    return model->link[model->path[loop->path[k] + i]].v;
}

/* Adds `sign` times the gradient of a sum to the entries of a matrix, `stride` apart for successive coordinates. */
static void add_gradient(const kt_model *model, const kt_data *data, int32_t index, const kt_loop_sum *sum, double sign,
                         double *work, double *to, size_t stride) {
    const kt_loop_record *loop = &model->loop[index];
    memset(work, 0, 2 * model->n.v * sizeof *work);
    KT_BY_LEVEL(model->level, , kt_planar_loop_gradient, (model, data, index, sum, work, work + model->n.v));
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < loop->length[k]; i++) {
            const size_t j = (size_t)coordinate_of(model, loop, k, i);
            to[j * stride] += sign * work[j];
        }
}

/* Rows of d(J z)/dq, and columns of the symmetric d(J' lambda)/dq, one by one. */
static void write_planar_matrices(const kt_model *model, const kt_data *data, int32_t index, const double *lambda,
                                  const double *z, double *unit, double *work, double *d_q, double *c_q) {
    const kt_loop_record *loop = &model->loop[index];
    const kt_planar_loop *flat = &model->planar_loop[index];
    double *row = unit + model->n.v;
    for (int i = 0; i < flat->count; i++) {
        const size_t r = (size_t)loop->equation + (size_t)flat->row[i].row;
        const kt_loop_sum sum = {.lambda = {row}, .p = {z}};
        row[r] = 1.0;
        add_gradient(model, data, index, &sum, 1.0, work, c_q + r, model->n.row);
        row[r] = 0.0;
    }
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < loop->length[k]; i++) {
            const size_t j = (size_t)coordinate_of(model, loop, k, i);
            const kt_loop_sum sum = {.lambda = {lambda}, .p = {unit}};
            unit[j] = 1.0;
            add_gradient(model, data, index, &sum, -1.0, work, d_q + j, model->n.v);
            unit[j] = 0.0;
        }
}

void kt_loop_matrices(const kt_model *model, kt_data *data, double t, const double *q, const double *lambda,
                      const double *z, kt_support_dof *dof, int32_t *chain, double *unit, double *work, double *d_q,
                      double *c_q) {
    memset(c_q, 0, model->n.row * model->n.v * sizeof *c_q);
    for (size_t i = 0; i < model->n.loop; i++) {
        if (model->loop[i].term_count)
            continue;
        if (model->sweep == KT_SWEEP_PLANAR)
            write_planar_matrices(model, data, (int32_t)i, lambda, z, unit, work, d_q, c_q);
        else
            kt_dual_loop_matrices(model, data, t, q, (int32_t)i, lambda, z, dof, chain, d_q, c_q);
    }
}
