/* Status codes, error messages and the version.
 *
 * An error contains its texts in its own arrays, so that reporting an error allocates nothing and cannot fail. A text
 * that does not fit is cut between UTF-8 characters, not within a character, and ends in "...".
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/status.h"

#include "base/escape.h"
#include "base/where.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

const char *kt_version(void) { return KT_VERSION; }

const char *kt_status_text(kt_status status) {
    switch (status) {
#define KT_STATUS_CASE(name, value, text)                                                                              \
    case name:                                                                                                         \
        return text;
        KT_STATUS_LIST(KT_STATUS_CASE)
#undef KT_STATUS_CASE
    }
    return "unknown status";
}

/* Cuts a text that did not fit into size bytes, and appends "...". */
static void mark_as_cut(char *text, size_t size) {
    static const char dots[] = "...";
    const size_t length = strlen(text), most = size - sizeof dots;
    size_t end = length < most ? length : most;
    while (end > 0 && ((unsigned char)text[end] & 0xC0U) == 0x80U) /* a continuation byte: no cut in its character */
        end--;
    memcpy(text + end, dots, sizeof dots);
}

static void format_text(char *text, size_t size, const char *format, va_list arguments) KT_PRINTF(3, 0);

static void format_text(char *text, size_t size, const char *format, va_list arguments) {
    int length = vsnprintf(text, size, format, arguments);
    if (length < 0) /* an argument that cannot be converted, such as a bad wide string */
        text[0] = '\0';
    else if ((size_t)length >= size)
        mark_as_cut(text, size);
}

/* The text is escaped because names and words in the text may come from a file. */
static void copy_escaped(const char *text, char *to, size_t size) {
    if (kt_text_escape(text, to, size) >= size)
        mark_as_cut(to, size);
}

kt_where_text kt_where_format(const char *format, ...) {
    kt_where_text where = {.text = ""};
    va_list arguments;
    va_start(arguments, format);
    format_text(where.text, sizeof where.text, format, arguments);
    va_end(arguments);
    return where;
}

kt_status kt_error_set(kt_error *error, kt_status code, const char *where, const char *format, ...) {
    if (error == NULL)
        return code;

    /* The error is composed in a copy: the given texts may be those of *error itself, when an error is reported again
     * with more context. */
    kt_error made;
    made.code = code;
    size_t length = where == NULL ? 0 : strlen(where);
    size_t fits = length < sizeof made.where ? length : sizeof made.where - 1;
    if (fits > 0)
        memcpy(made.where, where, fits);
    made.where[fits] = '\0';
    if (length > fits)
        mark_as_cut(made.where, sizeof made.where);

    va_list arguments;
    va_start(arguments, format);
    format_text(made.message, sizeof made.message, format, arguments);
    va_end(arguments);

    error->code = code;
    copy_escaped(made.where, error->where, sizeof error->where);
    copy_escaped(made.message, error->message, sizeof error->message);
    return code;
}
