/* Newton's equations of an implicit method.
 *
 * A step of an implicit method solves equations whose simplified Newton iteration needs solutions of
 *
 *     (sigma - J) x = r,     J = f_y(t_J, y_J),
 *
 * with sigma = gamma / h, real or complex, where gamma belongs to the method. J is kept over steps as long as the
 * iteration contracts well. The corrections d_k shrink by theta = |d_k| / |d_{k-1}|, and the error after the last
 * correction is theta / (1 - theta) |d_k|. Factors are kept while h stays.
 *
 * Solver. If kt_integrator_options.newton is given, the caller solves these equations, and can use the structure of f.
 * Otherwise this file computes J with forward differences, column by column, and sigma - J is factored as a dense
 * matrix.
 *
 * Checkpoints. A checkpoint does not contain J, but the point (t_J, y_J) of its evaluation, h of the factors, and the
 * last ratio. While `jacobian_known` is set, J in memory is that of the history. After a restore, this flag is not set,
 * and J is computed again at (t_J, y_J), with the same bits. A step that fails leaves J in memory, unless the step has
 * replaced J. Then the repeated step replaces J, too, before J has an influence on the result. The factors are computed
 * again (`factors_known`), because J and h determine their bits. J is not computed again, because other joint forces
 * may act by now.
 *
 * If J cannot be computed, as at a singular position of loops, the J of earlier steps remains in use. Without such a J,
 * J = 0: the iteration becomes Picard's, which requires short steps.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.8.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/newton.h"

#include "algebra/lu.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* A contraction slower than this requests a new Jacobian at the next step. */
#define KT_SLOW_RATE 0.03

/* A contraction rate of no use: corrections do not shrink. */
#define KT_STALLED_RATE 0.99

/* The fewest iterations of a try, which determine its rate (is_rate_reliable). A single iteration would have to use the
 * rate of the previous step. If a stiff force has vanished since, the correction with the old matrix is small, however
 * large the residual is. */
#define KT_NEWTON_LEAST 2

/* Hidden residuals. A stiff force, such as that of an opening contact, may vanish within the step. Then J no longer
 * belongs to the motion: a correction is (sigma - J)^-1 r, although it should be r / sigma. Such a correction is a
 * million times too small, and below the tolerance from the first iteration on. The same matrix hides such a step from
 * the error estimate.
 *
 * But with J' instead of J the next residual is (J' - J) (sigma - J)^-1 r, which does not shrink. The test extrapolates
 * r / sigma with the rate of the last iteration. If the result is not tolerable, and the correction is smaller than
 * KT_HIDDEN_PART of r / sigma, another iteration follows. If r / sigma shrinks more slowly than KT_HIDDEN_RATE, r /
 * sigma replaces the correction in the test. Once residuals shrink faster, J is close to J' in the directions that
 * matter, and the estimate includes the step.
 *
 * With a part of 0.01 or more, the smooth governor would trigger the test. Below 0.003, releases next to another stiff
 * spring are missed. */
#define KT_HIDDEN_PART 0.007
#define KT_HIDDEN_RATE 0.4

/* A correction of so few roundings of the state is rounding itself. The residual of such a correction is rounding, too,
 * and does not shrink. */
#define KT_HIDDEN_ROUNDINGS 100.0

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_ARRAYS(place_arrays, kt_newton_work, KT_NEWTON_FIELDS, size_t n, size_t matrix, size_t pivots, size_t rows)

static size_t lay_out_newton(kt_newton_work *work, void *memory, const kt_integrator_sizes *s) {
    const size_t n = s->n;
    return place_arrays(work, memory, n, s->owns_matrices ? n * n : 0, s->owns_matrices ? n : 0, s->newton_rows);
}

void kt_newton_measure(kt_integrator_sizes *sizes, size_t rows, size_t history) {
    sizes->newton_rows = rows;
    sizes->history = KT_NEWTON_NUMBERS + sizes->n + history;
    sizes->scratch = kt_arena_round(sizeof(kt_newton_work)) + lay_out_newton(NULL, NULL, sizes);
}

static const kt_newton_memory *memory_of(const kt_integrator *it) {
    return (const kt_newton_memory *)(const void *)it->history;
}

static double *jacobian_point(const kt_integrator *it) { return it->history + KT_NEWTON_NUMBERS; }

/* ---- the Jacobian ------------------------------------------------------------------------------------------------ */

/* Computes column j of J as (f(y + delta e_j) - f(y)) / delta, with the last slot and `trial` as scratch. An exact
 * Jacobian, to about 1e-10, is (f(y + delta e_j) - f(y - delta e_j)) / (2 delta) with a larger delta. The function also
 * uses slot 1 as scratch. */
static kt_try_result difference_jacobian(kt_integrator *it, double t, const double *y, size_t slot, kt_try *result) {
    const size_t n = it->sizes.n, counted = it->counted, other = it->sizes.slots - 1;
    kt_newton_work *w = kt_newton_of(it);
    const bool exact = it->family->exact;
    memcpy(it->trial, y, n * sizeof *y);
    for (size_t j = 0; j < counted; j++) {
        const double step = exact ? 6e-6 * fmax(1e-2, fabs(y[j])) : sqrt(DBL_EPSILON * fmax(1e-5, fabs(y[j])));
        it->trial[j] = y[j] + step;
        const double above = it->trial[j];
        if (kt_evaluate(it, t, it->trial, other, result) != KT_TRY_PASSED)
            return result->result;
        it->trial[j] = exact ? y[j] - step : y[j];
        const double delta = above - it->trial[j], *below = exact ? it->k[1] : it->k[slot];
        if (exact && kt_evaluate(it, t, it->trial, 1, result) != KT_TRY_PASSED)
            return result->result;
        for (size_t i = 0; i < counted; i++)
            w->jacobian[j * counted + i] = (it->k[other][i] - below[i]) / delta;
        it->trial[j] = y[j];
    }
    return KT_TRY_PASSED;
}

/* Computes J at (t, y), with f in slot `slot`. */
static kt_try_result compute_jacobian(kt_integrator *it, double t, const double *y, size_t slot, kt_try *result) {
    const kt_newton *newton = it->options.newton;
    it->memory.counts.jacobians++;
    result->result = KT_TRY_PASSED;
    if (newton == NULL)
        return difference_jacobian(it, t, y, slot, result);
    return kt_try_called(result, newton->jacobian(t, y, it->k[slot], it->callbacks.user), "the Jacobian", t);
}

/* Computes the J of the history again. Slot 0 has f(t, y), so that f(t_J, y_J) goes to slot 1. After a checkpoint, this
 * evaluation is not counted (is_cost: false), because a run without an interruption does not repeat it, and the costs
 * that auto compares must be equal. */
static kt_try_result recompute(kt_integrator *it, bool is_cost, kt_try *result) {
    const kt_newton_memory *m = memory_of(it);
    kt_newton_of(it)->factored = 0.0;
    kt_newton_of(it)->is_in_memory = true;
    if ((int)m->state != KT_JACOBIAN_KNOWN && (int)m->state != KT_JACOBIAN_LEFT_OUT)
        return KT_TRY_PASSED;
    const kt_integrator_counts counts = it->memory.counts;
    if (kt_evaluate(it, m->time, jacobian_point(it), 1, result) == KT_TRY_PASSED)
        (void)compute_jacobian(it, m->time, jacobian_point(it), 1, result);
    if (!is_cost)
        it->memory.counts = counts;
    return result->result;
}

kt_try_result kt_newton_refresh(kt_integrator *it, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    if (w->is_of_now)
        return KT_TRY_PASSED;
    it->jacobian_known = false; /* the matrix of the history is overwritten */
    const kt_try_result found = compute_jacobian(it, it->memory.t, it->y, 0, result);
    if (found == KT_TRY_STOPPED)
        return found;
    result->result = KT_TRY_PASSED; /* an old J, or J = 0, may suffice */
    if (found != KT_TRY_PASSED && (int)w->now.state != KT_JACOBIAN_NONE) {
        /* Differences have overwritten the old J. A Jacobian of the caller's leaves it if it fails. */
        const bool is_left = w->is_in_memory && it->options.newton != NULL;
        return is_left ? KT_TRY_PASSED : recompute(it, it->options.newton == NULL, result);
    }
    w->now.state = found == KT_TRY_PASSED ? KT_JACOBIAN_KNOWN : KT_JACOBIAN_ZERO;
    w->now.time = it->memory.t;
    w->now.step = w->factored = 0.0; /* sigma - J has no factors yet */
    w->is_of_now = w->is_in_memory = true;
    return KT_TRY_PASSED;
}

/* ---- before a try ------------------------------------------------------------------------------------------------ */

/* With fixed steps, the scale of a component is at least this part of the scale of the largest one. The scale is also
 * at least this part of the scale of the stage's own value. */
#define KT_SMALL_PART 1e-3

/* Sets the scales of corrections. With adaptive steps, the scales follow the weights of the error estimate. The
 * estimate is of order 3 and proportional to h^4, the error of a run to h^5. With the estimate held at r^(4/5), the
 * error is proportional to r. Therefore the relative tolerance of a try is r^(4/5) instead of r, and absolute
 * tolerances are larger by the same factor. (Hairer's RADAU5 has 0.1 r^(2/3): errors are proportional to r^(5/6).)
 *
 * With fixed steps the scales are the rounding of the state, or of the value after a step. A component that is
 * 0 has a part of the largest component's scale. If all components are 0 and at rest, the largest one counts as 1. */
static void set_scales(kt_integrator *it) {
    kt_newton_work *w = kt_newton_of(it);
    const double relative = it->options.relative_tolerance;
    w->slack = relative > 0.0 && relative < 1.0 ? kt_control_power(relative, -1.0 / 5.0) : 1.0;
    const size_t n = it->counted;
    double most = 0.0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, fmax(fabs(it->y[i]), it->options.step * fabs(it->k[0][i])));
    most = most > 0.0 ? most : 1.0;
    for (size_t i = 0; i < n; i++)
        w->scale[i] = it->options.step > 0.0
                          ? 4.0 * DBL_EPSILON * (fabs(it->y[i]) + KT_SMALL_PART * most) + DBL_MIN / DBL_EPSILON
                          : w->slack * kt_error_scale(it, i, it->y[i], it->y[i]);
}

kt_try_result kt_newton_prepare(kt_integrator *it, bool rejected, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    result->result = KT_TRY_PASSED;
    if (rejected) {
        w->rejected = true;
        return kt_newton_refresh(it, result);
    }
    *w = (kt_newton_work){.now = *memory_of(it)};
    (void)lay_out_newton(w, it->scratch + kt_arena_round(sizeof *w), &it->sizes);
    w->is_in_memory = it->jacobian_known;
    w->factored = it->jacobian_known && it->factors_known ? w->now.step : 0.0;
    set_scales(it);
    if ((int)w->now.state == KT_JACOBIAN_NONE || w->now.requested > 0.0)
        return kt_newton_refresh(it, result);
    return it->jacobian_known ? KT_TRY_PASSED : recompute(it, false, result);
}

/* ---- linear systems ---------------------------------------------------------------------------------------------- */

/* sigma - J, dense. */
static bool factor_dense(kt_integrator *it, kt_complex sigma) {
    kt_newton_work *w = kt_newton_of(it);
    const size_t n = it->counted;
    double *re = sigma.im != 0.0 ? w->re : w->real;
    for (size_t i = 0; i < n * n; i++)
        re[i] = -w->jacobian[i];
    for (size_t i = 0; i < n; i++)
        re[i * (n + 1)] += sigma.re;
    if (sigma.im == 0.0)
        return kt_lu_factor(re, n, w->pivot);
    memset(w->im, 0, n * n * sizeof *w->im);
    for (size_t i = 0; i < n; i++)
        w->im[i * (n + 1)] = sigma.im;
    return kt_lu_factor_complex(re, w->im, n, w->pivot_complex);
}

kt_try_result kt_newton_diverged(const kt_integrator *it, double factor, kt_try *result) {
    result->t = it->memory.t;
    result->factor = factor;
    return result->result = KT_TRY_DIVERGED;
}

static kt_try_result factor_one(kt_integrator *it, kt_complex sigma, kt_try *result) {
    const kt_newton *newton = it->options.newton;
    it->memory.counts.factorizations++;
    const int code = newton != NULL ? newton->factor(sigma, it->callbacks.user) : !factor_dense(it, sigma);
    return code > 0 ? kt_newton_diverged(it, 0.5, result)
                    : kt_try_called(result, code, "the factorization of Newton's matrix", it->memory.t);
}

kt_try_result kt_newton_factor(kt_integrator *it, double h, double real, kt_complex pair, kt_try *result) {
    assert(isfinite(h) && h != 0.0 && real > 0.0);
    kt_newton_work *w = kt_newton_of(it);
    if (!kt_is_same_step(h, w->now.step))
        w->now.step = h;
    h = w->now.step;
    if (w->factored == h || kt_newton_is_zero(w))
        return KT_TRY_PASSED;
    it->factors_known = false;
    w->factored = 0.0;
    if (factor_one(it, (kt_complex){real / h, 0.0}, result) != KT_TRY_PASSED)
        return result->result;
    if (pair.im != 0.0 && factor_one(it, (kt_complex){pair.re / h, pair.im / h}, result) != KT_TRY_PASSED)
        return result->result;
    w->factored = h;
    return KT_TRY_PASSED;
}

/* r_i / sigma, for components first .. n - 1. */
static void divide_components(kt_complex sigma, double *re, double *im, size_t first, size_t n) {
    const double square = sigma.re * sigma.re + sigma.im * sigma.im, a = sigma.re / square, b = -sigma.im / square;
    for (size_t i = first; i < n; i++) {
        const double x = re[i], y = im != NULL ? im[i] : 0.0;
        re[i] = a * x - b * y;
        if (im != NULL)
            im[i] = a * y + b * x;
    }
}

kt_try_result kt_newton_solve(kt_integrator *it, kt_complex sigma, double *re, double *im, kt_try *result) {
    assert(sigma.re != 0.0 && (im == NULL) == (sigma.im == 0.0));
    kt_newton_work *w = kt_newton_of(it);
    const kt_newton *newton = it->options.newton;
    const bool zero = kt_newton_is_zero(w);
    divide_components(sigma, re, im, zero ? 0 : it->counted, it->sizes.n);
    if (zero)
        return KT_TRY_PASSED;
    if (newton == NULL) {
        if (im == NULL)
            kt_lu_solve(w->real, it->counted, w->pivot, re);
        else
            kt_lu_solve_complex(w->re, w->im, it->counted, w->pivot_complex, re, im);
        return KT_TRY_PASSED;
    }
    return kt_try_called(result, newton->solve(re, im, it->callbacks.user), "the solution of Newton's equations",
                         it->memory.t);
}

/* ---- the iteration ----------------------------------------------------------------------------------------------- */

double kt_newton_square(const kt_integrator *it, const double *x) {
    assert(it->counted > 0);
    const double *scale = kt_newton_of(it)->scale;
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double u = x[i] / scale[i];
        sum += u * u;
    }
    return sum;
}

double kt_newton_square_of(const kt_integrator *it, const double *x, const double *stage) {
    const double *scale = kt_newton_of(it)->scale;
    double sum = 0.0;
    if (!(it->options.step > 0.0))
        return kt_newton_square(it, x);
    for (size_t i = 0; i < it->counted; i++) {
        const double u = x[i] / fmax(scale[i], KT_SMALL_PART * 4.0 * DBL_EPSILON * fabs(stage[i] + x[i]));
        sum += u * u;
    }
    return sum;
}

kt_try_result kt_newton_relinearize(kt_integrator *it, double t, const double *stage, size_t slot, double sigma,
                                    kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    it->jacobian_known = w->is_in_memory = false; /* the matrices of the history are overwritten */
    w->factored = 0.0;
    if (compute_jacobian(it, t, stage, slot, result) == KT_TRY_STOPPED)
        return result->result;
    return factor_one(it, (kt_complex){sigma, 0.0}, result);
}

kt_try_result kt_newton_check(const kt_integrator *it, const double *x, double t, double size, kt_try *result) {
    if (isfinite(size))
        return KT_TRY_PASSED;
    result->component = kt_first_not_finite(x, it->sizes.n);
    if (result->component == it->sizes.n)
        return KT_TRY_PASSED;
    return kt_try_fail(result, KT_TRY_NOT_FINITE, "the new state", t);
}

void kt_newton_begin(kt_integrator *it) {
    kt_newton_work *w = kt_newton_of(it);
    w->iterations = 0;
    w->rate = w->worst = 0.0;
    w->hidden = w->hidden_quotient = 0.0;
    w->hides_residual = false;
    /* An iteration that diverged leaves an infinite ratio. */
    if (!isinf(w->now.ratio))
        w->now.ratio = kt_control_power(fmax(w->now.ratio, DBL_EPSILON), 0.8);
}

static double newton_noise_within(const kt_integrator *it, double h) {
    return it->noise == NULL ? 0.0 : it->noise->within(fabs(h), it->callbacks.user);
}

/* The largest error that may remain in the stages, over the tolerance, so small that it has no effect on the step's
 * error. With the tolerance r^(4/5) of a try (set_scales), this error is r^(6/5). After the r^(-1/5) steps of a run,
 * the total is proportional to r, even if all steps leave errors of one sign. Such a motion is a bend of the path next
 * to a singular position of loops. With fixed steps, the scales are rounding errors. */
static double iteration_tolerance(const kt_integrator *it) {
    const double relative = kt_newton_of(it)->slack * it->options.relative_tolerance;
    if (it->options.step > 0.0)
        return 1.0;
    if (!(relative > 0.0))
        return 1e-3;
    return fmax(10.0 * DBL_EPSILON / relative, fmin(0.03, sqrt(relative)));
}

/* Whether a correction is made of errors of the slopes, which no further iteration lowers, nor a shorter step. */
static bool correction_is_noise(const kt_integrator *it, double size) {
    const kt_newton_work *w = kt_newton_of(it);
    const double most = fmax(it->options.relative_tolerance, it->options.absolute_tolerance);
    return w->iterations >= KT_NEWTON_LEAST && size * w->slack * most <= newton_noise_within(it, w->now.step);
}

/* Whether corrections that do not shrink are small. With J = 0, corrections equal the residual of the equations, which
 * no stiffness hides: rate * size after this correction. If a motion leaves a singular position from rest,
 * accelerations depend only on the direction of departure. Corrections then shrink by a factor that no shorter step
 * lowers. */
static bool is_small(const kt_integrator *it, double size) {
    const kt_newton_work *w = kt_newton_of(it);
    return w->iterations >= KT_NEWTON_LEAST && w->rate >= KT_STALLED_RATE && kt_newton_is_zero(w) &&
           w->rate * size <= iteration_tolerance(it);
}

/* The error after `further` more iterations with the rate theta, which multiply it by theta^further, over the
 * tolerance. */
static double predicted_error(const kt_newton_work *w, double size, double tolerance, int further) {
    double missing = w->now.ratio * size / tolerance;
    for (int i = 0; i < further; i++)
        missing *= w->rate;
    return missing;
}

/* The rounding of the state, over the tolerance. */
static double rounding_of(const kt_integrator *it) {
    return DBL_EPSILON * sqrt(kt_newton_square(it, it->y) / (double)it->counted);
}

/* Gives up if the remaining iterations would leave an error above the tolerance, with the step for which they suffice.
 * Accepts corrections of a few roundings, which do not shrink, as at an equilibrium of large forces. */
static kt_try_result test_adaptive(kt_integrator *it, double size, bool *done, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    const int left = KT_NEWTON_ITERATIONS - 1 - w->iterations;
    if (w->iterations < 2 || left < 0)
        return KT_TRY_PASSED;
    if (!(w->rate < KT_STALLED_RATE)) {
        *done = size <= 10.0 * rounding_of(it);
        return *done ? KT_TRY_PASSED : kt_newton_diverged(it, 0.5, result);
    }
    w->now.ratio = w->rate / (1.0 - w->rate);
    const double missing = predicted_error(w, size, iteration_tolerance(it), left);
    if (missing < 1.0)
        return KT_TRY_PASSED;
    return kt_newton_diverged(
        it, 0.8 * kt_control_power(fmin(missing, 20.0), -1.0 / (double)(KT_NEWTON_ITERATIONS - 1 + 4 - w->iterations)),
        result);
}

/* The iteration ends if corrections of some thousand roundings no longer halve (the caller tests the tolerance). Near a
 * singular position of loops, f itself is not exact to rounding, so that corrections stop shrinking earlier. Such
 * corrections are accepted below 1e-7 of y, and counted. */
static kt_try_result test_fixed(kt_integrator *it, double size, bool *done, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    if (w->iterations < 2)
        return KT_TRY_PASSED;
    w->now.ratio = w->rate < 1.0 ? w->rate / (1.0 - w->rate) : HUGE_VAL;
    *done = (w->rate >= 0.5 && size <= KT_NEWTON_ROUNDED) || (w->rate >= 1.0 && size <= KT_NEWTON_TOLERATED);
    it->memory.counts.capped += *done && size > KT_NEWTON_ROUNDED;
    if (*done)
        return KT_TRY_PASSED;
    if (w->rate >= 1.0 && w->iterations > 4) /* the first corrections may grow */
        return kt_newton_diverged(it, 0.5, result);
    return KT_TRY_PASSED;
}

/* Whether the rate is reliable. A reliable rate needs two corrections, and a third if the second was not much shorter
 * than the first. If a stiff force has vanished within the step, as in a contact that opens, the matrix hides the
 * residual. In this case, all corrections are small and do not shrink, although the first two may seem to shrink. */
static bool is_rate_reliable(const kt_integrator *it) {
    const kt_newton_work *w = kt_newton_of(it);
    const bool is_fast = w->rate <= KT_SLOW_RATE || it->options.step > 0.0;
    return w->iterations >= (is_fast ? KT_NEWTON_LEAST : KT_NEWTON_LEAST + 1) && !w->hides_residual;
}

/* The error that is left, over the last correction. The error follows from the rate, or with adaptive steps from the
 * last quotient if that is worse. */
static double error_ratio(const kt_integrator *it) {
    const kt_newton_work *w = kt_newton_of(it);
    if (it->options.step > 0.0 || w->iterations < 3 || w->last_quotient <= w->rate)
        return w->now.ratio;
    return w->last_quotient < 1.0 ? w->last_quotient / (1.0 - w->last_quotient) : HUGE_VAL;
}

/* quotient * bare extrapolates the next |r / sigma|; above 1, the residual is not tolerable (hidden residuals). */
void kt_newton_store_residual(kt_integrator *it, size_t stage, double bare) {
    assert(!(bare < 0.0));
    kt_newton_work *w = kt_newton_of(it);
    const double quotient = w->iterations > 0 && w->bare[stage] > 0.0 ? bare / w->bare[stage] : 0.0;
    w->bare[stage] = bare;
    if (quotient * bare > 1.0) {
        w->hidden = fmax(w->hidden, bare);
        w->hidden_quotient = fmax(w->hidden_quotient, quotient);
    }
}

/* Whether a correction of this size hides a residual that is not tolerable, and is not rounding itself. */
static bool is_hidden(const kt_integrator *it, double size) {
    const kt_newton_work *w = kt_newton_of(it);
    if (size >= KT_HIDDEN_PART * w->hidden)
        return false;
    return size > KT_HIDDEN_ROUNDINGS * rounding_of(it);
}

/* Counts an iteration with a correction d_k, |d_k| = size. With the quotients Theta_k = |d_k| / |d_(k-1)|, the rate is
 * Theta_1 after the second correction, and then sqrt(Theta_k Theta_(k-1)) (Hairer and Wanner, Solving ODE II, IV.8).
 * Returns the size for the test of convergence. If the matrix hides a residual that persists, size and quotient are
 * those of the residual. */
static double count_iteration(kt_integrator *it, double size) {
    kt_newton_work *w = kt_newton_of(it);
    w->hides_residual = is_hidden(it, size);
    const bool persists = w->hides_residual && w->hidden_quotient > KT_HIDDEN_RATE;
    const double tested = persists ? w->hidden : size;
    if (w->iterations++ > 0) {
        const double quotient = fmax(size / w->last_size, persists ? w->hidden_quotient : 0.0);
        w->rate = w->iterations == 2 ? quotient : sqrt(quotient * w->last_quotient);
        w->last_quotient = quotient;
        w->worst = fmax(w->worst, quotient);
    }
    w->last_size = fmax(size, DBL_EPSILON);
    w->hidden = w->hidden_quotient = 0.0;
    return tested;
}

kt_try_result kt_newton_test_convergence(kt_integrator *it, double size, bool *done, kt_try *result) {
    assert(!(size < 0.0));
    kt_newton_work *w = kt_newton_of(it);
    const bool fixed = it->options.step > 0.0;
    const int most = fixed ? KT_NEWTON_ITERATIONS_FIXED : KT_NEWTON_ITERATIONS;
    *done = false;
    if (!isfinite(size))
        return kt_newton_diverged(it, 0.5, result);
    const double left = count_iteration(it, size);
    *done = !fixed && (correction_is_noise(it, size) || is_small(it, size));
    if (*done)
        return KT_TRY_PASSED;
    const kt_try_result tested = fixed ? test_fixed(it, left, done, result) : test_adaptive(it, left, done, result);
    if (tested != KT_TRY_PASSED)
        return tested;
    *done = *done || size == 0.0 || (is_rate_reliable(it) && error_ratio(it) * left <= iteration_tolerance(it));
    if (*done || w->iterations < most)
        return KT_TRY_PASSED;
    return kt_newton_diverged(it, 0.5, result);
}

/* An iteration may diverge because its Jacobian J is old. Then the next try has a new J.
 *
 * Next to a singular position of loops, J cannot be computed. There an old J may cause divergence for every step size,
 * but a motion that is not stiff needs none. So the next try has J = 0, which stays as long as iterations converge. If
 * they diverge with J = 0, too, the next try has the old J and half of the step. Fixed steps cannot be halved, and do
 * not try J = 0. */
kt_try_result kt_newton_retry(kt_integrator *it, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    if (result->result != KT_TRY_DIVERGED || w->is_of_now)
        return result->result;
    if (kt_newton_refresh(it, result) != KT_TRY_PASSED)
        return result->result;
    if (w->is_of_now)
        return KT_TRY_PASSED;
    if ((int)w->now.state == KT_JACOBIAN_KNOWN && !(it->options.step > 0.0)) {
        w->now.state = KT_JACOBIAN_LEFT_OUT;
        return KT_TRY_PASSED;
    }
    if ((int)w->now.state == KT_JACOBIAN_LEFT_OUT) {
        w->now.state = KT_JACOBIAN_KNOWN;
        if (recompute(it, true, result) != KT_TRY_PASSED)
            return result->result;
    }
    return kt_newton_diverged(it, 0.5, result);
}

/* ---- after a step ------------------------------------------------------------------------------------------------ */

/* The next step computes J at its start if corrections shrink slowly with the present J, or not at all without damping.
 * If J = 0 because none could be computed, the next step tries again. */
void kt_newton_accept(kt_integrator *it) {
    kt_newton_work *w = kt_newton_of(it);
    w->now.requested = w->rate > KT_SLOW_RATE || w->damped || kt_newton_is_zero(w) ? 1.0 : 0.0;
    if (!isfinite(w->now.ratio))
        w->now.ratio = 1.0;
    memcpy(it->history, &w->now, sizeof w->now);
    if (w->is_of_now)
        memcpy(jacobian_point(it), it->previous_y, it->sizes.n * sizeof(double)); /* commit has exchanged them */
    it->jacobian_known = w->is_in_memory || kt_newton_is_zero(w);
    it->factors_known = w->factored == w->now.step;
}

void kt_newton_request_jacobian(kt_integrator *it) {
    kt_newton_memory *m = (kt_newton_memory *)(void *)it->history;
    m->requested = 1.0;
}

void kt_newton_renew(kt_integrator *it) {
    const kt_newton_memory fresh = {.state = KT_JACOBIAN_NONE, .ratio = 1.0};
    memcpy(it->history, &fresh, sizeof fresh);
}

void kt_newton_discard(kt_integrator *it) {
    memset(it->history, 0, it->sizes.history * sizeof(double));
    kt_newton_renew(it);
}

/* The contraction rate grows at least in proportion to the step. A step may grow until its predicted rate is this rate.
 * A longer step, which the error alone would allow, would be rejected again and again. */
#define KT_FORESEEN_RATE 0.5

double kt_newton_control(const kt_integrator *it, double h, double error) {
    const kt_newton_work *w = kt_newton_of(it);
    const kt_integrator_options *o = &it->options;
    const double most = (double)KT_NEWTON_ITERATIONS, root = 1.0 / it->error_order;
    if (!(error > 0.0))
        return o->factor_max;
    double factor = o->safety * fmin(1.0, (1.0 + 2.0 * most) / ((double)w->iterations + 2.0 * most)) *
                    kt_control_power(error, -root);
    if (it->memory.last_step != 0.0) {
        const double last = fmax(it->memory.control_error, 0.01);
        factor = fmin(factor, o->safety * fabs(h / it->memory.last_step) * kt_control_power(last / error, root) *
                                  kt_control_power(error, -root));
    }
    factor = fmax(o->factor_min, fmin(o->factor_max, factor));
    if (w->is_of_now && factor * w->worst > KT_FORESEEN_RATE) /* for an older J, the rate also reflects its age */
        factor = fmin(factor, fmax(1.0, KT_FORESEEN_RATE / w->worst));
    return factor >= 1.0 && factor <= 1.2 && w->rate <= KT_SLOW_RATE ? 1.0 : factor;
}

kt_status kt_newton_report(const kt_integrator *it, const char *where, kt_error *error) {
    const kt_newton_work *w = kt_newton_of(it);
    if (w->damped)
        return kt_error_set(error, KT_ERROR_STEP, where,
                            "Newton's iteration did not converge, although the Jacobian was new at every iteration. "
                            "After %d of at most %d iterations, a correction has %.3g of the state's size, and no part "
                            "of it reduces the residual; take a smaller step",
                            w->iterations, KT_NEWTON_ITERATIONS_FIXED, 4.0 * DBL_EPSILON * w->last_size);
    return kt_error_set(error, KT_ERROR_STEP, where,
                        "Newton's iteration did not converge: after %d of at most %d iterations a correction was %.3g "
                        "times the one before; take a smaller step, or adaptive ones or bdf2 if a contact opens in it",
                        w->iterations, KT_NEWTON_ITERATIONS_FIXED, w->rate);
}
