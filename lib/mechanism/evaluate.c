/* The accelerations of a whole mechanism: effects are summed, then a tree or a mechanism with loops is computed. */
#include "mechanism/evaluate.h"

#include "dynamics/dynamics.h"

#include <string.h>

kt_status kt_wrenches_check(const kt_model *model, const double *q, const double *v, const kt_wrench *external,
                            kt_error *error) {
    const kt_input input = {.q = q, .v = v, .external = external};
    return kt_input_check(model, &input, error);
}

KT_INLINE kt_status accelerate_trusted(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                       kt_error *error) {
    const kt_status given = at->external ? kt_wrenches_check(model, at->q, at->v, at->external, error) : KT_OK;
    if (given != KT_OK)
        return given;
    if (!model->n.effect)
        return model->forward(model, data, at, a, error);
    kt_dynamic_state loaded = *at;
    const kt_status status = kt_effects_apply(model, data, &loaded, error);
    return status == KT_OK ? model->forward(model, data, &loaded, a, error) : status;
}

kt_status kt_acceleration_trusted(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                  kt_error *error) {
    return accelerate_trusted(model, data, at, a, error);
}

kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                   const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, a || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {t, q, v ? v : model->zero, tau, external};
    const kt_status status = kt_open_contacts_reject(model, data, &at, error);
    return status == KT_OK ? accelerate_trusted(model, data, &at, a, error) : status;
}

#if KT_HAS_VARIABLE_MASS
/* Points at->external at the sum of its wrenches and those of masses that change (dynamics/variable_mass.c). */
static kt_status add_mass_rates(const kt_model *model, kt_data *data, kt_dynamic_state *at, const double *a,
                                kt_error *error) {
    if (at->external)
        memcpy(data->mass_wrench, at->external, model->n.body * sizeof *data->mass_wrench);
    else
        memset(data->mass_wrench, 0, model->n.body * sizeof *data->mass_wrench);
    at->external = data->mass_wrench;
    return kt_masses_add_rates(model, data, at->t, at->q, at->v, a, data->mass_wrench, error);
}

kt_status kt_acceleration_time_derivative(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                          const double *a, double *da_dt, kt_error *error) {
    kt_dynamic_state loaded = *at;
    kt_status status = kt_effects_apply_rising(model, data, &loaded, error);
    if (status == KT_OK && model->n.varying)
        status = add_mass_rates(model, data, &loaded, a, error);
    if (status == KT_OK)
        status = model->forward(model, data, &loaded, da_dt, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        da_dt[i] -= a[i];
    return status;
}
#endif

#if KT_HAS_SWITCHES
kt_status kt_slip_reject(const kt_model *model, const char *where, kt_error *error) {
    return model->n.slip == 0
               ? KT_OK
               : kt_error_set(
                     error, KT_ERROR_UNSUPPORTED, where,
                     "'%.60s' is a hard contact that slips, and derivatives of its friction are not computed; take "
                     "differences, or an elastic contact (stiffness)",
                     kt_loop_name(model, (int)(kt_slip_loop(model, 0) - model->loop)));
}
#endif
