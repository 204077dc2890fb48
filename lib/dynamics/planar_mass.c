/* Mass matrix of planar trees: the composite-rigid-body algorithm of mass.c in the plane.
 *
 * A composite has J about the origin, h = m c and m. Shifted by r to the parent's origin these are
 *   J + r . (2 h + m r),   h + m r,   m
 * Its wrench for a unit acceleration of its joint is carried to each ancestor j, where M_jk = +-n or u . f:
 *   revolute            (n, f) = (J, (-h_y, h_x))
 *   prismatic along u   (n, f) = (h x u, m u)
 * It is stored as a kt_planar_inertia: j, h = m c, xx = m.
 */
#include "dynamics/dynamics.h"
#include "dynamics/planar_sweep.h"

/* Sums the composites; returns the planar index of a link on the ground whose composite is not finite, or 0. */
static inline int32_t compose(const kt_model *model, kt_data *data, const kt_plane *plane, const double *q) {
    static const double none[2] = {0.0, 0.0};
    kt_planar_motion *motion = data->planar;
    kt_planar_inertia *composite = data->planar_inertia;
    kt_planar_ground_set(none, &motion[0]);
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        kt_planar_pose(link, &motion[link->parent], q, data->planar_cosine, data->planar_sine, &motion[k]);
        composite[k].j = link->inertia;
        composite[k].xx = link->mass;
        kt_planar_rotate(&motion[k], link->moment, composite[k].h);
    }
    for (int32_t k = plane->last - 1; k >= plane->first; k--) {
        const kt_planar_inertia *c = &composite[k];
        const double *r = motion[k].offset, m = c->xx, all = c->j + (c->h[0] + c->h[1]);
        const int32_t parent = model->planar[k].parent;
        if (parent) {
            kt_planar_inertia *up = &composite[parent];
            const double hx = c->h[0] + m * r[0], hy = c->h[1] + m * r[1];
            up->j += c->j + (r[0] * (c->h[0] + hx) + r[1] * (c->h[1] + hy));
            up->h[0] += hx;
            up->h[1] += hy;
            up->xx += m;
        } else if (!(all - all == 0.0)) {
            return k;
        }
    }
    return 0;
}

/* The component of a moment and a force along a link's degree of freedom. */
KT_INLINE double project(const kt_planar_link *link, const kt_planar_motion *m, double moment, const double force[2]) {
    if (link->revolute)
        return link->sign * moment;
    double u[2];
    kt_planar_along(link, m, u);
    return u[0] * force[0] + u[1] * force[1];
}

/* The column of M that belongs to link k, from its own row to the root's. */
static inline void column(const kt_model *model, const kt_data *data, int32_t k, double *mass) {
    const size_t nv = model->n.v;
    const kt_planar_link *link = &model->planar[k];
    const kt_planar_inertia *c = &data->planar_inertia[k];
    const size_t row = (size_t)link->v;
    double moment = link->sign * c->j, force[2] = {-link->sign * c->h[1], link->sign * c->h[0]};
    if (!link->revolute) {
        double u[2];
        kt_planar_along(link, &data->planar[k], u);
        moment = c->h[0] * u[1] - c->h[1] * u[0];
        force[0] = c->xx * u[0];
        force[1] = c->xx * u[1];
    }
    mass[row * nv + row] = project(link, &data->planar[k], moment, force);
    for (int32_t j = k; link->parent; link = &model->planar[j]) {
        const double *r = data->planar[j].offset;
        moment += r[0] * force[1] - r[1] * force[0];
        j = link->parent;
        const kt_planar_link *up = &model->planar[j];
        mass[(size_t)up->v * nv + row] = project(up, &data->planar[j], moment, force);
    }
}

size_t KT_KERNEL(kt_planar_compose)(const kt_model *model, kt_data *data, const double *q) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++) {
        const int32_t failed = compose(model, data, &model->plane[p], q);
        if (failed)
            return model->n.spatial + (size_t)failed - 1;
    }
    return 0;
}

void KT_KERNEL(kt_planar_columns)(const kt_model *model, const kt_data *data, double *mass) {
    for (int32_t k = (int32_t)model->n.planar - 1; k > 0; k--)
        column(model, data, k, mass);
}
