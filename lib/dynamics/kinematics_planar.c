/* Poses and motion of the planar links in the world: the forward pass of sweep_planar.h, without gravity, with each
 * link's numbers expressed in world axes. With A the link's axes at q = 0 in the plane's basis,
 *   R = [w1 w2 n] A,   w1 = c e1 + s e2,   w2 = c e2 - s e1
 *   angular velocity omega n,   angular acceleration alpha n,   a = a_1 e1 + a_2 e2
 * Offsets are computed as in sweep.h, in three coordinates, so that no height is lost and only prismatic joints show a
 * displacement.
 */
#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"
#include "dynamics/sweep_planar.h"

KT_INLINE kt_v4 in_plane(const kt_v4 basis[3], const double x[2]) {
    return kt_v4_splat(x[0]) * basis[0] + kt_v4_splat(x[1]) * basis[1];
}

KT_INLINE void to_world(const kt_v4 basis[3], const kt_planar_rest *rest, const kt_planar_motion *flat,
                        kt_link_motion *m) {
    const kt_v4 c = kt_v4_splat(flat->c), s = kt_v4_splat(flat->s);
    const kt_v4 turned[3] = {c * basis[0] + s * basis[1], c * basis[1] - s * basis[0], basis[2]};
    kt_multiply3(turned, rest->axes, m->axes);
    m->omega = kt_v4_splat(flat->omega) * basis[2];
    m->alpha = kt_v4_splat(flat->alpha) * basis[2];
    m->linear = in_plane(basis, flat->linear);
}

/* The sum of x - x over a link's motion, as in kinematics.c. */
KT_INLINE kt_v4 excess(const kt_link_motion *m, const kt_link_origin *at) {
    return ((m->alpha - m->alpha) + (m->linear - m->linear)) +
           ((at->position - at->position) + (at->velocity - at->velocity));
}

KT_INLINE bool is_zero(kt_v4 x) { return x[0] + x[1] + x[2] == 0.0; }

/* The links of one plane; returns the sum of their excess. posed: the data already hold the poses in the plane. */
KT_INLINE kt_v4 sweep_plane(const kt_model *model, kt_data *data, const kt_plane *plane, const double *q,
                            const double *v, const double *a, bool posed) {
    static const double none[2] = {0.0, 0.0};
    kt_planar_motion *flat = data->planar;
    kt_v4 basis[3], sum = kt_v4_splat(0.0);
    kt_v4_from_mat3(plane->basis, basis);
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
            kt_planar_pose(link, parent, q, data->planar_cosine, data->planar_sine, &flat[k]);
        kt_planar_velocity(link, parent, v, &flat[k]);
        kt_planar_acceleration(link, parent, a, &flat[k]);
        to_world(basis, &model->planar_rest[k], &flat[k], m);
        m->offset = kt_v4_apply_to(up->axes, model->link[i].at);
        if (!link->revolute)
            m->offset += kt_v4_splat(q[link->q]) * kt_link_axis(&model->link[i], m);
        at->position = before->position + m->offset;
        at->velocity = before->velocity + kt_v4_cross(kt_v4_splat(parent->omega) * basis[2], m->offset);
        if (!link->revolute)
            at->velocity += kt_v4_splat(v[link->v]) * kt_link_axis(&model->link[i], m);
        sum += excess(m, at);
    }
    return sum;
}

KT_INLINE size_t sweep(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                       bool posed) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_v4 sum = none;
    if (!posed)
        kt_planar_gather(model, data, q);
    kt_ground_set(none, &data->motion[0]);
    memset(&data->origin[0], 0, sizeof data->origin[0]);
    for (size_t p = 0; p < model->n.plane; p++)
        sum += sweep_plane(model, data, &model->plane[p], q, v, a, posed);
    size_t failed = is_zero(sum) ? 0 : model->n.spatial;
    while (failed && is_zero(excess(&data->motion[failed], &data->origin[failed])))
        failed++;
    return failed;
}

size_t KT_KERNEL(kt_planar_kinematics)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                       const double *a) {
    return sweep(model, data, q, v, a, false);
}

size_t KT_KERNEL(kt_planar_follow)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                   const double *a) {
    return sweep(model, data, q, v, a, true);
}
