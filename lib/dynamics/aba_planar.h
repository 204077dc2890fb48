/* Forward dynamics in a plane: the articulated-body algorithm of aba.h, with three by three numbers instead of
 * six by six.
 *
 * The wrench that a link with all it carries requires of its joint is, with p = r rotated by a right angle,
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
 * Every link waits for its child's J, and the division by it takes the longest. So J of a revolute joint's link after
 * the shift, p . M p with the reduced M, is computed as p . M p - (p . h)^2 / J from the M before: all but the last
 * product and difference proceed during the division. The rounding error is of the order of eps |M| |p|^2 either way.
 * A revolute joint leaves J = 0 and h = 0 exactly, so that no rounding error is taken for an inertia.
 *
 * As in aba.h, the passes are written once, with what eliminates a link's degree of freedom as a parameter: the
 * joint alone in a tree (aba_planar.c), or a constraint group (reduction/planar_links.c). What goes from a link to
 * the next stays in registers. The pivot test is that of aba.h.
 */
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
KT_INLINE void kt_planar_shift(kt_planar_inertia *x, const double r[2]) {
    const double px = -r[1], py = r[0];
    const double wx = x->h[0] + (x->xx * px + x->xy * py), wy = x->h[1] + (x->xy * px + x->yy * py);
    x->j += (px * x->h[0] + py * x->h[1]) + (px * wx + py * wy);
    x->h[0] = wx;
    x->h[1] = wy;
    x->moment += px * x->force[0] + py * x->force[1];
}

/* Projects a degree of freedom out of x, and stores its response: U = (n, fx, fy), force = tau - S . (n_b, f_b). */
KT_INLINE void kt_planar_project(const kt_planar_motion *m, double n, double fx, double fy, double inertia,
                                 double force, kt_planar_inertia *x, kt_planar_response *response) {
    const double d = 1.0 / inertia, cx = m->linear[0], cy = m->linear[1];
    const double y = (force - (fx * cx + fy * cy)) * d;
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
    response->free = y;
    response->gain_angular = nd + (m->offset[0] * gy - m->offset[1] * gx);
    response->gain_linear[0] = gx;
    response->gain_linear[1] = gy;
}

KT_INLINE bool kt_planar_project_prismatic(const kt_planar_link *link, const kt_planar_motion *m, double tau,
                                           kt_planar_inertia *x, kt_planar_response *response) {
    double u[2];
    kt_planar_along(link, m, u);
    const double fx = x->xx * u[0] + x->xy * u[1], fy = x->xy * u[0] + x->yy * u[1]; /* M u */
    const double n = x->h[0] * u[0] + x->h[1] * u[1], inertia = u[0] * fx + u[1] * fy;
    if (!(inertia > KT_NO_INERTIA * ((u[0] * u[0] * x->xx + u[1] * u[1] * x->yy) + link->size)))
        return false;
    kt_planar_project(m, n, fx, fy, inertia, tau - (u[0] * x->force[0] + u[1] * x->force[1]), x, response);
    return true;
}

/* The same of any joint with armature, which adds to S . U alone; U = [J; h] or (n, M u). */
KT_INLINE bool kt_planar_project_armature(const kt_planar_link *link, const kt_planar_motion *m, double tau,
                                          kt_planar_inertia *x, kt_planar_response *response) {
    double u[2] = {0.0, 0.0};
    if (!link->revolute)
        kt_planar_along(link, m, u);
    const double w = link->revolute ? 1.0 : 0.0;
    const double n = w * x->j + (x->h[0] * u[0] + x->h[1] * u[1]);
    const double fx = w * x->h[0] + (x->xx * u[0] + x->xy * u[1]), fy = w * x->h[1] + (x->xy * u[0] + x->yy * u[1]);
    const double inertia = w * n + (u[0] * fx + u[1] * fy) + link->armature;
    if (!(inertia > KT_NO_INERTIA * (w * x->j + (u[0] * u[0] * x->xx + u[1] * u[1] * x->yy) + link->size)))
        return false;
    const double force = tau - w * x->moment - (u[0] * x->force[0] + u[1] * x->force[1]);
    kt_planar_project(m, n, fx, fy, inertia, force, x, response);
    return true;
}

/* Accelerations of one link from the joint's response and the parent's alpha and linear, which are replaced by the
 * link's; the joint acceleration is written to a. The joint's is computed first and the link's from it, so that the
 * links that follow see the rounded joint acceleration that the caller is given. */
KT_INLINE void kt_planar_respond_joint(const kt_planar_link *link, const kt_planar_response *response, double *alpha,
                                       kt_v2 *linear, kt_planar_motion *m, double *a, void *context) {
    (void)context;
    const kt_v2 p = kt_v2_across(kt_v2_load(m->offset));
    const double x =
        (response->free - response->gain_angular * *alpha) - kt_v2_dot(kt_v2_load(response->gain_linear), *linear);
    *linear = kt_v2_load(m->linear) + (*linear + kt_v2_splat(*alpha) * p);
    if (link->revolute) {
        *alpha += x;
        a[link->v] = link->sign * x;
    } else {
        *linear += kt_v2_splat(x) * kt_planar_sum(kt_v2_load(m->rotation), link->along[0], link->along[1]);
        a[link->v] = x;
    }
    m->alpha = *alpha;
    kt_v2_store(m->linear, *linear);
}

/* ---- what is passed from link to link ---------------------------------------------------------------------------- */

/* kt_planar_inertia as it is passed from link to link: M = [xx xy; xy yy] as (xx, yy) and xy. */
typedef struct kt_planar_carried {
    kt_v2 h, diagonal, force;
    double j, xy, moment;
} kt_planar_carried;

KT_INLINE kt_planar_carried kt_planar_load(const kt_planar_inertia *x) {
    return (kt_planar_carried){.h = kt_v2_load(x->h),
                               .diagonal = {x->xx, x->yy},
                               .force = kt_v2_load(x->force),
                               .j = x->j,
                               .xy = x->xy,
                               .moment = x->moment};
}

KT_INLINE kt_planar_inertia kt_planar_unload(const kt_planar_carried *x) {
    return (kt_planar_inertia){.j = x->j,
                               .h = {x->h[0], x->h[1]},
                               .xx = x->diagonal[0],
                               .xy = x->xy,
                               .yy = x->diagonal[1],
                               .moment = x->moment,
                               .force = {x->force[0], x->force[1]}};
}

/* M u */
KT_INLINE kt_v2 kt_planar_apply(const kt_planar_carried *x, kt_v2 u) {
    return x->diagonal * u + kt_v2_splat(x->xy) * kt_v2_swap(u);
}

/* Projects a revolute joint out of x and shifts the remainder to the parent's origin; tau is about n. */
KT_INLINE bool kt_planar_pass_revolute(const kt_planar_link *link, const kt_planar_motion *m, double tau,
                                       kt_planar_carried *x, kt_planar_response *response) {
    const kt_v2 h = x->h, c = kt_v2_load(m->linear), p = kt_v2_across(kt_v2_load(m->offset));
    const double j = x->j;
    if (!(j > KT_NO_INERTIA * (j + link->size)))
        return false;
    const double d = 1.0 / j, n = kt_v2_dot(p, h), nd = n * d, y = tau - x->moment;
    const kt_v2 g = h * kt_v2_splat(d);
    x->j = kt_v2_dot(p, kt_planar_apply(x, p)) - n * nd;
    x->diagonal -= h * g;
    x->xy -= h[0] * g[1];
    x->h = kt_planar_apply(x, p);
    x->force += kt_v2_splat(y) * g + kt_planar_apply(x, c);
    x->moment = tau + kt_v2_dot(p, x->force);
    response->free = y * d - kt_v2_dot(g, c);
    response->gain_angular = 1.0 + nd;
    kt_v2_store(response->gain_linear, g);
    return true;
}

/* The same for a prismatic joint. By value, and not inlined, so that x can stay in registers between revolute joints.
 * */
static __attribute__((noinline)) kt_planar_carried kt_planar_pass_prismatic(const kt_planar_link *link,
                                                                            const kt_planar_motion *m, double tau,
                                                                            kt_planar_carried x,
                                                                            kt_planar_response *response, bool *done) {
    kt_planar_inertia whole = kt_planar_unload(&x);
    *done = kt_planar_project_prismatic(link, m, tau, &whole, response);
    kt_planar_shift(&whole, m->offset);
    return kt_planar_load(&whole);
}

/* Adds the link's own inertia and bias wrench to what the next link has passed on in x, if it has. */
KT_INLINE void kt_planar_add_own(const kt_planar_link *link, const kt_planar_motion *m, bool has_child,
                                 kt_planar_carried *x) {
    const kt_v2 h = kt_v2_across(kt_v2_load(m->first)), force = kt_v2_load(m->force), mass = kt_v2_splat(link->mass);
    if (has_child) {
        x->h += h;
        x->diagonal += mass;
        x->force += force;
        x->j += link->inertia;
        x->moment += m->moment;
    } else {
        *x = (kt_planar_carried){.h = h, .diagonal = mass, .force = force, .j = link->inertia, .moment = m->moment};
    }
}

KT_INLINE void kt_planar_add_others(const kt_planar_inertia *others, kt_planar_carried *x) {
    const kt_planar_carried more = kt_planar_load(others);
    x->h += more.h;
    x->diagonal += more.diagonal;
    x->force += more.force;
    x->j += more.j;
    x->xy += more.xy;
    x->moment += more.moment;
}

/* ---- memory ahead of use ----------------------------------------------------------------------------------------- */

/* How many links further on a sweep fetches memory (sweep.h): towards `last`, which is past the end, or to `first`. */
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
KT_INLINE void kt_planar_wrench_set(const kt_planar_link *link, double omega, kt_planar_motion *m) {
    const kt_v2 first = kt_planar_sum(kt_v2_load(m->rotation), link->moment[0], link->moment[1]);
    kt_v2_store(m->first, first);
    m->moment = 0.0;
    kt_v2_store(m->force, kt_v2_splat(-(omega * omega)) * first);
}

/* Forward pass: poses, velocities and bias wrenches, and zeros for what children pass on. */
KT_INLINE void kt_planar_articulated_motion(const kt_model *model, kt_data *data, const kt_plane *plane,
                                            const double *q, const double *v) {
    const double *cosine = data->planar_cosine, *sine = data->planar_sine;
    const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
    kt_planar_motion *motion = data->planar, *m = &motion[plane->first];
    kt_v2 e = {1.0, 0.0};
    double omega = 0.0;
    const bool far = kt_is_far(model);
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (; link < last; link++, m++) {
        if (far)
            kt_planar_fetch(link, m, NULL, kt_planar_ahead(link, last));
        if (!link->follows) {
            e = kt_v2_load(motion[link->parent].rotation);
            omega = motion[link->parent].omega;
        }
        e = kt_planar_pose_after(link, e, q, cosine, sine, m);
        omega = kt_planar_velocity_after(link, omega, v, m);
        kt_planar_wrench_set(link, omega, m);
        if (link->branches)
            data->planar_inertia[link - model->planar] = (kt_planar_inertia){.j = 0.0};
    }
}

/* As kt_eliminate; x receives what is passed to the parent, about the parent's origin. */
typedef kt_elimination kt_planar_eliminate(const kt_planar_link *link, const kt_planar_motion *m, const double *tau,
                                           kt_planar_carried *x, kt_planar_response *response, void *context);

/* Of a link that is in no group. */
KT_INLINE kt_elimination kt_planar_eliminate_joint(const kt_planar_link *link, const kt_planar_motion *m,
                                                   const double *tau, kt_planar_carried *x,
                                                   kt_planar_response *response, void *context) {
    bool done;
    (void)context;
    if (link->revolute)
        done = kt_planar_pass_revolute(link, m, link->sign * tau[link->v], x, response);
    else
        *x = kt_planar_pass_prismatic(link, m, tau[link->v], *x, response, &done);
    return done ? KT_ELIMINATION_PASSED : KT_ELIMINATION_SINGULAR;
}

/* The same of a link that may have armature. */
static __attribute__((noinline, unused)) kt_elimination
kt_planar_eliminate_armature(const kt_planar_link *link, const kt_planar_motion *m, const double *tau,
                             kt_planar_carried *x, kt_planar_response *response, void *context) {
    kt_planar_inertia whole = kt_planar_unload(x);
    if (!(link->armature > 0.0))
        return kt_planar_eliminate_joint(link, m, tau, x, response, context);
    const double force = link->revolute ? link->sign * tau[link->v] : tau[link->v];
    if (!kt_planar_project_armature(link, m, force, &whole, response))
        return KT_ELIMINATION_SINGULAR;
    kt_planar_shift(&whole, m->offset);
    *x = kt_planar_load(&whole);
    return KT_ELIMINATION_PASSED;
}

/* Backward pass. Returns the planar index of a link without inertia along its degree of freedom, or 0. */
KT_INLINE size_t kt_planar_articulated_backward(const kt_model *model, kt_data *data, const kt_plane *plane,
                                                const double *tau, kt_planar_eliminate *eliminate, void *context) {
    const kt_planar_link *first = &model->planar[plane->first], *link = &model->planar[plane->last] - 1;
    const kt_planar_motion *m = &data->planar[plane->last] - 1;
    kt_planar_response *response = &data->planar_response[plane->last] - 1;
    kt_planar_inertia *inertia = data->planar_inertia;
    kt_planar_carried x = {.j = 0.0};
    const bool far = kt_is_far(model);
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
typedef void kt_planar_respond(const kt_planar_link *link, const kt_planar_response *response, double *alpha,
                               kt_v2 *linear, kt_planar_motion *m, double *a, void *context);

KT_INLINE void kt_planar_articulated_forward(const kt_model *model, kt_data *data, const kt_plane *plane,
                                             const double *gravity, kt_planar_respond *respond, double *a,
                                             void *context) {
    const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
    const kt_planar_response *response = &data->planar_response[plane->first];
    kt_planar_motion *motion = data->planar, *m = &motion[plane->first];
    kt_v2 linear = -kt_v2_load(gravity);
    double alpha = 0.0;
    const bool far = kt_is_far(model);
    kt_v2_store(motion[0].linear, linear);
    for (; link < last; link++, m++, response++) {
        if (far)
            kt_planar_fetch(link, m, response, kt_planar_ahead(link, last));
        if (!link->follows) {
            alpha = motion[link->parent].alpha;
            linear = kt_v2_load(motion[link->parent].linear);
        }
        respond(link, response, &alpha, &linear, m, a, context);
    }
}

#endif
