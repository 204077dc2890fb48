/* Gravity in joints by inverse dynamics at rest. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/gravity.h"

#include "kinetree/dynamics.h"

#include <math.h>
#include <stdlib.h>

struct kt_gravity {
    kt_data *data;
    double *forces;
};

kt_gravity *kt_gravity_create(const kt_model *model) {
    kt_gravity *made = calloc(1, sizeof *made);
    if (made == NULL)
        return NULL;
    made->forces = calloc((size_t)kt_model_nv(model) + 1, sizeof *made->forces);
    if (made->forces != NULL && kt_data_create(model, &made->data, NULL) == KT_OK)
        return made;
    kt_gravity_free(made);
    return NULL;
}

void kt_gravity_free(kt_gravity *gravity) {
    if (gravity == NULL)
        return;
    kt_data_free(gravity->data);
    free(gravity->forces);
    free(gravity);
}

const double *kt_gravity_evaluate(kt_gravity *gravity, const kt_model *model, double t, const double *q) {
    if (kt_masses_update(model, gravity->data, t, NULL) == KT_OK &&
        kt_dynamics_inverse(model, gravity->data, q, NULL, NULL, NULL, gravity->forces, NULL) == KT_OK)
        return gravity->forces;
    for (int i = 0; i < kt_model_nv(model); i++)
        gravity->forces[i] = (double)NAN;
    return gravity->forces;
}
