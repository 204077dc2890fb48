/* Flow style to nodes, in place of yaml.c, for programs without libyaml. The text is one that kt_flow_write wrote, the
 * value of a setting, or a list whose items begin with "- " on lines of their own.
 *
 *     value  = '{' [text ':' value {',' text ':' value}] '}' | '[' [value {',' value}] ']' | text
 *     text   = '"' characters with escapes '"' | "'" characters, '' for ' "'" | plain characters
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/node_builder.h"

#include <stdlib.h>
#include <string.h>

typedef struct kt_flow {
    kt_node_builder builder;
    const char *at, *end, *line_begin;
    uint32_t line;
} kt_flow;

static uint32_t flow_column(const kt_flow *f) { return (uint32_t)(f->at - f->line_begin) + 1; }

static bool report_flow(kt_flow *f, const char *message) {
    return kt_fault_put(f->builder.r, KT_ERROR_SCENE, f->line, flow_column(f), "%s", message);
}

static char flow_next(const kt_flow *f, size_t k) { return (size_t)(f->end - f->at) > k ? f->at[k] : '\0'; }

static bool is_flow_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/* Passes over blanks, ends of lines, and comments. */
static void skip_flow_blanks(kt_flow *f) {
    for (; f->at < f->end; f->at++) {
        if (*f->at == '#' && (f->at == f->line_begin || is_flow_blank(f->at[-1])))
            while (f->at + 1 < f->end && f->at[1] != '\n')
                f->at++;
        else if (!is_flow_blank(*f->at))
            return;
        if (*f->at == '\n') {
            f->line++;
            f->line_begin = f->at + 1;
        }
    }
}

/* ---- texts ------------------------------------------------------------------------------------------------------- */

/* Writes the character of an escape and returns the number of its bytes in the text; 0: there is no such escape. */
static size_t read_escape(const kt_flow *f, char *to) {
    static const char names[] = "\"\\/nt", values[] = "\"\\/\n\t";
    const char name = flow_next(f, 1), *known = name != '\0' ? strchr(names, name) : NULL;
    if (known != NULL) {
        *to = values[known - names];
        return 2;
    }
    const char digits[] = {flow_next(f, 2), flow_next(f, 3), '\0'};
    char *end;
    *to = (char)strtol(digits, &end, 16);
    return name == 'x' && *end == '\0' && digits[0] > ' ' && digits[1] > ' ' ? 4 : 0;
}

/* Copies a text in quotes to a place with room for it. Returns the length; SIZE_MAX after reporting a fault. */
static size_t read_quoted(kt_flow *f, char *to) {
    const char quote = *f->at++;
    size_t length = 0;
    while (f->at < f->end && (*f->at != quote || (quote == '\'' && flow_next(f, 1) == quote))) {
        size_t taken = *f->at == quote ? 2 : 1;
        to[length] = *f->at;
        if (quote == '"' && *f->at == '\\')
            taken = read_escape(f, &to[length]);
        if (taken == 0) {
            (void)report_flow(f, "there is no such escape in double quotes");
            return SIZE_MAX;
        }
        length++;
        f->at += taken;
    }
    if (f->at == f->end) {
        (void)report_flow(f, "a quote is never closed");
        return SIZE_MAX;
    }
    f->at++;
    return length;
}

/* Whether a plain text ends here. Outside of all brackets, only the end of the line ends a plain text. */
static bool ends_plain(const kt_flow *f) {
    const char c = *f->at, next = flow_next(f, 1);
    if (c == '\n' || c == '\r' || (is_flow_blank(c) && next == '#'))
        return true;
    if (f->builder.depth == 0)
        return false;
    return strchr(",[]{}", c) != NULL || (c == ':' && (is_flow_blank(next) || strchr(",[]{}", next) != NULL));
}

static bool read_flow_text(kt_flow *f) {
    const uint32_t line = f->line, column = flow_column(f);
    const char *begin = f->at;
    const bool is_plain = *begin != '"' && *begin != '\'';
    kt_node *node = kt_node_builder_add(&f->builder, KT_NODE_TEXT, line, column);
    if (node == NULL)
        return false;
    node->plain = is_plain;
    if (is_plain) {
        while (f->at < f->end && !ends_plain(f))
            f->at++;
        size_t length = (size_t)(f->at - begin);
        while (length > 0 && is_flow_blank(begin[length - 1]))
            length--;
        return kt_node_builder_text(&f->builder, node, begin, length);
    }
    char *text = kt_pool_take(&f->builder.r->scratch, (size_t)(f->end - f->at) + 1, 1);
    if (text == NULL)
        return kt_reader_out_of_memory(f->builder.r);
    const size_t length = read_quoted(f, text);
    if (length == SIZE_MAX)
        return false;
    text[length] = '\0';
    node->of.text = text;
    node->count = (uint32_t)length;
    return true;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static bool read_flow_value(kt_flow *f);

static bool read_key(kt_flow *f) {
    if (!read_flow_text(f))
        return false;
    skip_flow_blanks(f);
    if (flow_next(f, 0) != ':')
        return report_flow(f, "a key needs a ':' before its value");
    f->at++;
    return true;
}

/* Depth is bounded by KT_NODE_DEPTH_MAX. */
static bool read_entries(kt_flow *f, kt_node_kind kind) {
    const char close = kind == KT_NODE_MAP ? '}' : ']';
    if (!kt_node_builder_open(&f->builder, kind, f->line, flow_column(f)))
        return false;
    f->at++;
    for (skip_flow_blanks(f); flow_next(f, 0) != close; skip_flow_blanks(f)) {
        if (f->at == f->end)
            return report_flow(f, "a bracket is never closed");
        if ((kind == KT_NODE_MAP && !read_key(f)) || !read_flow_value(f))
            return false;
        skip_flow_blanks(f);
        if (flow_next(f, 0) == ',')
            f->at++;
        else if (flow_next(f, 0) != close)
            return report_flow(f, "a ',' or a bracket is missing before this");
    }
    f->at++;
    kt_node_builder_close(&f->builder);
    return true;
}

static bool read_flow_value(kt_flow *f) {
    skip_flow_blanks(f);
    const char c = flow_next(f, 0);
    return c == '{' ? read_entries(f, KT_NODE_MAP) : c == '[' ? read_entries(f, KT_NODE_LIST) : read_flow_text(f);
}

static bool begins_item(const kt_flow *f) { return flow_next(f, 0) == '-' && is_flow_blank(flow_next(f, 1)); }

/* Reads a list whose items begin with "- ". */
static bool read_items(kt_flow *f) {
    if (!kt_node_builder_open(&f->builder, KT_NODE_LIST, f->line, flow_column(f)))
        return false;
    for (; begins_item(f); skip_flow_blanks(f)) {
        f->at++;
        if (!read_flow_value(f))
            return false;
    }
    kt_node_builder_close(&f->builder);
    return true;
}

bool kt_node_parse(kt_reader *r, const char *text, size_t size, kt_node **root) {
    kt_flow flow = {.builder.r = r, .at = text, .end = text + size, .line_begin = text, .line = 1};
    skip_flow_blanks(&flow);
    if (flow.at == flow.end)
        return report_flow(&flow, "there is no value here");
    if (!(begins_item(&flow) ? read_items(&flow) : read_flow_value(&flow)))
        return false;
    skip_flow_blanks(&flow);
    if (flow.at != flow.end)
        return report_flow(&flow, "the value has ended before this");
    *root = flow.builder.root;
    return true;
}
