/* The response of the loops at a state, and their multipliers, over the kernels of the model's instruction set and
 * sweep. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/loop_response.h"

#include "assembly/project.h"
#include "base/where.h"
#include "evaluate/evaluate.h"
#include "reduction/groups.h"

#include <math.h>
#include <string.h>

static kt_status reject_overflow(kt_error *error) {
    return kt_error_set(error, KT_ERROR_NOT_FINITE, "derivatives",
                        "the loops' equations overflow: look for a position that is huge");
}

static kt_status reject_singular_loops(kt_error *error) {
    return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                        "the loops are at a singular position, or next to one, where accelerations have no defined "
                        "derivative; take a neighbouring one");
}

kt_status kt_loops_reject_near(const kt_model *model, const kt_data *data, kt_error *error) {
    return kt_is_near_singular(model, data) ? reject_singular_loops(error) : KT_OK;
}

/* Whether a direction is lost altogether. */
static bool direction_is_lost(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->rank[g] < model->group[g].rank[data->factored[g]])
            return true;
    return false;
}

kt_status kt_loops_factor(const kt_model *model, kt_data *data, double t, const double *q, kt_rows rows,
                          kt_error *error) {
    kt_violation violation;
    if (!model->group_kernels->residuals(model, data, t, q, NULL, NULL, &violation))
        return reject_overflow(error);
    return kt_loops_factor_again(model, data, rows, error);
}

kt_status kt_loops_factor_again(const kt_model *model, kt_data *data, kt_rows rows, kt_error *error) {
    if (!model->group_kernels->prepare(model, data, rows, false))
        return reject_overflow(error);
    return kt_is_near_singular(model, data) && direction_is_lost(model, data) ? reject_singular_loops(error) : KT_OK;
}

/* ---- next to a singular position ---------------------------------------------------------------------------------
 *
 * The error of an acceleration that is computed directly grows like 1 / s^3 (singular_crossing.c). Therefore the
 * relative error of its derivative is three times as large. If accelerations are interpolated from neighbouring states,
 * their error is the error at these states, and no derivative can be computed. */

/* Measures the error of an acceleration, or sets infinity. The record of the motion in data does not include this
 * error, because nothing moves during the measurement. */
static kt_status measure_loop_response(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                       double *size, kt_error *error) {
    const kt_passage passage = data->passage;
    const kt_crossings crossings = data->crossings;
    data->passage = (kt_passage){.time = 0.0};
    const kt_status status = kt_acceleration_trusted(model, data, at, a, error);
    const bool measured = data->passage.acceleration > 0.0 || data->passage.error == 0.0;
    *size = measured && !data->interpolated ? data->passage.acceleration : (double)INFINITY;
    data->passage = passage;
    data->crossings = crossings;
    return status;
}

kt_status kt_loops_derivative_error(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                    double *size, kt_error *error) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    kt_violation violation;
    *size = 0.0;
    if (!kernels->residuals(model, data, at->t, at->q, at->v, NULL, &violation) ||
        !kernels->factor(model, data, KT_ROWS_ALL, false))
        return reject_overflow(error);
    if (!kt_is_near_singular(model, data))
        return KT_OK;
    const double s = kt_smallest_direction(model, data, KT_ROWS_ALL);
    const kt_status status = measure_loop_response(model, data, at, a, size, error);
    if (status != KT_OK)
        return status;
    *size *= 3.0 / s;
    if (!isfinite(*size)) /* of NaN, 0 / 0, too */
        return reject_singular_loops(error);
    return kernels->residuals(model, data, at->t, at->q, at->v, NULL, &violation) &&
                   kernels->factor(model, data, KT_ROWS_ALL, false)
               ? KT_OK
               : reject_overflow(error);
}

kt_status kt_derivatives_reject_unknown(double t, double size, double most, kt_error *error) {
    if (size <= KT_KNOWN * most)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_SINGULAR, kt_where_format("derivatives, t = %.9g s", t).text,
                        "next to a singular position of the loops rounding leaves derivatives of the accelerations "
                        "uncertain by %.2g of the largest, more than %g; take a state farther away",
                        size / most, KT_KNOWN);
}

/* The arrays of a group's equations. */
typedef enum array { RIGHT, MULTIPLIER, RESIDUAL, PRODUCT } array;

/* The array in a group's matrices, in the order of its slots. */
static double *array_of(const kt_group_work *w, array of) {
    return of == RIGHT        ? w->right
           : of == MULTIPLIER ? w->multiplier
           : of == RESIDUAL   ? w->residual
                              : kt_group_products(w);
}

/* Copies numbers of the factored equations from the groups' order to the loops' order, with zeros for all other
 * equations. If `out` is NULL, copies in the other direction, from `given` (NULL: zeros). */
static void exchange_equations(const kt_model *model, const kt_data *data, array of, const double *given, double *out) {
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
    exchange_equations(model, data, RESIDUAL, NULL, phi);
}

kt_status kt_loops_respond(const kt_model *model, kt_data *data, kt_metric metric, const double *right,
                           const double *force, double *x, kt_error *error) {
    exchange_equations(model, data, RIGHT, right, NULL);
    if (model->group_kernels->least_step(model, data, metric, force, x))
        return KT_OK;
    return kt_inertia_reject("derivatives", error);
}

/* Groups that have been solved in their own form are factored. */
static kt_status refactor(const kt_model *model, kt_data *data, kt_error *error) {
    bool some = false, fine;
    for (size_t g = 0; g < model->n.group; g++)
        some |= data->special_form[g];
    if (!some)
        return KT_OK;
    KT_BY_ISA(model->isa, fine =, kt_groups_refactor, (model, data));
    if (!fine)
        return reject_overflow(error);
    return kt_is_near_singular(model, data) && direction_is_lost(model, data) ? reject_singular_loops(error) : KT_OK;
}

kt_status kt_loops_multipliers_of(const kt_model *model, kt_data *data, const double *force, double *lambda,
                                  kt_error *error) {
    const kt_status status = refactor(model, data, error);
    if (status != KT_OK)
        return status;
    KT_BY_ISA(model->isa, , kt_groups_multipliers_of, (model, data, force));
    exchange_equations(model, data, MULTIPLIER, NULL, lambda);
    return KT_OK;
}

void kt_loops_apply(const kt_model *model, kt_data *data, const double *x, double *out) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        if (group->has_fronts)
            model->group_kernels->apply(model, data, g, data->factored[g], x, kt_group_products(&w), NULL);
        for (int r = 0; r < w.k && !group->has_fronts; r++) {
            double *sum = &kt_group_products(&w)[r];
            *sum = 0.0;
            for (int i = 0; i < w.m; i++)
                *sum += w.a[(size_t)r * (size_t)w.m + (size_t)i] * x[model->group_v[group->v + i]];
        }
    }
    exchange_equations(model, data, PRODUCT, NULL, out);
}
