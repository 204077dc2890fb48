/* Functions that the C library of WebAssembly lacks, and the connection to the page.
 *
 * The resource of an FMU is a file. A page has no files, so that kt_page_resource stands for the only one: the linker
 * replaces fopen (--wrap=fopen).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "host.h"

#include "command.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const kt_bytes *resource;

void kt_host_offer(const kt_bytes *text) { resource = text; }

FILE *__wrap_fopen(const char *path, const char *mode);
FILE *__wrap_fopen(const char *path, const char *mode) {
    (void)path;
    if (resource == NULL || resource->used == 0 || mode[0] != 'r')
        return NULL;
    return fmemopen(resource->text, resource->used, "r");
}

char *realpath(const char *restrict path, char *restrict resolved);
char *realpath(const char *restrict path, char *restrict resolved) {
    (void)path, (void)resolved;
    return NULL;
}

void kt_host_print(kt_host_rank rank, const char *text) { kt_host_message((int)rank, text, strlen(text)); }

/* The messages of the command's files that a page has. */
void kt_say(const char *format, ...) {
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    kt_host_print(KT_HOST_FAULT, text);
}

void kt_say_error(const kt_error *error) { kt_say("%s", kt_words_of(error).text); }
