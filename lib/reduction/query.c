/* Queries about the loops of a model as a whole. */
#include "kinetree/reduction.h"
#include "reduction/kernel.h"

int kt_loop_group_count(const kt_model *model) { return (int)model->n.group; }

kt_loop_group kt_loop_group_at(const kt_model *model, int group) {
    const kt_group *g = &model->group[group];
    return (kt_loop_group){.loop_count = g->loop_count,
                           .loops = model->group_loop + g->loop,
                           .coordinates = g->v_count,
                           .equations = g->row_count,
                           .rank = g->rank[KT_ROWS_ALL]};
}

kt_mobility kt_model_mobility(const kt_model *model) {
    kt_mobility f = {.tree = (int)model->n.v};
    for (size_t g = 0; g < model->n.group; g++) {
        f.equations += model->group[g].row_count;
        f.rank += model->group[g].rank[KT_ROWS_ALL];
    }
    f.minimal = f.tree - f.rank;
    return f;
}

size_t kt_group_layout(kt_group *group) {
    const size_t m = (size_t)group->v_count, k = (size_t)group->row_count, s = m < k ? m : k;
    size_t used = 0, *at = group->at;
#define KT_GROUP_PLACE(name, count, meaning)                                                                           \
    *at++ = used;                                                                                                      \
    used += ((count) + 7) / 8 * 8;
    KT_GROUP_FIELDS(KT_GROUP_PLACE)
#undef KT_GROUP_PLACE
    return used;
}

const kt_reduction_kernels *kt_reduction_kernels_of(const kt_model *model) {
    if (model->sweep == KT_SWEEP_SPATIAL)
        return kt_reduction_kernels_in_space(model);
#ifdef KT_ISAS
    if (model->level == KT_ISA_V4)
        return &kt_reduction_planar_kernels_v4;
    if (model->level == KT_ISA_V3)
        return &kt_reduction_planar_kernels_v3;
#endif
    return &kt_reduction_planar_kernels_baseline;
}

const kt_reduction_kernels *kt_reduction_kernels_in_space(const kt_model *model) {
#ifdef KT_ISAS
    if (model->level == KT_ISA_V4)
        return &kt_reduction_kernels_v4;
    if (model->level == KT_ISA_V3)
        return &kt_reduction_kernels_v3;
#endif
    (void)model;
    return &kt_reduction_kernels_baseline;
}
