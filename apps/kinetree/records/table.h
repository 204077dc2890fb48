/* Tables of numbers from CSV files. */
#ifndef KT_COMMAND_RECORDS_TABLE_H
#define KT_COMMAND_RECORDS_TABLE_H

#include <stddef.h>

typedef struct kt_table {
    char *text;    /* content of the file; the header is split into names */
    char **names;  /* `columns` pointers into text */
    double *cells; /* column-major; NaN if a cell is not a number */
    int columns;
    size_t rows;
} kt_table;

/* Reads a file ("-": standard input) whose first line names its columns. Returns -1 on success, and then the caller
 * releases the table with kt_table_free, or KT_EXIT_SCENE after printing the error with its location. */
int kt_table_read_file(const char *path, kt_table *table);
void kt_table_free(kt_table *table);

/* Returns a column of `rows` numbers; NULL: there is none of this name. */
const double *kt_table_column(const kt_table *table, const char *name);

#endif
