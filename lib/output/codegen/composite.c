/* Derivatives of inverse dynamics by composite bodies, as nodes.
 *
 * A joint carries a composite body: its link and all links beyond. A change of the joint's position turns and moves
 * this body as a whole. Seen from the body, the motion of the ground changes instead, and only its rates matter: an
 * angular velocity dw, an angular acceleration dal, and the acceleration da of the joint's origin. With velocities u
 * relative to this origin, the accelerations of particles change by
 *
 *   da + du x r + 2 dw x u        du = dal + w x dw,
 *
 * where r is the place of the particle and w the angular velocity of the joint's link. Integration over the mass gives
 *
 *   n = J du + h x da + K dw      K = tr(C) 1 - C     C = sum 2 u r' m
 *   f = m da + du x h + dw x p    p = sum 2 u m.
 *
 * (m, h, J, C, p) of all links beyond are added, as in the mass matrix. The shares of a link are
 *
 *   C = [w] (tr(J) 1 - 2 J)    p = 2 w x h.
 *
 * Let d be twice the velocity of the origin relative to the parent's origin, which is at -r. About the parent's origin,
 * C gains d (h + m r)' + p r', and p gains m d.
 *
 * A joint with the axis s turns: dw = w x s, du = U s, da = a x s for its position, dw = s, du = 2 w x s for its
 * velocity. A slider has da = U s, and da = 2 w x s. For a joint with quaternions, w, al and U are those of the parent,
 * in the axes of the link, and du = (w_p + w) x s for a velocity.
 *
 * The derivatives for joints nearer to the ground are entries of the wrench (n, f) on its way there. The wrench
 * includes the turn of the composite body's wrench. The derivatives for joints beyond follow from tau = s . (n, f) as a
 * function of (dw, du, da). The coefficients of this function (k, n, f) move to the ground, too:
 *
 *   n += r x f    k += d x f.
 *
 * The pair (n, f) is the column of the mass matrix.
 *
 * Sources: Carpentier & Mansard, Robotics: Science and Systems (2018). Singh, Russell & Wensing, IEEE Robotics and
 * Automation Letters 7 (2022). These authors differentiate spatial vectors, whereas this file uses accelerations of
 * points, as in recursion.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

/* A change of the motion of a joint's link. */
typedef struct composite_change {
    kt_op3 omega, u, linear;
} composite_change;

/* A wrench about the origin of a link, in its axes. */
typedef struct composite_wrench {
    kt_op3 n, f;
} composite_wrench;

/* A degree of freedom: its axis, the changes by its position and its velocity, and all that moves to the ground. */
typedef struct composite_dof {
    kt_op3 turn, shift; /* in the axes of the link */
    composite_change by_q, by_v;
    composite_wrench wrench_by_q, wrench_by_v, column;
    kt_op3 k;
} composite_dof;

/* The quantities of a composite body that the mass matrix does not need. */
typedef struct composite_flow {
    kt_op33 c;
    kt_op3 p;
    kt_op3 speed; /* d: twice the velocity of the origin relative to that of the parent, in the parent's axes */
} composite_flow;

/* All that the recursion has. */
typedef struct composite_tree {
    kt_code_tree *tree;
    kt_code_moving *moving; /* of each link; force and moment are those of the composite body */
    kt_code_link *body;     /* of each link: what it carries */
    composite_flow *flow;
    composite_dof *dof; /* of each coordinate */
} composite_tree;

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* The terms of a link alone, with its inertia J, angular velocity w and first moment h = m c:
 *     C = w x (tr(J) 1 - 2 J)   by columns,     p = w x 2 h */
static void start_flow(kt_graph *g, const kt_code_link *l, kt_op3 omega, composite_flow *flow) {
    const kt_op *j = l->inertia.x;
    const kt_op trace = kt_op_add(g, kt_op_add(g, j[0], j[1]), j[2]);
    for (int k = 0; k < 3; k++) {
        kt_op3 column;
        for (int i = 0; i < 3; i++)
            column.x[i] = kt_op_scale(g, -2.0, j[kt_op6_index(i, k)]);
        column.x[k] = kt_op_add(g, trace, column.x[k]);
        column = kt_op3_cross(g, omega, column);
        for (int i = 0; i < 3; i++)
            flow->c.row[i].x[k] = column.x[i];
    }
    flow->p = kt_op3_cross(g, omega, kt_op3_scale(g, kt_op_number(g, 2.0), l->moment));
}

/* d, in the axes of the parent. */
static kt_op3 speed_of_origin(const composite_tree *t, int i) {
    kt_graph *g = t->tree->graph;
    const kt_code_moving *m = &t->moving[i], *p = &t->moving[t->body[i].parent];
    const kt_op two = kt_op_number(g, 2.0);
    kt_op3 spin, shift;
    kt_code_rates(t->tree, i, KT_OP_RATE, &spin, &shift);
    const kt_op3 along = kt_code_rest_up(g, &m->frame, kt_op3_scale(g, two, shift));
    return kt_op3_add(g, kt_op3_cross(g, p->omega, kt_op3_scale(g, two, m->frame.offset)), along);
}

/* Moves C and p of a composite body to its parent. */
static void give_flow(const composite_tree *t, int i) {
    kt_graph *g = t->tree->graph;
    const kt_code_frame *frame = &t->moving[i].frame;
    const kt_code_link *own = &t->body[i];
    composite_flow *flow = &t->flow[i], *up = &t->flow[own->parent];
    const kt_op3 r = frame->offset, d = flow->speed, p = kt_code_up(g, frame, flow->p);
    const kt_op3 moment = kt_code_up(g, frame, own->moment), h = kt_op3_add(g, moment, kt_op3_scale(g, own->mass, r));
    const kt_op33 at_rest = kt_code_matrix_to_rest(g, frame, &flow->c), c = kt_code_matrix_rest_up(g, frame, &at_rest);
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++) {
            const kt_op moved = kt_op_add_products(g, d.x[k], h.x[j], p.x[k], r.x[j]);
            up->c.row[k].x[j] = kt_op_add(g, up->c.row[k].x[j], kt_op_add(g, c.row[k].x[j], moved));
        }
    up->p = kt_op3_add(g, up->p, kt_op3_add(g, p, kt_op3_scale(g, own->mass, d)));
}

/* K x, or its transpose. */
static kt_op3 turn_flow(kt_graph *g, const composite_flow *flow, kt_op3 x, bool transposed) {
    const kt_op33 *c = &flow->c;
    kt_op33 k;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            k.row[i].x[j] = kt_op_negate(g, transposed ? c->row[j].x[i] : c->row[i].x[j]);
    for (int i = 0; i < 3; i++) { /* without the difference of the trace and the entry */
        const int m = (i + 1) % 3, n = (i + 2) % 3;
        k.row[i].x[i] = kt_op_add(g, c->row[m].x[m], c->row[n].x[n]);
    }
    return kt_op33_apply(g, &k, x);
}

/* ---- changes ----------------------------------------------------------------------------------------------------- */

/* The motion whose products a joint reads: the motion of its link or, with quaternions, of the parent. */
static kt_code_moving motion_before(const composite_tree *t, int i) {
    kt_graph *g = t->tree->graph;
    const kt_code_moving *own = &t->moving[i], *p = &t->moving[t->body[i].parent];
    kt_code_moving m = *own;
    if (kt_motion_facts_of(kt_code_motion(&t->body[i])).quaternions == 0)
        return m;
    m.omega = kt_code_down(g, &own->frame, p->omega);
    m.alpha = kt_code_down(g, &own->frame, p->alpha);
    kt_code_multiply_rates(g, &m);
    return m;
}

/* The axes of the degrees of freedom of a joint, and the changes by their positions and velocities. */
static void change_motion(const composite_tree *t, int i) {
    kt_graph *g = t->tree->graph;
    const kt_code_link *l = &t->body[i];
    const kt_code_moving *own = &t->moving[i], before = motion_before(t, i);
    for (int d = 0; d < kt_link_dofs(l->link); d++) {
        composite_dof *dof = &t->dof[l->link->v + d];
        const kt_code_dof which = kt_code_dof_of(l->link, d);
        const bool has_quaternion = which.is_of_three;
        kt_op3 unit = kt_op3_zero(g);
        unit.x[which.k] = kt_op_number(g, 1.0);
        dof->turn = which.turns ? unit : kt_op3_zero(g);
        dof->shift = which.turns      ? kt_op3_scale(g, l->pitch, unit)
                     : has_quaternion ? kt_code_from_rest(g, &own->frame, unit)
                                      : unit;
        const kt_op3 moved = kt_op33_apply(g, &before.u, dof->shift);
        const kt_op3 twice = kt_op3_scale(g, kt_op_number(g, 2.0), before.omega);
        dof->by_q.omega = kt_op3_cross(g, before.omega, dof->turn);
        dof->by_q.u = kt_op33_apply(g, &before.u, dof->turn);
        dof->by_q.linear = kt_op3_add(g, kt_op3_cross(g, own->linear, dof->turn), moved);
        dof->by_v.omega = dof->turn;
        dof->by_v.u = kt_op3_cross(g, has_quaternion ? kt_op3_add(g, before.omega, own->omega) : twice, dof->turn);
        dof->by_v.linear = kt_op3_cross(g, twice, dof->shift);
    }
}

/* The wrench that a change of the motion takes. */
static composite_wrench respond_composite(const composite_tree *t, int i, const composite_change *c) {
    kt_graph *g = t->tree->graph;
    const kt_code_link *b = &t->body[i];
    const kt_op3 h_a = kt_op3_cross(g, b->moment, c->linear), k_w = turn_flow(g, &t->flow[i], c->omega, false);
    const kt_op3 n = kt_op3_add(g, kt_op6_apply(g, &b->inertia, c->u), h_a);
    const kt_op3 u_h = kt_op3_cross(g, c->u, b->moment), w_p = kt_op3_cross(g, c->omega, t->flow[i].p);
    const kt_op3 f = kt_op3_add(g, kt_op3_scale(g, b->mass, c->linear), u_h);
    const kt_op3 moment = kt_op3_add(g, n, k_w);
    return (composite_wrench){moment, kt_op3_add(g, f, w_p)};
}

/* tau = s . (n, f) of a degree of freedom, as a function of a change of the motion. */
static void read_composite(const composite_tree *t, int i, composite_dof *dof) {
    kt_graph *g = t->tree->graph;
    const kt_code_link *b = &t->body[i];
    const kt_op3 h_s = kt_op3_cross(g, b->moment, dof->shift), s_h = kt_op3_cross(g, dof->turn, b->moment);
    const kt_op3 p_s = kt_op3_cross(g, t->flow[i].p, dof->shift);
    dof->column.n = kt_op3_add(g, kt_op6_apply(g, &b->inertia, dof->turn), h_s);
    dof->column.f = kt_op3_add(g, kt_op3_scale(g, b->mass, dof->shift), s_h);
    dof->k = kt_op3_add(g, turn_flow(g, &t->flow[i], dof->turn, true), p_s);
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

/* The work of a wrench about a link's origin on a degree of freedom of its joint. */
static kt_op work_on_dof(kt_graph *g, const composite_dof *dof, const composite_wrench *w) {
    return kt_op3_add_dots(g, dof->turn, w->n, dof->shift, w->f);
}

/* Begins the columns of a joint, with its own entries. */
static void begin_derivatives(const composite_tree *t, int i, kt_op *by_q, kt_op *by_v) {
    kt_graph *g = t->tree->graph;
    const kt_link *link = t->body[i].link;
    const size_t nv = t->tree->model->n.v, v = (size_t)link->v, count = (size_t)kt_link_dofs(link);
    const composite_wrench own = {t->moving[i].moment, t->moving[i].force};
    for (size_t c = v; c < v + count; c++) {
        composite_dof *dof = &t->dof[c];
        composite_wrench *w = &dof->wrench_by_q;
        dof->wrench_by_v = respond_composite(t, i, &dof->by_v);
        *w = respond_composite(t, i, &dof->by_q);
        w->f = kt_op3_add(g, w->f, kt_op3_cross(g, dof->turn, own.f));
        for (size_t row = v; row < v + count; row++) { /* the axes of rotations turn with the link */
            by_q[c * nv + row] = work_on_dof(g, &t->dof[row], w);
            by_v[c * nv + row] = work_on_dof(g, &t->dof[row], &dof->wrench_by_v);
        }
        const kt_op3 s_f = kt_op3_cross(g, dof->shift, own.f);
        w->n = kt_op3_add(g, w->n, kt_op3_add(g, kt_op3_cross(g, dof->turn, own.n), s_f));
        read_composite(t, i, dof);
    }
}

/* Moves a wrench to the parent of a link. */
static void move_wrench(kt_graph *g, const kt_code_frame *frame, composite_wrench *w) {
    w->f = kt_code_up(g, frame, w->f);
    w->n = kt_code_up(g, frame, w->n);
    w->n = kt_op3_add(g, w->n, kt_op3_cross(g, frame->offset, w->f));
}

/* Moves a column from link i to its parent. */
static void move_derivatives(const composite_tree *t, int i, composite_dof *dof) {
    kt_graph *g = t->tree->graph;
    const kt_code_frame *frame = &t->moving[i].frame;
    move_wrench(g, frame, &dof->wrench_by_q);
    move_wrench(g, frame, &dof->wrench_by_v);
    move_wrench(g, frame, &dof->column);
    dof->k = kt_code_up(g, frame, dof->k);
    dof->k = kt_op3_add(g, dof->k, kt_op3_cross(g, t->flow[i].speed, dof->column.f));
}

/* The change of a joint's force by a change of the motion of a link that carries it. */
static kt_op force_of_change(kt_graph *g, const composite_dof *dof, const composite_change *c) {
    const kt_op other = kt_op3_add_dots(g, dof->column.n, c->u, dof->column.f, c->linear);
    return kt_op_add(g, kt_op3_dot(g, dof->k, c->omega), other);
}

/* The entries of column c for the joint of a link that carries column c, on both sides of the diagonal. */
static void fill_derivatives(const composite_tree *t, int link, size_t c, kt_op *by_q, kt_op *by_v) {
    kt_graph *g = t->tree->graph;
    const kt_link *l = t->body[link].link;
    const size_t nv = t->tree->model->n.v, count = (size_t)kt_link_dofs(l);
    const composite_dof *own = &t->dof[c];
    for (size_t row = (size_t)l->v; row < (size_t)l->v + count; row++) {
        const composite_dof *dof = &t->dof[row];
        by_q[c * nv + row] = work_on_dof(g, dof, &own->wrench_by_q);
        by_v[c * nv + row] = work_on_dof(g, dof, &own->wrench_by_v);
        by_q[row * nv + c] = force_of_change(g, own, &dof->by_q);
        by_v[row * nv + c] = force_of_change(g, own, &dof->by_v);
    }
}

/* Computes the composite bodies and their columns, the last link first. */
static void derive_composites(const composite_tree *t, kt_op *by_q, kt_op *by_v) {
    kt_graph *g = t->tree->graph;
    for (int i = t->tree->link_count - 1; i > 0 && !g->failed; i--) {
        const kt_link *link = t->body[i].link;
        const char *name = t->body[i].name;
        const size_t v = (size_t)link->v, end = v + (size_t)kt_link_dofs(link);
        kt_graph_section(g, "%s: derivatives of its own force, by the motion of all that it carries", name);
        begin_derivatives(t, i, by_q, by_v);
        for (int at = i, up = t->body[i].parent; up > 0; at = up, up = t->body[up].parent) {
            kt_graph_section(g, "%s: derivatives with respect to %s", name, t->body[up].name);
            for (size_t c = v; c < end; c++) {
                move_derivatives(t, at, &t->dof[c]);
                fill_derivatives(t, up, c, by_q, by_v);
            }
        }
        kt_graph_section(g, "%s: the parent carries C and p", name);
        if (t->body[i].parent > 0)
            give_flow(t, i);
    }
}

void kt_code_composite_derivatives(kt_code_tree *tree, kt_op *tau, kt_op *by_q, kt_op *by_v) {
    kt_graph *g = tree->graph;
    const size_t links = (size_t)tree->link_count, nv = tree->model->n.v;
    composite_tree t = {tree, kt_graph_take(g, links, sizeof *t.moving), kt_graph_take(g, links, sizeof *t.body),
                        kt_graph_take(g, links, sizeof *t.flow), kt_graph_take(g, nv + 1, sizeof *t.dof)};
    kt_code_frame *frame = kt_graph_take(g, links, sizeof *frame);
    if (g->failed)
        return;
    for (size_t k = 0; k < nv * nv; k++)
        by_q[k] = by_v[k] = kt_op_number(g, 0.0);
    kt_code_inverse_links(tree, true, t.moving, tau);
    kt_code_compose_bodies(tree, frame, t.body);
    for (int i = 1; i < tree->link_count && !g->failed; i++) {
        kt_graph_section(g, "%s: C = [w] (tr(J) 1 - 2 J),  p = 2 w x h,  and the speed of its origin", t.body[i].name);
        start_flow(g, &tree->link[i], t.moving[i].omega, &t.flow[i]);
        t.flow[i].speed = speed_of_origin(&t, i);
        change_motion(&t, i);
    }
    if (!g->failed)
        derive_composites(&t, by_q, by_v);
}
