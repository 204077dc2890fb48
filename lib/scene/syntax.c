/* YAML's own errors in plain words.
 *
 * libyaml names what its grammar missed ("did not find expected key"), which says little to who wrote the file. Here
 * each such text has what it mostly means and how to mend it, at the place where the eye should go: the offending
 * token, or the beginning of what was left open.
 */
#include "scene/syntax.h"

#include <string.h>

typedef enum kt_spot {
    SPOT_PROBLEM, /* where libyaml stopped */
    SPOT_CONTEXT, /* where that which it was reading begins */
    SPOT_BOTH     /* the first, with the line of the second (%u) in the message */
} kt_spot;

typedef struct kt_syntax {
    const char *problem; /* libyaml's text */
    const char *context; /* its context, or NULL: any */
    kt_spot spot;
    const char *message;
} kt_syntax;

static const kt_syntax table[] = {
    {"could not find expected ':'", NULL, SPOT_CONTEXT,
     "a key needs a ':' and a blank before its value ('key: value')"},
    {"mapping values are not allowed in this context", NULL, SPOT_PROBLEM,
     "a ':' cannot stand here; begin the key on a line of its own in the column of its neighbours, or put a text with "
     "a "
     "':' in it into quotes"},
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

static bool fits(const char *pattern, const char *text) {
    return pattern == NULL || (text != NULL && strcmp(pattern, text) == 0);
}

static bool report_at(kt_reader *r, yaml_mark_t mark, const char *message) {
    return kt_fault_put(r, KT_ERROR_SCENE, (uint32_t)mark.line + 1, (uint32_t)mark.column + 1, "%s", message);
}

/* A character that begins nothing: a tab, or one that YAML keeps for itself (@ ` and, here, %). */
static void report_character(kt_reader *r, const yaml_parser_t *parser) {
    char character = (char)*parser->buffer.pointer;
    yaml_mark_t mark = parser->problem_mark;
    if (character == '\t')
        (void)report_at(r, mark, "a tab cannot indent; use blanks");
    else
        (void)kt_fault_put(r, KT_ERROR_SCENE, (uint32_t)mark.line + 1, (uint32_t)mark.column + 1,
                           "a value cannot begin with '%c'; put the text in quotes", character);
}

/* "... in line %u ...", with the number in place of the %u. */
static void report_with_line(kt_reader *r, const kt_syntax *syntax, const yaml_parser_t *parser) {
    const char *hole = strstr(syntax->message, "%u");
    kt_phrase phrase = {.length = 0};
    kt_phrase_add(&phrase, "%.*s%u%s", (int)(hole - syntax->message), syntax->message,
                  (unsigned)parser->context_mark.line + 1, hole + 2);
    (void)report_at(r, parser->problem_mark, phrase.text);
}

void kt_syntax_report(kt_reader *r, const yaml_parser_t *parser) {
    if (fits("found character that cannot start any token", parser->problem)) {
        report_character(r, parser);
        return;
    }
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_syntax *syntax = &table[i];
        if (!fits(syntax->problem, parser->problem) || !fits(syntax->context, parser->context))
            continue;
        if (syntax->spot == SPOT_BOTH)
            report_with_line(r, syntax, parser);
        else
            (void)report_at(r, syntax->spot == SPOT_CONTEXT ? parser->context_mark : parser->problem_mark,
                            syntax->message);
        return;
    }
    (void)kt_fault_put(r, KT_ERROR_SCENE, (uint32_t)parser->problem_mark.line + 1,
                       (uint32_t)parser->problem_mark.column + 1, "this is not YAML: %s",
                       parser->problem == NULL ? "unknown fault" : parser->problem);
}
