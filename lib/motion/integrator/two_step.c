/* The family of implicit two-step methods of order 2 with a chosen spectral radius at infinity (multistep.c has their
 * weights). The radius 0 gives BDF2, which is L-stable; the radius 1 damps nothing.
 *
 *     Y = base + h b_0 f(t1, Y),     base = a_1 y0 + a_2 y_{-1} + h (b_1 f_0 + b_2 f_{-1})
 *
 * This equation is solved as a stage of a diagonally implicit method. The initial guess is y_{-1} + 2 h f_0, with an
 * error of O(h^3). Both past states are projected, and their slopes are evaluated after the projection.
 *
 * A two-step step needs a past state at the distance h. This state is missing at the start, after a jump, and before
 * and after a step of another length. In these cases, the method of the table computes the step; this method is
 * L-stable and of order 2.
 *
 * Source: P. Masarati, M. Lanz, P. Mantegazza, Multistep integration of ordinary, stiff and differential-algebraic
 * problems for multibody dynamics applications, XVI Congresso AIDAA, 2001; [MSD 5.31].
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/dirk.h"
#include "integrator/multistep.h"

#include <string.h>

/* The history after that of diagonally implicit methods: the length of the last step (0: none) and gamma of the factors
 * in memory. The state before that step and its slope follow. */
enum { HISTORY_STEP, HISTORY_GAMMA, HISTORY_STATE };

static double *past_state_of(const kt_integrator *it) { return kt_newton_history(it) + kt_dirk_history(it->sizes.n); }

static void measure_two_step(const kt_method *method, kt_integrator_sizes *sizes) {
    sizes->slots = (size_t)method->stages + 1; /* one more for the differences of a Jacobian */
    kt_newton_measure(sizes, KT_DIRK_ROWS, kt_dirk_history(sizes->n) + HISTORY_STATE + 2 * sizes->n);
}

/* Inputs that are samples of a signal at the start of each step also act at its end. The part b_0 / (b_0 + b_1 + b_2)
 * of the forces therefore lags by h. If the past were forgotten, all forces would lag by h / 2. The past is kept if
 * that part is at most a half. BDF2 forgets the past, since its error would be twice as large.
 *
 * The Jacobian is not kept. The Jacobian of the history is computed again with the present inputs (newton.c), and would
 * have other bits after a checkpoint. */
static void two_step_change(kt_integrator *it, bool smooth) {
    const kt_multistep w = kt_multistep_of(it->method);
    const double *b = w.slopes;
    if (smooth && 2.0 * b[0] <= b[0] + b[1] + b[2])
        kt_newton_renew(it);
    else
        kt_newton_discard(it);
    kt_newton_history(it)[KT_DIRK_FLAG] = 0.0; /* the slope at the start is another one */
}

/* ---- a try ------------------------------------------------------------------------------------------------------- */

static bool step_is_regular(const kt_integrator *it, double h) {
    return kt_is_same_step(h, past_state_of(it)[HISTORY_STEP]);
}

/* The factor of h in the matrix of this step's method. */
static double two_step_gamma_of(const kt_integrator *it, double h) {
    const kt_method *m = it->method;
    return step_is_regular(it, h) ? kt_multistep_of(m).slopes[0] : m->a[m->stages * m->stages - 1];
}

/* Solves y_1 = past_1 y_0 + past_2 y_-1 + h (s_0 f(y_1) + s_1 f(y_0) + s_2 f(y_-1)). The start of Newton's method is
 * the midpoint rule. */
static kt_try_result solve_two_step(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n;
    const kt_multistep w = kt_multistep_of(it->method);
    const double *state = past_state_of(it) + HISTORY_STATE, *slope = state + n, h = in->h;
    const double *last = kt_dirk_slope(it);
    double *base = kt_newton_row(it, KT_DIRK_BASE), *stage = kt_newton_row(it, KT_DIRK_STAGE);
    if (!kt_newton_of(it)->damped &&
        kt_newton_factor(it, h, 1.0 / w.slopes[0], (kt_complex){0.0, 0.0}, result) != KT_TRY_PASSED)
        return result->result;
    for (size_t l = 0; l < n; l++) {
        base[l] =
            w.past[1] * in->y[l] + w.past[2] * state[l] + h * (w.slopes[1] * it->k[0][l] + w.slopes[2] * slope[l]);
        stage[l] = state[l] + 2.0 * h * last[l];
    }
    return kt_dirk_solve(it, in->end, h * w.slopes[0], it->fresh, result);
}

/* Factors of another gamma are discarded. A step whose length differs from the last one has no past, and is a
 * Runge-Kutta step. */
static kt_try_result two_step_try(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const bool regular = step_is_regular(it, in->h);
    if (past_state_of(it)[HISTORY_GAMMA] != two_step_gamma_of(it, in->h))
        kt_newton_of(it)->factored = 0.0;
    return kt_dirk_try(it, in, regular ? solve_two_step : kt_dirk_stages, result);
}

/* Stores the state and the slope before the step, which the next step needs. */
static void two_step_accept(kt_integrator *it) {
    const size_t n = it->sizes.n;
    double *past = past_state_of(it);
    past[HISTORY_GAMMA] = two_step_gamma_of(it, it->memory.last_step);
    past[HISTORY_STEP] = it->memory.last_step;
    memcpy(past + HISTORY_STATE, it->previous_y, n * sizeof *past); /* commit has exchanged them */
    memcpy(past + HISTORY_STATE + n, it->k[0], n * sizeof *past);
    kt_dirk_accept(it);
}

/* ------------------------------------------------------------------------------------------------------------------ */

const kt_method_family kt_family_two_step = {
    .name = "two-step",
    .open = true,
    .check_sizes = kt_multistep_check_sizes,
    .check_order = kt_multistep_check_order,
    .measure = measure_two_step,
    .words = kt_dirk_words,
    .init = kt_dirk_init,
    .change = two_step_change,
    .try_step = two_step_try,
    .error = kt_no_error,
    .error_at = kt_no_error_at,
    .accept = two_step_accept,
    .report = kt_newton_report,
    .interpolate = kt_dirk_interpolate,
    .stability = kt_multistep_stability,
    .value = kt_multistep_value,
    .gain = kt_multistep_gain,
    KT_NEWTON_MEMBERS,
};
