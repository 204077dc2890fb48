/* Differential-algebraic baselines: an implicit method on F(y', y, t) = 0 (dae_equations.c).
 *
 * In a step the solved stages i = 1 .. s are at t + c_i h. A Runge-Kutta method, or one of two steps, relates their
 * differential unknowns x = (xi, v) and slopes by
 *
 *     x_i = base_i + h sum_j a_ij x'_j          x'_i = sum_j d_ij (x_j - base_j) / h,   d = a^-1
 *     base_i = x_0 + h a_i0 x'_0                a first stage that is the start itself (Crank-Nicolson)
 *     base = alpha_1 x_0 + alpha_2 x_-1 + h (beta_1 x'_0 + beta_2 x'_-1)    of two steps, where s = 1
 *
 * Positions are relative to the start of the step: xi_0 = 0. Multipliers have no slopes: their values solve
 * the equations at each stage. Newton's matrix has the blocks
 *
 *     delta_ij (dF/dy)_i + d_ij / h (dF/dy')_i
 *
 * and is that whose condition grows with the index. Only stiffly accurate methods are supported, because their last
 * stage is the new state, which therefore satisfies the equations.
 *
 * Source: [MSD 8.3, 8.4]; E. Hairer, C. Lubich, M. Roche, The Numerical Solution of Differential-Algebraic Systems by
 * Runge-Kutta Methods, Springer 1989; K. E. Brenan, S. L. Campbell, L. R. Petzold, Numerical Solution of Initial-Value
 * Problems in Differential-Algebraic Equations, SIAM 1996.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/dae.h"
#include "algebra/lu.h"
#include "base/copy.h"
#include "base/options.h"
#include "integrator/multistep.h"
#include "kinetree/loop.h"
#include "linear/lapack.h"
#include "model/describe.h"
#include "model/model.h"

#include <math.h>
#include <string.h>

const char *kt_dae_name(kt_dae_type type) {
    static const char *const names[] = {KT_DAE_LIST(KT_LISTED_NAME)};
    return (unsigned)type < KT_DAE_COUNT ? names[type] : NULL;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_dae, KT_DAE_FIELDS, size_t n, size_t nq, size_t k, size_t most, size_t all)

static size_t place_dae(void *memory, const kt_model *model, kt_dae_type type, int stages) {
    const kt_mobility mobility = kt_model_mobility(model);
    const size_t n = (size_t)kt_model_nv(model), m = (size_t)mobility.rank;
    const size_t most = 2 * n + (type == KT_DAE_GGL ? 2 : 1) * m;
    return lay_out(memory, n, (size_t)kt_model_nq(model), (size_t)mobility.equations, most, most * (size_t)stages);
}

static kt_status check_dae_options(const kt_dae_options *o, kt_error *error) {
    const char *family = kt_method_family_name(o->method);
    if (kt_dae_name(o->type) == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "type", "%d is no differential-algebraic baseline", (int)o->type);
    if (!(isfinite(o->alpha) && o->alpha >= 0.0 && isfinite(o->beta) && o->beta >= 0.0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "alpha, beta", "%g, %g: must be zero or more", o->alpha, o->beta);
    if (strcmp(family, "dirk") != 0 && strcmp(family, "radau") != 0 && strcmp(family, "two-step") != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "method",
                            "%s does not solve its stages for slopes: take implicit-euler, crank-nicolson, bdf2, "
                            "two-step or radau5",
                            o->method->name);
    return KT_OK;
}

/* Hard contacts and friction that sticks have events, which the baselines do not follow. */
static kt_status reject_dae_contacts(const kt_model *model, kt_error *error) {
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE || kt_loop_is_stick(model, i))
            return kt_error_set(error, KT_ERROR_UNSUPPORTED, kt_loop_name(model, i),
                                "it is hard or sticks, and a differential-algebraic baseline does not follow where it "
                                "closes, opens or slips; take a simulation");
    return KT_OK;
}

/* The number of solved stages: all stages, except a first stage that equals the start. */
static int solved_stages(const kt_method *method) { return method->stages - 1; }

/* An equation without a measure of closure constrains velocities alone, as rolling does. */
static void note_holonomic(kt_dae *dae) {
    for (int loop = 0; loop < kt_loop_count(dae->model); loop++) {
        const kt_loop_rows rows = kt_loop_rows_of(dae->model, loop);
        for (int r = 0; r < rows.count; r++)
            dae->holonomic[rows.first + r] = kt_loop_measure_of(dae->model, loop, r) != KT_MEASURE_NONE;
    }
}

static kt_status fill_memory(kt_dae *dae, const kt_model *model, const kt_dae_options *options, kt_error *error) {
    const kt_constraint_formulation_options gauss =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 1.0);
    dae->model = model;
    dae->options = *options;
    dae->n = (size_t)kt_model_nv(model);
    dae->nq = (size_t)kt_model_nq(model);
    dae->k = (size_t)kt_model_mobility(model).equations;
    note_holonomic(dae);
    kt_status status = kt_data_create(model, &dae->data, error);
    if (status == KT_OK)
        status = kt_constraint_formulation_create(model, &gauss, &dae->equations, error);
    return status;
}

kt_status kt_dae_create(const kt_model *model, const kt_dae_options *given, kt_dae **dae, kt_error *error) {
    const kt_dae_options *options = given;
    if (KT_IS_MISSING(error, model, options, options->method, dae))
        return KT_ERROR_ARGUMENT;
    kt_dae_options own = kt_dae_options_default(given->type);
    options = KT_OPTIONS(kt_dae_options, beta, &own, given, error);
    kt_status status = options ? check_dae_options(options, error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status = reject_dae_contacts(model, error);
    if (status != KT_OK)
        return status;
    const size_t size = place_dae(NULL, model, options->type, solved_stages(options->method));
    kt_dae *made = kt_arena_allocate(size, "a differential-algebraic baseline", error);
    if (made == NULL)
        return KT_ERROR_MEMORY;
    memset(made, 0, size);
    (void)place_dae(made, model, options->type, solved_stages(options->method));
    made->owned = made;
    status = fill_memory(made, model, options, error);
    if (status == KT_OK)
        *dae = made;
    else
        kt_dae_free(made);
    return status;
}

void kt_dae_free(kt_dae *dae) {
    if (dae == NULL)
        return;
    kt_constraint_formulation_free(dae->equations);
    kt_data_free(dae->data);
    kt_arena_free(dae);
}

/* ---- start ------------------------------------------------------------------------------------------------------- */

/* The baseline uses the equations that Gauss' principle chooses first. */
static kt_status choose_rows(kt_dae *dae, double t, const double *q, const double *v, kt_error *error) {
    const size_t rank = (size_t)kt_model_mobility(dae->model).rank;
    kt_constraint_formulation_reset(dae->equations);
    const kt_status status = kt_constraint_formulation_evaluate(dae->equations, dae->data, t, q, v, NULL, NULL, NULL,
                                                                dae->slope + dae->n, error);
    if (status != KT_OK)
        return status;
    if (kt_constraint_formulation_statistics_of(dae->equations).dropped)
        return kt_formulation_reject(t, KT_ERROR_SINGULAR,
                                     "the loops are at a singular position, where their equations determine no "
                                     "multipliers: start at another one",
                                     error);
    dae->m = rank;
    dae->size = 2 * dae->n + (dae->options.type == KT_DAE_GGL ? 2 : 1) * rank;
    for (size_t r = 0; r < rank; r++)
        dae->row[r] = dae->equations->pivot[r] - 1;
    return KT_OK;
}

/* M a - A' lambda = f, A a = b'' [MSD 8.47a, 8.52]: a matrix of n + m rows. */
static kt_status find_dae_multipliers(kt_dae *dae, double t, const double *q, const double *v, double *a,
                                      double *multipliers, kt_error *error) {
    const size_t n = dae->n, m = dae->m, size = n + m;
    const kt_constraint_formulation *e = dae->equations;
    const kt_status status = kt_formulation_fill(dae->equations, dae->data, t, q, v, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    memset(dae->factor, 0, size * size * sizeof(double));
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++)
            dae->factor[j * size + i] = e->mass[j * n + i];
        for (size_t r = 0; r < m; r++) {
            const double entry = e->jacobian[j * dae->k + (size_t)dae->row[r]];
            dae->factor[j * size + n + r] = entry;
            dae->factor[(n + r) * size + j] = -entry;
        }
        dae->residual[j] = e->force[j];
    }
    for (size_t r = 0; r < m; r++)
        dae->residual[n + r] = e->drift[dae->row[r]];
    if (!kt_lu_factor(dae->factor, size, dae->pivot))
        return kt_formulation_reject(t, KT_ERROR_SINGULAR, "the chosen equations of the loops are not independent",
                                     error);
    kt_lu_solve(dae->factor, size, dae->pivot, dae->residual);
    memcpy(a, dae->residual, n * sizeof(double));
    memset(multipliers, 0, dae->k * sizeof(double));
    for (size_t r = 0; r < m; r++)
        multipliers[dae->row[r]] = dae->residual[n + r];
    return KT_OK;
}

kt_status kt_dae_start(kt_dae *dae, double t, const double *q, const double *v, kt_error *error) {
    if (KT_IS_MISSING(error, dae, q || dae->nq == 0, v || dae->n == 0, isfinite(t)))
        return KT_ERROR_ARGUMENT;
    dae->started = false; /* a failure leaves no valid state */
    kt_status status = choose_rows(dae, t, q, v, error);
    if (status == KT_OK)
        status = find_dae_multipliers(dae, t, q, v, dae->slope + dae->n, dae->multiplier, error);
    if (status != KT_OK)
        return status;
    kt_copy(dae->q, q, dae->nq * sizeof *q);
    kt_copy(dae->v, v, dae->n * sizeof *v);
    kt_copy(dae->slope, v, dae->n * sizeof *v);
    memset(dae->mu, 0, dae->k * sizeof(double));
    dae->t = t;
    dae->past_h = 0.0;
    dae->started = true;
    dae->solved = false;
    dae->counts = (kt_dae_counts){0};
    return KT_OK;
}

kt_status kt_dae_consistent(kt_dae *dae, double t, const double *q, const double *v, double *multipliers,
                            kt_error *error) {
    if (KT_IS_MISSING(error, dae, dae->started, q || dae->nq == 0, v || dae->n == 0, multipliers, isfinite(t)))
        return KT_ERROR_ARGUMENT;
    dae->solved = false; /* Newton's factors are overwritten; the next step makes its own */
    return find_dae_multipliers(dae, t, q, v, dae->rate, multipliers, error);
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* The stages of a step: c, and d = a^-1. */
typedef struct kt_dae_stages {
    int count;
    double c[KT_DAE_STAGES], d[KT_DAE_STAGES][KT_DAE_STAGES];
} kt_dae_stages;

/* d = a^-1, column by column. */
static void invert_stage_matrix(const double *a, int stages, int stride, kt_dae_stages *s) {
    double factor[KT_DAE_STAGES * KT_DAE_STAGES], column[KT_DAE_STAGES];
    int pivot[KT_DAE_STAGES];
    for (int j = 0; j < stages; j++)
        for (int i = 0; i < stages; i++)
            factor[j * stages + i] = a[i * stride + j];
    (void)kt_lu_factor(factor, (size_t)stages, pivot); /* regular in every implicit method */
    for (int j = 0; j < stages; j++) {
        memset(column, 0, sizeof column);
        column[j] = 1.0;
        kt_lu_solve(factor, (size_t)stages, pivot, column);
        for (int i = 0; i < stages; i++)
            s->d[i][j] = column[i];
    }
}

/* x = (xi, v) at the start is (0, v). */
static kt_dae_stages runge_kutta(kt_dae *dae, double h) {
    const kt_method *m = dae->options.method;
    kt_dae_stages s = {.count = solved_stages(m)};
    invert_stage_matrix(m->a + m->stages + 1, s.count, m->stages, &s);
    for (int i = 0; i < s.count; i++) {
        const double known = h * m->a[(i + 1) * m->stages];
        double *base = dae->base + (size_t)i * 2 * dae->n;
        s.c[i] = m->c[i + 1];
        for (size_t j = 0; j < dae->n; j++) {
            base[j] = known * dae->slope[j];
            base[dae->n + j] = dae->v[j] + known * dae->slope[dae->n + j];
        }
    }
    return s;
}

/* The stage of a two-step method in tangent coordinates about the present position: the unknown is the change of
 * (position, velocity) over the step. `base` has the terms of the past, with the previous state and slope moved to
 * these coordinates. */
static kt_dae_stages two_step(kt_dae *dae, double h) {
    const kt_multistep w = kt_multistep_of(dae->options.method);
    const size_t n = dae->n;
    kt_dae_stages s = {.count = 1, .c = {1.0}};
    double *xi = dae->u, *rate = dae->u + n;
    s.d[0][0] = 1.0 / w.slopes[0];
    kt_position_subtract(dae->model, dae->past_q, dae->q, xi);
    kt_dae_tangent_rate(dae->model, xi, dae->past_slope, rate);
    for (size_t j = 0; j < n; j++) {
        dae->base[j] = w.past[2] * xi[j] + h * (w.slopes[1] * dae->slope[j] + w.slopes[2] * rate[j]);
        dae->base[n + j] = w.past[1] * dae->v[j] + w.past[2] * dae->past_v[j] +
                           h * (w.slopes[1] * dae->slope[n + j] + w.slopes[2] * dae->past_slope[n + j]);
    }
    return s;
}

/* The rate x'_i of stage i, from the states of all stages. */
static void find_stage_rate(kt_dae *dae, const kt_dae_stages *s, double h, int i) {
    const size_t n = 2 * dae->n;
    for (size_t l = 0; l < n; l++) {
        double sum = 0.0;
        for (int j = 0; j < s->count; j++)
            sum += s->d[i][j] * (dae->y[(size_t)j * dae->size + l] - dae->base[(size_t)j * n + l]);
        dae->rate[l] = sum / h;
    }
}

/* Forms and factors Newton's matrix of all stages: a block for each pair of stages, and the derivatives of the
 * equations on the diagonal. */
static kt_status make_matrix(kt_dae *dae, const kt_dae_stages *s, double h, kt_error *error) {
    const size_t size = dae->size, n = 2 * dae->n, all = size * (size_t)s->count;
    memset(dae->matrix, 0, all * all * sizeof(double));
    for (int i = 0; i < s->count; i++) {
        find_stage_rate(dae, s, h, i);
        const kt_status status =
            kt_dae_differentiate(dae, dae->t + s->c[i] * h, dae->y + (size_t)i * size, dae->rate, error);
        if (status != KT_OK)
            return status;
        for (int j = 0; j < s->count; j++)
            for (size_t l = 0; l < size; l++)
                for (size_t r = 0; r < size; r++) {
                    const double rest = dae->by_rest[l * size + r];
                    double entry = l < n ? s->d[i][j] / h * rest : 0.0;
                    if (i == j)
                        entry += l < n ? dae->by_state[l * size + r] : rest;
                    dae->matrix[((size_t)j * size + l) * all + (size_t)i * size + r] = entry;
                }
    }
    dae->stages = s->count;
    dae->solved = true;
    memcpy(dae->factor, dae->matrix, all * all * sizeof(double));
    if (kt_lu_factor(dae->factor, all, dae->pivot))
        return KT_OK;
    return kt_formulation_reject(dae->t, KT_ERROR_SINGULAR,
                                 "Newton's matrix is singular: the equations of the loops that were chosen at the "
                                 "start are not independent here; the reduction chooses them anew at every evaluation",
                                 error);
}

/* The size of the last correction of positions and of h times velocities. Multipliers do not count: their rounding
 * error is larger by 1 / h^2 and follows from these. */
static double newton_correction(const kt_dae *dae, int stages, double h) {
    double most = 0.0;
    for (int i = 0; i < stages; i++)
        for (size_t l = 0; l < 2 * dae->n; l++) {
            const double x = fabs(dae->residual[(size_t)i * dae->size + l]) * (l < dae->n ? 1.0 : h);
            most = x > most || isnan(x) ? x : most;
        }
    return most;
}

/* Newton's method for all stages at once. The matrix is formed again while the iteration converges slowly. */
static kt_status iterate_dae_stages(kt_dae *dae, const kt_dae_stages *s, double h, kt_error *error) {
    enum { ITERATIONS = 40 };
    const size_t size = dae->size, all = size * (size_t)s->count;
    double last = HUGE_VAL;
    kt_status status = make_matrix(dae, s, h, error);
    for (int iteration = 0; iteration < ITERATIONS && status == KT_OK; iteration++) {
        for (int i = 0; i < s->count && status == KT_OK; i++) {
            find_stage_rate(dae, s, h, i);
            status = kt_dae_evaluate(dae, dae->t + s->c[i] * h, dae->y + (size_t)i * size, dae->rate,
                                     dae->residual + (size_t)i * size, error);
        }
        if (status != KT_OK)
            break;
        dae->counts.iterations++;
        kt_lu_solve(dae->factor, all, dae->pivot, dae->residual);
        for (size_t l = 0; l < all; l++)
            dae->y[l] -= dae->residual[l];
        const double now = newton_correction(dae, s->count, h);
        if (now < 1e-15 || (now < 1e-11 && now > 0.5 * last)) /* the rest is rounding */
            return KT_OK;
        if (!isfinite(now))
            break;
        if (now > 0.1 * last)
            status = make_matrix(dae, s, h, error);
        last = now;
    }
    return status != KT_OK ? status
                           : kt_formulation_reject(dae->t, KT_ERROR_STEP,
                                                   "Newton's iteration of the multipliers does not converge: take "
                                                   "shorter steps",
                                                   error);
}

/* The last stage becomes the state. */
static void accept_dae_step(kt_dae *dae, const kt_dae_stages *s, double h) {
    const size_t n = dae->n, m = dae->m;
    const double *y = dae->y + (size_t)(s->count - 1) * dae->size;
    memcpy(dae->past_q, dae->q, dae->nq * sizeof(double));
    memcpy(dae->past_v, dae->v, n * sizeof(double));
    memcpy(dae->past_slope, dae->slope, 2 * n * sizeof(double));
    find_stage_rate(dae, s, h, s->count - 1);
    memcpy(dae->slope + n, dae->rate + n, n * sizeof(double));
    kt_position_add(dae->model, dae->q, y, dae->q);
    memcpy(dae->v, y + n, n * sizeof(double));
    memcpy(dae->slope, y + n, n * sizeof(double));
    for (size_t r = 0; r < m; r++) {
        dae->multiplier[dae->row[r]] = y[2 * n + r];
        if (dae->options.type != KT_DAE_GGL)
            continue;
        dae->mu[r] = y[2 * n + m + r];
        for (size_t j = 0; j < n; j++) /* of the last evaluation: the converged state but for rounding */
            dae->slope[j] += dae->equations->jacobian[j * dae->k + (size_t)dae->row[r]] * dae->mu[r];
    }
    dae->t += h;
    dae->past_h = h;
    dae->counts.steps++;
}

kt_status kt_dae_step(kt_dae *dae, double h, kt_error *error) {
    if (KT_IS_MISSING(error, dae, dae->started, isfinite(h) && h > 0.0))
        return KT_ERROR_ARGUMENT;
    const size_t n = dae->n;
    const bool two = dae->options.method->steps == 2 && fabs(h - dae->past_h) <= 1e-9 * h;
    const kt_dae_stages s = two ? two_step(dae, h) : runge_kutta(dae, h);
    memset(dae->y, 0, dae->size * (size_t)s.count * sizeof(double));
    for (int i = 0; i < s.count; i++) {
        double *y = dae->y + (size_t)i * dae->size;
        for (size_t j = 0; j < n; j++) {
            y[j] = s.c[i] * h * dae->slope[j];
            y[n + j] = dae->v[j] + s.c[i] * h * dae->slope[n + j];
        }
        for (size_t r = 0; r < dae->m; r++)
            y[2 * n + r] = dae->multiplier[dae->row[r]];
    }
    const kt_status status = iterate_dae_stages(dae, &s, h, error);
    if (status == KT_OK)
        accept_dae_step(dae, &s, h);
    return status;
}

/* ---- state and counts -------------------------------------------------------------------------------------------- */

double kt_dae_time(const kt_dae *dae) { return dae ? dae->t : (double)NAN; }
const double *kt_dae_positions(const kt_dae *dae) { return dae ? dae->q : NULL; }
const double *kt_dae_velocities(const kt_dae *dae) { return dae ? dae->v : NULL; }
const double *kt_dae_multipliers(const kt_dae *dae) { return dae ? dae->multiplier : NULL; }
kt_dae_counts kt_dae_counts_of(const kt_dae *dae) { return dae ? dae->counts : (kt_dae_counts){0}; }

kt_status kt_dae_residual(kt_dae *dae, kt_residual *residual, kt_error *error) {
    if (KT_IS_MISSING(error, dae, dae->started, residual))
        return KT_ERROR_ARGUMENT;
    return kt_loop_residual(dae->model, dae->data, dae->t, dae->q, dae->v, residual, error);
}

double kt_dae_condition(kt_dae *dae) {
    if (dae == NULL || !dae->solved)
        return (double)NAN;
    const size_t all = dae->size * (size_t)dae->stages;
    double *singular = dae->svd + all * all, *work = singular + all;
    memcpy(dae->factor, dae->matrix, all * all * sizeof(double));
    dae->solved = false; /* dgesvd overwrites the factors, and the next step overwrites the matrix */
    if (kt_lapack_gesvd((int)all, (int)all, dae->factor, singular, dae->svd, work, (int)(6 * all)) != 0)
        return (double)NAN;
    dae->solved = true;
    return singular[0] / singular[all - 1];
}
