/* Forward dynamics of trees with armature, in space and in the plane: aba.c and aba_planar.c with another elimination
 * of joints. Both are compiled separately, so that armature does not change the code for models without armature. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba.h"
#include "dynamics/aba_planar.h"
#include "dynamics/dynamics.h"

#include <assert.h>

/* Projects the degrees of freedom of a link with armature out of x, the last degree of freedom first. With A the
 * acceleration before the joint's acceleration, including c, and k ascending,
 *   U = I S,  d = 1 / (S.U + a),  y = (tau - S.p) d:     x_k = y_k - d U.(A + sum_{j<k} S_j x_j)
 * Stores y and d U. For one degree of freedom, both are stored as in kt_articulated_project_axis; for several, in the
 * link's articulated inertia, with d (kt_armature_gain). */
kt_condition KT_KERNEL(kt_project_armature)(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                            kt_articulated *x) {
    assert(i > 0 && i < model->n.link);
    const kt_link *link = &model->link[i];
    const kt_link_motion *m = &data->motion[i];
    kt_articulated *kept = &data->articulated[link->articulated];
    kt_condition has_inertia = kt_condition_true();
    kt_subspace s;
    kt_link_subspace(link, &data->motion[link->parent], m, &s);
    for (int k = s.count - 1; k >= 0; k--) {
        const kt_real3 sn = s.angular[k], sf = s.linear[k];
        const kt_real3 un = kt_articulated_moment(x, sn, sf), uf = kt_articulated_force(x, sn, sf);
        const kt_real1 inertia = kt_dots3(sn, un, sf, uf) + model->armature[link->v + k];
        const kt_real1 size =
            kt_dots3(kt_mul3(sn, sn), kt_diagonal3(x->j), kt_mul3(sf, sf), kt_diagonal3(x->m)) + link->size;
        if (kt_fails(&has_inertia, inertia > KT_NO_INERTIA * size))
            return kt_condition_false();
        const kt_real1 d = 1.0 / inertia, y = (tau[link->v + k] - kt_dots3(sn, x->moment, sf, x->force)) * d;
        const kt_real3 vn = kt_scale3(d, un), vf = kt_scale3(d, uf);
        x->moment = kt_add_scaled3(x->moment, y, un);
        x->force = kt_add_scaled3(x->force, y, uf);
        kt_articulated_subtract_square(x, d, un, uf);
        if (s.count == 1) {
            kt_response_set(&data->response[i], kt_add3(vn, kt_cross3(m->offset, vf)), vf,
                            y - kt_dots3(vn, m->alpha, vf, m->linear));
            continue;
        }
        *kt_armature_gain(kept, 2 * k) = vn;
        kt_armature_store(kept, 2 * k, d);
        *kt_armature_gain(kept, 2 * k + 1) = vf;
        kt_set_part3(k < 3 ? &kept->moment : &kept->force, k % 3, y);
    }
    x->moment = kt_add3(x->moment, kt_articulated_moment(x, m->alpha, m->linear));
    x->force = kt_add3(x->force, kt_articulated_force(x, m->alpha, m->linear));
    return has_inertia;
}

size_t KT_KERNEL(kt_armature_forward)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                      const kt_real1 *tau, const kt_external *external, kt_real1 *a) {
    assert(kt_data_serve(model, data) && model->has_armature);
    const size_t end = model->n.spatial;
    kt_articulated_motion(model, data, q, v, end);
    if (external)
        kt_external_set(model, data, external);
    const size_t failed = kt_articulated_backward(model, data, tau, end, kt_eliminate_armature, NULL);
    if (!failed)
        kt_articulated_forward(model, data, end, kt_link_respond_armature, a);
    return failed;
}

size_t KT_KERNEL(kt_planar_armature_forward)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                             const kt_real1 *tau, const kt_external *external, kt_real1 *a) {
    assert(kt_data_serve(model, data) && model->has_armature);
    kt_planar_articulated_motion(model, data, q, v, external);
    return kt_planar_articulated_solve(model, data, tau, kt_planar_eliminate_armature, NULL, a);
}
