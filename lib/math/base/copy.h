/* Copies of a caller's arrays. An array may be NULL if it has no numbers, as for a model that does not move. C does not
 * allow a copy of no bytes from or to NULL (C17, 7.24.1). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_COPY_H
#define KT_BASE_COPY_H

#include <string.h>

static inline void kt_copy(void *to, const void *from, size_t bytes) {
    if (bytes > 0)
        memcpy(to, from, bytes);
}

/* Copies arrays that may overlap. */
static inline void kt_move(void *to, const void *from, size_t bytes) {
    if (bytes > 0)
        memmove(to, from, bytes);
}

static inline void kt_clear(void *to, size_t bytes) {
    if (bytes > 0)
        memset(to, 0, bytes);
}

/* from: NULL means zeros. */
static inline void kt_copy_or_clear(void *to, const void *from, size_t bytes) {
    if (from)
        kt_copy(to, from, bytes);
    else
        kt_clear(to, bytes);
}

#endif
