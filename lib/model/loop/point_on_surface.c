/* Surface: the second point stays on a surface of the first end's frame; phi is the distance of the point from the
 * surface, positive outside. The point lies at d and moves at u in that frame (relative_motion.h). With the unit normal
 * n of the surface through the point
 *     phi'  = n . u
 *     phi'' = n . (u' + coriolis) + bias,      bias = u . H u
 *
 * H contains the second derivatives of phi. Let h be the part of d normal to the axis z, with rho = |h|.
 * Let m = h / rho. With u_n the part of u normal to z, g = m x u_n:
 *     plane     phi = z . d                    n = z                        bias = 0
 *     cylinder  phi = rho - R                  n = m                        bias = g^2 / rho
 *     sphere    phi = |d| - R                  n = d / |d|                  bias = |n x u|^2 / |d|
 *     torus     phi = tau - r                  n = (s m + y z) / tau
 *               bias = (s' y - y' s)^2 / tau^3 + s g^2 / (rho tau)
 *               s = rho - R, y = z . d, tau = |(s, y)|
 *
 * On the axis, at the centre and on the circle in the tube, no normal is defined. For such points, the first end's x
 * axis, or m, replaces the normal, and the curvature is set to zero.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

#include <float.h>

/* v / |v|, or `aside` where v is next to nothing; *inverse: 1 / |v|, or 0. */
static inline kt_vector direction_or_aside(kt_vector v, kt_vector aside, kt_real *norm, kt_real *inverse) {
    const kt_real square = kt_dot(v, v);
    const bool is_zero = !(kt_value(square) > DBL_MIN);
    *norm = is_zero ? 0.0 : kt_sqrt(square);
    *inverse = is_zero ? 0.0 : 1.0 / *norm;
    return is_zero ? aside : kt_over(v, *norm);
}

typedef struct normal {
    kt_vector n;
    kt_real phi, bias;
} normal;

static inline normal normal_of_sphere(const kt_loop_record *loop, const kt_vector *e, const kt_loop_relative *r) {
    kt_real norm, inverse;
    normal x = {.n = direction_or_aside(r->d, e[0], &norm, &inverse)};
    const kt_vector across = kt_cross(x.n, r->u);
    x.phi = norm - loop->radius;
    x.bias = kt_dot(across, across) * inverse;
    return x;
}

/* cylinder and torus */
static inline normal normal_about_axis(const kt_loop_record *loop, const kt_vector *e, const kt_loop_relative *r) {
    const kt_real y = kt_dot(e[2], r->d), y1 = kt_dot(e[2], r->u);
    kt_real rho, inverse, tau, inverse_tau;
    const kt_vector m = direction_or_aside(r->d - kt_scale(y, e[2]), e[0], &rho, &inverse);
    const kt_real g = kt_dot(e[2], kt_cross(m, r->u)), around = g * g * inverse;
    if (loop->form == KT_SURFACE_CYLINDER)
        return (normal){.n = m, .phi = rho - loop->radius, .bias = around};
    const kt_real s = rho - loop->radius, s1 = kt_dot(m, r->u);
    const kt_vector n = direction_or_aside(kt_scale(s, m) + kt_scale(y, e[2]), m, &tau, &inverse_tau);
    const kt_real swept = (s1 * y - y1 * s) * inverse_tau;
    return (normal){.n = n, .phi = tau - loop->tube, .bias = (swept * swept + s * around) * inverse_tau};
}

static int evaluate_surface(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                            kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    const kt_vector *e = end[0].axes;
    const normal x = loop->form == KT_SURFACE_PLANE    ? (normal){.n = e[2], .phi = kt_dot(e[2], r.d), .bias = 0.0}
                     : loop->form == KT_SURFACE_SPHERE ? normal_of_sphere(loop, e, &r)
                                                       : normal_about_axis(loop, e, &r);
    rows[0] = (kt_loop_row){.force = x.n,
                            .moment = kt_vector_zero(),
                            .residual = x.phi,
                            .drift = kt_dot(x.n, r.coriolis) + x.bias,
                            .holonomic = true};
    return 1;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a type with numbers of its own writes them */
static void prepare_surface(const kt_description *description, const kt_loop *loop, double *numbers,
                            kt_loop_record *record) {
    (void)description, (void)numbers;
    record->form = (int32_t)loop->surface.type;
    record->radius = loop->surface.radius;
    record->tube = loop->surface.tube;
}

const kt_loop_kind KT_KERNEL(kt_loop_surface) = {
    .rows = 1, .evaluate = evaluate_surface, .part = {KT_PART_SPATIAL}, .prepare = prepare_surface};

#if KT_DESCRIBES
#define BEAD                                                                                                           \
    "bodies:\n"                                                                                                        \
    "  - name: bead\n"                                                                                                 \
    "    joint: {type: free, position: {position: [0.3, 0, 0.4]}}\n"                                                   \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: sphere, radius: 0.03}\n"                                                                        \
    "loops:\n"

static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"surface", KT_KEY_SURFACE, KT_LOOP_AT(surface), "", "one of plane, cylinder, sphere, torus", .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "of the surface, in the frame of the first end", .needed = false},
};
const kt_descriptor kt_loop_surface_descriptor = {
    .name = "surface",
    .help = "the second point stays on a surface",
    .formula = "S(d) = 0    S: of the surface, in the frame of the first end;  d: from its point to the second",
    .example = BEAD "  - {name: on, type: surface, between: [world, bead], surface: {sphere: {radius: 0.5}}}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
