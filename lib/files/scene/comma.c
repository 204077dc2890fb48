/* Formulas that a comma has cut. In { } and [ ], the plain text =atan2(y, x) becomes "=atan2(y" and one more item, or a
 * key, "x)".
 *
 * Such parts are found from their parentheses, reported once, and hidden from everything else.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/expand.h"

/* Parentheses that a text opens less those that it closes; below zero at some place: it is no beginning. */
static int open_parentheses(const char *text) {
    int open = 0;
    for (; *text != '\0'; text++)
        open += (*text == '(') - (*text == ')');
    return open;
}

static bool is_plain_text(const kt_node *node) { return node->kind == KT_NODE_TEXT && node->plain; }

/* The rest of a formula begins behind `first`, in a mapping with a key: adds it to the phrase. Returns its last node;
 * NULL: the formula has no end here. */
static kt_node *find_rest(const kt_node *first, bool is_map, kt_phrase *whole) {
    int open = open_parentheses(first->of.text);
    kt_phrase_add(whole, "%s", first->of.text);
    for (kt_node *part = first->next; part != NULL; part = part->next) {
        kt_node *value = is_map ? part->next : NULL;
        if (!is_plain_text(part) || (is_map && (!is_plain_text(value) || value->of.text[0] != '\0')))
            return NULL;
        kt_phrase_add(whole, ", %s", part->of.text);
        open += open_parentheses(part->of.text);
        if (open <= 0)
            return open == 0 ? (is_map ? value : part) : NULL;
        part = is_map ? value : part;
    }
    return NULL;
}

/* Reports a formula that is cut at `first`, and returns its last node; `first` if there is none. */
static kt_node *check_value(kt_reader *r, const kt_scope *scope, kt_node *first, bool is_map) {
    kt_phrase whole = {.length = 0};
    if (!is_plain_text(first) || first->of.text[0] == '\0' || open_parentheses(first->of.text) <= 0)
        return first;
    kt_node *last = find_rest(first, is_map, &whole);
    if (last == NULL)
        return first;
    (void)kt_fault_at(r, KT_ERROR_SCENE, scope, first,
                      "in { } and [ ] a comma ends a text without quotes; put it in quotes: \"%s\"", whole.text);
    for (kt_node *node = first->next; node != last->next; node = node->next)
        node->faulty = true;
    return last;
}

/* Visits all values, and skips the items that are the rest of a cut formula. */
static void check_node(kt_reader *r, const kt_scope *outer, kt_node *node) {
    const bool is_map = node->kind == KT_NODE_MAP;
    bool is_cut = false;
    int i = 0;
    for (kt_node *item = node->kind == KT_NODE_TEXT ? NULL : node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope scope = {
            .outer = outer, .key = is_map && item->kind == KT_NODE_TEXT ? item->of.text : NULL, .index = i};
        kt_node *value = is_map ? item->next : item;
        check_node(r, &scope, value);
        item = check_value(r, &scope, value, is_map);
        is_cut = is_cut || item != value;
    }
    node->faulty = node->faulty || (is_cut && !is_map); /* a list has too many items then */
}

void kt_commas_check(kt_reader *r) { check_node(r, NULL, r->root); }
