/* Values of columns that records of a simulation do not have: gravity in joints, the distance of a position from a
 * singular one, the wrench that a joint transmits by its structure alone, and the quantities of all effects, with the
 * forces of hard contacts, hard stops and friction that sticks. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_GRAVITY_H
#define KT_COMMAND_RECORDS_GRAVITY_H

#include "kinetree/description.h"
#include "kinetree/dynamics.h"
#include "kinetree/simulation.h"

#include <stdbool.h>

/* Gravity in joints: the joint forces that balance it, as formulas read them (gravity.JOINT). */
typedef struct kt_gravity kt_gravity;

/* Allocates the memory for a model and its sets. Returns NULL if memory is insufficient. */
kt_gravity *kt_gravity_create(const kt_model *model);
void kt_gravity_free(kt_gravity *gravity);

/* Returns the joint forces (nv) at (t, q), valid until the next call; NaN if the position is not finite. */
const double *kt_gravity_evaluate(kt_gravity *gravity, const kt_model *model, double t, const double *q);

/* The smallest singular value of the constraint Jacobian. */
typedef struct kt_singular kt_singular;

/* Allocates the memory for singular values of a model and its sets. Returns NULL if memory is insufficient. */
kt_singular *kt_singular_create(const kt_model *model);
void kt_singular_free(kt_singular *singular);

/* Returns the r-th largest singular value of A (kt_loop_equations) at (t, q, v). Here r is the rank of A at generic
 * positions. The value is 0 at a singular position. Infinite if r is 0; NaN if the state is not finite. */
double kt_singular_evaluate(kt_singular *singular, const kt_model *model, double t, const double *q, const double *v);

/* Returns the part of a wrench in the joint of a body that is orthogonal to the free motions of the joint. Effects in
 * the joint and drives exert the rest: the moment about the free axes and the force along the free directions. For a
 * screw, the rest is a moment about its axis with the power of moment and force together. The data must be at the
 * positions of the wrench. jacobian: room for 6 nv numbers. Cost: O(nv). */
kt_wrench kt_bearing_of(const kt_model *model, const kt_data *data, int body, kt_wrench reaction, double *jacobian);

/* Returns whether the force of any effect is the reaction of a loop: of a hard contact, a hard stop, or sticking
 * friction. */
bool kt_quantities_need_reactions(const kt_description *description);

/* Writes the quantities of all effects, effect by effect (kt_effect_quantities_evaluate). The description is that of
 * the record's model. If kt_quantities_need_reactions, the record must have reactions. A quantity that cannot be
 * computed is NaN. If the state is not finite, all quantities are NaN; the last state of a failed run may be one. The
 * components of the force are NaN for a contact whose slip has just begun. */
void kt_quantities_evaluate(const kt_description *description, const kt_record *record, double *values);

#endif
