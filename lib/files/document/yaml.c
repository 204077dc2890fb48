/* YAML to nodes, from libyaml's events. Constructs that a scene does not use are rejected.
 *
 * Text is checked before libyaml sees it. UTF-8 and characters are checked for a line and a column in the message, and
 * because libyaml would guess UTF-16. Directives are checked because libyaml compares each directive with all earlier
 * ones. Aliases and anchors are rejected, so that time and memory of reading grow with the size of the file alone. Tags
 * are rejected, since a scene's own keys determine the type of each value.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/node_builder.h"

#include "document/document_text.h"

#include <string.h>
#include <yaml.h>

/* ---- YAML's own errors in plain words ----------------------------------------------------------------------------
 *
 * libyaml names the token that its grammar missed ("did not find expected key"), which is no help for the author of the
 * file. This table gives the usual meaning of each such text, a remedy, and a position. The position is that of the
 * offending token, or of the beginning of the unfinished construct. */

typedef enum kt_spot {
    SPOT_PROBLEM, /* where libyaml stopped */
    SPOT_CONTEXT, /* where the construct that it was reading begins */
    SPOT_BOTH     /* the first, with the line of the second (%u) in the message */
} kt_spot;

typedef struct kt_syntax {
    const char *problem; /* libyaml's text */
    const char *context; /* its context, or NULL: any */
    kt_spot spot;
    const char *message;
} kt_syntax;

static const kt_syntax syntax_table[] = {
    {"could not find expected ':'", NULL, SPOT_CONTEXT,
     "a key needs a ':' and a blank before its value ('key: value')"},
    {"mapping values are not allowed in this context", NULL, SPOT_PROBLEM,
     "a ':' is not allowed here; begin the key on its own line in the column of its neighbours, or put a text with a "
     "':' into quotes"},
    {"mapping keys are not allowed in this context", NULL, SPOT_PROBLEM,
     "a key cannot begin here; begin it on a line of its own"},
    {"block sequence entries are not allowed in this context", NULL, SPOT_PROBLEM,
     "a list cannot begin here; begin its first '- ' on a line of its own"},
    {"did not find expected key", NULL, SPOT_BOTH,
     "this does not fit the mapping that begins in line %u; its keys must all begin in one column"},
    {"did not find expected '-' indicator", NULL, SPOT_BOTH,
     "this does not fit the list that begins in line %u; its items must all begin with '- ' in one column"},
    {"did not find expected ',' or ']'", NULL, SPOT_BOTH,
     "a ',' or ']' is missing before this, in the list that begins in line %u"},
    {"did not find expected ',' or '}'", NULL, SPOT_BOTH,
     "a ',' or '}' is missing before this, in the mapping that begins in line %u"},
    {"did not find expected node content", NULL, SPOT_PROBLEM, "a value is missing before this"},
    {"found unexpected end of stream", "while scanning a quoted scalar", SPOT_CONTEXT,
     "the quote that opens here is never closed"},
    {"found unexpected document indicator", "while scanning a quoted scalar", SPOT_CONTEXT,
     "the quote that opens here is not closed before the document ends"},
    {"found a tab character that violates indentation", NULL, SPOT_PROBLEM, "a tab cannot indent; use blanks"},
    {"found a tab character where an indentation space is expected", NULL, SPOT_PROBLEM,
     "a tab cannot indent; use blanks"},
    {"found unknown escape character", NULL, SPOT_PROBLEM,
     "there is no such escape in double quotes; write two backslashes for one, or use single quotes"},
    {"did not find expected <document start>", NULL, SPOT_PROBLEM,
     "the scene has ended before this; all its keys must begin in one column"},
    {"found unexpected ':'", NULL, SPOT_PROBLEM, "a ':' needs a blank after it ('key: value')"},
    {"did not find expected alphabetic or numeric character", "while scanning an alias", SPOT_CONTEXT,
     "a value cannot begin with '*'; put the text in quotes"},
    {"did not find expected alphabetic or numeric character", "while scanning an anchor", SPOT_CONTEXT,
     "a value cannot begin with '&'; put the text in quotes"},
    {NULL, "while scanning a tag", SPOT_CONTEXT,
     "tags ('!...') are not part of a scene file; remove it, or put the text in quotes"},
    {NULL, "while parsing a node", SPOT_CONTEXT,
     "tags ('!...') are not part of a scene file; remove it, or put the text in quotes"},
};

static bool fits_pattern(const char *pattern, const char *text) {
    return pattern == NULL || (text != NULL && strcmp(pattern, text) == 0);
}

static uint32_t yaml_line_of(yaml_mark_t mark) { return (uint32_t)mark.line + 1; }
static uint32_t yaml_column_of(yaml_mark_t mark) { return (uint32_t)mark.column + 1; }

static bool fault_at_mark(kt_reader *r, yaml_mark_t mark, const char *message) {
    return kt_fault_put(r, KT_ERROR_SCENE, yaml_line_of(mark), yaml_column_of(mark), "%s", message);
}

/* Reports a character that cannot begin a token: a tab, or a character that YAML reserves (@ ` and, here, %). */
static void report_no_token(kt_reader *r, const yaml_parser_t *parser) {
    char character = (char)*parser->buffer.pointer;
    yaml_mark_t mark = parser->problem_mark;
    if (character == '\t')
        (void)fault_at_mark(r, mark, "a tab cannot indent; use blanks");
    else
        (void)kt_fault_put(r, KT_ERROR_SCENE, yaml_line_of(mark), yaml_column_of(mark),
                           "a value cannot begin with '%c'; put the text in quotes", character);
}

/* Reports "... in line %u ...", with the number in place of the %u. */
static void report_with_line(kt_reader *r, const kt_syntax *syntax, const yaml_parser_t *parser) {
    const char *hole = strstr(syntax->message, "%u");
    kt_phrase phrase = {.length = 0};
    kt_phrase_add(&phrase, "%.*s%u%s", (int)(hole - syntax->message), syntax->message,
                  (unsigned)parser->context_mark.line + 1, hole + 2);
    (void)fault_at_mark(r, parser->problem_mark, phrase.text);
}

static void report_syntax(kt_reader *r, const yaml_parser_t *parser) {
    if (fits_pattern("found character that cannot start any token", parser->problem)) {
        report_no_token(r, parser);
        return;
    }
    for (size_t i = 0; i < sizeof syntax_table / sizeof *syntax_table; i++) {
        const kt_syntax *syntax = &syntax_table[i];
        if (!fits_pattern(syntax->problem, parser->problem) || !fits_pattern(syntax->context, parser->context))
            continue;
        if (syntax->spot == SPOT_BOTH)
            report_with_line(r, syntax, parser);
        else
            (void)fault_at_mark(r, syntax->spot == SPOT_CONTEXT ? parser->context_mark : parser->problem_mark,
                                syntax->message);
        return;
    }
    (void)kt_fault_put(r, KT_ERROR_SCENE, yaml_line_of(parser->problem_mark), yaml_column_of(parser->problem_mark),
                       "this is not YAML: %s", parser->problem == NULL ? "unknown fault" : parser->problem);
}

/* ---- characters -------------------------------------------------------------------------------------------------- */

static bool report_character(kt_reader *r, uint32_t line, uint32_t column, size_t length, uint32_t character) {
    if (length == 0)
        return kt_fault_put(r, KT_ERROR_SCENE, line, column, "this is not UTF-8 text; save the file as UTF-8");
    if (character == 0)
        return kt_fault_put(r, KT_ERROR_SCENE, line, column, "there is a zero byte here; a scene is plain UTF-8 text");
    return kt_fault_put(r, KT_ERROR_SCENE, line, column,
                        "the character U+%04X is not allowed in a scene file; remove it", (unsigned)character);
}

static bool check_characters(kt_reader *r, const char *text, size_t size) {
    uint32_t line = 1, column = 1, character = 0;
    for (size_t i = 0; i < size;) {
        size_t length = kt_utf8_decode(text + i, size - i, &character);
        if (length == 0 || !kt_character_is_allowed(character))
            return report_character(r, line, column, length, character);
        if (character == '%' && column == 1)
            return kt_fault_put(r, KT_ERROR_SCENE, line, column,
                                "a line cannot begin with '%%': a scene file has no YAML directives; remove the line");
        i += length;
        column++;
        if (character == '\n') {
            line++;
            column = 1;
        }
    }
    return true;
}

/* ---- the tree ---------------------------------------------------------------------------------------------------- */

static kt_node *add_yaml_text(kt_node_builder *b, yaml_mark_t mark) {
    return kt_node_builder_add(b, KT_NODE_TEXT, yaml_line_of(mark), yaml_column_of(mark));
}

static bool add_scalar(kt_node_builder *b, const yaml_event_t *event) {
    kt_node *node = add_yaml_text(b, event->start_mark);
    if (node == NULL)
        return false;
    size_t length = event->data.scalar.length;
    if (!kt_node_builder_text(b, node, (const char *)event->data.scalar.value, length))
        return false;
    node->plain = event->data.scalar.style == YAML_PLAIN_SCALAR_STYLE;
    node->faulty = event->data.scalar.tag != NULL;
    /* "\0" within quotes */
    if (strlen(node->of.text) != length) {
        (void)fault_at_mark(b->r, event->start_mark, "there is a zero character in this text; remove it");
        node->faulty = true;
    }
    return true;
}

static bool add_alias(kt_node_builder *b, const yaml_event_t *event) {
    kt_node *node = add_yaml_text(b, event->start_mark);
    if (node == NULL)
        return false;
    node->of.text = "";
    node->faulty = true;
    (void)kt_fault_put(b->r, KT_ERROR_SCENE, node->line, node->column,
                       "aliases are not part of a scene file; write out the value of %s here",
                       kt_name_quote((const char *)event->data.alias.anchor).text);
    return true;
}

static void check_properties(kt_node_builder *b, yaml_mark_t mark, const yaml_char_t *anchor, const yaml_char_t *tag) {
    if (anchor != NULL)
        (void)kt_fault_put(b->r, KT_ERROR_SCENE, yaml_line_of(mark), yaml_column_of(mark),
                           "anchors are not part of a scene file; remove '&%.40s'", (const char *)anchor);
    if (tag != NULL)
        (void)fault_at_mark(b->r, mark, "tags ('!...') are not part of a scene file; remove this one");
}

/* Adds the node of an event to the tree; returns false to stop. */
static bool take_event(kt_node_builder *b, const yaml_event_t *event) {
    yaml_mark_t mark = event->start_mark;
    switch (event->type) {
    case YAML_DOCUMENT_START_EVENT:
        if (b->root != NULL)
            return fault_at_mark(b->r, mark, "a second document begins here; a file holds one scene");
        return true;
    case YAML_ALIAS_EVENT:
        return add_alias(b, event);
    case YAML_SCALAR_EVENT:
        check_properties(b, mark, event->data.scalar.anchor, event->data.scalar.tag);
        return add_scalar(b, event);
    case YAML_SEQUENCE_START_EVENT:
        check_properties(b, mark, event->data.sequence_start.anchor, event->data.sequence_start.tag);
        return kt_node_builder_open(b, KT_NODE_LIST, yaml_line_of(mark), yaml_column_of(mark));
    case YAML_MAPPING_START_EVENT:
        check_properties(b, mark, event->data.mapping_start.anchor, event->data.mapping_start.tag);
        return kt_node_builder_open(b, KT_NODE_MAP, yaml_line_of(mark), yaml_column_of(mark));
    case YAML_SEQUENCE_END_EVENT:
    case YAML_MAPPING_END_EVENT:
        kt_node_builder_close(b);
        return true;
    case YAML_NO_EVENT:
    case YAML_STREAM_START_EVENT:
    case YAML_STREAM_END_EVENT:
    case YAML_DOCUMENT_END_EVENT:
        return true;
    }
    return true;
}

static bool run_parser(kt_node_builder *b, yaml_parser_t *parser) {
    for (bool going = true; going;) {
        yaml_event_t event;
        if (!yaml_parser_parse(parser, &event)) {
            if (parser->error == YAML_MEMORY_ERROR)
                return kt_reader_out_of_memory(b->r);
            report_syntax(b->r, parser);
            return false;
        }
        bool taken = take_event(b, &event);
        going = event.type != YAML_STREAM_END_EVENT;
        yaml_event_delete(&event);
        if (!taken)
            return false;
    }
    return true;
}

bool kt_node_parse(kt_reader *r, const char *text, size_t size, kt_node **root) {
    static const char mark[] = "\xEF\xBB\xBF"; /* byte order mark */
    if (size >= sizeof mark - 1 && memcmp(text, mark, sizeof mark - 1) == 0) {
        text += sizeof mark - 1;
        size -= sizeof mark - 1;
    }
    if (!check_characters(r, text, size))
        return false;
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser))
        return kt_reader_out_of_memory(r);
    yaml_parser_set_encoding(&parser, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, size);
    kt_node_builder builder = {.r = r};
    bool built = run_parser(&builder, &parser);
    yaml_parser_delete(&parser);
    if (!built)
        return false;
    const kt_node *top = builder.root;
    if (top == NULL || (top->kind == KT_NODE_TEXT && top->plain && top->count == 0))
        return kt_fault_put(r, KT_ERROR_SCENE, 1, 1, "the file is empty; a scene begins with 'kinetree: 1'");
    *root = builder.root;
    return true;
}
