/* Lists of items: each is an array of an object, whose items a function reads and another one writes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_part.h"

#include <string.h>

bool kt_list_nodes(kt_reader *r, const kt_scope *scope, kt_node *list, const char *expected, kt_node ***nodes,
                   int *count) {
    if (list->kind != KT_NODE_LIST)
        return kt_fault_expected(r, scope, list, expected);
    *nodes = kt_pool_take(&r->scratch, list->count, sizeof **nodes);
    if (*nodes == NULL)
        return kt_reader_out_of_memory(r);
    *count = 0;
    for (kt_node *item = list->of.first; item != NULL; item = item->next)
        (*nodes)[(*count)++] = item;
    return true;
}

/* Faults of items are reported by their own `read`; the result is about the list alone. */
bool kt_items_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_items *list = kt_detail_of(field);
    kt_item_read item = {.object = object};
    if (node->count < list->least)
        return kt_fault_expected(r, scope, node, list->expected);
    if (!kt_list_nodes(r, scope, node, list->expected, &item.nodes, &item.count))
        return false;
    if (list->most > 0 && item.count > list->most)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "there are %d %s; a scene has at most %d", item.count,
                           list->section, list->most);
    item.items = kt_pool_take(&r->keep, (size_t)item.count, list->size);
    if (item.items == NULL)
        return kt_reader_out_of_memory(r);
    if (list->nodes > 0)
        memcpy((char *)r->scene + list->nodes, &item.nodes, sizeof item.nodes);
    for (; item.index < item.count; item.index++) {
        kt_node *one = item.nodes[item.index];
        const kt_scope here = list->noun != NULL ? kt_item_scope(list->noun, list->section, item.index, one)
                                                 : (kt_scope){.outer = scope, .index = item.index};
        list->read(r, &here, &item);
    }
    memcpy((char *)object + list->array, &item.items, sizeof item.items);
    memcpy((char *)object + list->count, &item.count, sizeof item.count);
    return list->finish == NULL || list->finish(r, &item);
}

static int item_count_of(const kt_items *list, const void *object) {
    int count;
    memcpy(&count, (const char *)object + list->count, sizeof count);
    return count;
}

void kt_items_write(kt_emitter *e, const kt_member *m) {
    const kt_items *list = kt_detail_of(m->field);
    const int count = item_count_of(list, m->object);
    const char *items;
    memcpy(&items, (const char *)m->object + list->array, sizeof items);
    kt_emit_list(e, list->flow ? KT_EMIT_FLOW : KT_EMIT_BLOCK);
    for (int i = 0; i < count; i++)
        list->write(e, items + (size_t)i * list->size, i);
    kt_emit_end(e);
}

bool kt_items_same(const kt_member *m) { return item_count_of(kt_detail_of(m->field), m->object) == 0; }

const kt_kind kt_kind_items = {.read = kt_items_read, .write = kt_items_write, .same = kt_items_same};
