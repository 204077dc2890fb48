/* The structural rank of each constraint group: how many of its equations are independent at generic positions.
 *
 * Off the manifold redundant equations seem independent (Bricard's five of rank four). At singular positions
 * independent equations seem redundant. Therefore ranks are determined at several generic positions on the manifold,
 * and the largest counts. Equations whose rows and residuals vanish at all of them (the out-of-plane ones of a planar
 * loop) vanish everywhere, and are not evaluated again. If other equations are redundant, independent equations are
 * chosen at the position with the largest last direction. The chosen equations get a weight, so that the same choice is
 * made everywhere, unless the rows are much shorter at another position (group.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "compile/rank_samples.h"
#include "constraint/rejecting_loop.h"
#include "constraint/self_stress.h"
#include "kinetree/loop.h"

#include <stdio.h>
#include <string.h>

KT_ARENA_ARRAYS(lay_out_rank_samples, kt_rank_samples, KT_RANK_SAMPLES_FIELDS, const kt_counts *n)

/* Assigns slots to the nontrivial equations of a group, in their order, equations with a residual first. All other
 * equations get -1. */
static void number_group_rows(kt_model *model, const kt_data *data, size_t g, const bool *nontrivial) {
    kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    int32_t *slot = model->slot + group->row, count = 0;
    double *closes = w.work; /* by row, because slots change */
    for (int32_t row = 0; row < group->row_count; row++)
        closes[row] = slot[row] < 0 ? 0.0 : w.closes[slot[row]];
    for (int pass = 0; pass < 2; pass++) {
        for (int32_t row = 0; row < group->row_count; row++)
            if (nontrivial[group->row + row] && (closes[row] == 0.0) == (pass == 1))
                slot[row] = count++;
        if (!pass)
            group->count[KT_ROWS_CLOSED] = count;
    }
    group->count[KT_ROWS_ALL] = count;
    for (int32_t row = 0; row < group->row_count; row++)
        if (!nontrivial[group->row + row])
            slot[row] = -1;
}

/* Lets directions count down to `tolerance` of the largest. The absolute bound, `least` times KT_RANK_TOLERANCE,
 * remains. */
static void resolve_rank(kt_group *group, int rows, double least, double tolerance) {
    group->least[rows] = least * (KT_RANK_TOLERANCE / tolerance);
    group->tolerance[rows] = tolerance;
}

/* Sets the initial values: all equations count, and ranks are as large as possible. */
static void begin_ranks(kt_model *model, kt_data *data, bool *nontrivial) {
    kt_violation violation;
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.row; i++)
        model->weight[i] = 1.0;
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.front; i++) {
        model->front_usual[i] = 1.0;
        model->front_cap[i] = INT32_MAX / 2;
    }
    memset(nontrivial, 1, model->n.row * sizeof *nontrivial);
    (void)model->group_kernels->residuals(model, data, 0.0, model->q0, NULL, NULL, &violation);
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        number_group_rows(model, data, g, nontrivial);
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        const double least = kt_rank_least(model, group, &w);
        kt_form_choose_damped(model, group);
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++) {
            resolve_rank(group, rows, least, KT_RANK_TOLERANCE);
            group->rank[rows] = group->count[rows] < group->v_count ? group->count[rows] : group->v_count;
        }
    }
    memset(nontrivial, 0, model->n.row * sizeof *nontrivial);
}

/* Gives the chosen equations of a group their weights. */
static void prefer_equations(kt_model *model, const kt_group *group, int rows, const kt_rank_samples *found) {
    const size_t first = (size_t)rows * model->n.row + (size_t)group->row;
    for (int32_t row = 0; row < group->row_count; row++)
        if (model->slot[group->row + row] >= 0)
            model->weight[first + (size_t)model->slot[group->row + row]] =
                found->chosen[first + (size_t)row] ? KT_PREFERRED : 1.0;
}

/* Sets the ranks and the usual sizes of directions that the samples have shown, and chooses the form of each group. */
static void finish_ranks(kt_model *model, const kt_data *data, const kt_rank_samples *found) {
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.front; i++) {
        model->front_usual[i] = found->usual[i];
        model->front_cap[i] = found->cap[i];
    }
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        number_group_rows(model, data, g, found->nontrivial);
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++) { /* void equations contribute rounding errors only */
            const int32_t rank = found->rank[KT_ROWS_COUNT * g + (size_t)rows];
            group->rank[rows] = rank < group->count[rows] ? rank : group->count[rows];
            group->usual[rows] = !group->rank[rows] ? 0.0 : group->has_fronts ? 1.0 : group->usual[rows];
            resolve_rank(group, rows, group->least[rows], rows == KT_ROWS_CLOSED ? KT_RANK_CLOSED : KT_RANK_MOVING);
            prefer_equations(model, group, rows, found);
        }
    }
    if (model->n.front) {
        kt_fronts_find_delays(model);
        kt_groups_place_matrices(model);
    }
    kt_armature_update_flags(model);
    kt_forms_choose(model);
    kt_stress_plan(model);
}

/* Fronts choose among the equations of a step and the delayed equations of earlier steps. Without weights all equations
 * are delayed as far as possible, so that dependent equations are compared at the same step. The equations chosen at
 * this step get the weight. */
static kt_status choose_among_delayed(kt_model *model, kt_rank_samples *found, kt_error *error) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    const double *q = found->q + 2 * model->n.q;
    kt_violation violation;
    kt_data *data = NULL;
    bool any = false;
    for (size_t g = 0; g < model->n.group; g++)
        any = any || model->group[g].front.delayed_most;
    const kt_status status = any ? kt_data_create(model, &data, error) : KT_OK;
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.row && data; i++)
        model->weight[i] = 1.0;
    bool done = data && kernels->residuals(model, data, 0.0, q, NULL, NULL, &violation);
    for (int rows = KT_ROWS_COUNT - 1; rows >= 0 && done; rows--) {
        done = kt_rank_factor(model, data, rows);
        for (size_t g = 0; g < model->n.group && done; g++)
            if (model->group[g].front.delayed_most && data->rank[g] == model->group[g].rank[rows])
                kt_rank_store_steps(model, data, &model->group[g], rows, true, found);
    }
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.front && data; i++)
        model->front_usual[i] = found->usual[i];
    for (size_t g = 0; g < model->n.group && data; g++)
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++)
            prefer_equations(model, &model->group[g], rows, found);
    kt_data_free(data);
    return status;
}

/* Opens LAPACK if a group is so large that its factorisation calls LAPACK; an error names the group's first loop. */
static kt_status open_lapack(const kt_model *model, kt_error *error) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (group->has_fronts || group->v_count < model->reduction->large)
            continue;
        const kt_status status = model->reduction->open(error);
        if (status != KT_OK && error)
            (void)snprintf(error->where, sizeof error->where, "group of loop '%.40s', %d coordinates",
                           kt_loop_name(model, model->group_loop[group->loop]), (int)group->v_count);
        return status;
    }
    return KT_OK;
}

kt_status kt_groups_rank(kt_model *model, kt_error *error) {
    if (!model->n.group)
        return KT_OK;
    if (open_lapack(model, error) != KT_OK)
        return KT_ERROR_UNSUPPORTED;
    kt_data *data = NULL;
    kt_rank_samples found = {.places = false};
    const size_t bytes = lay_out_rank_samples(NULL, NULL, &model->n);
    void *memory = kt_arena_allocate(bytes, "ranks", NULL);
    if (memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    memset(memory, 0, bytes);
    (void)lay_out_rank_samples(&found, memory, &model->n);
    kt_status status = kt_data_create(model, &data, error);
    if (status == KT_OK) {
        begin_ranks(model, data, found.nontrivial);
        memcpy(found.q + 2 * model->n.q, model->q0, model->n.q * sizeof *found.q);
        model->disagreement = model->tolerance; /* searches end where loops disagree by less */
        kt_rank_find(model, data, &found);
        if (kt_rank_accept_disagreement(model, data, &found) != KT_OK)
            status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    }
    if (status == KT_OK && kt_rank_sample_places(model, data, &found) != KT_OK)
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    if (status == KT_OK) {
        kt_rank_sample_bounds(model, data, &found);
        kt_rank_sample_groups(model, data, model->q0, false, &found);
        finish_ranks(model, data, &found);
        status = kt_stop_report(model, data, 0.0, choose_among_delayed(model, &found, error), error);
    }
    kt_data_free(data);
    kt_aligned_release(memory);
    return status;
}
