/* The address that malloc returned is stored directly in front of the aligned memory, for kt_aligned_release. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "base/arena.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void *kt_aligned_allocate(size_t bytes) {
    const size_t spare = KT_ARENA_ALIGNMENT + sizeof(void *);
    char *block = bytes <= SIZE_MAX - spare ? malloc(bytes + spare) : NULL;
    if (block == NULL)
        return NULL;
    char *first = block + sizeof(void *);
    char *memory = first + (KT_ARENA_ALIGNMENT - (uintptr_t)first % KT_ARENA_ALIGNMENT) % KT_ARENA_ALIGNMENT;
    memcpy(memory - sizeof(void *), &block, sizeof block);
    return memory;
}

void kt_aligned_release(void *memory) {
    char *block = NULL;
    if (memory != NULL)
        memcpy(&block, (char *)memory - sizeof(void *), sizeof block);
    free(block);
}
