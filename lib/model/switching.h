/* The models of a mechanism whose loops and effects are switched: one for each set of those that are on. */
#ifndef KT_MODEL_SWITCHING_H
#define KT_MODEL_SWITCHING_H

#include "model/model.h"

/* What is switched: a loop or an effect, by its index in the description; the other is -1. */
typedef struct kt_switch {
    int32_t loop, effect;
} kt_switch;

/* One block of memory: this struct, the offsets of the models, by their sets, and the models. */
typedef struct kt_family {
    size_t bytes;
    size_t data;   /* bytes of the largest data */
    int32_t count; /* of switches: 1 << count models */
    bool placed;   /* in the caller's memory (kt_model_copy) */
    kt_switch item[KT_SWITCH_MAX];
    size_t at[]; /* of each model, from the beginning of the block */
} kt_family;

static inline uint64_t kt_family_sets(const kt_family *family) { return (uint64_t)1 << family->count; }

static inline kt_model *kt_family_model(const kt_family *family, uint64_t set) {
    return (kt_model *)(void *)((char *)(uintptr_t)family + family->at[set]);
}

/* Bytes from the beginning of a family to its first model. */
static inline size_t kt_family_head(int count) {
    return kt_arena_round(sizeof(kt_family) + ((size_t)1 << count) * sizeof(size_t));
}

/* Copies one model, without the others of its family. */
void kt_model_copy_one(const kt_model *model, void *memory);

/* Initialises data for another model, whose data fit in their memory; counts go on. */
void kt_data_adapt(const kt_model *model, kt_data *data);

#endif
