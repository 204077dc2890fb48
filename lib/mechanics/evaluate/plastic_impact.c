/* Plastic impacts. When a foot touches the ground, for example, its velocities do not fit the loops. The velocities
 * jump onto the loops, by the impulses of the loops themselves:
 *     M (v+ - v) = A' p,   A v+ = b'
 * so that v+ is nearest to v in the mass metric. Let d = v+ - v. If b' = 0, the kinetic energy falls by d'M d / 2
 * (Carnot). Moving loops supply p . b' in addition. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"

/* v'M v / 2 */
static kt_status find_kinetic(const kt_model *model, kt_data *data, const double *q, const double *v, double *energy,
                              kt_error *error) {
    const kt_status status = kt_kinematics_update(model, data, q, v, NULL, error);
    if (status == KT_OK)
        *energy = kt_kinetic_energy(model, data);
    return status;
}

kt_status kt_velocity_impact(const kt_model *model, kt_data *data, double t, const double *q, double *v,
                             kt_impact *impact, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, v || !model->n.v))
        return KT_ERROR_ARGUMENT;
    double *after = data->assembled_v, *change = data->scratch_v, before = 0.0, behind = 0.0;
    kt_impact found = {0.0, 0.0};
    const kt_input input = {.q = q, .v = v};
    kt_status status = kt_input_check(model, &input, error);
    if (model->n.varying) {
        data->mass_time[0] = t;
        model = kt_model_of_instant(model, data);
    }
    kt_copy(after, v, model->n.v * sizeof *v);
    if (status == KT_OK && model->n.group)
        status = kt_velocities_project(model, data, t, &input, after, error);
    if (status == KT_OK && impact) {
        for (size_t i = 0; i < model->n.v; i++)
            change[i] = after[i] - v[i];
        status = find_kinetic(model, data, q, change, &found.dissipated, error);
        if (status == KT_OK && model->driven)
            status = find_kinetic(model, data, q, v, &before, error);
        if (status == KT_OK && model->driven)
            status = find_kinetic(model, data, q, after, &behind, error);
        found.supplied = model->driven ? behind - before + found.dissipated : 0.0;
    }
    if (status != KT_OK)
        return status;
    kt_copy(v, after, model->n.v * sizeof *v);
    if (impact)
        *impact = found;
    return KT_OK;
}
