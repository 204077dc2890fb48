/* Friction in a joint: Coulomb's, with more of it at rest (Stribeck 1902) and a viscous part,
 *     force = -(C + (S - C) exp(-(v / vs)^2)) tanh(v / v0) - c v,   dissipated = -force v >= 0,
 * after Armstrong-Helouvry, Dupont and Canudas de Wit (1994), with the sign of v made smooth over v0.
 *
 * The force is smooth (no events), a function of the speed alone; the price is that nothing rests: under a load f < S
 * the joint creeps, at v0 artanh(f / S) where v0 << vs. At rest it is a damper of S / v0, and this is what limits the
 * steps of an explicit method: h < 2.8 v0 J / S for Runge-Kutta 4. Errors against dry friction are proportional to v0.
 */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_scalar_joint(checker, "joint", -1, effect->joint);
    const bool slides = kt_checker_not_negative(checker, "coulomb", "", effect->coulomb);
    const bool sticks = kt_checker_not_negative(checker, "static", "", effect->breakaway);
    kt_checker_not_negative(checker, "viscous", "", effect->viscous);
    if (slides && sticks && effect->breakaway > 0.0 && effect->breakaway < effect->coulomb)
        kt_checker_fault(checker, "static", -1,
                         "static is %g, less than coulomb, which is %g; friction at rest is not less than in motion: "
                         "raise static, or leave it out to have both alike",
                         effect->breakaway, effect->coulomb);
    kt_checker_positive(checker, "stribeck", effect->stribeck);
    kt_checker_positive(checker, "smoothing", effect->smoothing);
}

static kt_real drive(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, double t,
                     kt_effect_power *balance) {
    (void)numbers, (void)q, (void)t;
    kt_real dry = effect->coulomb;
    if (effect->breakaway > effect->coulomb) {
        const kt_real ratio = v / effect->stribeck;
        dry += (effect->breakaway - effect->coulomb) * kt_exp(-ratio * ratio);
    }
    const kt_real force = -dry * kt_tanh(v / effect->smoothing) - effect->viscous * v;
    if (balance)
        *balance = (kt_effect_power){.dissipated = -force * v};
    return force;
}

static kt_energetics energetics(const kt_effect_record *effect) {
    return kt_energetics_of(effect->coulomb > 0.0 || effect->breakaway > 0.0 || effect->viscous > 0.0);
}

const kt_effect_kind KT_EFFECT(kt_effect_joint_friction) = {.check = check, .energetics = energetics, .drive = drive};
