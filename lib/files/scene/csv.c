/* A table of a function of time, or a lookup table, in a file of comma-separated values:
 *
 *     # made by a planner
 *     time [ms],shoulder [deg],elbow [deg]
 *     0,10,-30
 *     20,10.4,-31.2
 *
 * The first line is the header. Lines that begin with '#' and empty lines are left out. A header states the unit of its
 * column in brackets, or the scene states it; both state the same. Without either, numbers are in SI units.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "scene/csv.h"

#include "base/decimal.h"
#include "document/file.h"
#include "scene/units.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- files ------------------------------------------------------------------------------------------------------- */

const char *kt_path_near(kt_reader *r, const char *name) {
    const char *slash = r->path != NULL ? strrchr(r->path, '/') : NULL;
    const size_t folder = slash != NULL && name[0] != '/' ? (size_t)(slash - r->path) + 1 : 0;
    char *joined = kt_pool_take(&r->scratch, folder + strlen(name) + 1, 1);
    if (joined == NULL)
        return name;
    (void)sprintf(joined, "%.*s%s", (int)folder, folder > 0 ? r->path : "", name);
    char *whole = realpath(joined, NULL);
    const char *kept =
        kt_reader_text(r, &r->keep, whole != NULL ? whole : joined, strlen(whole != NULL ? whole : joined));
    free(whole);
    kt_named_file *file = kt_reader_take(r, &r->keep, 1, sizeof *file);
    if (kept == NULL || file == NULL)
        return name;
    *file = (kt_named_file){.path = kept, .next = r->scene->files};
    r->scene->files = file;
    return kept;
}

/* ---- units ------------------------------------------------------------------------------------------------------- */

/* Whether a unit measures the quantity of values in this SI unit. `si` ends at a '|' or its end; NULL: any quantity is
 * right. Degrees also measure rates: "30 deg" is per second. */
static bool unit_fits(const kt_unit *of, const char *si) {
    const size_t length = si != NULL ? strcspn(si, "|") : 0;
    return si == NULL || strcmp(of->si, "1") == 0 || (strlen(of->si) == length && strncmp(of->si, si, length) == 0) ||
           (strcmp(of->si, "rad") == 0 && length == 5 && strncmp(si, "rad/s", length) == 0);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

typedef struct reading {
    kt_reader *r;
    const kt_scope *scope;
    kt_node *node;
    const char *path;
    const char *at; /* the rest of the file */
    long line;
    const char *begin; /* of the line */
} reading;

static bool fault(const reading *f, const char *at, const char *format, ...) KT_PRINTF(3, 4);

/* Reports a fault in the file with its line and column. at: NULL for the first column. */
static bool fault(const reading *f, const char *at, const char *format, ...) {
    const long column = at != NULL ? (long)(at - f->begin) + 1 : 1;
    char message[KT_MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    return kt_fault_at(f->r, KT_ERROR_SCENE, f->scope, f->node, "%s:%ld:%ld: %s", f->path, f->line > 0 ? f->line : 1,
                       column, message);
}

/* The next line that is neither empty nor a comment, without its end; false: there is none. */
static bool next_csv_line(reading *f, const char **end) {
    while (*f->at != '\0') {
        f->begin = f->at;
        f->line++;
        *end = f->at + strcspn(f->at, "\n");
        f->at = *end + (**end == '\n');
        while (*end > f->begin && ((*end)[-1] == '\r' || (*end)[-1] == ' ' || (*end)[-1] == '\t'))
            (*end)--;
        if (*end > f->begin && *f->begin != '#')
            return true;
    }
    return false;
}

/* A cell, without blanks and quotes around it. */
typedef struct cell {
    const char *from, *to;
} cell;

/* Takes the cell at *at, and moves *at to the next one; NULL after the last. */
static cell next_cell(const char **at, const char *end) {
    cell c = {*at, *at};
    bool quoted = false;
    while (c.to < end && (quoted || *c.to != ','))
        quoted = (*c.to++ == '"') != quoted;
    *at = c.to < end ? c.to + 1 : NULL;
    while (c.from < c.to && (*c.from == ' ' || *c.from == '\t'))
        c.from++;
    while (c.to > c.from && (c.to[-1] == ' ' || c.to[-1] == '\t'))
        c.to--;
    if (c.to - c.from >= 2 && *c.from == '"' && c.to[-1] == '"') {
        c.from++;
        c.to--;
    }
    return c;
}

static cell cell_at(const char *begin, const char *end, int index) {
    cell c = {begin, begin};
    for (int k = 0; k <= index && begin != NULL; k++)
        c = next_cell(&begin, end);
    return c;
}

static int count_cells(const char *begin, const char *end) {
    int count = 0;
    for (; begin != NULL; count++)
        (void)next_cell(&begin, end);
    return count;
}

/* ---- the header -------------------------------------------------------------------------------------------------- */

/* The name of a header's cell, and the unit behind it in brackets, if there is one. */
static cell header_name_of(cell c, cell *in) {
    *in = (cell){c.to, c.to};
    if (c.to == c.from || c.to[-1] != ']')
        return c;
    const char *open = c.to - 1;
    while (open > c.from && *open != '[')
        open--;
    if (*open != '[' || open == c.from || open[-1] != ' ')
        return c;
    *in = (cell){open + 1, c.to - 1};
    c.to = open;
    while (c.to > c.from && c.to[-1] == ' ')
        c.to--;
    return c;
}

static bool is(cell c, const char *name) {
    return strlen(name) == (size_t)(c.to - c.from) && strncmp(name, c.from, strlen(name)) == 0;
}

/* The only column of this name, with or without its unit; -1: there is none, -2: there are several. */
static int find_csv_column(const char *begin, const char *end, const char *name) {
    int found = -1;
    cell in;
    for (int k = 0; begin != NULL; k++) {
        const cell c = next_cell(&begin, end);
        if (is(c, name) || is(header_name_of(c, &in), name))
            found = found == -1 ? k : -2;
    }
    return found;
}

/* The names of the columns for a message: "; PREFIX a,b,c" if the file seems to be a table: the next line has as many
 * cells as the header, two or more, and begins with a number. Messages do not quote other files. */
static const char *quote_header(const reading *f, const char *end, const char *prefix, char text[256]) {
    reading next = *f;
    const char *row_end;
    double number;
    text[0] = '\0';
    const int count = count_cells(f->begin, end);
    if (count < 2 || !next_csv_line(&next, &row_end) || count_cells(next.begin, row_end) != count)
        return text;
    const cell first = cell_at(next.begin, row_end, 0);
    const char *to = first.from;
    if (kt_decimal_read(first.from, &number, &to) && to == first.to && first.to > first.from)
        (void)snprintf(text, 256, "; %s %.*s", prefix, (int)(end - f->begin < 200 ? end - f->begin : 200), f->begin);
    return text;
}

static bool fault_column(const reading *f, const char *end, const char *name) {
    char header[256];
    if (*quote_header(f, end, "the columns are", header) == '\0')
        return fault(f, f->begin, "there is no column %s", kt_name_quote(name).text);
    kt_nearest near = kt_nearest_make(name, &f->r->effort);
    const char *begin = f->begin;
    cell in;
    while (begin != NULL) {
        const cell c = header_name_of(next_cell(&begin, end), &in);
        const char *text = kt_pool_text(&f->r->scratch, c.from, (size_t)(c.to - c.from));
        if (text != NULL)
            (void)kt_nearest_try(&near, text);
    }
    if (near.best != NULL)
        return fault(f, f->begin, "there is no column %s; did you mean '%s'?", kt_name_quote(name).text, near.best);
    return fault(f, f->begin, "there is no column %s%s", kt_name_quote(name).text, header);
}

/* The index of a column: the chosen one. Without a choice, the time is `time` or `t`, and the value is the other of
 * two. */
static bool choose_csv_column(const reading *f, const char *end, const char *key, const char *name, int other,
                              int *column) {
    const int count = count_cells(f->begin, end);
    *column = name != NULL ? find_csv_column(f->begin, end, name) : -1;
    if (name == NULL && other >= 0 && count == 2)
        *column = 1 - other;
    if (name == NULL && other < 0)
        *column = find_csv_column(f->begin, end, "time");
    if (name == NULL && other < 0 && *column == -1)
        *column = find_csv_column(f->begin, end, "t");
    if (*column >= 0 && *column != other)
        return true;
    if (name != NULL && *column == -1)
        return fault_column(f, end, name);
    if (*column == -2)
        return fault(f, f->begin, "two columns have the name that is chosen; give one another name");
    if (*column >= 0)
        return fault(f, f->begin, "time and value are the same column; give `value` the column of the values");
    char header[256];
    return fault(f, f->begin, "give `%s` the name of a column%s", key, quote_header(f, end, "they are", header));
}

/* The unit of a column, by its header, by the scene, or 1. */
static const kt_unit *csv_unit_of(const reading *f, const char *end, int column, const char *stated, const char *key) {
    const cell c = cell_at(f->begin, end, column);
    cell in;
    (void)header_name_of(c, &in);
    const char *const at = in.to > in.from ? in.from : c.from;
    const kt_unit *by_header = in.to > in.from ? kt_unit_find(in.from, (size_t)(in.to - in.from)) : NULL;
    const kt_unit *by_scene = stated != NULL ? kt_unit_find(stated, strlen(stated)) : NULL;
    if (stated != NULL && by_scene == NULL)
        (void)fault(f, at, "there is no unit %s; take s, ms, rad, deg, m, mm, N, kN, 'N m', rad/s, rpm or the like",
                    kt_name_quote(stated).text);
    else if (in.to > in.from && by_header == NULL)
        (void)fault(f, at,
                    "the unit '%.*s' is unknown; write s, ms, rad, deg, m, mm, N, kN, N m, rad/s, rpm or the like",
                    (int)(in.to - in.from < 40 ? in.to - in.from : 40), in.from);
    else if (by_header != NULL && by_scene != NULL && by_header != by_scene)
        (void)fault(f, at, "the header states the unit '%s', and `%s` states '%s'; remove one of them", by_header->name,
                    key, by_scene->name);
    else
        return by_header != NULL ? by_header : by_scene != NULL ? by_scene : kt_unit_find("1", 1);
    return NULL;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static bool read_cell(const reading *f, const char *end, int column, const kt_unit *of, double *value) {
    const int count = count_cells(f->begin, end);
    if (column >= count)
        return fault(f, f->begin, "the row has %d cell%s, and column %d is needed", count, count == 1 ? "" : "s",
                     column + 1);
    const cell c = cell_at(f->begin, end, column);
    const char *to = c.from;
    double number = 0.0;
    if (c.from == c.to || !kt_decimal_read(c.from, &number, &to) || to != c.to)
        return fault(f, c.from, "expected a finite number, found '%.*s'%s",
                     (int)(c.to - c.from < 40 ? c.to - c.from : 40), c.from,
                     memchr(f->begin, ';', (size_t)(end - f->begin)) != NULL
                         ? "; separate cells by commas, and write a point for the decimal comma"
                         : "");
    *value = number * of->times / of->divided;
    return true;
}

/* The columns of a table, with their units. */
typedef struct csv_columns {
    int count;
    bool is_of_time; /* the first one is the time, which increases */
    int at[3];
    const kt_unit *of[3];
} csv_columns;

/* Rows of `rows` have columns->count numbers. A function of time has two: time and value. */
static bool read_csv_rows(reading *f, const csv_columns *columns, double *rows, int *count) {
    const char *end;
    *count = 0;
    while (next_csv_line(f, &end)) {
        double *row = rows + columns->count * (ptrdiff_t)*count;
        for (int k = 0; k < columns->count; k++)
            if (!read_cell(f, end, columns->at[k], columns->of[k], &row[k]))
                return false;
        if (columns->is_of_time && *count > 0 && !(row[0] > row[-2]))
            return fault(f, cell_at(f->begin, end, columns->at[0]).from,
                         "the time %.9g s follows %.9g s; times must increase, remove one of the rows", row[0],
                         row[-2]);
        ++*count;
    }
    return *count >= 2 || !columns->is_of_time ||
           fault(f, NULL, "the table has less than two rows; a function of time needs two or more");
}

/* The unit, other than that of SI, of values in `si` that a name without a unit seems to have: "y (deg)", "y[deg]". It
 * would not be read, and the numbers would be taken as SI units. NULL: there is none. */
static const kt_unit *find_unread_unit(cell c, const char *si) {
    cell in;
    (void)header_name_of(c, &in);
    const char last = c.to > c.from ? c.to[-1] : '\0';
    if (si == NULL || in.to > in.from || (last != ')' && last != ']'))
        return NULL;
    const char *open = c.to - 1;
    while (open > c.from && *open != (last == ')' ? '(' : '['))
        open--;
    const kt_unit *of = open > c.from ? kt_unit_find(open + 1, (size_t)(c.to - open) - 2) : NULL;
    return of != NULL && !kt_unit_is_si(of) && unit_fits(of, si) ? of : NULL;
}

/* Rejects a header that seems to have a unit, if the scene does not state one. */
static bool check_unread_unit(const reading *f, const char *end, int column, const char *stated, const char *key,
                              const char *si) {
    const cell c = cell_at(f->begin, end, column);
    const kt_unit *of = stated == NULL ? find_unread_unit(c, si) : NULL;
    return of == NULL ||
           fault(f, c.from,
                 "the name states a unit that is not read; write [%s] after a blank in the header, or `%s: %s` in the "
                 "scene",
                 of->name, key, of->name);
}

/* The unit of a column measures another quantity than that of the values, with their SI unit. */
static bool fault_unit(const reading *f, const char *end, int column, const kt_unit *of, const char *si) {
    return fault(f, cell_at(f->begin, end, column).from,
                 "the values here are in %.*s, and '%s' measures another quantity; state the right unit, or choose "
                 "another column",
                 (int)strcspn(si, "|"), si, of->name);
}

/* Reads the lines behind the header into memory of the scene. */
static bool keep_csv_rows(reading *f, const csv_columns *columns, const double **rows, int *count) {
    size_t lines = 1;
    for (const char *c = f->at; *c != '\0'; c++)
        lines += *c == '\n';
    double *made = kt_pool_take(&f->r->keep, (size_t)columns->count * lines, sizeof *made);
    if (made == NULL)
        return kt_reader_out_of_memory(f->r);
    *rows = made;
    return read_csv_rows(f, columns, made, count);
}

/* The columns of a function of time. Its header ends at `end`. */
static bool choose_time_columns(reading *f, const char *end, const kt_csv_choice *choice, kt_quantity quantity,
                                csv_columns *columns) {
    int *const column = columns->at;
    const kt_unit **const of = columns->of;
    *columns = (csv_columns){.count = 2, .is_of_time = true};
    if (!choose_csv_column(f, end, "time", choice->time, -1, &column[0]) ||
        !choose_csv_column(f, end, "value", choice->value, column[0], &column[1]))
        return false;
    of[0] = csv_unit_of(f, end, column[0], choice->time_unit, "time_unit");
    of[1] = of[0] != NULL ? csv_unit_of(f, end, column[1], choice->unit, "unit") : NULL;
    if (of[1] == NULL)
        return false;
    if (!check_unread_unit(f, end, column[0], choice->time_unit, "time_unit", "s") ||
        !check_unread_unit(f, end, column[1], choice->unit, "unit", f->r->scene->unit))
        return false;
    if (!unit_fits(of[0], "s"))
        return fault_unit(f, end, column[0], of[0], "s");
    if (!unit_fits(of[1], f->r->scene->unit))
        return fault_unit(f, end, column[1], of[1], f->r->scene->unit);
    if (f->r->scene->unit == NULL && strncmp(of[1]->si, "rad", 3) == 0 && !kt_unit_is_si(of[1]) &&
        quantity != KT_QUANTITY_ANGLE && quantity != KT_QUANTITY_RATE)
        return fault(f, cell_at(f->begin, end, column[1]).from,
                     "the unit is that of an angle, and this function is none; state another unit");
    return true;
}

/* The columns of a lookup table, by their names or, without names, by their order. */
static bool choose_lookup_columns(reading *f, const char *end, const char *const names[3], csv_columns *columns) {
    const int cells = count_cells(f->begin, end);
    const bool is_named = names[0] != NULL || names[1] != NULL || names[2] != NULL;
    char header[256];
    *columns = (csv_columns){.count = is_named ? 2 + (names[1] != NULL) : cells};
    if (columns->count < 2 || columns->count > 3)
        return fault(f, f->begin, "give `x`, `y` and `value` the names of columns%s",
                     quote_header(f, end, "they are", header));
    for (int k = 0; k < columns->count; k++) {
        const char *name = names[columns->count == 2 && k == 1 ? 2 : k];
        static const char *const keys[] = {"x", "y", "value"};
        const char *key = keys[columns->count == 2 && k == 1 ? 2 : k];
        columns->at[k] = k;
        if (is_named && name == NULL)
            return fault(f, f->begin, "give `%s` the name of a column, too%s", key,
                         quote_header(f, end, "they are", header));
        if (is_named && !choose_csv_column(f, end, key, name, -1, &columns->at[k]))
            return false;
        columns->of[k] = csv_unit_of(f, end, columns->at[k], NULL, key);
        if (columns->of[k] == NULL || !check_unread_unit(f, end, columns->at[k], NULL, key, columns->of[k]->si))
            return false;
    }
    return true;
}

/* A file that is being read: a function of time, or a lookup table. */
typedef struct csv_target {
    const kt_csv_choice *choice; /* NULL: a lookup table */
    kt_quantity quantity;
    const char *const *names;
    int *inputs;
} csv_target;

static bool read_csv_file(reading *f, const csv_target *target, const double **rows, int *count) {
    const char *end;
    csv_columns columns;
    if (strncmp(f->at, "\xEF\xBB\xBF", 3) == 0)
        f->at += 3;
    if (!next_csv_line(f, &end))
        return fault(f, NULL, "the file has no header, whose names choose the columns");
    const bool chosen = target->choice != NULL ? choose_time_columns(f, end, target->choice, target->quantity, &columns)
                                               : choose_lookup_columns(f, end, target->names, &columns);
    if (chosen && target->inputs != NULL)
        *target->inputs = columns.count - 1;
    return chosen && keep_csv_rows(f, &columns, rows, count);
}

static bool read_csv(kt_reader *r, const kt_scope *scope, kt_node *file, const csv_target *target, const double **rows,
                     int *count) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {0};
    reading f = {.r = r, .scope = scope, .node = file, .path = kt_path_near(r, file->of.text)};
    if (r->scene->is_alone)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, file, "%s is another file; write its rows here", file->of.text);
    if (kt_file_read(f.path, &text, &size, &error) != KT_OK)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, file, "%s: %s", f.path, error.message);
    char *ended = kt_pool_take(&r->scratch, size + 1, 1); /* with a zero behind it */
    if (ended == NULL) {
        free(text);
        return kt_reader_out_of_memory(r);
    }
    memcpy(ended, text, size);
    f.at = f.begin = ended;
    const bool good = strlen(ended) == size ? read_csv_file(&f, target, rows, count)
                                            : fault(&f, NULL, "the file has bytes of zero; it is no text");
    free(text);
    return good;
}

bool kt_read_csv(kt_reader *r, const kt_scope *scope, kt_node *file, const kt_csv_choice *choice, kt_quantity quantity,
                 const double **rows, int *count) {
    const csv_target target = {.choice = choice, .quantity = quantity};
    return read_csv(r, scope, file, &target, rows, count);
}

/* NOLINTNEXTLINE(readability-non-const-parameter): the reader of the header writes it */
bool kt_read_csv_lookup(kt_reader *r, const kt_scope *scope, kt_node *file, const char *const names[3], int *inputs,
                        const double **rows, int *count) {
    const csv_target target = {.names = names, .inputs = inputs};
    return read_csv(r, scope, file, &target, rows, count);
}
