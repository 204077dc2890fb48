/* Loops whose equations repeat each other but for the rounding of the data. */
#ifndef KT_COMPILE_ROUNDED_H
#define KT_COMPILE_ROUNDED_H

#include "model/model.h"

/* Moves the ends of the loops of a group that leaves one degree of freedom by the least amounts with which their
 * equations repeat each other to the last digit, along the motion that leads through a position near q. Stores by
 * how much they disagree. *found: whether there are such amounts below the model's tolerance; if not, all ends are
 * where they were. Returns KT_OK or KT_ERROR_MEMORY. O((coordinates + equations + corrections)^3) a position. */
kt_status kt_group_unround(kt_model *model, kt_data *data, size_t g, const double *q, bool *found);

/* Puts the ends of all loops to given places, two a loop. */
void kt_loops_place_ends(kt_model *model, const kt_pose *ends);

/* Stores by how much the loops of a group, as last filled, are open, where that is more than was known; returns the
 * largest of these, relative to the scales. */
double kt_group_note_disagreement(kt_model *model, const kt_data *data, size_t g);

#endif
