/* Hard contacts that slip, with Coulomb friction. The contact is a loop of the mechanism, whose multiplier is the
 * normal force N. Let s be the velocity of the lowest point of the sphere (or disc) against the plane. The force
 *
 *     T = -mu N e,   e = s / |s|
 *
 * acts on the sphere in that point, and -T on the plane's body. Accelerations and multipliers are affine in all forces.
 * With N0 the multipliers without friction and G_ij the change of N_i for one N of N_j,
 *
 *     (1 - G) N = N0
 *
 * The accelerations are evaluated without friction. If the contacts are solved in range space
 * (reduction/half_columns.h), G and the accelerations with friction follow from this evaluation. While no slip is slow
 * (below), friction is added between its passes, and the forward pass runs once. Otherwise accelerations are evaluated
 * with a unit of each force, and with N. If k contacts slip, this takes k + 2 evaluations, or 2 k + 2 if slip is slow.
 * Contacts are eliminated one after the other. If the pivots that remain are not positive, friction wedges a contact:
 * the force has no value, or two (Painleve 1895), and this is an error. A single contact has the pivot 1 - G. If other
 * contacts slip, 1 - G_ii may be negative although the forces are unique, since their friction changes, too.
 *
 * e jumps when s passes through zero, which ends a step that would go beyond (contact/contact_part.c). The steps before
 * must see no jump. Therefore e is -s / abs(s) if s . d < 0, and d if s = 0, where d is the direction in which the
 * contact began to slip. If slip had turned from d by more than 26 degrees when a step began, d becomes its direction
 * at that time. Across s . d = 0, away from zero, e jumps nevertheless: with a d that stays behind, slip would come
 * near to this line, and stay there. While slip is slow, e follows s at a rate of mu N / (m |s|), which has no bound
 * when slip begins. At the beginning of slip, the part of s across d is of the size of rounding. This part is left out
 * up to kt_slip_still_speed, and so is slip that is no faster.
 *
 * A fixed step that ends where slip ends has a stage next to rest, whose only slip is the error of other stages. Its
 * direction is arbitrary, and friction would throw the foot across d at up to a sixth of s0, by which friction changes
 * slip in a step. Therefore still_speed is a part of s0 while slip is slower than s0 (slip_prediction.c). Directions
 * that lag by more than this speed are set anew when a step begins, so that d is that of the step.
 *
 * If slip is slow, e is the direction a moment later, so that this rate is bounded (slip_prediction.c).
 *
 * F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, 1996, 5.4; F. Genot, B. Brogliato, New results
 * on Painleve paradoxes, Eur. J. Mech. A 18, 1999.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/slip.h"
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "kinetree/algebra.h"
#include "kinetree/joint.h"
#include "linear/cholesky.h"

#include <math.h>

/* The largest pivot of a reaction that counts as wedged: friction makes a normal force a thousand times as large.
 * Stages of a fixed step behind the end of slip have such forces, and would throw the body. */
static const double wedged = 1e-3;
/* ---- forces ------------------------------------------------------------------------------------------------------ */

/* The slip velocity s on the side of the direction d in which slip began. Its part across d counts from `still` on:
 *
 *     along -> sqrt(along^2 + still^2),   across -> across - still^2 / across
 *
 * Far beyond `still`, both changes vanish. A part that is `still` shorter at any speed would turn all friction, and not
 * only friction next to rest. */
static void restrict_to_half_plane_of_slip(const double s[2], const double d[2], double still, double *x, double *y) {
    const double along = s[0] * d[0] + s[1] * d[1], across = d[0] * s[1] - d[1] * s[0];
    const double beyond = fabs(across) > still ? fabs(across) - still * (still / fabs(across)) : 0.0;
    const double forwards = kt_hypot(along, still), side = copysign(beyond, along < 0.0 ? -across : across);
    *x = forwards * d[0] - side * d[1];
    *y = forwards * d[1] + side * d[0];
}

/* Finds e from the slip velocity and the direction in which slip began, d; 0 if both are 0. */
static void slip_direction_of(const double s[2], const double d[2], double still, double e[2]) {
    double x = s[0], y = s[1];
    if (d[0] != 0.0 || d[1] != 0.0)
        restrict_to_half_plane_of_slip(s, d, still, &x, &y);
    const double norm = kt_hypot(x, y);
    e[0] = norm > 0.0 ? x / norm : 0.0;
    e[1] = norm > 0.0 ? y / norm : 0.0;
}

static void set_slip_direction(kt_data *data, size_t k) {
    slip_direction_of(data->slip_velocity + 2 * k, data->slip + 2 * k, kt_slip_still_speed(data, k),
                      data->slip_direction + 2 * k);
}

static const kt_effect_record *effect_of_slip(const kt_data *data, size_t k) {
    return kt_slip_problem_of(data)->contact[k].effect;
}

static double coefficient_of_slip(const kt_data *data, size_t k) { return effect_of_slip(data, k)->friction; }

/* ---- normal forces ----------------------------------------------------------------------------------------------- */

/* Accelerations without the friction of slip, unless it was added between the passes. Also finds the normal forces,
 * unless `normal` is NULL. */
static kt_status evaluate_steady(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                 double *normal, kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    kt_status status = kt_closed_forward(model, data, at, a, error);
    if (status != KT_OK || normal == NULL)
        return status;
    /* spatial links respond behind the last pass as between the passes; planar ones may have been computed again */
    const bool known = ((p->has_friction && model->n.planar == 0) || kt_slip_has_responses(model, data));
    p->is_known = known;
    if (known && p->has_friction)
        return KT_OK;
    if (!known) {
        kt_multipliers_find(model, data, at, a);
        status = kt_multipliers_take(model, data, at->t, data->slip_multiplier, error);
    }
    for (size_t k = 0; status == KT_OK && k < model->n.slip; k++) {
        const kt_loop_record *loop = p->contact[k].loop;
        normal[k] = known ? kt_slip_multiplier(model, data, loop) : data->slip_multiplier[loop->equation];
    }
    return status;
}

/* Accelerations and normal forces, as evaluate_steady computes them, with the wrenches in slip_loaded added. */
static kt_status evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a, double *normal,
                          kt_error *error) {
    kt_dynamic_state loaded = *at;
    loaded.external = data->slip_loaded;
    return evaluate_steady(model, data, &loaded, a, normal, error);
}

static kt_status reject(const kt_model *model, kt_data *data, size_t k, double t, double pivot, kt_error *error) {
    kt_slip_problem_of(data)->wedged = k;
    return kt_error_set(error, KT_ERROR_SINGULAR, kt_where_at("contact", kt_slip_name(model, k), t).text,
                        "it slips in a direction in which friction wedges it: its normal force has no value, or two "
                        "(Painleve's paradox; 1 - dN/dN = %.3g); take less friction, or an elastic contact (stiffness)",
                        pivot);
}

/* Takes the largest pivot of contacts from k on, with the contact's row and column. */
static void take_largest_pivot(size_t n, double *A, int *order, size_t k) {
    size_t r = k;
    for (size_t i = k + 1; i < n; i++)
        r = A[i * n + i] > A[r * n + r] ? i : r;
    for (size_t i = 0; i < n; i++)
        kt_coulomb_swap(A + k * n + i, A + r * n + i);
    for (size_t i = 0; i <= n; i++)
        kt_coulomb_swap(A + i * n + k, A + i * n + r);
    const int contact = order[k];
    order[k] = order[r];
    order[r] = contact;
}

/* Solves A N = b, the column behind the n columns of A. Returns the contact that friction wedges, with its pivot; n:
 * none. The forces of other contacts change with that of a contact. Therefore a contact that would wedge alone is
 * eliminated behind the others. */
KT_INLINE size_t solve_normals_of(size_t n, double *A, int *order, double *N, double *pivot) {
    for (size_t k = 0; k < n; k++)
        order[k] = (int)k;
    for (size_t k = 0; k < n; k++) {
        const double *column = A + k * n;
        if (!(column[k] > wedged))
            take_largest_pivot(n, A, order, k);
        *pivot = column[k];
        if (!(*pivot > wedged))
            return (size_t)order[k];
        for (size_t i = k + 1; i < n; i++) {
            const double factor = column[i] / *pivot;
            for (double *of = A + (k + 1) * n; of <= A + n * n; of += n)
                of[i] -= factor * of[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        double sum = A[n * n + k];
        for (size_t j = k + 1; j < n; j++)
            sum -= A[j * n + k] * N[order[j]];
        N[order[k]] = sum / A[k * n + k];
    }
    return n;
}

/* As solve_normals_of. For up to four contacts, n is a constant, so that the compiler unrolls the loops. */
static size_t solve_normals(size_t n, double *A, int *order, double *N, double *pivot) {
    switch (n) {
    case 1:
        return solve_normals_of(1, A, order, N, pivot);
    case 2:
        return solve_normals_of(2, A, order, N, pivot);
    case 3:
        return solve_normals_of(3, A, order, N, pivot);
    case 4:
        return solve_normals_of(4, A, order, N, pivot);
    default:
        return solve_normals_of(n, A, order, N, pivot);
    }
}

/* Solves (1 - G) N = N0 of an island, in the columns of slip_matrix; N becomes slip_normal. */
static kt_status solve_slip(const kt_model *model, kt_data *data, double t, kt_error *error) {
    const kt_slip_problem *p = kt_slip_problem_of(data);
    const size_t n = p->at->n;
    double pivot;
    const size_t stuck = solve_normals(n, data->slip_matrix, p->pivot, p->normal, &pivot);
    if (stuck < n)
        return reject(model, data, kt_slip_index(p, stuck), t, pivot, error);
    for (size_t k = 0; k < n; k++)
        data->slip_normal[kt_slip_index(p, k)] = p->normal[k];
    return KT_OK;
}

/* The largest N0 of an island; 1 if all are 0. */
static double largest_normal(const kt_slip_problem *p) {
    double size = 0.0;
    for (size_t k = 0; k < p->at->n; k++)
        size = fmax(size, fabs(p->N0[kt_slip_index(p, k)]));
    return size > 0.0 ? size : 1.0;
}

/* Finds N of an island for the directions e. */
static kt_status find_normals(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                              kt_error *error) {
    const kt_slip_problem *p = kt_slip_problem_of(data);
    const size_t n = p->at->n;
    double *A = data->slip_matrix;
    kt_status status = KT_OK;
    for (size_t k = 0; p->responds && k < n; k++) {
        const double mu = coefficient_of_slip(data, kt_slip_index(p, k));
        for (size_t i = 0; i < n; i++)
            A[k * n + i] = (i == k ? 1.0 : 0.0) + mu * p->by_normal[k * n + i];
    }
    const double scale = p->responds ? 1.0 : largest_normal(p);
    for (size_t k = 0; status == KT_OK && !p->responds && k < n; k++) {
        kt_slip_begin_load(model, data, at->external);
        kt_slip_add_friction_load(data, effect_of_slip(data, kt_slip_index(p, k)), kt_slip_index(p, k), scale);
        status = evaluate(model, data, at, a, p->N, error);
        for (size_t i = 0; i < n; i++) {
            const size_t index = kt_slip_index(p, i);
            A[k * n + i] = (i == k ? 1.0 : 0.0) - (p->N[index] - p->N0[index]) / scale;
        }
    }
    for (size_t k = 0; k < n; k++)
        A[n * n + k] = p->N0[kt_slip_index(p, k)];
    return status == KT_OK ? solve_slip(model, data, at->t, error) : status;
}

/* ---- slow slip --------------------------------------------------------------------------------------------------- */

static void begin_slow_island(kt_slip_problem *p) {
    const size_t n = p->at->n;
    p->c = kt_coulomb_init(n, 3 * n, n, p->problem, p->matrices);
    p->held = kt_coulomb_solution_init(n, 3 * n, p->trial);
}

/* Finds the part of s' that is not due to accelerations: s' = J a + J' v. `step` is for nv numbers. */
static void find_drift(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *step, double *drift) {
    const double later = kt_slip_problem_of(data)->slow_time;
    for (size_t i = 0; i < model->n.v; i++)
        step[i] = later * at->v[i];
    kt_position_add(model, at->q, step, data->moved_q);
    kt_slip_find_rates(model, data, data->moved_q, at->v, drift);
    for (size_t i = 0; i < 2 * model->n.slip; i++)
        drift[i] = (drift[i] - data->slip_velocity[i]) / later;
}

/* Responses to a unit of force j of an island: of N in its unit, and of J a. */
static kt_status respond(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a, size_t j,
                         kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    const size_t n = p->at->n;
    for (size_t k = 0; p->responds && k < n; k++) {
        const size_t index = kt_slip_index(p, k);
        p->N[index] = p->by_normal[j * n + k];
        for (size_t i = 0; i < 2; i++)
            p->rate[2 * index + i] = p->at->unit * p->by_rate[j * 2 * n + 2 * k + i];
    }
    if (p->responds)
        return KT_OK;
    kt_slip_begin_load(model, data, at->external);
    kt_slip_add_force(data, effect_of_slip(data, kt_slip_index(p, j / 2)), kt_slip_index(p, j / 2),
                      j % 2 == 0 ? p->at->unit : 0.0, j % 2 == 1 ? p->at->unit : 0.0);
    const kt_status status = evaluate(model, data, at, a, p->N, error);
    if (status != KT_OK)
        return status;
    kt_slip_find_rates(model, data, at->q, a, p->rate);
    for (size_t k = 0; k < n; k++) {
        const size_t index = kt_slip_index(p, k);
        p->N[index] = (p->N[index] - p->N0[index]) / p->at->unit;
        for (size_t i = 2 * index; i < 2 * index + 2; i++)
            p->rate[i] -= p->rate0[i];
    }
    return KT_OK;
}

/* Finds W and b of an island from accelerations a without friction, and for a unit of force along each axis of each
 * contact. */
static kt_status find_response(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                               kt_slip_problem *p, kt_error *error) {
    const size_t n = p->at->n, rows = 3 * n;
    kt_status status = KT_OK;
    memset(p->W_at, 0, rows * rows * sizeof *p->W_at);
    p->at->unit = largest_normal(p);
    for (size_t j = 0; p->responds && j < 2 * n; j++)
        p->rate0[2 * kt_slip_index(p, j / 2) + j % 2] =
            kt_dense_dot(p->unit_force + j * model->n.v, a, (int)model->n.v);
    for (size_t j = 0; status == KT_OK && j < 2 * n; j++) {
        status = respond(model, data, at, a, j, error);
        double *column = p->W_at + 3 * (j / 2) + 1 + j % 2;
        for (size_t i = 0; status == KT_OK && i < rows; i++) {
            const size_t index = kt_slip_index(p, i / 3);
            column[i * rows] = i % 3 == 0 ? -p->N[index] : p->rate[2 * index + i % 3 - 1];
        }
    }
    for (size_t k = 0; status == KT_OK && k < n; k++)
        p->W_at[3 * k * rows + 3 * k] = 1.0;
    return status;
}

/* Finds N of a block and the directions e from the responses. wide: with the length of fixed steps. */
static kt_status solve_predicted(const kt_model *model, kt_data *data, double t, bool wide, bool *found,
                                 kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    const size_t n = p->at->n;
    *found = kt_slip_predict(data, p, wide);
    for (size_t k = 0; *found && k < n; k++)
        memcpy(data->slip_direction + 2 * kt_slip_index(p, k), p->to.e[k], sizeof p->to.e[k]);
    for (size_t k = 0; k < n; k++) {
        const size_t index = kt_slip_index(p, k);
        const double *e = data->slip_direction + 2 * index, mu = coefficient_of_slip(data, index);
        for (size_t i = 0; i < n; i++) {
            const double *G = p->W_at + 3 * i * p->stride + 3 * k + 1;
            data->slip_matrix[k * n + i] = (i == k ? 1.0 : 0.0) - mu * (G[0] * e[0] + G[1] * e[1]);
        }
        data->slip_matrix[n * n + k] = p->N0[index];
    }
    return solve_slip(model, data, t, error);
}

/* Finds N of a block, and the directions e. Friction may wedge a contact in the direction that fixed steps predict, but
 * not in the contact's present direction. */
static kt_status find_slow_block(const kt_model *model, kt_data *data, double t, kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    bool found;
    kt_status status = solve_predicted(model, data, t, true, &found, error);
    if (status == KT_ERROR_SINGULAR && kt_slip_predicts_wide(data, p)) {
        p->wedged = model->n.slip;
        for (size_t k = 0; k < p->at->n; k++)
            set_slip_direction(data, kt_slip_index(p, k));
        status = solve_predicted(model, data, t, false, &found, error);
    }
    for (size_t k = 0; k < p->at->n; k++)
        p->predicted[kt_slip_index(p, k)] = p->predicted[kt_slip_index(p, k)] && found;
    p->found = p->found && found;
    data->unconverged += !found;
    return status;
}

/* Finds N of an island if some slip is slow, and the corresponding directions e, one block of W after the other. */
static kt_status find_slow(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                           kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    kt_slip_island *island = p->at;
    begin_slow_island(p);
    kt_status status = find_response(model, data, at, a, p, error);
    const int blocks = status == KT_OK ? kt_slip_sort_blocks(data, p) : 0;
    for (int k = 0; k < blocks && status == KT_OK; k++) {
        kt_slip_select_block(model, p, island, k);
        status = find_slow_block(model, data, at->t, error);
    }
    p->at = island;
    return status;
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

static bool is_slow_slip(const kt_data *data, size_t k) {
    double grows;
    return !kt_slip_is_fast(data, k) && kt_slip_prediction_time(data, k, &grows) > 0.0;
}

/* Finds slip velocities, directions and drifts. Returns whether some slip is slow. */
static bool find_directions(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *step) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    bool any = false;
    kt_slip_find_frames(model, data, at);
    for (size_t k = 0; k < model->n.slip; k++)
        set_slip_direction(data, k);
    for (size_t i = 0; i < p->islands; i++) {
        p->at = &p->island[i];
        p->at->is_slow = false;
        for (size_t k = 0; k < p->at->n && !p->at->is_slow; k++)
            p->at->is_slow = is_slow_slip(data, kt_slip_index(p, k));
        any = any || p->at->is_slow;
    }
    if (any) {
        find_drift(model, data, at, step, p->drift);
        data->posed = false;
    }
    return any;
}

/* Finds the normal forces of an island. Adds its friction to the free accelerations of the joints if responses are
 * known. */
static kt_status solve_island(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                              kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    p->per = p->at->is_slow ? 2 : 1;
    if (p->responds)
        kt_slip_find_responses(model, data, p);
    const kt_status status = (p->at->is_slow ? find_slow : find_normals)(model, data, at, a, error);
    if (status == KT_OK && p->responds)
        kt_slip_add_friction(model, data, p);
    return status;
}

/* Islands do not act on each other's accelerations, so that each is solved by itself. */
static kt_status solve_islands(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                               kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    kt_status status = KT_OK;
    for (size_t i = 0; i < p->islands && status == KT_OK; i++) {
        kt_slip_select(model, p, &p->island[i]);
        status = solve_island(model, data, at, a, error);
    }
    return status;
}

/* Adds friction between the passes of accelerations (kt_data.between), if responses are known at this point. Then one
 * evaluation suffices while no slip is slow. */
static void solve_between(const kt_model *model, kt_data *data) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    const kt_dynamic_state at = {.t = p->t};
    p->responds = p->has_friction = !kt_is_near_singular(model, data) && kt_slip_has_responses(model, data);
    for (size_t k = 0; p->has_friction && k < model->n.slip; k++)
        p->N0[k] = kt_slip_multiplier(model, data, p->contact[k].loop);
    p->status = p->has_friction ? solve_islands(model, data, &at, NULL, p->error) : KT_OK;
}

/* Accelerations and normal forces, without friction unless it was added between the passes. Friction is added
 * between the passes only if no slip is_slow. */
static kt_status evaluate_without_friction(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                           bool is_slow, double *a, kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    p->has_friction = false;
    p->found = true;
    p->t = at->t;
    p->error = error;
    data->between = is_slow ? NULL : solve_between;
    const kt_status status = evaluate_steady(model, data, at, a, p->N0, error);
    data->between = NULL;
    p->responds = status == KT_OK && p->is_known;
    p->has_friction = p->has_friction && p->responds;
    if (is_slow)
        kt_slip_begin_slow(model, p);
    if (status == KT_OK && is_slow && !p->responds)
        kt_slip_find_rates(model, data, at->q, a, p->rate0);
    return status;
}

/* Accelerations with friction, in the cheapest way that the model permits. Friction is added between the passes. If
 * this is not possible, known responses add it, and without these a second evaluation with the forces of friction. */
static kt_status accelerate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, bool is_slow, double *a,
                            kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    kt_status status = evaluate_without_friction(model, data, at, is_slow, a, error);
    if (status == KT_OK)
        status = p->has_friction ? p->status : solve_islands(model, data, at, a, error);
    if (status != KT_OK || p->has_friction || (p->responds && kt_slip_resume(model, data, at, a)))
        return status;
    (void)kt_slip_load(model, data, at->external); /* into slip_loaded, the wrenches of evaluate */
    return evaluate(model, data, at, a, NULL, error);
}

double kt_largest_speed(const kt_model *model, const double *v) {
    double most = 0.0;
    for (size_t i = 1; i < model->n.link; i++) {
        const double *rate = v + model->link[i].v;
        const int dofs = kt_link_dofs(&model->link[i]), lengths = kt_link_lengths(&model->link[i]);
        for (int k = 0; k < dofs; k++) {
            const double speed = fabs(rate[k]) * (k < lengths ? 1.0 : model->length);
            most = speed > most ? speed : most;
        }
    }
    return most;
}

/* Whether a slip velocity exceeds `least`; true for a NaN. No norm is below its largest part, so that most norms need
 * not be computed. */
static bool is_faster_than(const double s[2], double least) {
    return fabs(s[0]) > least || fabs(s[1]) > least || !(kt_hypot(s[0], s[1]) <= least);
}

/* Rejects a state in which a contact begins to slip, unless the data belong to a simulation. A simulation has the
 * direction d in which each contact slips. Without this direction, a contact at rest would have no friction. */
static kt_status reject_unknown_direction(const kt_model *model, const kt_data *data, const kt_dynamic_state *at,
                                          kt_error *error) {
    const double speed = data->followed ? 0.0 : kt_largest_speed(model, at->v);
    for (size_t k = 0; !data->followed && k < model->n.slip; k++) {
        const double *s = data->slip_velocity + 2 * k, *d = data->slip + 2 * k;
        if (d[0] != 0.0 || d[1] != 0.0 || is_faster_than(s, kt_slip_rest * speed))
            continue;
        return kt_error_set(error, KT_ERROR_UNSUPPORTED,
                            kt_where_format("contact '%.60s', t = %.9g s", kt_slip_name(model, k), at->t).text,
                            "it begins to slip, and only a simulation has the direction of its friction; take the "
                            "accelerations of the simulation");
    }
    return KT_OK;
}

kt_status kt_slip_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                          kt_error *error) {
    kt_slip_begin(model, data);
    const bool is_slow = find_directions(model, data, at, a);
    const kt_status status = reject_unknown_direction(model, data, at, error);
    if (status == KT_OK)
        return accelerate(model, data, at, is_slow, a, error);
    data->posed = false; /* the next evaluation is that of another state */
    return status;
}

void kt_slip_add(kt_model *model) {
    model->n.slip++;
    model->n.slip_work = kt_slip_size(&model->n);
    model->place_slip = kt_slip_init;
    *(model->n.loaded > 0    ? &model->unloaded
      : model->n.varying > 0 ? &model->steady
                             : &model->forward) = kt_slip_forward;
}
