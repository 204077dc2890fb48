/* Inverse dynamics of planar trees: the recursive Newton-Euler algorithm of inverse.c in the plane.
 *
 * Out:   motion (planar_sweep.h), a_0 = -gravity; with h = m c turned by a right angle and J about the origin,
 *          n = J alpha + h . a,   f = m a + h alpha - w^2 m c   (less what acts from outside)
 * Back:  tau = +-n or u . f;   n_p += n + p . f,  f_p += f,  p = r turned by a right angle.
 */
#include "dynamics/kernel.h"
#include "dynamics/planar_articulated.h"

KT_INLINE void inertial_wrench(const kt_planar_link *link, kt_planar_motion *m) {
    double h[2];
    kt_planar_turn(m, link->moment, h);
    const double ww = m->omega * m->omega, ax = m->linear[0], ay = m->linear[1];
    m->moment = link->inertia * m->alpha + (h[0] * ay - h[1] * ax);
    m->force[0] = link->mass * ax - m->alpha * h[1] - ww * h[0];
    m->force[1] = link->mass * ay + m->alpha * h[0] - ww * h[1];
}

static inline void way_out(const kt_model *model, kt_data *data, const kt_plane *plane, const double *q,
                           const double *v, const double *a) {
    kt_planar_motion *motion = data->planar;
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *parent = &motion[link->parent];
        kt_planar_pose(link, parent, q, data->planar_cosine, data->planar_sine, &motion[k]);
        kt_planar_velocity(link, parent, v, &motion[k]);
        kt_planar_acceleration(link, parent, a, &motion[k]);
        inertial_wrench(link, &motion[k]);
    }
}

static inline void way_back(const kt_model *model, kt_data *data, double *tau) {
    kt_planar_motion *motion = data->planar;
    for (size_t k = model->n.planar - 1; k > 0; k--) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *m = &motion[k];
        kt_planar_motion *parent = &motion[link->parent];
        if (link->motion == KT_MOTION_TURN) {
            tau[link->v] = link->sign * m->moment;
        } else {
            double u[2];
            kt_planar_along(link, m, u);
            tau[link->v] = u[0] * m->force[0] + u[1] * m->force[1];
        }
        parent->moment += m->moment + (m->offset[0] * m->force[1] - m->offset[1] * m->force[0]);
        parent->force[0] += m->force[0];
        parent->force[1] += m->force[1];
    }
}

void KT_KERNEL(kt_planar_inverse)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                  const double *a, const kt_wrench *external, double *tau) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        way_out(model, data, &model->plane[p], q, v, a);
    if (external)
        kt_planar_external(model, data->planar, external);
    way_back(model, data, tau);
}
