/* Records of runs in one HDF5 file. As long as runs last they are in a side file, FILE.partial, of plain numbers: a run that
 * has been added stays there whatever becomes of this process. The HDF5 file is made of it at the end, run by run, so that
 * its contents are the same whether or not there was a break. */
#ifndef KT_COMMAND_RECORDS_KEEP_H
#define KT_COMMAND_RECORDS_KEEP_H

#include "records/output.h"
#include "records/table.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef struct kt_keep {
    kt_output output;
    FILE *file; /* the side file; NULL: nothing is kept */
    long begin; /* of the run that is being added */
} kt_keep;

/* What stands at the head of a run in the side file. */
typedef struct kt_kept_run {
    int64_t run, status; /* its number; kt_exit_code */
    int64_t rows, columns;
} kt_kept_run;

/* Whether a name asks for HDF5 (.h5, .hdf5); whether this program can write it: if not, says so. */
bool kt_keep_is_meant(const char *path);
int kt_keep_check(const char *path);

/* Opens the side file, empty or with what is there. Returns -1, or an exit code after printing the error. kt_keep_end must
 * follow. */
int kt_keep_open(kt_keep *keep, const char *path, bool resume);

/* Ends the side file before the first run that is not among first, first + 1, ... or not whole, or not before `end`; *next is
 * that run. Returns -1 or an exit code. */
int kt_keep_resume(kt_keep *keep, int64_t first, int64_t end, int64_t *next);

/* A run, and its records, a number for each of `columns`. The last one writes it out. Each returns 0, or -1 after printing the
 * error. */
int kt_keep_begin(kt_keep *keep, int64_t run);
int kt_keep_rows(kt_keep *keep, const double *numbers, size_t rows, size_t columns);
int kt_keep_close_run(kt_keep *keep, int64_t run, int64_t status, size_t rows, size_t columns);

/* What the HDF5 file says of its runs. */
typedef struct kt_keep_words {
    const char *const *columns, *const *units; /* of the columns of all runs */
    size_t column_count;
    const char *const *names; /* of the numbers that each run has as attributes */
    size_t name_count;
    void (*values)(const void *user, int64_t run, double *values); /* theirs */
    const void *user;
    const char *lanes; /* NULL, or how all runs were computed: an attribute of their group */
    const char *only;  /* NULL: a dataset runs/N for each run; else the name of the dataset of the only one */
} kt_keep_words;

/* Makes the HDF5 file where the fate is KT_OUTPUT_WHOLE, or KT_OUTPUT_PART: then under a name as of kt_part_name; and removes
 * the side file. KT_OUTPUT_AS_IS leaves that, unless it is empty. Returns 0, or -1 after printing the error. Does nothing if
 * nothing was opened. */
int kt_keep_end(kt_keep *keep, const kt_keep_words *words, kt_output_fate fate);

/* The HDF5 file, from an open side file (hdf5.c, or no_hdf5.c where the program is built without). Returns 0, or -1 after
 * printing the error. */
int kt_hdf5_write(const char *path, FILE *file, const kt_keep_words *words);
extern const bool kt_hdf5_is_there;

/* Adds the runs of such a file to a table; of very many some, evenly chosen, which is told. Returns -1, or an exit code after printing the error. */
int kt_hdf5_read(const char *path, kt_table *table);

/* Reads several files, whose columns must be the same, and of HDF5 files (keep.h) every run; one file, too. Returns as
 * kt_table_read_file. */
int kt_table_read_files(char *const *paths, int count, kt_table *table);

#endif
