/* Writes records as CSV. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include "text/digits.h"

#include "base/sum.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- the columns ------------------------------------------------------------------------------------------------- */

/* Makes room for a cell of `length` bytes, with a comma before and a zero after it. Returns where it goes; NULL: memory
 * is insufficient. */
static char *start_cell(kt_lines *lines, size_t length) {
    char *cell = kt_bytes_room(&lines->buffer, length + 1);
    if (cell != NULL && lines->buffer.used > lines->whole) {
        *cell++ = ',';
        lines->buffer.used++;
    }
    return cell;
}

static void add_header(kt_csv *csv) {
    for (size_t i = 0; i < csv->columns->count; i++) {
        const int length = kt_column_header(csv->columns, i, NULL, 0);
        char *cell = start_cell(&csv->lines, (size_t)length);
        if (cell != NULL)
            csv->lines.buffer.used += (size_t)kt_column_header(csv->columns, i, cell, (size_t)length + 1);
    }
}

static void add_csv_line(kt_csv *csv, const double *values) {
    for (size_t i = 0; i < csv->columns->count; i++) {
        char *cell = start_cell(&csv->lines, KT_DIGITS_SIZE);
        if (cell != NULL)
            csv->lines.buffer.used += (size_t)(isnan(values[i]) ? snprintf(cell, KT_DIGITS_SIZE, "nan") /* never -nan */
                                                                : kt_digits_write(cell, values[i]));
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
    /* Checkpoints read the written records back if the output is a file. */
    const int mode = csv->output.partial != NULL ? O_RDWR : O_WRONLY;
    int file = strcmp(path, "-") == 0 ? STDOUT_FILENO : kt_output_open(&csv->output, mode | O_CREAT);
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
    char *text = malloc(lines->buffer.used + 1);
    bool same = text != NULL && pread(lines->file, text, lines->buffer.used + 1, 0) >= (ssize_t)lines->buffer.used &&
                memcmp(text, lines->buffer.text, lines->buffer.used) == 0 && text[lines->buffer.used] == '\n';
    free(text);
    return same;
}

/* Copies at most `size` bytes of a file to an empty one. */
static bool copy_beginning(const char *from, int to, long long size) {
    char block[1 << 16];
    const int in = open(from, O_RDONLY | O_CLOEXEC);
    bool fine = in >= 0;
    for (ssize_t count = 1; fine && size > 0 && count > 0; size -= count) {
        count = read(in, block, size < (long long)sizeof block ? (size_t)size : sizeof block);
        fine = count >= 0 && write(to, block, (size_t)count) == count;
    }
    if (in >= 0)
        (void)close(in);
    return fine;
}

/* Opens the records up to the checkpoint. They are the partial file of an interrupted run, or else a copy of the first
 * bytes of a finished result. In the latter case, *copied is true, and the run computes the remainder again. */
static int open_beginning(kt_output *output, long long written, bool *copied) {
    int file = kt_output_open(output, O_RDWR);
    *copied = file < 0 && errno == ENOENT && output->partial != NULL && access(output->name, R_OK) == 0;
    if (!*copied)
        return file;
    file = kt_output_open(output, O_RDWR | O_CREAT);
    if (file < 0 || (ftruncate(file, 0) == 0 && copy_beginning(output->name, file, written)))
        return file;
    (void)close(file);
    return -1;
}

bool kt_csv_sum(int file, long long from, long long to, uint64_t *sum) {
    char block[1 << 16];
    while (from < to) {
        const size_t most = to - from < (long long)sizeof block ? (size_t)(to - from) : sizeof block;
        const ssize_t count = pread(file, block, most, (off_t)from);
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            return false;
        *sum = kt_sum_add(*sum, block, (size_t)count);
        from += count;
    }
    return true;
}

/* Returns NULL if the file holds the records that a checkpoint belongs to, from its first byte on. Otherwise returns
 * the text of the error. */
static const char *find_fault(const kt_lines *lines, const kt_written *before) {
    struct stat status;
    uint64_t sum = KT_SUM_START;
    if (fstat(lines->file, &status) != 0 || !S_ISREG(status.st_mode) || lines->buffer.is_short ||
        !begins_with_line(lines))
        return "the file does not have the records until the checkpoint: other columns, or no records; give the --out "
               "of the "
               "run that wrote it";
    if (status.st_size < before->bytes)
        return "the file does not have the records until the checkpoint: they are fewer; give the --out of the run "
               "that wrote "
               "it";
    if (!kt_csv_sum(lines->file, 0, before->bytes, &sum) || sum != before->sum)
        return "the file does not have the records until the checkpoint: another run has written over them; give the "
               "--out of "
               "the run that wrote it, or begin anew without --resume";
    return NULL;
}

int kt_csv_reopen(kt_csv *csv, const char *path, const kt_columns *columns, const kt_written *before) {
    *csv = (kt_csv){.columns = columns, .lines.file = -1};
    int code = kt_output_start(&csv->output, path);
    if (code >= 0)
        return code;
    const char *name = kt_output_path(&csv->output);
    bool copied;
    int file = open_beginning(&csv->output, before->bytes, &copied);
    if (file < 0) {
        const int reason = errno;
        if (reason == EBUSY)
            say_not_open(name, reason);
        else
            kt_say("%s, the records until the checkpoint, cannot be opened: %s", path, strerror(reason));
        (void)kt_output_end(&csv->output, copied ? KT_OUTPUT_NOTHING : KT_OUTPUT_AS_IS);
        return reason == EBUSY ? KT_EXIT_INTEGRATION : KT_EXIT_USAGE;
    }
    kt_lines *lines = &csv->lines;
    kt_lines_start(lines, file, path, before->bytes);
    add_header(csv);
    const char *wrong = find_fault(lines, before);
    if (wrong == NULL && (ftruncate(file, before->bytes) != 0 || lseek(file, before->bytes, SEEK_SET) != before->bytes))
        wrong = strerror(errno);
    lines->buffer.used = 0;
    if (wrong == NULL)
        return -1;
    kt_say("%s: %s", copied ? path : name, wrong);
    (void)kt_csv_close(csv, copied ? KT_OUTPUT_NOTHING : KT_OUTPUT_AS_IS);
    return KT_EXIT_USAGE;
}

int kt_csv_write(kt_csv *csv, const double *values) {
    if (csv->output.name == NULL)
        return 0;
    add_csv_line(csv, values);
    return kt_lines_end(&csv->lines);
}
