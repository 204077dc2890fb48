/* Laying arrays out in one block: the same walk measures (base == NULL) and places. */
#ifndef KT_BASE_ARENA_H
#define KT_BASE_ARENA_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { KT_ARENA_ALIGNMENT = 64 }; /* a cache line, and the widest vector */

static inline size_t kt_arena_round(size_t bytes) {
    return (bytes + KT_ARENA_ALIGNMENT - 1) / KT_ARENA_ALIGNMENT * KT_ARENA_ALIGNMENT;
}

/* Takes `bytes` from the block at *used: NULL while measuring. */
static inline void *kt_arena_take(char *base, size_t *used, size_t bytes) {
    void *place = base ? base + *used : NULL;
    *used += kt_arena_round(bytes);
    return place;
}

/* Whether a block that a caller gives will do. */
static inline bool kt_arena_fits(const void *memory, size_t size, size_t needed) {
    return memory && size >= needed && (uintptr_t)memory % KT_ARENA_ALIGNMENT == 0;
}

/* KT_ERROR_MEMORY at `where`, with what the memory must be; `query` is the call that tells its size. */
kt_status kt_arena_refuse(const char *where, const char *query, const void *memory, size_t size, size_t needed,
                          kt_error *error);

#endif
