/* Forward dynamics of trees that move in planes, as nodes: the recursion of dynamics/aba_planar.h.
 *
 * All vectors have the components along the axes e_1 and e_2 of the plane; the reference point is the origin of the
 * link. p is the offset r of the link, rotated by a right angle. A link takes the moment and force
 *
 *   n = J al + h . a + n_b,   f = h al + M a + f_b,   a = a_p + al_p p + c
 *
 * A degree of freedom with U = (U_n, U_f), D and y = tau - S . (n_b, f_b) - U_f . c is eliminated. The remaining
 * inertia and bias move to the parent's origin. With V = U_n + p . U_f,
 *
 *   J' = (J + 2 p . h + p . M p) - V^2 / D     M' = M - U_f U_f' / D     h' = h + M p - U_f V / D
 *   f_b' = f_b + M c + U_f y / D               n_b' = n_b + h . c + U_n y / D + p . f_b'
 *
 * A revolute joint without armature has U = (J, h) and D = J, and leaves J' = p . M p - (p . h)^2 / J,  h' = M' p and
 * n_b' = tau + p . f_b'. Each link waits for the division by the D of the next link. All but the last product and
 * difference of J' proceed meanwhile. The recursion in the axes of the links (articulated.c) would rotate M in between.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

typedef struct kt_op2 {
    kt_op x[2];
} kt_op2;

/* A link on its way through the passes. */
typedef struct code_flat {
    kt_op33 axes;    /* at q = 0, in the basis of the plane */
    kt_op2 rotation; /* cosine and sine of its angle relative to q = 0 */
    kt_op2 offset, along, bias;
    kt_op omega;
    kt_op j, xx, xy, yy, moment; /* its inertia and bias: J, M, n_b; then h, f_b */
    kt_op2 h, force;
    kt_op free, gain; /* qdd = free - gain al_p - slope . a_p */
    kt_op2 slope;
    kt_op alpha;
    kt_op2 linear;
} code_flat;

bool kt_code_is_planar(const kt_model *model) { return model->n.plane > 0 && model->n.spatial == 1; }

/* ---- vectors of the plane ---------------------------------------------------------------------------------------- */

/* The first component is made first: C does not order the values of an initialiser, which number the nodes. */

static kt_op2 flat_add(kt_graph *g, kt_op2 a, kt_op2 b) {
    const kt_op first = kt_op_add(g, a.x[0], b.x[0]);
    return (kt_op2){{first, kt_op_add(g, a.x[1], b.x[1])}};
}

static kt_op2 flat_scale(kt_graph *g, kt_op s, kt_op2 a) {
    const kt_op first = kt_op_multiply(g, s, a.x[0]);
    return (kt_op2){{first, kt_op_multiply(g, s, a.x[1])}};
}

static kt_op flat_dot(kt_graph *g, kt_op2 a, kt_op2 b) { return kt_op_add_products(g, a.x[0], b.x[0], a.x[1], b.x[1]); }

/* Rotated by a right angle. */
static kt_op2 flat_across(kt_graph *g, kt_op2 a) { return (kt_op2){{kt_op_negate(g, a.x[1]), a.x[0]}}; }

/* The vector u, given at q = 0, of a link with the rotation e. */
static kt_op2 flat_turn(kt_graph *g, kt_op2 e, kt_op2 u) {
    const kt_op2 across = flat_scale(g, u.x[1], flat_across(g, e));
    return flat_add(g, flat_scale(g, u.x[0], e), across);
}

static kt_op2 flat_of(kt_graph *g, const kt_op33 *axes, kt_op3 u) {
    const kt_op3 all = kt_op33_apply(g, axes, u);
    return (kt_op2){{all.x[0], all.x[1]}};
}

/* M u */
static kt_op2 flat_apply(kt_graph *g, const code_flat *x, kt_op2 u) {
    const kt_op first = kt_op_add_products(g, x->xx, u.x[0], x->xy, u.x[1]);
    return (kt_op2){{first, kt_op_add_products(g, x->xy, u.x[0], x->yy, u.x[1])}};
}

/* M -= u v' */
static void flat_reduce(kt_graph *g, code_flat *x, kt_op2 u, kt_op2 v) {
    x->xx = kt_op_subtract(g, x->xx, kt_op_multiply(g, u.x[0], v.x[0]));
    x->xy = kt_op_subtract(g, x->xy, kt_op_multiply(g, u.x[0], v.x[1]));
    x->yy = kt_op_subtract(g, x->yy, kt_op_multiply(g, u.x[1], v.x[1]));
}

/* ---- velocities -------------------------------------------------------------------------------------------------- */

/* The ground as the parent of a link of this plane. */
static code_flat ground_of_plane(kt_code_tree *tree, const kt_plane *plane) {
    kt_graph *g = tree->graph;
    const kt_op zero = kt_op_number(g, 0.0);
    const kt_const_mat3 *b = &plane->basis;
    const kt_mat3 across = {
        .x = {b->x.x, b->y.x, b->z.x}, .y = {b->x.y, b->y.y, b->z.y}, .z = {b->x.z, b->y.z, b->z.z}};
    bool unused;
    code_flat ground = {.rotation = {{kt_op_number(g, 1.0), zero}}, .omega = zero, .alpha = zero};
    ground.axes = kt_code_rotation(g, &across, &unused);
    const kt_op2 gravity = flat_of(g, &ground.axes, tree->gravity);
    ground.linear = flat_scale(g, kt_op_number(g, -1.0), gravity);
    return ground;
}

/* Pose and velocity of a link, and the wrench that its own inertia requires. */
static void start_flat(kt_code_tree *tree, int i, const code_flat *p, code_flat *b) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_planar_link *flat = &tree->model->planar[i];
    const kt_v4 *columns = tree->model->planar_rest[i].axes;
    const kt_mat3 axes = {.x = {columns[0][0], columns[0][1], columns[0][2]},
                          .y = {columns[1][0], columns[1][1], columns[1][2]},
                          .z = {columns[2][0], columns[2][1], columns[2][2]}};
    const kt_op v = kt_code_rate(tree, KT_OP_RATE, l->link->v), sign = kt_op_number(g, flat->sign);
    const kt_op zero = kt_op_number(g, 0.0);
    bool unused;
    kt_graph_section(g, "%s: place and velocity of link %d in the axes of the plane\nw = w_p + v,  c = - w_p^2 r",
                     l->name, i);
    b->axes = kt_code_rotation(g, &axes, &unused);
    kt_op3 unit = kt_op3_zero(g);
    unit.x[l->link->axis] = kt_op_number(g, 1.0);
    const kt_op2 along = flat_of(g, &b->axes, unit);
    kt_op2 at = flat_of(g, &p->axes, l->at);
    b->rotation = p->rotation;
    b->omega = p->omega;
    if (flat->revolute) {
        const kt_op sine = kt_op_multiply(g, sign, kt_op_input(g, KT_OP_SINE, l->link->angle));
        b->rotation = flat_turn(g, p->rotation, (kt_op2){{kt_op_input(g, KT_OP_COSINE, l->link->angle), sine}});
        b->omega = kt_op_add(g, p->omega, kt_op_multiply(g, sign, v));
    } else {
        at = flat_add(g, at, flat_scale(g, kt_op_input(g, KT_OP_POSITION, l->link->q), along));
    }
    b->offset = flat_turn(g, p->rotation, at);
    b->along = flat_turn(g, b->rotation, along);
    b->bias = flat_scale(g, kt_op_negate(g, kt_op_multiply(g, p->omega, p->omega)), b->offset);
    if (!flat->revolute) {
        const kt_op twice = kt_op_scale(g, 2.0, kt_op_multiply(g, p->omega, v));
        b->bias = flat_add(g, b->bias, flat_scale(g, twice, flat_across(g, b->along)));
    }
    kt_op_name(g, b->omega, "w%d", i);
    kt_graph_section(g, "%s: force of the velocities alone, f = - w^2 first moment", l->name);
    const kt_op2 first = flat_turn(g, b->rotation, flat_of(g, &b->axes, l->moment));
    b->h = flat_across(g, first);
    b->force = flat_scale(g, kt_op_negate(g, kt_op_multiply(g, b->omega, b->omega)), first);
    b->moment = b->xy = zero;
    b->xx = b->yy = l->mass;
    b->j = kt_op3_dot(g, b->axes.row[2], kt_op6_apply(g, &l->inertia, b->axes.row[2]));
}

/* ---- elimination ------------------------------------------------------------------------------------------------- */

/* U, D, 1 / D and tau of a joint. Here y = tau - S . (n_b, f_b): the passes subtract U_f . c. */
typedef struct flat_pivot {
    kt_op n, inertia, inverse, tau, y;
    kt_op2 f;
} flat_pivot;

static flat_pivot make_flat_pivot(kt_code_tree *tree, int i, const code_flat *x, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const int v = l->link->v;
    const bool turns = tree->model->planar[i].revolute;
    const kt_op own = turns ? x->moment : flat_dot(g, x->along, x->force);
    const kt_op tau = kt_op_scale(g, turns ? tree->model->planar[i].sign : 1.0, kt_code_given_force(tree, v));
    flat_pivot u = {.n = turns ? x->j : flat_dot(g, x->h, x->along)};
    u.f = turns ? x->h : flat_apply(g, x, x->along);
    u.inertia = kt_op_add(g, turns ? x->j : flat_dot(g, x->along, u.f), l->armature[0]);
    u.inverse = kt_op_divide(g, kt_op_number(g, 1.0), u.inertia);
    u.tau = tau;
    u.y = kt_op_subtract(g, tau, own);
    guard[v] = (kt_code_guard){.pivot = u.inertia, .limit = turns ? l->size : l->carried, .body = l->link->body};
    kt_op_name(g, u.inertia, "D%d", v);
    kt_op_name(g, u.inverse, "E%d", v);
    return u;
}

/* Eliminates a revolute joint without armature. */
static void pass_flat_hinge(kt_graph *g, const flat_pivot *u, kt_op2 p, code_flat *x) {
    const kt_op n = flat_dot(g, p, x->h), nd = kt_op_multiply(g, n, u->inverse);
    const kt_op whole = flat_dot(g, p, flat_apply(g, x, p));
    x->slope = flat_scale(g, u->inverse, x->h);
    x->j = kt_op_subtract(g, whole, kt_op_multiply(g, n, nd));
    flat_reduce(g, x, x->h, x->slope);
    x->h = flat_apply(g, x, p);
    const kt_op2 carried = flat_apply(g, x, x->bias);
    const kt_op own = flat_dot(g, x->slope, x->bias);
    x->force = flat_add(g, x->force, flat_add(g, flat_scale(g, u->y, x->slope), carried));
    x->moment = kt_op_add(g, u->tau, flat_dot(g, p, x->force));
    x->free = kt_op_subtract(g, kt_op_multiply(g, u->y, u->inverse), own);
    x->gain = kt_op_add(g, kt_op_number(g, 1.0), nd);
}

/* Eliminates a joint of any type, with its armature. */
static void pass_flat_joint(kt_graph *g, const flat_pivot *u, kt_op2 p, code_flat *x) {
    const kt_op2 h = flat_add(g, x->h, flat_apply(g, x, p));
    const kt_op second = flat_dot(g, p, h), across = kt_op_add(g, flat_dot(g, p, x->h), second);
    const kt_op lever = kt_op_add(g, u->n, flat_dot(g, p, u->f)), ratio = kt_op_multiply(g, lever, u->inverse);
    const kt_op y = kt_op_multiply(g, kt_op_subtract(g, u->y, flat_dot(g, u->f, x->bias)), u->inverse);
    const kt_op2 carried = flat_apply(g, x, x->bias);
    x->slope = flat_scale(g, u->inverse, u->f);
    const kt_op n_y = kt_op_multiply(g, u->n, y), reduced = kt_op_multiply(g, lever, ratio);
    x->moment = kt_op_add(g, x->moment, kt_op_add(g, flat_dot(g, x->h, x->bias), n_y));
    x->force = flat_add(g, x->force, flat_add(g, carried, flat_scale(g, y, u->f)));
    x->moment = kt_op_add(g, x->moment, flat_dot(g, p, x->force));
    x->j = kt_op_subtract(g, kt_op_add(g, x->j, across), reduced);
    x->h = flat_add(g, h, flat_scale(g, kt_op_negate(g, ratio), u->f));
    flat_reduce(g, x, u->f, x->slope);
    x->free = y;
    x->gain = ratio;
}

/* Writes the code that eliminates the joint of a link in a plane, and adds its inertia and wrench to the parent. */
static void give_flat(kt_code_tree *tree, int i, code_flat *all, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    code_flat *x = &all[i], *to = &all[l->parent];
    const kt_op2 p = flat_across(g, x->offset);
    kt_graph_section(g, "%s: D = s . U + armature,  J' = p . M p - V^2 / D, and so on", l->name);
    const flat_pivot u = make_flat_pivot(tree, i, x, guard);
    if (tree->model->planar[i].revolute && kt_op_is(g, l->armature[0], 0.0))
        pass_flat_hinge(g, &u, p, x);
    else
        pass_flat_joint(g, &u, p, x);
    if (l->parent == 0)
        return;
    to->j = kt_op_add(g, to->j, x->j);
    to->xx = kt_op_add(g, to->xx, x->xx);
    to->xy = kt_op_add(g, to->xy, x->xy);
    to->yy = kt_op_add(g, to->yy, x->yy);
    to->h = flat_add(g, to->h, x->h);
    to->force = flat_add(g, to->force, x->force);
    to->moment = kt_op_add(g, to->moment, x->moment);
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

/* qdd = free - gain al_p - slope . a_p. Then al = al_p + qdd and a = a_p + al_p p + c if the joint rotates, else al =
 * al_p and a has qdd along the joint's axis, too. */
static void respond_flat(kt_code_tree *tree, int i, const code_flat *p, code_flat *x, kt_op *a) {
    kt_graph *g = tree->graph;
    const kt_link *link = tree->link[i].link;
    const kt_planar_link *flat = &tree->model->planar[i];
    kt_graph_section(g, "%s: acceleration", tree->link[i].name);
    const kt_op carried = kt_op_subtract(g, x->free, kt_op_multiply(g, x->gain, p->alpha));
    const kt_op own = kt_op_subtract(g, carried, flat_dot(g, x->slope, p->linear));
    const kt_op2 swung = flat_add(g, p->linear, flat_scale(g, p->alpha, flat_across(g, x->offset)));
    x->linear = flat_add(g, x->bias, swung);
    x->alpha = flat->revolute ? kt_op_add(g, p->alpha, own) : p->alpha;
    if (!flat->revolute)
        x->linear = flat_add(g, x->linear, flat_scale(g, own, x->along));
    a[link->v] = flat->revolute ? kt_op_scale(g, flat->sign, own) : own;
    kt_op_name(g, x->alpha, "al%d", i);
}

void kt_code_forward_planar(kt_code_tree *tree, kt_op *a, kt_code_guard *guard) {
    const kt_model *model = tree->model;
    code_flat *all = kt_graph_take(tree->graph, (size_t)tree->link_count, sizeof *all);
    for (size_t k = 0; k < model->n.plane && all != NULL; k++) {
        const kt_plane *plane = &model->plane[k];
        all[0] = ground_of_plane(tree, plane);
        kt_graph_pass(tree->graph);
        for (int i = plane->first; i < plane->last; i++) {
            kt_graph_step(tree->graph);
            start_flat(tree, i, &all[tree->link[i].parent], &all[i]);
        }
        kt_graph_pass(tree->graph);
        for (int i = plane->last - 1; i >= plane->first; i--) {
            kt_graph_step(tree->graph);
            give_flat(tree, i, all, guard);
        }
        kt_graph_pass(tree->graph);
        for (int i = plane->first; i < plane->last; i++) {
            kt_graph_step(tree->graph);
            respond_flat(tree, i, &all[tree->link[i].parent], &all[i], a);
        }
        kt_graph_pass(tree->graph);
    }
}
