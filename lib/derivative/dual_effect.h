/* Derivatives of effects by dual numbers (dual_effect.c). */
#ifndef KT_DERIVATIVE_DUAL_EFFECT_H
#define KT_DERIVATIVE_DUAL_EFFECT_H

#include "effect/effect.h"

/* The derivatives of an effect's wrench on its last end; of a joint force with respect to q and v. */
void kt_dual_effect_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                             kt_effect_jacobian *jacobian);
void kt_dual_joint_derivatives(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                               double derivative[2]);

#endif
