/* The structural rank of each constraint group: how many of its equations are independent at generic positions.
 *
 * Off the manifold redundant equations seem independent (Bricard's five of rank four). At singular positions
 * independent equations seem redundant. Therefore ranks are determined at several generic positions on the manifold,
 * and the largest counts. Equations whose rows and residuals vanish at all of them (the out-of-plane ones of a planar
 * loop) are void and are not evaluated again. If some of the other equations are redundant, a choice is made at the
 * position with the largest last direction. The chosen equations get a weight, by which they are chosen everywhere,
 * unless they are much shorter there (group.h).
 */
#include "closure/levenberg_marquardt.h"
#include "closure/rounding.h"
#include "compile/compile.h"
#include "compile/rounded.h"
#include "dynamics/dynamics.h"
#include "kinetree/loop.h"
#include "reduction/delassus.h"
#include "reduction/front4.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 7 };

#define FRACTION_LEAST 1e-3 /* of a displacement; a smaller one is not reduced any more */

/* The results of the samples: for each equation, whether it is nontrivial (not void); for each group, whether any
 * position was closed, and its ranks. */
typedef struct samples {
    double *q;        /* three positions; the third of each group's links where its rank was found */
    double *fraction; /* of the displacements, from which a group closes */
    double *near;     /* a displacement that the equations allow */
    bool *alive, *sampled;
    bool *open, *seen; /* groups that no sample closes; those of them that one closes except for a disagreement */
    bool *chosen;      /* KT_ROWS_COUNT times the equations: at the best position of each group */
    int32_t *rank;     /* KT_ROWS_COUNT a group */
    int32_t *cap;      /* KT_ROWS_COUNT times the steps of fronts: independent equations up to there */
    double *usual;     /* likewise: the largest size of the last one */
} samples;

/* A step that moves the coordinates of groups by up to `size` and the group's fraction of their units. */
static void scatter(const kt_model *model, double size, const double *fraction, size_t sample, double *step) {
    memset(step, 0, model->n.v * sizeof *step);
    for (size_t g = 0; g < model->n.group; g++)
        for (size_t i = (size_t)model->group[g].v, end = i + (size_t)model->group[g].v_count; i < end; i++)
            step[model->group_v[i]] = fraction[g] * size * model->unit[i] * kt_generic(i + 131 * sample);
}

/* The entries and residuals of a void equation, relative to its scale. */
static double void_size(const kt_model *model) { return fmax(1e-12, model->rounding); }

/* Marks the equations of a group that are nontrivial as last filled: the row or the residual is not zero. */
static void note_alive(const kt_model *model, const kt_group *group, const kt_group_work *w, bool *alive) {
    for (int32_t row = 0; row < group->row_count; row++) {
        const int32_t r = model->slot[group->row + row];
        double largest = 0.0;
        for (int i = 0; i < w->m; i++)
            largest = fmax(largest, fabs(w->a[(size_t)r * (size_t)w->m + (size_t)i]) * model->unit[group->v + i]);
        if (fmax(largest, fabs(w->residual[r])) > void_size(model) * w->scale[r])
            alive[group->row + row] = true;
    }
}

/* The same for a group that is reduced by fronts, whose A is not at hand: A x for some generic x. (The generic
 * numbers alone would not do: the differences between them repeat.) */
static void note_alive_front(const kt_model *model, kt_data *data, size_t g, bool *alive) {
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
            if (fabs(kt_group_products(&w)[r]) > void_size(model) * fmax(w.scale[r], w.work[r]) ||
                fabs(w.residual[r]) > void_size(model) * w.scale[r])
                alive[group->row + row] = true;
        }
    }
}

/* Marks the equations that depend on time, too: if no motion can satisfy one, that is reported at the time when it
 * happens. */
static void note_driven(const kt_model *model, const kt_group *group, bool *alive) {
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        for (int r = 0; r < loop->row_count && kt_loop_is_driven(loop); r++)
            alive[group->row + loop->row + r] = true;
    }
}

/* Assigns slots to the nontrivial equations of a group, in their order, those with a residual first. The others get
 * -1. */
static void place_rows(kt_model *model, const kt_data *data, size_t g, const bool *alive) {
    kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    int32_t *slot = model->slot + group->row, count = 0;
    double *closes = w.work; /* by row, because slots change */
    for (int32_t row = 0; row < group->row_count; row++)
        closes[row] = slot[row] < 0 ? 0.0 : w.closes[slot[row]];
    for (int pass = 0; pass < 2; pass++) {
        for (int32_t row = 0; row < group->row_count; row++)
            if (alive[group->row + row] && (closes[row] == 0.0) == (pass == 1))
                slot[row] = count++;
        if (!pass)
            group->count[KT_ROWS_CLOSED] = count;
    }
    group->count[KT_ROWS_ALL] = count;
    for (int32_t row = 0; row < group->row_count; row++)
        if (!alive[group->row + row])
            slot[row] = -1;
}

/* Stores the largest rank so far, and for it the largest size of the last direction; returns whether this sample has
 * them. */
static bool note_rank(int32_t rank, double last, int32_t *most, double *usual) {
    if (rank < *most || (rank == *most && !(last > *usual)))
        return false;
    *usual = last;
    *most = rank;
    return true;
}

/* Stores the results of a sample for a group that is reduced by fronts. If this sample has the `best` rank of all so
 * far, the rank up to each step and the chosen equations are stored. The size of each step's last direction is the
 * largest of all samples. */
static void note_steps(const kt_model *model, const kt_data *data, const kt_group *group, int rows, bool best,
                       samples *found) {
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
static void note_chosen(const kt_model *model, const kt_group *group, const kt_group_work *w, int32_t rank,
                        bool *chosen) {
    for (int32_t row = 0; row < group->row_count; row++) {
        chosen[group->row + row] = false;
        for (int32_t i = 0; i < rank; i++)
            chosen[group->row + row] |= model->slot[group->row + row] == w->pivot[i];
    }
}

/* Copies the positions of a group's links. */
static void keep_position(const kt_model *model, const kt_group *group, const double *q, double *to) {
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

/* Factors the equations, those to be closed before all, which may be the same. Returns false if a number is not
 * finite. */
static bool factor_all_groups(const kt_model *model, kt_data *data, int rows) {
    return (rows == KT_ROWS_ALL && all_close(model)) || model->group_kernels->factor(model, data, (kt_rows)rows, false);
}

/* Whether a group is closed as last filled, except for rounding at the positions of the description. Coordinates that
 * have run away would permit larger rounding errors. */
static bool is_closed(const kt_model *model, const kt_data *data, size_t g) {
    return kt_group_is_closed(model, data, g, model->q0, KT_CLOSED_STEP);
}

/* Evaluates the groups that are closed at q. If not `closed`, evaluates the groups that no sample found closed.
 * These do not close, which assembly reports later; only the given position is available for them. */
static void sample_groups(kt_model *model, kt_data *data, const double *q, bool closed, samples *found) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    kt_violation violation;
    if (!kernels->residuals(model, data, 0.0, q, NULL, NULL, &violation))
        return;
    for (int rows = KT_ROWS_COUNT - 1; rows >= 0; rows--) {
        if (!factor_all_groups(model, data, rows))
            return;
        for (size_t g = 0; g < model->n.group; g++) {
            kt_group *group = &model->group[g];
            const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
            if (closed ? !is_closed(model, data, g) : found->sampled[g])
                continue;
            const bool best = note_rank(data->rank[g], data->last[g], &found->rank[KT_ROWS_COUNT * g + (size_t)rows],
                                        &group->usual[rows]);
            if (kt_group_has_fronts(group))
                note_steps(model, data, group, rows, best, found);
            else if (best && model->reduction->chooses)
                note_chosen(model, group, &w, data->rank[g], found->chosen + (size_t)rows * model->n.row);
            if (rows != KT_ROWS_ALL)
                continue;
            if (best)
                keep_position(model, group, q, found->q + 2 * model->n.q);
            found->sampled[g] = true;
            if (kt_group_has_fronts(group))
                note_alive_front(model, data, g, found->alive);
            else
                note_alive(model, group, &w, found->alive);
            note_driven(model, group, found->alive);
            for (int32_t row = 0; row < group->row_count && !closed; row++)
                found->alive[group->row + row] = true;
        }
    }
}

/* Reduces the displacements of the groups by fronts that have not closed; returns whether there are any. In a long
 * chain small rotations add up to large gaps, from which hundreds of steps may not lead back. */
static bool shrink_displacements(const kt_model *model, kt_data *data, double *fraction) {
    bool any = false;
    for (size_t g = 0; g < model->n.group; g++) {
        if (!kt_group_has_fronts(&model->group[g]) || is_closed(model, data, g) || fraction[g] < FRACTION_LEAST)
            continue;
        fraction[g] *= 0.25;
        any = true;
    }
    return any;
}

/* Closes the loops from the base, displaced by up to `size` and each group's fraction of that. */
static void take_sample(const kt_model *model, kt_data *data, double size, size_t sample, samples *found) {
    const double *base = found->q;
    double *q = found->q + model->n.q;
    do {
        scatter(model, size, found->fraction, sample, data->delta);
        kt_position_add(model, base, data->delta, q);
        (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_SAMPLE, q);
    } while (shrink_displacements(model, data, found->fraction));
}

/* ---- rounded data ------------------------------------------------------------------------------------------------ */

/* The factor by which motion may increase a disagreement that samples show. */
#define DISAGREEMENT_GROWTH 30.0

/* Whether a displacement of a group stays when the loops are closed after it. The displacement is one that the
 * equations allow at the base, by a share of their units. Equations that repeat each other leave the motion. The
 * equations of a linkage that is stretched and out of reach by a little allow it to first order alone; closing then
 * undoes it. */
static bool motion_stays(const kt_model *model, kt_data *data, size_t g, const double *base, samples *found) {
    static const double share = 0.03;
    const kt_reduction_kernels *kernels = model->group_kernels;
    const kt_group *group = &model->group[g];
    double *q = found->q + model->n.q, *allowed = data->delta, *step = data->scratch_v, *moved = data->moved_v;
    kt_violation violation;
    for (size_t sample = 0; sample < SAMPLES; sample++) {
        memset(found->fraction, 0, model->n.group * sizeof *found->fraction);
        found->fraction[g] = 1.0;
        scatter(model, share, found->fraction, sample, allowed);
        if (!kernels->residuals(model, data, 0.0, base, NULL, NULL, &violation) ||
            !kernels->prepare(model, data, KT_ROWS_CLOSED, false))
            return false;
        for (size_t h = 0; h < model->n.group; h++) {
            const kt_group_work w = kt_group_matrices(model, data, h, KT_ROWS_CLOSED);
            memset(w.residual, 0, (size_t)w.k * sizeof *w.residual);
        }
        kt_aim_nearest(model, data, allowed);
        if (!kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, step))
            return false;
        double before = 0.0, after = 0.0;
        for (size_t i = 0; i < model->n.v; i++)
            allowed[i] -= step[i];
        memcpy(step, allowed, model->n.v * sizeof *step); /* the search overwrites delta */
        kt_position_add(model, base, step, q);
        memcpy(found->near, step, model->n.v * sizeof *step);
        (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_SAMPLE, q);
        if (!is_closed(model, data, g))
            return false;
        kt_position_subtract(model, q, base, moved);
        for (int i = 0; i < group->v_count; i++) {
            const int32_t v = model->group_v[group->v + i];
            const double unit = model->unit[group->v + i] * model->unit[group->v + i];
            before += found->near[v] * found->near[v] / unit;
            after += found->near[v] * moved[v] / unit;
        }
        if (before > 1e-6 * share * share && !(after >= 0.98 * before))
            return false;
    }
    return true;
}

static void find_ranks(kt_model *model, kt_data *data, samples *found) {
    const size_t nq = model->n.q;
    double *base = found->q, *q = found->q + nq;
    memcpy(base, model->q0, nq * sizeof *base);
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = 1.0;
    if (isfinite(kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_STUBBORN, base)))
        for (size_t s = 0; s < SAMPLES; s++) {
            take_sample(model, data, s < 3 ? 0.3 : s < 6 ? 0.15 : 0.1, s, found);
            sample_groups(model, data, q, true, found);
        }
}

#if KT_HAS_SWITCHES
static bool is_bounded(const kt_model *model, size_t g) {
    const kt_group *group = &model->group[g];
    bool any = false;
    for (int32_t i = 0; i < group->loop_count; i++)
        any = any || model->loop[model->group_loop[group->loop + i]].side != KT_SIDE_NONE;
    return any;
}

/* Evaluates the groups that no sample found closed at generic positions next to the given one. Only groups with a
 * loop that bounds one side are evaluated. A drive may bring such a loop to its bound later. For example, a rope
 * hangs straight down on a cart and is stretched when the cart moves away. The given position may be singular, and
 * so may every position that comes nearest to closing the loop: there A' g = 0, with g the gaps. */
static void sample_bounds(kt_model *model, kt_data *data, samples *found) {
    double *q = found->q + model->n.q;
    memcpy(found->seen, found->sampled, model->n.group * sizeof *found->seen);
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = 1.0;
    for (size_t s = 0; s < 3; s++) {
        for (size_t g = 0; g < model->n.group; g++)
            found->sampled[g] = found->seen[g] || !is_bounded(model, g);
        scatter(model, 0.1, found->fraction, s, data->delta);
        kt_position_add(model, model->q0, data->delta, q);
        sample_groups(model, data, q, false, found);
    }
    memcpy(found->sampled, found->seen, model->n.group * sizeof *found->seen);
}
#endif

static double least_of(const kt_model *model, const kt_group *group, const kt_group_work *w);

/* Takes the equations of a group for as uncertain as the model's rounding. */
static void coarsen(kt_model *model, const kt_data *data, size_t g) {
    kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    for (int rows = 0; rows < KT_ROWS_COUNT; rows++)
        group->least[rows] = least_of(model, group, &w);
}

/* Notes the groups that close neither in a sample nor from the given position: those that do are hard to sample, and
 * their equations agree. */
static void note_open(kt_model *model, kt_data *data, samples *found) {
    model->disagreement = 0.0;
    memcpy(found->q, model->q0, model->n.q * sizeof *found->q);
    (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_STUBBORN, found->q);
    for (size_t g = 0; g < model->n.group; g++)
        found->open[g] = !found->sampled[g] && !is_closed(model, data, g);
}

/* The disagreement of the groups that no sample closes; 0 where one is larger than the tolerance. */
static double find_disagreement(kt_model *model, kt_data *data, samples *found) {
    double most = 0.0, *base = found->q;
    const bool *open = found->open;
    bool *seen = found->seen;
    memset(seen, 0, model->n.group * sizeof *seen);
    model->disagreement = model->rounding = model->tolerance;
    memcpy(base, model->q0, model->n.q * sizeof *base);
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = 1.0;
    (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_STUBBORN, base);
    for (size_t s = 0; s < SAMPLES; s++) {
        take_sample(model, data, s < 3 ? 0.3 : s < 6 ? 0.15 : 0.1, s, found);
        for (size_t g = 0; g < model->n.group; g++)
            if (open[g] && is_closed(model, data, g)) {
                most = fmax(most, kt_group_note_disagreement(model, data, g));
                seen[g] = true;
            }
    }
    for (size_t g = 0; g < model->n.group; g++)
        most = open[g] && !seen[g] ? 0.0 : most;
    return most;
}

static void forget_disagreement(kt_model *model, size_t g) {
    const kt_group *group = &model->group[g];
    for (int i = 0; i < group->loop_count; i++) {
        kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        loop->disagreement[0] = loop->disagreement[1] = 0.0;
    }
}

/* Deletes the results of samples for a group. */
static void forget(kt_model *model, const kt_data *data, size_t g, samples *found) {
    found->sampled[g] = false;
    found->rank[KT_ROWS_COUNT * g] = found->rank[KT_ROWS_COUNT * g + 1] = 0;
    model->group[g].usual[0] = model->group[g].usual[1] = 0.0;
    coarsen(model, data, g);
}

/* Whether a group closes in a sample, and moves from a position. */
static bool group_moves(kt_model *model, kt_data *data, size_t g, const double *base, samples *found) {
    return found->sampled[g] && motion_stays(model, data, g, base, found);
}

/* Whether a group that nothing drives closes in places where it does not move, as one does whose equations repeat each
 * other except for rounding. */
static bool is_locked(const kt_model *model, size_t g, const samples *found) {
    const kt_group *group = &model->group[g];
    for (int i = 0; i < group->loop_count; i++)
        if (kt_loop_is_driven(&model->loop[model->group_loop[group->loop + i]]))
            return false;
    return found->sampled[g] && found->rank[KT_ROWS_COUNT * g + KT_ROWS_CLOSED] == group->v_count &&
           group->count[KT_ROWS_CLOSED] == group->count[KT_ROWS_ALL];
}

/* Corrects the ends of a group's loops so that their equations repeat each other to the last digit. Sets *done if
 * such corrections are found and the mechanism then moves. The motion is tried at a sample, since bars may lie in
 * line at the given position. Returns KT_OK or KT_ERROR_MEMORY. */
static kt_status undo_rounding(kt_model *model, kt_data *data, size_t g, samples *found, bool *done) {
    const double rounding = model->rounding;
    kt_pose *given = malloc(2 * model->n.loop * sizeof *given);
    *done = false;
    if (!given)
        return KT_ERROR_MEMORY;
    for (size_t i = 0; i < 2 * model->n.loop; i++)
        given[i] = model->loop[i / 2].frame[i % 2];
    memcpy(found->q, model->q0, model->n.q * sizeof *found->q);
    const kt_status status = kt_group_unround(model, data, g, found->q, done);
    model->rounding = rounding;
    if (*done) {
        forget(model, data, g, found);
        find_ranks(model, data, found);
        *done = group_moves(model, data, g, found->q + 2 * model->n.q, found);
        if (!*done) {
            kt_loops_place_ends(model, given);
            forget(model, data, g, found);
            find_ranks(model, data, found);
        }
    }
    if (!*done)
        forget_disagreement(model, g);
    free(given);
    return status;
}

/* Treats groups that close at no position, except for a disagreement below the tolerance: their equations repeat each
 * other, but their data are rounded. If no correction of the data is found, the groups count as closed up to the
 * disagreement that motion may cause. Directions that are not larger than this do not count. Returns KT_OK or
 * KT_ERROR_MEMORY. */
static kt_status accept_disagreement(kt_model *model, kt_data *data, samples *found) {
    const double rounding = model->rounding;
    kt_status status = KT_OK;
    bool any = false;
    note_open(model, data, found);
    for (size_t g = 0; status == KT_OK && g < model->n.group && model->tolerance > 0.0; g++) {
        bool undone = false;
        if (!found->sampled[g] || is_locked(model, g, found))
            status = undo_rounding(model, data, g, found, &undone);
        found->open[g] = !undone && found->open[g];
        any |= found->open[g];
    }
    if (status != KT_OK || !any)
        return status;
    const double most = find_disagreement(model, data, found);
    bool accepted = most > 0.0;
    model->disagreement = DISAGREEMENT_GROWTH * most;
    model->rounding = fmax(rounding, model->disagreement);
    for (size_t g = 0; g < model->n.group && accepted; g++)
        if (found->open[g])
            coarsen(model, data, g);
    if (accepted)
        find_ranks(model, data, found);
    for (size_t g = 0; g < model->n.group && accepted; g++)
        accepted = !found->open[g] || group_moves(model, data, g, found->q, found);
    if (accepted)
        return KT_OK;
    model->disagreement = 0.0;
    model->rounding = rounding;
    for (size_t g = 0; g < model->n.group; g++)
        if (found->open[g]) {
            forget_disagreement(model, g);
            forget(model, data, g, found);
        }
    return KT_OK;
}

/* Returns a lower bound of the size that the largest direction counts as. It is KT_RANK_FLOOR of the possible size, or
 * more if the rounding of the given lengths is larger, so that no direction of rounding counts. An entry of A can be as
 * large as the ratio of its row's unit to its coordinate's unit. Angles between bodies, however, do not depend on
 * lengths. Needs the equations' scales. */
static double least_of(const kt_model *model, const kt_group *group, const kt_group_work *w) {
    double longest = 0.0, of_lengths = 0.0, angles = 0.0;
    for (int i = 0; i < w->m && kt_group_has_fronts(group); i++)
        angles += model->unit[group->v + i] == 1.0;
    for (int r = 0; r < w->k; r++) {
        double sum = 0.0;
        if (kt_group_has_fronts(group))
            sum = w->scale[r] * w->scale[r] * angles + (w->scale[r] == model->length ? w->m - angles : 0.0);
        for (int i = 0; i < w->m && !kt_group_has_fronts(group); i++) {
            const double unit = model->unit[group->v + i], entry = w->scale[r] / unit;
            sum += unit == 1.0 || w->scale[r] == model->length ? entry * entry : 0.0;
        }
        longest = fmax(longest, sum);
        of_lengths = w->scale[r] == model->length ? fmax(of_lengths, sum) : of_lengths;
    }
    return fmax(KT_RANK_FLOOR * sqrt(longest), model->rounding / KT_RANK_TOLERANCE * sqrt(of_lengths));
}

/* Lets directions count down to `tolerance` of the largest. The absolute bound, `least` times KT_RANK_TOLERANCE,
 * remains. */
static void resolve(kt_group *group, int rows, double least, double tolerance) {
    group->least[rows] = least * (KT_RANK_TOLERANCE / tolerance);
    group->tolerance[rows] = tolerance;
}

/* Sets the initial values: all equations count, and ranks are as large as they can be. */
static void begin(kt_model *model, kt_data *data, bool *alive) {
    kt_violation violation;
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.row; i++)
        model->weight[i] = 1.0;
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.front; i++) {
        model->front_usual[i] = 1.0;
        model->front_cap[i] = INT32_MAX / 2;
    }
    memset(alive, 1, model->n.row * sizeof *alive);
    (void)model->group_kernels->residuals(model, data, 0.0, model->q0, NULL, NULL, &violation);
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        place_rows(model, data, g, alive);
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        const double least = least_of(model, group, &w);
        kt_form_choose_damped(model, group);
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++) {
            resolve(group, rows, least, KT_RANK_TOLERANCE);
            group->rank[rows] = group->count[rows] < group->v_count ? group->count[rows] : group->v_count;
        }
    }
    memset(alive, 0, model->n.row * sizeof *alive);
}

/* Gives the chosen equations of a group their weights. */
static void prefer(kt_model *model, const kt_group *group, int rows, const samples *found) {
    const size_t first = (size_t)rows * model->n.row + (size_t)group->row;
    for (int32_t row = 0; row < group->row_count; row++)
        if (model->slot[group->row + row] >= 0)
            model->weight[first + (size_t)model->slot[group->row + row]] =
                found->chosen[first + (size_t)row] ? KT_PREFERRED : 1.0;
}

static void finish(kt_model *model, const kt_data *data, const samples *found) {
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.front; i++) {
        model->front_usual[i] = found->usual[i];
        model->front_cap[i] = found->cap[i];
    }
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        place_rows(model, data, g, found->alive);
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++) { /* void equations contribute rounding errors only */
            const int32_t rank = found->rank[KT_ROWS_COUNT * g + (size_t)rows];
            group->rank[rows] = rank < group->count[rows] ? rank : group->count[rows];
            group->usual[rows] = !group->rank[rows] ? 0.0 : kt_group_has_fronts(group) ? 1.0 : group->usual[rows];
            resolve(group, rows, group->least[rows], rows == KT_ROWS_CLOSED ? KT_RANK_CLOSED : KT_RANK_MOVING);
            prefer(model, group, rows, found);
        }
    }
    if (model->n.front) {
        kt_fronts_find_delays(model);
        kt_groups_place_matrices(model);
    }
    kt_armature_note(model);
    kt_forms_choose(model);
}

/* Fronts choose among the equations of a step and the delayed equations of earlier steps. Without weights all equations
 * are delayed as far as possible, so that dependent equations are compared at the same step. The equations chosen there
 * get the weight. */
static kt_status choose_among_delayed(kt_model *model, samples *found, kt_error *error) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    const double *q = found->q + 2 * model->n.q;
    kt_violation violation;
    kt_data *data = NULL;
    bool any = false;
    for (size_t g = 0; g < model->n.group; g++)
        any = any || model->group[g].front.delayed_most;
    const kt_status status = any ? kt_data_create(model, &data, error) : KT_OK;
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.row && data; i++)
        model->weight[i] = 1.0;
    bool done = data && kernels->residuals(model, data, 0.0, q, NULL, NULL, &violation);
    for (int rows = KT_ROWS_COUNT - 1; rows >= 0 && done; rows--) {
        done = factor_all_groups(model, data, rows);
        for (size_t g = 0; g < model->n.group && done; g++)
            if (model->group[g].front.delayed_most && data->rank[g] == model->group[g].rank[rows])
                note_steps(model, data, &model->group[g], rows, true, found);
    }
    for (size_t i = 0; i < KT_ROWS_COUNT * model->n.front && data; i++)
        model->front_usual[i] = found->usual[i];
    for (size_t g = 0; g < model->n.group && data; g++)
        for (int rows = 0; rows < KT_ROWS_COUNT; rows++)
            prefer(model, &model->group[g], rows, found);
    kt_data_free(data);
    return status;
}

/* Opens LAPACK if a group is so large that its factorisation calls it; an error names the group's first loop. */
static kt_status open_lapack(const kt_model *model, kt_error *error) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (kt_group_has_fronts(group) || group->v_count < model->reduction->large)
            continue;
        const kt_status status = model->reduction->open(error);
        if (status != KT_OK && error)
            (void)snprintf(error->where, sizeof error->where, "group of loop '%.40s', %d coordinates",
                           kt_loop_name(model, model->group_loop[group->loop]), (int)group->v_count);
        return status;
    }
    return KT_OK;
}

kt_status kt_groups_rank(kt_model *model, kt_error *error) {
    if (!model->n.group)
        return KT_OK;
    if (open_lapack(model, error) != KT_OK)
        return KT_ERROR_UNSUPPORTED;
    kt_data *data = NULL;
    samples found = {.q = malloc(3 * model->n.q * sizeof(double)),
                     .fraction = malloc(model->n.group * sizeof(double)),
                     .alive = calloc(model->n.row, sizeof(bool)),
                     .chosen = calloc(KT_ROWS_COUNT * model->n.row, sizeof(bool)),
                     .near = malloc((model->n.v + 1) * sizeof(double)),
                     .sampled = calloc(model->n.group, sizeof(bool)),
                     .open = calloc(model->n.group, sizeof(bool)),
                     .seen = calloc(model->n.group, sizeof(bool)),
                     .rank = calloc(model->n.group * KT_ROWS_COUNT, sizeof(int32_t)),
                     .cap = calloc(model->n.front * KT_ROWS_COUNT + 1, sizeof(int32_t)),
                     .usual = calloc(model->n.front * KT_ROWS_COUNT + 1, sizeof(double))};
    kt_status status = KT_OK;
    if (!found.q || !found.fraction || !found.alive || !found.chosen || !found.sampled || !found.rank || !found.near ||
        !found.open || !found.seen || !found.cap || !found.usual)
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    if (status == KT_OK)
        status = kt_data_create(model, &data, error);
    if (status == KT_OK) {
        begin(model, data, found.alive);
        memcpy(found.q + 2 * model->n.q, model->q0, model->n.q * sizeof *found.q);
        model->disagreement = model->tolerance; /* searches end where loops disagree by less */
        find_ranks(model, data, &found);
        if (accept_disagreement(model, data, &found) != KT_OK)
            status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "out of memory");
    }
    if (status == KT_OK) {
#if KT_HAS_SWITCHES
        sample_bounds(model, data, &found);
#endif
        sample_groups(model, data, model->q0, false, &found);
        finish(model, data, &found);
        status = choose_among_delayed(model, &found, error);
    }
    kt_data_free(data);
    free(found.usual);
    free(found.cap);
    free(found.rank);
    free(found.seen);
    free(found.open);
    free(found.near);
    free(found.sampled);
    free(found.chosen);
    free(found.alive);
    free(found.fraction);
    free(found.q);
    return status;
}
