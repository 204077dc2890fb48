/* Masks: models of sets of contacts between none and all.
 *
 * kt_model_compile makes a model of each set only for few contacts (compile/variants.c). A mask has its own loops, with
 * those of open contacts off, its own groups, and its own order of their equations. Everything else is shared with the
 * model in which all contacts are closed. The groups of that model have dense matrices, which factor any subset of
 * their equations.
 *
 * The number of independent equations of a group follows from the state at which contacts close, which satisfies these
 * equations. (compile/rank.c does the same at compilation, without such a state.) Loops that are switched on may have a
 * gap (simulation/switch.c), where redundant equations are independent. Such loops are closed first. The state may be a
 * singular position. If a nearby position has a larger rank, the loops are closed at this position, and the larger rank
 * counts. Among dependent equations, the choice at this position holds from now on.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/mask.h"

#include "assembly/levenberg_marquardt.h"
#include "base/generic.h"
#include "constraint/group.h"
#include "evaluate/evaluate.h"
#include "evaluate/slip.h"
#include "model/switching.h"
#include "reduction/kernel.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The distance of a position next to the state, in units of the coordinates; the residual of closed loops at this
 * position, relative to their scales. */
static const double near = 0.01, closed = 1e-9;

KT_ARENA_LAYOUT(lay_out, kt_mask, KT_MASK_FIELDS, const kt_counts *n, size_t effects, size_t groups)

/* The model in which all contacts are closed, which is the last variant; NULL if each set of contacts is compiled. */
static const kt_model *closed_model(const kt_model *model) {
    const bool masks = model->variants != NULL && model->variants->switches.masked != 0;
    return masks ? kt_variants_model(model->variants, kt_variants_count(model->variants) - 1) : NULL;
}

/* The number of effects that a mask has as copies. A mask needs copies if friction of joints may slip backwards, since
 * its direction is a number of the effect. */
static size_t count_of_effects(const kt_model *all) {
    return all->variants->switches.back != 0 ? all->n.effect + all->n.effect_off : 0;
}

/* The largest count of groups: a loop that is switched on may join some. */
static size_t count_of_groups(const kt_model *all) {
    size_t count = 0;
    for (uint64_t k = 0; k < kt_variants_count(all->variants); k++) {
        const size_t groups = kt_variants_model(all->variants, k)->n.group;
        count = groups > count ? groups : count;
    }
    return count;
}

static size_t lay_out_mask(void *memory, const kt_model *all) {
    return lay_out(memory, &all->n, count_of_effects(all), count_of_groups(all));
}

size_t kt_mask_size(const kt_model *model) {
    const kt_model *all = closed_model(model);
    return all != NULL ? lay_out_mask(NULL, all) : 0;
}

/* The largest count of the ranks and usual sizes of all groups, and of the weights. */
static size_t count_of_ranks(const kt_model *all) { return KT_ROWS_COUNT * (2 * count_of_groups(all) + all->n.row); }

size_t kt_mask_ranks_size(const kt_model *model) {
    const kt_model *all = closed_model(model);
    return all != NULL ? count_of_ranks(all) * sizeof(double) : 0;
}

kt_mask *kt_mask_init(const kt_model *model, void *memory) {
    const kt_model *all = closed_model(model);
    return all != NULL && lay_out_mask(memory, all) > 0 ? memory : NULL;
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* Sets the loops, as in the compiler (compile/attach.c): a loop that is off is in no group and has no rows. */
static void set_loops(kt_mask *mask) {
    kt_model *model = &mask->model;
    memcpy(mask->loop, mask->all->loop, model->n.loop * sizeof *mask->loop);
    model->n.row = 0;
    for (size_t i = 0; i < model->n.loop; i++) {
        kt_loop_record *loop = &mask->loop[i];
        if (kt_loop_is_off(loop) || mask->open[i]) {
            loop->group = loop->term_count = -1;
            loop->row_count = 0;
        }
        loop->equation = (int32_t)model->n.row;
        model->n.row += (size_t)loop->row_count;
    }
}

/* Sets slip: a contact with friction that is closed, and does not stick, slips. Normal forces of more contacts than
 * velocities are not unique: only a trial (kt_contacts_model) has so many, and its friction does not act. */
static void set_slip(kt_mask *mask) {
    kt_model *model = &mask->model;
    for (size_t i = 0; i < model->n.loop; i++) {
        kt_loop_record *contact = &mask->loop[i];
        bool sticks = false;
        for (size_t k = 0; contact->rubs > 0 && k < model->n.loop; k++)
            sticks = sticks || (mask->loop[k].friction == contact->rubs && !kt_loop_is_off(&mask->loop[k]));
        const bool slips = contact->rubs > 0 && !kt_loop_is_off(contact) && !sticks && model->n.slip < model->n.v;
        contact->slips = slips ? contact->rubs : 0;
        if (contact->slips > 0)
            kt_slip_add(model);
    }
}

/* Sets the directions of friction of joints: forwards, backwards, or no force if the friction sticks or is released. */
static void set_friction(kt_mask *mask, uint64_t set) {
    kt_model *model = &mask->model;
    const size_t count = count_of_effects(mask->all);
    if (count == 0)
        return;
    memcpy(mask->effect, mask->all->effect, count * sizeof *mask->effect);
    model->effect = mask->effect;
    for (size_t i = 0; i < model->n.loop; i++) {
        const int effect = model->loop[i].friction - 1;
        if (effect < 0 || model->loop[i].type != KT_LOOP_RATES)
            continue;
        const bool is_back = (set & kt_switch_bits(model, kt_effect_switch(model, effect))) != 0;
        mask->loop[i].released = false; /* the set decides whether it is released, and not the description */
        for (size_t k = 0; k < count; k++)
            if (mask->effect[k].source == effect) {
                mask->effect[k].idle = (set & kt_switch_bits(model, kt_loop_switch(model, (int)i))) != 0;
                mask->effect[k].direction = is_back ? -1.0 : 1.0;
            }
    }
}

/* ---- groups ------------------------------------------------------------------------------------------------------ */

/* Sets the slots of the remaining equations, in their order among all equations: those with a residual come first. */
static void set_slots(kt_mask *mask, const kt_group *from, kt_group *group) {
    int32_t *slot = mask->slot + group->row;
    double *next = mask->weight + group->row;
    group->count[KT_ROWS_ALL] = group->count[KT_ROWS_CLOSED] = 0;
    for (int32_t r = 0; r < group->row_count; r++) {
        next[r] = slot[r] < 0 ? -1.0 : 0.0;
        for (int32_t k = 0; slot[r] >= 0 && k < group->row_count; k++)
            next[r] += slot[k] >= 0 && slot[k] < slot[r];
        group->count[KT_ROWS_ALL] += slot[r] >= 0;
        group->count[KT_ROWS_CLOSED] += slot[r] >= 0 && slot[r] < from->count[KT_ROWS_CLOSED];
    }
    for (int32_t r = 0; r < group->row_count; r++)
        slot[r] = (int32_t)next[r];
}

/* Sets the loops of a group that are on, and their equations. */
static void set_group(kt_mask *mask, const kt_group *from, int32_t row, kt_group *group) {
    *group = *from;
    group->row = row;
    group->row_count = group->loop_count = 0;
    for (int32_t i = from->loop; i < from->loop + from->loop_count; i++) {
        const int index = mask->all->group_loop[i];
        kt_loop_record *loop = &mask->loop[index];
        if (kt_loop_is_off(loop))
            continue;
        const int32_t *slot = mask->all->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            mask->slot[row + group->row_count + r] = slot[r];
        loop->slot = row + group->row_count;
        loop->row = group->row_count;
        group->row_count += loop->row_count;
        mask->group_loop[group->loop + group->loop_count++] = index;
    }
    set_slots(mask, from, group);
    for (int rows = 0; rows < KT_ROWS_COUNT; rows++) {
        group->rank[rows] = group->count[rows] < group->v_count ? group->count[rows] : group->v_count;
        group->usual[rows] = 0.0;
    }
}

/* Sets the groups of a masked model, which have the equations of closed contacts only, and lays their matrices out. */
static void set_groups(kt_mask *mask) {
    kt_model *model = &mask->model;
    int32_t row = 0;
    model->n.dense = 0;
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &mask->group[g];
        set_group(mask, &mask->all->group[g], row, group);
        row += group->row_count;
        group->dense = model->n.dense;
        model->n.dense += kt_group_layout(group);
    }
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.row; i++)
        mask->weight[i] = 1.0;
}

void kt_mask_make(kt_mask *mask, const kt_model *all, uint64_t set) {
    kt_model *model = &mask->model;
    mask->all = all;
    *model = *all;
    model->set = set;
    model->loop = mask->loop;
    model->group = mask->group;
    model->group_loop = mask->group_loop;
    model->slot = mask->slot;
    model->weight = mask->weight;
    set_loops(mask);
    set_friction(mask, set);
    set_slip(mask);
    set_groups(mask);
    kt_model_seal(model);
}

/* ---- ranks ------------------------------------------------------------------------------------------------------- */

/* Stores the rank and the chosen equations of the group that was factored last, if this rank is the largest so far. */
static void take_rank(kt_mask *mask, const kt_data *data, size_t g, int rows, int32_t *rank) {
    const kt_model *model = &mask->model;
    kt_group *group = &mask->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, (kt_rows)rows);
    double *weight = mask->weight + (size_t)rows * model->n.row + group->row;
    if (data->rank[g] < *rank || (data->rank[g] == *rank && !(data->last[g] > group->usual[rows])))
        return;
    *rank = data->rank[g];
    group->usual[rows] = data->last[g];
    for (int r = 0; r < w.k; r++)
        weight[r] = 1.0;
    for (int i = 0; i < *rank; i++)
        weight[w.pivot[i]] = KT_PREFERRED;
}

/* Evaluates the equations at q. Returns the largest gap relative to its scale; infinity if it is not finite. */
static double evaluate_gap(const kt_mask *mask, kt_data *data, double t, const double *q) {
    kt_violation violation;
    return mask->model.group_kernels->residuals(&mask->model, data, t, q, NULL, NULL, &violation) ? violation.gap
                                                                                                  : HUGE_VAL;
}

/* Measures the ranks of all groups where the equations were evaluated. rank: the largest ranks so far (KT_ROWS_COUNT a
 * group), replaced if `takes`. Returns whether any rank is larger than before. */
static bool measure(kt_mask *mask, kt_data *data, double gap, bool takes, int32_t *rank) {
    const kt_reduction_kernels *kernels = mask->model.group_kernels;
    bool larger = false;
    if (!(gap < HUGE_VAL))
        return false;
    for (int rows = KT_ROWS_COUNT - 1; rows >= 0; rows--) {
        if (!kernels->factor(&mask->model, data, (kt_rows)rows, false))
            return false;
        for (size_t g = 0; g < mask->model.n.group; g++) {
            larger = larger || data->rank[g] > rank[KT_ROWS_COUNT * g + (size_t)rows];
            if (takes)
                take_rank(mask, data, g, rows, &rank[KT_ROWS_COUNT * g + (size_t)rows]);
        }
    }
    return larger;
}

/* Finds a position next to q, with all loops closed if `closes`. Returns whether the loops are closed. */
static bool find_near_position(kt_mask *mask, kt_data *data, double t, const double *q, bool closes) {
    const kt_model *model = &mask->model;
    memset(data->delta, 0, model->n.v * sizeof *data->delta);
    for (size_t i = 0; i < model->n.group_v; i++)
        data->delta[model->group_v[i]] = near * model->unit[i] * kt_generic(i);
    kt_position_add(model, q, data->delta, mask->q);
    return !closes || kt_assemble_levenberg_marquardt(model, data, t, NULL, KT_SEARCH_SAMPLE, mask->q) <= closed;
}

/* Returns a position at which the loops close that are open at q; q if there is none. */
static const double *closed_position(kt_mask *mask, kt_data *data, double t, const double *q) {
    memcpy(mask->closed_q, q, mask->model.n.q * sizeof *q);
    const double gap = kt_assemble_levenberg_marquardt(&mask->model, data, t, NULL, KT_SEARCH_GIVEN, mask->closed_q);
    return gap <= closed ? mask->closed_q : q;
}

void kt_mask_rank(kt_mask *mask, kt_data *data, double t, const double *q) {
    assert(kt_data_serve(&mask->model, data) && isfinite(t));
    int32_t *rank = mask->rank;
    for (size_t i = 0; i < KT_ROWS_COUNT * mask->model.n.group; i++)
        rank[i] = 0;
    double gap = evaluate_gap(mask, data, t, q);
    if (gap > closed && gap < HUGE_VAL) {
        q = closed_position(mask, data, t, q);
        gap = evaluate_gap(mask, data, t, q);
    }
    (void)measure(mask, data, gap, true, rank);
    (void)find_near_position(mask, data, t, q, false);
    if (measure(mask, data, evaluate_gap(mask, data, t, mask->q), false, rank) &&
        find_near_position(mask, data, t, q, true))
        (void)measure(mask, data, evaluate_gap(mask, data, t, mask->q), true, rank);
    for (size_t g = 0; g < mask->model.n.group; g++)
        for (size_t rows = 0; rows < KT_ROWS_COUNT; rows++)
            mask->group[g].rank[rows] = rank[KT_ROWS_COUNT * g + rows];
}

void kt_mask_take_ranks(const kt_mask *mask, double *ranks) {
    for (size_t g = 0; g < mask->model.n.group; g++)
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++) {
            *ranks++ = mask->group[g].rank[rows];
            *ranks++ = mask->group[g].usual[rows];
        }
    memcpy(ranks, mask->weight, KT_ROWS_COUNT * mask->model.n.row * sizeof *ranks);
}

bool kt_mask_ranks_fit(const kt_mask *mask, const double *ranks) {
    bool fit = true;
    for (size_t g = 0; g < mask->model.n.group; g++)
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++, ranks += 2)
            fit = fit && ranks[0] >= 0.0 && ranks[0] <= mask->group[g].rank[rows] && ranks[1] >= 0.0 &&
                  ranks[1] < HUGE_VAL;
    for (size_t i = 0; i < KT_ROWS_COUNT * mask->model.n.row; i++)
        fit = fit && ranks[i] > 0.0 && ranks[i] < HUGE_VAL;
    return fit;
}

void kt_mask_put_ranks(kt_mask *mask, const double *ranks) {
    assert(kt_mask_ranks_fit(mask, ranks));
    for (size_t g = 0; g < mask->model.n.group; g++)
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++) {
            mask->group[g].rank[rows] = (int32_t)*ranks++;
            mask->group[g].usual[rows] = *ranks++;
        }
    memcpy(mask->weight, ranks, KT_ROWS_COUNT * mask->model.n.row * sizeof *ranks);
}
