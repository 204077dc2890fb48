/* The memory of the self-stresses of groups (self_stress.h), and the order of the joints that they load. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/self_stress.h"

KT_ARENA_ARRAYS(lay_out_stress, kt_stress, KT_STRESS_FIELDS, const kt_stress *s)

enum { SINGULAR = 2 };

/* Bytes above which the reactions of a group are not shared: all data of a model have them, whether reactions are
 * requested or not. A row of twelve planar windows takes as many. */
static const size_t stress_bytes_most = (size_t)1 << 18;

int32_t kt_stress_number_joints(const kt_model *model, size_t g, int32_t *joint) {
    const kt_group *group = &model->group[g];
    int32_t count = 0, body;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < group->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
            kt_stress_path path = {{loop->body[0], loop->body[1]}};
            int end;
            while (kt_stress_shares(loop) && !loop->term_count && (body = kt_stress_path_next(model, &path, &end)) >= 0)
                if (!pass || joint[body] < 0)
                    joint[body] = pass ? count++ : -1;
        }
    return count;
}

/* The sizes of a group. The paths of its loops are counted whole, which is an upper bound of their joints. */
static kt_stress stress_sizes(const kt_model *model, const kt_group *group) {
    kt_stress s = {.m = (size_t)group->v_count};
    size_t joints = 0;
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        kt_stress_path path = {{loop->body[0], loop->body[1]}};
        int end;
        if (!kt_stress_shares(loop))
            continue;
        s.k += (size_t)loop->row_count;
        s.rows += KT_STRESS_LOOP;
        while (!loop->term_count && kt_stress_path_next(model, &path, &end) >= 0)
            joints++;
    }
    joints = joints < model->n.body ? joints : model->n.body;
    s.rows += KT_STRESS_JOINT * joints;
    const bool all = (int32_t)s.k == group->row_count;
    s.redundant = all ? s.k - (size_t)group->rank[KT_ROWS_ALL] : s.k;
    s.most = s.redundant + SINGULAR < s.k ? s.redundant + SINGULAR : s.k;
    return s;
}

kt_stress kt_stress_of(const kt_model *model, const kt_data *data, size_t g) {
    kt_stress s = stress_sizes(model, &model->group[g]);
    (void)lay_out_stress(&s, data->stress + model->group[g].stress, &s);
    return s;
}

/* The length of the longest loop of a group that is between frames. */
static double stress_length(const kt_model *model, const kt_group *group) {
    double longest = 0.0;
    for (int i = 0; i < group->loop_count; i++) {
        const double around = model->loop[model->group_loop[group->loop + i]].around;
        longest = around > longest ? around : longest;
    }
    return longest > 1e-12 * model->length ? longest : model->length;
}

/* Whether the equations of a planar group in its plane are all there, and independent. Then the redundant ones are out
 * of the plane. Their multipliers are forces along the normal and moments in the plane. */
static bool is_redundant_in_normal(const kt_model *model, const kt_group *group) {
    bool all = group->planar && group->rank[KT_ROWS_ALL] == group->count[KT_ROWS_ALL];
    for (int i = 0; i < group->loop_count && all; i++) {
        const int32_t index = model->group_loop[group->loop + i];
        const kt_loop_record *loop = &model->loop[index];
        const int count = loop->term_count ? loop->row_count : model->planar_loop[index].count;
        for (int r = 0; r < count; r++)
            all = all && model->slot[loop->slot + (loop->term_count ? r : model->planar_loop[index].row[r].row)] >= 0;
    }
    return all;
}

void kt_stress_plan(kt_model *model) {
    model->n.stress = 0;
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        const kt_stress s = stress_sizes(model, group);
        const size_t bytes =
            s.redundant > 0 && group->rank[KT_ROWS_ALL] < group->row_count ? lay_out_stress(NULL, NULL, &s) : 0;
        group->redundancy = bytes == 0                  ? KT_REDUNDANCY_NONE
                            : bytes > stress_bytes_most ? KT_REDUNDANCY_LARGE
                                                        : KT_REDUNDANCY_SHARED;
        group->stress_length = stress_length(model, group);
        group->is_redundant_in_normal = is_redundant_in_normal(model, group);
        group->stress = model->n.stress;
        model->n.stress += group->redundancy == KT_REDUNDANCY_SHARED ? bytes : 0;
    }
}
