/* The recursions over a tree in the axes of the links, about their origins.
 *
 * Each recursion repeats with nodes a recursion of lib/mechanics/dynamics. R rotates from the link's axes to the
 * parent's, r is the offset of the origin, S the joint's degrees of freedom, and a_0 = -gravity. All accelerations are
 * those of points, not spatial ones. U = [al] + [w][w], so that a point at c has the acceleration a + U c.
 *
 * Source: Luh, Walker & Paul 1980 (inverse dynamics).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

kt_op kt_code_rate(const kt_code_tree *tree, kt_op_array array, int index) {
    const bool is_node = array == KT_OP_GIVEN && tree->acceleration != NULL;
    if (array == KT_OP_RATE && tree->is_at_rest)
        return kt_op_number(tree->graph, 0.0);
    return is_node ? tree->acceleration[index] : kt_op_input(tree->graph, array, index);
}

kt_op kt_code_given_force(const kt_code_tree *tree, int index) {
    const kt_op given = kt_op_input(tree->graph, KT_OP_GIVEN, index);
    return tree->load != NULL ? kt_op_add(tree->graph, given, tree->load[index]) : given;
}

void kt_code_rates(kt_code_tree *tree, int link, kt_op_array array, kt_op3 *angular, kt_op3 *linear) {
    const kt_code_link *l = &tree->link[link];
    kt_graph *g = tree->graph;
    *angular = *linear = kt_op3_zero(g);
    for (int d = 0; d < kt_link_dofs(l->link); d++) {
        const kt_code_dof dof = kt_code_dof_of(l->link, d);
        const kt_op rate = kt_code_rate(tree, array, l->link->v + d);
        (dof.turns ? angular : linear)->x[dof.k] = rate;
        if (kt_code_motion(l) == KT_MOTION_SCREW)
            linear->x[dof.k] = kt_op_multiply(g, l->pitch, rate);
    }
}

void kt_code_project(kt_code_tree *tree, const kt_code_frame *f, kt_op3 n, kt_op3 force, kt_op *tau) {
    kt_graph *g = tree->graph;
    const kt_link *link = f->link->link;
    const kt_op3 at_rest = kt_code_to_rest(g, f, force);
    for (int d = 0; d < kt_link_dofs(link); d++) {
        const kt_code_dof dof = kt_code_dof_of(link, d);
        tau[d] =
            !dof.turns ? at_rest.x[dof.k] : kt_op_add(g, n.x[dof.k], kt_op_multiply(g, f->link->pitch, force.x[dof.k]));
    }
}

void kt_code_multiply_rates(kt_graph *g, kt_code_moving *m) {
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            m->square[kt_op6_index(i, j)] = kt_op_multiply(g, m->omega.x[i], m->omega.x[j]);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        m->u.row[i].x[i] = kt_op_negate(g, kt_op_add(g, m->square[kt_op6_index(j, j)], m->square[kt_op6_index(k, k)]));
        m->u.row[i].x[j] = kt_op_subtract(g, m->square[kt_op6_index(i, j)], m->alpha.x[k]);
        m->u.row[i].x[k] = kt_op_add(g, m->square[kt_op6_index(i, k)], m->alpha.x[j]);
    }
}

/* ---- inverse dynamics -------------------------------------------------------------------------------------------- */

/* The rotation of link i from its parent's rotation. The member `linear` becomes the joint's contribution to the
 * acceleration. */
static void turn_link(kt_code_tree *tree, int i, bool has_acceleration, kt_code_moving *all) {
    kt_graph *g = tree->graph;
    kt_code_moving *m = &all[i];
    const kt_code_moving *p = &all[tree->link[i].parent];
    kt_op3 spin, shift, turn = kt_op3_zero(g), gain = turn;
    kt_code_rates(tree, i, KT_OP_RATE, &spin, &shift);
    if (has_acceleration)
        kt_code_rates(tree, i, KT_OP_GIVEN, &turn, &gain);
    const kt_op3 omega = kt_code_rest_down(g, &m->frame, p->omega);
    const kt_op3 before = kt_code_from_rest(g, &m->frame, omega);
    const kt_op3 coriolis = kt_op3_cross(g, kt_op3_scale(g, kt_op_number(g, 2.0), omega), shift);
    m->linear = kt_op3_add(g, coriolis, gain);
    m->omega = kt_op3_add(g, before, spin);
    turn = kt_op3_add(g, kt_op3_cross(g, before, spin), turn);
    m->alpha = kt_op3_add(g, kt_code_down(g, &m->frame, p->alpha), turn);
    kt_op3_name(g, m->omega, "w", i);
    kt_op3_name(g, m->alpha, "al", i);
}

/* Adds the acceleration of the parent's origin and u_r to that of the link's origin, in the link's axes. */
static void shift_link(kt_code_tree *tree, int i, kt_op3 u_r, kt_code_moving *all) {
    kt_graph *g = tree->graph;
    kt_code_moving *m = &all[i];
    const kt_op3 carried = kt_op3_add(g, all[tree->link[i].parent].linear, u_r);
    const kt_op3 linear = kt_op3_add(g, kt_code_rest_down(g, &m->frame, carried), m->linear);
    m->linear = kt_code_from_rest(g, &m->frame, linear);
    kt_op3_name(g, m->linear, "a", i);
}

/* J al + w x J w, with differences of the entries of J, and the entries of U. */
static kt_op3 spin_moment_of(kt_graph *g, const kt_code_link *l, const kt_code_moving *m) {
    const kt_op *jj = l->inertia.x, *ww = m->square;
    kt_op3 out;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const int jj_ = kt_op6_index(j, j), kk = kt_op6_index(k, k), jk = kt_op6_index(j, k);
        const kt_op own = kt_op_multiply(g, jj[kt_op6_index(i, i)], m->alpha.x[i]);
        const kt_op gyro = kt_op_multiply(g, kt_op_subtract(g, jj[kk], jj[jj_]), ww[jk]);
        const kt_op first = kt_op_multiply(g, jj[kt_op6_index(i, j)], m->u.row[k].x[i]);
        const kt_op second = kt_op_multiply(g, jj[kt_op6_index(i, k)], m->u.row[j].x[i]);
        kt_op across = kt_op_multiply(g, jj[jk], kt_op_subtract(g, ww[jj_], ww[kk]));
        across = kt_op_add(g, kt_op_subtract(g, second, first), across);
        out.x[i] = kt_op_add(g, kt_op_add(g, own, gyro), across);
    }
    return out;
}

/* The wrench that link i takes, without the moment of its acceleration. */
static void load_code_link(kt_code_tree *tree, int i, kt_code_moving *m) {
    m->force = kt_op33_apply(tree->graph, &m->u, tree->link[i].moment);
    m->moment = spin_moment_of(tree->graph, &tree->link[i], m);
}

/* Adds the wrench of the acceleration of its origin. */
static void load_code_shift(kt_code_tree *tree, int i, kt_code_moving *m) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[i];
    const kt_op3 h_a = kt_op3_cross(g, l->moment, m->linear);
    m->force = kt_op3_add(g, kt_op3_scale(g, l->mass, m->linear), m->force);
    m->moment = kt_op3_add(g, m->moment, h_a);
}

/* The motion of all links and their own wrenches, link by link. */
static void move_tree(kt_code_tree *tree, bool has_acceleration, kt_code_moving *all) {
    kt_graph *g = tree->graph;
    kt_graph_pass(g);
    for (int i = 1; i < tree->link_count; i++) {
        kt_code_moving *m = &all[i];
        kt_graph_step(g);
        kt_graph_section(g,
                         "%s: motion of link %d in its own axes\n"
                         "w = R'w_p + s v,  al = R'al_p + R'w_p x s v%s,  a = R'(a_p + al_p x r + w_p x (w_p x r))",
                         tree->link[i].name, i, has_acceleration ? " + s a" : "");
        m->frame = kt_code_frame_of(tree, i);
        const kt_op3 u_r = kt_op33_apply(g, &all[tree->link[i].parent].u, m->frame.offset);
        turn_link(tree, i, has_acceleration, all);
        shift_link(tree, i, u_r, all);
        kt_code_multiply_rates(g, m);
        kt_graph_section(g, "%s: f = m a + al x h + w x (w x h),  n = J al + w x J w + h x a", tree->link[i].name);
        load_code_link(tree, i, m);
        load_code_shift(tree, i, m);
    }
}

/* The motion of all links of a chain, and their own wrenches. A separate pass computes everything that does not depend
 * on another link, so that a compiler can turn its loop into vectors. */
static void move_chain(kt_code_tree *tree, bool has_acceleration, kt_code_moving *all) {
    kt_graph *g = tree->graph;
    kt_op3 *u_r = kt_graph_take(g, (size_t)tree->link_count, sizeof *u_r);
    kt_graph_pass(g);
    for (int i = 1; i < tree->link_count && !g->failed; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: rotation of link %d in its own axes\nw = R'w_p + s v,  al = R'al_p + R'w_p x s v%s",
                         tree->link[i].name, i, has_acceleration ? " + s a" : "");
        all[i].frame = kt_code_frame_of(tree, i);
        turn_link(tree, i, has_acceleration, all);
    }
    kt_graph_pass(g);
    for (int i = 0; i < tree->link_count && !g->failed; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: U = [al] + [w][w],  f = U h,  n = J al + w x J w;  U r for the next link",
                         i > 0 ? tree->link[i].name : "ground");
        kt_code_multiply_rates(g, &all[i]);
        if (i > 0)
            load_code_link(tree, i, &all[i]);
        if (i + 1 < tree->link_count)
            u_r[i + 1] = kt_op33_apply(g, &all[i].u, all[i + 1].frame.offset);
    }
    kt_graph_pass(g);
    for (int i = 1; i < tree->link_count && !g->failed; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: acceleration of link %d in its own axes\na = R'(a_p + U_p r)", tree->link[i].name, i);
        shift_link(tree, i, u_r[i], all);
    }
    kt_graph_pass(g);
    for (int i = 1; i < tree->link_count && !g->failed; i++) {
        kt_graph_step(g);
        kt_graph_section(g, "%s: f += m a,  n += h x a", tree->link[i].name);
        load_code_shift(tree, i, &all[i]);
    }
}

void kt_code_move_links(kt_code_tree *tree, bool has_acceleration, kt_code_moving *all) {
    kt_graph *g = tree->graph;
    all[0].omega = all[0].alpha = all[0].force = all[0].moment = kt_op3_zero(g);
    for (int k = 0; k < 3; k++)
        all[0].linear.x[k] = kt_op_negate(g, tree->gravity.x[k]);
    kt_code_multiply_rates(g, &all[0]);
    if (tree->is_uniform)
        move_chain(tree, has_acceleration, all);
    else
        move_tree(tree, has_acceleration, all);
}

void kt_code_inverse_links(kt_code_tree *tree, bool has_acceleration, kt_code_moving *all, kt_op *tau) {
    kt_graph *g = tree->graph;
    kt_code_move_links(tree, has_acceleration, all);
    kt_graph_pass(g);
    for (int i = tree->link_count - 1; i > 0; i--) {
        const kt_code_link *l = &tree->link[i];
        const kt_link *link = l->link;
        kt_code_moving *m = &all[i], *p = &all[l->parent];
        kt_graph_step(g);
        kt_op3_name(g, m->force, "f", i);
        kt_op3_name(g, m->moment, "n", i);
        kt_graph_section(g, "%s: tau = s . (n, f);  the parent carries f and n + r x f", l->name);
        kt_code_project(tree, &m->frame, m->moment, m->force, tau + link->v);
        for (int k = 0; k < kt_link_dofs(link) && has_acceleration; k++)
            tau[link->v + k] = kt_op_add(
                g, tau[link->v + k], kt_op_multiply(g, l->armature[k], kt_code_rate(tree, KT_OP_GIVEN, link->v + k)));
        const kt_op3 force = kt_code_up(g, &m->frame, m->force), r_f = kt_op3_cross(g, m->frame.offset, force);
        const kt_op3 early = kt_op3_add(g, p->moment, r_f); /* the moment of the link is the last to be known */
        p->force = kt_op3_add(g, p->force, force);
        p->moment = kt_op3_add(g, early, kt_code_up(g, &m->frame, m->moment));
    }
    kt_graph_pass(g);
}

void kt_code_inverse(kt_code_tree *tree, bool has_acceleration, kt_op *tau) {
    kt_code_moving *all = kt_graph_take(tree->graph, (size_t)tree->link_count, sizeof *all);
    if (all != NULL)
        kt_code_inverse_links(tree, has_acceleration, all, tau);
}
