/* Finds the groups of few equations whose form loses digits; the fronts reduce them instead.
 *
 * A group on the ground with up to four equations takes its accelerations from two parts: the accelerations of the tree
 * without loops, and the accelerations due to the multipliers (reduction/delassus.h). Both parts cancel in the loops'
 * equations, so that rounding limits the accuracy. In the free tree a light link that carries heavy ones has much
 * larger accelerations than the loops permit. The table shows the errors of the equations, relative to their largest
 * term, of 40 bars that are held at both ends. The masses of these bars are 1 and x in turn.
 *
 * | x   | few equations | fronts |
 * | 1   | 2e-16         | 2e-16  |
 * | 1e3 | 1e-14         | 2e-16  |
 * | 1e6 | 7e-12         | 2e-16  |
 * | 1e9 | 6e-9          | 2e-16  |
 *
 * The errors of the multipliers are larger by a factor of some 400. Therefore both sides of the equations are compared
 * once, at the initial positions. The velocities move all joints; the joint forces are zero in the first comparison,
 * and not in the second.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pool.h"
#include "compile/compile.h"
#include "reduction/kernel.h"

#include <math.h>

/* The largest accepted error of the equations for each link of the group, relative to their largest term. Errors for
 * each link were measured:
 *
 * | ropes, 10 to 1e4 like rods | 1e-17..2e-15 |
 * | rope, driven joint, gear   | 3e-13    |
 * | bars above, masses 1, 1e6  | 1e-11    | */
#define OFF_MOST 1e-12

/* Returns the largest difference between the two sides of A a = b, for a group that is solved by its few equations. The
 * difference is relative to the largest term, or to the terms of velocities of 1 rad/s if these are larger. Equations
 * that depend on others do not count. */
static double off_by(const kt_model *model, kt_data *data, size_t g, const double *a) {
    double off = 0.0, terms = 1.0;
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    model->group_kernels->apply(model, data, g, KT_ROWS_ALL, a, kt_group_products(&w), w.residual);
    for (int r = 0; r < w.k; r++) {
        if (w.weight && w.weight[r] == 1.0)
            continue;
        off = fmax(off, fabs(kt_group_products(&w)[r] - w.right[r]) / w.scale[r]);
        terms = fmax(terms, fmax(w.residual[r], fabs(w.right[r])) / w.scale[r]);
    }
    return off / terms;
}

/* v, tau and a: nv numbers each; inexact: of the groups, false. */
static void measure_delassus_accuracy(kt_model *model, kt_data *data, double *v, double *tau, double *a,
                                      bool *inexact) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    const kt_dynamic_state at = {.t = 0.0, .q = model->q0, .v = v, .tau = tau};
    for (size_t i = 0; i < model->n.v; i++) {
        v[i] = 1.0 - 0.25 * (double)(7 * i % 5);
        tau[i] = 0.0;
    }
    for (int forced = 0; forced < 2; forced++) {
        const bool done = kernels->forward(model, data, &at, false, a) == 0;
        for (size_t g = 0; g < model->n.group && done; g++) {
            const kt_group *group = &model->group[g];
            if (group->form == KT_FORM_DELASSUS && data->special_form[g])
                inexact[g] = inexact[g] || off_by(model, data, g, a) > OFF_MOST * group->link_count;
        }
        for (size_t i = 0; i < model->n.v; i++)
            tau[i] = 1.0 - 0.5 * (double)(3 * i % 5);
    }
    for (size_t g = 0; g < model->n.group; g++)
        if (inexact[g])
            kt_form_reject_inexact(&model->group[g]);
    kt_forms_choose(model);
}

static bool has_delassus(const kt_model *model) {
    for (size_t g = 0; g < model->n.group; g++)
        if (model->group[g].form == KT_FORM_DELASSUS)
            return true;
    return false;
}

kt_status kt_delassus_check_accuracy(kt_model *model, kt_error *error) {
    kt_data *data = NULL;
    kt_status status = has_delassus(model) ? kt_data_create(model, &data, error) : KT_OK;
    kt_pool pool = {.chunks = NULL};
    double *numbers = data ? kt_pool_take(&pool, 3 * model->n.v, sizeof *numbers) : NULL;
    bool *inexact = data ? kt_pool_take(&pool, model->n.group, sizeof *inexact) : NULL;
    if (data && (!numbers || !inexact))
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    if (numbers && inexact)
        measure_delassus_accuracy(model, data, numbers, numbers + model->n.v, numbers + 2 * model->n.v, inexact);
    kt_pool_free(pool.chunks);
    kt_data_free(data);
    return status;
}
