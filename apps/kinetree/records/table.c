/* Reads CSV files into columns. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/table.h"

#include "command.h"
#include "text/input.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int say_no_memory(void) { return kt_reject(KT_EXIT_SCENE, "there is not enough memory for the table"); }

/* Returns the length of words in quotes. A quote within the words is doubled. */
static size_t length_of_quoted(const char *at) {
    const char *end = at + 1;
    while (*end != '\0' && (*end != '"' || end[1] == '"'))
        end += *end == '"' ? 2 : 1;
    return (size_t)(end - at) + (*end == '"');
}

/* Returns the length of a name in the header. Names in quotes may contain commas. */
static size_t length_of_name(const char *at) {
    const size_t quoted = *at == '"' ? length_of_quoted(at) : 0;
    return quoted + strcspn(at + quoted, ",");
}

/* Splits the header into names, without their quotes. Returns the start of the lines below it. */
static char *split_header(kt_table *table) {
    char *const first = kt_behind_mark(table->text);
    char *end = first + strcspn(first, "\n"), *lines = *end != '\0' ? end + 1 : end;
    *end = '\0';
    if (end > first && end[-1] == '\r')
        end[-1] = '\0';
    table->columns = 1;
    for (const char *c = first + length_of_name(first); *c != '\0'; c += 1 + length_of_name(c + 1))
        table->columns++;
    if (table->columns > KT_TABLE_COLUMNS_MOST)
        return lines;
    table->names = calloc((size_t)table->columns, sizeof *table->names);
    char *name = first;
    for (int i = 0; table->names != NULL && i < table->columns; i++) {
        const size_t length = length_of_name(name);
        char *next = name + length;
        if (*next != '\0')
            *next++ = '\0';
        const bool is_quoted = length > 1 && name[0] == '"' && name[length - 1] == '"';
        if (is_quoted)
            name[length - 1] = '\0';
        table->names[i] = name + is_quoted;
        name = next;
    }
    return lines;
}

/* The cells of a column. Words in quotes and empty cells are not counted: columns of messages have them. */
typedef struct column_content {
    size_t numbers, words, line; /* the line of the first word */
    const char *first;           /* the first word in the text */
    int length;
} column_content;

static void count_cell(column_content *content, bool is_number, const char *at, size_t length, size_t line) {
    content->numbers += is_number;
    if (is_number || length == 0 || *at == '"')
        return;
    if (content->words++ == 0) {
        content->line = line;
        content->first = at;
        content->length = length < 40 ? (int)length : 40;
    }
}

/* Reports words among the numbers of a column. A column without a number is one of words. */
static void say_words(const char *path, const kt_table *table, const column_content *content) {
    for (int i = 0; i < table->columns; i++) {
        const column_content *c = &content[i];
        char word[64];
        if (c->words == 0 || c->numbers == 0)
            continue;
        (void)snprintf(word, sizeof word, "%.*s", c->length, c->first);
        kt_say("%s:%zu: warning: '%s' in column '%s' is not a number and counts as an empty cell (%zu %s)", path,
               c->line, kt_show(word).text, kt_show(table->names[i]).text, c->words,
               c->words == 1 ? "cell in all" : "cells in all");
    }
}

/* Returns whether a cell is a number. strtod alone would skip newlines in search of one, so that a file of empty lines
 * took a time proportional to its square. */
static bool read_cell(const char *at, size_t length, double *value) {
    const size_t blank = strspn(at, " \t");
    char *end;
    if (blank >= length || strchr("\v\f", at[blank]) != NULL)
        return false;
    *value = strtod(at + blank, &end);
    return end == at + length;
}

/* Reads one line into row `row`. Returns the start of the next line, or NULL after printing the error. */
static const char *read_line(const char *path, kt_table *table, size_t row, size_t most, const char *at,
                             column_content *content) {
    for (int column = 0; column < table->columns; column++) {
        double value;
        const size_t length = *at == '"' ? length_of_quoted(at) : strcspn(at, ",\r\n");
        const bool is_number = read_cell(at, length, &value);
        const bool is_last = column + 1 == table->columns;
        if ((at[length] == ',') == is_last) {
            kt_say("%s:%zu: %s than the %d cells that the first line has names for", path, row + 2,
                   is_last ? "more" : "fewer", table->columns);
            return NULL;
        }
        table->cells[(size_t)column * most + row] = is_number ? value : (double)NAN;
        count_cell(&content[column], is_number, at, length, row + 2);
        at += length + (is_last ? 0 : 1);
    }
    const char *const end = at + strspn(at, "\r");
    if (*end != '\n' && *end != '\0') { /* read_cells counts rows at newlines */
        kt_say("%s:%zu: %s; rows end in a newline", path, row + 2,
               end > at ? "a carriage return without a newline is within the row" : "text follows a cell in quotes");
        return NULL;
    }
    return *end == '\n' ? end + 1 : end;
}

/* Reads all lines. Returns -1, or KT_EXIT_SCENE after printing the error. */
static int read_lines(const char *path, kt_table *table, size_t most, const char *lines) {
    column_content *content = calloc((size_t)table->columns, sizeof *content);
    if (content == NULL)
        return say_no_memory();
    const char *at = lines;
    while (at != NULL && *at != '\0') {
        at = read_line(path, table, table->rows, most, at, content);
        table->rows += at != NULL;
    }
    size_t numbers = 0;
    for (int i = 0; i < table->columns; i++)
        numbers += content[i].numbers;
    if (at != NULL && numbers == 0) {
        kt_say("%s: there are no lines of numbers in it", path);
        at = NULL;
    }
    if (at != NULL)
        say_words(path, table, content);
    free(content);
    return at != NULL ? -1 : KT_EXIT_SCENE;
}

static int read_cells(const char *path, kt_table *table, const char *lines) {
    size_t most = 1;
    if (table->names != NULL && table->columns == 1 && strpbrk(table->names[0], ";\t :{") != NULL)
        return kt_reject(KT_EXIT_SCENE,
                         "%s:1: the first line has a single name, and no comma: this is no file of records (CSV), "
                         "which has commas between names and between cells",
                         path);
    for (const char *c = lines; *c != '\0'; c++)
        most += *c == '\n';
    if (most > KT_TABLE_NUMBERS_MOST / (size_t)table->columns)
        return kt_reject(KT_EXIT_SCENE, "%s has %zu lines of %d cells; a table has at most %d numbers", path, most,
                         table->columns, KT_TABLE_NUMBERS_MOST);
    table->cells = malloc(most * (size_t)table->columns * sizeof *table->cells);
    if (table->names == NULL || table->cells == NULL)
        return say_no_memory();
    const int code = read_lines(path, table, most, lines);
    if (code >= 0)
        return code;
    for (int column = 1; column < table->columns; column++)
        memmove(table->cells + (size_t)column * table->rows, table->cells + (size_t)column * most,
                table->rows * sizeof *table->cells);
    return -1;
}

int kt_table_read_file(const char *path, kt_table *table) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {0};
    *table = (kt_table){0};
    if (kt_input_read(path, &kt_input_table, &text, &size, &error) == KT_OK)
        return kt_table_parse(path, text, table);
    kt_say_error(&error);
    return KT_EXIT_SCENE;
}

int kt_table_parse(const char *path, char *text, kt_table *table) {
    *table = (kt_table){.text = NULL};
    table->text = text;
    const char *lines = split_header(table);
    if (table->columns > KT_TABLE_COLUMNS_MOST) {
        kt_table_free(table);
        return kt_reject(KT_EXIT_SCENE, "%s:1: a table has at most %d columns", path, KT_TABLE_COLUMNS_MOST);
    }
    int code = read_cells(path, table, lines);
    if (code >= 0)
        kt_table_free(table);
    return code;
}

void kt_table_free(kt_table *table) {
    free(table->text);
    free(table->names);
    free(table->cells);
    free(table->parts);
    *table = (kt_table){0};
}

/* ---- several results --------------------------------------------------------------------------------------------- */

static bool has_same_columns(const kt_table *a, const kt_table *b) {
    bool same = a->columns == b->columns;
    for (int i = 0; same && i < a->columns; i++)
        same = strcmp(a->names[i], b->names[i]) == 0;
    return same;
}

/* Appends the rows of another table, behind a row of NaN unless they are the first. Returns false if memory is
 * insufficient. */
static bool append_rows(kt_table *table, const kt_table *below) {
    const size_t gap = table->rows > 0, rows = table->rows + gap + below->rows;
    double *cells = malloc((size_t)table->columns * rows * sizeof *cells);
    if (cells == NULL)
        return false;
    for (size_t i = 0; i < (size_t)table->columns; i++) {
        double *to = cells + i * rows;
        if (table->rows > 0)
            memcpy(to, table->cells + i * table->rows, table->rows * sizeof *to);
        if (gap)
            to[table->rows] = (double)NAN;
        if (below->rows > 0)
            memcpy(to + table->rows + gap, below->cells + i * below->rows, below->rows * sizeof *to);
    }
    free(table->cells);
    table->cells = cells;
    table->rows = rows;
    return true;
}

int kt_table_join(kt_table *table, kt_table *below, const char *name) {
    if (table->text == NULL) { /* the first gives the names */
        const kt_table rest = {.rows = below->rows, .cells = below->cells};
        *table = *below;
        *below = rest;
        table->cells = NULL;
        table->rows = 0;
        below->columns = table->columns;
    } else if (!has_same_columns(table, below)) {
        return kt_reject(KT_EXIT_SCENE, "plot: %s has other columns than %s; draw them one by one", name,
                         table->parts[0].name);
    }
    kt_table_part *parts = realloc(table->parts, (table->part_count + 1) * sizeof *parts);
    table->parts = parts != NULL ? parts : table->parts;
    const size_t rows = below->rows;
    if (parts == NULL || !append_rows(table, below))
        return say_no_memory();
    kt_table_part *part = &parts[table->part_count++];
    *part = (kt_table_part){.first = table->rows - rows, .rows = rows};
    (void)snprintf(part->name, sizeof part->name, "%s", name);
    kt_table_free(below);
    return -1;
}

const double *kt_table_column(const kt_table *table, const char *name) {
    for (int i = 0; i < table->columns; i++)
        if (strcmp(table->names[i], name) == 0)
            return table->cells + (size_t)i * table->rows;
    return NULL;
}
