/* Attraction with the inverse square of the distance (Newton's, or with S < 0 Coulomb's repulsion). With d = p2 - p1
 * the force pulls the ends together:
 *     f = S / |d|^2,   V = -S / |d|.
 *
 * Coincident points have no direction, and the law has no bound there. Therefore, closer than r = 1e-50 m, the law is
 * that of a point inside a uniform ball of radius r. This distance is far below the resolution of a position in metres.
 * The law of the ball continues that outside:
 *     f = S |d| / r^3,   V = -S (3 - |d|^2 / r^2) / (2 r).
 * Because of symmetry, coincident points feel no force, and no result is NaN. Close passages at larger distances are
 * computed without a change of the law, and the error control shortens the steps as far as possible.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

#define NEAR 1e-50

static void attraction_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                              kt_plain t, kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple d = kt_triple_sub(end[1].point, end[0].point), none = kt_triple_zero();
    const double s = effect->strength;
    const kt_real distance = kt_triple_norm(d), r = kt_max(distance, NEAR);
    const kt_triple pull = kt_triple_scale(s / r / r, kt_triple_scale(1.0 / r, d));
    wrench[0] = (kt_effect_wrench){.moment = none, .force = pull};
    wrench[1] = (kt_effect_wrench){.moment = none, .force = kt_triple_scale(kt_real_of(-1.0), pull)};
    if (balance) {
        const kt_real ratio = distance / r; /* 1 outside */
        *balance = (kt_effect_power){.energy = -0.5 * (s / r) * (3.0 - ratio * ratio)};
    }
}

static kt_energetics attraction_energetics(const kt_effect_record *effect) {
    (void)effect;
    return KT_ENERGY_CONSERVED;
}

#if KT_IS_OF_VALUES
/* The force on the second end is -S d / r^3. Outside the ball, with n = d / r, its derivative is
 *
 *     -S (1 - 3 n n') / r^3 */
static void attraction_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                double t, kt_effect_jacobian *jacobian) {
    (void)numbers, (void)t;
    const kt_vec3 d = kt_vec3_sub(end[1].point, end[0].point);
    const double distance = kt_vec3_norm(d), r = fmax(distance, NEAR), f = effect->strength / r / r;
    const kt_vec3 n = kt_vec3_scale(1.0 / r, d);
    const kt_mat3 unit = kt_mat3_identity(),
                  along = kt_outer_product(kt_vec3_scale(distance < NEAR ? 0.0 : -3.0, n), n);
    jacobian->at_point = true;
    jacobian->force = kt_vec3_scale(-f, n);
    jacobian->stiffness[1][1] = kt_mat3_scale(-f / r, kt_mat3_add(unit, along));
    jacobian->damping[1][1] = kt_mat3_scale(0.0, unit);
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_attraction) = {
    .energetics = attraction_energetics, .wrench = attraction_wrench, .jacobian = KT_IF_JACOBIAN(attraction_jacobian)};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_effect),
    {"strength", KT_KEY_NUMBER, KT_EFFECT_AT(strength), "N m^2", "S; less than 0: repulsion", .needed = true},
};
const kt_descriptor kt_effect_attraction_descriptor = {
    .name = "attraction",
    .help = "attraction of two points by the inverse square of their distance",
    .formula = "force = S / d^2    d: distance of the ends",
    .example = "bodies:\n"
               "  - name: moon\n"
               "    joint:\n"
               "      type: free\n"
               "      position: {position: [1, 0, 0]}\n"
               "      velocity: {linear: [0, 2, 0]}\n"
               "    mass: 1\n"
               "    shape: {type: sphere, radius: 0.1}\n"
               "effects:\n"
               "  - {type: attraction, between: [world, moon], strength: 4}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_LINE,
};
#endif
