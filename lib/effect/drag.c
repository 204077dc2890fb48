/* Drag on a point that moves with v through a medium at rest: f = -(c1 + c2 |v|) v, dissipated = (c1 + c2 |v|) |v|^2.
 * Stokes' law for slow flow and Newton's for fast; f is continuously differentiable, at rest too. */
#include "effect/effect.h"

static void evaluate_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                            kt_plain t, kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple v = end[0].velocity;
    const kt_real square = kt_triple_dot(v, v), c = effect->linear + effect->quadratic * kt_sqrt(square);
    wrench[0] = (kt_effect_wrench){.moment = kt_triple_zero(), .force = kt_triple_scale(-c, v)};
    if (balance)
        *balance = (kt_effect_power){.dissipated = c * square};
}

static kt_energetics energetics(const kt_effect_record *effect) {
    return kt_energetics_of(effect->linear > 0.0 || effect->quadratic > 0.0);
}

#if KT_HAS_EFFECT_JACOBIAN
/* df/dv = -(c1 + c2 |v|) 1 - c2 v v' / |v| */
static void write_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                           kt_effect_jacobian *jacobian) {
    (void)numbers, (void)t;
    const kt_vec3 v = end[0].velocity;
    const double speed = kt_vec3_norm(v), c = effect->linear + effect->quadratic * speed;
    const kt_mat3 unit = kt_mat3_identity();
    const kt_vec3 along = kt_vec3_scale(speed > 0.0 ? effect->quadratic / speed : 0.0, v);
    jacobian->at_point = true;
    jacobian->force = kt_vec3_scale(-c, v);
    jacobian->stiffness[1][1] = kt_mat3_scale(0.0, unit);
    jacobian->damping[1][1] = kt_mat3_scale(-1.0, kt_mat3_add(kt_mat3_scale(c, unit), kt_outer_product(v, along)));
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_drag) = {.energetics = energetics,
                                                  .wrench = evaluate_wrench,
                                                  .jacobian = KT_IF_JACOBIAN(write_jacobian),
                                                  .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"on", KT_KEY_BODY, KT_EFFECT_AT(between[0]), "", KT_WORDS("the body, or BODY.MARKER"), .needed = true},
    {"at", KT_KEY_POINT, KT_EFFECT_AT(between[0].at), "m", KT_WORDS("the point, body frame; or a marker of the body"),
     "the body's origin", .needed = false},
    {"linear", KT_KEY_NUMBER, KT_EFFECT_AT(linear), "N s/m", KT_WORDS("c1"), .range = KT_RANGE_NOT_NEGATIVE},
    {"quadratic", KT_KEY_NUMBER, KT_EFFECT_AT(quadratic), "N s^2/m^2", KT_WORDS("c2"), .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_effect_drag_descriptor = {
    .name = "drag",
    .help = KT_WORDS("resistance of a medium at rest to the motion of a point"),
    .formula = KT_WORDS("force = -(c1 + c2 |v|) v    v: velocity of the point"),
    .example = KT_WORDS(KT_EXAMPLE_CUBE "  - {type: drag, on: box, at: corner, linear: 0.1, quadratic: 0.02}\n"),
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITIES_FORCE, KT_QUANTITY_POWER),
};
#endif
