/* Ranges of the words of a block that comes from outside, such as a checkpoint.
 *
 * A checksum detects accidents, but no attack, since anybody can compute a valid checksum. The program indexes arrays
 * with some words, converts some to integers, and takes some as flags. A list declares the range of each word, and one
 * function checks all words before the program uses any. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_BLOCK_WORDS_H
#define KT_BASE_BLOCK_WORDS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum kt_block_type {
    KT_BLOCK_FLAG, /* one byte, 0 or 1: C leaves other values of a bool undefined */
    KT_BLOCK_INT32,
    KT_BLOCK_UINT32,
    KT_BLOCK_INT64,
    KT_BLOCK_UINT64,
    KT_BLOCK_REAL,
} kt_block_type;

/* A member of a struct, a number or an array of numbers. The value passes if first <= value <= last. */
typedef struct kt_block_word {
    const char *name;
    size_t offset, size; /* bytes */
    kt_block_type type;
    double first, last;
} kt_block_word;

/* A range of real numbers that no decision depends on: any value passes, NaN included. */
#define KT_BLOCK_ANY (double)NAN, (double)NAN
#define KT_BLOCK_FINITE -1.7976931348623157e308, 1.7976931348623157e308
/* A count of at most 2^53 can grow by 2^62 without an overflow, and no program counts so far. */
#define KT_BLOCK_COUNT 0.0, 9007199254740992.0
#define KT_BLOCK_YES_NO 0.0, 1.0

/* An entry of a list of kt_block_word. */
#define KT_BLOCK_WORD(type, member, ...)                                                                               \
    { #member, offsetof(type, member), sizeof((type *)0)->member, KT_BLOCK_TYPE(((type *)0)->member), __VA_ARGS__ }
/* clang-format off */
#define KT_BLOCK_TYPE(value)                                                                                           \
    _Generic((value), bool: KT_BLOCK_FLAG, int32_t: KT_BLOCK_INT32, uint32_t: KT_BLOCK_UINT32,                         \
             int64_t: KT_BLOCK_INT64, uint64_t: KT_BLOCK_UINT64, double: KT_BLOCK_REAL, double *: KT_BLOCK_REAL)
/* clang-format on */

/* Returns the first word of the struct at `block` that is outside of its range, with its value in *value; NULL: none
 * is. The struct may lie at any address. */
const kt_block_word *kt_block_find_wrong(const void *block, const kt_block_word *words, size_t count, double *value);

#endif
