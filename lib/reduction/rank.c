/* The structural rank of each group: how many of its equations are independent where nothing is special.
 *
 * Off the manifold redundant equations look independent (Bricard's five of rank four), and at singular positions
 * independent ones do not; so ranks are taken at several generic positions on the manifold, and the largest counts.
 * Equations that vanish at all of them, with their residual (the out-of-plane ones of a planar loop), are void and not
 * evaluated again.
 */
#include "reduction/far.h"

#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 7 };

/* What the samples have shown: of equations, whether they are alive; of groups, whether any position was closed, and
 * the rank. */
typedef struct samples {
    double *q; /* two positions */
    bool *alive, *seen;
    int32_t *rank;
} samples;

/* Coordinates of groups moved by up to `size` of their units. */
static void scatter(const kt_model *model, double size, size_t sample, double *step) {
    memset(step, 0, model->n.v * sizeof *step);
    for (size_t i = 0; i < model->n.group_v; i++)
        step[model->group_v[i]] = size * model->unit[i] * kt_generic(i + 131 * sample);
}

/* Marks the equations of a group that are alive as last filled: not void, or with a residual, or moved by time. */
static void note_alive(const kt_model *model, const kt_group *group, const kt_group_work *w, bool *alive) {
    for (int r = 0; r < w->k; r++) {
        double largest = 0.0;
        for (int i = 0; i < w->m; i++)
            largest = fmax(largest, fabs(w->a[(size_t)r * (size_t)w->m + (size_t)i]) * model->unit[group->v + i]);
        if (largest > 1e-12 * w->scale[r] || fabs(w->residual[r]) > 1e-12 * w->scale[r] || w->rate[r] != 0.0)
            alive[group->kept + model->kept[group->kept + r]] = true;
    }
}

static void drop_void(kt_model *model, const bool *alive) {
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        int32_t kept = 0;
        for (int32_t r = 0; r < group->row_count; r++)
            if (alive[group->kept + r])
                model->kept[group->kept + kept++] = r;
        group->kept_count = kept;
    }
}

/* The largest rank so far, and the largest size of its last direction. */
static void note_rank(kt_group *group, int32_t rank, double last, int32_t *most) {
    if (rank > *most || (rank == *most && last > group->usual))
        group->usual = last;
    if (rank > *most)
        *most = rank;
}

/* Looks at the groups that are closed at q, or at those that have never been seen closed. */
static void look_at(kt_model *model, kt_data *data, const double *q, bool closed, samples *found) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    kt_violation violation;
    if (!kernels->look(model, data, 0.0, q, NULL, NULL, &violation) || !kernels->factor(model, data, false))
        return;
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_place(model, data, g);
        violation = (kt_violation){0.0, 0.0, 0.0, 0.0, 0.0};
        kt_group_look_at_positions(&w, &violation);
        if (closed ? violation.gap > KT_CLOSED_NEAR : found->seen[g])
            continue;
        found->seen[g] = true;
        note_rank(group, data->rank[g], data->last[g], &found->rank[g]);
        if (closed)
            note_alive(model, group, &w, found->alive);
        else /* it does not close: the assembly will say so, and until then the given position is all there is */
            for (int32_t r = 0; r < group->row_count; r++)
                found->alive[group->kept + r] = true;
    }
}

static void find_ranks(kt_model *model, kt_data *data, samples *found) {
    const size_t nq = model->n.q;
    double *base = found->q, *q = found->q + nq;
    memcpy(base, model->q0, nq * sizeof *base);
    if (isfinite(kt_close_from_far(model, data, 0.0, NULL, true, base)))
        for (size_t s = 0; s < SAMPLES; s++) {
            scatter(model, 0.3 / (double)(1 + s / 3), s, data->delta);
            kt_position_add(model, base, data->delta, q);
            (void)kt_close_from_far(model, data, 0.0, NULL, false, q);
            look_at(model, data, q, true, found);
        }
    look_at(model, data, model->q0, false, found);
    for (size_t g = 0; g < model->n.group; g++)
        model->group[g].rank = found->rank[g];
    drop_void(model, found->alive);
}

kt_status kt_groups_rank(kt_model *model, kt_error *error) {
    if (!model->n.group)
        return KT_OK;
    kt_data *data = NULL;
    samples found = {.q = malloc(2 * model->n.q * sizeof(double)),
                     .alive = calloc(model->n.row, sizeof(bool)),
                     .seen = calloc(model->n.group, sizeof(bool)),
                     .rank = calloc(model->n.group, sizeof(int32_t))};
    kt_status status = KT_OK;
    if (!found.q || !found.alive || !found.seen || !found.rank)
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    if (status == KT_OK)
        status = kt_data_create(model, &data, error);
    if (status == KT_OK)
        find_ranks(model, data, &found);
    kt_data_free(data);
    free(found.rank);
    free(found.seen);
    free(found.alive);
    free(found.q);
    return status;
}
