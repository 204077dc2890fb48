/* Drag of a medium at rest, on a point that moves with v, in a frame with the axes e_i and the angular velocity w:
 *     f = -(c1 + c2 |v|) v - sum_i h_i(e_i . v) e_i,   m = -sum_i h_i(e_i . w) e_i,   h(s) = (b + q |s|) s
 * Stokes' law for slow flow and Newton's for fast. The sums describe a body with a different resistance in each
 * direction, such as a box. The force is continuously differentiable, also at rest. Dissipated: -(f . v + m . w).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

/* The numbers of the axes begin with the numbers of the force (part 0) and of the moment (part 3). */
static bool acts_along(const kt_effect_record *effect, int part) {
    bool found = false;
    for (int i = part; i < part + 3; i++)
        found = found || effect->dampings[i] != 0.0 || effect->quadratics[i] != 0.0;
    return found;
}

/* Adds -sum_i h_i(e_i . v) e_i; returns the dissipated power. */
static kt_real add_axis_drag(const kt_effect_record *effect, int part, kt_triple_columns axes, kt_triple v,
                             kt_triple *sum) {
    const kt_triple along[3] = {axes.x, axes.y, axes.z};
    kt_real dissipated = kt_real_of(0.0);
    for (int i = 0; i < 3; i++) {
        const kt_real s = kt_triple_dot(along[i], v);
        const kt_real h = (effect->dampings[part + i] + effect->quadratics[part + i] * kt_abs(s)) * s;
        *sum = kt_triple_sub(*sum, kt_triple_scale(h, along[i]));
        dissipated = dissipated + h * s;
    }
    return dissipated;
}

static void drag_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, kt_plain t,
                        kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple v = end[0].velocity;
    const kt_real square = kt_triple_dot(v, v), c = effect->linear + effect->quadratic * kt_sqrt(square);
    kt_real dissipated = c * square;
    wrench[0] = (kt_effect_wrench){.moment = kt_triple_zero(), .force = kt_triple_scale(-c, v)};
    if (acts_along(effect, 0))
        dissipated = dissipated + add_axis_drag(effect, 0, end[0].axes, v, &wrench[0].force);
    if (acts_along(effect, 3))
        dissipated = dissipated + add_axis_drag(effect, 3, end[0].axes, end[0].omega, &wrench[0].moment);
    if (balance)
        *balance = (kt_effect_power){.dissipated = dissipated};
}

static kt_energetics drag_energetics(const kt_effect_record *effect) {
    return kt_energetics_of(effect->linear > 0.0 || effect->quadratic > 0.0 || acts_along(effect, 0) ||
                            acts_along(effect, 3));
}

#if KT_IS_OF_VALUES
/* Adds the derivatives of the sum F of one part. A rotation by d turns the axes: e_i' = d x e_i, so that
 *     dF = d x F - sum_i h_i' e_i (e_i x v) . d,   dF/dv = -sum_i h_i' e_i e_i',   h' = b + 2 q |s| */
static void add_jacobian(const kt_effect_record *effect, int part, kt_mat3 axes, kt_vec3 v, kt_vec3 *force,
                         kt_mat3 *by_rotation, kt_mat3 *by_velocity) {
    const kt_vec3 along[3] = {axes.x, axes.y, axes.z};
    kt_vec3 sum = {0.0, 0.0, 0.0};
    (void)add_axis_drag(effect, part, axes, v, &sum);
    *force = kt_vec3_add(*force, sum);
    *by_rotation = kt_mat3_scale(-1.0, kt_mat3_skew(sum));
    for (int i = 0; i < 3; i++) {
        const double s = kt_vec3_dot(along[i], v);
        const double slope = effect->dampings[part + i] + 2.0 * effect->quadratics[part + i] * fabs(s);
        const kt_vec3 less = kt_vec3_scale(-slope, along[i]);
        *by_rotation = kt_mat3_add(*by_rotation, kt_outer_product(less, kt_vec3_cross(along[i], v)));
        *by_velocity = kt_mat3_add(*by_velocity, kt_outer_product(less, along[i]));
    }
}

/* df/dv = -(c1 + c2 |v|) 1 - c2 v v' / |v|, and the derivatives of the parts along axes. */
static void drag_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                          kt_effect_jacobian *jacobian) {
    (void)numbers, (void)t;
    const kt_vec3 v = end[0].velocity;
    const double speed = kt_vec3_norm(v), c = effect->linear + effect->quadratic * speed;
    const kt_mat3 unit = kt_mat3_identity();
    const kt_vec3 along = kt_vec3_scale(speed > 0.0 ? effect->quadratic / speed : 0.0, v);
    *jacobian = (kt_effect_jacobian){.at_point = !acts_along(effect, 0) && !acts_along(effect, 3),
                                     .force = kt_vec3_scale(-c, v)};
    jacobian->damping[1][1] = kt_mat3_scale(-1.0, kt_mat3_add(kt_mat3_scale(c, unit), kt_outer_product(v, along)));
    if (jacobian->at_point)
        return;
    add_jacobian(effect, 0, end[0].axes, v, &jacobian->force, &jacobian->stiffness[1][0], &jacobian->damping[1][1]);
    add_jacobian(effect, 3, end[0].axes, end[0].omega, &jacobian->moment, &jacobian->stiffness[0][0],
                 &jacobian->damping[0][0]);
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_drag) = {.energetics = drag_energetics,
                                                  .wrench = drag_wrench,
                                                  .jacobian = KT_IF_JACOBIAN(drag_jacobian),
                                                  .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"on", KT_KEY_BODY, KT_EFFECT_AT(between[0]), "", "the body, or BODY.MARKER", .needed = true},
    {"at", KT_KEY_POINT, KT_EFFECT_AT(between[0].at), "m", "the point, body frame; or a marker of the body",
     "the body's origin", .needed = false},
    {"linear", KT_KEY_NUMBER, KT_EFFECT_AT(linear), "N s/m", "c1", .range = KT_RANGE_NOT_NEGATIVE},
    {"quadratic", KT_KEY_NUMBER, KT_EFFECT_AT(quadratic), "N s^2/m^2", "c2", .range = KT_RANGE_NOT_NEGATIVE},
    {"axes_linear", KT_KEY_SIX, KT_EFFECT_AT(dampings), "N s/m, N m s/rad",
     "b: along and about x, y, z of the point's frame, that of its marker or else of the body", "zeros",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"axes_quadratic", KT_KEY_SIX, KT_EFFECT_AT(quadratics), "N s^2/m^2, N m s^2/rad^2", "q: likewise", "zeros",
     .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_effect_drag_descriptor = {
    .name = "drag",
    .help = "resistance of a medium at rest to the motion of a point, or to a body along its axes",
    .formula = "force = -(c1 + c2 |v|) v    v: velocity of the point\n"
               "        -(b + q |s|) s    s: velocity along, or angular velocity about, an axis of its frame",
    .example = KT_EXAMPLE_CUBE "  - {type: drag, on: box, at: corner, linear: 0.1, quadratic: 0.02}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITIES_FORCE, KT_QUANTITIES_MOMENT, KT_QUANTITY_POWER),
};
#endif
