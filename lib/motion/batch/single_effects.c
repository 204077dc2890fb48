/* Effects of types that are not compiled for lanes: one state at a time. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "effect/effect.h"
#include "evaluate/effect_formula.h"

#include <string.h>

bool kt_effect_alone_wrench(const kt_model *model, const kt_effect_record *effect, const double *variables,
                            const kt_effect_end *end, double t, kt_wrench wrench[2]) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    memset(wrench, 0, 2 * sizeof *wrench);
    if (variables) {
        double values[6] = {0.0};
        const int code = kt_formulas_evaluate(model, effect, variables, values);
        kind->formula_wrench(effect, values, end, wrench, NULL);
        return code == 0;
    }
    if (!kind->wrench)
        return effect->wrench(effect->user, t, end, wrench, NULL) == 0;
    kind->wrench(effect, model->number, end, t, wrench, NULL);
    return true;
}

/* The force of an effect in a joint: the value of its formula, of the caller's callback, or of its kind. */
bool kt_effect_alone_force(const kt_model *model, const kt_effect_record *effect, const double *variables, double q,
                           double v, double t, double *force) {
    double values[6] = {0.0};
    if (variables) {
        const int code = kt_formulas_evaluate(model, effect, variables, values);
        *force = values[0];
        return code == 0;
    }
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    *force = 0.0;
    if (!kind->joint_force)
        return effect->joint_force(effect->user, t, q, v, force, NULL) == 0;
    *force = kind->joint_force(effect, model->number, q, v, t, NULL);
    return true;
}
