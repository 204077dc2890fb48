/* The family of Radau IIA methods: implicit, for stiff equations.
 *
 * The stages are y0 + z_i, i = 1 .. 3, at the times t0 + c_i h, the last at the end of the step:
 *
 *     z_i = h sum_j a_ij f(t0 + c_j h, y0 + z_j),     y1 = y0 + z_3
 *
 * With A^-1 T = T L, where L = (gamma, 0, 0; 0, alpha, -beta; 0, beta, alpha), and z = T w, a simplified Newton
 * iteration splits into one real system and one complex one:
 *
 *     (gamma / h - J) dw_1                            = (T^-1 f)_1 - gamma w_1 / h
 *     ((alpha + i beta) / h - J) (dw_2 + i dw_3)      = (T^-1 f)_2 + i (T^-1 f)_3 - (alpha + i beta) (w_2 + i w_3) / h
 *
 * The iteration begins with the continued polynomial of the last step, or with 0 in the first step. The residuals f - k
 * of the stages, k = A^-1 z / h, show whether J hides a part of them (newton.c).
 *
 * Error estimate. The embedded formula of order 3 (tables/radau_table.c) is filtered so that it decays if the motion is
 * stiff:
 *
 *     err = (gamma / h - J)^-1 (f(t0, y0) + gamma (e_1 z_1 + e_2 z_2 + e_3 z_3) / h)
 *
 * If err is too large in the first step or after a rejected try, err is computed once more with f(t0, y0 + err).
 *
 * Dense output. The slopes of the stages, k = A^-1 z / h, are those of the polynomial through the stages, and are not
 * evaluated, because f would magnify the small deviation of y1 from a stiff motion. The slope at the start is the last
 * slope of the previous step.
 *
 * Linear stability, A- and L-stable:
 *
 *     R(z) = (1 + 2 z / 5 + z^2 / 20) / (1 - 3 z / 5 + 3 z^2 / 20 - z^3 / 60)
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.8. The last component of
 * each column of T is 1 (for the complex pair: 1 and 0). All digits are computed from A.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/newton.h"

#include <math.h>
#include <string.h>

enum { STAGES = 3 };

/* Slots of slopes: f(t0, y0), then those of the stages. */
enum { SLOT_START, SLOT_FIRST, SLOTS = SLOT_FIRST + STAGES };

/* Rows of a try: z, w, the error estimate. */
enum { ROW_Z, ROW_W = ROW_Z + STAGES, ROW_ERROR = ROW_W + STAGES, ROWS };

/* The history besides Newton's: whether a step has been made, and the slopes of its dense output. */
enum { HISTORY_FLAG, HISTORY_SLOPES };

static const double gamma_real = 3.6378342527444957322084185;
static const kt_complex gamma_pair = {2.6810828736277521338957907, 3.0504301992474105694263776};

static const double t_matrix[STAGES][STAGES] = {
    {0.09443876248897524148749008, -0.14125529502095420842799038, -0.030029194105147424491861117},
    {0.25021312296533331137650907, 0.20412935229379993199599081, 0.38294211275726193779543823},
    {1.0, 1.0, 0.0},
};
static const double t_inverse[STAGES][STAGES] = {
    {4.1787185915519047273464627, 0.32768282076106238708253327, 0.52337644549944954803993092},
    {-4.1787185915519047273464627, -0.32768282076106238708253327, 0.47662355450055045196006908},
    {-0.50287263494578687595124734, 2.5719269498556054291867854, -0.59603920482822492496882191},
};
static const double a_inverse[STAGES][STAGES] = {
    {3.224744871391589049098642, 1.1678400846904054949240413, -0.25319726474218082618594242},
    {-3.5678400846904054949240413, 0.77525512860841095090135796, 1.0531972647421808261859424},
    {5.5319726474218082618594242, -7.5319726474218082618594242, 5.0},
};
/* gamma e of the error estimate: (-13 - 7 sqrt 6) / 3, (-13 + 7 sqrt 6) / 3, -1 / 3 */
static const double gamma_e[STAGES] = {-10.048809399827415562460330, 1.3821427331607488957936628,
                                       -0.3333333333333333333333333};

/* out_i = sum_j m_ij x_j / divisor, for component c of the three vectors. */
static inline void transform_stages(const double m[STAGES][STAGES], const double x[STAGES], double divisor,
                                    double out[STAGES]) {
    for (int i = 0; i < STAGES; i++)
        out[i] = (m[i][0] * x[0] + m[i][1] * x[1] + m[i][2] * x[2]) / divisor;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static void measure_radau(const kt_method *method, kt_integrator_sizes *sizes) {
    (void)method;
    sizes->slots = SLOTS;
    kt_newton_measure(sizes, ROWS, HISTORY_SLOPES + (1 + STAGES) * sizes->n);
}

static void radau_init(kt_integrator *it) {
    it->fresh = SLOTS - 1;
    it->gives_end_derivative = false; /* that of the polynomial is not f(t1, y1) to rounding */
}

/* ---- the stages -------------------------------------------------------------------------------------------------- */

/* B_j(s), the integral from 0 to s of the Lagrange polynomial of node j over c_1, c_2, c_3. */
static double integral_of_basis(const double *c, int j, double s) {
    const double p = c[(j + 1) % STAGES], q = c[(j + 2) % STAGES];
    return s * (p * q - s * (0.5 * (p + q) - s / 3.0)) / ((c[j] - p) * (c[j] - q));
}

/* z_i = u(1 + c_i r) - u(1), with u the polynomial of the last step and r = h / h_last. */
static void predict_radau_stages(kt_integrator *it, double h) {
    const size_t n = it->sizes.n;
    const double *c = it->table->c + 1, *history = kt_newton_history(it), last = it->memory.last_step;
    double *z = kt_newton_row(it, ROW_Z);
    memset(z, 0, STAGES * n * sizeof *z);
    for (int i = 0; i < STAGES && history[HISTORY_FLAG] > 0.0; i++)
        for (int j = 0; j < STAGES; j++) {
            const double *k = history + HISTORY_SLOPES + (size_t)(1 + j) * n;
            const double weight =
                last * (integral_of_basis(c, j, 1.0 + c[i] * h / last) - integral_of_basis(c, j, 1.0));
            for (size_t l = 0; l < n; l++)
                z[(size_t)i * n + l] += weight * k[l];
        }
}

/* w = T^-1 z, or z = T w. */
static void convert(kt_integrator *it, const double m[STAGES][STAGES], int from, int to) {
    const size_t n = it->sizes.n;
    const double *x = kt_newton_row(it, from);
    double *y = kt_newton_row(it, to);
    for (size_t l = 0; l < n; l++) {
        const double in[STAGES] = {x[l], x[n + l], x[2 * n + l]};
        double out[STAGES];
        transform_stages(m, in, 1.0, out);
        for (size_t i = 0; i < STAGES; i++)
            y[i * n + l] = out[i];
    }
}

/* f at all stages, into their slots. */
static kt_try_result evaluate_stages(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n;
    for (int i = 0; i < STAGES; i++) {
        const double *z = kt_newton_row(it, ROW_Z + i);
        const double t = i == STAGES - 1 ? in->end : in->t + it->table->c[1 + i] * in->h;
        for (size_t l = 0; l < n; l++)
            it->trial[l] = in->y[l] + z[l];
        if (kt_evaluate(it, t, it->trial, SLOT_FIRST + (size_t)i, result) != KT_TRY_PASSED)
            return result->result;
    }
    return KT_TRY_PASSED;
}

/* Records |h / gamma (f - k)| of all stages. With fixed steps the iteration continues to rounding anyway. */
static void store_residuals(kt_integrator *it, double h) {
    const size_t n = it->sizes.n;
    const kt_newton_work *w = kt_newton_of(it);
    const double *z = kt_newton_row(it, ROW_Z), part = h / gamma_real;
    double square[STAGES] = {0.0, 0.0, 0.0};
    if (it->options.step > 0.0 || kt_newton_is_zero(w))
        return;
    for (size_t l = 0; l < it->counted; l++) {
        const double in[STAGES] = {z[l], z[n + l], z[2 * n + l]}, weight = part / w->scale[l];
        double slope[STAGES];
        transform_stages(a_inverse, in, h, slope);
        for (size_t i = 0; i < STAGES; i++) {
            const double u = weight * (it->k[SLOT_FIRST + i][l] - slope[i]);
            square[i] += u * u;
        }
    }
    for (size_t i = 0; i < STAGES; i++)
        kt_newton_store_residual(it, i, sqrt(square[i] / (double)it->counted));
}

/* The right-hand sides of the two systems, in place of the slopes. */
static void form_residuals(kt_integrator *it, double h) {
    const size_t n = it->sizes.n;
    const double *w = kt_newton_row(it, ROW_W);
    double *const *k = it->k + SLOT_FIRST;
    for (size_t l = 0; l < n; l++) {
        const double f[STAGES] = {k[0][l], k[1][l], k[2][l]}, w2 = w[n + l], w3 = w[2 * n + l];
        double r[STAGES];
        transform_stages(t_inverse, f, 1.0, r);
        k[0][l] = r[0] - gamma_real * w[l] / h;
        k[1][l] = r[1] - (gamma_pair.re * w2 - gamma_pair.im * w3) / h;
        k[2][l] = r[2] - (gamma_pair.im * w2 + gamma_pair.re * w3) / h;
    }
}

/* One iteration: w and z are corrected. *size: the weighted norm of the correction. */
static kt_try_result correct_radau_stages(kt_integrator *it, const kt_interval *in, double *size, kt_try *result) {
    const size_t n = it->sizes.n;
    const kt_complex real = {gamma_real / in->h, 0.0}, pair = {gamma_pair.re / in->h, gamma_pair.im / in->h};
    double *w = kt_newton_row(it, ROW_W), *const *k = it->k + SLOT_FIRST;
    if (evaluate_stages(it, in, result) != KT_TRY_PASSED)
        return result->result;
    store_residuals(it, in->h);
    form_residuals(it, in->h);
    if (kt_newton_solve(it, real, k[0], NULL, result) != KT_TRY_PASSED ||
        kt_newton_solve(it, pair, k[1], k[2], result) != KT_TRY_PASSED)
        return result->result;
    double square = 0.0;
    for (size_t i = 0; i < STAGES; i++) {
        square += kt_newton_square_of(it, k[i], w + i * n);
        for (size_t l = 0; l < n; l++)
            w[i * n + l] += k[i][l];
    }
    *size = sqrt(square / (double)(STAGES * it->counted));
    convert(it, t_matrix, ROW_W, ROW_Z);
    for (int i = 0; i < STAGES; i++)
        if (kt_newton_check(it, kt_newton_row(it, ROW_Z + i), in->end, *size, result) != KT_TRY_PASSED)
            return result->result;
    return KT_TRY_PASSED;
}

/* Newton's iteration for z_i = Y_i - y0 from a prediction. */
static kt_try_result iterate_radau_stages(kt_integrator *it, const kt_interval *in, kt_try *result) {
    predict_radau_stages(it, in->h);
    convert(it, t_inverse, ROW_Z, ROW_W);
    kt_newton_begin(it);
    for (bool done = false; !done;) {
        double size = 0.0;
        if (correct_radau_stages(it, in, &size, result) != KT_TRY_PASSED ||
            kt_newton_test_convergence(it, size, &done, result) != KT_TRY_PASSED)
            return result->result;
    }
    return KT_TRY_PASSED;
}

/* ---- a try ------------------------------------------------------------------------------------------------------- */

/* k = A^-1 z / h into the slots of the stages. */
static void set_slopes(kt_integrator *it, double h) {
    const size_t n = it->sizes.n;
    const double *z = kt_newton_row(it, ROW_Z);
    for (size_t l = 0; l < n; l++) {
        const double in[STAGES] = {z[l], z[n + l], z[2 * n + l]};
        double out[STAGES];
        transform_stages(a_inverse, in, h, out);
        for (size_t i = 0; i < STAGES; i++)
            it->k[SLOT_FIRST + i][l] = out[i];
    }
}

/* The filtered estimate, from the slope f0 at the start. */
static kt_try_result filter(kt_integrator *it, const double *f0, double h, kt_try *result) {
    const size_t n = it->sizes.n;
    const double *z = kt_newton_row(it, ROW_Z);
    double *error = kt_newton_row(it, ROW_ERROR);
    for (size_t l = 0; l < n; l++)
        error[l] = f0[l] + (gamma_e[0] * z[l] + gamma_e[1] * z[n + l] + gamma_e[2] * z[2 * n + l]) / h;
    return kt_newton_solve(it, (kt_complex){gamma_real / h, 0.0}, error, NULL, result);
}

/* sqrt(mean (err_i / scale_i)^2), over the slack of the iteration */
static double radau_error_norm(const kt_integrator *it, double h) {
    const double *error = kt_newton_row(it, ROW_ERROR);
    double sum = 0.0;
    (void)h;
    for (size_t i = 0; i < it->counted; i++) {
        const double u = error[i] / kt_error_scale(it, i, it->y[i], it->trial[i]);
        sum += u * u;
    }
    return sqrt(sum / (double)it->counted) / kt_newton_of(it)->slack;
}

/* f(t0, y0 + err) goes to the slot of the first stage, before the slope of this stage. */
static kt_try_result estimate_radau_error(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n;
    double *error = kt_newton_row(it, ROW_ERROR);
    const bool early = kt_newton_history(it)[HISTORY_FLAG] == 0.0 || kt_newton_of(it)->rejected;
    if (filter(it, it->k[SLOT_START], in->h, result) != KT_TRY_PASSED)
        return result->result;
    if (!early || radau_error_norm(it, in->h) <= 1.0)
        return KT_TRY_PASSED;
    for (size_t l = 0; l < n; l++)
        error[l] += in->y[l];
    if (kt_evaluate(it, in->t, error, SLOT_FIRST, result) != KT_TRY_PASSED)
        return result->result;
    return filter(it, it->k[SLOT_FIRST], in->h, result);
}

/* Stages, y1 = y0 + z_3, and with adaptive steps the error. A failed iteration may be repeated with a new Jacobian. */
static kt_try_result radau_try(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n;
    do {
        if (kt_newton_factor(it, in->h, gamma_real, gamma_pair, result) == KT_TRY_PASSED &&
            iterate_radau_stages(it, in, result) == KT_TRY_PASSED)
            break;
    } while (kt_newton_retry(it, result) == KT_TRY_PASSED);
    if (result->result != KT_TRY_PASSED)
        return result->result;
    const double *z = kt_newton_row(it, ROW_Z + STAGES - 1);
    for (size_t l = 0; l < n; l++)
        it->trial[l] = in->y[l] + z[l];
    if (it->options.step == 0.0 && kt_first_not_finite(it->trial, n) == n &&
        estimate_radau_error(it, in, result) != KT_TRY_PASSED)
        return result->result;
    set_slopes(it, in->h);
    return KT_TRY_PASSED;
}

static double radau_error_at(const kt_integrator *it, double h, size_t i) {
    (void)h;
    return kt_newton_row(it, ROW_ERROR)[i] / kt_newton_of(it)->slack;
}

/* ---- after a step ------------------------------------------------------------------------------------------------ */

/* Stores the slopes of the step for its dense output and for the next prediction. */
static void radau_accept(kt_integrator *it) {
    const size_t n = it->sizes.n;
    double *history = kt_newton_history(it), *start = history + HISTORY_SLOPES;
    const double *last = history[HISTORY_FLAG] > 0.0 ? start + STAGES * n : it->k[SLOT_START];
    memcpy(start, last, n * sizeof *start);
    for (size_t i = 0; i < STAGES; i++)
        memcpy(start + (1 + i) * n, it->k[SLOT_FIRST + i], n * sizeof *start);
    history[HISTORY_FLAG] = 1.0;
    kt_newton_accept(it);
}

static kt_try_result radau_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result) {
    double *k[1 + STAGES];
    for (size_t j = 0; j <= STAGES; j++)
        k[j] = kt_newton_history(it) + HISTORY_SLOPES + j * it->sizes.n;
    kt_dense_state(it, t, 1 + STAGES, k, y_out);
    return result->result = KT_TRY_PASSED;
}

/* ---- linear stability -------------------------------------------------------------------------------------------- */

/* R(z) of Radau IIA with three stages: the Pade approximant of exp z with degrees 2 and 3. */
static kt_status radau_function(const kt_method *method, int stages, kt_stability *out, kt_error *error) {
    static const double p[] = {1.0, 2.0 / 5.0, 1.0 / 20.0}, q[] = {1.0, -3.0 / 5.0, 3.0 / 20.0, -1.0 / 60.0};
    (void)method;
    (void)stages;
    (void)error;
    out->degree = 2;
    out->poles = 3;
    memcpy(out->coefficient, p, sizeof p);
    memcpy(out->denominator, q, sizeof q);
    return KT_OK;
}

/* ------------------------------------------------------------------------------------------------------------------ */

static const kt_history_word radau_words[] = {
    KT_NEWTON_WORDS, {"first step", KT_HISTORY_METHOD, HISTORY_FLAG, KT_BLOCK_YES_NO}, {.name = NULL}};

const kt_method_family kt_family_radau = {
    .name = "radau",
    .check_sizes = kt_table_check_sizes,
    .measure = measure_radau,
    .words = radau_words,
    .init = radau_init,
    .try_step = radau_try,
    .error = radau_error_norm,
    .error_at = radau_error_at,
    .accept = radau_accept,
    .control = kt_newton_control,
    .report = kt_newton_report,
    .interpolate = radau_interpolate,
    .stability = radau_function,
    .value = kt_rational_value,
    KT_NEWTON_MEMBERS,
};
