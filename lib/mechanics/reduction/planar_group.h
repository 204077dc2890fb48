/* One constraint group inside the articulated-body recursion, in a plane: spatial_group.h with three numbers instead
 * of six.
 *
 * Velocities alone give no angular acceleration in a plane. For a group on the ground F and Ic are not needed.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_PLANAR_GROUP_H
#define KT_REDUCTION_PLANAR_GROUP_H

#include "constraint/planar_loop_jacobian.h"
#include "dynamics/aba_planar.h"
#include "reduction/maggi_kane.h"

enum { KT_PLANAR_WIDTH = 3 };

/* Computes the accelerations A0 due to the velocities alone, while the parent's acceleration is zero (in
 * response->bias_linear). Also computes the corresponding wrenches: the bias becomes IA_i A0_i + bias. (ax, ay): the
 * ground's acceleration, minus gravity. */
static inline void kt_planar_group_bias(const kt_model *model, kt_data *data, const kt_group *group, int32_t top,
                                        kt_real1 ax, kt_real1 ay) {
    const int32_t *index = model->group_link + group->link, count = group->link_count, first = model->to_planar;
    for (int l = 0; l < count; l++) {
        const int32_t k = index[l] + first;
        const int32_t up = model->planar[k].parent;
        const kt_planar_motion *m = &data->planar[k];
        kt_planar_inertia *x = &data->planar_inertia[k];
        kt_real1 *linear = data->planar_response[k].bias_linear;
        linear[0] = m->linear[0];
        linear[1] = m->linear[1];
        if (up != top) {
            linear[0] += data->planar_response[up].bias_linear[0];
            linear[1] += data->planar_response[up].bias_linear[1];
        } else if (up == 0) {
            linear[0] += ax;
            linear[1] += ay;
        }
        x->moment += x->h[0] * linear[0] + x->h[1] * linear[1];
        x->force[0] += x->xx * linear[0] + x->xy * linear[1];
        x->force[1] += x->xy * linear[0] + x->yy * linear[1];
    }
}

/* The component of (moment, force) along the degree of freedom of the link with planar index k. */
KT_INLINE kt_real1 kt_planar_along_dof(const kt_model *model, const kt_data *data, int32_t k, kt_real1 moment,
                                       kt_real1 fx, kt_real1 fy) {
    const kt_planar_link *link = &model->planar[k];
    kt_real1 u[2];
    if (link->revolute)
        return link->sign * moment;
    kt_planar_along(link, &data->planar[k], u);
    return u[0] * fx + u[1] * fy;
}

/* Computes the column of M for the degree of freedom of the link with planar index k, whose composite inertia c is
 * complete. If the parent (top) accelerates, also computes the column of F. */
KT_INLINE void kt_planar_group_column(const kt_model *model, const kt_data *data, const kt_group_work *w, int32_t top,
                                      int32_t k, const kt_planar_inertia *c) {
    const kt_planar_link *link = &model->planar[k];
    const int m = w->m, own = link->local;
    kt_real1 moment, fx, fy, u[2];
    if (link->revolute) {
        moment = link->sign * c->j;
        fx = link->sign * c->h[0];
        fy = link->sign * c->h[1];
        w->mass[own * (m + 1)] = c->j;
    } else {
        kt_planar_along(link, &data->planar[k], u);
        moment = c->h[0] * u[0] + c->h[1] * u[1];
        fx = c->xx * u[0] + c->xy * u[1];
        fy = c->xy * u[0] + c->yy * u[1];
        w->mass[own * (m + 1)] = u[0] * fx + u[1] * fy;
    }
    for (int32_t j = k;;) {
        const kt_real1 *r = data->planar[j].offset;
        j = model->planar[j].parent;
        if (j == 0)
            return;
        moment += r[0] * fy - r[1] * fx;
        if (j == top)
            break;
        const kt_real1 x = kt_planar_along_dof(model, data, j, moment, fx, fy);
        const int other = model->planar[j].local;
        w->mass[own * m + other] = x;
        w->mass[other * m + own] = x;
    }
    kt_real1 *coupling = w->coupling + KT_PLANAR_WIDTH * own;
    coupling[0] = moment;
    coupling[1] = fx;
    coupling[2] = fy;
}

/* Computes M, F and tau - h. If the parent accelerates, `total` becomes the inertia and bias wrench on it while x = 0:
 * (Ic, W). */
static inline void kt_planar_group_assemble(const kt_model *model, kt_data *data, const kt_group *group,
                                            const kt_group_work *w, int32_t top, const kt_real1 *tau,
                                            kt_planar_inertia *total) {
    *total = (kt_planar_inertia){.j = kt_real1_splat(0.0)};
    for (int i = 0; i < w->m * w->m; i++)
        w->mass[i] = kt_real1_splat(0.0);
    const int32_t *index = model->group_link + group->link, first = model->to_planar;
    for (int l = group->link_count - 1; l >= 0; l--) {
        const int32_t k = index[l] + first;
        const kt_planar_link *link = &model->planar[k];
        kt_planar_inertia *x = &data->planar_inertia[k];
        w->bias[link->local] = tau[link->v] - kt_planar_along_dof(model, data, k, x->moment, x->force[0], x->force[1]);
        kt_planar_group_column(model, data, w, top, k, x);
        if (link->parent == 0)
            continue;
        kt_planar_shift(x, data->planar[k].offset);
        kt_planar_add(link->parent == top ? total : &data->planar_inertia[link->parent], x);
    }
}

/* total becomes (Ic - F K, W + F y) and is added to the parent. */
static inline void kt_planar_group_onto_parent(const kt_group_work *w, kt_planar_inertia *total,
                                               kt_planar_inertia *parent) {
    const size_t m = (size_t)w->m;
    for (size_t i = 0; i < m; i++) {
        const kt_real1 *f = w->coupling + KT_PLANAR_WIDTH * i;
        const kt_real1 y = w->free[i], kn = w->gain[i], kx = w->gain[m + i], ky = w->gain[2 * m + i];
        total->moment += f[0] * y;
        total->force[0] += f[1] * y;
        total->force[1] += f[2] * y;
        total->j -= f[0] * kn;
        total->h[0] -= f[1] * kn;
        total->h[1] -= f[2] * kn;
        total->xx -= f[1] * kx;
        total->xy -= f[2] * kx;
        total->yy -= f[2] * ky;
    }
    kt_planar_add(parent, total);
}

/* Writes the accelerations of the group's coordinates, which follow from the accelerations of the parent with the
 * planar index `top`, to a. */
static inline void kt_planar_group_respond(const kt_model *model, const kt_data *data, const kt_group *group,
                                           const kt_group_work *w, int32_t top, kt_real1 *a) {
    const int m = w->m;
    const int32_t *v = model->group_v + group->v;
    const kt_planar_motion *p = &data->planar[top];
    for (int i = 0; i < m; i++) {
        kt_real1 x = w->free[i];
        if (top)
            x -= w->gain[i] * p->alpha + (w->gain[m + i] * p->linear[0] + w->gain[2 * m + i] * p->linear[1]);
        a[v[i]] = x;
    }
}

#endif
