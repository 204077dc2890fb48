/* Slopes: their evaluation, their sums, and the step of a method with an explicit table,
 *     k_i = f(t + c_i h, y0 + h sum_{j<i} a_ij k_j)
 *     y1  = y0 + h sum_i b_i k_i
 * All sums run over the terms of a row in the order of the table, component by component, and depend on nothing else.
 * Therefore a value has the same bits for every n and for every tile. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/finite.h"
#include "integrator/integrator.h"

#include <assert.h>
#include <math.h>

/* ---- sums of slopes ---------------------------------------------------------------------------------------------- */

/* Components per tile: a loop that compilers unroll into vector instructions. */
enum { TILE = 8 };

/* sum_j weight_j k_j for the components at .. at + TILE - 1. */
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

double kt_slopes_sum(const kt_stage_term *terms, size_t count, double *const *k, size_t at) {
    double sum = 0.0;
    for (size_t j = 0; j < count; j++)
        sum += terms[j].weight * k[terms[j].slot][at];
    return sum;
}

/* The squares are summed in the lanes i mod TILE, for components i. */
double kt_slopes_mean_square(const kt_integrator *it, const kt_stage_term *terms, size_t count) {
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
            const double u = sum[l] / kt_scale_of(atol[l], relative, y0[i + (size_t)l], y1[i + (size_t)l]);
            lanes[l] += u * u;
        }
    }
    for (int l = 0; i < n; i++, l++) {
        const double u = kt_slopes_sum(terms, count, it->k, i) /
                         kt_scale_of(each != NULL ? each[i] : absolute, relative, y0[i], y1[i]);
        lanes[l] += u * u;
    }
    double total = 0.0;
    for (int l = 0; l < TILE; l++)
        total += lanes[l];
    return total / (double)n;
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
        out[i] = y[i] + h * kt_slopes_sum(terms, count, k, i);
}

void kt_combine_rows(double *out, const double *y, double h, const double *weights, size_t count, double *k, size_t n) {
    assert(count <= KT_METHOD_STAGES_MAX);
    kt_stage_term terms[KT_METHOD_STAGES_MAX];
    double *rows[KT_METHOD_STAGES_MAX];
    for (size_t j = 0; j < count; j++)
        rows[j] = k + j * n;
    kt_combine(out, y, h, terms, kt_stage_terms(weights, count, terms), rows, n);
}

/* ---- one slope --------------------------------------------------------------------------------------------------- */

kt_try_result kt_evaluate(kt_integrator *it, double t, const double *y, size_t slot, kt_try *result) {
    assert(slot < it->sizes.slots && y != it->k[slot]);
    assert(isfinite(t));
    if (it->evaluations_end > 0 && it->memory.counts.evaluations >= it->evaluations_end) {
        it->exhausted = true;
        result->code = 0;
        return kt_try_fail(result, KT_TRY_STOPPED, "the last evaluation", t);
    }
    it->memory.counts.evaluations++;
    const int code = it->callbacks.rhs(t, y, it->k[slot], it->callbacks.user);
    if (code == 0 && kt_all_finite(it->k[slot], it->sizes.n))
        return result->result = KT_TRY_PASSED;
    result->code = code;
    result->component = code == 0 ? kt_first_not_finite(it->k[slot], it->sizes.n) : 0;
    return code == 0 ? kt_try_fail(result, KT_TRY_NOT_FINITE, "the right-hand side", t)
                     : kt_try_called(result, code, "the right-hand side", t);
}

/* ---- stages ------------------------------------------------------------------------------------------------------ */

kt_try_result kt_evaluate_stages(kt_integrator *it, const kt_interval *in, size_t first, size_t last, kt_try *result) {
    assert(last <= (size_t)it->table->stages);
    assert(isfinite(in->h) && in->h != 0.0 && in->y != it->trial);
    const kt_method *m = it->table;
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

kt_try_result kt_explicit_step(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const size_t s = (size_t)it->table->stages;
    if (kt_evaluate_stages(it, in, 1, s, result) != KT_TRY_PASSED)
        return result->result;
    if (!it->table->fsal) /* with fsal the last stage was at y1 */
        kt_combine(it->trial, in->y, in->h, it->terms + it->row[s], it->row[s + 1] - it->row[s], it->k, it->sizes.n);
    return KT_TRY_PASSED;
}
