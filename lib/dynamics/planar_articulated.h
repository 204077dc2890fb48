/* Articulated inertias in a plane (three by three instead of six by six): what one link adds, how a joint's degree of
 * freedom is projected out, and how the remainder is passed to the parent. The equations are in planar_forward.c; the
 * pivot test is that of articulated.h. A revolute joint leaves J = 0 and h = 0 exactly, so that no rounding error is
 * taken for an inertia.
 */
#ifndef KT_DYNAMICS_PLANAR_ARTICULATED_H
#define KT_DYNAMICS_PLANAR_ARTICULATED_H

#include "dynamics/articulated.h"
#include "dynamics/planar_sweep.h"

/* The link's own inertia and bias wrench; m already holds the external forces. */
KT_INLINE void kt_planar_rigid(const kt_planar_link *link, const kt_planar_motion *m, kt_planar_inertia *out) {
    double h[2];
    kt_planar_rotate(m, link->moment, h);
    const double ww = m->omega * m->omega;
    *out = (kt_planar_inertia){.j = link->inertia,
                               .h = {-h[1], h[0]},
                               .xx = link->mass,
                               .yy = link->mass,
                               .moment = m->moment,
                               .force = {m->force[0] - ww * h[0], m->force[1] - ww * h[1]}};
}

KT_INLINE void kt_planar_add(kt_planar_inertia *to, const kt_planar_inertia *from) {
    to->j += from->j;
    to->h[0] += from->h[0];
    to->h[1] += from->h[1];
    to->xx += from->xx;
    to->xy += from->xy;
    to->yy += from->yy;
    to->moment += from->moment;
    to->force[0] += from->force[0];
    to->force[1] += from->force[1];
}

/* Shifts from the child's origin to the parent's; p is the offset r rotated by a right angle. */
KT_INLINE void kt_planar_shift(kt_planar_inertia *x, const double r[2]) {
    const double px = -r[1], py = r[0];
    const double wx = x->h[0] + (x->xx * px + x->xy * py), wy = x->h[1] + (x->xy * px + x->yy * py);
    x->j += (px * x->h[0] + py * x->h[1]) + (px * wx + py * wy);
    x->h[0] = wx;
    x->h[1] = wy;
    x->moment += px * x->force[0] + py * x->force[1];
}

/* Projects a revolute joint out of x, and stores its response; tau is about n. */
KT_INLINE bool kt_planar_project_revolute(const kt_planar_link *link, const kt_planar_motion *m, double tau,
                                          kt_planar_inertia *x, kt_planar_response *response) {
    if (!(x->j > KT_NO_INERTIA * (x->j + link->size)))
        return false;
    const double d = 1.0 / x->j, hx = x->h[0] * d, hy = x->h[1] * d; /* h / J */
    const double y = tau - x->moment;
    const double cx = m->linear[0], cy = m->linear[1];
    response->base = y * d - (hx * cx + hy * cy);
    response->angular = 1.0 + (m->offset[0] * hy - m->offset[1] * hx);
    response->linear[0] = hx;
    response->linear[1] = hy;
    x->xx -= x->h[0] * hx;
    x->xy -= x->h[0] * hy;
    x->yy -= x->h[1] * hy;
    x->force[0] += y * hx + (x->xx * cx + x->xy * cy);
    x->force[1] += y * hy + (x->xy * cx + x->yy * cy);
    x->moment = tau;
    x->j = x->h[0] = x->h[1] = 0.0;
    return true;
}

/* Projects a prismatic joint out of x, and stores its response. */
KT_INLINE bool kt_planar_project_prismatic(const kt_planar_link *link, const kt_planar_motion *m, double tau,
                                           kt_planar_inertia *x, kt_planar_response *response) {
    double u[2];
    kt_planar_along(link, m, u);
    const double fx = x->xx * u[0] + x->xy * u[1], fy = x->xy * u[0] + x->yy * u[1]; /* M u */
    const double n = x->h[0] * u[0] + x->h[1] * u[1], inertia = u[0] * fx + u[1] * fy;
    if (!(inertia > KT_NO_INERTIA * ((u[0] * u[0] * x->xx + u[1] * u[1] * x->yy) + link->size)))
        return false;
    const double d = 1.0 / inertia, cx = m->linear[0], cy = m->linear[1];
    const double y = (tau - (u[0] * x->force[0] + u[1] * x->force[1]) - (fx * cx + fy * cy)) * d;
    const double nd = n * d, gx = fx * d, gy = fy * d;
    x->moment += (x->h[0] * cx + x->h[1] * cy) + n * y;
    x->force[0] += (x->xx * cx + x->xy * cy) + fx * y;
    x->force[1] += (x->xy * cx + x->yy * cy) + fy * y;
    x->j -= n * nd;
    x->h[0] -= n * gx;
    x->h[1] -= n * gy;
    x->xx -= fx * gx;
    x->xy -= fx * gy;
    x->yy -= fy * gy;
    response->base = y;
    response->angular = nd + (m->offset[0] * gy - m->offset[1] * gx);
    response->linear[0] = gx;
    response->linear[1] = gy;
    return true;
}

/* Accelerations of one link from the joint's response and the parent's alpha and linear, which are replaced by the
 * link's; the joint acceleration is written to a. The joint's is computed first and the link's from it, so that the
 * links that follow see the rounded joint acceleration that the caller is given. */
KT_INLINE void kt_planar_respond_after(const kt_planar_link *link, const kt_planar_response *response, double *alpha,
                                       kt_v2 *linear, kt_planar_motion *m, double *a) {
    const kt_v2 p = kt_v2_across(kt_v2_load(m->offset));
    const double x = (response->base - response->angular * *alpha) - kt_v2_dot(kt_v2_load(response->linear), *linear);
    *linear = kt_v2_load(m->linear) + (*linear + kt_v2_splat(*alpha) * p);
    if (link->motion == KT_MOTION_REVOLUTE) {
        *alpha += x;
        a[link->v] = link->sign * x;
    } else {
        *linear += kt_v2_splat(x) * kt_planar_sum(kt_v2_load(m->turn), link->along[0], link->along[1]);
        a[link->v] = x;
    }
    m->alpha = *alpha;
    kt_v2_store(m->linear, *linear);
}

/* The same from the parent's motion. */
KT_INLINE void kt_planar_respond(const kt_planar_link *link, const kt_planar_response *response,
                                 const kt_planar_motion *parent, kt_planar_motion *m, double *a) {
    double alpha = parent->alpha;
    kt_v2 linear = kt_v2_load(parent->linear);
    kt_planar_respond_after(link, response, &alpha, &linear, m, a);
}

/* Subtracts wrenches on bodies (world axes, about the body frames' origins) from the wrenches of their links.
 * Components out of the plane are left out. */
KT_INLINE void kt_planar_external(const kt_model *model, kt_planar_motion *motion, const kt_wrench *external) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if ((size_t)body->link < model->n.spatial)
            continue;
        const size_t place = (size_t)body->link - model->n.spatial + 1;
        const kt_planar_rest *rest = &model->planar_rest[place];
        const kt_mat3 *basis = &model->plane[rest->plane].basis;
        kt_planar_motion *m = &motion[place];
        const kt_v4 arm = kt_v4_apply(rest->axes, kt_v4_from(body->in_link.position));
        const double flat[2] = {arm[0], arm[1]};
        const double fx = kt_vec3_dot(basis->x, external[b].force), fy = kt_vec3_dot(basis->y, external[b].force);
        double r[2];
        kt_planar_rotate(m, flat, r);
        m->moment -= kt_vec3_dot(basis->z, external[b].moment) + (r[0] * fy - r[1] * fx);
        m->force[0] -= fx;
        m->force[1] -= fy;
    }
}

#endif
