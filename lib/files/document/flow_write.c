/* Writes trees of nodes in flow style. Plain texts are quoted, unless they are words. Numbers, and words that a scene
 * does not read as text (true, null), stay plain. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/flow.h"

#include "document/number.h"

#include <string.h>

enum { LINES = 2 }; /* lists and mappings up to this depth have a line for each entry */

static bool is_flow_word(const char *text) {
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_", others[] = "0123456789-";
    const size_t first = strspn(text, letters);
    return first > 0 && text[first + strspn(text + first, others)] == '\0';
}

static void write_quoted(const char *text, FILE *stream) {
    fputc('"', stream);
    for (const char *c = text; *c != '\0'; c++)
        if (*c == '"' || *c == '\\')
            fprintf(stream, "\\%c", *c);
        else if ((unsigned char)*c < ' ')
            fprintf(stream, "\\x%02X", (unsigned)(unsigned char)*c);
        else
            fputc(*c, stream);
    fputc('"', stream);
}

/* A scalar is read back as the same kind: a text that looks like a number keeps its quotes. */
static void write_scalar(const kt_node *node, FILE *stream) {
    double value;
    const char *text = node->of.text;
    const kt_scalar kind = kt_scalar_classify(text, &value);
    const bool is_bare =
        node->plain ? kind != KT_SCALAR_TEXT || is_flow_word(text) : kind == KT_SCALAR_TEXT && is_flow_word(text);
    if (node->plain && *text == '\0')
        fputc('~', stream);
    else if (is_bare)
        fputs(text, stream);
    else
        write_quoted(text, stream);
}

/* Depth is bounded by KT_NODE_DEPTH_MAX. */
static void write_node(const kt_node *node, int depth, FILE *stream) {
    const bool is_map = node->kind == KT_NODE_MAP;
    if (node->kind == KT_NODE_TEXT) {
        write_scalar(node, stream);
        return;
    }
    fputc(is_map ? '{' : '[', stream);
    for (const kt_node *item = node->of.first; item != NULL; item = item->next) {
        if (depth < LINES)
            fprintf(stream, "\n%*s", 2 * (depth + 1), "");
        write_node(item, depth + 1, stream);
        if (is_map) {
            item = item->next;
            fputs(": ", stream);
            write_node(item, depth + 1, stream);
        }
        if (item->next != NULL)
            fputs(depth < LINES ? "," : ", ", stream);
    }
    fputc(is_map ? '}' : ']', stream);
}

void kt_flow_write(const kt_node *root, FILE *stream) {
    write_node(root, 0, stream);
    fputc('\n', stream);
}
