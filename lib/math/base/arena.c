/* Checks and clears the caller's memory. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"

#include <string.h>

kt_status kt_arena_check(const char *where, const char *query, const void *memory, size_t size, size_t needed,
                         kt_error *error) {
    const bool aligned = (uintptr_t)memory % KT_ARENA_ALIGNMENT == 0;
    if (memory != NULL && size >= needed && aligned)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_MEMORY, where,
                        "%lu bytes at a multiple of %d are needed (%s); given: %lu bytes%s", (unsigned long)needed,
                        KT_ARENA_ALIGNMENT, query, memory ? (unsigned long)size : 0, aligned ? "" : ", misaligned");
}

kt_status kt_arena_begin(const char *where, const char *query, void *memory, size_t size, size_t needed,
                         kt_error *error) {
    const kt_status status = kt_arena_check(where, query, memory, size, needed, error);
    if (status == KT_OK)
        memset(memory, 0, needed);
    return status;
}
