/* Lookup tables of formulas as nodes (expression/lookup.h): each row of a table becomes a choice. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"
#include "expression/expression.h"
#include "expression/lookup.h"

/* The numbers of the row that begins the piece at t, and y_k + s (b_k + s (c_k + s d_k)). */
static kt_op piece_of_rows(kt_graph *g, const double *rows, int count, kt_op t) {
    kt_op row[KT_PIECE_SIZE], sum = kt_op_number(g, 0.0);
    for (int i = 0; i < KT_PIECE_SIZE; i++)
        row[i] = kt_op_number(g, rows[i]);
    for (int k = 1; k + 1 < count; k++) {
        const double *next = rows + (size_t)k * KT_PIECE_SIZE;
        const kt_op before = kt_op_subtract(g, kt_op_number(g, next[KT_PIECE_X]), t);
        for (int i = 0; i < KT_PIECE_SIZE; i++)
            row[i] = kt_op_choose(g, before, row[i], kt_op_number(g, next[i]));
    }
    const kt_op s = kt_op_subtract(g, t, row[KT_PIECE_X]);
    for (int i = KT_PIECE_D; i >= KT_PIECE_Y; i--)
        sum = kt_op_add(g, row[i], kt_op_multiply(g, s, sum));
    return sum;
}

kt_op kt_code_rows(kt_graph *g, const double *rows, int count, kt_op t) {
    const double *last = rows + (size_t)(count - 1) * KT_PIECE_SIZE;
    kt_op sum = piece_of_rows(g, rows, count, t);
    const kt_op before = kt_op_number(g, rows[KT_PIECE_Y]), after = kt_op_number(g, last[KT_PIECE_Y]);
    sum = kt_op_choose(g, kt_op_subtract(g, t, kt_op_number(g, last[KT_PIECE_X])), after, sum);
    return kt_op_choose(g, kt_op_subtract(g, kt_op_number(g, rows[KT_PIECE_X]), t), before, sum);
}

/* Chooses a value before the first number, one behind the last number, or else `inside`. */
static kt_op choose_side(kt_graph *g, kt_op x, double first, double last, const kt_op side[2], kt_op inside) {
    const kt_op behind = kt_op_choose(g, kt_op_subtract(g, x, kt_op_number(g, last)), side[1], inside);
    return kt_op_choose(g, kt_op_subtract(g, kt_op_number(g, first), x), side[0], behind);
}

enum { CODE_TABLE_POINTS = 400 }; /* of a grid, as KT_CODE_TABLE_ROWS */

bool kt_code_has_tables(const kt_expression *formula) {
    for (size_t i = 0; i < formula->count; i++) {
        const kt_expression_term *term = &formula->term[i];
        const double *table = kt_operator_is_lookup((kt_operator)term->code) ? kt_lookup_of(term) : NULL;
        if (table == NULL)
            continue;
        const double points = table[KT_LOOKUP_NX] * table[KT_LOOKUP_NY];
        if (points > (table[KT_LOOKUP_INPUTS] == 2.0 ? CODE_TABLE_POINTS : KT_CODE_TABLE_ROWS))
            return false;
    }
    return true;
}

/* NaN before the first number and behind the last one, since these roots are of negative numbers. */
static kt_op rejected_outside(kt_graph *g, kt_op x, double first, double last, kt_op inside) {
    kt_op side[2];
    side[0] = kt_op_call(g, KT_OP_SQRT, kt_op_subtract(g, x, kt_op_number(g, first)), -1);
    side[1] = kt_op_call(g, KT_OP_SQRT, kt_op_subtract(g, kt_op_number(g, last), x), -1);
    return choose_side(g, x, first, last, side, inside);
}

/* The line through a point, with the slope of the table there. */
static kt_op line_at_edge(kt_graph *g, const double *table, double at, kt_op x) {
    const kt_lookup_piece p = kt_lookup_piece_at(table, at, 0.0);
    const kt_lookup_value value = kt_lookup_evaluate(&p, at, 0.0);
    const kt_op s = kt_op_subtract(g, x, kt_op_number(g, at));
    const kt_op linear = kt_op_scale(g, value.x, s);
    return kt_op_add(g, kt_op_number(g, value.z), linear);
}

/* A table of one input. Outside of the rows, the table holds its last value, repeats, continues along lines, or is
 * rejected. */
static kt_op lookup_of_rows(kt_graph *g, const double *table, kt_op x) {
    const double *rows = table + KT_LOOKUP_HEAD;
    const int count = (int)table[KT_LOOKUP_NX], outside = (int)table[KT_LOOKUP_OUTSIDE];
    const double first = rows[KT_PIECE_X], last = rows[(size_t)(count - 1) * KT_PIECE_SIZE + KT_PIECE_X];
    if (outside == KT_OUTSIDE_HOLD)
        return kt_code_rows(g, rows, count, x);
    if (outside == KT_OUTSIDE_REPEAT) {
        const kt_op origin = kt_op_number(g, first), period = kt_op_number(g, last - first);
        const kt_op turns = kt_op_call(g, KT_OP_FLOOR, kt_op_divide(g, kt_op_subtract(g, x, origin), period), -1);
        const kt_op shift = kt_op_multiply(g, period, turns);
        return piece_of_rows(g, rows, count, kt_op_subtract(g, x, shift));
    }
    const kt_op inside = piece_of_rows(g, rows, count, x);
    if (outside == KT_OUTSIDE_REJECT)
        return rejected_outside(g, x, first, last, inside);
    kt_op side[2];
    side[0] = line_at_edge(g, table, first, x);
    side[1] = line_at_edge(g, table, last, x);
    return choose_side(g, x, first, last, side, inside);
}

/* Chooses, of two neighbouring lines of numbers, those of the interval that x is in: low[j] and high[j]. The numbers of
 * line i are line + i * width. */
static void choose_lines(kt_graph *g, const double *axis, int count, const kt_op *line, int width, kt_op x, kt_op *low,
                         kt_op *high) {
    for (int j = 0; j < width; j++) {
        /* cppcheck-suppress uninitvar ; callers fill count * width numbers */
        low[j] = line[j];
        high[j] = line[width + j];
    }
    for (int i = 1; i + 1 < count; i++) {
        const kt_op before = kt_op_subtract(g, kt_op_number(g, axis[i]), x);
        for (int j = 0; j < width; j++) {
            low[j] = kt_op_choose(g, before, low[j], line[i * width + j]);
            high[j] = kt_op_choose(g, before, high[j], line[(i + 1) * width + j]);
        }
    }
}

/* The share of the interval, and its ends, from the numbers of the axis. */
static kt_op share_of_interval(kt_graph *g, const double *axis, int count, kt_op x) {
    kt_op numbers[CODE_TABLE_POINTS], low, high;
    for (int i = 0; i < count; i++)
        numbers[i] = kt_op_number(g, axis[i]);
    choose_lines(g, axis, count, numbers, 1, x, &low, &high);
    const kt_op s = kt_op_subtract(g, x, low);
    return kt_op_divide(g, s, kt_op_subtract(g, high, low));
}

/* low + share (high - low) */
static kt_op between_of(kt_graph *g, kt_op low, kt_op high, kt_op share) {
    return kt_op_add(g, low, kt_op_multiply(g, share, kt_op_subtract(g, high, low)));
}

/* Interpolates between two lines of the grid by x, and then in the line so made by y. */
static kt_op lookup_of_grid(kt_graph *g, const double *table, kt_op x, kt_op y) {
    const int nx = (int)table[KT_LOOKUP_NX], ny = (int)table[KT_LOOKUP_NY], outside = (int)table[KT_LOOKUP_OUTSIDE];
    const double *axis[2] = {table + KT_LOOKUP_HEAD, table + KT_LOOKUP_HEAD + nx}, *grid = axis[1] + ny;
    kt_op points[CODE_TABLE_POINTS], low[CODE_TABLE_POINTS], high[CODE_TABLE_POINTS], in[2] = {x, y};
    const int count[2] = {nx, ny};
    for (int k = 0; k < 2 && outside == KT_OUTSIDE_HOLD; k++) {
        const double first = axis[k][0], last = axis[k][count[k] - 1];
        kt_op side[2];
        side[0] = kt_op_number(g, first);
        side[1] = kt_op_number(g, last);
        in[k] = choose_side(g, in[k], first, last, side, in[k]);
    }
    for (int i = 0; i < nx * ny; i++)
        points[i] = kt_op_number(g, grid[i]);
    choose_lines(g, axis[0], nx, points, ny, in[0], low, high);
    const kt_op share = share_of_interval(g, axis[0], nx, in[0]);
    for (int j = 0; j < ny; j++)
        points[j] = between_of(g, low[j], high[j], share);
    choose_lines(g, axis[1], ny, points, 1, in[1], low, high);
    kt_op z = between_of(g, low[0], high[0], share_of_interval(g, axis[1], ny, in[1]));
    for (int k = 0; k < 2 && outside == KT_OUTSIDE_REJECT; k++)
        z = rejected_outside(g, in[k], axis[k][0], axis[k][count[k] - 1], z);
    return z;
}

kt_op kt_code_lookup(kt_graph *g, const double *table, kt_op x, kt_op y) {
    if (table == NULL)
        return x;
    return table[KT_LOOKUP_INPUTS] == 2.0 ? lookup_of_grid(g, table, x, y) : lookup_of_rows(g, table, x);
}
