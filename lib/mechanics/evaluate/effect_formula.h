/* Values of the formulas of an effect (effect_formula.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_FORMULA_H
#define KT_MECHANISM_FORMULA_H

#include "effect/effect.h"

/* Reads the variables of an effect's formulas in a state. Markers are taken from `kinematics` or, if NULL, from the
 * links that carry forces. The array `end` holds the ends of an effect that acts between two. */
void kt_formula_variables_read(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                               const kt_effect_record *effect, const kt_dynamic_state *at, const kt_effect_end *end,
                               double values[KT_FORMULA_VARIABLE_MAX]);

/* Evaluates the formulas with these variables; 0 for a formula that is not given. Returns the code of a law's callback,
 * otherwise 0. */
int kt_formulas_evaluate(const kt_model *model, const kt_effect_record *effect, const double *values, double out[6]);

/* Names the operation that makes one of the formulas infinite or NaN, as text for a message: " (exp(8000) exceeds the
 * largest number)". The text is "" if there is none. */
void kt_formulas_explain(const kt_model *model, const kt_effect_record *effect, const double *values, char *text,
                         size_t size);

/* Evaluates the derivatives of a law that provides derivatives: by[j][k] is the derivative of number k (the force or a
 * rate) by variable j. Returns the code of its callback. */
int kt_law_differentiate(const kt_effect_record *effect, const double *values, double by[KT_FORMULA_VARIABLE_MAX][6]);

/* Evaluates the partial derivatives of the formulas by time; kt_formula_variables_read has read the variables. The
 * derivatives are undefined for a law without derivatives (kt_law_is_differenced). Returns the code of a law's
 * callback, otherwise 0. */
int kt_formula_time_derivatives(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                                const kt_effect_record *effect, const kt_dynamic_state *at, const kt_effect_end *end,
                                double rates[6]);

/* A formula of an effect; NULL: there is none. */
const kt_expression *kt_formula_of(const kt_model *model, const kt_effect_record *effect, int k);

#endif
