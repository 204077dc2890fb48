/* The files that results go to. A result is written to NAME.partial, beside NAME, and renamed when it is whole: what
 * NAME held before stays until then. The part that a failed run has left is renamed too where there is no NAME yet, and
 * else keeps the name it has. Devices and pipes are written as they are. */
#ifndef KT_COMMAND_OUTPUT_H
#define KT_COMMAND_OUTPUT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct kt_output {
    char *name;    /* links followed */
    char *partial; /* NULL: `name` itself is written */
} kt_output;

/* Finds the names; "-" is no file. Returns -1 to go on, or an exit code after saying why. Ended by kt_output_end. */
int kt_output_start(kt_output *output, const char *path);
/* The file to write now. */
const char *kt_output_path(const kt_output *output);

typedef enum kt_output_fate {
    KT_OUTPUT_WHOLE,   /* renamed to its name */
    KT_OUTPUT_PART,    /* renamed where that name is free, else kept as NAME.partial: kt_part_name */
    KT_OUTPUT_AS_IS,   /* kept as NAME.partial */
    KT_OUTPUT_NOTHING, /* removed */
} kt_output_fate;

/* Returns 0, or -1 where it could not be renamed, which has been said. Does nothing for what was not started. */
int kt_output_end(kt_output *output, kt_output_fate fate);

/* NAME.partial for the name of a result (NULL: none), or the name itself where that is written as it is ("-", a
 * device). The caller frees it. */
char *kt_partial_name(const char *path);

/* The name that a part gets in the end: NAME where there is no such file now, else kt_partial_name. The caller frees
 * it. */
char *kt_part_name(const char *path);

/* Of a result that is about to be replaced: "a.csv of 2026-01-31 12:00", appended to text after ", " or at its begin.
 * Nothing where there is no such file. */
void kt_note_replaced(const char *path, char *text, size_t size);

/* A file that a command reads or writes, as it was named; NULL: none. */
typedef struct kt_file_use {
    const char *what; /* "the scene", "--summary" */
    const char *path;
    bool is_written;
} kt_file_use;

/* Says where a result would be another result or something that is read, by whatever name; and where one could not be
 * written in the end. Returns -1 to go on, or an exit code. */
int kt_check_files(const char *command, const kt_file_use *uses, int count);

#endif
