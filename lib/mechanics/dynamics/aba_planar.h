/* Forward dynamics in a plane: the articulated-body algorithm of aba.h, with three by three numbers instead of six by
 * six.
 *
 * A link, with all bodies that it carries, requires of its joint the wrench, with p = r rotated by a right angle,
 *   n = J alpha + h . a + n_b
 *   f = h alpha + M a + f_b
 *   a = a_p + alpha_p p + c_f
 * A revolute joint, with y = tau - n_b (tau and the moments about n):
 *   alpha = (y - h . a) / J
 *   M -= h h' / J,   f_b += h y / J + M c_f,   J = 0,   h = 0,   n_b = tau
 * so that its link passes on M, f_b and tau alone. A prismatic joint along u, with U = M u, n_u = h . u, D = u . U:
 *   y = (tau - u . f_b - U . c_f) / D
 *   n_b += h . c_f + n_u y,   f_b += M c_f + U y
 *   J -= n_u^2 / D,   h -= n_u U / D,   M -= U U' / D
 * The shift to the parent:
 *   J += 2 p . h + p . M p,   h += M p,   n_b += p . f_b
 *
 * Every link waits for its child's J, and the division by J takes the longest. So J of a revolute joint's link after
 * the shift, p . M p with the reduced M, is computed as p . M p - (p . h)^2 / J from the M before. All but the last
 * product and difference proceed during the division. The rounding error is of the order of eps |M| |p|^2 either way. A
 * revolute joint leaves J = 0 and h = 0 exactly, so that no rounding error is taken for an inertia.
 *
 * As in aba.h, the passes are written once, with the elimination of a link's degree of freedom as a parameter. In a
 * tree, only the joint is eliminated (aba_planar.c); with loops, a constraint group (reduction/planar_links.c). The
 * numbers that pass from one link to the next stay in registers. The pivot test is that of aba.h.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_ABA_PLANAR_H
#define KT_DYNAMICS_ABA_PLANAR_H

#include "dynamics/aba.h"
#include "dynamics/sweep_planar.h"

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
KT_INLINE void kt_planar_shift(kt_planar_inertia *x, const kt_real1 r[2]) {
    const kt_real1 px = -r[1], py = r[0];
    const kt_real1 wx = x->h[0] + (x->xx * px + x->xy * py), wy = x->h[1] + (x->xy * px + x->yy * py);
    x->j += (px * x->h[0] + py * x->h[1]) + (px * wx + py * wy);
    x->h[0] = wx;
    x->h[1] = wy;
    x->moment += px * x->force[0] + py * x->force[1];
}

/* Projects a degree of freedom out of x, and stores its response: U = (n, fx, fy), force = tau - S . (n_b, f_b). */
KT_INLINE void kt_planar_project(const kt_planar_motion *m, kt_real1 n, kt_real1 fx, kt_real1 fy, kt_real1 inertia,
                                 kt_real1 force, kt_planar_inertia *x, kt_planar_response *response) {
    const kt_real1 d = 1.0 / inertia, cx = m->linear[0], cy = m->linear[1];
    const kt_real1 y = (force - (fx * cx + fy * cy)) * d;
    const kt_real1 nd = n * d, gx = fx * d, gy = fy * d;
    x->moment += (x->h[0] * cx + x->h[1] * cy) + n * y;
    x->force[0] += (x->xx * cx + x->xy * cy) + fx * y;
    x->force[1] += (x->xy * cx + x->yy * cy) + fy * y;
    x->j -= n * nd;
    x->h[0] -= n * gx;
    x->h[1] -= n * gy;
    x->xx -= fx * gx;
    x->xy -= fx * gy;
    x->yy -= fy * gy;
    response->free = y;
    response->gain_angular = nd + (m->offset[0] * gy - m->offset[1] * gx);
    response->gain_linear[0] = gx;
    response->gain_linear[1] = gy;
}

KT_INLINE kt_condition kt_planar_project_prismatic(const kt_planar_link *link, const kt_planar_motion *m, kt_real1 tau,
                                                   kt_planar_inertia *x, kt_planar_response *response) {
    kt_condition has_inertia = kt_condition_true();
    kt_real1 u[2];
    kt_planar_along(link, m, u);
    const kt_real1 fx = x->xx * u[0] + x->xy * u[1], fy = x->xy * u[0] + x->yy * u[1]; /* M u */
    const kt_real1 n = x->h[0] * u[0] + x->h[1] * u[1], inertia = u[0] * fx + u[1] * fy;
    if (kt_fails(&has_inertia, inertia > KT_NO_INERTIA * ((u[0] * u[0] * x->xx + u[1] * u[1] * x->yy) + link->size)))
        return kt_condition_false();
    kt_planar_project(m, n, fx, fy, inertia, tau - (u[0] * x->force[0] + u[1] * x->force[1]), x, response);
    return has_inertia;
}

/* Projects for any joint with armature, which adds only to S . U; U = [J; h] or (n, M u). */
KT_INLINE kt_condition kt_planar_project_armature(const kt_planar_link *link, const kt_planar_motion *m, kt_real1 tau,
                                                  kt_planar_inertia *x, kt_planar_response *response) {
    kt_condition has_inertia = kt_condition_true();
    kt_real1 u[2] = {kt_real1_splat(0.0), kt_real1_splat(0.0)};
    if (!link->revolute)
        kt_planar_along(link, m, u);
    const double w = link->revolute ? 1.0 : 0.0;
    const kt_real1 n = w * x->j + (x->h[0] * u[0] + x->h[1] * u[1]);
    const kt_real1 fx = w * x->h[0] + (x->xx * u[0] + x->xy * u[1]), fy = w * x->h[1] + (x->xy * u[0] + x->yy * u[1]);
    const kt_real1 inertia = w * n + (u[0] * fx + u[1] * fy) + link->armature;
    if (kt_fails(&has_inertia,
                 inertia > KT_NO_INERTIA * (w * x->j + (u[0] * u[0] * x->xx + u[1] * u[1] * x->yy) + link->size)))
        return kt_condition_false();
    const kt_real1 force = tau - w * x->moment - (u[0] * x->force[0] + u[1] * x->force[1]);
    kt_planar_project(m, n, fx, fy, inertia, force, x, response);
    return has_inertia;
}

/* Computes the accelerations of one link from the joint's response and the parent's alpha and linear, and replaces
 * these by the link's. Computes the joint acceleration first, stores it in a, and derives the link's accelerations from
 * it. So the links that follow use the rounded joint acceleration that the caller receives. */
KT_INLINE void kt_planar_respond_joint(const kt_planar_link *link, const kt_planar_response *response, kt_real1 *alpha,
                                       kt_real2 *linear, kt_planar_motion *m, kt_real1 *a, void *context) {
    (void)context;
    const kt_real2 p = kt_across2(kt_load2(m->offset));
    const kt_real1 x =
        (response->free - response->gain_angular * *alpha) - kt_dot2(kt_load2(response->gain_linear), *linear);
    *linear = kt_add2(kt_load2(m->linear), kt_add_scaled2(*linear, *alpha, p));
    if (link->revolute) {
        *alpha += x;
        a[link->v] = link->sign * x;
    } else {
        *linear = kt_add_scaled2(*linear, x, kt_planar_const_sum(kt_load2(m->rotation), link->along));
        a[link->v] = x;
    }
    m->alpha = *alpha;
    kt_store2(m->linear, *linear);
}

/* ---- numbers that pass from link to link ------------------------------------------------------------------------- */

/* kt_planar_inertia in the form that links pass on: M = [xx xy; xy yy] as (xx, yy) and xy. */
typedef struct kt_planar_carried {
    kt_real2 h, diagonal, force;
    kt_real1 j, xy, moment;
} kt_planar_carried;

KT_INLINE kt_planar_carried kt_planar_load(const kt_planar_inertia *x) {
    return (kt_planar_carried){.h = kt_load2(x->h),
                               .diagonal = kt_make2(x->xx, x->yy),
                               .force = kt_load2(x->force),
                               .j = x->j,
                               .xy = x->xy,
                               .moment = x->moment};
}

KT_INLINE kt_planar_inertia kt_planar_unload(const kt_planar_carried *x) {
    return (kt_planar_inertia){.j = x->j,
                               .h = {KT_PART2(x->h, 0), KT_PART2(x->h, 1)},
                               .xx = KT_PART2(x->diagonal, 0),
                               .xy = x->xy,
                               .yy = KT_PART2(x->diagonal, 1),
                               .moment = x->moment,
                               .force = {KT_PART2(x->force, 0), KT_PART2(x->force, 1)}};
}

/* Projects a revolute joint out of x and shifts the remainder to the parent's origin; tau is about n. */
KT_INLINE kt_condition kt_planar_pass_revolute(const kt_planar_link *link, const kt_planar_motion *m, kt_real1 tau,
                                               kt_planar_carried *x, kt_planar_response *response) {
    const kt_real2 h = x->h, c = kt_load2(m->linear), p = kt_across2(kt_load2(m->offset));
    const kt_real1 j = x->j;
    kt_condition has_inertia = kt_condition_true();
    if (kt_fails(&has_inertia, j > KT_NO_INERTIA * (j + link->size)))
        return kt_condition_false();
    const kt_real1 d = 1.0 / j, n = kt_dot2(p, h), nd = n * d, y = tau - x->moment;
    const kt_real2 g = kt_scale2(d, h);
    x->j = kt_dot2(p, kt_symmetric2_apply(x->diagonal, x->xy, p)) - n * nd;
    x->diagonal = kt_sub2(x->diagonal, kt_mul2(h, g));
    x->xy -= KT_PART2(h, 0) * KT_PART2(g, 1);
    x->h = kt_symmetric2_apply(x->diagonal, x->xy, p);
    x->force = kt_add2(x->force, kt_add2(kt_scale2(y, g), kt_symmetric2_apply(x->diagonal, x->xy, c)));
    x->moment = tau + kt_dot2(p, x->force);
    response->free = y * d - kt_dot2(g, c);
    response->gain_angular = 1.0 + nd;
    kt_store2(response->gain_linear, g);
    return has_inertia;
}

/* Passes a prismatic joint. x is passed by value and the function is not inlined, so that x can stay in registers
 * between revolute joints. */
static __attribute__((noinline)) kt_planar_carried
kt_planar_pass_prismatic(const kt_planar_link *link, const kt_planar_motion *m, kt_real1 tau, kt_planar_carried x,
                         kt_planar_response *response, kt_condition *done) {
    kt_planar_inertia whole = kt_planar_unload(&x);
    *done = kt_planar_project_prismatic(link, m, tau, &whole, response);
    kt_planar_shift(&whole, m->offset);
    return kt_planar_load(&whole);
}

/* Adds the inertia and the bias wrench of the link alone to x, which the next link has passed on if it is its child. */
KT_INLINE void kt_planar_add_own(const kt_planar_link *link, const kt_planar_motion *m, bool has_child,
                                 kt_planar_carried *x) {
    const kt_real2 h = kt_across2(kt_load2(m->first)), force = kt_load2(m->force), mass = kt_const_same2(link->mass);
    if (has_child) {
        x->h = kt_add2(x->h, h);
        x->diagonal = kt_add2(x->diagonal, mass);
        x->force = kt_add2(x->force, force);
        x->j += link->inertia;
        x->moment += m->moment;
    } else {
        *x = (kt_planar_carried){
            .h = h, .diagonal = mass, .force = force, .j = kt_const_real1(link->inertia), .moment = m->moment};
    }
}

KT_INLINE void kt_planar_add_others(const kt_planar_inertia *others, kt_planar_carried *x) {
    const kt_planar_carried more = kt_planar_load(others);
    x->h = kt_add2(x->h, more.h);
    x->diagonal = kt_add2(x->diagonal, more.diagonal);
    x->force = kt_add2(x->force, more.force);
    x->j += more.j;
    x->xy += more.xy;
    x->moment += more.moment;
}

/* ---- memory ahead of use ----------------------------------------------------------------------------------------- */

/* A sweep prefetches the memory of the link so many links further on (sweep.h): towards `last`, which is past the end,
 * or to `first`. */
enum { KT_PLANAR_AHEAD = 16 };

KT_INLINE ptrdiff_t kt_planar_ahead(const kt_planar_link *link, const kt_planar_link *last) {
    return last - link > KT_PLANAR_AHEAD ? KT_PLANAR_AHEAD : 0;
}
KT_INLINE ptrdiff_t kt_planar_ahead_down(const kt_planar_link *link, const kt_planar_link *first) {
    return link - first > KT_PLANAR_AHEAD ? -KT_PLANAR_AHEAD : 0;
}

/* A response that has not been computed is NULL. */
KT_INLINE void kt_planar_fetch(const kt_planar_link *link, const kt_planar_motion *m,
                               const kt_planar_response *response, ptrdiff_t ahead) {
    kt_fetch(link + ahead, sizeof *link);
    kt_fetch(m + ahead, sizeof *m);
    if (response)
        kt_fetch(response + ahead, sizeof *response);
}

/* ---- the recursion ----------------------------------------------------------------------------------------------- */

/* The bias wrench of a link that turns at omega. */
KT_INLINE void kt_planar_wrench_set(const kt_planar_link *link, kt_real1 omega, kt_planar_motion *m) {
    const kt_real2 first = kt_planar_const_sum(kt_load2(m->rotation), link->moment);
    kt_store2(m->first, first);
    m->moment = kt_real1_splat(0.0);
    kt_store2(m->force, kt_scale2(-(omega * omega), first));
}

/* Forward pass of all planes: poses, velocities and bias wrenches, and zeros for the sums over children. external: NULL
 * for none. */
KT_INLINE void kt_planar_articulated_motion(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                            const kt_external *external) {
    const kt_real1 *cosine = data->planar_cosine, *sine = data->planar_sine;
    kt_planar_motion *motion = data->planar;
    const bool far = model->exceeds_caches;
    kt_planar_gather(model, data, q);
    for (const kt_plane *plane = model->plane; plane < model->plane + model->n.plane; plane++) {
        const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
        kt_planar_motion *m = &motion[plane->first];
        kt_real2 e = kt_make2(kt_real1_splat(1.0), kt_real1_splat(0.0));
        kt_real1 omega = kt_real1_splat(0.0);
        kt_planar_ground_set(plane->gravity, &motion[0]);
        for (; link < last; link++, m++) {
            if (far)
                kt_planar_fetch(link, m, NULL, kt_planar_ahead(link, last));
            if (!link->follows) {
                e = kt_load2(motion[link->parent].rotation);
                omega = motion[link->parent].omega;
            }
            e = kt_planar_pose(link, e, q, cosine, sine, m);
            omega = kt_planar_velocity(link, omega, v, m);
            kt_planar_wrench_set(link, omega, m);
            if (link->branches)
                data->planar_inertia[link - model->planar] = (kt_planar_inertia){.j = kt_real1_splat(0.0)};
        }
    }
    if (external)
        kt_planar_external(model, motion, external);
}

/* As kt_eliminate; x receives the inertia that passes to the parent, about the parent's origin. */
typedef kt_elimination kt_planar_eliminate(const kt_planar_link *link, const kt_planar_motion *m, const kt_real1 *tau,
                                           kt_planar_carried *x, kt_planar_response *response, void *context);

/* Eliminates the joint of a link that is in no group. For trees, the context is the data. */
KT_INLINE kt_elimination kt_planar_eliminate_joint(const kt_planar_link *link, const kt_planar_motion *m,
                                                   const kt_real1 *tau, kt_planar_carried *x,
                                                   kt_planar_response *response, void *context) {
    kt_condition done;
    if (link->revolute)
        done = kt_planar_pass_revolute(link, m, link->sign * tau[link->v], x, response);
    else
        *x = kt_planar_pass_prismatic(link, m, tau[link->v], *x, response, &done);
    return kt_is_rejected(context, done) ? KT_ELIMINATION_SINGULAR : KT_ELIMINATION_PASSED;
}

/* Eliminates the joint of a link that may have armature. */
static __attribute__((noinline, unused)) kt_elimination
kt_planar_eliminate_armature(const kt_planar_link *link, const kt_planar_motion *m, const kt_real1 *tau,
                             kt_planar_carried *x, kt_planar_response *response, void *context) {
    kt_planar_inertia whole = kt_planar_unload(x);
    if (!(kt_const_any1(link->armature) > 0.0))
        return kt_planar_eliminate_joint(link, m, tau, x, response, context);
    const kt_real1 force = link->revolute ? link->sign * tau[link->v] : tau[link->v];
    if (kt_is_rejected(context, kt_planar_project_armature(link, m, force, &whole, response)))
        return KT_ELIMINATION_SINGULAR;
    kt_planar_shift(&whole, m->offset);
    *x = kt_planar_load(&whole);
    return KT_ELIMINATION_PASSED;
}

/* Backward pass. Returns the planar index of a link without inertia along its degree of freedom, or 0. */
KT_INLINE size_t kt_planar_articulated_backward(const kt_model *model, kt_data *data, const kt_plane *plane,
                                                const kt_real1 *tau, kt_planar_eliminate *eliminate, void *context) {
    const kt_planar_link *first = &model->planar[plane->first], *link = &model->planar[plane->last] - 1;
    const kt_planar_motion *m = &data->planar[plane->last] - 1;
    kt_planar_response *response = &data->planar_response[plane->last] - 1;
    kt_planar_inertia *inertia = data->planar_inertia;
    kt_planar_carried x = {.j = kt_real1_splat(0.0)};
    const bool far = model->exceeds_caches;
    bool ended = false; /* the link before has passed nothing on */
    for (; link >= first; link--, m--, response--) {
        if (far)
            kt_planar_fetch(link, m, response, kt_planar_ahead_down(link, first));
        kt_planar_add_own(link, m, link->leads && !ended, &x);
        if (link->branches)
            kt_planar_add_others(&inertia[link - model->planar], &x);
        const kt_elimination left = eliminate(link, m, tau, &x, response, context);
        if (left == KT_ELIMINATION_SINGULAR)
            return (size_t)(link - model->planar);
        ended = left == KT_ELIMINATION_ENDED;
        if (!ended && !link->follows && link->parent) {
            const kt_planar_inertia whole = kt_planar_unload(&x);
            kt_planar_add(&inertia[link->parent], &whole);
        }
    }
    return 0;
}

/* Forward pass: accelerations, the ground's being minus gravity. `respond` is kt_planar_respond_joint, or does more. */
typedef void kt_planar_respond(const kt_planar_link *link, const kt_planar_response *response, kt_real1 *alpha,
                               kt_real2 *linear, kt_planar_motion *m, kt_real1 *a, void *context);

KT_INLINE void kt_planar_articulated_forward(const kt_model *model, kt_data *data, const kt_plane *plane,
                                             const kt_const1 *gravity, kt_planar_respond *respond, kt_real1 *a,
                                             void *context) {
    const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
    const kt_planar_response *response = &data->planar_response[plane->first];
    kt_planar_motion *motion = data->planar, *m = &motion[plane->first];
    kt_real2 linear = kt_minus2(kt_const_load2(gravity));
    kt_real1 alpha = kt_real1_splat(0.0);
    const bool far = model->exceeds_caches;
    kt_store2(motion[0].linear, linear);
    for (; link < last; link++, m++, response++) {
        if (far)
            kt_planar_fetch(link, m, response, kt_planar_ahead(link, last));
        if (!link->follows) {
            alpha = motion[link->parent].alpha;
            linear = kt_load2(motion[link->parent].linear);
        }
        respond(link, response, &alpha, &linear, m, a, context);
    }
}

/* The backward pass and the forward pass of accelerations in all planes, for trees. Returns a link without inertia
 * along its degree of freedom, or 0. gravity: NULL for the gravity of the planes. */
KT_INLINE size_t kt_planar_articulated_solve(const kt_model *model, kt_data *data, const kt_real1 *tau,
                                             kt_planar_eliminate *eliminate, const kt_const1 *gravity, kt_real1 *a) {
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        const size_t failed = kt_planar_articulated_backward(model, data, plane, tau, eliminate, data);
        if (failed)
            return model->n.spatial + failed - 1;
        kt_planar_articulated_forward(model, data, plane, gravity ? gravity : plane->gravity, kt_planar_respond_joint,
                                      a, NULL);
    }
    return 0;
}

#endif
