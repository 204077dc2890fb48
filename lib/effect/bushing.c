/* Bushing: a spring and a damper in all six directions between two frames. With d = R1' (p2 - p1) and R = R1' R2 the
 * second frame seen from the first, theta the Euler vector of R, u = d' and w the rates of both seen from there,
 *     u = R1' (v2 - v1 - w1 x (p2 - p1)),   w = R1' (w2 - w1) = G thetadot   [MSD A.28],
 *     V = d' K d / 2 + theta' Kr theta / 2,   dissipated = u' C u + w' Cr w,
 *     F = -K d - C u,   M = -G^-T Kr theta - Cr w     on the second end, at its point, in the first end's axes,
 * since theta' Kr thetadot = (G^-T Kr theta) . w. The first end feels -F in the second's point, so about its own
 * -M - (p2 - p1) x F: nothing is left over on the pair, and the gradient of V holds for the first frame's turn too.
 *
 * Where both frames turn about one axis of the first, M = -k theta exactly. The frames are taken to be less than half a
 * turn apart: there theta jumps to the other way round, and the moment with it.
 */
#include "effect/kind.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_ends(checker, effect->between);
    for (int i = 0; i < 6; i++) {
        static const char *const place[6] = {"[0]", "[1]", "[2]", "[3]", "[4]", "[5]"};
        kt_checker_not_negative(checker, "stiffness", place[i], effect->stiffnesses[i]);
        kt_checker_not_negative(checker, "damping", place[i], effect->dampings[i]);
    }
}

/* A diagonal matrix times a vector, and the product u' D u. */
static kt_vec3 scale_each(const double *diagonal, kt_vec3 u) {
    return kt_vec3_make(diagonal[0] * u.x, diagonal[1] * u.y, diagonal[2] * u.z);
}

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                 kt_wrench *wrench, kt_effect_balance *balance) {
    (void)numbers, (void)t;
    const kt_mat3 axes = end[0].axes;
    const kt_vec3 apart = kt_vec3_sub(end[1].point, end[0].point);
    const kt_vec3 carried = kt_vec3_cross(end[0].omega, apart);
    const kt_vec3 moving = kt_vec3_sub(kt_vec3_sub(end[1].velocity, end[0].velocity), carried);
    const kt_vec3 d = kt_mat3_apply_transposed(axes, apart), u = kt_mat3_apply_transposed(axes, moving);
    const kt_vec3 w = kt_mat3_apply_transposed(axes, kt_vec3_sub(end[1].omega, end[0].omega));
    const kt_vec3 theta = kt_euler_vector_from_matrix(kt_mat3_multiply(kt_mat3_transpose(axes), end[1].axes));
    const kt_vec3 spring = scale_each(effect->stiffnesses, d), twist = scale_each(effect->stiffnesses + 3, theta);
    const kt_vec3 damper = scale_each(effect->dampings, u), brake = scale_each(effect->dampings + 3, w);
    kt_mat3 inverse = kt_mat3_identity();
    kt_error error;
    if (kt_euler_vector_map_inverse(theta, &inverse, &error) != KT_OK)
        inverse =
            kt_mat3_identity(); /* theta is not finite, and so will be the moment: within half a turn G is regular */
    const kt_vec3 back = kt_mat3_apply_transposed(inverse, twist);
    const kt_vec3 force = kt_mat3_apply(axes, kt_vec3_scale(-1.0, kt_vec3_add(spring, damper)));
    const kt_vec3 moment = kt_mat3_apply(axes, kt_vec3_scale(-1.0, kt_vec3_add(back, brake)));
    wrench[1] = (kt_wrench){.moment = moment, .force = force};
    wrench[0].force = kt_vec3_scale(-1.0, force);
    wrench[0].moment = kt_vec3_scale(-1.0, kt_vec3_add(moment, kt_vec3_cross(apart, force)));
    if (balance)
        *balance = (kt_effect_balance){.energy = 0.5 * (kt_vec3_dot(spring, d) + kt_vec3_dot(twist, theta)),
                                       .dissipated = kt_vec3_dot(damper, u) + kt_vec3_dot(brake, w)};
}

const kt_effect_kind kt_effect_bushing = {.ends = 2, .check = check, .push = push};
