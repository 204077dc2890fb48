/* Forward dynamics of planar trees: the articulated-body algorithm of forward.c in the plane.
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
 */
#include "dynamics/dynamics.h"
#include "dynamics/planar_articulated.h"

/* kt_planar_inertia as it is passed from link to link: M = [xx xy; xy yy] as (xx, yy) and xy. */
typedef struct carried {
    kt_v2 h, diagonal, force;
    double j, xy, moment;
} carried;

KT_INLINE carried load(const kt_planar_inertia *x) {
    return (carried){.h = kt_v2_load(x->h),
                     .diagonal = {x->xx, x->yy},
                     .force = kt_v2_load(x->force),
                     .j = x->j,
                     .xy = x->xy,
                     .moment = x->moment};
}

KT_INLINE kt_planar_inertia unload(const carried *x) {
    return (kt_planar_inertia){.j = x->j,
                               .h = {x->h[0], x->h[1]},
                               .xx = x->diagonal[0],
                               .xy = x->xy,
                               .yy = x->diagonal[1],
                               .moment = x->moment,
                               .force = {x->force[0], x->force[1]}};
}

/* M u */
KT_INLINE kt_v2 apply(const carried *x, kt_v2 u) { return x->diagonal * u + kt_v2_splat(x->xy) * kt_v2_swap(u); }

/* Projects a revolute joint out of x and shifts the remainder to the parent's origin; tau is about n. */
KT_INLINE bool pass_revolute(const kt_planar_link *link, const kt_planar_motion *m, double tau, carried *x,
                             kt_planar_response *response) {
    const kt_v2 h = x->h, c = kt_v2_load(m->linear), p = kt_v2_across(kt_v2_load(m->offset));
    const double j = x->j;
    if (!(j > KT_NO_INERTIA * (j + link->size)))
        return false;
    const double d = 1.0 / j, n = kt_v2_dot(p, h), nd = n * d, y = tau - x->moment;
    const kt_v2 g = h * kt_v2_splat(d);
    x->j = kt_v2_dot(p, apply(x, p)) - n * nd;
    x->diagonal -= h * g;
    x->xy -= h[0] * g[1];
    x->h = apply(x, p);
    x->force += kt_v2_splat(y) * g + apply(x, c);
    x->moment = tau + kt_v2_dot(p, x->force);
    response->base = y * d - kt_v2_dot(g, c);
    response->angular = 1.0 + nd;
    kt_v2_store(response->linear, g);
    return true;
}

/* The same for a prismatic joint. By value, and not inlined, so that x can stay in registers between revolute joints.
 * */
static __attribute__((noinline)) carried pass_prismatic(const kt_planar_link *link, const kt_planar_motion *m,
                                                        double tau, carried x, kt_planar_response *response,
                                                        bool *done) {
    kt_planar_inertia whole = unload(&x);
    *done = kt_planar_project_prismatic(link, m, tau, &whole, response);
    kt_planar_shift(&whole, m->offset);
    return load(&whole);
}

static inline void forward_pass(const kt_model *model, kt_data *data, const kt_plane *plane, const double *q,
                                const double *v) {
    const double *cosine = data->planar_cosine, *sine = data->planar_sine;
    const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
    kt_planar_motion *motion = data->planar, *m = &motion[plane->first];
    kt_v2 e = {1.0, 0.0};
    double omega = 0.0;
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (; link < last; link++, m++) {
        if (!link->follows) {
            e = kt_v2_load(motion[link->parent].turn);
            omega = motion[link->parent].omega;
        }
        e = kt_planar_pose_after(link, e, q, cosine, sine, m);
        omega = kt_planar_velocity_after(link, omega, v, m);
        const kt_v2 first = kt_planar_sum(e, link->moment[0], link->moment[1]);
        kt_v2_store(m->first, first);
        m->moment = 0.0;
        kt_v2_store(m->force, kt_v2_splat(-(omega * omega)) * first);
        if (link->branches)
            data->planar_inertia[link - model->planar] = (kt_planar_inertia){.j = 0.0};
    }
}

/* Adds the link's own inertia and bias wrench to what the next link has passed on in x. */
KT_INLINE void gather(const kt_planar_link *link, const kt_planar_motion *m, carried *x) {
    const kt_v2 h = kt_v2_across(kt_v2_load(m->first)), force = kt_v2_load(m->force), mass = kt_v2_splat(link->mass);
    if (link->leads) {
        x->h += h;
        x->diagonal += mass;
        x->force += force;
        x->j += link->inertia;
        x->moment += m->moment;
    } else {
        *x = (carried){.h = h, .diagonal = mass, .force = force, .j = link->inertia, .moment = m->moment};
    }
}

KT_INLINE void add_others(const kt_planar_inertia *others, carried *x) {
    const carried more = load(others);
    x->h += more.h;
    x->diagonal += more.diagonal;
    x->force += more.force;
    x->j += more.j;
    x->xy += more.xy;
    x->moment += more.moment;
}

/* Backward pass. Returns the planar index of a link without inertia along its degree of freedom, or 0. */
static inline size_t backward_pass(const kt_model *model, kt_data *data, const kt_plane *plane, const double *tau) {
    const kt_planar_link *first = &model->planar[plane->first], *link = &model->planar[plane->last] - 1;
    const kt_planar_motion *m = &data->planar[plane->last] - 1;
    kt_planar_response *response = &data->planar_response[plane->last] - 1;
    kt_planar_inertia *inertia = data->planar_inertia;
    carried x = {.j = 0.0};
    for (; link >= first; link--, m--, response--) {
        bool done;
        gather(link, m, &x);
        if (link->branches)
            add_others(&inertia[link - model->planar], &x);
        if (link->motion == KT_MOTION_REVOLUTE)
            done = pass_revolute(link, m, link->sign * tau[link->v], &x, response);
        else
            x = pass_prismatic(link, m, tau[link->v], x, response, &done);
        if (!done)
            return (size_t)(link - model->planar);
        if (!link->follows && link->parent) {
            const kt_planar_inertia whole = unload(&x);
            kt_planar_add(&inertia[link->parent], &whole);
        }
    }
    return 0;
}

static inline void forward_pass_again(const kt_model *model, kt_data *data, const kt_plane *plane, double *a) {
    const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
    const kt_planar_response *response = &data->planar_response[plane->first];
    kt_planar_motion *motion = data->planar, *m = &motion[plane->first];
    kt_v2 linear = -kt_v2_load(plane->gravity);
    double alpha = 0.0;
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (; link < last; link++, m++, response++) {
        if (!link->follows) {
            alpha = motion[link->parent].alpha;
            linear = kt_v2_load(motion[link->parent].linear);
        }
        kt_planar_respond_after(link, response, &alpha, &linear, m, a);
    }
}

size_t KT_KERNEL(kt_planar_forward)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                    const double *tau, const kt_wrench *external, double *a) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        forward_pass(model, data, &model->plane[p], q, v);
    if (external)
        kt_planar_external(model, data->planar, external);
    for (size_t p = 0; p < model->n.plane; p++) {
        const size_t failed = backward_pass(model, data, &model->plane[p], tau);
        if (failed)
            return model->n.spatial + failed - 1;
        forward_pass_again(model, data, &model->plane[p], a);
    }
    return 0;
}
