/* Effects of the type `fmu`, as nodes of the file (fmu_node.h). */
#include "scene/expand.h"

#include <string.h>

static bool is_fmu(const kt_node *item) {
    const kt_node *type = item->kind == KT_NODE_MAP ? kt_node_find(item, "type") : NULL;
    return type != NULL && type->kind == KT_NODE_TEXT && strcmp(type->of.text, "fmu") == 0;
}

void kt_fmus_take(kt_reader *r) {
    kt_node *list = kt_node_find(r->root, "effects");
    if (list == NULL || list->kind != KT_NODE_LIST)
        return;
    r->scene->fmu_nodes = kt_reader_take(r, &r->scratch, (size_t)list->count + 1, sizeof *r->scene->fmu_nodes);
    if (r->scene->fmu_nodes == NULL)
        return;
    for (kt_node **at = &list->of.first; *at != NULL;) {
        kt_node *item = *at;
        if (!is_fmu(item)) {
            at = &item->next;
            continue;
        }
        *at = item->next;
        list->count--;
        r->scene->fmu_nodes[r->scene->fmu_count++] = item;
    }
}

kt_node *kt_fmu_first(const kt_node *item, const char *key) {
    const kt_node *map = kt_node_find(item, key);
    return map != NULL && map->kind == KT_NODE_MAP ? map->of.first : NULL;
}

bool kt_section_has(const kt_reader *r, const char *section, const char *key) {
    const kt_node *map = kt_node_find(r->root, section);
    return map != NULL && map->kind == KT_NODE_MAP && kt_node_find(map, key) != NULL;
}

bool kt_fmus_set(const kt_reader *r, const char *name) {
    for (int i = 0; i < r->scene->fmu_count; i++)
        for (const kt_node *key = kt_fmu_first(r->scene->fmu_nodes[i], "outputs"); key != NULL; key = key->next->next)
            if (key->next->kind == KT_NODE_TEXT && (name == NULL || strcmp(key->next->of.text, name) == 0) &&
                kt_section_has(r, "parameters", key->next->of.text))
                return true;
    return false;
}
