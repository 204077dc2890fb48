/* One constraint group inside the articulated-body recursion.
 *
 * The backward pass reaches the group's highest link with the articulated inertias IA_i and bias wrenches of all links
 * of the group. Inertias and wrenches include all descendants outside the group. The links of the group are then
 * treated together as a mechanism of m coordinates x on a parent that accelerates by A = (alpha, a):
 *
 *   M x + F' A + h = tau + A_g' lambda
 *   A_g x = b''                              (b'' does not depend on A: loop_jacobian.h)
 *   wrench on the parent = Ic A + F x + W
 *
 * The composite-body recursion over IA_i yields M, F and the composite Ic. Newton-Euler with the accelerations due to
 * the velocities alone yields h and W. By Maggi-Kane [MSD 7.33, 7.34],
 *
 *   x = x0 + N z,   A_g x0 = b'',   A_g N = 0
 *   (N' M N) z = N' (tau - h - M x0 - F' A)
 *
 * so that (maggi_kane.h)
 *
 *   x = y - K A                              y: free acceleration, K: parent gain
 *   inertia on the parent     Ic - F K       an articulated inertia like any other
 *   bias wrench on the parent W + F y
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_SPATIAL_GROUP_H
#define KT_REDUCTION_SPATIAL_GROUP_H

#include "reduction/maggi_kane.h"

#ifndef KT_LANES
#include "reduction/components.h"
#else
#include "constraint/group.h"
#include "dynamics/aba.h"
#endif

#include <string.h>

/* Computes the accelerations A0 due to the velocities alone, while the parent's acceleration is zero (in response).
 * Also computes the corresponding wrenches: articulated[i].(moment, force) becomes IA_i A0_i + bias. */
static inline void kt_group_bias(const kt_model *model, kt_data *data, const kt_group *group) {
    for (int l = 0; l < group->link_count; l++) {
        const int32_t i = model->group_link[group->link + l], up = model->link[i].parent;
        const kt_link_motion *m = &data->motion[i];
        kt_response *self = &data->response[i];
        self->bias_angular = m->alpha;
        self->bias_linear = m->linear;
        if (up != group->parent) {
            self->bias_angular = kt_add3(self->bias_angular, data->response[up].bias_angular);
            self->bias_linear =
                kt_add3(self->bias_linear,
                        kt_add3(data->response[up].bias_linear, kt_cross3(data->response[up].bias_angular, m->offset)));
        } else if (up == 0) { /* the ground's acceleration is given: gravity */
            self->bias_linear = kt_add3(self->bias_linear, data->motion[0].linear);
        }
        kt_articulated *x = &data->articulated[i];
        x->moment = kt_add3(x->moment, kt_articulated_moment(x, self->bias_angular, self->bias_linear));
        x->force = kt_add3(x->force, kt_articulated_force(x, self->bias_angular, self->bias_linear));
    }
}

/* Computes the columns of M and F for the degrees of freedom of link i, whose composite inertia is complete. */
static inline void kt_group_columns(const kt_model *model, const kt_data *data, const kt_group *group,
                                    const kt_group_work *w, int32_t i) {
    const size_t m = (size_t)w->m;
    const kt_articulated *c = &data->articulated[i];
    const kt_link *link = &model->link[i];
    kt_subspace own;
    kt_link_subspace(link, &data->motion[link->parent], &data->motion[i], &own);
    for (int k = 0; k < own.count; k++) {
        const size_t column = (size_t)link->local + (size_t)k;
        kt_real3 moment = kt_articulated_moment(c, own.angular[k], own.linear[k]);
        kt_real3 force = kt_articulated_force(c, own.angular[k], own.linear[k]);
        for (int32_t j = i;;) {
            const kt_link *at = &model->link[j];
            kt_subspace s;
            kt_link_subspace(at, &data->motion[at->parent], &data->motion[j], &s);
            for (int l = 0; l < s.count; l++) {
                const kt_real1 x = kt_along(s.angular[l], s.linear[l], moment, force);
                w->mass[column * m + (size_t)(at->local + l)] = x;
                w->mass[(size_t)(at->local + l) * m + column] = x;
            }
            moment = kt_add3(moment, kt_cross3(data->motion[j].offset, force));
            j = at->parent;
            if (j == group->parent)
                break;
        }
        for (int l = 0; l < 3; l++) {
            w->coupling[6 * column + (size_t)l] = KT_PART3(moment, l);
            w->coupling[6 * column + 3 + (size_t)l] = KT_PART3(force, l);
        }
    }
}

/* Computes M, F and tau - h; returns in `total` the inertia and bias wrench on the parent while x = 0: (Ic, W). */
static inline void kt_group_assemble(const kt_model *model, kt_data *data, const kt_group *group,
                                     const kt_group_work *w, const kt_real1 *tau, kt_articulated *total) {
    kt_articulated_zero(total);
    memset(w->mass, 0, (size_t)w->m * (size_t)w->m * sizeof *w->mass);
    kt_group_bias(model, data, group);
    for (int l = group->link_count - 1; l >= 0; l--) {
        const int32_t i = model->group_link[group->link + l];
        const kt_link *link = &model->link[i];
        kt_articulated x = data->articulated[i];
        kt_subspace s;
        kt_link_subspace(link, &data->motion[link->parent], &data->motion[i], &s);
        for (int k = 0; k < s.count; k++)
            w->bias[link->local + k] = tau[link->v + k] - kt_along(s.angular[k], s.linear[k], x.moment, x.force);
        kt_group_columns(model, data, group, w, i);
        kt_articulated_shift(&x, data->motion[i].offset);
        kt_articulated_add(link->parent == group->parent ? total : &data->articulated[link->parent], &x);
    }
}

/* Adds the armatures to M. */
static inline void kt_group_gear(const kt_model *model, const kt_group *group, const kt_group_work *w) {
    for (int i = 0; i < w->m; i++)
        w->mass[i * (w->m + 1)] += model->armature[model->group_v[group->v + i]];
}

/* total becomes (Ic - F K, W + F y) and is added to the parent. */
static inline void kt_group_onto_parent(const kt_group_work *w, kt_articulated *total, kt_articulated *parent) {
    kt_real1 f[6], fk[36];
    memset(f, 0, sizeof f);
    memset(fk, 0, sizeof fk);
    for (int i = 0; i < w->m; i++)
        for (int r = 0; r < 6; r++) {
            const kt_real1 x = w->coupling[6 * (size_t)i + (size_t)r];
            f[r] += x * w->free[i];
            for (int c = 0; c < 6; c++)
                fk[6 * c + r] += x * w->gain[(size_t)c * (size_t)w->m + (size_t)i];
        }
    for (int c = 0; c < 3; c++) {
        total->j[c] = kt_sub3(total->j[c], kt_load3(fk + 6 * c));
        total->g[c] = kt_sub3(total->g[c], kt_load3(fk + 6 * c + 3));
        total->m[c] = kt_sub3(total->m[c], kt_load3(fk + 6 * (c + 3) + 3));
    }
    total->moment = kt_add3(total->moment, kt_load3(f));
    total->force = kt_add3(total->force, kt_load3(f + 3));
    kt_articulated_add(parent, total);
}

/* Writes the accelerations of the group's coordinates, which follow from the parent's, to a. */
static inline void kt_group_respond(const kt_model *model, const kt_data *data, const kt_group *group,
                                    const kt_group_work *w, kt_real1 *a) {
    const kt_link_motion *p = &data->motion[group->parent];
    for (int i = 0; i < w->m; i++) {
        kt_real1 x = w->free[i];
        for (int c = 0; c < 3 && group->parent; c++)
            x -= w->gain[(size_t)c * (size_t)w->m + (size_t)i] * KT_PART3(p->alpha, c) +
                 w->gain[(size_t)(c + 3) * (size_t)w->m + (size_t)i] * KT_PART3(p->linear, c);
        a[model->group_v[group->v + i]] = x;
    }
}

#endif
