/* Rows of loops that prescribe an orientation. loop/orientation.h derives them, and loop_row.c describes rows.
 *
 * Frame 1 has the axes e_k, and frame 2 the axes f_k. A rotation by theta about the axis n has the vector
 *     p = 4 tan(theta / 4) n
 *
 *   orientation    phi = e_k . p            p of the rotation from frame 1 to frame 2, k = x, y, z
 *   one axis       phi = e_k . p            p of the rotation that takes e_z to f_z, k = x, y
 *   right angle    phi = 2 tan(eps / 2)     sin(eps) = e_z . f_z
 *   homokinetic    phi = 4 tan(theta / 4)   theta: the angle between the frames about their axes
 *   screw          phi = e_z . d - pitch theta
 *
 * Each phi is regular as long as its rotation is below half a turn.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"

/* w = w_2 - w_1, and w_1 x w_2 */
static kt_op3 relative_spin(const kt_code_closing *c, kt_op3 *turning) {
    *turning = kt_op3_cross(c->tree->graph, c->omega[0], c->omega[1]);
    return kt_op3_subtract(c->tree->graph, c->omega[1], c->omega[0]);
}

static kt_op op_power(kt_graph *g, kt_op a, int n) { return n == 1 ? a : kt_op_multiply(g, a, op_power(g, a, n - 1)); }

/* e_z along f_z (kt_row_coaxial): h = (-e_y . f, e_x . f), b = cos(theta / 2), F = 2 / (b (1 + b)), and F', F'' by
 * e . f. */
void kt_code_add_one_axis(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0), two = kt_op_number(g, 2.0);
    const kt_op three = kt_op_number(g, 3.0), nine = kt_op_number(g, 9.0);
    const kt_op3 x = kt_code_end_axis(c, 0, 0), y = kt_code_end_axis(c, 0, 1);
    const kt_op3 e = kt_code_end_axis(c, 0, 2), f = kt_code_end_axis(c, 1, 2);
    const kt_op3 side[2] = {kt_op3_scale(g, kt_op_number(g, -1.0), y), x};
    kt_op3 turning;
    const kt_op3 w = relative_spin(c, &turning);
    const kt_op h_x = kt_op3_dot(g, side[0], f), h[2] = {h_x, kt_op3_dot(g, side[1], f)};
    const kt_op half = kt_op_scale(g, 0.5, kt_op_add(g, one, kt_op3_dot(g, e, f)));
    const kt_op b = kt_op_call(g, KT_OP_SQRT, half, -1), sum = kt_op_add(g, one, b);
    const kt_op f0 = kt_op_divide(g, two, kt_op_multiply(g, b, sum));
    const kt_op cube = kt_op_multiply(g, half, b); /* b^3 */
    kt_op under = kt_op_scale(g, 2.0, kt_op_multiply(g, cube, op_power(g, sum, 2)));
    const kt_op f1 = kt_op_negate(g, kt_op_divide(g, kt_op_add(g, one, kt_op_scale(g, 2.0, b)), under));
    const kt_op over = kt_op_add(g, three, kt_op_multiply(g, b, kt_op_add(g, nine, kt_op_scale(g, 8.0, b))));
    under = op_power(g, sum, 3);
    under = kt_op_scale(g, 8.0, kt_op_multiply(g, kt_op_multiply(g, half, cube), under));
    const kt_op f2 = kt_op_divide(g, over, under);
    const kt_op3 across = kt_op3_cross(g, f, e), bias = kt_op3_cross(g, w, kt_op3_cross(g, w, f));
    const kt_op c1 = kt_op3_dot(g, w, across), c2 = kt_op3_dot(g, e, bias);
    const kt_op bent = kt_op_add_products(g, f2, kt_op_multiply(g, c1, c1), f1, c2);
    for (int k = 0; k < 2; k++) {
        if (!(active & 1u << (KT_PART_TILT_X + k)))
            continue;
        const kt_op3 lever = kt_op3_cross(g, f, side[k]);
        const kt_op3 m = kt_op3_combine(g, f0, lever, kt_op_multiply(g, f1, h[k]), across);
        const kt_op first = kt_op_multiply(g, f0, kt_op3_dot(g, side[k], bias));
        const kt_op rate = kt_op3_dot(g, w, lever), third = kt_op_multiply(g, bent, h[k]);
        const kt_op second = kt_op_scale(g, 2.0, kt_op_multiply(g, kt_op_multiply(g, f1, c1), rate));
        const kt_op drift = kt_op_add(g, kt_op_add(g, first, second), third);
        kt_code_row row = {.moment = m, .force = kt_op3_zero(g), .measure = KT_CODE_ANGLE};
        row.phi = kt_op_multiply(g, f0, h[k]);
        row.drift = kt_op_subtract(g, drift, kt_op3_dot(g, m, turning));
        kt_code_add_row(c, rows, &row);
    }
}

/* Equal orientation (kt_row_parallel): q = (c, e) from the entries e_j . f_k, and p = 4 e / (1 + c). */
void kt_code_add_orientation(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0), two = kt_op_number(g, 2.0), half = kt_op_number(g, 0.5);
    kt_op r[3][3];
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++)
            r[j][k] = kt_op3_dot(g, kt_code_end_axis(c, 0, j), kt_code_end_axis(c, 1, k));
    const kt_op trace = kt_op_add(g, kt_op_add(g, r[0][0], r[1][1]), r[2][2]);
    const kt_op twice = kt_op_call(g, KT_OP_SQRT, kt_op_add(g, one, trace), -1); /* 2 cos(theta / 2) */
    /* 4 / (1 + c) / (4 c) = 2 / (c' (1 + c' / 2)) with c' = 2 c */
    const kt_op scale = kt_op_divide(g, two, kt_op_multiply(g, twice, kt_op_add(g, one, kt_op_scale(g, 0.5, twice))));
    kt_op component[3];
    kt_op3 p = kt_op3_zero(g), turning;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        component[k] = kt_op_multiply(g, scale, kt_op_subtract(g, r[j][i], r[i][j]));
        p = kt_op3_add(g, p, kt_op3_scale(g, component[k], kt_code_end_axis(c, 0, k)));
    }
    const kt_op3 w = relative_spin(c, &turning);
    const kt_op s = kt_op_scale(g, 1.0 / 16.0, kt_op3_dot(g, p, p)), pw = kt_op3_dot(g, p, w), ww = kt_op3_dot(g, w, w);
    const int first = rows->count;
    for (int k = 0; k < 3; k++) {
        if (!(active & 1u << (KT_PART_ROTATION_X + k)))
            continue;
        const kt_op3 e = kt_code_end_axis(c, 0, k);
        kt_op3 m = kt_op3_scale(g, kt_op_subtract(g, one, s), e);
        m = kt_op3_add(g, m, kt_op3_scale(g, half, kt_op3_cross(g, p, e)));
        m = kt_op3_add(g, m, kt_op3_scale(g, kt_op_scale(g, 0.125, component[k]), p));
        const kt_op bent = kt_op_scale(g, 0.25, kt_op_multiply(g, pw, kt_op3_dot(g, m, w)));
        const kt_op back =
            kt_op_scale(g, 0.125, kt_op_multiply(g, kt_op_multiply(g, kt_op_add(g, one, s), ww), component[k]));
        const kt_op carried = kt_op3_dot(g, m, turning);
        kt_code_row row = {.moment = m, .force = kt_op3_zero(g), .phi = component[k], .measure = KT_CODE_ANGLE};
        row.drift = kt_op_subtract(g, kt_op_subtract(g, bent, back), carried);
        kt_code_add_row(c, rows, &row);
        if ((active >> KT_PART_ROTATION_X & 7u) == 7u)
            rows->block[rows->count - 1] = first;
    }
}

/* e_z and f_z at a right angle (kt_row_orthogonal): c = e . f, s = |e x f|, G' = 2 / (s (1 + s)) and G''. */
void kt_code_add_right_angle(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0), two = kt_op_number(g, 2.0);
    const kt_op3 e = kt_code_end_axis(c, 0, 2), f = kt_code_end_axis(c, 1, 2);
    kt_op3 turning;
    const kt_op3 w = relative_spin(c, &turning), lever = kt_op3_cross(g, f, e);
    const kt_op cosine = kt_op3_dot(g, e, f), s = kt_op3_length(g, lever), sum = kt_op_add(g, one, s);
    const kt_op g1 = kt_op_divide(g, two, kt_op_multiply(g, s, sum)), twice = kt_op_multiply(g, two, cosine);
    const kt_op over = kt_op_multiply(g, twice, kt_op_add(g, one, kt_op_scale(g, 2.0, s))), cube = op_power(g, s, 3);
    const kt_op g2 = kt_op_divide(g, over, kt_op_multiply(g, cube, op_power(g, sum, 2)));
    const kt_op c1 = kt_op3_dot(g, w, lever), c2 = kt_op3_dot(g, e, kt_op3_cross(g, w, kt_op3_cross(g, w, f)));
    const kt_op3 m = kt_op3_scale(g, g1, lever);
    const kt_op bent = kt_op_add_products(g, g1, c2, g2, kt_op_multiply(g, c1, c1));
    kt_code_row row = {.moment = m, .force = kt_op3_zero(g), .measure = KT_CODE_ANGLE};
    row.phi = kt_op_divide(g, twice, sum);
    row.drift = kt_op_subtract(g, bent, kt_op3_dot(g, m, turning));
    kt_code_add_row(c, rows, &row);
}

/* A multiple of the cosine and the sine of an angle. */
typedef struct code_angle {
    kt_op cosine, sine;
} code_angle;

static code_angle code_angle_of(kt_graph *g, kt_op angle) {
    const kt_op cosine = kt_op_call(g, KT_OP_COS, angle, -1);
    return (code_angle){cosine, kt_op_call(g, KT_OP_SIN, angle, -1)};
}

/* From a to b. */
static code_angle code_angle_between(kt_graph *g, code_angle a, code_angle b) {
    const kt_op cosine = kt_op_add_products(g, a.cosine, b.cosine, a.sine, b.sine);
    return (code_angle){cosine, kt_op_subtract_products(g, a.cosine, b.sine, a.sine, b.cosine)};
}

/* d_z - pitch theta, less whole turns. */
static kt_op advance_of_screw(kt_graph *g, kt_op pitch, kt_op along, code_angle theta) {
    if (kt_op_is(g, pitch, 0.0))
        return along;
    const code_angle left = code_angle_between(g, theta, code_angle_of(g, kt_op_divide(g, along, pitch)));
    return kt_op_multiply(g, pitch, kt_op_call(g, KT_OP_ATAN2, left.sine, left.cosine));
}

/* The angle theta about both z axes (kt_axis_turn_of): with e = e_z, f = f_z, c = e . f and k = (e + f) / (1 + c)
 *
 *   theta' = k . w,   (1 + c) cos(theta) = e_x . f_x + e_y . f_y,   (1 + c) sin(theta) = e_y . f_x - e_x . f_y
 *
 * theta is counted from its value at the start, a parameter whose sine and cosine are prepared. In the same way the
 * advance d_z of a screw is an angle psi = d_z / pitch, and phi = pitch (psi - theta) is within half a turn. */
void kt_code_add_turn(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0);
    const kt_op3 x = kt_code_end_axis(c, 0, 0), y = kt_code_end_axis(c, 0, 1), e = kt_code_end_axis(c, 0, 2);
    const kt_op3 fx = kt_code_end_axis(c, 1, 0), fy = kt_code_end_axis(c, 1, 1), f = kt_code_end_axis(c, 1, 2);
    kt_op3 turning;
    const kt_op3 w = relative_spin(c, &turning);
    const kt_op sum = kt_op_add(g, one, kt_op3_dot(g, e, f)), inverse = kt_op_divide(g, one, sum);
    const kt_op3 k = kt_op3_scale(g, inverse, kt_op3_add(g, e, f));
    const kt_op rate = kt_op3_dot(g, k, w), opening = kt_op3_dot(g, w, kt_op3_cross(g, f, e));
    const kt_op swept = kt_op_multiply(g, kt_op_multiply(g, rate, opening), inverse);
    const kt_op bias = kt_op_negate(g, kt_op_add(g, swept, kt_op3_dot(g, k, turning)));
    const kt_op x_fy = kt_op3_dot(g, x, fy);
    code_angle theta = {.sine = kt_op_subtract(g, kt_op3_dot(g, y, fx), x_fy)};
    theta.cosine = kt_op3_add_dots(g, x, fx, y, fy);
    const code_angle turn = code_angle_between(g, code_angle_of(g, c->number->angle), theta);
    if (active & 1u << KT_CODE_ADVANCE) {
        const kt_op pitch = c->number->pitch;
        kt_code_row row = {.moment = kt_op3_scale(g, kt_op_negate(g, pitch), k), .force = e, .pitch = &pitch};
        row.phi = advance_of_screw(g, pitch, kt_op3_dot(g, e, c->d), turn);
        row.drift = kt_op_negate(g, kt_op_multiply(g, pitch, bias));
        kt_code_add_row(c, rows, &row);
        return;
    }
    /* p = 4 tan(theta / 4) from b = cos(theta / 2) */
    const kt_op cosine = kt_op_multiply(g, turn.cosine, inverse), sine = kt_op_multiply(g, turn.sine, inverse);
    const kt_op b = kt_op_call(g, KT_OP_SQRT, kt_op_scale(g, 0.5, kt_op_add(g, one, cosine)), -1);
    const kt_op under = kt_op_multiply(g, b, kt_op_add(g, one, b)),
                p = kt_op_divide(g, kt_op_scale(g, 2.0, sine), under);
    const kt_op slope = kt_op_add(g, one, kt_op_scale(g, 1.0 / 16.0, kt_op_multiply(g, p, p)));
    const kt_op bent = kt_op_scale(g, 0.125, kt_op_multiply(g, p, kt_op_multiply(g, rate, rate)));
    kt_code_row row = {.force = kt_op3_zero(g), .phi = p, .measure = KT_CODE_ANGLE};
    row.moment = kt_op3_scale(g, slope, k);
    row.drift = kt_op_multiply(g, slope, kt_op_add(g, bias, bent));
    kt_code_add_row(c, rows, &row);
}
