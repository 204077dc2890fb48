/* The regressor of inverse dynamics: the list of its columns, the model's own parameters, and the columns of friction.
 * The columns of bodies are written by dynamics/regressor.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/elementary.h"
#include "base/copy.h"
#include "dynamics/regressor.h"
#include "kinetree/identification.h"

#include <string.h>

int kt_regressor_columns(const kt_model *model) {
    return model ? KT_BODY_PARAMETERS * ((int)model->n.body - 1) + 3 * (int)model->n.v : 0;
}

kt_dynamic_parameter kt_regressor_parameter(const kt_model *model, int column) {
    if (!model || !KT_IS_INDEX(column, kt_regressor_columns(model)))
        return (kt_dynamic_parameter){.body = -1, .coordinate = -1};
    const int bodies = KT_BODY_PARAMETERS * ((int)model->n.body - 1), nv = (int)model->n.v;
    if (column < bodies)
        return (kt_dynamic_parameter){.kind = (kt_dynamic_kind)(column % KT_BODY_PARAMETERS),
                                      .body = 1 + column / KT_BODY_PARAMETERS,
                                      .coordinate = -1};
    const int coordinate = (column - bodies) % nv;
    return (kt_dynamic_parameter){.kind = (kt_dynamic_kind)(KT_DYNAMIC_ARMATURE + (column - bodies) / nv),
                                  .body = kt_velocity_body(model, coordinate),
                                  .coordinate = coordinate};
}

void kt_regressor_parameters(const kt_model *model, double *parameters) {
    if (!model || !parameters)
        return;
    memset(parameters, 0, (size_t)kt_regressor_columns(model) * sizeof *parameters);
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        const double m = body->mass;
        const kt_vec3 h = kt_vec3_scale(m, body->com);
        const kt_sym3 i = kt_sym3_shift(body->inertia, m, body->com);
        const double all[KT_BODY_PARAMETERS] = {m, h.x, h.y, h.z, i.xx, i.yy, i.zz, i.xy, i.xz, i.yz};
        memcpy(parameters + KT_BODY_PARAMETERS * (b - 1), all, sizeof all);
    }
    memcpy(parameters + KT_BODY_PARAMETERS * (model->n.body - 1), model->armature, model->n.v * sizeof *parameters);
}

/* Entries are sums of products of three numbers of the motion of links: up to this size none overflows. */
#define KT_MOTION_MOST 1e90

/* The largest number in the motion of links, for the test of overflow. Units do not matter, since KT_MOTION_MOST is
 * far beyond any motion. */
static double largest_motion(const kt_model *model, const kt_data *data) {
    double most = 0.0;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link_motion *m = &data->motion[i];
        const kt_v4 all[] = {m->offset, m->omega, m->alpha, m->linear, data->origin[i].position};
        for (size_t k = 0; k < sizeof all / sizeof *all; k++)
            for (int c = 0; c < 3; c++)
                most = fmax(most, fabs(all[k][c]));
    }
    return most;
}

/* kt_regressor_bodies subtracts gravity from the accelerations, so that Y pi = tau (kt_dynamics_inverse). */
kt_status kt_regressor_evaluate(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                                double *regressor, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, regressor || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const size_t nv = model->n.v;
    const kt_status status = kt_motion_update(model, data, q, v, a, error);
    if (status != KT_OK)
        return status;
    if (!(largest_motion(model, data) <= KT_MOTION_MOST))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "regressor",
                            "it overflows: look for a position, velocity or acceleration that is huge");
    if (nv == 0)
        return KT_OK;
    KT_BY_ISA(model->isa, , kt_regressor_bodies, (model, data, regressor));
    double *const armature = regressor + KT_BODY_PARAMETERS * (model->n.body - 1) * nv,
                  *const viscous = armature + nv * nv, *const coulomb = viscous + nv * nv;
    kt_clear(armature, 3 * nv * nv * sizeof *armature);
    for (size_t i = 0; i < nv; i++) {
        const double rate = v ? v[i] : 0.0;
        armature[i * (nv + 1)] = a ? a[i] : 0.0;
        viscous[i * (nv + 1)] = rate;
        coulomb[i * (nv + 1)] = kt_sign_of(rate);
    }
    return KT_OK;
}
