/* Trees of nodes: queries, and their construction from the events of a parser. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/node_builder.h"

#include <string.h>

/* ---- nodes ------------------------------------------------------------------------------------------------------- */

kt_node *kt_node_find(const kt_node *map, const char *key) {
    if (map->kind != KT_NODE_MAP)
        return NULL;
    for (const kt_node *k = map->of.first; k != NULL; k = k->next->next)
        if (k->kind == KT_NODE_TEXT && strcmp(k->of.text, key) == 0)
            return k->next;
    return NULL;
}

bool kt_node_has_stray(const kt_node *map) {
    for (const kt_node *key = map->kind == KT_NODE_MAP ? map->of.first : NULL; key != NULL; key = key->next->next)
        if (key->faulty)
            return true;
    return false;
}

/* The depth of the recursion is bounded by KT_NODE_DEPTH_MAX. */
bool kt_node_is_faulty(const kt_node *node) {
    if (node == NULL)
        return false;
    if (node->faulty)
        return true;
    if (node->kind != KT_NODE_TEXT)
        for (const kt_node *child = node->of.first; child != NULL; child = child->next)
            if (kt_node_is_faulty(child))
                return true;
    return false;
}

/* ---- the tree ---------------------------------------------------------------------------------------------------- */

kt_node *kt_node_builder_add(kt_node_builder *b, kt_node_kind kind, uint32_t line, uint32_t column) {
    if (b->count == KT_NODE_COUNT_MAX) {
        (void)kt_fault_put(b->r, KT_ERROR_SCENE, line, column,
                           "the file has more values than a scene may have (8388608)");
        return NULL;
    }
    kt_node *node = kt_reader_take(b->r, &b->r->scratch, 1, sizeof *node);
    if (node == NULL)
        return NULL;
    b->count++;
    node->kind = (uint8_t)kind;
    node->line = line;
    node->column = column;
    if (b->depth == 0) {
        b->root = node;
        return node;
    }
    int top = b->depth - 1;
    *b->tail[top] = node;
    b->tail[top] = &node->next;
    b->open[top]->count++;
    return node;
}

bool kt_node_builder_open(kt_node_builder *b, kt_node_kind kind, uint32_t line, uint32_t column) {
    if (b->depth == KT_NODE_DEPTH_MAX)
        return kt_fault_put(b->r, KT_ERROR_SCENE, line, column,
                            "lists and mappings are nested deeper than %d here; no scene needs that",
                            KT_NODE_DEPTH_MAX);
    kt_node *node = kt_node_builder_add(b, kind, line, column);
    if (node == NULL)
        return false;
    b->open[b->depth] = node;
    b->tail[b->depth] = &node->of.first;
    b->depth++;
    return true;
}

void kt_node_builder_close(kt_node_builder *b) {
    if (b->depth == 0) /* an end without a beginning: no parser gives any */
        return;
    b->depth--;
    kt_node *node = b->open[b->depth];
    if (node->kind == KT_NODE_MAP)
        node->count /= 2;
}

bool kt_node_builder_text(kt_node_builder *b, kt_node *node, const char *text, size_t length) {
    node->of.text = kt_pool_text(&b->r->scratch, text, length);
    node->count = (uint32_t)length;
    return node->of.text != NULL || kt_reader_out_of_memory(b->r);
}
