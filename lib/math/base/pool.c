/* Memory that is allocated in small pieces and released all at once.
 *
 * Chunks double from 4 KB to 1 MB, so that a small scene takes little memory and a large scene few allocations. A piece
 * that does not fit into the remainder of a chunk begins a new chunk.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pool.h"

#include "base/copy.h"
#include "base/grow.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_CHUNK = 4096, LARGEST_CHUNK = 1 << 20, ALIGNMENT = _Alignof(max_align_t) };

struct kt_chunk {
    kt_chunk *next;
    size_t size; /* bytes that follow */
    max_align_t bytes[];
};

/* Begins a chunk with room for `size` bytes, all zero. The remainder of the chunk before is not used any more. */
static kt_chunk *add_chunk(kt_pool *pool, size_t size) {
    size_t next = pool->chunks == NULL ? FIRST_CHUNK : 2 * pool->chunks->size;
    if (next > LARGEST_CHUNK)
        next = LARGEST_CHUNK;
    if (next < size)
        next = size;
    if (next > SIZE_MAX - sizeof(kt_chunk))
        return NULL;
    kt_chunk *chunk = calloc(1, sizeof *chunk + next);
    if (chunk == NULL)
        return NULL;
    chunk->next = pool->chunks;
    chunk->size = next;
    pool->chunks = chunk;
    pool->used = 0;
    return chunk;
}

void *kt_pool_take(kt_pool *pool, size_t count, size_t size) {
    if (size != 0 && count > (SIZE_MAX - ALIGNMENT) / size)
        return NULL;
    size_t bytes = (count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    kt_chunk *chunk = pool->chunks;
    if (chunk == NULL || bytes > chunk->size - pool->used)
        chunk = add_chunk(pool, bytes);
    if (chunk == NULL)
        return NULL;
    void *piece = (char *)chunk->bytes + pool->used;
    pool->used += bytes;
    return piece;
}

char *kt_pool_text(kt_pool *pool, const char *text, size_t length) {
    char *copy = length < SIZE_MAX ? kt_pool_take(pool, length + 1, 1) : NULL;
    if (copy != NULL && length > 0)
        memcpy(copy, text, length);
    return copy;
}

void *kt_pool_grow(kt_pool *pool, void *items, size_t count, size_t more, size_t *room, size_t size) {
    const size_t wanted = kt_grown_room(count, more, *room);
    if (wanted == *room)
        return items;
    void *grown = wanted > 0 ? kt_pool_take(pool, wanted, size) : NULL;
    if (grown == NULL)
        return NULL;
    kt_copy(grown, items, count * size);
    *room = wanted;
    return grown;
}

bool kt_pool_has(const kt_pool *pool, const double *number) {
    for (const kt_chunk *chunk = pool->chunks; chunk != NULL; chunk = chunk->next) {
        const uintptr_t at = (uintptr_t)number, begin = (uintptr_t)chunk->bytes;
        if (at >= begin && at - begin < chunk->size)
            return true;
    }
    return false;
}

kt_chunk *kt_pool_join(kt_chunk *chunks, kt_chunk *others) {
    kt_chunk *last = chunks;
    if (chunks == NULL)
        return others;
    while (last->next != NULL)
        last = last->next;
    last->next = others;
    return chunks;
}

void kt_pool_free(kt_chunk *chunks) {
    while (chunks != NULL) {
        kt_chunk *next = chunks->next;
        free(chunks);
        chunks = next;
    }
}
