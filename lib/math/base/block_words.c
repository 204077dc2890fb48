/* Compares words of a block from outside with their ranges (block_words.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/block_words.h"

#include <string.h>

static size_t size_of_type(kt_block_type type) {
    static const size_t sizes[] = {[KT_BLOCK_FLAG] = 1,  [KT_BLOCK_INT32] = 4,  [KT_BLOCK_UINT32] = 4,
                                   [KT_BLOCK_INT64] = 8, [KT_BLOCK_UINT64] = 8, [KT_BLOCK_REAL] = 8};
    return sizes[type];
}

/* The number at any address; a flag as its byte, because C does not define other values of a bool than 0 and 1. */
static double value_at(const char *at, kt_block_type type) {
    union {
        uint8_t flag;
        int32_t int32;
        uint32_t uint32;
        int64_t int64;
        uint64_t uint64;
        double real;
    } u = {.uint64 = 0};
    memcpy(&u, at, size_of_type(type));
    switch (type) {
    case KT_BLOCK_FLAG:
        return u.flag;
    case KT_BLOCK_INT32:
        return u.int32;
    case KT_BLOCK_UINT32:
        return u.uint32;
    case KT_BLOCK_INT64:
        return (double)u.int64;
    case KT_BLOCK_UINT64:
        return (double)u.uint64;
    default:
        return u.real;
    }
}

/* Whether all numbers of a word are in its range (NaN: any are, KT_BLOCK_ANY). *value: the last number read, which is
 * the wrong one if there is one. */
static bool word_is_right(const char *block, const kt_block_word *word, double *value) {
    const size_t step = size_of_type(word->type);
    if (isnan(word->first))
        return true;
    for (size_t at = 0; at < word->size; at += step) {
        *value = value_at(block + word->offset + at, word->type);
        if (!(word->first <= *value && *value <= word->last))
            return false;
    }
    return true;
}

const kt_block_word *kt_block_find_wrong(const void *block, const kt_block_word *words, size_t count, double *value) {
    for (size_t i = 0; i < count; i++)
        if (!word_is_right(block, &words[i], value))
            return &words[i];
    return NULL;
}
