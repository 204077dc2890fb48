/* Files that a command or a scene names, for the command: "-" is standard input, and errors are printed. All of them
 * are opened by document/file.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_INPUT_H
#define KT_COMMAND_TEXT_INPUT_H

#include "document/file.h"
#include "text/bytes.h"

#include <jansson.h>

extern const kt_file_kind kt_input_table;   /* records, lines of a sweep, the values of sweep --from */
extern const kt_file_kind kt_input_result;  /* a table or a summary */
extern const kt_file_kind kt_input_summary; /* a summary */
extern const kt_file_kind kt_input_scene;   /* a scene or a robot */
extern const kt_file_kind kt_input_checkpoint;
extern const kt_file_kind kt_input_lines; /* lines of a sweep that are read one by one, of any number */

/* Reads a whole file, or all of standard input ("-"). A byte of zero follows the text, which the caller frees. Errors:
 * those of kt_file_read_as. */
kt_status kt_input_read(const char *path, const kt_file_kind *kind, char **text, size_t *size, kt_error *error);

/* Returns what a text holds as JSON, or NULL after printing that the file is no `what`. The message quotes nothing of
 * the file, which may be any file of the user. */
json_t *kt_input_json(const char *path, const char *text, size_t size, const char *what);

/* Opens a regular file as a stream. Returns NULL after an error. */
FILE *kt_input_open(const char *path, const kt_file_kind *kind, kt_error *error);

/* Reads the next line into `line`, with the newline that ends it unless the file ends before. Returns 1; 0 at the end
 * of the file; -1 with errno if it cannot be read. EINVAL: the line has a byte of zero; EFBIG: it is longer than any
 * line of a result. */
int kt_input_line(FILE *file, kt_bytes *line);

#endif
