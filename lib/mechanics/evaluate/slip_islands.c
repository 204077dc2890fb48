/* The memory of contacts that slip, island by island.
 *
 * A force in one island (kt_group.island) changes no acceleration in another. Therefore normal forces, directions of
 * slow slip and derivatives are computed for one island after the other, in arrays that have room for the largest
 * island. Memory grows with the number of islands, and not with its square. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/evaluate.h"
#include "evaluate/slip.h"

#include <string.h>

KT_ARENA_LAYOUT(lay_out_slip, kt_slip_problem, SLIP_FIELDS, size_t n, size_t most, const kt_counts *count)
KT_ARENA_ARRAYS(lay_out_slow, kt_slip_problem, SLIP_SLOW_FIELDS, size_t n, size_t most)

size_t kt_slip_size(const kt_counts *n) {
    const size_t most = kt_slip_most(n);
    return lay_out_slip(NULL, n->slip, most, n) + lay_out_slow(NULL, NULL, n->slip, most);
}

/* Sorts the contacts by islands. */
static void sort_contacts(const kt_model *model, kt_slip_problem *p) {
    size_t first = 0;
    if (model->n.group == 1) { /* the order of the loops */
        for (size_t k = 0; k < model->n.slip; k++)
            p->order[k] = (int)k;
        p->island[0] = (kt_slip_island){.n = model->n.slip};
        p->islands = 1;
        return;
    }
    p->islands = 0;
    memset(p->place, 0, model->n.group * sizeof *p->place);
    for (size_t k = 0; k < model->n.slip; k++)
        p->place[model->group[p->contact[k].loop->group].island]++;
    for (size_t g = 0; g < model->n.group; g++) {
        const size_t n = (size_t)p->place[g];
        p->place[g] = (int)first;
        if (n > 0)
            p->island[p->islands++] = (kt_slip_island){.index = (int32_t)g, .first = first, .n = n};
        first += n;
    }
    for (size_t k = 0; k < model->n.slip; k++)
        p->order[p->place[model->group[p->contact[k].loop->group].island]++] = (int)k;
}

/* The effect with a source; the search begins behind the effect `last`, or NULL: loops have the order of effects. */
static const kt_effect_record *next_effect(const kt_model *model, const kt_effect_record *last, int source) {
    const kt_effect_record *end = model->effect + model->n.effect + model->n.effect_off;
    return last != NULL && last + 1 < end && last[1].source == source ? last + 1 : kt_effect_record_find(model, source);
}

/* Lists the contacts that slip. */
static void find_contacts(const kt_model *model, kt_slip_problem *p) {
    kt_slip_contact *next = p->contact;
    const kt_effect_record *effect = NULL;
    for (size_t i = 0; i < model->n.loop && next < p->contact + model->n.slip; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (loop->slips > 0)
            *next++ = (kt_slip_contact){loop, effect = next_effect(model, effect, loop->slips - 1)};
    }
    sort_contacts(model, p);
    p->is_sorted = false;
    p->wedged = model->n.slip;
    p->loops = model->loop;
    p->effects = model->effect;
    p->slips = model->slips;
}

void kt_slip_init(const kt_model *model, kt_data *data) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    const size_t most = kt_slip_most(&model->n), used = lay_out_slip(p, model->n.slip, most, &model->n);
    (void)lay_out_slow(p, data->slip_work + used, model->n.slip, most);
    p->slow_time = 0.0;
    find_contacts(model, p);
}

void kt_slip_begin(const kt_model *model, kt_data *data) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    if (p->slips != model->slips || p->loops != model->loop || p->effects != model->effect)
        find_contacts(model, p); /* data serve all models of one shape */
    else if (p->is_sorted)
        sort_contacts(model, p);
    p->is_sorted = false;
}

/* Selects the part of the solution of the present contacts. */
static void select_solution(kt_slip_problem *p) {
    const size_t first = p->at->first;
    p->to = *p->all;
    p->to.mode += first;
    p->to.e += first;
    p->to.p += 3 * first;
    p->to.u += 3 * first;
}

void kt_slip_select(const kt_model *model, kt_slip_problem *p, kt_slip_island *island) {
    p->at = island;
    p->W_at = p->W + 9 * kt_slip_most(&model->n) * island->first;
    p->stride = 3 * island->n;
    if (island->is_slow)
        select_solution(p);
}

/* Lets two contacts of the present island change places. */
static void swap_contacts(kt_slip_problem *p, size_t i, size_t j) {
    int *order = p->order + p->at->first;
    const int contact = order[i];
    order[i] = order[j];
    order[j] = contact;
    for (size_t r = 0; r < 3; r++) {
        for (size_t k = 0; k < p->stride; k++)
            kt_coulomb_swap(p->W_at + (3 * i + r) * p->stride + k, p->W_at + (3 * j + r) * p->stride + k);
        for (size_t k = 0; k < p->stride; k++)
            kt_coulomb_swap(p->W_at + k * p->stride + 3 * i + r, p->W_at + k * p->stride + 3 * j + r);
    }
}

/* Contact i of the new order is contact coupled[i] of the old one, which may have changed places before. */
int kt_slip_sort_blocks(const kt_data *data, kt_slip_problem *p) {
    const int blocks = p->at->n > 1 ? kt_slip_list_blocks(data, p) : 1;
    p->end[blocks - 1] = (int)p->at->n;
    for (size_t i = 0; blocks > 1 && i < p->at->n; i++) {
        size_t j = (size_t)p->coupled[i];
        while (j < i)
            j = (size_t)p->coupled[j];
        if (j != i)
            swap_contacts(p, i, j);
    }
    p->is_sorted = p->is_sorted || blocks > 1;
    return blocks;
}

void kt_slip_select_block(const kt_model *model, kt_slip_problem *p, kt_slip_island *island, int block) {
    const size_t begin = block > 0 ? (size_t)p->end[block - 1] : 0;
    kt_slip_select(model, p, island);
    p->block = *island;
    p->block.first += begin;
    p->block.n = (size_t)p->end[block] - begin;
    p->at = &p->block;
    p->W_at += 3 * begin * (p->stride + 1);
    select_solution(p);
}

void kt_slip_begin_slow(const kt_model *model, kt_slip_problem *p) {
    p->all = kt_coulomb_solution_init(model->n.slip, 3 * model->n.slip, p->solution);
}
