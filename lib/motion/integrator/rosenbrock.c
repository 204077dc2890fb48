/* The family of Rosenbrock methods: linearly implicit, for stiff equations. A step solves eight linear systems with one
 * matrix, without any iteration:
 *
 *     k_i = f(t0 + alpha_i h, y0 + h sum_{j<i} alpha_ij k_j) + h J sum_{j<=i} gamma_ij k_j + gamma_i h f_t
 *     y1  = y0 + h sum_i b_i k_i
 *
 * with J = f_y and f_t at (t0, y0), and all gamma_ii = gamma. With U_i = h sum_j gamma_ij k_j no product with J is
 * left:
 *
 *     (1 / (h gamma) - J) U_i = f(t0 + alpha_i h, y0 + sum_{j<i} a_ij U_j) + sum_{j<i} C_ij U_j / h + gamma_i h f_t
 *     y1 = y0 + sum_i m_i U_i
 *
 * Error estimate: the difference to the embedded method is U_8. U_8 solves such a system, and so decays if the motion
 * is stiff.
 *
 * J. The order depends on an exact Jacobian. This Jacobian is computed at every step, with central differences if the
 * caller provides none. If the Jacobian cannot be computed, the old Jacobian remains in use, and the step is counted
 * (capped). The order of such a step is lower, and the error estimate of an adaptive step includes this. After a bend
 * near a singular position of loops, the old J may be wrong by any factor, and steps with this J would be shorter by
 * this factor. If the slope of the second stage is predicted better without J, the step uses J = 0.
 *
 * f_t. The caller may declare that f does not depend on time (kt_newton.autonomous), or may compute f_t
 * (kt_newton.time_derivative). Otherwise f_t is a difference within the step. delta is h / 1024, or eight roundings of
 * t0 if these are longer:
 *
 *     f_t = (-3 f(t0) + 4 f(t0 + delta) - f(t0 + 2 delta)) / (2 delta)
 *
 * The error of the difference is delta^2 f_ttt / 3, which contributes 1e-7 h^4 f_ttt to a step. The rounding of f
 * contributes 5e-13 h f. A step of less than 16 roundings of the time has no room for the difference, and f_t is left
 * out.
 *
 * Hidden residuals. A stiff force may vanish within the step, as that of a contact that opens. The inverse of 1 / (h
 * gamma) - J then leaves nothing of the change in U, and so in the estimate. But the stages 6 to 8 are all at the end
 * of the step:
 *
 *     Y_7 = Y_6 + U_6,     Y_8 = Y_7 + U_7
 *
 * J predicts f(Y_7) = f(Y_6) + J U_6, and likewise f(Y_8). If the prediction is wrong by a large part of J U, and the
 * matrix hides this, h gamma times the prediction error counts as an error, too.
 *
 * Quadratures. f does not depend on quadratures, and they have no part in J. Quadratures are integrated to order 4 with
 * Simpson's rule over the dense output, which takes two more evaluations.
 *
 * Dense output: the quartic through both states, the value in the middle, and the slopes at the ends. The slopes are
 * those of the published continuous output and are not evaluated, because f would magnify the small deviation of y1
 * from a stiff motion. The slope at the start is the last slope of the previous step.
 *
 * Linear stability (rational.c): R = Y_8, since b is the last row of B = alpha + gamma. The numerator of R has degree
 * 7, so that R goes to 0.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.7.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/rosenbrock.h"
#include "integrator/newton.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { STAGES = KT_ROSENBROCK_STAGES };

/* Slots: f(t0, y0), the slope of a stage, and a slot for differences. */
enum { SLOT_START, SLOT_STAGE, SLOT_OTHER, SLOTS };

/* Rows of a try: U, f_t, the slope at the end, and the state in the middle less the mean of both ends. The last two
 * rows are free until the last stage is solved. */
enum { ROW_U, ROW_TIME = ROW_U + STAGES, ROW_END, ROW_MIDDLE, ROWS, ROW_FORETOLD = ROW_MIDDLE };

/* The first of the stages at the end of the step. Each of these stages is the previous stage plus its U. */
enum { FIRST_AT_END = 5 };

/* A prediction error counts if it exceeds the tolerance and FORETOLD_PART of J U, and if the matrix hides it. The
 * matrix hides an error if less than HIDDEN_PART of it remains, but more than HIDDEN_ROUNDINGS roundings of the state.
 * With a FORETOLD_PART of 0.3 or 0.1, the smooth motion of a stiff direction that turns takes twice the steps. */
#define FORETOLD_PART 0.5
#define HIDDEN_PART 0.01
#define HIDDEN_ROUNDINGS 100.0

/* The history besides Newton's: whether a step has been made; the slopes at both ends, and the value in the middle. */
enum { HISTORY_FLAG, HISTORY_SLOPES };

static const kt_rosenbrock *rosenbrock_table_of(const kt_integrator *it) { return it->method->transformed; }

static double rosenbrock_gamma_of(const kt_method *m) { return m->gamma[0]; }

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static void measure_rosenbrock(const kt_method *method, kt_integrator_sizes *sizes) {
    (void)method;
    sizes->slots = SLOTS;
    kt_newton_measure(sizes, ROWS, HISTORY_SLOPES + 3 * sizes->n);
}

static void rosenbrock_init(kt_integrator *it) {
    it->fresh = SLOT_OTHER;
    it->gives_end_derivative = false;
}

/* ---- the time ---------------------------------------------------------------------------------------------------- */

/* f_t becomes h f_t. */
static kt_try_result scale_slope(kt_integrator *it, double h, kt_try *result) {
    double *slope = kt_newton_row(it, ROW_TIME);
    for (size_t l = 0; l < it->sizes.n; l++)
        slope[l] *= h;
    return result->result = KT_TRY_PASSED;
}

/* h f_t into its row. */
static kt_try_result find_slope_time_derivative(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n;
    const kt_newton *newton = it->options.newton;
    double *slope = kt_newton_row(it, ROW_TIME);
    const double *f = it->k[SLOT_START], *next = it->k[SLOT_STAGE];
    memset(slope, 0, n * sizeof *slope);
    if (newton != NULL && newton->autonomous != NULL && newton->autonomous(it->callbacks.user))
        return KT_TRY_PASSED;
    const int known = newton != NULL && newton->time_derivative != NULL
                          ? newton->time_derivative(in->t, in->y, f, slope, it->callbacks.user)
                          : 1;
    it->memory.counts.evaluations += known == 0;
    if (known <= 0)
        return known == 0 ? scale_slope(it, in->h, result) : kt_try_called(result, known, "the slope in time", in->t);
    memset(slope, 0, n * sizeof *slope);
    const double delta = fmax(in->h / 1024.0, 8.0 * DBL_EPSILON * fabs(in->t));
    for (int k = 1; k <= 2 && 2.0 * delta <= in->h; k++) {
        const double t = in->t + (double)k * delta, part = (k == 1 ? 2.0 : -1.0) * (in->h / (t - in->t));
        if (kt_evaluate(it, t, in->y, SLOT_STAGE, result) != KT_TRY_PASSED)
            return result->result;
        for (size_t l = 0; l < n; l++)
            slope[l] += part * (next[l] - f[l]);
    }
    return KT_TRY_PASSED;
}

/* ---- the stages -------------------------------------------------------------------------------------------------- */

/* out = y + sum_{j < count} weights_j U_j */
static void combine_stages(const kt_integrator *it, const double *y, const double *weights, int count, double *out) {
    const size_t n = it->sizes.n;
    memcpy(out, y, n * sizeof *out);
    for (int j = 0; j < count; j++)
        kt_add_times(out, weights[j], kt_newton_row(it, ROW_U + j), n);
}

/* Whether J predicts f at the stage after i. Fixed steps have no error estimate, and need no prediction. */
static bool predicts_stage(const kt_integrator *it, int i) { return i >= FIRST_AT_END && !(it->options.step > 0.0); }

static double increment_size_of(const kt_integrator *it, const double *x) {
    return kt_newton_of(it)->slack * sqrt(kt_newton_square(it, x) / (double)it->counted);
}

/* f(Y) + J U of stage i, computed as U / (h gamma) - rest / h. The function begin_prediction writes the second term
 * before the stage is solved. Afterwards predict_stage adds the first term. */
static void begin_prediction(kt_integrator *it, int i, const double *rest, double h) {
    double *foretold = kt_newton_row(it, ROW_FORETOLD);
    for (size_t l = 0; l < it->sizes.n && predicts_stage(it, i); l++)
        foretold[l] = -rest[l] / h;
}

/* Completes the prediction of f at the next stage, sigma U_i - (sum_j C_ij U_j) / h = f + J U_i. Its error is compared
 * with J U_i / sigma. */
static void predict_stage(kt_integrator *it, int i, double sigma) {
    double *foretold = kt_newton_row(it, ROW_FORETOLD), *change = kt_newton_row(it, ROW_END);
    const double *u = kt_newton_row(it, ROW_U + i), *f = it->k[SLOT_STAGE];
    if (!predicts_stage(it, i))
        return;
    for (size_t l = 0; l < it->sizes.n; l++) {
        foretold[l] += sigma * u[l];
        change[l] = (foretold[l] - f[l]) / sigma; /* J U / sigma */
    }
    kt_newton_of(it)->bare[0] = increment_size_of(it, change);
}

/* Compares f at stage i with its prediction. */
static kt_try_result check_foretold(kt_integrator *it, int i, kt_complex sigma, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    double *off = kt_newton_row(it, ROW_FORETOLD), *bare = kt_newton_row(it, ROW_END);
    if (!predicts_stage(it, i - 1))
        return KT_TRY_PASSED;
    for (size_t l = 0; l < it->sizes.n; l++) {
        off[l] = it->k[SLOT_STAGE][l] - off[l];
        bare[l] = off[l] / sigma.re;
    }
    const double size = increment_size_of(it, bare);
    if (!(size > fmax(1.0, FORETOLD_PART * w->bare[0])))
        return KT_TRY_PASSED;
    if (kt_newton_solve(it, sigma, off, NULL, result) != KT_TRY_PASSED)
        return result->result;
    const double seen = increment_size_of(it, off);
    if (seen < HIDDEN_PART * size && seen > HIDDEN_ROUNDINGS * DBL_EPSILON * increment_size_of(it, it->y))
        w->hidden = fmax(w->hidden, size);
    return KT_TRY_PASSED;
}

/* (sigma - J) U_i = f(t0 + alpha_i h, y0 + sum_j a_ij U_j) + sum_j C_ij U_j / h + gamma_i h f_t
 * with sigma = 1 / (h gamma) */
static kt_try_result solve_rosenbrock_stage(kt_integrator *it, const kt_interval *in, int i, kt_try *result) {
    const size_t n = it->sizes.n;
    const kt_rosenbrock *table = rosenbrock_table_of(it);
    const kt_complex sigma = {1.0 / (in->h * rosenbrock_gamma_of(it->method)), 0.0};
    const double *f = it->k[SLOT_START], *slope = kt_newton_row(it, ROW_TIME);
    double *u = kt_newton_row(it, ROW_U + i);
    if (i > 0) {
        const double t = it->method->c[i] == 1.0 ? in->end : in->t + it->method->c[i] * in->h;
        combine_stages(it, in->y, table->a[i], i, it->trial);
        if (kt_evaluate(it, t, it->trial, SLOT_STAGE, result) != KT_TRY_PASSED)
            return result->result;
        if (check_foretold(it, i, sigma, result) != KT_TRY_PASSED)
            return result->result;
        f = it->k[SLOT_STAGE];
    }
    memset(u, 0, n * sizeof *u);
    for (int j = 0; j < i; j++)
        for (size_t l = 0; l < n; l++)
            u[l] += table->coupling[i][j] * kt_newton_row(it, ROW_U + j)[l];
    begin_prediction(it, i, u, in->h);
    for (size_t l = 0; l < n; l++)
        u[l] = f[l] + u[l] / in->h + table->gamma_sum[i] * slope[l];
    if (kt_newton_solve(it, sigma, u, NULL, result) != KT_TRY_PASSED)
        return result->result;
    predict_stage(it, i, sigma.re);
    return KT_TRY_PASSED;
}

/* The slope at the end and the middle, for the dense output. */
static void set_dense(kt_integrator *it, double h) {
    const size_t n = it->sizes.n;
    const kt_rosenbrock *table = rosenbrock_table_of(it);
    double *end = kt_newton_row(it, ROW_END), *middle = kt_newton_row(it, ROW_MIDDLE);
    memset(end, 0, n * sizeof *end);
    memset(middle, 0, n * sizeof *middle);
    for (int j = 0; j < STAGES; j++) {
        const double *u = kt_newton_row(it, ROW_U + j);
        for (size_t l = 0; l < n; l++) {
            end[l] += table->end[j] * u[l] / h;
            middle[l] += (table->middle[j] - 0.5 * table->m[j]) * u[l];
        }
    }
}

/* Integrates the quadratures g with Simpson's rule, from their slopes at t0, in the middle and at the end. Only the
 * quadratures of `trial` change. Also sets their dense output:
 *
 *     z(1/2) = z0 + h (5 g0 + 8 g_m - g1) / 24 */
static kt_try_result integrate_quadratures(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n, first = it->counted;
    const double *g0 = it->k[SLOT_START], *g1 = it->k[SLOT_STAGE], *gm = it->k[SLOT_OTHER];
    double *end = kt_newton_row(it, ROW_END), *middle = kt_newton_row(it, ROW_MIDDLE),
           *state = kt_newton_row(it, ROW_TIME);
    for (size_t l = 0; l < n; l++)
        state[l] = 0.5 * (in->y[l] + it->trial[l]) + middle[l];
    if (kt_evaluate(it, in->t + 0.5 * in->h, state, SLOT_OTHER, result) != KT_TRY_PASSED ||
        kt_evaluate(it, in->end, it->trial, SLOT_STAGE, result) != KT_TRY_PASSED)
        return result->result;
    for (size_t l = first; l < n; l++) {
        it->trial[l] = in->y[l] + in->h / 6.0 * (g0[l] + 4.0 * gm[l] + g1[l]);
        end[l] = g1[l];
        middle[l] = in->h / 24.0 * (5.0 * g0[l] + 8.0 * gm[l] - g1[l]) - 0.5 * (it->trial[l] - in->y[l]);
    }
    return KT_TRY_PASSED;
}

/* Whether an old J predicts the change of the slope up to the second stage worse than J = 0 does. The second stage must
 * have been evaluated. The prediction is J a_21 U_1, with
 *
 *     J U_1 = U_1 / (h gamma) - f(t0, y0) - gamma_1 h f_t */
static bool misleads(kt_integrator *it, double h) {
    const size_t n = it->sizes.n;
    const kt_rosenbrock *table = rosenbrock_table_of(it);
    const double *u = kt_newton_row(it, ROW_U), *slope = kt_newton_row(it, ROW_TIME), *f = it->k[SLOT_START];
    const double *next = it->k[SLOT_STAGE], sigma = 1.0 / (h * rosenbrock_gamma_of(it->method));
    double *change = kt_newton_row(it, ROW_MIDDLE), *foreseen = kt_newton_row(it, ROW_END);
    for (size_t l = 0; l < n; l++) {
        change[l] = next[l] - f[l] - it->method->c[1] * slope[l];
        foreseen[l] = table->a[1][0] * (sigma * u[l] - f[l] - table->gamma_sum[0] * slope[l]);
    }
    return !(kt_scaled_norm(it, change, foreseen) <= kt_scaled_norm(it, change, NULL));
}

/* All stages, without an old J if that misleads. */
static kt_try_result solve_stages(kt_integrator *it, const kt_interval *in, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    for (int i = 0, next = 0; i < STAGES; i = next) {
        if (solve_rosenbrock_stage(it, in, i, result) != KT_TRY_PASSED)
            return result->result;
        const bool is_old = !w->is_of_now && (int)w->now.state == KT_JACOBIAN_KNOWN;
        const bool again = i == 1 && is_old && misleads(it, in->h);
        if (again)
            w->now.state = KT_JACOBIAN_LEFT_OUT;
        next = again ? 0 : i + 1;
    }
    return KT_TRY_PASSED;
}

/* The matrix, f_t, the stages, and y1 = y0 + sum_i m_i U_i. */
static kt_try_result rosenbrock_try(kt_integrator *it, const kt_interval *in, kt_try *result) {
    kt_newton_work *w = kt_newton_of(it);
    w->hidden = 0.0;
    w->factored = w->now.step = 0.0;               /* those of another step, however near, are not exact */
    if ((int)w->now.state == KT_JACOBIAN_LEFT_OUT) /* of another try, too */
        w->now.state = KT_JACOBIAN_KNOWN;
    if (kt_newton_factor(it, in->h, 1.0 / rosenbrock_gamma_of(it->method), (kt_complex){0.0, 0.0}, result) !=
            KT_TRY_PASSED ||
        find_slope_time_derivative(it, in, result) != KT_TRY_PASSED)
        return result->result;
    if (solve_stages(it, in, result) != KT_TRY_PASSED)
        return result->result;
    combine_stages(it, in->y, rosenbrock_table_of(it)->m, STAGES, it->trial);
    set_dense(it, in->h);
    if (it->counted < it->sizes.n && kt_first_not_finite(it->trial, it->counted) == it->counted)
        return integrate_quadratures(it, in, result);
    return KT_TRY_PASSED;
}

/* ---- the error --------------------------------------------------------------------------------------------------- */

static double rosenbrock_error_norm(const kt_integrator *it, double h) {
    return fmax(kt_error_norm(it, h), kt_newton_of(it)->hidden);
}

static double rosenbrock_error_at(const kt_integrator *it, double h, size_t i) {
    (void)h;
    return kt_newton_row(it, ROW_U + STAGES - 1)[i];
}

static kt_status rosenbrock_report(const kt_integrator *it, const char *where, kt_error *error) {
    (void)it;
    return kt_error_set(error, KT_ERROR_STEP, where,
                        "the matrix of a linearly implicit step is singular; take a smaller step");
}

/* ---- after a step ------------------------------------------------------------------------------------------------ */

/* Stores slopes and the middle of the step for the dense output. The next step needs a new Jacobian. */
static void rosenbrock_accept(kt_integrator *it) {
    const size_t n = it->sizes.n;
    double *history = kt_newton_history(it), *start = history + HISTORY_SLOPES, *end = start + n, *middle = end + n;
    memcpy(start, history[HISTORY_FLAG] > 0.0 ? end : it->k[SLOT_START], n * sizeof *start);
    memcpy(end, kt_newton_row(it, ROW_END), n * sizeof *end);
    memcpy(middle, kt_newton_row(it, ROW_MIDDLE), n * sizeof *middle);
    history[HISTORY_FLAG] = 1.0;
    it->memory.counts.capped += !kt_newton_of(it)->is_of_now;
    kt_newton_accept(it);
    kt_newton_request_jacobian(it);
}

/* Beyond the cubic of the ends, the term theta^2 theta'^2 Q meets the middle, with
 *
 *     Q = 16 (middle - h (s0 - s1) / 8) */
static kt_try_result rosenbrock_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result) {
    const size_t n = it->sizes.n;
    const double t0 = it->memory.previous_t, h = it->memory.last_step, theta = (t - t0) / (it->memory.t - t0);
    const double rest = 1.0 - theta, cubic = theta * theta * (3.0 - 2.0 * theta);
    const double *y0 = it->previous_y, *y1 = it->y;
    const double *s0 = kt_newton_history(it) + HISTORY_SLOPES, *s1 = s0 + n, *middle = s1 + n;
    for (size_t l = 0; l < n; l++) {
        const double bubble = 16.0 * middle[l] - 2.0 * h * (s0[l] - s1[l]);
        y_out[l] = y0[l] + cubic * (y1[l] - y0[l]) +
                   theta * rest * (h * (rest * s0[l] - theta * s1[l]) + theta * rest * bubble);
    }
    return result->result = KT_TRY_PASSED;
}

/* ---- linear stability -------------------------------------------------------------------------------------------- */

static kt_status rosenbrock_function(const kt_method *m, int stages, kt_stability *out, kt_error *error) {
    (void)stages;
    (void)error;
    kt_rational_stages(m, rosenbrock_gamma_of(m), 0, STAGES - 1, out);
    return KT_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

static const kt_history_word rosenbrock_words[] = {
    KT_NEWTON_WORDS, {"first step", KT_HISTORY_METHOD, HISTORY_FLAG, KT_BLOCK_YES_NO}, {.name = NULL}};

const kt_method_family kt_family_rosenbrock = {
    .name = "rosenbrock",
    .exact = true,
    .check_sizes = kt_table_check_sizes,
    .measure = measure_rosenbrock,
    .words = rosenbrock_words,
    .init = rosenbrock_init,
    .try_step = rosenbrock_try,
    .error = rosenbrock_error_norm,
    .error_at = rosenbrock_error_at,
    .accept = rosenbrock_accept,
    .report = rosenbrock_report,
    .interpolate = rosenbrock_interpolate,
    .stability = rosenbrock_function,
    .value = kt_rational_value,
    KT_NEWTON_MEMBERS,
};
