/* Writes records as CSV. */
#include "subcommands/run.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NUMBER_SIZE = 32 };

/* ---- the columns ------------------------------------------------------------------------------------------------- */

/* Makes room for a cell of `length` bytes, with a comma before and a zero after it. Returns where it goes; NULL: memory
 * is insufficient. */
static char *start_cell(kt_lines *lines, size_t length) {
    if (!kt_lines_make_room(lines, length + 2))
        return NULL;
    if (lines->used > lines->whole)
        lines->text[lines->used++] = ',';
    return lines->text + lines->used;
}

static void add_header(kt_csv *csv) {
    for (size_t i = 0; i < csv->columns->count; i++) {
        const int length = kt_column_name(csv->columns, i, NULL, 0);
        char *cell = start_cell(&csv->lines, (size_t)length);
        if (cell != NULL)
            csv->lines.used += (size_t)kt_column_name(csv->columns, i, cell, (size_t)length + 1);
    }
}

static void add_line(kt_csv *csv, const double *values) {
    for (size_t i = 0; i < csv->columns->count; i++) {
        char *cell = start_cell(&csv->lines, NUMBER_SIZE);
        if (cell != NULL)
            csv->lines.used += (size_t)snprintf(cell, NUMBER_SIZE, "%.17g", values[i]);
    }
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

static void say_not_open(const char *name, int reason) {
    kt_say("%s cannot be written: %s; --out FILE writes elsewhere", name,
           reason == EBUSY ? "another run is writing it" : strerror(reason));
}

int kt_csv_open(kt_csv *csv, const char *path, const kt_columns *columns) {
    *csv = (kt_csv){.columns = columns, .lines.file = -1};
    if (path == NULL)
        return -1;
    int code = kt_output_start(&csv->output, path);
    if (code >= 0)
        return code;
    const char *name = kt_output_path(&csv->output);
    int file = strcmp(path, "-") == 0 ? STDOUT_FILENO : kt_output_open(&csv->output, O_WRONLY | O_CREAT);
    if (file < 0 || (csv->output.partial != NULL && ftruncate(file, 0) != 0)) {
        say_not_open(name, errno);
        if (file >= 0)
            (void)close(file);
        (void)kt_output_end(&csv->output, KT_OUTPUT_AS_IS);
        return KT_EXIT_INTEGRATION;
    }
    kt_lines_start(&csv->lines, file, path, 0);
    add_header(csv);
    if (kt_lines_end(&csv->lines) == 0)
        return -1;
    (void)kt_csv_close(csv, KT_OUTPUT_NOTHING);
    return KT_EXIT_INTEGRATION;
}

int kt_csv_close(kt_csv *csv, kt_output_fate fate) {
    const int failed = kt_lines_close(&csv->lines);
    if (failed != 0 && fate == KT_OUTPUT_WHOLE)
        fate = KT_OUTPUT_PART;
    return kt_output_end(&csv->output, fate) != 0 ? -1 : failed;
}

/* Returns whether the file begins with the line that is being built (the header). */
static bool begins_with_line(const kt_lines *lines) {
    char *text = malloc(lines->used + 1);
    bool same = text != NULL && pread(lines->file, text, lines->used + 1, 0) >= (ssize_t)lines->used &&
                memcmp(text, lines->text, lines->used) == 0 && text[lines->used] == '\n';
    free(text);
    return same;
}

/* Copies at most `size` bytes to a new file. Returns its descriptor, or -1. */
static int copy_beginning(const char *from, const char *to, long long size) {
    char block[1 << 16];
    FILE *in = fopen(from, "rb"), *out = in != NULL ? fopen(to, "wb") : NULL;
    bool fine = out != NULL;
    size_t count = 1;
    while (fine && size > 0 && count > 0) {
        count = fread(block, 1, size < (long long)sizeof block ? (size_t)size : sizeof block, in);
        fine = !ferror(in) && fwrite(block, 1, count, out) == count;
        size -= (long long)count;
    }
    if (in != NULL)
        (void)fclose(in);
    if (out != NULL)
        fine = fclose(out) == 0 && fine;
    return fine ? open(to, O_RDWR | O_CLOEXEC) : -1;
}

/* Opens the records up to the checkpoint: the partial file that an interrupted run has left, or else a copy of the
 * first bytes of a finished result, whose remainder is computed again; then *copied is true. */
static int open_beginning(kt_output *output, long long written, bool *copied) {
    const int file = kt_output_open(output, O_RDWR);
    *copied = file < 0 && errno == ENOENT && output->partial != NULL && access(output->name, R_OK) == 0;
    return *copied ? copy_beginning(output->name, output->partial, written) : file;
}

int kt_csv_reopen(kt_csv *csv, const char *path, const kt_columns *columns, long long written) {
    struct stat status;
    *csv = (kt_csv){.columns = columns, .lines.file = -1};
    int code = kt_output_start(&csv->output, path);
    if (code >= 0)
        return code;
    const char *name = kt_output_path(&csv->output);
    bool copied;
    int file = open_beginning(&csv->output, written, &copied);
    if (file < 0) {
        const int reason = errno;
        if (reason == EBUSY)
            say_not_open(name, reason);
        else
            kt_say("%s, the records until the checkpoint, cannot be opened: %s", path, strerror(reason));
        (void)kt_output_end(&csv->output, KT_OUTPUT_AS_IS);
        return reason == EBUSY ? KT_EXIT_INTEGRATION : KT_EXIT_USAGE;
    }
    kt_lines *lines = &csv->lines;
    kt_lines_start(lines, file, path, written);
    add_header(csv);
    const char *wrong = NULL;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size < written || lines->full ||
        !begins_with_line(lines))
        wrong = "these are not the records until the checkpoint; give the --out of the run that wrote it";
    else if (ftruncate(file, written) != 0 || lseek(file, written, SEEK_SET) != written)
        wrong = strerror(errno);
    lines->used = 0;
    if (wrong == NULL)
        return -1;
    kt_say("%s: %s", copied ? path : name, wrong);
    (void)kt_csv_close(csv, copied ? KT_OUTPUT_NOTHING : KT_OUTPUT_AS_IS);
    return KT_EXIT_USAGE;
}

int kt_csv_write(kt_csv *csv, const double *values) {
    if (csv->output.name == NULL)
        return 0;
    add_line(csv, values);
    return kt_lines_end(&csv->lines);
}
