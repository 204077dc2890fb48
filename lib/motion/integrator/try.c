/* The functions that every family needs for a tried step: they form norms and report errors.
 *
 * Sums over components have the same bits for every n and every width of the machine's vectors.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/finite.h"
#include "base/where.h"
#include "integrator/integrator.h"

#include <assert.h>
#include <math.h>

size_t kt_first_not_finite(const double *values, size_t n) {
    size_t i = kt_all_finite(values, n) ? n : 0;
    while (i < n && isfinite(values[i]))
        i++;
    return i;
}

double kt_error_scale(const kt_integrator *it, size_t i, double y0, double y1) {
    const double *each = it->options.absolute_tolerances;
    return kt_scale_of(each != NULL ? each[i] : it->options.absolute_tolerance, it->options.relative_tolerance, y0, y1);
}

double kt_scaled_norm(const kt_integrator *it, const double *u, const double *v) {
    assert(it->counted > 0);
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double x = (u[i] - (v != NULL ? v[i] : 0.0)) / kt_error_scale(it, i, it->y[i], it->y[i]);
        sum += x * x;
    }
    return sqrt(sum / (double)it->counted);
}

double kt_error_norm(const kt_integrator *it, double h) {
    assert(it->counted > 0 && h != 0.0);
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double u = it->family->error_at(it, h, i) / kt_error_scale(it, i, it->y[i], it->trial[i]);
        sum += u * u;
    }
    return sqrt(sum / (double)it->counted);
}

double kt_no_error(const kt_integrator *it, double h) {
    (void)it;
    (void)h;
    return 0.0;
}

double kt_no_error_at(const kt_integrator *it, double h, size_t i) {
    (void)i;
    return kt_no_error(it, h);
}

kt_status kt_try_report(const kt_integrator *it, const kt_try *r, const char *advice, kt_error *error) {
    const kt_where_text where = kt_where_format("t = %.17g", r->t);
    switch (r->result) {
    case KT_TRY_STOPPED:
        return kt_error_set(error, KT_ERROR_CALLBACK, where.text, "%s stopped (code %d)", r->what, r->code);
    case KT_TRY_RECOVERABLE:
        return kt_error_set(error, KT_ERROR_CALLBACK, where.text, "%s could not be computed (code %d); %s", r->what,
                            r->code, advice);
    case KT_TRY_NOT_FINITE:
        return kt_error_set(error, KT_ERROR_NOT_FINITE, where.text, "component %lu of %s is not finite; %s",
                            (unsigned long)r->component, r->what, advice);
    case KT_TRY_TOO_LONG:
    case KT_TRY_DIVERGED:
        return it->family->report(it, where.text, error);
    default:
        return KT_OK;
    }
}
