/* Poses and motion of the planar links in the world. The computation is the forward pass of sweep_planar.h, without
 * gravity, with each link's numbers expressed in world axes. With A the link's axes at q = 0 in the plane's basis,
 *   R = [w1 w2 n] A,   w1 = c e1 + s e2,   w2 = c e2 - s e1
 *   angular velocity omega n,   angular acceleration alpha n,   a = a_1 e1 + a_2 e2
 * Offsets are computed as in sweep.h, in three coordinates. So no height is lost, and only prismatic joints show a
 * displacement. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "dynamics/excess.h"
#include "dynamics/sweep.h"
#include "dynamics/sweep_planar.h"

#include <assert.h>

KT_INLINE kt_real3 in_plane(const kt_real3 basis[3], const kt_real1 x[2]) {
    return kt_add3(kt_scale3(x[0], basis[0]), kt_scale3(x[1], basis[1]));
}

/* R, omega, alpha and a of the formulas above; `rest` has A. */
KT_INLINE void to_world(const kt_real3 basis[3], const kt_planar_rest *rest, const kt_planar_motion *flat,
                        kt_link_motion *m) {
    const kt_real1 c = flat->c, s = flat->s;
    const kt_real3 turned[3] = {kt_add3(kt_scale3(c, basis[0]), kt_scale3(s, basis[1])),
                                kt_sub3(kt_scale3(c, basis[1]), kt_scale3(s, basis[0])), basis[2]};
    const kt_real3 axes[3] = {kt_splat3(rest->axes[0]), kt_splat3(rest->axes[1]), kt_splat3(rest->axes[2])};
    kt_multiply3(turned, axes, m->axes);
    m->omega = kt_scale3(flat->omega, basis[2]);
    m->alpha = kt_scale3(flat->alpha, basis[2]);
    m->linear = in_plane(basis, flat->linear);
}

/* Computes the links of one plane; returns the sum of their excess. posed: the data already hold the poses in the
 * plane. */
KT_INLINE kt_real3 sweep_plane(const kt_model *model, kt_data *data, const kt_plane *plane, const kt_real1 *q,
                               const kt_real1 *v, const kt_real1 *a, bool posed) {
    const kt_const1 none[2] = {kt_real1_splat(0.0), kt_real1_splat(0.0)};
    kt_planar_motion *flat = data->planar;
    const kt_real3 basis[3] = {kt_const_from3(plane->basis.x), kt_const_from3(plane->basis.y),
                               kt_const_from3(plane->basis.z)};
    kt_real3 sum = kt_zero3();
    kt_planar_ground_set(none, &flat[0]);
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *parent = &flat[link->parent];
        const size_t i = model->n.spatial + (size_t)k - 1;
        kt_link_motion *m = &data->motion[i];
        const kt_link_motion *up = &data->motion[model->link[i].parent];
        kt_link_origin *at = &data->origin[i];
        const kt_link_origin *before = &data->origin[model->link[i].parent];
        if (!posed)
            (void)kt_planar_pose(link, kt_load2(parent->rotation), q, data->planar_cosine, data->planar_sine, &flat[k]);
        (void)kt_planar_velocity(link, parent->omega, v, &flat[k]);
        kt_planar_acceleration(link, parent, a, &flat[k]);
        to_world(basis, &model->planar_rest[k], &flat[k], m);
        m->offset = kt_const_apply3(up->axes, model->link[i].at);
        if (!link->revolute)
            m->offset = kt_add_scaled3(m->offset, q[link->q], kt_link_axis(&model->link[i], m));
        at->position = kt_add3(before->position, m->offset);
        at->velocity = kt_add3(before->velocity, kt_cross3(kt_scale3(parent->omega, basis[2]), m->offset));
        if (!link->revolute)
            at->velocity = kt_add_scaled3(at->velocity, v[link->v], kt_link_axis(&model->link[i], m));
        sum = kt_add3(sum, kt_excess(m, at));
    }
    return sum;
}

/* All planes. If `posed`, the data already hold the poses in the planes. Returns the first link whose motion is not
 * finite, or 0. */
KT_INLINE size_t sweep(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v, const kt_real1 *a,
                       bool posed) {
    kt_real3 sum = kt_zero3();
    if (!posed)
        kt_planar_gather(model, data, q);
    kt_ground_set(kt_zero3(), &data->motion[0]);
    memset(&data->origin[0], 0, sizeof data->origin[0]);
    for (size_t p = 0; p < model->n.plane; p++)
        sum = kt_add3(sum, sweep_plane(model, data, &model->plane[p], q, v, a, posed));
    return kt_first_excess(data, sum, model->n.spatial);
}

size_t KT_KERNEL(kt_planar_kinematics)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                       const kt_real1 *a) {
    assert(kt_data_serve(model, data));
    return sweep(model, data, q, v, a, false);
}

size_t KT_KERNEL(kt_planar_follow)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                   const kt_real1 *a) {
    assert(kt_data_serve(model, data));
    return sweep(model, data, q, v, a, true);
}
