/* Memory that is taken in small pieces and given back in one.
 *
 * Chunks double from 4 KB to 1 MB, so that a small scene takes little and a large one asks seldom; what does not fit
 * into the rest of a chunk begins a new one.
 */
#include "scene/arena.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_CHUNK = 4096, LARGEST_CHUNK = 1 << 20, ALIGNMENT = _Alignof(max_align_t) };

struct kt_chunk {
    kt_chunk *next;
    size_t size; /* bytes that follow */
    max_align_t bytes[];
};

static kt_chunk *add_chunk(kt_arena *arena, size_t size) {
    size_t next = arena->chunks == NULL ? FIRST_CHUNK : 2 * arena->chunks->size;
    if (next > LARGEST_CHUNK)
        next = LARGEST_CHUNK;
    if (next < size)
        next = size;
    if (next > SIZE_MAX - sizeof(kt_chunk))
        return NULL;
    kt_chunk *chunk = calloc(1, sizeof *chunk + next);
    if (chunk == NULL)
        return NULL;
    chunk->next = arena->chunks;
    chunk->size = next;
    arena->chunks = chunk;
    arena->used = 0;
    return chunk;
}

void *kt_arena_take(kt_arena *arena, size_t count, size_t size) {
    if (size != 0 && count > (SIZE_MAX - ALIGNMENT) / size)
        return NULL;
    size_t bytes = (count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    kt_chunk *chunk = arena->chunks;
    if (chunk == NULL || bytes > chunk->size - arena->used)
        chunk = add_chunk(arena, bytes);
    if (chunk == NULL)
        return NULL;
    void *piece = (char *)chunk->bytes + arena->used;
    arena->used += bytes;
    return piece;
}

char *kt_arena_text(kt_arena *arena, const char *text, size_t length) {
    char *copy = length < SIZE_MAX ? kt_arena_take(arena, length + 1, 1) : NULL;
    if (copy != NULL && length > 0)
        memcpy(copy, text, length);
    return copy;
}

void kt_arena_free(kt_chunk *chunks) {
    while (chunks != NULL) {
        kt_chunk *next = chunks->next;
        free(chunks);
        chunks = next;
    }
}
