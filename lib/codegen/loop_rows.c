/* The equations of a loop between two ends, as in lib/loop: relative.h and orientation.h have the derivations.
 *
 * With d, u and g of loops.c, w = w_2 - w_1, and al = al_2 - al_1, a row with the moment m and the force f has
 *
 *   A v = m . w + f . u,    right = -(m . al + f . g + drift),    rate = 0
 *
 *   along e        phi = e . d,           f = e
 *   distance       phi = |d| - L,         f = n = d / |d|,  drift = |n x u|^2 / |d| - L'',  rate = L'
 *
 * loop_orientation.c, loop_surface.c and loop_rolling.c have the others.
 *
 * If two points coincide, the axes e are those of the ancestor, turned with the first end at this instant. The library
 * takes those of the first end. Both sets are equal but for a constant rotation, and have the same solutions. In a
 * plane two of them lie in it, and the third equation is void.
 */
#include "codegen/loop_rows.h"

#include <math.h>
#include <string.h>

/* The square of the entry that a row would have for a velocity if it lay along its direction. */
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
        a[v] = kt_op_add(g, kt_op3_dot(g, row->moment, w), kt_op3_dot(g, row->force, u));
        size[v] = square_of_entry(g, row, w, u);
        kt_op_name(g, a[v], "A%d_%d", at, (int)v);
    }
    rows->is_closed[at] = row->measure != KT_CODE_VELOCITY;
    rows->phi[at] = rows->is_closed[at] ? row->phi : kt_op_number(g, 0.0);
    rows->rate[at] = kt_op_number(g, 0.0);
    rows->scaled[at] = row->measure == KT_CODE_ANGLE ? row->phi : kt_op_divide(g, rows->phi[at], c->tree->loop_length);
    const kt_op3 alpha = kt_op3_subtract(g, c->alpha[1], c->alpha[0]);
    const kt_op linear = kt_op_add(g, kt_op3_dot(g, row->moment, alpha), kt_op3_dot(g, row->force, c->bias));
    rows->right[at] = kt_op_negate(g, kt_op_add(g, linear, row->drift));
}

void kt_code_add_along(const kt_code_closing *c, kt_code_loop_rows *rows, kt_op3 e) {
    kt_graph *g = c->tree->graph;
    const kt_code_row row = {
        .moment = kt_op3_zero(g), .force = e, .phi = kt_op3_dot(g, e, c->d), .drift = kt_op_number(g, 0.0)};
    kt_code_add_row(c, rows, &row);
}

/* Axes in which two points coincide, in the ancestor's axes: in a plane those that lie in it. */
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
        kt_code_add_along(
            c, rows, (kt_op3){{kt_op_number(g, axis[k][0]), kt_op_number(g, axis[k][1]), kt_op_number(g, axis[k][2])}});
        rows->block[first + k] = first;
    }
}

static void add_distance(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op norm = kt_op3_length(g, c->d), inverse = kt_op_divide(g, kt_op_number(g, 1.0), norm);
    const kt_op3 n = kt_op3_scale(g, inverse, c->d), across = kt_op3_cross(g, n, c->u);
    const kt_code_row row = {
        .moment = kt_op3_zero(g),
        .force = n,
        .phi = kt_op_subtract(g, norm, c->function[0]),
        .drift = kt_op_subtract(g, kt_op_multiply(g, kt_op3_dot(g, across, across), inverse), c->function[2])};
    kt_code_add_row(c, rows, &row);
    rows->rate[rows->count - 1] = c->function[1];
}

void kt_code_add_end_rows(const kt_code_closing *c, kt_code_loop_rows *rows) {
    const kt_model *model = c->tree->model;
    kt_graph_section(c->tree->graph, "%s: its equations", c->number->name);
    if (c->record->type == KT_LOOP_DISTANCE) {
        add_distance(c, rows);
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
}
