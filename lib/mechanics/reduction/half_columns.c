/* Groups of closed contacts in range space: half_columns.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/half_columns.h"

#include "reduction/half_square.h"
#include "reduction/half_sweep.h"

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

bool KT_KERNEL(kt_half_store)(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x) {
    const kt_link *link = &model->link[i];
    kt_v4 n, f;
    if (link->motion == KT_MOTION_FREE)
        return kt_articulated_project_free(link, &data->motion[link->parent], &data->motion[i], tau, true, x,
                                           &data->articulated[link->articulated]);
    if (model->group[link->group].rank[KT_ROWS_ALL] == 0)
        return false;
    kt_half_axis_of(link, &data->motion[i], &n, &f);
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
    kt_half_axis_of(link, m, &n, &f);
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

/* A0 and y - K A0_parent, from the ground to the tips:
 *
 *     A0 = shift(A0_parent) + c,   with the ground's acceleration minus gravity, and c due to velocities
 *
 * The acceleration of a free joint is stored as a whole, so that A0 is subtracted. */
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

/* ---- S ----------------------------------------------------------------------------------------------------------- */

/* The batch of equations; if there are fewer than four, the others are zero. */
static kt_half_batch equations(const kt_model *model, const kt_group_work *w, const kt_half *h, int index) {
    const size_t first = (size_t)index * (size_t)h->m;
    kt_half_batch b = {.column = h->column + first, .is_nonzero = h->is_nonzero + first};
    for (int r = 0; r < LANES; r++) {
        const int32_t slot = h->slot[LANES * index + r];
        b.row[r] = slot >= 0 ? w->a + (size_t)slot * (size_t)w->m : model->zero;
    }
    return b;
}

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

/* find_half_diagonal_of, with a constant number of rows in the frequent cases, so that loops can be unrolled. */
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
        const kt_half_batch rows = equations(model, &w, h, b);
        kt_half_find_columns(model, data, group, h, &rows);
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
        const kt_half_batch b = {.force = force + j, .forces = count - j < LANES ? count - j : LANES, .column = u};
        kt_half_find_columns(model, data, group, h, &b);
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
