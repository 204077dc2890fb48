/* A checksum that detects accidental differences, not forged ones: FNV-1a, 64 bits (Fowler, Noll, Vo). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_SUM_H
#define KT_BASE_SUM_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* The sum of no bytes. */
#define KT_SUM_START UINT64_C(0xcbf29ce484222325)

/* Returns the sum of the bytes that gave `sum`, followed by these bytes. */
static inline uint64_t kt_sum_add(uint64_t sum, const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ byte[i]) * UINT64_C(0x100000001b3);
    return sum;
}

/* Adds 64-bit words, eight times as fast as byte by byte. Each step is a bijection of the sum, so that one changed word
 * always changes the result. */
static inline uint64_t kt_sum_add_words(uint64_t sum, const void *words, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint64_t word;
        memcpy(&word, (const char *)words + i * sizeof word, sizeof word);
        sum = (sum ^ word) * UINT64_C(0x100000001b3);
        sum ^= sum >> 32;
    }
    return sum;
}

/* Adds a text and the zero behind the text; NULL adds nothing. */
static inline uint64_t kt_sum_add_text(uint64_t sum, const char *text) {
    return text != NULL ? kt_sum_add(sum, text, strlen(text) + 1) : sum;
}

#endif
