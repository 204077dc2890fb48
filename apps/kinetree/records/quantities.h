/* The quantities of all effects in a record, with the forces of hard contacts, hard stops and friction that sticks. */
#ifndef KT_COMMAND_RECORDS_QUANTITIES_H
#define KT_COMMAND_RECORDS_QUANTITIES_H

#include "kinetree/description.h"
#include "kinetree/simulation.h"

#include <stdbool.h>

/* Returns whether the force of any effect is the reaction of a loop: of a hard contact, a hard stop, or sticking
 * friction. */
bool kt_quantities_need_reactions(const kt_description *description);

/* Writes the quantities of all effects, effect by effect (kt_effect_quantities_evaluate). The description is that of
 * the record's model. If kt_quantities_need_reactions, the record must have reactions. A quantity that cannot be
 * computed is NaN. If the state is not finite, all quantities are NaN; the last state of a failed run may be one. The
 * components of the force are NaN for a contact whose slip has just begun. */
void kt_quantities_evaluate(const kt_description *description, const kt_record *record, double *values);

#endif
