/* Queries about the loops of a model as a whole. */
#include "kinetree/mechanism.h"
#include "model/model.h"

int kt_loop_group_count(const kt_model *model) { return model ? (int)model->n.group : 0; }

kt_loop_group kt_loop_group_at(const kt_model *model, int group) {
    static const char *const reasons[] = {
#define QUERY_REASON(id, words) words,
        KT_FORM_REASON_LIST(QUERY_REASON)
#undef QUERY_REASON
    };
    if (!model || !KT_IS_INDEX(group, model->n.group))
        return (kt_loop_group){.loops = NULL};
    const kt_group *g = &model->group[group];
    return (kt_loop_group){.loop_count = g->loop_count,
                           .loops = model->group_loop + g->loop,
                           .coordinates = g->v_count,
                           .equations = g->row_count,
                           .rank = g->rank[KT_ROWS_ALL],
                           .form = g->form,
                           .reason = reasons[g->reason]};
}

kt_mobility kt_model_mobility(const kt_model *model) {
    if (!model)
        return (kt_mobility){0, 0, 0, 0};
    kt_mobility f = {.tree = (int)model->n.v};
    for (size_t g = 0; g < model->n.group; g++) {
        f.equations += model->group[g].row_count;
        f.rank += model->group[g].rank[KT_ROWS_ALL];
    }
    f.minimal = f.tree - f.rank;
    return f;
}
