/* Values within the last accepted step.
 *
 * With theta = (t - t0) / (t1 - t0) and theta' = 1 - theta, the form in the header sums up to
 *
 *     y(theta) = y0 + A (y1 - y0) + h (theta theta'^2 k_1 - theta^2 theta' f1 + theta^2 theta'^2 sum_i D_i k_i)
 *     A = theta^2 (3 - 2 theta)
 *     D_i = d_0i + theta (d_1i + theta' (d_2i + theta (d_3i + ...)))
 *
 * a weighted sum of slopes, as a stage is. y1 and f1 = f(t1, y1) are those after the projection.
 *
 * Slopes that are missing are evaluated here: f1 where the method is not fsal or a projection moved y1 (the next step
 * then has it), the stages of the dense output; and, after a failed step or a restore, the stages of the last step
 * themselves.
 */
#include "integrator/integrator.h"

#include <string.h>

/* All slopes that the dense output needs, in their slots. */
static kt_try_result need_slopes(kt_integrator *it, kt_try *r) {
    const kt_method *m = it->method;
    const kt_integrator_memory *memory = &it->memory;
    const size_t fresh = it->fresh;
    const kt_interval in = {memory->previous_t, memory->last_step, memory->t, it->previous_y};

    if (!it->stages_known) {
        if (it->derivative_slot == 0) { /* a failed step left it there */
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

/* Terms of the slopes at theta, zeros left out. */
static size_t weigh_slopes(const kt_integrator *it, double theta, kt_stage_term *terms) {
    const kt_method *m = it->method;
    const double rest = 1.0 - theta, bubble = theta * theta * rest * rest;
    size_t count = 0;
    for (size_t i = 0; i < it->sizes.slots; i++) {
        double d = 0.0;
        for (int term = m->dense_terms - 1; term >= 0; term--) /* Horner: the factor in front of d_(term + 1) */
            d = m->dense_d[(size_t)term * it->sizes.slots + i] + (term % 2 == 0 ? theta : rest) * d;
        double weight = bubble * d;
        if (i == 0)
            weight += theta * rest * rest;
        if (i == it->fresh)
            weight -= theta * theta * rest;
        if (weight != 0.0)
            terms[count++] = (kt_stage_term){weight, i};
    }
    return count;
}

static kt_status refuse_time(const kt_integrator *it, double t, kt_error *error) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_interpolate",
                        "t = %.17g is outside of the last step, from %.17g to %.17g", t, it->memory.previous_t,
                        it->memory.t);
}

kt_status kt_integrator_interpolate(kt_integrator *it, double t, double *y_out, kt_error *error) {
    if (!it->started)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_interpolate", "call kt_integrator_start first");
    const double t0 = it->memory.previous_t, t1 = it->memory.t;
    const size_t n = it->sizes.n;
    const bool inside = t0 < t1 ? t0 <= t && t <= t1 : t1 <= t && t <= t0;
    if (!inside || (t != t1 && !it->memory.has_previous))
        return refuse_time(it, t, error);
    if (t == t1 || t == t0) {
        memcpy(y_out, t == t1 ? it->y : it->previous_y, n * sizeof *y_out);
        return KT_OK;
    }

    kt_try r;
    if (need_slopes(it, &r) != KT_TRY_PASSED)
        return kt_try_report(&r, "the step itself was accepted; ask at its end only", error);
    const double theta = (t - t0) / (t1 - t0);
    const double part = theta * theta * (3.0 - 2.0 * theta);
    const double *y0 = it->previous_y, *y1 = it->y;
    kt_stage_term terms[KT_METHOD_STAGES_MAX];
    const size_t count = weigh_slopes(it, theta, terms);
    kt_combine(y_out, y0, it->memory.last_step, terms, count, it->k, n);
    for (size_t i = 0; i < n; i++)
        y_out[i] += part * (y1[i] - y0[i]);
    return KT_OK;
}
