/* YAML in the layout of scene-files.md, to a stream. All functions require the C locale. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_EMIT_H
#define KT_DOCUMENT_EMIT_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum { KT_EMIT_DEPTH_MAX = 16 };

/* How a mapping or a list is written: one line for each item, or [a, b] and {a: b} in one line. */
typedef enum kt_emit_style { KT_EMIT_BLOCK, KT_EMIT_FLOW } kt_emit_style;

typedef struct kt_emit_level {
    bool list; /* a list; else a mapping */
    bool flow; /* KT_EMIT_FLOW */
    int count; /* items or keys so far */
    int indent;
} kt_emit_level;

/* An emitter of zeros writes nothing: it only finds values that cannot be written. */
typedef struct kt_emitter {
    FILE *stream;   /* NULL: none */
    kt_error fault; /* the first thing that cannot be written */
    int column;
    int depth;
    kt_emit_level levels[KT_EMIT_DEPTH_MAX];
} kt_emitter;

/* Records a value that cannot be written; the first such fault is kept. */
void kt_emit_reject(kt_emitter *e, kt_status code, const char *format, ...) KT_PRINTF(3, 4);

/* Begin a mapping or a list, and end it. Within a flow level everything is flow. The outermost mapping is a block. */
void kt_emit_map(kt_emitter *e, kt_emit_style style);
void kt_emit_list(kt_emitter *e, kt_emit_style style);
void kt_emit_end(kt_emitter *e);

/* Write a key of a mapping, before its value: kt_emit_key a plain key, kt_emit_section a key after a blank line. The
 * function kt_emit_name writes a name, in quotes if necessary. */
void kt_emit_key(kt_emitter *e, const char *key);
void kt_emit_section(kt_emitter *e, const char *key);
void kt_emit_name(kt_emitter *e, const char *name);

/* Write values. A text gets quotes if YAML would read it as something else; a word never gets quotes. */
void kt_emit_text(kt_emitter *e, const char *text);
void kt_emit_word(kt_emitter *e, const char *word);
void kt_emit_pair(kt_emitter *e, const char *body, const char *marker); /* BODY.MARKER; valid names need no quotes */
void kt_emit_number(kt_emitter *e, double value);
void kt_emit_integer(kt_emitter *e, int value);
void kt_emit_numbers(kt_emitter *e, const double *values, int count); /* [a, b, c] */

#endif
