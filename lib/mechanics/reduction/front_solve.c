/* The elimination of a constraint group link by link, of equations that have been factored, and the backward pass:
 * front.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front.h"

#include "reduction/maggi_kane.h"

#define KT_COLUMN double
#define KT_COLUMN_SHIFT kt_motion_shift
#include "reduction/front_constants.h"

#include <assert.h>
#include <string.h>

/* ---- the energy -------------------------------------------------------------------------------------------------- */

/* Replaces H by G H G for the reflector G = 1 - t u u' of `all` entries; the entries of u before `from` are zero.
 * Replaces g by G g, and the sizes of the terms on the diagonal of H by those of the sums. */
KT_INLINE void reflect_energy(const kt_front *f, const double *u, double t, int from, int all) {
    const int stride = f->stride;
    double *h = f->energy, *w = f->product, *size = f->size, whole = 0.0;
    for (int i = 0; i < all; i += KT_FRONT_LANES) {
        kt_v4 sum = kt_v4_splat(0.0);
        for (int c = from; c < all; c++)
            sum += kt_v4_splat(u[c]) * kt_v4_load(h + c * stride + i);
        kt_v4_store(w + i, kt_v4_splat(t) * sum);
    }
    kt_front_add(-0.5 * t * kt_front_dot(u, w, all), u, all, w);
    for (int c = 0; c < all; c++) {
        double *x = h + c * stride;
        const kt_v4 uc = kt_v4_splat(u[c]), wc = kt_v4_splat(w[c]);
        for (int i = 0; i < all; i += KT_FRONT_LANES)
            kt_v4_store(x + i, kt_v4_load(x + i) - (wc * kt_v4_load(u + i) + uc * kt_v4_load(w + i)));
    }
    kt_front_reflect(u, t, all, f->pull);
    for (int i = from; i < all; i++)
        whole += u[i] * u[i] * size[i];
    for (int i = from; i < all; i++) {
        const double square = t * u[i] * u[i];
        size[i] = size[i] * (1.0 - 2.0 * square) + t * square * whole;
    }
}

/* The reflector of an equation, or one of n entries that are all stored, behind the parent's acceleration; of `all`
 * entries in f->spare. */
KT_INLINE void expand_equation_row(const kt_front *f, const double *row, int head, int base, int all) {
    memset(f->spare, 0, (size_t)kt_front_padded(all) * sizeof *f->spare);
    f->spare[base + head] = 1.0;
    for (int i = head + 1; i < all - base; i++)
        f->spare[base + i] = row[i];
}
KT_INLINE void expand_reflector_to_rows(const kt_front *f, const double *u, int base, int all) {
    memset(f->spare, 0, (size_t)kt_front_padded(all) * sizeof *f->spare);
    memcpy(f->spare + base, u, (size_t)(all - base) * sizeof *u);
}

/* Extends the energy of `all` parameters by `more` parameters, with zero entries. */
KT_INLINE void extend_energy(const kt_front *f, int all, int more) {
    const int end = kt_front_padded(all + more);
    for (int c = 0; c < all + more; c++)
        for (int i = c < all ? all : 0; i < end; i++)
            f->energy[c * f->stride + i] = 0.0;
    for (int i = all; i < end; i++)
        f->pull[i] = f->size[i] = 0.0;
}

/* Removes `count` parameters from `at` on. */
KT_INLINE void remove_params(const kt_front *f, int at, int count, int all) {
    const int stride = f->stride;
    for (int c = 0; c < all; c++) {
        if (c >= at && c < at + count)
            continue;
        const double *from = f->energy + c * stride;
        double *to = f->energy + (c < at ? c : c - count) * stride;
        for (int i = 0; i < at && c >= at; i++)
            to[i] = from[i];
        for (int i = at + count; i < all; i++)
            to[i - count] = from[i];
    }
    for (int i = at + count; i < all; i++) {
        f->pull[i - count] = f->pull[i];
        f->size[i - count] = f->size[i];
    }
}

/* T of a link by components: the parent's acceleration at the link's origin, then the parameters. */
KT_INLINE void expand_joint_motion(const kt_front *f, const kt_front_step *step, const double *motion, int base,
                                   int n) {
    const int c = f->components, end = kt_front_padded(base + n);
    double *t = f->product;
    for (int i = 0; i < base; i++) {
        double x[KT_FRONT_SPACE] = {0.0};
        x[i] = 1.0;
        kt_motion_shift(c, f->data->front_motion[f->group->v + f->model->link[step->link].local].point, x);
        for (int k = 0; k < c; k++)
            t[k * f->stride + i] = x[k];
    }
    for (int k = 0; k < c; k++) {
        memcpy(t + k * f->stride + base, motion + k * n, (size_t)n * sizeof *t);
        for (int i = base + n; i < end; i++)
            t[k * f->stride + i] = 0.0;
    }
}

/* Adds T' I T, four rows of its lower triangle at a time, and -T' p to the forces. */
KT_INLINE void add_energy(const kt_front *f, int c, int all, const double *inertia, const double *p) {
    const int stride = f->stride;
    const double *t = f->product;
    for (int i = 0; i < all; i += KT_FRONT_LANES) {
        kt_v4 force[KT_FRONT_SPACE] = {{0.0}}, pull = kt_v4_load(f->pull + i), size = kt_v4_load(f->size + i);
        for (int j = 0; j < c; j++) {
            const kt_v4 x = kt_v4_load(t + j * stride + i);
            for (int k = 0; k < c; k++)
                force[k] += kt_v4_splat(inertia[j * c + k]) * x;
            pull -= kt_v4_splat(p[j]) * x;
            size += kt_v4_splat(inertia[j * (c + 1)]) * (x * x);
        }
        kt_v4_store(f->pull + i, pull);
        kt_v4_store(f->size + i, size);
        for (int j = 0; j < all && j < i + KT_FRONT_LANES; j++) {
            kt_v4 sum = force[0] * kt_v4_splat(t[j]);
            for (int k = 1; k < c; k++)
                sum += force[k] * kt_v4_splat(t[k * stride + j]);
            kt_v4_store(f->energy + j * stride + i, kt_v4_load(f->energy + j * stride + i) + sum);
        }
    }
    for (int j = 0; j < all; j++)
        for (int i = j + 1; i < all; i++)
            f->energy[i * stride + j] = f->energy[j * stride + i];
}

/* Adds the energy of a link: T' IA T, and the forces -T' (IA t + bias). Parameters: the parent's acceleration if
 * `base`, then n. */
KT_INLINE void apply_link_inertia(const kt_front *f, const kt_front_step *step, const double *motion, int base, int n,
                                  const double *constant) {
    const int c = f->components;
    double inertia[KT_FRONT_SPACE * KT_FRONT_SPACE], bias[KT_FRONT_SPACE];
    kt_front_inertia(f, step->link, inertia, bias);
    for (int k = 0; k < c; k++)
        for (int j = 0; j < c; j++)
            bias[k] += inertia[j * c + k] * constant[j];
    expand_joint_motion(f, step, motion, base, n);
    if (c == KT_FRONT_SPACE)
        add_energy(f, KT_FRONT_SPACE, base + n, inertia, bias);
    else
        add_energy(f, KT_FRONT_SPACE / 2, base + n, inertia, bias);
}

/* R1' y = e for the equations that the step completes. */
KT_INLINE void find_y(const kt_front *f, int s, const kt_front_factor *x) {
    const int rank = f->count[s].rank, n = f->count[s].params;
    find_right(f, f->constant, s, f->w.right, x->y);
    for (int j = 0; j < rank; j++) {
        double sum = x->y[j];
        for (int i = 0; i < j; i++)
            sum -= x->rows[j * n + i] * x->y[i];
        x->y[j] = sum / x->rows[j * (n + 1)];
    }
}

/* Stores a block of the factored energy for kt_kkt (kt_front_aim.kept): the columns at .. at + columns - 1, each
 * from entry `from` on. Does nothing unless the caller requested the factors. */
KT_INLINE void store_energy_rows(const kt_front *f, int at, int columns, int from, int rows) {
    for (int c = at; f->kept && c < at + columns; c++, *f->kept += rows)
        memcpy(*f->kept, f->energy + c * f->stride + from, (size_t)rows * sizeof **f->kept);
}

/* Puts p = Q (y, p2) into the energy. */
KT_INLINE void impose(const kt_front *f, int s, const kt_front_factor *x, int base) {
    const int n = f->count[s].params, rank = f->count[s].rank, all = base + n, stride = f->stride;
    for (int j = 0; j < rank; j++) {
        expand_equation_row(f, x->rows + j * n, j, base, all);
        reflect_energy(f, f->spare, x->scale[j], base + j, all);
    }
    store_energy_rows(f, base, rank, 0, all);
    for (int j = 0; j < rank; j++)
        kt_front_add(-x->y[j], f->energy + (base + j) * stride, all, f->pull);
    remove_params(f, base, rank, all);
}

/* Adds the squares of the violations (D p + gap) / scale, halved. */
KT_INLINE void add_violations(const kt_front *f, int s, const kt_front_factor *x, const double *gap) {
    const int n = f->count[s].params, stride = f->stride;
    const int32_t *pivot = f->w.pivot + f->count[s].first;
    for (int r = 0; r < f->count[s].rows; r++) {
        const double scale = f->w.scale[pivot[r]];
        double *d = f->spare;
        for (int i = 0; i < kt_front_padded(n); i++)
            d[i] = i < n ? x->rows[r * n + i] / scale : 0.0;
        kt_front_add(-gap[pivot[r]] / scale, d, n, f->pull);
        for (int i = 0; i < n; i++)
            kt_front_add(d[i], d, n, f->energy + i * stride);
    }
}

/* y = L^-1 y, y = L^-T y */
KT_INLINE void solve_lower(const kt_front *f, int at, int n, double *y) {
    const double *l = f->energy + at * (f->stride + 1);
    for (int j = 0; j < n; j++) {
        y[j] /= l[j * (f->stride + 1)];
        for (int i = j + 1; i < n; i++)
            y[i] -= l[j * f->stride + i] * y[j];
    }
}
/* y becomes L^-T y, for the factor L of the energy of n parameters from `at` on. */
KT_INLINE void solve_upper(const kt_front *f, int at, int n, double *y) {
    const double *l = f->energy + at * (f->stride + 1);
    for (int j = n - 1; j >= 0; j--) {
        for (int i = j + 1; i < n; i++)
            y[j] -= l[j * f->stride + i] * y[i];
        y[j] /= l[j * (f->stride + 1)];
    }
}

KT_INLINE void divide(double *x, int n, double by) {
    for (int i = 0; i < n; i += KT_FRONT_LANES)
        kt_v4_store(x + i, kt_v4_load(x + i) / kt_v4_splat(by));
}

/* Y = L^-1 H_ut by rows of t numbers, and H_tt - Y'Y, and g_t - Y' y for y = L^-1 g_u. */
KT_INLINE void couple(const kt_front *f, int t, int u, const double *y, double *rows) {
    const int stride = f->stride, end = kt_front_padded(t);
    const double *l = f->energy + t * (stride + 1);
    for (int i = 0; i < u; i++) {
        double *row = rows + i * end;
        memcpy(row, f->energy + (t + i) * stride, (size_t)t * sizeof *row);
        for (int k = t; k < end; k++)
            row[k] = 0.0;
        for (int j = 0; j < i; j++)
            kt_front_add(-l[j * stride + i], rows + j * end, t, row);
        divide(row, t, l[i * (stride + 1)]);
    }
    for (int i = 0; i < u; i++) {
        kt_front_add(-y[i], rows + i * end, t, f->pull);
        for (int c = 0; c < t; c++)
            kt_front_add(-rows[i * end + c], rows + i * end, t, f->energy + c * stride);
    }
}

/* Minimises over the parameters that nothing sees: p_u = free - gain (A, p_t). If checks_size, returns false if a pivot
 * is rounding relative to f->size; otherwise only a pivot that is not positive fails. */
KT_INLINE bool minimise(const kt_front *f, int s, const kt_front_factor *x, int base, bool checks_size) {
    const kt_front_count *count = &f->count[s];
    const int t = base + count->kept, u = count->left - count->kept, all = t + u, stride = f->stride;
    const int end = kt_front_padded(t);
    const double *l = f->energy + t * (stride + 1);
    if (u <= 0)
        return true;
    for (int j = 0; j < count->reflectors; j++) {
        const double *v = x->coupled + j * kt_front_padded(count->left);
        expand_reflector_to_rows(f, v, base, all);
        reflect_energy(f, f->spare, x->coupled_scale[j], base + (count->reflectors == count->kept ? j : 0), all);
    }
    if (!kt_dense_cholesky(f->energy + t * (f->stride + 1), (size_t)f->stride, u, checks_size ? f->size + t : NULL))
        return false;
    store_energy_rows(f, t, u, t, u);
    memcpy(x->free, f->pull + t, (size_t)u * sizeof *x->free);
    solve_lower(f, t, u, x->free);
    couple(f, t, u, x->free, x->gain);
    solve_upper(f, t, u, x->free);
    for (int i = u - 1; i >= 0; i--) {
        for (int j = i + 1; j < u; j++)
            kt_front_add(-l[i * stride + j], x->gain + j * end, t, x->gain + i * end);
        divide(x->gain + i * end, t, l[i * (stride + 1)]);
    }
    return true;
}

/* The least coordinates: all parameters that nothing sees are zero. */
KT_INLINE void store_minimisers(const kt_front *f, int s, const kt_front_factor *x) {
    const size_t u = (size_t)(f->count[s].left - f->count[s].kept);
    memset(x->free, 0, u * sizeof *x->free);
    memset(x->gain, 0, u * (size_t)kt_front_padded(f->count[s].kept) * sizeof *x->gain);
}

/* Adds the energy of the rotors of a link, whose coordinates are parameters from `at` on. */
static __attribute__((noinline)) void add_armature(const kt_front *f, const kt_link *link, int at) {
    for (int d = 0; d < kt_link_dofs(link); d++) {
        const double armature = f->model->armature[link->v + d];
        f->energy[(at + d) * (f->stride + 1)] += armature;
        f->size[at + d] += armature;
    }
}

/* Adds the energy of a link's own coordinates, and for dynamics all of its energy. has_armature is a constant at each
 * use, so that models without armature have code of their own. */
KT_INLINE void add_link(const kt_front *f, int s, const kt_front_factor *x, const kt_front_aim *aim, int base,
                        int first, bool has_armature) {
    const kt_front_step *step = &f->step[s];
    const kt_link *link = &f->model->link[step->link];
    const int dofs = f->count[s].params - first;
    extend_energy(f, base + first, dofs);
    if (aim->kind == KT_FRONT_DYNAMICS)
        apply_link_inertia(f, step, x->motion, base, f->count[s].params, kt_front_constant(f, s));
    if (has_armature && aim->kind == KT_FRONT_DYNAMICS)
        add_armature(f, link, base + first);
    for (int d = 0; d < dofs; d++) {
        const int at = base + first + d;
        const double unit = f->model->unit[f->group->v + link->local + d];
        if (aim->kind == KT_FRONT_DYNAMICS)
            f->pull[at] += f->w.bias[link->local + d] = aim->tau[link->v + d];
        else
            f->energy[at * (f->stride + 1)] = aim->damping / (unit * unit);
    }
}

/* The elimination of a group, a link after the other (front.h): the link's inertia is added, the equations that the
 * step completes are imposed, and the parameters on which no later equation depends are eliminated. Returns false if
 * the inertia of such a parameter is not positive. */
KT_INLINE bool reduce_steps(kt_front *f, const kt_front_aim *aim, int base, bool has_armature) {
    const bool dynamics = aim->kind == KT_FRONT_DYNAMICS, least = aim->kind == KT_FRONT_COORDINATES;
    int params = 0;
    extend_energy(f, 0, base);
    for (int s = 0; s < f->group->link_count; s++) {
        const kt_front_step *step = &f->step[s];
        const kt_front_count *count = &f->count[s];
        kt_front_factor x;
        kt_front_factor_find(f, s, &x);
        enter_slots(f, f->constant, s);
        if (!least)
            add_link(f, s, &x, aim, base, params, has_armature);
        if (aim->kind == KT_FRONT_DAMPED)
            add_violations(f, s, &x, aim->gap);
        if (count->rank)
            find_y(f, s, &x);
        if (count->received || count->delayed)
            pass_delayed(f, f->constant, s);
        kt_front_release_last_uses(f, step);
        if (count->rank && !least)
            impose(f, s, &x, base);
        if (count->rank)
            add_y(f, f->constant, x.early, count->rank, x.y);
        if (least)
            store_minimisers(f, s, &x);
        else if (!minimise(f, s, &x, base, dynamics))
            return false;
        params = count->kept;
    }
    return true;
}

static __attribute__((noinline)) bool reduce_armature(kt_front *f, const kt_front_aim *aim, int base) {
    return reduce_steps(f, aim, base, true);
}

bool KT_KERNEL(kt_front_reduce)(const kt_model *model, kt_data *data, size_t g, const kt_front_aim *aim,
                                kt_front_total *total) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(aim->kind != KT_FRONT_DYNAMICS || aim->tau != NULL);
    assert(aim->kind != KT_FRONT_DAMPED || (aim->gap != NULL && aim->damping >= 0.0));
    assert(!aim->base || total != NULL);
    kt_front f;
    kt_front_find(model, data, g, data->factored[g], &f);
    f.kept = aim->kept;
    const int base = aim->base ? f.components : 0;
    const bool done = model->has_armature ? reduce_armature(&f, aim, base) : reduce_steps(&f, aim, base, false);
    for (int c = 0; c < base && done; c++) {
        total->bias[c] = -f.pull[c];
        memcpy(total->inertia + c * base, f.energy + c * f.stride, (size_t)base * sizeof(double));
    }
    return done;
}

/* ---- the backward pass ------------------------------------------------------------------------------------------- */

/* Computes p of a step before its changes of parameters, from the parameters after the changes. The parent's
 * acceleration, of `base` components, comes first. */
KT_INLINE void substitute(const kt_front *f, int s, int base, double *z) {
    const kt_front_count *count = &f->count[s];
    const int kept = count->kept, left = count->left, rank = count->rank, n = count->params, u = left - kept;
    kt_front_factor x;
    double *p = z + base;
    kt_front_factor_find(f, s, &x);
    for (int i = 0; i < u; i++) {
        const double *gain = x.gain + i * kt_front_padded(base + kept);
        p[kept + i] = x.free[i] - (base + kept ? kt_front_dot(gain, z, base + kept) : 0.0);
    }
    for (int j = count->reflectors - 1; j >= 0; j--)
        kt_front_reflect(x.coupled + j * kt_front_padded(left), x.coupled_scale[j], left, p);
    if (!rank)
        return;
    for (int i = left - 1; i >= 0; i--)
        p[rank + i] = p[i];
    memcpy(p, x.y, (size_t)rank * sizeof *p);
    for (int j = rank - 1; j >= 0; j--) {
        kt_front_expand_reflector(x.rows + j * n, j, n, f->spare);
        kt_front_reflect(f->spare, x.scale[j], n, p);
    }
}

void KT_KERNEL(kt_front_respond)(const kt_model *model, kt_data *data, size_t g, const double *base, double *step) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    kt_front f;
    kt_front_find(model, data, g, data->factored[g], &f);
    const int count = base ? f.components : 0;
    for (int c = 0; c < f.stride; c++)
        f.z[c] = c < count ? base[c] : 0.0;
    for (int s = f.group->link_count - 1; s >= 0; s--) {
        substitute(&f, s, count, f.z);
        (void)kt_front_take_coordinates(&f, s, f.z + count, step);
    }
}
