/* Derivatives of inverse dynamics, and the mass matrix, of planar trees. For each joint k and each joint i that carries
 * it, the derivatives are sums over all links that k carries. With the origin o of k's link, and accelerations a less
 * gravity, the sums are
 *     m,  h = sum m x,  j = sum m x . x,  p = sum m v,  g = sum m x . v,  F = sum m a         x, v, a: relative to o
 * and of external forces f and f . x. J rotates by a right angle, and r is o less the origin of i. The links that k
 * carries move as one rigid body with q_k. A joint before k turns the other joint's field u of virtual velocities
 * along, so that no other sums are needed:
 *     i, k revolute         M_ik = j + r . h
 *                           D_ik = f . x + r . F - h . a_k          D_ki = f . x - h . a_i              by positions
 *                           D_ik = 2 (g + r . p)                    D_ki = 2 (g + h . (v_k - v_i))      by velocities
 *     i prismatic along e, k revolute        D_ik = -J e . F, 2 e . J p
 *     k prismatic           the field of i gives it P = sum m u, and turns with w:
 *                           D_ik = w J e . (F + m a_k - f) + P . (alpha J e - omega^2 e),   2 omega J e . P
 * and D_ki has P of k's own field, at rest before k. All are relative to o, since trees may travel fast, and as in
 * rnea_gradient_planar.c for the sum over i. Signs of joints about -n multiply both.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics_derivative.h"
#include "dynamics/sweep_planar.h"

#include <assert.h>

/* Sums over a link and all links that it carries, and its origin relative to the origin of the previous link. */
typedef struct carried {
    kt_v2 h, p, force, f;      /* h, p, F, f */
    kt_v2 offset, velocity, a; /* r and v from the link before; a, less gravity */
    kt_v2 e;                   /* prismatic: its direction */
    double m, j, g, fx;        /* fx: sum f . x */
} carried;

_Static_assert(sizeof(carried) <= sizeof(kt_derivative_link), "one memory holds either");

KT_INLINE kt_v2 scaled(double s, kt_v2 a) { return kt_v2_splat(s) * a; }

/* The link's own sums. */
KT_INLINE void set_link(const kt_planar_link *link, const kt_planar_motion *m, const kt_planar_motion *up,
                        const double *v, carried *x) {
    const kt_v2 rotation = kt_v2_load(m->rotation), h = kt_planar_sum(rotation, link->moment[0], link->moment[1]);
    const kt_v2 turned = kt_v2_across(h), none = {0.0, 0.0};
    x->offset = kt_v2_load(m->offset);
    x->velocity = scaled(up->omega, kt_v2_across(x->offset));
    x->a = kt_v2_load(m->linear);
    x->e = none;
    if (!link->revolute) {
        x->e = kt_planar_sum(rotation, link->along[0], link->along[1]);
        x->velocity += scaled(v[link->v], x->e);
    }
    x->h = h;
    x->p = scaled(m->omega, turned);
    x->force = scaled(m->alpha, turned) - scaled(m->omega * m->omega, h);
    x->f = none;
    x->m = link->mass;
    x->j = link->inertia;
    x->g = x->fx = 0.0;
}

/* The motion of the links of a plane, accelerations less gravity, and the sums m, h, j, p, g, F of each link alone. */
KT_INLINE void forward_pass(const kt_model *model, kt_data *data, const kt_plane *plane, const kt_dynamic_state *at,
                            const double *a, carried *links) {
    kt_planar_motion *motion = data->planar;
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *up = &motion[link->parent];
        (void)kt_planar_pose(link, kt_load2(up->rotation), at->q, data->planar_cosine, data->planar_sine, &motion[k]);
        (void)kt_planar_velocity(link, up->omega, at->v, &motion[k]);
        kt_planar_acceleration(link, up, a, &motion[k]);
        set_link(link, &motion[k], up, at->v, &links[k]);
    }
}

/* Adds external wrenches. The components of such wrenches out of the plane move nothing. Moments do not change as links
 * turn. */
KT_INLINE void load(const kt_model *model, const kt_planar_motion *motion, const kt_wrench *external, carried *links) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if (body->link == 0)
            continue;
        const kt_planar_external_wrench l = kt_planar_external_of(model, motion, body, &external[b]);
        links[l.link].f += l.force;
        links[l.link].fx += kt_v2_dot(l.force, l.x);
    }
}

/* Adds the sums of a link to the sums of the previous link. */
KT_INLINE void pass_on(const carried *x, carried *to) {
    const kt_v2 r = x->offset, first = x->h + scaled(x->m, r), p = x->p + scaled(x->m, x->velocity);
    to->m += x->m;
    to->j += x->j + kt_v2_dot(r, x->h + first);
    to->g += x->g + kt_v2_dot(x->h, x->velocity) + kt_v2_dot(r, p);
    to->h += first;
    to->p += p;
    to->force += x->force + scaled(x->m, x->a - to->a);
    to->fx += x->fx + kt_v2_dot(r, x->f);
    to->f += x->f;
}

/* Entries of a pair: M, and D_ik and D_ki by positions and by velocities. */
typedef struct pair {
    double mass, by_q[2], by_v[2];
} pair;

/* r, v: position and velocity of k's origin relative to i's origin; a: the acceleration of i's origin. */
KT_INLINE pair revolutes(const carried *x, kt_v2 r, kt_v2 v, kt_v2 a) {
    return (pair){.mass = x->j + kt_v2_dot(r, x->h),
                  .by_q = {x->fx + kt_v2_dot(r, x->force) - kt_v2_dot(x->h, x->a), x->fx - kt_v2_dot(x->h, a)},
                  .by_v = {2.0 * (x->g + kt_v2_dot(r, x->p)), 2.0 * (x->g + kt_v2_dot(x->h, v))}};
}

/* A prismatic joint along e on a link with omega and alpha: the accelerations due to its displacement and to its
 * rate. */
typedef struct prismatic {
    kt_v2 by_q, by_v;
} prismatic;

KT_INLINE prismatic prismatic_of(const kt_planar_motion *m, kt_v2 e) {
    const kt_v2 turned = kt_v2_across(e);
    return (prismatic){scaled(m->alpha, turned) - scaled(m->omega * m->omega, e), scaled(2.0 * m->omega, turned)};
}

/* The entries of a pair (i, k) with a prismatic joint i and a revolute joint k behind it. */
KT_INLINE pair slides_before(const carried *x, kt_v2 e, const kt_planar_motion *i) {
    const kt_v2 momentum = kt_v2_across(x->h);
    const prismatic s = prismatic_of(i, e);
    return (pair){.mass = kt_v2_dot(e, momentum),
                  .by_q = {-kt_v2_dot(kt_v2_across(e), x->force), kt_v2_dot(momentum, s.by_q)},
                  .by_v = {2.0 * kt_v2_dot(e, kt_v2_across(x->p)), kt_v2_dot(momentum, s.by_v)}};
}

/* i revolute, k prismatic. */
KT_INLINE pair slides_after(const carried *x, kt_v2 r, kt_v2 v, kt_v2 a, const kt_planar_motion *k) {
    const kt_v2 momentum = kt_v2_across(x->h + scaled(x->m, r)), turned = kt_v2_across(x->e);
    const prismatic s = prismatic_of(k, x->e);
    return (pair){.mass = kt_v2_dot(x->e, momentum),
                  .by_q = {kt_v2_dot(turned, x->force + scaled(x->m, x->a) - x->f) + kt_v2_dot(momentum, s.by_q),
                           kt_v2_dot(turned, scaled(x->m, a) - x->f)},
                  .by_v = {kt_v2_dot(momentum, s.by_v), -2.0 * kt_v2_dot(turned, x->p + scaled(x->m, v))}};
}

/* The entries of a pair of two prismatic joints. */
KT_INLINE pair slides(const carried *x, kt_v2 e, const kt_planar_motion *i, const kt_planar_motion *k) {
    const prismatic before = prismatic_of(i, e), after = prismatic_of(k, x->e);
    const kt_v2 here = scaled(x->m, x->e), there = scaled(x->m, e);
    return (pair){.mass = kt_v2_dot(e, here),
                  .by_q = {kt_v2_dot(there, after.by_q), kt_v2_dot(here, before.by_q)},
                  .by_v = {kt_v2_dot(there, after.by_v), kt_v2_dot(here, before.by_v)}};
}

/* The entries of joint k and of the joints that carry k. */
KT_INLINE void follow_path(const kt_model *model, const kt_planar_motion *motion, const carried *links, int32_t k,
                           kt_derivative_work *w) {
    double *by_q = (double *)w->dq, *by_v = (double *)w->dv, *mass = (double *)w->dtau;
    const kt_planar_link *own = &model->planar[k];
    const carried *x = &links[k];
    const size_t n = model->n.v, column = (size_t)own->v;
    kt_v2 r = {0.0, 0.0}, v = {0.0, 0.0};
    for (int32_t i = k; i > 0; i = model->planar[i].parent) {
        const kt_planar_link *link = &model->planar[i];
        const size_t row = (size_t)link->v, ik = column * n + row, ki = row * n + column;
        const double sign = (link->revolute ? link->sign : 1.0) * (own->revolute ? own->sign : 1.0);
        pair p;
        if (own->revolute)
            p = link->revolute ? revolutes(x, r, v, links[i].a) : slides_before(x, links[i].e, &motion[i]);
        else
            p = link->revolute ? slides_after(x, r, v, links[i].a, &motion[k])
                               : slides(x, links[i].e, &motion[i], &motion[k]);
        by_q[ki] = sign * p.by_q[1];
        by_v[ki] = sign * p.by_v[1];
        by_q[ik] = sign * p.by_q[0];
        by_v[ik] = sign * p.by_v[0];
        mass[ik] = mass[ki] = sign * p.mass;
        r += links[i].offset;
        v += links[i].velocity;
    }
    mass[column * n + column] += model->armature[column];
}

void KT_KERNEL(kt_planar_derivative_inverse)(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                             const double *a, kt_derivative_work *w) {
    assert(kt_data_serve(model, data));
    const size_t bytes = model->n.v * model->n.v * sizeof(double);
    carried *links = (carried *)(void *)w->link;
    memset(w->dq, 0, bytes);
    memset(w->dv, 0, bytes);
    memset(w->dtau, 0, bytes);
    links[0] = (carried){.m = 0.0};
    kt_planar_gather(model, data, at->q);
    for (size_t p = 0; p < model->n.plane; p++)
        forward_pass(model, data, &model->plane[p], at, a, links);
    if (at->external)
        load(model, data->planar, at->external, links);
    for (int32_t k = (int32_t)model->n.planar - 1; k > 0; k--) {
        follow_path(model, data->planar, links, k, w);
        pass_on(&links[k], &links[model->planar[k].parent]);
    }
}
