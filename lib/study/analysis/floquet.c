/* Floquet multipliers of a periodic motion.
 *
 * Small differences from a motion of period T follow dx(T) = Phi dx(0). Phi, the monodromy matrix, is the product of
 * the exact derivatives of the steps that make up the period (kt_step_derivatives). The product therefore has the error
 * of the method and none of differences. The eigenvalues mu of Phi are the multipliers: a difference grows by |mu|
 * from period to period. The rate of growth is log |mu| / T. The frequency is arg mu / (2 pi T), up to a multiple of
 * 1 / T, which nothing distinguishes.
 *
 * Differences that the loops forbid have the multiplier 0: the projection of the last step removes them. For each
 * independent equation, the smallest multiplier is left out.
 *
 * Source: G. Floquet, Annales scientifiques de l'E.N.S. 12 (1883) 47; C. E. Hammond, An application of Floquet theory
 * to prediction of mechanical instability, J. American Helicopter Society 19 (1974) 14.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"
#include "base/copy.h"
#include "base/options.h"
#include "base/require.h"
#include "evaluate/evaluate.h"
#include "kinetree/algebra.h"
#include "kinetree/analysis.h"
#include "kinetree/descriptor.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/sensitivity.h"
#include "linear/eigen.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define KT_FLOQUET_FIELDS(X)                                                                                           \
    KT_EIGEN_FIELDS(X)                                                                                                 \
    X(double, monodromy, n *n, "Phi")                                                                                  \
    X(double, coarse, n *n, "Phi of half as many steps")                                                               \
    X(double, step, n *n, "derivatives of a step")                                                                     \
    X(double, product, n *n, "scratch")                                                                                \
    X(double, coarse_real, n, "of the multipliers of half as many steps")                                              \
    X(double, coarse_imaginary, n, "of these")                                                                         \
    X(kt_multiplier, multiplier, n, "handed out")                                                                      \
    X(double, q, nq, "the motion")                                                                                     \
    X(double, v, n, "the motion")                                                                                      \
    X(double, x, states, "auxiliary states at the start")                                                              \
    X(double, gap, n, "its difference from the start")                                                                 \
    X(char, data_memory, data_size, "the model's data")                                                                \
    X(char, work, work_size, "of a step")

struct kt_floquet {
    void *owned; /* memory of kt_floquet_create */
    const kt_model *model;
    kt_data *data;
    kt_floquet_options options;
    size_t n, nv, work_size; /* n: 2 nv, and auxiliary states */
    int count, states;
    double gap_size;
    KT_ARENA_DECLARE(KT_FLOQUET_FIELDS)
};

KT_ARENA_LAYOUT(lay_out, kt_floquet, KT_FLOQUET_FIELDS, size_t n, size_t nq, size_t states, size_t data_size,
                size_t work_size)

static const double pi = 3.14159265358979323846;

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static kt_status check_floquet_options(const kt_model *model, const kt_floquet_options *o, kt_error *error) {
    if (!(isfinite(o->period) && o->period > 0.0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "period", "%g s: must be above zero", o->period);
    if (o->steps < 2 || o->steps % 2 != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "steps",
                            "%d: the number of steps must be even and at least 2, because a second run with half as "
                            "many steps shows the error",
                            o->steps);
    if (kt_step_work_size(model, o->method) == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "method",
                            "steps of %s have no derivatives; take an explicit Runge-Kutta method, such as rk4 or "
                            "dop853, or implicit-euler, crank-nicolson, radau5 or rodas5p",
                            o->method->name);
    return KT_OK;
}

static size_t place_floquet(void *memory, const kt_model *model, const kt_floquet_options *o) {
    const size_t states = (size_t)kt_auxiliary_state_count(model);
    return lay_out(memory, 2 * (size_t)kt_model_nv(model) + states, (size_t)kt_model_nq(model), states,
                   kt_data_size(model), kt_step_work_size(model, o->method));
}

kt_status kt_floquet_create(const kt_model *model, const kt_floquet_options *options, kt_floquet **floquet,
                            kt_error *error) {
    if (KT_IS_MISSING(error, model, options, options->method, floquet))
        return KT_ERROR_ARGUMENT;
    kt_floquet_options own = kt_floquet_options_default(options->period);
    const kt_floquet_options *o = KT_OPTIONS(kt_floquet_options, steps, &own, options, error);
    kt_status status = o ? check_floquet_options(model, o, error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status = kt_massless_reject(model, "kt_floquet_create", "its steps have no derivatives", error);
    if (status == KT_OK)
        status = kt_lapack_open(error);
    if (status != KT_OK)
        return status;
    const size_t size = place_floquet(NULL, model, o);
    kt_floquet *made = kt_arena_allocate(size, "Floquet multipliers", error);
    if (made == NULL)
        return KT_ERROR_MEMORY;
    memset(made, 0, size);
    (void)place_floquet(made, model, o);
    made->model = model;
    made->options = *o;
    made->nv = (size_t)kt_model_nv(model);
    made->n = 2 * made->nv + (size_t)kt_auxiliary_state_count(model);
    kt_auxiliary_states_initial(model, made->x);
    made->work_size = kt_step_work_size(model, options->method);
    status = kt_arena_own(made, kt_data_init(model, made->data_memory, kt_data_size(model), &made->data, error));
    if (status == KT_OK)
        *floquet = made;
    return status;
}

void kt_floquet_free(kt_floquet *floquet) { kt_arena_free(floquet); }

/* ---- the monodromy matrix ---------------------------------------------------------------------------------------- */

/* phi = step phi */
static void multiply_monodromy(kt_floquet *f, double *phi) {
    const size_t n = f->n;
    kt_clear(f->product, n * n * sizeof(double));
    for (size_t j = 0; j < n; j++)
        for (size_t k = 0; k < n; k++) {
            const double x = phi[j * n + k];
            for (size_t i = 0; i < n && x != 0.0; i++)
                f->product[j * n + i] += f->step[k * n + i] * x;
        }
    kt_copy(phi, f->product, n * n * sizeof(double));
}

/* phi <- Phi over one period of `steps` steps from (t, q, v) and the auxiliary states f->x. The end of the period is in
 * f->q, f->v and the data. */
static kt_status follow_period(kt_floquet *f, double t, const double *q, const double *v, int steps, double *phi,
                               kt_error *error) {
    const double h = f->options.period / steps;
    kt_step step = {.method = f->options.method, .h = h};
    kt_status status = KT_OK;
    kt_copy(f->q, q, (size_t)kt_model_nq(f->model) * sizeof *q);
    kt_copy(f->v, v, f->nv * sizeof *v);
    kt_copy(kt_auxiliary_states(f->model, f->data), f->x, (f->n - 2 * f->nv) * sizeof *v);
    kt_clear(phi, f->n * f->n * sizeof(double));
    for (size_t i = 0; i < f->n; i++)
        phi[i * f->n + i] = 1.0;
    for (int i = 0; i < steps && status == KT_OK; i++) {
        step.t = t + i * h;
        status = kt_step_derivatives(f->model, f->data, f->work, f->work_size, &step, f->q, f->v, f->q, f->v, f->step,
                                     NULL, error);
        if (status == KT_OK)
            multiply_monodromy(f, phi);
    }
    return status;
}

/* How far the motion is from its start after the period: whole turns of revolute joints do not count. */
static double measure_gap(kt_floquet *f, const double *q, const double *v) {
    double most = 0.0;
    kt_position_subtract(f->model, f->q, q, f->gap);
    for (int body = 1; body < kt_model_body_count(f->model); body++) {
        const kt_coordinates at = kt_body_coordinates(f->model, body);
        for (int k = 0; k < at.nv; k++) {
            const bool turns = kt_joint_coordinate_kind(at.type, k) == KT_COORDINATE_ANGLE;
            const double x = f->gap[at.v + k], rate = f->v[at.v + k] - v[at.v + k];
            most = fmax(most, fabs(turns ? remainder(x, 2.0 * pi) : x));
            most = fmax(most, fabs(rate) * f->options.period);
        }
    }
    const double *x = kt_auxiliary_states(f->model, f->data);
    for (size_t k = 0; k < f->n - 2 * f->nv; k++) /* of whatever unit */
        most = fmax(most, fabs(x[k] - f->x[k]) / fmax(1.0, fabs(f->x[k])));
    return most;
}

/* ---- multipliers ------------------------------------------------------------------------------------------------- */

static bool solve_floquet_multipliers(kt_floquet *f, double *matrix) {
    double norm;
    return KT_EIGEN_SOLVE(f, f->n, matrix, &norm);
}

/* Returns the number of directions of (q, v) that the loops forbid. A non-holonomic equation forbids a velocity, but no
 * position. */
static int forbidden(const kt_model *model) {
    int lost = 2 * kt_model_mobility(model).rank;
    for (int loop = 0; loop < kt_loop_count(model); loop++)
        for (int r = 0; r < kt_loop_rows_of(model, loop).count; r++)
            lost -= kt_loop_measure_of(model, loop, r) == KT_MEASURE_NONE;
    return lost;
}

/* Multipliers by falling modulus, a conjugate pair as the multiplier above the axis. The smallest `lost` eigenvalues
 * belong to directions that the loops forbid. */
static void return_multipliers(kt_floquet *f, int lost) {
    const double period = f->options.period;
    f->count = f->states = 0;
    for (int left = (int)f->n - lost; left > 0;) {
        size_t best = f->n;
        for (size_t i = 0; i < f->n; i++)
            if (!isnan(f->real[i]) && f->imaginary[i] >= 0.0 &&
                (best == f->n || kt_hypot(f->real[i], f->imaginary[i]) > kt_hypot(f->real[best], f->imaginary[best])))
                best = i;
        if (best == f->n)
            break;
        kt_multiplier m = {.real = f->real[best], .imaginary = f->imaginary[best]};
        m.count = m.imaginary > 0.0 ? 2 : 1;
        m.modulus = kt_hypot(m.real, m.imaginary);
        m.growth = log(m.modulus) / period;
        m.frequency = fabs(atan2(m.imaginary, m.real)) / (2.0 * pi * period);
        m.error = f->condition[best]; /* for the moment */
        f->multiplier[f->count++] = m;
        f->states += m.count;
        left -= m.count;
        f->real[best] = (double)NAN;
    }
}

/* Estimates the errors of the multipliers. The nearest multiplier of half as many steps differs by 2^p - 1 times the
 * error, p the method's order. Rounding moves a multiplier by the rounding error of the matrix over the condition of
 * the multiplier. Rounding moves a multiple one by the root of that error; the smaller estimate counts. */
static void estimate_multiplier_errors(kt_floquet *f) {
    double size = 0.0;
    const double power = ldexp(1.0, f->options.method->order) - 1.0;
    for (size_t i = 0; i < f->n * f->n; i++)
        size += f->monodromy[i] * f->monodromy[i];
    const double rounding = 16.0 * DBL_EPSILON * (double)f->n * sqrt(size);
    for (int i = 0; i < f->count; i++) {
        kt_multiplier *m = &f->multiplier[i];
        double nearest = HUGE_VAL;
        for (size_t k = 0; k < f->n; k++)
            nearest = fmin(nearest, kt_hypot(m->real - f->coarse_real[k], m->imaginary - f->coarse_imaginary[k]));
        m->error =
            nearest / power + fmin(rounding / fmax(m->error, DBL_EPSILON), sqrt(rounding * fmax(1.0, m->modulus)));
    }
}

kt_status kt_floquet_evaluate(kt_floquet *f, double t, const double *q, const double *v, kt_error *error) {
    if (KT_IS_MISSING(error, f, q || kt_model_nq(f->model) == 0, v || f->nv == 0, isfinite(t)))
        return KT_ERROR_ARGUMENT;
    f->count = f->states = 0;
    f->gap_size = (double)NAN;
    kt_status status = follow_period(f, t, q, v, f->options.steps / 2, f->coarse, error);
    if (status == KT_OK)
        status = follow_period(f, t, q, v, f->options.steps, f->monodromy, error);
    if (status != KT_OK)
        return status;
    bool solved = f->n == 0 || solve_floquet_multipliers(f, f->coarse);
    kt_copy(f->coarse_real, f->real, f->n * sizeof(double));
    kt_copy(f->coarse_imaginary, f->imaginary, f->n * sizeof(double));
    kt_copy(f->step, f->monodromy, f->n * f->n * sizeof(double));
    solved = solved && (f->n == 0 || solve_floquet_multipliers(f, f->step));
    if (!solved)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "Floquet multipliers",
                            "the multipliers of the period cannot be computed: the motion runs away within it");
    f->gap_size = measure_gap(f, q, v);
    return_multipliers(f, forbidden(f->model));
    estimate_multiplier_errors(f);
    return KT_OK;
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

int kt_floquet_count(const kt_floquet *floquet) { return floquet ? floquet->count : 0; }

kt_multiplier kt_floquet_at(const kt_floquet *floquet, int multiplier) {
    const kt_multiplier none = {.real = (double)NAN, .imaginary = (double)NAN, .modulus = (double)NAN};
    return floquet && multiplier >= 0 && multiplier < floquet->count ? floquet->multiplier[multiplier] : none;
}

const double *kt_floquet_monodromy(const kt_floquet *floquet) { return floquet ? floquet->monodromy : NULL; }

double *kt_floquet_auxiliary_states(kt_floquet *floquet) { return floquet ? floquet->x : NULL; }

double kt_floquet_gap(const kt_floquet *floquet) { return floquet ? floquet->gap_size : (double)NAN; }
