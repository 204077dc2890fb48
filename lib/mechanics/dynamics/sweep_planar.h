/* Forward pass in a plane: a link's motion from its parent's. As in sweep.h, but a vector has two numbers, and a
 * rotation has a single angle.
 *
 * Vectors are in the plane's basis, each link about its own origin. p = (-r_y, r_x) is r rotated by a right angle, so
 * that alpha x r = alpha p. Angles are composed as complex numbers c + i s, which needs no sine of a sum. All axes are
 * parallel, so c_n is zero:
 *   alpha = alpha_p + [acceleration of a revolute joint]
 *   a     = a_p + alpha_p p + c_f + [acceleration of a prismatic joint along u]
 *   c_f   = -w_p^2 r + 2 w_p v (-u_y, u_x)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_SWEEP_PLANAR_H
#define KT_DYNAMICS_SWEEP_PLANAR_H

#include "dynamics/angles.h"

/* x e + y e', where e' is e rotated by a right angle: the vector (x, y), given at q = 0, in the axes e and e'. */
KT_INLINE kt_real2 kt_planar_sum(kt_real2 e, kt_real1 x, kt_real1 y) {
    return kt_add2(kt_scale2(x, e), kt_scale2(y, kt_across2(e)));
}

/* kt_planar_sum for a vector of the model. */
KT_OPERATOR kt_real2 kt_planar_sum_of(kt_real2 e, const double u[2]) {
    return kt_planar_sum(e, kt_real1_splat(u[0]), kt_real1_splat(u[1]));
}

/* kt_planar_sum for a vector of a link. */
KT_OPERATOR kt_real2 kt_planar_const_sum(kt_real2 e, const kt_const1 u[2]) {
    return kt_planar_sum(e, kt_const_real1(u[0]), kt_const_real1(u[1]));
}

/* The vector u, given at q = 0, rotated with the link m. */
KT_INLINE void kt_planar_rotate(const kt_planar_motion *m, const double u[2], kt_real1 out[2]) {
    kt_store2(out, kt_planar_sum_of(kt_load2(m->rotation), u));
}

/* The direction of a prismatic joint, which is fixed in its link. */
KT_INLINE void kt_planar_along(const kt_planar_link *link, const kt_planar_motion *m, kt_real1 out[2]) {
    kt_store2(out, kt_planar_const_sum(kt_load2(m->rotation), link->along));
}

/* Pose (c, s, offset) of one link from e, the parent's c + i s. Returns the link's c + i s. */
KT_INLINE kt_real2 kt_planar_pose(const kt_planar_link *link, kt_real2 e, const kt_real1 *q, const kt_real1 *cosine,
                                  const kt_real1 *sine, kt_planar_motion *out) {
    if (link->revolute) {
        const kt_real2 own = kt_planar_sum(e, cosine[link->angle], link->sign * sine[link->angle]);
        kt_store2(out->offset, kt_planar_const_sum(e, link->at));
        kt_store2(out->rotation, own);
        return own;
    }
    const kt_real2 at = kt_add_scaled2(kt_const_load2(link->at), q[link->q], kt_const_load2(link->along));
    kt_store2(out->offset, kt_planar_sum(e, KT_PART2(at, 0), KT_PART2(at, 1)));
    kt_store2(out->rotation, e);
    return e;
}

/* Computes the velocity of one link whose pose is set, from its parent's angular velocity w. Stores c_f in linear.
 * Returns the link's omega. */
KT_INLINE kt_real1 kt_planar_velocity(const kt_planar_link *link, kt_real1 w, const kt_real1 *v,
                                      kt_planar_motion *out) {
    const kt_real2 around = kt_scale2(-(w * w), kt_load2(out->offset));
    const kt_real1 x = v[link->v];
    if (link->revolute) {
        kt_store2(out->linear, around);
        return out->omega = w + link->sign * x;
    }
    const kt_real2 u = kt_planar_const_sum(kt_load2(out->rotation), link->along);
    kt_store2(out->linear, kt_add_scaled2(around, 2.0 * (w * x), kt_across2(u)));
    return out->omega = w;
}

/* From c_f to the full accelerations, for joint accelerations a. */
KT_INLINE void kt_planar_acceleration(const kt_planar_link *link, const kt_planar_motion *parent, const kt_real1 *a,
                                      kt_planar_motion *out) {
    const kt_real1 alpha = parent->alpha, x = a[link->v];
    const kt_real2 p = kt_across2(kt_load2(out->offset));
    const kt_real2 linear = kt_add2(kt_load2(out->linear), kt_add_scaled2(kt_load2(parent->linear), alpha, p));
    if (link->revolute) {
        kt_store2(out->linear, linear);
        out->alpha = alpha + link->sign * x;
        return;
    }
    const kt_real2 u = kt_planar_const_sum(kt_load2(out->rotation), link->along);
    kt_store2(out->linear, kt_add_scaled2(linear, x, u));
    out->alpha = alpha;
}

/* The ground in a plane: at rest, with the acceleration -gravity. */
KT_INLINE void kt_planar_ground_set(const kt_const1 gravity[2], kt_planar_motion *ground) {
    *ground = (kt_planar_motion){.c = kt_real1_splat(1.0),
                                 .linear = {kt_const_real1(-gravity[0]), kt_const_real1(-gravity[1])}};
}

/* Sines and cosines of the planar links. */
KT_INLINE void kt_planar_gather(const kt_model *model, kt_data *data, const kt_real1 *q) {
    kt_angles_gather(model, data, q, model->n.spatial_angle, model->n.angle - model->n.spatial_angle, data->planar_sine,
                     data->planar_cosine);
}

KT_OPERATOR kt_real1 kt_external_along(kt_const3 axis, const kt_external3 *x) {
    return axis.x * x->x + axis.y * x->y + axis.z * x->z;
}

/* An external wrench on a body. Components out of the plane are left out, because they move nothing. */
typedef struct kt_planar_external_wrench {
    size_t link;       /* planar index */
    kt_real2 x, force; /* the body's origin relative to that of its link */
    kt_real1 moment;   /* about n through the body's origin */
} kt_planar_external_wrench;

/* The wrench on a body that is on a planar link. */
KT_INLINE kt_planar_external_wrench kt_planar_external_of(const kt_model *model, const kt_planar_motion *motion,
                                                          const kt_body_record *body, const kt_external *external) {
    const size_t k = (size_t)body->link - model->n.spatial + 1;
    const kt_planar_rest *rest = &model->planar_rest[k];
    const kt_const_mat3 *basis = &model->plane[rest->plane].basis;
    const kt_real3 axes[3] = {kt_splat3(rest->axes[0]), kt_splat3(rest->axes[1]), kt_splat3(rest->axes[2])};
    const kt_real3 arm = kt_apply3(axes, kt_const_from3(body->in_link.position));
    return (kt_planar_external_wrench){
        .link = k,
        .x = kt_planar_sum(kt_load2(motion[k].rotation), KT_PART3(arm, 0), KT_PART3(arm, 1)),
        .force = kt_make2(kt_external_along(basis->x, &external->force), kt_external_along(basis->y, &external->force)),
        .moment = kt_external_along(basis->z, &external->moment)};
}

/* Subtracts wrenches on bodies (world axes, about the body frames' origins) from the wrenches of their links. */
KT_INLINE void kt_planar_external(const kt_model *model, kt_planar_motion *motion, const kt_external *external) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if ((size_t)body->link < model->n.spatial)
            continue;
        const kt_planar_external_wrench l = kt_planar_external_of(model, motion, body, &external[b]);
        kt_planar_motion *m = &motion[l.link];
        m->moment -= l.moment + kt_cross2(l.x, l.force);
        m->force[0] -= KT_PART2(l.force, 0);
        m->force[1] -= KT_PART2(l.force, 1);
    }
}

#endif
