/* Forward dynamics: the articulated-body algorithm (Featherstone 1983; 2008, 7.3), in world axes about each link's own
 * origin, on classical accelerations.
 *
 * A link, with all bodies that it carries, requires of its joint the wrench, with G = H' and a the acceleration of the
 * origin,
 *   (n, f) = [J H; G M] (alpha, a) + (n_b, f_b)
 * of which J, G and M are stored. 1. Forward pass: positions, velocities and c = (c_n, c_f) (sweep.h). 2. Backward
 * pass: articulated inertias from the tips to the ground. For one degree of freedom along S = (s_n, s_f):
 *      U = [J H; G M] S,   d = 1 / S.U,   y = (tau - S.(n_b, f_b) - U.c) d
 *      (n_b, f_b) += [J H; G M] c + U y                          with the inertia before the next line
 *      [J H; G M] -= U U' d
 *    then the shift by r to the parent, a = a_p + alpha_p x r, n_p = n + r x f, hence, with [r] u = r x u,
 *      G_p = G - M [r],   J_p = J - H [r] + [r] G_p = J + S + S',   S = [r] (G - M [r] / 2)
 *    A spherical joint transmits the applied moment tau alone: alpha = J^-1 (tau - n_b - H a). A free joint passes on
 *    nothing but the wrench tau.
 * 3. Forward pass: accelerations, of a joint y - d U . (the parent's A, shifted).
 *
 * Armature a, the rotor inertia reflected to a degree of freedom, adds a to S.U and to nothing else. The rotor turns
 * with the joint against the parent, and its momentum is neglected. A separate function eliminates links with armature,
 * in an instance of the recursion that only models with armature use.
 *
 * The three passes are written once, at the end of this file. The elimination of a link's degrees of freedom is a
 * parameter. In a tree, only the joint is eliminated (aba.c); with loops, a constraint group as a whole
 * (reduction/spatial_links.c). In inertia_check.c the joint's inertia is tested before the elimination. The compiler
 * makes one function of each, without calls in its loops.
 *
 * Pivot test. Projecting out a degree of freedom leaves rounding errors, which a massless link that moves along the
 * same direction would use instead of zero. Therefore a joint inertia s'Js counts as zero when it does not exceed
 * KT_NO_INERTIA times sum s_i^2 J_ii plus link->size, a number of the whole subtree. A bound by the trace of J would
 * not do. For a chain in a plane the trace grows as its length cubed in the directions that no joint frees. The trace
 * would exceed an exact inertia about the other directions. (inertia_check.c has a sharper test, made once at
 * compilation.)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_ABA_H
#define KT_DYNAMICS_ABA_H

#include "dynamics/angles.h"
#include "dynamics/dynamics.h"
#include "dynamics/no_inertia.h"
#include "dynamics/sweep.h"

#include <string.h>

/* Factors a symmetric matrix as L D L': l = (l10, l20, l21), e = 1 / D. Returns false if the matrix is not positive
 * definite beyond rounding. The rounding error of entry kk is proportional to size[k]. With E = diag(size) and m a row
 * of L^-1, the rounding error of the row's pivot is proportional to m E m'. */
KT_INLINE kt_condition kt_factor3(const kt_real3 a[3], kt_real3 size, kt_real3 *l, kt_real3 *e) {
    kt_condition positive = kt_condition_true();
    const kt_real1 l00 = KT_PART3(a[0], 0);
    if (kt_fails(&positive, l00 > KT_NO_INERTIA * KT_PART3(size, 0)))
        return kt_condition_false();
    const kt_real1 l10 = KT_PART3(a[0], 1) / l00, l20 = KT_PART3(a[0], 2) / l00;
    const kt_real1 d1 = KT_PART3(a[1], 1) - l10 * KT_PART3(a[0], 1);
    if (kt_fails(&positive, d1 > KT_NO_INERTIA * (KT_PART3(size, 1) + l10 * l10 * KT_PART3(size, 0))))
        return kt_condition_false();
    const kt_real1 b21 = KT_PART3(a[1], 2) - l10 * KT_PART3(a[0], 2), l21 = b21 / d1;
    const kt_real1 d2 = KT_PART3(a[2], 2) - l20 * KT_PART3(a[0], 2) - l21 * b21;
    const kt_real1 m20 = l10 * l21 - l20; /* L^-1 = [1; -l10 1; m20 -l21 1] */
    if (kt_fails(&positive, d2 > KT_NO_INERTIA * (KT_PART3(size, 2) + l21 * l21 * KT_PART3(size, 1) +
                                                  m20 * m20 * KT_PART3(size, 0))))
        return kt_condition_false();
    *l = kt_make3(l10, l20, l21);
    *e = kt_make3(1.0 / l00, 1.0 / d1, 1.0 / d2);
    return positive;
}

/* Inverts a symmetric matrix by its factors l and e, which are written to factor[0] and [1]. Returns false in the same
 * case as kt_factor3.
 */
KT_INLINE kt_condition kt_invert3(const kt_real3 a[3], kt_real3 size, kt_real3 factor[2], kt_real3 out[3]) {
    kt_condition positive = kt_condition_true();
    if (kt_fails(&positive, kt_factor3(a, size, &factor[0], &factor[1])))
        return kt_condition_false();
    const kt_real3 l = factor[0], e = factor[1];
    const kt_real1 m20 = KT_PART3(l, 0) * KT_PART3(l, 2) - KT_PART3(l, 1);
    const kt_real1 xy = -KT_PART3(l, 0) * KT_PART3(e, 1) - m20 * KT_PART3(l, 2) * KT_PART3(e, 2);
    const kt_real1 xz = m20 * KT_PART3(e, 2), yz = -KT_PART3(l, 2) * KT_PART3(e, 2);
    out[0] = kt_make3(KT_PART3(e, 0) + KT_PART3(l, 0) * KT_PART3(l, 0) * KT_PART3(e, 1) + m20 * m20 * KT_PART3(e, 2),
                      xy, xz);
    out[1] = kt_make3(xy, KT_PART3(e, 1) + KT_PART3(l, 2) * KT_PART3(l, 2) * KT_PART3(e, 2), yz);
    out[2] = kt_make3(xz, yz, KT_PART3(e, 2));
    return positive;
}

/* (L D L')^-1 b by substitution. */
KT_INLINE kt_real3 kt_solve3(kt_real3 l, kt_real3 e, kt_real3 b) {
    const kt_real1 y1 = KT_PART3(b, 1) - KT_PART3(l, 0) * KT_PART3(b, 0);
    const kt_real1 y2 = KT_PART3(b, 2) - KT_PART3(l, 1) * KT_PART3(b, 0) - KT_PART3(l, 2) * y1;
    const kt_real1 x2 = y2 * KT_PART3(e, 2), x1 = y1 * KT_PART3(e, 1) - KT_PART3(l, 2) * x2;
    return kt_make3(KT_PART3(b, 0) * KT_PART3(e, 0) - KT_PART3(l, 0) * x1 - KT_PART3(l, 1) * x2, x1, x2);
}

KT_INLINE kt_real3 kt_diagonal3(const kt_real3 a[3]) {
#ifdef KT_LANES
    return kt_make3(a[0].x, a[1].y, a[2].z);
#else
    return __builtin_shufflevector(__builtin_shufflevector(a[0], a[1], 0, 5, 2, 3), a[2], 0, 1, 6, 3);
#endif
}

/* The inertia and the bias wrench of the link alone, including external wrenches. */
KT_INLINE void kt_articulated_rigid(const kt_link *link, const kt_link_motion *m, const kt_link_origin *load,
                                    kt_articulated *out) {
    const kt_real3 none = kt_zero3();
    const kt_real3 h = kt_const_apply3(m->axes, link->moment);
    kt_rotate_inertia3(m->axes, &link->inertia, out->j);
    const kt_real1 zero = kt_real1_splat(0.0);
    out->g[0] = kt_make3(zero, -KT_PART3(h, 2), KT_PART3(h, 1)); /* -[h] */
    out->g[1] = kt_make3(KT_PART3(h, 2), zero, -KT_PART3(h, 0));
    out->g[2] = kt_make3(-KT_PART3(h, 1), KT_PART3(h, 0), zero);
    for (int k = 0; k < 3; k++) {
        out->m[k] = none;
        kt_set_part3(&out->m[k], k, kt_const_real1(link->mass));
    }
    /* before it is made symmetric: to the bit the moment of inverse dynamics, whose rounding grows with omega^2 */
    out->moment = kt_add3(kt_cross3(m->omega, kt_apply3(out->j, m->omega)), load->moment);
    kt_symmetric3_mirror(out->j);
    out->force = kt_add3(kt_cross3(m->omega, kt_cross3(m->omega, h)), load->force);
}

KT_INLINE void kt_articulated_add(kt_articulated *to, const kt_articulated *from) {
    kt_symmetric3_add(to->j, from->j);
    kt_symmetric3_add(to->m, from->m);
    for (int k = 0; k < 3; k++)
        to->g[k] = kt_add3(to->g[k], from->g[k]);
    to->moment = kt_add3(to->moment, from->moment);
    to->force = kt_add3(to->force, from->force);
}

/* (n, f) = [J G'; G M] (alpha, a) */
KT_INLINE kt_real3 kt_articulated_moment(const kt_articulated *x, kt_real3 alpha, kt_real3 a) {
    return kt_add3(kt_symmetric3_apply(x->j, alpha), kt_apply_transposed3(x->g, a));
}
KT_INLINE kt_real3 kt_articulated_force(const kt_articulated *x, kt_real3 alpha, kt_real3 a) {
    return kt_add3(kt_apply3(x->g, alpha), kt_symmetric3_apply(x->m, a));
}

/* [J G'; G M] -= d U U', U = (un, uf) */
KT_INLINE void kt_articulated_subtract_square(kt_articulated *x, kt_real1 d, kt_real3 un, kt_real3 uf) {
    const kt_real3 vn = kt_scale3(d, un);
    kt_symmetric3_subtract_square(x->j, d, un);
    kt_symmetric3_subtract_square(x->m, d, uf);
    for (int k = 0; k < 3; k++)
        x->g[k] = kt_sub_scaled3(x->g[k], KT_PART3(vn, k), uf);
}

KT_INLINE void kt_articulated_zero(kt_articulated *sum) {
#ifdef __OPTIMIZE_SIZE__
    memset(sum, 0, sizeof *sum);
#else /* a string instruction, which compilers take for memset, is slow to begin */
    for (int k = 0; k < 3; k++)
        sum->j[k] = sum->g[k] = sum->m[k] = kt_zero3();
    sum->moment = sum->force = kt_zero3();
#endif
}

/* Sets zeros if several children add to the sum. */
KT_INLINE void kt_articulated_clear(const kt_link *link, kt_articulated *sum) {
    if (link->branches)
        kt_articulated_zero(sum);
}

/* From the child's origin to the parent's. */
KT_INLINE void kt_articulated_shift(kt_articulated *x, kt_real3 r) {
    const kt_real3 half = kt_scale3(kt_real1_splat(0.5), r);
    const kt_real1 rx = KT_PART3(half, 0), ry = KT_PART3(half, 1), rz = KT_PART3(half, 2);
    kt_real3 m[3], mr[3], s[3];
    kt_symmetric3_columns(x->m, m);
    mr[0] = kt_sub3(kt_scale3(rz, m[1]), kt_scale3(ry, m[2]));
    mr[1] = kt_sub3(kt_scale3(rx, m[2]), kt_scale3(rz, m[0]));
    mr[2] = kt_sub3(kt_scale3(ry, m[0]), kt_scale3(rx, m[1]));
    for (int k = 0; k < 3; k++) {
        const kt_real3 middle = kt_sub3(x->g[k], mr[k]);
        s[k] = kt_cross3(r, middle);
        x->g[k] = kt_sub3(middle, mr[k]);
    }
    kt_symmetric3_add_both(x->j, s);
    x->moment = kt_add3(x->moment, kt_cross3(r, x->force));
}

/* The parent gain and the free acceleration of a joint with one degree of freedom. */
KT_OPERATOR void kt_response_set(kt_response *response, kt_real3 angular, kt_real3 linear, kt_real1 free) {
    response->gain_angular = angular;
    response->gain_linear = linear;
#ifdef KT_LANES
    response->free = free;
#else
    response->gain_angular[3] = free;
#endif
}
KT_OPERATOR kt_real1 kt_response_free(const kt_response *response) {
#ifdef KT_LANES
    return response->free;
#else
    return response->gain_angular[3];
#endif
}
KT_OPERATOR void kt_response_add(kt_response *response, kt_real1 free) {
#ifdef KT_LANES
    response->free += free;
#else
    response->gain_angular[3] += free;
#endif
}

/* Projects one degree of freedom out of x, and stores the joint's response, shifted to the parent's origin. */
KT_INLINE kt_condition kt_articulated_project_axis(const kt_link *link, const kt_link_motion *m, kt_real1 tau,
                                                   kt_articulated *x, kt_response *response) {
    const kt_real3 s = kt_link_axis(link, m), cn = m->alpha, cf = m->linear;
    kt_condition has_inertia = kt_condition_true();
    kt_real3 un, uf;
    kt_real1 inertia, bias, size;
    if (link->motion == KT_MOTION_REVOLUTE) {
        un = kt_symmetric3_apply(x->j, s);
        uf = kt_apply3(x->g, s);
        inertia = kt_dot3(s, un);
        bias = kt_dot3(s, x->moment);
        size = kt_dot3(kt_mul3(s, s), kt_diagonal3(x->j));
    } else {
        un = kt_apply_transposed3(x->g, s);
        uf = kt_symmetric3_apply(x->m, s);
        inertia = kt_dot3(s, uf);
        bias = kt_dot3(s, x->force);
        size = kt_dot3(kt_mul3(s, s), kt_diagonal3(x->m));
        if (link->motion == KT_MOTION_SCREW) {
            const double pitch = kt_link_pitch(link);
            const kt_real1 p = kt_real1_splat(pitch);
            un = kt_add3(kt_scale3(p, un), kt_symmetric3_apply(x->j, s));
            uf = kt_add3(kt_scale3(p, uf), kt_apply3(x->g, s));
            inertia = kt_dot3(s, kt_add_scaled3(un, p, uf));
            bias = kt_dot3(s, kt_add_scaled3(x->moment, p, x->force));
            size = kt_dot3(kt_mul3(s, s), kt_diagonal3(x->j)) + pitch * pitch * size;
        }
    }
    if (kt_fails(&has_inertia, inertia > KT_NO_INERTIA * (size + link->size)))
        return kt_condition_false();
    const kt_real1 d = 1.0 / inertia;
    const kt_real1 y = (tau - bias - kt_dots3(un, cn, uf, cf)) * d;
    x->moment = kt_add3(x->moment, kt_add_scaled3(kt_articulated_moment(x, cn, cf), y, un));
    x->force = kt_add3(x->force, kt_add_scaled3(kt_articulated_force(x, cn, cf), y, uf));
    kt_articulated_subtract_square(x, d, un, uf);
    const kt_real3 vn = kt_scale3(d, un), vf = kt_scale3(d, uf);
    kt_response_set(response, kt_add3(vn, kt_cross3(m->offset, vf)), vf, y);
    return has_inertia;
}

/* Projects the three rotations of a spherical joint out of x. With J = L D L' and Y = L^-1 H, the link passes on M - Y'
 * D^-1 Y. This is done by substitution, not with the inverse. A needle has next to no inertia about its long axis.
 * Therefore the inverse is huge, and the rounding errors would be huge, too. Y and D are exact to the rounding of J
 * nevertheless. Stores l and 1 / D in `kept->j`, G in `kept->g`, tau - n_b in `kept->moment`. */
KT_INLINE kt_condition kt_articulated_project_spherical(const kt_link *link, const kt_link_motion *m,
                                                        const kt_real1 *tau, kt_articulated *x, kt_articulated *kept) {
    const kt_real3 none = kt_zero3(), applied = kt_apply3(m->axes, kt_load3(tau + link->v));
    const kt_real3 size = kt_add3(kt_diagonal3(x->j), kt_const_same3(link->size));
    kt_condition has_inertia = kt_condition_true();
    kt_real3 l, e;
    if (kt_fails(&has_inertia, kt_factor3(x->j, size, &l, &e)))
        return kt_condition_false();
    kept->j[0] = l;
    kept->j[1] = e;
    kept->moment = kt_sub3(applied, x->moment);
    x->force = kt_add3(x->force, kt_apply3(x->g, kt_solve3(l, e, kept->moment)));
    /* rows of Y; those of H are columns of G */
    const kt_real3 y0 = x->g[0], y1 = kt_sub_scaled3(x->g[1], KT_PART3(l, 0), y0);
    const kt_real3 y2 = kt_sub_scaled3(kt_sub_scaled3(x->g[2], KT_PART3(l, 1), y0), KT_PART3(l, 2), y1);
    kt_symmetric3_subtract_square(x->m, KT_PART3(e, 0), y0);
    kt_symmetric3_subtract_square(x->m, KT_PART3(e, 1), y1);
    kt_symmetric3_subtract_square(x->m, KT_PART3(e, 2), y2);
    x->force = kt_add3(x->force, kt_symmetric3_apply(x->m, m->linear));
    for (int i = 0; i < 3; i++) {
        kept->g[i] = x->g[i];
        x->j[i] = x->g[i] = none;
    }
    x->moment = applied;
    return has_inertia;
}

/* Solves for all six degrees of freedom of a free joint, by blocks, the mass first:
 *   (J - H M^-1 G) alpha = n - H M^-1 f
 *   a = M^-1 (f - G alpha)
 * Stores the acceleration itself in `kept`: alpha in moment, a in force. If `factors`, stores l and 1 / D of M in m, of
 * the matrix of alpha in j, and M^-1 G in g. */
KT_INLINE kt_condition kt_articulated_project_free(const kt_link *link, const kt_link_motion *parent,
                                                   const kt_link_motion *m, const kt_real1 *tau, bool factors,
                                                   kt_articulated *x, kt_articulated *kept) {
    const kt_real3 none = kt_zero3();
    kt_real3 base[3], mass[3], k[3], about[3], inverse[3], of_mass[2], of_about[2];
    kt_axes_at_zero(link, parent->axes, base);
    const kt_real3 force = kt_apply3(base, kt_load3(tau + link->v));
    const kt_real3 moment = kt_apply3(m->axes, kt_load3(tau + link->v + 3));
    kt_condition has_inertia = kt_condition_true();
    if (kt_fails(&has_inertia, kt_invert3(x->m, kt_diagonal3(x->m), of_mass, mass)))
        return kt_condition_false();
    kt_multiply3(mass, x->g, k); /* M^-1 G */
    kt_symmetric3_columns(x->j, about);
    for (int i = 0; i < 3; i++)
        about[i] = kt_sub3(about[i], kt_apply_transposed3(x->g, k[i]));
    const kt_real3 size = kt_add3(kt_diagonal3(x->j), kt_const_same3(link->size));
    if (kt_fails(&has_inertia, kt_invert3(about, size, of_about, inverse)))
        return kt_condition_false();
    const kt_real3 f = kt_sub3(force, x->force), n = kt_sub3(moment, x->moment);
    const kt_real3 alpha = kt_apply3(inverse, kt_sub3(n, kt_apply_transposed3(x->g, kt_apply3(mass, f))));
    kept->moment = alpha;
    kept->force = kt_apply3(mass, kt_sub3(f, kt_apply3(x->g, alpha)));
    for (int i = 0; i < 2 && factors; i++) {
        kept->j[i] = of_about[i];
        kept->m[i] = of_mass[i];
    }
    for (int i = 0; i < 3; i++) {
        if (factors)
            kept->g[i] = k[i];
        x->j[i] = x->g[i] = x->m[i] = none;
    }
    x->moment = moment;
    x->force = force;
    return has_inertia;
}

KT_INLINE kt_condition kt_articulated_project(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
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
        return kt_articulated_project_free(link, &data->motion[link->parent], m, tau, false, x,
                                           &data->articulated[link->articulated]);
    case KT_MOTION_NONE:
        break;
    }
    return kt_condition_false();
}

/* ---- armature ---------------------------------------------------------------------------------------------------- */

/* The stored data of a spherical or free joint with armature: for each degree of freedom the parent gain,
 * with d in lane 3 of its angular part, and y. */
static inline kt_real3 *kt_armature_gain(kt_articulated *kept, int row) { return &kept->gain[row]; }
/* Only inverse inertias, which exist for one state, use d. */
KT_OPERATOR void kt_armature_store(kt_articulated *kept, int row, kt_real1 d) {
#ifdef KT_LANES
    (void)kept, (void)row, (void)d;
#else
    (*kt_armature_gain(kept, row))[3] = d;
#endif
}

/* The acceleration of a link. The forward pass keeps it in registers for the link that follows, because a load right
 * after the store of the same number waits for the store, in each link. */
typedef struct kt_acceleration {
    kt_real3 alpha, linear;
} kt_acceleration;

KT_OPERATOR kt_acceleration kt_acceleration_of(const kt_link_motion *m) {
    return (kt_acceleration){m->alpha, m->linear};
}

/* The acceleration of a link whose joint does not accelerate: the parent's, shifted to the link's origin, and c. */
KT_INLINE kt_acceleration kt_acceleration_shift(const kt_acceleration *parent, const kt_link_motion *m) {
    return (kt_acceleration){
        kt_add3(m->alpha, parent->alpha),
        kt_add3(m->linear, kt_add3(parent->linear, kt_cross3(parent->alpha, m->offset))),
    };
}

/* Compute joint accelerations and add them to the link's acceleration, which is that of kt_acceleration_shift on
 * entry. */
KT_INLINE void kt_respond_axis(const kt_link *link, const kt_acceleration *parent, const kt_link_motion *m,
                               const kt_response *response, kt_acceleration *own, kt_real1 *a) {
    const kt_real1 x = kt_response_free(response) -
                       kt_dots3(response->gain_angular, parent->alpha, response->gain_linear, parent->linear);
    *a = x;
    const kt_real3 along = kt_scale3(x, kt_link_axis(link, m));
    if (link->motion != KT_MOTION_PRISMATIC)
        own->alpha = kt_add3(own->alpha, along);
    if (link->motion != KT_MOTION_REVOLUTE)
        own->linear =
            kt_add3(own->linear,
                    link->motion == KT_MOTION_SCREW ? kt_scale3(kt_real1_splat(kt_link_pitch(link)), along) : along);
}

KT_INLINE void kt_respond_rotations(kt_real3 alpha, const kt_link_motion *m, kt_acceleration *own, kt_real1 *a) {
    for (int k = 0; k < 3; k++)
        a[k] = kt_dot3(m->axes[k], kt_sub3(alpha, own->alpha));
    own->alpha = alpha;
}

KT_INLINE void kt_respond_spherical(const kt_link_motion *m, const kt_articulated *kept, kt_acceleration *own,
                                    kt_real1 *a) {
    const kt_real3 moment = kt_sub3(kept->moment, kt_apply_transposed3(kept->g, own->linear));
    kt_respond_rotations(kt_solve3(kept->j[0], kept->j[1], moment), m, own, a);
}

KT_INLINE void kt_respond_free(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *m,
                               const kt_articulated *kept, kt_acceleration *own, kt_real1 *a) {
    kt_real3 base[3];
    kt_axes_at_zero(link, parent->axes, base);
    for (int k = 0; k < 3; k++)
        a[k] = kt_dot3(base[k], kt_sub3(kept->force, own->linear));
    own->linear = kept->force;
    kt_respond_rotations(kept->moment, m, own, a + 3);
}

KT_INLINE void kt_acceleration_store(const kt_acceleration *own, kt_link_motion *m) {
    m->alpha = own->alpha;
    m->linear = own->linear;
}

/* The acceleration of one link, from its parent's and the joint's response: `at` is the parent's on entry, and the
 * link's on return. Writes the joint accelerations to a. */
KT_INLINE void kt_link_respond(const kt_model *model, kt_data *data, size_t i, kt_acceleration *at, kt_real1 *a) {
    const kt_link *link = &model->link[i];
    kt_link_motion *m = &data->motion[i];
    kt_acceleration own = kt_acceleration_shift(at, m);
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
    case KT_MOTION_PRISMATIC:
    case KT_MOTION_SCREW:
        kt_respond_axis(link, at, m, &data->response[i], &own, a + link->v);
        break;
    case KT_MOTION_SPHERICAL:
        kt_respond_spherical(m, &data->articulated[link->articulated], &own, a + link->v);
        break;
    case KT_MOTION_FREE:
        kt_respond_free(link, &data->motion[link->parent], m, &data->articulated[link->articulated], &own, a + link->v);
        break;
    case KT_MOTION_NONE:
        break;
    }
    kt_acceleration_store(&own, m);
    *at = own;
}

/* Computes the acceleration of a link that may have armature. */
static __attribute__((noinline, unused)) void kt_link_respond_armature(const kt_model *model, kt_data *data, size_t i,
                                                                       kt_acceleration *at, kt_real1 *a) {
    const kt_link *link = &model->link[i];
    kt_link_motion *m = &data->motion[i];
    kt_articulated *kept = &data->articulated[link->articulated];
    kt_subspace s;
    if (!link->has_armature || kt_link_dofs(link) == 1) {
        kt_link_respond(model, data, i, at, a);
        return;
    }
    *at = kt_acceleration_shift(at, m);
    kt_link_subspace(link, &data->motion[link->parent], m, &s);
    for (int k = 0; k < s.count; k++) {
        const kt_real1 y = KT_PART3(k < 3 ? kept->moment : kept->force, k % 3);
        const kt_real1 x =
            y - kt_dots3(*kt_armature_gain(kept, 2 * k), at->alpha, *kt_armature_gain(kept, 2 * k + 1), at->linear);
        at->alpha = kt_add_scaled3(at->alpha, x, s.angular[k]);
        at->linear = kt_add_scaled3(at->linear, x, s.linear[k]);
        a[link->v + k] = x;
    }
    kt_acceleration_store(at, m);
}

/* ---- the recursion -----------------------------------------------------------------------------------------------
 * It treats the links 1 to end - 1; end is n.link, or n.spatial if the others are planar. */

/* Forward pass: poses and velocities, and zeros for the sums over children; no external wrenches. */
KT_INLINE void kt_articulated_motion(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                     size_t end) {
    kt_link_motion *motion = data->motion;
    const size_t angles = end == model->n.link ? model->n.angle : model->n.spatial_angle;
    kt_angles_gather(model, data, q, 0, angles, data->sine, data->cosine);
    const bool far = model->exceeds_caches;
    kt_ground_set(kt_gravity3(model, data), &motion[0]);
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

/* The outcome of eliminating the degrees of freedom of a link. SINGULAR: a degree of freedom has no inertia. PASSED:
 * x is to be passed to the parent. ENDED: nothing is passed, because a group is eliminated as a whole. */
typedef enum kt_elimination { KT_ELIMINATION_SINGULAR, KT_ELIMINATION_PASSED, KT_ELIMINATION_ENDED } kt_elimination;

/* x is the articulated inertia of link i with all bodies that it carries; on return, x is the projected inertia. */
typedef kt_elimination kt_eliminate(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                    kt_articulated *x, void *context);

/* Eliminates the joint of a link that is in no group. */
KT_INLINE kt_elimination kt_eliminate_joint(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                            kt_articulated *x, void *context) {
    (void)context;
    return kt_is_rejected(data, kt_articulated_project(model, data, i, tau, x)) ? KT_ELIMINATION_SINGULAR
                                                                                : KT_ELIMINATION_PASSED;
}

#ifdef KT_ISA
/* Eliminates the joint of a link that may have armature. */
static __attribute__((noinline, unused)) kt_elimination kt_eliminate_armature(const kt_model *model, kt_data *data,
                                                                              size_t i, const kt_real1 *tau,
                                                                              kt_articulated *x, void *context) {
    if (!model->link[i].has_armature)
        return kt_eliminate_joint(model, data, i, tau, x, context);
    return kt_is_rejected(data, KT_KERNEL(kt_project_armature)(model, data, i, tau, x)) ? KT_ELIMINATION_SINGULAR
                                                                                        : KT_ELIMINATION_PASSED;
}
#endif

/* Backward pass. Returns a link without inertia along a degree of freedom, or 0. */
KT_INLINE size_t kt_articulated_backward(const kt_model *model, kt_data *data, const kt_real1 *tau, size_t end,
                                         kt_eliminate *eliminate, void *context) {
    const size_t stride = data->has_external ? 1 : 0; /* from the wrench of a link to the next one's */
    const bool far = model->exceeds_caches;
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

/* Forward pass: accelerations; `respond` is kt_link_respond, or does more. *at is the parent's acceleration on entry,
 * and the link's on return. */
typedef void kt_respond(const kt_model *model, kt_data *data, size_t i, kt_acceleration *at, kt_real1 *a);

KT_INLINE void kt_articulated_forward(const kt_model *model, kt_data *data, size_t end, kt_respond *respond,
                                      kt_real1 *a) {
    const bool far = model->exceeds_caches;
    kt_acceleration at = kt_acceleration_of(&data->motion[0]);
    for (size_t i = 1; i < end; i++) {
        if (far) {
            kt_link_fetch(model, data, kt_ahead(i, end));
            kt_fetch(&data->response[kt_ahead(i, end)], sizeof *data->response);
        }
        if (!model->link[i].follows)
            at = kt_acceleration_of(&data->motion[model->link[i].parent]);
        respond(model, data, i, &at, a);
    }
}

#endif
