/* Reads XML by expat into a tree of elements. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/xml.h"

#include <expat.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

typedef struct kt_xml {
    kt_reader *reader;
    XML_Parser parser;
    kt_element *at, *root;
    int depth;
    const char *file;          /* of an included file: its name, and the element that includes it */
    const kt_element *include; /* in the robot's own file */
    const kt_element *by;      /* the element that includes this file */
    char *text;                /* since the last tag */
    size_t text_size, text_room;
} kt_xml;

/* Since version 2.9, expat deprecates the calls whose width depends on its build. */
#if XML_MAJOR_VERSION > 2 || XML_MINOR_VERSION >= 9
#define XML_LINE_NUMBER XML_GetCurrentLineNumber64
#define XML_COLUMN_NUMBER XML_GetCurrentColumnNumber64
#else
#define XML_LINE_NUMBER XML_GetCurrentLineNumber
#define XML_COLUMN_NUMBER XML_GetCurrentColumnNumber
#endif

static uint32_t xml_line_of(XML_Parser parser) { return (uint32_t)XML_LINE_NUMBER(parser); }
static uint32_t xml_column_of(XML_Parser parser) { return (uint32_t)XML_COLUMN_NUMBER(parser) + 1; }

/* Ends the reading after a fault or for want of memory. */
static void stop(kt_xml *x) { (void)XML_StopParser(x->parser, XML_FALSE); }

bool kt_xml_fault_in(kt_reader *reader, const kt_element *e, const char *context, const char *format,
                     va_list arguments) {
    char what[KT_MESSAGE_SIZE];
    (void)vsnprintf(what, sizeof what, format, arguments);
    if (e->included == NULL)
        return kt_fault_put(reader, KT_ERROR_SCENE, e->line, e->column, "%s%s", context, what);
    return kt_fault_put(reader, KT_ERROR_SCENE, e->included->line, e->included->column, "%.200s:%u:%u: %s%s", e->file,
                        (unsigned)e->line, (unsigned)e->column, context, what);
}

bool kt_xml_fault(kt_reader *reader, const kt_element *e, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const bool result = kt_xml_fault_in(reader, e, "", format, arguments);
    va_end(arguments);
    return result;
}

/* The place that the parser has reached, as an element. */
static kt_element here(const kt_xml *x) {
    return (kt_element){.line = xml_line_of(x->parser),
                        .column = xml_column_of(x->parser),
                        .file = x->file,
                        .included = x->include,
                        .by = x->by};
}

static const char *keep_xml_text(kt_xml *x, const char *text) {
    return kt_reader_text(x->reader, &x->reader->scratch, text, strlen(text));
}

/* Copies names and values, which expat frees. */
static bool keep_attributes(kt_xml *x, kt_element *element, const XML_Char **attributes) {
    size_t count = 0;
    while (attributes[count] != NULL)
        count++;
    const char **kept = kt_reader_take(x->reader, &x->reader->scratch, count + 1, sizeof *kept);
    element->attributes = kept;
    for (size_t i = 0; i < count && kept != NULL; i++)
        kept[i] = keep_xml_text(x, attributes[i]);
    return !x->reader->out_of_memory;
}

static void hang_below(kt_element *parent, kt_element *element) {
    element->parent = parent;
    if (parent->last == NULL)
        parent->first = element;
    else
        parent->last->next = element;
    parent->last = element;
}

static void XMLCALL start_element(void *user, const XML_Char *name, const XML_Char **attributes) {
    kt_xml *x = user;
    const kt_element place = here(x);
    x->text_size = 0;
    if (x->reader->out_of_memory)
        return;
    if (++x->depth > KT_XML_DEPTH_MAX) {
        (void)kt_xml_fault(x->reader, &place, "elements are nested more than %d deep", (int)KT_XML_DEPTH_MAX);
        stop(x);
        return;
    }
    if (++x->reader->elements > KT_XML_ELEMENTS_MAX) {
        (void)kt_xml_fault(x->reader, &place, "the files have more than %d elements, those of included files counted",
                           (int)KT_XML_ELEMENTS_MAX);
        stop(x);
        return;
    }
    kt_element *element = kt_reader_take(x->reader, &x->reader->scratch, 1, sizeof *element);
    if (element == NULL || !keep_attributes(x, element, attributes)) {
        stop(x);
        return;
    }
    const char *const *kept = element->attributes;
    *element = place;
    element->attributes = kept;
    element->name = keep_xml_text(x, name);
    if (x->at != NULL)
        hang_below(x->at, element);
    else
        x->root = element;
    x->at = element;
}

static bool is_xml_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/* The text since the last tag, without blanks around it. */
static void keep_leaf(kt_xml *x) {
    size_t from = 0, to = x->text_size;
    while (from < to && is_xml_blank(x->text[from]))
        from++;
    while (to > from && is_xml_blank(x->text[to - 1]))
        to--;
    if (from == to)
        return;
    x->at->text = kt_reader_text(x->reader, &x->reader->scratch, x->text + from, to - from);
}

static void XMLCALL end_element(void *user, const XML_Char *name) {
    kt_xml *x = user;
    (void)name;
    x->depth--;
    if (x->at == NULL)
        return;
    if (x->at->first == NULL)
        keep_leaf(x);
    x->text_size = 0;
    x->at = x->at->parent;
}

/* The parser gives one text in several pieces. */
static void XMLCALL add_text(void *user, const XML_Char *text, int length) {
    kt_xml *x = user;
    if (x->reader->out_of_memory)
        return;
    char *grown =
        kt_reader_grow(x->reader, &x->reader->scratch, x->text, x->text_size, (size_t)length, &x->text_room, 1);
    if (grown == NULL) {
        stop(x);
        return;
    }
    x->text = grown;
    memcpy(x->text + x->text_size, text, (size_t)length);
    x->text_size += (size_t)length;
}

static void XMLCALL reject_type(void *user, const XML_Char *name, const XML_Char *system, const XML_Char *public,
                                int internal) {
    kt_xml *x = user;
    (void)name, (void)system, (void)public, (void)internal;
    const kt_element place = here(x);
    (void)kt_xml_fault(x->reader, &place, "a document type (<!DOCTYPE ...>) is not read; leave it out");
    stop(x);
}

/* The index after a part that ends with the text `end`; size if the part does not end. */
static size_t behind(const char *text, size_t size, size_t from, const char *end) {
    const size_t length = strlen(end);
    while (from + length <= size && memcmp(text + from, end, length) != 0)
        from++;
    return from + length <= size ? from + length : size;
}

static bool begins_at(const char *text, size_t size, size_t at, const char *with) {
    return at + strlen(with) <= size && memcmp(text + at, with, strlen(with)) == 0;
}

/* The index of a declaration that only blanks and comments precede; 0: the declaration is at the beginning, or
 * missing. */
static size_t late_declaration(const char *text, size_t size) {
    size_t i = 0;
    while (i < size && (strchr(" \t\r\n", text[i]) != NULL || begins_at(text, size, i, "<!--")))
        i = text[i] == '<' ? behind(text, size, i + 4, "-->") : text[i] == '\0' ? size : i + 1;
    return begins_at(text, size, i, "<?xml ") ? i : 0;
}

/* A copy of the text with blanks in place of a declaration that is not at its beginning, where XML has it; or the text.
 * NULL: memory is insufficient. */
static const char *take_late_away(kt_reader *reader, const char *text, size_t size, kt_xml_late *late) {
    const size_t from = late_declaration(text, size);
    *late = (kt_xml_late){0, 0};
    if (from == 0)
        return text;
    char *copy = kt_pool_take(&reader->scratch, size, 1);
    if (copy == NULL)
        return NULL;
    memcpy(copy, text, size);
    *late = (kt_xml_late){1, 1};
    for (size_t i = 0; i < from; i++)
        *late = text[i] == '\n' ? (kt_xml_late){late->line + 1, 1} : (kt_xml_late){late->line, late->column + 1};
    for (size_t i = from, end = behind(text, size, from, "?>"); i < end; i++)
        copy[i] = text[i] == '\n' ? '\n' : ' ';
    return copy;
}

/* The index of the next comment from an index on, outside of character data; size if there is none. */
static size_t next_comment(const char *text, size_t size, size_t from) {
    while (from < size && !begins_at(text, size, from, "<!--"))
        from = begins_at(text, size, from, "<![CDATA[") ? behind(text, size, from, "]]>") : from + 1;
    return from;
}

static bool has_dashes(const char *text, size_t from, size_t to) {
    for (size_t i = from; i < to; i++)
        if (text[i] == '-' && text[i + 1] == '-') /* the text from `to` on contains the end of the comment */
            return true;
    return false;
}

/* Many files have "--" within comments, which XML forbids and other readers accept. Returns a copy of the text with
 * blanks in place of these dashes, or the text itself. NULL: memory is insufficient. */
static const char *take_dashes_away(kt_reader *reader, const char *text, size_t size) {
    char *copy = NULL;
    for (size_t at = next_comment(text, size, 0); at < size; at = next_comment(text, size, at)) {
        const size_t from = at + 4, end = behind(text, size, from, "-->"), to = end >= from + 3 ? end - 3 : from;
        at = end;
        if (!has_dashes(text, from, to))
            continue;
        copy = copy != NULL ? copy : kt_pool_take(&reader->scratch, size, 1);
        if (copy == NULL)
            return NULL;
        if (text != copy)
            memcpy(copy, text, size);
        text = copy;
        for (size_t i = from; i < to; i++)
            copy[i] = copy[i] == '-' ? ' ' : copy[i];
    }
    return text;
}

static bool parse(kt_xml *x, const char *text, size_t size, kt_element **root, kt_xml_late *late) {
    kt_reader *reader = x->reader;
    text = take_late_away(reader, text, size, late);
    text = text != NULL ? take_dashes_away(reader, text, size) : NULL;
    if (text == NULL)
        return kt_reader_out_of_memory(reader);
    x->parser = XML_ParserCreate(NULL);
    if (x->parser == NULL)
        return kt_reader_out_of_memory(reader);
    XML_SetUserData(x->parser, x);
    XML_SetElementHandler(x->parser, start_element, end_element);
    XML_SetCharacterDataHandler(x->parser, add_text);
    XML_SetStartDoctypeDeclHandler(x->parser, reject_type);
    const bool done =
        XML_Parse(x->parser, text, (int)size, 1) == XML_STATUS_OK; /* a file has less than INT_MAX bytes */
    const enum XML_Error code = XML_GetErrorCode(x->parser);
    const kt_element place = here(x);
    if (!done && code == XML_ERROR_NO_MEMORY)
        (void)kt_reader_out_of_memory(reader);
    else if (!done && code != XML_ERROR_ABORTED)
        (void)kt_xml_fault(reader, &place, "this is no well-formed XML: %s", XML_ErrorString(code));
    XML_ParserFree(x->parser);
    *root = x->root;
    return done && !reader->out_of_memory;
}

bool kt_xml_parse(kt_reader *reader, const char *text, size_t size, kt_element **root, kt_xml_late *late) {
    kt_xml x = {.reader = reader};
    return parse(&x, text, size, root, late);
}

bool kt_xml_parse_included(kt_reader *reader, const char *text, size_t size, const char *file,
                           const kt_element *include, kt_element **root) {
    kt_xml x = {.reader = reader,
                .file = file,
                .include = include->included != NULL ? include->included : include,
                .by = include};
    kt_xml_late late;
    return parse(&x, text, size, root, &late);
}

const char *kt_xml_attribute(const kt_element *element, const char *name) {
    for (const char *const *a = element->attributes; *a != NULL; a += 2)
        if (strcmp(*a, name) == 0)
            return a[1];
    return NULL;
}

static kt_element *named(kt_element *element, const char *name) {
    while (element != NULL && strcmp(element->name, name) != 0)
        element = element->next;
    return element;
}

kt_element *kt_xml_child(const kt_element *element, const char *name) { return named(element->first, name); }

kt_element *kt_xml_next(const kt_element *element, const char *name) { return named(element->next, name); }
