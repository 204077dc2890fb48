/* Wheels that mesh, and ropes between pulleys, as in loop/gear.c, rack.c, worm.c and span.h. Rows as in loop_row.c.
 *
 * The angle beta_k of d in the frame of end k has, with p = d - (z . d) z, h = z x d / |p|^2 and the rate r of d as
 * seen in that frame (loop/plane_angle.h)
 *
 *   k = 1:   r = u,           beta' = h . u,                 drift = -2 (p . r) (h . r) / |p|^2
 *   k = 2:   r = u - w x d,   beta' = h . u - (d x h) . w,   drift likewise, and h . b
 *            b = 2 w_1 x u + w_1 x (w_1 x d) - 2 w_2 x r - w_2 x (w_2 x d)
 *
 * since g of loops.c has the accelerations as seen from the first end. Numbers are folded: radii, angles at the start.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"
#include "loop/plane_angle.h"

/* An angle, or a sum of such: beta, and its row. */
typedef struct code_angle_row {
    kt_op phi;
    kt_code_row row;
} code_angle_row;

/* x less a multiple of a period: the nearest to 0. */
static kt_op op_remainder(kt_graph *g, kt_op x, double period) {
    const double scale = KT_PLANE_TURN / period;
    const kt_op angle = kt_op_scale(g, scale, x), sine = kt_op_call(g, KT_OP_SIN, angle, -1);
    return kt_op_scale(g, 1.0 / scale, kt_op_call(g, KT_OP_ATAN2, sine, kt_op_call(g, KT_OP_COS, angle, -1)));
}

/* d - (z . d) z, the part of d normal to the unit vector z. */
static kt_op3 op_across_less(kt_graph *g, kt_op3 z, kt_op3 d) {
    return kt_op3_subtract(g, d, kt_op3_scale(g, kt_op3_dot(g, z, d), z));
}

/* 2 w x r + w x (w x d) */
static kt_op3 op_swing(kt_graph *g, kt_op3 w, kt_op3 r, kt_op3 d) {
    const kt_op two = kt_op_number(g, 2.0);
    const kt_op3 coriolis = kt_op3_scale(g, two, kt_op3_cross(g, w, r));
    return kt_op3_add(g, coriolis, kt_op3_cross(g, w, kt_op3_cross(g, w, d)));
}

/* beta of the frame of end k, with its row (formulas at the top; k counts from 0). */
static code_angle_row angle_in_frame(const kt_code_closing *c, int k) {
    kt_graph *g = c->tree->graph;
    const kt_op3 z = kt_code_end_axis(c, k, 2), d = c->d, p = op_across_less(g, z, d);
    const kt_op one = kt_op_number(g, 1.0), inverse = kt_op_divide(g, one, kt_op3_dot(g, p, p));
    const kt_op3 h = kt_op3_scale(g, inverse, kt_op3_cross(g, z, d)), w = kt_op3_subtract(g, c->omega[1], c->omega[0]);
    const kt_op3 rate = k == 0 ? c->u : kt_op3_subtract(g, c->u, kt_op3_cross(g, w, d));
    const kt_op y = kt_op3_dot(g, d, kt_code_end_axis(c, k, 1)), x = kt_op3_dot(g, d, kt_code_end_axis(c, k, 0));
    const kt_op phi = kt_op_call(g, KT_OP_ATAN2, y, x);
    code_angle_row a = {.phi = phi, .row = {.force = h, .moment = kt_op3_zero(g)}};
    const kt_op radial = kt_op3_dot(g, p, rate), swept = kt_op_multiply(g, radial, kt_op3_dot(g, h, rate));
    a.row.drift = kt_op_scale(g, -2.0, kt_op_multiply(g, inverse, swept));
    if (k == 1) {
        const kt_op3 first = op_swing(g, c->omega[0], c->u, d);
        const kt_op3 bias = kt_op3_subtract(g, first, op_swing(g, c->omega[1], rate, d));
        a.row.moment = kt_op3_cross(g, h, d);
        a.row.drift = kt_op_add(g, a.row.drift, kt_op3_dot(g, h, bias));
    }
    return a;
}

/* The turn of an end as its joints count it. */
static kt_op turn_of_end(const kt_code_closing *c, int k) {
    kt_graph *g = c->tree->graph;
    const kt_model *model = c->tree->model;
    const kt_loop_record *r = c->record;
    const double *sign = model->number + r->turn + (k == 1 ? r->length[0] : 0);
    kt_op turn = kt_op_number(g, -r->turned[k]);
    for (int i = 0; i < r->length[k] && r->counted; i++)
        if (sign[i] != 0.0) {
            const kt_op q = kt_op_input(g, KT_OP_POSITION, model->link[model->path[r->path[k] + i]].q);
            turn = kt_op_add(g, turn, kt_op_scale(g, sign[i], q));
        }
    return r->counted ? turn : kt_op_number(g, 0.0);
}

static void add_scaled_row(kt_graph *g, double s, const kt_code_row *row, kt_code_row *sum) {
    sum->force = kt_op3_add(g, sum->force, kt_op3_scale(g, kt_op_number(g, s), row->force));
    sum->moment = kt_op3_add(g, sum->moment, kt_op3_scale(g, kt_op_number(g, s), row->moment));
    sum->drift = kt_op_add(g, sum->drift, kt_op_scale(g, s, row->drift));
}

/* c_1 beta_1 + c_2 beta_2 (kt_row_of_angles) */
static kt_code_row row_of_angles(const kt_code_closing *c, const double gain[2]) {
    kt_graph *g = c->tree->graph;
    const kt_loop_record *r = c->record;
    const kt_op3 none = kt_op3_zero(g);
    kt_op seen[2], at_start = kt_op_number(g, 0.0);
    kt_code_row row = {.force = none, .moment = none, .drift = at_start, .phi = at_start};
    for (int k = 0; k < 2; k++) {
        if (gain[k] == 0.0)
            continue;
        const code_angle_row a = angle_in_frame(c, k);
        const kt_op turn = turn_of_end(c, k),
                    start = kt_op_number(g, r->bearing[k] - (r->counted ? r->turned[k] : 0.0));
        const kt_op apart = kt_op_subtract(g, kt_op_add(g, a.phi, turn), start);
        const kt_op alike = k == 0 ? kt_op_number(g, 0.0) : kt_op_scale(g, r->sense, seen[0]);
        seen[k] = kt_op_add(g, alike, op_remainder(g, kt_op_subtract(g, apart, alike), KT_PLANE_TURN));
        row.phi = kt_op_add(g, row.phi, kt_op_scale(g, gain[k], kt_op_subtract(g, seen[k], turn)));
        add_scaled_row(g, gain[k], &a.row, &row);
    }
    return row;
}

/* The row of a span, reduced to its period. */
static kt_code_row row_of_span(const kt_code_closing *c, int side) {
    kt_graph *g = c->tree->graph;
    const kt_loop_record *r = c->record;
    const double s = side == 0 ? 1.0 : -1.0, rho[2] = {s * r->gain[0], s * r->gain[1]}, D = rho[0] - rho[1];
    const double gain[2] = {-rho[0], r->sense * rho[1]};
    const kt_op3 n = kt_code_end_axis(c, 0, 2), p = op_across_less(g, n, c->d);
    const kt_op square = kt_op3_dot(g, p, p), a = kt_op_call(g, KT_OP_SQRT, square, -1), one = kt_op_number(g, 1.0);
    const kt_op length = kt_op_call(g, KT_OP_SQRT, kt_op_subtract(g, square, kt_op_number(g, D * D)), -1);
    const kt_op3 e = kt_op3_scale(g, kt_op_divide(g, one, a), p);
    const kt_op along = kt_op3_dot(g, e, c->u), across = kt_op3_dot(g, kt_op3_cross(g, n, e), c->u);
    const kt_op slope = kt_op_divide(g, length, a);
    kt_code_row row = row_of_angles(c, gain);
    row.force = kt_op3_add(g, row.force, kt_op3_scale(g, slope, e));
    row.phi = kt_op_add(g, row.phi, kt_op_subtract(g, length, kt_op_number(g, r->phase[side])));
    const kt_op curve = kt_op_divide(g, kt_op_multiply(g, across, across), a);
    row.drift = kt_op_add(g, row.drift, kt_op_multiply(g, slope, curve));
    if (D != 0.0) {
        const kt_op delta = kt_op_call(g, KT_OP_ATAN2, kt_op_number(g, D), length);
        const kt_op under = kt_op_multiply(g, square, length);
        const kt_op bent = kt_op_divide(g, kt_op_multiply(g, along, along), under);
        row.phi = kt_op_add(g, row.phi, kt_op_scale(g, D, delta));
        row.drift = kt_op_add(g, row.drift, kt_op_scale(g, D * D, bent));
    }
    row.phi = r->period > 0.0 ? op_remainder(g, row.phi, r->period) : row.phi;
    return row;
}

/* The difference of both spans of a belt, or their sum. */
static kt_code_row row_of_belt(const kt_code_closing *c, int k) {
    kt_graph *g = c->tree->graph;
    const double scale = k == 0 ? 0.5 : 1.0, other = k == 0 ? -0.5 : 1.0;
    const kt_code_row one = row_of_span(c, 0), two = row_of_span(c, 1);
    const kt_op3 none = kt_op3_zero(g);
    kt_code_row row = {.force = none, .moment = none, .drift = kt_op_number(g, 0.0)};
    add_scaled_row(g, scale, &one, &row);
    add_scaled_row(g, other, &two, &row);
    const kt_op first = kt_op_scale(g, scale, one.phi);
    row.phi = kt_op_add(g, first, kt_op_scale(g, other, two.phi));
    return row;
}

/* phi = t . d - gain gamma - phase: t is the rack's axis, which moves with the second end, and gamma its angle about
 * the axis n of the wheel. */
static kt_code_row row_of_rack(const kt_code_closing *c) {
    kt_graph *g = c->tree->graph;
    const kt_loop_record *r = c->record;
    const kt_op3 n = kt_code_end_axis(c, 0, 2), t = kt_code_end_axis(c, 1, 2), d = c->d, *omega = c->omega;
    const kt_op3 w = kt_op3_subtract(g, omega[1], omega[0]), turned = kt_op3_cross(g, w, t);
    const kt_op3 p = op_across_less(g, n, t), rate = kt_op3_subtract(g, c->u, kt_op3_cross(g, w, d));
    const kt_op one = kt_op_number(g, 1.0), inverse = kt_op_divide(g, one, kt_op3_dot(g, p, p));
    const kt_op3 h = kt_op3_scale(g, inverse, kt_op3_cross(g, n, t));
    const kt_op3 first = op_swing(g, omega[0], c->u, d);
    const kt_op3 bias = kt_op3_subtract(g, first, op_swing(g, omega[1], rate, d));
    const kt_op3 inward = kt_op3_cross(g, w, turned);
    const kt_op3 bent = kt_op3_subtract(g, inward, kt_op3_cross(g, kt_op3_cross(g, omega[0], omega[1]), t));
    const kt_op y = kt_op3_dot(g, t, kt_code_end_axis(c, 0, 1)), x = kt_op3_dot(g, t, kt_code_end_axis(c, 0, 0));
    const kt_op angle = kt_op_call(g, KT_OP_ATAN2, y, x);
    const kt_op gamma = kt_op_subtract(g, angle, kt_op_number(g, r->bearing[0]));
    const kt_op turn = op_remainder(g, gamma, KT_PLANE_TURN), travel = kt_op3_dot(g, t, d);
    const kt_op radial = kt_op3_dot(g, p, turned), swept = kt_op_multiply(g, radial, kt_op3_dot(g, h, turned));
    const kt_op swing = kt_op_scale(g, 2.0, kt_op_multiply(g, inverse, swept));
    kt_code_row row = {.force = t, .moment = kt_op3_cross(g, t, d)};
    const kt_op3 none = kt_op3_zero(g), moment = kt_op3_cross(g, t, h);
    const kt_op drift = kt_op_subtract(g, kt_op3_dot(g, h, bent), swing);
    const kt_code_row wheel = {.force = none, .moment = moment, .drift = drift};
    row.drift = kt_op3_dot(g, t, bias);
    add_scaled_row(g, -r->gain[0], &wheel, &row);
    const kt_op phase = kt_op_number(g, r->phase[0]);
    const kt_op start = kt_op_add(g, phase, kt_op_scale(g, r->gain[0], turn));
    row.phi = op_remainder(g, kt_op_subtract(g, travel, start), r->period);
    return row;
}

/* The row of a gear or of a worm. */
static kt_code_row row_of_mesh(const kt_code_closing *c) {
    kt_graph *g = c->tree->graph;
    const kt_loop_record *r = c->record;
    const kt_op3 n = kt_code_end_axis(c, 0, 2);
    kt_code_row row = row_of_angles(c, r->gain);
    if (r->type == KT_LOOP_GEAR && r->slope[1] != 0.0) {
        const kt_op along = kt_op_scale(g, r->slope[1], kt_op3_dot(g, n, c->d));
        row.force = kt_op3_add(g, row.force, kt_op3_scale(g, kt_op_number(g, r->slope[1]), n));
        row.phi = kt_op_add(g, row.phi, kt_op_subtract(g, along, kt_op_number(g, r->phase[0])));
    }
    row.phi = op_remainder(g, row.phi, r->period);
    return row;
}

/* From the second point to the pitch point: C_1 + r_1 e, where e leads from the first wheel to the second or to the
 * rack.
 */
static kt_op3 reach_of_mesh(const kt_code_closing *c) {
    kt_graph *g = c->tree->graph;
    const kt_loop_record *r = c->record;
    const kt_op3 n = kt_code_end_axis(c, 0, 2), p = op_across_less(g, n, c->d);
    const kt_op radius = kt_op_number(g, r->type == KT_LOOP_WORM ? r->radius : r->gain[0]);
    const kt_op one = kt_op_number(g, 1.0);
    const kt_op3 e = r->type == KT_LOOP_RACK ? kt_op3_cross(g, n, kt_code_end_axis(c, 1, 2))
                                             : kt_op3_scale(g, kt_op_divide(g, one, kt_op3_length(g, p)), p);
    return kt_op3_subtract(g, kt_op3_scale(g, radius, e), c->d);
}

void kt_code_add_wheels(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    const kt_loop_record *r = c->record;
    const bool meshes = r->type != KT_LOOP_SPAN && r->type != KT_LOOP_BELT;
    const kt_op pitch = kt_op_number(c->tree->graph, r->gain[1]);
    const kt_op3 reach = meshes ? reach_of_mesh(c) : kt_op3_zero(c->tree->graph);
    for (int k = 0; k < 2; k++) {
        if (!(active & 1u << (KT_CODE_WHEEL + k)))
            continue;
        kt_code_row row = r->type == KT_LOOP_RACK   ? row_of_rack(c)
                          : r->type == KT_LOOP_SPAN ? row_of_span(c, 0)
                          : r->type == KT_LOOP_BELT ? row_of_belt(c, k)
                                                    : row_of_mesh(c);
        row.pitch = meshes ? NULL : &pitch;
        row.reach = &reach;
        kt_code_add_row(c, rows, &row);
    }
}
