/* Files that a command or a scene names. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/input.h"

#include "command.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { TABLE_MOST = 1 << 30, LINE_MOST = 16 << 20 /* bytes */ };

const kt_file_kind kt_input_table = {"a table", "a file with a table (CSV)", TABLE_MOST, true};
const kt_file_kind kt_input_result = {"a result", "a file with records (CSV) or a summary (JSON)", TABLE_MOST, true};
const kt_file_kind kt_input_summary = {"a summary", "the file of a summary (JSON)", KT_FILE_SIZE_MAX, true};
const kt_file_kind kt_input_checkpoint = {"a checkpoint", "a checkpoint of `run --checkpoint`", SIZE_MAX, false};
const kt_file_kind kt_input_lines = {"a sweep", "a file with lines of a sweep (CSV)", SIZE_MAX, true};
const kt_file_kind kt_input_scene = {"a scene", "a scene file", KT_FILE_SIZE_MAX, false};

kt_status kt_input_read(const char *path, const kt_file_kind *kind, char **text, size_t *size, kt_error *error) {
    if (strcmp(path, "-") != 0)
        return kt_file_read_as(path, kind, text, size, error);
    return kt_file_read_open(STDIN_FILENO, "(standard input)", kind, text, size, error);
}

json_t *kt_input_json(const char *path, const char *text, size_t size, const char *what) {
    json_error_t error;
    json_t *root = json_loadb(text, size, 0, &error);
    if (root != NULL)
        return root;
    char *quoted = strstr(error.text, " near '"); /* jansson quotes the file from there on */
    if (quoted != NULL)
        *quoted = '\0';
    kt_say("%s:%d:%d: it is no %s: %s", path, error.line, error.column, what, error.text);
    return NULL;
}

FILE *kt_input_open(const char *path, const kt_file_kind *kind, kt_error *error) {
    int descriptor = -1;
    if (kt_file_open(path, kind, &descriptor, error) != KT_OK)
        return NULL;
    FILE *file = fdopen(descriptor, "r");
    if (file == NULL) {
        (void)kt_error_set(error, KT_ERROR_MEMORY, path, "there is not enough memory for the file");
        (void)close(descriptor);
    }
    return file;
}

int kt_input_line(FILE *file, kt_bytes *line) {
    int c = 0;
    line->used = 0;
    errno = 0;
    while (c != '\n' && (c = getc(file)) != EOF) {
        char *to = kt_bytes_room(line, 1);
        if (to == NULL || c == '\0' || line->used == LINE_MOST) {
            errno = to == NULL ? ENOMEM : c == '\0' ? EINVAL : EFBIG;
            return -1;
        }
        to[0] = (char)c;
        to[1] = '\0';
        line->used++;
    }
    if (c == EOF && ferror(file)) {
        errno = errno != 0 ? errno : EIO;
        return -1;
    }
    return line->used > 0;
}
