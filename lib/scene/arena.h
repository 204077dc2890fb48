/* Memory that is taken in small pieces and given back in one. */
#ifndef KT_SCENE_ARENA_H
#define KT_SCENE_ARENA_H

#include <stddef.h>

typedef struct kt_chunk kt_chunk;

/* A struct of zeros is an empty arena. */
typedef struct kt_arena {
    kt_chunk *chunks; /* the newest first */
    size_t used;      /* bytes taken of the newest */
} kt_arena;

/* `count` pieces of `size` bytes, zeroed, aligned for any type; NULL where there is no memory. O(1) but for the zeros.
 */
void *kt_arena_take(kt_arena *arena, size_t count, size_t size);

/* A terminated copy of `length` bytes; NULL where there is no memory. */
char *kt_arena_text(kt_arena *arena, const char *text, size_t length);

/* Releases everything that was taken from an arena, given its `chunks`. */
void kt_arena_free(kt_chunk *chunks);

#endif
