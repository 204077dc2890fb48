/* Effects of types that are not compiled for lanes: one state at a time. */
#include "batch/lanes.h"

#include "effect/effect.h"
#include "mechanism/formula.h"

#include <string.h>

bool kt_effect_alone_formula(const kt_model *model, const kt_effect_record *effect, const double *variables,
                             double *value) {
    double values[6] = {0.0};
    const int code = KT_HAS_FORMULAS ? kt_formulas_evaluate(model, effect, variables, values) : 0;
    *value = values[0];
    return code == 0;
}

bool kt_effect_alone_formula_wrench(const kt_model *model, const kt_effect_record *effect, const double *variables,
                                    const kt_effect_end *end, kt_wrench wrench[2]) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    double values[6] = {0.0};
    memset(wrench, 0, 2 * sizeof *wrench);
    const int code = KT_HAS_FORMULAS ? kt_formulas_evaluate(model, effect, variables, values) : 0;
    if (KT_HAS_FORMULAS)
        kind->formula_wrench(effect, values, end, wrench, NULL);
    return code == 0;
}

bool kt_effect_alone_wrench(const kt_model *model, const kt_effect_record *effect, const kt_effect_end *end, double t,
                            kt_wrench wrench[2]) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    if (kind->wrench) {
        kind->wrench(effect, model->number, end, t, wrench, NULL);
        return true;
    }
    memset(wrench, 0, 2 * sizeof *wrench);
    return effect->wrench(effect->user, t, end, wrench, NULL) == 0;
}

bool kt_effect_alone_force(const kt_model *model, const kt_effect_record *effect, double q, double v, double t,
                           double *force) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    *force = 0.0;
    if (kind->joint_force) {
        *force = kind->joint_force(effect, model->number, q, v, t, NULL);
        return true;
    }
    return effect->joint_force(effect->user, t, q, v, force, NULL) == 0;
}
