/* An effect type: the wrench at each of its ends, or the force in a joint.
 *
 * An effect is a pure function of its record, the motion of its ends or joint, and the time. An effect also reports the
 * source of its power. With P the power of all forces that it exerts, and V its potential energy,
 *     P = supplied - dissipated - dV/dt
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EFFECT_EFFECT_H
#define KT_EFFECT_EFFECT_H

#include "base/inner.h"
#include "base/isa.h"
#include "effect/triple.h"
#include "kinetree/effect.h"
#include "kinetree/expression.h"
#include "model/check.h"
#include "model/describe.h"
#include "model/model.h"

#include <math.h>

/* The inputs and outputs of an effect. For values, these are the structs of a caller's own effects. For derivatives,
 * each number carries its derivative. In lanes, a number holds the values of several states. */
#if defined(KT_DUAL) || defined(KT_LANES)
#ifdef KT_LANES
#define KT_EFFECT(name) KT_KERNEL(name)
#else
#define KT_EFFECT(name) name##_dual
#endif
typedef struct kt_effect_frame {
    kt_triple_columns axes;
    kt_triple point, omega, velocity;
} kt_effect_frame;
typedef struct kt_effect_wrench {
    kt_triple moment, force;
} kt_effect_wrench;
typedef struct kt_effect_power {
    kt_real energy, dissipated, supplied;
} kt_effect_power;
#else
#define KT_EFFECT(name) name
typedef kt_effect_end kt_effect_frame;
typedef kt_wrench kt_effect_wrench;
typedef kt_effect_balance kt_effect_power;
#endif

/* The derivatives of the wrench on the last of an effect's ends while the other end (for one end: the ground) is at
 * rest. The derivatives are by the rotation, the displacement, the angular velocity and the velocity of the last end.
 * The wrench on the other end is the opposite in every state, so that these derivatives are complete.
 * Frame: world axes. The moment is about the end's point, and moves along with the end. */
typedef struct kt_effect_jacobian {
    kt_vec3 moment, force;
    bool at_point; /* a force alone, of displacement and velocity alone: of both matrices only [1][1] is set */
    kt_mat3 stiffness[2][2]; /* derivatives of moment, force: by rotation, displacement */
    kt_mat3 damping[2][2];   /* derivatives of moment, force: by angular velocity, velocity */
} kt_effect_jacobian;

/* The gap of an effect that acts only on one side of a boundary (a contact, a stop): the distance to this boundary. */
typedef struct kt_gap {
    double distance;  /* m or rad; below 0: it acts */
    double rate;      /* d(distance)/dt */
    kt_vec3 velocity; /* velocity of the approaching point, in any axes that are at rest relative to the boundary */
    double turn;      /* rad/s; of these axes relative to the approaching body */
} kt_gap;

/* A type is one file, compiled for values and once more for derivatives: const kt_effect_kind
 * KT_EFFECT(kt_effect_spring). The descriptor of a kind is compiled once and has its keys. The ends, the joint and the
 * functions of time that the type reads follow from the keys. */
typedef struct kt_effect_kind {
    /* Reports faults that the ranges of the keys do not cover; NULL: none. */
    void (*check)(kt_checker *checker, const kt_effect *effect);
    /* How the effect, with its present numbers, can change the energy of a mechanism; NULL: it can supply energy. */
    kt_energetics (*energetics)(const kt_effect_record *effect);
    /* Effects with ends: wrench[k] receives the wrench on end k. balance may be NULL. The points of both ends are
     * relative to a fixed point of the world near one of them. No digits are therefore lost if they are far from the
     * world's origin.
     * Frame: world axes; the moment is about the end's point. */
    void (*wrench)(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, kt_plain t,
                   kt_effect_wrench *wrench, kt_effect_power *balance);
    /* Effects in a joint with position q and velocity v: the joint force (N m, or N in a sliding joint). */
    kt_real (*joint_force)(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, kt_plain t,
                           kt_effect_power *balance);
    /* The derivatives of `wrench`, and of `joint_force` with respect to q and v, in closed form. NULL: dual numbers
     * differentiate the effect's own code (derivative/dual_effect.c), at about ten times the cost. */
    void (*jacobian)(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                     kt_effect_jacobian *jacobian);
    void (*joint_derivatives)(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                              double derivative[2]);
    /* The partial derivatives of `wrench` and of `joint_force` by time, just after t. NULL: they do not depend on
     * it. */
    void (*time_derivative)(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                            kt_wrench *wrench);
    double (*joint_time_derivative)(const kt_effect_record *effect, const double *numbers, double q, double v,
                                    double t);
    /* For effects with formulas, in place of the two above. `values` are those of the effect's six formulas. */
    void (*formula_wrench)(const kt_effect_record *effect, const double values[6], const kt_effect_end *end,
                           kt_wrench *wrench, kt_effect_balance *balance);
    /* For effects that act on one side of a boundary only; NULL: all others. The axes of the first end are not set. If
     * the second end is on the ground, its velocities are not set, and z is its only axis that is set. For `joint_gap`,
     * q is the effect's coordinate. For a contact, q is the height of its centre, if the height is a sum of
     * coordinates. */
    kt_gap (*gap)(const kt_effect_record *effect, const kt_effect_end *end);
    kt_gap (*joint_gap)(const kt_effect_record *effect, double q, double v);
    /* The highest derivative of its functions of time that the force depends on; 0: their values alone. */
    int derivatives;
    bool stores_none; /* the effect has no potential energy: balance.energy is 0 in every state */
} kt_effect_kind;

/* a b' */
static inline kt_mat3 kt_outer_product(kt_vec3 a, kt_vec3 b) {
    return (kt_mat3){kt_vec3_scale(b.x, a), kt_vec3_scale(b.y, a), kt_vec3_scale(b.z, a)};
}

/* Members of kt_effect_kind that the code for derivatives and lanes does not have:
 * .jacobian = KT_IF_JACOBIAN(write_jacobian), .gap = KT_GAP(find_gap). */
#if defined(KT_DUAL) || defined(KT_LANES)
#define KT_IS_OF_VALUES 0
#define KT_IF_JACOBIAN(function) NULL
#define KT_GAP(function) NULL
#else
#define KT_IS_OF_VALUES 1
#define KT_IF_JACOBIAN(function) function
#define KT_GAP(function) function
#endif

#define KT_COORDINATE_WORDS "the joint or loop in which the effect acts; `NAME[k]`: in its coordinate k, from 0"

#define KT_EFFECT_AT(member) offsetof(kt_effect, member)

/* Whether a stop or a contact is hard. Stops and contacts are elastic, with a stiffness, or hard, with a restitution
 * (compile/one_sided.c). */
static inline bool kt_effect_is_hard(const kt_effect *effect) {
    return (effect->type == KT_EFFECT_JOINT_LIMIT || effect->type == KT_EFFECT_CONTACT) && !isinf(effect->restitution);
}
/* Checks whether the effect is hard or elastic, and rejects the numbers of the other kind. `what` is the name of the
 * effect in messages. */
void kt_effect_check_hard(kt_checker *checker, const kt_effect *effect, const char *what);
/* Whether the rim of a disc, not a sphere, makes the contact. */
static inline bool kt_effect_has_axle(const kt_effect *effect) {
    return effect->type == KT_EFFECT_CONTACT &&
           (effect->axle.x != 0.0 || effect->axle.y != 0.0 || effect->axle.z != 0.0);
}
/* The distance of the nearer one of a joint's stops. */
static inline double kt_stop_distance(const kt_effect_record *effect, double q) {
    const double below = effect->upper - q, above = q - effect->lower;
    return below < above ? below : above;
}
/* The vector from the centre of a contact's sphere or disc to the lowest point. The vector is -r n for a sphere, and -r
 * a x (n x a) / |n x a| for a disc with the axle a. For a disc that lies flat, the vector leads to any point of the
 * rim. */
static inline kt_vec3 kt_contact_lowest(const kt_effect_record *effect, kt_mat3 axes, kt_vec3 n) {
    if (effect->disc) {
        const kt_vec3 across = kt_vec3_cross(n, axes.z);
        const double s = kt_vec3_norm(across);
        return s > 0.0 ? kt_vec3_scale(-effect->radius / s, kt_vec3_cross(axes.z, across))
                       : kt_vec3_scale(-effect->radius, axes.x);
    }
    return kt_vec3_scale(-effect->radius, n);
}
/* Whether the effect is friction that sticks. Friction that sticks is a constraint (compile/one_sided.c). */
static inline bool kt_effect_sticks(const kt_effect *effect) {
    return effect->type == KT_EFFECT_JOINT_FRICTION && effect->stick;
}
/* Whether a part of the friction is proportional to a reaction (evaluate/load_friction.c). */
static inline bool kt_effect_has_load(const kt_effect *effect) {
    return effect->type == KT_EFFECT_JOINT_FRICTION && (effect->friction > 0.0 || effect->efficiency < 1.0);
}
void kt_effect_check_stick(kt_checker *checker, const kt_effect *effect);
/* Reports that an effect has neither of two numbers although one is required. */
void kt_effect_report_neither(kt_checker *checker, const char *first, const char *second);
/* Checks that lower is not above upper. */
void kt_effect_check_bounds(kt_checker *checker, const kt_effect *effect);

#define KT_ELASTIC_STIFFNESS .range = KT_RANGE_NOT_NEGATIVE
#define KT_ELASTIC_WORDS(words) words "; stiffness or restitution is needed"
#define KT_HARD_KEYS(words)                                                                                            \
    {"restitution", KT_KEY_NUMBER, KT_EFFECT_AT(restitution), "", words, "none", .range = KT_RANGE_NOT_NEGATIVE},      \
        {"rest_velocity",                                                                                              \
         KT_KEY_NUMBER,                                                                                                \
         KT_EFFECT_AT(rest_velocity),                                                                                  \
         "rad/s|m/s",                                                                                                  \
         "of a hard stop or contact: a slower arrival does not bounce",                                                \
         .range = KT_RANGE_NOT_NEGATIVE},                                                                              \
        KT_POISSON_KEY(KT_EFFECT_AT(poisson), "of a hard stop or contact: ")

/* The beginning of an example: a free cube, or an arm on a joint, on which an effect acts. */
#define KT_EXAMPLE_CUBE                                                                                                \
    "bodies:\n"                                                                                                        \
    "  - name: box\n"                                                                                                  \
    "    joint: {type: free}\n"                                                                                        \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: box, size: [0.2, 0.2, 0.2]}\n"                                                                  \
    "    markers: {corner: [0.1, 0.1, 0.1]}\n"                                                                         \
    "effects:\n"
#define KT_EXAMPLE_ARM                                                                                                 \
    "bodies:\n"                                                                                                        \
    "  - name: arm\n"                                                                                                  \
    "    joint: {type: revolute, axis: y, position: 20 deg}\n"                                                         \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: rod, to: [0, 0, -1]}\n"                                                                         \
    "effects:\n"

/* Properties of an effect whose type exists: the number of its ends (0: it acts in a joint). Whether a rotation of the
 * second end's frame brings its z axis along `axis`. The k-th of at most three functions of time, or KT_FUNCTION_NONE
 * if the effect has fewer. Whether its length is the distance of its ends at the start. The check of its members. */
KT_INNER int kt_effect_end_count(const kt_effect *effect);
bool kt_effect_aligns_second_end(const kt_effect *effect);
const kt_function *kt_effect_function(const kt_effect *effect, int k);
bool kt_effect_has_initial_length(const kt_effect *effect);
void kt_effect_check(kt_checker *checker, const kt_effect *effect);

static inline kt_energetics kt_energetics_of(bool dissipates) {
    return dissipates ? KT_ENERGY_DISSIPATED : KT_ENERGY_CONSERVED;
}

/* The energetics of an effect whose force is a function of time. Unless all functions are zero, the effect supplies
 * energy. (A constant force has a potential, but its work counts as supplied.) */
kt_energetics kt_effect_energetics_of_curves(const kt_effect_record *effect);
/* The energetics of an effect in which only the damper dissipates. */
static inline kt_energetics kt_effect_energetics_of_damper(const kt_effect_record *effect) {
    return kt_energetics_of(effect->damping > 0.0);
}

/* `value` at time t, in world axes. */
kt_triple KT_EFFECT(kt_effect_value)(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                                     kt_plain t);

/* kt_curve_evaluate at the time of each lane, which is mostly the same for all lanes. */
static inline void kt_effect_curve_evaluate(const kt_curve *curve, const double *numbers, kt_plain t, kt_plain out[3]) {
#ifdef KT_LANES
    double f[3] = {0.0, 0.0, 0.0};
    for (int lane = 0; lane < KT_LANES; lane++) {
        if (lane == 0 || t[lane] != t[lane - 1] || t[lane] == 0.0)
            kt_curve_evaluate(curve, numbers, t[lane], f);
        for (int k = 0; k < 3; k++)
            out[k][lane] = f[k];
    }
#else
    kt_curve_evaluate(curve, numbers, t, out);
#endif
}

/* The derivatives of a function of time just after t, at which a ramp or a table may begin or end: out[1], out[2]. The
 * second function returns the derivative of `value`, in world axes. */
static inline void kt_effect_curve_derivatives(const kt_curve *curve, const double *numbers, double t, double out[3]) {
    kt_curve_evaluate(curve, numbers, nextafter(t, (double)INFINITY), out);
}
kt_vec3 kt_effect_value_time_derivative(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                        double t);

/* The types in this build of the library; other types have no kind and no descriptor. In lanes: the types whose files
 * are compiled for lanes; other types are evaluated lane by lane (batch/single_effects.c). */
#ifdef KT_LANES
#define KT_EFFECT_KIND_LIST(X)                                                                                         \
    X(KT_EFFECT_SPRING, spring)                                                                                        \
    X(KT_EFFECT_JOINT_SPRING, joint_spring)                                                                            \
    X(KT_EFFECT_JOINT_DAMPER, joint_damper)                                                                            \
    X(KT_EFFECT_JOINT_FRICTION, joint_friction)                                                                        \
    X(KT_EFFECT_JOINT_LIMIT, joint_limit)                                                                              \
    X(KT_EFFECT_MOTOR, motor)                                                                                          \
    X(KT_EFFECT_SERVO, servo)                                                                                          \
    X(KT_EFFECT_FORCE, force)                                                                                          \
    X(KT_EFFECT_TORQUE, torque)                                                                                        \
    X(KT_EFFECT_DRAG, drag)                                                                                            \
    X(KT_EFFECT_ATTRACTION, attraction)                                                                                \
    X(KT_EFFECT_CONTACT, contact)
#else
#define KT_EFFECT_KIND_LIST(X) KT_EFFECT_LIST(X)
#endif

extern const kt_effect_kind *const KT_EFFECT(kt_effect_kinds)[KT_EFFECT_TYPE_COUNT];

#ifndef KT_LANES

/* A caller's own effect has callbacks in place of wrench and joint_force (effect_custom.c). */
extern const kt_effect_kind KT_EFFECT(kt_effect_custom);

static inline const kt_effect_kind *kt_effect_kind_of(int type) {
    return type == KT_EFFECT_CUSTOM ? &KT_EFFECT(kt_effect_custom) : KT_EFFECT(kt_effect_kinds)[type];
}

/* Whether an effect is a caller's own that gives no derivatives: these are found by differences. */
static inline bool kt_effect_is_differenced(const kt_effect_record *effect) {
    return effect->type == KT_EFFECT_CUSTOM &&
           (effect->wrench ? !effect->wrench_derivatives : !effect->joint_force_derivatives);
}

/* Whether the derivatives of an effect's law are found by differences. */
static inline bool kt_law_is_differenced(const kt_effect_record *effect) {
    return effect->law != NULL && !effect->law_derivatives;
}

/* Whether effects of this type have a gap. */
static inline bool kt_effect_has_gap(int type) {
    const kt_effect_kind *kind = kt_effect_kind_of(type);
    return kind->gap != NULL || kind->joint_gap != NULL;
}

#endif

#endif
