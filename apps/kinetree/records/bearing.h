/* The wrench that a joint transmits by its structure alone. */
#ifndef KT_COMMAND_RECORDS_BEARING_H
#define KT_COMMAND_RECORDS_BEARING_H

#include "kinetree/dynamics.h"

/* Returns the part of a wrench in the joint of a body that is orthogonal to the free motions of the joint. Effects in
 * the joint and drives exert the rest: the moment about the free axes and the force along the free directions. For a
 * screw, the rest is a moment about its axis with the power of moment and force together. The data must be at the
 * positions of the wrench. jacobian: room for 6 nv numbers. Cost: O(nv). */
kt_wrench kt_bearing_of(const kt_model *model, const kt_data *data, int body, kt_wrench reaction, double *jacobian);

#endif
