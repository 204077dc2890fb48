/* The parameters of models that keys of effects and loops are (kinetree/model.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_PARAMETER_KEY_H
#define KT_MODEL_PARAMETER_KEY_H

#include "kinetree/descriptor.h"
#include "kinetree/model.h"

/* Sets the kind, the key and the count of the parameter that a key is. Returns false if it is none. Some numbers of
 * hard stops and contacts are in their loops, and are none. */
static inline bool kt_parameter_classify(const kt_key *key, bool of_loop, kt_parameter *parameter) {
    const bool is_of_hard =
        (key->offset == offsetof(kt_effect, restitution) || key->offset == offsetof(kt_effect, rest_velocity) ||
         key->offset == offsetof(kt_effect, radius2));
    parameter->key = key;
    parameter->count = 1;
    parameter->kind = KT_PARAMETER_EFFECT;
    switch (key->kind) {
    case KT_KEY_NUMBER:
    case KT_KEY_DISTANCE:
        return !of_loop && !is_of_hard;
    case KT_KEY_SIX:
        parameter->count = 6;
        return !of_loop;
    case KT_KEY_FUNCTION:
        parameter->count = 4;
        parameter->kind = of_loop ? KT_PARAMETER_LOOP_CURVE : KT_PARAMETER_EFFECT_CURVE;
        return true;
    case KT_KEY_FUNCTIONS:
        parameter->count = 3;
        parameter->kind = KT_PARAMETER_EFFECT_VALUE;
        return !of_loop;
    default:
        return false;
    }
}

#endif
