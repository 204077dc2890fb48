/* The parts of reduced matrices, after a factorisation with the metric of the coordinates. M x is found by inverse
 * dynamics at rest and without gravity, from the tips to the ground:
 *
 *     A = shifted A of the parent + S x,   P = I A + shifted P of the children,   M x = S.P + armature x
 *
 * For Z' x, the columns of Z are orthonormal. For a group by fronts, the columns are the parameters on which no later
 * step depends. With the coordinates x in h, step by step,
 *
 *     z = C_u' h,   h = C_t' h for the next step
 *
 * For a group by dense matrices, the columns are its null space. Finally, each coordinate outside groups has a column.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/kkt_columns.h"

#include <string.h>

/* ---- M x --------------------------------------------------------------------------------------------------------- */

/* The acceleration A of a link: that of its parent, and S x of its own coordinates. */
KT_INLINE void accelerate(const columns *k, size_t i, int c) {
    const kt_link *link = &k->model->link[i];
    column8 *a = carried_motion(k, i, c);
    for (int d = 0; d < kt_link_dofs(link); d++)
        add(kt_kkt_axis(k->w, i) + d * KT_FRONT_SPACE, k->x[link->v + d], c, a);
}

/* Replaces the acceleration A of a link by the wrench I A. */
KT_INLINE void load(const columns *k, size_t i, int c) {
    const double *inertia = k->w->inertia + (size_t)(KT_FRONT_SPACE * KT_FRONT_SPACE) * i;
    column8 p[KT_FRONT_SPACE], *a = motion_of(k, i);
    clear(p, c);
    for (int j = 0; j < c; j++)
        add(inertia + j * c, a[j], c, p);
    memcpy(a, p, (size_t)c * sizeof *a);
}

/* M x of the link's coordinates, and P for the parent. */
KT_INLINE void hand_down(const columns *k, size_t i, int c) {
    const kt_link *link = &k->model->link[i];
    const column8 *p = motion_of(k, i);
    for (int d = 0; d < kt_link_dofs(link); d++)
        k->x[link->v + d] = dot(kt_kkt_axis(k->w, i) + d * KT_FRONT_SPACE, p, c) +
                            splat(k->model->armature[link->v + d]) * k->x[link->v + d];
    pass_wrench(k, i, c);
}

/* M x for all columns: accelerations from the ground to the tips, their wrenches, and the sums of these back to the
 * ground. */
static void apply_mass_to_columns(const columns *k) {
    const size_t count = k->model->n.link;
    clear(k->motion, KT_FRONT_SPACE); /* the ground */
    for (size_t i = 1; i < count; i++)
        pass_link(k, i, accelerate);
    for (size_t i = 1; i < count; i++)
        pass_link(k, i, load);
    for (size_t i = count - 1; i > 0; i--)
        pass_link(k, i, hand_down);
}

/* ---- Z' x -------------------------------------------------------------------------------------------------------- */

/* The numbers of one group follow at `z`; returns their end. */
static column8 *restrict_front(const columns *k, size_t g, column8 *z) {
    front o;
    int params = 0;
    begin_front(k, g, 0, &o);
    for (int s = 0; s < o.f.group->link_count; s++) {
        begin_step(k, &o, s);
        const int n = o.count->params, kept = o.count->kept, u = o.count->left - kept;
        for (int d = 0; d < n - params; d++)
            k->pull[params + d] = k->x[k->model->link[o.step->link].v + d];
        for (int i = 0; i < u; i++)
            *z++ = dot(o.map.free + i * n, k->pull, n);
        for (int c = 0; c < kept; c++)
            k->z[c] = dot(o.map.back + c * n, k->pull, n);
        memcpy(k->pull, k->z, (size_t)kept * sizeof *k->z);
        params = kept;
    }
    return z;
}

/* z = Z' x for the free directions Z of a dense group. Returns the end of z. */
static column8 *restrict_dense(const columns *k, size_t g, column8 *z) {
    const kt_group *group = &k->model->group[g];
    const kt_group_work of = kt_group_matrices(k->model, k->data, g, k->w->rows);
    const int rank = k->data->rank[g];
    kt_kkt_map map;
    (void)kt_kkt_group_map_find(&of, rank, k->w->map + k->w->begin[g], &map);
    for (int j = 0; j < of.m - rank; j++, z++) {
        *z = splat(0.0);
        for (int i = 0; i < of.m; i++)
            *z += splat(map.free[j * of.m + i]) * k->x[k->model->group_v[group->v + i]];
    }
    return z;
}

/* Writes z = Z' x to k->response, for the free directions Z of all groups, and then the coordinates outside of
 * groups. */
static void restrict_columns(const columns *k) {
    column8 *z = k->response;
    for (size_t g = 0; g < k->model->n.group; g++)
        z = (k->model->group[g].has_fronts ? restrict_front : restrict_dense)(k, g, z);
    for (size_t i = 1; i < k->model->n.link; i++)
        for (int d = 0; d < kt_link_dofs(&k->model->link[i]) && k->model->link[i].group < 0; d++)
            *z++ = k->x[k->model->link[i].v + d];
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

/* Computes columns of `rows` numbers, which `compute` leaves in `found`, from columns of nv. */
static void compute_strips(const columns *k, size_t count, const double *x, void (*compute)(const columns *),
                           const column8 *found, size_t rows, double *out) {
    const size_t n = k->model->n.v;
    for (size_t from = 0; from < count; from += KT_KKT_LANES) {
        const int lanes = count - from < KT_KKT_LANES ? (int)(count - from) : KT_KKT_LANES;
        gather_columns_by_lane(k, n, lanes, x + from * n);
        compute(k);
        scatter_columns_by_lane(found, rows, lanes, out + from * rows);
    }
}

void KT_KERNEL(kt_kkt_apply_mass)(const kt_kkt *w, size_t count, double *x) {
    const columns k = columns_of(w);
    compute_strips(&k, count, x, apply_mass_to_columns, k.x, w->model->n.v, x);
}

void KT_KERNEL(kt_kkt_restrict)(const kt_kkt *w, size_t dofs, size_t count, const double *x, double *z) {
    const columns k = columns_of(w);
    compute_strips(&k, count, x, restrict_columns, k.response, dofs, z);
}
