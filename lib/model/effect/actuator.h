/* Forces by the numbers of actuators or of a polynomial spring, and activations, as formulas. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EFFECT_ACTUATOR_H
#define KT_EFFECT_ACTUATOR_H

#include "expression/formula_text.h"
#include "kinetree/effect.h"
#include "model/check.h"
#include "model/formula_names.h"

/* Whether an effect has the numbers of actuators or of a spring in place of formulas. These numbers are written as
 * formulas. The variables of these formulas have short names, because a name of the user may be as long as a formula:
 *     p, v          position and velocity of the effect's joint
 *     w2            the activation of actuator 2; the first actuator has the number 0
 *     p2_1, v2_1    position and velocity of the joint of term 1 of actuator 2 */
static inline bool kt_effect_has_numbers(const kt_effect *effect) {
    return effect->type == KT_EFFECT_EXPRESSION && (effect->actuators != NULL || effect->spring != NULL);
}

/* Returns the names for the formulas of an effect, which may be those of its numbers. */
kt_formula_names kt_effect_names_of(const kt_description *description, const kt_effect *effect);

/* Returns formula k of an expression: its text, or that of its numbers, written to `to`. NULL: that component is
 * zero. */
const char *kt_effect_formula(const kt_effect *effect, int k, kt_formula_text *to);

/* Writes the rate of an activation, the state of name w. */
void kt_activation_rate(const kt_activation *activation, const char *w, kt_formula_text *to);

/* Whether the formulas of the numbers of an effect have room. */
KT_INNER bool kt_effect_numbers_fit(const kt_effect *effect);

/* Whether the bounds of the sum of the tendon or path of an actuator, if there are any, can act. */
bool kt_actuator_sum_is_possible(const kt_effect *effect, int index);

/* Checks the numbers of an effect that has any, and those of an activation. */
void kt_checker_numbers(kt_checker *checker, const kt_effect *effect);
void kt_checker_activation(kt_checker *checker, const kt_auxiliary_state *state);

/* A number between bounds. */
static inline double kt_clamp(double x, double lower, double upper) { return fmin(fmax(x, lower), upper); }

/* Whether an activation, or a control with a delay, is a variable of the force. */
static inline bool kt_actuator_is_driven(const kt_actuator *a) { return a->activation != NULL || a->delay > 0.0; }

/* ---- muscle.c ---------------------------------------------------------------------------------------------------- */

/* A muscle by its scaled length offset + slope g L and rate `rate` g L'. */
typedef struct kt_muscle_scale {
    double offset, slope, rate;
} kt_muscle_scale;
kt_muscle_scale kt_muscle_scale_of(const kt_muscle *muscle);

/* Write the force per activation, and the passive force. Both forces are negative, since a muscle pulls. length, rate:
 * texts of the scaled quantities. */
void kt_formula_put_active(const kt_muscle *muscle, const char *length, const char *rate, kt_formula_text *to);
void kt_formula_put_passive(const kt_muscle *muscle, const char *length, kt_formula_text *to);

/* Writes w', the rate of a muscle's activation w. */
void kt_formula_put_muscle_rate(const kt_activation *activation, double control, const char *w, kt_formula_text *to);

/* "2", or "2*step(t - 0.1)" of a value that is zero before a delay. */
void kt_formula_put_delayed(kt_formula_text *to, double value, double delay);

#endif
