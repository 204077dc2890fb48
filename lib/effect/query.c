/* What is asked of effect types, and of the effects of a model together. */
#include "effect/effect.h"

int kt_effect_end_count(const kt_effect *effect) {
    if (effect->type == KT_EFFECT_CUSTOM)
        return effect->push ? effect->end_count : 0;
    return kt_effect_kinds[effect->type]->ends;
}

bool kt_effect_aligns_second_end(const kt_effect *effect) { return kt_effect_kind_of((int)effect->type)->turned; }

const kt_function *kt_effect_function(const kt_effect *effect, int k) {
    static const kt_function none = {.type = KT_FUNCTION_NONE};
    const int functions = kt_effect_kind_of((int)effect->type)->functions;
    if (functions == 3)
        return &effect->value[k];
    return k < functions ? &effect->torque : &none;
}

kt_energetics kt_model_energetics(const kt_model *model) {
    kt_energetics worst = model->driven ? KT_ENERGY_SUPPLIED : KT_ENERGY_CONSERVED;
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_energetics one = kt_effect_kind_of(effect->type)->energetics(effect);
        worst = one > worst ? one : worst;
    }
    return worst;
}

void kt_effect_check(kt_checker *checker, const kt_effect *effect) {
    kt_effect_kind_of((int)effect->type)->check(checker, effect);
}

kt_energetics kt_effect_energetics_of_curves(const kt_effect_record *effect) {
    for (int k = 0; k < kt_effect_kind_of(effect->type)->functions; k++) {
        const kt_curve *curve = &effect->curve[k];
        const bool rests = curve->type == KT_FUNCTION_NONE || curve->type == KT_FUNCTION_CONSTANT;
        if (!rests || curve->a != 0.0)
            return KT_ENERGY_SUPPLIED;
    }
    return KT_ENERGY_CONSERVED;
}

void kt_effect_check_value(kt_checker *checker, const kt_effect *effect) {
    for (int k = 0; k < 3; k++) {
        if (effect->value[k].type == KT_FUNCTION_NONE)
            kt_checker_fault(checker, "value", -1, "value has a component missing; give three numbers or functions");
        else
            kt_checker_function(checker, "value", &effect->value[k]);
    }
    if (effect->frame != KT_FRAME_WORLD && effect->frame != KT_FRAME_BODY)
        kt_checker_fault(checker, "frame", -1, "frame is %d; take KT_FRAME_WORLD or KT_FRAME_BODY", (int)effect->frame);
}
