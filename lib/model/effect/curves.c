/* Functions shared by effects that are given by functions of time: the value of their vector, and their effect on the
 * energy. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

kt_triple KT_EFFECT(kt_effect_value)(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                                     kt_plain t) {
    kt_plain x[3], y[3], z[3];
    kt_effect_curve_evaluate(&effect->curve[0], numbers, t, x);
    kt_effect_curve_evaluate(&effect->curve[1], numbers, t, y);
    kt_effect_curve_evaluate(&effect->curve[2], numbers, t, z);
    const kt_triple value = kt_triple_constant(x[0], y[0], z[0]);
    return effect->in_body ? kt_columns_apply(end->axes, value) : value;
}

#if KT_IS_OF_VALUES
kt_vec3 kt_effect_value_time_derivative(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                        double t) {
    double x[3], y[3], z[3];
    kt_effect_curve_derivatives(&effect->curve[0], numbers, t, x);
    kt_effect_curve_derivatives(&effect->curve[1], numbers, t, y);
    kt_effect_curve_derivatives(&effect->curve[2], numbers, t, z);
    const kt_vec3 rate = {x[1], y[1], z[1]};
    return effect->in_body ? kt_mat3_apply(end->axes, rate) : rate;
}
#endif

#if KT_DESCRIBES
kt_energetics kt_effect_energetics_of_curves(const kt_effect_record *effect) {
    for (int k = 0; k < 3; k++) { /* those that it does not have are KT_FUNCTION_NONE */
        const kt_curve *curve = &effect->curve[k];
        if (!kt_curve_rests(curve) || curve->a != 0.0)
            return KT_ENERGY_SUPPLIED;
    }
    return KT_ENERGY_CONSERVED;
}
#endif
