/* Actions of events, as nodes of the file (expand.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/expand.h"

void kt_actions_visit(const kt_reader *r, kt_action_visit *visit, void *user) {
    const kt_node *events = r->root->kind == KT_NODE_MAP ? kt_node_find(r->root, "events") : NULL;
    if (events == NULL || events->kind != KT_NODE_LIST)
        return;
    for (const kt_node *event = events->of.first; event != NULL; event = event->next) {
        const kt_node *then = event->kind == KT_NODE_MAP ? kt_node_find(event, "then") : NULL;
        if (then != NULL && then->kind == KT_NODE_MAP)
            visit(then, user);
        const bool is_list = then != NULL && then->kind == KT_NODE_LIST;
        for (const kt_node *one = is_list ? then->of.first : NULL; one != NULL; one = one->next)
            if (one->kind == KT_NODE_MAP)
                visit(one, user);
    }
}
