/* Definitions in the program come before those of the C library, so every library it loads uses these too. The
 * underlying functions are reached by glibc's second names, or by those of the address sanitizer when it is there. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"

#include "sanitized.h"

#include <errno.h>
#include <stddef.h>

#if KT_ADDRESS_SANITIZER
#define REAL(name) __interceptor_##name
#else
#define REAL(name) __libc_##name
#endif

/* NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp): these are the library's names */
void *REAL(malloc)(size_t size);
void *REAL(calloc)(size_t count, size_t size);
void *REAL(realloc)(void *memory, size_t size);
void *REAL(memalign)(size_t alignment, size_t size);
void REAL(free)(void *memory);
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

void *malloc(size_t size);
void *calloc(size_t count, size_t size);
void *realloc(void *memory, size_t size);
void *aligned_alloc(size_t alignment, size_t size);
int posix_memalign(void **memory, size_t alignment, size_t size);
void free(void *memory);

static int counting, has_failed;
static long allocations, frees, failing;

void kt_interpose_start(void) { kt_interpose_start_failing(0); }

void kt_interpose_start_failing(long n) {
    allocations = frees = 0;
    failing = n;
    has_failed = 0;
    counting = 1;
}

long kt_interpose_stop(void) {
    counting = 0;
    return allocations;
}

long kt_interpose_frees(void) { return frees; }

int kt_interpose_has_failed(void) { return has_failed; }

/* Counts one allocation; true when it must fail. */
static int fails(void) {
    if (!counting || ++allocations != failing)
        return 0;
    has_failed = 1;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size) { return fails() ? NULL : REAL(malloc)(size); }

void *calloc(size_t count, size_t size) { return fails() ? NULL : REAL(calloc)(count, size); }

void *realloc(void *memory, size_t size) { return fails() ? NULL : REAL(realloc)(memory, size); }

void *aligned_alloc(size_t alignment, size_t size) { return fails() ? NULL : REAL(memalign)(alignment, size); }

int posix_memalign(void **memory, size_t alignment, size_t size) {
    void *made = fails() ? NULL : REAL(memalign)(alignment, size);
    if (made == NULL)
        return ENOMEM;
    *memory = made;
    return 0;
}

void free(void *memory) {
    if (counting && memory != NULL)
        frees++;
    REAL(free)(memory);
}
