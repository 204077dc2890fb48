/* Right-hand sides of kkt.h, a strip of columns at a time: wrenches from the tips to the ground, accelerations
 * back. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/kkt_columns.h"

#define KT_COLUMN column8
#define KT_COLUMN_SHIFT kt_motion_shift_of8
#include "reduction/front_constants.h"

/* ---- a group by fronts, to the ground ---------------------------------------------------------------------------- */

/* The joint force, and the wrench I t + P on the link, in g. */
KT_INLINE void pull_link(const columns *k, const front *o, int params) {
    const size_t i = (size_t)o->step->link;
    const int c = o->components, n = o->count->params;
    const double *inertia = k->w->inertia + (size_t)(KT_FRONT_SPACE * KT_FRONT_SPACE) * i;
    const double *motion = o->f.w.front + o->step->at;
    const column8 *t = constant_at(&o->f, k->constant, o->s);
    column8 wrench[KT_FRONT_SPACE], *pull = k->pull + o->base;
    memcpy(wrench, motion_of(k, i), (size_t)c * sizeof *wrench);
    for (int j = 0; j < c; j++)
        add(inertia + j * c, t[j], c, wrench);
    for (int d = 0; d < n - params; d++)
        pull[params + d] = k->x[k->model->link[i].v + d];
    if (k->w->metric != KT_METRIC_MASS)
        return;
    for (int j = 0; j < c; j++)
        for (int p = 0; p < n; p++)
            pull[p] -= splat(motion[j * n + p]) * wrench[j];
    if (!o->base)
        return;
    kt_wrench_shift_of8(c, k->data->front_motion[o->f.group->v + k->model->link[i].local].point, wrench);
    for (int j = 0; j < c; j++)
        k->pull[j] -= wrench[j];
}

/* h = g - H W e,   p0 = W e,   t += T W e */
KT_INLINE void impose(const columns *k, front *o) {
    const int n = o->count->params, rank = o->count->rank, all = o->base + n;
    for (int j = 0; j < rank; j++) {
        add(o->map.pull + j * all, -k->z[j], all, k->pull);
        add(o->map.close + j * n, k->z[j], n, o->found);
    }
    add_y(&o->f, k->constant, o->map.reach, rank, k->z);
}

/* p0 += N N' h,   g = (G' h, h_A - G_A' h) */
KT_INLINE void minimise(const columns *k, front *o) {
    const int n = o->count->params, kept = o->count->kept, u = o->count->left - kept;
    column8 *h = k->pull + o->base;
    for (int i = 0; i < u; i++)
        add(o->map.free + i * n, dot(o->map.free + i * n, h, n), n, o->found);
    for (int c = 0; c < o->base; c++)
        k->pull[c] += dot(o->map.back + c * n, h, n);
    for (int c = 0; c < kept; c++)
        k->z[c] = dot(o->map.back + (o->base + c) * n, h, n);
    memcpy(h, k->z, (size_t)kept * sizeof *h);
}

/* Backward pass through the steps of a group with fronts. The factors are known, and only the constants change.
 * front_solve.c has the same pass for one right-hand side. */
KT_INLINE void backward_pass_front(const columns *k, size_t g, int c) {
    front o;
    int params = 0;
    begin_front(k, g, c, &o);
    clear(k->pull, o.base);
    for (int s = 0; s < o.f.group->link_count; s++) {
        begin_step(k, &o, s);
        enter_slots(&o.f, k->constant, s);
        pull_link(k, &o, params);
        clear(o.found, o.count->params);
        if (o.count->rank)
            find_right(&o.f, k->constant, s, k->b + o.f.group->row, k->z);
        if (o.count->received || o.count->delayed)
            pass_delayed(&o.f, k->constant, s);
        kt_front_release_last_uses(&o.f, o.step);
        if (o.count->rank)
            impose(k, &o);
        minimise(k, &o);
        params = o.count->kept;
    }
    for (int j = 0; j < o.base; j++)
        motion_of(k, (size_t)o.f.group->parent)[j] -= k->pull[j];
}

/* ---- and back ---------------------------------------------------------------------------------------------------- */

/* Forward pass through the steps of a group with fronts: the parameters p of each step follow from those of the step
 * after and from the parent's acceleration. The last parameters are the link's own coordinates. */
KT_INLINE void ascend(const columns *k, size_t g, int c) {
    front o;
    begin_front(k, g, c, &o);
    memcpy(k->z, motion_of(k, (size_t)o.f.group->parent), (size_t)o.base * sizeof *k->z);
    for (int s = o.f.group->link_count - 1; s >= 0; s--) {
        begin_step(k, &o, s);
        const kt_link *link = &k->model->link[o.step->link];
        const int dofs = kt_link_dofs(link), n = o.count->params;
        for (int i = 0; i < o.base + o.count->kept; i++) /* p = p0 + G p_t - G_A A */
            add(o.map.back + i * n, k->z[i], n, o.found);
        memcpy(k->z + o.base, o.found, (size_t)(n - dofs) * sizeof *k->z);
        memcpy(k->x + link->v, o.found + n - dofs, (size_t)dofs * sizeof *k->x);
    }
}

/* ---- a group by dense matrices ----------------------------------------------------------------------------------- */

/* f - F P in k->x, and P of the group on its parent. */
KT_INLINE void sum_forces(const columns *k, const kt_group *group, int c) {
    for (int l = group->link_count - 1; l >= 0; l--) {
        const size_t i = (size_t)k->model->group_link[group->link + l];
        const kt_link *link = &k->model->link[i];
        const column8 *p = motion_of(k, i);
        for (int d = 0; d < kt_link_dofs(link); d++)
            k->x[link->v + d] -= dot(kt_kkt_axis(k->w, i) + d * KT_FRONT_SPACE, p, c);
        pass_wrench(k, i, c);
    }
}

/* Backward pass of a dense group: the coordinates y for a parent at rest, from the forces h and the right-hand sides
 * b. The wrench on the parent is F y. */
KT_INLINE void backward_pass_dense(const columns *k, size_t g, int c) {
    const kt_group *group = &k->model->group[g];
    const kt_group_work of = kt_group_matrices(k->model, k->data, g, k->w->rows);
    const int m = of.m, rank = k->data->rank[g];
    const int32_t *v = k->model->group_v + group->v;
    const column8 *b = k->b + group->row;
    column8 *h = k->force, *y = k->response;
    kt_kkt_map map;
    (void)kt_kkt_group_map_find(&of, rank, k->w->map + k->w->begin[g], &map);
    if (k->w->metric == KT_METRIC_MASS)
        sum_forces(k, group, c);
    clear(y, m);
    for (int i = 0; i < m; i++)
        h[i] = k->x[v[i]];
    for (int r = 0; r < of.k; r++) {
        add(map.pull + r * m, -b[r], m, h);
        add(map.close + r * m, b[r], m, y);
    }
    for (int j = 0; j < m - rank; j++)
        add(map.free + j * m, dot(map.free + j * m, h, m), m, y);
    for (int i = 0; i < m; i++) {
        k->x[v[i]] = y[i];
        if (base_of(k, g, c))
            add(of.coupling + c * i, y[i], c, motion_of(k, (size_t)group->parent));
    }
}

/* Forward pass of a dense group: x -= K a, with the acceleration a of the parent. */
KT_INLINE void ascend_dense(const columns *k, size_t g, int c) {
    const kt_group *group = &k->model->group[g];
    const kt_group_work of = kt_group_matrices(k->model, k->data, g, k->w->rows);
    const column8 *a = motion_of(k, (size_t)group->parent);
    for (int i = 0; i < of.m && group->parent; i++)
        for (int j = 0; j < c; j++)
            k->x[k->model->group_v[group->v + i]] -= splat(of.gain[j * of.m + i]) * a[j];
}

/* ---- all links --------------------------------------------------------------------------------------------------- */

/* Backward pass at a link outside of groups: x becomes (x - s . p) / D, and the wrench p grows by the force times
 * the gain. */
KT_INLINE void eliminate(const columns *k, size_t i, int c) {
    const kt_link *link = &k->model->link[i];
    column8 *p = motion_of(k, i);
    for (int d = kt_link_dofs(link) - 1; d >= 0; d--) {
        const size_t v = (size_t)link->v + (size_t)d;
        const column8 force = k->x[v] - dot(k->w->axis + KT_FRONT_SPACE * v, p, c);
        k->x[v] = force * splat(k->w->inverse[v]);
        add(k->w->gain + KT_FRONT_SPACE * v, force, c, p);
    }
    pass_wrench(k, i, c);
}

/* Forward pass at a link: its acceleration is that of its parent, plus s x of its own coordinates. */
KT_INLINE void respond(const columns *k, size_t i, int c) {
    const kt_link *link = &k->model->link[i];
    column8 *a = carried_motion(k, i, c);
    for (int d = 0; d < kt_link_dofs(link); d++) {
        const size_t v = (size_t)link->v + (size_t)d;
        if (link->group < 0)
            k->x[v] -= dot(k->w->gain + KT_FRONT_SPACE * v, a, c);
        add(k->w->axis + KT_FRONT_SPACE * v, k->x[v], c, a);
    }
}

KT_INLINE bool is_first(const kt_model *model, size_t i) {
    const int32_t g = model->link[i].group;
    return g >= 0 && model->group_link[model->group[g].link] == (int32_t)i;
}

/* Backward pass at link i, with wrenches of c components (3 in a plane, otherwise 6). A group is reduced at its first
 * link, which the pass reaches last. */
KT_INLINE void backward_pass(const columns *k, size_t i, int c) {
    const int32_t g = k->model->link[i].group;
    if (g < 0)
        eliminate(k, i, c);
    else if (is_first(k->model, i) && k->model->group[g].has_fronts)
        backward_pass_front(k, (size_t)g, c);
    else if (is_first(k->model, i))
        backward_pass_dense(k, (size_t)g, c);
}

/* Forward pass at link i. A group responds at its first link. */
KT_INLINE void forward_pass(const columns *k, size_t i, int c) {
    const int32_t g = k->model->link[i].group;
    if (is_first(k->model, i) && k->model->group[g].has_fronts)
        ascend(k, (size_t)g, c);
    else if (is_first(k->model, i))
        ascend_dense(k, (size_t)g, c);
    respond(k, i, c);
}

/* In the metric of the coordinates, groups do not depend on each other, and outside of groups x = f. i: a link of the
 * group. */
KT_INLINE void solve_group(const columns *k, size_t i, int c) {
    const size_t g = (size_t)k->model->link[i].group;
    if (k->model->group[g].has_fronts) {
        backward_pass_front(k, g, c);
        ascend(k, g, c);
    } else {
        backward_pass_dense(k, g, c);
    }
}

static void solve_apart(const columns *k) {
    for (size_t g = 0; g < k->model->n.group; g++)
        pass_link(k, (size_t)k->model->group_link[k->model->group[g].link], solve_group);
}

/* Solves for the columns of a strip, in place. */
static void solve_kkt_columns(const columns *k) {
    const size_t count = k->model->n.link;
    if (k->w->metric != KT_METRIC_MASS) {
        solve_apart(k);
        return;
    }
    clear(k->motion, (int)(KT_FRONT_SPACE * count));
    for (size_t i = count - 1; i > 0; i--)
        pass_link(k, i, backward_pass);
    for (size_t i = 1; i < count; i++)
        pass_link(k, i, forward_pass);
}

/* b of one column, by groups and slots. */
static void load_equations(const columns *k, const double *b, int lane) {
    const kt_model *model = k->model;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        for (int i = 0; i < group->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
            const int32_t *slot = model->slot + loop->slot;
            for (int r = 0; r < loop->row_count; r++)
                if (slot[r] >= 0)
                    k->b[group->row + slot[r]][lane] = b[loop->equation + r];
        }
    }
}

void KT_KERNEL(kt_kkt_solve)(const kt_kkt *w, size_t count, double *f, const double *b) {
    const columns k = columns_of(w);
    const size_t n = w->model->n.v, p = w->model->n.row;
    clear(k.b, (int)p);
    for (size_t from = 0; from < count; from += KT_KKT_LANES) {
        const int lanes = count - from < KT_KKT_LANES ? (int)(count - from) : KT_KKT_LANES;
        gather_columns_by_lane(&k, n, lanes, f + from * n);
        for (int lane = 0; lane < lanes && b; lane++)
            load_equations(&k, b + (from + (size_t)lane) * p, lane);
        solve_kkt_columns(&k);
        scatter_columns_by_lane(k.x, n, lanes, f + from * n);
    }
}
