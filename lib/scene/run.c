/* Whether a run that a caller made can be written: reading it again must not find fault with it. */
#include "scene/part.h"

#include <math.h>

static bool is_positive(double value) { return isfinite(value) && value > 0.0; }
static bool is_not_negative(double value) { return isfinite(value) && value >= 0.0; }

static kt_status refuse(kt_error *error, const char *where, const char *message) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, where, "%s", message);
}

static kt_status check_method(const kt_run *run, kt_error *error) {
    const kt_method *method = run->integrator == NULL ? NULL : kt_method_find(run->integrator);
    if (method == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "simulate.integrator", "there is no method %s",
                            kt_name_quote(run->integrator == NULL ? "" : run->integrator).text);
    if (!is_not_negative(run->step))
        return refuse(error, "simulate.step", "the step must be finite and not negative");
    if (run->step > 0.0)
        return KT_OK;
    if (!kt_method_is_adaptive(method))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "simulate.step", "%s has a fixed step; give it", method->name);
    if (!is_not_negative(run->relative) || !is_not_negative(run->absolute) ||
        !is_positive(run->relative + run->absolute))
        return refuse(error, "simulate.tolerance", "tolerances must be finite, not negative, and one of them above 0");
    return KT_OK;
}

static kt_status check_marker(const kt_names *names, const kt_run *run, int i, kt_error *error) {
    const char *body = run->markers[i].body, *marker = run->markers[i].marker;
    if (body == NULL || marker == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "output.markers", "[%d] has no body or no marker", i);
    const int index = kt_names_find(names, 0, body);
    if (index < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "output.markers", "[%d]: body %s does not exist", i,
                            kt_name_quote(body).text);
    if (kt_names_find(names, index + 1, marker) < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "output.markers", "[%d]: body %s has no marker %s", i,
                            kt_name_quote(body).text, kt_name_quote(marker).text);
    return KT_OK;
}

static kt_status check_markers(const kt_run *run, const kt_description *description, kt_error *error) {
    if (run->marker_count < 0 || (run->marker_count > 0 && run->markers == NULL))
        return refuse(error, "output.markers", "the list is NULL, or its count negative");
    if (run->marker_count == 0)
        return KT_OK;
    kt_pool pool = {NULL, 0};
    kt_names names;
    kt_status status = KT_OK;
    if (!kt_index_bodies(&pool, &names, description->bodies, description->body_count))
        status = kt_error_set(error, KT_ERROR_MEMORY, "output.markers", "there is not enough memory to look them up");
    for (int i = 0; status == KT_OK && i < run->marker_count; i++)
        status = check_marker(&names, run, i, error);
    kt_pool_free(pool.chunks);
    return status;
}

kt_status kt_check_run(const kt_run *run, const kt_description *description, kt_error *error) {
#define RECORD_OR(id, bit, name) | bit
    static const unsigned records = 0U KT_RECORD_LIST(RECORD_OR);
#undef RECORD_OR
    if (!is_not_negative(run->duration))
        return refuse(error, "simulate.duration", "the duration must be finite and not negative");
    if (!is_not_negative(run->interval))
        return refuse(error, "output.interval", "the interval must be finite and not negative");
    if ((run->record & ~records) != 0)
        return refuse(error, "output.record", "a record bit stands for nothing; use those of KT_RECORD_LIST");
    kt_status status = check_method(run, error);
    if (status == KT_OK)
        status = kt_run_check(run, error);
    return status == KT_OK ? check_markers(run, description, error) : status;
}
