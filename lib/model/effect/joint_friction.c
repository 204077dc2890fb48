/* Friction in a joint: Coulomb's, with a larger force at rest (Stribeck 1902) and a viscous part,
 *     force = -(C + (S - C) exp(-(v / vs)^2)) tanh(v / v0) - c v,   dissipated = -force v >= 0,
 * after Armstrong-Helouvry, Dupont and Canudas de Wit (1994), with the sign of v made smooth over v0.
 *
 * The force is smooth, without events, and a function of the speed alone. Therefore nothing stays at rest: under a load
 * f < S the joint creeps, at v0 artanh(f / S) if v0 << vs. Near v = 0, the friction acts as a damper of S / v0. This
 * damper limits the steps of an explicit method: h < 2.8 v0 J / S for Runge-Kutta 4. Errors relative to dry friction
 * are proportional to v0.
 *
 * A part of C and S may be proportional to a reaction (evaluate/load_friction.c). The force here is without this part.
 *
 * With `stick` the friction is dry. Then the sign of v is the sign of the slip, which changes at events. At rest the
 * friction is a constraint (contact/contact_part.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

#include <string.h>

/* The joint in which an effect acts; NULL: it acts in no joint of one coordinate. */
static const kt_joint *joint_of_friction(const kt_checker *checker, const kt_effect *effect) {
    const kt_description *d = checker->description;
    for (int i = 0; effect->joint != NULL && i < d->body_count; i++) {
        const kt_joint_type type = d->bodies[i].joint.type;
        const char *name = kt_joint_name_of(&d->bodies[i]);
        if (name != NULL && strcmp(name, effect->joint) == 0 && kt_joint_type_name(type) != NULL)
            return kt_joint_sizes[type].nq == 1 ? &d->bodies[i].joint : NULL;
    }
    return NULL;
}

/* A screw with a larger coefficient holds its load in both directions, whatever torque turns it. */
static void check_thread(kt_checker *checker, const kt_effect *effect, double pitch) {
    if (effect->load == NULL && effect->friction * fabs(pitch) >= effect->radius)
        kt_checker_fault(
            checker, "coefficient", -1,
            "coefficient is %g; in a thread it must be less than radius / pitch, %g, or no torque moves it",
            effect->friction, effect->radius / fabs(pitch));
}

/* Whether the load is the force of a worm, whose radius the loop has. */
static bool is_load_of_worm(const kt_checker *checker, const kt_effect *effect) {
    const kt_description *d = checker->description;
    for (int i = 0; effect->load != NULL && i < d->loop_count; i++)
        if (d->loops[i].name != NULL && strcmp(d->loops[i].name, effect->load) == 0)
            return d->loops[i].type == KT_LOOP_WORM;
    return false;
}

/* Checks friction from a load. */
static void check_load(kt_checker *checker, const kt_effect *effect) {
    const bool shares = effect->efficiency != 1.0, rubs = effect->friction > 0.0;
    const kt_joint *joint = shares || rubs ? joint_of_friction(checker, effect) : NULL;
    if (!(effect->efficiency > 0.0 && effect->efficiency <= 1.0))
        kt_checker_fault(checker, "efficiency", -1, "efficiency is %g; it must be greater than 0, and at most 1",
                         effect->efficiency);
    else if (shares && rubs)
        kt_checker_fault(checker, "efficiency", -1, "coefficient is given, too; leave one of both out");
    else if (shares && effect->load == NULL)
        kt_checker_fault(checker, "efficiency", -1, "load is missing; name the loop that passes the power on");
    else if (!shares && !rubs && effect->load != NULL)
        kt_checker_fault(checker, "load", -1, "load has no effect without coefficient or efficiency; give one of both");
    else if ((shares || rubs) && effect->joint != NULL && joint == NULL)
        kt_checker_fault(checker, "joint", -1,
                         "friction from a load acts in a joint of one coordinate; name a joint "
                         "that is revolute, prismatic or screw");
    else if (rubs && joint != NULL && joint->type != KT_JOINT_PRISMATIC && effect->radius == 0.0 &&
             !is_load_of_worm(checker, effect))
        kt_checker_fault(checker, "radius", -1, "radius is missing; give the radius at which the joint rubs");
    else if (rubs && joint != NULL && joint->type == KT_JOINT_PRISMATIC && effect->radius > 0.0)
        kt_checker_fault(checker, "radius", -1, "a prismatic joint rubs at no radius; leave it out");
    else if (rubs && joint != NULL && joint->type == KT_JOINT_SCREW)
        check_thread(checker, effect, joint->pitch);
}

static void joint_friction_check(kt_checker *checker, const kt_effect *effect) {
    check_load(checker, effect);
    if (effect->stick)
        kt_effect_check_stick(checker, effect);
    else if (effect->stribeck == 0.0)
        kt_checker_fault(checker, "stribeck", -1, "stribeck is 0; it must be greater than 0");
    if (kt_number_is_fine(effect->coulomb) && effect->breakaway > 0.0 && effect->breakaway < effect->coulomb)
        kt_checker_fault(
            checker, "static", -1,
            "static is %g, less than coulomb, which is %g; raise static, or leave it out to have both alike",
            effect->breakaway, effect->coulomb);
}

/* If friction sticks, static friction may end with the first motion. */
#define HAS_CURVE(effect) ((effect)->stribeck > 0.0)
#define STRIBECK_RANGE KT_RANGE_NOT_NEGATIVE

static kt_real joint_friction_force(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v,
                                    kt_plain t, kt_effect_power *balance) {
    (void)numbers, (void)q, (void)t;
    kt_real dry = kt_real_of(effect->coulomb);
    if (effect->breakaway > effect->coulomb && HAS_CURVE(effect)) {
        const kt_real ratio = v / effect->stribeck;
        dry += (effect->breakaway - effect->coulomb) * kt_exp(-ratio * ratio);
    }
    if (effect->direction != 0.0) { /* it slips, and this is the sign of v, which may have just become zero */
        const kt_real slipping = effect->idle ? kt_real_of(0.0) : -effect->direction * dry - effect->viscous * v;
        if (balance)
            *balance = (kt_effect_power){.dissipated = -slipping * v};
        return slipping;
    }
    const kt_real force = -dry * kt_tanh(v / effect->smoothing) - effect->viscous * v;
    if (balance)
        *balance = (kt_effect_power){.dissipated = -force * v};
    return force;
}

static kt_energetics joint_friction_energetics(const kt_effect_record *effect) {
    return kt_energetics_of(effect->coulomb > 0.0 || effect->breakaway > 0.0 || effect->viscous > 0.0 ||
                            effect->load_slot > 0);
}

#if KT_IS_OF_VALUES
/* With D the dry force, s = v / v0 and r = v / vs:  dD/dv = -2 (S - C) exp(-r^2) r / vs. */
static void joint_friction_jacobian(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                                    double derivative[2]) {
    (void)numbers, (void)q, (void)t;
    double sign = tanh(v / effect->smoothing);
    sign = effect->direction != 0.0 ? effect->direction : sign;
    double dry = effect->coulomb, change = 0.0;
    if (effect->breakaway > effect->coulomb && HAS_CURVE(effect)) {
        const double ratio = v / effect->stribeck, more = (effect->breakaway - effect->coulomb) * exp(-ratio * ratio);
        dry += more;
        change = -2.0 * more * ratio / effect->stribeck;
    }
    derivative[0] = derivative[1] = 0.0;
    if (effect->idle)
        return;
    derivative[1] = -change * sign - dry * (1.0 - sign * sign) / effect->smoothing - effect->viscous;
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_joint_friction) = {
    .check = joint_friction_check,
    .energetics = joint_friction_energetics,
    .joint_force = joint_friction_force,
    .joint_derivatives = KT_IF_JACOBIAN(joint_friction_jacobian),
    .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_effect, KT_COORDINATE_WORDS),
    {"coulomb", KT_KEY_NUMBER, KT_EFFECT_AT(coulomb), "N m|N", "C, friction in motion", .range = KT_RANGE_NOT_NEGATIVE},
    {"coefficient", KT_KEY_NUMBER, KT_EFFECT_AT(friction), "",
     "mu: mu r R is added to C and S, with the reaction R of the joint, or the force of `load`",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"radius", KT_KEY_NUMBER, KT_EFFECT_AT(radius), "m",
     "r, at which a joint that turns rubs; of a screw, of its thread", .range = KT_RANGE_NOT_NEGATIVE},
    {"efficiency", KT_KEY_NUMBER, KT_EFFECT_AT(efficiency), "",
     "of the power that `load` passes through the joint; the rest of the power is friction",
     .range = KT_RANGE_POSITIVE},
    {"load", KT_KEY_LOOP, KT_EFFECT_AT(load), "",
     "a loop between two ends, such as a gear, whose force causes the friction", "the joint's reaction",
     .needed = false},
    {"viscous", KT_KEY_NUMBER, KT_EFFECT_AT(viscous), "N m s/rad|N s/m", "c", .range = KT_RANGE_NOT_NEGATIVE},
    {"static", KT_KEY_NUMBER, KT_EFFECT_AT(breakaway), "N m|N", "S, friction at rest, not less than coulomb",
     "that of `coulomb`", .range = KT_RANGE_NOT_NEGATIVE},
    {"stribeck", KT_KEY_NUMBER, KT_EFFECT_AT(stribeck), "rad/s|m/s",
     "vs, the speed over which static friction falls to coulomb", .range = STRIBECK_RANGE},
    {"smoothing", KT_KEY_NUMBER, KT_EFFECT_AT(smoothing), "rad/s|m/s",
     "v0, the speed over which the force changes its sign", .range = KT_RANGE_POSITIVE},
    {"stick", KT_KEY_FLAG, KT_EFFECT_AT(stick), "",
     "true: it sticks at rest, up to S, and slips by the sign of the speed (with vs = 0 at C from the start)",
     .needed = false},
};
const kt_descriptor kt_effect_joint_friction_descriptor = {
    .name = "joint_friction",
    .help = "dry and viscous friction in a joint, with Stribeck's curve",
    .formula = "force = -(C + (S - C) exp(-(v / vs)^2)) tanh(v / v0) - c v",
    .example = KT_EXAMPLE_ARM "  - type: joint_friction\n"
                              "    joint: arm\n"
                              "    coulomb: 0.1\n"
                              "    static: 0.15\n"
                              "    viscous: 0.01\n"
                              "    stribeck: 0.05\n"
                              "    smoothing: 0.01\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_JOINT,
};
#endif
