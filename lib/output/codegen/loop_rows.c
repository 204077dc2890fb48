/* The equations of a loop between two ends, as in lib/model/loop: relative.h and orientation.h have the derivations.
 *
 * Rows as in loop_row.c:
 *
 *   along e        phi = e . d,           f = e
 *   distance       phi = |d| - L,         f = n = d / |d|,  drift = |n x u|^2 / |d| - L'',  rate = L'
 *
 * loop_orientation.c, loop_surface.c, loop_rolling.c and loop_wheel.c have the others.
 *
 * If two points coincide, the axes e are the ancestor's axes, which turn with the first end at this instant. The
 * library uses the axes of the first end. Both sets differ only by a constant rotation, and have the same solutions. In
 * a plane, two axes lie in the plane, and the third equation vanishes.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"

#include <math.h>
#include <string.h>

/* Axes in which two points coincide, in the ancestor's axes: for a planar loop, the axes within the plane. */
static int coincidence_axes(const kt_code_closing *c, double e[3][3]) {
    const kt_model *model = c->tree->model;
    const kt_loop_record *r = c->record;
    memset(e, 0, 9 * sizeof e[0][0]);
    for (int k = 0; k < 3; k++)
        e[k][k] = 1.0;
    if (!kt_code_loop_is_planar(model, r))
        return 3;
    const int first = model->group_link[model->group[r->group].link];
    int p = 0;
    while (p + 1 < (int)model->n.plane && first - (int)model->n.spatial + 1 >= model->plane[p].last)
        p++;
    kt_vec3 n = model->plane[p].basis.z;
    kt_mat3 turn = kt_mat3_identity();
    for (int i = r->ancestor; i > 0; i = model->link[i].parent)
        if (model->link[i].rest_is_rotated)
            turn = kt_mat3_multiply(kt_link_rest_of(&model->link[i])->axes, turn);
    n = kt_mat3_apply_transposed(turn, n);
    const double x[3] = {n.x, n.y, n.z};
    int most = 0;
    for (int k = 1; k < 3; k++)
        most = fabs(x[k]) > fabs(x[most]) ? k : most;
    const int i = (most + 1) % 3, j = (most + 2) % 3;
    memset(e, 0, 9 * sizeof e[0][0]);
    e[0][i] = e[1][j] = 1.0;
    if (fabs(fabs(x[most]) - 1.0) <= 4.0 * 2.220446049250313e-16)
        return 2;
    const double across = sqrt(x[most] * x[most] + x[i] * x[i]); /* e_0 = n x a_j, e_1 = n x e_0 */
    e[0][i] = x[most] / across;
    e[0][most] = -x[i] / across;
    for (int k = 0; k < 3; k++)
        e[1][k] = x[(k + 1) % 3] * e[0][(k + 2) % 3] - x[(k + 2) % 3] * e[0][(k + 1) % 3];
    return 2;
}

static void add_coincidence(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    double axis[3][3];
    const int count = coincidence_axes(c, axis), first = rows->count;
    for (int k = 0; k < count; k++) {
        kt_code_add_along(c, rows, kt_op3_of(g, axis[k]));
        rows->block[first + k] = first;
    }
}

/* phi = |d| - l, along n = d / |d|: |d|'' - n . d'' = |n x u|^2 / |d|. */
static void add_distance_row(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op norm = kt_op3_length(g, c->d), inverse = kt_op_divide(g, kt_op_number(g, 1.0), norm);
    const kt_op3 n = kt_op3_scale(g, inverse, c->d), across = kt_op3_cross(g, n, c->u);
    kt_code_row row = {.moment = kt_op3_zero(g), .force = n};
    row.phi = kt_op_subtract(g, norm, c->function[0]);
    row.drift = kt_op_subtract(g, kt_op_multiply(g, kt_op3_dot(g, across, across), inverse), c->function[2]);
    kt_code_add_row(c, rows, &row);
    rows->rate[rows->count - 1] = c->function[1];
}

void kt_code_add_end_rows(const kt_code_closing *c, kt_code_loop_rows *rows) {
    const kt_model *model = c->tree->model;
    kt_graph_section(c->tree->graph, "%s: its equations", c->number->name);
    if (c->record->type == KT_LOOP_DISTANCE) {
        add_distance_row(c, rows);
        return;
    }
    const unsigned active = kt_code_active_parts(model, c->record);
    const bool coincide = kt_code_count_coincidence(model, c->record, active) > 0;
    if (coincide)
        add_coincidence(c, rows);
    for (int k = 0; k < 3; k++)
        if (!coincide && (active & 1u << (KT_PART_X + k)))
            kt_code_add_along(c, rows, kt_code_end_axis(c, 0, k));
    if (active & 3u << KT_PART_TILT_X)
        kt_code_add_one_axis(c, rows, active);
    if (active & 7u << KT_PART_ROTATION_X)
        kt_code_add_orientation(c, rows, active);
    if (active & 1u << KT_PART_NORMAL)
        kt_code_add_right_angle(c, rows);
    if (active & (1u << KT_CODE_ADVANCE | 1u << KT_CODE_TURN))
        kt_code_add_turn(c, rows, active);
    if (active & 1u << KT_CODE_SURFACE)
        kt_code_add_surface(c, rows);
    if (active & (1u << KT_CODE_CURVE_FIRST | 1u << KT_CODE_CURVE_SECOND | 1u << KT_CODE_CURVE_ALONG))
        kt_code_add_curve(c, rows, active);
    if (active & (1u << KT_CODE_ROLL_X | 1u << KT_CODE_ROLL_Y | 1u << KT_CODE_ROLL_GAP))
        kt_code_add_rolling(c, rows, active);
    if (active & 1u << KT_CODE_EDGE)
        kt_code_add_edge(c, rows);
    if (active & 3u << KT_CODE_WHEEL)
        kt_code_add_wheels(c, rows, active);
}
