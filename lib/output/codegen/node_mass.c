/* The mass matrix of a tree. A composite body is a link with all links beyond it, as if their joints were locked. A
 * column of M is the wrench that gives a joint's composite body a unit acceleration. Columns move from link to link to
 * the ground. In a long chain, all columns refer to the last origin instead, in the axes of the ground.
 *
 * Source: Walker & Orin 1982 (composite bodies).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

/* A wrench on a link, in the axes of the link. */
typedef struct code_wrench {
    kt_op3 n, f;
} code_wrench;

/* A column of M on its way to the ground: the wrench on the link that the column has reached. */
typedef struct code_column {
    code_wrench wrench;
    int link;     /* 0: the ground */
    bool at_rest; /* the axes are those of the link at rest */
} code_column;

/* Sets the entries of column v for the joint of its link. */
static void fill_entries(kt_code_tree *tree, const kt_code_frame *frame, const code_column *c, int v, kt_op *mass) {
    const kt_link *link = tree->link[c->link].link;
    const size_t nv = tree->model->n.v;
    kt_op entry[KT_DOF_MAX];
    kt_code_project(tree, &frame[c->link], c->wrench.n, c->wrench.f, entry);
    for (int k = 0; k < kt_link_dofs(link); k++)
        mass[(size_t)(link->v + k) * nv + (size_t)v] = mass[(size_t)v * nv + (size_t)(link->v + k)] = entry[k];
}

/* Moves a column to the parent of its link. */
static void move_column(kt_code_tree *tree, const kt_code_frame *frame, code_column *c) {
    kt_graph *g = tree->graph;
    const kt_code_frame *own = &frame[c->link];
    code_wrench *w = &c->wrench;
    c->link = tree->link[c->link].parent;
    if (c->link == 0)
        return;
    w->f = c->at_rest ? kt_code_rest_up(g, own, w->f) : kt_code_up(g, own, w->f);
    w->n = c->at_rest ? kt_code_rest_up(g, own, w->n) : kt_code_up(g, own, w->n);
    w->n = kt_op3_add(g, w->n, kt_op3_cross(g, own->offset, w->f));
    c->at_rest = false;
}

/* The wrench that a unit acceleration of a joint's first coordinate, or of a rotation about axis k, takes. */
static code_wrench unit_wrench(kt_graph *g, const kt_code_link *l, const kt_code_link *body, int k) {
    const bool is_prismatic = kt_code_motion(l) == KT_MOTION_PRISMATIC;
    kt_op3 turn = kt_op3_zero(g), shift = turn;
    if (is_prismatic)
        shift.x[k] = kt_op_number(g, 1.0);
    else
        turn.x[k] = kt_op_number(g, 1.0);
    if (kt_code_motion(l) == KT_MOTION_SCREW)
        shift.x[k] = l->pitch;
    const kt_op3 h_a = kt_op3_cross(g, body->moment, shift), alpha_h = kt_op3_cross(g, turn, body->moment);
    const kt_op3 n = kt_op3_add(g, kt_op6_apply(g, &body->inertia, turn), h_a);
    return (code_wrench){n, kt_op3_add(g, kt_op3_scale(g, body->mass, shift), alpha_h)};
}

/* Begins the columns of one joint, with its own entries. body: the composite body that the joint carries. */
static void begin_columns(kt_code_tree *tree, const kt_code_frame *frame, int i, const kt_code_link *body,
                          code_column *column, kt_op *mass) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const size_t nv = tree->model->n.v;
    const int v = l->link->v, lengths = kt_link_lengths(l->link), count = kt_link_dofs(l->link);
    const bool has_quaternion = kt_motion_facts_of(kt_code_motion(l)).quaternions > 0;
    for (int k = has_quaternion ? lengths : 0; k < count; k++)
        column[v + k] = (code_column){unit_wrench(g, l, body, kt_code_dof_of(l->link, k).k), i, false};
    for (int k = has_quaternion ? lengths : 0; k < count; k++)
        fill_entries(tree, frame, &column[v + k], v + k, mass);
    const kt_op3 moment = has_quaternion ? kt_code_to_rest(g, &frame[i], body->moment) : body->moment;
    for (int k = 0; k < lengths && has_quaternion; k++) {
        kt_op3 unit = kt_op3_zero(g);
        unit.x[k] = kt_op_number(g, 1.0);
        const kt_op3 n = kt_op3_cross(g, moment, unit);
        column[v + k] = (code_column){{n, kt_op3_scale(g, body->mass, unit)}, i, true};
        for (int j = 0; j < lengths; j++)
            mass[(size_t)(v + k) * nv + (size_t)(v + j)] = j == k ? body->mass : kt_op_number(g, 0.0);
    }
    for (int k = 0; k < kt_link_dofs(l->link); k++) {
        kt_op *entry = &mass[(size_t)(v + k) * (nv + 1)];
        *entry = kt_op_add(g, *entry, l->armature[k]);
    }
}

void kt_code_compose_bodies(kt_code_tree *tree, kt_code_frame *frame, kt_code_link *body) {
    kt_graph *g = tree->graph;
    kt_graph_pass(g);
    for (int i = 0; i < tree->link_count; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: rotation and offset of link %d", i > 0 ? tree->link[i].name : "ground", i);
        body[i] = tree->link[i];
        if (i > 0)
            frame[i] = kt_code_frame_of(tree, i);
    }
    kt_graph_pass(g);
    for (int i = tree->link_count - 1; i > 0; i--) {
        kt_code_link *own = &body[i];
        kt_op3_name(g, own->moment, "h", i);
        kt_op_name(g, own->mass, "m%d", i);
        if (own->parent == 0)
            continue;
        kt_graph_step(g);
        kt_graph_section(g, "%s: the parent carries m, R h + m r, and R J R' about its own origin", own->name);
        const kt_op3 moment = kt_code_up(g, &frame[i], own->moment);
        const kt_op6 inertia = kt_code_up_inertia(g, &frame[i], &own->inertia);
        kt_code_add_rigid(g, &body[own->parent], own->mass, moment, &inertia, frame[i].offset);
    }
}

/* Fills M: the columns beyond each link move to its parent. */
static void fill_tree(kt_code_tree *tree, const kt_code_frame *frame, const kt_code_link *body, code_column *column,
                      kt_op *mass) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    for (int i = tree->link_count - 1; i > 0 && !g->failed; i--) {
        kt_graph_pass(g);
        kt_graph_section(g, "%s: columns of M, the wrenches of unit accelerations", body[i].name);
        begin_columns(tree, frame, i, &body[i], column, mass);
        const int own = tree->link[i].link->v, end = own + kt_link_dofs(tree->link[i].link);
        for (int v = nv - 1; v >= 0; v--) {
            if (column[v].link != i)
                continue;
            kt_graph_step(g);
            kt_graph_section(g, "%s: column %d", body[i].name, v);
            if (v < own || v >= end)
                fill_entries(tree, frame, &column[v], v, mass);
            move_column(tree, frame, &column[v]);
        }
    }
}

/* ---- mass matrix of a chain -------------------------------------------------------------------------------------- */

/* The axes of the links of a chain in the axes of the ground, and minus the positions of their origins relative to the
 * last origin.
 */
static void place_chain(kt_code_tree *tree, const kt_code_frame *frame, const kt_code_places *at) {
    static const double unit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    kt_graph *g = tree->graph;
    const int last = tree->link_count - 1;
    at->turn[0] = kt_op33_of(g, unit);
    at->position[last] = kt_op3_zero(g);
    kt_graph_pass(g);
    for (int i = 1; i <= last; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: axes of link %d in those of the ground, Q = Q_p R", tree->link[i].name, i);
        for (int k = 0; k < 3; k++)
            at->turn[i].row[k] = kt_code_down(g, &frame[i], at->turn[i - 1].row[k]);
    }
    kt_graph_pass(g);
    for (int i = 1; i < last; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: offset of the next origin in the axes of the ground, Q r", tree->link[i].name);
        at->position[i] = kt_op33_apply(g, &at->turn[i], frame[i + 1].offset);
    }
    kt_graph_pass(g);
    for (int i = last - 1; i > 0; i--) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: last origin from that of link %d, d = d_next + Q r", tree->link[i].name, i);
        at->position[i] = kt_op3_add(g, at->position[i + 1], at->position[i]);
    }
}

/* Moves a wrench of link i to the origin of the last link, in the axes of the ground. */
static void move_to_last(kt_graph *g, const kt_code_places *at, const kt_code_frame *frame, int i, code_column *c) {
    const kt_op33 *turn = &at->turn[c->at_rest ? i - 1 : i];
    code_wrench *w = &c->wrench;
    w->f = kt_op33_apply(g, turn, c->at_rest ? kt_code_rest_up(g, frame, w->f) : w->f);
    w->n = kt_op33_apply(g, turn, c->at_rest ? kt_code_rest_up(g, frame, w->n) : w->n);
    w->n = kt_op3_add(g, w->n, kt_op3_cross(g, at->position[i], w->f));
}

/* Sets the entries of row v for the joints beyond its link. */
static void fill_row(kt_code_tree *tree, const kt_op *motion, const code_column *column, int v, kt_op *mass) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    const kt_op *m = &motion[6 * v];
    const kt_op3 s = {{m[0], m[1], m[2]}}, u = {{m[3], m[4], m[5]}};
    kt_graph_pass(g);
    for (int i = tree->link_count - 1; i > column[v].link; i--) {
        const kt_link *link = tree->link[i].link;
        kt_graph_step(g);
        kt_graph_section(g, "%s: row %d of M, s . n + u . f", tree->link[i].name, v);
        for (int c = link->v; c < link->v + kt_link_dofs(link); c++)
            mass[v * nv + c] = mass[c * nv + v] = kt_op3_add_dots(g, s, column[c].wrench.n, u, column[c].wrench.f);
    }
}

/* Fills M of a chain. Columns do not move from link to link. Joint i has the unit motion (s, u), and joint j > i has
 * the column (n, f). All four are about the origin of the last link, in the axes of the ground:
 *
 *   M_ij = s . n + u . f.
 *
 * The entries of a row do not wait for each other, and a compiler computes eight at once. An entry has a rounding error
 * of the order of eps |f| (d_i + d_j), where d are distances from the last origin. Distances from the ground would be
 * larger without a bound. */
static void fill_chain(kt_code_tree *tree, const kt_code_frame *frame, const kt_code_link *body, code_column *column,
                       kt_op *mass) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    const kt_code_places at = kt_code_no_places(tree);
    kt_op *motion = kt_graph_take(g, 6 * nv + 6, sizeof *motion);
    if (!g->failed)
        place_chain(tree, frame, &at);
    kt_graph_pass(g);
    for (int i = tree->link_count - 1; i > 0 && !g->failed; i--) {
        kt_graph_step(g);
        kt_graph_section(g,
                         "%s: unit motion (s, u) and column (n, f) of M about the last origin, axes of the ground\n"
                         "u = s x d,  n = Q n - d x f,  f = Q f",
                         body[i].name);
        begin_columns(tree, frame, i, &body[i], column, mass);
        at.position[i] = kt_op3_scale(g, kt_op_number(g, -1.0), at.position[i]);
        kt_code_fill_jacobian(tree, &at, i, kt_op3_zero(g), motion);
        for (int k = 0; k < kt_link_dofs(body[i].link); k++)
            move_to_last(g, &at, &frame[i], i, &column[body[i].link->v + k]);
    }
    for (int v = 0; v < (int)nv && !g->failed; v++)
        fill_row(tree, motion, column, v, mass);
}

void kt_code_mass(kt_code_tree *tree, kt_op *mass) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    kt_code_frame *frame = kt_graph_take(g, (size_t)tree->link_count, sizeof *frame);
    kt_code_link *body = kt_graph_take(g, (size_t)tree->link_count, sizeof *body);
    code_column *column = kt_graph_take(g, (size_t)nv + 1, sizeof *column);
    for (int i = 0; i < nv * nv; i++)
        mass[i] = kt_op_number(g, 0.0);
    if (!g->failed)
        kt_code_compose_bodies(tree, frame, body);
    if (!g->failed && tree->is_uniform)
        fill_chain(tree, frame, body, column, mass);
    else if (!g->failed)
        fill_tree(tree, frame, body, column, mass);
    kt_graph_pass(g);
}
