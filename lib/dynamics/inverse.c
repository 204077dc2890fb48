/* Inverse dynamics: the recursive Newton-Euler algorithm (Luh, Walker & Paul 1980; Featherstone 2008, 5.3), in world
 * axes about each link's own origin.
 *
 * Forward pass: the motion of each link from its parent's (sweep.h), with a_0 = -gravity; then, with J about the
 * origin, h = m c, and external wrenches subtracted,
 *   n = J alpha + w x J w + h x a
 *   f = m a + alpha x h + w x (w x h)
 * Backward pass:
 *   tau = s . n or s . f,   n_p += n + r x f,   f_p += f
 */
#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"

/* J u = R (Jb (R' u)) for two vectors would cost more than rotating J once. */
KT_INLINE void inertial_wrench(const kt_link *link, kt_link_motion *m) {
    kt_v4 j[3];
    kt_v4_rotate_inertia(m->axes, link->inertia, j);
    const kt_v4 h = kt_v4_apply(m->axes, link->moment);
    m->moment = kt_v4_apply(j, m->alpha) + kt_v4_cross(m->omega, kt_v4_apply(j, m->omega)) + kt_v4_cross(h, m->linear);
    m->force = kt_v4_splat(link->mass) * m->linear + kt_v4_cross(m->alpha, h) +
               kt_v4_cross(m->omega, kt_v4_cross(m->omega, h));
}

/* tau of a link's degrees of freedom from the wrench across its joint. */
KT_INLINE void project(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *m, double *tau) {
    const int k = link->v;
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        tau[k] = kt_v4_dot(m->axis, m->moment);
        break;
    case KT_MOTION_PRISMATIC:
        tau[k] = kt_v4_dot(m->axis, m->force);
        break;
    case KT_MOTION_SCREW:
        tau[k] = kt_v4_dot(m->axis, m->moment + kt_v4_splat(link->pitch) * m->force);
        break;
    case KT_MOTION_SPHERICAL:
        for (int i = 0; i < 3; i++)
            tau[k + i] = kt_v4_dot(m->axes[i], m->moment);
        break;
    case KT_MOTION_FREE: {
        kt_v4 base[3];
        kt_rest_axes(link, parent->axes, base);
        for (int i = 0; i < 3; i++) {
            tau[k + i] = kt_v4_dot(base[i], m->force);
            tau[k + 3 + i] = kt_v4_dot(m->axes[i], m->moment);
        }
        break;
    }
    case KT_MOTION_NONE:
        break;
    }
}

void KT_KERNEL(kt_inverse)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                           const kt_wrench *external, double *tau) {
    const size_t count = model->n.spatial;
    kt_link_motion *motion = data->motion;
    kt_sincos_gather(q, model->angle, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(model->gravity, &motion[0]);
    for (size_t i = 1; i < count; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        kt_link_pose(link, parent, q, data->cosine, data->sine, &motion[i]);
        kt_link_velocity(link, parent, v, &motion[i]);
        kt_link_acceleration(link, parent, a, &motion[i]);
        inertial_wrench(link, &motion[i]);
    }
    if (external)
        kt_external_subtract(model, motion, external);
    for (size_t i = count - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        kt_link_motion *m = &motion[i], *parent = &motion[link->parent];
        project(link, parent, m, tau);
        parent->moment += m->moment + kt_v4_cross(m->offset, m->force);
        parent->force += m->force;
    }
}
