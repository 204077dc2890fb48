/* Directions in which forces, torques and thrusts are drawn. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/picture.h"

#include <math.h>

/* A value with the typical sign and size of a function. */
static double typical_value(const kt_function *f) {
    double value = 0.0;
    switch (f->type) {
    case KT_FUNCTION_SINE:
        return f->offset != 0.0 ? f->offset : f->amplitude;
    case KT_FUNCTION_RAMP:
        return f->to != 0.0 ? f->to : f->from;
    case KT_FUNCTION_POLYNOMIAL:
        for (int i = f->number_count - 1; i >= 0; i--)
            value = f->numbers[i] != 0.0 ? f->numbers[i] : value;
        return value;
    case KT_FUNCTION_TABLE:
        for (int i = 1; i < f->number_count; i += 2)
            value = fabs(f->numbers[i]) > fabs(value) ? f->numbers[i] : value;
        return value;
    case KT_FUNCTION_BUMP:
        return f->amplitude;
    case KT_FUNCTION_SUM:
    case KT_FUNCTION_PRODUCT:
        for (int i = f->part_count - 1; i >= 0; i--)
            value = typical_value(&f->parts[i]) != 0.0 ? typical_value(&f->parts[i]) : value;
        return value;
    case KT_FUNCTION_EXPRESSION: /* it has a direction; its sign and size require an evaluation */
        return 1.0;
    default:
        return f->value;
    }
}

/* Thrust is opposite to the exhaust velocity if mass leaves, and along it if mass arrives. */
static kt_vec3 thrust_direction(const kt_effect *effect) {
    double mass[3];
    const bool arrives = kt_function_evaluate(&effect->mass, 0.0, mass, NULL) == KT_OK && mass[1] > 0.0;
    return kt_vec3_scale(arrives ? 1.0 : -1.0, effect->exhaust);
}

kt_vec3 kt_load_direction(const kt_effect *effect) {
    const bool thrusts = effect->type == KT_EFFECT_THRUST;
    const kt_vec3 value = thrusts ? thrust_direction(effect)
                                  : kt_vec3_make(typical_value(&effect->value[0]), typical_value(&effect->value[1]),
                                                 typical_value(&effect->value[2]));
    const bool is_load = thrusts || effect->type == KT_EFFECT_FORCE || effect->type == KT_EFFECT_TORQUE;
    return is_load && kt_vec3_dot(value, value) > 0.0 ? kt_vec3_normalize(value) : kt_vec3_make(0.0, 0.0, 0.0);
}
