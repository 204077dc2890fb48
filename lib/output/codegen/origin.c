/* Origins and axes of links.
 *
 * The origin of a link may lie anywhere on the axis e of its joint. At the distance d from its position in the model,
 *
 *   r' = r + d R e    r_c' = r_c - d e    c' = c - d e
 *
 * for its position r in the parent with the axes at rest R, the positions r_c of joints that the link carries, and all
 * its points c. Each component of a position that vanishes saves products in all recursions. d is chosen so that as
 * many components as possible vanish: the component of r along the axis, or of one r_c. For a joint on the ground, a
 * vanishing component of r saves nothing, since the ground does not rotate. In an arm with axes z, y, z, y, ... every
 * second position vanishes.
 *
 * Source: Denavit & Hartenberg 1955, where one more component vanishes by a rotation about the axis.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/node_tree.h"

enum {
    CHAIN_LEAST = 16, /* links: a loop over fewer ones fills few vectors */
    FIRST_LIKE = 3    /* link; those before have more zeros */
};

/* The coordinate of the parent's axes along which the axis of a joint points, and its sign; -1: there is none. */
static int axis_in_parent(const kt_code_tree *tree, int i, double *sign) {
    const kt_code_link *l = &tree->link[i];
    for (int row = 0; row < 3; row++)
        for (int s = -1; s <= 1; s += 2)
            if (kt_op_is(tree->graph, l->rest.row[row].x[l->link->axis], s)) {
                *sign = s;
                return row;
            }
    return -1;
}

static bool has_axis(const kt_code_link *l) {
    const kt_motion_facts facts = kt_motion_facts_of(kt_code_motion(l));
    return facts.quaternions == 0 && kt_code_motion(l) != KT_MOTION_NONE;
}

/* The number of nonzero components, not counting one of them. */
static int count_components(const kt_graph *g, kt_op3 r, int apart) {
    int count = 0;
    for (int k = 0; k < 3; k++)
        count += k != apart && !kt_op_is(g, r.x[k], 0.0);
    return count;
}

/* The number of nonzero components of the positions of a link, and of the links that it carries, if the origin moves.
 * The component of a carried link along its own axis does not count, because its origin can move along this axis, and a
 * slider has this component in any case. */
static int count_with(const kt_code_tree *tree, int i, int row, double sign, kt_op d) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const int axis = l->link->axis;
    const bool slides = kt_link_lengths(l->link) > 0;
    kt_op3 at = l->at;
    double unused;
    at.x[row] = kt_op_add(g, at.x[row], kt_op_scale(g, sign, d));
    int count = l->parent > 0 ? count_components(g, at, slides ? row : -1) : 0;
    for (int c = i + 1; c < tree->link_count; c++)
        if (tree->link[c].parent == i) {
            kt_op3 there = tree->link[c].at;
            there.x[axis] = kt_op_subtract(g, there.x[axis], d);
            count += count_components(g, there, has_axis(&tree->link[c]) ? axis_in_parent(tree, c, &unused) : -1);
        }
    return count;
}

/* Moves the origin, and all positions relative to this origin. */
static void move_origin(kt_code_tree *tree, int i, int row, double sign, kt_op d) {
    kt_graph *g = tree->graph;
    kt_code_link *l = &tree->link[i];
    const int axis = l->link->axis;
    const kt_op mass = l->mass;
    const kt_op3 moment = l->moment;
    const kt_op6 inertia = l->inertia;
    kt_op3 back = kt_op3_zero(g);
    kt_graph_section(g, "%s: the origin of its link moves along the axis", l->name);
    l->shift = d;
    l->at.x[row] = kt_op_add(g, l->at.x[row], kt_op_scale(g, sign, d));
    for (int c = i + 1; c < tree->link_count; c++)
        if (tree->link[c].parent == i)
            tree->link[c].at.x[axis] = kt_op_subtract(g, tree->link[c].at.x[axis], d);
    for (int b = 1; b < (int)tree->model->n.body; b++)
        if (tree->model->body[b].link == i)
            tree->body_position[b].x[axis] = kt_op_subtract(g, tree->body_position[b].x[axis], d);
    back.x[axis] = kt_op_negate(g, d);
    l->mass = kt_op_number(g, 0.0);
    l->moment = kt_op3_zero(g);
    l->inertia = kt_op6_zero(g);
    kt_code_add_rigid(g, l, mass, moment, &inertia, back);
}

void kt_code_tree_place_origins(kt_code_tree *tree) {
    kt_graph *g = tree->graph;
    for (int i = 1; i < tree->link_count; i++) {
        const kt_code_link *l = &tree->link[i];
        double sign;
        const int row = has_axis(l) ? axis_in_parent(tree, i, &sign) : -1;
        if (row < 0)
            continue;
        kt_op best = kt_op_number(g, 0.0);
        int least = count_with(tree, i, row, sign, best);
        for (int c = i; c < tree->link_count; c++) {
            if (c != i && tree->link[c].parent != i)
                continue;
            const kt_op d = c == i ? kt_op_scale(g, -sign, l->at.x[row]) : tree->link[c].at.x[l->link->axis];
            const int count = count_with(tree, i, row, sign, d);
            if (count < least) {
                least = count;
                best = d;
            }
        }
        if (!kt_op_is(g, best, 0.0))
            move_origin(tree, i, row, sign, best);
    }
}

/* ---- axes -------------------------------------------------------------------------------------------------------- */

/* Returns the component before the turn that became component k of a turned link. */
static int component_before(const kt_code_link *l, int k) {
    return l->link != NULL && has_axis(l) ? (l->link->axis + 1 + k) % 3 : k;
}

static kt_op3 turn_code_vector(kt_graph *g, const kt_code_link *l, kt_op3 v) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op_opaque(g, v.x[component_before(l, k)]);
    return out;
}

/* Turns a link. parent: the parent before its turn. */
static void turn_code_link(kt_graph *g, const kt_code_link *from, const kt_code_link *parent, kt_link *record,
                           kt_code_link *to) {
    *to = *from;
    to->moment = turn_code_vector(g, from, from->moment);
    to->at = turn_code_vector(g, parent, from->at);
    for (int i = 0; i < 3; i++) {
        to->rest.row[i] = turn_code_vector(g, from, from->rest.row[component_before(parent, i)]);
        for (int k = i; k < 3; k++)
            to->inertia.x[kt_op6_index(i, k)] =
                kt_op_opaque(g, from->inertia.x[kt_op6_index(component_before(from, i), component_before(from, k))]);
    }
    to->is_rotated = false;
    for (int i = 0; i < 3; i++)
        to->is_rotated |= !kt_op_is(g, to->rest.row[i].x[i], 1.0);
    *record = *from->link;
    record->axis = has_axis(from) ? 2 : record->axis;
    record->rest = 0; /* its place is relative to the original */
    to->link = record;
}

/* Whether two numbers are both parameters, or one constant. */
static bool are_like_numbers(const kt_graph *g, const kt_op *a, const kt_op *b, int count) {
    bool are_like = true;
    for (int k = 0; k < count; k++)
        are_like &= a[k] == b[k] || (!kt_op_is_constant(g, a[k]) && !kt_op_is_constant(g, b[k]));
    return are_like;
}

/* Whether equal operations compute two links. */
static bool are_like_links(const kt_graph *g, const kt_code_link *a, const kt_code_link *b) {
    bool are_like = a->link->motion == b->link->motion && a->link->axis == b->link->axis;
    for (int k = 0; k < 3; k++)
        are_like &= are_like_numbers(g, a->rest.row[k].x, b->rest.row[k].x, 3);
    return are_like && are_like_numbers(g, a->at.x, b->at.x, 3) && are_like_numbers(g, a->moment.x, b->moment.x, 3) &&
           are_like_numbers(g, a->inertia.x, b->inertia.x, 6) && are_like_numbers(g, &a->mass, &b->mass, 1) &&
           are_like_numbers(g, a->armature, b->armature, kt_link_dofs(a->link));
}

void kt_code_tree_turn(kt_code_tree *turned, const kt_code_tree *tree) {
    const int count = tree->link_count;
    *turned = *tree;
    turned->link = kt_graph_take(tree->graph, (size_t)count, sizeof *turned->link);
    turned->record = kt_graph_take(tree->graph, (size_t)count, sizeof *turned->record);
    turned->is_uniform = count > CHAIN_LEAST;
    if (tree->graph->failed)
        return;
    turned->link[0] = tree->link[0];
    for (int i = 1; i < count; i++) {
        turn_code_link(tree->graph, &tree->link[i], &tree->link[tree->link[i].parent], &turned->record[i],
                       &turned->link[i]);
        turned->is_uniform &= tree->link[i].parent == i - 1;
        if (i > FIRST_LIKE && i < count - 1)
            turned->is_uniform &= are_like_links(tree->graph, &turned->link[FIRST_LIKE], &turned->link[i]);
    }
}
