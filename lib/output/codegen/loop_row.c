/* One row of the equations of a loop. With d, u and g of loops.c, w = w_2 - w_1, and al = al_2 - al_1, a row with the
 * moment m and the force f has
 *
 *   A v = m . w + f . u,    right = -(m . al + f . g + drift),    rate = 0
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"

#include <string.h>

/* The square of the entry that a row would have for a velocity along the direction of the row. */
static kt_op square_of_entry(kt_graph *g, const kt_code_row *row, kt_op3 w, kt_op3 u) {
    const kt_op turned = kt_op3_dot(g, w, w);
    if (row->measure == KT_CODE_ANGLE)
        return turned;
    const kt_op3 there = row->reach != NULL ? kt_op3_add(g, u, kt_op3_cross(g, w, *row->reach)) : u;
    const kt_op square = kt_op3_dot(g, there, there);
    return row->pitch == NULL
               ? square
               : kt_op_add(g, square, kt_op_multiply(g, kt_op_multiply(g, *row->pitch, *row->pitch), turned));
}

void kt_code_add_row(const kt_code_closing *c, kt_code_loop_rows *rows, const kt_code_row *row) {
    kt_graph *g = c->tree->graph;
    const size_t nv = c->tree->model->n.v;
    const int at = rows->count++;
    kt_op *a = rows->a + (size_t)at * nv, *size = rows->size + (size_t)at * nv;
    rows->loop[at] = (int)(c->record - c->tree->model->loop);
    rows->block[at] = at;
    for (size_t v = 0; v < nv; v++) {
        kt_op3 w, u;
        memcpy(w.x, c->column + 6 * v, sizeof w.x);
        memcpy(u.x, c->column + 6 * v + 3, sizeof u.x);
        a[v] = kt_op3_add_dots(g, row->moment, w, row->force, u);
        size[v] = square_of_entry(g, row, w, u);
        kt_op_name(g, a[v], "A%d_%d", at, (int)v);
    }
    rows->is_closed[at] = row->measure != KT_CODE_VELOCITY;
    rows->phi[at] = rows->is_closed[at] ? row->phi : kt_op_number(g, 0.0);
    rows->rate[at] = kt_op_number(g, 0.0);
    rows->scaled[at] = row->measure == KT_CODE_ANGLE ? row->phi : kt_op_divide(g, rows->phi[at], c->tree->loop_length);
    const kt_op3 alpha = kt_op3_subtract(g, c->alpha[1], c->alpha[0]);
    const kt_op linear = kt_op3_add_dots(g, row->moment, alpha, row->force, c->bias);
    rows->right[at] = kt_op_negate(g, kt_op_add(g, linear, row->drift));
}

void kt_code_add_along(const kt_code_closing *c, kt_code_loop_rows *rows, kt_op3 e) {
    kt_graph *g = c->tree->graph;
    kt_code_row row = {.moment = kt_op3_zero(g), .force = e};
    row.phi = kt_op3_dot(g, e, c->d);
    row.drift = kt_op_number(g, 0.0);
    kt_code_add_row(c, rows, &row);
}
