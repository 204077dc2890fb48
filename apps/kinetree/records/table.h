/* Tables of numbers from CSV files. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_TABLE_H
#define KT_COMMAND_RECORDS_TABLE_H

#include <stddef.h>

/* Several results in one table, one below the other with a row of NaN between them. */
typedef struct kt_table_part {
    char name[96]; /* "a.csv", "run 3" */
    size_t first, rows;
} kt_table_part;

typedef struct kt_table {
    char *text;    /* content of the file; the header is split into names */
    char **names;  /* `columns` pointers into text */
    double *cells; /* column-major; NaN if a cell is not a number */
    int columns;
    size_t rows;
    kt_table_part *parts; /* NULL: one result */
    size_t part_count;
} kt_table;

enum { KT_TABLE_COLUMNS_MOST = 1 << 20, KT_TABLE_NUMBERS_MOST = 1 << 27 /* 1 GiB */ };

/* Reads a file ("-": standard input) whose first line names its columns. Returns -1 on success, and then the caller
 * releases the table with kt_table_free, or KT_EXIT_SCENE after printing the error with its location. */
int kt_table_read_file(const char *path, kt_table *table);
/* Does the same with the text of a file, which ends in a zero and belongs to the table from then on. */
int kt_table_parse(const char *path, char *text, kt_table *table);
void kt_table_free(kt_table *table);

/* Puts the rows of a table below another, and releases it. Returns -1, or KT_EXIT_SCENE after printing the error. */
int kt_table_join(kt_table *table, kt_table *below, const char *name);

/* Returns a column of `rows` numbers; NULL: there is none of this name. */
const double *kt_table_column(const kt_table *table, const char *name);

#endif
