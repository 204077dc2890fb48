/* Queries about the loops of a model as a whole, and about the records and ends of its effects. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/evaluate.h"
#include "kinetree/mechanism.h"

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

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* Searches among `count` effects in the description's order. */
static const kt_effect_record *find_among(const kt_effect_record *first, int32_t count, int source) {
    int32_t low = 0, high = count - 1;
    while (low < high) {
        const int32_t middle = (low + high) / 2;
        if (first[middle].source < source)
            low = middle + 1;
        else
            high = middle;
    }
    return count > 0 && first[low].source == source ? &first[low] : NULL;
}

/* The effects of a batch are in the description's order, and so are the effects that are off. */
const kt_effect_record *kt_effect_record_find(const kt_model *model, int source) {
    const kt_effect_record *found = NULL;
    for (size_t i = 0; i < model->n.batch && found == NULL; i++)
        found = find_among(model->effect + model->batch[i].first, model->batch[i].count, source);
    return found != NULL ? found : find_among(model->effect + model->n.effect, (int32_t)model->n.effect_off, source);
}

void kt_effect_ends_find(const kt_data *data, const kt_effect_record *effect, kt_effect_end end[2]) {
    for (int k = 0; k < effect->ends; k++) {
        const kt_link_kinematics *link = &data->kinematics[effect->link[k]];
        const kt_vec3 arm = kt_mat3_apply(link->axes, effect->frame[k].position);
        end[k].axes = kt_mat3_multiply(link->axes, effect->frame[k].rotation);
        end[k].point = kt_vec3_add(link->position, arm);
        end[k].omega = link->omega;
        end[k].velocity = kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm));
    }
}
