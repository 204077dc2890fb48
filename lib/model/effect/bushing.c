/* Bushing: a spring and a damper in all six directions between two frames. The pose of the second frame relative to the
 * first is d = R1' (p2 - p1) and R = R1' R2. The Euler vector of R is theta. The rates of both relative to the first
 * frame are u = d' and w:
 *     u = R1' (v2 - v1 - w1 x (p2 - p1)),   w = R1' (w2 - w1) = G thetadot   [MSD A.28],
 *     V = d' K d / 2 + theta' Kr theta / 2,   dissipated = u' C u + w' Cr w,
 *     F = -K d - C u,   M = -G^-T Kr theta - Cr w,
 * since theta' Kr thetadot = (G^-T Kr theta) . w.
 *
 * Frame: F and M act on the second end, at its point, in the first end's axes. The first end feels -F in the second's
 * point. About the first end's point, the moment is -M - (p2 - p1) x F. The pair therefore has no resultant wrench, and
 * the gradient of V is also correct for rotations of the first frame.
 *
 * If both frames turn about one axis of the first, M = -k theta exactly. The frames must be less than half a turn
 * apart. At half a turn theta jumps to its opposite, and the moment with it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

/* u and w of the code are relative to the first frame, `theta` is the Euler vector of R, and `back` is
 * G^-T Kr theta. */
static void bushing_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, double t,
                           kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple_columns axes = end[0].axes;
    const kt_triple apart = kt_triple_sub(end[1].point, end[0].point);
    const kt_triple carried = kt_triple_cross(end[0].omega, apart);
    const kt_triple moving = kt_triple_sub(kt_triple_sub(end[1].velocity, end[0].velocity), carried);
    const kt_triple d = kt_columns_apply_transposed(axes, apart), u = kt_columns_apply_transposed(axes, moving);
    const kt_triple w = kt_columns_apply_transposed(axes, kt_triple_sub(end[1].omega, end[0].omega));
    const kt_triple theta = kt_rotation_vector_of(kt_columns_multiply(kt_columns_transpose(axes), end[1].axes));
    const kt_triple spring = kt_triple_scale_each(effect->stiffnesses, d),
                    twist = kt_triple_scale_each(effect->stiffnesses + 3, theta);
    const kt_triple damper = kt_triple_scale_each(effect->dampings, u),
                    brake = kt_triple_scale_each(effect->dampings + 3, w);
    const kt_triple back = kt_rotation_vector_transposed_map(theta, twist);
    const kt_triple force = kt_columns_apply(axes, kt_triple_scale(-1.0, kt_triple_add(spring, damper)));
    const kt_triple moment = kt_columns_apply(axes, kt_triple_scale(-1.0, kt_triple_add(back, brake)));
    wrench[1] = (kt_effect_wrench){.moment = moment, .force = force};
    wrench[0].force = kt_triple_scale(-1.0, force);
    wrench[0].moment = kt_triple_scale(-1.0, kt_triple_add(moment, kt_triple_cross(apart, force)));
    if (balance)
        *balance = (kt_effect_power){.energy = 0.5 * (kt_triple_dot(spring, d) + kt_triple_dot(twist, theta)),
                                     .dissipated = kt_triple_dot(damper, u) + kt_triple_dot(brake, w)};
}

static kt_energetics bushing_energetics(const kt_effect_record *effect) {
    bool dissipates = false;
    for (int i = 0; i < 6; i++)
        dissipates = dissipates || effect->dampings[i] > 0.0;
    return kt_energetics_of(dissipates);
}

#if KT_IS_OF_VALUES
/* Derivatives in the axes of the first end, with kappa = Kr theta. The terms du and dtheta are for a displacement and a
 * rotation of the second end:
 *     dF = -K dd - C du,               du = -w1 x dd
 *     dM = -d(G^-T kappa) - Cr dw,     dtheta = G^-1 (the rotation of the second end),   dkappa = Kr dtheta
 * With the coefficient c(x) of x = |theta|^2 (triple.h),
 *     G^-T kappa = kappa + theta x kappa / 2 + c theta x (theta x kappa)
 *     d(G^-T kappa) = G^-T dkappa + dtheta x kappa / 2 + 2 c' (theta . dtheta) theta x (theta x kappa)
 *                   + c (dtheta x (theta x kappa) + theta x (dtheta x kappa)) */

/* The derivative of G^-T kappa along dtheta. */
static kt_vec3 change_of_moment(const double stiffness[3], kt_vec3 theta, kt_vec3 along) {
    const kt_vec3 kappa = kt_triple_scale_each(stiffness, theta), across = kt_vec3_cross(theta, kappa);
    const double x = kt_vec3_dot(theta, theta), c = kt_rotation_vector_map_coefficient(x);
    const double derivative = kt_rotation_vector_map_coefficient_derivative(x);
    const kt_vec3 turned = kt_vec3_cross(along, kappa);
    const kt_vec3 twice = kt_vec3_add(kt_vec3_cross(along, across), kt_vec3_cross(theta, turned));
    const kt_vec3 stretch = kt_vec3_scale(2.0 * derivative * kt_vec3_dot(theta, along), kt_vec3_cross(theta, across));
    const kt_vec3 change = kt_rotation_vector_transposed_map(theta, kt_triple_scale_each(stiffness, along));
    return kt_vec3_add(kt_vec3_add(change, kt_vec3_scale(0.5, turned)), kt_vec3_add(stretch, kt_vec3_scale(c, twice)));
}

/* -R diag(d) R' */
static kt_mat3 resist(kt_mat3 axes, const double d[3]) {
    const kt_mat3 scaled = {kt_vec3_scale(-d[0], axes.x), kt_vec3_scale(-d[1], axes.y), kt_vec3_scale(-d[2], axes.z)};
    return kt_mat3_multiply(scaled, kt_mat3_transpose(axes));
}

/* The displaced end is the second. u = R1' (..) changes by -w1 x its displacement, hence damping times -[w1] in the
 * stiffness. */
static void bushing_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                             kt_effect_jacobian *jacobian) {
    kt_wrench wrench[2];
    kt_error error;
    const kt_mat3 axes = end[0].axes, back = kt_mat3_transpose(axes);
    const kt_vec3 theta = kt_rotation_vector_of(kt_mat3_multiply(back, end[1].axes));
    kt_mat3 map = kt_mat3_identity();
    bushing_wrench(effect, numbers, end, t, wrench, NULL);
    if (kt_euler_vector_map_inverse(theta, &map, &error) != KT_OK)
        map = kt_mat3_identity(); /* as in kt_rotation_vector_transposed_map */
    *jacobian = (kt_effect_jacobian){.moment = wrench[1].moment, .force = wrench[1].force};
    const kt_mat3 turning = {change_of_moment(effect->stiffnesses + 3, theta, map.x),
                             change_of_moment(effect->stiffnesses + 3, theta, map.y),
                             change_of_moment(effect->stiffnesses + 3, theta, map.z)};
    const kt_mat3 damping = resist(axes, effect->dampings);
    jacobian->stiffness[0][0] = kt_mat3_scale(-1.0, kt_mat3_multiply(axes, kt_mat3_multiply(turning, back)));
    jacobian->stiffness[1][1] = kt_mat3_add(resist(axes, effect->stiffnesses),
                                            kt_mat3_multiply(damping, kt_mat3_scale(-1.0, kt_mat3_skew(end[0].omega))));
    jacobian->damping[0][0] = resist(axes, effect->dampings + 3);
    jacobian->damping[1][1] = damping;
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_bushing) = {
    .energetics = bushing_energetics, .wrench = bushing_wrench, .jacobian = KT_IF_JACOBIAN(bushing_jacobian)};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_effect),
    {"stiffness", KT_KEY_SIX, KT_EFFECT_AT(stiffnesses), "N/m, N m/rad",
     "K, Kr: along and about x, y, z of the first end", "zeros", .range = KT_RANGE_NOT_NEGATIVE},
    {"damping", KT_KEY_SIX, KT_EFFECT_AT(dampings), "N s/m, N m s/rad", "C, Cr: likewise", "zeros",
     .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_effect_bushing_descriptor = {
    .name = "bushing",
    .help = "springs and dampers in all six directions between two frames",
    .formula = "force = -K d - C d',  moment = -G^-T Kr theta - Cr w    d, theta, w: displacement, Euler vector and\n"
               "angular velocity of the second frame as seen from the first, less than half a turn;  w = G theta'",
    .example = "bodies:\n"
               "  - name: engine\n"
               "    joint: {type: free}\n"
               "    mass: 2\n"
               "    shape: {type: box, size: [0.4, 0.2, 0.2]}\n"
               "effects:\n"
               "  - type: bushing\n"
               "    between: [world, engine]\n"
               "    stiffness: [4e3, 4e3, 4e3, 50, 50, 50]\n"
               "    damping: [20, 20, 20, 1, 1, 1]\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITIES_FORCE, KT_QUANTITIES_MOMENT, KT_QUANTITY_POWER),
};
#endif
