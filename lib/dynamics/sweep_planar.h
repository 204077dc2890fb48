/* Forward pass in a plane: how a link's motion follows from its parent's. As in sweep.h, with two numbers a vector and
 * one a rotation.
 *
 * Vectors are in the plane's basis, each link about its own origin; p = (-r_y, r_x) is r rotated by a right angle, so
 * that alpha x r = alpha p. Angles are composed as complex numbers c + i s, which needs no sine of a sum. All axes are
 * parallel, so c_n is zero:
 *   alpha = alpha_p + [acceleration of a revolute joint]
 *   a     = a_p + alpha_p p + c_f + [acceleration of a prismatic joint along u]
 *   c_f   = -w_p^2 r + 2 w_p v (-u_y, u_x)
 */
#ifndef KT_DYNAMICS_SWEEP_PLANAR_H
#define KT_DYNAMICS_SWEEP_PLANAR_H

#include "algebra/sincos.h"
#include "model/model.h"

/* x e + y e', where e' is e rotated by a right angle: the vector (x, y), given at q = 0, in the axes e and e'. */
KT_INLINE kt_v2 kt_planar_sum(kt_v2 e, double x, double y) {
    return kt_v2_splat(x) * e + kt_v2_splat(y) * kt_v2_across(e);
}

/* The vector u, given at q = 0, rotated with the link m. */
KT_INLINE void kt_planar_rotate(const kt_planar_motion *m, const double u[2], double out[2]) {
    kt_v2_store(out, kt_planar_sum(kt_v2_load(m->rotation), u[0], u[1]));
}

/* The direction of a prismatic joint, which is fixed in its link. */
KT_INLINE void kt_planar_along(const kt_planar_link *link, const kt_planar_motion *m, double out[2]) {
    kt_planar_rotate(m, link->along, out);
}

/* Pose of one link (c, s, offset) from its parent's c + i s, which is e. Returns its own c + i s. */
KT_INLINE kt_v2 kt_planar_pose_after(const kt_planar_link *link, kt_v2 e, const double *q, const double *cosine,
                                     const double *sine, kt_planar_motion *out) {
    if (link->revolute) {
        const kt_v2 own = kt_planar_sum(e, cosine[link->angle], link->sign * sine[link->angle]);
        kt_v2_store(out->offset, kt_planar_sum(e, link->at[0], link->at[1]));
        kt_v2_store(out->rotation, own);
        return own;
    }
    const kt_v2 at = kt_v2_load(link->at) + kt_v2_splat(q[link->q]) * kt_v2_load(link->along);
    kt_v2_store(out->offset, kt_planar_sum(e, at[0], at[1]));
    kt_v2_store(out->rotation, e);
    return e;
}

/* Velocity of one link whose pose is known, from its parent's angular velocity w; stores c_f in linear. Returns its own
 * omega. */
KT_INLINE double kt_planar_velocity_after(const kt_planar_link *link, double w, const double *v,
                                          kt_planar_motion *out) {
    const kt_v2 around = kt_v2_splat(-(w * w)) * kt_v2_load(out->offset);
    const double x = v[link->v];
    if (link->revolute) {
        kt_v2_store(out->linear, around);
        return out->omega = w + link->sign * x;
    }
    const kt_v2 u = kt_planar_sum(kt_v2_load(out->rotation), link->along[0], link->along[1]);
    kt_v2_store(out->linear, around + kt_v2_splat(2.0 * (w * x)) * kt_v2_across(u));
    return out->omega = w;
}

/* The pose and velocity of one link from the parent's motion. */
KT_INLINE void kt_planar_pose(const kt_planar_link *link, const kt_planar_motion *parent, const double *q,
                              const double *cosine, const double *sine, kt_planar_motion *out) {
    (void)kt_planar_pose_after(link, kt_v2_load(parent->rotation), q, cosine, sine, out);
}

KT_INLINE void kt_planar_velocity(const kt_planar_link *link, const kt_planar_motion *parent, const double *v,
                                  kt_planar_motion *out) {
    (void)kt_planar_velocity_after(link, parent->omega, v, out);
}

/* From c_f to the full accelerations, for joint accelerations a. */
KT_INLINE void kt_planar_acceleration(const kt_planar_link *link, const kt_planar_motion *parent, const double *a,
                                      kt_planar_motion *out) {
    const double alpha = parent->alpha, x = a[link->v];
    const kt_v2 p = kt_v2_across(kt_v2_load(out->offset));
    const kt_v2 linear = kt_v2_load(out->linear) + (kt_v2_load(parent->linear) + kt_v2_splat(alpha) * p);
    if (link->revolute) {
        kt_v2_store(out->linear, linear);
        out->alpha = alpha + link->sign * x;
        return;
    }
    const kt_v2 u = kt_planar_sum(kt_v2_load(out->rotation), link->along[0], link->along[1]);
    kt_v2_store(out->linear, linear + kt_v2_splat(x) * u);
    out->alpha = alpha;
}

/* The ground in a plane: at rest, with the acceleration -gravity. */
KT_INLINE void kt_planar_ground_set(const double gravity[2], kt_planar_motion *ground) {
    *ground = (kt_planar_motion){.c = 1.0, .linear = {-gravity[0], -gravity[1]}};
}

/* Sines and cosines of the planar links. */
KT_INLINE void kt_planar_gather(const kt_model *model, kt_data *data, const double *q) {
    kt_sincos_gather(q, model->angle + model->n.spatial_angle, model->n.angle - model->n.spatial_angle,
                     data->planar_sine, data->planar_cosine);
}

/* Subtracts wrenches on bodies (world axes, about the body frames' origins) from the wrenches of their links.
 * Components out of the plane are left out. */
KT_INLINE void kt_planar_external(const kt_model *model, kt_planar_motion *motion, const kt_wrench *external) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if ((size_t)body->link < model->n.spatial)
            continue;
        const size_t k = (size_t)body->link - model->n.spatial + 1;
        const kt_planar_rest *rest = &model->planar_rest[k];
        const kt_mat3 *basis = &model->plane[rest->plane].basis;
        kt_planar_motion *m = &motion[k];
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
