/* Mass matrix of planar trees: the composite-rigid-body algorithm of crba.c in the plane.
 *
 * A composite has J about the origin, h = m c and m. Shifted by r to the parent's origin these are
 *
 *   J + r . (2 h + m r),   h + m r,   m
 *
 * Its wrench for a unit acceleration of its joint is carried to each ancestor j, where M_jk = +-n or u . f:
 *
 *   revolute            (n, f) = (J, (-h_y, h_x))
 *   prismatic along u   (n, f) = (h x u, m u)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/crba.h"
#include "dynamics/sweep_planar.h"

#include <assert.h>

typedef struct composite {
    double j, h[2], m;
} composite;

KT_INLINE void add(composite *to, const composite *from) {
    to->j += from->j;
    to->h[0] += from->h[0];
    to->h[1] += from->h[1];
    to->m += from->m;
}

/* If several children add their composites, the sum is stored as a kt_planar_inertia: j, h = m c, xx = m. */
KT_INLINE composite load(const kt_planar_inertia *x) {
    return (composite){.j = x->j, .h = {x->h[0], x->h[1]}, .m = x->xx};
}
KT_INLINE void store(const composite *c, kt_planar_inertia *x) {
    *x = (kt_planar_inertia){.j = c->j, .h = {c->h[0], c->h[1]}, .xx = c->m};
}

KT_INLINE void shift(composite *c, const double r[2]) {
    const double hx = c->h[0] + c->m * r[0], hy = c->h[1] + c->m * r[1];
    c->j += r[0] * (c->h[0] + hx) + r[1] * (c->h[1] + hy);
    c->h[0] = hx;
    c->h[1] = hy;
}

/* Sets the wrench of a unit acceleration of the link's joint: n, f_x and f_y, `stride` apart. */
KT_INLINE void set_wrench(const kt_planar_link *link, const kt_planar_motion *m, const composite *c, double *w,
                          size_t stride) {
    if (link->revolute) {
        w[0] = link->sign * c->j;
        w[stride] = -link->sign * c->h[1];
        w[2 * stride] = link->sign * c->h[0];
        return;
    }
    double u[2];
    kt_planar_along(link, m, u);
    w[0] = c->h[0] * u[1] - c->h[1] * u[0];
    w[stride] = c->m * u[0];
    w[2 * stride] = c->m * u[1];
}

/* Forward pass: the poses of the links of a plane at q, and zeros for the composite inertias of links with several
 * children. */
KT_INLINE void poses(const kt_model *model, kt_data *data, const kt_plane *plane, const double *q) {
    static const double none[2] = {0.0, 0.0};
    kt_planar_motion *motion = data->planar;
    kt_planar_ground_set(none, &motion[0]);
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        (void)kt_planar_pose(link, kt_load2(motion[link->parent].rotation), q, data->planar_cosine, data->planar_sine,
                             &motion[k]);
        if (link->branches)
            data->planar_inertia[k] = (kt_planar_inertia){.j = 0.0};
    }
}

/* Returns the planar index of a link on the ground whose composite is not finite, or 0. */
static inline int32_t compose_planar_links(const kt_model *model, kt_data *data, const kt_plane *plane) {
    const kt_planar_motion *motion = data->planar;
    double *wrench = data->scratch_v + model->n.spatial_v - 1; /* of planar index 0 */
    composite carried = {.j = 0.0};
    for (int32_t k = plane->last - 1; k >= plane->first; k--) {
        const kt_planar_link *link = &model->planar[k];
        composite c = {.j = link->inertia, .m = link->mass};
        kt_planar_rotate(&motion[k], link->moment, c.h);
        if (link->leads)
            add(&c, &carried);
        if (link->branches) {
            const composite others = load(&data->planar_inertia[k]);
            add(&c, &others);
        }
        const double all = c.j + (c.h[0] + c.h[1]);
        if (link->parent == 0 && !(all - all == 0.0))
            return k;
        set_wrench(link, &motion[k], &c, wrench + k, kt_lanes8(model->n.v));
        shift(&c, motion[k].offset);
        if (link->follows) {
            carried = c;
        } else if (link->parent) {
            composite sum = load(&data->planar_inertia[link->parent]);
            add(&sum, &c);
            store(&sum, &data->planar_inertia[link->parent]);
        }
    }
    return 0;
}

typedef struct wrenches {
    kt_lanes n, f[2];
} wrenches;

/* Writes the lanes of a block for the link with planar index k, and transforms them to its parent. */
KT_INLINE void pass_link(const kt_model *model, const kt_data *data, size_t k, wrenches *w, const kt_mass_part *p) {
    const kt_planar_link *link = &model->planar[k];
    const kt_planar_motion *m = &data->planar[k];
    const double *r = m->offset;
    if (link->revolute) {
        kt_mass_part_put(p, (size_t)link->v, link->sign * w->n);
    } else {
        double u[2];
        kt_planar_along(link, m, u);
        kt_mass_part_put(p, (size_t)link->v, u[0] * w->f[0] + u[1] * w->f[1]);
    }
    w->n += kt_mass_part_of(p, r[0] * w->f[1] - r[1] * w->f[0]);
}

/* Does in the plane what pass_block of crba.c does in space. The planar index of a link is its degree of freedom plus
 * one. */
KT_INLINE void pass_block(const kt_model *model, const kt_data *data, const kt_mass_block *b, bool together) {
    const kt_planar_link *link = model->planar;
    const size_t stride = kt_lanes8(model->n.v);
    const double *wrench = data->scratch_v + model->n.spatial_v + b->first;
    wrenches w = {kt_lanes_load(wrench), {kt_lanes_load(wrench + stride), kt_lanes_load(wrench + 2 * stride)}};
    for (size_t k = b->end; k > b->first; k--) {
        const size_t end = (size_t)link[k].end;
        const kt_mass_part part = kt_mass_part_make(b, together, k - 1, end);
        pass_link(model, data, k, &w, &part);
        kt_mass_block_clear(b, (size_t)link[k].v, 1, end);
    }
    size_t k = (size_t)link[b->first + 1].parent;
    for (; k > 0 && (size_t)link[k].end < b->end; k = (size_t)link[k].parent) {
        const kt_mass_part part = kt_mass_part_make(b, together, b->first, (size_t)link[k].end);
        pass_link(model, data, k, &w, &part);
    }
    const kt_mass_part whole = kt_mass_part_whole(b, together);
    for (; k > 0; k = (size_t)link[k].parent)
        pass_link(model, data, k, &w, &whole);
}

size_t KT_KERNEL(kt_planar_mass_compose)(const kt_model *model, kt_data *data, const double *q) {
    assert(kt_data_serve(model, data));
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++) {
        poses(model, data, &model->plane[p], q);
        const int32_t failed = compose_planar_links(model, data, &model->plane[p]);
        if (failed)
            return model->n.spatial + (size_t)failed - 1;
    }
    return 0;
}

void KT_KERNEL(kt_planar_mass_columns)(const kt_model *model, const kt_data *data, double *mass) {
    assert(kt_data_serve(model, data));
    for (size_t end = model->n.planar - 1; end > 0;) {
        const kt_mass_block b = kt_mass_block_before(model, model->link_v + model->n.spatial_v, end, mass);
        if (b.together)
            pass_block(model, data, &b, true);
        else
            pass_block(model, data, &b, false);
        end = b.first;
    }
}
