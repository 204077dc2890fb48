/* Motions of joints, as nodes: the pose of a link is a rotation about a coordinate axis or of a quaternion, then the
 * constant rotation at rest.
 *
 * An inertia is rotated about axis k by 2 x 2 blocks. With d = J_ii - J_jj, s = sin, c = cos,
 *
 *   t = s^2 d + 2 s c J_ij    J_ii' = J_ii - t    J_jj' = J_jj + t    J_ij' = J_ij + s c d - 2 s^2 J_ij
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/node_tree.h"

kt_code_frame kt_code_frame_of(kt_code_tree *tree, int link) {
    kt_graph *g = tree->graph;
    const kt_code_link *l = &tree->link[link];
    const kt_op q = kt_op_input(g, KT_OP_POSITION, l->link->q);
    kt_code_frame f = {.link = l, .cosine = -1};
    kt_op3 moved = kt_op3_zero(g);
    kt_op p[4];
    switch (kt_code_motion(l)) {
    case KT_MOTION_SCREW:
        moved.x[l->link->axis] = kt_op_multiply(g, l->pitch, q);
        /* fall through */
    case KT_MOTION_REVOLUTE:
        f.cosine = kt_op_input(g, KT_OP_COSINE, l->link->angle);
        f.sine = kt_op_input(g, KT_OP_SINE, l->link->angle);
        f.square = kt_op_multiply(g, f.sine, f.sine);
        f.product = kt_op_multiply(g, f.sine, f.cosine);
        break;
    case KT_MOTION_PRISMATIC:
        moved.x[l->link->axis] = q;
        break;
    case KT_MOTION_FREE:
        for (int k = 0; k < 3; k++)
            moved.x[k] = kt_op_input(g, KT_OP_POSITION, l->link->q + k);
        /* fall through */
    case KT_MOTION_SPHERICAL:
        for (int k = 0; k < 4; k++)
            p[k] = kt_op_input(g, KT_OP_POSITION, l->link->q + kt_link_lengths(l->link) + k);
        f.turn = kt_op33_of_quaternion(g, p);
        break;
    case KT_MOTION_NONE:
        break;
    }
    f.offset = kt_op3_add(g, l->at, kt_code_rest_up(g, &f, moved));
    return f;
}

static bool is_turned_by_quaternion(const kt_code_frame *f) {
    return kt_motion_facts_of(kt_code_motion(f->link)).quaternions > 0;
}

kt_op3 kt_code_to_rest(kt_graph *g, const kt_code_frame *f, kt_op3 a) {
    const int k = f->link->link->axis, i = (k + 1) % 3, j = (k + 2) % 3;
    kt_op3 out = a;
    if (is_turned_by_quaternion(f))
        return kt_op33_apply(g, &f->turn, a);
    if (f->cosine < 0)
        return a;
    out.x[i] = kt_op_subtract_products(g, f->cosine, a.x[i], f->sine, a.x[j]);
    out.x[j] = kt_op_add_products(g, f->sine, a.x[i], f->cosine, a.x[j]);
    return out;
}

kt_op3 kt_code_from_rest(kt_graph *g, const kt_code_frame *f, kt_op3 a) {
    kt_code_frame back = *f;
    if (is_turned_by_quaternion(f))
        return kt_op33_apply_transposed(g, &f->turn, a);
    back.sine = f->cosine < 0 ? f->sine : kt_op_negate(g, f->sine);
    return kt_code_to_rest(g, &back, a);
}

kt_op3 kt_code_rest_up(kt_graph *g, const kt_code_frame *f, kt_op3 a) {
    return f->link->is_rotated ? kt_op33_apply(g, &f->link->rest, a) : a;
}

kt_op3 kt_code_rest_down(kt_graph *g, const kt_code_frame *f, kt_op3 a) {
    return f->link->is_rotated ? kt_op33_apply_transposed(g, &f->link->rest, a) : a;
}

kt_op3 kt_code_up(kt_graph *g, const kt_code_frame *f, kt_op3 a) {
    return kt_code_rest_up(g, f, kt_code_to_rest(g, f, a));
}

kt_op3 kt_code_down(kt_graph *g, const kt_code_frame *f, kt_op3 a) {
    return kt_code_from_rest(g, f, kt_code_rest_down(g, f, a));
}

/* K = R J R' for a rotation about axis k. With d = J_ii - J_jj and t = sin^2 d + 2 sin cos J_ij
 *     K_ii = J_ii - t,   K_jj = J_jj + t,   K_ij = J_ij + sin cos d - 2 sin^2 J_ij */
static kt_op6 turn_code_inertia(kt_graph *g, const kt_code_frame *f, const kt_op6 *inertia) {
    const int k = f->link->link->axis, i = (k + 1) % 3, j = (k + 2) % 3;
    const int ii = kt_op6_index(i, i), jj = kt_op6_index(j, j), ij = kt_op6_index(i, j);
    const int ik = kt_op6_index(i, k), jk = kt_op6_index(j, k);
    const kt_op *a = inertia->x;
    kt_op6 out = *inertia;
    const kt_op d = kt_op_subtract(g, a[ii], a[jj]), twice = kt_op_scale(g, 2.0, a[ij]);
    const kt_op t = kt_op_add_products(g, f->square, d, f->product, twice);
    const kt_op u = kt_op_subtract_products(g, f->product, d, f->square, twice);
    out.x[ii] = kt_op_subtract(g, a[ii], t);
    out.x[jj] = kt_op_add(g, a[jj], t);
    out.x[ij] = kt_op_add(g, a[ij], u);
    out.x[ik] = kt_op_subtract_products(g, f->cosine, a[ik], f->sine, a[jk]);
    out.x[jk] = kt_op_add_products(g, f->sine, a[ik], f->cosine, a[jk]);
    return out;
}

kt_op6 kt_code_inertia_to_rest(kt_graph *g, const kt_code_frame *f, const kt_op6 *j) {
    if (is_turned_by_quaternion(f))
        return kt_op6_rotate(g, &f->turn, j);
    return f->cosine >= 0 ? turn_code_inertia(g, f, j) : *j;
}

kt_op6 kt_code_inertia_rest_up(kt_graph *g, const kt_code_frame *f, const kt_op6 *j) {
    return f->link->is_rotated ? kt_op6_rotate(g, &f->link->rest, j) : *j;
}

kt_op6 kt_code_up_inertia(kt_graph *g, const kt_code_frame *f, const kt_op6 *j) {
    const kt_op6 at_rest = kt_code_inertia_to_rest(g, f, j);
    return kt_code_inertia_rest_up(g, f, &at_rest);
}

/* H' = R H R' for a rotation R about axis k, without symmetry. In the plane of i and j, with s = sin, c = cos,
 * d = H_ii - H_jj and e = H_ij + H_ji,
 *
 *     H_ii' = H_ii - t    H_jj' = H_jj + t    t = s^2 d + s c e
 *     H_ij' = H_ij + u    H_ji' = H_ji + u    u = s c d - s^2 e
 *
 * Column k and row k turn as vectors; H_kk stays. */
static kt_op33 turn_matrix(kt_graph *g, const kt_code_frame *f, const kt_op33 *h) {
    const int k = f->link->link->axis, i = (k + 1) % 3, j = (k + 2) % 3;
    const kt_op33 a = *h;
    kt_op33 out = a;
    const kt_op d = kt_op_subtract(g, a.row[i].x[i], a.row[j].x[j]), e = kt_op_add(g, a.row[i].x[j], a.row[j].x[i]);
    const kt_op t = kt_op_add_products(g, f->square, d, f->product, e);
    const kt_op u = kt_op_subtract_products(g, f->product, d, f->square, e);
    out.row[i].x[i] = kt_op_subtract(g, a.row[i].x[i], t);
    out.row[j].x[j] = kt_op_add(g, a.row[j].x[j], t);
    out.row[i].x[j] = kt_op_add(g, a.row[i].x[j], u);
    out.row[j].x[i] = kt_op_add(g, a.row[j].x[i], u);
    const kt_op3 column = kt_code_to_rest(g, f, (kt_op3){{a.row[0].x[k], a.row[1].x[k], a.row[2].x[k]}});
    const kt_op3 row = kt_code_to_rest(g, f, a.row[k]);
    out.row[i].x[k] = column.x[i];
    out.row[j].x[k] = column.x[j];
    out.row[k].x[i] = row.x[i];
    out.row[k].x[j] = row.x[j];
    return out;
}

kt_op33 kt_code_matrix_to_rest(kt_graph *g, const kt_code_frame *f, const kt_op33 *h) {
    if (is_turned_by_quaternion(f))
        return kt_op33_rotate(g, &f->turn, h);
    return f->cosine >= 0 ? turn_matrix(g, f, h) : *h;
}

kt_op33 kt_code_matrix_rest_up(kt_graph *g, const kt_code_frame *f, const kt_op33 *h) {
    return f->link->is_rotated ? kt_op33_rotate(g, &f->link->rest, h) : *h;
}
