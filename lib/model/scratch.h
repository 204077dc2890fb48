/* data->scratch_v in parts, each with room for nv numbers from a whole vector of lanes on. Calls under way at the same
 * time take different ones:
 *
 *   0, 1   what inverse dynamics gives with and without something (effects.c, power.c); the neighbouring state's
 *          acceleration, and the jump between the sides (singular_crossing.c); the direction and the step of an assembly (assemble.c)
 *   2      a motion tried by an assembly; the acceleration of a call that computes something else from it (power.c, reaction.c); before that is
 *          written, an interpolated one (singular_crossing.c)
 *   3      the interpolation from the inner four states
 *   4      the acceleration of the state closed to rounding
 *
 * The recursion of composite bodies takes the whole as six rows of nv numbers (dynamics/crba.c).
 */
#ifndef KT_MODEL_SCRATCH_H
#define KT_MODEL_SCRATCH_H

#include "model/model.h"

static inline double *kt_scratch_part(const kt_model *model, const kt_data *data, size_t part) {
    return data->scratch_v + part * kt_lanes8(model->n.v);
}

#endif
