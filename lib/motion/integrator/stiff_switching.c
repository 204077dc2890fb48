/* The family of methods that are explicit until the motion is stiff, and implicit while the motion is stiff: dopri5 and
 * radau5.
 *
 * Stiffness. Stability bounds the steps of dopri5 near h rho = 3.3 on the real axis, where rho is the spectral radius
 * of J = f_y. The last two stages of dopri5, Y_6 and Y_7 = y1, are both at the end of the step. If the fastest mode is
 * at its stability limit, this mode prevails in their difference d, and in the difference g of their slopes, so that
 *
 *     h rho = |g| / |d|,    g = f(Y_7) - f(Y_6) = J (Y_7 - Y_6),    d = (Y_7 - Y_6) / h = sum_j (b_j - a_6j) k_j
 *
 * which costs no evaluation. Two cases resemble this, but their steps are bounded by accuracy, not by stability.
 *   - A corner of f within the step (friction that reverses, a rope that goes slack). The quotient of the differences
 *     of slopes and of states is then any number. At its limit a mode that decays shows 3.3. A mode that oscillates
 *     while it decays shows somewhat more from step to step, since q and v have one norm. Therefore a sign of stiffness
 *     is KT_STIFF_LEAST < h rho < KT_STIFF_MOST.
 *   - At loose tolerances, an oscillation that the steps follow. Then cos(g, d) is 0 in the mean, as over kinks. If a
 *     mode decays, the cosine is -1. Therefore a sign counts 1 - KT_DECAYING (1 + cos(g, d)), and the sum is never less
 *     than 0.
 *
 * The motion counts as stiff when the sum is KT_STIFF_SIGNS, and no KT_CALM_STEPS other steps have interrupted it.
 * Until a first sign is found, only every KT_WATCH_PERIOD-th step is checked. The bounds are measured on the bundled
 * scenes, at tolerances of 1e-3 to 1e-9 (reference/implicit). The bounds are also measured on linear oscillators with a
 * damping of 0.1 to 1 of the critical one.
 *
 * Ringing. If a pair of modes oscillates while it decays, g and d turn against each other from step to step. Their
 * ratio is then any number. Fast modes also prevail in the difference of the error estimate,
 *
 *     e = sum_i e_i k_i = J h d_2,    d_2 = sum_ij e_i a_ij k_j,
 *
 * so that in the plane of the pair [g e] = h J [d d_2]. The eigenvalues of M are the eigenvalues z = h lambda of the
 * pair:
 *
 *     M = (D'D)^-1 D' [g e],     D = [d d_2]
 *
 * Positions count 3.3 / h times in D' (options.positions). Then both halves of an oscillation at the limit have the
 * same size. Otherwise the effect of other modes on velocities would outweigh the positions.
 *
 * dopri5 is stable up to |z| = 2.4 to 3.4 for every damping above 0.05 of the critical one. At this limit, and only
 * there, the pair grows as often as it decays. An oscillation that the steps follow decays like e^z. A step counts as
 * ringing if |g| > KT_RINGING_RATE |d| and KT_RINGING_LEAST < |z| < KT_RINGING_MOST, and if it decays by more than
 * KT_RINGING_DAMPING. The step then counts
 *
 *     1 + KT_RINGING_GROWTH (|R|^2 - 1) / (|R|^2 + 1),
 *
 * where R = R(z) is the growth of the mode in a step of dopri5. Any other step counts -1. The motion is stiff when the
 * sum, never less than 0, is KT_RINGING_SIGNS. The 46 bundled scenes that are not stiff reach at most 6.9 of 20.
 *
 * Oscillation without damping. dopri5 is stable on the imaginary axis up to |z| = 1, and rounding excites a mode there.
 * The amplitude then grows until the error estimate rejects a step, and the motion takes steps of 1 / |lambda| for
 * ever, although the oscillation is no part of the motion: it is as small as the tolerance. A step near that limit
 * resembles one that follows an oscillation at a loose tolerance. Therefore many steps are needed, KT_IDLE_SIGNS, each
 * with KT_IDLE_LEAST < |z| < KT_IDLE_MOST and without damping, and any other step counts -1. radau5 then needs many
 * steps to damp the oscillation, since its own damping is weak near |z| = 2. It is not left for KT_IDLE_PHASE steps.
 * After such a phase, the next one takes twice as many signs.
 *
 * Back. dopri5 takes over again in three cases.
 *   - After the first step, if radau5 took over for a decay and h rho was in truth not above KT_STIFF_LEAST.
 *   - When h rho has been below KT_CALM_LIMIT for KT_WINDOW steps of radau5. dopri5 would take these, too, or two for
 *     each.
 *   - When a window of so many steps has cost more for each second of the motion than the last step of dopri5 did. The
 *     first window does not count.
 *
 * If the implicit phase was short, the next one takes twice as many signs. A motion between the two therefore does not
 * switch for ever.
 *
 * The radius rho is that of the Jacobian in use. When the Jacobian is new, the power method computes rho with the
 * factors of the Jacobian. The eigenvalues of
 *
 *     B = J (sigma - J)^-1 = sigma (sigma - J)^-1 - 1,     sigma = gamma / h,
 *
 * are lambda / (sigma - lambda), so that rho = sigma mu / (1 - mu) if lambda decays, and less if lambda oscillates. The
 * iteration begins with Y_7 - Y_6, in which the fastest mode prevails. The iteration continues with the final vector of
 * the Jacobian before.
 *
 * The steps themselves are those of dopri5 and radau5: a motion that is never stiff has exactly the bits of dopri5.
 * With a fixed step, all steps are dopri5's. The history records the method of the last step, whose dense output may be
 * requested, and the method of the next step. The struct also holds the counts of the detection. The counts change
 * after an accepted step only.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.2 for the detection.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/newton.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define KT_STIFF_LEAST 2.5
#define KT_STIFF_MOST 10.0
#define KT_DECAYING 2.0
#define KT_CALM_LIMIT 4.0
#define KT_RINGING_LEAST 1.8
#define KT_RINGING_RATE 1.5
#define KT_RINGING_MOST 4.5
#define KT_RINGING_DAMPING 0.005
#define KT_RINGING_GROWTH 1.5
#define KT_IDLE_LEAST 0.8
#define KT_IDLE_MOST 1.5
#define KT_REAL_LIMIT 3.3 /* of dopri5 */
#define KT_PARALLEL 1e-14 /* of the square of a sine: d and d_2 span no plane */

enum {
    KT_STIFF_SIGNS = 15,
    KT_RINGING_SIGNS = 20,
    KT_SIGNS_MOST = 960,
    KT_CALM_STEPS = 6,
    KT_WATCH_PERIOD = 8,
    KT_WINDOW = 10,
    KT_LONG_PHASE = 50, /* steps of radau5 */
    KT_POWER_STEPS = 4,
    KT_IDLE_SIGNS = 250, /* of the steps that are checked */
    KT_IDLE_PHASE = 1500 /* steps of radau5 */
};

/* The cost of linear equations in evaluations, measured on mechanisms of 2 to 20 degrees of freedom. The first number
 * is for one evaluation of radau5 with its linear equations. The second number is for a Jacobian and its factors. */
#define KT_IMPLICIT_EVALUATION 1.5
#define KT_JACOBIAN_EVALUATIONS 10.0

/* gamma of radau5: 1 / gamma is the real eigenvalue of A (radau.c). */
static const double gamma_real = 3.6378342527444957322084185;

/* The results of a step for the detection. The results are the last part of the history, after that of radau5 and the
 * vector of the power method. */
typedef struct watch {
    double last_stiff; /* 1: the last step was one of radau5 */
    double next_stiff; /* 1: the next one is */
    double signs;      /* signs for the other method, or their sum */
    double wanted;     /* so many of them it takes to leave dopri5 */
    double calm;       /* dopri5: steps since, that did not */
    double unchecked;  /* dopri5: steps since one was checked */
    double ringing;    /* dopri5: the sum of signs of a pair that rings; radau5: 1: it took over for these */
    double age;        /* radau5: steps since it took over */
    double radius;     /* radau5: rho of the Jacobian in use */
    double price;      /* radau5: evaluations a second that dopri5 took */
    double time;       /* radau5: where the window of its steps began */
    double spent;      /* radau5: the cost of the run there, in evaluations */
    double idle;       /* dopri5: the sum of signs of an oscillation without damping; radau5: steps before it may end */
    double patience;   /* so many of them it takes to leave dopri5 */
} watch;

enum { WATCH_NUMBERS = sizeof(watch) / sizeof(double) };

static watch *watch_of(const kt_integrator *it) {
    return (watch *)(void *)(it->history + it->sizes.history - WATCH_NUMBERS);
}

static double *switching_vector_of(const kt_integrator *it) {
    return it->history + it->sizes.history - WATCH_NUMBERS - it->sizes.n;
}

/* ---- which of the two -------------------------------------------------------------------------------------------- */

static const kt_method_family *active_family(const kt_integrator *it) { return kt_method_family_of(it->table); }

static bool is_stiff(const kt_integrator *it) { return it->table == &kt_method_radau5; }

/* Changes to radau5 (stiff) or dopri5. A slope at the present state stays available. */
static void switch_to(kt_integrator *it, bool stiff) {
    const size_t before = it->fresh;
    if (stiff == is_stiff(it))
        return;
    it->table = stiff ? &kt_method_radau5 : &kt_method_dopri5;
    it->error_order = kt_method_error_order(it->table);
    it->fresh = (size_t)kt_method_fresh(it->table);
    it->gives_end_derivative = !stiff;
    if (it->derivative_slot == (int)before) { /* left there by kt_integrator_derivative after a failed step */
        double *k = it->k[before];
        it->k[before] = it->k[it->fresh];
        it->k[it->fresh] = k;
        it->derivative_slot = (int)it->fresh;
    }
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* Slots and table of dopri5. The history and the scratch are those of radau5, since dopri5 has none, and the history
 * also has the vector of the power method and the watch. */
static void measure_switching(const kt_method *method, kt_integrator_sizes *sizes) {
    kt_integrator_sizes implicit = *sizes;
    kt_family_radau.measure(&kt_method_radau5, &implicit);
    kt_family_explicit.measure(method, sizes);
    sizes->history = implicit.history + sizes->n + WATCH_NUMBERS;
    sizes->scratch = implicit.scratch;
    sizes->newton_rows = implicit.newton_rows;
}

static void switching_init(kt_integrator *it) {
    kt_family_explicit.init(it);
    it->table = &kt_method_dopri5;
}

/* A jump does not change whether the motion is stiff. A new motion, which has no steps yet, counts as not stiff. */
static void switching_start(kt_integrator *it) {
    watch w = {.wanted = KT_STIFF_SIGNS, .patience = KT_IDLE_SIGNS};
    if (it->memory.counts.steps > 0)
        w = *watch_of(it);
    kt_family_radau.start(it);
    w.last_stiff = w.next_stiff;
    *watch_of(it) = w;
    switch_to(it, w.last_stiff > 0.0);
}

static void restore(kt_integrator *it) { switch_to(it, watch_of(it)->last_stiff > 0.0); }

/* ---- one step ---------------------------------------------------------------------------------------------------- */

static kt_try_result switching_prepare(kt_integrator *it, bool rejected, kt_try *result) {
    if (!rejected)
        switch_to(it, watch_of(it)->next_stiff > 0.0);
    if (is_stiff(it))
        return kt_family_radau.prepare(it, rejected, result);
    return result->result = KT_TRY_PASSED;
}

static kt_try_result switching_try(kt_integrator *it, const kt_interval *interval, kt_try *result) {
    return active_family(it)->try_step(it, interval, result);
}

static double switching_error_norm(const kt_integrator *it, double h) { return active_family(it)->error(it, h); }
static double switching_error_at(const kt_integrator *it, double h, size_t i) {
    return active_family(it)->error_at(it, h, i);
}

static double switching_control(const kt_integrator *it, double h, double error) {
    return is_stiff(it) ? kt_newton_control(it, h, error) : kt_control_accepted(it, error);
}

static kt_try_result switching_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result) {
    switch_to(it, watch_of(it)->last_stiff > 0.0);
    return active_family(it)->interpolate(it, t, y_out, result);
}

/* ---- is it stiff? ------------------------------------------------------------------------------------------------ */

/* Component i of (Y_7 - Y_6) / h. */
static double stage_difference(const kt_integrator *it, size_t i) {
    const double *last = it->table->b, *before = it->table->a + 10; /* row 6: 5 * 4 / 2 */
    double apart = last[5] * it->k[5][i];
    for (size_t j = 0; j < 5; j++)
        apart += (last[j] - before[j]) * it->k[j][i];
    return apart;
}

/* The differences of the last two stages of an accepted step. */
typedef struct difference {
    double rate, cosine; /* h rho, and cos(g, d) */
    bool may_ring;       /* |g| > KT_RINGING_RATE |d|, with positions counted 3.3 / h times */
} difference;

/* h rho = |g| / |d| and cos(g, d), with the differences g of slopes and d of states of the last two stages. */
static difference last_difference(const kt_integrator *it) {
    const double limit = KT_REAL_LIMIT / fabs(it->memory.last_step);
    double gg = 0.0, dd = 0.0, gd = 0.0, natural = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double scale = kt_error_scale(it, i, it->y[i], it->y[i]);
        const double g = (it->k[6][i] - it->k[5][i]) / scale, d = stage_difference(it, i) / scale;
        gg += g * g;
        dd += d * d;
        gd += g * d;
        natural +=
            (i < it->options.positions ? limit * limit : 1.0) * (g * g - KT_RINGING_RATE * KT_RINGING_RATE * d * d);
    }
    return (difference){.rate = dd > 0.0 ? sqrt(gg / dd) : 0.0,
                        .cosine = gg > 0.0 && dd > 0.0 ? gd / (sqrt(gg) * sqrt(dd)) : 0.0,
                        .may_ring = natural > 0.0};
}

/* z = h lambda of the pair of modes that prevails in d and d_2; zero if no pair does. */
static kt_complex fast_pair(const kt_integrator *it, double least_rate) {
    const double *a = it->table->a, *e = it->table->e, near = fabs(it->memory.last_step) / KT_REAL_LIMIT;
    double ea[6] = {0.0}, dd[3] = {0.0}, dg[4] = {0.0}, gg = 0.0;
    for (size_t i = 1; i < 7; i++)
        for (size_t j = 0; j < i; j++)
            ea[j] += e[i] * a[i * (i - 1) / 2 + j];
    for (size_t i = 0; i < it->counted; i++) {
        const double weight =
            1.0 / (kt_error_scale(it, i, it->y[i], it->y[i]) * (i < it->options.positions ? near : 1.0));
        double d[2] = {stage_difference(it, i), 0.0}, g[2] = {it->k[6][i] - it->k[5][i], e[6] * it->k[6][i]};
        for (size_t j = 0; j < 6; j++) {
            d[1] += ea[j] * it->k[j][i];
            g[1] += e[j] * it->k[j][i];
        }
        for (size_t j = 0; j < 2; j++) {
            d[j] *= weight;
            g[j] *= weight;
        }
        dd[0] += d[0] * d[0];
        dd[1] += d[0] * d[1];
        dd[2] += d[1] * d[1];
        gg += g[0] * g[0];
        for (size_t j = 0; j < 4; j++)
            dg[j] += d[j / 2] * g[j % 2];
    }
    const double area = dd[0] * dd[2] - dd[1] * dd[1];
    if (!(area > KT_PARALLEL * dd[0] * dd[2]) || !(gg > least_rate * least_rate * dd[0]))
        return (kt_complex){0.0, 0.0};
    const double half = 0.5 * (dd[2] * dg[0] - dd[1] * (dg[1] + dg[2]) + dd[0] * dg[3]) / area; /* of the trace of M */
    const double square = (dg[0] * dg[3] - dg[1] * dg[2]) / area - half * half;
    return (kt_complex){half, square > 0.0 ? sqrt(square) : 0.0};
}

/* |R(z)|^2, by which dopri5 makes a mode's energy grow: R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 + z^5/120 + z^6/600. */
static double growth(kt_complex z) {
    static const double divisors[] = {120.0, 24.0, 6.0, 2.0, 1.0, 1.0};
    kt_complex r = {1.0 / 600.0, 0.0};
    for (size_t k = 0; k < 6; k++)
        r = (kt_complex){r.re * z.re - r.im * z.im + 1.0 / divisors[k], r.re * z.im + r.im * z.re};
    return r.re * r.re + r.im * r.im;
}

/* The contribution of the last step to the sum of a pair that rings at the limit of stability. */
static double ringing_sign(const kt_integrator *it) {
    const kt_complex z = fast_pair(it, KT_RINGING_RATE);
    const double size = sqrt(z.re * z.re + z.im * z.im);
    const bool is_near = KT_RINGING_LEAST < size && size < KT_RINGING_MOST;
    if (!is_near || !(z.im > 0.0) || z.re > -KT_RINGING_DAMPING * size)
        return -1.0;
    const double grows = growth(z);
    return 1.0 + KT_RINGING_GROWTH * (grows - 1.0) / (grows + 1.0);
}

/* The contribution of the last step to the sum of an oscillation without damping; 0 if no pair prevails. */
static double idle_sign(const kt_integrator *it) {
    const kt_complex z = fast_pair(it, KT_IDLE_LEAST);
    const double size = sqrt(z.re * z.re + z.im * z.im);
    const bool is_near = KT_IDLE_LEAST < size && size < KT_IDLE_MOST && fabs(z.re) < 0.1 * size;
    return size == 0.0 ? 0.0 : is_near && z.im > 0.0 ? 1.0 : -1.0;
}

/* The cost of all steps so far, in evaluations. */
static double cost_so_far(const kt_integrator *it) {
    const kt_integrator_counts *counts = &it->memory.counts;
    return KT_IMPLICIT_EVALUATION * (double)counts->evaluations + KT_JACOBIAN_EVALUATIONS * (double)counts->jacobians;
}

/* Continues with the implicit method, which ends when it costs more than the explicit one has cost for each second.
 * rings: for a pair that rings or is idle; is_idle: for an oscillation without damping, and then for KT_IDLE_PHASE
 * steps at least. */
static void to_implicit(kt_integrator *it, bool rings, bool is_idle) {
    const watch before = *watch_of(it);
    kt_family_radau.start(it);
    for (size_t i = 0; i < it->counted; i++)
        switching_vector_of(it)[i] = stage_difference(it, i);
    *watch_of(it) = (watch){.next_stiff = 1.0,
                            .wanted = before.wanted,
                            .patience = before.patience,
                            .ringing = rings,
                            .idle = is_idle ? KT_IDLE_PHASE : 0.0,
                            .price = (double)(kt_method_fresh(it->table)) / fabs(it->memory.last_step),
                            .time = it->memory.t,
                            .spent = cost_so_far(it)};
    it->memory.counts.switches++;
}

/* Counts steps whose length stability limits: h rho is in a range around the limit, and the slopes change against the
 * states (cos(g, d) near -1), as they do for a fast decay. */
static void test_decay(watch *w, const difference *last) {
    if (KT_STIFF_LEAST < last->rate && last->rate < KT_STIFF_MOST) {
        w->signs = fmax(0.0, w->signs + 1.0 - KT_DECAYING * (1.0 + last->cosine));
        w->calm = 0.0;
    } else if (w->signs > 0.0 && (w->calm += 1.0) >= KT_CALM_STEPS) {
        w->signs = 0.0;
    }
}

/* After an explicit step: does stability limit its length, through a decay, a ringing or an idle mode? */
static void watch_explicit(kt_integrator *it) {
    watch *w = watch_of(it);
    bool may_ring = false;
    if (w->signs > 0.0 || (w->unchecked += 1.0) >= KT_WATCH_PERIOD) {
        const difference last = last_difference(it);
        w->unchecked = 0.0;
        test_decay(w, &last);
        may_ring = last.may_ring;
        w->idle = fmax(0.0, w->idle + idle_sign(it));
    }
    if (may_ring || w->ringing > 0.0)
        w->ringing = fmax(0.0, w->ringing + ringing_sign(it));
    const bool rings = w->ringing > KT_RINGING_SIGNS * w->wanted / KT_STIFF_SIGNS;
    const bool is_idle = w->idle >= w->patience;
    if (rings || is_idle || w->signs > w->wanted - 0.5) /* a decay alone counts one a step, up to rounding */
        to_implicit(it, rings || is_idle, is_idle);
}

/* ---- is it no longer? -------------------------------------------------------------------------------------------- */

/* A vector with a component in every mode: fractional parts of multiples of the golden ratio, in the scales of the
 * norm. */
static void begin_vector(const kt_integrator *it, double *x) {
    for (size_t i = 0; i < it->counted; i++) {
        const double part = 0.61803398874989485 * (double)(i + 1);
        x[i] = (part - floor(part) - 0.5) * kt_newton_of(it)->scale[i];
    }
}

/* The norm of corrections, but that positions count sigma times. */
static double scaled_norm_of(const kt_integrator *it, double sigma, const double *x) {
    const double *scale = kt_newton_of(it)->scale;
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double u = (i < it->options.positions ? sigma : 1.0) * x[i] / scale[i];
        sum += u * u;
    }
    return sqrt(sum);
}

/* x becomes B x over its norm, which is returned. */
static double power_step(kt_integrator *it, double sigma, double *x) {
    double *z = it->trial;
    kt_try ignored;
    memcpy(z, x, it->sizes.n * sizeof *x);
    if (kt_newton_solve(it, (kt_complex){sigma, 0.0}, z, NULL, &ignored) != KT_TRY_PASSED)
        return HUGE_VAL;
    for (size_t i = 0; i < it->counted; i++)
        x[i] = sigma * z[i] - x[i];
    const double norm = scaled_norm_of(it, sigma, x);
    for (size_t i = 0; i < it->counted; i++)
        x[i] = norm > 0.0 ? x[i] / norm : 0.0;
    return norm;
}

/* rho of the Jacobian in use. If two modes rotate into each other, norms alternate: the mean of the last two is
 * used. */
static double jacobian_radius(kt_integrator *it) {
    const kt_newton_work *w = kt_newton_of(it);
    const double sigma = gamma_real / fabs(w->factored);
    double *x = switching_vector_of(it), last = 0.0, norm = 0.0;
    if (!(kt_newton_square(it, x) > 0.0))
        begin_vector(it, x);
    for (int i = 0; i < KT_POWER_STEPS; i++) {
        last = norm;
        norm = power_step(it, gamma_real / w->factored, x);
    }
    const double mean = sqrt(last * norm);
    if (!isfinite(mean))
        memset(x, 0, it->sizes.n * sizeof *x);
    return mean < 1.0 ? sigma * mean / (1.0 - mean) : DBL_MAX;
}

/* Ends the implicit phase. If it was short, the next one takes twice as many signs; if it began for lack of damping
 * (`idle`), twice as many of these. All counts begin anew. */
static void to_explicit(kt_integrator *it) {
    watch *w = watch_of(it);
    const double wanted = w->age > KT_LONG_PHASE ? KT_STIFF_SIGNS : fmin(2.0 * w->wanted, KT_SIGNS_MOST);
    const double patience = w->idle > 0.0 ? 2.0 * w->patience : w->patience;
    *w = (watch){.last_stiff = 1.0, .wanted = wanted, .patience = patience};
    it->memory.counts.switches++;
}

/* Called at the end of each window except the first, in which steps grow: whether the window cost more than dopri5
 * would have. */
static bool is_dear(const kt_integrator *it, watch *w) {
    if (fmod(w->age, KT_WINDOW) != 0.0)
        return false;
    const bool first = w->age == KT_WINDOW;
    const double price = (cost_so_far(it) - w->spent) / fabs(it->memory.t - w->time);
    w->time = it->memory.t;
    w->spent = cost_so_far(it);
    return !first && price > w->price;
}

/* After an implicit step: h rho was small for a whole window, or steps cost more than explicit ones did? */
static void watch_implicit(kt_integrator *it) {
    const kt_newton_work *newton = kt_newton_of(it);
    watch *w = watch_of(it);
    if (kt_newton_is_zero(newton))
        w->radius = 0.0;
    else if (newton->is_of_now || w->age == 0.0)
        w->radius = jacobian_radius(it);
    const double rate = fabs(it->memory.last_step) * w->radius;
    w->last_stiff = 1.0;
    w->age += 1.0;
    w->signs = rate < KT_CALM_LIMIT ? w->signs + 1.0 : 0.0;
    if (w->idle > w->age)
        return;
    if (w->signs >= KT_WINDOW || (w->age == 1.0 && w->ringing == 0.0 && rate < KT_STIFF_LEAST) || is_dear(it, w))
        to_explicit(it);
}

/* Fixed steps are all dopri5's, and are not watched. */
static void switching_accept(kt_integrator *it) {
    if (is_stiff(it)) {
        kt_family_radau.accept(it);
        watch_implicit(it);
        return;
    }
    watch_of(it)->last_stiff = 0.0;
    if (it->options.step == 0.0)
        watch_explicit(it);
}

/* ---- linear stability: that of dopri5, with which fixed steps are made ------------------------------------------- */

static kt_status make_stability(const kt_method *method, int stages, kt_stability *out, kt_error *error) {
    out->family = &kt_family_explicit;
    return kt_family_explicit.stability(method, stages, out, error);
}

/* ------------------------------------------------------------------------------------------------------------------ */

/* The flags of watch, which is the end of the history. */
static const kt_history_word switching_words[] = {
    KT_NEWTON_WORDS,
    {"first step", KT_HISTORY_METHOD, 0, KT_BLOCK_YES_NO},
    {"last_stiff", KT_HISTORY_END, WATCH_NUMBERS, KT_BLOCK_YES_NO},
    {"next_stiff", KT_HISTORY_END, WATCH_NUMBERS - 1, KT_BLOCK_YES_NO},
    {.name = NULL},
};

const kt_method_family kt_family_switching = {
    .name = "switching",
    .switches = true,
    .check_sizes = kt_table_check_sizes,
    .measure = measure_switching,
    .init = switching_init,
    .words = switching_words,
    .start = switching_start,
    .restore = restore,
    .prepare = switching_prepare,
    .try_step = switching_try,
    .error = switching_error_norm,
    .error_at = switching_error_at,
    .accept = switching_accept,
    .control = switching_control,
    .report = kt_newton_report,
    .interpolate = switching_interpolate,
    .stability = make_stability,
};
