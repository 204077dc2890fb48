/* Gravity forces in joints, which formulas read, and their derivatives by positions (gravity_force.c). The terms of the
 * tree are those of inverse dynamics, in which no joint is projected out. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_GRAVITY_FORCE_H
#define KT_DERIVATIVE_GRAVITY_FORCE_H

#include "dynamics/dynamics_derivative.h"

/* Returns the degree of freedom of a variable of type KT_VARIABLE_GRAVITY, in the order of the links. */
int32_t kt_gravity_dof_of(const kt_model *model, const kt_derivative_work *w, const kt_variable_record *variable);

/* Returns its value, in N m or N. */
double kt_gravity_force_of(const kt_model *model, const kt_derivative_work *w, const kt_variable_record *variable);

/* Returns the derivative of a gravity force by the position of degree of freedom k. This k carries the degree of
 * freedom of the force, belongs to its node, or is carried by it. */
double kt_gravity_force_by(const kt_model *model, const kt_derivative_work *w, const kt_variable_record *variable,
                           int32_t k);

#endif
