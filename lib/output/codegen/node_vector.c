/* Vectors, rotations and symmetric matrices of nodes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/node_vector.h"

kt_op3 kt_op3_of(kt_graph *g, const double v[3]) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op_number(g, v[k]);
    return out;
}

kt_op3 kt_op3_zero(kt_graph *g) { return kt_op3_of(g, (const double[3]){0.0}); }

kt_op3 kt_op3_add(kt_graph *g, kt_op3 a, kt_op3 b) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op_add(g, a.x[k], b.x[k]);
    return out;
}

kt_op3 kt_op3_subtract(kt_graph *g, kt_op3 a, kt_op3 b) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op_subtract(g, a.x[k], b.x[k]);
    return out;
}

kt_op3 kt_op3_scale(kt_graph *g, kt_op s, kt_op3 a) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op_multiply(g, s, a.x[k]);
    return out;
}

kt_op3 kt_op3_combine(kt_graph *g, kt_op s, kt_op3 a, kt_op t, kt_op3 b) {
    const kt_op3 second = kt_op3_scale(g, t, b);
    return kt_op3_add(g, kt_op3_scale(g, s, a), second);
}

kt_op3 kt_op3_cross(kt_graph *g, kt_op3 a, kt_op3 b) {
    kt_op3 out;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out.x[k] = kt_op_subtract_products(g, a.x[i], b.x[j], a.x[j], b.x[i]);
    }
    return out;
}

kt_op kt_op3_dot(kt_graph *g, kt_op3 a, kt_op3 b) {
    const kt_op xy = kt_op_add_products(g, a.x[0], b.x[0], a.x[1], b.x[1]);
    return kt_op_add(g, xy, kt_op_multiply(g, a.x[2], b.x[2]));
}

kt_op kt_op3_add_dots(kt_graph *g, kt_op3 a, kt_op3 b, kt_op3 c, kt_op3 d) {
    const kt_op second = kt_op3_dot(g, c, d);
    return kt_op_add(g, kt_op3_dot(g, a, b), second);
}

kt_op kt_op3_length(kt_graph *g, kt_op3 a) { return kt_op_call(g, KT_OP_SQRT, kt_op3_dot(g, a, a), -1); }

void kt_op3_name(kt_graph *g, kt_op3 a, const char *name, int number) {
    for (int k = 0; k < 3; k++)
        kt_op_name(g, a.x[k], "%s%d%c", name, number, "xyz"[k]);
}

/* ---- matrices ---------------------------------------------------------------------------------------------------- */

kt_op33 kt_op33_of(kt_graph *g, const double m[3][3]) {
    kt_op33 out;
    for (int i = 0; i < 3; i++)
        out.row[i] = kt_op3_of(g, m[i]);
    return out;
}

kt_op3 kt_op33_apply(kt_graph *g, const kt_op33 *m, kt_op3 a) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op3_dot(g, m->row[k], a);
    return out;
}

kt_op33 kt_op33_transpose(const kt_op33 *m) {
    kt_op33 out;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out.row[i].x[j] = m->row[j].x[i];
    return out;
}

kt_op3 kt_op33_apply_transposed(kt_graph *g, const kt_op33 *m, kt_op3 a) {
    const kt_op33 t = kt_op33_transpose(m);
    return kt_op33_apply(g, &t, a);
}

kt_op33 kt_op33_multiply(kt_graph *g, const kt_op33 *a, const kt_op33 *b) {
    const kt_op33 t = kt_op33_transpose(b);
    kt_op33 out;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out.row[i].x[j] = kt_op3_dot(g, a->row[i], t.row[j]);
    return out;
}

kt_op33 kt_op33_rotate(kt_graph *g, const kt_op33 *r, const kt_op33 *h) {
    const kt_op33 half = kt_op33_multiply(g, r, h), back = kt_op33_transpose(r);
    return kt_op33_multiply(g, &half, &back);
}

/* R = (1 - p'q) 1 + p q' + q0 [p x]   with p = 2 q / |(q0, q)|^2 */
kt_op33 kt_op33_of_quaternion(kt_graph *g, const kt_op q[4]) {
    kt_op square = kt_op_multiply(g, q[0], q[0]), p[3], product[3][3], turn[3];
    for (int k = 1; k < 4; k++)
        square = kt_op_add(g, square, kt_op_multiply(g, q[k], q[k]));
    const kt_op scale = kt_op_divide(g, kt_op_number(g, 2.0), square), one = kt_op_number(g, 1.0);
    for (int i = 0; i < 3; i++) {
        p[i] = kt_op_multiply(g, scale, q[i + 1]);
        turn[i] = kt_op_multiply(g, p[i], q[0]);
    }
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            product[i][j] = product[j][i] = kt_op_multiply(g, p[i], q[j + 1]);
    kt_op33 out;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out.row[i].x[i] = kt_op_subtract(g, one, kt_op_add(g, product[j][j], product[k][k]));
        out.row[i].x[j] = kt_op_subtract(g, product[i][j], turn[k]);
        out.row[i].x[k] = kt_op_add(g, product[i][k], turn[j]);
    }
    return out;
}

/* ---- symmetric matrices ------------------------------------------------------------------------------------------ */

int kt_op6_index(int row, int column) {
    static const int index[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    return index[row][column];
}

kt_op kt_op6_at(const kt_op6 *j, int row, int column) { return j->x[kt_op6_index(row, column)]; }

kt_op6 kt_op6_zero(kt_graph *g) {
    kt_op6 out;
    for (int k = 0; k < 6; k++)
        out.x[k] = kt_op_number(g, 0.0);
    return out;
}

kt_op6 kt_op6_add(kt_graph *g, const kt_op6 *a, const kt_op6 *b) {
    kt_op6 out;
    for (int k = 0; k < 6; k++)
        out.x[k] = kt_op_add(g, a->x[k], b->x[k]);
    return out;
}

static kt_op33 full_op6(const kt_op6 *j) {
    kt_op33 out;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            out.row[i].x[k] = kt_op6_at(j, i, k);
    return out;
}

kt_op3 kt_op6_apply(kt_graph *g, const kt_op6 *j, kt_op3 a) {
    const kt_op33 full = full_op6(j);
    return kt_op33_apply(g, &full, a);
}

kt_op6 kt_op6_rotate(kt_graph *g, const kt_op33 *r, const kt_op6 *j) {
    const kt_op33 full = full_op6(j), half = kt_op33_multiply(g, r, &full);
    kt_op6 out = kt_op6_zero(g);
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++)
            out.x[kt_op6_index(i, k)] = kt_op3_dot(g, half.row[i], r->row[k]);
    return out;
}

kt_op6 kt_op6_inertia_of(kt_graph *g, kt_op3 a, kt_op3 b) {
    kt_op product[3];
    kt_op6 out;
    for (int k = 0; k < 3; k++)
        product[k] = kt_op_multiply(g, a.x[k], b.x[k]);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const kt_op both = kt_op_add_products(g, a.x[i], b.x[j], a.x[j], b.x[i]);
        out.x[kt_op6_index(i, i)] = kt_op_scale(g, 2.0, kt_op_add(g, product[j], product[k]));
        out.x[kt_op6_index(i, j)] = kt_op_negate(g, both);
    }
    return out;
}
