/* Assembly [MSD 8.5]: the closed state nearest to the given one.
 *
 * With d = u - u_given, |d|^2 is minimised subject to phi(u) = 0. If the given state is far from closed, the loops are
 * closed first (levenberg_marquardt.c). The search then follows the manifold. The tangential part of d, (1 - A+ A) d,
 * can still be reduced. If it vanishes, d is normal to the manifold. The step is d_new - d, where d_new is the least
 * solution of
 *
 *   A d_new = A d - phi
 *
 * If phi = 0, the step is minus the tangential part. Steps are scaled after Barzilai & Borwein (1988) and shortened
 * until |d| falls. Fixed coordinates have no column in A.
 *
 * The velocity equations are linear: dv is the least solution of A dv = b' - A v.
 *
 * Coordinates that must be held are fixed. Coordinates whose value the description gives are fixed, too, in every group
 * that closes without moving them. In all other groups, given coordinates may move. A change of 1 is then d_k =
 * weight_k y_k, and |y|^2 is minimised: a coordinate that is not given moves NOT_GIVEN times as easily as a given
 * coordinate, so that its start value has almost no influence. Steps are computed for y, with A weight for A.
 *
 * Moving given coordinates least may lead to the boundary of the reachable positions, such as a stretched chain. Such a
 * boundary is a singular position. If the result is near a singular position, all coordinates of the groups get equal
 * weights.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/levenberg_marquardt.h"
#include "assembly/open_loops.h"
#include "assembly/rounding.h"

#include "dynamics/dynamics.h"
#include "joint/joint.h"
#include "model/scratch.h"

#include <string.h>

/* Halvings of a step, and further searches of a least change of given values. */
enum { SHORTER_MOST = 12, FURTHER = 2 };

/* The minimised sum contains the changes of start values with a share of 1 / NOT_GIVEN^2 (move_given_least). */
#define NOT_GIVEN 30.0

/* The velocities that move only if their group cannot be closed otherwise. */
enum { VELOCITY_GIVEN = KT_VELOCITY_GIVEN | KT_VELOCITY_KEPT };

static double square(const double *x, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sum;
}

void kt_aim_nearest(const kt_model *model, kt_data *data, const double *d) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_CLOSED);
        if (group->has_fronts) {
            model->group_kernels->apply(model, data, g, KT_ROWS_CLOSED, d, w.right, NULL);
            for (int r = 0; r < w.k; r++)
                w.right[r] -= w.residual[r];
            continue;
        }
        for (int r = 0; r < w.k; r++) {
            w.right[r] = -w.residual[r];
            for (int i = 0; i < w.m; i++)
                w.right[r] += w.a[(size_t)r * (size_t)w.m + (size_t)i] * d[model->group_v[group->v + i]];
        }
    }
}

/* ---- fixed coordinates ------------------------------------------------------------------------------------------- */

/* The coordinates to be held, by positions or velocities. */
static const bool *held_of(const kt_model *model, unsigned given) {
    return given == KT_POSITION_GIVEN ? model->held : model->held_velocity;
}

/* Fixes the coordinates to be held. In groups with other, free coordinates, it also fixes those whose value is `given`
 * (KT_POSITION_GIVEN, VELOCITY_GIVEN). Returns whether any given coordinate is fixed. */
static bool fix_given(const kt_model *model, unsigned given, bool *fixed) {
    const bool *held = held_of(model, given);
    bool any = false;
    memcpy(fixed, held, model->n.v * sizeof *fixed);
    for (size_t g = 0; g < model->n.group; g++) {
        const int32_t *v = model->group_v + model->group[g].v;
        bool has_given = false, has_others = false;
        for (int i = 0; i < model->group[g].v_count; i++) {
            has_given |= !held[v[i]] && (model->given[v[i]] & given);
            has_others |= !held[v[i]] && !(model->given[v[i]] & given);
        }
        for (int i = 0; i < model->group[g].v_count && has_given && has_others; i++)
            fixed[v[i]] |= (model->given[v[i]] & given) != 0;
        any |= has_given && has_others;
    }
    return any;
}

static bool keeps_given(const kt_model *model, unsigned given, const bool *fixed) {
    return memcmp(fixed, held_of(model, given), model->n.v * sizeof *fixed) != 0;
}

static void release_coordinates(const kt_model *model, const kt_group *group, unsigned given, bool *fixed) {
    for (int i = 0; i < group->v_count; i++)
        fixed[model->group_v[group->v + i]] = held_of(model, given)[model->group_v[group->v + i]];
}

/* Gives weights to the coordinates of a group, larger weights to coordinates that are not given. Groups with fronts
 * have equal weights, because their equations are not stored as a matrix. */
static bool set_group_weights(const kt_model *model, const kt_group *group, unsigned given, double *weight) {
    const kt_rows rows = given == KT_POSITION_GIVEN ? KT_ROWS_CLOSED : KT_ROWS_ALL;
    if (group->has_fronts || group->rank[rows] >= group->v_count) /* nothing to choose */
        return false;
    for (int i = 0; i < group->v_count; i++) {
        const int32_t v = model->group_v[group->v + i];
        weight[v] = model->unit[group->v + i] * (model->given[v] & given ? 1.0 : NOT_GIVEN);
    }
    return true;
}

/* Closes positions without moving given positions. In groups that remain open, given positions may move, and
 * coordinates get weights. Returns whether any group has weights. */
static bool close_around_given(const kt_model *model, kt_data *data, double t, const double *given, double *q,
                               bool *fixed, double *weight) {
    bool weighted = false;
    for (size_t k = 0; k < model->n.v; k++)
        weight[k] = 1.0;
    if (!fix_given(model, KT_POSITION_GIVEN, fixed))
        return false;
    (void)kt_assemble_levenberg_marquardt(model, data, t, fixed, KT_SEARCH_STUBBORN, q);
    for (size_t g = 0; g < model->n.group; g++) {
        if (kt_group_is_closed(model, data, g, q, KT_CLOSED_STEP))
            continue;
        kt_copy_group(model, &model->group[g], given, q);
        release_coordinates(model, &model->group[g], KT_POSITION_GIVEN, fixed);
        weighted |= set_group_weights(model, &model->group[g], KT_POSITION_GIVEN, weight);
    }
    return weighted;
}

/* ---- positions --------------------------------------------------------------------------------------------------- */

/* Multiplies the weights into the columns of A. */
static void apply_weights(const kt_model *model, kt_data *data, const double *weight) {
    for (size_t g = 0; g < model->n.group && weight; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        for (int i = 0; i < w.m && !group->has_fronts; i++)
            for (int r = 0; r < w.k; r++)
                w.a[(size_t)r * (size_t)w.m + (size_t)i] *= weight[model->group_v[group->v + i]];
    }
}

/* The state of an assembly that starts at `given` and has reached q; d = q - given, over the weights. */
typedef struct approach {
    const kt_model *model;
    kt_data *data;
    double t;
    const double *given;
    const bool *fixed;
    double *q, *d, *step; /* step: that of the linearised problem, over the weights */
    const double *weight; /* NULL: all are 1 */
    double *start;        /* changes that do not count, of coordinates that are not given; NULL: all changes count */
} approach;

/* (q - given - start) over the weights. */
static void weighted_change(const approach *a, const double *q, double *d) {
    kt_position_subtract(a->model, q, a->given, d);
    for (size_t k = 0; k < a->model->n.v && a->start; k++)
        d[k] -= a->start[k];
    for (size_t k = 0; k < a->model->n.v && a->weight; k++)
        d[k] /= a->weight[k];
}

/* Computes the step from q towards the nearest state; returns false if it cannot be computed. */
static bool find_assembly_step(const approach *a) {
    const kt_reduction_kernels *kernels = a->model->group_kernels;
    kt_violation violation;
    if (!kernels->residuals(a->model, a->data, a->t, a->q, NULL, a->fixed, &violation))
        return false;
    apply_weights(a->model, a->data, a->weight);
    if (!kernels->prepare(a->model, a->data, KT_ROWS_CLOSED, false))
        return false;
    weighted_change(a, a->q, a->d);
    kt_aim_nearest(a->model, a->data, a->d);
    if (!kernels->least_step(a->model, a->data, KT_METRIC_IDENTITY, a->model->zero, a->step))
        return false;
    for (size_t k = 0; k < a->model->n.v; k++)
        a->step[k] = a->fixed[k] ? 0.0 : a->step[k] - a->d[k];
    return true;
}

/* Takes the largest of the tried fractions of the step that brings q nearer to `given`; returns false if none does.
 * Close to the solution rounding errors hide the decrease of |d|, and the whole step is accepted. */
static bool line_search(const approach *a, double part) {
    const size_t nv = a->model->n.v;
    double *near = a->data->near_q, *part_of_step = a->data->moved_v;
    const double from = square(a->d, nv);
    const bool close = square(a->step, nv) < 1e-10 * from;
    for (int i = 0; i < SHORTER_MOST; i++) {
        for (size_t k = 0; k < nv; k++)
            part_of_step[k] = ldexp(part, -i) * a->step[k] * (a->weight ? a->weight[k] : 1.0);
        kt_position_move(a->model, a->fixed, a->q, part_of_step, near);
        const double gap = kt_assemble_levenberg_marquardt(a->model, a->data, a->t, a->fixed, KT_SEARCH_GIVEN, near);
        if (!kt_loops_are_closed(a->model, near, gap, KT_CLOSED_ASSEMBLED))
            continue;
        weighted_change(a, near, part_of_step);
        if (!close && !(square(part_of_step, nv) < from))
            continue;
        memcpy(a->q, near, a->model->n.q * sizeof *near);
        return true;
    }
    return false;
}

/* The largest entry of the step, relative to its unit; of all coordinates, or only of those with a nonlinear equation
 * (`of_nonlinear`). */
static double assembly_step_length(const approach *a, bool of_nonlinear) {
    double most = 0.0;
    for (size_t i = 0; i < a->model->n.group_v; i++) {
        const int32_t v = a->model->group_v[i];
        const double change = fabs(a->step[v]) * (a->weight ? a->weight[v] : 1.0);
        if (change > most * a->model->unit[i] && !(of_nonlinear && a->model->is_linear[i]))
            most = change / a->model->unit[i];
    }
    return most;
}

/* Moves q, which is closed, to the nearest closed state to `given` in its neighbourhood. */
static void nearest_on_manifold(const approach *a, double *before) {
    const size_t nv = a->model->n.v;
    kt_iterations *taken = &a->data->iterations;
    double part = 1.0;
    for (uint32_t i = 0; find_assembly_step(a); i++) {
        const double most = assembly_step_length(a, false), bounded = assembly_step_length(a, true);
        if (i) { /* the Barzilai-Borwein factor: the next step would vanish if the step kept changing at this rate */
            double change = 0.0;
            for (size_t k = 0; k < nv; k++)
                change += before[k] * (before[k] - a->step[k]);
            part = change > 0.0 ? fmin(fmax(part * square(before, nv) / change, 0.1), 10.0) : 1.0;
        }
        memcpy(before, a->step, nv * sizeof *before);
        if (bounded * part > 0.2) /* the linearisation is not valid farther away */
            part = 0.2 / bounded;
        if (!(most > 1e-11))
            return;
        if (i == KT_ASSEMBLY_STEPS_MAX ||
            !line_search(a, part)) { /* the state is closed, but another one may be nearer */
            taken->capped++;
            return;
        }
        taken->assembly = i + 1 > taken->assembly ? i + 1 : taken->assembly;
    }
}

/* Moves q, which is closed, to a closed state with the least change of given coordinates. With weights, changes of the
 * others have a share of 1 / NOT_GIVEN^2 in the sum. Each further search counts these changes from the state before it
 * (a proximal point), which multiplies their influence by that share. */
static void move_given_least(approach *a, double *start, double *before) {
    nearest_on_manifold(a, before);
    for (int i = 0; i < FURTHER && a->weight; i++) {
        kt_position_subtract(a->model, a->q, a->given, start);
        for (size_t k = 0; k < a->model->n.v; k++)
            start[k] = a->model->given[k] & KT_POSITION_GIVEN ? 0.0 : start[k];
        a->start = start;
        nearest_on_manifold(a, before);
    }
    a->start = NULL;
}

/* The directions of the equations, at the closed state, along which coordinates that are not given can move: how many,
 * and the size of the smallest, over all groups with weights. */
typedef struct free_directions {
    int rank;
    double least;
} free_directions;

/* Finds the rank of the equations in the coordinates whose positions are not given, and the size of the smallest
 * direction. Only groups with weighted coordinates count. */
static free_directions find_free_directions(const approach *a) {
    const kt_model *model = a->model;
    const kt_reduction_kernels *kernels = model->group_kernels;
    free_directions found = {0, HUGE_VAL};
    kt_violation violation;
    if (!kernels->residuals(model, a->data, a->t, a->q, NULL, a->fixed, &violation))
        return found;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, a->data, g, KT_ROWS_ALL);
        const int32_t *v = model->group_v + model->group[g].v;
        for (int i = 0; i < w.m && !model->group[g].has_fronts; i++)
            for (int r = 0; r < w.k && (model->given[v[i]] & KT_POSITION_GIVEN); r++)
                w.a[(size_t)r * (size_t)w.m + (size_t)i] = 0.0;
    }
    if (!kernels->prepare(model, a->data, KT_ROWS_CLOSED, false))
        return found;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        bool weighted = false;
        for (int i = 0; i < group->v_count; i++)
            weighted |= a->weight[model->group_v[group->v + i]] > model->unit[group->v + i];
        if (!weighted)
            continue;
        found.rank += a->data->rank[g];
        found.least = fmin(found.least, a->data->last[g]);
    }
    return found;
}

/* Whether a direction has been lost between two states, or nearly so. */
static bool loses_direction(free_directions from, free_directions to) {
    static const double part = 0.1;
    return to.rank < from.rank || to.least < part * from.least;
}

/* Closes the loops, and moves q to the nearest closed state to `given`. If the weights of coordinates that are not
 * given lead next to a singular position, the search begins again with equal weights. Gaps that remain within the
 * digits of the data are closed by moving given coordinates, and at last held ones, in their last digits. */
static kt_status assemble_positions(const kt_model *model, kt_data *data, double t, const double *given, double *q,
                                    kt_error *error) {
    bool *fixed = data->fixed;
    double *weight = kt_scratch_part(model, data, 3);
    approach a = {.model = model,
                  .data = data,
                  .t = t,
                  .given = given,
                  .fixed = fixed,
                  .q = q,
                  .d = kt_scratch_part(model, data, 0),
                  .step = kt_scratch_part(model, data, 1)};
    if (close_around_given(model, data, t, given, q, fixed, weight))
        a.weight = weight;
    double gap = kt_assemble_levenberg_marquardt(model, data, t, fixed, KT_SEARCH_STUBBORN, q);
    if (kt_loops_are_closed(model, q, gap, KT_CLOSED_ASSEMBLED)) {
        const free_directions before = a.weight ? find_free_directions(&a) : (free_directions){0, 0.0};
        move_given_least(&a, kt_scratch_part(model, data, 4), kt_scratch_part(model, data, 2));
        if (a.weight && loses_direction(before, find_free_directions(&a))) {
            a.weight = NULL;
            memcpy(q, given, model->n.q * sizeof *q);
            (void)kt_assemble_levenberg_marquardt(model, data, t, fixed, KT_SEARCH_STUBBORN, q);
            nearest_on_manifold(&a, kt_scratch_part(model, data, 2));
        }
        gap = kt_assemble_levenberg_marquardt(model, data, t, fixed, KT_SEARCH_GIVEN, q);
        /* A larger gap that is nearly closed comes from given values with fewer digits, and is closed by changing
         * these, too, in their last digits. */
        if (!kt_loops_are_closed(model, q, gap, KT_ROUNDING) && keeps_given(model, KT_POSITION_GIVEN, fixed))
            gap = kt_assemble_levenberg_marquardt(model, data, t, model->held, KT_SEARCH_GIVEN, q);
        if (kt_loops_are_closed(model, q, gap, KT_CLOSED_ASSEMBLED))
            return KT_OK;
    }
    if (gap <= model->tolerance) { /* held joints whose values are rounded move in their last digits */
        gap = kt_assemble_levenberg_marquardt(model, data, t, NULL, KT_SEARCH_GIVEN, q);
        if (kt_loops_are_closed(model, q, gap, KT_CLOSED_ASSEMBLED))
            return KT_OK;
    }
    return kt_open_loops_error(model, data, t,
                               "the loops cannot be closed from the given positions (they are out of reach, contradict "
                               "each other, or held joints prevent it); these stay open",
                               KT_OPEN_POSITIONS, error);
}

/* ---- velocities -------------------------------------------------------------------------------------------------- */

/* The velocities v at q, whose changes are least over the weights (NULL: all are 1). */
typedef struct velocity_aim {
    const kt_model *model;
    kt_data *data;
    double t;
    const double *q;
    double *v;
    const double *weight;
} velocity_aim;

/* Changes v by the least step that satisfies the velocity equations; fixed coordinates (NULL: none) do not change.
 * *violation is the remaining violation. *speed is the largest term of the equations, of which the violation may be a
 * rounding error. Returns false if a number is not finite. */
static bool close_initial_velocities(const velocity_aim *x, const bool *fixed, kt_violation *violation, double *speed) {
    const kt_model *model = x->model;
    kt_data *data = x->data;
    const kt_reduction_kernels *kernels = model->group_kernels;
    *speed = 0.0;
    for (int i = 0;; i++) { /* one step suffices in exact arithmetic */
        if (!kernels->residuals(model, data, x->t, x->q, x->v, fixed, violation))
            return false;
        *speed = fmax(violation->speed, *speed);
        if (i == 2 || violation->slip <= KT_CLOSED * violation->speed)
            return true;
        apply_weights(model, data, x->weight);
        if (!kernels->prepare(model, data, KT_ROWS_ALL, false) ||
            !kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, data->delta))
            return true;
        for (size_t k = 0; k < model->n.v; k++)
            x->v[k] += fixed && fixed[k] ? 0.0 : data->delta[k] * (x->weight ? x->weight[k] : 1.0);
    }
}

/* Whether the velocities of a group satisfy its equations; equations and `right` are filled for v. */
static bool group_fits_velocities(const kt_model *model, kt_data *data, size_t g, double t, const double *q,
                                  const double *v) {
    kt_violation violation = kt_violation_none;
    model->group_kernels->violate(model, data, g, v, &violation);
    return violation.slip <= KT_CLOSED_STEP * violation.speed ||
           kt_group_velocities_fit(model, data, g, t, q, v, KT_CLOSED_STEP);
}

/* The counterpart of close_around_given for velocities. Sets aim->weight to `weight` if any coordinates get weights. */
static bool move_around_given(velocity_aim *aim, bool *fixed, double *weight) {
    const kt_model *model = aim->model;
    kt_data *data = aim->data;
    double *given = data->moved_v, *v = aim->v, speed;
    kt_violation violation;
    for (size_t k = 0; k < model->n.v; k++)
        weight[k] = 1.0;
    if (!fix_given(model, VELOCITY_GIVEN, fixed))
        return true;
    memcpy(given, v, model->n.v * sizeof *v);
    if (!close_initial_velocities(aim, fixed, &violation, &speed) ||
        !model->group_kernels->residuals(model, data, aim->t, aim->q, v, NULL, &violation))
        return false;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (group_fits_velocities(model, data, g, aim->t, aim->q, v))
            continue;
        for (int i = 0; i < group->v_count; i++)
            v[model->group_v[group->v + i]] = given[model->group_v[group->v + i]];
        release_coordinates(model, group, VELOCITY_GIVEN, fixed);
        if (set_group_weights(model, group, VELOCITY_GIVEN, weight))
            aim->weight = weight;
    }
    return true;
}

/* Closes velocities, with the least change of given ones in groups with weights: the counterpart of move_given_least.
 * data->moved_v has the given velocities. */
static bool close_velocities_around_given(velocity_aim *aim, kt_violation *violation, double *speed) {
    const kt_model *model = aim->model;
    const bool *fixed = aim->data->fixed;
    bool finite = close_initial_velocities(aim, fixed, violation, speed);
    for (int i = 0; i < FURTHER && finite && aim->weight; i++) {
        for (size_t k = 0; k < model->n.v; k++)
            if (!fixed[k] && (model->given[k] & VELOCITY_GIVEN))
                aim->v[k] = aim->data->moved_v[k];
        finite = close_initial_velocities(aim, fixed, violation, speed);
    }
    return finite;
}

/* Makes v satisfy the velocity equations at q. Given velocities change only if the others cannot satisfy the equations,
 * and held velocities only within the model's tolerance. */
static kt_status assemble_velocities(const kt_model *model, kt_data *data, double t, const double *q, double *v,
                                     kt_error *error) {
    kt_violation violation;
    double speed; /* a residual velocity below the rounding error of this speed counts as zero */
    velocity_aim aim = {.model = model, .data = data, .t = t, .q = q, .v = v};
    bool finite = move_around_given(&aim, data->fixed, kt_scratch_part(model, data, 3)) &&
                  close_velocities_around_given(&aim, &violation, &speed);
    if (finite && violation.slip > KT_ROUNDING * speed && keeps_given(model, VELOCITY_GIVEN, data->fixed))
        finite = close_initial_velocities(&aim, model->held_velocity, &violation, &speed);
    if (!finite)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the initial velocities are too large");
    if (violation.slip <= KT_CLOSED_ASSEMBLED * speed)
        return KT_OK;
    const kt_reduction_kernels *kernels = model->group_kernels;
    if (kernels->residuals(model, data, t, q, v, NULL, &violation) &&
        kt_velocities_fit(model, data, t, q, v, KT_CLOSED_ASSEMBLED))
        return KT_OK; /* the violation is small relative to the speeds of fixed coordinates, too */
    if (violation.slip <= model->tolerance * speed && close_initial_velocities(&aim, NULL, &violation, &speed) &&
        kt_velocities_fit(model, data, t, q, v, KT_CLOSED_ASSEMBLED))
        return KT_OK; /* those that are held are rounded */
    (void)kernels->residuals(model, data, t, q, v, data->fixed, &violation);
    kt_velocity_gaps_least_squares(model, data);
    return kt_open_loops_error(model, data, t,
                               "the initial velocities contradict the loops; hold fewer joints, or make loops agree; "
                               "apart are",
                               KT_OPEN_VELOCITIES, error);
}

kt_status kt_loops_assemble(const kt_model *model, kt_data *data, double t, const double *given, double *q, double *v,
                            kt_error *error) {
    const kt_status status = assemble_positions(model, data, t, given, q, error);
    return status == KT_OK ? assemble_velocities(model, data, t, q, v, error) : status;
}
