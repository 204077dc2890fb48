/* The family of Runge-Kutta-Chebyshev methods: explicit, with as many stages as the fastest decay of f requires.
 *
 * Many polynomials of degree s agree with e^z to order 2. Those built from T_s stay below 1 on nearly the longest
 * interval of the negative real axis, whose length grows as s^2:
 *
 *     R(z) = a_s + b_s T_s(w0 + w1 z)
 *     w0   = 1 + epsilon / s^2,              w1  = T_s'(w0) / T_s''(w0)
 *     b_s  = T_s''(w0) / T_s'(w0)^2,         a_s = 1 - b_s T_s(w0)
 *
 * These constants give
 *
 *     R(0) = R'(0) = R''(0) = 1
 *
 * While w0 + w1 z is in [-1, 1], that is, for z >= -(w0 + 1) / w1, R lies within a_s +- b_s. The damping, epsilon =
 * 2/13, keeps this below 1 - epsilon/3, about 0.95. The length of the interval is close to
 *
 *     2/3 (s^2 - 1) (1 - 2/15 epsilon) = 0.653 (s^2 - 1)
 *
 * Stages. With R_j(z) = a_j + b_j T_j(w0 + w1 z) for stage j, the three-term recurrence of T_j gives a recurrence for
 * the stages. The recurrence is written for d_j = Y_j - y0, in which less cancels than in Y_j:
 *
 *     d_0   = 0,   d_1 = b_1 w1 h f0
 *     d_j   = mu_j d_{j-1} + nu_j d_{j-2} + h (mut_j f(t0 + c_{j-1} h, Y_{j-1}) + gat_j f0),   j = 2 .. s
 *     mu_j  = 2 b_j w0 / b_{j-1},   nu_j  = -b_j / b_{j-2}
 *     mut_j = 2 b_j w1 / b_{j-1},   gat_j = -a_{j-1} mut_j
 *     b_j   = T_j''(w0) / T_j'(w0)^2,   b_0 = b_1 = b_2,   a_j = 1 - b_j T_j(w0)
 *
 * The number c_j is d_j of y' = 1 over h, and follows from the same recurrence. y1 = y0 + d_s. Each stage has order 2.
 *
 * Order 4 by extrapolation. T_1, T_2 and T_3 denote one step over h, two over h/2 and three over h/3. Their local
 * errors of order 2 and 3 cancel in
 *
 *     y1 = T_1 / 12 - 4 T_2 / 3 + 9 T_3 / 4
 *
 * if all steps have the same number of stages, on which these errors depend. The sum stays bounded if each step is
 * damped more. With epsilon = 6/5, the sum stays below 0.74 (computed for all numbers of stages), on a length of 0.58
 * s^2.
 *
 * Dense output. The three steps over h/3 pass states at h/3 and 2h/3. Their increments d_1 and d_2 have the third-order
 * errors of one and of two steps, and D_3 - (y1 - y0) has the error of three steps. Hence
 *
 *     u_j = d_j - j/3 (D_3 - (y1 - y0)) = y(t0 + j h/3) - y0 + O(h^4),   j = 1, 2
 *
 * and the dense output is the cubic P through y0, y0 + u_1, y0 + u_2 and y1. The cubic has no slope at the end of the
 * step. If a step in free flight ends just inside a stop, this slope belongs to the stop, and a Hermite cubic would put
 * the force of the stop into the flight.
 *
 * Error estimate of order 4. The last slope that y1 contains may be at 0.73 h. Forces that begin later, at a stop, do
 * not change the sum. Therefore the slope f1 at y1 is compared with that of the dense output,
 *
 *     delta = h (f1 - P') = h f1 - (9 u_1 - 18 u_2 + 11 (y1 - y0)) / 2 = O(h^4)
 *
 * The error is the larger of the norms of the sums' difference (extrapolate_increments) and of delta / (20 (1 + h
 * radius)). The division by the radius accounts for decay, since f1 has the errors of y1 times the radius. f1 is the
 * first slope of the next step.
 *
 * Sources: J. G. Verwer, W. H. Hundsdorfer, B. P. Sommeijer, Numer. Math. 57 (1990) 157; B. P. Sommeijer, L. F.
 * Shampine, J. G. Verwer, J. Comput. Appl. Math. 88 (1998) 315 (below: RKC), (2.3) to (2.6). Extrapolation: HNW II.9.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/stabilised.h"

#include "integrator/complex.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* ---- the polynomials --------------------------------------------------------------------------------------------- */

double kt_chebyshev_damping(const kt_method *method) { return method->order == 2 ? 2.0 / 13.0 : 6.0 / 5.0; }
int kt_chebyshev_copies(const kt_method *method) { return method->order == 2 ? 1 : 3; }

kt_chebyshev kt_chebyshev_make(int stages, double damping) {
    assert(stages >= 2 && damping > 0.0);
    const double s = (double)stages;
    kt_chebyshev family = {.stages = stages, .w0 = 1.0 + damping / (s * s)};
    kt_chebyshev_values v = kt_chebyshev_first(family.w0);
    for (int j = 1; j < stages; j++)
        kt_chebyshev_next(&v, family.w0);
    family.w1 = v.dt / v.ddt;
    family.b = v.ddt / (v.dt * v.dt);
    family.a = 1.0 - family.b * v.t;
    return family;
}

double kt_chebyshev_reach(const kt_chebyshev *family) { return (family->w0 + 1.0) / family->w1; }

/* The reach of every member is below 0.667 (s^2 - 1). The search therefore begins at or below the answer. */
int kt_chebyshev_stages(double z, double damping) {
    const double most = (double)KT_STABILISED_STAGES_MAX;
    if (!(z < most * most))
        return KT_STABILISED_STAGES_MAX + 1;
    int stages = (int)sqrt(z / 0.667 + 1.0);
    for (stages = stages > 2 ? stages : 2; stages <= KT_STABILISED_STAGES_MAX; stages++) {
        const kt_chebyshev family = kt_chebyshev_make(stages, damping);
        if (kt_chebyshev_reach(&family) >= z)
            break;
    }
    return stages;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* Slots of slopes: f0, the current stage, f1. */
enum { SLOT_STAGE = 1, SLOT_END, SLOTS };

/* The increments u_1 and u_2 of the dense output follow the numbers of the history. */
static bool has_thirds(const kt_method *method) { return kt_chebyshev_copies(method) > 1; }
static double *thirds_of(const kt_integrator *it) { return it->history + KT_STABILISED_HISTORY; }

static void measure_stabilised(const kt_method *method, kt_integrator_sizes *sizes) {
    sizes->slots = SLOTS;
    sizes->history = KT_STABILISED_HISTORY + (has_thirds(method) ? 2 * sizes->n : 0);
    sizes->scratch = kt_stabilised_scratch_size(sizes->n);
}

static void stabilised_init(kt_integrator *it) {
    it->fresh = SLOT_END;
    it->gives_end_derivative = it->options.step == 0.0; /* a fixed step does not need f1 */
}

static void start_stabilised(kt_integrator *it) {
    memset(it->history, 0, it->sizes.history * sizeof(double));
    kt_radius_forget(it);
}

/* ---- the stages -------------------------------------------------------------------------------------------------- */

/* The coefficients of the recurrence at stage j. */
typedef struct recurrence {
    kt_chebyshev_values values; /* at w0, of stage j */
    double b, b1, b2;           /* b_j, b_{j-1}, b_{j-2} */
    double a1;                  /* a_{j-1} */
    double c, c1;               /* c_j, c_{j-1} */
    double mu, nu, mut, gat;
} recurrence;

static recurrence begin_recurrence(const kt_chebyshev *family) {
    recurrence r = {.values = kt_chebyshev_first(family->w0)};
    r.b = r.b1 = r.b2 = 1.0 / (4.0 * family->w0 * family->w0); /* T_2 = 2 x^2 - 1 */
    r.mut = r.b * family->w1;
    r.c = r.mut;
    return r;
}

/* The coefficients of stage j + 1 after those of stage j (formulas at the beginning of the file). */
static void advance_recurrence(recurrence *r, const kt_chebyshev *family) {
    r->a1 = 1.0 - r->b * r->values.t;
    r->b2 = r->b1;
    r->b1 = r->b;
    kt_chebyshev_next(&r->values, family->w0);
    r->b = r->values.ddt / (r->values.dt * r->values.dt);
    r->mu = 2.0 * r->b * family->w0 / r->b1;
    r->nu = -r->b / r->b2;
    r->mut = 2.0 * r->b * family->w1 / r->b1;
    r->gat = -r->a1 * r->mut;
    const double c = r->mu * r->c + r->nu * r->c1 + r->mut + r->gat;
    r->c1 = r->c;
    r->c = c;
}

/* d2 (d_{j-2} on entry) becomes d_j, and trial becomes y0 + d_j. */
static void form_stage(kt_integrator *it, const recurrence *r, double h, const double *y0, const double *f0,
                       const double *d1, double *d2) {
    const double *f = it->k[SLOT_STAGE];
    double *stage = it->trial;
    for (size_t i = 0; i < it->sizes.n; i++) {
        d2[i] = r->mu * d1[i] + r->nu * d2[i] + h * (r->mut * f[i] + r->gat * f0[i]);
        stage[i] = y0[i] + d2[i];
    }
}

/* One step of a member from the state z with its slope f; writes z + d_s to trial. */
static kt_try_result member_step(kt_integrator *it, const kt_chebyshev *family, double t, double h, const double *z,
                                 const double *f, double **d_s, kt_try *result) {
    const size_t n = it->sizes.n;
    const kt_stabilised_scratch *scratch = kt_stabilised_scratch_of(it);
    recurrence r = begin_recurrence(family);
    double *d1 = scratch->moved, *d2 = scratch->moved + n;
    for (size_t i = 0; i < n; i++) {
        d2[i] = 0.0;
        d1[i] = h * r.mut * f[i];
        it->trial[i] = z[i] + d1[i];
    }
    for (int j = 2; j <= family->stages; j++) {
        if (kt_evaluate(it, t + r.c * h, it->trial, SLOT_STAGE, result) != KT_TRY_PASSED)
            return result->result;
        advance_recurrence(&r, family);
        form_stage(it, &r, h, z, f, d1, d2);
        double *d = d1;
        d1 = d2;
        d2 = d;
    }
    *d_s = d1;
    return KT_TRY_PASSED;
}

/* Writes y0 plus the extrapolated sum to trial, where D_m is the increment of m steps over h / m:
 *
 *     sum   = D_1 / 12 - 4 D_2 / 3 + 9 D_3 / 4
 *     error = sum - (9 D_3 / 5 - 4 D_2 / 5)
 *
 * The error estimate is stored in `krylov` until error_at reads it. */
static kt_try_result extrapolate_increments(kt_integrator *it, const kt_chebyshev *family, const kt_interval *in,
                                            kt_try *result) {
    static const double weight[] = {1.0 / 12.0, -4.0 / 3.0, 9.0 / 4.0}, e[] = {1.0 / 12.0, -8.0 / 15.0, 9.0 / 20.0};
    const size_t n = it->sizes.n;
    const kt_stabilised_scratch *scratch = kt_stabilised_scratch_of(it);
    double *error = scratch->krylov, *sum = error + n, *moved = sum + n, *z = moved + n, *slope = z + n, *d = NULL;
    double *third = slope + n; /* d_1 and d_2, then u_1 and u_2 */
    for (size_t i = 0; i < n; i++)
        error[i] = sum[i] = 0.0;
    for (int m = 1; m <= 3; m++) {
        const double h = in->h / (double)m;
        for (size_t i = 0; i < n; i++) {
            moved[i] = 0.0;
            slope[i] = it->k[0][i];
        }
        for (int j = 0; j < m; j++) {
            const double t = in->t + (double)j * h;
            for (size_t i = 0; i < n; i++)
                z[i] = in->y[i] + moved[i];
            if (j > 0) {
                if (kt_evaluate(it, t, z, SLOT_STAGE, result) != KT_TRY_PASSED)
                    return result->result;
                for (size_t i = 0; i < n; i++)
                    slope[i] = it->k[SLOT_STAGE][i];
            }
            if (member_step(it, family, t, h, z, slope, &d, result) != KT_TRY_PASSED)
                return result->result;
            for (size_t i = 0; i < n; i++)
                moved[i] += d[i];
            if (m == 3 && j < 2)
                memcpy(third + (size_t)j * n, moved, n * sizeof *moved);
        }
        for (size_t i = 0; i < n; i++) {
            sum[i] += weight[m - 1] * moved[i];
            error[i] += e[m - 1] * moved[i];
        }
    }
    for (size_t i = 0; i < n; i++) {
        const double excess = moved[i] - sum[i];
        it->trial[i] = in->y[i] + sum[i];
        third[i] -= excess / 3.0;
        third[n + i] -= 2.0 * excess / 3.0;
    }
    return KT_TRY_PASSED;
}

/* Computes the slopes that are kept, and y1 in `trial`. */
static kt_try_result stabilised_try(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const double damping = kt_chebyshev_damping(it->method);
    const int stages = kt_chebyshev_stages(fabs(in->h) * kt_stabilised_radius(it), damping);
    if (stages > KT_STABILISED_STAGES_MAX) {
        result->t = in->t;
        return result->result = KT_TRY_TOO_LONG;
    }
    const kt_chebyshev family = kt_chebyshev_make(stages, damping);
    double *unused;
    const kt_try_result tried = has_thirds(it->method)
                                    ? extrapolate_increments(it, &family, in, result)
                                    : member_step(it, &family, in->t, in->h, in->y, it->k[0], &unused, result);
    if (tried != KT_TRY_PASSED)
        return tried;
    if (it->gives_end_derivative && kt_first_not_finite(it->trial, it->sizes.n) == it->sizes.n)
        return kt_evaluate(it, in->end, it->trial, it->fresh, result);
    return KT_TRY_PASSED;
}

/* The error estimate of rkc2, with y3 the third derivative of y:
 *
 *     4/5 (y0 - y1) + 2/5 h (f0 + f1) = h^3/15 y3 + O(h^4)
 *
 * The error estimate of rkc4 is the difference of its two sums. */
static double stabilised_error_at(const kt_integrator *it, double h, size_t i) {
    const double *y0 = it->y, *y1 = it->trial, *f0 = it->k[0], *f1 = it->k[it->fresh];
    return has_thirds(it->method) ? kt_stabilised_scratch_of(it)->krylov[i]
                                  : 0.8 * (y0[i] - y1[i]) + 0.4 * h * (f0[i] + f1[i]);
}

/* The norm of delta / (20 (1 + h radius)). */
static double end_slope_error(const kt_integrator *it, double h) {
    const double *y0 = it->y, *y1 = it->trial, *f1 = it->k[it->fresh];
    const double *u1 = kt_stabilised_scratch_of(it)->krylov + 5 * it->sizes.n, *u2 = u1 + it->sizes.n;
    const double part = 1.0 / (20.0 * (1.0 + fabs(h) * kt_stabilised_radius(it)));
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double delta = h * f1[i] - 0.5 * (9.0 * u1[i] - 18.0 * u2[i] + 11.0 * (y1[i] - y0[i]));
        const double error = part * delta / kt_error_scale(it, i, y0[i], y1[i]);
        sum += error * error;
    }
    return it->counted > 0 ? sqrt(sum / (double)it->counted) : 0.0;
}

static double stabilised_error(const kt_integrator *it, double h) {
    const double error = kt_error_norm(it, h);
    return has_thirds(it->method) ? fmax(error, end_slope_error(it, h)) : error;
}

/* ---- dense output ------------------------------------------------------------------------------------------------ */

static void accept_stabilised(kt_integrator *it) {
    const size_t n = it->sizes.n;
    if (has_thirds(it->method))
        memcpy(thirds_of(it), kt_stabilised_scratch_of(it)->krylov + 5 * n, 2 * n * sizeof(double));
    kt_radius_accept(it);
}

/* Lagrange's cubic of u_0 = 0, u_1, u_2 and y1 - y0 at theta = 0, 1/3, 2/3, 1. */
static kt_try_result interpolate_thirds(const kt_integrator *it, double t, double *y_out, kt_try *result) {
    const double t0 = it->memory.previous_t, x = 3.0 * (t - t0) / (it->memory.t - t0);
    const double first = 0.5 * x * (x - 2.0) * (x - 3.0), second = -0.5 * x * (x - 1.0) * (x - 3.0);
    const double whole = x * (x - 1.0) * (x - 2.0) / 6.0;
    const double *y0 = it->previous_y, *y1 = it->y, *u1 = thirds_of(it), *u2 = u1 + it->sizes.n;
    for (size_t i = 0; i < it->sizes.n; i++)
        y_out[i] = y0[i] + first * u1[i] + second * u2[i] + whole * (y1[i] - y0[i]);
    return result->result = KT_TRY_PASSED;
}

static kt_try_result interpolate_stabilised(kt_integrator *it, double t, double *y_out, kt_try *result) {
    return has_thirds(it->method) ? interpolate_thirds(it, t, y_out, result)
                                  : kt_table_interpolate(it, t, y_out, result);
}

/* ---- the longest step -------------------------------------------------------------------------------------------- */

/* The largest h radius for which the maximum number of stages is stable. */
static double farthest_reach(const kt_method *method) {
    const kt_chebyshev most = kt_chebyshev_make(KT_STABILISED_STAGES_MAX, kt_chebyshev_damping(method));
    return kt_chebyshev_reach(&most);
}

double kt_stabilised_reach(const kt_integrator *it) {
    const double radius = kt_stabilised_radius(it);
    if (!(radius > 0.0))
        return HUGE_VAL;
    return (1.0 - 1e-12) * farthest_reach(it->method) / radius; /* the factor keeps rounding from leading beyond */
}

static kt_status stabilised_report(const kt_integrator *it, const char *where, kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, where,
                        "the right-hand side decays at %.3g /s, for which this step needs more than the %d stages that "
                        "there are: take steps below %.3g s",
                        kt_stabilised_radius(it), KT_STABILISED_STAGES_MAX, kt_stabilised_reach(it));
}

/* ---- linear stability -------------------------------------------------------------------------------------------- */

static kt_status stabilised_polynomial(const kt_method *method, int stages, kt_stability *out, kt_error *error) {
    if (stages < 2 || stages > KT_STABILISED_STAGES_MAX)
        return kt_error_set(error, KT_ERROR_ARGUMENT, method->name, "it has 2 to %d stages, not %d",
                            KT_STABILISED_STAGES_MAX, stages);
    const kt_chebyshev family = kt_chebyshev_make(stages, kt_chebyshev_damping(method));
    out->degree = stages;
    out->w0 = family.w0;
    out->w1 = family.w1;
    out->a = family.a;
    out->b = family.b;
    out->copies = kt_chebyshev_copies(method);
    return KT_OK;
}

/* R(z) = a + b T_s(w0 + w1 z), by the recursion of Chebyshev polynomials. */
static kt_complex chebyshev_value(const kt_stability *s, kt_complex z) {
    const kt_complex x = {s->w0 + s->w1 * z.re, s->w1 * z.im};
    kt_complex t1 = {1.0, 0.0}, t = x;
    for (int j = 1; j < s->degree; j++) {
        const kt_complex xt = kt_complex_multiply(x, t), next = {2.0 * xt.re - t1.re, 2.0 * xt.im - t1.im};
        t1 = t;
        t = next;
    }
    const kt_complex value = {s->a + s->b * t.re, s->b * t.im};
    return value;
}

/* P(z) / 12 - 4 P(z/2)^2 / 3 + 9 P(z/3)^3 / 4 */
static kt_complex extrapolated_value(const kt_stability *s, kt_complex z) {
    const kt_complex half = {z.re / 2.0, z.im / 2.0}, third = {z.re / 3.0, z.im / 3.0};
    const kt_complex p1 = chebyshev_value(s, z), p2 = chebyshev_value(s, half), p3 = chebyshev_value(s, third);
    const kt_complex two = kt_complex_multiply(p2, p2), three = kt_complex_multiply(p3, kt_complex_multiply(p3, p3));
    const kt_complex value = {p1.re / 12.0 - 4.0 / 3.0 * two.re + 2.25 * three.re,
                              p1.im / 12.0 - 4.0 / 3.0 * two.im + 2.25 * three.im};
    return value;
}

static kt_complex stabilised_value(const kt_stability *s, kt_complex z) {
    return s->copies > 1 ? extrapolated_value(s, z) : chebyshev_value(s, z);
}

static double stabilised_real_limit(const kt_stability *s) { return kt_axis_limit(s, -1.0, 0.0, 0.0, 0.0); }

/* |R(iy)|^2 and 1 differ from the term in y^4 on. Growth becomes visible above rounding from y of about 1e-3 on. */
static double stabilised_imaginary_limit(const kt_stability *s) {
    const double y = kt_axis_limit(s, 0.0, 1.0, 0.0, 64.0 * DBL_EPSILON);
    return y > 2e-3 ? y : 0.0;
}

/* Inputs hardly change the decay of the right-hand side, so that the radius is estimated again only at the usual
 * time. */
static void stabilised_change(kt_integrator *it, bool smooth) { (void)it, (void)smooth; }

static int stages_of_step(const kt_method *method, double z) {
    return kt_chebyshev_stages(KT_RADIUS_MARGIN * z, kt_chebyshev_damping(method));
}

/* The largest h radius of a step, with the margin for errors of the radius. */
static double reach(const kt_method *method) { return farthest_reach(method) / KT_RADIUS_MARGIN; }

/* ------------------------------------------------------------------------------------------------------------------ */

const kt_method_family kt_family_stabilised = {
    .name = "stabilised",
    .stages_max = KT_STABILISED_STAGES_MAX,
    .check_sizes = kt_table_check_sizes,
    .measure = measure_stabilised,
    .init = stabilised_init,
    .start = start_stabilised,
    .change = stabilised_change,
    .prepare = kt_need_radius,
    .try_step = stabilised_try,
    .error = stabilised_error,
    .error_at = stabilised_error_at,
    .accept = accept_stabilised,
    .longest_step = kt_stabilised_reach,
    .report = stabilised_report,
    .interpolate = interpolate_stabilised,
    .stability = stabilised_polynomial,
    .value = stabilised_value,
    .real_limit = stabilised_real_limit,
    .imaginary_limit = stabilised_imaginary_limit,
    .stages = stages_of_step,
    .reach = reach,
};
