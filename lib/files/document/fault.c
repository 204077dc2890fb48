/* Faults of a scene file: found in any order, reported in the order of lines.
 *
 * A message is [NOUN 'NAME': ][PATH: ]TEXT . The noun names the innermost body, loop or effect, and the path is the
 * position within this item. An example is "body 'crank': joint.axis: the axis is zero".
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/document_reader.h"
#include "document/number.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool kt_reader_out_of_memory(kt_reader *r) {
    r->out_of_memory = true;
    return false;
}

void *kt_reader_take(kt_reader *r, kt_pool *pool, size_t count, size_t size) {
    void *taken = kt_pool_take(pool, count, size);
    r->out_of_memory = r->out_of_memory || taken == NULL;
    return taken;
}

void *kt_reader_grow(kt_reader *r, kt_pool *pool, void *items, size_t count, size_t more, size_t *room, size_t size) {
    void *grown = kt_pool_grow(pool, items, count, more, room, size);
    r->out_of_memory = r->out_of_memory || grown == NULL;
    return grown;
}

char *kt_reader_text(kt_reader *r, kt_pool *pool, const char *text, size_t length) {
    char *copy = kt_pool_text(pool, text, length);
    r->out_of_memory = r->out_of_memory || copy == NULL;
    return copy;
}

static void phrase_add_list(kt_phrase *phrase, const char *format, va_list arguments) KT_PRINTF(2, 0);

/* A full phrase is not changed. */
static void phrase_add_list(kt_phrase *phrase, const char *format, va_list arguments) {
    size_t room = sizeof phrase->text - phrase->length;
    int length = vsnprintf(phrase->text + phrase->length, room, format, arguments);
    if (length > 0)
        phrase->length += (size_t)length < room ? (size_t)length : room - 1;
}

void kt_phrase_add(kt_phrase *phrase, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    phrase_add_list(phrase, format, arguments);
    va_end(arguments);
}

/* ---- the list of faults ------------------------------------------------------------------------------------------ */

/* Returns room for one more fault; NULL if there is no memory, or if enough have been reported. */
static kt_fault *next_fault(kt_reader *r) {
    if (r->fault_count == KT_FAULT_COUNT_MAX) {
        r->fault_dropped++;
        return NULL;
    }
    kt_fault *faults = kt_reader_grow(r, &r->scratch, r->faults, r->fault_count, 1, &r->fault_room, sizeof *faults);
    if (faults == NULL)
        return NULL;
    r->faults = faults;
    return &faults[r->fault_count];
}

static void put_phrase(kt_reader *r, kt_status code, uint32_t line, uint32_t column, const kt_phrase *phrase) {
    kt_fault *fault = next_fault(r);
    if (fault == NULL)
        return;
    const char *message = kt_pool_text(&r->scratch, phrase->text, phrase->length);
    if (message == NULL) {
        kt_reader_out_of_memory(r);
        return;
    }
    *fault = (kt_fault){message, code, line, column, (uint32_t)r->fault_count};
    r->fault_count++;
}

bool kt_fault_put(kt_reader *r, kt_status code, uint32_t line, uint32_t column, const char *format, ...) {
    kt_phrase phrase = {.length = 0};
    va_list arguments;
    va_start(arguments, format);
    phrase_add_list(&phrase, format, arguments);
    va_end(arguments);
    put_phrase(r, code, line, column, &phrase);
    return false;
}

static int compare_faults(const void *a, const void *b) {
    const kt_fault *x = a, *y = b;
    if (x->line != y->line)
        return x->line < y->line ? -1 : 1;
    if (x->column != y->column)
        return x->column < y->column ? -1 : 1;
    return x->order < y->order ? -1 : 1;
}

/* The beginning of a long file name is cut, since its end identifies the file better. */
void kt_document_where(char where[KT_WHERE_SIZE], const char *path, uint32_t line, uint32_t column) {
    enum { PATH_MAX_SHOWN = KT_WHERE_SIZE - 32 };
    size_t length = strlen(path);
    const char *dots = "";
    if (length > PATH_MAX_SHOWN) {
        path += length - PATH_MAX_SHOWN;
        while (((unsigned char)*path & 0xC0U) == 0x80U) /* do not cut within a character */
            path++;
        dots = "...";
    }
    (void)snprintf(where, KT_WHERE_SIZE, "%s%s:%u:%u", dots, path, (unsigned)line, (unsigned)column);
}

static bool are_the_same(const kt_fault *a, const kt_fault *b) {
    return a->line == b->line && a->column == b->column && strcmp(a->message, b->message) == 0;
}

/* A fault that two checks have found is reported once. */
void kt_fault_sort(kt_reader *r) {
    size_t count = 0;
    if (r->fault_count > 1)
        qsort(r->faults, r->fault_count, sizeof *r->faults, compare_faults);
    for (size_t i = 0; i < r->fault_count; i++)
        if (count == 0 || !are_the_same(&r->faults[count - 1], &r->faults[i]))
            r->faults[count++] = r->faults[i];
    r->fault_count = count;
}

/* ---- messages ---------------------------------------------------------------------------------------------------- */

/* Adds the path from the innermost noun to this scope, and returns whether anything was added. */
static bool add_scope_path(kt_phrase *phrase, const kt_scope *scope) {
    if (scope == NULL || scope->noun != NULL)
        return false;
    bool inner = add_scope_path(phrase, scope->outer);
    if (scope->key == NULL)
        kt_phrase_add(phrase, "[%d]", scope->index);
    else
        kt_phrase_add(phrase, "%s%s", inner ? "." : "", scope->key);
    return true;
}

/* Begins a message with the innermost item that has a noun ("body 'arm': "), then the path of keys within it. */
static void add_scope(kt_phrase *phrase, const kt_scope *scope) {
    const kt_scope *item = scope;
    while (item != NULL && item->noun == NULL)
        item = item->outer;
    if (item != NULL && item->name != NULL)
        kt_phrase_add(phrase, "%s %s: ", item->noun, kt_name_quote(item->name).text);
    else if (item != NULL)
        kt_phrase_add(phrase, "%s[%d]: ", item->list, item->index);
    if (add_scope_path(phrase, scope))
        kt_phrase_add(phrase, ": ");
}

bool kt_fault_at(kt_reader *r, kt_status code, const kt_scope *scope, kt_node *node, const char *format, ...) {
    if (node->faulty)
        return false;
    kt_phrase phrase = {.length = 0};
    add_scope(&phrase, scope);
    va_list arguments;
    va_start(arguments, format);
    phrase_add_list(&phrase, format, arguments);
    va_end(arguments);
    put_phrase(r, code, node->line, node->column, &phrase);
    node->faulty = true;
    return false;
}

/* Describes a scalar in place of a number, and its remedy. */
static void describe_scalar(kt_phrase *phrase, const kt_node *node) {
    double value;
    const char *text = node->of.text;
    kt_name_text quoted = kt_name_quote(text);
    if (!node->plain) {
        bool number = kt_scalar_classify(text, &value) == KT_SCALAR_NUMBER;
        kt_phrase_add(phrase, "the text %s in quotes%s", quoted.text, number ? "; take the quotes away" : "");
        return;
    }
    switch (kt_scalar_classify(text, &value)) {
    case KT_SCALAR_NULL:
        kt_phrase_add(phrase, "nothing; give it a value, or remove it");
        return;
    case KT_SCALAR_HEX:
        kt_phrase_add(phrase, "%s; write it in decimal", quoted.text);
        return;
    case KT_SCALAR_OCTAL:
        kt_phrase_add(phrase, "%s; some readers take it as octal: write it without the leading zero", quoted.text);
        return;
    case KT_SCALAR_BOOL:
    case KT_SCALAR_NUMBER:
    case KT_SCALAR_ANGLE:
    case KT_SCALAR_NOT_FINITE:
    case KT_SCALAR_INF_WORD:
    case KT_SCALAR_TOO_LARGE:
    case KT_SCALAR_TEXT:
        kt_phrase_add(phrase, "%s", quoted.text);
        return;
    }
}

bool kt_fault_expected(kt_reader *r, const kt_scope *scope, kt_node *node, const char *expected) {
    kt_phrase found = {.length = 0};
    if (node->kind == KT_NODE_TEXT)
        describe_scalar(&found, node);
    else if (node->count == 0)
        kt_phrase_add(&found, "an empty %s", node->kind == KT_NODE_LIST ? "list" : "mapping");
    else if (node->kind == KT_NODE_LIST)
        kt_phrase_add(&found, "a list of %u", (unsigned)node->count);
    else
        kt_phrase_add(&found, "a mapping");
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected %s, found %s", expected, found.text);
}
