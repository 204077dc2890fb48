/* Quaternions after a step, whose error leaves their norm off. */
#include "joint/joint.h"
#include "kinetree/joint.h"

#include <float.h>

bool kt_position_make_units(const kt_model *model, double *q) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_motion_facts motion = kt_motion_facts_of(model->link[i].motion);
        const double *p = q + model->link[i].q + motion.plain;
        if (motion.quaternions &&
            !(fabs(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3] - 1.0) <= 4.0 * DBL_EPSILON))
            return kt_position_normalize(model, q);
    }
    return true;
}
