/* Records of runs in one HDF5 file. During the runs, the records are in a side file, FILE.partial, as plain numbers. A
 * run that has been added survives the end of this process. The HDF5 file is made from the side file at the end, run by
 * run. The contents of that file are therefore the same with and without a break. */
/* SPDX-License-Identifier: Apache-2.0 */
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
    long begin; /* offset at which the run that is being added begins */
} kt_keep;

/* The head of a run in the side file. */
typedef struct kt_kept_run {
    int64_t run, status; /* the run's number; kt_exit_code */
    int64_t rows, columns;
} kt_kept_run;

/* Examine the name of a file of records. The first function returns whether the name ends as HDF5 does (.h5, .hdf5).
 * The second function returns -1 if this program can write HDF5, else an exit code after printing the error. */
bool kt_keep_is_meant(const char *path);
int kt_keep_check(const char *path);

/* Opens the side file: empty, or (resume) with its present content. Returns -1, or an exit code after printing the
 * error. A call of kt_keep_end must follow. */
int kt_keep_open(kt_keep *keep, const char *path, bool resume);

/* Cuts the side file off before the first run that is incomplete, is out of the order first, first + 1, ..., or reaches
 * `end`. *next: this run. Returns -1, or an exit code after printing the error. */
int kt_keep_resume(kt_keep *keep, int64_t first, int64_t end, int64_t *next);

/* Add a run, and its records with one number for each of `columns`. kt_keep_close_run writes the run to the file. Each
 * returns 0, or -1 after printing the error. */
int kt_keep_begin(kt_keep *keep, int64_t run);
int kt_keep_rows(kt_keep *keep, const double *numbers, size_t rows, size_t columns);
int kt_keep_close_run(kt_keep *keep, int64_t run, int64_t status, size_t rows, size_t columns);

/* The names and attributes of the runs in the HDF5 file. */
typedef struct kt_keep_words {
    const char *const *columns, *const *units; /* names and units of the columns of all runs */
    size_t column_count;
    const char *const *names; /* names of the numbers that each run has as attributes */
    size_t name_count;
    void (*values)(const void *user, int64_t run, double *values); /* theirs */
    const void *user;
    const char *only; /* NULL: a dataset runs/N for each run; else the name of the dataset of the only one */
} kt_keep_words;

/* Ends the side file. For KT_OUTPUT_WHOLE and KT_OUTPUT_PART, it makes the HDF5 file and removes the side file. The
 * name for KT_OUTPUT_PART is that of kt_part_name. KT_OUTPUT_AS_IS keeps the side file, unless it is empty. Returns 0,
 * or -1 after printing the error. Does nothing if nothing was opened. */
int kt_keep_end(kt_keep *keep, const kt_keep_words *words, kt_output_fate fate);

/* Writes the HDF5 file from an open side file (hdf5.c; no_hdf5.c if the program is built without HDF5). Returns 0, or
 * -1 after printing the error. */
int kt_hdf5_write(const char *path, FILE *file, const kt_keep_words *words);

/* Adds the runs of an HDF5 file to a table. If there are too many, it adds an even selection and reports this. Returns
 * -1, or an exit code after printing the error. */
int kt_hdf5_read(const char *path, kt_table *table);

/* Reads one or more files with equal columns, and every run of HDF5 files (keep.h). Returns as kt_table_read_file. */
int kt_table_read_files(char *const *paths, int count, kt_table *table);

#endif
