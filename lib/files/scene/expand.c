/* Nodes that the reader makes of others (expand.h): items as text, parsed and appended to a section of the file. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/expand.h"

#include <string.h>

void kt_nodes_settle(kt_node *node, const kt_node *place, const kt_replacement *words, int count) {
    node->line = place->line;
    node->column = place->column;
    if (node->kind != KT_NODE_TEXT) {
        for (kt_node *item = node->of.first; item != NULL; item = item->next)
            kt_nodes_settle(item, place, words, count);
        return;
    }
    for (int i = 0; i < count; i++) {
        if (strcmp(node->of.text, words[i].word) != 0)
            continue;
        if (words[i].node != NULL) {
            node->kind = words[i].node->kind;
            node->of = words[i].node->of;
            node->count = words[i].node->count;
            node->plain = words[i].node->plain;
        } else {
            node->of.text = words[i].text;
            node->count = (uint32_t)strlen(words[i].text);
        }
        return;
    }
}

/* The section of a kind, made if the file has none. */
static kt_node *section_of(kt_reader *r, const char *key, uint8_t kind, const kt_node *place) {
    kt_node *section = kt_node_find(r->root, key);
    if (section != NULL)
        return section->kind == kind ? section : NULL; /* any other kind is reported when the section is read */
    kt_node *made = kt_reader_take(r, &r->scratch, 2, sizeof *made);
    if (made == NULL)
        return NULL;
    made[0] = (kt_node){.of.text = key, .next = &made[1], .count = (uint32_t)strlen(key), .plain = true};
    made[1] = (kt_node){.kind = kind};
    made[0].line = made[1].line = place->line;
    made[0].column = made[1].column = place->column;
    made[1].next = r->root->of.first;
    r->root->of.first = &made[0];
    r->root->count++;
    return &made[1];
}

void kt_nodes_append(kt_reader *r, const char *key, kt_node *items, const kt_node *place) {
    const bool has_any = items != NULL && items->kind != KT_NODE_TEXT && items->count > 0;
    kt_node *section = has_any ? section_of(r, key, items->kind, place) : NULL;
    if (section == NULL)
        return;
    kt_node **last = &section->of.first;
    while (*last != NULL)
        last = &(*last)->next;
    *last = items->of.first;
    section->count += items->count;
}

kt_node *kt_nodes_parse(kt_reader *r, const char *text, size_t length) {
    kt_node *root = NULL;
    if (length == 0 || !kt_node_parse(r, text, length, &root))
        return NULL;
    return root;
}

bool kt_section_has(const kt_reader *r, const char *section, const char *key) {
    const kt_node *map = kt_node_find(r->root, section);
    return map != NULL && map->kind == KT_NODE_MAP && kt_node_find(map, key) != NULL;
}
