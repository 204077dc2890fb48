/* Measures the lengths of springs that start unstretched, in the assembled initial state. If the loops do not close,
 * the given state is used; a simulation reports that. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pool.h"
#include "compile/compile.h"
#include "effect/effect.h"
#include "evaluate/evaluate.h"

/* The lengths are the distances of the ends of each such spring. */
static void measure_mechanism(kt_model *m, const kt_description *description, const kt_pose *poses) {
    for (size_t i = 0; i < m->n.effect + m->n.effect_off; i++) {
        kt_effect_record *r = &m->effect[i];
        if (!kt_effect_has_initial_length(&description->effects[r->source]))
            continue;
        const kt_pose first = kt_pose_compose(poses[r->link[0]], r->frame[0]);
        const kt_pose second = kt_pose_compose(poses[r->link[1]], r->frame[1]);
        r->length = kt_vec3_norm(kt_vec3_sub(second.position, first.position));
    }
}

kt_status kt_model_measure_springs(kt_model *model, const kt_description *description, kt_error *error) {
    bool any = false;
    for (int i = 0; i < description->effect_count; i++)
        any |= kt_effect_has_initial_length(&description->effects[i]);
    if (!any)
        return KT_OK;
    kt_data *data = NULL;
    kt_pool pool = {.chunks = NULL};
    double *state = kt_pool_take(&pool, model->n.q + model->n.v, sizeof *state);
    kt_pose *poses = kt_pool_take(&pool, model->n.link, sizeof *poses);
    kt_status status = state && poses ? kt_data_create(model, &data, error)
                                      : kt_error_set(error, KT_ERROR_MEMORY, "", "out of memory");
    if (status == KT_OK) {
        kt_model_initial(model, state, state + model->n.q);
        kt_assemble_initial(model, data, state, state + model->n.q);
        kt_link_poses(model, state, poses);
        measure_mechanism(model, description, poses);
    }
    kt_data_free(data);
    kt_pool_free(pool.chunks);
    return status;
}
