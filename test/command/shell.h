/* Runs the command through a shell, in a folder of its own that goes with the program. In command lines, "$K" is the
 * command. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_COMMAND_SHELL_H
#define KT_TEST_COMMAND_SHELL_H

#include "check.h"

#include <jansson.h>

typedef struct kt_ran {
    int code;        /* exit status; 128 + signal where one ended it */
    const char *out; /* both terminated; valid until the next call */
    const char *err;
} kt_ran;

/* printf-style. */
kt_ran kt_shell(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The same with standard output and standard error on a terminal, in a UTF-8 locale; both are in `out`. */
kt_ran kt_terminal(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Checks the exit code and that standard error contains `message` (NULL: standard error is empty). */
void kt_expect(int code, const char *message, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* A file in the folder. */
void kt_write_file(const char *name, const char *text);
const char *kt_read_file(const char *name); /* terminated; valid until the next call */

/* How light the page of an SVG is, from 0 (black) to 1 (white): that of the first colour in it, since the page is
 * painted first. NaN: no colour was found. */
double kt_page_lightness(const char *svg);

/* ---- what was read ----------------------------------------------------------------------------------------------- */

int kt_count_lines(const char *text);
/* How often `part` occurs in a text. */
int kt_count_of(const char *text, const char *part);
/* The number in a column (from 0) of a line (0: the header) of CSV text. */
double kt_csv_number(const char *text, int line, int column);
/* The column of this name in the header; -1: none. */
int kt_csv_column(const char *text, const char *name);

/* Parses; a failed check and NULL where it is no JSON. The caller releases it. */
json_t *kt_json(const char *text);
/* A number at a path: "energy.total", "marker.bob.tip[1]"; NaN where there is none. Names with dots in them are written
 * with '/' between the parts of the path: "marker/bob.tip[1]". */
double kt_json_at(const json_t *root, const char *path);
const json_t *kt_json_find(const json_t *root, const char *path);

#endif
