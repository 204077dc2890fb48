/* Bytes or text that grow: the room doubles. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/bytes.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

char *kt_bytes_room(kt_bytes *bytes, size_t more) {
    if (bytes->is_short)
        return NULL;
    if (bytes->room - bytes->used <= more) {
        const size_t room = 2 * bytes->room + more + 4096;
        char *text = realloc(bytes->text, room);
        bytes->is_short = text == NULL;
        if (text == NULL)
            return NULL;
        bytes->text = text;
        bytes->room = room;
    }
    return bytes->text + bytes->used;
}

void kt_bytes_add(kt_bytes *bytes, const void *from, size_t size) {
    char *to = kt_bytes_room(bytes, size);
    if (to == NULL)
        return;
    if (size > 0)
        memcpy(to, from, size);
    to[size] = '\0';
    bytes->used += size;
}

/* Mostly there is room, and the text is made once. */
void kt_bytes_print(kt_bytes *bytes, const char *format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    char *to = kt_bytes_room(bytes, 64);
    const size_t left = bytes->room - bytes->used;
    const int length = to != NULL ? vsnprintf(to, left, format, arguments) : -1;
    if (length >= 0 && (size_t)length >= left && (to = kt_bytes_room(bytes, (size_t)length)) != NULL)
        (void)vsnprintf(to, (size_t)length + 1, format, again);
    if (length >= 0 && to != NULL)
        bytes->used += (size_t)length;
    va_end(again);
    va_end(arguments);
}

bool kt_bytes_read(kt_bytes *bytes, FILE *file, size_t most) {
    size_t count = 1;
    while (count > 0 && bytes->used <= most) {
        enum { BLOCK = 65536 };
        char *to = kt_bytes_room(bytes, BLOCK);
        count = to != NULL ? fread(to, 1, bytes->room - bytes->used - 1, file) : 0;
        bytes->used += count;
    }
    if (!bytes->is_short && !ferror(file)) {
        bytes->text[bytes->used] = '\0';
        return true;
    }
    free(bytes->text);
    *bytes = (kt_bytes){.is_short = bytes->is_short};
    return false;
}

char *kt_behind_mark(char *text) {
    static const char mark[] = "\xEF\xBB\xBF";
    return strncmp(text, mark, sizeof mark - 1) == 0 ? text + sizeof mark - 1 : text;
}
