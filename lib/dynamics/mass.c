/* Mass matrix: the composite-rigid-body algorithm (Walker & Orin 1982; Featherstone 2008, 6.2), in world axes about
 * each link's own origin.
 *
 * A composite has the inertia J about the origin, h = m c and m. Shifted by r to the parent's origin these are
 *   J + [h, r] + [r, h] + m [r, r],   h + m r,   m          with [u, w] = (u . w) I - w u'
 * Its wrench for a unit acceleration of degree of freedom k is carried to each ancestor j:
 *   F = (J s + h x s_f, m s_f + s x h),   M_jk = S_j . F
 */
#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"

#include <string.h>

/* Adds the composite of a link to its parent's. It is stored as an articulated inertia: j, moment = h, force = (m, ..).
 */
KT_INLINE void add_to_parent(const kt_articulated *c, kt_v4 r, kt_articulated *parent) {
    const kt_v4 h = c->moment;
    const double m = c->force[0];
    const kt_v4 w = h + kt_v4_splat(m) * r; /* [h, r] + [r, h] + m [r, r] = [w, r] + [r, h] */
    const double diagonal = kt_v4_dot(w, r) + kt_v4_dot(r, h);
    for (int k = 0; k < 3; k++) {
        kt_v4 column = c->j[k] - r * kt_v4_splat(w[k]) - h * kt_v4_splat(r[k]);
        column[k] += diagonal;
        parent->j[k] += column;
    }
    parent->moment += w;
    parent->force += c->force;
}

/* The columns of M that belong to link i, from its own rows to the root's. */
static inline void columns(const kt_model *model, const kt_data *data, size_t i, double *mass) {
    const size_t nv = model->n.v;
    const kt_link_motion *motion = data->motion;
    const kt_link *link = &model->link[i];
    const kt_articulated *c = &data->articulated[i];
    kt_v4 moment[KT_DOF_MAX], force[KT_DOF_MAX];
    kt_subspace own;
    kt_link_subspace(link, &motion[link->parent], &motion[i], &own);
    for (int k = 0; k < own.count; k++) {
        moment[k] = kt_v4_apply(c->j, own.angular[k]) + kt_v4_cross(c->moment, own.linear[k]);
        force[k] = kt_v4_splat(c->force[0]) * own.linear[k] + kt_v4_cross(own.angular[k], c->moment);
        for (int l = k; l < own.count; l++) /* lower triangle: row l, column k */
            mass[(size_t)(link->v + k) * nv + (size_t)(link->v + l)] =
                kt_along(own.angular[l], own.linear[l], moment[k], force[k]);
    }
    for (size_t j = i; link->parent != 0; j = (size_t)link->parent, link = &model->link[j]) {
        const kt_link *up = &model->link[link->parent];
        kt_subspace s;
        kt_link_subspace(up, &motion[up->parent], &motion[link->parent], &s);
        for (int k = 0; k < own.count; k++) {
            moment[k] += kt_v4_cross(motion[j].offset, force[k]);
            for (int l = 0; l < s.count; l++) /* row of the descendant, column of the ancestor */
                mass[(size_t)(up->v + l) * nv + (size_t)(model->link[i].v + k)] =
                    kt_along(s.angular[l], s.linear[l], moment[k], force[k]);
        }
    }
}

/* Sums the composites; returns a link on the ground whose composite is not finite, or 0. */
static inline size_t compose(const kt_model *model, kt_data *data, const double *q) {
    const size_t count = model->n.spatial;
    kt_link_motion *motion = data->motion;
    kt_articulated *composite = data->articulated;
    kt_sincos_gather(q, model->angle, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(kt_v4_splat(0.0), &motion[0]);
    for (size_t i = 1; i < count; i++) {
        const kt_link *link = &model->link[i];
        kt_link_motion *m = &motion[i];
        kt_link_pose(link, &motion[link->parent], q, data->cosine, data->sine, m);
        kt_v4_rotate_inertia(m->axes, link->inertia, composite[i].j);
        composite[i].moment = kt_v4_apply(m->axes, link->moment);
        composite[i].force = (kt_v4){link->mass, 0.0, 0.0, 0.0};
    }
    for (size_t i = count - 1; i > 0; i--) {
        kt_articulated *c = &composite[i];
        const int32_t parent = model->link[i].parent;
        const kt_v4 all = c->j[0] + c->j[1] + c->j[2] + c->moment, none = all - all;
        if (parent)
            add_to_parent(c, motion[i].offset, &composite[parent]);
        else if (!(none[0] + none[1] + none[2] == 0.0))
            return i;
    }
    return 0;
}

size_t KT_KERNEL(kt_mass)(const kt_model *model, kt_data *data, const double *q, double *mass) {
    const size_t failed = compose(model, data, q);
    if (failed)
        return failed;
    memset(mass, 0, model->n.v * model->n.v * sizeof *mass);
    for (size_t i = model->n.spatial - 1; i > 0; i--)
        columns(model, data, i, mass);
    return 0;
}
