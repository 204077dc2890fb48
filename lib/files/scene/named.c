/* Formulas with names, which other formulas use:
 *
 *     expressions: {lean: "atan2(marker.bike.top.y, marker.bike.top.z)", push: "-k*lean"}
 *
 * A name is replaced with its formula in parentheses when a formula is read. An expression may therefore use all names
 * that the formula around it may use. Code behind the reader sees formulas without such names.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/named.h"
#include "base/text.h"

#include "scene/vary.h"

#include <string.h>

struct kt_named_formula {
    const char *name;
    kt_node *key, *node;
    bool is_used;
    int from; /* while it is written out: the one that uses it, -1: the formula itself; else IDLE */
};

enum { IDLE = -2 };

/* ---- the section ------------------------------------------------------------------------------------------------- */

bool kt_is_reserved(const char *name) {
#define FUNCTION_NAME(id, function, least, most) #function,
    static const char *const words[] = {"t", "pi", "deg", "rad", KT_EXPRESSION_FUNCTION_LIST(FUNCTION_NAME)};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        if (strcmp(name, words[k]) == 0)
            return true;
    return false;
}

/* Letters, digits and _ from a letter or _ on. */
static bool is_expression_name(const char *name) {
    bool good = kt_is_letter(*name);
    for (; *name != '\0'; name++)
        good = good && (kt_is_letter(*name) || kt_is_digit(*name));
    return good;
}

static int find_named(const kt_reader *r, const char *name, size_t length) {
    for (int k = 0; k < r->scene->named_count; k++)
        if (strncmp(r->scene->named[k].name, name, length) == 0 && r->scene->named[k].name[length] == '\0')
            return k;
    return -1;
}

bool kt_is_named(const kt_reader *r, const char *name) { return find_named(r, name, strlen(name)) >= 0; }

const char *kt_expression_name(const kt_reader *r, int k) {
    return k < r->scene->named_count ? r->scene->named[k].name : NULL;
}

kt_node *kt_expression_unused(const kt_reader *r, int k) {
    for (int i = 0; i < r->scene->named_count; i++)
        if (!r->scene->named[i].is_used && k-- == 0)
            return r->scene->named[i].key;
    return NULL;
}

static void list_one(kt_reader *r, const kt_scope *scope, kt_node *key) {
    if (key->kind != KT_NODE_TEXT || !is_expression_name(key->of.text)) {
        (void)kt_fault_expected(r, scope, key,
                                "the name of an expression: letters, digits and _, the first one no digit");
        return;
    }
    if (kt_is_reserved(key->of.text) || strcmp(key->of.text, "length") == 0 || strcmp(key->of.text, "speed") == 0)
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                          "'%.40s' has a meaning of its own in formulas; take another name", key->of.text);
    const int before = find_named(r, key->of.text, key->count);
    if (before >= 0)
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                          "the expression '%.40s' is there already, in line %u; remove one of them", key->of.text,
                          (unsigned)r->scene->named[before].key->line);
    if (key->next->kind != KT_NODE_TEXT || key->next->count == 0) {
        const kt_scope here = {.outer = scope, .key = key->of.text};
        (void)kt_fault_expected(r, &here, key->next, "a formula (\"2*position.arm\")");
    }
    r->scene->named[r->scene->named_count++] =
        (kt_named_formula){.name = key->of.text, .key = key, .node = key->next, .from = IDLE};
}

/* Names are compared with each other. */
enum { EXPRESSION_COUNT_MAX = 1000 };

void kt_expressions_list(kt_reader *r) {
    const kt_scope scope = {.key = "expressions"};
    kt_node *map = kt_node_find(r->root, "expressions");
    if (map == NULL)
        return;
    if (map->kind != KT_NODE_MAP)
        (void)kt_fault_expected(r, &scope, map, "a mapping of names to formulas (lift: \"2*velocity.wing^2\")");
    else if (map->count > EXPRESSION_COUNT_MAX)
        (void)kt_fault_at(r, KT_ERROR_SCENE, &scope, map, "there are %u expressions; a scene has at most %d",
                          (unsigned)map->count, (int)EXPRESSION_COUNT_MAX);
    else if ((r->scene->named = kt_reader_take(r, &r->scratch, (size_t)map->count + 1, sizeof *r->scene->named)) !=
             NULL)
        for (kt_node *key = map->of.first; key != NULL; key = key->next->next)
            list_one(r, &scope, key);
}

kt_node kt_spot_of(const kt_node *node, int at) {
    kt_node spot = *node;
    const char *text = node->of.text;
    if (strchr(text, '\n') != NULL)
        return spot;
    spot.column += node->plain ? 0 : 1;
    for (int i = 0; i < at && text[i] != '\0'; i++)
        spot.column += ((unsigned char)text[i] & 0xC0U) != 0x80U;
    return spot;
}

/* ---- words of a formula ------------------------------------------------------------------------------------------ */

/* The end of a name, as the formula's own reader finds it: dots and [k] within. */
static const char *end_of_name(const char *at) {
    while (kt_is_letter(*at) || kt_is_digit(*at) || (*at == '.' && (kt_is_letter(at[1]) || kt_is_digit(at[1])))) {
        at++;
        if (*at == '[' && kt_is_digit(at[1])) {
            const char *end = at + 1 + strspn(at + 1, "0123456789");
            at = *end == ']' ? end + 1 : at;
        }
    }
    return at;
}

/* The end of the longest name of a variable that goes on with hyphens. */
static const char *end_with_hyphens(const char *from, const char *end, const kt_symbols *variables) {
    char name[KT_EXPRESSION_NAME_MAX + 1];
    kt_symbol symbol;
    for (const char *next = end; *next == '-' && end_of_name(next + 1) > next + 1;) {
        next = end_of_name(next + 1);
        if (next - from > KT_EXPRESSION_NAME_MAX)
            break;
        memcpy(name, from, (size_t)(next - from));
        name[next - from] = '\0';
        if (variables->find(variables->user, name, &symbol))
            end = next;
    }
    return end;
}

/* The end of the number at a place: 1e-3 has no name in it. */
static const char *end_of_number(const char *at) {
    while (kt_is_digit(*at) || *at == '.')
        at++;
    const char *exponent = at + 1 + (*at != '\0' && (at[1] == '+' || at[1] == '-'));
    if ((*at == 'e' || *at == 'E') && kt_is_digit(*exponent))
        for (at = exponent; kt_is_digit(*at);)
            at++;
    return at;
}

/* The next word from a place on, and its end; NULL: there is none. */
static const char *next_formula_word(const char *at, const kt_symbols *variables, const char **end) {
    while (*at != '\0' && !kt_is_letter(*at))
        at = kt_is_digit(*at) || *at == '.' ? end_of_number(at) : at + 1;
    if (*at == '\0')
        return NULL;
    *end = end_of_name(at);
    if (variables != NULL)
        *end = end_with_hyphens(at, *end, variables);
    return at;
}

int kt_find_named(const kt_reader *r, const char *text) {
    const char *end;
    for (const char *at = text; r->scene->named_count > 0 && (at = next_formula_word(at, NULL, &end)) != NULL; at = end)
        if (find_named(r, at, (size_t)(end - at)) >= 0)
            return (int)(at - text);
    return -1;
}

/* ---- writing out ------------------------------------------------------------------------------------------------- */

typedef struct kt_writer {
    kt_reader *r;
    const kt_scope *scope;
    const kt_symbols *variables;
    kt_written *to;
    char *text;
    int length;
} kt_writer;

static bool put_formula_text(kt_writer *w, const char *text, size_t length) {
    if (length > (size_t)(KT_EXPRESSION_LENGTH_MAX - w->length))
        return kt_fault_at(
            w->r, KT_ERROR_SCENE, w->scope, w->to->node,
            "with its expressions written out the formula has more than %d characters; make an auxiliary state "
            "or a shorter formula of a part of it",
            KT_EXPRESSION_LENGTH_MAX);
    memcpy(w->text + w->length, text, length);
    w->length += (int)length;
    w->text[w->length] = '\0';
    return true;
}

static void begin_stretch(kt_writer *w, kt_node *node, int named, int offset) {
    w->to->stretches[w->to->count++] = (kt_stretch){.at = w->length, .offset = offset, .node = node, .named = named};
}

/* "a -> b -> a" */
static bool report_name_circle(kt_writer *w, int k, int user) {
    kt_reader *r = w->r;
    const kt_scope outer = {.key = "expressions"}, here = {.outer = &outer, .key = r->scene->named[k].name};
    kt_phrase phrase = {.length = 0};
    const char *names[8];
    int count = 0;
    for (int i = user; i != k && count < 7; i = r->scene->named[i].from)
        names[count++] = r->scene->named[i].name;
    kt_phrase_add(&phrase, "%s", r->scene->named[k].name);
    while (count > 0)
        kt_phrase_add(&phrase, " -> %s", names[--count]);
    return kt_fault_at(r, KT_ERROR_SCENE, &here, r->scene->named[k].node,
                       "the expression depends on itself: %s -> %s; write one of them without the next", phrase.text,
                       r->scene->named[k].name);
}

static bool write_out(kt_writer *w, kt_node *node, int named);

/* from: who uses the formula that is being written out. An expression that is met again meanwhile contains itself. */
static bool write_named_formula(kt_writer *w, int k, int user) {
    kt_named_formula *named = &w->r->scene->named[k];
    named->is_used = true;
    if (named->from != IDLE)
        return report_name_circle(w, k, user);
    if (kt_node_is_faulty(named->node))
        return false; /* that has been reported */
    named->from = user;
    const bool good = put_formula_text(w, "(", 1) && write_out(w, named->node, k) && put_formula_text(w, ")", 1);
    named->from = IDLE;
    return good;
}

/* The text of a node, which may begin with '='; recursion ends at circles. */
static bool write_out(kt_writer *w, kt_node *node, int named) {
    const char *const text = node->of.text, *from = text + (named >= 0 && text[0] == '='), *end;
    begin_stretch(w, node, named, (int)(from - text));
    for (const char *at = from; (at = next_formula_word(at, w->variables, &end)) != NULL; at = end) {
        const int k = find_named(w->r, at, (size_t)(end - at));
        if (k < 0)
            continue;
        if (!put_formula_text(w, from, (size_t)(at - from)) || !write_named_formula(w, k, named))
            return false;
        from = end;
        begin_stretch(w, node, named, (int)(from - text));
    }
    return put_formula_text(w, from, strlen(from));
}

bool kt_write_out(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *variables, kt_written *out) {
    *out = (kt_written){.text = node->of.text, .node = node};
    if (kt_find_named(r, node->of.text) < 0)
        return true;
    kt_writer w = {.r = r, .scope = scope, .variables = variables, .to = out};
    /* each word that is written out adds one parenthesis at least, and two stretches */
    out->stretches = kt_pool_take(&r->scratch, 2 * (size_t)KT_EXPRESSION_LENGTH_MAX + 4, sizeof *out->stretches);
    w.text = kt_pool_take(&r->scratch, (size_t)KT_EXPRESSION_LENGTH_MAX + 1, 1);
    if (out->stretches == NULL || w.text == NULL)
        return kt_reader_out_of_memory(r);
    out->text = w.text;
    if (write_out(&w, node, -1))
        return true;
    node->faulty = true;
    return false;
}

bool kt_written_varies(const kt_reader *r, const kt_written *written) {
    bool varies = false;
    for (int k = 0; k < written->count; k++)
        varies = varies || kt_is_varied(r, written->stretches[k].node);
    return varies;
}

bool kt_written_fault(kt_reader *r, const kt_scope *scope, const kt_written *written, int at, const char *message) {
    const kt_stretch *s = NULL;
    for (int k = 0; k < written->count && written->stretches[k].at <= at; k++)
        s = &written->stretches[k];
    kt_node spot = kt_spot_of(s != NULL ? s->node : written->node, s != NULL ? at - s->at + s->offset : at);
    const kt_scope outer = {.key = "expressions"};
    if (s == NULL || s->named < 0) {
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, &spot, "%s", message);
    } else if (!kt_node_is_faulty(s->node)) {
        const kt_scope here = {.outer = &outer, .key = r->scene->named[s->named].name};
        (void)kt_fault_at(r, KT_ERROR_SCENE, &here, &spot, "%s (in the formula of line %u, which uses it)", message,
                          (unsigned)written->node->line);
        s->node->faulty = true;
    }
    written->node->faulty = true;
    return false;
}
