/* The accelerations of a whole mechanism: effects are summed, then a tree or a mechanism with loops is computed. */
#include "mechanism/evaluate.h"

#include "dynamics/dynamics.h"

#include <string.h>

kt_status kt_wrenches_check(const kt_model *model, const double *q, const double *v, const kt_wrench *external,
                            kt_error *error) {
    const kt_input input = {.q = q, .v = v, .external = external};
    return kt_input_check(model, &input, error);
}

kt_status kt_acceleration_trusted(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                  const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    const kt_status given = external ? kt_wrenches_check(model, q, v, external, error) : KT_OK;
    if (given != KT_OK)
        return given;
    const kt_status status = model->n.effect ? kt_effects_apply(model, data, t, q, v, &tau, &external, error) : KT_OK;
    if (status != KT_OK)
        return status;
    return model->forward(model, data, t, q, v, tau, external, a, error);
}

kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                   const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, a || !model->n.v))
        return KT_ERROR_ARGUMENT;
    return kt_acceleration_trusted(model, data, t, q, v ? v : model->zero, tau, external, a, error);
}

#ifndef KT_NO_JACOBIAN
/* Points *external at the same wrenches and those of masses that change (dynamics/variable_mass.c). */
static kt_status add_mass_rates(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                const double *a, const kt_wrench **external, kt_error *error) {
    if (*external)
        memcpy(data->mass_wrench, *external, model->n.body * sizeof **external);
    else
        memset(data->mass_wrench, 0, model->n.body * sizeof **external);
    *external = data->mass_wrench;
    return kt_masses_add_rates(model, data, t, q, v, a, data->mass_wrench, error);
}

kt_status kt_acceleration_time_derivative(const kt_model *model, kt_data *data, double t, const double *q,
                                          const double *v, const double *tau, const kt_wrench *external,
                                          const double *a, double *da_dt, kt_error *error) {
    kt_status status = kt_effects_apply_rising(model, data, t, q, v, &tau, &external, error);
    if (status == KT_OK && model->n.varying)
        status = add_mass_rates(model, data, t, q, v, a, &external, error);
    if (status == KT_OK)
        status = model->forward(model, data, t, q, v, tau, external, da_dt, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        da_dt[i] -= a[i];
    return status;
}
#endif
