/* Assembly from a state far from closed: Levenberg-Marquardt (Marquardt 1963),
 *   (B'B + mu tr(B'B) 1) dy = -B' r with mu lowered after a step that reduces |r| and raised after any other step.
 *   Unlike a step with QR, such a step needs no rank. This matters off the manifold, where redundant equations appear
 * independent, and contradictory equations have no solution.
 *
 * The residuals r and the coordinates y are relative to their scales (a radian, or the length of the loops). The size
 * of a mechanism, millimetres or kilometres, therefore makes no difference. A step changes a coordinate by at most half
 * its scale, unless all equations of the coordinate are linear (motions, couplings): then any step is right. Each group
 * is iterated independently of the others.
 *
 * In a long chain tr(B'B) grows with the cube of the length, and the least singular value of B does not. mu would have
 * to fall by decades more for each decade of links. The damping of a group that is reduced by fronts is therefore at
 * most GAP_DAMPING mu times the mean of r^2 over the coordinates (Yamashita & Fukushima 2001). With this damping, a
 * first step that closes all of the gap changes a coordinate by a third of its scale. A row of 10 to 1000 windows then
 * takes five steps instead of six to eleven.
 *
 * If links are reduced by fronts, Newton's method is tried first. The steps of Newton's method cost as much as those of
 * the projection after a step, which eliminates the equations. Damped steps, which eliminate none, cost up to ten times
 * as much. Newton's method counts only if each step is short and leaves at most a quarter of the gap. Otherwise the
 * search begins at the state before Newton's method. In a chain of thousands of links rounding errors bound the damping
 * from below. Then damped steps converge slowly, by a factor of 0.5 per step, while Newton's method doubles the digits.
 *
 * If |r| has a minimum above zero, or a saddle (a stretched chain that must fold to close), other starts are tried
 * around the given one.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/levenberg_marquardt.h"

#include "assembly/rounding.h"
#include "joint/joint.h"
#include "linear/cholesky.h"

#include <assert.h>
#include <string.h>

/* The most steps of a search, from another start, and for groups with fronts from a sample. Most groups that close at
 * all do so within ten steps. After these steps, Newton's method is tried on a sample once more. If the sample does not
 * close, a sample nearer to the given position is tried. With more than LONG links reduced by fronts, damped steps
 * converge so slowly that a sample from less far away takes less time. */
enum { STEPS_MOST = 400, STEPS_ELSEWHERE = 40, STEPS_OF_SAMPLE = 10, STARTS = 4, LONG = 500 };

#define NEWTON_REACH 0.1                  /* the longest step of Newton's method, in the coordinates' units */
#define NEWTON_ROUNDING (4e3 * KT_CLOSED) /* the gap that rounding errors may leave, as after a step */
#define BEGINNING 1e-3                    /* mu of the first step */
#define UNDAMPED 1e-13                    /* the least damping */
#define GAP_DAMPING (10.0 / BEGINNING)
#define HIDDEN 1e-14 /* by fronts: the least damping, relative to the mean square of an equation's row */

static const double scatter[STARTS] = {0.0, 0.1, 0.3, 1.0};

static double group_gap_of(const kt_group_work *w) {
    kt_violation violation = kt_violation_none;
    kt_group_position_residuals(w, &violation);
    return violation.gap;
}

/* The sum of the squares of the residuals in their scales, which the search reduces. */
static double squares(const kt_group_work *w) {
    double sum = 0.0;
    for (int r = 0; r < w->k; r++)
        sum += (w->residual[r] / w->scale[r]) * (w->residual[r] / w->scale[r]);
    return sum;
}

/* The noise level of an entry in the units of its row and coordinate (group.h). */
static const double noise = KT_RANK_TOLERANCE * KT_RANK_FLOOR;

/* The damped step of a group that is reduced by fronts. The damping is at most `most`, unless rounding errors hide a
 * damping so small. */
static bool damp_front(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const double *gap, double mu,
                       double most) {
    const kt_group *group = &model->group[g];
    const kt_reduction_kernels *kernels = model->group_kernels;
    const kt_group_work w = kt_group_matrices(model, data, g, rows);
    const double size = kernels->measure(model, data, g, rows), equation = size / (double)w.k;
    double damping = fmax(fmin(mu * size, fmax(most, HIDDEN * equation)), noise * noise);
    while (!kernels->damp(model, data, g, gap, damping, data->scratch)) {
        if (!(damping < mu * size))
            return false;
        damping *= 100.0;
    }
    for (int i = 0; i < w.m; i++)
        w.free[i] = data->scratch[model->group_v[group->v + i]] / model->unit[group->v + i];
    return true;
}

bool kt_damped_step(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const double *gap, double mu) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(mu >= 0.0);
    const kt_group *group = &model->group[g];
    const kt_group_work matrices = kt_group_matrices(model, data, g, rows), *w = &matrices;
    if (group->has_fronts)
        return damp_front(model, data, g, rows, gap, mu, (double)INFINITY);
    const size_t m = (size_t)w->m;
    const double *unit = model->unit + group->v;
    double *row = w->work, trace = 0.0;
    memset(w->reduced, 0, m * m * sizeof(double));
    memset(w->free, 0, m * sizeof(double));
    for (int r = 0; r < w->k; r++) {
        for (size_t i = 0; i < m; i++)
            row[i] = w->a[(size_t)r * m + i] * unit[i] / w->scale[r];
        for (size_t c = 0; c < m; c++) {
            w->free[c] -= row[c] * (gap[r] / w->scale[r]);
            for (size_t i = c; i < m && row[c] != 0.0; i++)
                w->reduced[c * m + i] += row[c] * row[i];
        }
    }
    for (size_t i = 0; i < m; i++)
        trace += w->reduced[i * (m + 1)];
    const double damping = fmax(mu * trace, noise * noise); /* rows that are noise alone give no step */
    for (size_t i = 0; i < m; i++)
        w->reduced[i * (m + 1)] += damping;
    if (!kt_dense_cholesky(w->reduced, (size_t)w->m, w->m, NULL))
        return false;
    kt_dense_solve(w->reduced, w->m, w->free);
    return true;
}

/* Writes dy of one group into step; writes nothing if the damped matrix is not positive definite. */
static void damped_step(const kt_model *model, kt_data *data, size_t g, double mu, double *step) {
    const kt_group *group = &model->group[g];
    const kt_group_work matrices = kt_group_matrices(model, data, g, KT_ROWS_CLOSED), *w = &matrices;
    const size_t m = (size_t)w->m;
    const double *unit = model->unit + group->v;
    double largest = 0.0;
    const double most = GAP_DAMPING * mu * data->gap[g] / (double)w->m;
    if (!(group->has_fronts ? damp_front(model, data, g, KT_ROWS_CLOSED, w->residual, mu, most)
                            : kt_damped_step(model, data, g, KT_ROWS_CLOSED, w->residual, mu)))
        return;
    for (size_t i = 0; i < m; i++)
        largest = fmax(largest, model->is_linear[(size_t)group->v + i] ? 0.0 : fabs(w->free[i]));
    const double shorter = largest > 0.5 ? 0.5 / largest : 1.0;
    for (size_t i = 0; i < m; i++)
        step[model->group_v[group->v + (int32_t)i]] = shorter * w->free[i] * unit[i];
}

void kt_copy_group(const kt_model *model, const kt_group *group, const double *from, double *to) {
    assert(from != to);
    for (int l = 0; l < group->link_count; l++) {
        const kt_link *link = &model->link[model->group_link[group->link + l]];
        memcpy(to + link->q, from + link->q, (size_t)kt_motion_facts_of(link->motion).positions * sizeof *to);
    }
}

/* The purpose of a search: to close the loops, or also to find the minimum of |r|, whose gap is reported. A sample of
 * ranks is to close, too, but may as well be taken nearer to a closed position. */
typedef enum purpose { TO_CLOSE, TO_SAMPLE, TO_TELL } purpose;

/* Whether the step of one group is accepted; its equations at the new state have been filled. data->damping is mu after
 * an accepted step, and -mu after a rejected one. */
static bool group_step_is_accepted(const kt_model *model, kt_data *data, size_t g, const kt_group_work *w,
                                   purpose asked) {
    const double before = data->gap[g], after = squares(w);
    /* If the gap alone damps the step, the step ends at a minimum at once. More damping would find it again and
     * again. */
    const bool least = model->group[g].has_fronts && after != before && fabs(after - before) <= 1e-10 * before;
    const bool rounding = before <= 1e-28 * (double)w->k;
    /* The disagreement of loops has a minimum somewhere along the motion that they leave. A search ends where it
     * reaches the disagreement. */
    const double gap = group_gap_of(w);
    if (after > 0.5 * before && gap > KT_CLOSED_STEP && gap <= model->disagreement) {
        data->settled[g] = true;
        return false;
    }
    const double mu = fabs(data->damping[g]);
    if (after < before) {
        /* Above the first mu, a step with less damping was rejected: steps creep along a valley to a minimum above
         * zero. (From a saddle mu falls first.) */
        const bool creeps = asked != TO_TELL && mu > BEGINNING && after > 0.99999 * before;
        data->damping[g] = fmax(mu * 0.1, UNDAMPED);
        data->gap[g] = after;
        data->settled[g] = least || creeps || group_gap_of(w) <= KT_CLOSED ||
                           (after > 0.99999 * before && data->damping[g] <= 1e-12) ||
                           (rounding && after > 0.5 * before);
        return true;
    }
    /* A sample of a long chain begins too far away if two steps in a row are rejected: the next ones would be short. */
    const bool is_far = asked == TO_SAMPLE && model->group[g].has_fronts && data->damping[g] < 0.0;
    /* Near closure, rounding errors hide the decrease of a damped step along a direction that is about to be lost. More
     * damping would only end the iteration there. If any step closes the gap in this direction, the undamped step
     * does. */
    const bool near = before <= 1e-24 * (double)w->k, undamped = mu <= UNDAMPED;
    data->damping[g] = near ? -UNDAMPED : -10.0 * mu;
    data->settled[g] = least || rounding || (is_far && !near) || (near && undamped) || 10.0 * mu > 1e12;
    return false;
}

/* Fills the equations at q. */
static bool begin_iteration(const kt_model *model, kt_data *data, double t, const bool *held, const double *q) {
    kt_violation violation;
    if (!model->group_kernels->residuals(model, data, t, q, NULL, held, &violation))
        return false;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_CLOSED);
        data->gap[g] = squares(&w);
        data->settled[g] = group_gap_of(&w) <= KT_CLOSED;
        data->damping[g] = BEGINNING;
    }
    return true;
}

/* Iterates until all groups are settled. Groups that are reduced by fronts iterate for at most `large` steps. q must be
 * finite, and remains finite. On return, the equations are filled at q. */
static void iterate_groups(const kt_model *model, kt_data *data, double t, const bool *held, int large, purpose asked,
                           double *q) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    kt_violation violation;
    for (int i = 0; i < STEPS_MOST; i++) {
        bool all = true, refill = false;
        memset(data->delta, 0, model->n.v * sizeof(double));
        for (size_t g = 0; g < model->n.group; g++) {
            data->settled[g] |= i >= large && model->group[g].has_fronts;
            all &= data->settled[g];
            if (!data->settled[g])
                damped_step(model, data, g, fabs(data->damping[g]), data->delta);
        }
        if (all)
            return;
        kt_position_move(model, held, q, data->delta, data->moved_q);
        (void)kernels->residuals(model, data, t, data->moved_q, NULL, held, &violation);
        for (size_t g = 0; g < model->n.group; g++) {
            const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_CLOSED);
            if (data->settled[g])
                continue;
            if (group_step_is_accepted(model, data, g, &w, asked))
                kt_copy_group(model, &model->group[g], data->moved_q, q);
            else
                refill = true;
        }
        if (refill)
            (void)kernels->residuals(model, data, t, q, NULL, held, &violation);
    }
}

/* Whether the largest change of a coordinate is short. */
static bool step_is_short(const kt_model *model, const double *step) {
    double most = 0.0;
    for (size_t i = 0; i < model->n.group_v; i++)
        most = fmax(most, fabs(step[model->group_v[i]]) / model->unit[i]);
    return most <= NEWTON_REACH;
}

/* Newton's method. Returns whether Newton's method closes the loops. If so, the equations and *violation belong to
 * q. */
static bool close_by_newton(const kt_model *model, kt_data *data, double t, const bool *held, double *q,
                            kt_violation *violation) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    double gap;
    bool fine = kernels->residuals(model, data, t, q, NULL, held, violation);
    while (fine && (gap = violation->gap) > KT_CLOSED) {
        kt_residuals_to_right_hand_side(model, data, KT_CLOSED);
        fine = kernels->prepare(model, data, KT_ROWS_CLOSED, false) &&
               kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, data->delta) &&
               step_is_short(model, data->delta);
        if (!fine)
            break;
        kt_position_move(model, held, q, data->delta, data->moved_q);
        fine = kernels->residuals(model, data, t, data->moved_q, NULL, held, violation);
        if (fine && violation->gap > 0.25 * gap) /* rounding errors dominate, or the state is too far away */
            return gap <= NEWTON_ROUNDING && kernels->residuals(model, data, t, q, NULL, held, violation);
        memcpy(q, data->moved_q, model->n.q * sizeof *q);
    }
    return fine;
}

/* Resets the groups that are not closed to their positions in `from`, displaced by up to scatter[start] of their
 * units. */
static void start_elsewhere(const kt_model *model, kt_data *data, const bool *held, const double *from, int start,
                            double *q) {
    memset(data->delta, 0, model->n.v * sizeof(double));
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (kt_group_is_closed(model, data, g, q, KT_CLOSED_ASSEMBLED))
            continue;
        kt_copy_group(model, group, from, q);
        for (int32_t i = group->v; i < group->v + group->v_count; i++)
            if (!held || !held[model->group_v[i]])
                data->delta[model->group_v[i]] =
                    scatter[start] * model->unit[i] * kt_generic((size_t)i + 131 * (size_t)start);
    }
    if (start) {
        kt_position_move(model, held, q, data->delta, data->moved_q);
        memcpy(q, data->moved_q, model->n.q * sizeof *q);
    }
}

double kt_assemble_levenberg_marquardt(const kt_model *model, kt_data *data, double t, const bool *held,
                                       kt_search search, double *q) {
    assert(kt_data_serve(model, data));
    assert(q != data->neighbour_q && q != data->moved_q);
    const kt_reduction_kernels *kernels = model->group_kernels;
    const int of_sample = model->n.front > LONG ? 0 : STEPS_OF_SAMPLE;
    double *from = data->neighbour_q;
    kt_violation violation;
    double least = (double)INFINITY;
    int best = 0;
    memcpy(from, q, model->n.q * sizeof *q);
    if (model->n.front && close_by_newton(model, data, t, held, q, &violation))
        return violation.gap;
    memcpy(q, from, model->n.q * sizeof *q);
    for (int start = 0; start <= STARTS; start++) { /* the last pass repeats the best start, to report its gap */
        const int at = start < STARTS ? start : best;
        if (start)
            start_elsewhere(model, data, held, from, at, q);
        if (!begin_iteration(model, data, t, held, q))
            return (double)INFINITY;
        iterate_groups(model, data, t, held,
                       at > 0                       ? STEPS_ELSEWHERE
                       : search == KT_SEARCH_SAMPLE ? of_sample
                                                    : STEPS_MOST,
                       search == KT_SEARCH_SAMPLE                       ? TO_SAMPLE
                       : search == KT_SEARCH_STUBBORN && start < STARTS ? TO_CLOSE
                                                                        : TO_TELL,
                       q);
        if (search == KT_SEARCH_SAMPLE && model->n.front && (of_sample > 0 || model->n.group > 1) &&
            close_by_newton(model, data, t, held, q, &violation))
            return violation.gap;
        if (!kernels->residuals(model, data, t, q, NULL, held, &violation))
            return (double)INFINITY;
        if (kt_loops_are_closed(model, q, violation.gap, KT_CLOSED_ASSEMBLED) || search != KT_SEARCH_STUBBORN)
            break;
        if (violation.gap < 0.999 * least) {
            least = violation.gap;
            best = start;
        }
    }
    return violation.gap;
}
