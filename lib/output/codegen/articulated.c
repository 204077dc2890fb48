/* Forward dynamics by articulated bodies, as nodes.
 *
 * A link takes the wrench n = J al + H a + n0, f = H' al + M a + f0, when all bodies that it carries move freely. A
 * degree of freedom with the axis s is eliminated with
 *
 *   U = (J s_w + H s_v, H' s_w + M s_v),   D = s . U + armature,   y = tau - s . (n0, f0)
 *   J -= U_n U_n' / D ...,   (n0, f0) += U y / D,   qdd = (y - U . (al, a)) / D
 *
 * Several degrees of freedom are eliminated one after the other, the last degree of freedom first: rotations in the
 * axes of the link, then translations in its axes at rest. Without armature, the row of an eliminated rotation or
 * translation is zero.
 *
 * Source: Featherstone, Rigid Body Dynamics Algorithms (2008), 7.3.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

/* An articulated inertia with its bias wrench. */
typedef struct code_articulated {
    kt_op6 j, m;
    kt_op33 h;
    kt_op3 n, f;
} code_articulated;

/* An eliminated degree of freedom: V = U / D, and y / D. */
typedef struct code_pivot {
    kt_op3 n, f;
    kt_op y;
} code_pivot;

/* A link on its way through the passes. */
typedef struct code_body {
    kt_code_moving moving;
    code_articulated own;
    code_pivot pivot[KT_DOF_MAX];
} code_body;

/* ---- without accelerations of joints ----------------------------------------------------------------------------- */

/* Begins a link with its own inertia, and the wrench that it requires without accelerations of joints. */
static void start_body(kt_code_tree *tree, int i, const kt_code_moving *moving, code_body *b) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    b->moving = *moving;
    b->own.n = moving->moment;
    b->own.f = moving->force;
    b->own.j = l->inertia;
    b->own.m = b->own.j;
    for (int k = 0; k < 6; k++)
        b->own.m.x[k] = k < 3 ? l->mass : kt_op_number(g, 0.0);
    for (int k = 0; k < 3; k++) { /* [h] */
        kt_op3 unit = kt_op3_zero(g);
        unit.x[k] = kt_op_number(g, 1.0);
        b->own.h.row[k] = kt_op3_cross(g, unit, l->moment);
    }
}

/* ---- elimination ------------------------------------------------------------------------------------------------- */

static kt_op3 column_of(const kt_op33 *h, int k) { return (kt_op3){{h->row[0].x[k], h->row[1].x[k], h->row[2].x[k]}}; }
static kt_op3 column_of6(const kt_op6 *j, int k) {
    return (kt_op3){{kt_op6_at(j, 0, k), kt_op6_at(j, 1, k), kt_op6_at(j, 2, k)}};
}

/* Subtracts U V'. zero: the row of J (turns) or M that vanishes exactly; -1: none. */
static void subtract_products(kt_graph *g, code_articulated *x, const kt_op3 u[2], const kt_op3 v[2], int zero,
                              bool turns) {
    const kt_op none = kt_op_number(g, 0.0);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            const int at = kt_op6_index(i, k);
            if (k >= i) {
                x->j.x[at] = kt_op_subtract(g, x->j.x[at], kt_op_multiply(g, u[0].x[i], v[0].x[k]));
                x->m.x[at] = kt_op_subtract(g, x->m.x[at], kt_op_multiply(g, u[1].x[i], v[1].x[k]));
            }
            x->h.row[i].x[k] = kt_op_subtract(g, x->h.row[i].x[k], kt_op_multiply(g, u[0].x[i], v[1].x[k]));
        }
    for (int k = 0; k < 3 && zero >= 0; k++) {
        if (turns)
            x->j.x[kt_op6_index(zero, k)] = x->h.row[zero].x[k] = none;
        else
            x->m.x[kt_op6_index(zero, k)] = x->h.row[k].x[zero] = none;
    }
}

/* Eliminates one degree of freedom: a rotation about axis k, with the pitch of a screw, or a translation along it. */
static void eliminate_dof(kt_code_tree *tree, const kt_code_link *l, int d, int k, bool turns, kt_op least_of,
                          code_body *b, kt_code_guard *guard) {
    code_articulated *x = &b->own;
    code_pivot *pivot = &b->pivot[d];
    kt_graph *g = tree->graph;
    const int v = l->link->v + d;
    const kt_op armature = l->armature[d], pitch = turns ? l->pitch : kt_op_number(g, 0.0);
    kt_op3 u[2] = {turns ? column_of6(&x->j, k) : column_of(&x->h, k), turns ? x->h.row[k] : column_of6(&x->m, k)};
    if (turns) {
        u[0] = kt_op3_add(g, u[0], kt_op3_scale(g, pitch, column_of(&x->h, k)));
        u[1] = kt_op3_add(g, u[1], kt_op3_scale(g, pitch, column_of6(&x->m, k)));
    }
    const kt_op own = turns ? kt_op_add(g, u[0].x[k], kt_op_multiply(g, pitch, u[1].x[k])) : u[1].x[k];
    const kt_op wrench = turns ? kt_op_add(g, x->n.x[k], kt_op_multiply(g, pitch, x->f.x[k])) : x->f.x[k];
    const kt_op inertia = kt_op_add(g, own, armature);
    const kt_op inverse = kt_op_divide(g, kt_op_number(g, 1.0), inertia);
    const kt_op y = kt_op_subtract(g, kt_code_given_force(tree, v), wrench);
    const bool is_plain = kt_op_is(g, armature, 0.0) && kt_op_is(g, pitch, 0.0);
    guard[v] = (kt_code_guard){.pivot = inertia, .limit = least_of, .body = l->link->body};
    kt_op_name(g, inertia, "D%d", v);
    kt_op_name(g, inverse, "E%d", v);
    pivot->n = kt_op3_scale(g, inverse, u[0]);
    pivot->f = kt_op3_scale(g, inverse, u[1]);
    pivot->y = kt_op_multiply(g, y, inverse);
    if (is_plain) /* exactly one */
        *(turns ? &pivot->n.x[k] : &pivot->f.x[k]) = kt_op_number(g, 1.0);
    subtract_products(g, x, u, (kt_op3[2]){pivot->n, pivot->f}, is_plain ? k : -1, turns);
    x->n = kt_op3_add(g, x->n, kt_op3_scale(g, y, pivot->n));
    x->f = kt_op3_add(g, x->f, kt_op3_scale(g, y, pivot->f));
}

/* Eliminates the degrees of freedom of one kind, the last first. */
static void eliminate_kind(kt_code_tree *tree, int i, bool turns, code_body *b, kt_code_guard *guard) {
    const kt_code_link *l = &tree->link[i];
    const kt_op size = turns ? l->size : l->carried;
    const kt_op6 before = turns ? b->own.j : b->own.m;
    for (int d = kt_link_dofs(l->link) - 1; d >= 0; d--) {
        const kt_code_dof dof = kt_code_dof_of(l->link, d);
        if (dof.turns != turns)
            continue;
        const kt_op all = dof.is_of_three ? kt_op_add(tree->graph, size, kt_op6_at(&before, dof.k, dof.k)) : size;
        eliminate_dof(tree, l, d, dof.k, turns, all, b, guard);
    }
}

/* ---- to the parent ----------------------------------------------------------------------------------------------- */

/* Moves the origin by -r: with a = a' + al x r, H' = H + [r] M and J' = J - H [r] + [r] H' - [r] M [r]. */
static void shift_articulated(kt_graph *g, code_articulated *x, kt_op3 r) {
    kt_op33 half, mean;
    const kt_op3 halved = kt_op3_scale(g, kt_op_number(g, 0.5), r);
    for (int k = 0; k < 3; k++) { /* columns of [r] M / 2 */
        const kt_op3 column = kt_op3_cross(g, halved, column_of6(&x->m, k));
        for (int i = 0; i < 3; i++)
            half.row[i].x[k] = column.x[i];
    }
    for (int i = 0; i < 3; i++)
        mean.row[i] = kt_op3_add(g, x->h.row[i], half.row[i]);
    kt_op33 moved; /* - mean [r], row by row */
    for (int i = 0; i < 3; i++)
        moved.row[i] = kt_op3_cross(g, r, mean.row[i]);
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++) {
            const int at = kt_op6_index(i, k);
            x->j.x[at] = kt_op_add(g, x->j.x[at], kt_op_add(g, moved.row[i].x[k], moved.row[k].x[i]));
        }
    for (int i = 0; i < 3; i++)
        x->h.row[i] = kt_op3_add(g, mean.row[i], half.row[i]);
    x->n = kt_op3_add(g, x->n, kt_op3_cross(g, r, x->f));
}

static void rotate_articulated(kt_graph *g, const kt_code_frame *f, bool to_rest, code_articulated *x) {
    x->j = to_rest ? kt_code_inertia_to_rest(g, f, &x->j) : kt_code_inertia_rest_up(g, f, &x->j);
    x->m = to_rest ? kt_code_inertia_to_rest(g, f, &x->m) : kt_code_inertia_rest_up(g, f, &x->m);
    x->h = to_rest ? kt_code_matrix_to_rest(g, f, &x->h) : kt_code_matrix_rest_up(g, f, &x->h);
    x->n = to_rest ? kt_code_to_rest(g, f, x->n) : kt_code_rest_up(g, f, x->n);
    x->f = to_rest ? kt_code_to_rest(g, f, x->f) : kt_code_rest_up(g, f, x->f);
}

/* Writes the code that eliminates the joint of a link, and adds the articulated inertia and wrench to the parent, in
 * its axes and about its origin. */
static void give_to_parent(kt_code_tree *tree, int i, code_body *all, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_code_frame *frame = &all[i].moving.frame;
    code_articulated *x = &all[i].own, *p = &all[l->parent].own;
    kt_graph_section(g, "%s: U = A s,  D = s . U + armature,  A -= U U' / D,  wrench += U y / D", l->name);
    eliminate_kind(tree, i, true, &all[i], guard);
    if (kt_link_lengths(l->link) == 0 && l->parent == 0)
        return;
    kt_graph_section(g, "%s: the same in the axes of the parent, about its origin", l->name);
    rotate_articulated(g, frame, true, x);
    eliminate_kind(tree, i, false, &all[i], guard);
    if (l->parent == 0)
        return;
    rotate_articulated(g, frame, false, x);
    shift_articulated(g, x, frame->offset);
    p->j = kt_op6_add(g, &p->j, &x->j);
    p->m = kt_op6_add(g, &p->m, &x->m);
    for (int k = 0; k < 3; k++)
        p->h.row[k] = kt_op3_add(g, p->h.row[k], x->h.row[k]);
    p->n = kt_op3_add(g, p->n, x->n);
    p->f = kt_op3_add(g, p->f, x->f);
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

/* Computes the accelerations of one kind, the first first. The accelerations change the motion of the link. */
static void respond_kind(kt_code_tree *tree, int i, bool turns, const code_body *b, kt_op3 *alpha, kt_op3 *linear,
                         kt_op *a) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    for (int d = 0; d < kt_link_dofs(l->link); d++) {
        const code_pivot *pivot = &b->pivot[d];
        const kt_code_dof dof = kt_code_dof_of(l->link, d);
        const int k = dof.k;
        if (dof.turns != turns)
            continue;
        kt_op3 n = pivot->n, f = pivot->f;
        kt_op *own = turns ? &alpha->x[k] : &linear->x[k];
        kt_op *coefficient = turns ? &n.x[k] : &f.x[k];
        const bool is_plain = kt_op_is(g, *coefficient, 1.0);
        if (is_plain) /* own + qdd = y / D - the other products */
            *coefficient = kt_op_number(g, 0.0);
        const int x = (k + 1) % 3, y = (k + 2) % 3;
        const kt_op along = kt_op_add_products(g, n.x[k], alpha->x[k], f.x[k], linear->x[k]);
        const kt_op turned = kt_op_add_products(g, n.x[x], alpha->x[x], n.x[y], alpha->x[y]);
        const kt_op moved = kt_op_add_products(g, f.x[x], linear->x[x], f.x[y], linear->x[y]);
        const kt_op early = kt_op_subtract(g, kt_op_subtract(g, pivot->y, along), turned);
        const kt_op rest = kt_op_subtract(g, early, moved); /* the last to be known: two rotations make them */
        a[l->link->v + d] = is_plain ? kt_op_subtract(g, rest, *own) : rest;
        *own = is_plain ? rest : kt_op_add(g, *own, rest);
        if (turns)
            linear->x[k] = kt_op_add(g, linear->x[k], kt_op_multiply(g, l->pitch, a[l->link->v + d]));
    }
}

/* Writes the code for the accelerations of a link, from those of its parent. */
static void respond_body(kt_code_tree *tree, int i, code_body *all, kt_op *a) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_code_moving *p = &all[l->parent].moving;
    kt_code_moving *m = &all[i].moving;
    kt_graph_section(g, "%s: acceleration (y - U . (al, a)) / D; al, a: besides those above", l->name);
    const kt_op3 point = kt_op3_add(g, p->linear, kt_op3_cross(g, p->alpha, m->frame.offset));
    kt_op3 linear = kt_code_rest_down(g, &m->frame, point);
    kt_op3 alpha = kt_code_rest_down(g, &m->frame, p->alpha);
    respond_kind(tree, i, false, &all[i], &alpha, &linear, a);
    m->linear = kt_code_from_rest(g, &m->frame, linear);
    m->alpha = kt_code_from_rest(g, &m->frame, alpha);
    respond_kind(tree, i, true, &all[i], &m->alpha, &m->linear, a);
    kt_op3_name(g, m->alpha, "dal", i);
    kt_op3_name(g, m->linear, "da", i);
}

void kt_code_forward_articulated(kt_code_tree *tree, kt_op *a, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    code_body *all = kt_graph_take(g, (size_t)tree->link_count, sizeof *all);
    kt_code_moving *moving = kt_graph_take(g, (size_t)tree->link_count, sizeof *moving);
    if (g->failed)
        return;
    kt_code_move_links(tree, false, moving);
    for (int i = 0; i < tree->link_count; i++)
        start_body(tree, i, &moving[i], &all[i]);
    all[0].moving.alpha = all[0].moving.linear = kt_op3_zero(g); /* it has its acceleration already */
    kt_graph_pass(g);
    for (int i = tree->link_count - 1; i > 0; i--) {
        kt_graph_step(g);
        give_to_parent(tree, i, all, guard);
    }
    kt_graph_pass(g);
    for (int i = 1; i < tree->link_count; i++) {
        kt_graph_step(g);
        respond_body(tree, i, all, a);
    }
    kt_graph_pass(g);
}
