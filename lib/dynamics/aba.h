/* Forward dynamics: the articulated-body algorithm (Featherstone 1983; 2008, 7.3), in world axes about each link's own
 * origin, on classical accelerations.
 *
 * The wrench that a link with all it carries requires of its joint is, with G = H' and a the acceleration of the
 * origin,
 *   (n, f) = [J H; G M] (alpha, a) + (n_b, f_b)
 * 1. Forward pass: positions, velocities and c = (c_n, c_f) (sweep.h).
 * 2. Backward pass: articulated inertias from the tips to the ground. For one degree of freedom along S = (s_n, s_f):
 *      U = [J H; G M] S,   d = 1 / S.U,   y = (tau - S.(n_b, f_b) - U.c) d
 *      (n_b, f_b) += [J H; G M] c + U y                          with the inertia before the next line
 *      [J H; G M] -= U U' d
 *    then the shift by r to the parent, a = a_p + alpha_p x r, n_p = n + r x f, hence, with [r] u = r x u,
 *      J -= H [r],   G -= M [r],   then   J += [r] G,   H += [r] M
 *    A spherical joint transmits the applied moment tau alone: alpha = J^-1 (tau - n_b - H a). A free joint passes on
 *    nothing but the wrench tau.
 * 3. Forward pass: accelerations, of a joint y - d U . (the parent's A, shifted).
 *
 * Armature a, the rotor inertia reflected to a degree of freedom, adds a to S.U and to nothing else: the rotor turns
 * with the joint against the parent, and its momentum is neglected. Links with armature are eliminated by a function of
 * their own, in an instance of the recursion that only models with armature use.
 *
 * The three passes are written once, at the end of this file. What eliminates a link's degrees of freedom is a
 * parameter: the joint alone in a tree (aba.c), a constraint group as a whole (reduction/spatial_links.c), a joint whose
 * inertia is judged first (inertia_check.c). The compiler makes one function of each, without calls in its loops.
 *
 * Pivot test. Projecting out a degree of freedom leaves rounding errors, and a massless link that moves along the same
 * direction would find these instead of zero. So a joint inertia s'Js counts as zero when it does not exceed
 * KT_NO_INERTIA times sum s_i^2 J_ii plus link->size, a number of the whole subtree. A bound by the trace of J would
 * not do: for a chain in a plane the trace grows as its length cubed in the directions that no joint frees, and swamps
 * an inertia about the others that is exact. (inertia_check.c has a sharper test, made once at compilation.)
 */
#ifndef KT_DYNAMICS_ABA_H
#define KT_DYNAMICS_ABA_H

#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"

#include <string.h>

#define KT_NO_INERTIA 1e-14 /* about 45 units of rounding */

/* Factors a symmetric matrix as L D L': l = (l10, l20, l21), e = 1 / D. Returns false if it is not positive definite
 * beyond rounding. The rounding error of entry kk is proportional to size[k]; with E = diag(size) and m a row of L^-1,
 * that of the row's pivot is proportional to m E m'. */
KT_INLINE bool kt_factor3(const kt_v4 a[3], kt_v4 size, kt_v4 *l, kt_v4 *e) {
    const double l00 = a[0][0];
    if (!(l00 > KT_NO_INERTIA * size[0]))
        return false;
    const double l10 = a[0][1] / l00, l20 = a[0][2] / l00;
    const double d1 = a[1][1] - l10 * a[0][1];
    if (!(d1 > KT_NO_INERTIA * (size[1] + l10 * l10 * size[0])))
        return false;
    const double b21 = a[1][2] - l10 * a[0][2], l21 = b21 / d1;
    const double d2 = a[2][2] - l20 * a[0][2] - l21 * b21;
    const double m20 = l10 * l21 - l20; /* L^-1 = [1; -l10 1; m20 -l21 1] */
    if (!(d2 > KT_NO_INERTIA * (size[2] + l21 * l21 * size[1] + m20 * m20 * size[0])))
        return false;
    *l = (kt_v4){l10, l20, l21, 0.0};
    *e = (kt_v4){1.0 / l00, 1.0 / d1, 1.0 / d2, 0.0};
    return true;
}

/* Inverts a symmetric matrix by its factors; returns false as kt_factor3. */
KT_INLINE bool kt_invert3(const kt_v4 a[3], kt_v4 size, kt_v4 out[3]) {
    kt_v4 l, e;
    if (!kt_factor3(a, size, &l, &e))
        return false;
    const double m20 = l[0] * l[2] - l[1];
    const double xy = -l[0] * e[1] - m20 * l[2] * e[2], xz = m20 * e[2], yz = -l[2] * e[2];
    out[0] = (kt_v4){e[0] + l[0] * l[0] * e[1] + m20 * m20 * e[2], xy, xz, 0.0};
    out[1] = (kt_v4){xy, e[1] + l[2] * l[2] * e[2], yz, 0.0};
    out[2] = (kt_v4){xz, yz, e[2], 0.0};
    return true;
}

/* (L D L')^-1 b by substitution. */
KT_INLINE kt_v4 kt_solve3(kt_v4 l, kt_v4 e, kt_v4 b) {
    const double y1 = b[1] - l[0] * b[0], y2 = b[2] - l[1] * b[0] - l[2] * y1;
    const double x2 = y2 * e[2], x1 = y1 * e[1] - l[2] * x2;
    return (kt_v4){b[0] * e[0] - l[0] * x1 - l[1] * x2, x1, x2, 0.0};
}

KT_INLINE kt_v4 kt_diagonal3(const kt_v4 a[3]) {
    return __builtin_shufflevector(__builtin_shufflevector(a[0], a[1], 0, 5, 2, 3), a[2], 0, 1, 6, 3);
}

/* The link's own inertia and bias wrench, that of external ones included. */
KT_INLINE void kt_articulated_rigid(const kt_link *link, const kt_link_motion *m, const kt_link_origin *load,
                                    kt_articulated *out) {
    const kt_v4 none = kt_v4_splat(0.0);
    const kt_v4 h = kt_v4_apply_to(m->axes, link->moment);
    kt_v4_rotate_inertia(m->axes, &link->inertia, out->j);
    out->h[0] = (kt_v4){0.0, h[2], -h[1], 0.0}; /* [h] */
    out->h[1] = (kt_v4){-h[2], 0.0, h[0], 0.0};
    out->h[2] = (kt_v4){h[1], -h[0], 0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        out->g[k] = -out->h[k];
        out->m[k] = none;
        out->m[k][k] = link->mass;
    }
    out->moment = kt_v4_cross(m->omega, kt_v4_apply(out->j, m->omega)) + load->moment;
    out->force = kt_v4_cross(m->omega, kt_v4_cross(m->omega, h)) + load->force;
}

KT_INLINE void kt_articulated_add(kt_articulated *to, const kt_articulated *from) {
    for (int k = 0; k < 3; k++) {
        to->j[k] += from->j[k];
        to->g[k] += from->g[k];
        to->h[k] += from->h[k];
        to->m[k] += from->m[k];
    }
    to->moment += from->moment;
    to->force += from->force;
}

/* Zeros where several children add what they pass on. */
KT_INLINE void kt_articulated_clear(const kt_link *link, kt_articulated *sum) {
    if (!link->branches)
        return;
#ifdef __OPTIMIZE_SIZE__
    memset(sum, 0, sizeof *sum);
#else /* a string instruction, which compilers take for memset, is slow to begin */
    for (int k = 0; k < 3; k++)
        sum->j[k] = sum->g[k] = sum->h[k] = sum->m[k] = kt_v4_splat(0.0);
    sum->moment = sum->force = kt_v4_splat(0.0);
#endif
}

/* From the child's origin to the parent's. */
KT_INLINE void kt_articulated_shift(kt_articulated *x, kt_v4 r) {
    const kt_v4 rx = kt_v4_splat(r[0]), ry = kt_v4_splat(r[1]), rz = kt_v4_splat(r[2]);
    x->j[0] -= rz * x->h[1] - ry * x->h[2];
    x->j[1] -= rx * x->h[2] - rz * x->h[0];
    x->j[2] -= ry * x->h[0] - rx * x->h[1];
    x->g[0] -= rz * x->m[1] - ry * x->m[2];
    x->g[1] -= rx * x->m[2] - rz * x->m[0];
    x->g[2] -= ry * x->m[0] - rx * x->m[1];
    for (int k = 0; k < 3; k++) {
        x->j[k] += kt_v4_cross(r, x->g[k]);
        x->h[k] += kt_v4_cross(r, x->m[k]);
    }
    x->moment += kt_v4_cross(r, x->force);
}

/* Projects one degree of freedom out of x, and stores the joint's response, shifted to the parent's origin. */
KT_INLINE bool kt_articulated_project_axis(const kt_link *link, const kt_link_motion *m, double tau, kt_articulated *x,
                                           kt_response *response) {
    const kt_v4 s = kt_link_axis(link, m), cn = m->alpha, cf = m->linear;
    const kt_v4 sx = kt_v4_splat(s[0]), sy = kt_v4_splat(s[1]), sz = kt_v4_splat(s[2]);
    kt_v4 un, uf;
    double inertia, bias, size;
    if (link->motion == KT_MOTION_REVOLUTE) {
        un = x->j[0] * sx + x->j[1] * sy + x->j[2] * sz;
        uf = x->g[0] * sx + x->g[1] * sy + x->g[2] * sz;
        inertia = kt_v4_dot(s, un);
        bias = kt_v4_dot(s, x->moment);
        size = kt_v4_dot(s * s, kt_diagonal3(x->j));
    } else {
        un = x->h[0] * sx + x->h[1] * sy + x->h[2] * sz;
        uf = x->m[0] * sx + x->m[1] * sy + x->m[2] * sz;
        inertia = kt_v4_dot(s, uf);
        bias = kt_v4_dot(s, x->force);
        size = kt_v4_dot(s * s, kt_diagonal3(x->m));
        if (link->motion == KT_MOTION_SCREW) {
            const double pitch = kt_link_pitch(link);
            const kt_v4 p = kt_v4_splat(pitch);
            un = p * un + (x->j[0] * sx + x->j[1] * sy + x->j[2] * sz);
            uf = p * uf + (x->g[0] * sx + x->g[1] * sy + x->g[2] * sz);
            inertia = kt_v4_dot(s, un + p * uf);
            bias = kt_v4_dot(s, x->moment + p * x->force);
            size = kt_v4_dot(s * s, kt_diagonal3(x->j)) + pitch * pitch * size;
        }
    }
    if (!(inertia > KT_NO_INERTIA * (size + link->size)))
        return false;
    const double d = 1.0 / inertia;
    const kt_v4 dd = kt_v4_splat(d);
    const double y = (tau - bias - kt_v4_dot2(un, cn, uf, cf)) * d;
    const kt_v4 yy = kt_v4_splat(y);
    x->moment += kt_v4_apply(x->j, cn) + kt_v4_apply(x->h, cf) + un * yy;
    x->force += kt_v4_apply(x->g, cn) + kt_v4_apply(x->m, cf) + uf * yy;
    const kt_v4 vn = un * dd, vf = uf * dd;
    for (int k = 0; k < 3; k++) {
        const kt_v4 nk = kt_v4_splat(vn[k]), fk = kt_v4_splat(vf[k]);
        x->j[k] -= un * nk;
        x->g[k] -= uf * nk;
        x->h[k] -= un * fk;
        x->m[k] -= uf * fk;
    }
    response->gain_angular = vn + kt_v4_cross(m->offset, vf);
    response->gain_angular[3] = y;
    response->gain_linear = vf;
    return true;
}

/* Projects the three rotations of a spherical joint out of x. With J = L D L' and Y = L^-1 H, M - Y' D^-1 Y is passed
 * on. This is done by substitution, not with the inverse: the inverse of a needle, which has next to no inertia about
 * its own axis, is huge, and so would be its rounding errors; Y and D are exact to the rounding of J all the same.
 * Stores l and 1 / D in `kept->j`, H in `kept->h`, tau - n_b in `kept->moment`. */
KT_INLINE bool kt_articulated_project_spherical(const kt_link *link, const kt_link_motion *m, const double *tau,
                                                kt_articulated *x, kt_articulated *kept) {
    const kt_v4 none = kt_v4_splat(0.0), applied = kt_v4_apply(m->axes, kt_load3(tau + link->v));
    kt_v4 l, e;
    if (!kt_factor3(x->j, kt_diagonal3(x->j) + kt_v4_splat(link->size), &l, &e))
        return false;
    kept->j[0] = l;
    kept->j[1] = e;
    kept->moment = applied - x->moment;
    x->force += kt_v4_apply(x->g, kt_solve3(l, e, kept->moment));
    const kt_v4 y0 = x->g[0], y1 = x->g[1] - kt_v4_splat(l[0]) * y0; /* rows of Y; those of H are columns of G */
    const kt_v4 y2 = x->g[2] - kt_v4_splat(l[1]) * y0 - kt_v4_splat(l[2]) * y1;
    const kt_v4 z0 = kt_v4_splat(e[0]) * y0, z1 = kt_v4_splat(e[1]) * y1, z2 = kt_v4_splat(e[2]) * y2;
    for (int i = 0; i < 3; i++)
        x->m[i] -= kt_v4_splat(z0[i]) * y0 + kt_v4_splat(z1[i]) * y1 + kt_v4_splat(z2[i]) * y2;
    x->force += kt_v4_apply(x->m, m->linear);
    for (int i = 0; i < 3; i++) {
        kept->h[i] = x->h[i];
        x->j[i] = x->g[i] = x->h[i] = none;
    }
    x->moment = applied;
    return true;
}

/* Solves for all six degrees of freedom of a free joint, by blocks, the mass first:
 *   (J - H M^-1 G) alpha = n - H M^-1 f
 *   a = M^-1 (f - G alpha)
 * Stores the acceleration itself in `kept`: alpha in moment, a in force. */
KT_INLINE bool kt_articulated_project_free(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *m,
                                           const double *tau, kt_articulated *x, kt_articulated *kept) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_v4 base[3], mass[3], k[3], about[3], inverse[3];
    kt_rest_axes(link, parent->axes, base);
    const kt_v4 force = kt_v4_apply(base, kt_load3(tau + link->v));
    const kt_v4 moment = kt_v4_apply(m->axes, kt_load3(tau + link->v + 3));
    if (!kt_invert3(x->m, kt_diagonal3(x->m), mass))
        return false;
    kt_v4_multiply(mass, x->g, k); /* M^-1 G */
    for (int i = 0; i < 3; i++)
        about[i] = x->j[i] - kt_v4_apply(x->h, k[i]);
    if (!kt_invert3(about, kt_diagonal3(x->j) + kt_v4_splat(link->size), inverse))
        return false;
    const kt_v4 f = force - x->force, n = moment - x->moment;
    const kt_v4 alpha = kt_v4_apply(inverse, n - kt_v4_apply(x->h, kt_v4_apply(mass, f)));
    kept->moment = alpha;
    kept->force = kt_v4_apply(mass, f - kt_v4_apply(x->g, alpha));
    for (int i = 0; i < 3; i++)
        x->j[i] = x->g[i] = x->h[i] = x->m[i] = none;
    x->moment = moment;
    x->force = force;
    return true;
}

KT_INLINE bool kt_articulated_project(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                      kt_articulated *x) {
    const kt_link *link = &model->link[i];
    const kt_link_motion *m = &data->motion[i];
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
    case KT_MOTION_PRISMATIC:
    case KT_MOTION_SCREW:
        return kt_articulated_project_axis(link, m, tau[link->v], x, &data->response[i]);
    case KT_MOTION_SPHERICAL:
        return kt_articulated_project_spherical(link, m, tau, x, &data->articulated[link->articulated]);
    case KT_MOTION_FREE:
        return kt_articulated_project_free(link, &data->motion[link->parent], m, tau, x,
                                           &data->articulated[link->articulated]);
    case KT_MOTION_NONE:
        break;
    }
    return false;
}

/* ---- armature ---------------------------------------------------------------------------------------------------- */

/* What a spherical or free joint with armature keeps: of each degree of freedom the parent gain, with d in lane 3 of
 * its angular part, and y. */
static inline kt_v4 *kt_armature_gain(kt_articulated *kept, int row) {
    kt_v4 *const part[] = {kept->j, kept->g, kept->h, kept->m};
    return &part[row / 3][row % 3];
}

/* Joint accelerations, and from them the link's, from those of its parent; c and the parent's accelerations, shifted to
 * the link's origin, have been added to the link's alpha and linear. */
KT_INLINE void kt_respond_axis(const kt_link *link, const kt_link_motion *parent, kt_link_motion *m,
                               const kt_response *response, double *a) {
    const double x = response->gain_angular[3] -
                     kt_v4_dot2(response->gain_angular, parent->alpha, response->gain_linear, parent->linear);
    *a = x;
    const kt_v4 along = kt_v4_splat(x) * kt_link_axis(link, m);
    if (link->motion != KT_MOTION_PRISMATIC)
        m->alpha += along;
    if (link->motion != KT_MOTION_REVOLUTE)
        m->linear += link->motion == KT_MOTION_SCREW ? kt_v4_splat(kt_link_pitch(link)) * along : along;
}

KT_INLINE void kt_respond_rotations(kt_v4 alpha, kt_link_motion *m, double *a) {
    for (int k = 0; k < 3; k++)
        a[k] = kt_v4_dot(m->axes[k], alpha - m->alpha);
    m->alpha = alpha;
}

KT_INLINE void kt_respond_spherical(kt_link_motion *m, const kt_articulated *kept, double *a) {
    const kt_v4 moment = kept->moment - kt_v4_apply(kept->h, m->linear);
    kt_respond_rotations(kt_solve3(kept->j[0], kept->j[1], moment), m, a);
}

KT_INLINE void kt_respond_free(const kt_link *link, const kt_link_motion *parent, kt_link_motion *m,
                               const kt_articulated *kept, double *a) {
    kt_v4 base[3];
    kt_rest_axes(link, parent->axes, base);
    for (int k = 0; k < 3; k++)
        a[k] = kt_v4_dot(base[k], kept->force - m->linear);
    m->linear = kept->force;
    kt_respond_rotations(kept->moment, m, a + 3);
}

/* Accelerations of one link from its parent's and the joint's response; writes the joint accelerations to a. */
KT_INLINE void kt_link_respond(const kt_model *model, kt_data *data, size_t i, double *a) {
    const kt_link *link = &model->link[i];
    const kt_link_motion *parent = &data->motion[link->parent];
    kt_link_motion *m = &data->motion[i];
    m->alpha += parent->alpha;
    m->linear += parent->linear + kt_v4_cross(parent->alpha, m->offset);
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
    case KT_MOTION_PRISMATIC:
    case KT_MOTION_SCREW:
        kt_respond_axis(link, parent, m, &data->response[i], a + link->v);
        break;
    case KT_MOTION_SPHERICAL:
        kt_respond_spherical(m, &data->articulated[link->articulated], a + link->v);
        break;
    case KT_MOTION_FREE:
        kt_respond_free(link, parent, m, &data->articulated[link->articulated], a + link->v);
        break;
    case KT_MOTION_NONE:
        break;
    }
}

/* The same of a link that may have armature. */
static __attribute__((noinline, unused)) void kt_link_respond_armature(const kt_model *model, kt_data *data, size_t i,
                                                                       double *a) {
    const kt_link *link = &model->link[i];
    const kt_link_motion *parent = &data->motion[link->parent];
    kt_link_motion *m = &data->motion[i];
    kt_articulated *kept = &data->articulated[link->articulated];
    kt_subspace s;
    if (!link->has_armature || kt_link_dofs(link) == 1) {
        kt_link_respond(model, data, i, a);
        return;
    }
    m->alpha += parent->alpha;
    m->linear += parent->linear + kt_v4_cross(parent->alpha, m->offset);
    kt_link_subspace(link, parent, m, &s);
    for (int k = 0; k < s.count; k++) {
        const double y = (k < 3 ? &kept->moment : &kept->force)[0][k % 3];
        const double x =
            y - kt_v4_dot2(*kt_armature_gain(kept, 2 * k), m->alpha, *kt_armature_gain(kept, 2 * k + 1), m->linear);
        m->alpha += s.angular[k] * kt_v4_splat(x);
        m->linear += s.linear[k] * kt_v4_splat(x);
        a[link->v + k] = x;
    }
}

/* ---- the recursion -----------------------------------------------------------------------------------------------
 * It treats the links 1 to end - 1; end is n.link, or n.spatial where the others are planar. */

/* Forward pass: poses and velocities, and zeros for what children pass on; no external wrenches. */
KT_INLINE void kt_articulated_motion(const kt_model *model, kt_data *data, const double *q, const double *v,
                                     size_t end) {
    kt_link_motion *motion = data->motion;
    const size_t angles = end == model->n.link ? model->n.angle : model->n.spatial_angle;
    kt_sincos_gather(q, model->angle, angles, data->sine, data->cosine);
    const bool far = kt_is_far(model);
    kt_ground_set(model->gravity, &motion[0]);
    for (size_t i = 1; i < end; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        if (far)
            kt_link_fetch(model, data, kt_ahead(i, end));
        kt_link_pose(link, parent, q, data->cosine, data->sine, &motion[i]);
        kt_link_velocity(link, parent, v, &motion[i]);
        kt_articulated_clear(link, &data->articulated[link->articulated]);
    }
    kt_external_none(data);
}

/* The outcome of eliminating the degrees of freedom of a link: there is no inertia along one of them; x is to be passed
 * to the parent; or nothing is passed, because a group is eliminated as a whole. */
typedef enum kt_elimination { KT_ELIMINATION_SINGULAR, KT_ELIMINATION_PASSED, KT_ELIMINATION_ENDED } kt_elimination;

/* x is the articulated inertia of link i with all it carries; it receives the projected one. */
typedef kt_elimination kt_eliminate(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                    kt_articulated *x, void *context);

/* Of a link that is in no group. */
KT_INLINE kt_elimination kt_eliminate_joint(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                            kt_articulated *x, void *context) {
    (void)context;
    return kt_articulated_project(model, data, i, tau, x) ? KT_ELIMINATION_PASSED : KT_ELIMINATION_SINGULAR;
}

#ifdef KT_ISA
/* The same of a link that may have armature. */
static __attribute__((noinline, unused)) kt_elimination kt_eliminate_armature(const kt_model *model, kt_data *data,
                                                                              size_t i, const double *tau,
                                                                              kt_articulated *x, void *context) {
    if (!model->link[i].has_armature)
        return kt_eliminate_joint(model, data, i, tau, x, context);
    return KT_KERNEL(kt_project_armature)(model, data, i, tau, x) ? KT_ELIMINATION_PASSED : KT_ELIMINATION_SINGULAR;
}
#endif

/* Backward pass. Returns a link without inertia along a degree of freedom, or 0. */
KT_INLINE size_t kt_articulated_backward(const kt_model *model, kt_data *data, const double *tau, size_t end,
                                         kt_eliminate *eliminate, void *context) {
    const size_t stride = data->has_external ? 1 : 0; /* from the wrench of a link to the next one's */
    const bool far = kt_is_far(model);
    kt_articulated x, carried;
    bool ended = false; /* the link before has passed nothing on */
    memset(&carried, 0, sizeof carried);
    for (size_t i = end - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        if (far) {
            kt_link_fetch(model, data, kt_ahead_down(i));
            kt_fetch(&data->response[kt_ahead_down(i)], sizeof *data->response);
        }
        kt_articulated_rigid(link, &data->motion[i], &data->origin[i * stride], &x);
        if (link->leads && !ended)
            kt_articulated_add(&x, &carried);
        if (link->branches)
            kt_articulated_add(&x, &data->articulated[link->articulated]);
        const kt_elimination left = eliminate(model, data, i, tau, &x, context);
        if (left == KT_ELIMINATION_SINGULAR)
            return i;
        ended = left == KT_ELIMINATION_ENDED;
        if (ended || link->parent == 0)
            continue;
        kt_articulated_shift(&x, data->motion[i].offset);
        if (link->follows)
            carried = x;
        else
            kt_articulated_add(&data->articulated[model->link[link->parent].articulated], &x);
    }
    return 0;
}

/* Forward pass: accelerations; `respond` is kt_link_respond, or does more. */
typedef void kt_respond(const kt_model *model, kt_data *data, size_t i, double *a);

KT_INLINE void kt_articulated_forward(const kt_model *model, kt_data *data, size_t end, kt_respond *respond,
                                      double *a) {
    const bool far = kt_is_far(model);
    for (size_t i = 1; i < end; i++) {
        if (far) {
            kt_link_fetch(model, data, kt_ahead(i, end));
            kt_fetch(&data->response[kt_ahead(i, end)], sizeof *data->response);
        }
        respond(model, data, i, a);
    }
}

#endif
