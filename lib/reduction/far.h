/* Closing loops from far off. */
#ifndef KT_REDUCTION_FAR_H
#define KT_REDUCTION_FAR_H

#include "reduction/project.h"

/* Moves q until the loops close, held coordinates (NULL: none) not at all, or until nothing helps any more; returns the
 * largest residual. For set-up and assembly: not bounded in time as the projection of a step is, but to a fixed number
 * of evaluations. */
double kt_close_from_far(const kt_model *model, kt_data *data, double t, const bool *held, double *q);

#endif
