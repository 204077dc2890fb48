/* Loops whose equations repeat each other except for the rounding of the data. */
#ifndef KT_COMPILE_ROUNDED_H
#define KT_COMPILE_ROUNDED_H

#include "model/model.h"

/* Moves the ends of the loops of a group that leaves one degree of freedom, along the motion that leads through a
 * position near q. The moves are the least ones with which the equations repeat each other to the last digit. Stores by
 * how much they disagree. *found: whether there are such moves below the model's tolerance; if not, all ends are where
 * they are `given`, two a loop.
 * Errors: KT_ERROR_MEMORY.
 * Cost: O((coordinates + equations + corrections)^3) a position. */
kt_status kt_group_repair(kt_model *model, kt_data *data, size_t g, const double *q, const kt_pose *given, bool *found);

/* Puts the ends of all loops to given places, two a loop. */
void kt_loops_place_ends(kt_model *model, const kt_pose *ends);

/* Stores the gaps of the loops of a group, as last filled, if they are larger than the stored ones. Returns the largest
 * gap, relative to the scales. */
double kt_group_note_disagreement(kt_model *model, const kt_data *data, size_t g);

#endif
