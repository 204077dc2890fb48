/* Memory that the library allocates itself: for kt_*_create, whose callers do not bring their own, and for set-up. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "base/arena.h"

void *kt_arena_allocate(size_t bytes, const char *what, kt_error *error) {
    void *memory = kt_aligned_allocate(bytes);
    if (memory == NULL)
        (void)kt_error_set(error, KT_ERROR_MEMORY, NULL, "%lu bytes for %s cannot be allocated", (unsigned long)bytes,
                           what);
    return memory;
}

kt_status kt_arena_own(void *memory, kt_status status) {
    if (status == KT_OK)
        *(void **)memory = memory;
    else
        kt_aligned_release(memory);
    return status;
}

void kt_arena_free(void *object) {
    if (object != NULL)
        kt_aligned_release(*(void **)object);
}
