/* The structural rank of each constraint group at several positions, near the given one, at which its loops close.
 *
 * The positions are displaced by generic steps, and closed again. At each position, the equations are factored. The
 * largest rank counts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/rank_samples.h"

#include "assembly/levenberg_marquardt.h"
#include "assembly/rounding.h"
#include "reduction/front4.h"

#include <string.h>

#define FRACTION_LEAST 1e-3 /* of a displacement; a smaller one is not reduced any more */

/* A step that moves the coordinates of groups by up to `size` and the group's fraction of their units. */
void kt_rank_scatter(const kt_model *model, double size, const double *fraction, size_t sample, double *step) {
    memset(step, 0, model->n.v * sizeof *step);
    for (size_t g = 0; g < model->n.group; g++)
        for (size_t i = (size_t)model->group[g].v, end = i + (size_t)model->group[g].v_count; i < end; i++)
            step[model->group_v[i]] = fraction[g] * size * model->unit[i] * kt_generic(i + 131 * sample);
}

/* The entries and residuals of a void equation, relative to its scale. */
static double vanishing_size(const kt_model *model) { return fmax(1e-12, model->rounding); }

/* Marks the equations of a group that are nontrivial as last filled: the row or the residual is not zero. */
static void mark_nontrivial_rows(const kt_model *model, const kt_group *group, const kt_group_work *w,
                                 bool *nontrivial) {
    for (int32_t row = 0; row < group->row_count; row++) {
        const int32_t r = model->slot[group->row + row];
        double largest = 0.0;
        for (int i = 0; i < w->m; i++)
            largest = fmax(largest, fabs(w->a[(size_t)r * (size_t)w->m + (size_t)i]) * model->unit[group->v + i]);
        if (fmax(largest, fabs(w->residual[r])) > vanishing_size(model) * w->scale[r])
            nontrivial[group->row + row] = true;
    }
}

/* As mark_nontrivial_rows, for a group that is reduced by fronts. Its A is not stored as a matrix, so that A x is
 * tested for some generic x. (A single set of generic numbers would not suffice: the differences between them repeat.)
 */
static void mark_nontrivial_front_rows(const kt_model *model, kt_data *data, size_t g, bool *nontrivial) {
    enum { VECTORS = 3 };
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    for (size_t s = 0; s < VECTORS; s++) {
        for (int i = 0; i < w.m; i++)
            data->scratch[model->group_v[group->v + i]] =
                model->unit[group->v + i] * kt_generic((size_t)i + 131 * s) * (2.0 + kt_generic((size_t)i * (size_t)i));
        model->group_kernels->apply(model, data, g, KT_ROWS_ALL, data->scratch, kt_group_products(&w), w.work);
        for (int32_t row = 0; row < group->row_count; row++) {
            const int32_t r = model->slot[group->row + row];
            if (fabs(kt_group_products(&w)[r]) > vanishing_size(model) * fmax(w.scale[r], w.work[r]) ||
                fabs(w.residual[r]) > vanishing_size(model) * w.scale[r])
                nontrivial[group->row + row] = true;
        }
    }
}

/* Marks the equations that depend on time, too: if no motion can satisfy such an equation at some time, the run reports
 * this at that time. */
static void mark_driven_rows(const kt_model *model, const kt_group *group, bool *nontrivial) {
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        for (int r = 0; r < loop->row_count && kt_loop_is_driven(loop); r++)
            nontrivial[group->row + loop->row + r] = true;
    }
}

/* Stores the largest rank so far, and for this rank the largest size of the last direction; returns whether this sample
 * has both. */
static bool update_largest_rank(int32_t rank, double last, int32_t *most, double *usual) {
    if (rank < *most || (rank == *most && !(last > *usual)))
        return false;
    *usual = last;
    *most = rank;
    return true;
}

/* Stores the results of a sample for a group that is reduced by fronts. If this sample has the `best` rank of all so
 * far, the rank up to each step and the chosen equations are stored. The size of each step's last direction is the
 * largest of all samples. */
void kt_rank_store_steps(const kt_model *model, const kt_data *data, const kt_group *group, int rows, bool best,
                         kt_rank_samples *found) {
    const size_t first = (size_t)rows * model->n.front + (size_t)group->front.step;
    const kt_front_count *count = data->front + group->front.step;
    bool *chosen = found->chosen + (size_t)rows * model->n.row;
    int32_t rank = 0;
    for (int32_t s = 0; s < group->link_count; s++) {
        rank += count[s].rank;
        found->cap[first + (size_t)s] = best ? rank : found->cap[first + (size_t)s];
        found->usual[first + (size_t)s] = fmax(found->usual[first + (size_t)s], count[s].last);
    }
    const kt_group_work w = kt_group_matrices(model, data, (size_t)(group - model->group), KT_ROWS_ALL);
    for (int32_t slot = 0; slot < w.k; slot++)
        w.work[slot] = 0.0;
    for (int32_t s = 0; s < group->link_count; s++)
        for (int32_t i = 0; i < count[s].rank; i++)
            w.work[w.pivot[count[s].first + i]] = 1.0;
    for (int32_t row = 0; row < group->row_count && best; row++)
        chosen[group->row + row] = model->slot[group->row + row] >= 0 && w.work[model->slot[group->row + row]] > 0.0;
}

/* Stores which equations were chosen in the last factorisation. */
static void mark_chosen_equations(const kt_model *model, const kt_group *group, const kt_group_work *w, int32_t rank,
                                  bool *chosen) {
    for (int32_t row = 0; row < group->row_count; row++) {
        chosen[group->row + row] = false;
        for (int32_t i = 0; i < rank; i++)
            chosen[group->row + row] |= model->slot[group->row + row] == w->pivot[i];
    }
}

/* Copies the positions of a group's links. */
static void store_position(const kt_model *model, const kt_group *group, const double *q, double *to) {
    for (int l = 0; l < group->link_count; l++) {
        const kt_link *link = &model->link[model->group_link[group->link + l]];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        const size_t count = (size_t)motion.plain + 4 * (size_t)motion.quaternions;
        memcpy(to + link->q, q + link->q, count * sizeof *to);
    }
}

/* Whether all equations of all groups have a residual to be closed. */
static bool all_close(const kt_model *model) {
    for (size_t g = 0; g < model->n.group; g++)
        if (model->group[g].count[KT_ROWS_CLOSED] < model->group[g].count[KT_ROWS_ALL])
            return false;
    return true;
}

/* Factors the equations, first the equations to be closed, then all equations, unless both sets are equal. Returns
 * false if a number is not finite. */
bool kt_rank_factor(const kt_model *model, kt_data *data, int rows) {
    return (rows == KT_ROWS_ALL && all_close(model)) || model->group_kernels->factor(model, data, (kt_rows)rows, false);
}

/* Whether a group is closed as last filled, except for rounding at the positions of the description. Coordinates that
 * have run away would permit larger rounding errors. */
bool kt_rank_is_closed(const kt_model *model, const kt_data *data, size_t g) {
    return kt_group_is_closed(model, data, g, model->q0, KT_CLOSED_STEP);
}

/* Evaluates the groups that are closed at q. Without `closed`, evaluates the groups that no sample found closed, for
 * which only the given position is available. Assembly later reports that these groups do not close. */
void kt_rank_sample_groups(kt_model *model, kt_data *data, const double *q, bool closed, kt_rank_samples *found) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    kt_violation violation;
    if (!kernels->residuals(model, data, 0.0, q, NULL, NULL, &violation))
        return;
    for (int rows = KT_ROWS_COUNT - 1; rows >= 0; rows--) {
        if (!kt_rank_factor(model, data, rows))
            return;
        for (size_t g = 0; g < model->n.group; g++) {
            kt_group *group = &model->group[g];
            const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
            if ((closed ? !kt_rank_is_closed(model, data, g) : found->sampled[g]) ||
                (found->places && !found->placed[g]))
                continue;
            const bool best = update_largest_rank(data->rank[g], data->last[g],
                                                  &found->rank[KT_ROWS_COUNT * g + (size_t)rows], &group->usual[rows]);
            if (group->has_fronts)
                kt_rank_store_steps(model, data, group, rows, best, found);
            else if (best && model->reduction->chooses)
                mark_chosen_equations(model, group, &w, data->rank[g], found->chosen + (size_t)rows * model->n.row);
            if (rows != KT_ROWS_ALL)
                continue;
            if (best)
                store_position(model, group, q, found->q + 2 * model->n.q);
            found->sampled[g] = true;
            if (group->has_fronts)
                mark_nontrivial_front_rows(model, data, g, found->nontrivial);
            else
                mark_nontrivial_rows(model, group, &w, found->nontrivial);
            mark_driven_rows(model, group, found->nontrivial);
            for (int32_t row = 0; row < group->row_count && !closed; row++)
                found->nontrivial[group->row + row] = true;
        }
    }
}

/* Reduces the displacements of the groups by fronts that have not closed; returns whether such groups exist. In a long
 * chain small rotations add up to large gaps, from which hundreds of steps may not lead back. */
static bool shrink_displacements(const kt_model *model, kt_data *data, double *fraction) {
    bool any = false;
    for (size_t g = 0; g < model->n.group; g++) {
        if (!model->group[g].has_fronts || kt_rank_is_closed(model, data, g) || fraction[g] < FRACTION_LEAST)
            continue;
        fraction[g] *= 0.25;
        any = true;
    }
    return any;
}

/* Closes the loops from the base, displaced by up to `size` and each group's fraction of that. */
void kt_rank_take_sample(const kt_model *model, kt_data *data, double size, size_t sample, kt_rank_samples *found) {
    const double *base = found->q;
    double *q = found->q + model->n.q;
    do {
        kt_rank_scatter(model, size, found->fraction, sample, data->delta);
        kt_position_add(model, base, data->delta, q);
        (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_SAMPLE, q);
    } while (shrink_displacements(model, data, found->fraction));
}

/* Returns a lower bound of the size that the largest direction counts as. The bound is KT_RANK_FLOOR of the possible
 * size, or more if the rounding of the given lengths is larger, so that no direction of rounding counts. An entry of A
 * can be as large as the ratio of its row's unit to its coordinate's unit. Angles between bodies, however, do not
 * depend on lengths. The entries of a balanced group are scaled to at most 1. Needs the equations' scales. */
double kt_rank_least(const kt_model *model, const kt_group *group, const kt_group_work *w) {
    double longest = 0.0, of_lengths = 0.0, angles = 0.0;
    for (int i = 0; i < w->m && group->has_fronts; i++)
        angles += model->unit[group->v + i] == 1.0;
    for (int r = 0; r < w->k; r++) {
        double sum = 0.0;
        if (group->has_fronts)
            sum = w->scale[r] * w->scale[r] * angles + (w->scale[r] == model->length ? w->m - angles : 0.0);
        for (int i = 0; i < w->m && group->balanced; i++)
            sum += 1.0;
        for (int i = 0; i < w->m && !group->has_fronts && !group->balanced; i++) {
            const double unit = model->unit[group->v + i], entry = w->scale[r] / unit;
            sum += unit == 1.0 || w->scale[r] == model->length ? entry * entry : 0.0;
        }
        longest = fmax(longest, sum);
        of_lengths = w->scale[r] == model->length ? fmax(of_lengths, sum) : of_lengths;
    }
    return fmax(KT_RANK_FLOOR * sqrt(longest), model->rounding / KT_RANK_TOLERANCE * sqrt(of_lengths));
}

/* Takes the equations of a group for as uncertain as the model's rounding. */
void kt_rank_coarsen(kt_model *model, const kt_data *data, size_t g) {
    kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    for (int rows = 0; rows < KT_ROWS_COUNT; rows++)
        group->least[rows] = kt_rank_least(model, group, &w);
}

void kt_rank_find(kt_model *model, kt_data *data, kt_rank_samples *found) {
    const size_t nq = model->n.q;
    double *base = found->q, *q = found->q + nq;
    memcpy(base, model->q0, nq * sizeof *base);
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = 1.0;
    if (isfinite(kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_STUBBORN, base)))
        for (size_t s = 0; s < KT_RANK_SAMPLES; s++) {
            kt_rank_take_sample(model, data, kt_rank_sample_size(s), s, found);
            kt_rank_sample_groups(model, data, q, true, found);
        }
}

static bool is_bounded(const kt_model *model, size_t g) {
    const kt_group *group = &model->group[g];
    bool any = false;
    for (int32_t i = 0; i < group->loop_count; i++)
        any = any || model->loop[model->group_loop[group->loop + i]].side != KT_SIDE_NONE;
    return any;
}

/* Evaluates the groups that no sample found closed at generic positions near the given position. Only groups with a
 * loop that bounds one side are evaluated. A drive may bring such a loop to its bound later. For example, a rope
 * hangs straight down on a cart and is stretched when the cart moves away. The given position may be singular, and so
 * may every position that comes nearest to closing the loop, since A' g = 0 at such a position, with the gaps g. */
void kt_rank_sample_bounds(kt_model *model, kt_data *data, kt_rank_samples *found) {
    double *q = found->q + model->n.q;
    memcpy(found->seen, found->sampled, model->n.group * sizeof *found->seen);
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = 1.0;
    for (size_t s = 0; s < 3; s++) {
        for (size_t g = 0; g < model->n.group; g++)
            found->sampled[g] = found->seen[g] || !is_bounded(model, g);
        kt_rank_scatter(model, 0.1, found->fraction, s, data->delta);
        kt_position_add(model, model->q0, data->delta, q);
        kt_rank_sample_groups(model, data, q, false, found);
    }
    memcpy(found->sampled, found->seen, model->n.group * sizeof *found->seen);
}
