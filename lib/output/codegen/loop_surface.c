/* Points on surfaces, lines and circles, as in loop/point_on_surface.c and loop/point_on_curve.c. Rows as in
 * loop_row.c.
 *
 * The second point lies at d and moves at u relative to the first end. h is the part of d normal to e_z. With
 * y = e_z . d, rho = |h|, m = h / rho, t = e_z x m, and g = t . u:
 *
 *   plane      phi = y            f = e_z                  drift = 0
 *   cylinder   phi = rho - R      f = m                    drift = g^2 / rho
 *   sphere     phi = |d| - R      f = n = d / |d|          drift = |n x u|^2 / |d|
 *   torus      phi = tau - r      f = (s m + y e_z) / tau  drift = (s' y - y' s)^2 / tau^3 + s g^2 / (rho tau)
 *              s = rho - R, tau = |(s, y)|
 *   line       phi = -e_y . d, e_x . d, and y - f(t)
 *   circle     phi = R - rho, y, and R alpha - f(t) with the angle alpha of h; along it
 *              f = (R / rho) t    drift = -2 (R / rho^2) (m . u) g
 *
 * Whole turns of a circle are not counted. On the axis, at the centre and on the circle in the tube a division by zero
 * stops the function.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"

/* The second point about the first end's z axis. */
typedef struct code_around {
    kt_op3 e, m, t;
    kt_op y, rho, inverse; /* 1 / rho */
    kt_op g, out;          /* t . u and m . u */
} code_around;

static code_around point_around_axis(const kt_code_closing *c) {
    kt_graph *g = c->tree->graph;
    code_around a = {.e = kt_code_end_axis(c, 0, 2)};
    a.y = kt_op3_dot(g, a.e, c->d);
    const kt_op3 h = kt_op3_subtract(g, c->d, kt_op3_scale(g, a.y, a.e));
    a.rho = kt_op3_length(g, h);
    a.inverse = kt_op_divide(g, kt_op_number(g, 1.0), a.rho);
    a.m = kt_op3_scale(g, a.inverse, h);
    a.t = kt_op3_cross(g, a.e, a.m);
    a.g = kt_op3_dot(g, a.t, c->u);
    a.out = kt_op3_dot(g, a.m, c->u);
    return a;
}

static void add_on_cylinder(const kt_code_closing *c, kt_code_loop_rows *rows, double sign) {
    kt_graph *g = c->tree->graph;
    const code_around a = point_around_axis(c);
    const kt_op s = kt_op_number(g, sign);
    const kt_op bent = kt_op_multiply(g, kt_op_multiply(g, a.g, a.g), a.inverse);
    kt_code_row row = {.moment = kt_op3_zero(g)};
    row.force = kt_op3_scale(g, s, a.m);
    row.phi = kt_op_multiply(g, s, kt_op_subtract(g, a.rho, c->number->radius));
    row.drift = kt_op_multiply(g, s, bent);
    kt_code_add_row(c, rows, &row);
}

static void add_on_sphere(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op norm = kt_op3_length(g, c->d), inverse = kt_op_divide(g, kt_op_number(g, 1.0), norm);
    const kt_op3 n = kt_op3_scale(g, inverse, c->d), across = kt_op3_cross(g, n, c->u);
    kt_code_row row = {.moment = kt_op3_zero(g), .force = n};
    row.phi = kt_op_subtract(g, norm, c->number->radius);
    row.drift = kt_op_multiply(g, kt_op3_dot(g, across, across), inverse);
    kt_code_add_row(c, rows, &row);
}

static void add_on_torus(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const code_around a = point_around_axis(c);
    const kt_op s = kt_op_subtract(g, a.rho, c->number->radius), axial = kt_op3_dot(g, a.e, c->u);
    const kt_op square = kt_op_add_products(g, s, s, a.y, a.y);
    const kt_op tau = kt_op_call(g, KT_OP_SQRT, square, -1), inverse = kt_op_divide(g, kt_op_number(g, 1.0), tau);
    const kt_op3 n = kt_op3_scale(g, inverse, kt_op3_combine(g, s, a.m, a.y, a.e));
    const kt_op difference = kt_op_subtract_products(g, a.out, a.y, axial, s);
    const kt_op swept = kt_op_multiply(g, difference, inverse);
    const kt_op around = kt_op_multiply(g, s, kt_op_multiply(g, kt_op_multiply(g, a.g, a.g), a.inverse));
    kt_code_row row = {.moment = kt_op3_zero(g), .force = n};
    row.phi = kt_op_subtract(g, tau, c->number->tube);
    row.drift = kt_op_multiply(g, kt_op_add(g, kt_op_multiply(g, swept, swept), around), inverse);
    kt_code_add_row(c, rows, &row);
}

void kt_code_add_surface(const kt_code_closing *c, kt_code_loop_rows *rows) {
    switch ((kt_surface_type)c->record->form) {
    case KT_SURFACE_CYLINDER:
        add_on_cylinder(c, rows, 1.0);
        break;
    case KT_SURFACE_SPHERE:
        add_on_sphere(c, rows);
        break;
    case KT_SURFACE_TORUS:
        add_on_torus(c, rows);
        break;
    default:
        kt_code_add_along(c, rows, kt_code_end_axis(c, 0, 2));
        break;
    }
}

/* R alpha - f, less whole turns. */
static kt_op arc_of_circle(const kt_code_closing *c) {
    kt_graph *g = c->tree->graph;
    const kt_op goal = kt_op_divide(g, c->function[0], c->number->radius);
    const kt_op x = kt_op3_dot(g, kt_code_end_axis(c, 0, 0), c->d), y = kt_op3_dot(g, kt_code_end_axis(c, 0, 1), c->d);
    const kt_op cosine = kt_op_call(g, KT_OP_COS, goal, -1), sine = kt_op_call(g, KT_OP_SIN, goal, -1);
    const kt_op over = kt_op_subtract_products(g, y, cosine, x, sine);
    const kt_op under = kt_op_add_products(g, x, cosine, y, sine);
    return kt_op_multiply(g, c->number->radius, kt_op_call(g, KT_OP_ATAN2, over, under));
}

/* The arc length. */
static void add_along_curve(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    kt_code_row row = {.moment = kt_op3_zero(g)};
    if (c->record->form == KT_TRACK_LINE) {
        row.force = kt_code_end_axis(c, 0, 2);
        row.phi = kt_op_subtract(g, kt_op3_dot(g, row.force, c->d), c->function[0]);
        row.drift = kt_op_negate(g, c->function[2]);
    } else {
        const code_around a = point_around_axis(c);
        const kt_op ratio = kt_op_multiply(g, c->number->radius, a.inverse), rates = kt_op_multiply(g, a.out, a.g);
        const kt_op swept = kt_op_multiply(g, kt_op_multiply(g, ratio, a.inverse), rates);
        row.force = kt_op3_scale(g, ratio, a.t);
        row.phi = arc_of_circle(c);
        row.drift = kt_op_negate(g, kt_op_add(g, kt_op_scale(g, 2.0, swept), c->function[2]));
    }
    kt_code_add_row(c, rows, &row);
    rows->rate[rows->count - 1] = c->function[1];
}

void kt_code_add_curve(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const bool is_line = c->record->form == KT_TRACK_LINE;
    if (active & 1u << KT_CODE_CURVE_FIRST && is_line)
        kt_code_add_along(c, rows, kt_op3_scale(g, kt_op_number(g, -1.0), kt_code_end_axis(c, 0, 1)));
    else if (active & 1u << KT_CODE_CURVE_FIRST)
        add_on_cylinder(c, rows, -1.0);
    if (active & 1u << KT_CODE_CURVE_SECOND)
        kt_code_add_along(c, rows, kt_code_end_axis(c, 0, is_line ? 0 : 2));
    if (active & 1u << KT_CODE_CURVE_ALONG)
        add_along_curve(c, rows);
}
