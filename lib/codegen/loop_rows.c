/* The equations of a loop between two ends, as in lib/loop: relative.h and orientation.h have the derivations.
 *
 * With d, u and g of loops.c, w = w_2 - w_1, and al = al_2 - al_1, a row with the moment m and the force f has
 *
 *   A v = m . w + f . u,    right = -(m . al + f . g + drift),    rate = 0
 *
 *   along e        phi = e . d,           f = e
 *   distance       phi = |d| - L,         f = n = d / |d|,  drift = |n x u|^2 / |d| - L'',  rate = L'
 *   one axis       phi = F h_k            components of 4 tan(theta / 4) n of the rotation that takes e_z to f_z
 *   orientation    phi = p_k              components of 4 tan(theta / 4) n of the whole rotation
 *   right angle    phi = 2 tan(eps / 2),  sin(eps) = e_z . f_z
 *
 * If two points coincide, the axes e are those of the ancestor, turned with the first end at this instant. The library
 * takes those of the first end. Both sets are equal but for a constant rotation, and have the same solutions. In a
 * plane two of them lie in it, and the third equation is void. Orientations are regular up to half a turn.
 */
#include "codegen/loop_rows.h"
#include "constraint/group.h"
#include "loop/loop.h"

#include <math.h>
#include <string.h>

/* ---- which equations --------------------------------------------------------------------------------------------- */

static bool is_in_plane(const kt_model *model, const kt_loop_record *loop) {
    return model->n.planar_loop > 0 && kt_group_is_planar(model, &model->group[loop->group]);
}

/* The equations of types, in the order of lib/loop; types without them cannot be generated, or have no parts. */
static const unsigned char part_of_type[KT_LOOP_TYPE_COUNT][KT_LOOP_ROW_MAX] = {
    [KT_LOOP_SPHERICAL] = {KT_PART_X, KT_PART_Y, KT_PART_Z},
    [KT_LOOP_INLINE] = {KT_PART_X, KT_PART_Y},
    [KT_LOOP_INPLANE] = {KT_PART_Z},
    [KT_LOOP_PARALLEL] = {KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z},
    [KT_LOOP_COAXIAL] = {KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_ORTHOGONAL] = {KT_PART_NORMAL},
    [KT_LOOP_REVOLUTE] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_PRISMATIC] = {KT_PART_X, KT_PART_Y, KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z},
    [KT_LOOP_CYLINDRICAL] = {KT_PART_X, KT_PART_Y, KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_PLANAR] = {KT_PART_Z, KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_WELD] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z},
    [KT_LOOP_UNIVERSAL] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_NORMAL},
};

enum { CODE_POINT = 1 << KT_PART_X | 1 << KT_PART_Y | 1 << KT_PART_Z };

/* Whether an equation of a loop is among the independent ones that were chosen when the model was compiled. */
static bool is_chosen(const kt_model *model, const kt_loop_record *r, int row) {
    const kt_group *group = &model->group[r->group];
    const int32_t slot = kt_rows_slots(model, group, r)[row];
    return slot >= 0 && (group->rank[KT_ROWS_ALL] == group->count[KT_ROWS_ALL] ||
                         model->weight[KT_ROWS_ALL * model->n.row + (size_t)(group->row + slot)] >= KT_PREFERRED);
}

/* The parts whose equations are not void, and chosen. */
static unsigned active_parts(const kt_model *model, const kt_loop_record *r) {
    unsigned active = 0;
    if (is_in_plane(model, r)) {
        const kt_planar_loop *flat = &model->planar_loop[r - model->loop];
        for (int i = 0; i < flat->count; i++)
            if (is_chosen(model, r, flat->row[i].row))
                active |= 1u << part_of_type[r->type][flat->row[i].row];
    } else {
        for (int i = 0; i < KT_LOOP_ROW_MAX && part_of_type[r->type][i] != KT_PART_NONE; i++)
            if (is_chosen(model, r, i))
                active |= 1u << part_of_type[r->type][i];
    }
    return active;
}

static int count_bits(unsigned x) {
    int count = 0;
    for (; x > 0; x &= x - 1)
        count++;
    return count;
}

/* The equations with which both points of a loop coincide, in any axes; 0: there are fewer. */
static int count_coincidence(const kt_model *model, const kt_loop_record *r, unsigned active) {
    const int least = is_in_plane(model, r) ? 2 : 3;
    return count_bits(active & CODE_POINT) >= least ? least : 0;
}

/* Whether a loop has one equation with a function of time. */
static bool has_function(const kt_loop_record *r) {
    return r->type == KT_LOOP_DISTANCE || r->type == KT_LOOP_COUPLING || r->type == KT_LOOP_MOTION ||
           r->type == KT_LOOP_RATES;
}

bool kt_code_has_loop_type(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (r->group < 0) /* it is switched off */
        return false;
    if (has_function(r))
        return kt_code_has_curve(model, &r->curve);
    return r->type >= 0 && r->type < KT_LOOP_TYPE_COUNT && part_of_type[r->type][0] != KT_PART_NONE;
}

int kt_code_rows_of_loop(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (!kt_code_has_loop_type(model, loop))
        return 0;
    if (has_function(r))
        return is_chosen(model, r, 0) ? 1 : 0;
    const unsigned active = active_parts(model, r);
    const int points = count_coincidence(model, r, active);
    return points > 0 ? points + count_bits(active & ~(unsigned)CODE_POINT) : count_bits(active);
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* A row, with its numbers as in loop/loop.h. */
typedef struct code_row {
    kt_op3 moment, force;
    kt_op phi, drift;
} code_row;

static kt_op3 column_of_axes(const kt_op33 *axes, int k) {
    return (kt_op3){{axes->row[0].x[k], axes->row[1].x[k], axes->row[2].x[k]}};
}

static void add_code_row(const kt_code_closing *c, kt_code_loop_rows *rows, const code_row *row, bool is_angle) {
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
        size[v] = is_angle ? kt_op3_dot(g, w, w) : kt_op3_dot(g, u, u);
        kt_op_name(g, a[v], "A%d_%d", at, (int)v);
    }
    rows->phi[at] = row->phi;
    rows->rate[at] = kt_op_number(g, 0.0);
    rows->scaled[at] = is_angle ? row->phi : kt_op_divide(g, row->phi, c->tree->loop_length);
    const kt_op3 alpha = kt_op3_subtract(g, c->alpha[1], c->alpha[0]);
    const kt_op linear = kt_op_add(g, kt_op3_dot(g, row->moment, alpha), kt_op3_dot(g, row->force, c->bias));
    rows->right[at] = kt_op_negate(g, kt_op_add(g, linear, row->drift));
}

static void add_along(const kt_code_closing *c, kt_code_loop_rows *rows, kt_op3 e) {
    kt_graph *g = c->tree->graph;
    const code_row row = {
        .moment = kt_op3_zero(g), .force = e, .phi = kt_op3_dot(g, e, c->d), .drift = kt_op_number(g, 0.0)};
    add_code_row(c, rows, &row, false);
}

/* Axes in which two points coincide, in the ancestor's axes: in a plane those that lie in it. */
static int coincidence_axes(const kt_code_closing *c, double e[3][3]) {
    const kt_model *model = c->tree->model;
    const kt_loop_record *r = c->record;
    memset(e, 0, 9 * sizeof e[0][0]);
    for (int k = 0; k < 3; k++)
        e[k][k] = 1.0;
    if (!is_in_plane(model, r))
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
        add_along(c, rows,
                  (kt_op3){{kt_op_number(g, axis[k][0]), kt_op_number(g, axis[k][1]), kt_op_number(g, axis[k][2])}});
        rows->block[first + k] = first;
    }
}

static void add_distance(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op norm = kt_op3_length(g, c->d), inverse = kt_op_divide(g, kt_op_number(g, 1.0), norm);
    const kt_op3 n = kt_op3_scale(g, inverse, c->d), across = kt_op3_cross(g, n, c->u);
    const code_row row = {
        .moment = kt_op3_zero(g),
        .force = n,
        .phi = kt_op_subtract(g, norm, c->function[0]),
        .drift = kt_op_subtract(g, kt_op_multiply(g, kt_op3_dot(g, across, across), inverse), c->function[2])};
    add_code_row(c, rows, &row, false);
    rows->rate[rows->count - 1] = c->function[1];
}

/* ---- orientations ------------------------------------------------------------------------------------------------ */

/* w = w_2 - w_1, and w_1 x w_2 */
static kt_op3 relative_spin(const kt_code_closing *c, kt_op3 *turning) {
    *turning = kt_op3_cross(c->tree->graph, c->omega[0], c->omega[1]);
    return kt_op3_subtract(c->tree->graph, c->omega[1], c->omega[0]);
}

static kt_op scale_op(kt_graph *g, double s, kt_op a) { return kt_op_multiply(g, kt_op_number(g, s), a); }

static kt_op power_of(kt_graph *g, kt_op a, int n) { return n == 1 ? a : kt_op_multiply(g, a, power_of(g, a, n - 1)); }

/* e_z along f_z (kt_row_coaxial): h = (-e_y . f, e_x . f), b = cos(theta / 2), F = 2 / (b (1 + b)), and F', F'' by
 * e . f. */
static void add_one_axis(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0);
    const kt_op3 x = column_of_axes(&c->axes[0], 0), y = column_of_axes(&c->axes[0], 1);
    const kt_op3 e = column_of_axes(&c->axes[0], 2), f = column_of_axes(&c->axes[1], 2);
    const kt_op3 side[2] = {kt_op3_scale(g, kt_op_number(g, -1.0), y), x};
    kt_op3 turning;
    const kt_op3 w = relative_spin(c, &turning);
    const kt_op h[2] = {kt_op3_dot(g, side[0], f), kt_op3_dot(g, side[1], f)};
    const kt_op half = scale_op(g, 0.5, kt_op_add(g, one, kt_op3_dot(g, e, f)));
    const kt_op b = kt_op_call(g, KT_OP_SQRT, half, -1), sum = kt_op_add(g, one, b);
    const kt_op f0 = kt_op_divide(g, kt_op_number(g, 2.0), kt_op_multiply(g, b, sum));
    const kt_op cube = kt_op_multiply(g, half, b); /* b^3 */
    const kt_op f1 = kt_op_negate(g, kt_op_divide(g, kt_op_add(g, one, scale_op(g, 2.0, b)),
                                                  scale_op(g, 2.0, kt_op_multiply(g, cube, power_of(g, sum, 2)))));
    const kt_op over = kt_op_add(g, kt_op_number(g, 3.0),
                                 kt_op_multiply(g, b, kt_op_add(g, kt_op_number(g, 9.0), scale_op(g, 8.0, b))));
    const kt_op under = scale_op(g, 8.0, kt_op_multiply(g, kt_op_multiply(g, half, cube), power_of(g, sum, 3)));
    const kt_op f2 = kt_op_divide(g, over, under);
    const kt_op3 across = kt_op3_cross(g, f, e), bias = kt_op3_cross(g, w, kt_op3_cross(g, w, f));
    const kt_op c1 = kt_op3_dot(g, w, across), c2 = kt_op3_dot(g, e, bias);
    const kt_op bent = kt_op_add(g, kt_op_multiply(g, f2, kt_op_multiply(g, c1, c1)), kt_op_multiply(g, f1, c2));
    for (int k = 0; k < 2; k++) {
        if (!(active & 1u << (KT_PART_TILT_X + k)))
            continue;
        const kt_op3 lever = kt_op3_cross(g, f, side[k]);
        const kt_op3 m =
            kt_op3_add(g, kt_op3_scale(g, f0, lever), kt_op3_scale(g, kt_op_multiply(g, f1, h[k]), across));
        const kt_op first = kt_op_multiply(g, f0, kt_op3_dot(g, side[k], bias));
        const kt_op second = scale_op(g, 2.0, kt_op_multiply(g, kt_op_multiply(g, f1, c1), kt_op3_dot(g, w, lever)));
        const kt_op drift = kt_op_add(g, kt_op_add(g, first, second), kt_op_multiply(g, bent, h[k]));
        const code_row row = {.moment = m,
                              .force = kt_op3_zero(g),
                              .phi = kt_op_multiply(g, f0, h[k]),
                              .drift = kt_op_subtract(g, drift, kt_op3_dot(g, m, turning))};
        add_code_row(c, rows, &row, true);
    }
}

/* Equal orientation (kt_row_parallel): q = (c, e) from the entries e_j . f_k, and p = 4 e / (1 + c). */
static void add_orientation(const kt_code_closing *c, kt_code_loop_rows *rows, unsigned active) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0);
    kt_op r[3][3];
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++)
            r[j][k] = kt_op3_dot(g, column_of_axes(&c->axes[0], j), column_of_axes(&c->axes[1], k));
    const kt_op trace = kt_op_add(g, kt_op_add(g, r[0][0], r[1][1]), r[2][2]);
    const kt_op twice = kt_op_call(g, KT_OP_SQRT, kt_op_add(g, one, trace), -1); /* 2 cos(theta / 2) */
    /* 4 / (1 + c) / (4 c) = 2 / (c' (1 + c' / 2)) with c' = 2 c */
    const kt_op scale =
        kt_op_divide(g, kt_op_number(g, 2.0), kt_op_multiply(g, twice, kt_op_add(g, one, scale_op(g, 0.5, twice))));
    kt_op component[3];
    kt_op3 p = kt_op3_zero(g), turning;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        component[k] = kt_op_multiply(g, scale, kt_op_subtract(g, r[j][i], r[i][j]));
        p = kt_op3_add(g, p, kt_op3_scale(g, component[k], column_of_axes(&c->axes[0], k)));
    }
    const kt_op3 w = relative_spin(c, &turning);
    const kt_op s = scale_op(g, 1.0 / 16.0, kt_op3_dot(g, p, p)), pw = kt_op3_dot(g, p, w), ww = kt_op3_dot(g, w, w);
    const int first = rows->count;
    for (int k = 0; k < 3; k++) {
        if (!(active & 1u << (KT_PART_ROTATION_X + k)))
            continue;
        const kt_op3 e = column_of_axes(&c->axes[0], k);
        kt_op3 m = kt_op3_scale(g, kt_op_subtract(g, one, s), e);
        m = kt_op3_add(g, m, kt_op3_scale(g, kt_op_number(g, 0.5), kt_op3_cross(g, p, e)));
        m = kt_op3_add(g, m, kt_op3_scale(g, scale_op(g, 0.125, component[k]), p));
        const kt_op bent = scale_op(g, 0.25, kt_op_multiply(g, pw, kt_op3_dot(g, m, w)));
        const kt_op back =
            scale_op(g, 0.125, kt_op_multiply(g, kt_op_multiply(g, kt_op_add(g, one, s), ww), component[k]));
        const code_row row = {.moment = m,
                              .force = kt_op3_zero(g),
                              .phi = component[k],
                              .drift = kt_op_subtract(g, kt_op_subtract(g, bent, back), kt_op3_dot(g, m, turning))};
        add_code_row(c, rows, &row, true);
        if (count_bits(active & 7u << KT_PART_ROTATION_X) == 3)
            rows->block[rows->count - 1] = first;
    }
}

/* e_z and f_z at a right angle (kt_row_orthogonal): c = e . f, s = |e x f|, G' = 2 / (s (1 + s)) and G''. */
static void add_right_angle(const kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    const kt_op one = kt_op_number(g, 1.0);
    const kt_op3 e = column_of_axes(&c->axes[0], 2), f = column_of_axes(&c->axes[1], 2);
    kt_op3 turning;
    const kt_op3 w = relative_spin(c, &turning), lever = kt_op3_cross(g, f, e);
    const kt_op cosine = kt_op3_dot(g, e, f), s = kt_op3_length(g, lever), sum = kt_op_add(g, one, s);
    const kt_op g1 = kt_op_divide(g, kt_op_number(g, 2.0), kt_op_multiply(g, s, sum));
    const kt_op over = kt_op_multiply(g, scale_op(g, 2.0, cosine), kt_op_add(g, one, scale_op(g, 2.0, s)));
    const kt_op g2 = kt_op_divide(g, over, kt_op_multiply(g, power_of(g, s, 3), power_of(g, sum, 2)));
    const kt_op c1 = kt_op3_dot(g, w, lever), c2 = kt_op3_dot(g, e, kt_op3_cross(g, w, kt_op3_cross(g, w, f)));
    const kt_op3 m = kt_op3_scale(g, g1, lever);
    const kt_op bent = kt_op_add(g, kt_op_multiply(g, g1, c2), kt_op_multiply(g, g2, kt_op_multiply(g, c1, c1)));
    const code_row row = {.moment = m,
                          .force = kt_op3_zero(g),
                          .phi = kt_op_divide(g, scale_op(g, 2.0, cosine), sum),
                          .drift = kt_op_subtract(g, bent, kt_op3_dot(g, m, turning))};
    add_code_row(c, rows, &row, true);
}

void kt_code_add_end_rows(const kt_code_closing *c, kt_code_loop_rows *rows) {
    const kt_model *model = c->tree->model;
    kt_graph_section(c->tree->graph, "%s: its equations", c->number->name);
    if (c->record->type == KT_LOOP_DISTANCE) {
        add_distance(c, rows);
        return;
    }
    const unsigned active = active_parts(model, c->record);
    const bool coincide = count_coincidence(model, c->record, active) > 0;
    if (coincide)
        add_coincidence(c, rows);
    for (int k = 0; k < 3; k++)
        if (!coincide && (active & 1u << (KT_PART_X + k)))
            add_along(c, rows, column_of_axes(&c->axes[0], k));
    if (active & 3u << KT_PART_TILT_X)
        add_one_axis(c, rows, active);
    if (active & 7u << KT_PART_ROTATION_X)
        add_orientation(c, rows, active);
    if (active & 1u << KT_PART_NORMAL)
        add_right_angle(c, rows);
}
