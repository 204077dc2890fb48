/* data->scratch_v in parts, each with room for nv numbers from a whole vector of lanes on. Calls that are under way at
 * the same time use different parts:
 *
 *   0, 1   The results of inverse dynamics with and without some part (effects.c, power.c).
 *          The neighbouring state's acceleration, and the jump between the sides (singular_crossing.c).
 *          The direction and the step of an assembly (assemble.c).
 *   2      A motion tried by an assembly. The acceleration of a call that computes another quantity from it (power.c,
 *          reaction.c); until that is written, an interpolated acceleration (singular_crossing.c).
 *   3      The interpolation from the inner four states. The weights of an assembly (assemble.c).
 *   4      The acceleration of the state closed to rounding. Changes that do not count in an assembly (assemble.c).
 *
 * The recursion of composite bodies takes the whole as six rows of nv numbers (dynamics/crba.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_SCRATCH_H
#define KT_MODEL_SCRATCH_H

#include "model/model.h"

static inline double *kt_scratch_part(const kt_model *model, const kt_data *data, size_t part) {
    return data->scratch_v + part * kt_lanes8(model->n.v);
}

#endif
