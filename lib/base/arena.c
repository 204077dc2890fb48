/* What memory that a caller gives must be. */
#include "base/arena.h"

kt_status kt_arena_refuse(const char *where, const char *query, const void *memory, size_t size, size_t needed,
                          kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, where,
                        "%zu bytes at a multiple of %d are needed (%s); given: %zu bytes%s", needed, KT_ARENA_ALIGNMENT,
                        query, memory ? size : 0, (uintptr_t)memory % KT_ARENA_ALIGNMENT != 0 ? ", misaligned" : "");
}
