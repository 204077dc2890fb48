/* The start of an export: the one at which loops are closed, as a run begins. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "kinetree/model.h"
#include "robot/write.h"

#include <string.h>

/* Puts positions and velocities of a state into joints. */
static void put_state(const kt_model *model, const double *q, const double *v, kt_body *bodies) {
    for (int b = 1; b < kt_model_body_count(model); b++) {
        const kt_coordinates at = kt_body_coordinates(model, b);
        kt_joint *joint = &bodies[kt_body_source(model, b)].joint;
        for (int k = 0; k < at.nq; k++)
            joint->position[k] = q[at.q + k];
        for (int k = 0; k < at.nv; k++)
            joint->velocity[k] = v[at.v + k];
    }
}

bool kt_export_assemble(kt_export *x) {
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_error ignored;
    if (x->d->loop_count == 0)
        return true;
    kt_description *d = kt_pool_take(&x->pool, 1, sizeof *d);
    kt_body *bodies = kt_pool_take(&x->pool, (size_t)x->d->body_count + 1, sizeof *bodies);
    if (d == NULL || bodies == NULL)
        return false;
    kt_status status = kt_model_compile(x->d, NULL, &model, &ignored);
    if (status == KT_OK)
        status = kt_data_create(model, &data, &ignored);
    const size_t nq = status == KT_OK ? (size_t)kt_model_nq(model) : 0,
                 nv = status == KT_OK ? (size_t)kt_model_nv(model) : 0;
    double *q = kt_pool_take(&x->pool, nq + nv + 1, sizeof *q);
    if (q != NULL && status == KT_OK) {
        kt_model_initial(model, q, q + nq);
        status = kt_state_assemble(model, data, 0.0, q, q + nq, &ignored);
    }
    if (q != NULL && status == KT_OK) {
        *d = *x->d;
        if (x->d->body_count > 0)
            memcpy(bodies, x->d->bodies, (size_t)x->d->body_count * sizeof *bodies);
        put_state(model, q, q + nq, bodies);
        d->bodies = bodies;
        x->d = d;
    } else if (q != NULL && status != KT_ERROR_MEMORY) {
        kt_export_lose(x,
                       "the assembled start, since no state that closes all loops is found; the given one is written");
    }
    kt_data_free(data);
    kt_model_free(model);
    return q != NULL && status != KT_ERROR_MEMORY;
}
