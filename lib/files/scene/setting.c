/* Settings: values from outside a file, "bodies.crank.mass=2", put in the place of its own before it is read.
 *
 * A path leads from the top of the file through mappings by their keys, and through lists of mappings by the names of
 * their items. The path leads through any list by [k], k from 0. A path of one word is a parameter. A key that is
 * missing is added, so that the tables of keys decide whether there is such a key, as for the file.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_parameter.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_setting {
    kt_reader *r;
    const char *text; /* PATH=VALUE */
    int index;        /* among the settings, behind which the variables come */
    int variables_at; /* the index of the first variable */
    const kt_table *top;
} kt_setting;

static bool reject_setting(const kt_setting *s, size_t at, const char *format, ...) KT_PRINTF(3, 4);

static bool reject_setting(const kt_setting *s, size_t at, const char *format, ...) {
    char text[KT_MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return kt_fault_put(s->r, KT_ERROR_SCENE, kt_setting_line(s->index), (uint32_t)at + 1, "%s", text);
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* Depth is bounded by KT_NODE_DEPTH_MAX. */
static void relocate(kt_node *node, uint32_t line, uint32_t columns) {
    node->line = line;
    node->column += columns;
    if (node->kind != KT_NODE_TEXT)
        for (kt_node *child = node->of.first; child != NULL; child = child->next)
            relocate(child, line, columns);
}

/* Reads the value as YAML; its faults are located in the setting. */
static kt_node *read_setting_value(const kt_setting *s, size_t at) {
    const size_t before = s->r->fault_count;
    kt_node *value = NULL;
    if (s->text[at + strspn(s->text + at, " \t")] == '\0') {
        (void)reject_setting(s, at, "a value is missing after '='");
        return NULL;
    }
    if (!kt_node_parse(s->r, s->text + at, strlen(s->text + at), &value))
        value = NULL;
    for (size_t i = before; i < s->r->fault_count; i++) {
        s->r->faults[i].line = kt_setting_line(s->index);
        s->r->faults[i].column += (uint32_t)at;
    }
    if (value != NULL)
        relocate(value, kt_setting_line(s->index), (uint32_t)at);
    return value;
}

static kt_node *new_setting_node(const kt_setting *s, size_t at, const kt_node *like) {
    kt_node *node = kt_reader_take(s->r, &s->r->scratch, 1, sizeof *node);
    if (node == NULL)
        return NULL;
    *node = *like;
    node->line = kt_setting_line(s->index);
    node->column = (uint32_t)at + 1;
    return node;
}

/* ---- paths ------------------------------------------------------------------------------------------------------- */

/* The value of a key, which is added with an empty mapping as its value if it is missing. */
static kt_node *enter_map(const kt_setting *s, kt_node *map, const char *word, size_t at) {
    kt_node *value = kt_node_find(map, word);
    if (value != NULL)
        return value;
    const kt_node key_like = {.kind = KT_NODE_TEXT, .of.text = word, .count = (uint32_t)strlen(word), .plain = true};
    const kt_node map_like = {.kind = KT_NODE_MAP};
    kt_node *key = new_setting_node(s, at, &key_like);
    value = new_setting_node(s, at, &map_like);
    if (key == NULL || value == NULL)
        return NULL;
    kt_node **end = &map->of.first;
    while (*end != NULL)
        end = &(*end)->next;
    *end = key;
    key->next = value;
    map->count++;
    return value;
}

/* The item of a list that has this name. */
static kt_node *enter_named(const kt_setting *s, kt_node *list, const char *word, size_t at) {
    kt_nearest nearest = kt_nearest_make(word, &s->r->effort);
    for (kt_node *item = list->of.first; item != NULL; item = item->next) {
        const kt_node *name = kt_node_find(item, "name");
        if (name == NULL || name->kind != KT_NODE_TEXT)
            continue;
        if (strcmp(name->of.text, word) == 0)
            return item;
        (void)kt_nearest_try(&nearest, name->of.text);
    }
    (void)reject_setting(s, at, "no item of this list has the name %s%s%s%s", kt_name_quote(word).text,
                         nearest.best != NULL ? "; did you mean '" : "; name one, or count from [0]",
                         nearest.best != NULL ? nearest.best : "", nearest.best != NULL ? "'?" : "");
    return NULL;
}

static kt_node *enter_index(const kt_setting *s, kt_node *list, const char *digits, size_t at) {
    const unsigned long index = strlen(digits) < 9 ? strtoul(digits, NULL, 10) : 999999999UL;
    if (list->kind != KT_NODE_LIST || index >= list->count) {
        if (list->kind != KT_NODE_LIST)
            (void)reject_setting(s, at, "this is no list");
        else if (list->count == 1)
            (void)reject_setting(s, at, "the list has one item, [0]");
        else
            (void)reject_setting(s, at, "the list has %u items; count from [0]", (unsigned)list->count);
        return NULL;
    }
    kt_node *item = list->of.first;
    for (unsigned long i = 0; i < index; i++)
        item = item->next;
    return item;
}

static kt_node *enter_value(const kt_setting *s, kt_node *node, const char *word, size_t at, bool is_index) {
    if (is_index)
        return enter_index(s, node, word, at);
    if (node->kind == KT_NODE_MAP)
        return enter_map(s, node, word, at);
    if (node->kind == KT_NODE_LIST)
        return enter_named(s, node, word, at);
    (void)reject_setting(s, at, "the file has a single value here, without a %s; end the path before it",
                         kt_name_quote(word).text);
    return NULL;
}

/* The next word of a path, as a copy; moves *at behind the word. NULL after reporting a fault. */
static const char *next_path_word(const kt_setting *s, size_t *at, bool *is_index) {
    const char *from = s->text + *at;
    *is_index = *from == '[';
    const size_t length = *is_index ? strspn(from + 1, "0123456789") : strcspn(from, ".[=");
    if (length == 0 || (*is_index && from[1 + length] != ']')) {
        (void)reject_setting(s, *at, *is_index ? "write [k], k from 0" : "a word of the path is missing here");
        return NULL;
    }
    const char *word = kt_reader_text(s->r, &s->r->scratch, from + *is_index, length);
    *at += *is_index ? length + 2 : length;
    return word;
}

static bool is_key_of(const kt_table *table, const char *word) {
    for (int i = 0; i < table->count; i++)
        if (strcmp(table->fields[i].key, word) == 0)
            return true;
    return false;
}

/* A path of one word is a parameter, or else a key at the top of a scene. */
static kt_node *enter_parameter(const kt_setting *s, const char *word) {
    kt_node *parameters = kt_node_find(s->r->root, "parameters");
    kt_node *value = parameters != NULL ? kt_node_find(parameters, word) : NULL;
    if (value == NULL)
        value = kt_node_find(s->r->root, word);
    if (value == NULL && is_key_of(s->top, word))
        value = enter_map(s, s->r->root, word, 0);
    if (value != NULL || s->r->out_of_memory)
        return value;
    kt_nearest nearest = kt_nearest_make(word, &s->r->effort);
    if (parameters != NULL && parameters->kind == KT_NODE_MAP)
        for (const kt_node *key = parameters->of.first; key != NULL; key = key->next->next)
            (void)kt_nearest_try(&nearest, key->kind == KT_NODE_TEXT ? key->of.text : NULL);
    (void)reject_setting(s, 0, "the scene has no parameter %s%s%s%s", kt_name_quote(word).text,
                         nearest.best != NULL ? "; did you mean '"
                                              : "; other values have a path, such as bodies.crank.mass",
                         nearest.best != NULL ? nearest.best : "", nearest.best != NULL ? "'?" : "");
    return NULL;
}

static kt_node *follow_setting(const kt_setting *s, size_t *at) {
    kt_node *node = s->r->root;
    for (bool first = true; first || s->text[*at] != '='; first = false) {
        bool is_index;
        if (!first && s->text[*at] == '.')
            ++*at;
        const size_t begin = *at;
        const char *word = next_path_word(s, at, &is_index);
        if (word == NULL)
            return NULL;
        node = first && s->text[*at] == '=' ? enter_parameter(s, word) : enter_value(s, node, word, begin, is_index);
        if (node == NULL)
            return NULL;
    }
    return node;
}

/* Two variables cannot have the same number: a path with an index is another text than one with a name. */
static bool is_of_other_variable(const kt_setting *s, const kt_node *node) {
    const uint32_t first = KT_SETTING_LINE + (uint32_t)s->variables_at;
    if (s->index < s->variables_at || node->line < first || node->line == kt_setting_line(s->index))
        return false;
    const char *other = s->r->scene->settings[node->line - KT_SETTING_LINE];
    return !reject_setting(s, 0, "'%.*s' is the same value, and varies already; remove one", (int)strcspn(other, "="),
                           other);
}

static void apply_setting(const kt_setting *s) {
    size_t at = 0;
    if (strchr(s->text, '=') == NULL) {
        (void)reject_setting(s, 0, "a setting is PATH=VALUE, such as L=1.5 or bodies.crank.mass=2");
        return;
    }
    kt_node *node = follow_setting(s, &at);
    if (node == NULL || is_of_other_variable(s, node))
        return;
    kt_node *value = read_setting_value(s, at + 1);
    if (value == NULL)
        return;
    kt_node *next = node->next; /* the node keeps its place among its neighbours */
    *node = *value;
    node->next = next;
}

void kt_reader_where(const kt_reader *r, const char *path, uint32_t line, uint32_t column, char where[KT_WHERE_SIZE]) {
    if (line < KT_SETTING_LINE)
        kt_document_where(where, path, line, column);
    else
        (void)snprintf(where, KT_WHERE_SIZE, "%s", r->scene->settings[line - KT_SETTING_LINE]);
}

/* The settings, and those of variables. */
static const char *const *list_settings(kt_reader *r, const kt_scene_options *options) {
    const int count = options->setting_count + options->variable_count;
    const char **texts = kt_reader_take(r, &r->scratch, (size_t)count, sizeof *texts);
    for (int k = 0; texts != NULL && k < count; k++) {
        const int variable = k - options->setting_count;
        const size_t room = variable < 0 ? 0 : strlen(options->variables[variable]) + 32;
        char *own = variable < 0 ? NULL : kt_reader_take(r, &r->scratch, room, 1);
        if (own != NULL)
            (void)snprintf(own, room, "%s=%.17g", options->variables[variable], options->values[variable]);
        texts[k] = variable < 0 ? options->settings[k] : own;
    }
    return texts;
}

void kt_settings_apply(kt_reader *r, const kt_scene_options *options, const kt_table *top) {
    const int count = options != NULL ? options->setting_count + options->variable_count : 0;
    r->scene->settings = count > 0 ? list_settings(r, options) : NULL;
    for (int k = 0; k < count && !r->out_of_memory; k++) {
        const kt_setting setting = {
            .r = r, .text = r->scene->settings[k], .index = k, .variables_at = options->setting_count, .top = top};
        apply_setting(&setting);
    }
}
