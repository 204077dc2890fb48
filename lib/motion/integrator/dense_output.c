/* The dense output of methods with a table: the state at any time of the last step, from the slopes of its stages.
 *
 * With theta = (t - t0) / (t1 - t0) and theta' = 1 - theta, the form in the public header becomes
 *
 *     y(theta) = y0 + A (y1 - y0) + h (theta theta'^2 k_1 - theta^2 theta' f1 + theta^2 theta'^2 sum_i D_i k_i)
 *     A        = theta^2 (3 - 2 theta)
 *     D_i      = d_0i + theta (d_1i + theta' (d_2i + theta (d_3i + ...)))
 *
 * which is a weighted sum of slopes, like a stage. y1 and f1 = f(t1, y1) are the values after the projection.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "integrator/lane_parts.h"

#include <assert.h>

/* Provides all slopes that the dense output needs, in their slots. Missing slopes are evaluated. f1 is missing if the
 * method is not fsal or a projection changed y1; the next step then uses this f1. The stages of the dense output are
 * missing, too. After a failed step or a restore, the stages of the last step itself are missing. */
static kt_try_result need_slopes(kt_integrator *it, kt_try *r) {
    const kt_method *m = it->table;
    const kt_integrator_memory *memory = &it->memory;
    const size_t fresh = it->fresh;
    const kt_interval in = {memory->previous_t, memory->last_step, memory->t, it->previous_y};

    if (!it->stages_known) {
        if (it->derivative_slot == 0) { /* left there by a failed step */
            double *k = it->k[0];
            it->k[0] = it->k[fresh];
            it->k[fresh] = k;
            it->derivative_slot = (int)fresh;
        }
        if (kt_evaluate_stages(it, &in, 0, m->dense_terms > 0 ? fresh : 1, r) != KT_TRY_PASSED)
            return r->result;
        it->stages_known = true;
    }
    if (it->derivative_slot < 0) {
        if (kt_evaluate(it, memory->t, it->y, fresh, r) != KT_TRY_PASSED)
            return r->result;
        it->derivative_slot = (int)fresh;
    }
    for (size_t i = 0; !it->dense_known && i < (size_t)m->dense_stages; i++) {
        const size_t *row = it->row + m->stages + KT_ROW_DENSE + i;
        kt_combine(it->trial, it->previous_y, in.h, it->terms + row[0], row[1] - row[0], it->k, it->sizes.n);
        if (kt_evaluate(it, in.t + m->dense_c[i] * in.h, it->trial, fresh + 1 + i, r) != KT_TRY_PASSED)
            return r->result;
    }
    it->dense_known = true;
    return KT_TRY_PASSED;
}

void kt_dense_state(const kt_integrator *it, double t, size_t slots, double *const *k, double *y_out) {
    assert(slots <= it->sizes.slots && slots <= KT_METHOD_STAGES_MAX + 1);
    assert(it->memory.t != it->memory.previous_t && y_out != it->y && y_out != it->previous_y);
    const double t0 = it->memory.previous_t, theta = (t - t0) / (it->memory.t - t0);
    const double part = theta * theta * (3.0 - 2.0 * theta); /* A; the weights include all terms but A (y1 - y0) */
    const double *y0 = it->previous_y, *y1 = it->y;
    const size_t n = it->sizes.n;
    kt_stage_term terms[KT_METHOD_STAGES_MAX + 1];
    double weight[KT_METHOD_STAGES_MAX + 1];
    kt_dense_weights(it->table, slots, it->fresh, theta, weight);
    kt_combine(y_out, y0, it->memory.last_step, terms, kt_stage_terms(weight, slots, terms), k, n);
    for (size_t i = 0; i < n; i++)
        y_out[i] += part * (y1[i] - y0[i]);
}

/* y0 + theta h f0 + theta^2 (y1 - y0 - h f0),   theta = (t - t0) / (t1 - t0) */
bool kt_integrator_sketch(const kt_integrator *it, double t, double *y_out) {
    const bool has_all_slopes = it->derivative_slot >= 0 && (it->dense_known || it->table->dense_stages == 0);
    if (it->family->interpolate != kt_table_interpolate || !it->stages_known || has_all_slopes)
        return false;
    const double t0 = it->memory.previous_t, theta = (t - t0) / (it->memory.t - t0), h = it->memory.last_step;
    const double *y0 = it->previous_y, *y1 = it->y, *f0 = it->k[0];
    for (size_t i = 0; i < it->sizes.n; i++)
        y_out[i] = y0[i] + theta * (h * f0[i] + theta * ((y1[i] - y0[i]) - h * f0[i]));
    return true;
}

kt_try_result kt_table_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result) {
    if (need_slopes(it, result) != KT_TRY_PASSED)
        return result->result;
    kt_dense_state(it, t, it->sizes.slots, it->k, y_out);
    return KT_TRY_PASSED;
}
