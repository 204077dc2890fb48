/* Energy, markers and their Jacobians, as nodes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

/* ---- energy ------------------------------------------------------------------------------------------------------ */

/* Writes the code for the velocities of a link in its own axes, from those of its parent. */
static void speed_link(kt_code_tree *tree, int i, kt_code_speed *all) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    kt_code_speed *s = &all[i];
    const kt_code_speed *p = &all[l->parent];
    kt_op3 spin, shift;
    kt_graph_section(g, "%s: velocity of link %d in its own axes\nw = R'w_p + s v,  u = R'(u_p + w_p x r) + s v",
                     l->name, i);
    s->frame = kt_code_frame_of(tree, i);
    kt_code_rates(tree, i, KT_OP_RATE, &spin, &shift);
    const kt_op3 carried = kt_op3_add(g, p->linear, kt_op3_cross(g, p->omega, s->frame.offset));
    s->linear = kt_code_from_rest(g, &s->frame, kt_op3_add(g, kt_code_rest_down(g, &s->frame, carried), shift));
    s->omega = kt_op3_add(g, kt_code_down(g, &s->frame, p->omega), spin);
    kt_op3_name(g, s->omega, "w", i);
    kt_op3_name(g, s->linear, "u", i);
}

/* Twice the kinetic energy of a link and of the rotors of its joint. */
static kt_op twice_energy(kt_code_tree *tree, int i, const kt_code_speed *s) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_op3 across = kt_op3_cross(g, s->omega, l->moment);
    const kt_op3 momentum = kt_op3_combine(g, l->mass, s->linear, kt_op_number(g, 2.0), across);
    kt_op sum = kt_op3_add_dots(g, s->linear, momentum, s->omega, kt_op6_apply(g, &l->inertia, s->omega));
    for (int k = 0; k < kt_link_dofs(l->link); k++) {
        const kt_op v = kt_op_input(g, KT_OP_RATE, l->link->v + k);
        sum = kt_op_add(g, sum, kt_op_multiply(g, l->armature[k], kt_op_multiply(g, v, v)));
    }
    return sum;
}

kt_code_speed *kt_code_speeds(kt_code_tree *tree) {
    kt_graph *g = tree->graph;
    kt_code_speed *all = kt_graph_take(g, (size_t)tree->link_count, sizeof *all);
    if (all == NULL)
        return NULL;
    all[0].omega = all[0].linear = kt_op3_zero(g);
    for (int i = 1; i < tree->link_count; i++)
        speed_link(tree, i, all);
    return all;
}

void kt_code_energy(kt_code_tree *tree, kt_op energy[2]) {
    kt_graph *g = tree->graph;
    kt_code_speed *all = kt_code_speeds(tree);
    if (all == NULL)
        return;
    kt_op twice = kt_op_number(g, 0.0);
    for (int i = 0; i < tree->link_count; i++) {
        const kt_code_link *l = &tree->link[i];
        all[i].moment = l->moment;
        all[i].mass = l->mass;
        kt_graph_section(g, "%s: kinetic energy, m u.u / 2 + u.(w x h) + w.J w / 2", i > 0 ? l->name : "ground");
        if (i > 0)
            twice = kt_op_add(g, twice, twice_energy(tree, i, &all[i]));
    }
    energy[0] = kt_op_scale(g, 0.5, twice);
    for (int i = tree->link_count - 1; i > 0; i--) {
        const kt_code_speed *s = &all[i];
        kt_code_speed *p = &all[tree->link[i].parent];
        kt_graph_section(g, "%s: first moment, R h + m r", tree->link[i].name);
        const kt_op3 m_r = kt_op3_scale(g, s->mass, s->frame.offset);
        p->moment = kt_op3_add(g, p->moment, kt_op3_add(g, kt_code_up(g, &s->frame, s->moment), m_r));
        p->mass = kt_op_add(g, p->mass, s->mass);
    }
    kt_graph_section(g, "potential energy: - g . h");
    energy[1] = kt_op_negate(g, kt_op3_dot(g, tree->gravity, all[0].moment));
}

/* ---- markers ----------------------------------------------------------------------------------------------------- */

kt_op33 kt_code_turn_of_frame(kt_graph *g, const kt_code_frame *f) {
    kt_op33 out;
    for (int k = 0; k < 3; k++) {
        kt_op3 unit = kt_op3_zero(g);
        unit.x[k] = kt_op_number(g, 1.0);
        const kt_op3 column = kt_code_up(g, f, unit);
        for (int i = 0; i < 3; i++)
            out.row[i].x[k] = column.x[i];
    }
    return out;
}

kt_code_places kt_code_no_places(kt_code_tree *tree) {
    kt_code_places to;
    to.turn = kt_graph_take(tree->graph, (size_t)tree->link_count, sizeof *to.turn);
    to.position = kt_graph_take(tree->graph, (size_t)tree->link_count, sizeof *to.position);
    return to;
}

kt_code_places kt_code_place_links(kt_code_tree *tree) {
    static const double unit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    kt_graph *g = tree->graph;
    const kt_code_places to = kt_code_no_places(tree);
    for (int i = 0; i < tree->link_count && !g->failed; i++) {
        const int up = tree->link[i].parent;
        kt_graph_section(g, "%s: rotation and position of link %d in the world", i > 0 ? tree->link[i].name : "ground",
                         i);
        to.turn[i] = kt_op33_of(g, unit);
        to.position[i] = kt_op3_zero(g);
        if (i == 0)
            continue;
        const kt_code_frame frame = kt_code_frame_of(tree, i);
        const kt_op33 own = kt_code_turn_of_frame(g, &frame);
        to.turn[i] = kt_op33_multiply(g, &to.turn[up], &own);
        to.position[i] = kt_op3_add(g, to.position[up], kt_op33_apply(g, &to.turn[up], frame.offset));
        kt_op3_name(g, to.position[i], "p", i);
    }
    return to;
}

void kt_code_markers(kt_code_tree *tree, kt_op *out) {
    kt_graph *g = tree->graph;
    const kt_model *model = tree->model;
    const int count = (int)model->n.marker;
    kt_code_speed *all = kt_code_speeds(tree);
    const kt_code_places at = kt_code_place_links(tree);
    for (int b = 0; b < (int)model->n.body && !g->failed; b++)
        for (int k = 0; k < model->body[b].marker_count; k++) {
            const int link = model->body[b].link, index = model->body[b].marker + k;
            kt_graph_section(g, "marker %s of %s: p + R c,  R (u + w x c)", kt_marker_name(model, b, k),
                             kt_body_name(model, b));
            const kt_op3 arm = kt_code_marker(tree, b, k);
            const kt_op3 rate = kt_op3_add(g, all[link].linear, kt_op3_cross(g, all[link].omega, arm));
            const kt_op3 place = kt_op3_add(g, at.position[link], kt_op33_apply(g, &at.turn[link], arm));
            const kt_op3 velocity = kt_op33_apply(g, &at.turn[link], rate);
            for (int x = 0; x < 3; x++) {
                out[3 * index + x] = place.x[x];
                out[3 * (count + index) + x] = velocity.x[x];
            }
        }
}

/* ---- Jacobians --------------------------------------------------------------------------------------------------- */

/* A column of a Jacobian: the angular velocity w, and the velocity u + w x arm. */
static void set_column(kt_graph *g, kt_op3 w, kt_op3 u, kt_op3 arm, kt_op column[6]) {
    const kt_op3 velocity = kt_op3_add(g, u, kt_op3_cross(g, w, arm));
    for (int x = 0; x < 3; x++) {
        column[x] = w.x[x];
        column[3 + x] = velocity.x[x];
    }
}

/* Column `axis` of the rotation R, or of R times the axes at rest of a link. */
static kt_op3 world_axis(kt_graph *g, const kt_op33 *turn, const kt_code_link *at_rest, int axis) {
    kt_op3 unit = kt_op3_zero(g);
    unit.x[axis] = kt_op_number(g, 1.0);
    if (at_rest != NULL && at_rest->is_rotated)
        unit = kt_op33_apply(g, &at_rest->rest, unit);
    return kt_op33_apply(g, turn, unit);
}

void kt_code_fill_jacobian(kt_code_tree *tree, const kt_code_places *at, int i, kt_op3 point, kt_op *jacobian) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_op33 *own = &at->turn[i], *parent = &at->turn[l->parent];
    const kt_op3 zero = kt_op3_zero(g), arm = kt_op3_subtract(g, point, at->position[i]);
    for (int d = 0; d < kt_link_dofs(l->link); d++) {
        const kt_code_dof dof = kt_code_dof_of(l->link, d);
        const bool is_own = dof.turns && dof.is_of_three;
        const kt_op3 axis = world_axis(g, is_own ? own : parent, is_own ? NULL : l, dof.k);
        kt_op *column = jacobian + 6 * (size_t)(l->link->v + d);
        set_column(g, dof.turns ? axis : zero, dof.turns ? kt_op3_scale(g, l->pitch, axis) : axis, arm, column);
    }
}

void kt_code_jacobians(kt_code_tree *tree, kt_op *out) {
    kt_graph *g = tree->graph;
    const kt_model *model = tree->model;
    const size_t size = 6 * model->n.v;
    const kt_code_places at = kt_code_place_links(tree);
    for (size_t i = 0; i < size * model->n.marker; i++)
        out[i] = kt_op_number(g, 0.0);
    for (int b = 0; b < (int)model->n.body && !g->failed; b++)
        for (int k = 0; k < model->body[b].marker_count; k++) {
            const int link = model->body[b].link;
            kt_graph_section(g, "marker %s of %s: columns (w, u + w x (p - p_link)) of the joints that carry it",
                             kt_marker_name(model, b, k), kt_body_name(model, b));
            const kt_op3 arm = kt_op33_apply(g, &at.turn[link], kt_code_marker(tree, b, k));
            const kt_op3 point = kt_op3_add(g, at.position[link], arm);
            for (int i = link; i > 0; i = tree->link[i].parent)
                kt_code_fill_jacobian(tree, &at, i, point, out + size * (size_t)(model->body[b].marker + k));
        }
}
