/* The side file of records that become HDF5: runs one after the other, a head (kt_kept_run) and its rows each. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/keep.h"
#include "command.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool kt_keep_is_meant(const char *path) { return kt_stem_length(path, ".h5|.hdf5") >= 0; }

static int say(const kt_keep *keep, const char *what) {
    kt_say("%s %s: %s", kt_output_path(&keep->output), what, strerror(errno));
    return -1;
}

int kt_keep_open(kt_keep *keep, const char *path, bool resume) {
    *keep = (kt_keep){.output.lock = -1};
    int code = kt_keep_check(path);
    if (code < 0)
        code = kt_output_start(&keep->output, path);
    if (code >= 0)
        return code;
    if (keep->output.partial == NULL)
        return kt_misuse("%s: HDF5 is written to a file alone, not to a stream or a device", path);
    const int descriptor = kt_output_open(&keep->output, O_CREAT | O_RDWR);
    keep->file = descriptor >= 0 ? fdopen(descriptor, "r+") : NULL;
    if (keep->file != NULL && (resume || ftruncate(descriptor, 0) == 0))
        return -1;
    return kt_reject(KT_EXIT_INTEGRATION, "%s cannot be written: %s", path,
                     errno == EBUSY ? "another run is writing it" : strerror(errno));
}

int kt_keep_resume(kt_keep *keep, int64_t first, int64_t end, int64_t *next) {
    kt_kept_run head;
    long whole = 0, size = 0;
    *next = first;
    if (fseek(keep->file, 0, SEEK_END) == 0)
        size = ftell(keep->file);
    rewind(keep->file);
    while (*next < end && fread(&head, sizeof head, 1, keep->file) == 1 && head.run == *next && head.rows >= 0 &&
           head.columns >= 0) {
        const int64_t room = (size - whole - (long)sizeof head) / (long)sizeof(double);
        if (head.columns > 0 && head.rows > room / head.columns)
            break;
        whole += (long)sizeof head + (long)(head.rows * head.columns) * (long)sizeof(double);
        ++*next;
        if (fseek(keep->file, whole, SEEK_SET) != 0)
            break;
    }
    if (fseek(keep->file, whole, SEEK_SET) == 0 && ftruncate(fileno(keep->file), whole) == 0)
        return -1;
    (void)say(keep, "cannot be continued");
    return KT_EXIT_INTEGRATION;
}

int kt_keep_begin(kt_keep *keep, int64_t run) {
    const kt_kept_run head = {.run = run, .rows = -1}; /* not whole yet */
    if (keep->file == NULL)
        return 0;
    keep->begin = ftell(keep->file);
    return keep->begin >= 0 && fwrite(&head, sizeof head, 1, keep->file) == 1 ? 0 : say(keep, "cannot be written");
}

int kt_keep_rows(kt_keep *keep, const double *numbers, size_t rows, size_t columns) {
    if (keep->file == NULL || rows * columns == 0)
        return 0;
    return fwrite(numbers, sizeof *numbers, rows * columns, keep->file) == rows * columns
               ? 0
               : say(keep, "cannot be written");
}

/* Writes the head of a run, after its records. Without the head the run is not whole. */
int kt_keep_close_run(kt_keep *keep, int64_t run, int64_t status, size_t rows, size_t columns) {
    const kt_kept_run head = {.run = run, .status = status, .rows = (int64_t)rows, .columns = (int64_t)columns};
    if (keep->file == NULL)
        return 0;
    if (fflush(keep->file) == 0 && fseek(keep->file, keep->begin, SEEK_SET) == 0 &&
        fwrite(&head, sizeof head, 1, keep->file) == 1 && fflush(keep->file) == 0 &&
        fseek(keep->file, 0, SEEK_END) == 0)
        return 0;
    return say(keep, "cannot be written");
}

/* Makes the HDF5 file. It has the name NAME.new until it is whole. A partial result gets the name of the side file if
 * an earlier result has the name. */
static int make_file(kt_keep *keep, const kt_keep_words *words, bool whole) {
    char *name = kt_join_texts(keep->output.name, ".new", ""), *part = kt_part_name(keep->output.name);
    int failed = name == NULL || part == NULL ? -1 : 0;
    const char *final = whole ? keep->output.name : part;
    if (failed != 0)
        kt_say("there is not enough memory");
    rewind(keep->file);
    if (failed == 0)
        (void)unlink(name); /* a link of this name is not followed */
    if (failed == 0)
        failed = kt_hdf5_write(name, keep->file, words);
    if (failed == 0 && rename(name, final) != 0) {
        kt_say("%s cannot be written: %s", final, strerror(errno));
        failed = -1;
    }
    if (failed == 0 && strcmp(final, keep->output.partial) != 0)
        (void)unlink(keep->output.partial);
    else if (failed != 0 && name != NULL)
        (void)unlink(name);
    free(name);
    free(part);
    return failed;
}

int kt_keep_end(kt_keep *keep, const kt_keep_words *words, kt_output_fate fate) {
    int failed = 0;
    if (keep->file != NULL) {
        const bool is_empty = fseek(keep->file, 0, SEEK_END) == 0 && ftell(keep->file) == 0;
        if (fate == KT_OUTPUT_WHOLE || fate == KT_OUTPUT_PART)
            failed = make_file(keep, words, fate == KT_OUTPUT_WHOLE);
        (void)fclose(keep->file);
        keep->file = NULL;
        fate = fate == KT_OUTPUT_NOTHING || (fate == KT_OUTPUT_AS_IS && is_empty) ? KT_OUTPUT_NOTHING : KT_OUTPUT_AS_IS;
    }
    return kt_output_end(&keep->output, fate) != 0 ? -1 : failed;
}
