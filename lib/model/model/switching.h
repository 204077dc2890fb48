/* The models of a mechanism whose loops and effects are switched: one model for each set of active switches. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_SWITCHING_H
#define KT_MODEL_SWITCHING_H

#include "model/model.h"

/* A switch turns a loop or an effect on and off, given by its index in the description. The other index is -1. */
typedef struct kt_switch {
    int32_t loop, effect;
} kt_switch;

/* The most switches that each have a bit in a set. With more switches, contacts share the two bits above. */
enum { KT_SWITCH_BITS = 62 };

/* The switches of variants. Each set of up to KT_SWITCH_MAX switches has a compiled model. With more than a few
 * switches of contacts (kt_model_options.contact_switches), these are masked. Then each set of the other switches has
 * two models, one with no contact and one with all contacts. A simulation derives all other sets from the model with
 * all contacts (contact/mask.h). Sticking friction of a joint counts as a contact; in the model with no contact, the
 * joint slips forwards.
 *
 * Each switch has its bit in a set, bit k for switch k, up to KT_SWITCH_BITS switches. With more switches, the masked
 * switches come last, and share two bits: bit 62 if any contact is closed, and bit 63 if all are. */
typedef struct kt_switches {
    int32_t count;
    int32_t own;     /* the first switches, which have a bit each */
    uint64_t masked; /* bits of contacts whose sets have no models of their own; 0: all sets have */
    uint64_t back;   /* bits of effects: masked friction of joints that slips backwards, or with its loop is released.
                        No set with one of these has a model of its own */
    int32_t loops, effects; /* number of loops and effects of the description */
} kt_switches;

static const uint64_t kt_switches_any = (uint64_t)1 << 62, kt_switches_all = (uint64_t)3 << 62;

/* One block of memory: this struct, the offsets of the models, the switches, the switch of each loop and of each effect
 * (-1: none), and the models. */
typedef struct kt_variants {
    size_t bytes;
    size_t data;       /* bytes of the largest data */
    uint64_t contacts; /* bits of hard contacts, stops and ropes, and of friction that sticks; 0: there are none */
    uint64_t back;     /* bits of friction of joints that slips backwards, among `contacts` */
    bool placed;       /* in the caller's memory (kt_model_copy) */
    /* Rejects a state in which an open contact touches: kt_open_contacts_place (evaluate/open.h). */
    kt_status (*check_open)(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            kt_error *error);
    kt_switches switches;
    size_t at[]; /* place of each model, from the beginning of the block */
} kt_variants;

/* The bits of switch k. Contacts without their own bit have both shared bits. */
static inline uint64_t kt_switches_bit(const kt_switches *of, int k) {
    return k < of->own ? (uint64_t)1 << k : kt_switches_all;
}

/* Whether switch k is on in a set that has a model. */
static inline bool kt_switches_has(const kt_switches *of, uint64_t set, int k) {
    const uint64_t bit = kt_switches_bit(of, k);
    return (set & bit) == bit;
}

/* The number of models, and the set of the k-th. The last model has all switched items. */
static inline uint64_t kt_switches_models(const kt_switches *of) {
    int count = of->masked != 0;
    for (int k = 0; k < of->own; k++)
        count += ((of->masked | of->back) >> k & 1) == 0;
    return (uint64_t)1 << count;
}

static inline uint64_t kt_switches_set(const kt_switches *of, uint64_t index) {
    uint64_t set = 0;
    int bit = 0;
    for (int k = 0; k < of->own; k++)
        if (((of->masked | of->back) >> k & 1) == 0)
            set |= (index >> bit++ & 1) << k;
    return set | ((index >> bit & 1) != 0 ? of->masked : 0);
}

/* The index of a set's model; -1: the set has no model. */
static inline int64_t kt_switches_index(const kt_switches *of, uint64_t set) {
    const uint64_t contacts = set & of->masked, known = (((uint64_t)1 << of->own) - 1) | of->masked;
    uint64_t index = 0;
    int bit = 0;
    if ((set & ~known) != 0 || (set & of->back) != 0 || (contacts != 0 && contacts != of->masked))
        return -1;
    if ((of->masked | of->back) == 0)
        return (int64_t)set;
    for (int k = 0; k < of->own; k++)
        if (((of->masked | of->back) >> k & 1) == 0)
            index |= (set >> k & 1) << bit++;
    return (int64_t)(index | (uint64_t)(contacts != 0) << bit);
}

/* The number of variants, and the k-th variant. */
static inline uint64_t kt_variants_count(const kt_variants *variants) {
    return kt_switches_models(&variants->switches);
}
static inline kt_model *kt_variants_model(const kt_variants *variants, uint64_t k) {
    return (kt_model *)(void *)((char *)(uintptr_t)variants + variants->at[k]);
}

/* The switches of variants. */
static inline const kt_switch *kt_variants_switches(const kt_variants *variants) {
    return (const kt_switch *)(const void *)(variants->at + kt_variants_count(variants));
}

/* The switch of each loop, followed by the switch of each effect. */
static inline const int32_t *kt_variants_switch_of_loop(const kt_variants *variants) {
    return (const int32_t *)(const void *)(kt_variants_switches(variants) + variants->switches.count);
}
static inline const int32_t *kt_variants_switch_of_effect(const kt_variants *variants) {
    return kt_variants_switch_of_loop(variants) + variants->switches.loops;
}

/* Bytes from the beginning of the variants to the first model. */
static inline size_t kt_variants_head(const kt_switches *of) {
    return kt_arena_round(sizeof(kt_variants) + (size_t)kt_switches_models(of) * sizeof(size_t) +
                          (size_t)of->count * sizeof(kt_switch) + (size_t)(of->loops + of->effects) * sizeof(int32_t));
}

/* The model in which all contacts are closed and all friction sticks, with the other switches of a model's set. NULL:
 * the model has no contacts. */
static inline const kt_model *kt_variants_closed(const kt_model *model) {
    const kt_variants *variants = model->variants;
    return variants != NULL && variants->contacts != 0
               ? kt_model_switched(model, (model->set | variants->contacts) & ~variants->back)
               : NULL;
}

/* Copies one model, without its other variants. */
void kt_model_copy_one(const kt_model *model, void *memory);

/* Initialises data for another model, whose data fit in their memory. Counts continue. */
void kt_data_rebind(const kt_model *model, kt_data *data);

#endif
