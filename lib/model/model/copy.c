/* Copies of a compiled model in the caller's memory.
 *
 * A model is one block: the struct, then the arrays of KT_MODEL_FIELDS, each at an offset that follows from the counts
 * alone. Therefore a copy has the block's bytes, and the function that laid out the original sets the pointers of the
 * copy to its own arrays. Arrays contain indices and offsets but no pointers, with two exceptions. The table of names
 * is built again. The user pointers of custom effects are kept.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"
#include "model/model.h"
#include "model/switching.h"

#include <stdint.h>
#include <string.h>

size_t kt_model_size(const kt_model *model) {
    if (model && model->variants)
        return model->variants->bytes;
    return model ? model->bytes : 0;
}

void kt_model_copy_one(const kt_model *model, void *memory) {
    kt_model *copy = memory;
    memcpy(memory, model, model->bytes);
    (void)kt_model_layout(memory, &model->n);
    kt_model_name_all(copy);
    copy->placed = true;
}

/* Copies the block of all variants. Returns the copy of the given member. */
static kt_model *copy_variants(const kt_model *model, void *memory) {
    const kt_variants *from = model->variants;
    kt_variants *to = memory;
    memcpy(to, from, from->bytes);
    to->placed = true;
    for (uint64_t k = 0; k < kt_variants_count(to); k++) {
        kt_model *copy = kt_variants_model(to, k);
        kt_model_copy_one(kt_variants_model(from, k), copy);
        copy->variants = to;
    }
    const int64_t index = kt_switches_index(&to->switches, model->set);
    if (index >= 0)
        return kt_variants_model(to, (uint64_t)index);
    /* a set within a mask: the model without contacts */
    return kt_variants_model(
        to, (uint64_t)kt_switches_index(&to->switches, model->set & ~(to->switches.masked | to->switches.back)));
}

kt_status kt_model_copy(const kt_model *model, void *memory, size_t size, kt_model **copy, kt_error *error) {
    if (KT_IS_MISSING(error, model, copy))
        return KT_ERROR_ARGUMENT;
    const kt_status status =
        kt_arena_check("kt_model_copy", "kt_model_size", memory, size, kt_model_size(model), error);
    if (status != KT_OK)
        return status;
    if (model->variants) {
        *copy = copy_variants(model, memory);
        return KT_OK;
    }
    kt_model_copy_one(model, memory);
    *copy = memory;
    return KT_OK;
}
