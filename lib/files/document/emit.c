/* YAML in the layout of scene-files.md.
 *
 * The layout is part of the format and must not change with the version of a library, so that this file writes it.
 * Block mappings and lists are indented by two, short values are in flow style, and lines are broken near column 110.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/emit.h"

#include "document/document_text.h"
#include "document/number.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

enum { WIDTH = 110 };

void kt_emit_reject(kt_emitter *e, kt_status code, const char *format, ...) {
    if (e->fault.code != KT_OK)
        return;
    char message[KT_MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    (void)kt_error_set(&e->fault, code, NULL, "%s", message);
}

static void emit_bytes(kt_emitter *e, const char *text, size_t length) {
    if (e->stream != NULL)
        (void)fwrite(text, 1, length, e->stream);
    e->column += (int)length;
}

static void put_string(kt_emitter *e, const char *text) { emit_bytes(e, text, strlen(text)); }

static void new_line(kt_emitter *e, int indent) {
    static const char blanks[2 * KT_EMIT_DEPTH_MAX + 1] = "                                ";
    emit_bytes(e, "\n", 1);
    e->column = 0;
    emit_bytes(e, blanks, (size_t)indent);
}

/* Separates an item of a flow level from the previous item. */
static void separate(kt_emitter *e, const kt_emit_level *level) {
    if (level->count == 0)
        return;
    emit_bytes(e, ",", 1);
    if (e->column > WIDTH)
        new_line(e, level->indent);
    else
        emit_bytes(e, " ", 1);
}

static kt_emit_level *top(kt_emitter *e) { return e->depth == 0 ? NULL : &e->levels[e->depth - 1]; }

/* Writes the text between the last value, or the key, and the next value. block: behind a key, on the next line. */
static void before_value(kt_emitter *e, bool block) {
    kt_emit_level *level = top(e);
    if (level == NULL)
        return;
    if (!level->list) {
        if (!block)
            emit_bytes(e, " ", 1);
        return;
    }
    if (!level->flow) {
        new_line(e, level->indent);
        emit_bytes(e, "- ", 2);
    } else {
        separate(e, level);
    }
    level->count++;
}

/* list: a list, else a mapping. Everything within a flow level is flow. */
static void open_level(kt_emitter *e, bool list, kt_emit_style style) {
    const kt_emit_level *outer = top(e);
    const bool flow = style == KT_EMIT_FLOW || (outer != NULL && outer->flow);
    if (e->depth == KT_EMIT_DEPTH_MAX) {
        kt_emit_reject(e, KT_ERROR_ARGUMENT, "the scene is nested too deeply");
        return;
    }
    int indent = 0;
    if (outer != NULL)
        indent = outer->indent + (outer->list && outer->flow ? 0 : 2);
    before_value(e, !flow);
    if (flow)
        emit_bytes(e, list ? "[" : "{", 1);
    e->levels[e->depth] = (kt_emit_level){list, flow, 0, indent};
    e->depth++;
}

void kt_emit_map(kt_emitter *e, kt_emit_style style) { open_level(e, false, style); }
void kt_emit_list(kt_emitter *e, kt_emit_style style) { open_level(e, true, style); }

void kt_emit_end(kt_emitter *e) {
    const kt_emit_level *level = top(e);
    if (level == NULL) /* of a level that was rejected */
        return;
    if (level->flow)
        emit_bytes(e, level->list ? "]" : "}", 1);
    e->depth--;
    if (e->depth == 0)
        emit_bytes(e, "\n", 1);
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

static void emit_escaped(kt_emitter *e, const char *text) {
    emit_bytes(e, "\"", 1);
    for (const char *c = text; *c != '\0';) {
        uint32_t character;
        size_t length = kt_utf8_decode(c, strlen(c), &character);
        char escape[12];
        if (*c == '"' || *c == '\\')
            (void)snprintf(escape, sizeof escape, "\\%c", *c);
        else if (*c == '\n')
            (void)snprintf(escape, sizeof escape, "\\n");
        else if (*c == '\t')
            (void)snprintf(escape, sizeof escape, "\\t");
        else if (!kt_character_is_plain(character))
            (void)snprintf(escape, sizeof escape, "\\u%04X", (unsigned)character); /* those beyond U+FFFF are plain */
        else
            escape[0] = '\0';
        if (escape[0] == '\0')
            emit_bytes(e, c, length);
        else
            put_string(e, escape);
        c += length;
    }
    emit_bytes(e, "\"", 1);
}

static void emit_text(kt_emitter *e, const char *text) {
    size_t offset;
    if (!kt_utf8_is_valid(text, strlen(text), &offset))
        kt_emit_reject(e, KT_ERROR_MODEL, "a text is not UTF-8, which a scene file is written in");
    else if (kt_text_is_plain(text))
        put_string(e, text);
    else
        emit_escaped(e, text);
}

/* The first key of a map that is an item of a list is on the line of the item's dash. */
static void begin_key(kt_emitter *e) {
    kt_emit_level *level = &e->levels[e->depth - 1];
    const kt_emit_level *outer = e->depth > 1 ? level - 1 : NULL;
    if (level->flow) {
        separate(e, level);
    } else if (level->count > 0 || (outer != NULL && !outer->list)) {
        new_line(e, level->indent);
    }
    level->count++;
}

void kt_emit_key(kt_emitter *e, const char *key) {
    begin_key(e);
    put_string(e, key);
    emit_bytes(e, ":", 1);
}

void kt_emit_section(kt_emitter *e, const char *key) {
    emit_bytes(e, "\n", 1);
    kt_emit_key(e, key);
}

void kt_emit_name(kt_emitter *e, const char *name) {
    begin_key(e);
    emit_text(e, name);
    emit_bytes(e, ":", 1);
}

void kt_emit_text(kt_emitter *e, const char *text) {
    before_value(e, false);
    emit_text(e, text);
}

void kt_emit_pair(kt_emitter *e, const char *body, const char *marker) {
    before_value(e, false);
    put_string(e, body);
    emit_bytes(e, ".", 1);
    put_string(e, marker);
}

void kt_emit_word(kt_emitter *e, const char *word) {
    before_value(e, false);
    put_string(e, word);
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

void kt_emit_number(kt_emitter *e, double value) {
    char text[KT_NUMBER_SIZE];
    if (!isfinite(value)) {
        kt_emit_reject(e, KT_ERROR_NOT_FINITE, "a number is %g; a scene file has finite numbers", value);
        return;
    }
    kt_number_format(text, value);
    kt_emit_word(e, text);
}

void kt_emit_integer(kt_emitter *e, int value) { kt_emit_number(e, value); }

void kt_emit_numbers(kt_emitter *e, const double *values, int count) {
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < count; i++)
        kt_emit_number(e, values[i]);
    kt_emit_end(e);
}
