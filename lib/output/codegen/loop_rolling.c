/* Rolling and skating, as in loop/rolling.c and loop/knife_edge.c. Rows as in loop_row.c.
 *
 * Skate: with the axis a = f_z of the second end, f = a and drift = (w x a) . u.
 *
 * Disc: the second end is its centre C with the axle a, the first end is a frame of the plane with the normal n. So w
 * and u are the motion of the disc as seen in the plane. No number depends on the distance of the plane's point. With c
 * = n . a and s = |n x a|:
 *
 *   t  = a x (n x a) / s             from the lowest point of the disc, P = C + p, to its centre; p = -rho t
 *   t' = -(c' a + c a' + s' t) / s,  a' = w x a, c' = n . a', s' = -c c' / s
 *
 * The disc's velocity at P relative to the plane is y = u + w x p. A row along k = x, y or n has
 *
 *   f = k,  m = p x k,  drift = k . (w x p' - (w_1 x w_2) x p)
 *
 * since w' as seen in the plane is al_2 - al_1 - w_1 x w. The row along n is the rate of the gap phi = n . d - rho s.
 * A disc that lies flat, s = 0, stops the function.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"

/* The place of contact of a disc. */
typedef struct code_disc_contact {
    kt_op s;
    kt_op3 t, rate; /* t' */
} code_disc_contact;

/* s, t and t' of the top. turn: w, the angular velocity of the disc as seen from the plane. */
static code_disc_contact contact_of_disc(const kt_code_closing *c, kt_op3 n, kt_op3 turn) {
    kt_graph *g = c->tree->graph;
    code_disc_contact at;
    const kt_op3 a = kt_code_end_axis(c, 1, 2), across = kt_op3_cross(g, n, a), moved = kt_op3_cross(g, turn, a);
    const kt_op cosine = kt_op3_dot(g, n, a), rate = kt_op3_dot(g, n, moved);
    at.s = kt_op3_length(g, across);
    const kt_op inverse = kt_op_divide(g, kt_op_number(g, 1.0), at.s);
    at.t = kt_op3_scale(g, inverse, kt_op3_cross(g, a, across));
    const kt_op closing = kt_op_multiply(g, kt_op_multiply(g, cosine, rate), inverse); /* -s' */
    kt_op3 sum = kt_op3_combine(g, rate, a, cosine, moved);
    sum = kt_op3_subtract(g, sum, kt_op3_scale(g, closing, at.t));
    at.rate = kt_op3_scale(g, kt_op_negate(g, inverse), sum);
    return at;
}

void kt_code_add_rolling(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const kt_op radius = c->number->radius;
    const kt_op3 n = kt_code_end_axis(c, 0, 2), w = kt_op3_subtract(g, c->omega[1], c->omega[0]);
    const code_disc_contact at = contact_of_disc(c, n, w);
    const kt_op back = kt_op_negate(g, radius);
    const kt_op3 p = kt_op3_scale(g, back, at.t), moved = kt_op3_scale(g, back, at.rate);
    const kt_op3 turned = kt_op3_cross(g, kt_op3_cross(g, c->omega[0], c->omega[1]), p);
    const kt_op3 bias = kt_op3_subtract(g, kt_op3_cross(g, w, moved), turned);
    const kt_op height = kt_op_multiply(g, radius, at.s); /* of the centre */
    for (int k = 0; k < 3; k++) {
        if (!(active & 1u << (KT_CODE_ROLL_X + k)))
            continue;
        const kt_op3 along = kt_code_end_axis(c, 0, k);
        kt_code_row row = {.moment = kt_op3_cross(g, p, along), .force = along, .reach = &p};
        row.phi = kt_op_subtract(g, kt_op3_dot(g, n, c->d), height);
        row.drift = kt_op3_dot(g, along, bias);
        row.measure = k < 2 ? KT_CODE_VELOCITY : KT_CODE_LENGTH;
        kt_code_add_row(c, rows, &row);
    }
}

void kt_code_add_edge(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op3 a = kt_code_end_axis(c, 1, 2), w = kt_op3_subtract(g, c->omega[1], c->omega[0]);
    kt_code_row row = {.moment = kt_op3_zero(g), .force = a, .measure = KT_CODE_VELOCITY};
    row.phi = kt_op_number(g, 0.0);
    row.drift = kt_op3_dot(g, kt_op3_cross(g, w, a), c->u);
    kt_code_add_row(c, rows, &row);
}
