/* What a joint transmits by its structure alone. */
#ifndef KT_COMMAND_RECORDS_BEARING_H
#define KT_COMMAND_RECORDS_BEARING_H

#include "kinetree/dynamics.h"

/* The part of a wrench in the joint of a body that is orthogonal to all that the joint leaves free: without the moment
 * about its free axes and the force along its free directions, which effects in the joint and drives exert. Of a screw
 * the moment about its axis that has the power of moment and force together is left out. data: at the positions of the
 * wrench; jacobian: room for 6 nv numbers. O(nv). */
kt_wrench kt_bearing_of(const kt_model *model, const kt_data *data, int body, kt_wrench reaction, double *jacobian);

#endif
