/* Preloaded into a program: the allocation number KT_FAIL_AT of its main fails, alone (1 is the first; 0: none). When
 * main has returned, the number of them all goes to the file KT_COUNT_TO. Allocations before and after are not the
 * program's. Coverage's counters, which are written at the exit, are an example. For memory.py; glibc's own names do
 * the work. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* RTLD_NEXT */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* NOLINTBEGIN(bugprone-reserved-identifier,readability-inconsistent-declaration-parameter-name): names of glibc's */

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

typedef int program(int, char **, char **);
typedef int start_program(program *, int, char **, void (*)(void), void (*)(void), void (*)(void), void *);

static program *its_main;

static void tell(long allocations) {
    const char *name = getenv("KT_COUNT_TO");
    const int file = name ? open(name, O_WRONLY | O_CREAT | O_TRUNC, 0666) : -1;
    char text[24];
    if (file < 0)
        return;
    const int length = snprintf(text, sizeof text, "%ld", allocations);
    (void)!write(file, text, (size_t)length);
    close(file);
}

static int counted_main(int argc, char **argv, char **environment) {
    const char *text = getenv("KT_FAIL_AT");
    fail_at = text ? strtol(text, NULL, 10) : 0;
    const int code = its_main(argc, argv, environment);
    fail_at = -1;
    tell(count);
    return code;
}

start_program __libc_start_main;

/* The first function of every program. */
int __libc_start_main(program *main, int argc, char **argv, void (*init)(void), void (*fini)(void), void (*end)(void),
                      void *stack) {
    start_program *real;
    void *found = dlsym(RTLD_NEXT, "__libc_start_main");
    memcpy(&real, &found, sizeof real);
    its_main = main;
    return real(counted_main, argc, argv, init, fini, end, stack);
}

/* NOLINTEND(bugprone-reserved-identifier,readability-inconsistent-declaration-parameter-name) */
