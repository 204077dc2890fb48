/* The gradient of w . tau, the joint forces of inverse dynamics in a direction w, with respect to positions and
 * velocities at constant accelerations. The cost is O(n), while all derivatives cost O(n depth). The adjoint of forward
 * dynamics needs this gradient: da = M^-1 (dtau - d(inverse dynamics)), so that with w = M^-1 mu
 *     mu . da = w . dtau - (gradient of w . inverse dynamics) . (dq, dv).
 *
 * Terms and letters are as in dynamics_derivative.h, and W_l = sum w_i S_i over the degrees of freedom that
 * carry link l. The columns of d tau / dq and d tau / dv sum up to
 *
 *     w . dtau/dq_k = psi''_k . H + psi'_k . N + s_k . Y + W_b . (S_k x* F^C)
 *     w . dtau/dv_k = phi_k . H + s_k . N
 *     H = sum I_l W_l,   N = sum 2B_l' W_l,   Y = sum X_l' W_l        over the links l that k carries
 *
 * where b is the frame that carries k's node. (The terms for i before k's node are W_b . M^C_k x. The terms for i in
 * k's node or after this node are the sum over l of (W_l - W_b)' M_l x. So the terms M x with W_b cancel.) H and F are
 * shifted from origin to origin as wrenches. N and Y do not depend on the origin. About the link's own origin, W = (w',
 * u'),
 *
 *     I W    = (J w' + h x u', m u' + w' x h)
 *     2B' W  = 2 ((v . h) w' - h (v . w') - E (w' x w) + p x u'),   E = tr J / 2 1 - J,   p = m v + w x h
 *     X' W   = n x w' + f x (u' + w' x c)                            for a wrench (n, f) at c
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_RNEA_GRADIENT_H
#define KT_DYNAMICS_RNEA_GRADIENT_H

#include "dynamics/dynamics.h"

/* The sums of a link: first the motion and terms of the link alone. The backward pass adds the sums of all links that
 * it carries. */
typedef struct kt_gradient_link {
    kt_real3 velocity, linear; /* velocity of the origin; the spatial acceleration's part, minus gravity */
    kt_real3 w[2];             /* W */
    kt_real3 h[2], f[2];       /* H, F */
    kt_real3 n, y;             /* N, Y */
} kt_gradient_link;

/* Sums of a link in a plane (rnea_gradient_planar.c); velocity and u: of the origin, along the motion and along w. */
typedef struct kt_planar_gradient_link {
    kt_real2 velocity, u, force, p; /* F, P */
    kt_real1 w, moment, spin;       /* angular velocity along w; moments of F and P about the origin */
    kt_real1 n, y;                  /* N, Y */
} kt_planar_gradient_link;

_Static_assert(sizeof(kt_planar_gradient_link) <= sizeof(kt_gradient_link), "one memory holds either");

/* The results, nv numbers each: the gradient, and two by-products of the same sums, inverse dynamics and M w without
 * armatures.
 *
 * links: scratch, one for each link. */
typedef struct kt_gradient {
    kt_real1 *by_q, *by_v, *force, *momentum;
    kt_gradient_link *links;
} kt_gradient;

/* The state of the evaluation: velocities, accelerations, and wrenches on bodies, or NULL. */
typedef struct kt_gradient_state {
    const kt_real1 *v, *a;
    const kt_external *external;
    bool weightless; /* without gravity */
} kt_gradient_state;

/* kt_inverse_gradient uses the motion of all links, accelerations without gravity (kt_links_update), which is in data.
 *
 * kt_planar_gradient serves planar links, and uses their poses in the plane.
 *
 * kt_planar_respond computes x = M^-1 tau of planar trees, and their poses. Returns a link without inertia, or 0. The
 * result x may overwrite tau. zero: as many zeros as velocities.
 *
 * In lanes, data->sound excludes states that are rejected. */
#define KT_GRADIENT_DECLARE(isa)                                                                                       \
    void kt_inverse_gradient_##isa(const kt_model *model, const kt_data *data, const kt_gradient_state *at,            \
                                   const kt_real1 *w, const kt_gradient *out);                                         \
    void kt_planar_gradient_##isa(const kt_model *model, kt_data *data, const kt_gradient_state *at,                   \
                                  const kt_real1 *w, const kt_gradient *out);                                          \
    size_t kt_planar_respond_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *zero,      \
                                   const kt_real1 *tau, kt_real1 *x);
KT_EACH_KERNEL(KT_GRADIENT_DECLARE)
#undef KT_GRADIENT_DECLARE

/* Evaluates the gradient with the kernel of the model's instruction set and sweep. KT_GRADIENT_POSED: the data already
 * hold the poses of q, in the plane if the model is planar. KT_GRADIENT_WEIGHTLESS: without gravity.
 *
 * Errors: KT_ERROR_NOT_FINITE. */
typedef enum kt_gradient_choice { KT_GRADIENT_POSED = 1, KT_GRADIENT_WEIGHTLESS = 2 } kt_gradient_choice;
KT_CHECKED kt_status kt_gradient_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                          const double *a, unsigned choice, const double *w, const kt_gradient *out,
                                          kt_error *error);

/* x becomes M^-1 x of a tree, in O(n); memory: kt_inverse_layout. Leaves the poses of q in data. Errors:
 * KT_ERROR_SINGULAR names the joint; those of kt_input_check. */
KT_CHECKED kt_status kt_tree_respond(const kt_model *model, kt_data *data, const double *q, void *memory, double *x,
                                     kt_error *error);

#endif
