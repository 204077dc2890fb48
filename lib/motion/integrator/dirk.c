/* The family of diagonally implicit Runge-Kutta methods whose first stage is y0 and whose last is y1:
 *
 *     k_1 = f(t0, y0)
 *     Y_i = y0 + h sum_{j<i} a_ij k_j + h gamma k_i,     k_i = f(t0 + c_i h, Y_i),     i = 2 .. s
 *     y1  = Y_s
 *
 * with one gamma = a_ii for all i > 1. A stage is solved with the simplified Newton iteration
 *
 *     (1 / (h gamma) - J) dY = f(Y) - (Y - base) / (h gamma),     base = y0 + h sum_{j<i} a_ij k_j
 *
 * which begins with the slope at the end of the last step. The iteration may diverge, as when friction sets in or a
 * contact closes within the step. J and the factors are then computed anew in every iteration, and a correction dY is
 * damped. The damping lambda = 1, 1/2, 1/4, ... is the largest for which the next correction is shorter than (1 -
 * lambda / 4) |dY|. The next correction is that at Y + lambda dY with the same factors. This test is affine invariant:
 * P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3.
 *
 * Slopes are not evaluated, but k_i = (Y_i - base) / (h gamma). f would magnify the small deviation of Y from a stiff
 * motion.
 *
 * Linear stability: rational.c, with R = Y_s.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, sections IV.3 and IV.6.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/dirk.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static double dirk_entry(const kt_method *m, int i, int j) { return m->a[i * m->stages + j]; }
static double dirk_gamma_of(const kt_method *m) { return dirk_entry(m, m->stages - 1, m->stages - 1); }

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static void measure_dirk(const kt_method *method, kt_integrator_sizes *sizes) {
    sizes->slots = (size_t)method->stages + 1; /* one more for the differences of a Jacobian */
    kt_newton_measure(sizes, KT_DIRK_ROWS, kt_dirk_history(sizes->n));
}

void kt_dirk_init(kt_integrator *it) {
    it->fresh = (size_t)it->method->stages - 1;
    it->gives_end_derivative = false;
}

/* ---- a try ------------------------------------------------------------------------------------------------------- */

/* base = y0 + h sum_{j<i} a_ij k_j */
static void form_base(kt_integrator *it, const kt_interval *in, int i) {
    const size_t n = it->sizes.n;
    double *base = kt_newton_row(it, KT_DIRK_BASE);
    memcpy(base, in->y, n * sizeof *base);
    for (int j = 0; j < i; j++)
        kt_add_times(base, in->h * dirk_entry(it->method, i, j), it->k[j], n);
}

/* Replaces f(Y), in the slot, with the correction dY of the stage:
 *
 *     (1 / (h gamma) - J) dY = f(Y) - (Y - base) / (h gamma)     with the factors that are stored
 */
static kt_try_result find_correction(kt_integrator *it, double h_gamma, size_t slot, kt_try *result) {
    const kt_complex sigma = {1.0 / h_gamma, 0.0};
    const double *stage = kt_newton_row(it, KT_DIRK_STAGE), *base = kt_newton_row(it, KT_DIRK_BASE);
    double *r = it->k[slot];
    for (size_t l = 0; l < it->sizes.n; l++)
        r[l] -= sigma.re * (stage[l] - base[l]);
    return kt_newton_solve(it, sigma, r, NULL, result);
}

/* The weighted norm of a correction of the stage. */
static double correction_size_of(const kt_integrator *it, const double *correction) {
    const double square = kt_newton_square_of(it, correction, kt_newton_row(it, KT_DIRK_STAGE));
    return sqrt(square / (double)it->counted);
}

/* One iteration of Newton's method without damping: Y <- Y + dY. *size: the weighted norm of dY. The slot in it->k has
 * first f(Y), and then dY. */
static kt_try_result correct_dirk_stage(kt_integrator *it, double t, double h_gamma, size_t slot, double *size,
                                        kt_try *result) {
    double *stage = kt_newton_row(it, KT_DIRK_STAGE);
    if (kt_evaluate(it, t, stage, slot, result) != KT_TRY_PASSED ||
        find_correction(it, h_gamma, slot, result) != KT_TRY_PASSED)
        return result->result;
    *size = correction_size_of(it, it->k[slot]);
    for (size_t l = 0; l < it->sizes.n; l++)
        stage[l] += it->k[slot][l];
    return kt_newton_check(it, stage, t, *size, result);
}

/* ---- damped ------------------------------------------------------------------------------------------------------ */

/* The largest number of halvings of a correction. */
enum { HALVINGS = 20 };

/* Puts the stage at `from` + lambda times the correction, with the largest lambda that reduces the residual. *found:
 * whether such a lambda exists. The norm of the test does not depend on the stage. */
static kt_try_result damp(kt_integrator *it, double t, double h_gamma, size_t slot, bool *found, kt_try *result) {
    double *stage = kt_newton_row(it, KT_DIRK_STAGE);
    const double *from = kt_newton_row(it, KT_DIRK_FROM), *correction = kt_newton_row(it, KT_DIRK_CORRECTION);
    const double size = sqrt(kt_newton_square(it, correction));
    *found = false;
    for (int k = 0; k <= HALVINGS && !*found; k++) {
        const double lambda = ldexp(1.0, -k);
        for (size_t l = 0; l < it->sizes.n; l++)
            stage[l] = from[l] + lambda * correction[l];
        const kt_try_result tried = kt_evaluate(it, t, stage, slot, result);
        if (tried == KT_TRY_STOPPED ||
            (tried == KT_TRY_PASSED && find_correction(it, h_gamma, slot, result) != KT_TRY_PASSED))
            return result->result;
        *found = tried == KT_TRY_PASSED && sqrt(kt_newton_square(it, it->k[slot])) <= (1.0 - 0.25 * lambda) * size;
    }
    return result->result = KT_TRY_PASSED;
}

/* One iteration with a new Jacobian: Y <- Y + lambda dY.
 *
 * A correction with a weighted norm above 1 is damped. If a damping lambda exists that shortens the next correction,
 * and iterations are left, the iteration goes on. In all other cases this iteration is the last one. It takes the whole
 * correction unless a lambda was found, and has converged if the norm is at most KT_NEWTON_TOLERATED. *done: the
 * iteration has converged. */
static kt_try_result correct_damped(kt_integrator *it, double t, double h_gamma, size_t slot, bool *done,
                                    kt_try *result) {
    const size_t n = it->sizes.n;
    kt_newton_work *w = kt_newton_of(it);
    double *stage = kt_newton_row(it, KT_DIRK_STAGE), *from = kt_newton_row(it, KT_DIRK_FROM);
    double *correction = kt_newton_row(it, KT_DIRK_CORRECTION);
    bool is_damped = false;
    if (kt_evaluate(it, t, stage, slot, result) != KT_TRY_PASSED ||
        kt_newton_relinearize(it, t, stage, slot, 1.0 / h_gamma, result) != KT_TRY_PASSED ||
        find_correction(it, h_gamma, slot, result) != KT_TRY_PASSED)
        return result->result;
    memcpy(from, stage, n * sizeof *from);
    memcpy(correction, it->k[slot], n * sizeof *correction);
    const double size = w->last_size = correction_size_of(it, correction);
    if (size > 1.0 && damp(it, t, h_gamma, slot, &is_damped, result) != KT_TRY_PASSED)
        return result->result;
    if (++w->iterations < KT_NEWTON_ITERATIONS_FIXED && is_damped)
        return KT_TRY_PASSED;
    for (size_t l = 0; l < n && !is_damped; l++)
        stage[l] = from[l] + correction[l];
    it->memory.counts.capped += size > KT_NEWTON_ROUNDED && size <= KT_NEWTON_TOLERATED;
    *done = size <= KT_NEWTON_TOLERATED;
    return *done ? KT_TRY_PASSED : kt_newton_diverged(it, 0.5, result);
}

/* Decides how a step continues whose iteration did not converge: with a new Jacobian, then damped (KT_TRY_PASSED), or
 * not. */
static kt_try_result retry_dirk(kt_integrator *it, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    if (kt_newton_retry(it, result) == KT_TRY_PASSED)
        return KT_TRY_PASSED;
    if (result->result != KT_TRY_DIVERGED || w->damped || kt_newton_is_zero(w))
        return result->result;
    w->damped = true;
    return result->result = KT_TRY_PASSED;
}

kt_try_result kt_dirk_try(kt_integrator *it, const kt_interval *in, kt_dirk_solver *solve, kt_try *result) {
    while (solve(it, in, result) != KT_TRY_PASSED)
        if (retry_dirk(it, result) != KT_TRY_PASSED)
            return result->result;
    memcpy(it->trial, kt_newton_row(it, KT_DIRK_STAGE), it->sizes.n * sizeof *it->trial);
    return KT_TRY_PASSED;
}

/* ---- stages ------------------------------------------------------------------------------------------------------ */

const double *kt_dirk_slope(const kt_integrator *it) {
    const double *history = kt_newton_history(it);
    return history[KT_DIRK_FLAG] > 0.0 ? history + KT_DIRK_SLOPES + it->sizes.n : it->k[0];
}

kt_try_result kt_dirk_solve(kt_integrator *it, double t, double h_gamma, size_t slot, kt_try *result) {
    assert(slot < it->sizes.slots &&
           isfinite(h_gamma)); /* h_gamma is 0 for steps near the least number, and fails below */
    const double *stage = kt_newton_row(it, KT_DIRK_STAGE), *base = kt_newton_row(it, KT_DIRK_BASE);
    const kt_newton_work *w = kt_newton_of(it);
    kt_newton_begin(it);
    for (bool done = false; !done;) {
        double size = 0.0;
        if (w->damped ? correct_damped(it, t, h_gamma, slot, &done, result) != KT_TRY_PASSED
                      : correct_dirk_stage(it, t, h_gamma, slot, &size, result) != KT_TRY_PASSED ||
                            kt_newton_test_convergence(it, size, &done, result) != KT_TRY_PASSED)
            return result->result;
    }
    for (size_t l = 0; l < it->sizes.n; l++)
        it->k[slot][l] = (stage[l] - base[l]) / h_gamma;
    return KT_TRY_PASSED;
}

/* base + h gamma f, with the slope at the end of the last step. */
static void predict_dirk_stage(kt_integrator *it, double h_gamma) {
    const double *base = kt_newton_row(it, KT_DIRK_BASE), *slope = kt_dirk_slope(it);
    double *stage = kt_newton_row(it, KT_DIRK_STAGE);
    for (size_t l = 0; l < it->sizes.n; l++)
        stage[l] = base[l] + h_gamma * slope[l];
}

kt_try_result kt_dirk_stages(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const kt_complex none = {0.0, 0.0};
    const kt_method *m = it->method;
    const double gamma = dirk_gamma_of(m);
    if (!kt_newton_of(it)->damped && kt_newton_factor(it, in->h, 1.0 / gamma, none, result) != KT_TRY_PASSED)
        return result->result;
    for (int i = 1; i < m->stages; i++) {
        const double t = m->c[i] == 1.0 ? in->end : in->t + m->c[i] * in->h;
        form_base(it, in, i);
        predict_dirk_stage(it, in->h * gamma);
        if (kt_dirk_solve(it, t, in->h * gamma, (size_t)i, result) != KT_TRY_PASSED)
            return result->result;
    }
    return KT_TRY_PASSED;
}

static kt_try_result dirk_try(kt_integrator *it, const kt_interval *in, kt_try *result) {
    return kt_dirk_try(it, in, kt_dirk_stages, result);
}

/* ---- after a step ------------------------------------------------------------------------------------------------ */

void kt_dirk_accept(kt_integrator *it) {
    const size_t n = it->sizes.n;
    double *history = kt_newton_history(it), *start = history + KT_DIRK_SLOPES, *end = start + n;
    memcpy(start, history[KT_DIRK_FLAG] > 0.0 ? end : it->k[0], n * sizeof *start);
    memcpy(end, it->k[it->method->stages - 1], n * sizeof *end);
    history[KT_DIRK_FLAG] = 1.0;
    kt_newton_accept(it);
}

kt_try_result kt_dirk_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result) {
    assert(y_out != it->y && y_out != it->previous_y);
    const size_t n = it->sizes.n;
    const double t0 = it->memory.previous_t, h = it->memory.last_step, theta = (t - t0) / (it->memory.t - t0);
    const double rest = 1.0 - theta, part = theta * theta * (3.0 - 2.0 * theta);
    const double *y0 = it->previous_y, *y1 = it->y, *k0 = kt_newton_history(it) + KT_DIRK_SLOPES, *k1 = k0 + n;
    for (size_t l = 0; l < n; l++)
        y_out[l] = y0[l] + part * (y1[l] - y0[l]) + h * theta * rest * (rest * k0[l] - theta * k1[l]);
    return result->result = KT_TRY_PASSED;
}

/* ---- linear stability -------------------------------------------------------------------------------------------- */

static kt_status dirk_function(const kt_method *m, int stages, kt_stability *out, kt_error *error) {
    (void)stages;
    (void)error;
    kt_rational_stages(m, dirk_gamma_of(m), 1, m->stages, out);
    return KT_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

const kt_history_word kt_dirk_words[] = {
    KT_NEWTON_WORDS, {"first step", KT_HISTORY_METHOD, KT_DIRK_FLAG, KT_BLOCK_YES_NO}, {.name = NULL}};

const kt_method_family kt_family_dirk = {
    .name = "dirk",
    .check_sizes = kt_table_check_sizes,
    .measure = measure_dirk,
    .words = kt_dirk_words,
    .init = kt_dirk_init,
    .try_step = dirk_try,
    .error = kt_no_error,
    .error_at = kt_no_error_at,
    .accept = kt_dirk_accept,
    .report = kt_newton_report,
    .interpolate = kt_dirk_interpolate,
    .stability = dirk_function,
    .value = kt_rational_value,
    KT_NEWTON_MEMBERS,
};
