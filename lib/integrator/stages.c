/* One try of a step: the slopes, the new state, the weighted norm of the error estimate.
 *
 * All sums run over the terms of a row in the order of the table, component by component, and nothing else enters: a
 * value has the same bits whatever n, the tile it falls into, and the width of the machine's vectors.
 */
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

/* Components that are worked on together: a loop that compilers unroll into vectors. */
enum { TILE = 8 };

/* sum_j weight_j k_j for a tile */
static inline void sum_tile(double sum[TILE], const kt_stage_term *terms, size_t count, double *const *k, size_t at) {
    for (int l = 0; l < TILE; l++)
        sum[l] = 0.0;
    for (size_t j = 0; j < count; j++) {
        const double weight = terms[j].weight;
        const double *kj = k[terms[j].slot] + at;
        for (int l = 0; l < TILE; l++)
            sum[l] += weight * kj[l];
    }
}

static inline double sum_one(const kt_stage_term *terms, size_t count, double *const *k, size_t at) {
    double sum = 0.0;
    for (size_t j = 0; j < count; j++)
        sum += terms[j].weight * k[terms[j].slot][at];
    return sum;
}

void kt_combine(double *restrict out, const double *restrict y, double h, const kt_stage_term *terms, size_t count,
                double *const *k, size_t n) {
    size_t i = 0;
    for (; i + TILE <= n; i += TILE) {
        double sum[TILE];
        sum_tile(sum, terms, count, k, i);
        for (int l = 0; l < TILE; l++)
            out[i + (size_t)l] = y[i + (size_t)l] + h * sum[l];
    }
    for (; i < n; i++)
        out[i] = y[i] + h * sum_one(terms, count, k, i);
}

/* 0 x is 0 for a finite x and NaN for others, and NaN stays in a sum. */
size_t kt_first_not_finite(const double *values, size_t n) {
    double sum = 0.0;
    size_t i = 0;
    if (n >= TILE) {
        double lanes[TILE] = {0.0};
        for (; i + TILE <= n; i += TILE)
            for (int l = 0; l < TILE; l++)
                lanes[l] += 0.0 * values[i + (size_t)l];
        for (int l = 0; l < TILE; l++)
            sum += lanes[l];
    }
    for (; i < n; i++)
        sum += 0.0 * values[i];
    if (sum == 0.0)
        return n;
    for (i = 0; i < n && isfinite(values[i]); i++)
        ;
    return i;
}

kt_try_result kt_evaluate(kt_integrator *it, double t, const double *y, size_t slot, kt_try *result) {
    it->memory.counts.evaluations++;
    const int code = it->callbacks.rhs(t, y, it->k[slot], it->callbacks.user);
    result->result = KT_TRY_PASSED;
    if (code != 0)
        result->result = code > 0 ? KT_TRY_RECOVERABLE : KT_TRY_STOPPED;
    else if ((result->component = kt_first_not_finite(it->k[slot], it->sizes.n)) < it->sizes.n)
        result->result = KT_TRY_NOT_FINITE;
    result->what = "the right-hand side";
    result->t = t;
    result->code = code;
    return result->result;
}

kt_try_result kt_evaluate_stages(kt_integrator *it, const kt_interval *in, size_t first, size_t last, kt_try *result) {
    const kt_method *m = it->method;
    for (size_t i = first; i < last; i++) {
        const double t = m->c[i] == 1.0 ? in->end : in->t + m->c[i] * in->h;
        const double *y = in->y;
        if (i > 0) {
            kt_combine(it->trial, in->y, in->h, it->terms + it->row[i], it->row[i + 1] - it->row[i], it->k,
                       it->sizes.n);
            y = it->trial;
        }
        if (kt_evaluate(it, t, y, i, result) != KT_TRY_PASSED)
            return result->result;
    }
    return KT_TRY_PASSED;
}

/* ---- the error --------------------------------------------------------------------------------------------------- */

static inline double scale_of(double absolute, double relative, double y0, double y1) {
    const double a = fabs(y0), b = fabs(y1);
    return absolute + relative * (a > b ? a : b) + DBL_MIN; /* 0 / 0 where both are 0 */
}

/* mean over i of (sum_j weight_j k_ji / scale_i)^2, summed in lanes i mod TILE. */
static double mean_square(const kt_integrator *it, const kt_stage_term *terms, size_t count) {
    const size_t n = it->counted;
    const double *y0 = it->y, *y1 = it->trial, *each = it->options.absolute_tolerances;
    const double relative = it->options.relative_tolerance, absolute = it->options.absolute_tolerance;
    double lanes[TILE] = {0.0};
    size_t i = 0;
    for (; i + TILE <= n; i += TILE) {
        double sum[TILE], atol[TILE];
        sum_tile(sum, terms, count, it->k, i);
        for (int l = 0; l < TILE; l++)
            atol[l] = each != NULL ? each[i + (size_t)l] : absolute;
        for (int l = 0; l < TILE; l++) {
            const double u = sum[l] / scale_of(atol[l], relative, y0[i + (size_t)l], y1[i + (size_t)l]);
            lanes[l] += u * u;
        }
    }
    for (int l = 0; i < n; i++, l++) {
        const double u =
            sum_one(terms, count, it->k, i) / scale_of(each != NULL ? each[i] : absolute, relative, y0[i], y1[i]);
        lanes[l] += u * u;
    }
    double total = 0.0;
    for (int l = 0; l < TILE; l++)
        total += lanes[l];
    return total / (double)n;
}

/* err, or where there are two estimates HNW (II.10.17): h err_5^2 / sqrt(err_5^2 + 0.01 err_3^2). */
static double error_norm(const kt_integrator *it, double h) {
    const size_t *row = it->row + it->method->stages;
    const double high = mean_square(it, it->terms + row[KT_ROW_E], row[KT_ROW_E + 1] - row[KT_ROW_E]);
    if (it->method->e_low == NULL || high == 0.0)
        return fabs(h) * sqrt(high);
    const double low = mean_square(it, it->terms + row[KT_ROW_E_LOW], row[KT_ROW_E_LOW + 1] - row[KT_ROW_E_LOW]);
    return fabs(h) * high / sqrt(high + 0.01 * low);
}

double kt_error_scale(const kt_integrator *it, size_t i, double y0, double y1) {
    const double *each = it->options.absolute_tolerances;
    return scale_of(each != NULL ? each[i] : it->options.absolute_tolerance, it->options.relative_tolerance, y0, y1);
}

double kt_scaled_norm(const kt_integrator *it, const double *u, const double *v) {
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double x = (u[i] - (v != NULL ? v[i] : 0.0)) / kt_error_scale(it, i, it->y[i], it->y[i]);
        sum += x * x;
    }
    return sqrt(sum / (double)it->counted);
}

/* ---- the try ----------------------------------------------------------------------------------------------------- */

/* The slopes of a tableau, and y1 in `trial`. */
static kt_try_result tableau_stages(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t s = (size_t)it->method->stages;
    if (kt_evaluate_stages(it, in, 1, s, result) != KT_TRY_PASSED)
        return result->result;
    if (!it->method->fsal) /* else the last stage was at y1 */
        kt_combine(it->trial, in->y, in->h, it->terms + it->row[s], it->row[s + 1] - it->row[s], it->k, it->sizes.n);
    return KT_TRY_PASSED;
}

kt_try_result kt_try_step(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t n = it->sizes.n;
    const bool stabilised = it->method->stabilised;
    if ((stabilised ? kt_stabilised_stages(it, in, result) : tableau_stages(it, in, result)) != KT_TRY_PASSED)
        return result->result;
    result->result = KT_TRY_PASSED;
    result->what = "the new state";
    result->t = in->end;
    result->component = kt_first_not_finite(it->trial, n);
    if (result->component < n)
        result->result = KT_TRY_NOT_FINITE;
    else if (it->options.step == 0.0) {
        result->what = "the error estimate";
        result->error = stabilised ? kt_stabilised_error(it, in->h) : error_norm(it, in->h);
        if (!(result->error <= 1.0)) /* an estimate that overflowed, too */
            result->result = KT_TRY_INACCURATE;
    }
    return result->result;
}
