/* What an effect type tells those who sum the effects of a scene: a wrench at each of its ends, or the force of a
 * joint.
 *
 * An effect is a pure function of its record, the motion of its ends or joint, and the time. It says where its power
 * comes from: with P the power of all it exerts,
 *     P = supplied - dissipated - dV/dt,   V its potential energy.
 */
#ifndef KT_EFFECT_EFFECT_H
#define KT_EFFECT_EFFECT_H

#include "effect/triple.h"
#include "kinetree/effect.h"
#include "model/check.h"
#include "model/model.h"

#include <math.h>

/* What an effect reads and writes: of values, what a caller's own has, too; and that with its change. */
#ifdef KT_DUAL
#define KT_EFFECT(name) name##_dual
typedef struct kt_effect_frame {
    kt_columns axes;
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

/* One file a type, compiled for values and once more for derivatives: const kt_effect_kind
 * KT_EFFECT(kt_effect_spring). The model's compiler reads the rest of it: a new type is its
 * file and its line in KT_EFFECT_LIST; where it has numbers of its own, these stand in kt_effect and KT_EFFECT_NUMBERS,
 * and their keys in the table of lib/scene/effect.c. */
typedef struct kt_effect_kind {
    int ends;      /* frames that it acts on: 1 or 2; 0: a scalar joint */
    int functions; /* of time: 3: `value`; 1: `torque`; 0: none */
    bool turned;   /* the second end's frame is turned: z along `axis` */
    /* Reports what is wrong with the members that it reads. */
    void (*check)(kt_checker *checker, const kt_effect *effect);
    /* What it can do to the energy of a mechanism, with the numbers that it has. */
    kt_energetics (*energetics)(const kt_effect_record *effect);
    /* Effects with ends: wrench[k] receives what end k feels, moment about its point, world axes. balance may be NULL.
     * The points of both ends are counted from some point near to one of them that rests in the world: where they are
     * far from the world's origin, nothing is lost by that. */
    void (*push)(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, double t,
                 kt_effect_wrench *wrench, kt_effect_power *balance);
    /* Effects on a joint with position q and velocity v: the joint's force (N m, or N where it slides). */
    kt_real (*drive)(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, double t,
                     kt_effect_power *balance);
} kt_effect_kind;

/* Of an effect whose type exists: the frames that it acts on (0: a joint); whether the second is turned to its axis; its
 * k-th function of time of at most three, KT_FUNCTION_NONE where there is none; and the rules of its type. */
int kt_effect_end_count(const kt_effect *effect);
bool kt_effect_aligns_second_end(const kt_effect *effect);
const kt_function *kt_effect_function(const kt_effect *effect, int k);
void kt_effect_check(kt_checker *checker, const kt_effect *effect);

static inline kt_energetics kt_energetics_of(bool dissipates) {
    return dissipates ? KT_ENERGY_DISSIPATED : KT_ENERGY_CONSERVED;
}

/* Of an effect that acts as its functions of time say: supplied, unless they all are zero. (A constant force has a
 * potential, but it counts as supplied.) */
kt_energetics kt_effect_energetics_of_curves(const kt_effect_record *effect);

/* `value` at time t, in world axes; and its check, with that of `frame`. */
kt_triple KT_EFFECT(kt_effect_value)(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                                     double t);
void kt_effect_check_value(kt_checker *checker, const kt_effect *effect);

extern const kt_effect_kind *const KT_EFFECT(kt_effect_kinds)[KT_EFFECT_TYPE_COUNT];

/* A caller's own has callbacks in place of push and drive (custom.c). */
extern const kt_effect_kind KT_EFFECT(kt_effect_custom);

static inline const kt_effect_kind *kt_effect_kind_of(int type) {
    return type == KT_EFFECT_CUSTOM ? &KT_EFFECT(kt_effect_custom) : KT_EFFECT(kt_effect_kinds)[type];
}

#endif
