/* Result files. A result is written to NAME.partial, next to NAME, and renamed when it is complete: until then NAME
 * keeps its old content. The partial file of a failed run is also renamed if no NAME exists, and otherwise keeps its
 * name. Devices and pipes are written directly. Records, which are written as long as a run lasts, are locked against
 * other runs that would write them, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_OUTPUT_H
#define KT_COMMAND_RECORDS_OUTPUT_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef struct kt_output {
    char *name;    /* symbolic links are resolved */
    char *partial; /* NULL: `name` itself is written */
    int lock;      /* -1: none; else a descriptor that keeps the file locked until it has its name */
} kt_output;

/* Determines the names; "-" means standard output. Returns -1 on success, else an exit code after printing the error. A
 * call of kt_output_end must follow. */
int kt_output_start(kt_output *output, const char *path);
/* Returns the path of the file to write. */
const char *kt_output_path(const kt_output *output);
/* Opens the file for writing, with `flags` of open (O_CREAT, O_RDWR), and locks it until kt_output_end. Nothing of it
 * is truncated. Returns its descriptor, or -1 with errno; EBUSY: another run writes it. */
int kt_output_open(kt_output *output, int flags);

/* Opens the file as an empty stream for writing. Returns NULL with errno on failure. */
FILE *kt_output_stream(const kt_output *output);

/* Opens a file as open does, unless it is a symbolic link, and locks it against other runs for as long as it is open.
 * Returns its descriptor, or -1 with errno; EBUSY: another run has it. */
int kt_open_locked(const char *name, int flags);

/* Returns whether the name is still that of the open file. A run that has ended meanwhile has renamed its own. */
bool kt_file_is_named(int file, const char *name);

/* Returns the name behind symbolic links, which need not exist. The caller frees it. NULL, with errno: the links lead
 * round, or memory is insufficient. */
char *kt_follow_links(const char *path);

/* Returns three texts as one, which the caller frees. NULL: not enough memory. */
char *kt_join_texts(const char *a, const char *b, const char *c);

/* Returns the folder of a file: "." if the path names none. The caller frees it. NULL: not enough memory. */
char *kt_folder_of(const char *path);

/* Flushes a file's name to the disk, if the file system can. The file then survives a crash of the system. */
void kt_sync_folder(const char *path);

typedef enum kt_output_fate {
    KT_OUTPUT_WHOLE,   /* renamed to its name */
    KT_OUTPUT_PART,    /* renamed if that name is free, else kept as NAME.partial: kt_part_name */
    KT_OUTPUT_AS_IS,   /* kept as NAME.partial */
    KT_OUTPUT_NOTHING, /* removed */
} kt_output_fate;

/* Ends an output. Returns 0, or -1 after printing an error if the file could not be renamed. Does nothing for an output
 * that was not started. */
int kt_output_end(kt_output *output, kt_output_fate fate);

/* Writes a result to a file, whole or not at all, or to standard output ("-"). Errors of the stream stay in it. Returns
 * KT_EXIT_DONE, or another exit code after printing the error. */
int kt_output_write(const char *path, void (*write)(FILE *file, const void *what), const void *what);

/* Does the same with a function that has errors of its own. Errors: those of `write`, KT_ERROR_FILE and
 * KT_ERROR_MEMORY. */
KT_CHECKED kt_status kt_output_fill(const char *path, kt_status (*write)(FILE *file, const void *what, kt_error *error),
                                    const void *what, kt_error *error);

/* Returns NAME.partial for the name of a result (NULL: no result), or the name itself if it is written directly ("-", a
 * device). The caller frees it. */
char *kt_partial_name(const char *path);

/* Returns the name that a partial result gets at the end: NAME if no such file exists now, else kt_partial_name. The
 * caller frees it. */
char *kt_part_name(const char *path);

/* Describes a result that is about to be replaced: appends "a.csv of 2026-01-31 12:00" to text, after ", " unless text
 * is empty. Appends nothing if there is no such file. */
void kt_note_replaced(const char *path, char *text, size_t size);

/* Returns the folder of temporary files: TMPDIR if it is an absolute path, else /tmp. */
const char *kt_temporary_folder(void);

/* Prints the name of a result that has been written ("picture"), with a remark or "", and the file that it replaces
 * unless `replaced` is empty (kt_note_replaced). */
void kt_say_written(const char *what, const char *path, const char *remark, const char *replaced);

/* Returns the length of a file's name before its ending, one of those in `endings` (".svg|.png"), in letters of any
 * case; -1 if it has none of them, or is NULL. */
ptrdiff_t kt_stem_length(const char *path, const char *endings);

/* Prints an error if the ending of a result's name does not match its format. path: NULL, or as given to the option.
 * Devices may have any name. Returns -1 if there is no error, else KT_EXIT_USAGE. */
int kt_check_ending(const char *option, const char *path, const char *ending);

/* Does the same for records. Names of records may have any ending except those of pages, pictures, glTF files,
 * summaries and scenes. */
int kt_check_records(const char *path);

/* Does the same for the lines of a sweep. */
int kt_check_lines(const char *path);

/* Does the same for summaries. Names of summaries may have any ending except those of records and scenes. */
int kt_check_summary(const char *path);

/* A file that a command reads or writes, with the name given by the user; NULL: none. */
typedef struct kt_file_use {
    const char *what; /* "the scene", "--summary" */
    const char *path;
    bool is_written;
} kt_file_use;

/* Prints an error if a result would overwrite another result or an input, even under a different name. Also prints an
 * error if a result could not be written at the end. Returns -1 if there is no error, else an exit code. */
int kt_check_files(const char *command, const kt_file_use *uses, int count);
/* Does the same for the result of one option, and one input. */
int kt_check_result(const char *command, const char *what, const char *input, const char *option, const char *path);

/* Prints an error if a result of any call of kt_check_files would overwrite this input, which only the scene names.
 * Later calls of kt_check_files reject such results, too. path: NULL if there is none. Returns -1 if there is no error,
 * else an exit code. */
int kt_check_input(const char *what, const char *path);

#endif
