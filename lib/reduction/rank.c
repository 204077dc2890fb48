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

/* The k-th of a fixed sequence of generic numbers in (-1, 1). */
static double generic(size_t k) {
    const double x = (double)(k + 1) * 0.61803398874989485;
    return 2.0 * (x - floor(x)) - 1.0;
}

/* Coordinates of groups moved by up to `size`. */
static void scatter(const kt_model *model, double size, size_t sample, double *step) {
    memset(step, 0, model->n.v * sizeof *step);
    for (size_t i = 0; i < model->n.group_v; i++)
        step[model->group_v[i]] = size * generic(i + 131 * sample);
}

/* Marks the equations that are alive at the position last factored: not void, or with a residual, or moved by time. */
static void note_alive(const kt_model *model, const kt_data *data, bool *alive) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_place(model, data, g);
        double whole = 0.0;
        for (size_t i = 0; i < (size_t)w.m * (size_t)w.k; i++)
            whole = fmax(whole, fabs(w.a[i]));
        for (int r = 0; r < w.k; r++) {
            double largest = 0.0;
            for (int i = 0; i < w.m; i++)
                largest = fmax(largest, fabs(w.a[(size_t)r * (size_t)w.m + (size_t)i]));
            if (largest > 1e-12 * whole || fabs(w.residual[r]) > 1e-12 * model->length || w.rate[r] != 0.0)
                alive[group->kept + model->kept[group->kept + r]] = true;
        }
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
        if (group->rank > kept)
            group->rank = kept;
    }
}

/* The largest rank so far, and the least size of its last direction. */
static void note_rank(kt_model *model, const kt_data *data, int32_t *rank) {
    for (size_t g = 0; g < model->n.group; g++) {
        double *usual = &model->group[g].usual;
        if (data->rank[g] > rank[g])
            *usual = data->last[g];
        else if (data->rank[g] == rank[g])
            *usual = fmin(*usual, data->last[g]);
        if (data->rank[g] > rank[g])
            rank[g] = data->rank[g];
    }
}

static kt_status sample(kt_model *model, kt_data *data, double *q, bool *alive, int32_t *rank) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    double *base = q + model->n.q;
    kt_violation violation;
    int closed = 0;
    memcpy(base, model->q0, model->n.q * sizeof *q);
    const bool assembled = kt_close_from_far(model, data, 0.0, NULL, base) <= 1e-9 * model->length;
    for (size_t s = 0; s < SAMPLES && assembled; s++) {
        scatter(model, 0.3 / (double)(1 + s / 3), s, data->delta);
        kt_position_add(model, base, data->delta, q);
        if (!(kt_close_from_far(model, data, 0.0, NULL, q) <= 1e-11 * model->length) ||
            !kernels->factor(model, data, 0.0, q, NULL, NULL, &violation))
            continue;
        closed++;
        note_alive(model, data, alive);
        note_rank(model, data, rank);
    }
    if (closed)
        return KT_OK;
    /* nothing closes: the assembly will say so; until then the given position is all there is */
    memcpy(base, model->q0, model->n.q * sizeof *q);
    if (kernels->factor(model, data, 0.0, base, NULL, NULL, &violation))
        note_rank(model, data, rank);
    for (size_t r = 0; r < model->n.row; r++)
        alive[r] = true;
    return KT_OK;
}

kt_status kt_groups_rank(kt_model *model, kt_error *error) {
    if (!model->n.group)
        return KT_OK;
    kt_data *data = NULL;
    double *q = malloc(2 * model->n.q * sizeof *q);
    bool *alive = calloc(model->n.row, sizeof *alive);
    int32_t *rank = calloc(model->n.group, sizeof *rank);
    kt_status status = KT_ERROR_MEMORY;
    if (q && alive && rank)
        status = kt_data_create(model, &data, error);
    else
        (void)kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    if (status == KT_OK) {
        status = sample(model, data, q, alive, rank);
        for (size_t g = 0; g < model->n.group; g++)
            model->group[g].rank = rank[g];
        drop_void(model, alive);
    }
    kt_data_free(data);
    free(rank);
    free(alive);
    free(q);
    return status;
}
