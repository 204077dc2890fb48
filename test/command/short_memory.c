/* Preloaded into a program: its allocation number KT_FAIL_AT fails, alone (1 is the first after start-up; 0: none).
 * At the end, the number of them all goes to the file KT_COUNT_TO. For memory.py; glibc's own names do the work. */
#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

static long count, fail_at = -1;

static int is_short(void) {
    if (fail_at < 0 || ++count != fail_at)
        return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size) { return is_short() ? NULL : __libc_malloc(size); }
void *calloc(size_t n, size_t size) { return is_short() ? NULL : __libc_calloc(n, size); }
void *realloc(void *old, size_t size) { return is_short() ? NULL : __libc_realloc(old, size); }
void *aligned_alloc(size_t alignment, size_t size) { return is_short() ? NULL : __libc_memalign(alignment, size); }

int posix_memalign(void **out, size_t alignment, size_t size) {
    void *memory = is_short() ? NULL : __libc_memalign(alignment, size);
    if (!memory)
        return ENOMEM;
    *out = memory;
    return 0;
}

__attribute__((constructor)) static void start(void) {
    const char *text = getenv("KT_FAIL_AT");
    fail_at = text ? strtol(text, NULL, 10) : 0;
}

__attribute__((destructor)) static void finish(void) {
    const char *name = getenv("KT_COUNT_TO");
    const int file = name ? open(name, O_WRONLY | O_CREAT | O_TRUNC, 0666) : -1;
    char text[24];
    if (file < 0)
        return;
    const int length = snprintf(text, sizeof text, "%ld", count);
    (void)!write(file, text, (size_t)length);
    close(file);
}
