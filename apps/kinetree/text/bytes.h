/* Bytes or text that grow. A struct of zeros has none. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_BYTES_H
#define KT_COMMAND_TEXT_BYTES_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef struct kt_bytes {
    char *text; /* a zero follows what was added; NULL: nothing was. The owner frees it */
    size_t used, room;
    bool is_short; /* memory was insufficient: the bytes are incomplete, and nothing is added any more */
} kt_bytes;

/* Returns where `more` bytes and a zero go, behind those that are used. The caller adds to `used`. NULL: memory is
 * insufficient. */
char *kt_bytes_room(kt_bytes *bytes, size_t more);

void kt_bytes_add(kt_bytes *bytes, const void *from, size_t size);
void kt_bytes_print(kt_bytes *bytes, const char *format, ...) KT_PRINTF(2, 3);

/* Adds what a stream has left, or its beginning if it has more than `most` bytes. Returns false, without any bytes, if
 * it cannot be read or memory is insufficient. */
bool kt_bytes_read(kt_bytes *bytes, FILE *file, size_t most);

/* Returns the text behind the byte order mark of UTF-8, or the text itself. Spreadsheets begin a CSV file with this
 * mark, which belongs to no name. */
char *kt_behind_mark(char *text);

#endif
