/* The terms of the derivatives of each degree of freedom (dynamics_derivative.h): a forward pass and a backward pass.
 * */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba.h"
#include "dynamics/dof.h"
#include "dynamics/dynamics_derivative.h"

#include <assert.h>

/* ---- forward pass: nodes, and how their degrees of freedom move -------------------------------------------------- */

/* Appends a node with the next `count` degrees of freedom. The tree has branches if a parent is not the node before. */
static inline kt_derivative_node *new_derivative_node(kt_derivative_work *w, int32_t link, int32_t parent,
                                                      int32_t count) {
    kt_derivative_node *node = &w->node[w->nodes];
    *node = (kt_derivative_node){.link = link, .parent = parent, .first = w->dofs, .count = count};
    w->dofs += count;
    if (parent && parent != (int32_t)w->nodes - 1)
        w->branched = w->node[parent].branches = true;
    w->nodes++;
    return node;
}

/* The nodes of one link and their degrees of freedom. */
static inline void set_nodes(const kt_model *model, const kt_data *data, size_t i, const double *v, const double *a,
                             kt_carried *c, int32_t parent, kt_derivative_work *w) {
    const kt_link *link = &model->link[i];
    kt_dof_motions_set(link, &data->motion[link->parent], &data->motion[i], v, a, c, &w->motion[w->dofs]);
    const int translations = kt_link_first_node(link);
    if (translations) {
        new_derivative_node(w, (int32_t)i, parent, translations);
        parent = (int32_t)w->nodes - 1;
    }
    new_derivative_node(w, (int32_t)i, parent, kt_link_dofs(link) - translations);
}

/* The inertia, F and 2B of the link alone. */
static inline void apply_link_inertia(const kt_link *link, const kt_link_motion *m, kt_v4 linear,
                                      kt_derivative_link *x) {
    const kt_v4 none = kt_v4_splat(0.0), w = m->omega;
    kt_articulated *r = &x->inertia;
    kt_articulated_rigid(link, m, &(kt_link_origin){.moment = none, .force = none},
                         r); /* moment = w x J w, force = w x (w x h) */
    const kt_v4 h = kt_v4_apply_to(m->axes, link->moment), mass = kt_v4_splat(link->mass);
    r->moment += kt_v4_apply(r->j, m->alpha) + kt_v4_cross(h, linear);
    r->force += mass * linear + kt_v4_cross(m->alpha, h);
    const kt_v4 p = mass * x->velocity + kt_v4_cross(w, h);
    const kt_v4 half = kt_v4_splat(0.5 * (r->j[0][0] + r->j[1][1] + r->j[2][2]));
    kt_v4 t[3];
    for (int k = 0; k < 3; k++) {
        kt_v4 e = -r->j[k];
        e[k] += half[k];
        t[k] = x->velocity * kt_v4_splat(h[k]) + kt_v4_cross(w, e);
    }
    const double trace = t[0][0] + t[1][1] + t[2][2];
    const kt_v4 two = kt_v4_splat(2.0);
    for (int k = 0; k < 3; k++) {
        kt_v4 n = -t[k], unit = none;
        n[k] += trace;
        unit[k] = 1.0;
        x->bn[k] = two * n;
        x->bf[k] = two * kt_v4_cross(unit, p);
        x->xn[k] = x->xf[k] = none;
    }
}

/* The motion of each link, expressed about the origin and at the velocity of the tree's first link (Galilei), and its
 * nodes and own terms. `gravity` is subtracted from the accelerations in data->motion; it is zero if these contain
 * -gravity already (kt_motion_kept). */
static inline void derivative_forward_pass(const kt_model *model, const kt_data *data, const double *v, const double *a,
                                           kt_v4 gravity, kt_derivative_work *w) {
    const kt_v4 none = kt_v4_splat(0.0);
    w->nodes = 1;
    w->dofs = 0;
    w->branched = false;
    for (size_t lane = 0; lane < KT_LANES && model->n.v > 0; lane++) /* without degrees of freedom there is no batch */
        w->batch[kt_batches(&model->n) - 1].node[lane] = 0;
    w->node[0] = (kt_derivative_node){0};
    kt_derivative_link ground = {.origin = none};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &data->motion[i], *up = &data->motion[link->parent];
        kt_derivative_link *x = &w->link[i];
        const kt_derivative_link *px = link->parent ? &w->link[link->parent] : &ground;
        kt_v4 angular, linear;
        kt_joint_twist(link, up, m, v, &angular, &linear);
        if (link->parent == 0) { /* expressed about the origin of this link */
            ground.origin = -m->offset;
            ground.velocity = -linear;
            ground.linear = -model->gravity;
        }
        kt_carried c = {.omega = up->omega,
                        .velocity = px->velocity + kt_v4_cross(up->omega, m->offset),
                        .alpha = up->alpha,
                        .linear = px->linear + kt_v4_cross(up->alpha, m->offset)};
        const kt_v4 acceleration = m->linear - gravity;
        x->origin = px->origin + m->offset;
        x->velocity = c.velocity + linear;
        x->linear = acceleration - kt_v4_cross(m->omega, x->velocity);
        apply_link_inertia(link, m, acceleration, x);
        set_nodes(model, data, i, v, a, &c, px == &ground ? 0 : w->link[link->parent].last, w);
        x->last = (int32_t)w->nodes - 1;
    }
}

/* Subtracts external wrenches from F, and sets X. */
static inline void load_external_wrenches(const kt_model *model, const kt_data *data, const kt_wrench *external,
                                          kt_derivative_work *w) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if (body->link == 0)
            continue;
        kt_derivative_link *x = &w->link[body->link];
        const kt_v4 c = kt_v4_apply(data->motion[body->link].axes, kt_v4_from(body->in_link.position));
        const kt_v4 n = kt_v4_from(external[b].moment), f = kt_v4_from(external[b].force);
        x->inertia.moment -= n + kt_v4_cross(c, f);
        x->inertia.force -= f;
        for (int k = 0; k < 3; k++) {
            kt_v4 unit = kt_v4_splat(0.0);
            unit[k] = 1.0;
            const kt_v4 turned = kt_v4_cross(unit, f);
            x->xn[k] += kt_v4_cross(unit, n) + kt_v4_cross(c, turned);
            x->xf[k] += turned;
        }
    }
}

/* ---- backward pass: rows, columns, and what is passed to the parent ---------------------------------------------- */

KT_INLINE void store6(double *to, kt_v4 a, kt_v4 b) {
    for (int k = 0; k < 3; k++) {
        to[k] = a[k];
        to[3 + k] = b[k];
    }
}

KT_INLINE void store_lane6(kt_v8 *to, size_t lane, kt_v4 a, kt_v4 b) {
    for (int k = 0; k < 3; k++) {
        to[k][lane] = a[k];
        to[3 + k][lane] = b[k];
    }
}

/* The row of one degree of freedom; with `absorb`, the degree of freedom is projected out. */
static inline void set_row(const kt_dof_motion *m, double armature, bool absorb, bool loaded, kt_derivative_link *x,
                           kt_dof_row *row) {
    kt_articulated *r = &x->inertia;
    const kt_v4 s = m->s[0], l = m->s[1];
    const kt_v4 un = kt_articulated_moment(r, s, l), uf = kt_articulated_force(r, s, l);
    const double d = absorb ? 1.0 / (kt_v4_dot2(s, un, l, uf) + armature) : 1.0;
    const kt_v4 dd = kt_v4_splat(d), vn = un * dd, vf = uf * dd;
    double b[3], e[3];
    for (int k = 0; k < 3; k++) {
        b[k] = d * kt_v4_dot2(s, x->bn[k], l, x->bf[k]);
        e[k] = loaded ? d * kt_v4_dot2(s, x->xn[k], l, x->xf[k]) : 0.0;
    }
    if (absorb)
        kt_articulated_subtract_square(r, d, un, uf);
    for (int k = 0; k < 3 && absorb; k++) {
        x->bn[k] -= un * kt_v4_splat(b[k]);
        x->bf[k] -= uf * kt_v4_splat(b[k]);
        if (loaded) {
            x->xn[k] -= un * kt_v4_splat(e[k]);
            x->xf[k] -= uf * kt_v4_splat(e[k]);
        }
    }
    const kt_v4 p = x->origin;
    row->d = d;
    store6(row->s, s, l + kt_v4_cross(p, s));
    store6(row->u, vn + kt_v4_cross(p, vf), vf);
    memcpy(row->b, b, sizeof b);
    memcpy(row->x, e, sizeof e);
}

/* The column of one degree of freedom in its lane, about the tree's origin: f_k with q_k and with v_k, S, psi'', phi
 * and psi'. x has the sums of the node, from which set_row has projected its degrees of freedom in forward dynamics. */
static inline void set_dof_column(const kt_dof_motion *m, bool loaded, const kt_derivative_link *x, kt_dof_batch *to,
                                  size_t lane) {
    const kt_articulated *r = &x->inertia;
    const kt_v4 p = x->origin, s = m->s[0], l = m->s[1];
    kt_v4 qn = kt_articulated_moment(r, m->rate[0], m->rate[1]) + kt_v4_apply(x->bn, m->psi[0]);
    kt_v4 qf = kt_articulated_force(r, m->rate[0], m->rate[1]) + kt_v4_apply(x->bf, m->psi[0]);
    if (loaded) {
        qn += kt_v4_apply(x->xn, s);
        qf += kt_v4_apply(x->xf, s);
    }
    qn = qn + kt_v4_cross(s, r->moment) + kt_v4_cross(l, r->force);
    qf = qf + kt_v4_cross(s, r->force);
    const kt_v4 vn = kt_articulated_moment(r, m->phi[0], m->phi[1]) + kt_v4_apply(x->bn, s);
    const kt_v4 vf = kt_articulated_force(r, m->phi[0], m->phi[1]) + kt_v4_apply(x->bf, s);
    store_lane6(to->wrench[0], lane, qn + kt_v4_cross(p, qf), qf);
    store_lane6(to->wrench[1], lane, vn + kt_v4_cross(p, vf), vf);
    store_lane6(to->s, lane, s, l + kt_v4_cross(p, s));
    store_lane6(to->rate, lane, m->rate[0], m->rate[1] + kt_v4_cross(p, m->rate[0]));
    store_lane6(to->phi, lane, m->phi[0], m->phi[1] + kt_v4_cross(p, m->phi[0]));
    for (int k = 0; k < 3; k++)
        to->psi[k][lane] = m->psi[0][k];
}

/* Shifts to the parent's origin and adds to the parent. F^C is shifted separately, because no joint is projected out of
 * F^C. */
static inline void pass_on_to_parent(const kt_derivative_link *x, kt_v4 offset, bool loaded,
                                     kt_derivative_link *parent) {
    kt_articulated moved = x->inertia;
    kt_articulated_shift(&moved, offset);
    kt_articulated_add(&parent->inertia, &moved);
    for (int k = 0; k < 3; k++) {
        parent->bn[k] += x->bn[k] + kt_v4_cross(offset, x->bf[k]);
        parent->bf[k] += x->bf[k];
        if (loaded) {
            parent->xn[k] += x->xn[k] + kt_v4_cross(offset, x->xf[k]);
            parent->xf[k] += x->xf[k];
        }
    }
}

/* loaded: with external wrenches, without which X is zero. */
static inline void derivative_backward_pass(const kt_model *model, const kt_data *data, bool absorb, bool loaded,
                                            kt_derivative_work *w) {
    for (size_t n = w->nodes - 1; n > 0; n--) {
        const kt_derivative_node *node = &w->node[n], *parent = &w->node[node->parent];
        const kt_link *link = &model->link[node->link];
        kt_derivative_link *x = &w->link[node->link];
        const bool above = node->parent && w->node[node->parent].link == node->link; /* the rotations of a free link */
        for (int32_t k = node->count - 1; k >= 0; k--) {
            kt_dof_row *row = &w->row[node->first + k];
            row->node = (int32_t)n;
            row->before = k > 0 ? node->first + k - 1 : parent->first + parent->count - 1;
            row->v = link->v + k + (above ? 3 : 0);
            set_row(&w->motion[node->first + k], model->armature[row->v], absorb, loaded, x, row);
        }
        for (int32_t k = 0; k < node->count; k++) {
            const size_t f = (size_t)node->first + (size_t)k;
            w->batch[f / KT_LANES].node[f % KT_LANES] = (int64_t)n;
            set_dof_column(&w->motion[f], loaded, x, &w->batch[f / KT_LANES], f % KT_LANES);
        }
        if (!above && link->parent)
            pass_on_to_parent(x, data->motion[node->link].offset, loaded, &w->link[link->parent]);
    }
}

void KT_KERNEL(kt_derivative_terms)(const kt_model *model, kt_data *data, const double *v, const double *a,
                                    const kt_wrench *external, kt_motion_kept kept, bool absorb,
                                    kt_derivative_work *w) {
    assert(kt_data_serve(model, data));
    const kt_v4 gravity = kept == KT_MOTION_HEAVY ? kt_v4_splat(0.0) : model->gravity; /* HEAVY: a_0 = -gravity */
    derivative_forward_pass(model, data, v, a, gravity, w);
    if (external)
        load_external_wrenches(model, data, external, w);
    derivative_backward_pass(model, data, absorb, external != NULL, w);
}
