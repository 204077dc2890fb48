/* Groups of closed contacts in range space: half_columns.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/half_columns.h"

#include "reduction/half_square.h"

#include <assert.h>

enum { LANES = KT_HALF_LANES };

/* The place of the arrays among a group's matrices. */
enum {
#define PLACE(name, count, meaning) PLACE_OF_##name,
    KT_GROUP_FIELDS(PLACE)
#undef PLACE
        HALF_COLUMNS = PLACE_OF_half_columns
};

_Static_assert(sizeof(kt_half) <= KT_HALF_HEAD * sizeof(double), "the struct has room before its arrays");

KT_INLINE kt_half *half_of(const kt_model *model, const kt_data *data, size_t g) {
    const kt_group *group = &model->group[g];
    return (kt_half *)(void *)(data->dense + group->dense + group->at[HALF_COLUMNS]);
}

/* Sizes of a group, and the arrays behind the struct. */
KT_INLINE void lay_out_half(const kt_group *group, kt_half *h) {
    h->m = group->v_count;
    h->rank = group->rank[KT_ROWS_ALL];
    h->n = (h->rank + LANES - 1) / LANES;
    const size_t m = (size_t)h->m, n = (size_t)h->n;
    char *at = (char *)h + KT_HALF_HEAD * sizeof(double);
    assert((uintptr_t)at % sizeof(kt_v4) == 0);
#define PLACE(type, name, count, meaning) h->name = (type *)(void *)at, at += (count) * sizeof(type);
    KT_HALF_FIELDS(PLACE)
#undef PLACE
}

/* Whether a free joint has armature: rotors turn against the ground, with other terms (aba_armature.c). */
static bool has_free_armature(const kt_model *model, const kt_group *group) {
    for (int l = 0; l < group->link_count && group->has_armature; l++) {
        const kt_link *link = &model->link[model->group_link[group->link + l]];
        if (link->motion == KT_MOTION_FREE && link->has_armature)
            return true;
    }
    return false;
}

/* Chooses the equations; returns false if the null space must solve the group. The null space also solves a group whose
 * equations permit no motion, because such a group then stays at rest to the last bit. */
static bool choose_half_equations(const kt_model *model, const kt_data *data, size_t g) {
    kt_half *h = half_of(model, data, g);
    int count = 0;
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    lay_out_half(&model->group[g], h);
    for (int r = 0; r < w.k; r++) {
        if (w.weight && w.weight[r] == 1.0)
            continue;
        if (count < h->rank)
            h->slot[count] = r;
        count++;
    }
    for (int r = h->rank; r < LANES * h->n; r++)
        h->slot[r] = -1;
    return count == h->rank && h->rank < h->m && !has_free_armature(model, &model->group[g]);
}

bool KT_KERNEL(kt_half_prepare)(const kt_model *model, kt_data *data, size_t g) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(model->group[g].form == KT_FORM_DENSE);
    if (!kt_group_is_locked(model, &model->group[g]) && !choose_half_equations(model, data, g))
        return false;
    data->factored[g] = KT_ROWS_ALL;
    data->near[g] = false;
    data->rank[g] = model->group[g].rank[KT_ROWS_ALL];
    return true;
}

/* ---- terms of the links ------------------------------------------------------------------------------------------ */

/* S of a joint with one axis. */
KT_INLINE void axis_of(const kt_link *link, const kt_link_motion *m, kt_v4 *angular, kt_v4 *linear) {
    const kt_v4 s = kt_link_axis(link, m), none = kt_v4_splat(0.0);
    *angular = link->motion == KT_MOTION_PRISMATIC ? none : s;
    *linear = link->motion == KT_MOTION_REVOLUTE ? none
              : link->motion == KT_MOTION_SCREW  ? kt_v4_splat(kt_link_pitch(link)) * s
                                                 : s;
}

bool KT_KERNEL(kt_half_store)(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x) {
    const kt_link *link = &model->link[i];
    kt_v4 n, f;
    if (link->motion == KT_MOTION_FREE)
        return kt_articulated_project_free(link, &data->motion[link->parent], &data->motion[i], tau, true, x,
                                           &data->articulated[link->articulated]);
    if (model->group[link->group].rank[KT_ROWS_ALL] == 0)
        return false;
    axis_of(link, &data->motion[i], &n, &f);
    half_of(model, data, (size_t)link->group)->inverse[link->local] =
        1.0 /
        (kt_v4_dot2(n, kt_articulated_moment(x, n, f), f, kt_articulated_force(x, n, f)) + model->armature[link->v]);
    return false;
}

/* The equation a x = b'' of the stop gives the acceleration x of the one joint. With its axis S, the inertia I and the
 * bias wrench p of the link (articulated), and the acceleration c due to velocities:
 *
 *     p <- p + I c
 *     M = S . I S + armature,   tau - h = tau - S . p,   F = shift(I S)      for the multiplier (kt_group_assemble)
 *     p <- p + I S x
 */
void KT_KERNEL(kt_half_lock)(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x) {
    const kt_link *link = &model->link[i];
    const kt_link_motion *m = &data->motion[i];
    const kt_group_work w = kt_group_matrices(model, data, (size_t)link->group, KT_ROWS_ALL);
    const double acceleration = w.right[0] / w.a[0];
    kt_v4 n, f;
    axis_of(link, m, &n, &f);
    const kt_v4 moment = kt_articulated_moment(x, n, f), force = kt_articulated_force(x, n, f);
    x->moment += kt_articulated_moment(x, m->alpha, m->linear);
    x->force += kt_articulated_force(x, m->alpha, m->linear);
    w.mass[0] = kt_v4_dot2(n, moment, f, force) + model->armature[link->v];
    w.bias[0] = tau[link->v] - kt_v4_dot2(n, x->moment, f, x->force);
    if (link->parent == 0) /* the ground's acceleration is given: gravity */
        w.bias[0] -= kt_v4_dot(force, data->motion[0].linear);
    x->moment += kt_v4_splat(acceleration) * moment;
    x->force += kt_v4_splat(acceleration) * force;
    const kt_v4 on_parent = moment + kt_v4_cross(m->offset, force);
    for (int c = 0; c < 3; c++) {
        w.coupling[c] = on_parent[c];
        w.coupling[c + 3] = force[c];
    }
    kt_response_set(&data->response[i], kt_v4_splat(0.0), kt_v4_splat(0.0), acceleration);
}

/* L' x, with L of kt_factor3. */
KT_INLINE kt_v4 unfactor3(kt_v4 l, kt_v4 x) {
    return (kt_v4){x[0] + l[0] * x[1] + l[1] * x[2], x[1] + l[2] * x[2], x[2], 0.0};
}

/* Writes y - K A0 of a free joint, and d. Its acceleration without multipliers (alpha, linear) is known. */
static void find_accelerations_of_free_joint(const kt_half *h, int local, const kt_articulated *factors, kt_v4 alpha,
                                             kt_v4 linear) {
    const kt_v4 moved = linear + kt_v4_apply(factors->g, alpha);
    const kt_v4 y[2] = {unfactor3(factors->m[0], moved), unfactor3(factors->j[0], alpha)};
    for (int k = 0; k < KT_DOF_MAX; k++) {
        h->free_acceleration[local + k] = y[k / 3][k % 3];
        h->inverse[local + k] = (k < 3 ? factors->m : factors->j)[1][k % 3];
    }
}

/* A0, and y - K A0, from the ground to the tips. */
static void find_free_accelerations(const kt_model *model, const kt_data *data, const kt_group *group,
                                    const kt_half *h) {
    const int32_t *link = model->group_link + group->link;
    for (int l = 0; l < group->link_count; l++) {
        const kt_link *at = &model->link[link[l]], *up = &model->link[at->parent];
        const kt_link_motion *m = &data->motion[link[l]];
        const kt_v4 alpha = at->parent ? h->base[2 * up->local] : data->motion[0].alpha;
        const kt_v4 linear = at->parent ? h->base[2 * up->local + 1] : data->motion[0].linear;
        kt_v4 *base = h->base + 2 * at->local;
        base[0] = alpha + m->alpha;
        base[1] = linear + kt_v4_cross(alpha, m->offset) + m->linear;
        if (at->motion == KT_MOTION_FREE) {
            const kt_articulated *factors = &data->articulated[at->articulated];
            find_accelerations_of_free_joint(h, at->local, factors, factors->moment - base[0],
                                             factors->force - base[1]);
            continue;
        }
        const kt_response *y = &data->response[link[l]];
        h->free_acceleration[at->local] =
            kt_response_free(y) - kt_v4_dot2(y->gain_angular, alpha, y->gain_linear, linear);
    }
}

/* ---- half columns ------------------------------------------------------------------------------------------------ */

/* Components of moments and forces of four equations. */
typedef struct wrenches {
    kt_v4 x[6];
} wrenches;

KT_INLINE kt_v4 along_half(kt_v4 n, const kt_v4 *x) {
    return kt_v4_splat(n[0]) * x[0] + kt_v4_splat(n[1]) * x[1] + kt_v4_splat(n[2]) * x[2];
}

KT_INLINE kt_v4 along(kt_v4 n, kt_v4 f, const wrenches *p) { return along_half(n, p->x) + along_half(f, p->x + 3); }

KT_INLINE void add_gain(kt_v4 n, kt_v4 f, kt_v4 u, wrenches *p) {
    for (int c = 0; c < 3; c++) {
        p->x[c] += kt_v4_splat(n[c]) * u;
        p->x[c + 3] += kt_v4_splat(f[c]) * u;
    }
}

KT_INLINE void shift(kt_v4 r, wrenches *p) {
    const kt_v4 x = kt_v4_splat(r[0]), y = kt_v4_splat(r[1]), z = kt_v4_splat(r[2]);
    p->x[0] += y * p->x[5] - z * p->x[4];
    p->x[1] += z * p->x[3] - x * p->x[5];
    p->x[2] += x * p->x[4] - y * p->x[3];
}

/* Four columns of joint forces, and where their half columns go. The columns belong to equations, or to forces on
 * links. */
typedef struct batch {
    const double *row[KT_HALF_LANES];
    const kt_half_force *force;
    int forces; /* 0: equations */
    kt_v4 *column;
    uint8_t *is_nonzero; /* NULL: not asked for */
} batch;

KT_INLINE kt_v4 entries(const batch *b, int32_t at) {
    return (kt_v4){b->row[0][at], b->row[1][at], b->row[2][at], b->row[3][at]};
}

/* Adds the wrenches that act on a link, times 1 or -1; returns whether such wrenches exist. */
KT_INLINE bool load_link(const batch *b, int32_t link, double sign, kt_v4 *moment, kt_v4 *force_sum) {
    bool any = false;
    for (int r = 0; r < b->forces; r++)
        for (int end = 0; end < 2; end++) {
            const kt_half_force *force = &b->force[r];
            if (force->link[end] != link)
                continue;
            for (int c = 0; c < 3; c++) {
                moment[c][r] += sign * force->wrench[end][c];
                force_sum[c][r] += sign * force->wrench[end][c + 3];
            }
            any = true;
        }
    return any;
}

KT_INLINE bool is_zero(kt_v4 x) { return x[0] == 0.0 && x[1] == 0.0 && x[2] == 0.0 && x[3] == 0.0; }

/* L^-1 b, with L of kt_factor3. */
KT_INLINE void reduce3(kt_v4 l, kt_v4 *b) {
    b[1] -= kt_v4_splat(l[0]) * b[0];
    b[2] -= kt_v4_splat(l[1]) * b[0] + kt_v4_splat(l[2]) * b[1];
}

/* y = axes x */
KT_INLINE void apply_axes(const kt_v4 axes[3], const kt_v4 *x, kt_v4 *y) {
    for (int c = 0; c < 3; c++)
        y[c] = kt_v4_splat(axes[0][c]) * x[0] + kt_v4_splat(axes[1][c]) * x[1] + kt_v4_splat(axes[2][c]) * x[2];
}

/* The force and the moment on a link by the forces of its free joint, whose parent is the ground. */
KT_INLINE void apply_free(const kt_link *link, const kt_data *data, int32_t i, const kt_v4 *joint, kt_v4 *b) {
    if (link->rest_is_rotated) {
        kt_v4 base[3];
        kt_axes_at_zero(link, data->motion[0].axes, base);
        apply_axes(base, joint, b);
    } else {
        memcpy(b, joint, 3 * sizeof *b);
    }
    apply_axes(data->motion[i].axes, joint + 3, b + 3);
}

/* The half columns of a free joint, whose link the force f = b and the moment n = b + 3 accelerate. With the factor L
 * of M, the columns for f are L^-1 f. With the factor L of J - H M^-1 G, the columns for n are L^-1 (n - H M^-1 f)
 * (aba.h). */
KT_INLINE void reduce_free_link(const kt_articulated *factors, kt_v4 *b, kt_v4 *column) {
    for (int c = 0; c < 3; c++)
        b[c + 3] -= along_half(factors->g[c], b);
    reduce3(factors->m[0], b);
    reduce3(factors->j[0], b + 3);
    memcpy(column, b, 6 * sizeof *b);
}

/* The half columns of one link; p: wrenches on it, then those on its parent. applied: joint forces act, too. */
KT_INLINE void reduce_link(const kt_model *model, const kt_data *data, int32_t i, bool applied, kt_v4 *column,
                           wrenches *p) {
    const kt_link *link = &model->link[i];
    kt_v4 b[6], own[6];
    if (link->motion != KT_MOTION_FREE) {
        const kt_response *y = &data->response[i];
        kt_v4 n, f;
        axis_of(link, &data->motion[i], &n, &f);
        column[0] -= along(n, f, p);
        shift(data->motion[i].offset, p);
        add_gain(y->gain_angular, y->gain_linear, column[0], p);
        return;
    }
    if (applied)
        apply_free(link, data, i, column, own);
    for (int c = 0; c < 6; c++)
        b[c] = applied ? own[c] - p->x[(c + 3) % 6] : -p->x[(c + 3) % 6];
    reduce_free_link(&data->articulated[link->articulated], b, column);
}

/* The half columns of a free link on which no other link of the group acts. */
static __attribute__((noinline)) void find_free_leaf(const kt_model *model, const kt_data *data, int32_t i,
                                                     const batch *b) {
    const kt_link *link = &model->link[i];
    kt_v4 x[6], *column = b->column + link->local;
    bool nonzero = false;
    for (int c = 0; c < 6; c++) {
        x[c] = column[c] = b->forces ? kt_v4_splat(0.0) : entries(b, link->local + c);
        nonzero = nonzero || (!b->forces && !is_zero(x[c]));
    }
    if (b->forces)
        nonzero = load_link(b, i, 1.0, x + 3, x);
    else if (nonzero)
        apply_free(link, data, i, column, x);
    if (nonzero)
        reduce_free_link(&data->articulated[link->articulated], x, column);
    if (b->is_nonzero)
        memset(b->is_nonzero + link->local, nonzero, 6);
}

KT_INLINE void add_flow(const kt_half *h, int32_t local, const wrenches *p) {
    for (int c = 0; c < 6; c++)
        h->flow[6 * local + c] = h->has_flow[local] ? h->flow[6 * local + c] + p->x[c] : p->x[c];
    h->has_flow[local] = 1;
}

static void find_half_columns(const kt_model *model, const kt_data *data, const kt_group *group, const kt_half *h,
                              const batch *b) {
    const int32_t *link = model->group_link + group->link;
    bool from_child = false;
    wrenches p;
    if (group->link_count == 1 && model->link[link[0]].motion == KT_MOTION_FREE) {
        find_free_leaf(model, data, link[0], b);
        return;
    }
    memset(h->has_flow, 0, (size_t)h->m);
    for (int l = group->link_count - 1; l >= 0; l--) {
        const kt_link *at = &model->link[link[l]];
        const int32_t local = at->local, up = at->parent;
        kt_v4 *column = b->column + local;
        if (at->motion == KT_MOTION_FREE && !from_child && !h->has_flow[local]) { /* its parent is the ground */
            find_free_leaf(model, data, link[l], b);
            continue;
        }
        for (int c = 0; c < 6 && !from_child; c++)
            p.x[c] = kt_v4_splat(0.0);
        for (int c = 0; c < 6 && h->has_flow[local]; c++)
            p.x[c] += h->flow[6 * local + c];
        bool nonzero = load_link(b, link[l], -1.0, p.x, p.x + 3) || from_child || h->has_flow[local];
        for (int k = 0; k < kt_link_dofs(at); k++) {
            column[k] = b->forces ? kt_v4_splat(0.0) : entries(b, local + k);
            nonzero = nonzero || (!b->forces && !is_zero(column[k]));
        }
        for (int k = 0; k < kt_link_dofs(at) && b->is_nonzero; k++)
            b->is_nonzero[local + k] = nonzero;
        if (nonzero)
            reduce_link(model, data, link[l], b->forces == 0, column, &p);
        from_child = nonzero && l > 0 && up == link[l - 1];
        if (nonzero && !from_child && up != 0)
            add_flow(h, model->link[up].local, &p);
    }
}

/* The batch of equations; if there are fewer than four, the others are zero. */
static batch equations(const kt_model *model, const kt_group_work *w, const kt_half *h, int index) {
    const size_t first = (size_t)index * (size_t)h->m;
    batch b = {.column = h->column + first, .is_nonzero = h->is_nonzero + first};
    for (int r = 0; r < LANES; r++) {
        const int32_t slot = h->slot[LANES * index + r];
        b.row[r] = slot >= 0 ? w->a + (size_t)slot * (size_t)w->m : model->zero;
    }
    return b;
}

/* ---- S ----------------------------------------------------------------------------------------------------------- */

/* Rows and columns of vector i, of so many equations. Also lambda = b'' - A M^-1 f of these. */
KT_INLINE void find_half_diagonal_of(const kt_group_work *w, const kt_half *h, int i, int columns) {
    const size_t m = (size_t)h->m, stride = LANES * (size_t)h->n;
    const kt_v4 *a = h->column + (size_t)i * m;
    const uint8_t *nonzero = h->is_nonzero + (size_t)i * m;
    kt_v4 sum[LANES] = {{0.0}}, along_free = kt_v4_splat(0.0);
    for (size_t l = 0; l < m; l++) {
        if (!nonzero[l])
            continue;
        const kt_v4 x = kt_v4_splat(h->inverse[l]) * a[l];
        along_free += kt_v4_splat(h->free_acceleration[l]) * a[l];
        for (int c = 0; c < columns; c++)
            sum[c] += kt_v4_splat(x[c]) * a[l];
    }
    for (int c = 0; c < columns; c++)
        memcpy(h->square + (LANES * (size_t)i + (size_t)c) * stride + LANES * (size_t)i, &sum[c], sizeof sum[c]);
    for (int r = 0; r < LANES; r++) {
        const int32_t slot = h->slot[LANES * i + r];
        h->multiplier[LANES * i + r] = slot >= 0 ? w->right[slot] - along_free[r] : 0.0;
    }
}

static void find_half_diagonal(const kt_group_work *w, const kt_half *h, int i) {
    if (h->rank - LANES * i >= LANES)
        find_half_diagonal_of(w, h, i, LANES);
    else if (h->rank - LANES * i == LANES - 1)
        find_half_diagonal_of(w, h, i, LANES - 1);
    else
        find_half_diagonal_of(w, h, i, h->rank - LANES * i);
}

/* The block of S in the rows of vector i and the columns of vector j, j < i. */
static void find_half_block(const kt_half *h, int i, int j) {
    const size_t m = (size_t)h->m, stride = LANES * (size_t)h->n;
    const kt_v4 *a = h->column + (size_t)i * m, *b = h->column + (size_t)j * m;
    const uint8_t *nonzero[2] = {h->is_nonzero + (size_t)i * m, h->is_nonzero + (size_t)j * m};
    kt_v4 sum[LANES] = {{0.0}};
    for (size_t l = 0; l < m; l++) {
        if (!nonzero[0][l] || !nonzero[1][l])
            continue;
        const kt_v4 x = kt_v4_splat(h->inverse[l]) * b[l];
        for (int c = 0; c < LANES; c++)
            sum[c] += kt_v4_splat(x[c]) * a[l];
    }
    for (int c = 0; c < LANES; c++)
        memcpy(h->square + (LANES * (size_t)j + (size_t)c) * stride + LANES * (size_t)i, &sum[c], sizeof sum[c]);
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

/* d_l (U' lambda)_l, of the first vector of equations and of the others */
KT_INLINE double response_of(const kt_half *h, int local, kt_v4 first) {
    kt_v4 sum = h->is_nonzero[local] ? first * h->column[local] : kt_v4_splat(0.0), x;
    for (int b = 1; b < h->n; b++) {
        memcpy(&x, h->multiplier + LANES * (size_t)b, sizeof x);
        if (h->is_nonzero[(size_t)b * (size_t)h->m + (size_t)local])
            sum += x * h->column[(size_t)b * (size_t)h->m + (size_t)local];
    }
    return h->inverse[local] * ((sum[0] + sum[1]) + (sum[2] + sum[3]));
}

/* L'^-1 x, with L of kt_factor3. */
KT_INLINE kt_v4 substitute3(kt_v4 l, const double *x) {
    const double z = x[2], y = x[1] - l[2] * z;
    return (kt_v4){x[0] - l[0] * y - l[1] * z, y, z, 0.0};
}

/* x: d (U' lambda), by coordinates */
static void add_responses(const kt_model *model, kt_data *data, const kt_group *group, const double *x) {
    const int32_t *link = model->group_link + group->link;
    for (int l = 0; l < group->link_count; l++) {
        const kt_link *at = &model->link[link[l]];
        if (at->motion != KT_MOTION_FREE) {
            kt_response_add(&data->response[link[l]], x[at->local]);
            continue;
        }
        kt_articulated *factors = &data->articulated[at->articulated];
        const kt_v4 alpha = substitute3(factors->j[0], x + at->local + 3),
                    linear = substitute3(factors->m[0], x + at->local);
        factors->moment += alpha;
        factors->force += linear - kt_v4_apply(factors->g, alpha);
    }
}

/* Adds the accelerations due to lambda, and to forces with the half column h->free_acceleration. */
static void complete_responses(const kt_model *model, kt_data *data, const kt_group *group, const kt_half *h) {
    kt_v4 first;
    memcpy(&first, h->multiplier, sizeof first);
    for (int l = 0; l < h->m; l++)
        h->free_acceleration[l] = h->inverse[l] * h->free_acceleration[l] + response_of(h, l, first);
    add_responses(model, data, group, h->free_acceleration);
    *h->is_incomplete = 0;
}

/* Adds the accelerations due to lambda, without forces. */
static void complete_multipliers(const kt_model *model, kt_data *data, const kt_group *group, const kt_half *h) {
    memset(h->free_acceleration, 0, (size_t)h->m * sizeof *h->free_acceleration);
    complete_responses(model, data, group, h);
}

bool KT_KERNEL(kt_half_solve)(const kt_model *model, kt_data *data, size_t g) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(!kt_group_is_locked(model, &model->group[g]));
    const kt_group *group = &model->group[g];
    kt_half *h = half_of(model, data, g);
    if (group->rank[KT_ROWS_ALL] == 0)
        return true;
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    find_free_accelerations(model, data, group, h);
    for (int b = 0; b < h->n; b++) {
        const batch rows = equations(model, &w, h, b);
        find_half_columns(model, data, group, h, &rows);
        for (int j = 0; j < b; j++)
            find_half_block(h, b, j);
        find_half_diagonal(&w, h, b);
    }
    if (!kt_half_find_multipliers(h))
        return false;
    for (int r = 0; r < w.k && h->rank < w.k; r++)
        w.multiplier[r] = 0.0;
    for (int r = 0; r < h->rank; r++)
        w.multiplier[h->slot[r]] = h->multiplier[r];
    *h->is_incomplete = 1;
    if (!data->between)
        complete_multipliers(model, data, group, h);
    return true;
}

void KT_KERNEL(kt_half_complete)(const kt_model *model, kt_data *data, size_t g) {
    const kt_half *h = half_of(model, data, g);
    if (model->group[g].rank[KT_ROWS_ALL] == 0 || kt_group_is_locked(model, &model->group[g]))
        return;
    if (*h->is_incomplete)
        complete_multipliers(model, data, &model->group[g], h);
}

/* ---- more forces ------------------------------------------------------------------------------------------------- */

/* The changes of lambda due to four forces, whose half columns are u: S change = -A M^-1 f. */
KT_INLINE void find_right_sides(const kt_half *h, const kt_v4 *u, int index, int count, kt_v4 *right) {
    const kt_v4 *row = h->column + (size_t)index * (size_t)h->m;
    kt_v4 sum[LANES] = {{0.0}};
    for (int l = 0; l < h->m; l++) {
        const kt_v4 x = kt_v4_splat(h->inverse[l]) * u[l];
        for (int r = 0; r < count; r++)
            sum[r] -= kt_v4_splat(row[l][r]) * x;
    }
    for (int r = 0; r < count; r++)
        right[LANES * index + r] = sum[r];
}

static void find_multiplier_changes(const kt_half *h, const kt_v4 *u, kt_v4 *change) {
    if (h->rank == LANES - 1)
        find_right_sides(h, u, 0, LANES - 1, change);
    else
        for (int b = 0; b < h->n; b++)
            find_right_sides(h, u, b, LANES, change);
    kt_half_substitute_four(h, change);
}

/* Adds f_i' M^-1 (f_j + A' change), which is symmetric, for four forces j from `first` on, and all forces i up to
 * these. The half columns of later forces are not known yet. */
static void add_force_rates(const kt_half *h, const kt_v4 *column, const kt_v4 *change, int first, int count,
                            double *rate) {
    const kt_v4 *u = column + (size_t)first / LANES * (size_t)h->m;
    kt_v4 *y = h->flow;
    for (int l = 0; l < h->m; l++) {
        kt_v4 sum = u[l];
        for (int r = 0; r < h->rank; r++)
            sum += kt_v4_splat(h->column[(size_t)(r / LANES * h->m + l)][r % LANES]) * change[r];
        y[l] = kt_v4_splat(h->inverse[l]) * sum;
    }
    for (int i = 0; i <= first; i += LANES) {
        const kt_v4 *with = column + (size_t)i / LANES * (size_t)h->m;
        kt_v4 sum[LANES] = {{0.0}};
        for (int l = 0; l < h->m; l++)
            for (int j = 0; j < LANES; j++)
                sum[j] += kt_v4_splat(y[l][j]) * with[l];
        for (int j = 0; j < LANES && first + j < count; j++)
            for (int r = 0; r < LANES && i + r < count; r++) {
                rate[(size_t)(first + j) * (size_t)count + (size_t)(i + r)] += sum[j][r];
                if (i < first)
                    rate[(size_t)(i + r) * (size_t)count + (size_t)(first + j)] += sum[j][r];
            }
    }
}

/* For LANES forces f at a time: their half columns u = H f, and the changes x = -S^-1 U D u of the multipliers. */
void KT_KERNEL(kt_half_respond)(const kt_model *model, const kt_data *data, size_t g, const kt_half_force *force,
                                int count, double *column, double *change, double *rate) {
    assert(count > 0);
    assert(kt_half_has_terms(model, data, g));
    const kt_group *group = &model->group[g];
    const size_t rows = (size_t)group->row_count;
    const kt_half *h = half_of(model, data, g);
    if (rows > (size_t)h->rank)
        memset(change, 0, (size_t)count * rows * sizeof *change);
    for (int j = 0; j < count; j += LANES) {
        kt_v4 *u = (kt_v4 *)(void *)column + (size_t)j / LANES * (size_t)h->m, *x = h->change;
        const batch b = {.force = force + j, .forces = count - j < LANES ? count - j : LANES, .column = u};
        find_half_columns(model, data, group, h, &b);
        find_multiplier_changes(h, u, x);
        for (int r = 0; r < h->rank; r++)
            for (int k = 0; k < b.forces; k++)
                change[(size_t)(j + k) * rows + (size_t)h->slot[r]] = x[r][k];
        if (rate)
            add_force_rates(h, (kt_v4 *)(void *)column, x, j, count, rate);
    }
}

/* The half column of the sum of so many forces, times factors. */
static void combine_columns(const kt_half *h, const double *factor, int count, const kt_v4 *u, double *sum) {
    for (int j = 0; j < count; j += LANES, u += h->m) {
        kt_v4 by = kt_v4_splat(0.0);
        for (int r = 0; r < LANES && j + r < count; r++)
            by[r] = factor[j + r];
        for (int l = 0; l < h->m; l++) {
            const kt_v4 x = by * u[l];
            sum[l] = (j > 0 ? sum[l] : 0.0) + ((x[0] + x[1]) + (x[2] + x[3]));
        }
    }
}

void KT_KERNEL(kt_half_add_forces)(const kt_model *model, kt_data *data, size_t g, const double *factor, int count,
                                   const double *change, const double *column) {
    assert(count > 0);
    assert(kt_half_has_terms(model, data, g));
    const kt_group *group = &model->group[g];
    const kt_half *h = half_of(model, data, g);
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    combine_columns(h, factor, count, (const kt_v4 *)(const void *)column, h->free_acceleration);
    for (int r = 0; r < h->rank; r++) {
        const double *from = change + h->slot[r];
        double sum = 0.0, *lambda = w.multiplier + h->slot[r];
        for (int j = 0; j < count; j++, from += group->row_count)
            sum += factor[j] * *from;
        *lambda += sum;
        h->multiplier[r] = *h->is_incomplete ? *lambda : sum;
    }
    complete_responses(model, data, group, h);
}
