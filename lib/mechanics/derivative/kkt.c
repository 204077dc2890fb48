/* Memory and calls of kkt.h: the kernels of the model's instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/kkt.h"

#include "evaluate/evaluate.h"
#include "reduction/kernel.h"

KT_ARENA_ARRAYS(place_arrays, kt_kkt, KT_KKT_FIELDS, const kt_kkt_sizes *s)

static size_t larger_size(size_t a, size_t b) { return a > b ? a : b; }

/* Returns the most numbers that the steps of a group store. A step with n parameters stores its rank times n +
 * KT_FRONT_SPACE, and the square of the number of parameters that it minimises out. */
static size_t kept_of(const kt_group *group) {
    const size_t width = (size_t)group->front.width;
    return (size_t)group->link_count * width * (width + KT_FRONT_SPACE);
}

/* Returns the most numbers of a group's maps. The maps have a column of N and W for each parameter. */
static size_t maps_of(const kt_group *group) {
    const size_t width = (size_t)group->front.width, base = KT_FRONT_SPACE, m = (size_t)group->v_count;
    if (!group->has_fronts)
        return m * (m + 2 * (size_t)group->row_count);
    return (size_t)group->link_count * width * (2 * base + 3 * width + group->front.vectors);
}

/* Sums over all groups, and the largest numbers of a group: groups are factored one after the other. */
static kt_kkt_sizes kkt_sizes_of(const kt_model *model) {
    kt_kkt_sizes s = {.links = model->n.link, .v = model->n.v, .rows = model->n.row, .groups = model->n.group};
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        s.maps += maps_of(group);
        if (!group->has_fronts)
            continue;
        s.steps += (size_t)group->link_count;
        s.width = larger_size(s.width, (size_t)group->front.width);
        s.vectors = larger_size(s.vectors, group->front.vectors);
        s.stride = larger_size(s.stride, (size_t)group->front.stride);
        s.kept = larger_size(s.kept, kept_of(group));
    }
    return s;
}

size_t kt_kkt_init(kt_kkt *w, void *memory, const kt_model *model, kt_data *data) {
    const kt_kkt_sizes s = kkt_sizes_of(model);
    if (memory)
        *w = (kt_kkt){.model = model, .data = data, .size = s};
    return place_arrays(w, memory, &s);
}

kt_status kt_kkt_factor(kt_kkt *w, kt_rows rows, kt_metric metric, double t, const double *q, kt_error *error) {
    const kt_reduction_kernels *kernels = w->model->group_kernels;
    w->rows = rows;
    w->metric = metric;
    kernels->fill(w->model, w->data, t, q, w->model->zero);
    if (!kernels->factor(w->model, w->data, rows, false))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "equations of motion",
                            "the loops' equations overflow: look for a position that is huge");
    bool done;
    KT_BY_ISA(w->model->isa, done =, kt_kkt_reduce, (w));
    if (!done)
        return kt_inertia_reject("equations of motion", error);
    return KT_OK;
}

void kt_kkt_solve(const kt_kkt *w, size_t columns, double *f, const double *b) {
    KT_BY_ISA(w->model->isa, , kt_kkt_solve, (w, columns, f, b));
}

void kt_kkt_apply_mass(const kt_kkt *w, size_t columns, double *x) {
    KT_BY_ISA(w->model->isa, , kt_kkt_apply_mass, (w, columns, x));
}

size_t kt_kkt_dofs(const kt_kkt *w) {
    size_t dofs = w->model->n.v;
    for (size_t g = 0; g < w->model->n.group; g++)
        dofs -= (size_t)w->data->rank[g];
    return dofs;
}

void kt_kkt_restrict(const kt_kkt *w, size_t columns, const double *x, double *z) {
    KT_BY_ISA(w->model->isa, , kt_kkt_restrict, (w, kt_kkt_dofs(w), columns, x, z));
}
