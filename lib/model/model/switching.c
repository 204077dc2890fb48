/* Loops and effects that are switched on and off: selects another model of the same block, and initialises the data for
 * this model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/switching.h"

/* ---- queries ----------------------------------------------------------------------------------------------------- */

int kt_switch_count(const kt_model *model) { return model && model->variants ? model->variants->switches.count : 0; }

uint64_t kt_switch_set(const kt_model *model) { return model ? model->set : 0; }

uint64_t kt_switch_bits(const kt_model *model, int k) {
    return model && KT_IS_INDEX(k, kt_switch_count(model)) ? kt_switches_bit(&model->variants->switches, k) : 0;
}

const kt_model *kt_model_switched(const kt_model *model, uint64_t set) {
    if (!model || !model->variants)
        return set == 0 ? model : NULL;
    const int64_t index = kt_switches_index(&model->variants->switches, set);
    return index >= 0 ? kt_variants_model(model->variants, (uint64_t)index) : NULL;
}

const char *kt_switch_name(const kt_model *model, int k) {
    if (!model || !KT_IS_INDEX(k, kt_switch_count(model)))
        return NULL;
    const kt_switch *item = &kt_variants_switches(model->variants)[k];
    if (item->loop >= 0)
        return model->text + model->loop[item->loop].name;
    for (size_t i = 0; i < model->n.effect + model->n.effect_off; i++)
        if (model->effect[i].source == item->effect && model->effect[i].name)
            return model->text + model->effect[i].name;
    return "";
}

int kt_loop_switch(const kt_model *model, int loop) {
    const kt_variants *variants = model != NULL ? model->variants : NULL;
    return variants != NULL && KT_IS_INDEX(loop, variants->switches.loops) ? kt_variants_switch_of_loop(variants)[loop]
                                                                           : -1;
}

int kt_effect_switch(const kt_model *model, int effect) {
    const kt_variants *variants = model != NULL ? model->variants : NULL;
    return variants != NULL && KT_IS_INDEX(effect, variants->switches.effects)
               ? kt_variants_switch_of_effect(variants)[effect]
               : -1;
}

/* ---- switching --------------------------------------------------------------------------------------------------- */

/* Switches item k of the switches on or off: selects the model of the new set, and initialises the data (NULL: none)
 * for it. `call` and `what` are the names for messages. Nothing changes on failure. */
static kt_status enable(const kt_model **model, kt_data *data, int k, bool on, const char *call, const char *what,
                        kt_error *error) {
    if (k < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, call,
                            "there is no such %s, or it is always on: declare it switched in its description "
                            "(switching), before the model is compiled",
                            what);
    if (data && kt_is_other_data(error, call, *model, data))
        return KT_ERROR_ARGUMENT;
    const uint64_t bit = kt_switch_bits(*model, k);
    const kt_model *to = kt_model_switched(*model, on ? (*model)->set | bit : (*model)->set & ~bit);
    if (!to || k >= (*model)->variants->switches.own)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, call,
                            "it is one of the contacts that only a simulation closes and opens; compile the model with "
                            "kt_model_options.contact_switches for up to %d switches of contacts",
                            KT_SWITCH_MAX);
    if (data && data->bytes < (*model)->variants->data)
        return kt_error_set(error, KT_ERROR_MEMORY, call,
                            "the data have %lu bytes, and need %lu for all models; make them for one of these "
                            "(kt_data_create)",
                            (unsigned long)data->bytes, (unsigned long)(*model)->variants->data);
    if (data && to != *model)
        kt_data_rebind(to, data);
    *model = to;
    return KT_OK;
}

kt_status kt_loop_set_on(const kt_model **model, kt_data *data, int loop, bool on, kt_error *error) {
    if (KT_IS_MISSING(error, model, *model))
        return KT_ERROR_ARGUMENT;
    return enable(model, data, kt_loop_switch(*model, loop), on, "kt_loop_set_on", "loop", error);
}

kt_status kt_effect_set_on(const kt_model **model, kt_data *data, int effect, bool on, kt_error *error) {
    if (KT_IS_MISSING(error, model, *model))
        return KT_ERROR_ARGUMENT;
    return enable(model, data, kt_effect_switch(*model, effect), on, "kt_effect_set_on", "effect", error);
}
