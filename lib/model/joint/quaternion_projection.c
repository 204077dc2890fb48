/* The projection of quaternions onto unit length: p / |p|. Steps of an integrator add to the four numbers of a
 * quaternion as to any others, so that its length is off by the error of the step. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"
#include "joint/turn.h"
#include "kinetree/joint.h"

#include <math.h>
#include <string.h>

bool kt_position_normalize(const kt_model *model, double *q) {
    if (!model || (!q && model->n.q > 0))
        return false;
    for (int pass = 0; pass < 2; pass++) /* the first pass checks, so that a failure changes nothing */
        for (size_t i = 1; i < model->n.link; i++) {
            const kt_motion_facts motion = kt_motion_facts_of(model->link[i].motion);
            if (!motion.quaternions)
                continue;
            double *p = q + model->link[i].q + motion.plain;
            const kt_quat unit = kt_quat_normalize(kt_joint_load_quaternion(p));
            if (!isfinite(unit.w + unit.x + unit.y + unit.z))
                return false;
            const double projected[4] = {unit.w, unit.x, unit.y, unit.z};
            if (pass)
                memcpy(p, projected, sizeof projected);
        }
    return true;
}

/* The error of a step leaves norms off. */
bool kt_position_make_units(const kt_model *model, double *q) {
    return kt_turns_make_units(model, q, false) || kt_position_normalize(model, q);
}
