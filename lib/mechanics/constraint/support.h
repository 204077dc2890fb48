/* The degrees of freedom that move the ends of a loop or an effect, and the derivatives along each of these degrees of
 * freedom.
 *
 * S, psi', psi'' and phi belong to a degree of freedom (dof.h), and all spatial vectors are expressed about a fixed
 * point O. The derivatives of a frame that it moves, with velocity V = (w, v) and acceleration A = (alpha, a), are
 *     with q_k, which carries the frame along S_k: dV = S x V + psi', dA = S x A + psi'' - V x psi'
 *     with v_k:                               dV = S,              dA = phi - V x S
 * (dynamics_derivative.h), and the derivatives of the point x of this frame follow from
 *     velocity      v + w x x
 *     acceleration  a + alpha x x + w x (v + w x x)
 * The ends with these derivatives, as dual numbers, are inputs of the code of the loop or effect (algebra/real.h).
 *
 * Degree of freedom i moves a part. A wrench W about O on this part has the joint force S_i . W. The degrees of freedom
 * before S_i, and those of its node, carry S_i along by S_k x S_i.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_SUPPORT_H
#define KT_CONSTRAINT_SUPPORT_H

#include "constraint/dual_rows.h"
#include "loop/loop.h"

/* ---- the paths to the ends --------------------------------------------------------------------------------------- */

/* A frame in motion, world axes. */
typedef struct kt_support_end {
    kt_v4 axes[3], point;
    kt_v4 velocity[2], acceleration[2]; /* V, A */
} kt_support_end;

typedef struct kt_support {
    const kt_dual_motion *x;
    int32_t count; /* number of degrees of freedom */
    kt_support_end end[2];
} kt_support;

/* Expresses s, given about the point `at` (relative to O), about O. */
KT_INLINE void kt_express_about_origin(kt_v4 at, kt_v4 s[2]) { s[1] += kt_v4_cross(at, s[0]); }

static inline void kt_support_add(kt_support *w, const kt_link *link, int end, kt_v4 origin,
                                  const kt_dof_motion *motion) {
    const int count = kt_link_dofs(link);
    const int32_t first = w->count;
    for (int k = 0; k < count; k++) {
        kt_support_dof *f = &w->x->dof[w->count++];
        *f = (kt_support_dof){.motion = motion[k], .v = link->v + k, .end = end, .first = first + (k >= 3 ? 3 : 0)};
        kt_express_about_origin(origin, f->motion.s);
        kt_express_about_origin(origin, f->motion.psi);
        kt_express_about_origin(origin, f->motion.rate);
        kt_express_about_origin(origin, f->motion.phi);
    }
}

/* Follows the path from the ancestor, whose origin is at `origin`, to a frame on a link. */
static inline void kt_support_follow(kt_support *w, int32_t ancestor, kt_v4 origin, int end, int32_t to,
                                     const kt_pose *frame) {
    const kt_model *model = w->x->model;
    const kt_link_motion *motion = w->x->data->motion;
    kt_carried c = {kt_v4_splat(0.0), kt_v4_splat(0.0), kt_v4_splat(0.0), kt_v4_splat(0.0)};
    kt_dof_motion dof[KT_DOF_MAX];
    int32_t n = 0;
    for (int32_t i = to; i != ancestor; i = model->link[i].parent)
        w->x->chain[n++] = i;
    while (n-- > 0) {
        const kt_link *link = &model->link[w->x->chain[n]];
        const kt_link_motion *m = &motion[w->x->chain[n]];
        c.velocity += kt_v4_cross(c.omega, m->offset);
        c.linear += kt_v4_cross(c.alpha, m->offset);
        origin += m->offset;
        kt_dof_motions_set(link, &motion[link->parent], m, w->x->v, w->x->a, &c, dof);
        kt_support_add(w, link, end, origin, dof);
    }
    kt_support_end *e = &w->end[end];
    kt_v4 turn[3];
    kt_v4_from_mat3(frame->rotation, turn);
    kt_multiply3(motion[to].axes, turn, e->axes);
    e->point = origin + kt_v4_apply(motion[to].axes, kt_v4_from(frame->position));
    e->velocity[0] = c.omega, e->velocity[1] = c.velocity;
    e->acceleration[0] = c.alpha, e->acceleration[1] = c.linear;
    kt_express_about_origin(origin, e->velocity);
    kt_express_about_origin(origin, e->acceleration);
}

/* Finds both paths. O is the origin of the first link on the path. */
static inline void kt_support_find(kt_support *w, int32_t ancestor, int ends, const int32_t link[2],
                                   const kt_pose frame[2]) {
    int32_t first = ends < 2 || link[0] != ancestor ? link[0] : link[1];
    kt_v4 origin = kt_v4_splat(0.0);
    while (first != ancestor && w->x->model->link[first].parent != ancestor)
        first = w->x->model->link[first].parent;
    if (first != ancestor)
        origin -= w->x->data->motion[first].offset;
    w->count = 0;
    for (int end = 0; end < ends; end++)
        kt_support_follow(w, ancestor, origin, end, link[end], &frame[end]);
}

/* ---- a direction ------------------------------------------------------------------------------------------------- */

typedef enum kt_direction { KT_BY_POSITION, KT_BY_RATE } kt_direction;

/* An end, as dual numbers along the degree of freedom m, or constant if m is NULL. */
static inline kt_loop_end kt_support_end_dual(const kt_support_end *e, const kt_dof_motion *m, kt_direction along) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_v4 axes[3] = {none, none, none}, point = none, v[2] = {none, none}, a[2] = {none, none}, x[2];
    if (m && along == KT_BY_POSITION) {
        for (int k = 0; k < 3; k++)
            axes[k] = kt_v4_cross(m->s[0], e->axes[k]);
        point = m->s[1] + kt_v4_cross(m->s[0], e->point);
        kt_motion_cross(m->s[0], m->s[1], e->velocity, v);
        kt_motion_cross(m->s[0], m->s[1], e->acceleration, a);
        kt_motion_cross(e->velocity[0], e->velocity[1], m->psi, x);
        for (int k = 0; k < 2; k++) {
            v[k] += m->psi[k];
            a[k] += m->rate[k] - x[k];
        }
    } else if (m) {
        kt_motion_cross(e->velocity[0], e->velocity[1], m->s, x);
        for (int k = 0; k < 2; k++) {
            v[k] = m->s[k];
            a[k] = m->phi[k] - x[k];
        }
    }
    kt_loop_end end;
    end.turn = kt_real_of(0.0); /* only residuals need the turn */
    for (int k = 0; k < 3; k++)
        end.axes[k] = kt_vector_of(e->axes[k], axes[k]);
    end.point = kt_vector_of(e->point, point);
    end.omega = kt_vector_of(e->velocity[0], v[0]);
    end.velocity = kt_vector_of(e->velocity[1], v[1]) + kt_cross(end.omega, end.point);
    end.alpha = kt_vector_of(e->acceleration[0], a[0]);
    end.linear =
        kt_vector_of(e->acceleration[1], a[1]) + kt_cross(end.alpha, end.point) + kt_cross(end.omega, end.velocity);
    return end;
}

/* The wrench on an end, about O. */
typedef struct kt_end_wrench {
    kt_vector moment, force;
} kt_end_wrench;

/* The derivative of joint force i with respect to q_k or v_k: S_i . dW, and (S_k x S_i) . W where S_i is carried
 * along. */
static inline double kt_support_derivative(const kt_support *w, int32_t i, int32_t k, kt_direction along,
                                           const kt_end_wrench p[2]) {
    const kt_support_dof *by = &w->x->dof[k], *at = &w->x->dof[i];
    const kt_vector moment = p[at->end].moment, force = p[at->end].force;
    const double x =
        kt_v4_dot2(at->motion.s[0], kt_vector_derivative(moment), at->motion.s[1], kt_vector_derivative(force));
    if (along != KT_BY_POSITION || at->end != by->end || i < by->first)
        return x;
    kt_v4 carried[2];
    kt_motion_cross(by->motion.s[0], by->motion.s[1], at->motion.s, carried);
    return x + kt_v4_dot2(carried[0], kt_vector_value(moment), carried[1], kt_vector_value(force));
}

/* Subtracts the derivatives of all joint forces from column d. */
static inline void kt_support_subtract(const kt_support *w, int32_t k, kt_direction along, const kt_end_wrench p[2],
                                       double *d) {
    for (int32_t i = 0; i < w->count; i++)
        d[w->x->dof[i].v] -= kt_support_derivative(w, i, k, along, p);
}

#endif
