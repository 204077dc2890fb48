/* Forward dynamics of trees with armature, in space and in the plane: aba.c and aba_planar.c with another
 * elimination of joints. These two are compiled by themselves, so that what has no armature is compiled as if there
 * were none.
 */
#include "dynamics/aba.h"
#include "dynamics/aba_planar.h"
#include "dynamics/dynamics.h"

/* Projects the degrees of freedom of a link with armature out of x, the last one first. With A the acceleration before
 * the joint's own, c included, and k ascending,
 *   U = I S,  d = 1 / (S.U + a),  y = (tau - S.p) d:     x_k = y_k - d U.(A + sum_{j<k} S_j x_j)
 * Stores y and d U: of one degree of freedom as kt_articulated_project_axis does, of several with d in the link's
 * articulated inertia (kt_armature_gain). */
bool KT_KERNEL(kt_project_armature)(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                    kt_articulated *x) {
    const kt_link *link = &model->link[i];
    const kt_link_motion *m = &data->motion[i];
    kt_articulated *kept = &data->articulated[link->articulated];
    kt_subspace s;
    kt_link_subspace(link, &data->motion[link->parent], m, &s);
    for (int k = s.count - 1; k >= 0; k--) {
        const kt_v4 sn = s.angular[k], sf = s.linear[k];
        const kt_v4 un = kt_v4_apply(x->j, sn) + kt_v4_apply(x->h, sf);
        const kt_v4 uf = kt_v4_apply(x->g, sn) + kt_v4_apply(x->m, sf);
        const double inertia = kt_v4_dot2(sn, un, sf, uf) + model->armature[link->v + k];
        const double size = kt_v4_dot2(sn * sn, kt_diagonal3(x->j), sf * sf, kt_diagonal3(x->m)) + link->size;
        if (!(inertia > KT_NO_INERTIA * size))
            return false;
        const double d = 1.0 / inertia, y = (tau[link->v + k] - kt_v4_dot2(sn, x->moment, sf, x->force)) * d;
        const kt_v4 vn = un * kt_v4_splat(d), vf = uf * kt_v4_splat(d);
        x->moment += un * kt_v4_splat(y);
        x->force += uf * kt_v4_splat(y);
        for (int c = 0; c < 3; c++) {
            x->j[c] -= un * kt_v4_splat(vn[c]);
            x->g[c] -= uf * kt_v4_splat(vn[c]);
            x->h[c] -= un * kt_v4_splat(vf[c]);
            x->m[c] -= uf * kt_v4_splat(vf[c]);
        }
        if (s.count == 1) {
            data->response[i].gain_angular = vn + kt_v4_cross(m->offset, vf);
            data->response[i].gain_angular[3] = y - kt_v4_dot2(vn, m->alpha, vf, m->linear);
            data->response[i].gain_linear = vf;
            continue;
        }
        *kt_armature_gain(kept, 2 * k) = (kt_v4){vn[0], vn[1], vn[2], d};
        *kt_armature_gain(kept, 2 * k + 1) = vf;
        (k < 3 ? &kept->moment : &kept->force)[0][k % 3] = y;
    }
    x->moment += kt_v4_apply(x->j, m->alpha) + kt_v4_apply(x->h, m->linear);
    x->force += kt_v4_apply(x->g, m->alpha) + kt_v4_apply(x->m, m->linear);
    return true;
}

size_t KT_KERNEL(kt_armature_forward)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                      const double *tau, const kt_wrench *external, double *a) {
    const size_t end = model->n.spatial;
    kt_articulated_motion(model, data, q, v, end);
    if (external)
        kt_external_set(model, data, external);
    const size_t failed = kt_articulated_backward(model, data, tau, end, kt_eliminate_armature, NULL);
    if (!failed)
        kt_articulated_forward(model, data, end, kt_link_respond_armature, a);
    return failed;
}

size_t KT_KERNEL(kt_planar_armature_forward)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                             const double *tau, const kt_wrench *external, double *a) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        kt_planar_articulated_motion(model, data, &model->plane[p], q, v);
    if (external)
        kt_planar_external(model, data->planar, external);
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        const size_t failed =
            kt_planar_articulated_backward(model, data, plane, tau, kt_planar_eliminate_armature, NULL);
        if (failed)
            return model->n.spatial + failed - 1;
        kt_planar_articulated_forward(model, data, plane, plane->gravity, kt_planar_respond_joint, a, NULL);
    }
    return 0;
}
