/* The stages of an implicit method, solved to rounding, and the linear equations that determine the stages and also
 * their changes.
 *
 * With the slopes K_i = f(t + c_i h, Y_i) as unknowns, f = (E(q) v, a),
 *
 *     Y_i = y + h sum_j a_ij K_j,   K_i = f_i(Y_i),   y+ = Y_s
 *
 * The same equations hold for Newton's corrections and for the changes dK_i. The latter follow from changes of y and of
 * held inputs, by the implicit function theorem.
 *
 *     dK_i - h F_i sum_j a_ij dK_j = r_i,   F_i = f_y(Y_i),   sum over the stages that are solved together
 *
 * For corrections r_i = f(Y_i) - K_i. For changes from outside r_i = F_i dY_i + f_p dp. Stages are solved together if
 * a_ij couples them forward. Diagonally implicit methods solve stages one after the other, Radau IIA all three
 * together. If positions are plain numbers, their slopes V_i = v + h sum a_ij A_j are inserted, and only A_i = dv/dt is
 * unknown:
 *
 *     dA_i - h F^v_i sum_j a_ij dA_j - h^2 F^q_i sum_j (a^2)_ij dA_j = r_i
 *
 * With quaternions, the unknowns are the slopes of all N numbers. In this case, F contains the terms of E and of the
 * rotation xi of dp (tangent.c).
 *
 * The iteration has three forms.
 *
 * - If h F is small, as judged by the ratio of the first residuals to the slopes, K_i = f(Y_i) is iterated without F.
 *   (F costs up to 24 evaluations.)
 *
 * - Otherwise F of one guessed stage serves all stages, as long as corrections shrink.
 *
 * - If they do not shrink, for example because a contact closes within the step, F is computed at the stages themselves
 *   in every iteration. In this form, corrections are damped, as in integrator/dirk.c. The factor is the largest lambda
 *   = 1, 1/2, .. that makes the next correction, with the same factors, shorter than (1 - lambda / 4) of the present
 *   correction.
 *
 * Corrections are compared with rounding of the state, like those of a simulation with fixed steps
 * (integrator/newton.c).
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.8; P. Deuflhard, Newton
 * Methods for Nonlinear Problems, 2004, section 3.3.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sensitivity/implicit.h"
#include "algebra/lu.h"
#include "derivative/stiffness.h"
#include "evaluate/evaluate.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { ITERATIONS = 50, HALVINGS = 20 };
#define QUICK 0.02      /* residuals that shrink below this ratio need no F: rounding is eight evaluations away */
#define SLOW 0.25       /* corrections that shrink less require another F */
#define SMALL_PART 1e-3 /* components count as at least this part of the largest one */
#define ROUNDED 1e4     /* in roundings: smaller corrections may stop shrinking */

/* ---- tables ------------------------------------------------------------------------------------------------------ */

bool kt_method_is_coupled(const kt_method *method) {
    const kt_method_family *family = kt_method_family_of(method);
    return family->implicit && !family->exact;
}

/* Whether a later stage uses the slope of stage i, or stage i is the last one, whose state is y+. */
static bool stage_counts(const kt_method *method, size_t i) {
    const size_t s = (size_t)method->stages;
    bool any = i + 1 == s;
    for (size_t j = i + 1; j < s; j++)
        any = any || kt_implicit_entry(method, j, i) != 0.0;
    return any;
}

kt_coupled kt_coupled_at(const kt_method *method, size_t first) {
    kt_coupled c = {first, first + 1};
    for (size_t i = first; i < c.end; i++)
        for (size_t j = c.end; j < (size_t)method->stages; j++)
            if (kt_implicit_entry(method, i, j) != 0.0)
                c.end = j + 1;
    return c;
}

bool kt_coupled_counts(const kt_method *method, kt_coupled c) {
    return c.end - c.first > 1 || stage_counts(method, c.first);
}

size_t kt_coupled_most(const kt_method *method) {
    size_t most = 0;
    for (kt_coupled c = {0, 0}; c.end < (size_t)method->stages;) {
        c = kt_coupled_at(method, c.end);
        most = c.end - c.first > most ? c.end - c.first : most;
    }
    return most;
}

/* ---- stages ------------------------------------------------------------------------------------------------------ */

/* The index of the accelerations among the unknowns of a stage. */
static size_t rates_of(const kt_step_work *w) { return kt_is_plain(w->model) ? 0 : w->model->n.q; }

/* Computes y + h sum_{j < end} a_ij k_j, for `count` numbers from index `from` on. */
static void combine_slopes(const kt_step_work *w, size_t i, size_t end, size_t from, size_t count, double *out) {
    const size_t N = kt_state_numbers(w->model);
    memcpy(out, w->y + from, count * sizeof *out);
    for (size_t j = 0; j < end; j++)
        kt_add_times(out, w->step->h * kt_implicit_entry(w->step->method, i, j), w->slope + j * N + from, count);
}

/* Forms the states Y_i of these stages from all available slopes. */
static void form_coupled(kt_step_work *w, kt_coupled c) {
    const size_t nq = w->model->n.q, n = w->model->n.v, N = kt_state_numbers(w->model);
    for (size_t i = c.first; i < c.end && kt_is_plain(w->model); i++) {
        combine_slopes(w, i, c.end, nq, N - nq, w->stage + i * N + nq);
        memcpy(w->slope + i * N, w->stage + i * N + nq, n * sizeof *w->slope);
    }
    for (size_t i = c.first; i < c.end && kt_is_plain(w->model); i++)
        combine_slopes(w, i, c.end, 0, nq, w->stage + i * N);
    for (size_t i = c.first; i < c.end && !kt_is_plain(w->model); i++)
        combine_slopes(w, i, c.end, 0, N, w->stage + i * N);
}

/* ---- the linear equations ---------------------------------------------------------------------------------------- */

/* Whether rows of accelerations are multiplied by M, since that needs no solution: for trees, unless a parameter is
 * requested. */
static bool has_coupled_mass(const kt_step_work *w) {
    return !w->model->n.group && !w->parameter && !kt_has_auxiliary_states(w->model) && w->model->n.loaded == 0;
}

/* sum_l a_il a_lj over the stages of c */
static double squared(const kt_method *method, kt_coupled c, size_t i, size_t j) {
    double sum = 0.0;
    for (size_t l = c.first; l < c.end; l++)
        sum += kt_implicit_entry(method, i, l) * kt_implicit_entry(method, l, j);
    return sum;
}

/* Adds block (i, j) of the equations for dK or dA (see above) to the matrix. The block is
 *     1 - h a_ij F                             on the diagonal; 1 becomes M in rows that are multiplied by M
 *     1 - (h a_ij F^v + h^2 (a^2)_ij F^q)      if positions are plain numbers
 * Off the diagonal, 1 is left out. m: the numbers of a column. */
static void add_stage_block(const kt_step_work *w, kt_coupled c, size_t i, size_t j, size_t m, double *to) {
    const size_t n = w->model->n.v, e = kt_rate_numbers(w->model), at = w->one_derivative ? 0 : i - c.first;
    const double h = w->step->h, a = h * kt_implicit_entry(w->step->method, i, j);
    const double *by_q = w->by_q + at * e * e, *by_v = w->by_v + at * e * e;
    const size_t rates = rates_of(w);
    for (size_t l = 0; l < w->unknowns && i == j; l++)
        to[l * m + l] += l < rates || !has_coupled_mass(w) ? 1.0 : 0.0;
    for (size_t k = 0; k < n && i == j && has_coupled_mass(w); k++)
        for (size_t l = 0; l < n; l++)
            to[(rates + k) * m + rates + l] += w->mass[(at * n + k) * n + l];
    if (!kt_is_plain(w->model)) {
        if (a != 0.0)
            kt_slope_add(w, at, w->stage + (w->one_derivative ? w->derivative_at : i) * kt_state_numbers(w->model), -a,
                         m, to);
        return;
    }
    const double twice = h * h * squared(w->step->method, c, i, j);
    for (size_t k = 0; k < e && (a != 0.0 || twice != 0.0); k++)
        for (size_t l = 0; l < e; l++)
            to[k * m + l] -= a * by_v[k * e + l] + twice * by_q[k * e + l];
}

/* Factors the matrix of the coupled stages c.first .. c.end - 1: a block of size `unknowns` for each pair of stages. */
static kt_status factor_coupled(kt_step_work *w, kt_coupled c, kt_error *error) {
    const size_t count = c.end - c.first, m = w->unknowns, whole = count * m;
    memset(w->matrix, 0, whole * whole * sizeof *w->matrix);
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < count; j++)
            add_stage_block(w, c, c.first + i, c.first + j, whole, w->matrix + j * m * whole + i * m);
    if (kt_lu_factor(w->matrix, whole, w->pivot))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_STEP, "step",
                        "the matrix of the implicit stages is singular at h = %g s; take a smaller step", w->step->h);
}

void kt_coupled_solve(const kt_step_work *w, kt_coupled c, double *x) {
    kt_lu_solve(w->matrix, (c.end - c.first) * w->unknowns, w->pivot, x);
}

void kt_coupled_solve_transposed(const kt_step_work *w, kt_coupled c, double *x) {
    kt_lu_solve_transposed(w->matrix, (c.end - c.first) * w->unknowns, w->pivot, x);
}

/* Computes Newton's correction, in place of the residual. */
static void correct_slopes(const kt_step_work *w, kt_coupled c) {
    const size_t n = w->model->n.v;
    for (size_t i = c.first; i < c.end && has_coupled_mass(w); i++) {
        const size_t at = w->one_derivative ? 0 : i - c.first;
        double *r = w->correction + (i - c.first + 1) * w->unknowns - n;
        kt_dense_apply(w->mass + at * n * n, (int)n, (int)n, r, w->unit_state);
        memcpy(r, w->unit_state, n * sizeof *r);
    }
    kt_coupled_solve(w, c, w->correction);
}

/* Differentiates the accelerations a(q, v, tau) at a stage, and stores the matrices as block `block` of the coupled
 * stages. If rows are multiplied by M (has_coupled_mass), the matrices are M, M da/dq and M da/dv. They are the
 * negative stiffness and damping, because M a = tau - h. `inputs` then asks for nothing: M da/dtau is 1
 * (kt_coupled_differentiate). Otherwise the matrices are da/dq, da/dv and, with `inputs`, da/dtau. */
static kt_status differentiate_implicit_stage(kt_step_work *w, size_t stage, size_t block, const double *a, bool inputs,
                                              kt_error *error) {
    const kt_model *model = w->model;
    const kt_step *step = w->step;
    const size_t n = model->n.v;
    if (has_coupled_mass(w)) {
        double *by_q = w->by_q + block * n * n, *by_v = w->by_v + block * n * n;
        const double *q = w->stage + stage * kt_state_numbers(w->model);
        const kt_dynamic_state at = {kt_step_time(step, stage), q, q + model->n.q, step->tau, step->external};
        const kt_stiffness_matrices to = {.mass = w->mass + block * n * n, .stiffness = by_q, .damping = by_v};
        kt_status status = kt_slip_reject(model, "kt_step", error);
        if (status == KT_OK)
            status = kt_stiffness_evaluate_at(model, w->data, w->derivative, kt_acceleration_work_size(model), &at, a,
                                              &to, error);
        for (size_t l = 0; l < n * n && status == KT_OK; l++) {
            by_q[l] = -by_q[l];
            by_v[l] = -by_v[l];
        }
        return status;
    }
    return kt_step_differentiate_at(w, kt_step_time(step, stage), w->stage + stage * kt_state_numbers(w->model), a,
                                    block, inputs, error);
}

kt_status kt_coupled_differentiate(kt_step_work *w, kt_coupled c, size_t held, kt_error *error) {
    const size_t n = w->model->n.v, N = kt_state_numbers(w->model);
    kt_status status = KT_OK;
    w->one_derivative = false;
    for (size_t i = c.first; i < c.end && status == KT_OK; i++) {
        status = differentiate_implicit_stage(w, i, i - c.first, w->slope + i * N + w->model->n.q, held > 0, error);
        if (status == KT_OK && w->parameter)
            status = kt_parameter_stage(w, kt_step_time(w->step, i), w->stage + i * N, w->slope + i * N + w->model->n.q,
                                        error);
        double *by_held = w->by_held + (i - c.first) * n * w->held_most;
        if (status == KT_OK && held > 0 && !has_coupled_mass(w))
            memcpy(by_held, w->parameter ? w->parameter->by_parameter : w->by_tau, n * held * sizeof *by_held);
        for (size_t l = 0; l < n * held && has_coupled_mass(w); l++)
            by_held[l] = l % (n + 1) == 0 ? 1.0 : 0.0;
    }
    return status == KT_OK ? factor_coupled(w, c, error) : status;
}

/* ---- the iteration ----------------------------------------------------------------------------------------------- */

/* Computes r_i = f(Y_i) - K_i at the present slopes, and the accelerations into w->reached. */
static kt_status find_slope_residual(kt_step_work *w, kt_coupled c, kt_error *error) {
    const kt_model *model = w->model;
    const size_t n = model->n.v, N = kt_state_numbers(w->model), m = w->unknowns;
    const bool reduced = kt_is_plain(model);
    form_coupled(w, c);
    for (size_t i = c.first; i < c.end; i++) {
        const double *y = w->stage + i * N, *k = w->slope + i * N + (reduced ? model->n.q : 0);
        const double t = kt_step_time(w->step, i);
        double *r = w->correction + (i - c.first) * m;
        const kt_status status = reduced ? kt_step_rates(w, t, y, r, error) : kt_step_slope(w, t, y, r, error);
        if (status != KT_OK)
            return status;
        kt_copy(w->reached + (i - c.first) * n, r + rates_of(w), n * sizeof *r);
        for (size_t l = 0; l < m; l++)
            r[l] -= k[l];
    }
    return KT_OK;
}

/* The weighted norm of a correction: h dK over some roundings of the state. */
static double slope_size_of(const kt_step_work *w, kt_coupled c, const double *correction) {
    const size_t N = kt_state_numbers(w->model), m = w->unknowns;
    double most = 0.0, sum = 0.0;
    if (m == 0) /* nothing moves */
        return 0.0;
    for (size_t l = 0; l < N; l++) { /* fmax would be a call */
        const double y = fabs(w->y[l]), change = fabs(w->step->h * w->slope[(c.end - 1) * N + l]);
        most = y > most ? y : most;
        most = change > most ? change : most;
    }
    most = most > 0.0 ? most : 1.0;
    for (size_t k = 0; k < c.end - c.first; k++, correction += m)
        for (size_t l = 0; l < m; l++) {
            const double y = w->y[N - m + l];
            const double scale = 4.0 * DBL_EPSILON * (fabs(y) + SMALL_PART * most) + DBL_MIN / DBL_EPSILON;
            const double x = w->step->h * correction[l] / scale;
            sum += x * x;
        }
    return sqrt(sum / (double)((c.end - c.first) * m));
}

/* The slopes become `from` + lambda times the correction x. */
static void move_slopes(kt_step_work *w, kt_coupled c, double lambda, const double *from, const double *x) {
    const size_t N = kt_state_numbers(w->model), m = w->unknowns;
    for (size_t i = c.first; i < c.end; i++)
        for (size_t l = 0; l < m; l++) {
            const size_t at = (i - c.first) * m + l;
            w->slope[i * N + N - m + l] = from[at] + lambda * x[at];
        }
}

static void store_stage_slopes(const kt_step_work *w, kt_coupled c, double *to) {
    const size_t N = kt_state_numbers(w->model), m = w->unknowns;
    for (size_t i = c.first; i < c.end; i++)
        memcpy(to + (i - c.first) * m, w->slope + i * N + N - m, m * sizeof *to);
}

/* Computes F at the present stages, and from their residual the correction with this F. */
static kt_status relinearize(kt_step_work *w, kt_coupled c, kt_error *error) {
    kt_status status = KT_OK;
    w->one_derivative = false;
    for (size_t i = c.first; i < c.end && status == KT_OK; i++)
        status =
            differentiate_implicit_stage(w, i, i - c.first, w->reached + (i - c.first) * w->model->n.v, false, error);
    if (status == KT_OK)
        status = factor_coupled(w, c, error);
    if (status == KT_OK)
        correct_slopes(w, c);
    return status;
}

static kt_status stages_diverged(const kt_step_work *w, double size, kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, "step",
                        "the stages of '%s' could not be solved over h = %g s: no part of a correction reduces the "
                        "residual, and the correction has %.3g of the state's size; take a smaller step",
                        w->step->method->name, w->step->h, 4.0 * DBL_EPSILON * size);
}

/* Newton's iteration with F at every iterate, damped, from the present slopes. */
static kt_status solve_damped(kt_step_work *w, kt_coupled c, kt_error *error) {
    const size_t bytes = (c.end - c.first) * w->unknowns * sizeof(double);
    double size = HUGE_VAL;
    for (int k = 0; k < ITERATIONS; k++) {
        kt_status status = find_slope_residual(w, c, error);
        if (status == KT_OK)
            status = relinearize(w, c, error);
        if (status != KT_OK)
            return status;
        size = slope_size_of(w, c, w->correction);
        bool nearer = false;
        store_stage_slopes(w, c, w->from);
        memcpy(w->taken, w->correction, bytes);
        for (int halved = 0; halved <= HALVINGS && !nearer && size > 1.0; halved++) {
            const double lambda = ldexp(1.0, -halved);
            move_slopes(w, c, lambda, w->from, w->taken);
            status = find_slope_residual(w, c, error);
            if (status == KT_ERROR_CALLBACK)
                return status;
            if (status != KT_OK)
                continue;
            correct_slopes(w, c);
            nearer = slope_size_of(w, c, w->correction) <= (1.0 - 0.25 * lambda) * size;
        }
        if (nearer)
            continue;
        move_slopes(w, c, 1.0, w->from, w->taken);
        form_coupled(w, c);
        return size <= ROUNDED ? KT_OK : stages_diverged(w, size, error);
    }
    return stages_diverged(w, size, error);
}

/* Whether a trial of the iteration without F pays. F must cost many evaluations: 9 for a chain of 20 links, 24 for a
 * four-bar in a plane, but 2 for a governor, a tree of four coordinates. Besides, the residuals must be small against
 * the guessed accelerations. The residuals measure the change of f over the step. */
static bool is_gentle(const kt_step_work *w, kt_coupled c) {
    const kt_model *model = w->model;
    const size_t n = model->n.v, N = kt_state_numbers(w->model), m = w->unknowns, rates = rates_of(w);
    const bool dear = model->n.group ? model->sweep == KT_SWEEP_PLANAR : n > 4;
    double size = 0.0, change = 0.0;
    if (!dear)
        return false;
    for (size_t i = c.first; i < c.end; i++)
        for (size_t l = 0; l < n; l++) {
            const double a = w->slope[i * N + model->n.q + l], r = w->correction[(i - c.first) * m + rates + l];
            size += a * a;
            change += r * r;
        }
    return change <= QUICK * QUICK * size;
}

/* Restores the guess and its residual. */
static void restore_guess(kt_step_work *w, kt_coupled c) {
    const size_t n = w->model->n.v, m = w->unknowns, count = c.end - c.first, rates = rates_of(w);
    move_slopes(w, c, 0.0, w->guess, w->guess);
    memcpy(w->correction, w->taken, count * m * sizeof *w->taken);
    for (size_t i = 0; i < count; i++)
        for (size_t l = 0; l < n; l++)
            w->reached[i * n + l] = w->guess[i * m + rates + l] + w->taken[i * m + rates + l];
    form_coupled(w, c);
}

/* The iteration without F, from the residual of the guess. *done: whether the iteration has converged to rounding.
 * Otherwise the slopes and their residual are those of the last iteration, or of the guess if the guess is nearer. */
static kt_status solve_without(kt_step_work *w, kt_coupled c, bool *done, kt_error *error) {
    double size = slope_size_of(w, c, w->correction), theta = 0.0;
    store_stage_slopes(w, c, w->guess);
    memcpy(w->taken, w->correction, (c.end - c.first) * w->unknowns * sizeof *w->taken);
    *done = false;
    for (int k = 0; theta <= QUICK && !*done; k++) {
        const double last = size;
        store_stage_slopes(w, c, w->from);
        move_slopes(w, c, 1.0, w->from, w->correction);
        *done = k > 0 && theta / (1.0 - theta) * size <= 1.0;
        const kt_status status = *done ? KT_OK : find_slope_residual(w, c, error);
        if (status == KT_ERROR_CALLBACK)
            return status;
        size = status == KT_OK ? slope_size_of(w, c, w->correction) : HUGE_VAL;
        theta = last > 0.0 ? size / last : 0.0;
        if (!(theta <= QUICK || k > 0) || status != KT_OK) {
            restore_guess(w, c);
            return KT_OK;
        }
    }
    form_coupled(w, c);
    return KT_OK;
}

/* Computes F at the middle of the guessed stages, for all stages, because this stage is closer to the solution than the
 * start. The residual of the stages is available. */
static kt_status linearize(kt_step_work *w, kt_coupled c, kt_error *error) {
    const size_t middle = (c.end - c.first) / 2;
    kt_status status =
        differentiate_implicit_stage(w, c.first + middle, 0, w->reached + middle * w->model->n.v, false, error);
    w->one_derivative = true;
    w->derivative_at = c.first + middle;
    return status == KT_OK ? factor_coupled(w, c, error) : status;
}

/* The simplified iteration, from the residual of the guess. With the ratio theta of a correction to the previous
 * correction, the remaining error is theta / (1 - theta) times the correction. If the iteration does not converge well,
 * *slow is true, and the slopes are those at the beginning. */
static kt_status solve_simplified(kt_step_work *w, kt_coupled c, bool *slow, kt_error *error) {
    double last = HUGE_VAL;
    store_stage_slopes(w, c, w->guess);
    *slow = false;
    for (int k = 0; k < ITERATIONS; k++) {
        const kt_status status = k ? find_slope_residual(w, c, error) : KT_OK;
        if (status == KT_ERROR_CALLBACK)
            return status;
        correct_slopes(w, c);
        const double size = status == KT_OK ? slope_size_of(w, c, w->correction) : HUGE_VAL, theta = size / last;
        const bool shrinks = theta <= SLOW;
        if (!(shrinks || size <= ROUNDED))
            break;
        store_stage_slopes(w, c, w->from);
        move_slopes(w, c, 1.0, w->from, w->correction);
        if (k > 0 && (!shrinks || theta / (1.0 - theta) * size <= 1.0)) {
            form_coupled(w, c);
            return KT_OK;
        }
        last = size;
    }
    *slow = true;
    move_slopes(w, c, 0.0, w->guess, w->guess);
    return KT_OK;
}

/* ---- all stages -------------------------------------------------------------------------------------------------- */

/* Begins with stage 0, which is the start itself. The slope of this stage is the guess for all stages. */
static kt_status begin_implicit_stages(kt_step_work *w, kt_error *error) {
    memcpy(w->stage, w->y, kt_state_numbers(w->model) * sizeof *w->stage);
    return kt_step_slope(w, w->step->t, w->y, w->slope, error);
}

/* Solves the coupled stages. Starts from the slope of the stage before; iterates without a matrix if the problem is
 * not stiff, otherwise by the simplified Newton method, and finally with damped steps if that converges slowly. */
static kt_status solve_implicit_stages(kt_step_work *w, kt_coupled c, kt_error *error) {
    const size_t N = kt_state_numbers(w->model);
    bool done = false, slow = false;
    for (size_t i = c.first; i < c.end; i++)
        memcpy(w->slope + i * N, w->slope + (c.first - 1) * N, N * sizeof *w->slope);
    kt_status status = find_slope_residual(w, c, error);
    if (status == KT_OK && is_gentle(w, c))
        status = solve_without(w, c, &done, error);
    if (status != KT_OK || done)
        return status;
    status = linearize(w, c, error);
    if (status == KT_OK)
        status = solve_simplified(w, c, &slow, error);
    return status == KT_OK && slow ? solve_damped(w, c, error) : status;
}

kt_status kt_coupled_stages(kt_step_work *w, const double *q, const double *v, kt_error *error) {
    const kt_method *method = w->step->method;
    const size_t N = kt_state_numbers(w->model), last = (size_t)method->stages - 1;
    kt_step_start(w, q, v);
    kt_status status = begin_implicit_stages(w, error); /* stage 0, which is the start itself */
    for (kt_coupled c = {0, 1}; c.end <= last && status == KT_OK;) {
        c = kt_coupled_at(method, c.end);
        status = solve_implicit_stages(w, c, error);
    }
    memcpy(w->next, w->stage + last * N, N * sizeof *w->next);
    return status;
}

void kt_coupled_recall(kt_step_work *w) {
    const kt_method *method = w->step->method;
    const size_t N = kt_state_numbers(w->model), last = (size_t)method->stages - 1;
    for (kt_coupled c = {0, 0}; c.end <= last;) {
        c = kt_coupled_at(method, c.end);
        form_coupled(w, c);
    }
    memcpy(w->next, w->stage + last * N, N * sizeof *w->next);
}
