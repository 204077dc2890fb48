/* Effects in relative coordinates of loops (relative_force.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_RELATIVE_H
#define KT_MECHANISM_RELATIVE_H

#include "effect/effect.h"

typedef struct kt_relative_motion {
    double position, rate;
    double counted[2];     /* the sums over the links that count turns (kt_relative_turns) */
    kt_vec3 moment, force; /* moment and force of a unit force: on the second end, about its point */
} kt_relative_motion;

/* The coordinate in which an effect acts, of its ends in a state. */
kt_relative_motion kt_relative_motion_of(const kt_model *model, const kt_effect_record *effect, const double *q,
                                         const kt_effect_end end[2]);

/* The wrenches that a force along the relative coordinate exerts on both ends, each about the point of the end. */
void kt_relative_wrenches(const kt_relative_motion *motion, const kt_effect_end end[2], double force,
                          kt_wrench wrench[2]);

#endif
