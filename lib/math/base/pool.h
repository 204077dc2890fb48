/* Memory that is allocated in small pieces and released all at once. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_POOL_H
#define KT_BASE_POOL_H

#include <stdbool.h>
#include <stddef.h>

typedef struct kt_chunk kt_chunk;

/* A struct of zeros is an empty pool. */
typedef struct kt_pool {
    kt_chunk *chunks; /* the newest first */
    size_t used;      /* bytes taken of the newest */
} kt_pool;

/* Takes `count` pieces of `size` bytes, zeroed, aligned for any type; returns NULL if there is no memory. O(1) except
 * for the zeros. */
void *kt_pool_take(kt_pool *pool, size_t count, size_t size);

/* A terminated copy of `length` bytes; NULL if there is no memory. */
char *kt_pool_text(kt_pool *pool, const char *text, size_t length);

/* Returns the array with room for `more` items behind `count`: itself, or a copy in the pool. NULL if there is no
 * memory. */
void *kt_pool_grow(kt_pool *pool, void *items, size_t count, size_t more, size_t *room, size_t size);

/* Whether a number lies in memory that was taken from a pool. O(chunks). */
bool kt_pool_has(const kt_pool *pool, const double *number);

/* Puts the chunks of one pool before the chunks of another (NULL: none), so that one call releases both; returns the
 * first chunk. */
kt_chunk *kt_pool_join(kt_chunk *chunks, kt_chunk *others);

/* Releases everything that was taken from a pool, given its `chunks`. */
void kt_pool_free(kt_chunk *chunks);

#endif
