/* The passes of rnea_gradient.h in a plane.
 *
 * What a joint carries moves as one rigid body when its position changes, so the gradient needs no more than sums over
 * the particles that it carries. With the velocities v along the motion and u along w, accelerations a less gravity,
 * and J a rotation by a right angle,
 *     w . tau = sum m u . a - (external forces . u + moments w)
 * A revolute joint at o turns u - u_o, v - v_o and a - a_o, and J u . a + u . J a = 0, so that
 *     F = sum m a - f,   P = sum m u,   N = 2 sum m u . J v,   Y = -sum f . J u
 *     w . dtau/dq = Y - J u_o . F - P . J a_o,   w . dtau/dv = N - 2 P . J v_o        (a changes by 2 J (v - v_o))
 * A prismatic joint along e, carried at omega and alpha, adds w J e to u, alpha J e - omega^2 e and 2 omega J e to a:
 *     w . dtau/dq = w J e . F + P . (alpha J e - omega^2 e),   w . dtau/dv = 2 omega P . J e
 * The joints' parts of F and P are tau itself and M w. */
#include "dynamics/planar_external.h"
#include "dynamics/rnea_gradient.h"

static const double still[2] = {0.0, 0.0};

size_t KT_KERNEL(kt_planar_respond)(const kt_model *model, kt_data *data, const double *q, const double *tau,
                                    double *x) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        kt_planar_articulated_motion(model, data, plane, q, model->zero);
        const size_t failed =
            model->has_armature
                ? kt_planar_articulated_backward(model, data, plane, tau, kt_planar_eliminate_armature, NULL)
                : kt_planar_articulated_backward(model, data, plane, tau, kt_planar_eliminate_joint, NULL);
        if (failed)
            return model->n.spatial + failed - 1;
        kt_planar_articulated_forward(model, data, plane, still, kt_planar_respond_joint, x, NULL);
    }
    return 0;
}

KT_INLINE double across(kt_v2 a, kt_v2 b) { return a[0] * b[1] - a[1] * b[0]; } /* J a . b */

/* The link's own sums. */
KT_INLINE void set_link_wrenches(const kt_planar_link *link, const kt_planar_motion *m, kt_planar_gradient_link *x) {
    const kt_v2 first = kt_planar_sum(kt_v2_load(m->rotation), link->moment[0], link->moment[1]); /* m c */
    const kt_v2 h = kt_v2_across(first), a = kt_v2_load(m->linear), mass = kt_v2_splat(link->mass);
    x->force = mass * a + (kt_v2_splat(m->alpha) * h - kt_v2_splat(m->omega * m->omega) * first);
    x->moment = link->inertia * m->alpha + kt_v2_dot(h, a);
    x->p = mass * x->u + kt_v2_splat(x->w) * h;
    x->spin = link->inertia * x->w + kt_v2_dot(h, x->u);
    x->n = 2.0 * (x->w * kt_v2_dot(first, x->velocity) - m->omega * kt_v2_dot(first, x->u) -
                  link->mass * across(x->u, x->velocity));
    x->y = 0.0;
}

KT_INLINE void forward_pass(const kt_model *model, kt_data *data, const kt_plane *plane, const double *v,
                            const double *a, bool weightless, const double *w, kt_planar_gradient_link *links) {
    const kt_v2 none = {0.0, 0.0};
    kt_planar_motion *motion = data->planar;
    kt_planar_ground_set(weightless ? still : plane->gravity, &motion[0]);
    links[0] = (kt_planar_gradient_link){.velocity = none, .u = none};
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *up = &motion[link->parent];
        const kt_planar_gradient_link *px = &links[link->parent];
        kt_planar_motion *m = &motion[k];
        kt_planar_gradient_link *x = &links[k];
        const kt_v2 r = kt_v2_across(kt_v2_load(m->offset));
        kt_planar_velocity(link, up, v, m);
        kt_planar_acceleration(link, up, a, m);
        x->velocity = px->velocity + kt_v2_splat(up->omega) * r;
        x->u = px->u + kt_v2_splat(px->w) * r;
        x->w = px->w;
        if (link->revolute) {
            x->w += link->sign * w[link->v];
        } else {
            const kt_v2 e = kt_planar_sum(kt_v2_load(m->rotation), link->along[0], link->along[1]);
            x->velocity += kt_v2_splat(v[link->v]) * e;
            x->u += kt_v2_splat(w[link->v]) * e;
        }
        set_link_wrenches(link, m, x);
    }
}

/* Subtracts external wrenches, whose components out of the plane move nothing. */
KT_INLINE void load(const kt_model *model, const kt_planar_motion *motion, const kt_wrench *external,
                    kt_planar_gradient_link *links) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if (body->link == 0)
            continue;
        const kt_planar_external_wrench l = kt_planar_external_of(model, motion, body, &external[b]);
        kt_planar_gradient_link *x = &links[l.link];
        x->moment -= l.moment + across(l.x, l.force);
        x->force -= l.force;
        x->y -= across(x->u, l.force) - x->w * kt_v2_dot(l.x, l.force);
    }
}

KT_INLINE void write_dof(const kt_planar_link *link, const kt_planar_motion *m, const kt_planar_gradient_link *x,
                         double *by_q, double *by_v, double *force, double *momentum) {
    const kt_v2 a = kt_v2_load(m->linear);
    if (link->revolute) {
        *by_q = link->sign * (x->y - across(x->u, x->force) - across(a, x->p));
        *by_v = link->sign * (x->n - 2.0 * across(x->velocity, x->p));
        *force = link->sign * x->moment;
        *momentum = link->sign * x->spin;
        return;
    }
    const kt_v2 e = kt_planar_sum(kt_v2_load(m->rotation), link->along[0], link->along[1]);
    const double turned = across(e, x->p);
    *by_q = x->w * across(e, x->force) + m->alpha * turned - m->omega * m->omega * kt_v2_dot(e, x->p);
    *by_v = 2.0 * m->omega * turned;
    *force = kt_v2_dot(e, x->force);
    *momentum = kt_v2_dot(e, x->p);
}

KT_INLINE void backward_pass(const kt_model *model, const kt_planar_motion *motion, kt_planar_gradient_link *links,
                             const kt_gradient *out) {
    for (size_t k = model->n.planar - 1; k > 0; k--) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_gradient_link *x = &links[k];
        kt_planar_gradient_link *px = &links[link->parent];
        const kt_v2 r = kt_v2_load(motion[k].offset);
        const int32_t i = link->v;
        write_dof(link, &motion[k], x, &out->by_q[i], &out->by_v[i], &out->force[i], &out->momentum[i]);
        px->force += x->force;
        px->moment += x->moment + across(r, x->force);
        px->p += x->p;
        px->spin += x->spin + across(r, x->p);
        px->n += x->n;
        px->y += x->y;
    }
}

void KT_KERNEL(kt_planar_gradient)(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a,
                                   bool weightless, const double *w, const kt_gradient *out) {
    kt_planar_gradient_link *links = (kt_planar_gradient_link *)(void *)out->links;
    for (size_t p = 0; p < model->n.plane; p++)
        forward_pass(model, data, &model->plane[p], at->v, a, weightless, w, links);
    if (at->external)
        load(model, data->planar, at->external, links);
    backward_pass(model, data->planar, links, out);
}
