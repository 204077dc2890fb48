/* The half columns U' = H A' of four equations, or H f of four forces, in one sweep over the links of a group, tips
 * first (half_columns.h).
 *
 * b_i are the joint forces of the columns. P_i are the bias wrenches on link i about its origin. They begin with minus
 * the forces on the link, and its children add theirs. For a joint with the axis S and the parent gain K:
 *
 *     u_i = b_i - S . P_i,   P_parent += shift(P_i) + K u_i
 *
 * A free joint has six rows u_i, by the factors of its elimination.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_HALF_SWEEP_H
#define KT_REDUCTION_HALF_SWEEP_H

#include "reduction/half_columns.h"

#include <assert.h>

/* S of a joint with one axis. */
KT_INLINE void kt_half_axis_of(const kt_link *link, const kt_link_motion *m, kt_v4 *angular, kt_v4 *linear) {
    const kt_v4 s = kt_link_axis(link, m), none = kt_v4_splat(0.0);
    *angular = link->motion == KT_MOTION_PRISMATIC ? none : s;
    *linear = link->motion == KT_MOTION_REVOLUTE ? none
              : link->motion == KT_MOTION_SCREW  ? kt_v4_splat(kt_link_pitch(link)) * s
                                                 : s;
}

/* Components of moments and forces, each for four columns. */
typedef struct kt_half_wrenches {
    kt_v4 x[6];
} kt_half_wrenches;

/* n . x */
KT_INLINE kt_v4 kt_half_along3(kt_v4 n, const kt_v4 *x) {
    return kt_v4_splat(n[0]) * x[0] + kt_v4_splat(n[1]) * x[1] + kt_v4_splat(n[2]) * x[2];
}

/* S . P with S = (n, f) */
KT_INLINE kt_v4 kt_half_along(kt_v4 n, kt_v4 f, const kt_half_wrenches *p) {
    return kt_half_along3(n, p->x) + kt_half_along3(f, p->x + 3);
}

/* P += K u with K = (n, f) */
KT_INLINE void kt_half_add_gain(kt_v4 n, kt_v4 f, kt_v4 u, kt_half_wrenches *p) {
    for (int c = 0; c < 3; c++) {
        p->x[c] += kt_v4_splat(n[c]) * u;
        p->x[c + 3] += kt_v4_splat(f[c]) * u;
    }
}

/* To the origin of the parent: n += r x f. */
KT_INLINE void kt_half_shift(kt_v4 r, kt_half_wrenches *p) {
    const kt_v4 x = kt_v4_splat(r[0]), y = kt_v4_splat(r[1]), z = kt_v4_splat(r[2]);
    p->x[0] += y * p->x[5] - z * p->x[4];
    p->x[1] += z * p->x[3] - x * p->x[5];
    p->x[2] += x * p->x[4] - y * p->x[3];
}

/* Four columns of joint forces, and where their half columns go. The columns belong to equations, or to forces on
 * links. */
typedef struct kt_half_batch {
    const double *row[KT_HALF_LANES];
    const kt_half_force *force;
    int forces; /* 0: equations */
    kt_v4 *column;
    uint8_t *is_nonzero; /* NULL: not asked for */
} kt_half_batch;

KT_INLINE kt_v4 kt_half_entries(const kt_half_batch *b, int32_t at) {
    return (kt_v4){b->row[0][at], b->row[1][at], b->row[2][at], b->row[3][at]};
}

/* Adds the wrenches that act on a link, times 1 or -1; returns whether such wrenches exist. */
KT_INLINE bool kt_half_load_link(const kt_half_batch *b, int32_t link, double sign, kt_v4 *moment, kt_v4 *force_sum) {
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

KT_INLINE bool kt_half_is_zero(kt_v4 x) { return x[0] == 0.0 && x[1] == 0.0 && x[2] == 0.0 && x[3] == 0.0; }

/* L^-1 b, with L of kt_factor3. */
KT_INLINE void kt_half_reduce3(kt_v4 l, kt_v4 *b) {
    b[1] -= kt_v4_splat(l[0]) * b[0];
    b[2] -= kt_v4_splat(l[1]) * b[0] + kt_v4_splat(l[2]) * b[1];
}

/* y = axes x */
KT_INLINE void kt_half_apply_axes(const kt_v4 axes[3], const kt_v4 *x, kt_v4 *y) {
    for (int c = 0; c < 3; c++)
        y[c] = kt_v4_splat(axes[0][c]) * x[0] + kt_v4_splat(axes[1][c]) * x[1] + kt_v4_splat(axes[2][c]) * x[2];
}

/* The force and the moment on a link by the forces of its free joint, whose parent is the ground. */
KT_INLINE void kt_half_apply_free(const kt_link *link, const kt_data *data, int32_t i, const kt_v4 *joint, kt_v4 *b) {
    if (link->rest_is_rotated) {
        kt_v4 base[3];
        kt_axes_at_zero(link, data->motion[0].axes, base);
        kt_half_apply_axes(base, joint, b);
    } else {
        memcpy(b, joint, 3 * sizeof *b);
    }
    kt_half_apply_axes(data->motion[i].axes, joint + 3, b + 3);
}

/* The half columns of a free joint, whose link the force f = b and the moment n = b + 3 accelerate. With the factor L
 * of M, the columns for f are L^-1 f. With the factor L of J - H M^-1 G, the columns for n are L^-1 (n - H M^-1 f)
 * (aba.h). */
KT_INLINE void kt_half_reduce_free_link(const kt_articulated *factors, kt_v4 *b, kt_v4 *column) {
    for (int c = 0; c < 3; c++)
        b[c + 3] -= kt_half_along3(factors->g[c], b);
    kt_half_reduce3(factors->m[0], b);
    kt_half_reduce3(factors->j[0], b + 3);
    memcpy(column, b, 6 * sizeof *b);
}

/* The half columns of one link; p: wrenches on it, then those on its parent. applied: joint forces act, too. */
KT_INLINE void kt_half_reduce_link(const kt_model *model, const kt_data *data, int32_t i, bool applied, kt_v4 *column,
                                   kt_half_wrenches *p) {
    const kt_link *link = &model->link[i];
    kt_v4 b[6], own[6];
    if (link->motion != KT_MOTION_FREE) {
        const kt_response *y = &data->response[i];
        kt_v4 n, f;
        kt_half_axis_of(link, &data->motion[i], &n, &f);
        column[0] -= kt_half_along(n, f, p);
        kt_half_shift(data->motion[i].offset, p);
        kt_half_add_gain(y->gain_angular, y->gain_linear, column[0], p);
        return;
    }
    if (applied)
        kt_half_apply_free(link, data, i, column, own);
    for (int c = 0; c < 6; c++)
        b[c] = applied ? own[c] - p->x[(c + 3) % 6] : -p->x[(c + 3) % 6];
    kt_half_reduce_free_link(&data->articulated[link->articulated], b, column);
}

/* The half columns of a free link on which no other link of the group acts. */
static __attribute__((noinline)) void kt_half_find_free_leaf(const kt_model *model, const kt_data *data, int32_t i,
                                                             const kt_half_batch *b) {
    const kt_link *link = &model->link[i];
    kt_v4 x[6], *column = b->column + link->local;
    bool nonzero = false;
    memset(x, 0, sizeof x);
    for (int c = 0; c < 6 && !b->forces; c++) {
        column[c] = kt_half_entries(b, link->local + c);
        nonzero = nonzero || !kt_half_is_zero(column[c]);
    }
    if (b->forces)
        nonzero = kt_half_load_link(b, i, 1.0, x + 3, x);
    else if (nonzero)
        kt_half_apply_free(link, data, i, column, x);
    if (nonzero)
        kt_half_reduce_free_link(&data->articulated[link->articulated], x, column);
    else
        memcpy(column, x, sizeof x);
    if (b->is_nonzero)
        memset(b->is_nonzero + link->local, nonzero, 6);
}

/* Adds the wrenches that a child passes to the link with this first coordinate. */
KT_INLINE void kt_half_add_flow(const kt_half *h, int32_t local, const kt_half_wrenches *p) {
    for (int c = 0; c < 6; c++)
        h->flow[6 * local + c] = h->has_flow[local] ? h->flow[6 * local + c] + p->x[c] : p->x[c];
    h->has_flow[local] = 1;
}

/* Computes the half columns of a batch. Wrenches pass in registers if the next link is the parent, otherwise in
 * h->flow. */
static void kt_half_find_columns(const kt_model *model, const kt_data *data, const kt_group *group, const kt_half *h,
                                 const kt_half_batch *b) {
    const int32_t *link = model->group_link + group->link;
    bool from_child = false;
    kt_half_wrenches p;
    if (group->link_count == 1 && model->link[link[0]].motion == KT_MOTION_FREE) {
        kt_half_find_free_leaf(model, data, link[0], b);
        return;
    }
    memset(h->has_flow, 0, (size_t)h->m);
    for (int l = group->link_count - 1; l >= 0; l--) {
        const kt_link *at = &model->link[link[l]];
        const int32_t local = at->local, up = at->parent;
        kt_v4 *column = b->column + local;
        if (at->motion == KT_MOTION_FREE && !from_child && !h->has_flow[local]) { /* its parent is the ground */
            kt_half_find_free_leaf(model, data, link[l], b);
            continue;
        }
        for (int c = 0; c < 6 && !from_child; c++)
            p.x[c] = kt_v4_splat(0.0);
        for (int c = 0; c < 6 && h->has_flow[local]; c++)
            p.x[c] += h->flow[6 * local + c];
        bool nonzero = kt_half_load_link(b, link[l], -1.0, p.x, p.x + 3) || from_child || h->has_flow[local];
        for (int k = 0; k < kt_link_dofs(at); k++) {
            column[k] = b->forces ? kt_v4_splat(0.0) : kt_half_entries(b, local + k);
            nonzero = nonzero || (!b->forces && !kt_half_is_zero(column[k]));
        }
        for (int k = 0; k < kt_link_dofs(at) && b->is_nonzero; k++)
            b->is_nonzero[local + k] = nonzero;
        if (nonzero)
            kt_half_reduce_link(model, data, link[l], b->forces == 0, column, &p);
        from_child = nonzero && l > 0 && up == link[l - 1];
        if (nonzero && !from_child && up != 0)
            kt_half_add_flow(h, model->link[up].local, &p);
    }
}

#endif
