/* Projection of several states at once (algebra/real3.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_LANE_PROJECT_H
#define KT_CLOSURE_LANE_PROJECT_H

#include "reduction/lane_groups.h"

#ifdef KT_LANES
/* Projects q, then v, in place, as kt_state_project does, for the states of the mask `states` at the times t.
 * Returns the states for which the usual course was enough. The numbers of the other states are undefined. */
kt_condition KT_KERNEL(kt_project)(const kt_model *model, kt_data *data, kt_condition states, kt_real1 t, kt_real1 *q,
                                   kt_real1 *v);
#endif

#endif
