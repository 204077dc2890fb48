/* planar_cost planar|spatial LEVEL CALL: one call on a chain of 128 rods that turn about one axis, for planar_cost.py
 * to count its instructions. LEVEL: 1 baseline, 2 v3. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "describe.h"

#include "kinetree/dynamics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RODS = 128 };

static kt_body bodies[RODS];
static char names[RODS][16];
static double q[RODS], v[RODS], a[RODS], mass[RODS * RODS];

static kt_status call(const char *what, const kt_model *model, kt_data *data) {
    if (strcmp(what, "forward") == 0)
        return kt_dynamics_forward(model, data, q, v, NULL, NULL, a, NULL);
    if (strcmp(what, "inverse") == 0)
        return kt_dynamics_inverse(model, data, q, v, v, NULL, a, NULL);
    if (strcmp(what, "mass") == 0)
        return kt_dynamics_mass(model, data, q, mass, NULL);
    return kt_kinematics_update(model, data, q, v, v, NULL);
}

int main(int argc, char **argv) {
    if (argc != 4)
        return 1;
    for (int i = 0; i < RODS; i++) {
        (void)snprintf(names[i], sizeof names[i], "rod%d", i);
        bodies[i] = kt_body_of(names[i], i ? names[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
        bodies[i].joint.axis = kt_vec3_make(0.0, -1.0, 0.0);
        bodies[i].joint.at = kt_vec3_make(i ? 1.0 : 0.0, 0.0, 0.0);
        bodies[i].com = kt_vec3_make(0.5, 0.0, 0.0);
        bodies[i].inertia = kt_sym3_make(0.01, 1.0 / 12.0, 1.0 / 12.0, 0.0, 0.0, 0.0);
        q[i] = sin(i);
        v[i] = cos(i);
    }
    kt_model_options options = kt_model_options_default();
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_description d = kt_description_of(bodies, RODS, NULL, 0, NULL, 0);
    d.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    options.plan = strcmp(argv[1], "spatial") == 0 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
    options.isa = (kt_isa)strtol(argv[2], NULL, 10);
    const kt_status status = kt_model_compile(&d, &options, &model, NULL);
    if (status == KT_ERROR_UNSUPPORTED)
        return 77; /* a level that this processor or build does not have */
    if (status != KT_OK || strcmp(kt_model_plan(model), argv[1]) != 0 || kt_data_create(model, &data, NULL) != KT_OK ||
        call(argv[3], model, data) != KT_OK)
        return 1;
    kt_data_free(data);
    kt_model_free(model);
    return 0;
}
