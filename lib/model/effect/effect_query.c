/* Queries that the descriptors of effect types answer, and the energetics of all effects of a model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "model/switching.h"

#define KT_EFFECT_EXTERN(id, name) extern const kt_descriptor kt_effect_##name##_descriptor;
KT_EFFECT_KIND_LIST(KT_EFFECT_EXTERN)
#undef KT_EFFECT_EXTERN

const kt_descriptor *kt_effect_descriptor(kt_effect_type type) {
#define KT_EFFECT_ENTRY(id, name) [id] = &kt_effect_##name##_descriptor,
    static const kt_descriptor *const descriptors[KT_EFFECT_TYPE_COUNT] = {KT_EFFECT_KIND_LIST(KT_EFFECT_ENTRY)};
#undef KT_EFFECT_ENTRY
    return (unsigned)type < KT_EFFECT_TYPE_COUNT ? descriptors[type] : NULL;
}

int kt_effect_end_count(const kt_effect *effect) {
    if (effect->type == KT_EFFECT_CUSTOM)
        return effect->wrench ? effect->end_count : 0;
    if (effect->type == KT_EFFECT_EXPRESSION)
        return effect->end_count;
    return kt_descriptor_end_count(kt_effect_descriptor(effect->type));
}

bool kt_effect_aligns_second_end(const kt_effect *effect) {
    return kt_descriptor_reads(kt_effect_descriptor(effect->type), KT_EFFECT_AT(axis));
}

const kt_function *kt_effect_function(const kt_effect *effect, int k) {
    static const kt_function none = {.type = KT_FUNCTION_NONE};
    const kt_descriptor *descriptor = kt_effect_descriptor(effect->type);
    if (kt_descriptor_reads(descriptor, KT_EFFECT_AT(value)))
        return &effect->value[k];
    const kt_key *key = k == 0 ? kt_descriptor_kind(descriptor, KT_KEY_FUNCTION) : NULL;
    return key != NULL ? (const kt_function *)((const char *)effect + key->offset) : &none;
}

bool kt_effect_has_initial_length(const kt_effect *effect) {
    return effect->initial_length && kt_descriptor_reads(kt_effect_descriptor(effect->type), KT_EFFECT_AT(length));
}

/* Whether an effect is friction that sticks. */
static bool is_stick(const kt_model *model, int source) {
    for (size_t i = 0; i < model->n.effect + model->n.effect_off; i++)
        if (model->effect[i].source == source)
            return model->effect[i].direction != 0.0;
    return false;
}

kt_energetics kt_model_energetics(const kt_model *model) {
    if (!model)
        return KT_ENERGY_CONSERVED;
    const bool supplied = model->driven || (model->n.varying > 0);
    kt_energetics worst = supplied ? KT_ENERGY_SUPPLIED : KT_ENERGY_CONSERVED;
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
        const kt_energetics one = kind->energetics != NULL ? kind->energetics(effect) : KT_ENERGY_SUPPLIED;
        worst = one > worst ? one : worst;
    }
    /* Loops that are switched on dissipate energy. The stored energy of effects appears and vanishes with them. */
    for (int k = 0; k < kt_switch_count(model); k++) {
        const bool takes = kt_variants_switches(model->variants)[k].loop >= 0 ||
                           is_stick(model, kt_variants_switches(model->variants)[k].effect);
        const kt_energetics one = takes ? KT_ENERGY_DISSIPATED : KT_ENERGY_SUPPLIED;
        worst = one > worst ? one : worst;
    }
    if (model->variants && kt_variants_model(model->variants, kt_variants_count(model->variants) - 1)->driven)
        worst = KT_ENERGY_SUPPLIED;
    return worst;
}

void kt_effect_check(kt_checker *checker, const kt_effect *effect) {
    const kt_descriptor *descriptor = kt_effect_descriptor(effect->type);
    const kt_effect standard = kt_effect_default();
    const kt_effect_kind *kind = kt_effect_kind_of((int)effect->type);
    if (descriptor != NULL && effect->type != KT_EFFECT_EXPRESSION) /* whose keys exclude one another */
        kt_checker_keys(checker, descriptor, effect, &standard);
    if (kind->check != NULL)
        kind->check(checker, effect);
}
