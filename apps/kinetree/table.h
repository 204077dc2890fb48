/* Tables of numbers from CSV files, and lists of words and numbers from the command line. */
#ifndef KT_COMMAND_TABLE_H
#define KT_COMMAND_TABLE_H

#include <stddef.h>

typedef struct kt_table {
    char *text;    /* the header, cut into names */
    char **names;  /* `columns` */
    double *cells; /* column by column; NaN where there is no number */
    int columns;
    size_t rows;
} kt_table;

/* Reads a file ("-": standard input) whose first line names its columns. Returns -1 to go on, and then it is released
 * with kt_table_free, or KT_EXIT_SCENE after saying what is wrong where. */
int kt_table_read_file(const char *path, kt_table *table);
void kt_table_free(kt_table *table);

/* A column; NULL: there is none of this name. */
const double *kt_table_column(const kt_table *table, const char *name);

/* Cuts the next word off a list with commas; NULL at its end. */
char *kt_next_word(char **rest);

/* A list of at most `most` numbers above zero; says what is wrong as option `name` of `command`. Returns how many, or
 * -1.
 */
int kt_list_read(const char *command, const char *name, const char *list, double *numbers, int most);

#endif
