/* Dead points: positions at which a mechanism cannot move as its drives prescribe (derived in dead_point.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_DEAD_POINT_H
#define KT_CLOSURE_DEAD_POINT_H

#include "assembly/project.h"

/* A state is a dead point under two conditions. A direction of a group is smaller than the fraction KT_DEAD of its
 * usual size. The other directions miss more than the fraction KT_DEAD_FRACTION of the drives' rates. To follow these
 * rates, the motion would have to be 1000 times as fast as usual, KT_DEAD_FRACTION / KT_DEAD. */
#define KT_DEAD 1e-4
#define KT_DEAD_FRACTION 0.1

/* Whether the state of a driven model, near a singular position, is a dead point. A projection must have factored the
 * equations. At a dead point `right` then holds the prescribed rates that the mechanism cannot follow, and zeros in
 * other groups. */
bool kt_is_dead_point(const kt_model *model, kt_data *data);

#endif
