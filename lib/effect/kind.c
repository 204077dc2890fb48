/* The list of effect types, and what they share. */
#include "effect/effect.h"

#define KT_EFFECT_EXTERN(id, name) extern const kt_effect_kind KT_EFFECT(kt_effect_##name);
KT_EFFECT_LIST(KT_EFFECT_EXTERN)
#undef KT_EFFECT_EXTERN

#define KT_EFFECT_ENTRY(id, name) [id] = &KT_EFFECT(kt_effect_##name),
const kt_effect_kind *const KT_EFFECT(kt_effect_kinds)[KT_EFFECT_TYPE_COUNT] = {KT_EFFECT_LIST(KT_EFFECT_ENTRY)};
#undef KT_EFFECT_ENTRY

kt_triple KT_EFFECT(kt_effect_value)(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                                     double t) {
    double x[3], y[3], z[3];
    kt_curve_evaluate(&effect->curve[0], numbers, t, x);
    kt_curve_evaluate(&effect->curve[1], numbers, t, y);
    kt_curve_evaluate(&effect->curve[2], numbers, t, z);
    const kt_triple value = {x[0], y[0], z[0]};
    return effect->in_body ? kt_columns_apply(end->axes, value) : value;
}
