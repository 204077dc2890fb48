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
KT_INLINE void inertial_wrench(const kt_link *link, const kt_link_motion *m, kt_link_origin *load) {
    kt_v4 j[3];
    kt_v4_rotate_inertia(m->axes, &link->inertia, j);
    const kt_v4 h = kt_v4_apply_to(m->axes, link->moment);
    load->moment =
        kt_v4_apply(j, m->alpha) + kt_v4_cross(m->omega, kt_v4_apply(j, m->omega)) + kt_v4_cross(h, m->linear);
    load->force = kt_v4_splat(link->mass) * m->linear + kt_v4_cross(m->alpha, h) +
                  kt_v4_cross(m->omega, kt_v4_cross(m->omega, h));
}

/* S . (n, f), the joint force of one degree of freedom. */
typedef struct projection {
    const kt_link_origin *load;
    double *tau;
} projection;

KT_INLINE void project(const kt_dof *dof, void *context) {
    const projection *p = context;
    const kt_v4 n = p->load->moment, f = p->load->force;
    p->tau[dof->index] = kt_v4_dot(dof->u, dof->kind == KT_DOF_ROTATION      ? n
                                           : dof->kind == KT_DOF_TRANSLATION ? f
                                                                             : n + kt_v4_splat(dof->pitch) * f);
}

void KT_KERNEL(kt_inverse)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                           const kt_wrench *external, double *tau) {
    const size_t count = model->n.spatial;
    kt_link_motion *motion = data->motion;
    kt_link_origin *load = data->origin;
    const bool far = kt_is_far(model);
    projection p;
    kt_sincos_gather(q, model->angle, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(model->gravity, &motion[0]);
    memset(&load[0], 0, sizeof load[0]);
    for (size_t i = 1; i < count; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        if (far) {
            kt_link_fetch(model, data, kt_ahead(i, count));
            kt_fetch(&load[kt_ahead(i, count)], sizeof *load);
        }
        kt_link_pose(link, parent, q, data->cosine, data->sine, &motion[i]);
        kt_link_velocity(link, parent, v, &motion[i]);
        kt_link_acceleration(link, parent, a, &motion[i]);
        inertial_wrench(link, &motion[i], &load[i]);
    }
    if (external)
        kt_external_subtract(model, data, external);
    for (size_t i = count - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i];
        if (far) {
            kt_link_fetch(model, data, kt_ahead_down(i));
            kt_fetch(&load[kt_ahead_down(i)], sizeof *load);
        }
        kt_link_origin *own = &load[i], *parent = &load[link->parent];
        p.load = own;
        p.tau = &tau[link->v];
        kt_dofs_visit(link, motion[link->parent].axes, m->axes, project, &p);
        parent->moment += own->moment + kt_v4_cross(m->offset, own->force);
        parent->force += own->force;
    }
}
