/* Mass matrix: the composite-rigid-body algorithm (Walker & Orin 1982; Featherstone 2008, 6.2). The algorithm uses
 * world axes about each link's own origin.
 *
 * A composite has the inertia J about the origin, h = m c and m. Shifted by r to the parent's origin these are
 *   J + [h, r] + [r, h] + m [r, r],   h + m r,   m          with [u, w] = (u . w) I - w u'
 * Its wrench for a unit acceleration of degree of freedom k is carried to each ancestor j:
 *   F = (J s + h x s_f, m s_f + s x h),   M_jk = S_j . F
 * Backward pass: the composites and the wrenches F, a link after the other. Columns: F of a block of degrees of freedom
 * at a time (crba.h), from link to link in registers.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/crba.h"
#include "dynamics/aba.h"
#include "dynamics/sweep.h"

#include <assert.h>

/* ---- composites -------------------------------------------------------------------------------------------------- */

typedef struct composite {
    kt_v4 j[3], h;
    double m;
} composite;

KT_INLINE composite of_link(const kt_link *link, const kt_link_motion *m) {
    composite c;
    kt_rotate_inertia3(m->axes, &link->inertia, c.j);
    c.h = kt_v4_apply_to(m->axes, link->moment);
    c.m = link->mass;
    return c;
}

KT_INLINE void add(composite *to, const composite *from) {
    for (int k = 0; k < 3; k++)
        to->j[k] += from->j[k];
    to->h += from->h;
    to->m += from->m;
}

/* If several children add their composites, the sum is stored as an articulated inertia: j, moment = h, force = (m,
 * ..). */
KT_INLINE composite load(const kt_articulated *x) {
    return (composite){.j = {x->j[0], x->j[1], x->j[2]}, .h = x->moment, .m = x->force[0]};
}
KT_INLINE void store(const composite *c, kt_articulated *x) {
    for (int k = 0; k < 3; k++)
        x->j[k] = c->j[k];
    x->moment = c->h;
    x->force = kt_v4_splat(c->m);
}

/* Masks that keep only lane k of a vector. */
typedef int64_t lane_bits __attribute__((vector_size(32)));
static const lane_bits lane[3] = {{-1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, -1, 0}};

/* Shifts a composite to the parent's origin. */
KT_INLINE void shift(composite *c, kt_v4 r) {
    const kt_v4 h = c->h, w = h + kt_v4_splat(c->m) * r; /* [h, r] + [r, h] + m [r, r] = [w, r] + [r, h] */
    const lane_bits diagonal = (lane_bits)kt_v4_splat(kt_v4_dot2(w, r, r, h));
    for (int k = 0; k < 3; k++)
        c->j[k] += (kt_v4)(diagonal & lane[k]) - (r * kt_v4_splat(w[k]) + h * kt_v4_splat(r[k]));
    c->h = w;
}

/* The destination of the wrenches of unit accelerations. */
typedef struct wrench_columns {
    const composite *c;
    double *first; /* of the link's degrees of freedom: the x component of the moment; the others `stride` apart */
    size_t stride;
} wrench_columns;

/* Writes the wrench I s that a unit acceleration along the degree of freedom s requires, about the link's origin.
 * The composite inertia I has the mass m, the first moment h and the inertia j. A column has three moments and three
 * forces. */
KT_INLINE void add_wrench(const kt_dof *dof, void *context) {
    const wrench_columns *w = context;
    const composite *c = w->c;
    kt_v4 moment, force;
    if (dof->kind == KT_DOF_TRANSLATION) {
        moment = kt_v4_cross(c->h, dof->u);
        force = kt_v4_splat(c->m) * dof->u;
    } else {
        moment = kt_v4_apply(c->j, dof->u);
        force = kt_v4_cross(dof->u, c->h);
    }
    if (dof->kind == KT_DOF_SCREW) {
        const kt_v4 linear = kt_dof_linear(dof);
        moment += kt_v4_cross(c->h, linear);
        force += kt_v4_splat(c->m) * linear;
    }
    double *at = w->first + dof->index;
    for (size_t k = 0; k < 3; k++) {
        at[k * w->stride] = moment[k];
        at[(k + 3) * w->stride] = force[k];
    }
}

/* The axes of the previous link are still in registers for the link that follows it. */
KT_INLINE void poses(const kt_model *model, kt_data *data, const double *q) {
    kt_link_motion *motion = data->motion;
    kt_sincos_gather(q, model->angle, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(kt_v4_splat(0.0), &motion[0]);
    kt_v4 axes[3] = {motion[0].axes[0], motion[0].axes[1], motion[0].axes[2]};
    for (size_t i = 1; i < model->n.spatial; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *up = &motion[link->parent];
        kt_link_motion *m = &motion[i];
        if (!link->follows)
            for (int k = 0; k < 3; k++)
                axes[k] = up->axes[k];
        if (kt_link_is_revolute(link) && !link->rest_is_rotated) {
            m->offset = kt_v4_apply_to(axes, link->at);
            kt_revolute_pose(link, axes, q, data->cosine, data->sine, m);
        } else {
            kt_link_pose(link, up, q, data->cosine, data->sine, m);
        }
        for (int k = 0; k < 3; k++)
            axes[k] = m->axes[k];
        kt_articulated_clear(link, &data->articulated[link->articulated]);
    }
}

static inline bool composite_is_finite(const composite *c) {
    const kt_v4 all = c->j[0] + c->j[1] + c->j[2] + c->h, none = all - all;
    return none[0] + none[1] + none[2] == 0.0;
}

/* Returns a link on the ground whose composite is not finite, or 0. */
static inline size_t compose_links(const kt_model *model, kt_data *data) {
    const kt_link_motion *motion = data->motion;
    composite carried;
    wrench_columns columns = {.stride = kt_lanes8(model->n.v)};
    size_t dof = model->n.spatial_v;
    memset(&carried, 0, sizeof carried);
    for (size_t i = model->n.spatial - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i];
        composite c = of_link(link, m);
        if (link->leads)
            add(&c, &carried);
        if (link->branches) {
            const composite others = load(&data->articulated[link->articulated]);
            add(&c, &others);
        }
        if (link->parent == 0 && !composite_is_finite(&c))
            return i;
        dof -= kt_link_is_revolute(link) ? 1 : (size_t)kt_link_dofs(link);
        columns.c = &c;
        columns.first = data->scratch_v + dof;
        if (kt_link_is_revolute(link))
            add_wrench(&(kt_dof){.kind = KT_DOF_ROTATION, .u = kt_link_axis(link, m)}, &columns);
        else
            kt_dofs_visit(link, motion[link->parent].axes, m->axes, add_wrench, &columns);
        if (link->parent == 0)
            continue;
        shift(&c, m->offset);
        if (link->follows) {
            carried = c;
            continue;
        }
        composite sum = load(&data->articulated[model->link[link->parent].articulated]);
        add(&sum, &c);
        store(&sum, &data->articulated[model->link[link->parent].articulated]);
    }
    return 0;
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

typedef struct wrenches {
    kt_lanes n[3], f[3];
} wrenches;

KT_INLINE kt_lanes along(const double *u, const kt_lanes x[3]) { return (u[0] * x[0] + u[1] * x[1]) + u[2] * x[2]; }

typedef struct projection {
    const kt_mass_part *part;
    const wrenches *w;
    size_t v;
} projection;

/* M_jk = S_j . F */
KT_INLINE void project(const kt_dof *dof, void *context) {
    const projection *p = context;
    const wrenches *w = p->w;
    const double u[3] = {dof->u[0], dof->u[1], dof->u[2]};
    kt_lanes x = along(u, dof->kind == KT_DOF_TRANSLATION ? w->f : w->n);
    if (dof->kind == KT_DOF_SCREW)
        x += dof->pitch * along(u, w->f);
    kt_mass_part_put(p->part, p->v + (size_t)dof->index, x);
}

/* Writes the lanes of a block for link i, and transforms them to its parent. */
KT_INLINE void pass_link(const kt_link *link, const kt_link_motion *motion, size_t i, wrenches *w,
                         const kt_mass_part *p) {
    const kt_link_motion *m = &motion[i];
    const double *s = kt_v4_components(&m->axes[link[i].axis]), *r = kt_v4_components(&m->offset);
    if (kt_link_is_revolute(&link[i])) {
        kt_mass_part_put(p, (size_t)link[i].v, along(s, w->n));
    } else {
        projection to = {.part = p, .w = w, .v = (size_t)link[i].v};
        kt_dofs_visit(&link[i], motion[link[i].parent].axes, m->axes, project, &to);
    }
    w->n[0] += kt_mass_part_of(p, r[1] * w->f[2] - r[2] * w->f[1]);
    w->n[1] += kt_mass_part_of(p, r[2] * w->f[0] - r[0] * w->f[2]);
    w->n[2] += kt_mass_part_of(p, r[0] * w->f[1] - r[1] * w->f[0]);
}

KT_INLINE size_t dofs_of(const kt_link *link) { return kt_link_is_revolute(link) ? 1 : (size_t)kt_link_dofs(link); }

/* Writes the rows of a block. *last is the link of the block's last degree of freedom, and *dof the first degree of
 * freedom of that link. On return, both belong to the previous block. */
KT_INLINE void pass_block(const kt_model *model, const kt_data *data, const kt_mass_block *b, bool together,
                          size_t *last, size_t *dof) {
    const size_t stride = kt_lanes8(model->n.v);
    const kt_link *link = model->link;
    const kt_link_motion *motion = data->motion;
    wrenches w;
    for (size_t k = 0; k < 3; k++) {
        w.n[k] = kt_lanes_load(data->scratch_v + k * stride + b->first);
        w.f[k] = kt_lanes_load(data->scratch_v + (k + 3) * stride + b->first);
    }
    size_t i = *last, own = *dof;
    for (;; own -= dofs_of(&link[i])) {
        const size_t end = (size_t)link[i].end;
        const kt_mass_part part = kt_mass_part_make(b, together, own, end);
        pass_link(link, motion, i, &w, &part);
        kt_mass_block_clear(b, (size_t)link[i].v, dofs_of(&link[i]), end);
        if (own <= b->first)
            break;
        i--;
    }
    *dof = own;
    *last = i;
    if (own == b->first && --*last > 0)
        *dof -= dofs_of(&link[*last]);
    for (i = (size_t)link[i].parent; i > 0 && (size_t)link[i].end < b->end; i = (size_t)link[i].parent) {
        const kt_mass_part part = kt_mass_part_make(b, together, b->first, (size_t)link[i].end);
        pass_link(link, motion, i, &w, &part);
    }
    const kt_mass_part whole = kt_mass_part_whole(b, together);
    while (i > 0) {
        pass_link(link, motion, i, &w, &whole);
        i = __builtin_expect(link[i].follows, true) ? i - 1 : (size_t)link[i].parent;
    }
}

size_t KT_KERNEL(kt_mass_compose)(const kt_model *model, kt_data *data, const double *q) {
    assert(kt_data_serve(model, data));
    poses(model, data, q);
    return compose_links(model, data);
}

void KT_KERNEL(kt_mass_columns)(const kt_model *model, const kt_data *data, double *mass) {
    assert(kt_data_serve(model, data));
    size_t last = model->n.spatial - 1, dof = model->n.spatial_v - (size_t)kt_link_dofs(&model->link[last]);
    for (size_t end = model->n.spatial_v; end > 0;) {
        const kt_mass_block b = kt_mass_block_before(model, model->link_v, end, mass);
        if (b.together)
            pass_block(model, data, &b, true, &last, &dof);
        else
            pass_block(model, data, &b, false, &last, &dof);
        end = b.first;
    }
}

/* ---- the upper triangle ------------------------------------------------------------------------------------------ */

/* Two numbers each of two columns. */
KT_INLINE kt_v4 load_pairs(const double *x, const double *y) {
    return __builtin_shufflevector(kt_v2_load(x), kt_v2_load(y), 0, 1, 2, 3);
}
KT_INLINE void store4(double *x, kt_v4 v) { memcpy(x, &v, sizeof v); }

/* Transposes a block of 4 x 4 numbers between two arrays with rows of n numbers. */
KT_INLINE void transpose4(const double *from, double *to, size_t n) {
#if defined(__SSE2__) && !defined(__AVX__)
    /* Registers of two lanes, for which gcc compiles the shuffles below badly. */
    for (size_t k = 0; k < 4; k += 2)
        for (size_t l = 0; l < 4; l += 2) {
            const kt_v2 x = kt_v2_load(from + k * n + l), y = kt_v2_load(from + (k + 1) * n + l);
            kt_v2_store(to + l * n + k, __builtin_shufflevector(x, y, 0, 2));
            kt_v2_store(to + (l + 1) * n + k, __builtin_shufflevector(x, y, 1, 3));
        }
    return;
#endif
    const kt_v4 a = load_pairs(from, from + 2 * n), b = load_pairs(from + n, from + 3 * n);
    const kt_v4 c = load_pairs(from + 2, from + 2 * n + 2), d = load_pairs(from + n + 2, from + 3 * n + 2);
    store4(to, __builtin_shufflevector(a, b, 0, 4, 2, 6));
    store4(to + n, __builtin_shufflevector(a, b, 1, 5, 3, 7));
    store4(to + 2 * n, __builtin_shufflevector(c, d, 0, 4, 2, 6));
    store4(to + 3 * n, __builtin_shufflevector(c, d, 1, 5, 3, 7));
}

/* Copies the lower triangle to the upper triangle, in blocks of four by four. */
void KT_KERNEL(kt_mass_mirror)(size_t n, double *mass) {
    assert(n == 0 || mass != NULL);
    for (size_t first = 0; first < n; first += 4) { /* columns [first, end) of the lower triangle */
        const size_t end = first + 4 < n ? first + 4 : n;
        size_t row = end;
        for (size_t column = first; column < end; column++)
            for (size_t k = column + 1; k < end; k++)
                mass[k * n + column] = mass[column * n + k];
        for (; row + 4 <= n; row += 4) /* only four columns can have rows below them */
            transpose4(mass + first * n + row, mass + row * n + first, n);
        for (; row < n; row++)
            for (size_t column = first; column < end; column++)
                mass[row * n + column] = mass[column * n + row];
    }
}
